//! Ray tracing (Whitted, "An improved illumination model for shaded display", 1980): a tree of perfect reflections and
//! refractions, and a shadow ray from each hit to each light, taken as a point. No randomness at all.
//!
//! Rough metal and rough glass are lit by the points according to their lobe, and reflect and refract what is around as if
//! they were polished; the lamps seen that way are left out, for the points have counted them. Other lobes that are not
//! Dirac get an ambient term instead of the light between surfaces. How lamps become points:
//! [`World::light_points`]. Environments are seen, directly and in mirrors, and light nothing else.

use crate::record::{self, RayKind, Record};
use steradian_bsdf::{Bsdf, Conductor, Dielectric, Lobe, LobeSample, Lobes, Part, TransportMode, TrowbridgeReitz};
use steradian_math::{Ray, RayDifferential, Vec3};
use steradian_scene::{CameraRay, LightContext, Shading, Surface, World};
use steradian_spectrum::{Lanes, Wavelengths};

const MODE: TransportMode = TransportMode::Radiance;

/// Whitted's ray tracing.
#[derive(Clone, Copy, Debug)]
pub struct Whitted {
    /// The greatest number of bounces.
    pub max_depth: u32,
    /// Radiance from everywhere to everything that is not a mirror, in units of luminance.
    pub ambient: f32,
}

/// A ray of the tree.
struct Branch {
    ray: Ray,
    differential: Option<RayDifferential>,
    beta: Lanes,
    depth: u32,
    /// Whether lamps that have a point count when they are met.
    sees_lamps: bool,
}

impl Whitted {
    /// The radiance that arrives along a camera ray.
    pub fn radiance<R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        record: &mut R,
    ) -> Lanes {
        record.ray(RayKind::Camera);
        let mut radiance = Lanes::ZERO;
        let mut next = Some(Branch {
            ray: camera_ray.ray,
            differential: camera_ray.differential,
            beta: Lanes::ONE,
            depth: 0,
            sees_lamps: true,
        });
        // Branches yet to be followed: no more than one a level. Nothing is allocated until a ray splits.
        let mut waiting = Vec::new();
        while let Some(branch) = next {
            next = self.follow(branch, &mut waiting, &mut radiance, world, wavelengths, record);
            next = next.or_else(|| waiting.pop());
        }
        radiance
    }

    /// Adds what a ray meets; returns where it goes on, and leaves a second way with those waiting.
    fn follow<R: Record>(
        &self,
        mut branch: Branch,
        waiting: &mut Vec<Branch>,
        radiance: &mut Lanes,
        world: &World,
        wavelengths: &mut Wavelengths,
        record: &mut R,
    ) -> Option<Branch> {
        let (surface, shading) = loop {
            let Some(hit) = record::intersect(world, &branch.ray, record) else {
                for &light in world.infinite_lights() {
                    *radiance += branch.beta * world.environment(light, &branch.ray, wavelengths);
                }
                return None;
            };
            let mut surface = world.surface(&branch.ray, &hit);
            if surface.is_emitter() && (branch.sees_lamps || surface.light.is_none()) {
                *radiance += branch.beta * world.emitted(&surface, wavelengths);
            }
            if branch.depth == self.max_depth {
                return None;
            }
            match world.shading(&mut surface, &branch.ray, branch.differential.as_ref(), wavelengths) {
                Some(shading) => break (surface, shading),
                None => branch.ray = surface.continue_ray(&branch.ray),
            }
        };
        let Shading { frame, bsdf } = &shading;
        let wo = frame.to_local(-branch.ray.d);
        if bsdf.flags().is_non_specular() {
            *radiance += branch.beta * self.lit(world, &surface, &shading, wo, wavelengths, record);
        }
        let is_dirac = bsdf.flags().is_specular();
        let mut on = |sample: LobeSample| {
            // The density of a Dirac sample is its probability: the product is the share of the light.
            let beta = branch.beta * sample.weight * sample.pdf;
            if beta.is_black() {
                return None;
            }
            record.ray(RayKind::Scattered);
            let wi = frame.from_local(sample.wi);
            let differential =
                branch.differential.and_then(|d| surface.scattered_differential(&branch.ray, &d, frame, wi, &sample));
            Some(Branch {
                ray: surface.spawn_ray(wi),
                differential,
                beta,
                depth: branch.depth + 1,
                sees_lamps: is_dirac,
            })
        };
        let [first, second] = mirror_directions(bsdf, wo).map(|sample| sample.and_then(&mut on));
        match (first, second) {
            (Some(first), Some(second)) => {
                waiting.push(second);
                Some(first)
            }
            (first, second) => first.or(second),
        }
    }

    /// The light of all points and of the surroundings that the lobe sends to the viewer.
    fn lit<R: Record>(
        &self,
        world: &World,
        surface: &Surface,
        shading: &Shading,
        wo: Vec3,
        wavelengths: &Wavelengths,
        record: &mut R,
    ) -> Lanes {
        let Shading { frame, bsdf } = shading;
        let context = LightContext::of_surface(surface, frame);
        let mut sum = Lanes::ZERO;
        if self.ambient > 0.0 && !matches!(bsdf, Bsdf::Conductor(_) | Bsdf::Dielectric(_)) {
            sum += bsdf.albedo(wo) * world.white(wavelengths) * self.ambient;
        }
        for point in world.light_points() {
            let Some(sample) = world.sample_light_point(&context, point, wavelengths) else { continue };
            let value = bsdf.eval_cos(wo, frame.to_local(sample.wi), MODE) * sample.radiance;
            if !value.is_black() {
                record.ray(RayKind::Shadow);
                // A lamp casts no shadow of its own, and its point may be inside it.
                let ray = surface.shadow_ray(&sample);
                if record::intersect(world, &ray, record).is_none_or(|hit| world.is_light_point(&ray, &hit, point)) {
                    sum += value;
                }
            }
        }
        for light in world.delta_lights() {
            let Some(sample) = world.sample_one_light(&context, light, [0.5; 2], wavelengths) else { continue };
            let value = bsdf.eval_cos(wo, frame.to_local(sample.wi), MODE) * sample.radiance;
            if !value.is_black() {
                record.ray(RayKind::Shadow);
                if !record::occluded(world, &surface.shadow_ray(&sample), record) {
                    sum += value;
                }
            }
        }
        sum
    }
}

/// The perfect reflection and the perfect refraction of a lobe, where it has them.
fn mirror_directions(bsdf: &Bsdf, wo: Vec3) -> [Option<LobeSample>; 2] {
    let polished = match bsdf {
        Bsdf::Conductor(c) => Bsdf::Conductor(Conductor { distribution: TrowbridgeReitz::smooth().into(), ..*c }),
        Bsdf::Dielectric(d) => Bsdf::Dielectric(Dielectric { distribution: TrowbridgeReitz::smooth().into(), ..*d }),
        other => *other,
    };
    if !polished.flags().is_specular() {
        return [None; 2];
    }
    // A coat of varnish reflects for the least number; what passes it would wander at random, and is left to `eval`.
    [Part::Reflection, Part::Transmission].map(|part| {
        let wanted = if part == Part::Reflection { Lobes::REFLECTION } else { Lobes::TRANSMISSION };
        let sample = polished.sample_part(wo, 0.0, [0.5; 2], MODE, part)?;
        sample.flags.contains(Lobes::SPECULAR.union(wanted)).then_some(sample)
    })
}
