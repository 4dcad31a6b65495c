//! Slide "Gloss and translucency": a rough mirror before black and white stripes, with all rays in the one ideal direction and
//! with rays distributed over the directions of reflection.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::{Rng, VarianceEstimator};

/// What is seen at an angle: stripes half a degree wide.
fn stripes(degrees: f64) -> f64 {
    f64::from(degrees.rem_euclid(1.0) < 0.5)
}

fn main() {
    // The lobe spreads evenly over 5 degrees around the ideal direction: whatever that is, it sees both colours alike.
    let (spread, exact) = (5.0, 0.5);
    let mut rng = Rng::new(1, 0);
    println!("rays  rms error of the ideal direction  over the lobe");
    for rays in [1u32, 4, 16, 64] {
        let (mut ideal, mut lobe) = (VarianceEstimator::default(), VarianceEstimator::default());
        for _ in 0..2_000 {
            let mirror = 90.0 * rng.f64();
            let n = f64::from(rays);
            let one = (0..rays).map(|_| stripes(mirror)).sum::<f64>() / n;
            let many = (0..rays).map(|_| stripes(mirror + spread * (rng.f64() - 0.5))).sum::<f64>() / n;
            ideal.add((one - exact) * (one - exact));
            lobe.add((many - exact) * (many - exact));
        }
        println!("{rays:4}  {:32.4}  {:13.4}", ideal.mean().sqrt(), lobe.mean().sqrt());
    }
}
