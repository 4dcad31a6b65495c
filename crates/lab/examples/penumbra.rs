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
    // Brute force: k x k places of the pixel, s x s of the lamp for each, here in one dimension of both.
    let (places, points) = (5u32, 5u32);
    let n = places * points;
    let rms = |estimate: &mut dyn FnMut(u64) -> f64| {
        (0..2_000)
            .map(|i| estimate(i) / f64::from(n) - exact)
            .map(|e| e * e)
            .collect::<VarianceEstimator>()
            .mean()
            .sqrt()
    };
    let mut rng = Rng::new(1, 0);
    let brute = rms(&mut |_| {
        let at = |rng: &mut Rng| (0..points).map(|_| rng.f64()).collect::<Vec<_>>();
        let pixel: Vec<f64> = (0..places).map(|_| rng.f64()).collect();
        pixel.iter().map(|&u| at(&mut rng).iter().map(|&v| light(u, v)).sum::<f64>()).sum()
    });
    let random = rms(&mut |_| (0..n).map(|_| light(rng.f64(), rng.f64())).sum());
    let stratified =
        rms(&mut |i| (0..n).map(|c| jittered_2d(c, places, points, i).map(f64::from)).map(|[u, v]| light(u, v)).sum());
    println!("rms error of {n} shadow rays: brute force {brute:.4}, random {random:.4}, stratified {stratified:.4}");
}
