//! Path tracing (Kajiya 1986) with every technique of the lecture as a switch: light sampling, importance sampling,
//! multiple importance sampling (Veach and Guibas 1995), Russian roulette and splitting (Arvo and Kirk 1990).
//!
//! Slower than [`Path`](crate::Path), which does what the default of the switches says; with that default both give the
//! same bits.

use crate::lobe_sampling;
use crate::numbers::{Domain, Numbers};
use crate::record::{self, Bounce, Contribution, RayKind, Record, Technique, Vertex};
use crate::subsurface::{self, Exit};
use steradian_bsdf::{Bsdf, Lobe, Lobes};
use steradian_math::{Ray, RayDifferential, Vec3};
use steradian_sampling::mis::{balance_heuristic, power_heuristic};
use steradian_scene::{CameraRay, LightContext, MisHeuristic, Shading, Surface, Techniques, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Path tracing by choice of technique.
#[derive(Clone, Copy, Debug)]
pub struct SwitchedPath {
    /// The greatest number of bounces.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce; biased.
    pub regularize: bool,
    /// The switches.
    pub techniques: Techniques,
}

/// A path on its way to the next hit.
#[derive(Clone, Copy)]
struct Walk {
    ray: Ray,
    differential: Option<RayDifferential>,
    beta: Lanes,
    /// Squared relative index of refraction along the path.
    eta_scale: f32,
    depth: u32,
    /// The density of the last lobe sample, and how many were taken there.
    p_lobe: f32,
    lobe_samples: f32,
    /// Where the last lobe sample was taken, if light sampling competes with it.
    previous: Option<LightContext>,
    any_non_specular: bool,
}

/// A point where the path scatters.
struct Here<'a> {
    surface: &'a Surface,
    shading: &'a Shading<'a>,
    context: LightContext,
    wo: Vec3,
}

impl SwitchedPath {
    /// The radiance that arrives along a camera ray.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        record.ray(RayKind::Camera);
        let walk = Walk {
            ray: camera_ray.ray,
            differential: camera_ray.differential,
            beta: Lanes::ONE,
            eta_scale: 1.0,
            depth: 0,
            p_lobe: 0.0,
            lobe_samples: 1.0,
            previous: None,
            any_non_specular: false,
        };
        let mut radiance = Lanes::ZERO;
        self.follow(walk, &mut radiance, world, wavelengths, numbers, record);
        radiance
    }

    /// Follows a path to its end. A path that splits is followed by its parts; that happens once.
    fn follow<N: Numbers, R: Record>(
        &self,
        mut walk: Walk,
        radiance: &mut Lanes,
        world: &World,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) {
        loop {
            let Some(hit) = record::intersect(world, &walk.ray, record) else {
                for &light in world.infinite_lights() {
                    let emitted = world.environment(light, &walk.ray, wavelengths);
                    self.add_hit(&walk, emitted, Some(light), None, radiance, world, record);
                }
                record.path(walk.depth);
                return;
            };
            let mut surface = world.surface(&walk.ray, &hit);
            if surface.is_emitter() {
                let emitted = world.emitted(&surface, wavelengths);
                self.add_hit(&walk, emitted, surface.light, Some(&surface), radiance, world, record);
            }
            if walk.depth == self.max_depth {
                record.path(walk.depth);
                return;
            }
            let Some(mut shading) = world.shading(&mut surface, &walk.ray, walk.differential.as_ref(), wavelengths)
            else {
                walk.ray = surface.continue_ray(&walk.ray);
                continue;
            };
            if self.regularize && walk.any_non_specular {
                shading.bsdf.regularize();
            }
            if R::DETAILED {
                record.vertex(Vertex::on(world, walk.depth, (&surface, &shading.frame), &shading.bsdf, walk.beta));
            }
            walk.depth += 1;
            let here = self.vertex(&surface, &shading, shading.frame.to_local(-walk.ray.d));
            let spread = shading.bsdf.flags().is_non_specular();
            let parts = if walk.depth == 1 && spread { self.techniques.split } else { 1 };
            if self.techniques.light_sampling {
                self.add_light(&walk, &here, parts as f32, radiance, world, wavelengths, numbers, record);
            }
            if parts == 1 {
                match self.scatter(&walk, &here, 1.0, radiance, world, wavelengths, numbers, record) {
                    Some(next) => walk = next,
                    None => {
                        record.path(walk.depth);
                        return;
                    }
                }
            } else {
                for _ in 0..parts {
                    let next = self.scatter(&walk, &here, parts as f32, radiance, world, wavelengths, numbers, record);
                    if let Some(next) = next {
                        self.follow(next, radiance, world, wavelengths, numbers, record);
                    } else {
                        record.path(walk.depth);
                    }
                }
                return;
            }
        }
    }

    /// Adds what a ray ran into, weighted against finding it by light sampling from where the ray came.
    fn add_hit<R: Record>(
        &self,
        walk: &Walk,
        emitted: Lanes,
        light: Option<u32>,
        surface: Option<&Surface>,
        radiance: &mut Lanes,
        world: &World,
        record: &mut R,
    ) {
        if emitted.is_black() {
            return;
        }
        let p_light = match (&walk.previous, light) {
            (Some(context), Some(light)) => world.light_pdf(context, light, walk.ray.d, surface),
            _ => 0.0,
        };
        let weight = match (&walk.previous, self.techniques.mis) {
            (None, _) => 1.0,
            // What light sampling cannot find is left to the lobe.
            (Some(_), MisHeuristic::None) => f32::from(p_light == 0.0),
            (Some(_), MisHeuristic::Balance) => balance_heuristic(walk.lobe_samples, walk.p_lobe, 1.0, p_light),
            (Some(_), MisHeuristic::Power) => power_heuristic(walk.lobe_samples, walk.p_lobe, 1.0, p_light),
        };
        let value = walk.beta * emitted * weight;
        *radiance += value;
        if R::LIGHT {
            record.contribution(Contribution {
                depth: walk.depth,
                technique: Technique::Hit,
                light,
                direction: walk.ray.d,
                end: surface.map(|s| s.p),
                pdf: walk.p_lobe,
                other_pdf: p_light,
                weight,
                value,
                occluded: false,
            });
        }
    }

    /// Adds the light of one sampled light, weighted against running into it by one of `lobe_samples` lobe samples.
    fn add_light<N: Numbers, R: Record>(
        &self,
        walk: &Walk,
        here: &Here<'_>,
        lobe_samples: f32,
        radiance: &mut Lanes,
        world: &World,
        wavelengths: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) {
        let (u_light, u_point) = (numbers.one(Domain::Light), numbers.two(Domain::Light));
        let Shading { frame, bsdf } = here.shading;
        if !bsdf.flags().is_non_specular() {
            return;
        }
        let Some(sample) = world.sample_light(&here.context, u_light, u_point, wavelengths) else { return };
        let (f, p) = self.eval_and_pdf(bsdf, here.wo, frame.to_local(sample.wi));
        let value = walk.beta * f * sample.radiance;
        if value.is_black() {
            return;
        }
        let weight = match self.techniques.mis {
            _ if sample.is_delta => 1.0,
            MisHeuristic::None => 1.0,
            MisHeuristic::Balance => balance_heuristic(1.0, sample.pdf, lobe_samples, p),
            MisHeuristic::Power => power_heuristic(1.0, sample.pdf, lobe_samples, p),
        };
        let value = value * (weight / sample.pdf);
        record.ray(RayKind::Shadow);
        let occluded = record::occluded(world, &here.surface.shadow_ray(&sample), record);
        if !occluded {
            *radiance += value;
        }
        if R::LIGHT {
            record.contribution(Contribution {
                depth: walk.depth,
                technique: Technique::LightSampling,
                light: Some(sample.light),
                direction: sample.wi,
                end: sample.distance.is_finite().then(|| here.surface.p + sample.wi * sample.distance),
                pdf: sample.pdf,
                other_pdf: if sample.is_delta { 0.0 } else { p },
                weight,
                value,
                occluded,
            });
        }
    }

    fn eval_and_pdf(&self, bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> (Lanes, f32) {
        lobe_sampling::eval_and_pdf(self.techniques.lobe_sampling, bsdf, wo, wi)
    }

    fn vertex<'a>(&self, surface: &'a Surface, shading: &'a Shading<'a>, wo: Vec3) -> Here<'a> {
        let context = LightContext::of_surface(surface, &shading.frame);
        // Without weights between them, light sampling must find all there is.
        let weighted = self.techniques.mis != MisHeuristic::None;
        Here { surface, shading, context: if weighted { context.beside_lobes() } else { context }, wo }
    }

    /// One of `parts` continuations of the path; `None` if it ends here. Light that goes in and comes out elsewhere is added
    /// there.
    fn scatter<N: Numbers, R: Record>(
        &self,
        walk: &Walk,
        here: &Here<'_>,
        parts: f32,
        radiance: &mut Lanes,
        world: &World,
        wavelengths: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Option<Walk> {
        let (mut next, mut bounce) = self.draw(walk, here, parts, numbers, record)?;
        // What goes into something translucent comes out elsewhere, and goes on from there.
        if bounce.transmission
            && world.has_subsurface()
            && let Some(inside) = world.subsurface(here.surface, wavelengths)
        {
            let at = (here.surface, &here.shading.frame);
            let Exit { surface, frame, bsdf, weight } =
                subsurface::exit(world, at, &inside, wavelengths, numbers, record)?;
            next.beta *= weight;
            if R::DETAILED {
                record.bounce(bounce);
                record.vertex(Vertex::on(world, walk.depth, (&surface, &frame), &bsdf, next.beta));
            }
            let shading = Shading { frame, bsdf };
            let there = self.vertex(&surface, &shading, shading.frame.to_local(surface.wo));
            if self.techniques.light_sampling {
                self.add_light(&next, &there, 1.0, radiance, world, wavelengths, numbers, record);
            }
            next.differential = None;
            // Coming out undoes the scaling of radiance by going in.
            next.eta_scale = walk.eta_scale;
            (next, bounce) = self.draw(&next, &there, 1.0, numbers, record)?;
        }
        let u_roulette = numbers.one(Domain::Other);
        bounce.survival = match self.techniques.roulette {
            Some(threshold) if next.depth > 1 => ((next.beta * next.eta_scale).max_component() / threshold).min(1.0),
            _ => 1.0,
        };
        if R::DETAILED {
            record.bounce(bounce);
        }
        if bounce.survival < 1.0 {
            if u_roulette >= bounce.survival {
                return None;
            }
            next.beta *= 1.0 / bounce.survival;
        }
        Some(next)
    }

    /// One of `parts` directions from a vertex.
    fn draw<N: Numbers, R: Record>(
        &self,
        walk: &Walk,
        here: &Here<'_>,
        parts: f32,
        numbers: &mut N,
        record: &mut R,
    ) -> Option<(Walk, Bounce)> {
        let (u_lobe, u_direction) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
        let Shading { frame, bsdf } = here.shading;
        let sample = lobe_sampling::sample(self.techniques.lobe_sampling, bsdf, here.wo, u_lobe, u_direction)?;
        let specular = sample.flags.contains(Lobes::SPECULAR);
        let transmission = sample.flags.contains(Lobes::TRANSMISSION);
        let wi = frame.from_local(sample.wi);
        let differential =
            walk.differential.and_then(|d| here.surface.scattered_differential(&walk.ray, &d, frame, wi, &sample));
        let weight = if parts == 1.0 { sample.weight } else { sample.weight * (1.0 / parts) };
        record.ray(RayKind::Scattered);
        let next = Walk {
            ray: here.surface.spawn_ray(wi),
            differential,
            beta: walk.beta * weight,
            eta_scale: if transmission { walk.eta_scale * (sample.eta * sample.eta) } else { walk.eta_scale },
            depth: walk.depth,
            p_lobe: sample.pdf,
            lobe_samples: parts,
            previous: (self.techniques.light_sampling && !specular).then_some(here.context),
            any_non_specular: walk.any_non_specular || !specular,
        };
        Some((next, Bounce { direction: wi, pdf: sample.pdf, weight, specular, transmission, survival: 1.0 }))
    }
}
