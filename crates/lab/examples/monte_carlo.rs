//! Slides "Stochastic sampling as integration" and "Monte Carlo integration": the factors that an estimator needs.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;
use steradian_sampling::estimator::monte_carlo;

fn main() {
    // The integral of x^2 from 1 to 3 is 26/3.
    let f = |x: &f64| x * x;
    let mut rng = Rng::new(1, 0);
    let bare = monte_carlo(100_000, || Some((1.0 + 2.0 * rng.f64(), 1.0)), f);
    println!("mean of f(X):              {:.4} +- {:.4}, which is F/w", bare.mean(), bare.standard_error());
    let uniform = monte_carlo(100_000, || Some((1.0 + 2.0 * rng.f64(), 0.5)), f);
    println!("mean of f(X)/p(X), p = 1/w: {:.4} +- {:.4}", uniform.mean(), uniform.standard_error());
    // p(x) = x/4 by inversion: larger where f is larger.
    let rising = || {
        let x = (1.0 + 8.0 * rng.f64()).sqrt();
        Some((x, x / 4.0))
    };
    let rising = monte_carlo(100_000, rising, f);
    println!("mean of f(X)/p(X), p = x/4: {:.4} +- {:.4}", rising.mean(), rising.standard_error());
}
