//! When a picture is good enough, or has taken long enough: the options, and what they ask of the renderer.

use std::fmt::Write;

use clap::{Args, ValueEnum};
use steradian_image::{Operator, PreparedToneMap};
use steradian_math::exp2;
use steradian_render::{Adaptive, ENDLESS_SPP, ErrorGoal, ErrorMeasure, Goals, Outcome, Plan, Rendered, Share};

use crate::args::OutputArgs;
use crate::numbers::{self, ExposureArg, Percent, Span};

/// The options.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "When to stop (with --spp: whatever comes first)")]
pub(crate) struct StopArgs {
    /// Stop after this time, at the end of a pass, as in 90s, 10m or 1h30m; without --spp, only then
    #[arg(long, value_name = "TIME")]
    pub time: Option<Span>,

    /// Stop when this is known of the error: with the confidence of --confidence, the share --error-pixels of all pixels
    /// lies within PERCENT of what endless rendering would give; corrected for looking many times. Turns on --adaptive
    #[arg(long, value_name = "PERCENT")]
    pub error: Option<Percent>,

    /// In what --error is measured
    #[arg(long, value_name = "HOW", default_value = "linear")]
    pub error_in: ErrorIn,

    /// The share of pixels that --error speaks of
    #[arg(long, value_name = "PERCENT", default_value = "95%")]
    pub error_pixels: Percent,

    /// How sure --error is
    #[arg(long, value_name = "PERCENT", default_value = "95%")]
    pub confidence: Percent,

    /// More samples where they are needed; --spp is then the average. The default under --error is error, as without HOW
    #[arg(long, value_name = "HOW", num_args = 0..=1, require_equals = true, default_missing_value = "error")]
    pub adaptive: Option<AdaptiveArg>,

    /// The same number of samples in every pixel, also under --error
    #[arg(long, conflicts_with = "adaptive")]
    pub no_adaptive: bool,
}

/// Where more samples are needed.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AdaptiveArg {
    /// Where there is more noise, in tiles of 16 x 16 pixels, measured again and again
    Error,
    /// Where intensity changes rapidly, in tiles of 4 x 4: by the contrast of the first two samples of neighbouring pixels
    Contrast,
}

/// What an error is measured in.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ErrorIn {
    /// Brightness, relative to the pixel's own, or to a twentieth of the picture's mean where it is darker than that
    #[default]
    Linear,
    /// Brightness on screen, after --exposure and --tonemap, relative to white
    Display,
}

impl StopArgs {
    /// What decides where more samples are taken.
    pub fn adaptive(&self) -> Adaptive {
        match self.adaptive {
            _ if self.no_adaptive => Adaptive::No,
            Some(AdaptiveArg::Contrast) => Adaptive::Contrast,
            Some(AdaptiveArg::Error) => Adaptive::Error,
            None if self.error.is_some() => Adaptive::Error,
            None => Adaptive::No,
        }
    }

    /// Whether something else than a number of samples ends the render.
    pub fn is_open_ended(&self) -> bool {
        self.time.is_some() || self.error.is_some()
    }

    /// Samples per pixel at most: what was typed, or the scene's number if nothing else ends the render.
    pub fn most_spp(&self, typed: Option<u32>, in_scene: u32) -> u32 {
        typed.unwrap_or(if self.is_open_ended() { ENDLESS_SPP } else { in_scene })
    }

    /// The plan.
    pub fn plan(&self, spp: u32, threads: usize) -> Plan {
        Plan { spp, threads, time_limit: self.time.map(|t| t.0) }
    }

    /// The goals.
    pub fn goals(&self, share: Share, output: &OutputArgs) -> Goals {
        let error = self.error.map(|bound| ErrorGoal {
            bound: bound.0,
            measure: match self.error_in {
                ErrorIn::Linear => ErrorMeasure::Linear,
                ErrorIn::Display => ErrorMeasure::Display(screen(output)),
            },
            pixels: self.error_pixels.0,
            confidence: self.confidence.0,
        });
        Goals { error, adaptive: self.adaptive(), share }
    }

    /// The options that give the same picture again, each with a space before it.
    pub fn as_typed(&self) -> String {
        let mut out = String::new();
        if let Some(error) = self.error {
            let _ = write!(out, " --error {error}");
            if self.error_in == ErrorIn::Display {
                out += " --error-in display";
            }
            let _ = write!(out, " --error-pixels {} --confidence {}", self.error_pixels, self.confidence);
        }
        out += match (self.adaptive(), self.error.is_some()) {
            (Adaptive::Contrast, _) => " --adaptive=contrast",
            (Adaptive::Error, false) => " --adaptive",
            (Adaptive::No, true) => " --no-adaptive",
            (Adaptive::Error, true) | (Adaptive::No, false) => "",
        };
        out
    }

    /// What is known of the picture's error, in words.
    pub fn statement(&self, bound: f64) -> String {
        let of = match self.error_in {
            ErrorIn::Linear => "of their brightness",
            ErrorIn::Display => "of white on screen",
        };
        format!(
            "with {} confidence, {} of the pixels are within {} {of}",
            self.confidence,
            self.error_pixels,
            Percent(bound)
        )
    }
}

/// The curve to the screen; an exposure that is found by itself is not known before the picture is.
fn screen(output: &OutputArgs) -> PreparedToneMap {
    let stops = match output.exposure {
        ExposureArg::Stops(s) => s,
        ExposureArg::Auto => 0.0,
    };
    PreparedToneMap { scale: exp2(stops), operator: Operator::from(output.tonemap) }
}

/// Why it ended, in a word or two; the manifest's `outcome`.
pub(crate) fn outcome_name(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Finished => "finished",
        Outcome::ErrorReached => "error reached",
        Outcome::TimeLimit => "time limit",
        Outcome::Interrupted => "interrupted",
    }
}

/// The samples per pixel in words: `64 samples per pixel`, `70.3 samples per pixel (32 to 512)`.
pub(crate) fn samples_in_words(rendered: &Rendered) -> String {
    let [least, most] = rendered.film.samples();
    if least == most {
        format!("{} per pixel", numbers::counted(u64::from(least), "sample"))
    } else {
        format!("{:.1} samples per pixel ({least} to {most})", rendered.film.average_samples())
    }
}
