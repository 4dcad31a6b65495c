//! Bounds on rounding error (Higham 2002; PBRT 4th ed., 6.8).

/// The bound `n u / (1 - n u)` on the relative error of `n` rounded operations.
#[inline]
pub const fn gamma(n: u32) -> f32 {
    const HALF_EPSILON: f32 = f32::EPSILON * 0.5;
    n as f32 * HALF_EPSILON / (1.0 - n as f32 * HALF_EPSILON)
}

/// The next `f32` towards positive infinity.
#[inline]
pub fn next_up(x: f32) -> f32 {
    x.next_up()
}

/// The next `f32` towards negative infinity.
#[inline]
pub fn next_down(x: f32) -> f32 {
    x.next_down()
}
