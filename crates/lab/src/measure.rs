//! Measuring errors and how they fall: root mean squares over repeats, slopes with intervals, spectra.

use crate::claim::z_limit;
use steradian_sampling::VarianceEstimator;
use steradian_sampling::statistics::Interval;

/// The error of an estimator with `n` samples, from repeats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorAt {
    /// Samples.
    pub n: f64,
    /// Mean of the squared error.
    pub mean_square: f64,
    /// Standard error of that mean, relative to it.
    pub relative: f64,
    /// Mean of the signed error.
    pub bias: f64,
}

impl ErrorAt {
    /// From the signed errors of independent repeats.
    pub fn of(n: f64, errors: impl IntoIterator<Item = f64>) -> Self {
        let (mut squares, mut signed) = (VarianceEstimator::default(), VarianceEstimator::default());
        for e in errors {
            squares.add(e * e);
            signed.add(e);
        }
        Self { n, mean_square: squares.mean(), relative: squares.relative_error(), bias: signed.mean() }
    }

    /// Root of the mean square.
    pub fn rms(&self) -> f64 {
        self.mean_square.sqrt()
    }
}

/// The order of convergence of a root-mean-square error: slope of its logarithm over that of `n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// The slope.
    pub value: f64,
    /// Its standard error, from the scatter of the repeats.
    pub standard_error: f64,
}

impl Slope {
    /// The interval that covers the true slope but for one time in ten million.
    pub fn interval(&self) -> Interval {
        let half = z_limit() * self.standard_error;
        Interval { low: self.value - half, high: self.value + half }
    }
}

impl std::fmt::Display for Slope {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.3} ± {:.3}", self.value, 1.96 * self.standard_error)
    }
}

/// Least-squares slope of log rms over log n. The error of each point is known from its repeats, so that the error of
/// the slope follows without assuming that the points scatter alike. `None` with fewer than two usable points.
pub fn slope(points: &[ErrorAt]) -> Option<Slope> {
    let logs: Vec<(f64, f64, f64)> = points
        .iter()
        .filter(|p| p.n > 0.0 && p.mean_square > 0.0)
        .map(|p| (p.n.ln(), 0.5 * p.mean_square.ln(), 0.5 * p.relative))
        .collect();
    let count = logs.len() as f64;
    let mean = logs.iter().map(|p| p.0).sum::<f64>() / count;
    let spread: f64 = logs.iter().map(|p| (p.0 - mean) * (p.0 - mean)).sum();
    if logs.len() < 2 || spread <= 0.0 {
        return None;
    }
    let value = logs.iter().map(|p| (p.0 - mean) * p.1).sum::<f64>() / spread;
    let variance: f64 = logs.iter().map(|p| ((p.0 - mean) * p.2 / spread) * ((p.0 - mean) * p.2 / spread)).sum();
    Some(Slope { value, standard_error: variance.sqrt() })
}

/// As [`slope`] for errors that were measured once each, without any scatter.
pub fn plain_slope(points: &[(f64, f64)]) -> f64 {
    steradian_sampling::statistics::log_log_slope(points).map_or(f64::NAN, |r| r.slope)
}

/// `(n, mean square)` for a figure.
pub fn squares(points: &[ErrorAt]) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p.n, p.mean_square)).collect()
}

/// `(n, rms)` for a figure.
pub fn curve(points: &[ErrorAt]) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p.n, p.rms())).collect()
}

/// A sample variance with its standard error, which knows the kurtosis of the sample and so needs no normality.
pub fn variance_with_error(values: &[f64]) -> (f64, f64) {
    let all: VarianceEstimator = values.iter().copied().collect();
    let mean = all.mean();
    let squares: VarianceEstimator = values.iter().map(|v| (v - mean) * (v - mean)).collect();
    (all.variance(), squares.standard_error())
}

/// Discrete Fourier transform: amplitude and phase of each frequency from 0 to half the number of samples.
///
/// Direct sums: `O(n^2)`, for a few hundred samples.
pub fn spectrum(samples: &[f64]) -> Vec<(f64, f64)> {
    let n = samples.len();
    (0..=n / 2)
        .map(|k| {
            let (re, im) = dft_bin(samples, k as f64);
            let scale = if k == 0 || 2 * k == n { 1.0 } else { 2.0 } / n as f64;
            (scale * re.hypot(im), im.atan2(re))
        })
        .collect()
}

fn dft_bin(samples: &[f64], k: f64) -> (f64, f64) {
    let step = std::f64::consts::TAU * k / samples.len() as f64;
    samples.iter().enumerate().fold((0.0, 0.0), |(re, im), (i, &v)| {
        let (s, c) = (step * i as f64).sin_cos();
        (re + v * c, im - v * s)
    })
}

/// Power of the two-dimensional discrete Fourier transform of a square picture, zero frequency in the middle.
pub fn power_spectrum_2d(values: &[f64], size: usize) -> Vec<f64> {
    let twiddle: Vec<(f64, f64)> =
        (0..size).map(|i| (std::f64::consts::TAU * i as f64 / size as f64).sin_cos()).map(|(s, c)| (c, -s)).collect();
    let half = size / 2;
    // Rows, then columns: the transform is a product.
    let mut rows = vec![(0.0, 0.0); size * size];
    for y in 0..size {
        for k in 0..size {
            let f = (k + size - half) % size;
            rows[y * size + k] = (0..size).fold((0.0, 0.0), |(re, im), x| {
                let (c, s) = twiddle[f * x % size];
                let v = values[y * size + x];
                (re + v * c, im + v * s)
            });
        }
    }
    let mut power = vec![0.0; size * size];
    for x in 0..size {
        for k in 0..size {
            let f = (k + size - half) % size;
            let (re, im) = (0..size).fold((0.0, 0.0), |(re, im), y| {
                let (c, s) = twiddle[f * y % size];
                let (a, b) = rows[y * size + x];
                (re + a * c - b * s, im + a * s + b * c)
            });
            power[k * size + x] = (re * re + im * im) / (size * size) as f64;
        }
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_power_law_and_its_error() {
        let points: Vec<_> = (0..8)
            .map(|k| {
                let n = f64::from(1 << k);
                ErrorAt { n, mean_square: 9.0 / n, relative: 0.1, bias: 0.0 }
            })
            .collect();
        let s = slope(&points).unwrap();
        assert!((s.value + 0.5).abs() < 1e-12);
        // Eight equally spaced points of standard error 0.05: 0.05 / (ln 2 sqrt(42)).
        assert!((s.standard_error - 0.05 / (2f64.ln() * 42f64.sqrt())).abs() < 1e-12);
        assert!(slope(&points[..1]).is_none());
    }

    #[test]
    fn spectra_find_a_sinusoid() {
        let wave: Vec<f64> =
            (0..64).map(|i| 1.0 + 0.5 * (std::f64::consts::TAU * 5.0 * f64::from(i) / 64.0).cos()).collect();
        let s = spectrum(&wave);
        assert!((s[0].0 - 1.0).abs() < 1e-12 && (s[5].0 - 0.5).abs() < 1e-12 && s[6].0 < 1e-12);
        let plane: Vec<f64> =
            (0..256).map(|i| (std::f64::consts::TAU * 3.0 * f64::from(i % 16) / 16.0).cos()).collect();
        let p = power_spectrum_2d(&plane, 16);
        // Two peaks, 3 to the left and right of the middle, of 16^2 / 4 each; Parseval gives the sum.
        assert!((p[8 * 16 + 11] - 64.0).abs() < 1e-9 && (p[8 * 16 + 5] - 64.0).abs() < 1e-9);
        assert!((p.iter().sum::<f64>() - plane.iter().map(|v| v * v).sum::<f64>()).abs() < 1e-9);
    }

    #[test]
    fn variance_error_of_uniform_numbers() {
        let values: Vec<f64> = (0..10_000).map(|i| (f64::from(i) + 0.5) / 10_000.0).collect();
        let (v, e) = variance_with_error(&values);
        // Var((u - 1/2)^2) = 1/80 - 1/144.
        assert!((v - 1.0 / 12.0).abs() < 1e-4 && (e - ((1.0 / 80.0 - 1.0 / 144.0) / 1e4f64).sqrt()).abs() < 1e-6);
    }
}
