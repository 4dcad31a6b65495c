//! Scenes whose radiance is known exactly, over integrators, samplers, colours and light selections.

use crate::scenes::*;
use std::sync::atomic::AtomicBool;
use steradian_math::Vec3;
use steradian_render::{Plan, Quiet, Rendered, render};
use steradian_sampling::SamplerKind;
use steradian_scene::{LightSelection, Primitive, Scattering, Scene, World};
use steradian_spectrum::ColorMode;

const SAMPLERS: [SamplerKind; 7] = [
    SamplerKind::Independent,
    SamplerKind::Stratified,
    SamplerKind::Halton,
    SamplerKind::Sobol,
    SamplerKind::PaddedSobol,
    SamplerKind::ZSobol,
    SamplerKind::Pmj02bn,
];

pub fn run(scene: Scene, spp: u32) -> Rendered {
    let world = World::build(scene).expect("a sound scene");
    let plan = Plan { spp, threads: 2, time_limit: None };
    let r = render(&world, &plan, &Quiet, &AtomicBool::new(false));
    assert_eq!(r.bad_count, 0, "{:?}", r.bad);
    r
}

/// The mean of the image must be within `z` standard errors of the value, channel by channel, plus a relative
/// tolerance for what is tabulated (spectra). False alarm rate: below 1e-7 for each check at z = 5.5.
pub fn check_mean(r: &Rendered, expected: [f32; 3], tolerance: f32, what: &str) {
    let (mean, variance) = (r.film.mean(), r.film.variance());
    let n = mean.len() as f64;
    for c in 0..3 {
        let m = mean.iter().map(|p| f64::from(p[c])).sum::<f64>() / n;
        let v = variance.iter().map(|p| f64::from(p[c])).sum::<f64>() / (n * n);
        let limit = 5.5 * v.sqrt() + f64::from(tolerance * expected[c]) + 1e-6;
        assert!(
            (m - f64::from(expected[c])).abs() <= limit,
            "{what}, channel {c}: {m} is not {} +- {limit}",
            expected[c]
        );
    }
}

/// Inside a white sphere of albedo `rho` that emits 1, every path sees `sum of rho^k` up to the depth.
#[test]
fn inside_an_emitting_sphere_radiance_is_a_geometric_series() {
    let (rho, depth) = (0.5f32, 6u32);
    let expected: f32 = (0..=depth).map(|k| steradian_math::powf(rho, k as f32)).sum();
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        for sampler in SAMPLERS {
            for selection in
                [LightSelection::Uniform, LightSelection::Power, LightSelection::Tree, LightSelection::Exhaustive]
            {
                let mut s = empty(4, 64, depth, color, sampler);
                s.settings.integrator.light_selection = selection;
                let m = diffuse(&mut s, [rho; 3]);
                let shell = sphere(1.0, Vec3::default(), m);
                s.primitives.push(Primitive { area_light: Some(area_light(1.0, true)), ..shell });
                let r = run(s, 64);
                check_mean(&r, [expected; 3], 2e-3, &format!("{color:?} {sampler:?} {selection:?}"));
            }
        }
    }
}

/// A body that absorbs nothing is invisible under uniform light, whatever it is made of.
#[test]
fn white_furnace() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let mut s = empty(8, 256, 50, color, SamplerKind::PaddedSobol);
        s.camera = camera([0.0, 0.0, -4.0], [0.0, 0.0, 0.0], 30.0);
        environment(&mut s, 1.0);
        let white = diffuse(&mut s, [1.0; 3]);
        let ball = sphere(0.4, Vec3::new(-0.5, 0.0, 0.0), white);
        s.primitives.push(ball);
        let zero = float(&mut s, 0.0);
        let smooth = steradian_scene::Roughness { u: zero, v: zero, remap: true };
        let glass =
            material(&mut s, Scattering::Dielectric { eta: steradian_scene::Ior::Constant(1.5), roughness: smooth });
        s.primitives.push(sphere(0.4, Vec3::new(0.5, 0.0, 0.0), glass));
        let pane = material(&mut s, Scattering::ThinDielectric { eta: steradian_scene::Ior::Constant(1.5) });
        s.primitives.push(sphere(0.2, Vec3::new(0.0, 0.4, 0.0), pane));
        check_mean(&run(s, 256), [1.0; 3], 3e-3, &format!("{color:?}"));
    }
}

/// A small diffuse sphere under a uniform environment reflects its albedo, to every direction, at one bounce.
#[test]
fn an_albedo_is_seen_as_such() {
    let mut s = empty(4, 64, 1, ColorMode::Rgb, SamplerKind::PaddedSobol);
    s.camera = camera([0.0, 0.0, -2.0], [0.0, 0.0, 0.0], 20.0);
    environment(&mut s, 2.0);
    let m = diffuse(&mut s, [0.2, 0.5, 0.8]);
    s.primitives.push(sphere(1.0, Vec3::default(), m));
    check_mean(&run(s, 64), [0.4, 1.0, 1.6], 1e-4, "albedo");
}

/// Depth 0 sees emission only; the light itself shows its radiance.
#[test]
fn depth_zero_is_emission() {
    for (depth, expected) in [(0, 1.0), (3, 1.0 + 0.5 + 0.25 + 0.125)] {
        let mut s = empty(2, 32, depth, ColorMode::Rgb, SamplerKind::Independent);
        let m = diffuse(&mut s, [0.5; 3]);
        let shell = sphere(2.0, Vec3::default(), m);
        s.primitives.push(Primitive { area_light: Some(area_light(1.0, true)), ..shell });
        check_mean(&run(s, 256), [expected; 3], 1e-5, "depth");
    }
}

/// Irradiance under a point light: `I cos / d^2`, and radiance `albedo / pi` of it.
#[test]
fn a_point_light_follows_the_inverse_square() {
    let mut s = empty(2, 16, 1, ColorMode::Rgb, SamplerKind::Independent);
    s.camera = camera([0.0, 0.0, -1.0], [0.0, 0.0, 0.0], 0.2);
    let m = diffuse(&mut s, [0.6; 3]);
    let wall = quad(&mut s, [[-9.0, -9.0, 0.0], [-9.0, 9.0, 0.0], [9.0, 9.0, 0.0], [9.0, -9.0, 0.0]], m);
    s.primitives.push(wall);
    let (intensity, scale) = white_light(50.0);
    let position = steradian_math::Point3::new(0.0, 3.0, -4.0);
    s.lights.push(steradian_scene::Light::Point { position, intensity, scale });
    let expected = 50.0 * (4.0 / 5.0) / 25.0 * 0.6 / std::f32::consts::PI;
    check_mean(&run(s, 16), [expected; 3], 1e-3, "point light");
}
