//! What the tests of boxes need of a ray.

use steradian_math::{Point3, Ray, Vec3};

/// A ray ready to be tested against boxes: slabs are entered and left at `(plane - o) * inverse`.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    pub(crate) o: Point3,
    /// One over each coordinate of the direction; infinite with the sign of a zero.
    pub(crate) inverse: Vec3,
    pub(crate) t_max: f32,
    pub(crate) traceable: bool,
}

impl BoxRay {
    /// Prepares a ray.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.d;
        let inverse = Vec3::new(1.0 / d.x, 1.0 / d.y, 1.0 / d.z);
        Self { o: ray.o, inverse, t_max: ray.t_max, traceable: is_traceable(ray) }
    }

    /// A ray of what [`BoxRay::inverse`] and [`BoxRay::is_traceable`] have said of it.
    #[inline(always)]
    pub fn from_parts(o: Point3, inverse: Vec3, t_max: f32, traceable: bool) -> Self {
        Self { o, inverse, t_max, traceable }
    }

    /// One over each coordinate of the direction.
    #[inline(always)]
    pub fn inverse(&self) -> Vec3 {
        self.inverse
    }

    /// Whether it is a ray that can be traced: finite origin, finite direction that is not null, positive length.
    #[inline(always)]
    pub fn is_traceable(&self) -> bool {
        self.traceable
    }
}

#[inline(always)]
pub(crate) fn is_traceable(ray: &Ray) -> bool {
    let d = ray.d;
    ray.o.is_finite() & d.is_finite() & ((d.x != 0.0) | (d.y != 0.0) | (d.z != 0.0)) & (ray.t_max >= 0.0)
}
