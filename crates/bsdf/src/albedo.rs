//! Directional albedo of a lobe, by quasi-Monte Carlo with fixed points.

use crate::lobe::{Lobe, TransportMode};
use steradian_math::Vec3;
use steradian_sampling::rng::unit_f32;
use steradian_sampling::sequence::{golden_ratio, sobol_02};
use steradian_spectrum::Lanes;

/// Mean weight of `count` samples. Flux is meant, so refraction does not scale it.
pub(crate) fn estimate(lobe: &impl Lobe, wo: Vec3, count: u32) -> Lanes {
    let mut sum = Lanes::ZERO;
    for i in 0..count {
        // The half step keeps the points off the borders of the square.
        let u = sobol_02(i).map(|bits| unit_f32(bits | (0x8000_0000 / count.max(1))));
        let u_lobe = golden_ratio(u64::from(i), 0.5);
        if let Some(sample) = lobe.sample(wo, u_lobe, u, TransportMode::Importance) {
            sum += sample.weight;
        }
    }
    sum / count.max(1) as f32
}
