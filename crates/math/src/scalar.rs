//! Scalar constants and helpers.

/// The ratio of a circle's circumference to its diameter.
pub const PI: f32 = std::f32::consts::PI;
/// `2 pi`.
pub const TAU: f32 = std::f32::consts::TAU;
/// `1 / pi`.
pub const INV_PI: f32 = std::f32::consts::FRAC_1_PI;
/// `1 / (2 pi)`.
pub const INV_2PI: f32 = 0.159_154_94;
/// `1 / (4 pi)`.
pub const INV_4PI: f32 = 0.079_577_47;
/// `pi / 2`.
pub const FRAC_PI_2: f32 = std::f32::consts::FRAC_PI_2;
/// `pi / 4`.
pub const FRAC_PI_4: f32 = std::f32::consts::FRAC_PI_4;
/// The square root of two.
pub const SQRT_2: f32 = std::f32::consts::SQRT_2;
/// The largest `f32` below one: random numbers never exceed it.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Linear interpolation, exact at both ends.
#[inline(always)]
pub fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// `x * x`.
#[inline(always)]
pub fn sqr(x: f32) -> f32 {
    x * x
}

/// The square root, with rounding noise below zero taken as zero.
#[inline(always)]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

/// The arc sine of `x` clamped to its domain.
#[inline]
pub fn safe_asin(x: f32) -> f32 {
    crate::asin(x.clamp(-1.0, 1.0))
}

/// The arc cosine of `x` clamped to its domain.
#[inline]
pub fn safe_acos(x: f32) -> f32 {
    crate::acos(x.clamp(-1.0, 1.0))
}

/// The cubic Hermite step: 0 below `a`, 1 above `b`.
#[inline]
pub fn smoothstep(x: f32, a: f32, b: f32) -> f32 {
    if a == b {
        return if x < a { 0.0 } else { 1.0 };
    }
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `a * b - c * d`, computed in double precision so that near-equal products do not cancel.
///
/// The product of two `f32` is exact in `f64`; hardware fused multiply-add, which other renderers use here, is not
/// available everywhere and would change the image from machine to machine.
#[inline(always)]
pub fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    (f64::from(a) * f64::from(b) - f64::from(c) * f64::from(d)) as f32
}

/// `a * b + c * d`, computed in double precision.
#[inline(always)]
pub fn sum_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    (f64::from(a) * f64::from(b) + f64::from(c) * f64::from(d)) as f32
}

/// The real roots of `a t^2 + b t + c`, smaller first; `None` when there are none.
pub fn solve_quadratic(a: f32, b: f32, c: f32) -> Option<(f32, f32)> {
    let (a, b, c) = (f64::from(a), f64::from(b), f64::from(c));
    if a == 0.0 {
        if b == 0.0 {
            return None;
        }
        let t = (-c / b) as f32;
        return Some((t, t));
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
    Some(if t0 <= t1 { (t0 as f32, t1 as f32) } else { (t1 as f32, t0 as f32) })
}

/// Degrees to radians.
#[inline]
pub fn radians(degrees: f32) -> f32 {
    degrees * (PI / 180.0)
}

/// Radians to degrees.
#[inline]
pub fn degrees(radians: f32) -> f32 {
    radians * (180.0 / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratic_roots_are_ordered_and_satisfy_the_equation() {
        let (t0, t1) = solve_quadratic(1.0, -3.0, 2.0).unwrap();
        assert_eq!((t0, t1), (1.0, 2.0));
        assert!(solve_quadratic(1.0, 0.0, 1.0).is_none());
        assert_eq!(solve_quadratic(0.0, 2.0, -4.0), Some((2.0, 2.0)));
        assert_eq!(solve_quadratic(1.0, 0.0, 0.0), Some((0.0, 0.0)));
    }

    #[test]
    fn products_do_not_cancel() {
        let (a, b) = (1.0 + f32::EPSILON, 1.0 - f32::EPSILON);
        assert_eq!(difference_of_products(a, b, 1.0, 1.0), -f32::EPSILON * f32::EPSILON);
    }

    #[test]
    fn smoothstep_ends() {
        assert_eq!(smoothstep(-1.0, 0.0, 1.0), 0.0);
        assert_eq!(smoothstep(0.5, 0.0, 1.0), 0.5);
        assert_eq!(smoothstep(2.0, 0.0, 1.0), 1.0);
    }
}
