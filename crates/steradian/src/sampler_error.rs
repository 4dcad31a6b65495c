//! The error of a sampler over the number of its samples, measured at a function whose integral is known.

use std::fmt::Write as _;
use std::sync::{Mutex, PoisonError};

use steradian_render::Film;

/// What was measured so far, by the number of samples per pixel.
#[derive(Default)]
pub(crate) struct SamplerError(Mutex<Vec<(u32, f64)>>);

impl SamplerError {
    /// Measures: the mean over pixels of the squared difference to the integral, which is one.
    pub fn measure(&self, film: &Film) {
        let [samples, most] = film.samples();
        if samples == 0 || samples != most {
            return;
        }
        let means = film.mean();
        let sum: f64 = means.iter().map(|m| (f64::from(m[0]) - 1.0) * (f64::from(m[0]) - 1.0)).sum();
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.last().is_none_or(|(last, _)| *last < samples) {
            all.push((samples, sum / means.len().max(1) as f64));
        }
    }

    /// A line for each number of samples: that, and the error.
    pub fn table(&self) -> String {
        let mut out = String::new();
        for (samples, error) in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{samples}, {error}");
        }
        out
    }
}
