//! Path tracing (Kajiya 1986) with next-event estimation and multiple importance sampling (Veach and Guibas 1995).
//!
//! `L(o, d) = sum over paths of emission * product of (lobe cos / pdf)`: one random choice for everything at each bounce.
//! Direct light is estimated twice, by sampling a light and by sampling the lobe, and joined with the power heuristic.

use crate::numbers::{Domain, Numbers};
use crate::record::{self, Bounce, Contribution, RayKind, Record, Technique, Vertex};
use crate::subsurface;
use std::ops::ControlFlow;
use steradian_bsdf::{Bsdf, Lobe, Lobes, TransportMode};
use steradian_math::{Frame, Ray, RayDifferential, Vec3};
use steradian_sampling::mis::power_weight;
use steradian_scene::{CameraRay, Hit, LightContext, Shading, Surface, Techniques, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Path tracing up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// The greatest number of bounces.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce; biased.
    pub regularize: bool,
    /// Whether the camera sees through lamps and past the sky.
    pub hide_lights: bool,
}

/// How far a path has come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Walk {
    /// Where it goes on.
    pub ray: Ray,
    /// The neighbours of that ray, where textures care.
    pub differential: Option<RayDifferential>,
    /// Light found so far.
    pub radiance: Lanes,
    /// Throughput.
    pub beta: Lanes,
    /// Squared relative index of refraction along the path.
    pub eta_scale: f32,
    /// Bounces so far.
    pub depth: u32,
    /// The density of the last lobe sample.
    pub p_lobe: f32,
    /// The point that it was taken at: what light sampling competes with there. `None` after a Dirac lobe.
    pub previous: Option<LightContext>,
    /// Whether any lobe was not Dirac.
    pub any_non_specular: bool,
}

impl Walk {
    /// At the camera.
    #[inline]
    pub fn new(camera_ray: &CameraRay) -> Self {
        Self {
            ray: camera_ray.ray,
            differential: camera_ray.differential,
            radiance: Lanes::ZERO,
            beta: Lanes::ONE,
            eta_scale: 1.0,
            depth: 0,
            p_lobe: 0.0,
            previous: None,
            any_non_specular: false,
        }
    }
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
        let mut walk = Walk::new(camera_ray);
        record.ray(RayKind::Camera);
        loop {
            // Find where the ray ends.
            let Some(hit) = record::intersect(world, &walk.ray, record) else {
                self.escape(world, &mut walk, wavelengths, record);
                break;
            };
            if self.bounce(world, &hit, &mut walk, wavelengths, numbers, record).is_break() {
                break;
            }
        }
        record.path(walk.depth);
        walk.radiance
    }

    /// Adds what is emitted where a path has arrived, and scatters it there. `Break` if it ends.
    #[inline(always)]
    pub(crate) fn bounce<N: Numbers, R: Record>(
        &self,
        world: &World,
        hit: &Hit,
        walk: &mut Walk,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> ControlFlow<()> {
        let Walk { ray, differential, radiance, beta, eta_scale, depth, p_lobe, previous, any_non_specular } = walk;
        let mut surface = world.surface(ray, hit);
        if self.hide_lights && *depth == 0 && surface.light.is_some() {
            *ray = surface.continue_ray(ray);
            return ControlFlow::Continue(());
        }

        // Add emission of the surface, weighted against light sampling at the previous vertex.
        if surface.is_emitter() {
            let emitted = world.emitted(&surface, wavelengths);
            if !emitted.is_black() {
                let p_light = match (&*previous, surface.light) {
                    (Some(c), Some(light)) => world.light_pdf(c, light, ray.d, Some(&surface)),
                    _ => 0.0,
                };
                let weight = if previous.is_some() { power_weight(*p_lobe, p_light) } else { 1.0 };
                let value = *beta * emitted * weight;
                *radiance += value;
                if R::LIGHT {
                    record.contribution(Contribution {
                        depth: *depth,
                        technique: Technique::Hit,
                        light: surface.light,
                        direction: ray.d,
                        end: Some(surface.p),
                        pdf: *p_lobe,
                        other_pdf: p_light,
                        weight,
                        value,
                        occluded: false,
                    });
                }
            }
        }
        if *depth == self.max_depth {
            return ControlFlow::Break(());
        }

        // Evaluate the material; a surface without one is passed through.
        let Some(Shading { frame, mut bsdf }) = world.shading(&mut surface, ray, differential.as_ref(), wavelengths)
        else {
            *ray = surface.continue_ray(ray);
            return ControlFlow::Continue(());
        };
        if self.regularize && *any_non_specular {
            bsdf.regularize();
        }
        if R::DETAILED {
            record.vertex(Vertex::on(world, *depth, (&surface, &frame), &bsdf, *beta));
        }
        *depth += 1;

        // Sample a light.
        let wo = frame.to_local(-ray.d);
        let context = LightContext::of_surface(&surface, &frame).beside_lobes();
        let vertex = PathVertex { surface: &surface, frame: &frame, bsdf: &bsdf, wo, context: &context };
        add_light(world, &vertex, wavelengths, (*beta, *depth), numbers, radiance, record);

        // Sample the lobe for the next direction.
        let (u_lobe, u_direction) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
        let Some(sample) = bsdf.sample(wo, u_lobe, u_direction, TransportMode::Radiance) else {
            return ControlFlow::Break(());
        };
        *beta *= sample.weight;
        let mut specular = sample.flags.contains(Lobes::SPECULAR);
        let mut transmission = sample.flags.contains(Lobes::TRANSMISSION);
        *p_lobe =
            if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi, TransportMode::Radiance) } else { sample.pdf };
        *previous = if specular { None } else { Some(context) };
        *any_non_specular |= !specular;
        if transmission {
            *eta_scale *= sample.eta * sample.eta;
        }
        let mut wi = frame.from_local(sample.wi);
        let mut weight = sample.weight;
        *differential = differential.and_then(|d| surface.scattered_differential(ray, &d, &frame, wi, &sample));
        *ray = surface.spawn_ray(wi);
        record.ray(RayKind::Scattered);

        // What goes into something translucent comes out elsewhere, and goes on from there.
        if transmission
            && world.has_subsurface()
            && let Some(inside) = world.subsurface(&surface, wavelengths)
        {
            let Some(exit) = subsurface::exit(world, (&surface, &frame), &inside, wavelengths, numbers, record) else {
                return ControlFlow::Break(());
            };
            if R::DETAILED {
                record.bounce(Bounce { direction: wi, pdf: *p_lobe, weight, specular, transmission, survival: 1.0 });
                record.vertex(Vertex::on(world, *depth, (&exit.surface, &exit.frame), &exit.bsdf, *beta * exit.weight));
            }
            *beta *= exit.weight;
            let context = LightContext::of_surface(&exit.surface, &exit.frame).beside_lobes();
            let vertex = PathVertex {
                surface: &exit.surface,
                frame: &exit.frame,
                bsdf: &exit.bsdf,
                wo: exit.frame.to_local(exit.surface.wo),
                context: &context,
            };
            add_light(world, &vertex, wavelengths, (*beta, *depth), numbers, radiance, record);
            let (u_lobe, u_direction) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let Some(out) = exit.bsdf.sample(vertex.wo, u_lobe, u_direction, TransportMode::Radiance) else {
                return ControlFlow::Break(());
            };
            *beta *= out.weight;
            // Coming out undoes the scaling of radiance by going in.
            *eta_scale /= sample.eta * sample.eta;
            (*p_lobe, *previous, *any_non_specular) = (out.pdf, Some(context), true);
            (specular, transmission, weight, *differential) = (false, false, out.weight, None);
            wi = exit.frame.from_local(out.wi);
            *ray = exit.surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);
        }

        // End the path by Russian roulette where little is left; refraction's scaling of radiance is not a loss.
        let u_roulette = numbers.one(Domain::Other);
        let left = (*beta * *eta_scale).max_component() / Techniques::ROULETTE;
        let survival = if *depth > 1 { left.min(1.0) } else { 1.0 };
        if R::DETAILED {
            record.bounce(Bounce { direction: wi, pdf: *p_lobe, weight, specular, transmission, survival });
        }
        if survival < 1.0 {
            if u_roulette >= survival {
                return ControlFlow::Break(());
            }
            *beta *= 1.0 / survival;
        }
        ControlFlow::Continue(())
    }

    /// Adds the light of infinite lights to a path that leaves the scene.
    #[inline]
    pub(crate) fn escape<R: Record>(&self, world: &World, walk: &mut Walk, wavelengths: &Wavelengths, record: &mut R) {
        for &light in world.infinite_lights() {
            self.see(world, walk, light, wavelengths, record);
        }
    }

    /// Adds the light of one of them.
    #[inline]
    pub(crate) fn see<R: Record>(
        &self,
        world: &World,
        walk: &mut Walk,
        light: u32,
        wavelengths: &Wavelengths,
        record: &mut R,
    ) {
        let d = walk.ray.d;
        let emitted = world.environment(light, &walk.ray, wavelengths);
        self.add_sky(walk, light, emitted, |c| world.light_pdf(c, light, d, None), record);
    }

    /// Adds what an infinite light emits against the ray, weighted against light sampling with density `p_light` at the previous vertex.
    #[inline]
    pub(crate) fn add_sky<R: Record>(
        &self,
        walk: &mut Walk,
        light: u32,
        emitted: Lanes,
        p_light: impl FnOnce(&LightContext) -> f32,
        record: &mut R,
    ) {
        if emitted.is_black() || (self.hide_lights && walk.depth == 0) {
            return;
        }
        let p_light = walk.previous.as_ref().map_or(0.0, p_light);
        let weight = if walk.previous.is_some() { power_weight(walk.p_lobe, p_light) } else { 1.0 };
        let value = walk.beta * emitted * weight;
        walk.radiance += value;
        if R::LIGHT {
            record.contribution(Contribution {
                depth: walk.depth,
                technique: Technique::Hit,
                light: Some(light),
                direction: walk.ray.d,
                end: None,
                pdf: walk.p_lobe,
                other_pdf: p_light,
                weight,
                value,
                occluded: false,
            });
        }
    }
}

/// A point where a path scatters.
struct PathVertex<'a> {
    surface: &'a Surface,
    frame: &'a Frame,
    bsdf: &'a Bsdf<'a>,
    wo: Vec3,
    context: &'a LightContext,
}

/// Adds the light of one sampled light, weighted against finding it by the lobe.
#[inline]
fn add_light<N: Numbers, R: Record>(
    world: &World,
    vertex: &PathVertex<'_>,
    wavelengths: &Wavelengths,
    (beta, depth): (Lanes, u32),
    numbers: &mut N,
    radiance: &mut Lanes,
    record: &mut R,
) {
    let (u_light, u_point) = (numbers.one(Domain::Light), numbers.two(Domain::Light));
    if !vertex.bsdf.flags().is_non_specular() {
        return;
    }
    let Some(sample) = world.sample_light(vertex.context, u_light, u_point, wavelengths) else { return };
    let wi = vertex.frame.to_local(sample.wi);
    let (f, p) = vertex.bsdf.eval_and_pdf(vertex.wo, wi, TransportMode::Radiance);
    let value = beta * f * sample.radiance;
    if value.is_black() {
        return;
    }
    let weight = if sample.is_delta { 1.0 } else { power_weight(sample.pdf, p) };
    let value = value * (weight / sample.pdf);
    record.ray(RayKind::Shadow);
    let occluded = record::occluded(world, &vertex.surface.shadow_ray(&sample), record);
    if !occluded {
        *radiance += value;
    }
    if R::LIGHT {
        record.contribution(Contribution {
            depth,
            technique: Technique::LightSampling,
            light: Some(sample.light),
            direction: sample.wi,
            end: sample.distance.is_finite().then(|| vertex.surface.p + sample.wi * sample.distance),
            pdf: sample.pdf,
            other_pdf: if sample.is_delta { 0.0 } else { p },
            weight,
            value,
            occluded,
        });
    }
}
