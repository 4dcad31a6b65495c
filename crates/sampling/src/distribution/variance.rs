//! Mean and variance of a stream of numbers in one pass (Welford 1962), mergeable (Chan, Golub and LeVeque 1979).

/// Running mean and variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VarianceEstimator {
    mean: f64,
    /// Sum of squared deviations from the mean.
    deviation: f64,
    count: u64,
}

impl VarianceEstimator {
    /// Takes one more number.
    #[inline]
    pub fn add(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.deviation += delta * (x - self.mean);
    }

    /// Takes all the numbers that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (n, m) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        self.deviation += other.deviation + delta * delta * n * m / (n + m);
        self.mean += delta * m / (n + m);
        self.count += other.count;
    }

    /// Number of numbers taken.
    #[inline]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; zero if there are none.
    #[inline]
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance of one number; zero if there are fewer than two.
    #[inline]
    pub fn variance(&self) -> f64 {
        if self.count > 1 { self.deviation / (self.count - 1) as f64 } else { 0.0 }
    }

    /// Variance of the mean, if the numbers are independent.
    #[inline]
    pub fn variance_of_mean(&self) -> f64 {
        if self.count > 0 { self.variance() / self.count as f64 } else { 0.0 }
    }

    /// Standard error of the mean, if the numbers are independent.
    #[inline]
    pub fn standard_error(&self) -> f64 {
        self.variance_of_mean().sqrt()
    }

    /// Standard error relative to the mean; infinite for a mean of zero.
    #[inline]
    pub fn relative_error(&self) -> f64 {
        if self.count < 1 || self.deviation == 0.0 { 0.0 } else { self.standard_error() / self.mean.abs() }
    }
}

impl Extend<f64> for VarianceEstimator {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, numbers: T) {
        for x in numbers {
            self.add(x);
        }
    }
}

impl FromIterator<f64> for VarianceEstimator {
    fn from_iter<T: IntoIterator<Item = f64>>(numbers: T) -> Self {
        let mut estimator = Self::default();
        estimator.extend(numbers);
        estimator
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_large_offset_and_merge() {
        let data = [4.0, 7.0, 13.0, 16.0].map(|x| x + 1e9);
        let all: VarianceEstimator = data.into_iter().collect();
        assert_eq!((all.mean(), all.variance(), all.count()), (1e9 + 10.0, 30.0, 4));
        assert!((all.standard_error() - 7.5f64.sqrt()).abs() < 1e-9);
        let mut left: VarianceEstimator = data[..1].iter().copied().collect();
        let right: VarianceEstimator = data[1..].iter().copied().collect();
        left.merge(&VarianceEstimator::default());
        left.merge(&right);
        assert_eq!(left.mean(), all.mean());
        assert!((left.variance() - 30.0).abs() < 1e-6);
        assert_eq!(VarianceEstimator::default().variance_of_mean(), 0.0);
    }
}
