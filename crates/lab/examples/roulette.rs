//! The reading on Russian roulette: a sum without end, estimated by walks that end.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::{Rng, VarianceEstimator};

fn main() {
    // Half of the light goes on at each bounce: 1 + 1/2 + 1/4 + ... = 2. The light found is 0 or 2 each time.
    let mut rng = Rng::new(1, 0);
    println!("survival  mean   variance  bounces  efficiency");
    for q in [0.3, 0.5, 0.625, 0.75, 0.9] {
        let (mut light, mut bounces) = (VarianceEstimator::default(), 0u32);
        for _ in 0..100_000 {
            let (mut sum, mut weight) = (0.0, 1.0);
            loop {
                bounces += 1;
                sum += weight * if rng.f64() < 0.5 { 2.0 } else { 0.0 };
                if rng.f64() >= q {
                    break;
                }
                weight *= 0.5 / q;
            }
            light.add(sum);
        }
        let cost = f64::from(bounces) / 1e5;
        println!(
            "{q:8}  {:.3}  {:8.3}  {cost:7.2}  {:10.3}",
            light.mean(),
            light.variance(),
            1.0 / (light.variance() * cost)
        );
    }
}
