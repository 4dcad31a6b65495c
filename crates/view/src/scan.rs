//! What the camera sees, but for light: what lies under a pixel, points in space to draw paths among, and features as pictures.

use crate::hub::Hub;
use crate::look;
use crate::message;
use crate::path::Trace;
use serde_json::{Value, json};
use steradian_integrator::record::Event;
use steradian_integrator::{Scratch, first_hit};
use steradian_math::Point2;
use steradian_render::{Features, PixelSampler, features};
use steradian_sampling::Sampler;
use steradian_scene::{CameraSample, World};
use steradian_spectrum::{ColorMode, Wavelengths};

/// Points of the grid, at most, along the longer side.
const FINEST: u32 = 150;
/// Paths whose vertices are shown as points, so that more can be seen than the camera does.
const PATHS: u32 = 1500;
/// Samples for a feature.
const FEATURE_SAMPLES: u32 = 4;

fn wavelengths(world: &World) -> Wavelengths {
    match world.settings().color {
        ColorMode::Rgb => Wavelengths::rgb(),
        ColorMode::Spectral => Wavelengths::sample_visible(0.5),
    }
}

fn middle_ray(world: &World, film: Point2) -> steradian_scene::CameraRay {
    world.camera_ray(&CameraSample { film, lens: [0.5, 0.5], time: 0.5 })
}

/// What lies under a pixel, and how far away: for the focus, and for turning around it.
pub(crate) fn probe(world: &World, pixel: [u32; 2]) -> Result<Value, String> {
    let ray = middle_ray(world, Point2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5));
    let Some(hit) = first_hit(world, &ray, &mut wavelengths(world)) else { return Ok(Value::Null) };
    let materials = &world.scene().materials;
    Ok(json!({
        "p": [hit.p.x, hit.p.y, hit.p.z],
        "n": [hit.shading.x, hit.shading.y, hit.shading.z],
        "depth": hit.depth,
        "focal_distance": hit.depth / look::scale(&world.scene().camera),
        "material": hit.material.index(), "materials": materials.len(),
        "object": hit.object,
    }))
}

/// A grid of the points that the camera sees, without a number where it sees nothing; and points where light passes, seen or not.
pub(crate) fn scan(id: u32, world: &World, hub: &Hub) -> Result<Vec<u8>, String> {
    let [x0, x1, y0, y1] = world.settings().film.pixel_bounds;
    let size = [x1 - x0, y1 - y0];
    let longer = size[0].max(size[1]).max(1);
    let grid = size.map(|n| (n * FINEST.min(longer) / longer).max(2));
    let mut points = Vec::with_capacity((grid[0] * grid[1]) as usize + 4 * PATHS as usize);
    let mut lambda = wavelengths(world);
    let space = world.settings().film.color_space;
    for j in 0..grid[1] {
        for i in 0..grid[0] {
            let at = |k: u32, n: u32, a: u32, size: u32| a as f32 + (k as f32 + 0.5) / n as f32 * size as f32;
            let film = Point2::new(at(i, grid[0], x0, size[0]), at(j, grid[1], y0, size[1]));
            let hit = first_hit(world, &middle_ray(world, film), &mut lambda);
            points.push(hit.map_or([f32::NAN; 6], |h| {
                let [r, g, b] = space.reflectance_rgb(h.albedo, &lambda);
                [h.p.x, h.p.y, h.p.z, r, g, b]
            }));
        }
        if hub.closing.load(std::sync::atomic::Ordering::Relaxed) {
            return Err("the server ends".into());
        }
    }
    let pixels = PixelSampler::new(world);
    let (mut sampler, mut scratch) = (Sampler::new(&world.settings().sampler), Scratch::default());
    for k in 0..PATHS {
        // Steps of the golden ratio and its like (Roberts 2018) spread pixels over the picture.
        let along = |alpha: f64| (0.5 + alpha * f64::from(k)).fract();
        let pixel = [
            x0 + (along(0.754_877_666_246_692_8) * f64::from(size[0])) as u32,
            y0 + (along(0.569_840_290_998_053_3) * f64::from(size[1])) as u32,
        ];
        let mut trace = Trace::default();
        pixels.sample(&mut sampler, pixel, 0, &mut trace, &mut scratch);
        for event in trace.events.iter().take(32) {
            let (p, lit) = match event {
                Event::Vertex(v) if v.depth > 0 => (v.p, 0.0),
                Event::Contribution(c) => match c.end {
                    Some(p) => (p, 1.0),
                    None => continue,
                },
                _ => continue,
            };
            points.push([p.x, p.y, p.z, lit, lit, lit]);
        }
    }
    Ok(message::scan(id, grid, &points))
}

/// A colour for a number, far from that of its neighbours.
fn color_of(number: u32) -> [f32; 3] {
    let mut x = number.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
    x = (x ^ (x >> 15)).wrapping_mul(0x2C1B_3C6D);
    x ^= x >> 12;
    std::array::from_fn(|c| 0.15 + 0.8 * ((x >> (10 * c)) & 1023) as f32 / 1023.0)
}

/// A feature as a picture: colours, and the share of the pixel where there is anything.
pub(crate) fn feature(id: u32, world: &World, name: &str, hub: &Hub) -> Result<Vec<u8>, String> {
    let [r, g, b]: [fn(&Features) -> f32; 3] = match name {
        "normal" => [|f| f.normal[0] * 0.5 + 0.5, |f| f.normal[1] * 0.5 + 0.5, |f| f.normal[2] * 0.5 + 0.5],
        "albedo" => [|f| f.albedo[0], |f| f.albedo[1], |f| f.albedo[2]],
        "depth" => [|f| f.depth, |f| f.depth, |f| f.depth],
        "uv" => [|f| f.uv[0].rem_euclid(1.0), |f| f.uv[1].rem_euclid(1.0), |_| 0.0],
        "position" => [|f| f.position[0], |f| f.position[1], |f| f.position[2]],
        "motion" => [|f| f.motion[0].abs(), |f| f.motion[1].abs(), |_| 0.0],
        "object" | "material" => [|_| 0.0; 3],
        _ => return Err(format!("there is no feature `{name}`")),
    };
    let all = features(world, FEATURE_SAMPLES, hub.threads, &hub.closing).ok_or("the server ends")?;
    let [x0, x1, y0, y1] = world.settings().film.pixel_bounds;
    let pixels = all.iter().map(|f| {
        let shares = |list: &mut dyn Iterator<Item = ([f32; 3], f32)>| {
            list.fold([0.0; 3], |sum: [f32; 3], (c, share)| std::array::from_fn(|i| sum[i] + c[i] * share))
        };
        let [r, g, b] = match name {
            "object" => shares(&mut f.objects.iter().map(|&((i, p), s)| (color_of(i.wrapping_mul(7919) ^ p), s))),
            "material" => shares(&mut f.materials.iter().map(|&(m, s)| (color_of(m), s))),
            _ => [r(f), g(f), b(f)],
        };
        [r, g, b, f.alpha]
    });
    Ok(message::plane(id, [x1 - x0, y1 - y0], pixels))
}
