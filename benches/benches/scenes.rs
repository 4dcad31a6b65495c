//! Whole renders of small scenes: camera paths per second.

use benches::CORNELL;
use divan::Bencher;
use divan::counter::ItemsCount;
use std::sync::atomic::AtomicBool;
use steradian_render::{Plan, Quiet, render};
use steradian_scene::World;
use steradian_spectrum::ColorMode;

fn main() {
    divan::main();
}

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
