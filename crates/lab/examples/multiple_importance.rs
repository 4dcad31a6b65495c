//! The reading on multiple importance sampling: two densities, each good for one of two peaks.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::{Rng, VarianceEstimator, power_heuristic};

/// A normal density by its middle and width.
fn normal(x: f64, middle: f64, width: f64) -> f64 {
    (-0.5 * ((x - middle) / width) * ((x - middle) / width)).exp() / (width * std::f64::consts::TAU.sqrt())
}

fn main() {
    // Two peaks of one half each: the integral is 1.
    let f = |x: f64| 0.5 * normal(x, 0.0, 0.1) + 0.5 * normal(x, 1.0, 0.5);
    let p = [|x: f64| normal(x, 0.0, 0.1), |x: f64| normal(x, 1.0, 0.5)];
    let mut rng = Rng::new(1, 0);
    let mut draw = |i: usize| {
        let z = (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (std::f64::consts::TAU * rng.f64()).cos();
        [0.1 * z, 1.0 + 0.5 * z][i]
    };
    let (mut second, mut both) = (VarianceEstimator::default(), VarianceEstimator::default());
    for _ in 0..10_000 {
        let x = draw(1);
        second.add(f(x) / p[1](x));
        both.add(
            (0..2)
                .map(|i| {
                    let x = draw(i);
                    let (own, other) = (p[i](x), p[1 - i](x));
                    f64::from(power_heuristic(1.0, own as f32, 1.0, other as f32)) * f(x) / own
                })
                .sum(),
        );
    }
    println!("the wide density alone: {:.4}, variance {:.3}", second.mean(), second.variance());
    println!("both, power heuristic:  {:.4}, variance {:.3}", both.mean(), both.variance());
}
