//! Uniform points of a triangle, as barycentric coordinates (Heitz, "A low-distortion map between triangle and square", 2019).

/// Uniform barycentric coordinates, summing to one.
///
/// The square is folded along its diagonal, which distorts strata less than the classic square root.
#[inline(always)]
pub fn square_to_uniform_triangle(u: [f32; 2]) -> [f32; 3] {
    let (b0, b1) = if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        (b0, u[1] - b0)
    } else {
        let b1 = 0.5 * u[1];
        (u[0] - b1, b1)
    };
    [b0, b1, 1.0 - b0 - b1]
}

/// Density with respect to area, for a triangle of the given `area`.
#[inline]
pub fn square_to_uniform_triangle_pdf(b: [f32; 3], area: f32) -> f32 {
    if b.iter().all(|&x| x >= 0.0) && area > 0.0 { 1.0 / area } else { 0.0 }
}

/// Inverse of [`square_to_uniform_triangle`].
#[inline]
pub fn uniform_triangle_to_square(b: [f32; 3]) -> [f32; 2] {
    if b[0] > b[1] { [b[0] + b[1], 2.0 * b[1]] } else { [2.0 * b[0], b[1] + b[0]] }
}
