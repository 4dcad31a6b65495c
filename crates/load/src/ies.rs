//! Photometric files of luminaires: IESNA LM-63 (1986, 1991, 1995, 2002), type C.
//!
//! A luminous intensity for each pair of angles: the vertical one from straight below (0) to straight above (180 degrees), the
//! horizontal one around that axis. Fewer horizontal angles stand for all by symmetry.

use steradian_math::{Vec3, acos, atan2};

/// The intensities of a luminaire.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct IesProfile {
    /// Degrees from below, growing.
    vertical: Vec<f32>,
    /// Degrees around, growing from zero.
    horizontal: Vec<f32>,
    /// Candela, one row of vertical angles for each horizontal one; the file's factors included.
    candela: Vec<f32>,
}

/// More angles than any instrument takes.
const MOST_ANGLES: usize = 4096;

/// The numbers of a file in order.
struct Numbers<'t>(std::iter::Peekable<Box<dyn Iterator<Item = &'t str> + 't>>);

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<f32, String> {
        let word = self.0.next().ok_or_else(|| format!("it ends before {what}"))?;
        word.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| format!("`{word}` where {what} should be"))
    }

    fn count(&mut self, what: &str) -> Result<usize, String> {
        let n = self.next(what)?;
        if n >= 1.0 && n <= MOST_ANGLES as f32 && n.fract() == 0.0 {
            return Ok(n as usize);
        }
        Err(format!("{what} must be from 1 to {MOST_ANGLES}, not {n}"))
    }

    fn list(&mut self, n: usize, what: &str) -> Result<Vec<f32>, String> {
        (0..n).map(|_| self.next(what)).collect()
    }
}

impl IesProfile {
    /// Reads a file. The error is in words.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        // Names in the head may be in any encoding; numbers are not.
        let text = String::from_utf8_lossy(bytes);
        let mut lines = text.lines();
        let tilt = lines.find_map(|l| l.trim().strip_prefix("TILT=")).ok_or("no photometric file: it has no TILT")?;
        let words: Box<dyn Iterator<Item = &str>> =
            Box::new(lines.flat_map(|l| l.split([' ', '\t', ',', '\r'])).filter(|w| !w.is_empty()));
        let mut n = Numbers(words.peekable());
        if tilt.trim() == "INCLUDE" {
            // What lamps lose when they are tilted: this one hangs as it was measured.
            n.next("the lamp's geometry")?;
            let pairs = n.count("the number of tilt angles")?;
            n.list(2 * pairs, "a tilt")?;
        }
        n.next("the number of lamps")?;
        n.next("the lumens of a lamp")?;
        let multiplier = n.next("the multiplier")?;
        let vertical = n.count("the number of vertical angles")?;
        let horizontal = n.count("the number of horizontal angles")?;
        let kind = n.next("the photometric type")?;
        if kind != 1.0 {
            return Err(format!("photometry of type {}; only type C is known", if kind == 2.0 { "B" } else { "A" }));
        }
        n.list(4, "the size of the luminaire")?;
        let factor = n.next("the ballast factor")? * n.next("the ballast lamp factor")?;
        n.next("the input watts")?;
        let vertical = n.list(vertical, "a vertical angle")?;
        let horizontal = n.list(horizontal, "a horizontal angle")?;
        let mut candela = n.list(vertical.len() * horizontal.len(), "an intensity")?;
        let grows = |v: &[f32]| v.windows(2).all(|w| w[0] < w[1]);
        if !grows(&vertical) || !grows(&horizontal) {
            return Err("its angles do not grow".into());
        }
        if vertical[0] < 0.0 || vertical.last().is_some_and(|&v| v > 180.0) || horizontal[0] != 0.0 {
            return Err("its angles are not those of type C".into());
        }
        let last = horizontal.last().copied().unwrap_or(0.0);
        if ![0.0, 90.0, 180.0, 360.0].contains(&last) {
            return Err(format!("its horizontal angles end at {last}, not at 0, 90, 180 or 360 degrees"));
        }
        candela.iter_mut().for_each(|v| *v *= multiplier * factor);
        if candela.iter().any(|v| *v < 0.0 || !v.is_finite()) {
            return Err("an intensity is negative or too large".into());
        }
        Ok(Self { vertical, horizontal, candela })
    }

    /// The luminous intensity in a direction, in candela: -y is straight below, x where the horizontal angle is zero.
    pub fn candela(&self, d: Vec3) -> f32 {
        let below = acos((-d.y).clamp(-1.0, 1.0)).to_degrees();
        let around = atan2(d.z, d.x).to_degrees();
        let around = if around < 0.0 { around + 360.0 } else { around };
        let last = self.horizontal.last().copied().unwrap_or(0.0);
        let around = match last {
            0.0 => 0.0,
            90.0 => 90.0 - (90.0 - around % 180.0).abs(),
            180.0 => 180.0 - (180.0 - around).abs(),
            _ => around,
        };
        // Nothing was measured where the angles do not reach.
        if below < self.vertical[0] || self.vertical.last().is_some_and(|&v| below > v) {
            return 0.0;
        }
        let (i, s) = between(&self.vertical, below);
        let (j, t) = between(&self.horizontal, around);
        let rows = self.vertical.len();
        let at =
            |i: usize, j: usize| self.candela[j.min(self.horizontal.len() - 1) * rows + i.min(self.vertical.len() - 1)];
        let column = |j: usize| at(i, j) * (1.0 - s) + at(i + 1, j) * s;
        column(j) * (1.0 - t) + column(j + 1) * t
    }
}

/// The last angle that is not above `x`, and how far on to the next `x` is.
fn between(angles: &[f32], x: f32) -> (usize, f32) {
    let i = angles.partition_point(|&a| a <= x).saturating_sub(1);
    let t = angles.get(i + 1).map_or(0.0, |next| ((x - angles[i]) / (next - angles[i])).clamp(0.0, 1.0));
    (i, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "IESNA:LM-63-2002\r\n[TEST] a lamp\r\nTILT=INCLUDE\r\n1\r\n2\r\n0 90\r\n1.0 0.9\r\n\
        1 1000 2.0 3 2 1 2 0.1 0.1 0.1\r\n0.5 1.0 60\r\n0 45 90\r\n0 90\r\n100 80 0\r\n100 40, 0\r\n";

    fn down(vertical: f32, horizontal: f32) -> Vec3 {
        let (v, h) = (vertical.to_radians(), horizontal.to_radians());
        let s = steradian_math::sin(v);
        Vec3::new(s * steradian_math::cos(h), -steradian_math::cos(v), s * steradian_math::sin(h))
    }

    #[test]
    fn angles_are_interpolated_and_mirrored() {
        let p = IesProfile::parse(FILE.as_bytes()).unwrap();
        let cases = [
            (0.0, 0.0, 100.0),
            (45.0, 0.0, 80.0),
            (45.0, 90.0, 40.0),
            (45.0, 270.0, 40.0),
            (45.0, 180.0, 80.0),
            (45.0, 45.0, 60.0),
            (45.0, 225.0, 60.0),
            (22.5, 0.0, 90.0),
            (90.0, 30.0, 0.0),
            (120.0, 30.0, 0.0),
        ];
        for (v, h, expected) in cases {
            let found = p.candela(down(v, h));
            assert!((found - expected).abs() < 0.05, "{v} {h}: {found}, not {expected}");
        }
    }

    #[test]
    fn damaged_files_are_errors() {
        for n in 0..FILE.len() - 2 {
            let cut = &FILE[..n];
            // Cut inside the last number it is another file.
            assert!(IesProfile::parse(cut.as_bytes()).is_err() || n > FILE.len() - 6, "{cut}");
        }
        for (from, to) in [
            ("3 2 1 2", "3 2 3 2"),
            ("3 2 1 2", "9999999 2 1 2"),
            ("0 45 90", "0 45 30"),
            ("0 90\r\n100", "0 80\r\n100"),
            ("100 80 0", "100 -80 0"),
            ("100 80 0", "100 nan 0"),
            ("TILT", "tilt"),
        ] {
            assert!(IesProfile::parse(FILE.replace(from, to).as_bytes()).is_err(), "{to}");
        }
    }
}
