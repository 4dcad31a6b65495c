//! Shapes: bounds, intersection, area and solid-angle sampling; and [`Accel`], which finds what a ray meets first.
//!
//! Shapes are plain values in whatever space their numbers are in. A [`SurfaceHit`] is geometry alone: where, how
//! uncertain, which way the surface faces, and how it is parametrised. Materials and lights are other crates' matter.

mod accel;
mod block;
mod triangle;

pub use accel::{Accel, AccelError, AccelHit, HitKind, InputTriangle};
pub use block::TriangleBlock;
pub use steradian_math::offset_ray_origin;
pub use triangle::{ShearedRay, Triangle, TriangleHit};
