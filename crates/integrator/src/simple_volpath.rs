//! A random walk through participating media, as one photon of one wavelength would make it (PBRT 4th ed., 14.2.1).
//!
//! Delta tracking without next-event estimation: noisy, but so simple that other estimators are judged by it. Lights
//! without extent are never found.

use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::{self, Contribution, RayKind, Record};
use steradian_bsdf::{Lobe, TransportMode};
use steradian_math::Ray;
use steradian_sampling::rng::{Rng, hash_floats};
use steradian_scene::{CameraRay, Shading, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// A random walk through media up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct SimpleVolPath {
    /// The greatest number of scattering events, in media and on surfaces.
    pub max_depth: u32,
}

impl SimpleVolPath {
    /// The radiance that arrives along a camera ray: in the lane that was followed, the others are black.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        // Follow one wavelength; in RGB mode one of three lanes stands for all.
        wavelengths.terminate_secondary();
        let hero = Hero::choose(wavelengths, numbers).lane;
        let mut only = Lanes::ZERO;
        only[hero] = if wavelengths.is_rgb() { 3.0 } else { 1.0 };

        let mut ray = camera_ray.ray;
        let mut medium = world.camera_medium();
        let (mut radiance, mut beta) = (0.0, 1.0);
        let mut depth = 0;
        record.ray(RayKind::Camera);
        'path: loop {
            let hit = record::intersect(world, &ray, record);
            if let Some(m) = medium {
                // Find the first collision that is not a null one.
                let length = ray.d.length();
                let d = ray.d * (1.0 / length);
                let along = world.medium_ray(m, ray.o, d, wavelengths);
                let mut flight = along.fly(hit.map_or(f32::INFINITY, |h| h.t * length), hero);
                let mut rng =
                    Rng::new(hash_floats(&[numbers.one(Domain::Other)]), hash_floats(&[numbers.one(Domain::Other)]));
                while let Some(c) = flight.next(rng.f32()) {
                    let (absorb, scatter) = (c.point.sigma_a[hero], c.point.sigma_s[hero]);
                    let choice = rng.f32() * c.majorant[hero];
                    if choice < absorb {
                        let value = beta * c.point.emission[hero];
                        radiance += value;
                        if R::LIGHT {
                            record.contribution(Contribution::only_way(depth, None, d, Some(c.p), only * value));
                        }
                        break 'path;
                    }
                    if choice < absorb + scatter {
                        if depth == self.max_depth {
                            break 'path;
                        }
                        depth += 1;
                        let wi = world.phase(m, c.p).sample(-d, rng.f32_2d()).wi;
                        ray = Ray::new(c.p, wi, ray.time);
                        record.ray(RayKind::Scattered);
                        continue 'path;
                    }
                }
            }
            let Some(hit) = hit else {
                for &light in world.infinite_lights() {
                    let value = beta * world.environment(light, &ray, wavelengths)[hero];
                    radiance += value;
                    if R::LIGHT {
                        record.contribution(Contribution::only_way(depth, Some(light), ray.d, None, only * value));
                    }
                }
                break;
            };
            let mut surface = world.surface(&ray, &hit);
            if surface.is_emitter() {
                let value = beta * world.emitted(&surface, wavelengths)[hero];
                radiance += value;
                if R::LIGHT {
                    let (light, p) = (surface.light, Some(surface.p));
                    record.contribution(Contribution::only_way(depth, light, ray.d, p, only * value));
                }
            }
            let Some(Shading { frame, bsdf }) = world.shading(&mut surface, &ray, None, wavelengths) else {
                medium = world.medium_beyond(&surface, ray.d, medium);
                ray = surface.continue_ray(&ray);
                continue;
            };
            if depth == self.max_depth {
                break;
            }
            depth += 1;
            let (u_lobe, u) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let wo = frame.to_local(surface.wo);
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance) else { break };
            beta *= sample.weight[hero];
            if beta == 0.0 {
                break;
            }
            let wi = frame.from_local(sample.wi);
            medium = world.medium_beyond(&surface, wi, medium);
            ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);
        }
        record.path(depth);
        only * radiance
    }
}
