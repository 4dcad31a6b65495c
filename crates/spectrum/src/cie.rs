//! The CIE 1931 2-degree standard observer and the white illuminants of the colour spaces.
//!
//! Source of the numbers: `data/README.md`.

use crate::dense::{DENSE_LEN, Dense};
use crate::{ColorSpace, Lanes, Wavelengths};

const OBSERVER: &[u8] = include_bytes!("../data/cie1931.f32");

/// The colour matching function x-bar.
pub static X: Dense = Dense::from_bytes(OBSERVER, 0);
/// The colour matching function y-bar, the photopic luminous efficiency.
pub static Y: Dense = Dense::from_bytes(OBSERVER, 1);
/// The colour matching function z-bar.
pub static Z: Dense = Dense::from_bytes(OBSERVER, 2);

/// CIE standard illuminant D65, scaled so that `sum D65 y = sum y`.
pub static D65: Dense = Dense::from_bytes(include_bytes!("../data/illuminant_d65.f32"), 0);
/// The white of ACES ("D60"), scaled so that `sum S y = sum y`.
pub static ACES_D60: Dense = Dense::from_bytes(include_bytes!("../data/illuminant_aces_d60.f32"), 0);

/// The sum of y-bar over whole nanometres, in nm.
pub const Y_INTEGRAL: f32 = {
    let y = Dense::from_bytes(OBSERVER, 1);
    let mut sum = 0.0f64;
    let mut i = 0;
    while i < DENSE_LEN {
        sum += y.0[i] as f64;
        i += 1;
    }
    sum as f32
};

/// Luminous efficacy of monochromatic light of 540 THz, in lumen per watt (SI definition of the candela).
pub const LUMENS_PER_WATT: f32 = 683.0;

/// The sums `S x`, `S y`, `S z` over whole nanometres of the emission `f(lambda)`. Not divided by [`Y_INTEGRAL`].
pub fn xyz_integral(mut f: impl FnMut(f32) -> f32) -> [f32; 3] {
    let emission = Dense::from_fn(&mut f);
    xyz_of_table(&emission)
}

/// [`xyz_integral`] of a table.
pub fn xyz_of_table(emission: &Dense) -> [f32; 3] {
    [X.dot(emission) as f32, Y.dot(emission) as f32, Z.dot(emission) as f32]
}

/// XYZ, with Y = 1 for a perfect reflector, of the reflectance `f(lambda)` under D65.
pub fn xyz_of_reflectance(mut f: impl FnMut(f32) -> f32) -> [f32; 3] {
    let reflected = Dense::from_fn(|lambda| f(lambda) * D65.eval_at(lambda));
    xyz_of_table(&reflected).map(|v| v / D65_Y)
}

/// XYZ of radiance `lanes`: an estimate of [`xyz_integral`] in spectral mode, exact in RGB mode.
pub fn xyz_of_lanes(lanes: Lanes, wavelengths: &Wavelengths) -> [f32; 3] {
    if wavelengths.is_rgb() {
        return ColorSpace::Srgb.xyz_from_rgb().apply(lanes.rgb());
    }
    let weighted = lanes.safe_div(wavelengths.pdf());
    [&X, &Y, &Z].map(|curve| (curve.eval(wavelengths.lambda()) * weighted).average())
}

/// The sum of D65 times y-bar.
const D65_Y: f32 = {
    let y = Dense::from_bytes(OBSERVER, 1);
    let d65 = Dense::from_bytes(include_bytes!("../data/illuminant_d65.f32"), 0);
    y.dot(&d65) as f32
};

/// The sums of an illuminant table against the observer, for use in constants.
pub(crate) const fn white_xyz(illuminant: &Dense) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    let mut c = 0;
    while c < 3 {
        xyz[c] = Dense::from_bytes(OBSERVER, c).dot(illuminant);
        c += 1;
    }
    xyz
}
