//! Metropolis light transport (Veach and Guibas 1997) in the space of random numbers (Kelemen et al. 2002), over the strategies of
//! bidirectional path tracing (PBRT 3rd ed., 16.4).
//!
//! Markov chains walk through the random numbers of paths of one length each, in proportion to the light that the paths
//! carry; what is bright is found again and again, and explored. How much light there is in all comes from independent
//! paths, the bootstrap, which the chains start from as well.

mod space;

pub use space::{Coordinate, Place};

use crate::bidirectional::{Found, Paths, Setting};
use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::Record;
use crate::splat::Splat;
use space::{PrimarySpace, Stream, Walker};
use steradian_math::Point2;
use steradian_sampling::rng::hash_u64;
use steradian_scene::{CameraSample, Metropolis, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Metropolis light transport up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct Mlt {
    /// The greatest number of scattering events.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce of either path; biased.
    pub regularize: bool,
    /// Steps, chains and bootstrap.
    pub parameters: Metropolis,
}

/// A path's light.
#[derive(Clone, Copy, Debug)]
pub struct PathLight {
    /// Where it lands, and how much, as [`Splat`] says.
    pub splat: Splat,
    /// Its wavelengths.
    pub wavelengths: Wavelengths,
    /// How bright it is: what paths are taken in proportion to.
    brightness: f32,
}

impl PathLight {
    const NONE: Self = Self {
        splat: Splat { film: Point2::new(0.0, 0.0), value: Lanes::ZERO },
        wavelengths: Wavelengths::rgb(),
        brightness: 0.0,
    };
}

/// A chain: a point of the space, and its light.
#[derive(Clone, Debug)]
pub struct Chain {
    space: PrimarySpace,
    /// Bounces of its paths.
    pub depth: u32,
    current: PathLight,
}

impl Chain {
    /// How bright its current path is.
    pub fn brightness(&self) -> f32 {
        self.current.brightness
    }

    /// Where it stands.
    pub fn place(&self) -> &Place {
        &self.space.place
    }

    /// Gives up the proposed step, if making its path went wrong.
    pub fn reject(&mut self) {
        self.space.reject();
    }
}

impl Mlt {
    /// Chain `number`, which started from bootstrap path `index` and has come to `place`. The bounces of its paths follow
    /// from the index.
    pub fn chain<'w, R: Record>(
        &self,
        world: &'w World,
        [index, number]: [u64; 2],
        place: Place,
        paths: &mut Paths<'w>,
        record: &mut R,
    ) -> Chain {
        let lengths = u64::from(self.max_depth) + 1;
        let (start, depth) = (index / lengths, index % lengths);
        let seed = hash_u64(&[world.settings().sampler.seed, depth, 0x6d6c_7400]);
        let Metropolis { sigma, large_step_probability, .. } = self.parameters;
        let mut space = PrimarySpace::new(Walker { seed, start, number }, sigma, large_step_probability, place);
        let depth = depth as u32;
        let current = self.light(world, &mut space, depth, paths, record);
        Chain { space, depth, current }
    }

    /// One step of a chain: the old light and the proposed one, each with the weight that it is to be added with; a mean of
    /// that over steps is to be multiplied with the light that there is in all. `mean` is the mean brightness of independent paths of
    /// the chain's length.
    ///
    /// A large step proposes such an independent path. It counts as a sample of that kind too, beside being one of the chain's, in the
    /// shares of the balance heuristic (Kelemen et al. 2002): what is dim comes from large steps mostly, what is bright from the chain.
    pub fn step<'w, R: Record>(
        &self,
        world: &'w World,
        chain: &mut Chain,
        mean: f32,
        paths: &mut Paths<'w>,
        record: &mut R,
    ) -> [(PathLight, f32); 2] {
        chain.space.propose();
        let proposed = self.light(world, &mut chain.space, chain.depth, paths, record);
        let old = chain.current;
        let accept = if old.brightness > 0.0 { (proposed.brightness / old.brightness).min(1.0) } else { 1.0 };
        let independent = if chain.space.proposes_large() { 1.0 } else { 0.0 };
        let rest = self.parameters.large_step_probability * mean;
        let share = |light: &PathLight, samples: f32| {
            if light.brightness > 0.0 { samples / (light.brightness + rest) } else { 0.0 }
        };
        let out = [(old, share(&old, 1.0 - accept)), (proposed, share(&proposed, accept + independent))];
        if chain.space.chance() < accept {
            chain.current = proposed;
            chain.space.accept();
        } else {
            chain.space.reject();
        }
        out
    }

    /// The light of the path that a point of the space makes.
    fn light<'w, R: Record>(
        &self,
        world: &'w World,
        space: &mut PrimarySpace,
        depth: u32,
        paths: &mut Paths<'w>,
        record: &mut R,
    ) -> PathLight {
        space.read(Stream::Camera);
        let mut w = world.settings().wavelengths(space.one(Domain::Other));
        if world.needs_one_wavelength() {
            w.terminate_secondary();
        }
        let hero = Hero::choose(&w, space);

        // One of the strategies that can make a path of this length, each as often.
        let strategies = if depth == 0 { 1 } else { depth as usize + 2 };
        let s = ((space.one(Domain::Other) * strategies as f32) as usize).min(strategies - 1);
        let t = depth as usize + 2 - s;

        let (film, area) = film_position(world, space.two(Domain::Pixel));
        let (lens, time) = (space.two(Domain::Lens), space.one(Domain::Time));
        let lens = if world.camera().has_lens() { lens } else { [0.5; 2] };
        let sample = CameraSample { film, lens, time: if world.has_motion() { time } else { 0.5 } };
        let ray = world.camera_ray(&sample);

        let setting = Setting { world, hero, max_depth: depth, regularize: self.regularize };
        let Paths { camera, light } = paths;
        setting.trace_from_camera(&ray, t, &mut w, space, camera, record);
        light.clear();
        if s >= 2 {
            space.read(Stream::Light);
            setting.trace_from_light(ray.ray.time, s, &mut w, space, light, record);
        }
        if camera.len() < t || (s >= 2 && light.len() < s) {
            return PathLight::NONE;
        }
        space.read(Stream::Connection);
        let direct = setting.direct_density(light);
        let (mut value, mut at) = (Lanes::ZERO, film);
        let scale = strategies as f32 * ray.weight;
        let mut add = |f: Found| value += f.value * (f.weight * area * scale);
        match (s, t) {
            (0, _) => setting.hit(camera, &w, add),
            (1, _) => {
                if let Some(f) = setting.sample_light(camera, &w, space, record) {
                    add(f);
                }
            }
            (_, 1) => {
                let seed = space.one(Domain::Other);
                if let Some((splat, weight)) = setting.receive(light, camera, &sample, direct, &w, seed, record) {
                    at = splat.film;
                    value = splat.value * (weight * strategies as f32);
                }
            }
            _ => {
                let seed = space.one(Domain::Other);
                if let Some(f) = setting.connect(light, camera, direct, &w, seed, record) {
                    add(f);
                }
            }
        }
        let brightness = brightness(value, &w);
        if !(brightness > 0.0 && brightness.is_finite()) {
            return PathLight::NONE;
        }
        PathLight { splat: Splat { film: at, value }, wavelengths: w, brightness }
    }
}

/// A uniform raster position from which light reaches any pixel, and the area of all of them.
fn film_position(world: &World, u: [f32; 2]) -> (Point2, f32) {
    let settings = world.settings();
    let [x0, x1, y0, y1] = settings.film.pixel_bounds.map(|v| v as f32);
    let radius = settings.filter.radius();
    let (rx, ry) = ((radius.x - 0.5).max(0.0), (radius.y - 0.5).max(0.0));
    let (w, h) = (x1 - x0 + 2.0 * rx, y1 - y0 + 2.0 * ry);
    (Point2::new(x0 - rx + u[0] * w, y0 - ry + u[1] * h), w * h)
}

/// A number that says how bright light is, whatever its wavelengths.
fn brightness(value: Lanes, w: &Wavelengths) -> f32 {
    let used = if w.is_rgb() { 3 } else { Lanes::COUNT };
    let pdf = w.pdf();
    (0..used).filter(|&i| pdf[i] > 0.0).map(|i| value[i].abs() / pdf[i]).sum::<f32>() / used as f32
}
