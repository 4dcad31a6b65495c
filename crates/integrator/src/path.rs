//! Path tracing (Kajiya 1986) with next-event estimation and multiple importance sampling (Veach and Guibas 1995).
//!
//! `L(o, d) = sum over paths of emission * product of (lobe cos / pdf)`: one random choice for everything at each bounce.
//! Direct light is estimated twice, by sampling a light and by sampling the lobe, and joined with the power heuristic.

use crate::numbers::{Domain, Numbers};
use crate::record::{self, Bounce, Contribution, RayKind, Record, Technique, Vertex};
use steradian_bsdf::{Lobe, Lobes, TransportMode};
use steradian_math::Ray;
use steradian_sampling::mis::power_weight;
use steradian_scene::{CameraRay, LightContext, Shading, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Path tracing up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// The greatest number of bounces.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce; biased.
    pub regularize: bool,
}

impl Path {
    /// The radiance that arrives along a camera ray.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        let mut ray = camera_ray.ray;
        let mut differential = camera_ray.differential;
        let mut radiance = Lanes::ZERO;
        // Throughput, squared relative index of refraction along the path, bounces so far.
        let mut beta = Lanes::ONE;
        let mut eta_scale = 1.0;
        let mut depth = 0;
        // The density of the last lobe sample, and the point it was taken at: what light sampling competes with there.
        let mut p_lobe = 0.0;
        let mut previous: Option<LightContext> = None;
        let mut any_non_specular = false;
        record.ray(RayKind::Camera);

        loop {
            // Find where the ray ends.
            let Some(hit) = record::intersect(world, &ray, record) else {
                self.add_environment(
                    world,
                    &ray,
                    wavelengths,
                    (beta, p_lobe, depth),
                    previous.as_ref(),
                    &mut radiance,
                    record,
                );
                break;
            };
            let mut surface = world.surface(&ray, &hit);

            // Add emission of the surface, weighted against light sampling at the previous vertex.
            if surface.is_emitter() {
                let emitted = world.emitted(&surface, wavelengths);
                if !emitted.is_black() {
                    let p_light = match (&previous, surface.light) {
                        (Some(c), Some(light)) => world.light_pdf(c, light, ray.d, Some(&surface)),
                        _ => 0.0,
                    };
                    let weight = if previous.is_some() { power_weight(p_lobe, p_light) } else { 1.0 };
                    let value = beta * emitted * weight;
                    radiance += value;
                    if R::DETAILED {
                        record.contribution(Contribution {
                            depth,
                            technique: Technique::Hit,
                            light: surface.light,
                            direction: ray.d,
                            end: Some(surface.p),
                            pdf: p_lobe,
                            other_pdf: p_light,
                            weight,
                            value,
                            occluded: false,
                        });
                    }
                }
            }
            if depth == self.max_depth {
                break;
            }

            // Evaluate the material; a surface without one is passed through.
            let Some(Shading { frame, mut bsdf }) =
                world.shading(&mut surface, &ray, differential.as_ref(), wavelengths)
            else {
                ray = surface.continue_ray(&ray);
                continue;
            };
            if self.regularize && any_non_specular {
                bsdf.regularize();
            }
            if R::DETAILED {
                record.vertex(Vertex {
                    depth,
                    p: surface.p,
                    n: frame.normal(),
                    material: world.material_name(&surface),
                    lobe: bsdf.name().to_owned(),
                    throughput: beta,
                });
            }
            depth += 1;

            // Sample a light.
            let wo = frame.to_local(-ray.d);
            let context = LightContext::of_surface(&surface, &frame);
            let (u_light, u_point) = (numbers.one(Domain::Light), numbers.two(Domain::Light));
            if bsdf.flags().is_non_specular()
                && let Some(sample) = world.sample_light(&context, u_light, u_point, wavelengths)
            {
                let wi = frame.to_local(sample.wi);
                let (f, p) = bsdf.eval_and_pdf(wo, wi, TransportMode::Radiance);
                let value = beta * f * sample.radiance;
                if !value.is_black() {
                    let weight = if sample.is_delta { 1.0 } else { power_weight(sample.pdf, p) };
                    let value = value * (weight / sample.pdf);
                    record.ray(RayKind::Shadow);
                    let occluded = record::occluded(world, &surface.shadow_ray(&sample), record);
                    if !occluded {
                        radiance += value;
                    }
                    if R::DETAILED {
                        record.contribution(Contribution {
                            depth,
                            technique: Technique::LightSampling,
                            light: Some(sample.light),
                            direction: sample.wi,
                            end: sample.distance.is_finite().then(|| surface.p + sample.wi * sample.distance),
                            pdf: sample.pdf,
                            other_pdf: if sample.is_delta { 0.0 } else { p },
                            weight,
                            value,
                            occluded,
                        });
                    }
                }
            }

            // Sample the lobe for the next direction.
            let (u_lobe, u_direction) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let Some(sample) = bsdf.sample(wo, u_lobe, u_direction, TransportMode::Radiance) else { break };
            beta *= sample.weight;
            let specular = sample.flags.contains(Lobes::SPECULAR);
            let transmission = sample.flags.contains(Lobes::TRANSMISSION);
            p_lobe =
                if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi, TransportMode::Radiance) } else { sample.pdf };
            previous = if specular { None } else { Some(context) };
            any_non_specular |= !specular;
            if transmission {
                eta_scale *= sample.eta * sample.eta;
            }
            let wi = frame.from_local(sample.wi);
            differential = differential.and_then(|d| surface.scattered_differential(&ray, &d, &frame, wi, &sample));
            ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);

            // End the path by Russian roulette where little is left; refraction's scaling of radiance is not a loss.
            let u_roulette = numbers.one(Domain::Other);
            let survival = if depth > 1 { (beta * eta_scale).max_component().min(1.0) } else { 1.0 };
            if R::DETAILED {
                record.bounce(Bounce {
                    direction: wi,
                    pdf: p_lobe,
                    weight: sample.weight,
                    specular,
                    transmission,
                    survival,
                });
            }
            if survival < 1.0 {
                if u_roulette >= survival {
                    break;
                }
                beta *= 1.0 / survival;
            }
        }
        record.path(depth);
        radiance
    }

    #[inline]
    fn add_environment<R: Record>(
        &self,
        world: &World,
        ray: &Ray,
        wavelengths: &Wavelengths,
        (beta, p_lobe, depth): (Lanes, f32, u32),
        previous: Option<&LightContext>,
        radiance: &mut Lanes,
        record: &mut R,
    ) {
        for &light in world.infinite_lights() {
            let emitted = world.environment(light, ray, wavelengths);
            if emitted.is_black() {
                continue;
            }
            let p_light = previous.map_or(0.0, |c| world.light_pdf(c, light, ray.d, None));
            let weight = if previous.is_some() { power_weight(p_lobe, p_light) } else { 1.0 };
            let value = beta * emitted * weight;
            *radiance += value;
            if R::DETAILED {
                record.contribution(Contribution {
                    depth,
                    technique: Technique::Hit,
                    light: Some(light),
                    direction: ray.d,
                    end: None,
                    pdf: p_lobe,
                    other_pdf: p_light,
                    weight,
                    value,
                    occluded: false,
                });
            }
        }
    }
}
