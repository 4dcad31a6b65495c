//! `Accel` on every instruction set against brute force with the scalar triangle test: the same hits, bit for bit.

use steradian_bvh::available_levels;
use steradian_geometry::{Accel, AccelError, AccelHit, HitKind, InputTriangle, Triangle};
use steradian_math::{Bounds3, Point3, Ray, Vec3};

/// A multiplicative generator: tests need arbitrary numbers, not good ones.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    fn signed(&mut self) -> f32 {
        2.0 * self.next() - 1.0
    }
    fn point(&mut self) -> Point3 {
        Point3::new(self.signed(), self.signed(), self.signed())
    }
    fn vector(&mut self) -> Vec3 {
        self.point().to_vec()
    }
}

/// Spheres as "others": the nearest root by scalar arithmetic.
fn meet_sphere(center: Point3, radius: f32, ray: &Ray) -> Option<f32> {
    let o = ray.o - center;
    let (a, b, c) = (ray.d.dot(ray.d), 2.0 * o.dot(ray.d), o.dot(o) - radius * radius);
    let (t0, t1) = steradian_math::solve_quadratic(a, b, c)?;
    [t0, t1].into_iter().find(|&t| t > 0.0 && t <= ray.t_max)
}

fn hole(id: u32, b1: f32, b2: f32) -> bool {
    ((b1 * 7.0) as u32 + (b2 * 5.0) as u32 + id).is_multiple_of(2)
}

fn brute_force(triangles: &[InputTriangle], spheres: &[(Point3, f32)], ray: &Ray) -> Option<AccelHit> {
    let mut best: Option<AccelHit> = None;
    let mut offer = |hit: AccelHit| {
        if best.is_none_or(|b| (hit.t, hit.kind, hit.id) < (b.t, b.kind, b.id)) {
            best = Some(hit);
        }
    };
    for t in triangles {
        if let Some(h) = (Triangle { p: t.p }).intersect(ray, ray.t_max)
            && (!t.filtered || hole(t.id, h.b1, h.b2))
        {
            offer(AccelHit { t: h.t, b1: h.b1, b2: h.b2, id: t.id, kind: HitKind::Triangle });
        }
    }
    for (i, &(c, r)) in spheres.iter().enumerate() {
        if let Some(t) = meet_sphere(c, r, ray) {
            offer(AccelHit { t, b1: 0.0, b2: 0.0, id: i as u32, kind: HitKind::Other });
        }
    }
    best
}

fn check(triangles: &[InputTriangle], spheres: &[(Point3, f32)], rays: impl IntoIterator<Item = Ray>) -> usize {
    let boxes: Vec<Bounds3> =
        spheres.iter().map(|&(c, r)| Bounds3 { min: c - Vec3::splat(r), max: c + Vec3::splat(r) }).collect();
    let mut accel = Accel::build(triangles, &boxes).unwrap();
    let mut hits = 0;
    for ray in rays {
        let expected = brute_force(triangles, spheres, &ray);
        hits += usize::from(expected.is_some());
        for level in available_levels() {
            accel.set_level(level);
            let sphere = |i: u32, r: &Ray| meet_sphere(spheres[i as usize].0, spheres[i as usize].1, r);
            let found = accel.closest(&ray, sphere, |id, _, b1, b2| hole(id, b1, b2));
            let bits = |h: Option<AccelHit>| h.map(|h| (h.t.to_bits(), h.b1.to_bits(), h.b2.to_bits(), h.id, h.kind));
            assert_eq!(bits(found), bits(expected), "{level:?} {ray:?} {found:?} {expected:?}");
            let any = accel.any(&ray, |i, r| sphere(i, r).is_some(), |id, _, b1, b2| hole(id, b1, b2));
            assert_eq!(any, expected.is_some(), "{level:?} {ray:?}");
        }
    }
    hits
}

#[test]
fn random_scenes_match_brute_force() {
    let mut n = Numbers(1);
    for round in 0..40 {
        let size = [0.05, 0.3, 1.0][round % 3];
        let triangles: Vec<_> = (0..(round * 17) as u32)
            .map(|id| {
                let p = n.point();
                InputTriangle {
                    p: [p, p + n.vector() * size, p + n.vector() * size],
                    id: id ^ 5,
                    filtered: id % 3 == 0,
                }
            })
            .collect();
        let spheres: Vec<_> = (0..round % 9).map(|_| (n.point(), 0.1 + 0.2 * n.next())).collect();
        let rays: Vec<_> = (0..60)
            .map(|i| {
                let mut d = n.vector();
                if i % 4 == 0 {
                    d.x = 0.0;
                }
                if i % 8 == 0 {
                    d.y = -0.0;
                }
                let t_max = if i % 5 == 0 { n.next() } else { f32::INFINITY };
                Ray { t_max, ..Ray::new(n.point(), d, 0.0) }
            })
            .collect();
        check(&triangles, &spheres, rays);
    }
}

/// A closed, bumpy surface around the origin.
fn blob(n: usize, bumps: f32) -> Vec<InputTriangle> {
    let at = |i: usize, j: usize| {
        let (theta, phi) =
            (i as f32 / n as f32 * steradian_math::PI, (j % (2 * n)) as f32 / n as f32 * steradian_math::PI);
        let r = 1.0 + bumps * steradian_math::sin(9.0 * theta) * steradian_math::cos(7.0 * phi);
        if i == 0 || i == n {
            return Point3::new(0.0, 0.0, if i == 0 { 1.0 } else { -1.0 });
        }
        let s = steradian_math::sin(theta);
        let (sin_phi, cos_phi) = steradian_math::sin_cos(phi);
        Point3::new(r * s * cos_phi, r * s * sin_phi, r * steradian_math::cos(theta))
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            let quad = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            for k in [[0, 1, 2], [0, 2, 3]] {
                let id = triangles.len() as u32;
                triangles.push(InputTriangle { p: k.map(|k| quad[k]), id, filtered: false });
            }
        }
    }
    triangles
}

#[test]
fn no_ray_escapes_a_closed_surface() {
    let triangles = blob(24, 0.1);
    let accel = Accel::build(&triangles, &[]).unwrap();
    assert!(accel.dropped() > 0, "the poles have triangles without area");
    let mut n = Numbers(3);
    let mut rays: Vec<Ray> =
        (0..20_000).map(|_| Ray::new(n.point().lerp(Point3::default(), 0.7), n.vector(), 0.0)).collect();
    // Straight at every vertex, and at the middle of every edge.
    for t in &triangles {
        for k in 0..3 {
            let o = Point3::new(0.01, 0.02, -0.03);
            rays.push(Ray::new(o, t.p[k] - o, 0.0));
            rays.push(Ray::new(Point3::default(), t.p[k].lerp(t.p[(k + 1) % 3], 0.5).to_vec(), 0.0));
        }
    }
    for ray in rays {
        assert!(accel.any(&ray, |_, _| false, |_, _, _, _| true), "{ray:?}");
        assert!(accel.closest(&ray, |_, _| None, |_, _, _, _| true).is_some(), "{ray:?}");
    }
}

#[test]
fn coincident_surfaces_give_the_smaller_identifier() {
    let mut n = Numbers(5);
    // Every triangle five times, in shuffled order; vertices on a grid, so that neighbours are hit at equal distance too.
    let mut triangles = Vec::new();
    for i in 0..64u32 {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        let quad = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]].map(|q| Point3::new(q[0], q[1], 2.0));
        for copy in 0..5 {
            let id = (i * 37 + copy * 101) % 640;
            triangles.push(InputTriangle { p: [quad[0], quad[1], quad[2]], id: 2 * id, filtered: false });
            triangles.push(InputTriangle { p: [quad[0], quad[2], quad[3]], id: 2 * id + 1, filtered: false });
        }
    }
    let sphere = (Point3::new(4.0, 4.0, 3.0), 1.0);
    let mut rays = Vec::new();
    for i in 0..=32 {
        for j in 0..=32 {
            rays.push(Ray::new(Point3::new(i as f32 * 0.25, j as f32 * 0.25, 0.0), Vec3::new(0.0, 0.0, 1.0), 0.0));
        }
    }
    rays.push(Ray::new(Point3::new(4.0 + n.next(), 4.0, 0.0), Vec3::new(0.0, 0.0, 1.0), 0.0));
    assert!(check(&triangles, &[sphere, sphere], rays) > 1000);
}

#[test]
fn a_ray_that_starts_on_a_triangle_does_not_meet_it() {
    let mut n = Numbers(8);
    for scale in [1e-3f32, 1.0, 1e3] {
        for _ in 0..2000 {
            let mut vertex = || n.point() + Vec3::splat(5.0);
            let triangle = Triangle::new(vertex(), vertex(), vertex());
            let triangle = Triangle { p: triangle.p.map(|p| (p.to_vec() * scale).to_point()) };
            let (mut b1, mut b2) = (n.next(), n.next());
            if b1 + b2 > 1.0 {
                (b1, b2) = (1.0 - b1, 1.0 - b2);
            }
            let [p0, p1, p2] = triangle.p;
            let p = p0 + (p1 - p0) * b1 + (p2 - p0) * b2;
            let ray = Ray::new(p, n.vector(), 0.0);
            // A direction in the plane may meet it at a distance; any other must not.
            if let Some(h) = triangle.intersect(&ray, f32::INFINITY) {
                assert!(ray.at(h.t).distance(p) < 1e-4 * scale, "{h:?} {triangle:?} {ray:?}");
            }
        }
    }
}

#[test]
fn bad_input_is_named() {
    let good = InputTriangle {
        p: [Point3::default(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
        id: 0,
        filtered: false,
    };
    let mut bad = InputTriangle { id: 9, ..good };
    bad.p[1].y = f32::NAN;
    assert_eq!(Accel::build(&[good, bad], &[]).err(), Some(AccelError::BadTriangle { id: 9 }));
    bad.p[1].y = f32::INFINITY;
    assert_eq!(Accel::build(&[bad], &[]).err(), Some(AccelError::BadTriangle { id: 9 }));
    assert_eq!(Accel::build(&[good], &[Bounds3::EMPTY]).err(), Some(AccelError::BadBounds { index: 0 }));
    let id = InputTriangle { id: 1 << 31, ..good };
    assert_eq!(Accel::build(&[id], &[]).err(), Some(AccelError::BadId { id: 1 << 31 }));
    let empty = Accel::build(&[], &[]).unwrap();
    let ray = Ray::new(Point3::default(), Vec3::new(0.0, 0.0, 1.0), 0.0);
    assert!(empty.closest(&ray, |_, _| Some(0.5), |_, _, _, _| true).is_none() && empty.bounds().is_empty());
}
