//! What can go wrong outside the experiments.

use crate::{BruteForce, TESTS_PER_SECOND, Topic};
use std::path::PathBuf;

/// An error of the laboratory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no such topic.
    #[error("there is no topic '{name}'{}; the topics are {}", did_you_mean(.hint), all_names())]
    UnknownTopic {
        /// What was asked for.
        name: String,
        /// The nearest name.
        hint: Option<&'static str>,
    },
    /// Brute force with such parameters would take too long.
    #[error(
        "brute force with {parameters} would take {:.1e} rays and {:.1e} intersection tests, about {} at {:.0e} tests a second; take smaller \
         numbers, or insist with --yes",
        parameters.rays(), parameters.tests(), time(parameters.tests() / TESTS_PER_SECOND), TESTS_PER_SECOND
    )]
    Absurd {
        /// What was asked for.
        parameters: BruteForce,
    },
    /// Parameters of brute force for topics that do not look at them.
    #[error("parameters of brute force are for the topic 'cost', which is not among those named")]
    NotCost,
    /// A file or folder of the report could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A picture could not be encoded or written.
    #[error("cannot write the picture {name}: {source}")]
    Picture {
        /// Its name in the report.
        name: String,
        /// Why.
        source: steradian_image::Error,
    },
    /// A plot could not be drawn.
    #[error("cannot draw the plot {name}: {reason}")]
    Plot {
        /// Its name in the report.
        name: String,
        /// Why.
        reason: String,
    },
    /// A scene of an experiment could not be built.
    #[error("cannot build a scene: {0}")]
    Scene(#[from] steradian_scene::Error),
}

fn did_you_mean(hint: &Option<&'static str>) -> String {
    hint.map(|h| format!(" (did you mean '{h}'?)")).unwrap_or_default()
}

fn time(seconds: f64) -> String {
    const YEAR: f64 = 365.25 * 86_400.0;
    match seconds {
        s if s < 2.0 * 3_600.0 => format!("{:.0} minutes", s / 60.0),
        s if s < 2.0 * YEAR => format!("{:.0} hours", s / 3_600.0),
        s => format!("{:.0e} years", s / YEAR),
    }
}

fn all_names() -> String {
    Topic::ALL.map(Topic::name).join(", ")
}
