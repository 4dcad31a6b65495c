//! The few distributions that the decision needs, in double precision.

use std::f64::consts::PI;

/// Probability that a standard normal variable is farther from zero than `z`.
pub(super) fn two_sided_tail(z: f64) -> f64 {
    let z = z.abs();
    if z < 2.5 {
        // Series of the error function (Abramowitz and Stegun 26.2.11).
        let (mut term, mut sum) = (z, z);
        for k in 1..100 {
            term *= z * z / f64::from(2 * k + 1);
            sum += term;
        }
        return (1.0 - 2.0 * sum * (-0.5 * z * z).exp() / (2.0 * PI).sqrt()).max(0.0);
    }
    // Continued fraction of Mills' ratio (26.2.14), from the back.
    let mut fraction = z;
    for k in (1..200).rev() {
        fraction = z + f64::from(k) / fraction;
    }
    2.0 * (-0.5 * z * z).exp() / ((2.0 * PI).sqrt() * fraction)
}

/// The `z` with `two_sided_tail(z) == p`.
pub(super) fn z_limit(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 38.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if two_sided_tail(middle) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The normal deviate that is as improbable as `t` is in Student's distribution of `dof` degrees of freedom (Wallace 1959).
pub(super) fn normal_from_t(t: f64, dof: f64) -> f64 {
    let nu = dof.max(1.0);
    (nu * (t * t / nu).ln_1p()).sqrt() * (8.0 * nu + 1.0) / (8.0 * nu + 3.0)
}

/// The normal deviate of a sum of squares that is `mean` per term over `terms` terms, not below zero (Wilson and Hilferty 1931).
pub(super) fn normal_from_chi2(mean: f64, terms: usize) -> f64 {
    let spread = 2.0 / (9.0 * terms as f64);
    ((mean.cbrt() - (1.0 - spread)) / spread.sqrt()).max(0.0)
}

/// A variance and how many degrees of freedom it was estimated with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    pub(super) variance: f64,
    pub(super) dof: f64,
}

impl Spread {
    /// Variance of a sum of independent terms, with Welch and Satterthwaite's degrees of freedom.
    pub(super) fn sum(parts: impl Iterator<Item = Spread>) -> Spread {
        let (mut variance, mut inverse) = (0.0, 0.0);
        for p in parts {
            variance += p.variance;
            inverse += p.variance * p.variance / p.dof.max(1e-9);
        }
        Spread { variance, dof: if inverse > 0.0 { variance * variance / inverse } else { 1e9 } }
    }

    /// The same, of the sum divided by `n`.
    pub(super) fn over(self, n: f64) -> Spread {
        Spread { variance: self.variance / (n * n), ..self }
    }
}

/// Mean and unbiased variance.
pub(super) fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n.max(1.0);
    let squares: f64 = values.map(|v| (v - mean) * (v - mean)).sum();
    (mean, if n > 1.0 { squares / (n - 1.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_have_their_tabulated_values() {
        for (z, p) in [(1.0, 0.317_310_507_863), (1.959_963_985, 0.05), (3.290_526_73, 0.001), (6.0, 1.973_175_29e-9)] {
            assert!((two_sided_tail(z) / p - 1.0).abs() < 1e-8, "{z}: {}", two_sided_tail(z));
            assert!((z_limit(p) - z).abs() < 1e-7, "{p}");
        }
    }

    #[test]
    fn deviates_of_t_and_chi_square() {
        // Student's t of 15 degrees of freedom exceeds 4.0728 with probability 0.001, as a normal deviate exceeds 3.2905.
        assert!((normal_from_t(4.0728, 15.0) - 3.2905).abs() < 0.01);
        // Chi-square of 100 degrees of freedom exceeds 149.449 with probability 0.001, a one-sided deviate of 3.0902.
        assert!((normal_from_chi2(1.49449, 100) - 3.0902).abs() < 0.01);
        assert_eq!(normal_from_chi2(0.5, 100), 0.0);
    }

    #[test]
    fn spreads_add() {
        let s = Spread::sum([Spread { variance: 1.0, dof: 10.0 }, Spread { variance: 1.0, dof: 10.0 }].into_iter());
        assert_eq!((s.variance, s.dof), (2.0, 20.0));
    }
}
