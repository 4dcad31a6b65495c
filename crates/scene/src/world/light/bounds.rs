//! Bounds on where, in which directions and how much a group of lights emits (Conty Estevez and Kulla 2018; PBRT 4th
//! ed., 12.6.3).

use steradian_math::{Bounds3, Normal3, PI, Point3, Vec3, safe_acos, safe_sqrt, sin_cos};

/// A cone of directions around a unit axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    axis: Vec3,
    cos: f32,
}

impl Cone {
    const SPHERE: Cone = Cone { axis: Vec3::new(0.0, 0.0, 1.0), cos: -1.0 };

    /// A cone around both.
    fn union(self, o: Cone) -> Cone {
        let (ta, tb) = (safe_acos(self.cos), safe_acos(o.cos));
        let between = self.axis.angle_between(o.axis);
        if (between + tb).min(PI) <= ta {
            return self;
        }
        if (between + ta).min(PI) <= tb {
            return o;
        }
        let half = (ta + between + tb) * 0.5;
        if half >= PI {
            return Cone::SPHERE;
        }
        let Some(pole) = self.axis.cross(o.axis).try_normalize() else { return Cone::SPHERE };
        // Turn the first axis towards the second until its own edge is the edge of the union.
        let (s, c) = sin_cos(half - ta);
        let axis = self.axis * c + pole.cross(self.axis) * s;
        Cone { axis: axis.normalize(), cos: sin_cos(half).1 }
    }
}

/// Bounds on emission: position, normals within a cone, emission within a further angle of the normals, and power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Where the light is.
    pub bounds: Bounds3,
    cone: Cone,
    cos_emission: f32,
    /// Emitted power, in any common unit.
    pub power: f32,
    two_sided: bool,
}

fn cos_sub_clamped(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

fn sin_sub_clamped(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 0.0 } else { sin_a * cos_b - cos_a * sin_b }
}

impl LightBounds {
    /// Bounds of one light: `axis` with all normals within `cos_normals` of it, emission up to `cos_emission` from a
    /// normal.
    pub fn new(bounds: Bounds3, axis: Vec3, cos_normals: f32, cos_emission: f32, power: f32, two_sided: bool) -> Self {
        Self { bounds, cone: Cone { axis, cos: cos_normals }, cos_emission, power, two_sided }
    }

    /// Bounds of an isotropic point of light.
    pub fn point(p: Point3, power: f32) -> Self {
        Self::new(Bounds3::new(p, p), Vec3::new(0.0, 0.0, 1.0), -1.0, 0.0, power, false)
    }

    /// Bounds of two groups together.
    pub fn union(self, o: Self) -> Self {
        if self.power <= 0.0 {
            return o;
        }
        if o.power <= 0.0 {
            return self;
        }
        Self {
            bounds: self.bounds.union(o.bounds),
            cone: self.cone.union(o.cone),
            cos_emission: self.cos_emission.min(o.cos_emission),
            power: self.power + o.power,
            two_sided: self.two_sided || o.two_sided,
        }
    }

    /// An upper-bound-like estimate of the light's effect on a point; `n` is the null vector inside a medium. Zero only if
    /// no light of the group reaches the point.
    pub fn importance(&self, p: Point3, n: Normal3) -> f32 {
        let centre = self.bounds.centroid();
        let radius2 = self.bounds.diagonal().length_squared() * 0.25;
        let to_point = p - centre;
        let d2 = to_point.length_squared();
        // Inside the sphere around the bounds, light may come from anywhere.
        let (sin_b, cos_b) = if d2 <= radius2 {
            (0.0, -1.0)
        } else {
            let sin2 = radius2 / d2;
            (sin2.sqrt(), safe_sqrt(1.0 - sin2))
        };
        let wi = if d2 > 0.0 { to_point / d2.sqrt() } else { Vec3::new(0.0, 0.0, 1.0) };
        let cos = self.cone.axis.dot(wi);
        let cos = if self.two_sided { cos.abs() } else { cos };
        let sin = safe_sqrt(1.0 - cos * cos);
        let (cos_o, sin_o) = (self.cone.cos, safe_sqrt(1.0 - self.cone.cos * self.cone.cos));
        let cos_x = cos_sub_clamped(sin, cos, sin_o, cos_o);
        let sin_x = sin_sub_clamped(sin, cos, sin_o, cos_o);
        let cos_p = cos_sub_clamped(sin_x, cos_x, sin_b, cos_b);
        // A rounded zero would be bias; leave a margin at the edge of emission.
        if cos_p <= self.cos_emission - 1e-4 {
            return 0.0;
        }
        let mut importance = self.power * cos_p.max(1e-4) / d2.max(radius2).max(1e-20);
        if n != Normal3::default() {
            let cos_i = wi.abs_dot(n);
            let sin_i = safe_sqrt(1.0 - cos_i * cos_i);
            importance *= cos_sub_clamped(sin_i, cos_i, sin_b, cos_b).max(1e-4);
        }
        importance
    }

    /// The cost of making this a node, for the surface area orientation heuristic; `extent` is the parent's diagonal and
    /// `axis` the one split.
    fn cost(&self, extent: Vec3, axis: usize) -> f32 {
        let theta_o = safe_acos(self.cone.cos);
        let theta_w = (theta_o + safe_acos(self.cos_emission)).min(PI);
        let (sin_o, cos_o) = sin_cos(theta_o);
        let m = 2.0 * PI * (1.0 - cos_o)
            + PI / 2.0 * (2.0 * theta_w * sin_o - sin_cos(theta_o - 2.0 * theta_w).1 - 2.0 * theta_o * sin_o + cos_o);
        let regular = extent.max_component() / extent[axis];
        // A group of points has no area; the least of one keeps power in play.
        self.power * m * regular * (self.bounds.surface_area() + 1e-12)
    }
}

/// The tree over the bounds of lights.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// For each light id: the turns from the root to its leaf, and whether it is in the tree.
    trails: Vec<Option<u64>>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: LightBounds,
    /// The second child, or the light of a leaf. The first child is the next node.
    index: u32,
    is_leaf: bool,
}

/// Deeper than this, a node is split in the middle, so that 64 bits hold any trail.
const SAH_DEPTH: u32 = 32;

impl LightTree {
    /// Builds the tree over `(light id, bounds)` pairs; `lights` is the number of ids. Lights without power are left out.
    pub fn build(mut items: Vec<(u32, LightBounds)>, lights: usize) -> Self {
        items.retain(|(_, b)| b.power > 0.0);
        let mut tree = Self { nodes: Vec::with_capacity(2 * items.len()), trails: vec![None; lights] };
        if !items.is_empty() {
            tree.split(&mut items, 0, 0);
        }
        tree
    }

    /// Whether there is any light in the tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn split(&mut self, items: &mut [(u32, LightBounds)], trail: u64, depth: u32) -> LightBounds {
        let at = self.nodes.len();
        if let [(id, bounds)] = items {
            self.nodes.push(Node { bounds: *bounds, index: *id, is_leaf: true });
            self.trails[*id as usize] = Some(trail);
            return *bounds;
        }
        let middle = partition(items, depth);
        let placeholder = items[0].1;
        self.nodes.push(Node { bounds: placeholder, index: 0, is_leaf: false });
        let (left, right) = items.split_at_mut(middle);
        let a = self.split(left, trail, depth + 1);
        let second = self.nodes.len() as u32;
        let b = self.split(right, trail | (1 << depth), depth + 1);
        self.nodes[at] = Node { bounds: a.union(b), index: second, is_leaf: false };
        self.nodes[at].bounds
    }

    /// Picks a light for a point by one random number: its id and the probability of the choice.
    #[inline]
    pub fn sample(&self, p: Point3, n: Normal3, mut u: f32) -> Option<(u32, f32)> {
        let mut at = 0;
        let mut probability = 1.0;
        let root = self.nodes.first()?;
        if root.is_leaf {
            return (root.bounds.importance(p, n) > 0.0).then_some((root.index, 1.0));
        }
        loop {
            let node = &self.nodes[at];
            if node.is_leaf {
                return Some((node.index, probability));
            }
            let (first, second) = (at + 1, node.index as usize);
            let (a, b) = (self.nodes[first].bounds.importance(p, n), self.nodes[second].bounds.importance(p, n));
            if a == 0.0 && b == 0.0 {
                return None;
            }
            let pa = a / (a + b);
            if u < pa {
                at = first;
                u = (u / pa).min(steradian_math::ONE_MINUS_EPSILON);
                probability *= pa;
            } else {
                at = second;
                u = ((u - pa) / (1.0 - pa)).min(steradian_math::ONE_MINUS_EPSILON);
                probability *= 1.0 - pa;
            }
        }
    }

    /// The probability with which `sample` picks the light.
    #[inline]
    pub fn probability(&self, p: Point3, n: Normal3, light: u32) -> f32 {
        let Some(mut trail) = self.trails[light as usize] else { return 0.0 };
        let mut at = 0;
        let mut probability = 1.0;
        if self.nodes[0].is_leaf {
            return if self.nodes[0].bounds.importance(p, n) > 0.0 { 1.0 } else { 0.0 };
        }
        while !self.nodes[at].is_leaf {
            let (first, second) = (at + 1, self.nodes[at].index as usize);
            let (a, b) = (self.nodes[first].bounds.importance(p, n), self.nodes[second].bounds.importance(p, n));
            if a == 0.0 && b == 0.0 {
                return 0.0;
            }
            let pa = a / (a + b);
            if trail & 1 == 0 {
                probability *= pa;
                at = first;
            } else {
                probability *= 1.0 - pa;
                at = second;
            }
            trail >>= 1;
        }
        probability
    }
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
                    Some((id, pmf)) => {
                        assert!((pmf - tree.probability(p, normal, id)).abs() <= 1e-6 * pmf);
                        // Dead ends (both children without importance) may lose a little; never gain.
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
        assert_eq!(l.importance(Point3::new(0.0, 0.0, -50.0), Normal3::default()), 0.0);
        assert!(l.importance(Point3::new(0.0, 0.0, 50.0), Normal3::default()) > 0.0);
        assert!(l.importance(Point3::new(0.0, 0.0, -0.5), Normal3::default()) > 0.0);
    }
}
