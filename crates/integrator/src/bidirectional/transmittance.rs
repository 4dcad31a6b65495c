//! What gets through from one vertex to another: surfaces that only separate media are passed, others block.

use crate::hero::Hero;
use crate::record::{self, RayKind, Record};
use steradian_math::{Point3, Ray};
use steradian_sampling::rng::{Rng, hash_floats, mix_bits};
use steradian_scene::{FreeFlight, Handle, Medium, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Transmittance over the density of the hero's lane, and the densities of all lanes over the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passed {
    pub t: Lanes,
    pub ratios: Lanes,
}

impl Passed {
    const ALL: Self = Self { t: Lanes::ONE, ratios: Lanes::ONE };

    /// Estimates by ratio tracking (Novák et al. 2014) what gets through one medium more; `None` if roulette ends it.
    fn track(&mut self, mut flight: FreeFlight<'_>, hero: Hero, w: &Wavelengths, rng: &mut Rng) -> Option<()> {
        while let Some(c) = flight.next(rng.f32()) {
            let per_majorant = c.transmittance * (1.0 / c.majorant[hero.lane]);
            self.t *= per_majorant * c.sigma_n();
            self.ratios *= per_majorant * c.majorant;
            // Russian roulette where little is left.
            let left = self.t * (1.0 / hero.average(self.ratios, w));
            if left.max_component() < 0.05 {
                const END: f32 = 0.75;
                if rng.f32() < END {
                    return None;
                }
                self.t *= 1.0 / (1.0 - END);
            }
        }
        let passed = flight.passed();
        self.t *= passed;
        self.ratios *= passed;
        Some(())
    }
}

/// What gets along `ray`, which ends at the parameter 1 or never, or an estimate of it. `None` if something is in the way.
/// `target` is where the ray leads, to go on there behind each boundary; `seed` makes estimates random.
pub(crate) fn transmittance<R: Record>(
    world: &World,
    mut ray: Ray,
    target: Option<Point3>,
    mut medium: Option<Handle<Medium>>,
    (hero, w): (Hero, &Wavelengths),
    seed: f32,
    record: &mut R,
) -> Option<Passed> {
    record.ray(RayKind::Shadow);
    if !world.has_media() && !world.has_interfaces() {
        return (!record::occluded(world, &ray, record)).then_some(Passed::ALL);
    }
    let mut out = Passed::ALL;
    let (o, d) = (ray.o, ray.d);
    let words = hash_floats(&[o.x, o.y, o.z, d.x, d.y, d.z, seed]);
    let mut rng = Rng::new(words, mix_bits(words));
    loop {
        let hit = record::intersect(world, &ray, record);
        if hit.is_some_and(|h| !world.is_interface(&h)) {
            return None;
        }
        if let Some(m) = medium {
            let length = ray.d.length();
            let t_max = hit.map_or(ray.whole_way(), |h| h.t) * length;
            let along = world.medium_ray(m, ray.o, ray.d * (1.0 / length), w);
            match along.transmittance(t_max) {
                Some(t) => out.t *= t,
                None => out.track(along.fly(t_max, hero.lane), hero, w, &mut rng)?,
            }
        }
        let Some(hit) = hit else { return Some(out) };
        let surface = world.surface(&ray, &hit);
        medium = world.medium_beyond(&surface, ray.d, medium);
        let next = surface.continue_ray(&ray);
        ray = match target {
            Some(p) if (p - next.o).dot(ray.d) <= 0.0 => return Some(out),
            Some(p) => Ray::between(next.o, p, next.time),
            None => next,
        };
    }
}
