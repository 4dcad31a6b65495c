//! Pictures of what the camera sees, besides light: averaged over pixels by the film's filter, in a pass of their own, so
//! that they cost nothing when nobody asks.
//!
//! A feature is a function of the scene and the settings alone: it does not depend on how many samples of light were
//! taken, on threads, or on interruptions.

use crate::sample::PixelSampler;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use steradian_integrator::{FirstHit, first_hit};
use steradian_math::{Point2, Point3, Ray, Vec2, Vec3};
use steradian_sampling::Sampler;
use steradian_scene::{CameraSample, World};
use steradian_spectrum::{ColorMode, Wavelengths};

/// The features of one pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Share of the pixel that shows a surface.
    pub alpha: f32,
    /// Albedo in the film's colour space; nothing counts as black.
    pub albedo: [f32; 3],
    /// Shading normal in world space; nothing counts as zero.
    pub normal: [f32; 3],
    /// Geometric normal in world space.
    pub geometric: [f32; 3],
    /// Distance along the view axis, over the part that shows a surface.
    pub depth: f32,
    /// Position in world space, over that part.
    pub position: [f32; 3],
    /// Surface coordinates, over that part.
    pub uv: [f32; 2],
    /// How far it moves to the right and down while the shutter is open, in pixels, over that part.
    pub motion: [f32; 2],
    /// How much farther away it is one pixel to the right and one down, over that part.
    pub slope: [f32; 2],
    /// Share of the pixel of each object (instance plus one or zero, primitive), largest first.
    pub objects: Vec<((u32, u32), f32)>,
    /// Share of the pixel of each material, largest first.
    pub materials: Vec<(u32, f32)>,
}

/// So many samples of a pixel are looked at, at most.
pub const MOST_FEATURE_SAMPLES: u32 = 64;

/// The features of every pixel of the film, row by row, from `spp` samples each; `None` if cancelled.
pub fn features(world: &World, spp: u32, threads: usize, cancel: &AtomicBool) -> Option<Vec<Features>> {
    let [_, _, y0, y1] = world.settings().film.pixel_bounds;
    let rows = features_of_rows(world, spp, &(y0..y1).collect::<Vec<_>>(), threads, cancel)?;
    Some(rows.into_iter().flatten().collect())
}

/// As [`features`], of these rows of the film.
pub(crate) fn features_of_rows(
    world: &World,
    spp: u32,
    wanted: &[u32],
    threads: usize,
    cancel: &AtomicBool,
) -> Option<Vec<Vec<Features>>> {
    let [x0, x1, ..] = world.settings().film.pixel_bounds;
    let spp = spp.clamp(1, MOST_FEATURE_SAMPLES);
    let pixels = PixelSampler::new(world);
    let rows: Vec<Mutex<Vec<Features>>> = wanted.iter().map(|_| Mutex::default()).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut sampler = Sampler::new(&world.settings().sampler);
        loop {
            let row = next.fetch_add(1, Ordering::Relaxed);
            if row >= rows.len() || cancel.load(Ordering::Relaxed) {
                return;
            }
            let done = (x0..x1).map(|x| pixel(&pixels, &mut sampler, [x, wanted[row]], spp)).collect();
            *rows[row].lock().unwrap_or_else(std::sync::PoisonError::into_inner) = done;
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.max(1) {
            scope.spawn(work);
        }
        work();
    });
    let rows = rows.into_iter().map(|row| row.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner));
    let rows: Vec<_> = rows.collect();
    rows.iter().all(|row| !row.is_empty()).then_some(rows)
}

fn pixel(pixels: &PixelSampler, sampler: &mut Sampler, pixel: [u32; 2], spp: u32) -> Features {
    let mut sum = Features::default();
    let mut objects: BTreeMap<(u32, u32), f32> = BTreeMap::new();
    let mut materials: BTreeMap<u32, f32> = BTreeMap::new();
    let mut total = 0.0;
    for index in 0..spp {
        let (weight, seen) = sample(pixels, sampler, pixel, index);
        total += weight;
        let Some((hit, albedo, slope)) = seen else { continue };
        sum.alpha += weight;
        sum.depth += hit.depth * weight;
        for c in 0..3 {
            sum.albedo[c] += albedo[c] * weight;
            sum.normal[c] += hit.shading[c] * weight;
            sum.geometric[c] += hit.geometric[c] * weight;
            sum.position[c] += hit.p[c] * weight;
        }
        sum.uv[0] += hit.uv.x * weight;
        sum.uv[1] += hit.uv.y * weight;
        sum.motion[0] += hit.motion.x * weight;
        sum.motion[1] += hit.motion.y * weight;
        sum.slope[0] += slope[0] * weight;
        sum.slope[1] += slope[1] * weight;
        *objects.entry((hit.object.0.map_or(0, |i| i + 1), hit.object.1)).or_default() += weight;
        *materials.entry(hit.material.index() as u32).or_default() += weight;
    }
    // By what all weights amount to, as in the picture: what fills a pixel has an alpha of one.
    let all = if total != 0.0 { 1.0 / total } else { 0.0 };
    let seen = if sum.alpha > 0.0 { 1.0 / sum.alpha } else { 0.0 };
    Features {
        alpha: if sum.alpha == total { 1.0 } else { (sum.alpha * all).clamp(0.0, 1.0) },
        albedo: sum.albedo.map(|v| v * all),
        normal: sum.normal.map(|v| v * all),
        geometric: sum.geometric.map(|v| v * all),
        depth: sum.depth * seen,
        position: sum.position.map(|v| v * seen),
        uv: sum.uv.map(|v| v * seen),
        motion: sum.motion.map(|v| v * seen),
        slope: sum.slope.map(|v| v * seen),
        objects: ranked(objects, all),
        materials: ranked(materials, all),
    }
}

/// What one sample sees: the hit, its albedo as a colour, and its slope.
type SeenAt = (FirstHit, [f32; 3], [f32; 2]);

/// The filter's weight of one sample, and what it sees.
fn sample(pixels: &PixelSampler, sampler: &mut Sampler, pixel: [u32; 2], index: u32) -> (f32, Option<SeenAt>) {
    let (world, settings) = (pixels.world, pixels.world.settings());
    sampler.start(pixel, index, 0);
    let position = sampler.pixel_2d();
    let (offset, weight) = if settings.disable_pixel_jitter {
        (Vec2::default(), 1.0)
    } else {
        let s = settings.filter.sample(Point2::from(position));
        (s.offset, s.weight)
    };
    let film = Point2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + offset;
    let mut wavelengths = match settings.color {
        ColorMode::Rgb => Wavelengths::rgb(),
        ColorMode::Spectral => settings.wavelengths(sampler.next_1d()),
    };
    let lens = if world.camera().has_lens() { sampler.next_2d() } else { [0.5, 0.5] };
    let time = if world.has_motion() { sampler.next_1d() } else { 0.5 };
    let camera_sample = CameraSample { film, lens, time };
    let ray = world.camera_ray(&camera_sample);
    let seen = first_hit(world, &ray, &mut wavelengths).map(|hit| {
        let slope = slope(world, &camera_sample, &ray.ray, &hit);
        (hit, settings.film.color_space.reflectance_rgb(hit.albedo, &wavelengths), slope)
    });
    (weight, seen)
}

/// How much farther away the plane of a surface is along the view axis one pixel to the right and one down: where the rays there meet it;
/// zero where they pass it.
fn slope(world: &World, sample: &CameraSample, ray: &Ray, hit: &FirstHit) -> [f32; 2] {
    let (camera, n) = (world.camera(), hit.geometric);
    let beside = camera.differential(sample, ray);
    let farther = |o: Point3, d: Vec3| {
        let t = n.dot(hit.p - o) / n.dot(d);
        let along = (o + d * t - hit.p).dot(camera.view_direction());
        if t > 0.0 && along.is_finite() { along / camera.differential_scale() } else { 0.0 }
    };
    [farther(beside.rx_o, beside.rx_d), farther(beside.ry_o, beside.ry_d)]
}

fn ranked<K: Copy + Ord>(shares: BTreeMap<K, f32>, scale: f32) -> Vec<(K, f32)> {
    let mut out: Vec<(K, f32)> = shares.into_iter().map(|(k, v)| (k, v * scale)).collect();
    out.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    out
}
