//! Whole renders of small scenes: camera paths per second.

use divan::Bencher;
use divan::counter::ItemsCount;
use std::sync::atomic::AtomicBool;
use steradian_render::{Plan, Quiet, render};
use steradian_scene::World;
use steradian_spectrum::ColorMode;

fn main() {
    divan::main();
}

/// The Cornell box (Goral et al. 1984), with the proportions of its measured successor.
const CORNELL: &str = r#"
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

const SPP: u32 = 4;

fn cornell(bencher: Bencher, color: ColorMode) {
    let mut scene = steradian::load_text("cornell.pbrt", CORNELL).expect("a sound scene");
    scene.settings.color = color;
    let world = World::build(scene).expect("a sound scene");
    let plan = Plan { spp: SPP, threads: 1, time_limit: None };
    let [width, height] = world.settings().film.size();
    bencher
        .counter(ItemsCount::new(width * height * SPP))
        .bench_local(|| render(&world, &plan, &Quiet, &AtomicBool::new(false)).spp);
}

#[divan::bench]
fn cornell_rgb(bencher: Bencher) {
    cornell(bencher, ColorMode::Rgb);
}

#[divan::bench]
fn cornell_spectral(bencher: Bencher) {
    cornell(bencher, ColorMode::Spectral);
}
