//! The binary tree: binned surface-area heuristic (Wald, "On fast construction of SAH-based bounding volume
//! hierarchies", 2007), built in place over an array of boxes.
//!
//! What a subtree looks like depends on its primitives alone, so building subtrees side by side gives the same tree as building
//! them one after the other.

use fearless_simd::Level;
use steradian_math::Bounds3;

use crate::{BuildError, Bvh, MAX_LEAF, MAX_PRIMITIVES};

/// The most levels of the binary tree, hence of the wide one: 40 by the heuristic, 27 by halving, one to part kinds,
/// and the root.
pub(crate) const MAX_DEPTH: usize = HEURISTIC_DEPTH + 30;
const HEURISTIC_DEPTH: usize = 40;
/// The cost of a node of the binary tree, in leaf tests: small, for most of them vanish into wide nodes.
const NODE_COST: f32 = 0.3;
/// Below this, a subtree is not worth a task.
const PARALLEL: usize = 4096;

/// One input: a box, and which of two kinds of leaf it goes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primitive {
    /// Where the primitive is. Finite, and not empty; may be flat.
    pub bounds: Bounds3,
    /// 0 or 1. A leaf holds primitives of one kind.
    pub kind: u8,
}

/// What the builder assumes about the cost of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// The most primitives in a leaf of each kind; brought into `1..=MAX_LEAF`.
    pub leaf_size: [usize; 2],
    /// How many primitives of each kind are tested for the price of one: 4 for blocks of four triangles, 1 for others.
    pub unit: [usize; 2],
}

impl Default for BuildOptions {
    /// Kind 0 in blocks of four, kind 1 one by one.
    fn default() -> Self {
        Self { leaf_size: [4, 1], unit: [4, 1] }
    }
}

/// A primitive's box in four lanes; the fourth carries the index and the kind.
///
/// Arithmetic runs over all four lanes, so the bits in the fourth must make a normal number: arithmetic on subnormal
/// numbers takes a hundred times as long (measured: two thirds of the build).
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Reference {
    lo: [f32; 4],
    hi: [f32; 4],
}

impl Reference {
    fn new(b: &Bounds3, id: u32, kind: u32) -> Self {
        let lane = |bits: u32| f32::from_bits(Self::NORMAL | bits);
        Self { lo: [b.min.x, b.min.y, b.min.z, lane(id)], hi: [b.max.x, b.max.y, b.max.z, lane(kind)] }
    }

    fn id(&self) -> u32 {
        self.lo[3].to_bits() & !Self::NORMAL
    }

    fn kind(&self) -> u32 {
        self.hi[3].to_bits() & !Self::NORMAL
    }

    /// An exponent bit: with up to 27 bits below it, a finite number of at least two.
    const NORMAL: u32 = 1 << 30;

    #[inline(always)]
    fn centroid(&self) -> [f32; 4] {
        std::array::from_fn(|i| 0.5 * self.lo[i] + 0.5 * self.hi[i])
    }
}

#[inline(always)]
fn min4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
}

#[inline(always)]
fn max4(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
}

/// A box in four lanes, the fourth without meaning.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Box4 {
    lo: [f32; 4],
    hi: [f32; 4],
}

impl Box4 {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 4], hi: [f32::NEG_INFINITY; 4] };

    #[inline(always)]
    fn add(&mut self, lo: [f32; 4], hi: [f32; 4]) {
        self.lo = min4(lo, self.lo);
        self.hi = max4(hi, self.hi);
    }

    /// Half the surface area; of no meaning for an empty box.
    #[inline(always)]
    fn half_area(&self) -> f32 {
        let (x, y, z) = (self.hi[0] - self.lo[0], self.hi[1] - self.lo[1], self.hi[2] - self.lo[2]);
        x * y + y * z + z * x
    }

    fn bounds(&self) -> Bounds3 {
        Bounds3 { min: [self.lo[0], self.lo[1], self.lo[2]].into(), max: [self.hi[0], self.hi[1], self.hi[2]].into() }
    }
}

/// A node of the binary tree. The left child follows its parent.
#[derive(Clone, Copy)]
pub(crate) struct BinaryNode {
    pub bounds: Bounds3,
    /// Inner: the offset from this node to the right child. Leaf: the position of the first primitive.
    pub right_or_first: u32,
    /// Inner: 0. Leaf: `count << 1 | kind`.
    pub leaf: u32,
}

/// The boxes of a range: of its primitives, and of their centroids.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Box4,
    centroids: Box4,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, centroids: Box4::EMPTY };

    #[inline(always)]
    fn add(&mut self, r: &Reference) {
        let c = r.centroid();
        self.bounds.add(r.lo, r.hi);
        self.centroids.add(c, c);
    }

    fn of(refs: &[Reference]) -> Self {
        let mut e = Self::EMPTY;
        refs.iter().for_each(|r| e.add(r));
        e
    }
}

/// A plane between two bins, or the price of the best one.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    /// Bins below this one go left.
    bin: usize,
    cost: f32,
}

/// How positions along the axes map to bins.
struct Binning {
    origin: [f32; 4],
    scale: [f32; 4],
    last: usize,
}

impl Binning {
    fn new(centroids: &Box4, bins: usize) -> Self {
        let scale = std::array::from_fn(|i| {
            let extent = centroids.hi[i] - centroids.lo[i];
            if extent > 0.0 { bins as f32 * (1.0 - 1e-6) / extent } else { 0.0 }
        });
        Self { origin: centroids.lo, scale, last: bins - 1 }
    }

    #[inline(always)]
    fn bins(&self, r: &Reference) -> [usize; 3] {
        let c = r.centroid();
        let at: [f32; 4] = std::array::from_fn(|i| (c[i] - self.origin[i]) * self.scale[i]);
        std::array::from_fn(|i| (at[i] as i32 as usize).min(self.last))
    }

    #[inline(always)]
    fn bin(&self, r: &Reference, axis: usize) -> usize {
        let c = 0.5 * r.lo[axis] + 0.5 * r.hi[axis];
        (((c - self.origin[axis]) * self.scale[axis]) as i32 as usize).min(self.last)
    }
}

struct Builder {
    leaf_size: [u32; 2],
    /// The cost of one primitive of each kind, in units of 1/`GRAIN` leaf tests.
    weight: [u32; 2],
    parallel: bool,
}

const GRAIN: u32 = 8;

impl Builder {
    /// Leaf tests for primitives of this total weight: a block that is not full costs as much as a full one.
    #[inline(always)]
    fn tests(weight: u32) -> f32 {
        weight.div_ceil(GRAIN) as f32
    }

    /// The cost of a binary leaf by its tag.
    fn leaf_cost(&self, leaf: u32) -> f32 {
        Self::tests((leaf >> 1) * self.weight[leaf as usize & 1])
    }

    /// How finely to look for a plane among `n` primitives.
    fn bins(n: usize) -> usize {
        if n > 32 {
            16
        } else if n > 8 {
            8
        } else {
            4
        }
    }

    /// The best of the planes between bins, by area times tests; `None` if no plane parts the centroids.
    fn find_split(&self, refs: &[Reference], binning: &Binning) -> Option<Split> {
        match binning.last {
            3 => self.find_split_of::<4>(refs, binning),
            7 => self.find_split_of::<8>(refs, binning),
            _ => self.find_split_of::<16>(refs, binning),
        }
    }

    fn find_split_of<const BINS: usize>(&self, refs: &[Reference], binning: &Binning) -> Option<Split> {
        let mut boxes = [[Box4::EMPTY; BINS]; 3];
        let mut weights = [[0u32; BINS]; 3];
        for r in refs {
            let w = self.weight[r.kind() as usize & 1];
            let bins = binning.bins(r);
            for axis in 0..3 {
                boxes[axis][bins[axis]].add(r.lo, r.hi);
                weights[axis][bins[axis]] += w;
            }
        }
        let mut best: Option<Split> = None;
        for axis in 0..3 {
            if binning.scale[axis] == 0.0 {
                continue;
            }
            let mut right_cost = [f32::INFINITY; BINS];
            let (mut b, mut w) = (Box4::EMPTY, 0);
            for bin in (1..BINS).rev() {
                b.add(boxes[axis][bin].lo, boxes[axis][bin].hi);
                w += weights[axis][bin];
                if w != 0 {
                    right_cost[bin] = b.half_area() * Self::tests(w);
                }
            }
            let (mut b, mut w) = (Box4::EMPTY, 0);
            for bin in 1..BINS {
                b.add(boxes[axis][bin - 1].lo, boxes[axis][bin - 1].hi);
                w += weights[axis][bin - 1];
                if w == 0 {
                    continue;
                }
                let cost = b.half_area() * Self::tests(w) + right_cost[bin];
                if cost < best.map_or(f32::INFINITY, |s| s.cost) {
                    best = Some(Split { axis, bin, cost });
                }
            }
        }
        best
    }

    /// Moves the references left of the plane to the front; how many they are, and the extents of both parts.
    fn partition(refs: &mut [Reference], binning: &Binning, split: Split) -> (usize, Extent, Extent) {
        let (mut left, mut right) = (Extent::EMPTY, Extent::EMPTY);
        let (mut i, mut j) = (0, refs.len());
        while i < j {
            let r = refs[i];
            if binning.bin(&r, split.axis) < split.bin {
                left.add(&r);
                i += 1;
            } else {
                right.add(&r);
                j -= 1;
                refs.swap(i, j);
            }
        }
        (i, left, right)
    }

    /// Parts kinds if they are mixed in a range that is small enough for a leaf, else halves it along the longest axis.
    fn partition_evenly(refs: &mut [Reference], extent: &Extent, by_kind: bool) -> (usize, Extent, Extent) {
        let middle = if by_kind {
            refs.sort_unstable_by_key(|r| (r.kind(), r.id()));
            refs.partition_point(|r| r.kind() == 0)
        } else {
            let c = &extent.centroids;
            let size: [f32; 3] = std::array::from_fn(|i| 0.5 * c.hi[i] - 0.5 * c.lo[i]);
            let axis = (0..3).fold(0, |best, i| if size[i] > size[best] { i } else { best });
            let key = |r: &Reference| 0.5 * r.lo[axis] + 0.5 * r.hi[axis];
            let middle = refs.len() / 2;
            refs.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.id().cmp(&b.id())));
            middle
        };
        let (left, right) = refs.split_at(middle);
        (middle, Extent::of(left), Extent::of(right))
    }

    /// Moves the references of the left child to the front and says how many they are, with the extents of both children; `None`
    /// if the range had better be a leaf.
    fn part(&self, refs: &mut [Reference], extent: &Extent, depth: usize) -> Option<(usize, Extent, Extent)> {
        let n = refs.len();
        let kind = refs[0].kind();
        let limit = self.leaf_size[kind as usize & 1] as usize;
        let small = n <= self.leaf_size[0].max(self.leaf_size[1]) as usize;
        let mixed = small && refs.iter().any(|r| r.kind() != kind);
        let weight: u32 = if small { refs.iter().map(|r| self.weight[r.kind() as usize & 1]).sum() } else { u32::MAX };
        let may_be_leaf = n <= limit && !mixed;
        let binning = Binning::new(&extent.centroids, Self::bins(n));
        let split = if n == 1 || mixed || depth >= HEURISTIC_DEPTH { None } else { self.find_split(refs, &binning) };
        let area = extent.bounds.half_area();
        let worth = |s: &Split| s.cost + NODE_COST * area < area * Self::tests(weight);
        if may_be_leaf && !split.as_ref().is_some_and(worth) {
            return None;
        }
        Some(match split {
            Some(split) => Self::partition(refs, &binning, split),
            None => Self::partition_evenly(refs, extent, mixed),
        })
    }

    /// Appends the tree of `refs`, whose first stands at `first`.
    fn append(&self, refs: &mut [Reference], nodes: &mut Vec<BinaryNode>, first: u32, extent: &Extent, depth: usize) {
        let at = nodes.len();
        let bounds = extent.bounds.bounds();
        let Some((middle, left, right)) = self.part(refs, extent, depth) else {
            nodes.push(BinaryNode { bounds, right_or_first: first, leaf: (refs.len() as u32) << 1 | refs[0].kind() });
            return;
        };
        nodes.push(BinaryNode { bounds, right_or_first: 0, leaf: 0 });
        let (left_refs, right_refs) = refs.split_at_mut(middle);
        self.append(left_refs, nodes, first, &left, depth + 1);
        nodes[at].right_or_first = (nodes.len() - at) as u32;
        self.append(right_refs, nodes, first + middle as u32, &right, depth + 1);
    }

    /// Builds the tree of `refs`, in tasks of their own below its top.
    fn build(&self, refs: &mut [Reference], first: u32, extent: &Extent, depth: usize) -> Tree {
        let n = refs.len();
        if n > PARALLEL
            && let Some((middle, left, right)) = self.part(refs, extent, depth)
        {
            let (left_refs, right_refs) = refs.split_at_mut(middle);
            let mut go_left = || self.build(left_refs, first, &left, depth + 1);
            let mut go_right = || self.build(right_refs, first + middle as u32, &right, depth + 1);
            let children = if self.parallel { rayon::join(go_left, go_right) } else { (go_left(), go_right()) };
            return Tree::Top(extent.bounds.bounds(), Box::new(children));
        }
        let mut nodes = Vec::with_capacity(n);
        self.append(refs, &mut nodes, first, extent, depth);
        nodes.shrink_to_fit();
        Tree::Below(nodes)
    }
}

/// The binary tree while it is built.
enum Tree {
    /// Where tasks part.
    Top(Bounds3, Box<(Tree, Tree)>),
    /// What one task made: its root first.
    Below(Vec<BinaryNode>),
}

impl Tree {
    fn len(&self) -> usize {
        match self {
            Self::Top(_, children) => 1 + children.0.len() + children.1.len(),
            Self::Below(nodes) => nodes.len(),
        }
    }

    /// Appends its nodes, giving back their memory as it goes.
    fn flatten(self, nodes: &mut Vec<BinaryNode>) {
        match self {
            Self::Top(bounds, children) => {
                let at = nodes.len();
                nodes.push(BinaryNode { bounds, right_or_first: 0, leaf: 0 });
                let (left, right) = *children;
                left.flatten(nodes);
                nodes[at].right_or_first = (nodes.len() - at) as u32;
                right.flatten(nodes);
            }
            Self::Below(below) => nodes.extend(below),
        }
    }
}

impl Bvh {
    /// Builds a tree over boxes, which are read once and numbered as they come. No primitives give an empty tree.
    ///
    /// Runs on several threads if called inside a rayon pool; the result does not depend on that.
    ///
    /// # Errors
    /// If a box is not finite or is empty, a kind is not 0 or 1, or there are too many primitives.
    pub fn build(
        primitives: impl ExactSizeIterator<Item = Primitive>,
        options: &BuildOptions,
    ) -> Result<Self, BuildError> {
        if primitives.len() > MAX_PRIMITIVES {
            return Err(BuildError::TooMany { count: primitives.len() });
        }
        let mut refs = Vec::with_capacity(primitives.len());
        let mut extent = Extent::EMPTY;
        for (i, p) in primitives.enumerate() {
            let b = &p.bounds;
            if b.is_empty() || !b.min.is_finite() || !b.max.is_finite() {
                return Err(BuildError::BadBounds { primitive: i });
            }
            if p.kind > 1 {
                return Err(BuildError::BadKind { primitive: i });
            }
            let r = Reference::new(b, i as u32, u32::from(p.kind));
            extent.add(&r);
            refs.push(r);
        }
        let mut bvh = Self { nodes: Vec::new(), order: Vec::new(), bounds: Bounds3::EMPTY, level: Level::new() };
        if refs.is_empty() {
            return Ok(bvh);
        }
        let unit = options.unit.map(|u| u.clamp(1, GRAIN as usize) as u32);
        let builder = Builder {
            leaf_size: options.leaf_size.map(|n| n.clamp(1, MAX_LEAF) as u32),
            weight: unit.map(|u| GRAIN / u),
            parallel: rayon::current_thread_index().is_some(),
        };
        let tree = builder.build(&mut refs, 0, &extent, 1);
        bvh.order = refs.iter().map(Reference::id).collect();
        drop(refs);
        let mut binary = Vec::with_capacity(tree.len());
        tree.flatten(&mut binary);
        bvh.bounds = extent.bounds.bounds();
        bvh.nodes = crate::collapse::collapse(&binary, &|leaf| builder.leaf_cost(leaf));
        Ok(bvh)
    }
}
