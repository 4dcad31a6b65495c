//! Eight triangles side by side, tested at once with the arithmetic of [`Triangle::intersect`](crate::Triangle).

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};
use steradian_bvh::fearless_simd;
use steradian_math::gamma;

use crate::Triangle;
use crate::triangle::{ShearedRay, edges_f64};

/// Triangles in a block.
pub const LANES: usize = 8;

/// The bit of an identifier that says: ask the filter before believing a hit.
pub(crate) const FILTERED: u32 = 1 << 31;

/// Up to eight triangles: vertices by axis, vertex and lane, and their identifiers. 320 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    v: [[[f32; LANES]; 3]; 3],
    id: [u32; LANES],
}

/// The lanes of a block that a ray meets.
pub(crate) struct BlockHits<S: Simd> {
    /// Bit `i` says that lane `i` is met within range.
    pub lanes: u32,
    pub t: f32x8<S>,
    pub b1: f32x8<S>,
    pub b2: f32x8<S>,
}

impl TriangleBlock {
    /// A block of nothing: vertices that are not numbers are never inside.
    pub(crate) const EMPTY: Self = Self { v: [[[f32::NAN; LANES]; 3]; 3], id: [u32::MAX; LANES] };

    pub(crate) fn set(&mut self, lane: usize, triangle: &Triangle, id: u32) {
        for axis in 0..3 {
            for vertex in 0..3 {
                self.v[axis][vertex][lane] = triangle.p[vertex][axis];
            }
        }
        self.id[lane] = id;
    }

    /// How many lanes hold a triangle.
    #[inline]
    pub(crate) fn len(&self) -> u32 {
        self.id.iter().map(|&id| u32::from(id != u32::MAX)).sum()
    }

    /// The identifier of a lane, with [`FILTERED`].
    #[inline(always)]
    pub(crate) fn id(&self, lane: usize) -> u32 {
        self.id[lane]
    }

    /// Tests all lanes for `0 < t <= t_max`.
    #[inline(always)]
    pub(crate) fn intersect<S: Simd>(&self, simd: S, r: &ShearedRay, t_max: f32) -> Option<BlockHits<S>> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let [vx, vy, vz] = [&self.v[r.axes[0]], &self.v[r.axes[1]], &self.v[r.axes[2]]];
        let (ox, oy, oz) = (splat(r.o[0]), splat(r.o[1]), splat(r.o[2]));
        let (sx, sy) = (splat(r.s[0]), splat(r.s[1]));
        let load = |v: &[f32; LANES]| f32x8::load_array_ref(simd, v);
        let [z0, z1, z2] = [load(&vz[0]) - oz, load(&vz[1]) - oz, load(&vz[2]) - oz];
        let x0 = (load(&vx[0]) - ox) + sx * z0;
        let x1 = (load(&vx[1]) - ox) + sx * z1;
        let x2 = (load(&vx[2]) - ox) + sx * z2;
        let y0 = (load(&vy[0]) - oy) + sy * z0;
        let y1 = (load(&vy[1]) - oy) + sy * z1;
        let y2 = (load(&vy[2]) - oy) + sy * z2;
        let e0 = x1 * y2 - y1 * x2;
        let e1 = x2 * y0 - y2 * x0;
        let e2 = x0 * y1 - y0 * x1;
        let mut e = [e0, e1, e2];
        let mut inside = inside(simd, e);
        if !inside.any_true() {
            return None;
        }
        let zero = splat(0.0);
        let on_edge = inside & (e0.simd_eq(zero) | e1.simd_eq(zero) | e2.simd_eq(zero));
        if on_edge.any_true() {
            e = refine(simd, on_edge.to_bitmask() as u32, [x0, x1, x2], [y0, y1, y2], e);
            inside = self::inside(simd, e);
        }
        let det = (e[0] + e[1]) + e[2];
        let sz = splat(r.s[2]);
        let [z0, z1, z2] = [z0 * sz, z1 * sz, z2 * sz];
        let inv_det = splat(1.0) / det;
        let t = ((e[0] * z0 + e[1] * z1) + e[2] * z2) * inv_det;
        let in_range = inside & t.simd_le(splat(t_max)) & t.simd_gt(zero) & t.simd_lt(splat(f32::INFINITY));
        if !in_range.any_true() {
            return None;
        }
        let max_x = x0.abs().max(x1.abs()).max(x2.abs());
        let max_y = y0.abs().max(y1.abs()).max(y2.abs());
        let max_z = z0.abs().max(z1.abs()).max(z2.abs());
        let max_e = e[0].abs().max(e[1].abs()).max(e[2].abs());
        let delta_z = splat(gamma(3)) * max_z;
        let delta_x = splat(gamma(5)) * (max_x + max_z);
        let delta_y = splat(gamma(5)) * (max_y + max_z);
        let delta_e = splat(2.0) * ((splat(gamma(2)) * max_x * max_y + delta_y * max_x) + delta_x * max_y);
        let delta_t =
            splat(3.0) * ((splat(gamma(3)) * max_e * max_z + delta_e * max_z) + delta_z * max_e) * inv_det.abs();
        // A null determinant makes `t` and its bound NaN or infinite, which no comparison accepts.
        let lanes = (in_range & t.simd_gt(delta_t)).to_bitmask() as u32;
        (lanes != 0).then(|| BlockHits { lanes, t, b1: e[1] * inv_det, b2: e[2] * inv_det })
    }
}

/// The lanes in which the ray passes all edges on the same side. Written so that NaN is outside.
#[inline(always)]
fn inside<S: Simd>(simd: S, e: [f32x8<S>; 3]) -> mask32x8<S> {
    let zero = f32x8::splat(simd, 0.0);
    (e[0].simd_ge(zero) & e[1].simd_ge(zero) & e[2].simd_ge(zero))
        | (e[0].simd_le(zero) & e[1].simd_le(zero) & e[2].simd_le(zero))
}

/// Replaces the edge functions of the given lanes by their values in double precision.
#[cold]
#[inline(never)]
fn refine<S: Simd>(simd: S, lanes: u32, x: [f32x8<S>; 3], y: [f32x8<S>; 3], e: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let (x, y): ([[f32; LANES]; 3], [[f32; LANES]; 3]) = (x.map(Into::into), y.map(Into::into));
    let mut e: [[f32; LANES]; 3] = e.map(Into::into);
    for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
        let refined = edges_f64(x.map(|v| v[lane]), y.map(|v| v[lane]));
        for i in 0..3 {
            e[i][lane] = refined[i];
        }
    }
    e.map(|e| f32x8::load_array(simd, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_five_cache_lines() {
        assert_eq!(size_of::<TriangleBlock>(), 320);
    }
}
