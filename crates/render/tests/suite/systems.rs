//! Whitted's ray tracing against scenes whose radiance is known, and distribution ray tracing against path tracing.

use crate::scenes::*;
use crate::techniques::{room, room_in_motion, same_mean};
use std::f32::consts::PI;
use std::sync::atomic::AtomicBool;
use steradian_math::{Point3, Vec3};
use steradian_render::{Plan, Quiet, Rendered, render};
use steradian_sampling::SamplerKind;
use steradian_scene::{
    Distribution, IntegratorKind, Ior, Light, Metal, Primitive, Roughness, Scattering, Scene, SpectrumInput, Whitted,
    World,
};
use steradian_spectrum::{ColorMode, Spectrum, SpectrumUse};

fn run(scene: Scene, spp: u32) -> Rendered {
    let world = World::build(scene).expect("a sound scene");
    let r = render(&world, &Plan { spp, threads: 2, time_limit: None }, &Quiet, &AtomicBool::new(false));
    assert_eq!(r.bad_count, 0, "{:?}", r.bad);
    r
}

/// The predicted rays of a pixel, and those taken, lens and motion included.
fn predicted(scene: &Scene, spp: u32) -> f64 {
    let world = World::build(scene.clone()).expect("a sound scene");
    let settings = world.settings().integrator.clone();
    settings.predicted_rays(&world.light_census()).expect("a system with a tree") * f64::from(spp)
}

/// A camera at the origin that looks along +z through one pixel, whose centre alone is sampled.
fn one_ray(depth: u32, ambient: f32) -> Scene {
    let mut s = empty(1, 1, depth, ColorMode::Rgb, SamplerKind::Independent);
    s.settings.integrator.kind = IntegratorKind::Whitted(Whitted { ambient });
    s.settings.disable_pixel_jitter = true;
    s.camera = camera([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 30.0);
    s
}

fn grey(s: &mut Scene, v: f32) -> SpectrumInput {
    spectrum(s, Spectrum::constant(v, SpectrumUse::Albedo))
}

/// A square of half side `h` across the z axis; its normal points back to the camera.
fn screen(s: &mut Scene, z: f32, h: f32, m: steradian_scene::Handle<steradian_scene::Material>) -> Primitive {
    quad(s, [[-h, -h, z], [-h, h, z], [h, h, z], [h, -h, z]], m)
}

fn pixel(s: Scene) -> f32 {
    run(s, 1).film.mean()[0][1]
}

fn assert_close(a: f32, b: f32, what: &str) {
    assert!((a - b).abs() <= 1e-4 * b.abs() + 1e-6, "{what}: {a} is not {b}");
}

fn mirror(s: &mut Scene, reflectance: f32) -> steradian_scene::Handle<steradian_scene::Material> {
    let (zero, r) = (float(s, 0.0), grey(s, reflectance));
    let roughness = Roughness { u: zero, v: zero, remap: false };
    material(s, Scattering::Conductor { metal: Metal::Reflectance(r), roughness })
}

/// The room without its varnished ball, whose lobe is evaluated by a walk that the seed chooses.
fn plain_room(size: u32) -> Scene {
    let mut s = room(size, 1, SamplerKind::Independent);
    s.primitives.pop();
    s
}

/// Two mirrors face each other, and the one behind the camera shines: a geometric series, as far as the depth goes.
#[test]
fn mirrors_multiply() {
    for (depth, terms) in [(0, 0), (1, 1), (2, 1), (3, 2), (4, 2), (9, 5), (101, 51)] {
        let mut s = one_ray(depth, 0.0);
        let (half, fifth) = (mirror(&mut s, 0.5), mirror(&mut s, 0.2));
        let front = screen(&mut s, 1.0, 1.0, half);
        s.primitives.push(front);
        let back = screen(&mut s, -1.0, 1.0, fifth);
        s.primitives.push(Primitive { area_light: Some(area_light(3.0, true)), ..back });
        let expected: f32 = (0..terms).map(|k| 1.5 * steradian_math::powf(0.1, k as f32)).sum();
        assert_close(pixel(s), expected, &format!("depth {depth}"));
    }
}

/// Reflected and refracted light of a pane, with all its reflections inside, is all the light there is; so it is with a
/// ball of glass, up to the light that is still inside when the tree ends.
#[test]
fn glass_splits_light_without_loss() {
    let mut s = one_ray(3, 0.0);
    let pane = material(&mut s, Scattering::ThinDielectric { eta: Ior::Constant(1.5) });
    let screen = screen(&mut s, 2.0, 1.0, pane);
    s.primitives.push(screen);
    environment(&mut s, 1.0);
    assert_close(pixel(s), 1.0, "pane");

    let mut s = one_ray(24, 0.0);
    let zero = float(&mut s, 0.0);
    let roughness = Roughness { u: zero, v: zero, remap: false };
    let glass = material(&mut s, Scattering::Dielectric { eta: Ior::Constant(1.5), roughness });
    s.primitives.push(sphere(1.0, Vec3::new(0.3, 0.2, 4.0), glass));
    environment(&mut s, 1.0);
    assert_close(pixel(s.clone()), 1.0, "ball");
    // One ray comes out at each bounce and one goes on; no ray is traced twice.
    let rays = run(s.clone(), 1).rays;
    assert!(rays.total() as f64 <= predicted(&s, 1));
    assert_eq!(rays.camera, 1);
}

/// Lamps are points at their centre: `L A cos` for a flat one, `L A / 4` for a ball; the squared distance, no more.
#[test]
fn lamps_are_points() {
    let (albedo, radiance) = (0.6, 7.0);
    let lit = |lamp: &dyn Fn(&mut Scene) -> Primitive, blocker: bool| {
        let mut s = one_ray(1, 0.0);
        let wall = diffuse(&mut s, [albedo; 3]);
        let screen = screen(&mut s, 5.0, 1.0, wall);
        s.primitives.push(screen);
        let lamp = lamp(&mut s);
        s.primitives.push(Primitive { area_light: Some(area_light(radiance, false)), ..lamp });
        if blocker {
            s.primitives.push(sphere(0.05, Vec3::new(0.0, 1.5, 3.0), wall));
        }
        pixel(s)
    };
    // Wall at (0, 0, 5), lamp at (0, 3, 1): distance 5, cosine 4/5 at both.
    let flat = |s: &mut Scene| {
        let m = diffuse(s, [0.0; 3]);
        quad(s, [[-1.0, 2.5, 1.0], [1.0, 2.5, 1.0], [1.0, 3.5, 1.0], [-1.0, 3.5, 1.0]], m)
    };
    let expected = albedo / PI * radiance * 2.0 * 0.8 * 0.8 / 25.0;
    assert_close(lit(&flat, false), expected, "flat lamp");
    assert_eq!(lit(&flat, true), 0.0, "a shadow has no soft edge");
    let turned = |s: &mut Scene| {
        let m = diffuse(s, [0.0; 3]);
        quad(s, [[-1.0, 2.5, 1.0], [-1.0, 3.5, 1.0], [1.0, 3.5, 1.0], [1.0, 2.5, 1.0]], m)
    };
    assert_eq!(lit(&turned, false), 0.0, "a lamp seen from behind");
    let ball = |s: &mut Scene| {
        let m = diffuse(s, [0.0; 3]);
        sphere(0.5, Vec3::new(0.0, 3.0, 1.0), m)
    };
    let expected = albedo / PI * radiance * PI * 0.25 * 0.8 / 25.0;
    assert_close(lit(&ball, false), expected, "ball");
    assert_eq!(lit(&ball, true), 0.0, "its shadow");
}

#[test]
fn delta_lights_and_ambient_light_add_up() {
    let mut s = one_ray(1, 0.25);
    let wall = diffuse(&mut s, [0.4; 3]);
    let screen = screen(&mut s, 5.0, 1.0, wall);
    s.primitives.push(screen);
    let (intensity, scale) = white_light(10.0);
    s.lights.push(Light::Point { position: Point3::new(0.0, 3.0, 1.0), intensity, scale });
    // An environment is seen, and lights nothing.
    environment(&mut s, 100.0);
    assert_close(pixel(s), 0.4 * 0.25 + 0.4 / PI * 10.0 * 0.8 / 25.0, "wall");
}

#[test]
fn whitted_is_the_same_every_time() {
    let image = |seed: u64| {
        let mut s = plain_room(12);
        s.settings.integrator.kind = IntegratorKind::Whitted(Whitted { ambient: 0.1 });
        s.settings.disable_pixel_jitter = true;
        s.settings.sampler.seed = seed;
        let r = run(s.clone(), 1);
        assert!(r.rays.total() as f64 <= 144.0 * predicted(&s, 1));
        r.film.mean()
    };
    let first = image(1);
    assert_eq!(first, image(2));
    assert!(first.iter().all(|p| p[1] > 0.0));
}

/// Thousands of mirrors in a row are no tree, and need no stack.
#[test]
fn a_deep_path_between_mirrors_ends() {
    let mut s = one_ray(200_000, 0.0);
    let polished = mirror(&mut s, 0.9999);
    for z in [-1.0, 1.0] {
        let m = screen(&mut s, z, 1.0, polished);
        s.primitives.push(m);
    }
    assert_eq!(pixel(s), 0.0);
}

fn distributed(mut scene: Scene, d: Distribution, depth: u32) -> Scene {
    scene.settings.integrator.kind = IntegratorKind::Distribution(d);
    scene.settings.integrator.max_depth = depth;
    scene.settings.sampler.spp = d.samples_per_pixel();
    scene
}

/// Distribution ray tracing and path tracing estimate the same integral: with all domains, Dirac lobes, lobes Dirac in
/// part, an environment, a point light and two lamps.
#[test]
fn distribution_has_the_expectation_of_path_tracing() {
    let scene = || {
        let mut s = room_in_motion(8, 256, SamplerKind::PaddedSobol);
        s.settings.integrator.max_depth = 2;
        let (intensity, scale) = white_light(0.5);
        s.lights.push(Light::Point { position: Point3::new(-0.6, 1.5, -0.5), intensity, scale });
        s
    };
    let reference = run(scene(), 1024);
    for (i, d) in [
        Distribution { subpixels: 3, aperture: 2, light: 2, lobe: 2, time: 2, jitter: true },
        Distribution { subpixels: 4, aperture: 1, light: 1, lobe: 3, time: 1, jitter: true },
        Distribution { subpixels: 10, aperture: 1, light: 1, lobe: 1, time: 1, jitter: true },
    ]
    .into_iter()
    .enumerate()
    {
        let s = distributed(scene(), d, 2);
        let spp = 8 * d.samples_per_pixel();
        let r = run(s.clone(), spp);
        same_mean(&r, &reference, 3, &format!("grid {i}"));
        assert!(r.rays.total() as f64 <= 64.0 * predicted(&s, spp), "{:?}", r.rays);
    }
}

/// Inside a ball that shines and scatters, every ray hits and every light ray finds light: the count is the formula's, and
/// the radiance a geometric series.
#[test]
fn the_predicted_rays_are_those_that_are_traced() {
    for d in [
        Distribution { subpixels: 2, aperture: 2, light: 3, lobe: 2, time: 2, jitter: true },
        Distribution { subpixels: 1, aperture: 3, light: 1, lobe: 3, time: 1, jitter: false },
    ] {
        let mut s = empty(3, 1, 0, ColorMode::Rgb, SamplerKind::Independent);
        s.camera.lens_radius = 0.01;
        s.camera.focal_distance = 0.5;
        let m = diffuse(&mut s, [0.5; 3]);
        let shell = sphere(1.0, Vec3::default(), m);
        s.primitives.push(Primitive { area_light: Some(area_light(1.0, true)), ..shell });
        for depth in 0..4 {
            let s = distributed(s.clone(), d, depth);
            let spp = d.samples_per_pixel();
            let r = run(s.clone(), spp);
            assert_eq!(r.rays.total() as f64, 9.0 * predicted(&s, spp), "depth {depth} of {d:?}");
            let expected = 2.0 - 0.5f64.powi(depth as i32);
            let mean = r.film.mean().iter().map(|p| f64::from(p[1])).sum::<f64>() / 9.0;
            assert!((mean - expected).abs() < 1e-3, "depth {depth} of {d:?}: {mean} is not {expected}");
        }
    }
}

/// Without jitter nothing is random: every seed gives the same picture.
#[test]
fn regular_grids_are_the_same_every_time() {
    let image = |seed: u64| {
        let d = Distribution { jitter: false, ..Distribution::default() };
        let mut s = distributed(plain_room(6), d, 2);
        s.settings.sampler.seed = seed;
        run(s, 4).film.mean()
    };
    assert_eq!(image(1), image(2));
}
