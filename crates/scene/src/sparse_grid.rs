//! A scalar on the integer points of space, kept only where there is something: bricks of 8 x 8 x 8 values behind a table
//! (after the leaves of Museth 2013, "VDB"; the tree above them is flattened).

use crate::MediumError;
use steradian_math::{Bounds3, Point3, Vec3};

/// Points along the side of a brick.
pub const BRICK: i32 = 8;
/// Points in a brick.
const POINTS: usize = (BRICK * BRICK * BRICK) as usize;
/// Table entries at most, which is half a gigabyte of them.
const MAX_TABLE: u64 = 1 << 27;
/// Marks a table entry as an index into the values of tiles, not into the bricks.
const TILE: u32 = 1 << 31;

/// A scalar field on integer points, interpolated in between; the background value outside.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseGrid {
    /// The least brick of the table, in units of bricks.
    first: [i32; 3],
    /// Bricks along x, y, z.
    size: [u32; 3],
    /// For each brick, x fastest: where its values are.
    table: Vec<u32>,
    /// Values of bricks, z fastest within each.
    bricks: Vec<f32>,
    /// Values of bricks that are the same throughout; the first is the background.
    tiles: Vec<f32>,
    /// Integer points from the field's own space: rows of a matrix and a shift that comes first.
    index_from_local: [[f32; 3]; 3],
    origin: [f32; 3],
    bounds: Bounds3,
}

/// Where the integer points lie, and which of them matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseLayout {
    /// Index space from local space, applied to `p - origin`.
    pub index_from_local: [[f32; 3]; 3],
    /// Local position of the point (0, 0, 0).
    pub origin: [f32; 3],
    /// The box in local space outside of which nothing is looked up.
    pub bounds: Bounds3,
    /// Least and greatest integer point that holds anything.
    pub index_bounds: [[i32; 3]; 2],
    /// The value of points that are not mentioned.
    pub background: f32,
}

impl SparseGrid {
    /// A field that is all background.
    ///
    /// # Errors
    /// If the box is empty, or so large that its table would not fit into memory.
    pub fn new(layout: &SparseLayout) -> Result<Self, MediumError> {
        let [low, high] = layout.index_bounds;
        let first = low.map(|v| v.div_euclid(BRICK));
        let last = high.map(|v| v.div_euclid(BRICK));
        let mut size = [0u32; 3];
        let mut entries = 1u64;
        for axis in 0..3 {
            let n = i64::from(last[axis]) - i64::from(first[axis]) + 1;
            if n <= 0 || low[axis] > high[axis] {
                return Err(MediumError::Bounds);
            }
            size[axis] = n as u32;
            entries = entries.saturating_mul(n as u64);
        }
        if entries > MAX_TABLE {
            return Err(MediumError::GridSize { grid: "density", size, expected: entries, found: 0 });
        }
        Ok(Self {
            first,
            size,
            table: vec![TILE; entries as usize],
            bricks: Vec::new(),
            tiles: vec![layout.background],
            index_from_local: layout.index_from_local,
            origin: layout.origin,
            bounds: layout.bounds,
        })
    }

    fn entry(&self, brick: [i32; 3]) -> Option<usize> {
        let mut cell = [0usize; 3];
        for axis in 0..3 {
            let c = i64::from(brick[axis]) - i64::from(self.first[axis]);
            if c < 0 || c >= i64::from(self.size[axis]) {
                return None;
            }
            cell[axis] = c as usize;
        }
        Some(cell[0] + self.size[0] as usize * (cell[1] + self.size[1] as usize * cell[2]))
    }

    /// Fills one brick, whose least point is `8 brick`, with values, z fastest. Ignored outside the table.
    pub fn set_brick(&mut self, brick: [i32; 3], values: &[f32; POINTS]) {
        if let Some(entry) = self.entry(brick) {
            let number = self.bricks.len() / POINTS;
            self.bricks.extend_from_slice(values);
            self.table[entry] = number as u32;
        }
    }

    /// Fills all bricks from `low` to `high`, both included, with one value. What lies outside the table is ignored.
    pub fn set_tile(&mut self, low: [i32; 3], high: [i32; 3], value: f32) {
        if value == self.tiles[0] {
            return;
        }
        if self.tiles.last() != Some(&value) {
            self.tiles.push(value);
        }
        let number = self.tiles.len() - 1;
        let clip = |axis: usize| {
            let end = i64::from(self.first[axis]) + i64::from(self.size[axis]) - 1;
            low[axis].max(self.first[axis])..=high[axis].min(end as i32)
        };
        for z in clip(2) {
            for y in clip(1) {
                for x in clip(0) {
                    if let Some(entry) = self.entry([x, y, z]) {
                        self.table[entry] = TILE | number as u32;
                    }
                }
            }
        }
    }

    /// The box outside of which nothing is looked up.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Bytes of table and values.
    pub fn bytes(&self) -> usize {
        size_of_val(self.table.as_slice()) + size_of_val(self.bricks.as_slice())
    }

    /// The first value that is negative, infinite or undefined, with its place in the order of storage.
    pub fn first_bad_value(&self) -> Option<(usize, f32)> {
        let bad = |v: &f32| !(*v >= 0.0 && *v < f32::INFINITY);
        let all = self.tiles.iter().chain(&self.bricks);
        all.enumerate().find(|(_, v)| bad(v)).map(|(i, v)| (i, *v))
    }

    /// The value at an integer point.
    #[inline]
    pub fn value(&self, p: [i32; 3]) -> f32 {
        let Some(entry) = self.entry(p.map(|v| v >> 3)) else { return self.tiles[0] };
        let t = self.table[entry];
        if t & TILE != 0 {
            return self.tiles[(t & !TILE) as usize];
        }
        let [x, y, z] = p.map(|v| (v & 7) as usize);
        self.bricks[t as usize * POINTS + (x << 6 | y << 3 | z)]
    }

    /// The position among the integer points of a point of local space.
    #[inline]
    pub fn to_index(&self, p: Point3) -> Vec3 {
        let d = [p.x - self.origin[0], p.y - self.origin[1], p.z - self.origin[2]];
        let row = |r: [f32; 3]| r[0] * d[0] + r[1] * d[1] + r[2] * d[2];
        Vec3::new(row(self.index_from_local[0]), row(self.index_from_local[1]), row(self.index_from_local[2]))
    }

    /// The field at a point of local space: trilinear between the eight integer points around it.
    #[inline]
    pub fn sample(&self, p: Point3) -> f32 {
        let q = self.to_index(p);
        let (fx, fy, fz) = (q.x.floor(), q.y.floor(), q.z.floor());
        let (tx, ty, tz) = (q.x - fx, q.y - fy, q.z - fz);
        let (x, y, z) = (fx as i32, fy as i32, fz as i32);
        let lerp = |t: f32, a: f32, b: f32| a + t * (b - a);
        let at = |i: i32, j: i32, k: i32| self.value([x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)]);
        let row = |i, j| lerp(tz, at(i, j, 0), at(i, j, 1));
        let plane = |i| lerp(ty, row(i, 0), row(i, 1));
        lerp(tx, plane(0), plane(1))
    }

    /// A bound on the field in a box of local space.
    pub fn max_in(&self, b: &Bounds3) -> f32 {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for corner in 0..8 {
            let q = self.to_index(b.corner(corner));
            for axis in 0..3 {
                low[axis] = low[axis].min(q[axis]);
                high[axis] = high[axis].max(q[axis]);
            }
        }
        let mut most = 0.0f32;
        let mut range = [(0, -1); 3];
        for axis in 0..3 {
            // One more point on either side: interpolation reaches there, and rounding may.
            let (a, b) = ((low[axis] - 1e-3).floor() as i32, (high[axis] + 1e-3).floor() as i32);
            let (a, b) = (a, b.saturating_add(1));
            let first = i64::from(self.first[axis]) * i64::from(BRICK);
            let last = first + i64::from(self.size[axis]) * i64::from(BRICK) - 1;
            let (a, b) = (i64::from(a), i64::from(b));
            if a < first || b > last {
                most = most.max(self.tiles[0]);
            }
            range[axis] = (a.max(first) as i32, b.min(last) as i32);
        }
        for x in range[0].0..=range[0].1 {
            for y in range[1].0..=range[1].1 {
                for z in range[2].0..=range[2].1 {
                    most = most.max(self.value([x, y, z]));
                }
            }
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(low: i32, high: i32) -> SparseLayout {
        SparseLayout {
            index_from_local: [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]],
            origin: [1.0, 0.0, 0.0],
            bounds: Bounds3::new(Point3::splat(-10.0), Point3::splat(10.0)),
            index_bounds: [[low; 3], [high; 3]],
            background: 0.0,
        }
    }

    #[test]
    fn bricks_tiles_and_background_are_told_apart() {
        let mut g = SparseGrid::new(&layout(-9, 20)).unwrap();
        let mut values = [0.0; POINTS];
        values[1 << 6 | 2 << 3 | 3] = 5.0;
        g.set_brick([-1, 0, 1], &values);
        g.set_tile([1, 1, 1], [9, 2, 2], 2.0);
        assert_eq!(g.value([-7, 2, 11]), 5.0);
        assert_eq!((g.value([-7, 2, 12]), g.value([8, 8, 8]), g.value([7, 8, 8])), (0.0, 2.0, 0.0));
        assert_eq!((g.value([i32::MAX; 3]), g.value([i32::MIN; 3])), (0.0, 0.0));
        // Half way between the point with 5 and its neighbour with 0.
        assert_eq!(g.sample(Point3::new(-6.5 / 2.0 + 1.0, 1.0, 5.5)), 2.5);
        let near = Bounds3::new(Point3::new(-2.6, 0.9, 5.4), Point3::new(-2.4, 1.1, 5.6));
        assert_eq!(g.max_in(&near), 5.0);
        assert_eq!(g.max_in(&Bounds3::new(Point3::splat(-3.0), Point3::splat(-2.0))), 0.0);
    }

    #[test]
    fn impossible_boxes_are_errors() {
        assert_eq!(SparseGrid::new(&layout(3, 2)), Err(MediumError::Bounds));
        assert!(matches!(SparseGrid::new(&layout(i32::MIN, i32::MAX)), Err(MediumError::GridSize { .. })));
    }

    #[test]
    fn bad_values_are_found() {
        let mut g = SparseGrid::new(&layout(0, 7)).unwrap();
        assert_eq!(g.first_bad_value(), None);
        let mut values = [0.0; POINTS];
        values[9] = -1.0;
        g.set_brick([0; 3], &values);
        assert_eq!(g.first_bad_value(), Some((10, -1.0)));
    }
}
