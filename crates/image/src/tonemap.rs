//! Light without bounds -> what a screen can show. Linear in, linear display-referred out; the sRGB curve is applied on encoding.

use steradian_math::{exp, exp2, ln, log2, powf};

/// How bright the picture is made before the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Multiply by 2 to this power.
    Stops(f32),
    /// Bring the log-average luminance (geometric mean; Reinhard et al. 2002, equation 1) of the pixels that are neither black nor in
    /// the brightest 1 % to 0.18, then apply these stops on top.
    Auto(f32),
}

/// The curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Operator {
    /// Clip each channel to `[0,1]`.
    Clip,
    /// Reinhard et al. 2002, equation 4, on luminance with white at 4.
    Reinhard,
    /// Hable's "Uncharted 2" curve (GDC 2010), white at 11.2.
    Hable,
    /// The ACES reference rendering and sRGB output transform in Hill's fit (2016).
    Aces,
    /// AgX (Sobotka): a logarithmic curve in an inset gamut, which lets bright saturated light go to white as film does. Base look.
    #[default]
    Agx,
}

impl Operator {
    /// Every operator with the name that the command line gives it.
    pub const NAMES: [(&'static str, Operator); 5] = [
        ("clip", Operator::Clip),
        ("reinhard", Operator::Reinhard),
        ("hable", Operator::Hable),
        ("aces", Operator::Aces),
        ("agx", Operator::Agx),
    ];

    /// The operator of this name; `filmic` also means `hable`, and `linear`, `srgb` and `none` mean `clip`.
    pub fn from_name(name: &str) -> Option<Operator> {
        match name {
            "filmic" => Some(Operator::Hable),
            "linear" | "srgb" | "none" => Some(Operator::Clip),
            _ => Operator::NAMES.iter().find(|(n, _)| *n == name).map(|(_, o)| *o),
        }
    }

    /// Linear Rec. 709 in, linear Rec. 709 in `[0,1]` out. Middle grey stays near middle grey. NaN becomes 0.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // The cap keeps the polynomials below from overflowing.
        let rgb = rgb.map(|v| limited(v, 1e9));
        let out = match self {
            Operator::Clip => rgb,
            Operator::Reinhard => reinhard(rgb),
            Operator::Hable => rgb.map(|v| hable(2.0 * v) / hable(11.2)),
            Operator::Aces => aces(rgb),
            Operator::Agx => agx(rgb),
        };
        out.map(|v| v.clamp(0.0, 1.0))
    }
}

/// Exposure, then operator. The default is AgX at no extra exposure: its shoulder is long, so that lamps and skies keep their shape,
/// and saturated highlights turn pale rather than into flat patches of primary colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Brightness.
    pub exposure: Exposure,
    /// Curve.
    pub operator: Operator,
}

impl Default for ToneMap {
    fn default() -> ToneMap {
        ToneMap { exposure: Exposure::Stops(0.0), operator: Operator::Agx }
    }
}

/// A tone map whose exposure has been found for one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedToneMap {
    /// Factor on linear light.
    pub scale: f32,
    /// Curve.
    pub operator: Operator,
}

impl ToneMap {
    /// Finds the exposure for a picture given as its linear R, G, B planes.
    pub fn prepared(&self, planes: [&[f32]; 3]) -> PreparedToneMap {
        let scale = match self.exposure {
            Exposure::Stops(s) => exp2(s),
            Exposure::Auto(s) => auto_scale(planes) * exp2(s),
        };
        PreparedToneMap { scale, operator: self.operator }
    }
}

impl PreparedToneMap {
    /// Maps one pixel.
    pub fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        self.operator.apply(rgb.map(|v| v * self.scale))
    }
}

/// The value held to `[0, high]`; NaN becomes 0, which `clamp` would pass on.
pub(crate) fn limited(v: f32, high: f32) -> f32 {
    if v > 0.0 { v.min(high) } else { 0.0 }
}

/// Rec. 709 luminance.
pub(crate) fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

fn auto_scale(planes: [&[f32]; 3]) -> f32 {
    let mut lit: Vec<f32> =
        (0..planes[0].len()).map(|i| luminance(planes.map(|p| p[i]))).filter(|y| y.is_finite() && *y > 1e-6).collect();
    lit.sort_unstable_by(f32::total_cmp);
    let kept = &lit[..lit.len() - lit.len() / 100];
    if kept.is_empty() {
        return 1.0;
    }
    let mean = kept.iter().map(|&y| f64::from(ln(y))).sum::<f64>() / kept.len() as f64;
    0.18 / exp(mean as f32)
}

fn reinhard(rgb: [f32; 3]) -> [f32; 3] {
    const WHITE: f32 = 4.0;
    let y = luminance(rgb);
    let scale = (1.0 + y / (WHITE * WHITE)) / (1.0 + y);
    rgb.map(|v| v * scale)
}

fn hable(x: f32) -> f32 {
    let (a, b, c, d, e, f) = (0.15, 0.50, 0.10, 0.20, 0.02, 0.30);
    (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f
}

fn transform(m: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn aces(rgb: [f32; 3]) -> [f32; 3] {
    // sRGB -> XYZ -> D65 to D60 -> AP1 -> RRT saturation, and back: constants of Hill's fit.
    const IN: [[f32; 3]; 3] = [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUT: [[f32; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fit = |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    transform(OUT, transform(IN, rgb).map(fit))
}

fn agx(rgb: [f32; 3]) -> [f32; 3] {
    // Gamut inset and outset, and the 6th order fit of the default contrast curve (Wrensch, "Minimal AgX implementation").
    const IN: [[f32; 3]; 3] = [
        [0.842_479_06, 0.078_433_6, 0.079_223_75],
        [0.042_328_24, 0.878_468_64, 0.079_166_13],
        [0.042_375_654, 0.078_433_6, 0.879_142_97],
    ];
    const OUT: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_74],
        [-0.052_896_85, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    const LOW: f32 = -12.473_93;
    const HIGH: f32 = 4.026_069;
    let curve = |v: f32| {
        let x = ((log2(v.max(1e-10)) - LOW) / (HIGH - LOW)).clamp(0.0, 1.0);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
    };
    // The curve gives display codes; back to light with the 2.2 power that it was fitted for.
    transform(OUT, transform(IN, rgb).map(curve)).map(|v| powf(v.max(0.0), 2.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_rises_from_black_to_white() {
        for (name, op) in Operator::NAMES {
            let mut last = -1.0;
            for i in 0..200 {
                let v = if i == 0 { 0.0 } else { exp2(-12.0 + i as f32 * 0.15) };
                let [r, g, b] = op.apply([v; 3]);
                assert!(r >= last - 1e-3 && (0.0..=1.0).contains(&r), "{name} at {v}: {r} after {last}");
                assert!((r - g).abs() < 2e-2 && (r - b).abs() < 2e-2, "{name} tints grey {v}: {r} {g} {b}");
                last = r;
            }
            assert!(op.apply([0.0; 3])[0] < 0.002, "{name} lifts black");
            assert!(last > 0.98, "{name} has no white: {last}");
        }
    }

    #[test]
    fn middle_grey_stays_near_middle_grey() {
        for (name, op) in Operator::NAMES {
            let y = op.apply([0.18; 3])[1];
            assert!((0.08..0.25).contains(&y), "{name}: {y}");
        }
    }

    #[test]
    fn highlights_roll_off_by_default() {
        let op = ToneMap::default().operator;
        let (one, two, four) = (op.apply([1.0; 3])[1], op.apply([2.0; 3])[1], op.apply([4.0; 3])[1]);
        assert!(one < two && two < four && four < 1.0, "{one} {two} {four}");
        let [r, _, b] = op.apply([50.0, 1.0, 1.0]);
        assert!(b > 0.2 * r, "a bright red goes pale: {r} {b}");
    }

    #[test]
    fn bad_values_do_not_spread() {
        for (_, op) in Operator::NAMES {
            for v in [f32::NAN, f32::INFINITY, -1.0, f32::MAX] {
                assert!(op.apply([v, 0.5, 0.5]).iter().all(|x| (0.0..=1.0).contains(x)));
            }
        }
    }

    #[test]
    fn auto_exposure_ignores_darkness_and_fireflies() {
        let mut plane = vec![0.02_f32; 1000];
        plane[..100].fill(0.0);
        plane[990..].fill(1e6);
        plane[500] = f32::NAN;
        let tone = ToneMap { exposure: Exposure::Auto(0.0), operator: Operator::Clip };
        let scale = tone.prepared([&plane, &plane, &plane]).scale;
        // Nine tenths of the pixels are lit, so one hundredth of those are nine, and one of the ten fireflies is still counted.
        assert!((scale * 0.02 / 0.18 - 1.0).abs() < 0.05, "{scale}");
    }
}
