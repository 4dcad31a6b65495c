//! A closed room full of triangles, traced by brute force as on the slide, with every intersection test counted.

use crate::BruteForce;
use steradian_bvh::{BuildOptions, Bvh, Primitive};
use steradian_math::{Bounds3, Frame, Point3, Ray, Vec3};
use steradian_sampling::Rng;
use steradian_sampling::warp::square_to_cosine_hemisphere;

/// How the nearest triangle is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Every ray is tested against every triangle.
    Linear,
    /// Only against those in the leaves of a tree that the ray reaches.
    Tree,
}

/// A room with lamps.
pub struct Soup {
    triangles: Vec<[Point3; 3]>,
    /// Corner and two sides of each lamp, which hang free in the room and stop no ray.
    lamps: Vec<[Vec3; 3]>,
    tree: Bvh,
}

/// What tracing has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spent {
    /// Rays.
    pub rays: u64,
    /// Tests of a ray against a triangle.
    pub tests: u64,
    /// Rays that met nothing.
    pub escaped: u64,
}

const ALBEDO: f64 = 0.5;

/// The walls of a room, and small triangles in its lower half until there are `n`.
pub fn clutter(n: usize, seed: u64) -> Vec<[Point3; 3]> {
    let corner = |i: usize| {
        let pick = |bit: usize| if i >> bit & 1 == 0 { -1.0f32 } else { 1.0 };
        Point3::new(pick(0), pick(1), pick(2))
    };
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let mut triangles: Vec<[Point3; 3]> = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[corner(a), corner(b), corner(c)], [corner(a), corner(c), corner(d)]])
        .collect();
    let mut rng = Rng::new(seed, 1);
    // Clutter on the lower half, smaller the more there is.
    let size = 0.5 / (n as f32).sqrt();
    while triangles.len() < n {
        let c = Point3::new(1.8 * rng.f32() - 0.9, 0.9 * rng.f32() - 0.95, 1.8 * rng.f32() - 0.9);
        let mut near = || c + Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5) * (4.0 * size);
        triangles.push([near(), near(), near()]);
    }
    triangles
}

impl Soup {
    /// A room of `n` triangles with `lamps` lamps under its ceiling. `None` if the tree cannot be built.
    pub fn new(n: usize, lamps: usize, seed: u64) -> Option<Self> {
        let triangles = clutter(n, seed);
        let boxes = triangles
            .iter()
            .map(|t| Primitive { bounds: t.iter().fold(Bounds3::EMPTY, |b, &p| b.union_point(p)), kind: 0 });
        let tree = Bvh::build(boxes, &BuildOptions::default()).ok()?;
        let lamps = (0..lamps)
            .map(|i| {
                let x = -0.6 + 1.2 * i as f32 / (lamps.max(2) - 1) as f32;
                [Vec3::new(x - 0.1, 0.95, -0.1), Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2)]
            })
            .collect();
        Some(Self { triangles, lamps, tree })
    }

    /// The number of lamps.
    pub fn lamps(&self) -> u32 {
        self.lamps.len() as u32
    }

    fn closest(&self, search: Search, ray: &Ray, spent: &mut Spent) -> Option<(f32, Vec3)> {
        spent.rays += 1;
        let mut best: Option<(f32, usize)> = None;
        let tests = std::cell::Cell::new(0u64);
        let mut test = |i: usize, limit: f32| -> Option<f32> {
            tests.set(tests.get() + 1);
            let t = meet(ray, &self.triangles[i])?;
            (t < limit).then(|| {
                best = Some((t, i));
                t
            })
        };
        match search {
            Search::Linear => {
                let mut limit = ray.t_max;
                for i in 0..self.triangles.len() {
                    limit = test(i, limit).unwrap_or(limit);
                }
            }
            Search::Tree => self.tree.closest(ray, |leaf, limit| {
                for &i in &self.tree.order()[leaf.range()] {
                    *limit = test(i as usize, *limit).unwrap_or(*limit);
                }
            }),
        }
        spent.tests += tests.get();
        if best.is_none() {
            spent.escaped += 1;
        }
        best.map(|(t, i)| {
            let [a, b, c] = self.triangles[i];
            let n = (b - a).cross(c - a).normalize();
            (t, if n.dot(ray.d) > 0.0 { -n } else { n })
        })
    }

    fn occluded(&self, search: Search, ray: &Ray, spent: &mut Spent) -> bool {
        spent.rays += 1;
        match search {
            Search::Linear => {
                // Brute force looks at all of them, as the formula has it.
                spent.tests += self.triangles.len() as u64;
                self.triangles.iter().filter(|t| meet(ray, t).is_some_and(|t| t < ray.t_max)).count() > 0
            }
            Search::Tree => {
                let tests = std::cell::Cell::new(0u64);
                let hit = self.tree.any(ray, |leaf| {
                    self.tree.order()[leaf.range()].iter().any(|&i| {
                        tests.set(tests.get() + 1);
                        meet(ray, &self.triangles[i as usize]).is_some_and(|t| t < ray.t_max)
                    })
                });
                spent.tests += tests.get();
                hit
            }
        }
    }

    /// Light that arrives along a ray: s x s shadow rays to each lamp, then r x r rays on, d bounces deep, every grid
    /// jittered.
    fn tree_of_rays(&self, search: Search, ray: &Ray, p: &BruteForce, d: u32, rng: &mut Rng, spent: &mut Spent) -> f64 {
        let Some((t, n)) = self.closest(search, ray, spent) else { return 0.0 };
        let at = ray.o + ray.d * t + n * 1e-4;
        let mut light = 0.0;
        for lamp in &self.lamps {
            for cell in 0..p.s * p.s {
                light += self.lamp_light(search, at, n, lamp, jitter(cell, p.s, rng), spent) / f64::from(p.s * p.s);
            }
        }
        if d > 1 {
            let frame = Frame::from_z(n);
            for cell in 0..p.r * p.r {
                let w = frame.from_local(square_to_cosine_hemisphere(jitter(cell, p.r, rng)));
                let next = Ray::new(at, w, 0.0);
                light += ALBEDO * self.tree_of_rays(search, &next, p, d - 1, rng, spent) / f64::from(p.r * p.r);
            }
        }
        light
    }

    fn lamp_light(
        &self,
        search: Search,
        at: Point3,
        n: Vec3,
        [o, u, v]: &[Vec3; 3],
        [x, y]: [f32; 2],
        spent: &mut Spent,
    ) -> f64 {
        let q = *o + *u * x + *v * y;
        let d = q - at.to_vec();
        let squared = d.length_squared();
        let w = d * (1.0 / squared.sqrt());
        let blocked = self.occluded(search, &Ray { o: at, d, t_max: 0.9999, time: 0.0 }, spent);
        // The lamp faces down.
        let geometry = n.dot(w).max(0.0) * w.y.max(0.0) / squared;
        let area = u.cross(*v).length();
        if blocked { 0.0 } else { 10.0 * ALBEDO / std::f64::consts::PI * f64::from(geometry * area) }
    }

    fn camera_ray(&self, m: u32, x: f32, y: f32, lens: [f32; 2]) -> Ray {
        let o = Point3::new(0.02 * (lens[0] - 0.5), 0.02 * (lens[1] - 0.5), -0.98);
        let target = Point3::new(1.6 * (x / m as f32 - 0.5), 1.6 * (0.5 - y / m as f32), 0.5);
        Ray::new(o, (target - o).normalize(), 0.0)
    }

    /// The picture by brute force, and what it cost.
    pub fn brute_force(&self, search: Search, p: &BruteForce, seed: u64) -> (Vec<f64>, Spent) {
        let mut spent = Spent::default();
        let picture = (0..p.m * p.m)
            .map(|pixel| {
                let mut rng = Rng::new(seed, u64::from(pixel));
                let mut sum = 0.0;
                for cell in 0..p.k * p.k {
                    let [dx, dy] = jitter(cell, p.k, &mut rng);
                    for lens in 0..p.a * p.a {
                        let lens = jitter(lens, p.a, &mut rng);
                        let ray = self.camera_ray(p.m, (pixel % p.m) as f32 + dx, (pixel / p.m) as f32 + dy, lens);
                        sum += self.tree_of_rays(search, &ray, p, p.d, &mut rng, &mut spent);
                    }
                }
                sum / f64::from(p.k * p.k * p.a * p.a)
            })
            .collect();
        (picture, spent)
    }

    /// The picture by path tracing: one random choice for everything, `paths` times; and what it cost.
    pub fn path_trace(&self, search: Search, m: u32, d: u32, paths: u32, seed: u64) -> (Vec<f64>, Spent) {
        let mut spent = Spent::default();
        let picture = (0..m * m)
            .map(|pixel| {
                let mut rng = Rng::new(seed, u64::from(pixel));
                (0..paths)
                    .map(|_| {
                        let (x, y) = ((pixel % m) as f32 + rng.f32(), (pixel / m) as f32 + rng.f32());
                        let mut ray = self.camera_ray(m, x, y, rng.f32_2d());
                        let (mut light, mut beta) = (0.0, 1.0);
                        for bounce in 0..d {
                            let Some((t, n)) = self.closest(search, &ray, &mut spent) else { break };
                            let at = ray.o + ray.d * t + n * 1e-4;
                            let lamp = &self.lamps[rng.below(self.lamps()) as usize];
                            let one = self.lamp_light(search, at, n, lamp, rng.f32_2d(), &mut spent);
                            light += beta * f64::from(self.lamps()) * one;
                            if bounce + 1 < d {
                                let w = Frame::from_z(n).from_local(square_to_cosine_hemisphere(rng.f32_2d()));
                                ray = Ray::new(at, w, 0.0);
                                beta *= ALBEDO;
                            }
                        }
                        light
                    })
                    .sum::<f64>()
                    / f64::from(paths)
            })
            .collect();
        (picture, spent)
    }
}

fn jitter(cell: u32, side: u32, rng: &mut Rng) -> [f32; 2] {
    let [u, v] = rng.f32_2d();
    let n = side as f32;
    [((cell % side) as f32 + u) / n, ((cell / side) as f32 + v) / n]
        .map(|v: f32| v.min(steradian_math::ONE_MINUS_EPSILON))
}

/// Möller and Trumbore 1997; no culling.
fn meet(ray: &Ray, [a, b, c]: &[Point3; 3]) -> Option<f32> {
    let (e1, e2) = (*b - *a, *c - *a);
    let p = ray.d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.o - *a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = ray.d.dot(q) / det;
    // The walls' edges are widened a little, so that no ray leaks out of the room between two triangles.
    const EDGE: f32 = -1e-6;
    if u < EDGE || v < EDGE || u + v > 1.0 - EDGE {
        return None;
    }
    let t = e2.dot(q) / det;
    (t > 0.0).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tree_and_list_see_the_same() {
        let soup = Soup::new(200, 2, 7).expect("a room");
        let p = BruteForce { m: 6, k: 1, a: 1, s: 1, r: 2, d: 2, n: 200, l: 2 };
        let (linear, l) = soup.brute_force(Search::Linear, &p, 1);
        let (tree, t) = soup.brute_force(Search::Tree, &p, 1);
        assert_eq!(linear, tree);
        assert_eq!(l.rays, t.rays);
        assert!(t.tests * 3 < l.tests);
    }
}
