//! The tree: nodes of eight boxes, references to children packed in 32 bits, and leaves.

use fearless_simd::Level;
use steradian_math::Bounds3;

use crate::WIDTH;

/// A node: eight child boxes, one array per plane, and eight child references. 224 bytes.
///
/// `planes[axis][0]` are the least and `planes[axis][1]` the greatest coordinates, so that a ray picks its near and
/// far planes with one index per axis. An empty slot has `min = +inf`, `max = -inf`, which no ray enters.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Node {
    pub(crate) planes: [[[f32; WIDTH]; 2]; 3],
    pub(crate) child: [u32; WIDTH],
}

impl Node {
    pub(crate) const EMPTY: Self =
        Self { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], child: [ChildRef::NONE.0; WIDTH] };

    /// The box of child `i`; empty if the slot is unused.
    pub fn bounds(&self, i: usize) -> Bounds3 {
        let p = &self.planes;
        Bounds3 { min: [p[0][0][i], p[1][0][i], p[2][0][i]].into(), max: [p[0][1][i], p[1][1][i], p[2][1][i]].into() }
    }

    /// How many of the eight slots hold a child.
    pub fn child_count(&self) -> u32 {
        self.child.iter().map(|&c| u32::from(c != ChildRef::NONE.0)).sum()
    }

    pub(crate) fn set(&mut self, i: usize, bounds: &Bounds3, child: ChildRef) {
        for axis in 0..3 {
            self.planes[axis][0][i] = bounds.min[axis];
            self.planes[axis][1][i] = bounds.max[axis];
        }
        self.child[i] = child.0;
    }
}

/// A run of primitives in the tree's order, all of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// The position of the first in [`Bvh::order`] (or whatever [`Bvh::renumber_leaves`] made of it).
    pub first: u32,
    /// How many, from 1 to [`MAX_LEAF`](crate::MAX_LEAF).
    pub count: u32,
    /// 0 or 1, as given to the build.
    pub kind: u32,
}

impl Leaf {
    /// The run as a range of positions.
    #[inline]
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// A child: bit 31 says leaf; a leaf has its kind in bit 30, its count less one in bits 27 to 29, its first below.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChildRef(pub u32);

impl ChildRef {
    pub const NONE: Self = Self(0x7fff_ffff);
    pub const ROOT: Self = Self(0);
    const LEAF: u32 = 1 << 31;
    const FIRST_BITS: u32 = 27;

    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub const fn from_leaf(leaf: Leaf) -> Self {
        Self(Self::LEAF | leaf.kind << 30 | (leaf.count - 1) << Self::FIRST_BITS | leaf.first)
    }

    #[inline(always)]
    pub const fn leaf(self) -> Leaf {
        Leaf {
            first: self.0 & ((1 << Self::FIRST_BITS) - 1),
            count: (self.0 >> Self::FIRST_BITS & 7) + 1,
            kind: self.0 >> 30 & 1,
        }
    }
}

/// An 8-wide tree over boxes.
#[derive(Clone, Debug)]
pub struct Bvh {
    pub(crate) nodes: Vec<Node>,
    pub(crate) order: Vec<u32>,
    pub(crate) bounds: Bounds3,
    pub(crate) level: Level,
}

impl Bvh {
    /// The nodes, the root first.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Which input primitive stands at each position of the leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The box around everything; empty for an empty tree.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// The bytes the tree occupies.
    pub fn byte_size(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.order.as_slice())
    }

    /// The instruction set that traversal uses.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Uses another instruction set (one of [`available_levels`]); the hits are the same.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
    }

    /// Calls `f` for every leaf, in the order of their positions.
    pub fn for_each_leaf(&self, mut f: impl FnMut(Leaf)) {
        for node in &self.nodes {
            for &child in &node.child {
                if ChildRef(child).is_leaf() {
                    f(ChildRef(child).leaf());
                }
            }
        }
    }

    /// Replaces what each leaf names, for callers that keep the content of leaves in another form (say, blocks of
    /// triangles). The result's `first` must be below [`MAX_PRIMITIVES`](crate::MAX_PRIMITIVES), its `count` from 1 to
    /// [`MAX_LEAF`](crate::MAX_LEAF), its `kind` 0 or 1. [`Bvh::validate`] applies to the tree before this.
    ///
    /// # Panics
    /// If a result is out of these ranges.
    pub fn renumber_leaves(&mut self, mut f: impl FnMut(Leaf) -> Leaf) {
        for node in &mut self.nodes {
            for child in &mut node.child {
                if ChildRef(*child).is_leaf() {
                    let leaf = f(ChildRef(*child).leaf());
                    assert!(
                        (leaf.first as usize) < crate::MAX_PRIMITIVES
                            && (1..=crate::MAX_LEAF as u32).contains(&leaf.count)
                            && leaf.kind < 2,
                        "leaf out of range: {leaf:?}"
                    );
                    *child = ChildRef::from_leaf(leaf).0;
                }
            }
        }
    }

    /// Takes [`Bvh::order`] out, when the caller makes its own copy of what the leaves need.
    pub fn take_order(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.order)
    }
}

/// Every instruction set that this machine can run, the best one last: for tests that run one case on each.
pub fn available_levels() -> Vec<Level> {
    let best = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        [
            best.as_sse2().map(Level::Sse2),
            best.as_sse4_2().map(Level::Sse4_2),
            best.as_avx2().map(Level::Avx2),
            best.as_avx512().map(Level::Avx512),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    vec![best]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_survives_packing() {
        for first in [0, 1, 12345, (1 << 27) - 1] {
            for count in 1..=8 {
                for kind in 0..2 {
                    let leaf = Leaf { first, count, kind };
                    assert!(ChildRef::from_leaf(leaf).is_leaf());
                    assert_eq!(ChildRef::from_leaf(leaf).leaf(), leaf);
                }
            }
        }
        assert!(!ChildRef::ROOT.is_leaf() && !ChildRef::NONE.is_leaf());
    }

    #[test]
    fn a_node_is_seven_half_cache_lines() {
        assert_eq!(size_of::<Node>(), 224);
    }
}
