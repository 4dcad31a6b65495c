//! Many rays, prepared together for boxes and triangles: divisions and the choice of axes by vectors, without branches.

use fearless_simd::{Level, dispatch};
use steradian_bvh::{BoxRay, fearless_simd};
use steradian_math::{ROW, Ray, Row, Rows3, row_end};

use crate::ShearedRay;
use crate::triangle::AXES;

/// At most [`ROW`] rays, and what [`BoxRay`] and [`ShearedRay`] are made of. Memory to be used again and again.
#[derive(Clone, Debug, Default)]
pub struct RayRows {
    o: Rows3,
    d: Rows3,
    t_max: Row,
    time: Row,
    inverse: Rows3,
    traceable: Row<u32>,
    /// The axis along which a ray runs fastest.
    major: Row<u32>,
    sheared_o: Rows3,
    shear: Rows3,
    count: usize,
}

impl RayRows {
    /// Takes all rays out.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds a ray.
    ///
    /// # Panics
    /// If there are [`ROW`] of them already.
    #[inline(always)]
    pub fn push(&mut self, ray: &Ray) {
        let i = self.count;
        assert!(i < ROW, "more than {ROW} rays in a row");
        self.o.set(i, ray.o.to_vec());
        self.d.set(i, ray.d);
        (self.t_max.0[i], self.time.0[i]) = (ray.t_max, ray.time);
        self.count = i + 1;
    }

    /// Works out what the tests need; to be called after the last ray has been added.
    pub fn prepare(&mut self, level: Level) {
        dispatch!(level, _simd => self.prepare_all());
    }

    #[inline(always)]
    fn prepare_all(&mut self) {
        for i in 0..row_end(self.count) {
            let ray = self.ray(i);
            let b = BoxRay::new(&ray);
            self.inverse.set(i, b.inverse());
            self.traceable.0[i] = u32::from(b.is_traceable());
        }
        for i in 0..row_end(self.count) {
            let (o, d) = (self.o.vec(i), self.d.vec(i));
            let (major, shear) = ShearedRay::shear(d);
            self.major.0[i] = major;
            let turned = ShearedRay::turned(major, o);
            self.sheared_o.set(i, turned);
            self.shear.set(i, shear);
        }
    }

    /// A ray.
    #[inline(always)]
    pub fn ray(&self, i: usize) -> Ray {
        Ray { o: self.o.point(i), d: self.d.vec(i), t_max: self.t_max.0[i], time: self.time.0[i] }
    }

    /// A ray for tests of boxes.
    #[inline(always)]
    pub(crate) fn box_ray(&self, i: usize) -> BoxRay {
        BoxRay::from_parts(self.o.point(i), self.inverse.vec(i), self.t_max.0[i], self.traceable.0[i] != 0)
    }

    /// A ray for tests of triangles.
    #[inline(always)]
    pub(crate) fn sheared(&self, i: usize) -> ShearedRay {
        let (o, s) = (self.sheared_o.vec(i), self.shear.vec(i));
        ShearedRay { axes: AXES[self.major.0[i] as usize % 3], o: o.to_array(), s: s.to_array() }
    }
}
