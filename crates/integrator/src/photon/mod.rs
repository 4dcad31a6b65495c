//! Stochastic progressive photon mapping (Hachisuka and Jensen 2009; PBRT 3rd ed., 16.2) whose iterations know nothing of each other
//! (Knaus and Zwicker 2011).
//!
//! Sample `i` of all pixels is iteration `i`: photons leave the lamps, and each pixel follows a path to the first surface that
//! scatters diffusely, where light straight from lamps is sampled, and photons within a radius bring the rest. The radius
//! is a function of `i` alone, `r(i+1)^2 = r(i)^2 (i + 2/3) / (i + 1)`, so that the mean over iterations converges: its bias
//! falls as `i^(-1/3)`, its variance as `i^(-2/3)`.
//!
//! An iteration has one set of wavelengths and one moment in time for all its pixels and photons.
//!
//! Two deviations from pbrt: the bounces of a photon and of the path that meets it count together, so that the limit is that
//! of path tracing; and a photon counts by the area of the true surface where a shading normal leans away from it.

mod grid;
mod visible;

use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use grid::PhotonGrid;
use std::ops::Range;
use steradian_bsdf::{Lobe, TransportMode};
use steradian_math::{INV_PI, Point3, Vec3};
use steradian_sampling::rng::{hash_u64, unit_f32};
use steradian_sampling::{Sampler, SamplerKind, SamplerSettings};
use steradian_scene::{CameraSample, PhotonMapping, Shading, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// How much of the photons an iteration's smaller circle keeps, in the limit.
const KEPT: f64 = 2.0 / 3.0;

/// Photon mapping up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct Sppm {
    /// The greatest number of bounces.
    pub max_depth: u32,
    radius: f32,
    /// Photons that leave the lamps in one iteration.
    pub per_iteration: u32,
    seed: u64,
}

/// Light that has arrived at a surface after at least one bounce.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    p: Point3,
    /// Unit direction to where it came from.
    wi: Vec3,
    flux: Lanes,
    /// Bounces before.
    depth: u32,
    /// Whether dispersion has left it the hero wavelength only.
    is_single: bool,
}

/// The photons of an iteration.
#[derive(Clone, Debug)]
pub struct PhotonMap {
    iteration: u32,
    grid: PhotonGrid,
    /// One over the area over which photons count, and over how many were sent.
    scale: f32,
}

impl Photon {
    /// Whether it is light at all.
    pub fn is_finite(&self) -> bool {
        self.flux.is_finite() && [self.p.x, self.p.y, self.p.z].iter().all(|v| v.is_finite())
    }
}

impl PhotonMap {
    /// The map of an iteration, of all its photons in the order of their numbers.
    pub fn new(sppm: &Sppm, iteration: u32, photons: &[Vec<Photon>]) -> Self {
        let radius = sppm.radius(iteration);
        let scale = INV_PI / (radius * radius * sppm.per_iteration as f32);
        Self { iteration, grid: PhotonGrid::new(photons, radius), scale }
    }

    /// Which iteration it is of.
    pub fn iteration(&self) -> u32 {
        self.iteration
    }

    /// How many photons it holds: each bounce of each that was sent, but the first.
    pub fn len(&self) -> usize {
        self.grid.len()
    }

    /// Whether it is dark.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Sppm {
    /// Photon mapping of a world.
    pub fn new(world: &World, max_depth: u32, photons: &PhotonMapping) -> Self {
        let settings = world.settings();
        let [w, h] = settings.film.size();
        let pixels = w.saturating_mul(h).clamp(1, steradian_scene::MOST_PHOTONS);
        let extent = world.bounds().diagonal().length();
        let fallback = if extent > 0.0 && extent.is_finite() { extent / 200.0 } else { 1.0 };
        Self {
            max_depth,
            radius: photons.radius.unwrap_or(fallback),
            per_iteration: photons.per_iteration.unwrap_or(pixels),
            seed: hash_u64(&[photons.seed.unwrap_or(settings.sampler.seed), 0x7370_706d]),
        }
    }

    /// Within what distance photons count in an iteration.
    pub fn radius(&self, iteration: u32) -> f32 {
        let factor = |i: u32| (f64::from(i) + KEPT) / (f64::from(i) + 1.0);
        let shrunk: f64 = (1..=iteration).map(factor).product();
        self.radius * shrunk.sqrt() as f32
    }

    /// The wavelengths of an iteration, the same for all pixels and photons.
    pub fn wavelengths(&self, world: &World, iteration: u32) -> Wavelengths {
        world.settings().wavelengths(self.evenly(iteration, 0))
    }

    /// The moment of an iteration, from 0 to 1 while the shutter is open.
    pub(crate) fn time(&self, iteration: u32) -> f32 {
        self.evenly(iteration, 1)
    }

    /// Van der Corput's sequence in base two, or in base three, rotated by the seed.
    fn evenly(&self, iteration: u32, what: u64) -> f32 {
        let start = (hash_u64(&[self.seed, what]) >> 32) as u32;
        if what == 0 {
            return unit_f32(iteration.reverse_bits().wrapping_add(start));
        }
        let (mut i, mut digit, mut value) = (iteration, 1.0 / 3.0f64, 0.0f64);
        while i > 0 {
            value += f64::from(i % 3) * digit;
            (i, digit) = (i / 3, digit / 3.0);
        }
        unit_f32(start.wrapping_add((value * 4_294_967_296.0) as u32))
    }

    /// Where some of the photons of an iteration arrive: a function of their numbers.
    pub fn photons<R: Record>(
        &self,
        world: &World,
        iteration: u32,
        numbers: Range<u32>,
        record: &mut R,
        out: &mut Vec<Photon>,
    ) {
        let mut sampler = Sampler::new(&SamplerSettings {
            kind: SamplerKind::PaddedSobol,
            seed: hash_u64(&[self.seed, u64::from(iteration), 2]),
            spp: self.per_iteration,
            ..SamplerSettings::default()
        });
        let w = self.wavelengths(world, iteration);
        let sample = CameraSample { film: Default::default(), lens: [0.5; 2], time: self.time(iteration) };
        let time = world.camera().time_of(&sample);
        for i in numbers {
            sampler.start([0, 0], i, 0);
            self.photon(world, time, w, &mut sampler, record, out);
        }
    }

    /// The whole map of an iteration.
    pub(crate) fn map<R: Record>(&self, world: &World, iteration: u32, record: &mut R) -> PhotonMap {
        let mut photons = Vec::new();
        self.photons(world, iteration, 0..self.per_iteration, record, &mut photons);
        photons.retain(Photon::is_finite);
        PhotonMap::new(self, iteration, &[photons])
    }

    fn photon<N: Numbers, R: Record>(
        &self,
        world: &World,
        time: f32,
        mut w: Wavelengths,
        numbers: &mut N,
        record: &mut R,
        out: &mut Vec<Photon>,
    ) {
        let u = numbers.one(Domain::Light);
        let (u_place, u_direction) = (numbers.two(Domain::Light), numbers.two(Domain::Lobe));
        let Some(e) = world.sample_emission(u, u_place, u_direction, time, &w) else { return };
        let (mut ray, mut flux) = (e.ray, e.flux);
        let mut depth = 0;
        record.ray(RayKind::Scattered);
        // The path that meets the photon has a bounce of its own there.
        while depth < self.max_depth {
            let Some(hit) = record::intersect(world, &ray, record) else { return };
            let mut surface = world.surface(&ray, &hit);
            let Some(Shading { frame, bsdf }) = world.shading(&mut surface, &ray, None, &mut w) else {
                ray = surface.continue_ray(&ray);
                continue;
            };
            // Light that comes straight from a lamp is sampled.
            if depth > 0 && bsdf.flags().is_diffuse() {
                out.push(Photon { p: surface.p, wi: surface.wo, flux, depth, is_single: w.secondary_terminated() });
            }
            depth += 1;
            let wo = frame.to_local(surface.wo);
            let (u_lobe, u) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) else { return };
            let wi = frame.from_local(sample.wi);
            let leaning = crate::bidirectional::adjoint_factor(surface.n, surface.wo, wi, wo.z, sample.wi.z);
            let next = flux * sample.weight * leaning;
            // Photons live on with the share of their flux that is scattered, so that all carry about the same.
            let u_roulette = numbers.one(Domain::Other);
            let survival = (next.max_component() / flux.max_component()).min(1.0);
            if survival.is_nan() || u_roulette >= survival {
                return;
            }
            flux = next * (1.0 / survival);
            ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPPM: Sppm = Sppm { max_depth: 5, radius: 2.0, per_iteration: 10, seed: 9 };

    /// Bias is the mean of squared radii: it falls as the cube root of the number of iterations.
    #[test]
    fn the_radius_shrinks_as_it_must() {
        assert_eq!(SPPM.radius(0), 2.0);
        let mean_square = |n: u32| {
            let mut sum = 0.0;
            let mut r2 = 4.0f64;
            for i in 0..n {
                assert!(i > 40 || (f64::from(SPPM.radius(i)) - r2.sqrt()).abs() < 1e-5);
                sum += r2;
                r2 *= (f64::from(i + 1) + 2.0 / 3.0) / f64::from(i + 2);
            }
            sum / f64::from(n)
        };
        let ratio = mean_square(1000) / mean_square(8000);
        assert!((ratio - 2.0).abs() < 0.02, "{ratio}");
    }

    /// Wavelengths and moments of 64 iterations fill 64, or 27 of 27, cells.
    #[test]
    fn wavelengths_and_moments_are_spread_evenly() {
        let cells = |what: u64, n: u32| {
            let mut seen = vec![0; n as usize];
            (0..n).for_each(|i| seen[(SPPM.evenly(i, what) * n as f32) as usize] += 1);
            seen
        };
        assert!(cells(0, 64).iter().all(|&k| k <= 2));
        assert!(cells(1, 27).iter().all(|&k| k <= 2));
        let mean: f32 = (0..1000).map(|i| SPPM.evenly(i, 1)).sum::<f32>() / 1000.0;
        assert!((mean - 0.5).abs() < 0.01);
    }
}
