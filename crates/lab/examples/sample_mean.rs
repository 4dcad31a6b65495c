//! Slides "A stochastic approach", "Sample mean" and "Sample variance": the mean of N draws is itself a random variable.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::{Rng, VarianceEstimator};

fn main() {
    // X uniform on [0, 1]: mean 1/2, variance 1/12.
    println!("  N  mean of the means  variance of the means  V[X]/N");
    for n in [1u32, 4, 16, 64] {
        let mut rng = Rng::new(7, u64::from(n));
        let means: VarianceEstimator =
            (0..20_000).map(|_| (0..n).map(|_| rng.f64()).sum::<f64>() / f64::from(n)).collect();
        println!("{n:3}  {:17.5}  {:21.6}  {:.6}", means.mean(), means.variance(), 1.0 / 12.0 / f64::from(n));
    }
}
