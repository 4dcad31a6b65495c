//! Tests of a mean against a reference, and corrections for many tests at once.

use crate::special::{erfc, student_t_two_sided};

/// Two-sided p-value of a normally distributed `mean` with known `variance_of_mean` when `reference` is true.
///
/// With no variance the p-value is 1 for equality and 0 for anything else.
pub fn z_test(mean: f64, variance_of_mean: f64, reference: f64) -> f64 {
    let difference = (mean - reference).abs();
    if variance_of_mean <= 0.0 {
        return if difference == 0.0 { 1.0 } else { 0.0 };
    }
    erfc(difference / (2.0 * variance_of_mean).sqrt())
}

/// Two-sided p-value (Student) of the mean of `count` numbers with sample variance `variance` when `reference` is true.
pub fn t_test(mean: f64, variance: f64, count: u64, reference: f64) -> f64 {
    let difference = (mean - reference).abs();
    if count < 2 || variance <= 0.0 {
        return if difference == 0.0 { 1.0 } else { 0.0 };
    }
    student_t_two_sided(difference / (variance / count as f64).sqrt(), (count - 1) as f64)
}

/// Significance of each of `tests` independent tests such that all together raise a false alarm with probability `significance`.
pub fn sidak(significance: f64, tests: u32) -> f64 {
    // 1 - (1 - s)^(1/n), without cancellation
    -((-significance).ln_1p() / f64::from(tests.max(1))).exp_m1()
}

/// As [`sidak`], for tests that may depend on each other.
pub fn bonferroni(significance: f64, tests: u32) -> f64 {
    significance / f64::from(tests.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_quantiles() {
        assert!((z_test(1.959_963_985, 1.0, 0.0) - 0.05).abs() < 1e-9);
        assert!((t_test(2.228_138_85, 11.0, 11, 0.0) - 0.05).abs() < 1e-8);
        assert_eq!(z_test(1.0, 0.0, 1.0), 1.0);
        assert_eq!(t_test(1.0, 0.0, 5, 2.0), 0.0);
        assert!((sidak(0.05, 10) - 0.005_116_196_891_823_743).abs() < 1e-15);
        assert!(sidak(1e-6, 3) > bonferroni(1e-6, 3));
    }
}
