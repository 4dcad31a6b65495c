//! Building trees and asking them: triangles per second, rays per second.

use benches::{blob, coherent_rays, incoherent_rays};
use divan::Bencher;
use divan::counter::ItemsCount;
use steradian_geometry::{Accel, InputTriangle};
use steradian_math::Ray;

fn main() {
    divan::main();
}

const SIZES: [usize; 3] = [1_000, 20_000, 1_000_000];
const RAYS: usize = 1 << 14;

fn input(count: usize) -> Vec<InputTriangle> {
    blob(count).into_iter().zip(0..).map(|(p, id)| InputTriangle { p, id, filtered: false }).collect()
}

fn tree(count: usize) -> Accel {
    Accel::build(&input(count), &[]).expect("finite triangles")
}

#[divan::bench(args = SIZES, sample_count = 5)]
fn build(bencher: Bencher, size: usize) {
    let triangles = input(size);
    bencher
        .counter(ItemsCount::new(triangles.len()))
        .bench_local(|| Accel::build(divan::black_box(&triangles), &[]).map(|a| a.byte_size()));
}

fn closest(bencher: Bencher, size: usize, rays: &[Ray]) {
    let tree = tree(size);
    bencher
        .counter(ItemsCount::new(rays.len()))
        .bench_local(|| rays.iter().filter(|r| tree.closest(r, |_, _| None, |_, _, _, _| true).is_some()).count());
}

#[divan::bench(args = SIZES)]
fn closest_coherent(bencher: Bencher, size: usize) {
    closest(bencher, size, &coherent_rays(RAYS));
}

#[divan::bench(args = SIZES)]
fn closest_incoherent(bencher: Bencher, size: usize) {
    closest(bencher, size, &incoherent_rays(RAYS));
}

#[divan::bench(args = SIZES)]
fn any_incoherent(bencher: Bencher, size: usize) {
    let (tree, rays) = (tree(size), incoherent_rays(RAYS));
    bencher
        .counter(ItemsCount::new(rays.len()))
        .bench_local(|| rays.iter().filter(|r| tree.any(r, |_, _| false, |_, _, _, _| true)).count());
}
