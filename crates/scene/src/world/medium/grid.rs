//! Looking up regular grids: trilinear between cell centres, zero beyond the outermost.

use crate::medium::VoxelGrid;
use std::ops::{Add, Mul};
use steradian_math::{Bounds3, Vec3};

impl<T: Copy> VoxelGrid<T> {
    /// Interpolates `value` of the cells around `q`, a point of the unit cube.
    #[inline]
    pub(super) fn interpolate<V>(&self, q: Vec3, value: impl Fn(usize) -> V) -> V
    where
        V: Copy + Default + Add<Output = V> + Mul<f32, Output = V>,
    {
        let mut cell = [0i32; 3];
        let mut t = [0.0f32; 3];
        for axis in 0..3 {
            let s = q[axis] * self.size[axis] as f32 - 0.5;
            let floor = s.floor();
            cell[axis] = floor as i32;
            t[axis] = s - floor;
        }
        let mut sum = V::default();
        for corner in 0..8usize {
            let (mut weight, mut index, mut stride) = (1.0f32, 0usize, 1usize);
            let mut inside = true;
            for axis in 0..3 {
                let upper = corner >> axis & 1;
                weight *= if upper == 1 { t[axis] } else { 1.0 - t[axis] };
                let c = i64::from(cell[axis]) + upper as i64;
                inside &= (0..i64::from(self.size[axis])).contains(&c);
                index += if inside { c as usize * stride } else { 0 };
                stride *= self.size[axis] as usize;
            }
            if inside && weight > 0.0 {
                sum = sum + value(index) * weight;
            }
        }
        sum
    }

    /// The greatest `value` of a cell that reaches into a box of the unit cube.
    pub(super) fn max_of(&self, b: &Bounds3, value: impl Fn(usize) -> f32) -> f32 {
        let range = |axis: usize| {
            let n = self.size[axis] as f32;
            // Rounding must not leave out a cell whose centre is just beyond.
            let low = (b.min[axis] * n - 0.5 - 1e-3).floor().max(0.0) as usize;
            let high = ((b.max[axis] * n - 0.5 + 1e-3).floor() + 1.0).min(n - 1.0).max(0.0) as usize;
            low..=high
        };
        let (nx, ny) = (self.size[0] as usize, self.size[1] as usize);
        let mut most = 0.0f32;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    most = most.max(value((z * ny + y) * nx + x));
                }
            }
        }
        most
    }
}

impl VoxelGrid<f32> {
    /// The value at a point of the unit cube.
    #[inline]
    pub(super) fn sample(&self, q: Vec3) -> f32 {
        self.interpolate(q, |i| self.values[i])
    }

    /// A bound on the values in a box of the unit cube.
    pub(super) fn max_in(&self, b: &Bounds3) -> f32 {
        self.max_of(b, |i| self.values[i])
    }
}
