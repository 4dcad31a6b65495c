//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; Veach 1997, chapter 10), and light tracing.
//!
//! A path from the camera and one from a light are made; every vertex of one is connected to every vertex of the other,
//! and each of the paths that come of it is weighted among all the ways in which it could have been made. What reaches
//! the camera directly from a light path lands on pixels of its own: it is returned as splats.
//!
//! Media are followed as by [`VolPath`](crate::VolPath), with its densities over wavelengths; only the weights among
//! strategies leave free flight out. Light of media themselves is found from the camera alone. Without Russian roulette:
//! a path ends where it is absorbed, or at the greatest depth.

mod light_path;
mod strategy;
mod subpath;
mod transmittance;
mod vertex;
mod weight;

pub use light_path::LightPath;
pub(crate) use strategy::Found;
pub(crate) use subpath::Setting;
use vertex::Vertex;
pub(crate) use vertex::adjoint_factor;

use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::Record;
use crate::splat::Splat;
use steradian_scene::{Bidirectional, CameraSample, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Bidirectional path tracing up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct Bdpt {
    /// The greatest number of scattering events, in media and on surfaces.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce of either path; biased.
    pub regularize: bool,
    /// What is to be seen.
    pub show: Bidirectional,
}

/// Memory for the vertices of a sample, used over and over.
#[derive(Clone, Debug, Default)]
pub struct Paths<'w> {
    pub(crate) camera: Vec<Vertex<'w>>,
    pub(crate) light: Vec<Vertex<'w>>,
}

impl Bdpt {
    /// The radiance at a film position, and what lands elsewhere on the film.
    pub fn sample<'w, N: Numbers, R: Record>(
        &self,
        world: &'w World,
        sample: &CameraSample,
        w: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
        (paths, splats): (&mut Paths<'w>, &mut Vec<Splat>),
    ) -> Lanes {
        if world.needs_one_wavelength() {
            w.terminate_secondary();
        }
        let hero = Hero::choose(w, numbers);
        let setting = Setting { world, hero, max_depth: self.max_depth, regularize: self.regularize };
        let Paths { camera, light } = paths;
        let ray = world.camera_ray(sample);
        let mut radiance = setting.trace_from_camera(&ray, self.max_depth as usize + 2, w, numbers, camera, record);
        if self.show.strategy.is_some() {
            // Light of media belongs to no strategy.
            radiance = Lanes::ZERO;
        }
        setting.trace_from_light(ray.ray.time, self.max_depth as usize + 1, w, numbers, light, record);
        record.path(camera.len().saturating_sub(2) as u32);
        let direct = setting.direct_density(light);
        for t in 2..=camera.len() {
            let z = &camera[..t];
            if self.shows(0, t) {
                setting.hit(z, w, |f| radiance += self.counted(f));
            }
            let most = (self.max_depth as usize + 2 - t).min(light.len());
            if most == 0 && self.max_depth as usize + 2 == t {
                break;
            }
            if self.shows(1, t)
                && let Some(f) = setting.sample_light(z, w, numbers, record)
            {
                radiance += self.counted(f);
            }
            for s in 2..=most {
                if !self.shows(s, t) {
                    continue;
                }
                let seed = numbers.one(Domain::Other);
                if let Some(f) = setting.connect(&light[..s], z, direct, w, seed, record) {
                    radiance += self.counted(f);
                }
            }
        }
        for s in 2..=light.len() {
            let lens = if world.camera().has_lens() { numbers.two(Domain::Lens) } else { [0.5; 2] };
            let seed = numbers.one(Domain::Other);
            if !self.shows(s, 1) {
                continue;
            }
            let through = CameraSample { lens, ..*sample };
            if let Some((splat, weight)) = setting.receive(&light[..s], &camera[..1], &through, direct, w, seed, record)
            {
                let value = self.counted(Found { value: splat.value, weight });
                splats.push(Splat { value, ..splat });
            }
        }
        radiance
    }

    fn shows(&self, s: usize, t: usize) -> bool {
        self.show.strategy.is_none_or(|[ls, lt]| [ls as usize, lt as usize] == [s, t])
    }

    fn counted(&self, f: Found) -> Lanes {
        if self.show.unweighted { f.value } else { f.value * f.weight }
    }
}
