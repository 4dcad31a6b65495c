//! Axis-aligned boxes.

use crate::{Point2, Point3, Vec2, Vec3};

/// An axis-aligned box in space; empty when `min > max` on some axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Bounds3 {
    /// The corner of least coordinates.
    pub min: Point3,
    /// The corner of greatest coordinates.
    pub max: Point3,
}

impl Default for Bounds3 {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds3 {
    /// The box that contains nothing: the neutral element of `union`.
    pub const EMPTY: Self = Self { min: Point3::splat(f32::INFINITY), max: Point3::splat(f32::NEG_INFINITY) };

    /// The box of two opposite corners in any order.
    pub fn new(a: Point3, b: Point3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// The least box around both.
    #[inline]
    pub fn union(self, o: Self) -> Self {
        Self { min: self.min.min(o.min), max: self.max.max(o.max) }
    }

    /// The least box around the box and a point.
    #[inline]
    pub fn union_point(self, p: Point3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The common part; may be empty.
    #[inline]
    pub fn intersection(self, o: Self) -> Self {
        Self { min: self.min.max(o.min), max: self.max.min(o.max) }
    }

    /// Whether nothing is inside.
    #[inline]
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// From the least to the greatest corner.
    #[inline]
    pub fn diagonal(&self) -> Vec3 {
        self.max - self.min
    }

    /// The centre.
    #[inline]
    pub fn centroid(&self) -> Point3 {
        Point3::new(
            0.5 * self.min.x + 0.5 * self.max.x,
            0.5 * self.min.y + 0.5 * self.max.y,
            0.5 * self.min.z + 0.5 * self.max.z,
        )
    }

    /// The area of the six faces; zero when empty.
    #[inline]
    pub fn surface_area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.diagonal();
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// The axis of greatest extent.
    #[inline]
    pub fn max_extent(&self) -> usize {
        let d = self.diagonal();
        if d.x > d.y && d.x > d.z {
            0
        } else if d.y > d.z {
            1
        } else {
            2
        }
    }

    /// Whether `p` is inside or on the boundary.
    #[inline]
    pub fn contains(&self, p: Point3) -> bool {
        p.x >= self.min.x
            && p.x <= self.max.x
            && p.y >= self.min.y
            && p.y <= self.max.y
            && p.z >= self.min.z
            && p.z <= self.max.z
    }

    /// Centre and radius of a sphere around the box; radius zero when empty.
    pub fn bounding_sphere(&self) -> (Point3, f32) {
        if self.is_empty() {
            return (Point3::default(), 0.0);
        }
        let c = self.centroid();
        (c, c.distance(self.max))
    }

    /// Corner `i` of 8: bit k of `i` chooses `max` on axis k.
    pub fn corner(&self, i: usize) -> Point3 {
        Point3::new(
            if i & 1 == 0 { self.min.x } else { self.max.x },
            if i & 2 == 0 { self.min.y } else { self.max.y },
            if i & 4 == 0 { self.min.z } else { self.max.z },
        )
    }

    /// Grown by `delta` on every side.
    pub fn expand(&self, delta: f32) -> Self {
        Self { min: self.min - Vec3::splat(delta), max: self.max + Vec3::splat(delta) }
    }

    /// The position of `p` in the box: (0,0,0) at `min`, (1,1,1) at `max`.
    pub fn offset(&self, p: Point3) -> Vec3 {
        let (o, d) = (p - self.min, self.diagonal());
        let rel = |o: f32, d: f32| if d > 0.0 { o / d } else { o };
        Vec3::new(rel(o.x, d.x), rel(o.y, d.y), rel(o.z, d.z))
    }

    /// The parametric range in which the ray is inside, clipped to `[0, t_max]`.
    pub fn intersect(&self, o: Point3, d: Vec3, t_max: f32) -> Option<(f32, f32)> {
        let (mut t0, mut t1) = (0.0f32, t_max);
        for axis in 0..3 {
            let inv = 1.0 / d[axis];
            let a = (self.min[axis] - o[axis]) * inv;
            let b = (self.max[axis] - o[axis]) * inv;
            let (near, far) = if a > b { (b, a) } else { (a, b) };
            let far = far * (1.0 + 2.0 * crate::gamma(3));
            // NaN (0 times infinity: the ray lies in a face) must not narrow the range.
            t0 = if near > t0 { near } else { t0 };
            t1 = if far < t1 { far } else { t1 };
            if t0 > t1 {
                return None;
            }
        }
        Some((t0, t1))
    }
}

/// An axis-aligned rectangle in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds2 {
    /// The corner of least coordinates.
    pub min: Point2,
    /// The corner of greatest coordinates.
    pub max: Point2,
}

impl Bounds2 {
    /// The rectangle of two opposite corners in any order.
    pub fn new(a: Point2, b: Point2) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// From the least to the greatest corner.
    pub fn diagonal(&self) -> Vec2 {
        self.max - self.min
    }

    /// Width times height.
    pub fn area(&self) -> f32 {
        let d = self.diagonal();
        d.x * d.y
    }

    /// Whether `p` is inside or on the boundary.
    pub fn contains(&self, p: Point2) -> bool {
        p.x >= self.min.x && p.x <= self.max.x && p.y >= self.min.y && p.y <= self.max.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_is_neutral() {
        let b = Bounds3::new(Point3::new(1.0, 2.0, 3.0), Point3::new(-1.0, 5.0, 0.0));
        assert_eq!(Bounds3::EMPTY.union(b), b);
        assert!(Bounds3::EMPTY.is_empty() && !b.is_empty());
        assert_eq!(Bounds3::EMPTY.surface_area(), 0.0);
        assert_eq!(b.surface_area(), 2.0 * (2.0 * 3.0 + 3.0 * 3.0 + 3.0 * 2.0));
        assert_eq!(b.max_extent(), 2);
    }

    #[test]
    fn a_ray_in_a_face_is_kept() {
        let b = Bounds3::new(Point3::splat(0.0), Point3::splat(1.0));
        assert!(b.intersect(Point3::new(0.0, 0.5, -1.0), Vec3::new(0.0, 0.0, 1.0), 10.0).is_some());
        assert!(b.intersect(Point3::new(1.5, 0.5, -1.0), Vec3::new(0.0, 0.0, 1.0), 10.0).is_none());
    }
}
