//! Numbers side by side: one for each of many paths, so that one loop over a row does the same step for all of them.
//!
//! Loops over rows are written in the scalar functions of this crate, without branches that matter. A compiler turns them into vector
//! instructions and keeps every operation, so a row holds the bits that one path alone would have got.

use crate::{Normal3, Point3, Vec3};

/// Places in a row.
pub const ROW: usize = 64;

/// A value for each place.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Row<T = f32>(pub [T; ROW]);

impl<T: Copy + Default> Default for Row<T> {
    fn default() -> Self {
        Self([T::default(); ROW])
    }
}

/// How far a loop over the first `n` places goes: on to a whole vector, since what stands in unused places is never read.
#[inline(always)]
pub const fn row_end(n: usize) -> usize {
    let end = n.next_multiple_of(16);
    if end > ROW { ROW } else { end }
}

/// A triple for each place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rows3 {
    /// The x coordinates.
    pub x: Row,
    /// The y coordinates.
    pub y: Row,
    /// The z coordinates.
    pub z: Row,
}

impl Rows3 {
    /// The triple at a place.
    #[inline(always)]
    pub fn vec(&self, i: usize) -> Vec3 {
        Vec3::new(self.x.0[i], self.y.0[i], self.z.0[i])
    }

    /// The triple at a place, as a point.
    #[inline(always)]
    pub fn point(&self, i: usize) -> Point3 {
        self.vec(i).to_point()
    }

    /// The triple at a place, as a normal.
    #[inline(always)]
    pub fn normal(&self, i: usize) -> Normal3 {
        self.vec(i).to_normal()
    }

    /// Writes the triple at a place.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: impl Into<Vec3>) {
        let v = v.into();
        (self.x.0[i], self.y.0[i], self.z.0[i]) = (v.x, v.y, v.z);
    }
}
