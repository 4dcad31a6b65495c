//! What spheres, cylinders and disks have in common: roots in double precision, and when a root is behind the origin.

use steradian_math::{PI, Point3, Ray, Vec3, atan2};

/// Where a ray meets a quadric, in the quadric's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadricHit {
    /// Ray parameter.
    pub t: f32,
    /// The point, put back on the surface.
    pub p: Point3,
}

/// The azimuth of a point, in `[0, 2 pi)`.
#[inline]
pub(crate) fn azimuth(p: Point3) -> f32 {
    let phi = atan2(p.y, p.x);
    if phi < 0.0 { phi + 2.0 * PI } else { phi }
}

/// The azimuth up to which a quadric reaches, in radians, from degrees in `[0, 360]`.
pub(crate) fn phi_max(degrees: f32) -> f32 {
    if degrees >= 360.0 { 2.0 * PI } else { degrees.max(0.0) * (PI / 180.0) }
}

/// A ray in double precision, with the error of its origin.
///
/// With exact `f32` inputs, roots in `f64` are off by far less than one `f32` ulp. What remains uncertain is the origin
/// itself, once a transform has rounded it: a root is behind the origin if it is within that error of the surface.
pub(crate) struct PreciseRay {
    pub o: [f64; 3],
    pub d: [f64; 3],
    o_error: [f64; 3],
    t_max: f32,
}

impl PreciseRay {
    pub fn new(ray: &Ray, o_error: Vec3) -> Self {
        Self {
            o: ray.o.to_array().map(f64::from),
            d: ray.d.to_array().map(f64::from),
            o_error: o_error.to_array().map(f64::from),
            t_max: ray.t_max,
        }
    }

    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|i| self.o[i] + t * self.d[i])
    }

    /// Whether `t` lies surely ahead and within range, for a surface with a normal along `n` there.
    pub fn accepts(&self, t: f64, n: [f64; 3]) -> bool {
        let along: f64 = (0..3).map(|i| n[i] * self.d[i]).sum();
        let error: f64 = (0..3).map(|i| n[i].abs() * self.o_error[i]).sum();
        // `t > error / |along|`, without dividing by what may be zero.
        t > 0.0 && t * along.abs() > error && (t as f32) <= self.t_max
    }

    /// The parameters at which the distance from the origin (`AXES` = 3) or the z axis (`AXES` = 2) is `radius`.
    pub fn roots<const AXES: usize>(&self, radius: f64) -> Option<[f64; 2]> {
        let dot = |a: &[f64; 3], b: &[f64; 3]| -> f64 { (0..AXES).map(|i| a[i] * b[i]).sum() };
        let a = dot(&self.d, &self.d);
        let half_b = dot(&self.d, &self.o);
        let c = dot(&self.o, &self.o) - radius * radius;
        if a == 0.0 {
            return None;
        }
        // The discriminant from the distance of closest approach, which does not cancel for far origins.
        let nearest: [f64; 3] = std::array::from_fn(|i| self.o[i] - half_b / a * self.d[i]);
        let miss = dot(&nearest, &nearest).sqrt();
        let discriminant = a * (radius + miss) * (radius - miss);
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let q = -(half_b + discriminant.sqrt().copysign(half_b));
        let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
        Some(if t0 <= t1 { [t0, t1] } else { [t1, t0] })
    }
}

pub(crate) fn point(p: [f64; 3]) -> Point3 {
    Point3::from_array(p.map(|x| x as f32))
}
