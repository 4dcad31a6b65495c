//! A bounding volume hierarchy over boxes: 8 children per node, tested together with SIMD instructions.
//!
//! The tree knows boxes and the order in which they are met along a ray, and nothing else. What is in a leaf, and how
//! a ray meets it, is the visitor's business: a [`Visitor`] (or a closure) is called for each [`Leaf`] that a ray
//! reaches, near ones first, and shortens the ray as it finds hits.
//!
//! * Build: binned surface-area heuristic (Wald 2007), collapsed to 8-wide nodes (Dammertz et al. 2008; Wald et al.
//!   2008). The tree depends on the boxes alone, never on the number of threads.
//! * Traversal: conservative slabs (Ize 2013), children sorted by entry distance, a bounded stack, no allocation.
//! * A box whose entry distance equals the current limit is still opened, so that a visitor that orders equal hits by
//!   primitive gets an answer that does not depend on the shape of the tree.
//!
//! The library starts no threads: a build runs in parallel only when it is called from inside a rayon pool.

mod box_ray;
mod build;
mod collapse;
mod error;
mod node;
mod reference;
mod stack;
mod traverse;
mod validate;

pub use box_ray::BoxRay;
pub use build::{BuildOptions, Primitive};
pub use error::{BuildError, InvalidBvh};
pub use fearless_simd;
pub use node::{Bvh, Leaf, Node, available_levels};
pub use traverse::Visitor;

/// Children per node.
pub const WIDTH: usize = 8;
/// The most primitives a leaf can name.
pub const MAX_LEAF: usize = 8;
/// The most primitives (or, after [`Bvh::renumber_leaves`], leaf units) a tree can hold.
pub const MAX_PRIMITIVES: usize = 1 << 27;
