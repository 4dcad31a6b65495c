//! Slides "Penumbra revisited": pixel and lamp by brute force, at random, and stratified, for equal numbers of rays.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::sequence::jittered_2d;
use steradian_sampling::{Rng, VarianceEstimator};

/// Light at a place u of the pixel from a place v of the lamp: an edge casts its shadow across both.
fn light(u: f64, v: f64) -> f64 {
    f64::from(u + 0.7 * v < 0.9)
}

fn main() {
    // The exact mean over the unit square: all of u below 0.2, then a slanted edge.
    let exact =
        (0..100_000).map(|i| (f64::from(i) + 0.5) / 1e5).map(|v| (0.9 - 0.7 * v).clamp(0.0, 1.0)).sum::<f64>() / 1e5;
    let k = 5u32;
    let error = |mut estimate: Box<dyn FnMut(u64) -> f64>| {
        (0..2_000).map(|i| estimate(i) - exact).map(|e| e * e).collect::<VarianceEstimator>().mean().sqrt()
    };
    let n = f64::from(k * k);
    let mut rng = Rng::new(1, 0);
    let random = error(Box::new(move |_| (0..k * k).map(|_| light(rng.f64(), rng.f64())).sum::<f64>() / n));
    let stratified = error(Box::new(move |i| {
        (0..k * k).map(|c| jittered_2d(c, k, k, i).map(f64::from)).map(|[u, v]| light(u, v)).sum::<f64>() / n
    }));
    println!("rms error of {n} rays: random {random:.4}, stratified {stratified:.4}");
}
