//! Light tracing (Arvo 1986; Dutré et al. 1993): paths start at lights, and every vertex is connected to the camera.
//!
//! What the camera sees shine directly is found by its own rays, free of noise; nothing else is. So mirrors and glass seen
//! directly stay black, since no vertex on them can be connected.

use super::Paths;
use super::subpath::Setting;
use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::Record;
use crate::splat::Splat;
use steradian_scene::{CameraSample, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Light tracing up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct LightPath {
    /// The greatest number of scattering events, in media and on surfaces.
    pub max_depth: u32,
}

impl LightPath {
    /// What is seen to shine at a film position, and what lands elsewhere on the film.
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
        let Paths { camera, light } = paths;
        let ray = world.camera_ray(sample);
        let seen = Setting { world, hero, max_depth: 0, regularize: false };
        let mut radiance = seen.trace_from_camera(&ray, 2, w, numbers, camera, record);
        seen.hit(camera, w, |f| radiance += f.value);

        let setting = Setting { world, hero, max_depth: self.max_depth, regularize: false };
        setting.trace_from_light(ray.ray.time, self.max_depth as usize + 1, w, numbers, light, record);
        for s in 2..=light.len() {
            let lens = if world.camera().has_lens() { numbers.two(Domain::Lens) } else { [0.5; 2] };
            let seed = numbers.one(Domain::Other);
            let through = CameraSample { lens, ..*sample };
            let found = setting.receive(&light[..s], &camera[..1], &through, 0.0, w, seed, record);
            splats.extend(found.map(|(splat, _)| splat));
        }
        record.path(light.len().saturating_sub(1) as u32);
        radiance
    }
}
