//! Normal, Student and chi-square distributions: distribution functions and quantiles.

use super::special::{beta_regularized, erfc, gamma_lower_regularized};
use std::f64::consts::{SQRT_2, TAU};

/// Density of the standard normal distribution.
pub fn normal_pdf(x: f64) -> f64 {
    (-0.5 * x * x).exp() / TAU.sqrt()
}

/// Distribution function of the standard normal distribution.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * erfc(-x / SQRT_2)
}

/// The `x` with `normal_cdf(x) = p`; infinite at 0 and 1, NaN outside.
pub fn normal_quantile(p: f64) -> f64 {
    if p == 0.5 {
        return 0.0;
    }
    if p > 0.5 {
        // The upper tail has no room for small numbers next to one; the lower one has.
        return -normal_quantile(1.0 - p);
    }
    if p <= 0.0 || p.is_nan() {
        return if p == 0.0 { f64::NEG_INFINITY } else { f64::NAN };
    }
    // Abramowitz and Stegun 26.2.23 to start, then Newton in the logarithm, which converges in the tails as well.
    let t = (-2.0 * p.ln()).sqrt();
    let mut x = -(t
        - (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308))));
    for _ in 0..8 {
        let cdf = normal_cdf(x);
        let step = (cdf.ln() - p.ln()) * cdf / normal_pdf(x);
        x -= step;
        if step.abs() < 1e-15 * x.abs() {
            break;
        }
    }
    x
}

/// Distribution function of Student's distribution with `freedom` degrees of freedom.
pub fn student_t_cdf(t: f64, freedom: f64) -> f64 {
    let tail = 0.5 * beta_regularized(freedom / (freedom + t * t), 0.5 * freedom, 0.5);
    if t > 0.0 { 1.0 - tail } else { tail }
}

/// The `t` with `student_t_cdf(t) = p`; infinite at 0 and 1, NaN outside.
pub fn student_t_quantile(p: f64, freedom: f64) -> f64 {
    if p == 0.5 {
        return 0.0;
    }
    if p > 0.5 {
        return -student_t_quantile(1.0 - p, freedom);
    }
    if p <= 0.0 || p.is_nan() {
        return if p == 0.0 { f64::NEG_INFINITY } else { f64::NAN };
    }
    let mut low = -1.0;
    while student_t_cdf(low, freedom) > p && low > -1e300 {
        low *= 2.0;
    }
    bisect(low, 0.0, |t| student_t_cdf(t, freedom) > p)
}

/// Distribution function of the chi-square distribution with `freedom` degrees of freedom.
pub fn chi_square_cdf(x: f64, freedom: f64) -> f64 {
    gamma_lower_regularized(0.5 * freedom, 0.5 * x)
}

/// The `x` with `chi_square_cdf(x) = p`; infinite at 1, NaN outside `[0, 1]`.
pub fn chi_square_quantile(p: f64, freedom: f64) -> f64 {
    if !(0.0..1.0).contains(&p) {
        return if p == 1.0 { f64::INFINITY } else { f64::NAN };
    }
    let mut high = freedom.max(1.0);
    while chi_square_cdf(high, freedom) < p && high < 1e300 {
        high *= 2.0;
    }
    bisect(0.0, high, |x| chi_square_cdf(x, freedom) > p)
}

/// The point between `low` and `high` at which `above` turns true, to the last bit or two.
fn bisect(mut low: f64, mut high: f64, above: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        if above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit as judge;

    #[test]
    fn table_values() {
        assert!((normal_quantile(0.975) - 1.959_963_984_540_054).abs() < 1e-12);
        assert!((normal_quantile(1e-9) + 5.997_807_015_008_182).abs() < 1e-9);
        assert!((student_t_quantile(0.975, 10.0) - 2.228_138_851_964_939).abs() < 1e-9);
        assert!((student_t_quantile(0.75, 1.0) - 1.0).abs() < 1e-9);
        assert!((chi_square_quantile(0.95, 10.0) - 18.307_038_053_275_15).abs() < 1e-8);
        assert_eq!(normal_quantile(1.0), f64::INFINITY);
        assert!(normal_quantile(-0.1).is_nan() && student_t_quantile(1.5, 3.0).is_nan());
    }

    #[test]
    fn quantiles_invert_the_distribution_functions() {
        for i in 1..100 {
            let p = f64::from(i) / 100.0;
            assert!((normal_cdf(normal_quantile(p)) - p).abs() < 1e-13);
            for freedom in [1.0, 2.5, 7.0, 300.0] {
                assert!((student_t_cdf(student_t_quantile(p, freedom), freedom) - p).abs() < 1e-11);
                assert!((chi_square_cdf(chi_square_quantile(p, freedom), freedom) - p).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn two_independent_implementations_agree() {
        for i in 1..60 {
            let x = 0.37 * f64::from(i);
            for freedom in [1.0, 3.0, 18.5, 64.0] {
                let survival = 1.0 - chi_square_cdf(x, freedom);
                assert!((survival - judge::chi_square_survival(x, freedom)).abs() < 1e-12);
                let two_sided = 2.0 * student_t_cdf(-x, freedom);
                assert!((two_sided - judge::student_t_two_sided(x, freedom)).abs() < 1e-12);
            }
        }
    }
}
