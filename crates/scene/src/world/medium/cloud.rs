//! The density of a procedural cloud (PBRT 4th ed., 11.4.5): noise, looked up where other noise has moved it.

use crate::medium::Cloud;
use crate::world::noise::noise;
use steradian_math::{Point3, Vec3};

/// The slope of the noise, by differences.
fn noise_slope(p: Point3) -> Vec3 {
    const STEP: f32 = 0.01;
    let here = noise(p);
    let along = |d: Vec3| (noise(p + d) - here) / STEP;
    Vec3::new(along(Vec3::new(STEP, 0.0, 0.0)), along(Vec3::new(0.0, STEP, 0.0)), along(Vec3::new(0.0, 0.0, STEP)))
}

impl Cloud {
    /// The density at a point of the medium's space, in [0, 1].
    pub(super) fn density_at(&self, p: Point3) -> f32 {
        let mut q = p * self.frequency;
        if self.wispiness > 0.0 {
            let (mut strength, mut lambda) = (0.05 * self.wispiness, 10.0);
            for _ in 0..2 {
                q += noise_slope(q * lambda) * strength;
                strength *= 0.5;
                lambda *= 1.99;
            }
        }
        let (mut sum, mut amplitude, mut lambda) = (0.0, 0.5, 1.0);
        for _ in 0..5 {
            sum += amplitude * noise(q * lambda);
            amplitude *= 0.5;
            lambda *= 1.99;
        }
        // Flat below, thinning out above.
        let body = ((1.0 - p.y) * 4.5 * self.density * sum).clamp(0.0, 1.0);
        (body + 2.0 * (0.5 - p.y).max(0.0)).clamp(0.0, 1.0)
    }
}
