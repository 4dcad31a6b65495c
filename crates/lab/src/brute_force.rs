//! The slide's parameters of brute force, as a student may choose them.

use std::fmt;
use std::str::FromStr;

/// Intersection tests above which nobody means to start: some minutes on one core.
pub const ABSURD_TESTS: f64 = 2e10;
/// Tests of a ray against a triangle that a core makes in a second, roughly.
pub const TESTS_PER_SECOND: f64 = 1e8;

/// `m` x `m` pixels, `k` x `k` places in each, `a` x `a` points of the aperture, `s` x `s` points of each of `l` lamps, `r` x `r` rays
/// on from each hit, `d` bounces, in a room of `n` triangles. Written as on the slide: `m=4,k=2,s=3`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BruteForce {
    /// Pixels along a side.
    pub m: u32,
    /// Places in a pixel along a side.
    pub k: u32,
    /// Points of the aperture along a side.
    pub a: u32,
    /// Points of a lamp along a side.
    pub s: u32,
    /// Rays on from a hit along a side.
    pub r: u32,
    /// Bounces.
    pub d: u32,
    /// Triangles.
    pub n: u32,
    /// Lamps.
    pub l: u32,
}

impl Default for BruteForce {
    fn default() -> Self {
        Self { m: 4, k: 1, a: 1, s: 1, r: 1, d: 1, n: 120, l: 2 }
    }
}

impl BruteForce {
    /// Rays for each camera ray: `T(1) = 1 + l s^2`, `T(d) = 1 + l s^2 + r^2 T(d - 1)`; the lecture's bracket, with the ray itself
    /// counted.
    pub fn rays_per_camera_ray(&self) -> f64 {
        let shadow = f64::from(self.l) * square(self.s);
        (1..self.d).fold(1.0 + shadow, |t, _| 1.0 + shadow + square(self.r) * t)
    }

    /// All rays of the picture: `m^2 k^2 a^2 T(d)`.
    pub fn rays(&self) -> f64 {
        square(self.m) * square(self.k) * square(self.a) * self.rays_per_camera_ray()
    }

    /// Intersection tests against every triangle: `n` for each ray.
    pub fn tests(&self) -> f64 {
        f64::from(self.n) * self.rays()
    }
}

fn square(v: u32) -> f64 {
    f64::from(v) * f64::from(v)
}

impl fmt::Display for BruteForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { m, k, a, s, r, d, n, l } = self;
        write!(f, "m={m},k={k},a={a},s={s},r={r},d={d},n={n},l={l}")
    }
}

impl FromStr for BruteForce {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut out = Self::default();
        for part in text.split(',') {
            let (name, value) = part.split_once('=').ok_or_else(|| format!("'{part}' is not of the form k=2"))?;
            let (target, range) = match name.trim() {
                "m" => (&mut out.m, 1..=4_096),
                "k" => (&mut out.k, 1..=4_096),
                "a" => (&mut out.a, 1..=4_096),
                "s" => (&mut out.s, 1..=4_096),
                "r" => (&mut out.r, 1..=4_096),
                "d" => (&mut out.d, 1..=64),
                // The room itself has twelve.
                "n" => (&mut out.n, 12..=10_000_000),
                "l" => (&mut out.l, 1..=1_000),
                other => return Err(format!("'{other}' is none of the slide's m, k, a, s, r, d, n, l")),
            };
            *target = value.trim().parse().ok().filter(|v| range.contains(v)).ok_or_else(|| {
                format!("{} must be from {} to {}, not '{value}'", name.trim(), range.start(), range.end())
            })?;
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slides_numbers() {
        let slide: BruteForce = "m=1000, k=8,a=8,s=8,r=8,d=8,n=1000000,l=4".parse().unwrap();
        assert_eq!(slide.to_string().parse(), Ok(slide));
        assert!(slide.tests() > 1e29 && slide.tests() < 1e31, "{:e}", slide.tests());
        let two: BruteForce = "k=2,d=2,r=3".parse().unwrap();
        // Two lamps: T(1) = 3, T(2) = 3 + 9 * 3.
        assert_eq!((two.rays_per_camera_ray(), two.rays()), (30.0, 16.0 * 4.0 * 30.0));
        let three: BruteForce = "m=2,k=3,a=2,s=2,r=2,d=3".parse().unwrap();
        // T(1) = 9, T(2) = 9 + 4 * 9, T(3) = 9 + 4 * 45.
        assert_eq!((three.rays_per_camera_ray(), three.rays()), (189.0, 4.0 * 9.0 * 4.0 * 189.0));
        for (bad, said) in
            [("k", "not of the form"), ("q=2", "none of the slide's"), ("d=65", "from 1 to 64"), ("m=-1", "'-1'")]
        {
            assert!(bad.parse::<BruteForce>().unwrap_err().contains(said), "{bad}");
        }
    }
}
