//! The error function and its inverse, portable (Abramowitz and Stegun 1964, 7.1.26; Giles 2010).

use crate::portable::{exp, ln};

/// `2 / sqrt(pi)` times the integral of `exp(-t^2)` from 0 to `x`; within 2e-7.
#[inline]
pub fn erf(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let p = 1.061_405_4;
    let p = p * t - 1.453_152_1;
    let p = p * t + 1.421_413_8;
    let p = p * t - 0.284_496_72;
    let p = p * t + 0.254_829_6;
    (1.0 - p * t * exp(-x * x)).copysign(x)
}

/// The `x` whose error function is `y`, for `y` in `(-1, 1)`; relative error below 1e-6 away from the ends.
#[inline]
pub fn erf_inv(y: f32) -> f32 {
    let w = -ln(((1.0 - y) * (1.0 + y)).max(f32::MIN_POSITIVE));
    let horner = |c: &[f32; 9], x: f32| c[1..].iter().fold(c[0], |p, &c| p * x + c);
    const CENTRE: [f32; 9] = [
        2.810_226_4e-8,
        3.432_739_5e-7,
        -3.523_387_7e-6,
        -4.391_506_5e-6,
        0.000_218_580_87,
        -0.001_253_725,
        -0.004_177_681_6,
        0.246_640_73,
        1.501_409_4,
    ];
    const TAIL: [f32; 9] = [
        -0.000_200_214_26,
        0.000_100_950_56,
        0.001_349_343_2,
        -0.003_673_428_4,
        0.005_739_507_7,
        -0.007_622_461_3,
        0.009_438_870_5,
        1.001_674_1,
        2.832_976_8,
    ];
    y * if w < 5.0 { horner(&CENTRE, w - 2.5) } else { horner(&TAIL, w.sqrt() - 3.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        for (x, y) in [(0.0, 0.0), (0.5, 0.520_499_9), (1.0, 0.842_700_8), (2.0, 0.995_322_3), (-1.0, -0.842_700_8)] {
            assert!((erf(x) - y).abs() < 3e-7, "{x}: {}", erf(x));
        }
    }

    #[test]
    fn the_inverse_inverts() {
        for i in -199..200 {
            let y = i as f32 / 200.0;
            assert!((erf(erf_inv(y)) - y).abs() < 1e-6, "{y}");
        }
        assert!(erf_inv(1.0).is_finite() && erf_inv(-1.0).is_finite());
    }
}
