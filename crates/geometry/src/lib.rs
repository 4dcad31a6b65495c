//! Shapes: bounds, intersection, area and solid-angle sampling; and [`Accel`], which finds what a ray meets first.
//!
//! Shapes are plain values in whatever space their numbers are in. A [`SurfaceHit`] is geometry alone: where, how
//! uncertain, which way the surface faces, and how it is parametrised. Materials and lights are other crates' matter.

mod accel;
mod bilinear;
mod bilinear_mesh;
mod block;
mod curvature;
mod curve;
mod curve_set;
mod cylinder;
mod disk;
mod distance_grid;
mod hit;
mod loop_subdivision;
mod mesh;
mod placed;
mod prepared_triangle;
mod quadric;
mod ray_rows;
mod sphere;
mod tally;
mod triangle;
mod triangle_sampling;

pub use accel::{Accel, AccelError, AccelHit, HitKind, InputTriangle};
pub use bilinear::{BilinearHit, BilinearPatch};
pub use bilinear_mesh::BilinearMesh;
pub use block::TriangleBlock;
pub use curve::{Curve, CurveHit, CurveProfile};
pub use curve_set::CurveSet;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use distance_grid::{DistanceGrid, DistanceGridError};
pub use hit::{Reference, Shading, ShapeSample, SurfaceHit, area_to_solid_angle};
pub use loop_subdivision::{SubdivisionError, loop_subdivide};
pub use mesh::{MeshAttribute, MeshError, TriangleMesh};
pub use placed::{PlacedQuadric, Quadric};
pub use prepared_triangle::PreparedTriangle;
pub use quadric::QuadricHit;
pub use ray_rows::RayRows;
pub use sphere::Sphere;
pub use steradian_math::offset_ray_origin;
pub use tally::{NoTally, Tally, TestCounts};
pub use triangle::{ShearedRay, Triangle, TriangleHit};
