//! The choice of a light by what it may do at a point: a tree over the bounds of lights, eight children a node (Conty Estevez and Kulla
//! 2018; PBRT 4th ed., 12.6.3).
//!
//! A binary tree is built by the surface area orientation heuristic, and nodes of eight are gathered from it: up to eight lights are
//! told apart by one step, and the arithmetic of a step runs side by side for all children.

mod exhaustive;

use super::bounds::{LightBounds, Prepared};
use super::selection::Pick;
use super::side_by_side::{Many, SideBySide};
use steradian_bvh::fearless_simd::{Simd, SimdBase, SimdMask, f32x8};
use steradian_math::{Bounds3, Normal3, ONE_MINUS_EPSILON, Point3, ROW, Row, Rows3, Vec3};

/// Children of a node, and as many as are worked on side by side; half of them where there are no wide vectors.
const WIDTH: usize = 8;
const HALF: usize = 4;
/// Deeper than this, a node of the binary tree is split in the middle, so that it cannot become a list.
const SAH_DEPTH: u32 = 32;
/// Bit of a child that says: a light, not a node.
const LIGHT: u32 = 1 << 31;

type Eight = [f32; WIDTH];

/// The bounds of up to eight children, number by number; unused ones have no power.
#[derive(Clone, Debug, Default)]
struct Node {
    centre: [Eight; 3],
    radius2: Eight,
    axis: [Eight; 3],
    cos: Eight,
    sin: Eight,
    least: Eight,
    mirror: Eight,
    power: Eight,
    child: [u32; WIDTH],
    count: u32,
    /// The node above and the place in it; the root is its own.
    parent: (u32, u32),
}

impl Node {
    fn set(&mut self, i: usize, p: &Prepared, child: u32) {
        for axis in 0..3 {
            self.centre[axis][i] = p.centre[axis];
            self.axis[axis][i] = p.axis[axis];
        }
        self.radius2[i] = p.radius2;
        (self.cos[i], self.sin[i], self.least[i]) = (p.cos, p.sin, p.least);
        (self.mirror[i], self.power[i]) = (p.mirror, p.power);
        self.child[i] = child;
        self.count = self.count.max(i as u32 + 1);
    }

    /// An upper-bound-like estimate of each child's effect on a point; `n` is the null vector inside a medium. Zero only if no light of
    /// the child reaches the point.
    #[inline]
    fn importances(&self, p: Point3, n: Normal3) -> Eight {
        let mut out = [0.0; WIDTH];
        let half = |first: usize| {
            let part = |v: &Eight| Many::<HALF>::part(v, first);
            self.children(part, Many::of).importance_of(p, n).0
        };
        out[..HALF].copy_from_slice(&half(0));
        if self.count > HALF as u32 {
            out[HALF..].copy_from_slice(&half(HALF));
        }
        out
    }

    /// The same by the instruction set in use.
    #[inline(always)]
    fn importances_by<S: Simd>(&self, simd: S, p: Point3, n: Normal3) -> Eight {
        let children = self.children(
            #[inline(always)]
            |v| f32x8::load_array_ref(simd, v),
            #[inline(always)]
            |x| f32x8::splat(simd, x),
        );
        children.importance_of(p, n).into()
    }

    /// The children as `part` reads their numbers.
    #[inline(always)]
    fn children<M: SideBySide, O: Fn(f32) -> M>(&self, part: impl Fn(&Eight) -> M, of: O) -> Children<M, O> {
        let (c, a) = (&self.centre, &self.axis);
        Children {
            of,
            centre: [part(&c[0]), part(&c[1]), part(&c[2])],
            radius2: part(&self.radius2),
            axis: [part(&a[0]), part(&a[1]), part(&a[2])],
            cos: part(&self.cos),
            sin: part(&self.sin),
            least: part(&self.least),
            mirror: part(&self.mirror),
            power: part(&self.power),
        }
    }
}

/// Some children of a node, or one for each of some points; `of` makes the same number for all of them.
struct Children<M, O> {
    of: O,
    centre: [M; 3],
    radius2: M,
    axis: [M; 3],
    cos: M,
    sin: M,
    least: M,
    mirror: M,
    power: M,
}

impl<M: SideBySide, O: Fn(f32) -> M> Children<M, O> {
    /// See [`Node::importances`].
    #[inline(always)]
    fn importance_of(&self, p: Point3, n: Normal3) -> M {
        let three = |v: Vec3| [(self.of)(v.x), (self.of)(v.y), (self.of)(v.z)];
        let n = if n == Normal3::default() { None } else { Some(three(n.to_vec())) };
        self.importance(three(p.to_vec()), n)
    }

    #[inline(always)]
    fn importance(&self, p: [M; 3], n: Option<[M; 3]>) -> M {
        let of = &self.of;
        let (zero, one) = (of(0.0), of(1.0));
        let [x, y, z] = [p[0] - self.centre[0], p[1] - self.centre[1], p[2] - self.centre[2]];
        let d2 = x * x + y * y + z * z;
        let inverse = one / d2.larger(of(1e-30)).root();
        // Inside the sphere around the bounds, light may come from anywhere.
        let sin2 = self.radius2 * (inverse * inverse);
        let sin_b = d2.where_above(self.radius2, sin2.root(), zero);
        let cos_b = d2.where_above(self.radius2, (one - sin2).larger(zero).root(), of(-1.0));
        // The least angle between a normal of the cone and the direction to the point, from anywhere in the sphere.
        let cos = (self.axis[0] * x + self.axis[1] * y + self.axis[2] * z) * inverse;
        let cos = cos.larger(cos * self.mirror);
        let sin = (one - cos * cos).larger(zero).root();
        let cos_x = cos.where_above(self.cos, one, cos * self.cos + sin * self.sin);
        let sin_x = cos.where_above(self.cos, zero, sin * self.cos - cos * self.sin);
        let cos_p = cos_x.where_above(cos_b, one, cos_x * cos_b + sin_x * sin_b);
        let mut importance = self.power * cos_p.larger(of(1e-4)) / d2.larger(self.radius2).larger(of(1e-20));
        // The same at the surface that is lit.
        if let Some([nx, ny, nz]) = n {
            let cos_i = ((nx * x + ny * y + nz * z) * inverse).magnitude();
            let sin_i = (one - cos_i * cos_i).larger(zero).root();
            let lit = cos_i.where_above(cos_b, one, cos_i * cos_b + sin_i * sin_b);
            importance = importance * lit.larger(of(1e-4));
        }
        cos_p.where_above(self.least, importance, zero)
    }
}

/// The sum in a fixed order that vectors can follow.
#[inline(always)]
fn sum(v: &Eight) -> f32 {
    let half = [v[0] + v[4], v[1] + v[5], v[2] + v[6], v[3] + v[7]];
    (half[0] + half[2]) + (half[1] + half[3])
}

/// One of eight, chosen in proportion to importance.
struct Choice {
    child: usize,
    importance: f32,
    /// What is left of the random number, uniform again.
    rest: f32,
}

impl Choice {
    #[inline(always)]
    fn new(importances: &Eight, child: usize, left: f32) -> Self {
        let importance = importances[child];
        // Rounding may leave more than there is.
        Self { child, importance, rest: (left / importance).clamp(0.0, ONE_MINUS_EPSILON) }
    }
}

/// The child that a number between zero and the sum of all importances falls on.
#[inline(always)]
fn choose(importances: &Eight, mut left: f32) -> Choice {
    let mut child = 0;
    for (i, &importance) in importances.iter().enumerate() {
        if importance > 0.0 {
            child = i;
            if left < importance {
                break;
            }
            left -= importance;
        }
    }
    Choice::new(importances, child, left)
}

/// The same without branches that nobody could foretell.
#[inline(always)]
fn choose_by<S: Simd>(simd: S, importances: &Eight, left: f32) -> Choice {
    // What is left at each child, if it is none before.
    let mut lefts = [left; WIDTH];
    for i in 1..WIDTH {
        lefts[i] = lefts[i - 1] - importances[i - 1];
    }
    let [lefts_, importances_] = [&lefts, importances].map(|v| f32x8::load_array_ref(simd, v));
    let reached = lefts_.simd_lt(importances_).to_bitmask();
    if reached == 0 {
        return choose(importances, left);
    }
    let child = reached.trailing_zeros() as usize & (WIDTH - 1);
    Choice::new(importances, child, lefts[child])
}

/// The tree over the bounds of lights.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// For each light id: its node and its place in it, if it is in the tree.
    places: Vec<Option<(u32, u32)>>,
}

impl LightTree {
    /// Builds the tree over `(light id, bounds)` pairs; `lights` is the number of ids. Lights without power are left out.
    pub fn build(mut items: Vec<(u32, LightBounds)>, lights: usize) -> Self {
        items.retain(|(_, b)| b.power > 0.0);
        let mut tree = Self { nodes: Vec::new(), places: vec![None; lights] };
        if !items.is_empty() {
            let mut binary = Vec::with_capacity(2 * items.len());
            split(&mut items, 0, &mut binary);
            tree.gather(&binary);
        }
        tree
    }

    /// Makes nodes of eight out of the binary tree.
    fn gather(&mut self, binary: &[Binary]) {
        self.nodes.push(Node::default());
        let mut pending = vec![(0, 0)];
        while let Some((at, root)) = pending.pop() {
            let mut children = vec![root];
            while children.len() < WIDTH {
                // Open what has most power: that is where telling lights apart pays.
                let inner = (0..children.len()).filter(|&i| binary[children[i]].light.is_none());
                let power = |i: usize| binary[children[i]].bounds.power;
                let Some(open) = inner.reduce(|a, b| if power(b) > power(a) { b } else { a }) else { break };
                let first = children[open] + 1;
                children.push(binary[children[open]].second);
                children[open] = first;
            }
            for (i, &child) in children.iter().enumerate() {
                let b = &binary[child];
                let reference = match b.light {
                    Some(light) => {
                        self.places[light as usize] = Some((at, i as u32));
                        LIGHT | light
                    }
                    None => {
                        let node = self.nodes.len() as u32;
                        self.nodes.push(Node { parent: (at, i as u32), ..Node::default() });
                        pending.push((node, child));
                        node
                    }
                };
                self.nodes[at as usize].set(i, &b.bounds.prepared(), reference);
            }
        }
    }

    /// Whether there is any light in the tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Picks a light for a point by one random number.
    #[inline]
    pub fn sample(&self, p: Point3, n: Normal3, mut u: f32) -> Option<Pick> {
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        loop {
            let importances = node.importances(p, n);
            let total = sum(&importances);
            if total <= 0.0 {
                return None;
            }
            let Choice { child, importance, rest } = choose(&importances, u * total);
            probability *= importance / total;
            let child = node.child[child];
            if child & LIGHT != 0 {
                return Some(Pick::new(child & !LIGHT, probability, rest));
            }
            u = rest;
            node = &self.nodes[child as usize];
        }
    }

    /// [`LightTree::sample`] for the first `count` points of a row, which go down the tree together, one level after the other: so no
    /// point waits for the memory or the branches of another. There must be a light in the tree.
    #[inline(always)]
    pub fn sample_each<S: Simd>(&self, simd: S, (p, n): (&Rows3, &Rows3), u: &Row, count: usize, out: &mut PickRows) {
        let count = count.min(ROW);
        out.u = *u;
        out.probability = Row([1.0; ROW]);
        (out.light, out.none) = Default::default();
        let mut on_the_way: [usize; ROW] = std::array::from_fn(|i| i);
        let mut left = count;
        while left > 0 {
            let mut kept = 0;
            for k in 0..left {
                let i = on_the_way[k];
                let node = &self.nodes[out.light.0[i] as usize];
                let importances = node.importances_by(simd, p.point(i), n.normal(i));
                let total = sum(&importances);
                let Choice { child, importance, rest } = choose_by(simd, &importances, out.u.0[i] * total);
                let child = node.child[child];
                let none = total <= 0.0;
                out.none.0[i] = u32::from(none);
                out.light.0[i] = child;
                out.probability.0[i] *= importance / total;
                out.u.0[i] = rest;
                on_the_way[kept] = i;
                kept += usize::from(!none & (child & LIGHT == 0));
            }
            left = kept;
        }
        out.light.0.iter_mut().for_each(|light| *light &= !LIGHT);
    }

    /// The lights among which all points of a row can choose at once, if there are no more than one node has.
    #[inline]
    pub fn one_node(&self) -> Option<OneNode<'_>> {
        let [node] = self.nodes.as_slice() else { return None };
        Some(OneNode(node))
    }

    /// The probability with which `sample` picks the light.
    #[inline]
    pub fn probability(&self, p: Point3, n: Normal3, light: u32) -> f32 {
        let Some((mut at, mut place)) = self.places[light as usize] else { return 0.0 };
        let mut probability = 1.0;
        loop {
            let node = &self.nodes[at as usize];
            let importances = node.importances(p, n);
            let total = sum(&importances);
            if total <= 0.0 {
                return 0.0;
            }
            probability *= importances[place as usize] / total;
            if at == 0 {
                return probability;
            }
            (at, place) = node.parent;
        }
    }
}

/// A tree that is one node.
#[derive(Clone, Copy)]
pub struct OneNode<'t>(&'t Node);

impl OneNode<'_> {
    /// [`LightTree::sample`] for the first `end` points of a row.
    #[inline(always)]
    pub fn sample_rows(&self, p: &Rows3, n: &Rows3, u: &Row, end: usize, out: &mut PickRows) {
        let count = (self.0.count as usize).min(WIDTH);
        for c in 0..count {
            let child = self.0.children(|v| Many::<1>::part(v, c), Many::of);
            let three = |v: Vec3| [Many([v.x]), Many([v.y]), Many([v.z])];
            for i in 0..end.min(ROW) {
                out.importances[c].0[i] = child.importance(three(p.vec(i)), Some(three(n.vec(i)))).0[0];
            }
        }
        for c in count..WIDTH {
            out.importances[c] = Row::default();
        }
        for i in 0..end.min(ROW) {
            let mut importances = [0.0; WIDTH];
            for c in 0..WIDTH {
                importances[c] = out.importances[c].0[i];
            }
            let total = sum(&importances);
            let mut left = u.0[i] * total;
            let (mut light, mut importance, mut found) = (0, 0.0, false);
            for c in 0..WIDTH {
                let v = importances[c];
                let reached = !found & (v > 0.0);
                light = if reached { self.0.child[c] & !LIGHT } else { light };
                importance = if reached { v } else { importance };
                found |= reached & (left < v);
                left = if reached & !found { left - v } else { left };
            }
            out.light.0[i] = light;
            out.none.0[i] = u32::from(total <= 0.0);
            out.probability.0[i] = importance / total;
            out.u.0[i] = (left / importance).clamp(0.0, ONE_MINUS_EPSILON);
        }
    }
}

/// [`Pick`]s side by side.
#[derive(Clone, Debug, Default)]
pub struct PickRows {
    importances: [Row; WIDTH],
    /// Whether no light reaches the point.
    none: Row<u32>,
    light: Row<u32>,
    probability: Row,
    u: Row,
}

impl PickRows {
    /// What was picked for a place.
    #[inline]
    pub fn pick(&self, i: usize) -> Option<Pick> {
        let pick = Pick { light: self.light.0[i], probability: self.probability.0[i], u: self.u.0[i] };
        (self.none.0[i] == 0).then_some(pick)
    }
}

/// A node of the binary tree; the first child follows it.
struct Binary {
    bounds: LightBounds,
    second: usize,
    light: Option<u32>,
}

/// Builds the binary tree over `items` at the end of `out`.
fn split(items: &mut [(u32, LightBounds)], depth: u32, out: &mut Vec<Binary>) -> LightBounds {
    let at = out.len();
    if let [(id, bounds)] = items {
        out.push(Binary { bounds: *bounds, second: 0, light: Some(*id) });
        return *bounds;
    }
    let middle = partition(items, depth);
    out.push(Binary { bounds: items[0].1, second: 0, light: None });
    let (left, right) = items.split_at_mut(middle);
    let a = split(left, depth + 1, out);
    let second = out.len();
    let b = split(right, depth + 1, out);
    out[at] = Binary { bounds: a.union(b), second, light: None };
    out[at].bounds
}

/// Splits by the surface area orientation heuristic over 12 buckets an axis; in the middle where that says nothing.
fn partition(items: &mut [(u32, LightBounds)], depth: u32) -> usize {
    const BUCKETS: usize = 12;
    let all = items.iter().fold(Bounds3::EMPTY, |b, (_, l)| b.union(l.bounds));
    let centres = items.iter().fold(Bounds3::EMPTY, |b, (_, l)| b.union_point(l.bounds.centroid()));
    let mut best: Option<(f32, usize, usize)> = None;
    let bucket = |l: &LightBounds, axis: usize| {
        ((centres.offset(l.bounds.centroid())[axis] * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    if depth < SAH_DEPTH {
        for axis in 0..3 {
            if centres.max[axis] <= centres.min[axis] {
                continue;
            }
            let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
            for (_, l) in items.iter() {
                let b = &mut buckets[bucket(l, axis)];
                *b = Some(b.map_or(*l, |b| b.union(*l)));
            }
            let join = |s: &[Option<LightBounds>]| s.iter().flatten().copied().reduce(LightBounds::union);
            for cut in 1..BUCKETS {
                if let (Some(a), Some(b)) = (join(&buckets[..cut]), join(&buckets[cut..])) {
                    let cost = a.cost(all.diagonal(), axis) + b.cost(all.diagonal(), axis);
                    if best.is_none_or(|(c, ..)| cost < c) {
                        best = Some((cost, axis, cut));
                    }
                }
            }
        }
    }
    match best {
        Some((_, axis, cut)) => {
            items.sort_by_key(|(_, l)| bucket(l, axis) >= cut);
            items.iter().filter(|(_, l)| bucket(l, axis) < cut).count()
        }
        None => {
            let axis = centres.max_extent();
            items.sort_by(|a, b| a.1.bounds.centroid()[axis].total_cmp(&b.1.bounds.centroid()[axis]));
            items.len() / 2
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::Vec3;
    use steradian_sampling::Rng;

    fn lights(n: usize, seed: u64) -> Vec<(u32, LightBounds)> {
        let mut r = Rng::new(seed, 0);
        (0..n)
            .map(|i| {
                let p = Point3::new(r.f32(), r.f32(), r.f32());
                let q = p + Vec3::new(r.f32(), r.f32(), r.f32()) * 0.1;
                let axis = Vec3::new(r.f32() - 0.5, r.f32() - 0.5, r.f32() - 0.5).normalize();
                (i as u32, LightBounds::new(Bounds3::new(p, q), axis, 1.0, 0.0, 0.1 + r.f32(), i % 3 == 0))
            })
            .collect()
    }

    #[test]
    fn probabilities_agree_with_sampling_and_add_up() {
        for n in [1usize, 2, 3, 17, 100] {
            let tree = LightTree::build(lights(n, 7), n);
            let mut r = Rng::new(3, 1);
            for _ in 0..200 {
                let p = Point3::new(r.f32() * 2.0, r.f32(), r.f32());
                let normal = if r.f32() < 0.5 { Normal3::new(0.0, 0.0, 1.0) } else { Normal3::default() };
                let total: f32 = (0..n as u32).map(|i| tree.probability(p, normal, i)).sum();
                match tree.sample(p, normal, r.f32()) {
                    Some(Pick { light: id, probability: pmf, .. }) => {
                        assert!((pmf - tree.probability(p, normal, id)).abs() <= 1e-6 * pmf);
                        // Dead ends (all children without importance) may lose a little; never gain.
                        assert!(total < 1.0 + 1e-4, "{total}");
                    }
                    None => assert!(total < 1.0 - 1e-6 || n == 1),
                }
            }
        }
    }

    #[test]
    fn coincident_lights_do_not_recurse_for_ever() {
        let p = Point3::new(1.0, 2.0, 3.0);
        let n = 5000;
        let tree = LightTree::build((0..n).map(|i| (i, LightBounds::point(p, 1.0))).collect(), n as usize);
        let q = Point3::new(0.0, 0.0, 0.0);
        assert!((tree.probability(q, Normal3::default(), 77) * n as f32 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_point_behind_a_one_sided_light_gets_nothing() {
        let b = Bounds3::new(Point3::new(-1.0, -1.0, 0.0), Point3::new(1.0, 1.0, 0.0));
        let l = LightBounds::new(b, Vec3::new(0.0, 0.0, 1.0), 1.0, 0.0, 1.0, false);
        let tree = LightTree::build(vec![(0, l)], 1);
        let chosen = |z: f32| tree.sample(Point3::new(0.0, 0.0, z), Normal3::default(), 0.5).is_some();
        assert!(!chosen(-50.0) && chosen(50.0) && chosen(-0.5));
    }
}
