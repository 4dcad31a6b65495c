//! Slides "Importance sampling": a lobe around the mirror direction, with directions from the hemisphere and from the lobe.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::Rng;
use steradian_sampling::estimator::monte_carlo;
use steradian_sampling::warp::{square_to_uniform_hemisphere, square_to_uniform_hemisphere_pdf};

fn main() {
    // The lobe z^50 reflects a sky of radiance 1 + x: the integral is 2 pi / 51.
    let exact = std::f64::consts::TAU / 51.0;
    let f = |w: &[f64; 3]| w[2].powi(50) * (1.0 + w[0]);
    let mut rng = Rng::new(1, 0);
    let uniform = || {
        let w = square_to_uniform_hemisphere(rng.f32_2d());
        Some(([w.x, w.y, w.z].map(f64::from), f64::from(square_to_uniform_hemisphere_pdf(w))))
    };
    let without = monte_carlo(100, uniform, f);
    let lobe = || {
        // Density (51 / 2 pi) z^50, by inversion.
        let (z, phi) = ((1.0 - rng.f64()).powf(1.0 / 51.0), std::f64::consts::TAU * rng.f64());
        let r = (1.0 - z * z).sqrt();
        Some(([r * phi.cos(), r * phi.sin(), z], z.powi(50) / exact))
    };
    let with = monte_carlo(100, lobe, f);
    println!("exactly {exact:.5}");
    println!("100 rays without importance sampling: {:.5} +- {:.5}", without.mean(), without.standard_error());
    println!("100 rays with importance sampling:    {:.5} +- {:.5}", with.mean(), with.standard_error());
    println!("as good without: {:.0} rays", 100.0 * without.variance() / with.variance());
}
