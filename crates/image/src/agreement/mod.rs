//! Do two images estimate the same picture? A decision with a stated rate of false alarms.
//!
//! Monte Carlo images of one scene differ by noise, so their difference is asked five kinds of question, each a family of hypothesis
//! tests:
//!
//! * **global**: does the mean of the picture differ, in R, G, B?
//! * **block**: does the mean of any block of 4 x 4, 8 x 8 or 16 x 16 pixels differ?
//! * **pattern**: are the blocks of one size, taken together, farther off than chance puts them? Finds many small coherent errors.
//! * **pixel**: does any pixel differ? A small share may, because a single pixel's mean has a heavy tail.
//! * **dispersion**: are all pixels together noisier than both images claim? Finds errors without coherence. Only asked where both
//!   noises were measured.
//!
//! The probability of a false alarm (`Settings::alpha`) is split evenly over the families, and within a family over its tests
//! (Bonferroni), which holds however the tests depend on each other. Scores are Welch's t, so that noise estimated from few batches is
//! not trusted too much. Every null hypothesis allows a relative error (`tolerance_*`): disagreement means sure *and* large enough to
//! matter. What the pair of images could not have shown is reported too (`Report::detectable_bias`).

mod estimate;
mod families;
mod noise;
mod statistics;

use serde::Serialize;

pub use estimate::{Estimate, Planes};

use noise::Pair;

/// What counts as a difference.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Probability that two estimates of the same picture are said to differ.
    pub alpha: f64,
    /// Relative error of the picture's mean that does not matter.
    pub tolerance_global: f64,
    /// Relative error of a block's mean that does not matter.
    pub tolerance_block: f64,
    /// Relative error of a pixel that does not matter.
    pub tolerance_pixel: f64,
    /// Share of pixel tests that may fail.
    pub pixel_outliers: f64,
    /// Excess of the mean squared deviation, which should be 1, that does not matter.
    pub dispersion_slack: f64,
    /// Sides of the blocks, in pixels.
    pub block_sizes: Vec<usize>,
    /// Where only the reference's variance is known: the candidate's as a multiple of it (the reference's samples per pixel over the
    /// candidate's, times how much noisier its estimator is). `None`: inferred from the difference.
    pub candidate_to_reference_variance: Option<f64>,
    /// `Report::is_weak` is set if an error of brightness below this could have gone unseen.
    pub weak_above: f64,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            alpha: 1e-4,
            tolerance_global: 0.004,
            tolerance_block: 0.005,
            tolerance_pixel: 0.015,
            pixel_outliers: 0.003,
            dispersion_slack: 0.15,
            block_sizes: vec![4, 8, 16],
            candidate_to_reference_variance: None,
            weak_above: 0.015,
        }
    }
}

/// The verdict of one family of tests.
#[derive(Clone, Debug, Serialize)]
pub struct Family {
    /// `global`, `block`, `pattern`, `pixel` or `dispersion`.
    pub name: &'static str,
    /// Whether the family is content.
    pub agrees: bool,
    /// Largest normal deviate.
    pub z_max: f64,
    /// Deviate beyond which a test fails.
    pub z_limit: f64,
    /// Number of tests.
    pub tests: usize,
    /// Number of tests that failed.
    pub failed: usize,
    /// Number of tests that may fail.
    pub allowed: usize,
    /// Where the largest deviate is, in words.
    pub place: String,
    /// Relative difference there.
    pub relative: f64,
}

/// Whether two images agree, and how sure that is.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Whether every family agrees.
    pub agree: bool,
    /// Why no tests were made, if none were.
    pub reason: Option<String>,
    /// The families that were asked.
    pub families: Vec<Family>,
    /// Relative difference of the picture's mean in R, G, B.
    pub bias: [f64; 3],
    /// Standard error of `bias`.
    pub bias_error: [f64; 3],
    /// Smallest relative error of brightness over the whole picture that would have been seen.
    pub detectable_bias: f64,
    /// Agreement says little, because `detectable_bias` is large: more samples are needed.
    pub is_weak: bool,
    /// Factor by which the assumed noise was raised to fit the difference; 1 where it was measured.
    pub noise_scale: f64,
    /// Mean squared deviation of the pixels; noise alone gives at most 1.
    pub mean_squared_deviation: f64,
}

impl Report {
    /// A disagreement that needs no statistics.
    fn refused(reason: &str) -> Report {
        Report {
            agree: false,
            reason: Some(reason.to_owned()),
            families: Vec::new(),
            bias: [0.0; 3],
            bias_error: [0.0; 3],
            detectable_bias: f64::INFINITY,
            is_weak: true,
            noise_scale: 1.0,
            mean_squared_deviation: 0.0,
        }
    }
}

/// Compares an estimate with a reference. Different sizes, NaN and infinity disagree without further question.
pub fn agreement(reference: &Estimate, candidate: &Estimate, settings: &Settings) -> Report {
    if (reference.width, reference.height) != (candidate.width, candidate.height) {
        return Report::refused("the images differ in size");
    }
    if reference.width == 0 || reference.height == 0 {
        return Report::refused("the images have no pixels");
    }
    for (estimate, which) in [(reference, "reference"), (candidate, "candidate")] {
        if !estimate.is_finite() {
            return Report::refused(&format!("the {which} has pixels that are not finite"));
        }
    }
    let pair = Pair::new(reference, candidate, settings);
    families::run(&pair, settings)
}
