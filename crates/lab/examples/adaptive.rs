//! Slide "Antialiasing by adaptive sampling": four rays decide whether a pixel gets more, and must not be counted again.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::{Rng, VarianceEstimator};

fn main() {
    let mut rng = Rng::new(1, 0);
    println!("share white  first rays kept  fresh rays");
    for share in [0.02, 0.05, 0.2, 0.5] {
        let (mut kept, mut fresh) = (VarianceEstimator::default(), VarianceEstimator::default());
        for _ in 0..200_000 {
            let mut white = |rays: u32| (0..rays).filter(|_| rng.f64() < share).count() as f64;
            let first = white(4);
            // The contrast is zero where all four agree.
            let flat = first == 0.0 || first == 4.0;
            kept.add(if flat { first / 4.0 } else { (first + white(28)) / 32.0 });
            fresh.add(if flat { white(4) / 4.0 } else { white(28) / 28.0 });
        }
        println!("{share:11}  {:15.5}  {:10.5}", kept.mean(), fresh.mean());
    }
}
