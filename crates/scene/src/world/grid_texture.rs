//! Grids of values in space: textures, and what fills media.

use crate::texture::GridTexture;
use std::ops::{Add, Mul};
use steradian_image::Wrap;
use steradian_math::{Bounds3, Point3};

impl GridTexture {
    /// The value at a point of the world; of one channel, three times.
    pub(super) fn look_up(&self, p: Point3) -> [f32; 3] {
        let Rgb(rgb) = self.interpolate(p, |cell| {
            let at = cell * self.channels;
            Rgb(std::array::from_fn(|k| self.values[at + k % self.channels]))
        });
        rgb
    }

    /// Interpolates `value` of the cells around a point of the world.
    #[inline]
    pub(super) fn interpolate<V>(&self, p: Point3, value: impl Fn(usize) -> V) -> V
    where
        V: Copy + Default + Add<Output = V> + Mul<f32, Output = V>,
    {
        let q = self.texture_from_world.point(p);
        let mut cell = [0i64; 3];
        let mut t = [0.0f32; 3];
        for k in 0..3 {
            // Beyond all reason, any cell will do.
            let x = (q[k] * self.size[k] as f32 - 0.5).clamp(-1e9, 1e9);
            let x = if self.nearest { (x + 0.5).floor() } else { x };
            cell[k] = x.floor() as i64;
            t[k] = x - x.floor();
        }
        let mut sum = V::default();
        for corner in 0..8usize {
            let (mut weight, mut index, mut stride) = (1.0f32, 0usize, 1usize);
            for k in 0..3 {
                let upper = corner >> k & 1;
                weight *= if upper == 1 { t[k] } else { 1.0 - t[k] };
                let (i, n) = (cell[k] + upper as i64, self.size[k]);
                let inside = self.wrap.along(i, n as usize).unwrap_or(i.clamp(0, i64::from(n) - 1) as usize);
                index += inside * stride;
                stride *= self.size[k] as usize;
            }
            if weight > 0.0 {
                sum = sum + value(index) * weight;
            }
        }
        sum
    }

    /// A bound on what `interpolate` finds in a box of the world, from the values of cells.
    pub(super) fn most_in(&self, b: &Bounds3, value: impl Fn(usize) -> f32) -> f32 {
        let b = self.texture_from_world.bounds(b);
        let range = |axis: usize| {
            let n = self.size[axis] as f32;
            if self.wrap != Wrap::Clamp {
                return 0..=self.size[axis] as usize - 1;
            }
            // Rounding must not leave out a cell whose centre is just beyond.
            let low = (b.min[axis] * n - 0.5 - 1e-3).floor().clamp(0.0, n - 1.0);
            let high = ((b.max[axis] * n - 0.5 + 1e-3).floor() + 1.0).clamp(0.0, n - 1.0);
            low as usize..=high as usize
        };
        let (nx, ny) = (self.size[0] as usize, self.size[1] as usize);
        let rows = range(2).flat_map(|z| range(1).map(move |y| (z * ny + y) * nx));
        rows.flat_map(|row| range(0).map(move |x| row + x)).map(value).fold(0.0, f32::max)
    }
}

/// Three channels that can be added.
#[derive(Clone, Copy, Default)]
struct Rgb([f32; 3]);

impl Add for Rgb {
    type Output = Rgb;

    #[inline]
    fn add(self, b: Rgb) -> Rgb {
        Rgb(std::array::from_fn(|k| self.0[k] + b.0[k]))
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;

    #[inline]
    fn mul(self, s: f32) -> Rgb {
        Rgb(self.0.map(|v| s * v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::Transform;

    fn grid(wrap: Wrap, nearest: bool) -> GridTexture {
        let texture_from_world = Transform::scale(0.5, 1.0, 1.0).unwrap();
        GridTexture { texture_from_world, size: [2, 1, 1], channels: 1, values: vec![1.0, 3.0], wrap, nearest }
    }

    #[test]
    fn between_the_centres_of_cells_values_are_interpolated() {
        let at = |wrap, x: f32| grid(wrap, false).look_up(Point3::new(x, 0.3, 0.9))[0];
        for (x, expected) in [(0.5, 1.0), (1.0, 2.0), (1.5, 3.0)] {
            assert!((at(Wrap::Clamp, x) - expected).abs() < 1e-6);
        }
        assert_eq!((at(Wrap::Clamp, -7.0), at(Wrap::Clamp, 9.0)), (1.0, 3.0));
        assert!((at(Wrap::Repeat, 2.0) - 2.0).abs() < 1e-6 && (at(Wrap::Mirror, 2.0) - 3.0).abs() < 1e-6);
        assert_eq!(grid(Wrap::Clamp, true).look_up(Point3::new(0.9, 0.0, 0.0)), [1.0; 3]);
        assert!(at(Wrap::Repeat, f32::MAX).is_finite());
    }

    #[test]
    fn the_bound_of_a_box_holds_inside_of_it_and_beyond_the_grid() {
        for (wrap, nearest) in [(Wrap::Clamp, false), (Wrap::Repeat, false), (Wrap::Mirror, true)] {
            let g = grid(wrap, nearest);
            for (low, high) in [(-5.0f32, -4.0), (-1.0, 0.4), (0.3, 0.6), (0.9, 1.2), (1.9, 2.5), (7.0, 8.0)] {
                let b = Bounds3 { min: Point3::new(low, 0.0, 0.0), max: Point3::new(high, 1.0, 1.0) };
                let bound = g.most_in(&b, |i| g.values[i]);
                for k in 0..=100 {
                    let x = low + (high - low) * k as f32 / 100.0;
                    let found = g.look_up(Point3::new(x, 0.5, 0.5))[0];
                    assert!(found <= bound + 1e-5, "{wrap:?} {x}: {found} above {bound}");
                }
            }
        }
        // It is no looser than the cells around.
        let g = grid(Wrap::Clamp, false);
        let near = Bounds3 { min: Point3::new(-2.0, 0.0, 0.0), max: Point3::new(0.4, 1.0, 1.0) };
        assert_eq!(g.most_in(&near, |i| g.values[i]), 1.0);
    }
}
