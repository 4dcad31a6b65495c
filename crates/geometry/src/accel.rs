//! What a ray meets first among triangles and other things: one BVH, with triangles in blocks at its leaves.

use std::fmt;
use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, dispatch};
use steradian_bvh::fearless_simd;
use steradian_bvh::{BuildError, BuildOptions, Bvh, Leaf, Node, Primitive, Visitor};
use steradian_math::{Bounds3, Point3, Ray, next_down};

use crate::block::{FILTERED, LANES, TriangleBlock};
use crate::{NoTally, RayRows, ShearedRay, Tally, Triangle};

const TRIANGLE: u8 = 0;
const OTHER: u8 = 1;

/// A triangle for [`Accel::build`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputTriangle {
    /// The vertices.
    pub p: [Point3; 3],
    /// The caller's name for it, below `2^31`; reported in hits and used to order hits at equal distance.
    pub id: u32,
    /// Whether hits must be confirmed by the filter (say, because the surface has holes painted on it).
    pub filtered: bool,
}

/// What was hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HitKind {
    /// A triangle; the identifier is [`InputTriangle::id`].
    Triangle,
    /// Something else; the identifier is its index in the `others` of [`Accel::build`].
    Other,
}

/// The nearest hit: what traversal needs to remember. The full interaction is worked out once, afterwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelHit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of a triangle's second vertex; 0 for others.
    pub b1: f32,
    /// Barycentric coordinate of a triangle's third vertex; 0 for others.
    pub b2: f32,
    /// Which one.
    pub id: u32,
    /// Which kind.
    pub kind: HitKind,
}

impl AccelHit {
    /// No hit yet, on a ray of this length.
    #[inline(always)]
    fn none(t_max: f32) -> Self {
        Self { t: t_max, b1: 0.0, b2: 0.0, id: u32::MAX, kind: HitKind::Other }
    }

    #[inline(always)]
    fn if_any(self) -> Option<Self> {
        (self.id != u32::MAX).then_some(self)
    }
}

/// Why an [`Accel`] cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccelError {
    /// A triangle has a vertex that is not finite.
    BadTriangle {
        /// Its identifier.
        id: u32,
    },
    /// One of the others has a box that is not finite, or is empty.
    BadBounds {
        /// Its index.
        index: usize,
    },
    /// An identifier of `2^31` or more.
    BadId {
        /// The identifier.
        id: u32,
    },
    /// More primitives than a tree can hold.
    TooMany {
        /// How many.
        count: usize,
    },
}

impl fmt::Display for AccelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadTriangle { id } => write!(f, "triangle {id} has a vertex that is not finite"),
            Self::BadBounds { index } => write!(f, "primitive {index} has no finite bounding box"),
            Self::BadId { id } => write!(f, "triangle identifier {id} is not below 2^31"),
            Self::TooMany { count } => write!(f, "{count} primitives are too many for one tree"),
        }
    }
}

impl std::error::Error for AccelError {}

/// A tree over triangles and other things.
///
/// The answer of a query does not depend on the shape of the tree, the order of the input or the instruction set: hits
/// at equal distance are ordered by kind, then by identifier, smaller first.
#[derive(Clone, Debug)]
pub struct Accel {
    bvh: Bvh,
    blocks: Vec<TriangleBlock>,
    others: Vec<u32>,
    dropped: usize,
}

impl Accel {
    /// Builds a tree. Triangles without area are left out, since no ray meets them.
    ///
    /// # Errors
    /// If anything is not finite, or there is too much of it.
    pub fn build(triangles: &[InputTriangle], others: &[Bounds3]) -> Result<Self, AccelError> {
        Self::build_from(triangles.len(), |i| triangles[i], others)
    }

    /// As [`Accel::build`], asking for each of `count` triangles by its number, two or three times, so that millions of them need not be kept twice.
    ///
    /// # Errors
    /// As [`Accel::build`].
    pub fn build_from(
        count: usize,
        triangle: impl Fn(usize) -> InputTriangle,
        others: &[Bounds3],
    ) -> Result<Self, AccelError> {
        // The index of each primitive in its list: triangles without area leave gaps.
        let mut source = Vec::with_capacity(count + others.len());
        for i in 0..count {
            let t = triangle(i);
            if t.id >= FILTERED {
                return Err(AccelError::BadId { id: t.id });
            }
            if !t.p.iter().all(|p| p.is_finite()) {
                return Err(AccelError::BadTriangle { id: t.id });
            }
            if !(Triangle { p: t.p }).is_degenerate() {
                source.push(i as u32);
            }
        }
        let triangle_count = source.len();
        source.extend(0..others.len() as u32);
        let primitives = source.iter().enumerate().map(|(position, &i)| {
            if position < triangle_count {
                Primitive { bounds: Triangle { p: triangle(i as usize).p }.bounds(), kind: TRIANGLE }
            } else {
                Primitive { bounds: others[i as usize], kind: OTHER }
            }
        });
        let options = BuildOptions { leaf_size: [LANES, 1], unit: [LANES, 1] };
        let mut bvh = Bvh::build(primitives, &options).map_err(|e| match e {
            BuildError::TooMany { count } => AccelError::TooMany { count },
            BuildError::BadBounds { primitive } | BuildError::BadKind { primitive } => {
                AccelError::BadBounds { index: primitive - triangle_count }
            }
        })?;
        let mut block_count = 0;
        bvh.for_each_leaf(|leaf| block_count += usize::from(leaf.kind == u32::from(TRIANGLE)));
        let (mut blocks, mut other_ids) = (Vec::with_capacity(block_count), Vec::with_capacity(others.len()));
        let order = bvh.take_order();
        bvh.renumber_leaves(|leaf| {
            let members = order[leaf.range()].iter().map(|&p| source[p as usize]);
            if leaf.kind == u32::from(TRIANGLE) {
                let mut block = TriangleBlock::EMPTY;
                for (lane, member) in members.enumerate() {
                    let t = triangle(member as usize);
                    block.set(lane, &Triangle { p: t.p }, t.id | if t.filtered { FILTERED } else { 0 });
                }
                blocks.push(block);
                Leaf { first: blocks.len() as u32 - 1, count: 1, ..leaf }
            } else {
                let first = other_ids.len() as u32;
                other_ids.extend(members);
                Leaf { first, ..leaf }
            }
        });
        Ok(Self { bvh, blocks, others: other_ids, dropped: count - triangle_count })
    }

    /// The box around everything; empty if there is nothing.
    pub fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    /// The bytes that nodes, triangles and references occupy.
    pub fn byte_size(&self) -> usize {
        self.bvh.byte_size() + size_of_val(self.blocks.as_slice()) + size_of_val(self.others.as_slice())
    }

    /// How many triangles without area were left out.
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// The tree under it, its leaves renumbered to blocks and positions.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The instruction set that queries use.
    pub fn level(&self) -> Level {
        self.bvh.level()
    }

    /// Uses another instruction set; the hits are the same, bit for bit.
    pub fn set_level(&mut self, level: Level) {
        self.bvh.set_level(level);
    }

    /// The nearest hit with `0 < t <= ray.t_max`.
    ///
    /// `other(index, ray)` intersects one of the others: it returns the least `t` in `(0, ray.t_max]`, with the
    /// `t_max` of the ray it is given. What it returns is always the nearest hit so far, so it may keep details of
    /// its last answer; they belong to the result if the result's kind is [`HitKind::Other`].
    /// `filter(id, t, b1, b2)` confirms a hit of a triangle marked as filtered. It may be asked about hits that turn
    /// out not to be the nearest, so its answer must depend on its arguments alone.
    #[inline]
    pub fn closest(
        &self,
        ray: &Ray,
        other: impl FnMut(u32, &Ray) -> Option<f32>,
        filter: impl FnMut(u32, f32, f32, f32) -> bool,
    ) -> Option<AccelHit> {
        self.closest_counted(ray, other, filter, &NoTally)
    }

    /// As [`Accel::closest`], counting tests. The others count as one test each, whatever they are.
    #[inline]
    pub fn closest_counted(
        &self,
        ray: &Ray,
        other: impl FnMut(u32, &Ray) -> Option<f32>,
        filter: impl FnMut(u32, f32, f32, f32) -> bool,
        tally: &impl Tally,
    ) -> Option<AccelHit> {
        let best = AccelHit::none(ray.t_max);
        let mut closest = Closest { accel: self, ray: *ray, sheared: ShearedRay::new(ray), best, other, filter, tally };
        self.bvh.visit_nearest(ray, &mut closest);
        closest.best.if_any()
    }

    /// As [`Accel::closest`] for many rays, which have been [prepared](RayRows::prepare); `found` is told the answer of each, in their order.
    #[inline]
    pub fn closest_rows(
        &self,
        rays: &RayRows,
        mut other: impl FnMut(u32, &Ray) -> Option<f32>,
        mut filter: impl FnMut(u32, f32, f32, f32) -> bool,
        mut found: impl FnMut(usize, Option<AccelHit>),
    ) {
        dispatch!(self.level(), simd => {
            for i in 0..rays.len() {
                let ray = rays.ray(i);
                let best = AccelHit::none(ray.t_max);
                let (other, filter) = (&mut other, &mut filter);
                let mut closest = Closest { accel: self, ray, sheared: rays.sheared(i), best, other, filter, tally: &NoTally };
                self.bvh.visit_nearest_in(simd, &rays.box_ray(i), &mut closest);
                found(i, closest.best.if_any());
            }
        });
    }

    /// As [`Accel::any`] for many rays, which have been [prepared](RayRows::prepare): bit `i` of the result answers ray `i`.
    #[inline]
    pub fn any_rows(
        &self,
        rays: &RayRows,
        mut other: impl FnMut(u32, &Ray) -> bool,
        mut filter: impl FnMut(u32, f32, f32, f32) -> bool,
    ) -> u64 {
        dispatch!(self.level(), simd => {
            let mut occluded = 0;
            for i in 0..rays.len() {
                let ray = &rays.ray(i);
                let (other, filter) = (&mut other, &mut filter);
                let mut any = Any { accel: self, ray, sheared: rays.sheared(i), other, filter, tally: &NoTally };
                occluded |= u64::from(self.bvh.visit_any_in(simd, &rays.box_ray(i), &mut any)) << i;
            }
            occluded
        })
    }

    /// Whether anything is hit with `0 < t <= ray.t_max`. `other` and `filter` as in [`Accel::closest`], except that
    /// `other` says whether there is a hit.
    #[inline]
    pub fn any(
        &self,
        ray: &Ray,
        other: impl FnMut(u32, &Ray) -> bool,
        filter: impl FnMut(u32, f32, f32, f32) -> bool,
    ) -> bool {
        self.any_counted(ray, other, filter, &NoTally)
    }

    /// As [`Accel::any`], counting tests.
    #[inline]
    pub fn any_counted(
        &self,
        ray: &Ray,
        other: impl FnMut(u32, &Ray) -> bool,
        filter: impl FnMut(u32, f32, f32, f32) -> bool,
        tally: &impl Tally,
    ) -> bool {
        let mut any = Any { accel: self, ray, sheared: ShearedRay::new(ray), other, filter, tally };
        self.bvh.visit_any(ray, &mut any)
    }

    #[inline(always)]
    fn block(&self, leaf: Leaf) -> &TriangleBlock {
        &self.blocks[leaf.first as usize]
    }

    #[inline(always)]
    fn other_ids(&self, leaf: Leaf) -> &[u32] {
        &self.others[leaf.range()]
    }
}

struct Closest<'a, O, F, T> {
    accel: &'a Accel,
    ray: Ray,
    sheared: ShearedRay,
    best: AccelHit,
    other: O,
    filter: F,
    tally: &'a T,
}

impl<O: FnMut(u32, &Ray) -> Option<f32>, F: FnMut(u32, f32, f32, f32) -> bool, T: Tally> Closest<'_, O, F, T> {
    /// Whether a hit at the distance of the best one so far would take its place.
    #[inline(always)]
    fn wins_tie(&self, kind: HitKind, id: u32) -> bool {
        (kind, id) < (self.best.kind, self.best.id)
    }

    #[inline(always)]
    fn meet_other(&mut self, id: u32) {
        let t_max = if self.wins_tie(HitKind::Other, id) { self.best.t } else { next_down(self.best.t) };
        self.ray.t_max = t_max;
        if let Some(t) = (self.other)(id, &self.ray)
            && t <= t_max
        {
            self.best = AccelHit { t, b1: 0.0, b2: 0.0, id, kind: HitKind::Other };
        }
    }
}

impl<O, F, T> Visitor for Closest<'_, O, F, T>
where
    O: FnMut(u32, &Ray) -> Option<f32>,
    F: FnMut(u32, f32, f32, f32) -> bool,
    T: Tally,
{
    #[inline(always)]
    fn node(&mut self, node: &Node) {
        self.tally.boxes(|| node.child_count());
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, leaf: Leaf, t_max: &mut f32) -> ControlFlow<()> {
        let accel = self.accel;
        if leaf.kind == u32::from(TRIANGLE) {
            let block = accel.block(leaf);
            self.tally.primitives(|| block.len());
            let Some(hits) = block.intersect(simd, &self.sheared, self.best.t) else {
                return ControlFlow::Continue(());
            };
            let (t, b1, b2): ([f32; LANES], [f32; LANES], [f32; LANES]) =
                (hits.t.into(), hits.b1.into(), hits.b2.into());
            let mut lanes = hits.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % LANES;
                lanes &= lanes - 1;
                let (t, b1, b2) = (t[lane], b1[lane], b2[lane]);
                let tagged = block.id(lane);
                let id = tagged & !FILTERED;
                if (t < self.best.t || t == self.best.t && self.wins_tie(HitKind::Triangle, id))
                    && (tagged & FILTERED == 0 || (self.filter)(id, t, b1, b2))
                {
                    self.best = AccelHit { t, b1, b2, id, kind: HitKind::Triangle };
                }
            }
        } else {
            for &id in accel.other_ids(leaf) {
                self.tally.primitives(|| 1);
                self.meet_other(id);
            }
        }
        *t_max = self.best.t;
        ControlFlow::Continue(())
    }
}

struct Any<'a, O, F, T> {
    accel: &'a Accel,
    ray: &'a Ray,
    sheared: ShearedRay,
    other: O,
    filter: F,
    tally: &'a T,
}

impl<O, F, T> Visitor for Any<'_, O, F, T>
where
    O: FnMut(u32, &Ray) -> bool,
    F: FnMut(u32, f32, f32, f32) -> bool,
    T: Tally,
{
    #[inline(always)]
    fn node(&mut self, node: &Node) {
        self.tally.boxes(|| node.child_count());
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, leaf: Leaf, _: &mut f32) -> ControlFlow<()> {
        let found = if leaf.kind == u32::from(TRIANGLE) {
            let block = self.accel.block(leaf);
            self.tally.primitives(|| block.len());
            block.intersect(simd, &self.sheared, self.ray.t_max).is_some_and(
                #[inline(always)]
                |hits| {
                    let (t, b1, b2): ([f32; LANES], [f32; LANES], [f32; LANES]) =
                        (hits.t.into(), hits.b1.into(), hits.b2.into());
                    (0..LANES).filter(|lane| hits.lanes >> lane & 1 != 0).any(|lane| {
                        let id = block.id(lane);
                        id & FILTERED == 0 || (self.filter)(id & !FILTERED, t[lane], b1[lane], b2[lane])
                    })
                },
            )
        } else {
            self.accel.other_ids(leaf).iter().any(|&id| {
                self.tally.primitives(|| 1);
                (self.other)(id, self.ray)
            })
        };
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
