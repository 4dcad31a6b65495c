//! Textures that are grids of values in space.

use crate::texture::GridTexture;
use steradian_math::Point3;

impl GridTexture {
    /// The value at a point of the world; of one channel, three times.
    pub(super) fn look_up(&self, p: Point3) -> [f32; 3] {
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
        let mut sum = [0.0f32; 3];
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
                let at = index * self.channels;
                for (k, s) in sum.iter_mut().enumerate() {
                    *s += weight * self.values[at + k % self.channels];
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_image::Wrap;
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
}
