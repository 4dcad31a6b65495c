//! Rays, ray differentials, and origins that leave a surface without an epsilon.

use crate::{Normal3, Point3, Vec3};

/// A half line `o + t d` for `t` in `(0, t_max)`, at one time of the shutter interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub o: Point3,
    /// Direction, not necessarily of unit length.
    pub d: Vec3,
    /// The parameter where the ray ends; may be infinite.
    pub t_max: f32,
    /// Time, in the scene's units.
    pub time: f32,
}

impl Ray {
    /// An unbounded ray.
    #[inline]
    pub const fn new(o: Point3, d: Vec3, time: f32) -> Self {
        Self { o, d, t_max: f32::INFINITY, time }
    }

    /// How far rays between two points go, of the whole way.
    ///
    /// The end is off its surface by no more than the error of its own coordinates, which vanish where these do; the way to it is rounded to
    /// the size of the other point's. What is missing is a ten thousandth, as in pbrt.
    pub const MOST_OF_THE_WAY: f32 = 0.9999;

    /// A ray to just before a point.
    #[inline(always)]
    pub fn between(o: Point3, end: Point3, time: f32) -> Self {
        Self { o, d: end - o, t_max: Self::MOST_OF_THE_WAY, time }
    }

    /// The parameter of its end, of a ray [between](Self::between) two points; others have none.
    #[inline]
    pub fn whole_way(&self) -> f32 {
        if self.t_max < f32::INFINITY { 1.0 } else { f32::INFINITY }
    }

    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Point3 {
        self.o + self.d * t
    }
}

/// The rays one pixel to the right and one pixel down (Igehy 1999), for texture filtering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferential {
    /// Origin of the ray offset in x.
    pub rx_o: Point3,
    /// Origin of the ray offset in y.
    pub ry_o: Point3,
    /// Direction of the ray offset in x.
    pub rx_d: Vec3,
    /// Direction of the ray offset in y.
    pub ry_d: Vec3,
}

impl RayDifferential {
    /// The offsets towards the central ray scaled by `s`: the spacing of samples rather than of pixels.
    pub fn scaled(&self, ray: &Ray, s: f32) -> Self {
        Self {
            rx_o: ray.o + (self.rx_o - ray.o) * s,
            ry_o: ray.o + (self.ry_o - ray.o) * s,
            rx_d: ray.d + (self.rx_d - ray.d) * s,
            ry_d: ray.d + (self.ry_d - ray.d) * s,
        }
    }
}

/// The origin of a ray that leaves a surface at `p` in direction `w`, moved off the surface by no more than the error
/// of `p` demands (PBRT 4th ed., 6.8.6).
///
/// `p_error` bounds the absolute error of each coordinate; `n` is the geometric normal, of unit length, on any side.
#[inline(always)]
pub fn offset_ray_origin(p: Point3, p_error: Vec3, n: Normal3, w: Vec3) -> Point3 {
    let d = n.abs().dot(p_error);
    let offset = if w.dot(n) < 0.0 { -d } else { d };
    let shift = |p: f32, n: f32| {
        let delta = n * offset;
        let q = p + delta;
        if delta > 0.0 {
            q.next_up()
        } else if delta < 0.0 {
            q.next_down()
        } else {
            q
        }
    };
    Point3::new(shift(p.x, n.x), shift(p.y, n.y), shift(p.z, n.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_origin_is_on_the_side_of_the_direction() {
        let p = Point3::new(1e3, 2.0, -5.0);
        let n = Normal3::new(0.6, 0.8, 0.0);
        let e = Vec3::splat(1e-4);
        for s in [1.0, -1.0] {
            let q = offset_ray_origin(p, e, n, n.to_vec() * s);
            assert!((q - p).dot(n) * s >= 1e-4);
        }
    }
}
