//! What gets through media to where it is looked for, and with which densities.

use steradian_math::Ray;
use steradian_sampling::rng::{Rng, hash_floats, mix_bits};
use steradian_scene::MediumRay;
use steradian_spectrum::Lanes;

/// Transmittance over the density of the hero's lane, and the densities of all lanes over the same: `r_l` for who looks along the ray, as for
/// lamps, `r_u` for who has to get through by chance, as who samples directions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Transmitted {
    pub t: Lanes,
    pub r_l: Lanes,
    pub r_u: Lanes,
}

impl Transmitted {
    /// Where nothing is in the way.
    pub const ALL: Self = Self { t: Lanes::ONE, r_l: Lanes::ONE, r_u: Lanes::ONE };

    /// The random numbers of estimates along a ray.
    pub fn rng(ray: &Ray, seed: f32) -> Rng {
        let (o, d) = (ray.o, ray.d);
        let words = hash_floats(&[o.x, o.y, o.z, d.x, d.y, d.z, seed]);
        Rng::new(words, mix_bits(words))
    }

    /// Goes through one medium more, up to the distance `t_max`: by the formula where the medium is the same everywhere, else by ratio tracking
    /// (Novák et al. 2014), with roulette where `left` is little. `None` if that ends it.
    #[inline]
    pub fn pass(
        &mut self,
        along: MediumRay<'_>,
        t_max: f32,
        lane: usize,
        rng: &mut Rng,
        left: impl Fn(&Self) -> Lanes,
    ) -> Option<()> {
        if let Some(t) = along.transmittance(t_max) {
            self.t *= t;
            self.r_u *= t;
            return Some(());
        }
        let mut flight = along.fly(t_max, lane);
        while let Some(c) = flight.next(rng.f32()) {
            let per_majorant = c.transmittance * (1.0 / c.majorant[lane]);
            let null = per_majorant * c.sigma_n();
            self.t *= null;
            self.r_u *= null;
            self.r_l *= per_majorant * c.majorant;
            if left(self).max_component() < 0.05 {
                const END: f32 = 0.75;
                if rng.f32() < END {
                    return None;
                }
                self.t *= 1.0 / (1.0 - END);
            }
        }
        let passed = flight.passed();
        self.t *= passed;
        self.r_u *= passed;
        self.r_l *= passed;
        Some(())
    }
}
