//! What can be said about a mean, a variance and a slope from a sample.

use super::distributions::{chi_square_quantile, student_t_cdf, student_t_quantile};
use crate::distribution::VarianceEstimator;

/// A confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Whether `x` lies inside, ends included.
    pub fn contains(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Half of its length.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

/// Interval that covers the true mean with probability `confidence`, for independent and about normal numbers (Student).
///
/// It is the whole line with fewer than two numbers.
pub fn mean_interval(sample: &VarianceEstimator, confidence: f64) -> Interval {
    if sample.count() < 2 {
        return Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };
    }
    let t = student_t_quantile(0.5 + 0.5 * confidence, (sample.count() - 1) as f64);
    let half = t * sample.standard_error();
    Interval { low: sample.mean() - half, high: sample.mean() + half }
}

/// Interval that covers the true variance with probability `confidence`, for normal numbers (chi-square).
pub fn variance_interval(sample: &VarianceEstimator, confidence: f64) -> Interval {
    if sample.count() < 2 {
        return Interval { low: 0.0, high: f64::INFINITY };
    }
    let freedom = (sample.count() - 1) as f64;
    let sum = sample.variance() * freedom;
    Interval {
        low: sum / chi_square_quantile(0.5 + 0.5 * confidence, freedom),
        high: sum / chi_square_quantile(0.5 - 0.5 * confidence, freedom),
    }
}

/// Two-sided p-value of the hypothesis that the true mean is `reference` (Student).
pub fn mean_p_value(sample: &VarianceEstimator, reference: f64) -> f64 {
    let difference = (sample.mean() - reference).abs();
    if sample.count() < 2 || sample.variance() == 0.0 {
        return if difference == 0.0 { 1.0 } else { 0.0 };
    }
    2.0 * student_t_cdf(-difference / sample.standard_error(), (sample.count() - 1) as f64)
}

/// A straight line through points, by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regression {
    /// Slope.
    pub slope: f64,
    /// Value at zero.
    pub intercept: f64,
    /// Standard error of the slope; zero for two points.
    pub slope_error: f64,
    /// Fraction of the variance that the line explains.
    pub r_squared: f64,
    /// Number of points.
    pub count: usize,
}

impl Regression {
    /// Interval that covers the true slope with probability `confidence`; the whole line with fewer than three points.
    pub fn slope_interval(&self, confidence: f64) -> Interval {
        if self.count < 3 {
            return Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        let half = student_t_quantile(0.5 + 0.5 * confidence, (self.count - 2) as f64) * self.slope_error;
        Interval { low: self.slope - half, high: self.slope + half }
    }
}

/// Least squares through `(x, y)`; `None` with fewer than two points or without spread in x.
pub fn linear_regression(points: &[(f64, f64)]) -> Option<Regression> {
    let n = points.len() as f64;
    if points.len() < 2 {
        return None;
    }
    let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - mean_x, p.1 - mean_y)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if xx <= 0.0 || xx.is_nan() {
        return None;
    }
    let slope = xy / xx;
    let residual = sum(&|x, y| (y - slope * x) * (y - slope * x));
    let slope_error = if points.len() > 2 { (residual / (n - 2.0) / xx).sqrt() } else { 0.0 };
    let r_squared = if yy > 0.0 { 1.0 - residual / yy } else { 1.0 };
    Some(Regression { slope, intercept: mean_y - slope * mean_x, slope_error, r_squared, count: points.len() })
}

/// Slope of `log y` over `log x`: the order of convergence of an error `y` with `x` samples. Points that are not positive are left out.
pub fn log_log_slope(points: &[(f64, f64)]) -> Option<Regression> {
    let logs: Vec<_> = points.iter().filter(|p| p.0 > 0.0 && p.1 > 0.0).map(|p| (p.0.ln(), p.1.ln())).collect();
    linear_regression(&logs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::warp::square_to_normal_2d;

    #[test]
    fn intervals_cover_as_often_as_they_say() {
        let mut rng = Rng::new(4, 2);
        let (rounds, mut means, mut variances) = (4000, 0u32, 0u32);
        for _ in 0..rounds {
            let sample: VarianceEstimator =
                (0..8).map(|_| 3.0 + 2.0 * f64::from(square_to_normal_2d(rng.f32_2d())[0])).collect();
            means += u32::from(mean_interval(&sample, 0.9).contains(3.0));
            variances += u32::from(variance_interval(&sample, 0.9).contains(4.0));
        }
        // Binomial with deviation 19; six deviations, false alarm 4e-9.
        for hits in [means, variances] {
            assert!((f64::from(hits) - 3600.0).abs() < 6.0 * 19.0, "{hits} of {rounds} intervals cover the truth");
        }
    }

    #[test]
    fn p_value_and_interval_tell_the_same() {
        let sample: VarianceEstimator = [1.0, 2.0, 4.0, 3.5, 0.5].into_iter().collect();
        let interval = mean_interval(&sample, 0.95);
        assert!((mean_p_value(&sample, interval.low) - 0.05).abs() < 1e-9);
        assert!((mean_p_value(&sample, interval.high) - 0.05).abs() < 1e-9);
        assert!(!mean_interval(&VarianceEstimator::default(), 0.9).half_width().is_finite());
    }

    #[test]
    fn regression_finds_a_line_and_an_order_of_convergence() {
        let points: Vec<_> = (0..10).map(|i| (f64::from(i), 3.0 - 0.5 * f64::from(i))).collect();
        let line = linear_regression(&points).unwrap();
        assert!((line.slope + 0.5).abs() < 1e-12 && (line.intercept - 3.0).abs() < 1e-12);
        assert!(line.slope_interval(0.99).contains(-0.5) || line.slope_error < 1e-12);
        let errors: Vec<_> = (0..12).map(|k| (f64::from(1 << k), 7.0 / f64::from(1 << k).sqrt())).collect();
        assert!((log_log_slope(&errors).unwrap().slope + 0.5).abs() < 1e-12);
        // Anscombe's first quartet: slope 0.5 with standard error 0.118.
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let quartet: Vec<_> = x.into_iter().zip(y).collect();
        let line = linear_regression(&quartet).unwrap();
        assert!((line.slope - 0.500_091).abs() < 1e-5 && (line.slope_error - 0.117_905).abs() < 1e-5);
        assert!((line.r_squared - 0.666_542).abs() < 1e-5);
        assert!(linear_regression(&[(1.0, 1.0), (1.0, 2.0)]).is_none());
    }
}
