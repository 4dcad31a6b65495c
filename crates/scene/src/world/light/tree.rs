//! The choice of a light by what it may do at a point: a tree over the bounds of lights, eight children a node (Conty Estevez and Kulla
//! 2018; PBRT 4th ed., 12.6.3).
//!
//! A binary tree is built by the surface area orientation heuristic, and nodes of eight are gathered from it: up to eight lights are
//! told apart by one step, and the arithmetic of a step runs side by side for all children.

mod exhaustive;

use super::bounds::{LightBounds, Prepared};
use super::selection::Pick;
use steradian_math::{Bounds3, Normal3, ONE_MINUS_EPSILON, Point3, ROW, Row, Rows3, Vec3};

/// Children of a node, and as many as are worked on side by side.
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
        out[..HALF].copy_from_slice(&self.some::<HALF>(0, p, n).0);
        if self.count > HALF as u32 {
            out[HALF..].copy_from_slice(&self.some::<HALF>(HALF, p, n).0);
        }
        out
    }

    /// The same, for instruction sets with vectors of eight.
    #[inline(always)]
    fn importances_at_once(&self, p: Point3, n: Normal3) -> Eight {
        self.some::<WIDTH>(0, p, n).0
    }

    /// The importances of some children, from `first` on.
    #[inline(always)]
    fn some<const N: usize>(&self, first: usize, p: Point3, n: Normal3) -> Many<N> {
        let n = if n == Normal3::default() { None } else { Some(Many::three(n.to_vec())) };
        self.children(first).importance(Many::three(p.to_vec()), n)
    }

    /// Some children, from `first` on.
    #[inline(always)]
    fn children<const N: usize>(&self, first: usize) -> Children<N> {
        let (c, a) = (&self.centre, &self.axis);
        Children {
            centre: [Many::part(&c[0], first), Many::part(&c[1], first), Many::part(&c[2], first)],
            radius2: Many::part(&self.radius2, first),
            axis: [Many::part(&a[0], first), Many::part(&a[1], first), Many::part(&a[2], first)],
            cos: Many::part(&self.cos, first),
            sin: Many::part(&self.sin, first),
            least: Many::part(&self.least, first),
            mirror: Many::part(&self.mirror, first),
            power: Many::part(&self.power, first),
        }
    }
}

/// Some children of a node, or one for each of some points.
struct Children<const N: usize> {
    centre: [Many<N>; 3],
    radius2: Many<N>,
    axis: [Many<N>; 3],
    cos: Many<N>,
    sin: Many<N>,
    least: Many<N>,
    mirror: Many<N>,
    power: Many<N>,
}

impl<const N: usize> Children<N> {
    /// See [`Node::importances`].
    #[inline(always)]
    fn importance(&self, p: [Many<N>; 3], n: Option<[Many<N>; 3]>) -> Many<N> {
        let (zero, one) = (Many::of(0.0), Many::of(1.0));
        let [x, y, z] = [p[0] - self.centre[0], p[1] - self.centre[1], p[2] - self.centre[2]];
        let d2 = x * x + y * y + z * z;
        let inverse = one / d2.max(Many::of(1e-30)).sqrt();
        // Inside the sphere around the bounds, light may come from anywhere.
        let sin2 = self.radius2 * (inverse * inverse);
        let sin_b = d2.where_above(self.radius2, sin2.sqrt(), zero);
        let cos_b = d2.where_above(self.radius2, (one - sin2).max(zero).sqrt(), Many::of(-1.0));
        // The least angle between a normal of the cone and the direction to the point, from anywhere in the sphere.
        let cos = (self.axis[0] * x + self.axis[1] * y + self.axis[2] * z) * inverse;
        let cos = cos.max(cos * self.mirror);
        let sin = (one - cos * cos).max(zero).sqrt();
        let cos_x = cos.where_above(self.cos, one, cos * self.cos + sin * self.sin);
        let sin_x = cos.where_above(self.cos, zero, sin * self.cos - cos * self.sin);
        let cos_p = cos_x.where_above(cos_b, one, cos_x * cos_b + sin_x * sin_b);
        let mut importance = self.power * cos_p.max(Many::of(1e-4)) / d2.max(self.radius2).max(Many::of(1e-20));
        // The same at the surface that is lit.
        if let Some([nx, ny, nz]) = n {
            let cos_i = ((nx * x + ny * y + nz * z) * inverse).abs();
            let sin_i = (one - cos_i * cos_i).max(zero).sqrt();
            let lit = cos_i.where_above(cos_b, one, cos_i * cos_b + sin_i * sin_b);
            importance = importance * lit.max(Many::of(1e-4));
        }
        cos_p.where_above(self.least, importance, zero)
    }
}

/// Numbers side by side, in plain arithmetic that compilers turn into vectors.
#[derive(Clone, Copy)]
#[repr(align(16))]
struct Many<const N: usize>([f32; N]);

impl<const N: usize> Many<N> {
    #[inline(always)]
    fn of(x: f32) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    fn part(v: &Eight, first: usize) -> Self {
        let mut out = Self([0.0; N]);
        out.0.copy_from_slice(&v[first..first + N]);
        out
    }

    #[inline(always)]
    fn three(v: Vec3) -> [Self; 3] {
        [Self::of(v.x), Self::of(v.y), Self::of(v.z)]
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = self;
        for i in 0..N {
            out.0[i] = f(self.0[i]);
        }
        out
    }

    #[inline(always)]
    fn with(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        for i in 0..N {
            out.0[i] = f(self.0[i], o.0[i]);
        }
        out
    }

    /// The larger ones; one instruction, unlike `f32::max`.
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.with(
            o,
            #[inline(always)]
            |a, b| if a > b { a } else { b },
        )
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }

    /// `yes` where this is greater than `limit`, else `no`.
    #[inline(always)]
    fn where_above(self, limit: Self, yes: Self, no: Self) -> Self {
        let mut out = no;
        for i in 0..N {
            out.0[i] = if self.0[i] > limit.0[i] { yes.0[i] } else { no.0[i] };
        }
        out
    }
}

macro_rules! lane_by_lane {
    ($($operator:ident $method:ident $symbol:tt),*) => {$(
        impl<const N: usize> std::ops::$operator for Many<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.with(
                    o,
                    #[inline(always)]
                    |a, b| a $symbol b,
                )
            }
        }
    )*};
}
lane_by_lane!(Add add +, Sub sub -, Mul mul *, Div div /);

/// The sum in a fixed order that vectors can follow.
#[inline(always)]
fn sum(v: &Eight) -> f32 {
    let half = [v[0] + v[4], v[1] + v[5], v[2] + v[6], v[3] + v[7]];
    (half[0] + half[2]) + (half[1] + half[3])
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
    pub fn sample(&self, p: Point3, n: Normal3, u: f32) -> Option<Pick> {
        self.sample_by::<false>(p, n, u)
    }

    /// [`LightTree::sample`] for the first `count` points of a row.
    #[inline(always)]
    pub fn sample_each(&self, p: &Rows3, n: &Rows3, u: &Row, count: usize, out: &mut PickRows) {
        for i in 0..count.min(ROW) {
            let pick = self.sample_by::<true>(p.point(i), n.normal(i), u.0[i]);
            out.none.0[i] = u32::from(pick.is_none());
            if let Some(pick) = pick {
                (out.light.0[i], out.probability.0[i], out.u.0[i]) = (pick.light, pick.probability, pick.u);
            }
        }
    }

    #[inline(always)]
    fn sample_by<const AT_ONCE: bool>(&self, p: Point3, n: Normal3, mut u: f32) -> Option<Pick> {
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        loop {
            let importances = if AT_ONCE { node.importances_at_once(p, n) } else { node.importances(p, n) };
            let total = sum(&importances);
            if total <= 0.0 {
                return None;
            }
            let mut left = u * total;
            let mut chosen = 0;
            for (i, &importance) in importances.iter().enumerate() {
                if importance > 0.0 {
                    chosen = i;
                    if left < importance {
                        break;
                    }
                    left -= importance;
                }
            }
            let importance = importances[chosen];
            probability *= importance / total;
            let child = node.child[chosen];
            let rest = left / importance;
            if child & LIGHT != 0 {
                return Some(Pick::new(child & !LIGHT, probability, rest));
            }
            // Rounding may leave more than there is.
            u = rest.clamp(0.0, ONE_MINUS_EPSILON);
            node = &self.nodes[child as usize];
        }
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
            let child = self.0.children::<1>(c);
            for i in 0..end.min(ROW) {
                let (p, n) = (Many::three(p.vec(i)), Many::three(n.vec(i)));
                out.importances[c].0[i] = child.importance(p, Some(n)).0[0];
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
