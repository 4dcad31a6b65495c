//! What can be wrong with the input of a build, and with a tree.

use std::fmt;

/// Why a tree cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildError {
    /// A box has a coordinate that is NaN or infinite, or its `min` exceeds its `max`.
    BadBounds {
        /// The index of the primitive in the input.
        primitive: usize,
    },
    /// A primitive's kind is neither 0 nor 1.
    BadKind {
        /// The index of the primitive in the input.
        primitive: usize,
    },
    /// More primitives than [`MAX_PRIMITIVES`](crate::MAX_PRIMITIVES).
    TooMany {
        /// How many there were.
        count: usize,
    },
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadBounds { primitive } => write!(f, "primitive {primitive} has no finite bounding box"),
            Self::BadKind { primitive } => write!(f, "primitive {primitive} has a kind other than 0 and 1"),
            Self::TooMany { count } => {
                write!(f, "{count} primitives in one tree; the most is {}", crate::MAX_PRIMITIVES)
            }
        }
    }
}

impl std::error::Error for BuildError {}

/// A broken invariant of a tree, found by [`Bvh::validate`](crate::Bvh::validate): always a bug of this crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidBvh {
    /// The node where it was found.
    pub node: usize,
    /// Which invariant.
    pub what: &'static str,
}

impl fmt::Display for InvalidBvh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {}: {}", self.node, self.what)
    }
}

impl std::error::Error for InvalidBvh {}
