//! A piecewise constant density on an interval, sampled by inverting its distribution function.

use super::{fill_guide, find_guided, guide_len, is_density};
use steradian_math::{ONE_MINUS_EPSILON, lerp};

/// A point of the interval, its density, and the piece it lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuousSample {
    /// The point.
    pub x: f32,
    /// Density with respect to length.
    pub pdf: f32,
    /// Index of the piece.
    pub index: usize,
}

/// An index, its probability, and a random number that can be used again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteSample {
    /// Index of the piece.
    pub index: usize,
    /// Probability of this index.
    pub probability: f32,
    /// Uniform in `[0, 1)` given the index.
    pub remapped: f32,
}

/// Density proportional to `values[i]` on the i-th of equal pieces of `[min, max]`. If all values are zero it is uniform.
#[derive(Clone, Debug)]
pub struct Piecewise1D {
    values: Vec<f32>,
    cdf: Vec<f32>,
    guide: Vec<u32>,
    integral: f32,
    min: f32,
    max: f32,
}

impl Piecewise1D {
    /// `None` if there is no value, one is negative or not finite, or the interval is empty.
    pub fn new(values: &[f32], min: f32, max: f32) -> Option<Self> {
        if !is_density(values) || max <= min || !(max - min).is_finite() {
            return None;
        }
        let mut cdf = vec![0.0; values.len() + 1];
        let mean = fill_cdf(values, &mut cdf);
        let mut guide = vec![0; guide_len(values.len())];
        fill_guide(&cdf, &mut guide);
        Some(Self { values: values.to_vec(), cdf, guide, integral: (mean * f64::from(max - min)) as f32, min, max })
    }

    /// Number of pieces.
    #[inline]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Never true; here since there is a `len`.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Integral of the unnormalised values over the interval.
    #[inline]
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// Point with density proportional to the values.
    #[inline]
    pub fn sample(&self, u: f32) -> ContinuousSample {
        let index = find_guided(&self.cdf, &self.guide, u);
        let (low, high) = (self.cdf[index], self.cdf[index + 1]);
        let inside = if high > low { ((u - low) / (high - low)).min(ONE_MINUS_EPSILON) } else { 0.0 };
        let t = (index as f32 + inside) / self.len() as f32;
        ContinuousSample { x: lerp(t, self.min, self.max).min(self.max), pdf: self.piece_pdf(index), index }
    }

    /// Index with probability proportional to the values.
    #[inline]
    pub fn sample_discrete(&self, u: f32) -> DiscreteSample {
        let index = find_guided(&self.cdf, &self.guide, u);
        let (low, high) = (self.cdf[index], self.cdf[index + 1]);
        let remapped = if high > low { ((u - low) / (high - low)).min(ONE_MINUS_EPSILON) } else { 0.0 };
        DiscreteSample { index, probability: self.probability(index), remapped }
    }

    /// Density at `x` with respect to length; zero outside the interval.
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        if !(x >= self.min && x <= self.max) {
            return 0.0;
        }
        let piece = ((x - self.min) / (self.max - self.min) * self.len() as f32) as usize;
        self.piece_pdf(piece.min(self.len() - 1))
    }

    /// Probability of index `index`; zero beyond the last one.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        if index >= self.len() { 0.0 } else { self.piece_pdf(index) * (self.max - self.min) / self.len() as f32 }
    }

    /// The random number that makes [`Self::sample`] return `x`; `None` outside the interval.
    #[inline]
    pub fn invert(&self, x: f32) -> Option<f32> {
        if !(x >= self.min && x <= self.max) {
            return None;
        }
        let place = (x - self.min) / (self.max - self.min) * self.len() as f32;
        let index = (place as usize).min(self.len() - 1);
        Some(lerp((place - index as f32).min(1.0), self.cdf[index], self.cdf[index + 1]))
    }

    #[inline]
    fn piece_pdf(&self, index: usize) -> f32 {
        if self.integral > 0.0 { self.values[index] / self.integral } else { 1.0 / (self.max - self.min) }
    }
}

/// Fills the normalised distribution function of equal pieces (`cdf` is one longer) and returns the mean value.
pub(super) fn fill_cdf(values: &[f32], cdf: &mut [f32]) -> f64 {
    let total: f64 = values.iter().map(|&v| f64::from(v)).sum();
    let count = values.len() as f64;
    let mut sum = 0.0;
    cdf[0] = 0.0;
    for (i, &value) in values.iter().enumerate() {
        sum += f64::from(value);
        cdf[i + 1] = if total > 0.0 { (sum / total) as f32 } else { ((i + 1) as f64 / count) as f32 };
    }
    // Everything after the last positive value is exactly one, so that no number below one selects it.
    cdf[values.len()] = 1.0;
    total / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_density_and_inverse_agree() {
        let d = Piecewise1D::new(&[1.0, 0.0, 3.0, 4.0, 0.0], -1.0, 4.0).unwrap();
        assert_eq!(d.integral(), 8.0);
        let mut integral = 0.0;
        for i in 0..1000 {
            let u = (i as f32 + 0.5) / 1000.0;
            let s = d.sample(u);
            assert!(s.pdf > 0.0 && (s.pdf - d.pdf(s.x)).abs() < 1e-6);
            assert!((d.invert(s.x).unwrap() - u).abs() < 1e-5);
            integral += d.pdf(-1.0 + 5.0 * u) * 5.0 / 1000.0;
            let t = d.sample_discrete(u);
            assert_eq!(t.index, s.index);
            assert!((0.0..1.0).contains(&t.remapped));
        }
        assert!((integral - 1.0).abs() < 1e-4);
        assert_eq!(d.probability(3), 0.5);
        assert_eq!(d.pdf(4.5), 0.0);
        assert_eq!(d.invert(-2.0), None);
        assert_eq!(d.sample(ONE_MINUS_EPSILON).index, 3);
    }

    #[test]
    fn all_zero_is_uniform_and_nonsense_is_refused() {
        let d = Piecewise1D::new(&[0.0; 4], 0.0, 2.0).unwrap();
        assert_eq!(d.pdf(1.0), 0.5);
        assert_eq!(d.sample(0.25).x, 0.5);
        assert!(Piecewise1D::new(&[], 0.0, 1.0).is_none());
        assert!(Piecewise1D::new(&[1.0, f32::NAN], 0.0, 1.0).is_none());
        assert!(Piecewise1D::new(&[1.0, -1.0], 0.0, 1.0).is_none());
        assert!(Piecewise1D::new(&[1.0], 1.0, 1.0).is_none());
    }
}
