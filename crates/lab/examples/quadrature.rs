//! Slides "Approximating integrals": the midpoint rule against random points, in one to six dimensions.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;
use steradian_sampling::estimator::{Quadrature, uniform_monte_carlo};

/// The product of e^x / (e - 1), whose integral over the unit cube is 1.
fn f<const D: usize>(x: &[f64; D]) -> f64 {
    x.iter().map(|v| v.exp() / (std::f64::consts::E - 1.0)).product()
}

fn compare<const D: usize>() {
    let per_axis = 4096f64.powf(1.0 / D as f64).round() as u32;
    let evaluations = u64::from(per_axis).pow(D as u32);
    let rule = (Quadrature::Midpoint.integrate(per_axis, f::<D>) - 1.0).abs();
    let random = uniform_monte_carlo(evaluations, &mut Rng::new(1, D as u64), f::<D>);
    println!("{D}  {per_axis:4}^{D} = {evaluations:5}  {rule:.2e}  {:.2e}", random.standard_error());
}

fn main() {
    println!("d  evaluations     midpoint  random (standard error)");
    compare::<1>();
    compare::<2>();
    compare::<3>();
    compare::<4>();
    compare::<6>();
}
