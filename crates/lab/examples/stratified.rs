//! Slides "Stratified sampling": 16 random and 16 jittered samples of a pixel.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::estimator::stratified_2d;
use steradian_sampling::{Rng, VarianceEstimator};

fn main() {
    let f = |p: [f64; 2]| p[0] + p[1] * p[1];
    let mut rng = Rng::new(1, 0);
    let random: VarianceEstimator =
        (0..10_000).map(|_| (0..16).map(|_| f([rng.f64(), rng.f64()])).sum::<f64>() / 16.0).collect();
    let jittered: VarianceEstimator = (0..10_000).map(|_| stratified_2d(4, 4, 1, &mut rng, f).value).collect();
    println!("random:   mean {:.4}, variance {:.2e}", random.mean(), random.variance());
    println!("jittered: mean {:.4}, variance {:.2e}", jittered.mean(), jittered.variance());
}
