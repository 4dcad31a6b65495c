//! Elementary functions with the same bits on every platform.
//!
//! Arguments are reduced and polynomials evaluated in `f64` with a fixed order of operations; the result is rounded
//! once to `f32`. That is accurate to about one unit in the last place and costs a few dozen cycles, without tables.
//! Method: Cody and Waite 1980 (argument reduction), Taylor and atanh series truncated below `f32` precision.

const FRAC_2_PI: f64 = std::f64::consts::FRAC_2_PI;
const FRAC_PI_2: f64 = std::f64::consts::FRAC_PI_2;
const FRAC_PI_4: f64 = std::f64::consts::FRAC_PI_4;
const PI: f64 = std::f64::consts::PI;

/// Adding and subtracting this rounds a double of magnitude below 2^51 to the nearest integer.
const ROUND: f64 = 6_755_399_441_055_744.0;

#[inline(always)]
fn sin_kernel(x: f64) -> f64 {
    let z = x * x;
    let p = -1.0 / 39_916_800.0;
    let p = p * z + 1.0 / 362_880.0;
    let p = p * z - 1.0 / 5_040.0;
    let p = p * z + 1.0 / 120.0;
    let p = p * z - 1.0 / 6.0;
    x + x * z * p
}

#[inline(always)]
fn cos_kernel(x: f64) -> f64 {
    let z = x * x;
    let p = 1.0 / 479_001_600.0;
    let p = p * z - 1.0 / 3_628_800.0;
    let p = p * z + 1.0 / 40_320.0;
    let p = p * z - 1.0 / 720.0;
    let p = p * z + 1.0 / 24.0;
    let p = p * z - 0.5;
    1.0 + z * p
}

/// Sine and cosine of `x` radians. Loses accuracy gracefully beyond `|x| > 1e6`; infinities give NaN.
#[inline(always)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let (s, c) = sin_cos_f64(f64::from(x));
    (s as f32, c as f32)
}

/// Sine and cosine accurate to about 1e-11; exact at multiples of a quarter turn.
#[inline(always)]
pub(crate) fn sin_cos_f64(x: f64) -> (f64, f64) {
    let rounded = x * FRAC_2_PI + ROUND;
    let k = rounded - ROUND;
    let r = x - k * FRAC_PI_2;
    let (s, c) = (sin_kernel(r), cos_kernel(r));
    // Only the quadrant matters: the lowest bits of the rounded number. Infinities are NaN already in `r`.
    let quadrant = rounded.to_bits() & 3;
    let (s, c) = if quadrant & 1 == 1 { (c, s) } else { (s, c) };
    let s = if quadrant & 2 == 2 { -s } else { s };
    let c = if (quadrant + 1) & 2 == 2 { -c } else { c };
    (s, c)
}

/// Sine of `x` radians.
#[inline]
pub fn sin(x: f32) -> f32 {
    sin_cos(x).0
}

/// Cosine of `x` radians.
#[inline]
pub fn cos(x: f32) -> f32 {
    sin_cos(x).1
}

/// Tangent of `x` radians.
#[inline]
pub fn tan(x: f32) -> f32 {
    let (s, c) = sin_cos(x);
    s / c
}

#[inline(always)]
fn atan_f64(x: f64) -> f64 {
    let a = x.abs();
    // Reduce to |r| <= tan(pi / 8).
    let (r, base) = if a > 2.414_213_562_373_095 {
        (-1.0 / a, FRAC_PI_2)
    } else if a > 0.414_213_562_373_095 {
        ((a - 1.0) / (a + 1.0), FRAC_PI_4)
    } else {
        (a, 0.0)
    };
    let z = r * r;
    let mut p = 0.0;
    let mut n = 21;
    while n >= 3 {
        p = (if n % 4 == 1 { 1.0 } else { -1.0 }) / f64::from(n) + z * p;
        n -= 2;
    }
    (base + (r + r * z * p)).copysign(x)
}

/// Arc tangent, in `[-pi/2, pi/2]`.
#[inline(always)]
pub fn atan(x: f32) -> f32 {
    atan_f64(f64::from(x)) as f32
}

/// The angle of the point `(x, y)`, in `[-pi, pi]`; zero at the origin.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (y, x) = (f64::from(y), f64::from(x));
    if y == 0.0 {
        return if x < 0.0 || (x == 0.0 && x.is_sign_negative()) { PI.copysign(y) as f32 } else { y as f32 };
    }
    let t = if x.is_infinite() && y.is_infinite() { FRAC_PI_4.copysign(y * x.signum()) } else { atan_f64(y / x) };
    (if x < 0.0 { t + PI.copysign(y) } else { t }) as f32
}

/// Arc sine, in `[-pi/2, pi/2]`; NaN outside `[-1, 1]`.
#[inline]
pub fn asin(x: f32) -> f32 {
    let x = f64::from(x);
    atan_f64(x / ((1.0 - x) * (1.0 + x)).sqrt()) as f32
}

/// Arc cosine, in `[0, pi]`; NaN outside `[-1, 1]`.
#[inline]
pub fn acos(x: f32) -> f32 {
    let x = f64::from(x);
    if x == -1.0 {
        return PI as f32;
    }
    // Half-angle form: no cancellation near 1.
    (2.0 * atan_f64((1.0 - x).sqrt() / (1.0 + x).sqrt())) as f32
}

#[inline]
fn exp2_f64(x: f64) -> f32 {
    if x < -150.0 {
        return 0.0;
    }
    if x > 128.0 {
        return f32::INFINITY;
    }
    let k = (x + ROUND) - ROUND;
    let f = (x - k) * std::f64::consts::LN_2;
    let p = 1.0 / 40_320.0;
    let p = p * f + 1.0 / 5_040.0;
    let p = p * f + 1.0 / 720.0;
    let p = p * f + 1.0 / 120.0;
    let p = p * f + 1.0 / 24.0;
    let p = p * f + 1.0 / 6.0;
    let p = p * f + 0.5;
    let p = 1.0 + f * (1.0 + f * p);
    if p.is_nan() {
        return f32::NAN;
    }
    (p * f64::from_bits(((k as i64 + 1023) as u64) << 52)) as f32
}

/// `2^x`.
#[inline]
pub fn exp2(x: f32) -> f32 {
    exp2_f64(f64::from(x))
}

/// `e^x`.
#[inline]
pub fn exp(x: f32) -> f32 {
    exp2_f64(f64::from(x) * std::f64::consts::LOG2_E)
}

/// The natural logarithm of a positive, finite `x`, in double precision.
#[inline]
fn ln_f64(x: f32) -> f64 {
    // Every positive f32, subnormal or not, is a normal f64.
    let bits = f64::from(x).to_bits();
    let mut exponent = (bits >> 52) as i64 - 1023;
    let mut m = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) | (1023 << 52));
    if m > std::f64::consts::SQRT_2 {
        m *= 0.5;
        exponent += 1;
    }
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let p = 1.0 / 13.0;
    let p = p * z + 1.0 / 11.0;
    let p = p * z + 1.0 / 9.0;
    let p = p * z + 1.0 / 7.0;
    let p = p * z + 1.0 / 5.0;
    let p = p * z + 1.0 / 3.0;
    let p = p * z + 1.0;
    exponent as f64 * std::f64::consts::LN_2 + 2.0 * s * p
}

/// Natural logarithm; negative infinity at zero, NaN below.
#[inline]
pub fn ln(x: f32) -> f32 {
    if x > 0.0 && x < f32::INFINITY {
        ln_f64(x) as f32
    } else if x == 0.0 {
        f32::NEG_INFINITY
    } else if x > 0.0 {
        x
    } else {
        f32::NAN
    }
}

/// Base-2 logarithm; negative infinity at zero, NaN below.
#[inline]
pub fn log2(x: f32) -> f32 {
    if x > 0.0 && x < f32::INFINITY { (ln_f64(x) * std::f64::consts::LOG2_E) as f32 } else { ln(x) }
}

/// `x^y` for `x >= 0`; NaN for a negative `x`, 1 for `y == 0`.
#[inline]
pub fn powf(x: f32, y: f32) -> f32 {
    if y == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x > 0.0 && x < f32::INFINITY {
        exp2_f64(ln_f64(x) * std::f64::consts::LOG2_E * f64::from(y))
    } else if x == 0.0 || x == f32::INFINITY {
        if (x == 0.0) == (y > 0.0) { 0.0 } else { f32::INFINITY }
    } else {
        f32::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in units in the last place of the correctly rounded result.
    fn ulps(a: f32, exact: f64) -> f64 {
        let b = exact as f32;
        let ulp = f64::from(f32::from_bits(b.abs().max(1e-30).to_bits() + 1)) - f64::from(b.abs().max(1e-30));
        (f64::from(a) - exact).abs() / ulp
    }

    #[test]
    fn within_one_ulp_of_the_exact_value() {
        for i in -20_000..20_000 {
            let x = i as f32 * 0.003_17;
            let d = f64::from(x);
            // Near a zero of sine the absolute error is what can be kept.
            assert!(ulps(sin(x), d.sin()) < 1.0 || (f64::from(sin(x)) - d.sin()).abs() < 1e-9, "sin {x}");
            assert!(ulps(cos(x), d.cos()) < 1.0 || (f64::from(cos(x)) - d.cos()).abs() < 1e-9, "cos {x}");
            assert!(ulps(atan(x), d.atan()) < 1.0, "atan {x}");
            assert!(ulps(exp(x), d.exp()) < 1.0, "exp {x}: {} {}", exp(x), d.exp());
            assert!(ulps(exp2(x), d.exp2()) < 1.0, "exp2 {x}");
            if x > 0.0 {
                assert!(ulps(ln(x), d.ln()) < 1.0 || (f64::from(ln(x)) - d.ln()).abs() < 1e-9, "ln {x}");
                assert!(ulps(log2(x), d.log2()) < 1.0 || (f64::from(log2(x)) - d.log2()).abs() < 1e-9, "log2 {x}");
                assert!(ulps(powf(x, 2.4), d.powf(f64::from(2.4f32))) < 1.0, "powf {x}");
            }
            let u = x / 64.0;
            if u.abs() <= 1.0 {
                let d = f64::from(u);
                assert!(ulps(asin(u), d.asin()) < 1.0, "asin {u}");
                assert!(ulps(acos(u), d.acos()) < 1.0 || (f64::from(acos(u)) - d.acos()).abs() < 1e-7, "acos {u}");
            }
        }
    }

    #[test]
    fn ends_of_the_domain() {
        assert_eq!(exp(f32::NEG_INFINITY), 0.0);
        assert_eq!(exp(200.0), f32::INFINITY);
        assert!(exp(f32::NAN).is_nan());
        assert_eq!(ln(0.0), f32::NEG_INFINITY);
        assert!(ln(-1.0).is_nan());
        assert_eq!(powf(0.0, 2.0), 0.0);
        assert_eq!(powf(0.0, -1.0), f32::INFINITY);
        assert_eq!(powf(0.0, 0.0), 1.0);
        assert_eq!(acos(1.0), 0.0);
        assert_eq!(acos(-1.0), std::f32::consts::PI);
        assert_eq!(asin(1.0), std::f32::consts::FRAC_PI_2);
        assert_eq!(atan2(0.0, -1.0), std::f32::consts::PI);
        assert_eq!(atan2(1.0, 0.0), std::f32::consts::FRAC_PI_2);
        assert!(sin(f32::INFINITY).is_nan());
        for (y, x) in [(1.0f32, 2.0f32), (-1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (3.0, -0.1)] {
            assert!((atan2(y, x) - (f64::from(y).atan2(f64::from(x)) as f32)).abs() < 1e-6);
        }
    }
}
