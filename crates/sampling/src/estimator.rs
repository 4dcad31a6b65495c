//! Estimators of integrals: Monte Carlo with importance, stratification and control variates, and quadrature rules to
//! compare them with. Integrands are closures on the unit interval, square or cube.

use crate::distribution::VarianceEstimator;
use crate::rng::Rng;

/// The Monte Carlo estimator: mean of `f / pdf` over `count` samples. `sample` returns a point and its density; `None` counts as zero.
///
/// The estimator is unbiased if the density is positive wherever `f` is not zero.
pub fn monte_carlo<T>(
    count: u64,
    mut sample: impl FnMut() -> Option<(T, f64)>,
    f: impl Fn(&T) -> f64,
) -> VarianceEstimator {
    (0..count)
        .map(|_| match sample() {
            Some((x, pdf)) if pdf > 0.0 => f(&x) / pdf,
            _ => 0.0,
        })
        .collect()
}

/// Uniform Monte Carlo in the unit cube of `D` dimensions.
pub fn uniform_monte_carlo<const D: usize>(
    count: u64,
    rng: &mut Rng,
    f: impl Fn(&[f64; D]) -> f64,
) -> VarianceEstimator {
    monte_carlo(count, || Some((std::array::from_fn(|_| rng.f64()), 1.0)), f)
}

/// Mean of `f` over a given point set: quasi-Monte Carlo if the points are a low-discrepancy sequence.
pub fn quasi_monte_carlo<P>(points: impl IntoIterator<Item = P>, f: impl Fn(&P) -> f64) -> f64 {
    points.into_iter().map(|p| f(&p)).collect::<VarianceEstimator>().mean()
}

/// An estimate with the variance of that estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its estimated variance.
    pub variance: f64,
}

/// Stratified sampling of the unit square: `per_stratum` samples in each cell of an `nx` by `ny` grid.
///
/// The variance is estimated within the strata, so it is zero for fewer than two samples each.
pub fn stratified_2d(nx: u32, ny: u32, per_stratum: u32, rng: &mut Rng, f: impl Fn([f64; 2]) -> f64) -> Estimate {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let strata = f64::from(nx) * f64::from(ny);
    let (mut value, mut variance) = (0.0, 0.0);
    for y in 0..ny {
        for x in 0..nx {
            let cell: VarianceEstimator = (0..per_stratum.max(1))
                .map(|_| f([(f64::from(x) + rng.f64()) / f64::from(nx), (f64::from(y) + rng.f64()) / f64::from(ny)]))
                .collect();
            value += cell.mean() / strata;
            variance += cell.variance_of_mean() / (strata * strata);
        }
    }
    Estimate { value, variance }
}

/// Control variate: estimates the integral of `f` from `(f, g)` pairs, where the integral of `g` is known to be `g_integral`.
///
/// The coefficient is the regression of `f` on `g` (bias of order `1/n`). `None` with fewer than three pairs.
pub fn control_variate(pairs: &[(f64, f64)], g_integral: f64) -> Option<Estimate> {
    let n = pairs.len() as f64;
    if pairs.len() < 3 {
        return None;
    }
    let points: Vec<_> = pairs.iter().map(|&(f, g)| (g, f)).collect();
    // Without any spread the control variate has nothing to tell.
    let slope = crate::statistics::linear_regression(&points).map_or(0.0, |line| line.slope);
    let corrected: VarianceEstimator = pairs.iter().map(|&(f, g)| f - slope * (g - g_integral)).collect();
    Some(Estimate { value: corrected.mean(), variance: corrected.variance() * (n - 1.0) / (n - 2.0) / n })
}

/// A quadrature rule on the unit interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quadrature {
    /// Midpoints of equal pieces; error of order `1/n^2`.
    Midpoint,
    /// Trapezoids over equal pieces; error of order `1/n^2`.
    Trapezoid,
    /// Parabolas over pairs of equal pieces (an odd count is made even); error of order `1/n^4`.
    Simpson,
}

impl Quadrature {
    /// Points and weights of the rule with `pieces` equal pieces; the weights sum to one.
    pub fn rule(self, pieces: u32) -> Vec<(f64, f64)> {
        let n = match self {
            Self::Simpson => pieces.max(2).next_multiple_of(2),
            _ => pieces.max(1),
        };
        let h = 1.0 / f64::from(n);
        let ends = |i: u32, middle: f64, end: f64| if i == 0 || i == n { end } else { middle };
        match self {
            Self::Midpoint => (0..n).map(|i| ((f64::from(i) + 0.5) * h, h)).collect(),
            Self::Trapezoid => (0..=n).map(|i| (f64::from(i) * h, ends(i, h, 0.5 * h))).collect(),
            Self::Simpson => (0..=n)
                .map(|i| (f64::from(i) * h, ends(i, if i % 2 == 1 { 4.0 } else { 2.0 }, 1.0) * h / 3.0))
                .collect(),
        }
    }

    /// Integral of `f` over the unit cube by the product of `D` rules with `pieces` pieces each: about `pieces^D` evaluations,
    /// which is the curse that Monte Carlo does not know.
    pub fn integrate<const D: usize>(self, pieces: u32, f: impl Fn(&[f64; D]) -> f64) -> f64 {
        let rule = self.rule(pieces);
        let mut digits = [0usize; D];
        let mut sum = 0.0;
        loop {
            let point = digits.map(|i| rule[i].0);
            sum += digits.iter().map(|&i| rule[i].1).product::<f64>() * f(&point);
            // Count up in base `rule.len()`.
            let Some(place) = digits.iter().position(|&i| i + 1 < rule.len()) else { return sum };
            digits[place] += 1;
            digits[..place].fill(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::{radical_inverse, sobol_02};
    use crate::statistics::{log_log_slope, mean_p_value};

    /// Integral of this over the unit square is `(e - 1)^2`.
    fn product_of_exponentials(p: &[f64; 2]) -> f64 {
        (p[0] + p[1]).exp()
    }

    fn truth() -> f64 {
        (std::f64::consts::E - 1.0) * (std::f64::consts::E - 1.0)
    }

    #[test]
    fn quadrature_has_its_order() {
        for (rule, order) in [(Quadrature::Midpoint, -2.0), (Quadrature::Trapezoid, -2.0), (Quadrature::Simpson, -4.0)]
        {
            let errors: Vec<_> = [4u32, 8, 16, 32]
                .map(|n| (f64::from(n), (rule.integrate(n, product_of_exponentials) - truth()).abs()))
                .to_vec();
            let slope = log_log_slope(&errors).unwrap().slope;
            assert!((slope - order).abs() < 0.05, "{rule:?} converges with order {slope}");
        }
        assert!((Quadrature::Simpson.integrate(3, |p: &[f64; 1]| p[0] * p[0] * p[0]) - 0.25).abs() < 1e-15);
        assert!((Quadrature::Midpoint.integrate(2, |_: &[f64; 0]| 7.0) - 7.0).abs() < 1e-15);
    }

    #[test]
    fn monte_carlo_is_unbiased_and_importance_helps() {
        let mut rng = Rng::new(1, 9);
        let uniform = uniform_monte_carlo(20_000, &mut rng, |x: &[f64; 1]| 3.0 * x[0] * x[0]);
        // Density 2x, by the square root.
        let important = monte_carlo(
            20_000,
            || {
                let x = (1.0 - rng.f64()).sqrt();
                Some((x, 2.0 * x))
            },
            |x| 3.0 * x * x,
        );
        assert!(mean_p_value(&uniform, 1.0) > 1e-9 && mean_p_value(&important, 1.0) > 1e-9);
        // Exact variances: 4/5 and 1/8.
        assert!((uniform.variance() - 0.8).abs() < 0.05 && (important.variance() - 0.125).abs() < 0.01);
        let failing = monte_carlo(1000, || (rng.f64() < 0.5).then_some((1.0, 0.5)), |&x| x);
        assert!(mean_p_value(&failing, 1.0) > 1e-9);
    }

    #[test]
    fn stratification_and_control_variates_reduce_variance() {
        let mut rng = Rng::new(2, 9);
        let f = |p: [f64; 2]| product_of_exponentials(&p);
        let plain = uniform_monte_carlo(512, &mut rng, product_of_exponentials);
        let stratified = stratified_2d(16, 16, 2, &mut rng, f);
        assert!(stratified.variance < 0.02 * plain.variance_of_mean());
        assert!((stratified.value - truth()).abs() < 7.0 * stratified.variance.sqrt());
        let pairs: Vec<_> = (0..512)
            .map(|_| {
                let p = [rng.f64(), rng.f64()];
                (f(p), p[0] + p[1])
            })
            .collect();
        let controlled = control_variate(&pairs, 1.0).unwrap();
        assert!(controlled.variance < 0.1 * plain.variance_of_mean());
        assert!((controlled.value - truth()).abs() < 7.0 * controlled.variance.sqrt());
    }

    #[test]
    fn quasi_monte_carlo_beats_the_square_root() {
        let points = |n: u32| (0..n).map(|i| sobol_02(i).map(|b| f64::from(b) / 4_294_967_296.0));
        let errors: Vec<_> = [64u32, 256, 1024, 4096]
            .map(|n| (f64::from(n), (quasi_monte_carlo(points(n), product_of_exponentials) - truth()).abs()))
            .to_vec();
        assert!(log_log_slope(&errors).unwrap().slope < -0.8, "{errors:?}");
        let halton = (0..4096u64).map(|i| [2, 3].map(|b| f64::from(radical_inverse(b, i))));
        assert!((quasi_monte_carlo(halton, product_of_exponentials) / truth() - 1.0).abs() < 3e-3);
    }
}
