//! The tree of a NanoVDB grid: root, nodes of 32^3, nodes of 16^3, leaves of 8^3 values, flattened to a [`SparseGrid`].
//!
//! Children are byte offsets relative to their parent. Within nodes z runs fastest.

use super::{Bytes, NanoVdbError};
use std::collections::BTreeSet;
use steradian_math::{Bounds3, Point3};
use steradian_scene::{SparseGrid, SparseLayout};

/// Sizes and offsets in bytes, for single-precision values.
const GRID: u64 = 672;
const MAP: u64 = 296;
const WORLD_BOX: u64 = 560;
const ROOT: u64 = 64;
const ROOT_TILE: u64 = 32;
const LEAF: u64 = 2144;
const LEAF_VALUES: u64 = 96;

/// The layout of an inner node.
struct Level {
    /// Children along one side.
    side: u32,
    /// Offset of the bits that mark children.
    mask: u64,
    /// Offset of the table of children and values.
    table: u64,
    /// Size of the node.
    size: u64,
    /// Bricks along the side of a child.
    child: i32,
}

const UPPER: Level = Level { side: 32, mask: 32 + 4096, table: 8256, size: 8256 + 8 * 32768, child: 16 };
const LOWER: Level = Level { side: 16, mask: 32 + 512, table: 1088, size: 1088 + 8 * 4096, child: 1 };

/// A part of the grid, in units of bricks.
enum Part {
    Leaf([i32; 3], u64),
    Tile { low: [i32; 3], side: i32, value: f32 },
}

struct Walk<'a> {
    grid: Bytes<'a>,
    parts: Vec<Part>,
    /// Nodes that a grid of this size still has room for: what refers to one node many times would else explode.
    uppers: u64,
    lowers: u64,
    leaves: u64,
    background: f32,
}

/// Reads the grid in `grid`.
pub(super) fn flatten(grid: Bytes<'_>) -> Result<SparseGrid, NanoVdbError> {
    if !grid.slice("a grid", 0, GRID)?.starts_with(b"NanoVDB") {
        return Err(NanoVdbError::Tree("it does not begin as grids do"));
    }
    let what = "the root of a grid";
    let root = offset(GRID, grid.u64("the tree of a grid", GRID + 24)?)?;
    let tiles = grid.u32(what, root + 24)?;
    let background = grid.f32(what, root + 28)?;
    let size = grid.0.len() as u64;
    let mut walk = Walk {
        grid,
        parts: Vec::new(),
        uppers: size / UPPER.size,
        lowers: size / LOWER.size,
        leaves: size / LEAF,
        background,
    };
    grid.slice(what, root + ROOT, u64::from(tiles) * ROOT_TILE)?;
    let mut keys = BTreeSet::new();
    for i in 0..u64::from(tiles) {
        let tile = root + ROOT + i * ROOT_TILE;
        let key = grid.u64(what, tile)?;
        if !keys.insert(key) {
            return Err(NanoVdbError::Tree("two parts of the root are in the same place"));
        }
        // 21 bits for each axis, of a position in units of 512 bricks.
        let axis = |shift: u32| (((key >> shift & 0x1f_ffff) << 12) as u32 as i32) >> 3;
        let low = [axis(42), axis(21), axis(0)];
        match grid.u64(what, tile + 8)? {
            0 => walk.tile(low, 512, grid.f32(what, tile + 20)?),
            child => {
                walk.uppers = walk.uppers.checked_sub(1).ok_or(TOO_MANY)?;
                walk.upper(offset(root, child)?, low)?;
            }
        }
    }
    build(&walk, root)
}

const TOO_MANY: NanoVdbError = NanoVdbError::Tree("it refers to more nodes than it has room for");

fn offset(base: u64, relative: u64) -> Result<u64, NanoVdbError> {
    // Offsets are signed, but children always follow.
    base.checked_add(relative).filter(|&v| v < 1 << 62).ok_or(NanoVdbError::Tree("an offset leads out of it"))
}

impl Walk<'_> {
    fn tile(&mut self, low: [i32; 3], side: i32, value: f32) {
        // Not-a-number is kept, to be complained about.
        if value != self.background {
            self.parts.push(Part::Tile { low, side, value });
        }
    }

    /// Calls for each child of a node: whether it is a node, what the table says, and its least brick.
    fn children(
        &mut self,
        level: &Level,
        node: u64,
        low: [i32; 3],
        mut each: impl FnMut(&mut Self, Option<u64>, f32, [i32; 3]) -> Result<(), NanoVdbError>,
    ) -> Result<(), NanoVdbError> {
        let grid = Bytes(self.grid.slice("a node", node, level.size)?);
        for n in 0..level.side.pow(3) {
            let byte: [u8; 1] = grid.array("a node", level.mask + u64::from(n / 8))?;
            let entry = level.table + u64::from(n) * 8;
            let child = if byte[0] >> (n % 8) & 1 == 1 { Some(grid.u64("a node", entry)?) } else { None };
            let cell = [n / (level.side * level.side), n / level.side % level.side, n % level.side];
            let at: [i32; 3] = std::array::from_fn(|a| low[a].saturating_add(cell[a] as i32 * level.child));
            each(self, child, grid.f32("a node", entry)?, at)?;
        }
        Ok(())
    }

    fn upper(&mut self, node: u64, low: [i32; 3]) -> Result<(), NanoVdbError> {
        self.children(&UPPER, node, low, |walk, child, value, at| match child {
            None => {
                walk.tile(at, UPPER.child, value);
                Ok(())
            }
            Some(child) => {
                walk.lowers = walk.lowers.checked_sub(1).ok_or(TOO_MANY)?;
                walk.lower(offset(node, child)?, at)
            }
        })
    }

    fn lower(&mut self, node: u64, low: [i32; 3]) -> Result<(), NanoVdbError> {
        self.children(&LOWER, node, low, |walk, child, value, at| match child {
            None => {
                walk.tile(at, LOWER.child, value);
                Ok(())
            }
            Some(child) => {
                walk.leaves = walk.leaves.checked_sub(1).ok_or(TOO_MANY)?;
                let leaf = offset(node, child)?;
                walk.grid.slice("a leaf", leaf, LEAF)?;
                walk.parts.push(Part::Leaf(at, leaf));
                Ok(())
            }
        })
    }
}

/// Table entries for each leaf, and for a grid at least.
const ENTRIES_PER_LEAF: u64 = 512;
const FREE_ENTRIES: u64 = 1 << 20;

fn build(walk: &Walk<'_>, root: u64) -> Result<SparseGrid, NanoVdbError> {
    let grid = walk.grid;
    let what = "the map of a grid";
    let mut index_from_local = [[0.0; 3]; 3];
    let mut origin = [0.0; 3];
    let mut index_bounds = [[0; 3]; 2];
    let mut corners = [[0.0f32; 3]; 2];
    for a in 0..3u64 {
        origin[a as usize] = grid.f32(what, MAP + 72 + 4 * a)?;
        for b in 0..3u64 {
            index_from_local[a as usize][b as usize] = grid.f32(what, MAP + 36 + 4 * (3 * a + b))?;
        }
        for end in 0..2u64 {
            index_bounds[end as usize][a as usize] = grid.i32(what, root + 4 * (3 * end + a))?;
            corners[end as usize][a as usize] = grid.f64(what, WORLD_BOX + 8 * (3 * end + a))? as f32;
        }
    }
    let numbers = index_from_local.iter().flatten().chain(&origin).chain(corners.iter().flatten());
    if numbers.into_iter().any(|v| !v.is_finite()) {
        return Err(NanoVdbError::Tree("its place in space is not finite"));
    }
    // A table that a small file makes large would be an attack.
    let leaves = walk.parts.iter().filter(|p| matches!(p, Part::Leaf(..))).count() as u64;
    let entries = (0..3).fold(1u64, |n, a| {
        let side = (i64::from(index_bounds[1][a]) >> 3) - (i64::from(index_bounds[0][a]) >> 3) + 1;
        n.saturating_mul(side.max(0) as u64)
    });
    if entries > FREE_ENTRIES + ENTRIES_PER_LEAF * leaves {
        return Err(NanoVdbError::Tree("its box is far too large for what it holds"));
    }
    let layout = SparseLayout {
        index_from_local,
        origin,
        bounds: Bounds3 { min: Point3::from_array(corners[0]), max: Point3::from_array(corners[1]) },
        index_bounds,
        background: walk.background,
    };
    let mut out = SparseGrid::new(&layout)?;
    let mut values = [0.0; 512];
    for part in &walk.parts {
        match *part {
            Part::Tile { low, side, value } => out.set_tile(low, low.map(|v| v.saturating_add(side - 1)), value),
            Part::Leaf(brick, at) => {
                let bytes = grid.slice("a leaf", at + LEAF_VALUES, 2048)?;
                for (v, b) in values.iter_mut().zip(bytes.as_chunks::<4>().0) {
                    *v = f32::from_le_bytes(*b);
                }
                out.set_brick(brick, &values);
            }
        }
    }
    Ok(out)
}
