//! What can go wrong outside the experiments.

use crate::Topic;
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

fn all_names() -> String {
    Topic::ALL.map(Topic::name).join(", ")
}
