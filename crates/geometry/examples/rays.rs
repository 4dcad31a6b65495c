//! Measures rays per second of `Accel`: `cargo run --release -p steradian-geometry --example rays [level]`.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use steradian_bvh::available_levels;
use steradian_geometry::{Accel, InputTriangle};
use steradian_math::{Frame, PI, Point3, Ray, Vec3, cos, sin, sin_cos};

struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn quad(out: &mut Vec<InputTriangle>, q: [Point3; 4]) {
    for k in [[0, 1, 2], [0, 2, 3]] {
        let id = out.len() as u32;
        out.push(InputTriangle { p: k.map(|k| q[k]), id, filtered: false });
    }
}

fn cube(out: &mut Vec<InputTriangle>, center: Point3, half: Vec3, angle: f32, open: bool) {
    let (s, c) = sin_cos(angle);
    let corner = |i: usize| {
        let v = [if i & 1 == 0 { -half.x } else { half.x }, if i & 2 == 0 { -half.y } else { half.y }];
        let z = if i & 4 == 0 { -half.z } else { half.z };
        center + Vec3::new(c * v[0] + s * z, v[1], c * z - s * v[0])
    };
    let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [4, 5, 7, 6], [0, 1, 3, 2]];
    for f in &faces[..if open { 5 } else { 6 }] {
        quad(out, f.map(corner));
    }
}

/// Five walls, a light and two boxes: 36 triangles.
fn cornell() -> Vec<InputTriangle> {
    let mut t = Vec::new();
    cube(&mut t, Point3::default(), Vec3::splat(1.0), 0.0, true);
    quad(&mut t, [[-0.2, 0.99, -0.2], [0.2, 0.99, -0.2], [0.2, 0.99, 0.2], [-0.2, 0.99, 0.2]].map(Point3::from));
    cube(&mut t, Point3::new(-0.35, -0.4, 0.3), Vec3::new(0.3, 0.6, 0.3), 0.3, false);
    cube(&mut t, Point3::new(0.35, -0.7, -0.2), Vec3::new(0.3, 0.3, 0.3), -0.3, false);
    t
}

/// Twenty bumpy spheres above a floor: about a million triangles.
fn blobs(n: usize) -> Vec<InputTriangle> {
    let mut t = Vec::new();
    let mut rng = Numbers(7);
    for _ in 0..20 {
        let center = Vec3::new(1.6 * rng.next() - 0.8, 1.2 * rng.next() - 0.8, 1.6 * rng.next() - 0.8);
        let radius = 0.15 + 0.2 * rng.next();
        let at = |i: usize, j: usize| {
            let (theta, phi) = (i as f32 / n as f32 * PI, j as f32 / n as f32 * PI);
            let r = radius * (1.0 + 0.1 * sin(40.0 * theta) * cos(30.0 * phi));
            (center + Vec3::spherical(sin(theta), cos(theta), phi) * r).to_point()
        };
        for i in 0..n {
            for j in 0..2 * n {
                quad(&mut t, [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    quad(&mut t, [[-3.0, -1.0, -3.0], [3.0, -1.0, -3.0], [3.0, -1.0, 3.0], [-3.0, -1.0, 3.0]].map(Point3::from));
    t
}

fn closest(accel: &Accel, ray: &Ray) -> Option<f32> {
    accel.closest(ray, |_, _| None, |_, _, _, _| true).map(|h| h.t)
}

/// Times `f` over all rays, best of a few rounds; in nanoseconds per ray.
fn time(rays: &[Ray], mut f: impl FnMut(&Ray) -> bool) -> (f64, usize) {
    let mut best = f64::INFINITY;
    let mut hits = 0;
    for _ in 0..9 {
        let start = Instant::now();
        hits = rays.iter().filter(|r| f(r)).count();
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best * 1e9 / rays.len() as f64, hits)
}

fn measure(name: &str, triangles: &[InputTriangle], eye: Point3) {
    let start = Instant::now();
    let mut accel = Accel::build(triangles, &[]).expect("the scene is finite");
    println!(
        "{name}: {} triangles, built in {:.3} s, {:.1} bytes per triangle",
        triangles.len(),
        start.elapsed().as_secs_f64(),
        accel.byte_size() as f64 / triangles.len() as f64
    );
    let wanted = std::env::args().nth(1);
    for level in available_levels() {
        let label = format!("{level:?}");
        if wanted.as_ref().is_some_and(|w| !label.to_lowercase().starts_with(w.as_str())) {
            continue;
        }
        accel.set_level(level);
        let side = 512;
        let mut rng = Numbers(1);
        let primary: Vec<Ray> = (0..side * side)
            .map(|i| {
                let (x, y) = ((i % side) as f32 + rng.next(), (i / side) as f32 + rng.next());
                let d = Vec3::new(x / side as f32 * 2.0 - 1.0, 1.0 - y / side as f32 * 2.0, 2.0).normalize();
                Ray::new(eye, d, 0.0)
            })
            .collect();
        let light = Point3::new(0.1, 0.98, 0.1);
        let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
        for ray in &primary {
            if let Some(h) = accel.closest(ray, |_, _| None, |_, _, _, _| true) {
                let p = triangles[h.id as usize].p;
                let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize().face_forward(-ray.d);
                let o = ray.at(h.t) + n * 1e-4;
                let (s, c) = sin_cos(2.0 * PI * rng.next());
                let r = rng.next();
                let local = Vec3::new(r.sqrt() * c, r.sqrt() * s, (1.0 - r).sqrt());
                bounce.push(Ray::new(o, Frame::from_z(n).from_local(local), 0.0));
                shadow.push(Ray { t_max: 0.999, ..Ray::new(o, light - o, 0.0) });
            }
        }
        let any = |r: &Ray| accel.any(r, |_, _| false, |_, _, _, _| true);
        let [p, b, s] = [
            time(&primary, |r| closest(&accel, r).is_some()),
            time(&bounce, |r| closest(&accel, r).is_some()),
            time(&shadow, any),
        ];
        let cell = |(ns, hits): (f64, usize)| format!("{:7.1} ns {:6.2} M/s ({hits})", ns, 1e3 / ns);
        let label = label.split('(').next().unwrap_or_default();
        println!("  {label:8} primary {}  bounce {}  shadow {}", cell(p), cell(b), cell(s));
    }
}

fn main() {
    measure("cornell", &cornell(), Point3::new(0.0, 0.0, -2.9));
    measure("blobs", &blobs(114), Point3::new(0.0, 0.2, -2.9));
}
