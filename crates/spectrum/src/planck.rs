//! Black bodies and daylight.
//!
//! Planck's law with the exact constants of the 2019 SI; CIE 15 for the D series.

use steradian_math as math;

use crate::color::xyz_from_xyy;
use crate::dense::Dense;
use crate::{ColorSpace, Lanes, SpectrumError, Wavelengths};

/// First radiation constant `2 h c^2`, for wavelengths in micrometres and radiance per metre: 1.191042972e-16 W m^2 / sr times 1e30.
const FIRST: f32 = 1.191_042_97e14;
/// Second radiation constant `h c / k`, in micrometre kelvin.
const SECOND: f32 = 14_387.768_8;
/// Wien's displacement constant: the peak of a black body of `T` kelvin lies at this over `T`, in nanometres.
pub const WIEN_NM_KELVIN: f32 = 2_897_771.955;

/// The spectral radiance of a black body at `lambda` nanometres, in W / (m^2 sr m). 0 for a temperature that is not positive; NaN stays NaN.
#[inline]
pub fn radiance(lambda: f32, kelvin: f32) -> f32 {
    if kelvin <= 0.0 {
        return 0.0;
    }
    let l = lambda * 1e-3;
    let x = SECOND / (l * kelvin);
    // e^x - 1 loses its digits for small x.
    let expm1 = if x < 0.05 { x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0)))) } else { math::exp(x) - 1.0 };
    let l2 = l * l;
    FIRST / (l2 * l2 * l * expm1)
}

/// The spectrum of daylight of a nominal colour temperature, as CIE's D series has it: D65 is `daylight(6500)`. Relative power: 1 at 560 nm.
///
/// Below 4000 K the series is not defined and a black body with peak 1 takes its place. Above 25000 K it is extrapolated.
///
/// # Errors
/// When the temperature is not positive and finite.
pub fn daylight(nominal_kelvin: f32) -> Result<Dense, SpectrumError> {
    if !(nominal_kelvin > 0.0 && nominal_kelvin.is_finite()) {
        return Err(SpectrumError::Temperature { kelvin: nominal_kelvin });
    }
    // The second radiation constant has changed since the illuminants were named.
    let t = nominal_kelvin * (1.4388 / 1.4380);
    if t < 4000.0 {
        let peak = radiance(WIEN_NM_KELVIN / t, t);
        return Ok(Dense::from_fn(|lambda| radiance(lambda, t) / peak));
    }
    let k = 1000.0 / t;
    let x = if t <= 7000.0 {
        0.244063 + k * (0.09911 + k * (2.9678 - k * 4.6070))
    } else {
        0.237040 + k * (0.24748 + k * (1.9018 - k * 2.0064))
    };
    let y = -3.0 * x * x + 2.870 * x - 0.275;
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    let m1 = (-1.3515 - 1.7703 * x + 5.9114 * y) / m;
    let m2 = (0.0300 - 31.4424 * x + 30.0717 * y) / m;
    let rows = crate::csv::rows::<3>(include_str!("../data/cie_daylight.csv"));
    Ok(Dense::from_fn(|lambda| {
        let next = rows.partition_point(|(l, _)| *l <= lambda).clamp(1, rows.len() - 1);
        let power = |(_, [s0, s1, s2]): &(f32, [f32; 3])| 0.01 * (s0 + m1 * s1 + m2 * s2);
        let (a, b) = (&rows[next - 1], &rows[next]);
        let w = (lambda - a.0) / (b.0 - a.0);
        (1.0 - w) * power(a) + w * power(b)
    }))
}

/// `ln X, ln Y, ln Z` (sums over whole nanometres) of black bodies with peak 1, at equal steps of the reciprocal temperature.
static LOG_XYZ: &[u8] = include_bytes!("../data/blackbody_log_xyz.f32");
/// The reciprocal temperatures (1e6 / K) of the first and the last row, and the number of rows.
const FIRST_MIRED: f32 = 10.0;
const LAST_MIRED: f32 = 2500.0;
const ROWS: usize = 499;

/// The lanes of [`Spectrum::blackbody`](crate::Spectrum::blackbody) of a temperature that is only known on the spot, as in a fire.
///
/// 0 below 400 K, where the visible part of the spectrum is some 15 orders of magnitude below the peak. In RGB mode temperatures above
/// 100000 K count as 100000 K.
pub fn blackbody_lanes(kelvin: f32, wavelengths: &Wavelengths) -> Lanes {
    if kelvin < 400.0 {
        return Lanes::ZERO;
    }
    if !wavelengths.is_rgb() {
        let scale = 1.0 / radiance(WIEN_NM_KELVIN / kelvin, kelvin);
        return Lanes(wavelengths.lambda().map(|l| radiance(l, kelvin) * scale));
    }
    let mired = (1e6 / kelvin).clamp(FIRST_MIRED, LAST_MIRED);
    let position = (mired - FIRST_MIRED) * ((ROWS - 1) as f32 / (LAST_MIRED - FIRST_MIRED));
    let row = (position as usize).min(ROWS - 2);
    let t = position - row as f32;
    let (a, b) = (crate::uplift::triple(LOG_XYZ, 3 * row), crate::uplift::triple(LOG_XYZ, 3 * row + 3));
    let xyz = [0, 1, 2].map(|c| math::exp((1.0 - t) * a[c] + t * b[c]));
    Lanes::from_rgb(ColorSpace::Srgb.rgb_from_xyz().apply(xyz).map(|v| v.max(0.0)))
}

/// XYZ with Y = 1 of the chromaticity of a CIE daylight phase of correlated temperature `kelvin`; a helper for white points.
pub fn daylight_white(nominal_kelvin: f32) -> Result<[f32; 3], SpectrumError> {
    let xyz = crate::cie::xyz_of_table(&daylight(nominal_kelvin)?);
    Ok(xyz_from_xyy(crate::color::xy_from_xyz(xyz), 1.0))
}
