//! One-dimensional densities with closed inverses, and their products: linear, tent, exponential, equiangular, normal, smooth step, bilinear.

use steradian_math::{ONE_MINUS_EPSILON, SQRT_2, TAU, atan, exp, lerp, ln, sin_cos, smoothstep, tan};

/// Number in `[0, 1)` with density proportional to the line from `a` (at 0) to `b` (at 1); both at least zero, not both zero.
#[inline(always)]
pub fn unit_to_linear(u: f32, a: f32, b: f32) -> f32 {
    if u == 0.0 && a == 0.0 {
        return 0.0;
    }
    // The stable solution of the quadratic: nothing cancels when a and b are nearly equal.
    (u * (a + b) / (a + lerp(u, a * a, b * b).sqrt())).min(ONE_MINUS_EPSILON)
}

/// Density of [`unit_to_linear`].
#[inline]
pub fn unit_to_linear_pdf(x: f32, a: f32, b: f32) -> f32 {
    if (0.0..=1.0).contains(&x) { 2.0 * lerp(x, a, b) / (a + b) } else { 0.0 }
}

/// Inverse of [`unit_to_linear`].
#[inline]
pub fn linear_to_unit(x: f32, a: f32, b: f32) -> f32 {
    x * (a * (2.0 - x) + b * x) / (a + b)
}

/// Number in `(-r, r)` with density proportional to `r - |x|`.
#[inline]
pub fn unit_to_tent(u: f32, r: f32) -> f32 {
    if u < 0.5 { -r + r * (2.0 * u).sqrt() } else { r - r * (2.0 - 2.0 * u).sqrt() }
}

/// Density of [`unit_to_tent`].
#[inline]
pub fn unit_to_tent_pdf(x: f32, r: f32) -> f32 {
    if x.abs() < r { (r - x.abs()) / (r * r) } else { 0.0 }
}

/// Inverse of [`unit_to_tent`].
#[inline]
pub fn tent_to_unit(x: f32, r: f32) -> f32 {
    let t = x / r;
    if t < 0.0 { 0.5 * (1.0 + t) * (1.0 + t) } else { 1.0 - 0.5 * (1.0 - t) * (1.0 - t) }
}

/// Number of at least zero with density `rate * exp(-rate x)`.
#[inline]
pub fn unit_to_exponential(u: f32, rate: f32) -> f32 {
    // 1 - u is exact since random numbers are multiples of 2^-24, and it is never zero.
    -ln(1.0 - u) / rate
}

/// Density of [`unit_to_exponential`].
#[inline]
pub fn unit_to_exponential_pdf(x: f32, rate: f32) -> f32 {
    if x >= 0.0 { rate * exp(-rate * x) } else { 0.0 }
}

/// Inverse of [`unit_to_exponential`].
#[inline]
pub fn exponential_to_unit(x: f32, rate: f32) -> f32 {
    1.0 - exp(-rate * x)
}

/// Number between `a` and `b` with a density in proportion to `1 / (distance^2 + x^2)`: evenly by the angle under which points of a line are seen
/// from `distance` > 0 beside its zero (Kulla and Fajardo 2012). Either end may be infinite.
#[inline]
pub fn unit_to_equiangular(u: f32, a: f32, b: f32, distance: f32) -> f32 {
    let (from, to) = (atan(a / distance), atan(b / distance));
    (distance * tan(from + (to - from) * u)).clamp(a, b)
}

/// Density of [`unit_to_equiangular`].
#[inline]
pub fn unit_to_equiangular_pdf(x: f32, a: f32, b: f32, distance: f32) -> f32 {
    let angle = atan(b / distance) - atan(a / distance);
    if (a..=b).contains(&x) { distance / (angle * (distance * distance + x * x)) } else { 0.0 }
}

/// Inverse of [`unit_to_equiangular`].
#[inline]
pub fn equiangular_to_unit(x: f32, a: f32, b: f32, distance: f32) -> f32 {
    let (from, to) = (atan(a / distance), atan(b / distance));
    (atan(x / distance) - from) / (to - from)
}

/// Normally distributed number by inversion, with Giles' single-precision inverse error function (2012).
#[inline]
pub fn unit_to_normal(u: f32, mean: f32, sigma: f32) -> f32 {
    mean + sigma * SQRT_2 * inverse_erf(2.0 * u.clamp(f32::EPSILON * 0.5, ONE_MINUS_EPSILON) - 1.0)
}

/// Density of [`unit_to_normal`].
#[inline]
pub fn unit_to_normal_pdf(x: f32, mean: f32, sigma: f32) -> f32 {
    let t = (x - mean) / sigma;
    exp(-0.5 * t * t) / (sigma * TAU.sqrt())
}

/// Inverse of [`unit_to_normal`], to about 1e-7 (Abramowitz and Stegun 7.1.26).
#[inline]
pub fn normal_to_unit(x: f32, mean: f32, sigma: f32) -> f32 {
    let z = (x - mean) / (sigma * SQRT_2);
    let t = 1.0 / (1.0 + 0.327_591_1 * z.abs());
    let polynomial = t * (0.254_829_6 + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152_1 + t * 1.061_405_4))));
    let tail = 0.5 * polynomial * exp(-z * z);
    if z < 0.0 { tail } else { 1.0 - tail }
}

/// Two independent standard normal numbers (Box and Muller 1958).
#[inline]
pub fn square_to_normal_2d(u: [f32; 2]) -> [f32; 2] {
    let r = (-2.0 * ln(1.0 - u[0])).sqrt();
    let (sin, cos) = sin_cos(TAU * u[1]);
    [r * cos, r * sin]
}

/// Density of [`square_to_normal_2d`].
#[inline]
pub fn square_to_normal_2d_pdf(p: [f32; 2]) -> f32 {
    exp(-0.5 * (p[0] * p[0] + p[1] * p[1])) / TAU
}

fn inverse_erf(x: f32) -> f32 {
    let w = -ln((1.0 - x) * (1.0 + x));
    let horner = |w: f32, c: &[f32]| c.iter().fold(0.0, |p, &c| p * w + c);
    let p = if w < 5.0 {
        const CENTRAL: [f32; 9] = [
            2.810_226_4e-8,
            3.432_739_4e-7,
            -3.523_387_7e-6,
            -4.391_506_5e-6,
            2.185_808_7e-4,
            -1.253_725_e-3,
            -4.177_681_6e-3,
            2.466_407_3e-1,
            1.501_409_4,
        ];
        horner(w - 2.5, &CENTRAL)
    } else {
        const TAIL: [f32; 9] = [
            -2.002_142_6e-4,
            1.009_505_6e-4,
            1.349_343_2e-3,
            -3.673_428_4e-3,
            5.739_507_7e-3,
            -7.622_461_3e-3,
            9.438_870_5e-3,
            1.001_674_1,
            2.832_976_8,
        ];
        horner(w.sqrt() - 3.0, &TAIL)
    };
    p * x
}

/// Number in `[a, b)` with density proportional to the cubic smooth step from `a` to `b`.
#[inline]
pub fn unit_to_smooth_step(u: f32, a: f32, b: f32) -> f32 {
    // The distribution function is t^3 (2 - t). Newton from cbrt-like starts may leave the interval, so it is bracketed.
    let (mut low, mut high, mut t) = (0.0f32, 1.0f32, 0.5f32);
    for _ in 0..32 {
        let error = t * t * t * (2.0 - t) - u;
        if error > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let slope = t * t * (6.0 - 4.0 * t);
        let newton = t - error / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == t {
            break;
        }
        t = next;
    }
    lerp(t.min(ONE_MINUS_EPSILON), a, b)
}

/// Density of [`unit_to_smooth_step`].
#[inline]
pub fn unit_to_smooth_step_pdf(x: f32, a: f32, b: f32) -> f32 {
    if x < a || x > b { 0.0 } else { 2.0 * smoothstep(x, a, b) / (b - a) }
}

/// Inverse of [`unit_to_smooth_step`].
#[inline]
pub fn smooth_step_to_unit(x: f32, a: f32, b: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * t * (2.0 - t)
}

/// Point of the unit square with density proportional to the bilinear interpolant of the corner values
/// `w` at (0,0), (1,0), (0,1), (1,1).
#[inline(always)]
pub fn square_to_bilinear(u: [f32; 2], w: [f32; 4]) -> [f32; 2] {
    let y = unit_to_linear(u[1], w[0] + w[1], w[2] + w[3]);
    [unit_to_linear(u[0], lerp(y, w[0], w[2]), lerp(y, w[1], w[3])), y]
}

/// Density of [`square_to_bilinear`]; uniform if all corners are zero.
#[inline(always)]
pub fn square_to_bilinear_pdf(p: [f32; 2], w: [f32; 4]) -> f32 {
    let inside = (0.0..=1.0).contains(&p[0]) & (0.0..=1.0).contains(&p[1]);
    if !inside {
        return 0.0;
    }
    let sum = w[0] + w[1] + w[2] + w[3];
    if sum == 0.0 {
        return 1.0;
    }
    4.0 * lerp(p[1], lerp(p[0], w[0], w[1]), lerp(p[0], w[2], w[3])) / sum
}

/// Inverse of [`square_to_bilinear`].
#[inline]
pub fn bilinear_to_square(p: [f32; 2], w: [f32; 4]) -> [f32; 2] {
    [
        linear_to_unit(p[0], lerp(p[1], w[0], w[2]), lerp(p[1], w[1], w[3])),
        linear_to_unit(p[1], w[0] + w[1], w[2] + w[3]),
    ]
}
