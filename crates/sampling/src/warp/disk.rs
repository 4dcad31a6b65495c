//! The unit disk: polar and concentric (Shirley and Chiu 1997) maps.

use steradian_math::{FRAC_PI_2, FRAC_PI_4, INV_PI, TAU, atan2, sin_cos};

/// Uniform point of the unit disk: `u[0]` is the squared radius, `u[1]` the angle. Simple, but it distorts strata.
#[inline]
pub fn square_to_uniform_disk_polar(u: [f32; 2]) -> [f32; 2] {
    let r = u[0].sqrt();
    let (sin, cos) = sin_cos(TAU * u[1]);
    [r * cos, r * sin]
}

/// Inverse of [`square_to_uniform_disk_polar`].
#[inline]
pub fn uniform_disk_polar_to_square(p: [f32; 2]) -> [f32; 2] {
    [p[0] * p[0] + p[1] * p[1], turn(p)]
}

/// Angle of a point as a fraction of a full turn, in `[0, 1]`.
#[inline]
pub(super) fn turn(p: [f32; 2]) -> f32 {
    let phi = atan2(p[1], p[0]) / TAU;
    if phi < 0.0 { phi + 1.0 } else { phi }
}

/// Uniform point of the unit disk: squares around the centre become circles, so that strata stay compact.
#[inline(always)]
pub fn square_to_uniform_disk_concentric(u: [f32; 2]) -> [f32; 2] {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let (r, phi) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    let (sin, cos) = sin_cos(phi);
    [r * cos, r * sin]
}

/// Inverse of [`square_to_uniform_disk_concentric`].
#[inline]
pub fn uniform_disk_concentric_to_square(p: [f32; 2]) -> [f32; 2] {
    let r = (p[0] * p[0] + p[1] * p[1]).sqrt();
    if r == 0.0 {
        return [0.5, 0.5];
    }
    let (x, y) = if p[0].abs() > p[1].abs() {
        let x = r.copysign(p[0]);
        (x, x * atan2(p[1] / p[0], 1.0) / FRAC_PI_4)
    } else {
        let y = r.copysign(p[1]);
        (y * atan2(p[0] / p[1], 1.0) / FRAC_PI_4, y)
    };
    [(0.5 * (x + 1.0)).clamp(0.0, 1.0), (0.5 * (y + 1.0)).clamp(0.0, 1.0)]
}

/// Density of both maps with respect to area.
#[inline]
pub fn square_to_uniform_disk_pdf(p: [f32; 2]) -> f32 {
    if p[0] * p[0] + p[1] * p[1] <= 1.0 { INV_PI } else { 0.0 }
}
