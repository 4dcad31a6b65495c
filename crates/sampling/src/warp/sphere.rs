//! Directions: sphere, hemisphere (uniform and cosine-weighted) and cone around `z`. Densities are per solid angle.

use super::disk::{square_to_uniform_disk_concentric, turn, uniform_disk_concentric_to_square};
use steradian_math::{INV_2PI, INV_4PI, INV_PI, TAU, Vec3, safe_sqrt, sin_cos};

/// The direction with `z = 1 - one_minus_z`. Taking the complement keeps the sine exact close to the pole.
#[inline(always)]
fn from_polar(one_minus_z: f32, turn: f32) -> Vec3 {
    let sin_theta = safe_sqrt(one_minus_z * (2.0 - one_minus_z));
    let (sin, cos) = sin_cos(TAU * turn);
    Vec3::new(sin_theta * cos, sin_theta * sin, 1.0 - one_minus_z)
}

/// `1 - z` of a unit vector, exact also close to the pole.
#[inline(always)]
fn one_minus_z(w: Vec3) -> f32 {
    if w.z > 0.5 { (w.x * w.x + w.y * w.y) / (1.0 + w.z) } else { 1.0 - w.z }
}

/// Uniform direction of the sphere.
#[inline]
pub fn square_to_uniform_sphere(u: [f32; 2]) -> Vec3 {
    from_polar(2.0 * u[0], u[1])
}

/// Density of [`square_to_uniform_sphere`]: `1 / 4 pi` everywhere.
#[inline]
pub fn square_to_uniform_sphere_pdf(_w: Vec3) -> f32 {
    INV_4PI
}

/// Inverse of [`square_to_uniform_sphere`].
#[inline]
pub fn uniform_sphere_to_square(w: Vec3) -> [f32; 2] {
    [(0.5 * one_minus_z(w)).clamp(0.0, 1.0), turn([w.x, w.y])]
}

/// Uniform direction of the upper hemisphere.
#[inline]
pub fn square_to_uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    from_polar(u[0], u[1])
}

/// Density of [`square_to_uniform_hemisphere`].
#[inline]
pub fn square_to_uniform_hemisphere_pdf(w: Vec3) -> f32 {
    if w.z >= 0.0 { INV_2PI } else { 0.0 }
}

/// Inverse of [`square_to_uniform_hemisphere`].
#[inline]
pub fn uniform_hemisphere_to_square(w: Vec3) -> [f32; 2] {
    [one_minus_z(w).clamp(0.0, 1.0), turn([w.x, w.y])]
}

/// Cosine-weighted direction of the upper hemisphere: a uniform disk point, lifted (Malley).
#[inline(always)]
pub fn square_to_cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = square_to_uniform_disk_concentric(u);
    Vec3::new(x, y, safe_sqrt(1.0 - x * x - y * y))
}

/// Density of [`square_to_cosine_hemisphere`]: `cos / pi`.
#[inline(always)]
pub fn square_to_cosine_hemisphere_pdf(w: Vec3) -> f32 {
    w.z.max(0.0) * INV_PI
}

/// Inverse of [`square_to_cosine_hemisphere`].
#[inline]
pub fn cosine_hemisphere_to_square(w: Vec3) -> [f32; 2] {
    uniform_disk_concentric_to_square([w.x, w.y])
}

/// Uniform direction of the cone around `z` that reaches up to the angle with `1 - cos = one_minus_cos_max`.
///
/// The complement is asked for since `cos_max` itself cannot describe narrow cones.
#[inline]
pub fn square_to_uniform_cone(u: [f32; 2], one_minus_cos_max: f32) -> Vec3 {
    from_polar(u[0] * one_minus_cos_max, u[1])
}

/// Density of [`square_to_uniform_cone`]; infinite for an empty cone at the pole.
#[inline]
pub fn square_to_uniform_cone_pdf(w: Vec3, one_minus_cos_max: f32) -> f32 {
    // A direction made by the warp may lie outside by rounding.
    if one_minus_z(w) <= one_minus_cos_max * (1.0 + 1e-4) { INV_2PI / one_minus_cos_max } else { 0.0 }
}

/// Inverse of [`square_to_uniform_cone`].
#[inline]
pub fn uniform_cone_to_square(w: Vec3, one_minus_cos_max: f32) -> [f32; 2] {
    [(one_minus_z(w) / one_minus_cos_max).clamp(0.0, 1.0), turn([w.x, w.y])]
}
