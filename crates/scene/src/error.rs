//! Why a scene cannot become a world.

use crate::MediumError;
use steradian_geometry::{AccelError, MeshError};

/// What is wrong with a scene that was not made by a careful loader.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A mesh does not fit together.
    #[error("mesh {mesh}: {source}")]
    Mesh {
        /// Which mesh, in the order of the arena.
        mesh: usize,
        /// What is wrong with it.
        source: MeshError,
    },
    /// A mesh that cannot be displaced.
    #[error("mesh {mesh} cannot be displaced: {message}")]
    Displacement {
        /// Which mesh, in the order of the arena.
        mesh: usize,
        /// Why not.
        message: &'static str,
    },
    /// Geometry that no tree can be built over.
    #[error("{0}")]
    Geometry(#[from] AccelError),
    /// A picture that cannot be prefiltered.
    #[error("image {name:?}: {message}")]
    Image {
        /// Its name.
        name: String,
        /// What is wrong with it.
        message: String,
    },
    /// A scratch file that cannot be written.
    #[error("the scratch file cannot be written: {message}")]
    Scratch {
        /// Why not.
        message: String,
    },
    /// A medium that cannot be.
    #[error("medium {name:?}: {source}")]
    Medium {
        /// Its name.
        name: String,
        /// What is wrong with it.
        source: MediumError,
    },
    /// Objects contain each other, or nest beyond all reason.
    #[error("instances of {object:?} nest deeper than {limit} levels")]
    Nesting {
        /// Name of the object at which the limit was reached.
        object: String,
        /// The limit.
        limit: usize,
    },
    /// Settings that make no sense, or none for the lights of this scene.
    #[error("{0}")]
    Settings(#[from] crate::SettingsError),
    /// More instances than can be numbered.
    #[error("more than {limit} instances")]
    TooManyInstances {
        /// The limit.
        limit: usize,
    },
}
