//! Points, vectors, normals, frames, transforms, rays, boxes, error bounds and portable elementary functions.
//!
//! Everything here is plain `f32` arithmetic in a fixed order, without fused multiply-add and without the platform's
//! math library, so that an image has the same bits on every machine.

mod animated;
mod bounds;
mod error_function;
mod frame;
mod portable;
mod ray;
mod rounding;
mod rows;
mod scalar;
mod transform;
mod vector;

pub use animated::{AnimatedTransform, Decomposed};
pub use bounds::{Bounds2, Bounds3};
pub use error_function::{erf, erf_inv};
pub use frame::Frame;
pub use portable::{acos, asin, atan, atan2, cos, exp, exp2, ln, log2, powf, sin, sin_cos, tan};
pub use ray::{Ray, RayDifferential, offset_ray_origin};
pub use rounding::{gamma, next_down, next_up};
pub use rows::{ROW, Row, Rows3, row_end};
pub use scalar::*;
pub use transform::Transform;
pub use vector::{Normal3, Point2, Point3, Vec2, Vec3};
