//! What can be wrong with a stored or distributed render.

use thiserror::Error as ThisError;

/// Why a stored render cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
pub enum Error {
    /// It is not what its checksum says, or no stored render at all.
    #[error("damaged: {0}")]
    Damaged(String),
    /// It was stored by a version whose files cannot be read.
    #[error("stored in format {found}; this version reads format {known}")]
    Version {
        /// The file's format.
        found: u32,
        /// The one that is read here.
        known: u32,
    },
    /// It is of another render: what differs, each with what is stored and what is asked for.
    #[error("of another render: {}", .0.join("; "))]
    Foreign(Vec<String>),
    /// Parts that do not make a whole.
    #[error("{0}")]
    Merge(String),
}
