//! The stage: small scenes built by hand, and the few steps of path tracing that the experiments put together in
//! their own ways.

mod build;
mod scenes;
mod vertex;

pub use build::{Builder, shining};
pub use scenes::*;
pub use vertex::{Vertex, Weights, add, scaled};

use crate::measure::ErrorAt;
use crate::parallel;
use std::sync::atomic::AtomicBool;
use steradian_image::Image;
use steradian_integrator::Scratch;
use steradian_integrator::record::{Counters, RayCounts, Record};
use steradian_render::{PixelSampler, Plan};
use steradian_sampling::{Randomization, Sampler, SamplerKind, SamplerSettings};
use steradian_scene::World;

/// Linear RGB.
pub type Rgb = [f32; 3];

/// A source of sample points for a world's pixels.
pub fn sampler(world: &World, kind: SamplerKind, spp: u32, seed: u64) -> Sampler {
    Sampler::new(&SamplerSettings {
        kind,
        seed,
        spp,
        randomization: Randomization::FastOwen,
        resolution: world.settings().film.resolution,
        strata: [0, 0],
        jitter: true,
    })
}

/// One value for each pixel, row by row: `f` is given the pixel and a sampler of its own.
pub fn per_pixel<T: Send>(
    world: &World,
    threads: usize,
    sampler: &Sampler,
    f: impl Fn([u32; 2], &mut Sampler) -> T + Sync,
) -> Vec<T> {
    let [width, height] = world.settings().film.resolution;
    let rows = parallel::map(threads, height as usize, |y| {
        let mut sampler = sampler.clone();
        (0..width).map(|x| f([x, y as u32], &mut sampler)).collect::<Vec<_>>()
    });
    rows.into_iter().flatten().collect()
}

/// The mean of `spp` samples in each pixel: `f` is given the pixel and a sampler that stands at a sample.
pub fn average(
    world: &World,
    threads: usize,
    kind: SamplerKind,
    spp: u32,
    seed: u64,
    f: impl Fn([u32; 2], &mut Sampler) -> Rgb + Sync,
) -> Vec<Rgb> {
    let source = sampler(world, kind, spp, seed);
    per_pixel(world, threads, &source, |pixel, s| {
        let mut sum = [0.0; 3];
        for i in 0..spp {
            s.start(pixel, i, 0);
            let value = f(pixel, s);
            sum = std::array::from_fn(|c| sum[c] + value[c]);
        }
        sum.map(|v| v / spp as f32)
    })
}

/// The picture of the world's own integrator, with its rays.
pub fn render_counted(world: &World, kind: SamplerKind, spp: u32, seed: u64, threads: usize) -> (Vec<Rgb>, RayCounts) {
    let mut rays = RayCounts::default();
    let all = render_recorded(world, kind, spp, seed, threads, RayCounts::default);
    let keep = |(value, counts): (Rgb, RayCounts)| {
        rays.merge(&counts);
        value
    };
    (all.into_iter().map(keep).collect(), rays)
}

/// The picture of the world's own integrator and sampler as the renderer makes it, light that lands on other pixels included,
/// with its rays.
pub fn render_film(world: &World, threads: usize) -> (Vec<Rgb>, RayCounts) {
    let plan = Plan { spp: world.settings().sampler.spp, threads, time_limit: None };
    let rendered = steradian_render::render(world, &plan, &steradian_render::Quiet, &AtomicBool::new(false));
    (rendered.film.mean(), rendered.rays)
}

/// Rays, tests of boxes and tests of primitives that the world's own integrator takes.
pub fn count_tests(world: &World, spp: u32, seed: u64, threads: usize) -> [u64; 3] {
    let all = render_recorded(world, SamplerKind::Independent, spp, seed, threads, Counters::default);
    all.iter().fold([0; 3], |[r, b, p], (_, c)| [r + c.rays.total(), b + c.box_tests, p + c.primitive_tests])
}

fn render_recorded<R: Record + Send>(
    world: &World,
    kind: SamplerKind,
    spp: u32,
    seed: u64,
    threads: usize,
    new: impl Fn() -> R + Sync,
) -> Vec<(Rgb, R)> {
    let source = sampler(world, kind, spp, seed);
    let pixels = PixelSampler::new(world);
    per_pixel(world, threads, &source, |pixel, s| {
        let mut record = new();
        let mut scratch = Scratch::default();
        let mut sum = [0.0; 3];
        for i in 0..spp {
            let value = pixels.sample(s, pixel, i, &mut record, &mut scratch).rgb;
            sum = std::array::from_fn(|c| sum[c] + value[c]);
        }
        (sum.map(|v| v / spp as f32), record)
    })
}

/// The picture of the world's own integrator with independent samples.
pub fn render_path(world: &World, spp: u32, seed: u64, threads: usize) -> Vec<Rgb> {
    render_counted(world, SamplerKind::Independent, spp, seed, threads).0
}

/// The squared error of a picture as a mean over its pixels, and how far that mean is known: the pixels scatter, and
/// each has its own noise. Relative errors are over `b^2 + 0.01`.
pub fn error_at(n: f64, a: &[Rgb], b: &[Rgb], relative: bool) -> ErrorAt {
    let of_pixel = |(p, q): (&Rgb, &Rgb)| {
        let square = |c: usize| {
            let (d, r) = (f64::from(p[c] - q[c]), f64::from(q[c]));
            d * d / if relative { r * r + 0.01 } else { 1.0 }
        };
        ((square(0) + square(1) + square(2)) / 3.0).sqrt()
    };
    ErrorAt::of(n, a.iter().zip(b).map(of_pixel))
}

/// Mean over pixels and channels of the squared difference.
pub fn mse(a: &[Rgb], b: &[Rgb]) -> f64 {
    let total: f64 = a
        .iter()
        .zip(b)
        .map(|(p, q)| (0..3).map(|c| f64::from(p[c] - q[c]) * f64::from(p[c] - q[c])).sum::<f64>() / 3.0)
        .sum();
    total / a.len().max(1) as f64
}

/// Mean of `(a - b)^2 / (b^2 + 0.01)`, as the image comparison of the project has it.
pub fn rel_mse(width: usize, a: &[Rgb], b: &[Rgb]) -> f64 {
    let image = |p: &[Rgb]| Image::from_rgb(width, p.len() / width, p);
    match (image(a), image(b)) {
        (Some(a), Some(b)) => steradian_image::metrics(&a, &b).map_or(f64::NAN, |m| m.rel_mse),
        _ => f64::NAN,
    }
}
