//! What the benchmarks measure on: geometry made by formula, so that everybody measures the same.
//!
//! `cargo bench -p benches` runs all of them, `cargo bench -p benches --bench rays` one group. Machines are noisy: compare
//! figures of one run, not of two.

pub mod embree;
pub mod room;

use steradian_math::{Point3, Ray, Vec3, cos, sin};
use steradian_sampling::Rng;
use steradian_sampling::warp::square_to_uniform_sphere;

/// A wavy sphere of about `count` triangles around the origin, of radius about one.
pub fn blob(count: usize) -> Vec<[Point3; 3]> {
    let n = ((count / 2) as f32).sqrt().ceil() as usize;
    let at = |i: usize, j: usize| {
        let w = square_to_uniform_sphere([i as f32 / n as f32, j as f32 / n as f32]);
        let r = 1.0 + 0.15 * sin(9.0 * w.x + 2.0 * w.z) * cos(7.0 * w.y);
        Point3::default() + w * r
    };
    let mut triangles = Vec::with_capacity(2 * n * n);
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        }
    }
    triangles
}

/// Rays from a point outside towards the unit sphere: neighbours are alike.
pub fn coherent_rays(count: usize) -> Vec<Ray> {
    let n = (count as f32).sqrt().ceil() as usize;
    (0..n * n)
        .map(|i| {
            let (x, y) = ((i % n) as f32 / n as f32, (i / n) as f32 / n as f32);
            Ray::new(Point3::new(0.0, 0.0, -3.0), Vec3::new(x - 0.5, y - 0.5, 1.2).normalize(), 0.0)
        })
        .collect()
}

/// Rays from random points near the surface in random directions: as after a diffuse bounce.
pub fn incoherent_rays(count: usize) -> Vec<Ray> {
    let mut rng = Rng::new(7, 0);
    (0..count)
        .map(|_| {
            let o = Point3::default() + square_to_uniform_sphere(rng.f32_2d()) * 1.2;
            Ray::new(o, square_to_uniform_sphere(rng.f32_2d()), 0.0)
        })
        .collect()
}

/// The Cornell box (Goral et al. 1984), with the proportions of its measured successor.
pub const CORNELL: &str = r#"
Integrator "path" "integer maxdepth" 8
PixelFilter "box"
Film "rgb" "integer xresolution" 128 "integer yresolution" 128
Sampler "paddedsobol"
LookAt 0 1 -6.8   0 1 0   0 1 0
Camera "perspective" "float fov" 19.5
WorldBegin
Material "diffuse" "rgb reflectance" [0.725 0.71 0.68]
Shape "trianglemesh" "point3 P" [-1 0 -1  1 0 -1  1 0 1  -1 0 1] "integer indices" [0 1 2 0 2 3]
Shape "trianglemesh" "point3 P" [-1 2 -1  1 2 -1  1 2 1  -1 2 1] "integer indices" [0 1 2 0 2 3]
Shape "trianglemesh" "point3 P" [-1 0 1  1 0 1  1 2 1  -1 2 1] "integer indices" [0 1 2 0 2 3]
AttributeBegin
  Translate 0.35 0.3 -0.35
  Rotate -17 0 1 0
  Scale 0.3 0.3 0.3
  Shape "trianglemesh" "point3 P" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1]
    "integer indices" [0 1 2 0 2 3  4 6 5 4 7 6  0 4 1 1 4 5  3 2 7 2 6 7  0 3 4 3 7 4  1 5 2 2 5 6]
AttributeEnd
AttributeBegin
  Translate -0.35 0.6 0.3
  Rotate 17 0 1 0
  Scale 0.3 0.6 0.3
  Shape "trianglemesh" "point3 P" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1]
    "integer indices" [0 1 2 0 2 3  4 6 5 4 7 6  0 4 1 1 4 5  3 2 7 2 6 7  0 3 4 3 7 4  1 5 2 2 5 6]
AttributeEnd
Material "diffuse" "rgb reflectance" [0.63 0.065 0.05]
Shape "trianglemesh" "point3 P" [-1 0 -1  -1 0 1  -1 2 1  -1 2 -1] "integer indices" [0 1 2 0 2 3]
Material "diffuse" "rgb reflectance" [0.14 0.45 0.091]
Shape "trianglemesh" "point3 P" [1 0 -1  1 2 -1  1 2 1  1 0 1] "integer indices" [0 1 2 0 2 3]
Material "diffuse" "rgb reflectance" [0 0 0]
AreaLightSource "diffuse" "rgb L" [17 12 4]
Shape "trianglemesh" "point3 P" [-0.24 1.98 -0.22  0.23 1.98 -0.22  0.23 1.98 0.16  -0.24 1.98 0.16] "integer indices" [0 1 2 0 2 3]
"#;
