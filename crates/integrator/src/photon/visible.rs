//! From a pixel to the point where photons are gathered.

use super::{PhotonMap, Sppm};
use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use steradian_bsdf::{Bsdf, Lobe, Lobes, TransportMode};
use steradian_math::{Frame, Ray};
use steradian_sampling::mis::power_weight;
use steradian_scene::{CameraRay, LightContext, Shading, Surface, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// What a path from the camera carries.
struct Walk {
    ray: Ray,
    beta: Lanes,
    depth: u32,
    /// The density of the last direction, and the point it was taken at, unless it was Dirac.
    p_lobe: f32,
    previous: Option<LightContext>,
}

impl Walk {
    /// The weight of light that the lobe has found, which light sampling finds with a density of its own.
    fn weight(&self, p_light: impl FnOnce(&LightContext) -> f32) -> f32 {
        self.previous.as_ref().map_or(1.0, |c| power_weight(self.p_lobe, p_light(c)))
    }
}

impl Sppm {
    /// The radiance that arrives along a camera ray, with the photons of an iteration.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        w: &mut Wavelengths,
        map: &PhotonMap,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        let mut differential = camera_ray.differential;
        let mut radiance = Lanes::ZERO;
        let mut walk = Walk { ray: camera_ray.ray, beta: Lanes::ONE, depth: 0, p_lobe: 0.0, previous: None };
        record.ray(RayKind::Camera);
        loop {
            // Find where the ray ends, and add what shines there.
            let Some(hit) = record::intersect(world, &walk.ray, record) else {
                for &light in world.infinite_lights() {
                    let weight = walk.weight(|c| world.light_pdf(c, light, walk.ray.d, None));
                    radiance += walk.beta * world.environment(light, &walk.ray, w) * weight;
                }
                break;
            };
            let mut surface = world.surface(&walk.ray, &hit);
            if surface.is_emitter() {
                let pdf = |c: &LightContext| {
                    surface.light.map_or(0.0, |light| world.light_pdf(c, light, walk.ray.d, Some(&surface)))
                };
                radiance += walk.beta * world.emitted(&surface, w) * walk.weight(pdf);
            }
            if walk.depth == self.max_depth {
                break;
            }
            let shading = world.shading(&mut surface, &walk.ray, differential.as_ref(), w);
            let Some(Shading { frame, bsdf }) = shading else {
                walk.ray = surface.continue_ray(&walk.ray);
                continue;
            };
            walk.depth += 1;

            // Sample a light. Where the path ends light sampling is all there is.
            let flags = bsdf.flags();
            let gathers = flags.is_diffuse();
            let context = LightContext::of_surface(&surface, &frame);
            radiance += walk.beta * direct(world, (&surface, &frame, &bsdf), &context, gathers, w, numbers, record);

            // Where a Dirac lobe lies over a diffuse one, chance says which is seen to.
            let wo = frame.to_local(surface.wo);
            let mixed = gathers && flags.is_specular();
            let follows = !gathers || (mixed && numbers.one(Domain::Lobe) < 0.5);
            if mixed {
                walk.beta *= 2.0;
            }
            if !follows {
                radiance += walk.beta * self.gather(map, (&surface, &frame, &bsdf), walk.depth, w);
                break;
            }
            let (u_lobe, u) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance) else { break };
            let specular = sample.flags.contains(Lobes::SPECULAR);
            if mixed && !specular {
                break;
            }
            walk.beta *= sample.weight;
            walk.p_lobe =
                if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi, TransportMode::Radiance) } else { sample.pdf };
            walk.previous = (!specular).then_some(context);
            let wi = frame.from_local(sample.wi);
            differential =
                differential.and_then(|d| surface.scattered_differential(&walk.ray, &d, &frame, wi, &sample));
            walk.ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);
        }
        record.path(walk.depth);
        radiance
    }

    /// The light that photons near a point bring.
    fn gather(
        &self,
        map: &PhotonMap,
        (surface, frame, bsdf): (&Surface, &Frame, &Bsdf<'_>),
        depth: u32,
        w: &Wavelengths,
    ) -> Lanes {
        let wo = frame.to_local(surface.wo);
        let (hero, dispersed) = (w.hero_lane(), w.secondary_terminated());
        let mut sum = Lanes::ZERO;
        map.grid.within(surface.p, |photon| {
            // A flux arrives on an area of the true surface, whatever the shading normal.
            let cos = surface.n.abs_dot(photon.wi);
            if photon.depth + depth > self.max_depth || cos == 0.0 {
                return;
            }
            let f = bsdf.eval_cos(wo, frame.to_local(photon.wi), TransportMode::Radiance) * (1.0 / cos);
            let mut flux = photon.flux;
            if photon.is_single && !dispersed {
                // What is left of a dispersed photon stands for all four wavelengths.
                flux = Lanes::ZERO;
                flux[hero] = photon.flux[hero] * Lanes::COUNT as f32;
            }
            sum += f * flux;
        });
        sum * map.scale
    }
}

/// The light of one sampled light, weighted against finding it by the lobe unless it is found in no other way.
fn direct<N: Numbers, R: Record>(
    world: &World,
    (surface, frame, bsdf): (&Surface, &Frame, &Bsdf<'_>),
    context: &LightContext,
    alone: bool,
    w: &Wavelengths,
    numbers: &mut N,
    record: &mut R,
) -> Lanes {
    let (u_light, u_point) = (numbers.one(Domain::Light), numbers.two(Domain::Light));
    if !bsdf.flags().is_non_specular() {
        return Lanes::ZERO;
    }
    let Some(s) = world.sample_light(context, u_light, u_point, w) else { return Lanes::ZERO };
    let (f, p) = bsdf.eval_and_pdf(frame.to_local(surface.wo), frame.to_local(s.wi), TransportMode::Radiance);
    let weight = if alone || s.is_delta { 1.0 } else { power_weight(s.pdf, p) };
    let value = f * s.radiance * (weight / s.pdf);
    if value.is_black() {
        return Lanes::ZERO;
    }
    record.ray(RayKind::Shadow);
    if record::occluded(world, &surface.shadow_ray(&s), record) { Lanes::ZERO } else { value }
}
