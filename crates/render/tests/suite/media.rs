//! Participating media: exact values, and estimators against each other.

use crate::furnace::{check_mean, run};
use crate::scenes::*;
use steradian_math::{Bounds3, PI, Point3, Transform, Vec3};
use steradian_render::Rendered;
use steradian_sampling::SamplerKind;
use steradian_scene::{
    Coefficients, Glow, IntegratorKind, Ior, Light, Medium, MediumInterface, Phase, Primitive, Roughness, Scattering,
    Scene, Volume, VoxelGrid, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};
use steradian_testkit::z_test;

const MODES: [ColorMode; 2] = [ColorMode::Rgb, ColorMode::Spectral];
const MEDIA: [IntegratorKind; 2] = [IntegratorKind::VolPath, IntegratorKind::SimpleVolPath];

fn scene(kind: IntegratorKind, max_depth: u32, color: ColorMode) -> Scene {
    let mut s = empty(6, 1, max_depth, color, SamplerKind::PaddedSobol);
    s.settings.integrator.kind = kind;
    s.camera = camera([0.0, 0.0, -4.0], [0.0, 0.0, 0.0], 12.0);
    s
}

fn grey(sigma_a: f32, sigma_s: f32) -> Coefficients {
    let constant = |v| Spectrum::constant(v, SpectrumUse::Unbounded);
    Coefficients { sigma_a: constant(sigma_a), sigma_s: constant(sigma_s) }
}

fn coloured(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> Coefficients {
    let s = |rgb| Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb);
    Coefficients { sigma_a: s(sigma_a), sigma_s: s(sigma_s) }
}

fn homogeneous(coefficients: Coefficients) -> Volume {
    Volume::Homogeneous { coefficients, emission: None }
}

fn grid_of_ones(coefficients: Coefficients, glow: Option<Glow<VoxelGrid<f32>>>) -> Volume {
    Volume::Grid {
        coefficients,
        bounds: Bounds3::new(Point3::splat(-2.0), Point3::splat(2.0)),
        // Cell centres at -1.5 to 1.5: one all over the box.
        density: VoxelGrid { size: [4; 3], values: vec![1.0; 64] },
        glow,
    }
}

/// A box from -1 to 1 full of something, between it and the outside nothing but the change of media.
fn fill(s: &mut Scene, g: f32, volume: Volume) {
    let surface = material(s, Scattering::Interface);
    bound(s, g, volume, surface);
}

fn bound(s: &mut Scene, g: f32, volume: Volume, surface: steradian_scene::Handle<steradian_scene::Material>) {
    let inside = s.media.push(Medium {
        name: "body".into(),
        phase: Phase::HenyeyGreenstein { g },
        scale: 1.0,
        world_from_medium: Transform::IDENTITY,
        volume,
    });
    let media = Some(MediumInterface { inside: Some(inside), outside: None });
    // Counter-clockwise seen from outside: normals point out.
    let faces = [
        [[-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, -1.0]],
        [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]],
        [[-1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0]],
        [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
        [[-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0]],
        [[-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]],
    ];
    for f in faces {
        let q = quad(s, f, surface);
        s.primitives.push(Primitive { media, ..q });
    }
}

/// A floor and a lamp, so that light comes from somewhere.
fn surroundings(s: &mut Scene) {
    let floor = diffuse(s, [0.6, 0.4, 0.3]);
    let q = quad(s, [[-4.0, -1.5, -4.0], [-4.0, -1.5, 4.0], [4.0, -1.5, 4.0], [4.0, -1.5, -4.0]], floor);
    s.primitives.push(q);
    let black = diffuse(s, [0.0; 3]);
    let lamp = quad(s, [[-1.0, 3.0, -1.0], [1.0, 3.0, -1.0], [1.0, 3.0, 1.0], [-1.0, 3.0, 1.0]], black);
    s.primitives.push(Primitive { area_light: Some(area_light(5.0, true)), ..lamp });
    environment(s, 0.3);
}

/// The means of two images must agree, channel by channel. False alarms: below 1e-7 for each.
fn check_same(a: &Rendered, b: &Rendered, what: &str) {
    let mean = |r: &Rendered, c: usize| {
        let (m, v) = (r.film.mean(), r.film.variance());
        let n = m.len() as f64;
        let sum = |p: &[[f32; 3]]| p.iter().map(|p| f64::from(p[c])).sum::<f64>();
        (sum(&m) / n, sum(&v) / (n * n))
    };
    for c in 0..3 {
        let ((ma, va), (mb, vb)) = (mean(a, c), mean(b, c));
        assert!(ma > 0.0 && va > 0.0, "{what}: nothing is seen");
        assert!(z_test(ma - mb, va + vb, 0.0) > 1e-7, "{what}, channel {c}: {ma} and {mb}, {}", (va + vb).sqrt());
    }
}

/// What only absorbs lets `exp(-sigma d)` of the light through.
#[test]
fn absorption_is_beer_and_lambert() {
    for kind in MEDIA {
        for color in MODES {
            let mut s = scene(kind, 3, color);
            s.camera = camera([0.0, 0.0, -400.0], [0.0, 0.0, 0.0], 0.05);
            environment(&mut s, 1.0);
            fill(&mut s, 0.0, homogeneous(grey(0.7, 0.0)));
            // Rays are all but parallel: the path inside is 2 long.
            check_mean(&run(s, 400), [steradian_math::exp(-1.4); 3], 3e-3, &format!("{kind:?} {color:?}"));
        }
    }
}

/// What only emits and absorbs shines with `Le (1 - exp(-sigma d))`.
#[test]
fn a_glowing_medium_saturates() {
    let (le, scale) = white_light(1.0);
    let volumes = [
        Volume::Homogeneous { coefficients: grey(0.7, 0.0), emission: Some((le.clone(), scale)) },
        grid_of_ones(grey(0.7, 0.0), Some(Glow::Spectrum { radiance: le, scale, field: None })),
    ];
    for kind in MEDIA {
        for volume in &volumes {
            let mut s = scene(kind, 3, ColorMode::Spectral);
            s.camera = camera([0.0, 0.0, -400.0], [0.0, 0.0, 0.0], 0.05);
            fill(&mut s, 0.0, volume.clone());
            check_mean(&run(s, 400), [1.0 - steradian_math::exp(-1.4); 3], 3e-3, &format!("{kind:?}"));
        }
    }
}

/// Light that comes through a medium that is the same everywhere is dimmed by what the formula says, and not by chance.
#[test]
fn shadows_of_even_media_have_no_noise() {
    for kind in [IntegratorKind::VolPath, IntegratorKind::Bdpt(steradian_scene::Bidirectional::default())] {
        for color in MODES {
            let mut s = scene(kind, 1, color);
            // A floor under the box, seen from below the box, and a light above it.
            s.camera = camera([0.0, -1.2, -4.0], [0.0, -1.5, 0.0], 0.5);
            let floor = diffuse(&mut s, [0.5; 3]);
            let q = quad(&mut s, [[-9.0, -1.5, -9.0], [-9.0, -1.5, 9.0], [9.0, -1.5, 9.0], [9.0, -1.5, -9.0]], floor);
            s.primitives.push(q);
            let (radiance, scale) = white_light(PI);
            s.lights.push(Light::Distant { to_light: Vec3::new(0.0, 1.0, 0.0), radiance, scale });
            fill(&mut s, 0.0, homogeneous(grey(0.8, 0.5)));
            let r = run(s, 8);
            check_mean(&r, [0.5 * steradian_math::exp(-2.6); 3], 1e-3, &format!("{kind:?} {color:?}"));
            let (mean, variance) = (r.film.mean(), r.film.variance());
            for (m, v) in mean.iter().flatten().zip(variance.iter().flatten()) {
                // What colours of wavelengths chosen by chance leave: in RGB mode nothing.
                let limit = if color == ColorMode::Rgb { 1e-3 } else { 0.5 };
                assert!(f64::from(*v).sqrt() < limit * f64::from(*m), "{kind:?} {color:?}: {m} with a variance of {v}");
            }
        }
    }
}

/// What scatters without absorbing is invisible under uniform light, whatever its colour, phase function and boundary.
#[test]
fn a_white_medium_is_invisible_in_a_furnace() {
    for kind in MEDIA {
        for color in MODES {
            for g in [-0.5, 0.0, 0.7] {
                let mut s = scene(kind, 1000, color);
                environment(&mut s, 1.0);
                fill(&mut s, g, homogeneous(coloured([0.0; 3], [0.4, 1.2, 2.0])));
                check_mean(&run(s, 200), [1.0; 3], 3e-3, &format!("{kind:?} {color:?} g {g}"));
            }
        }
    }
    let mut s = scene(IntegratorKind::VolPath, 1000, ColorMode::Spectral);
    environment(&mut s, 1.0);
    let zero = float(&mut s, 0.0);
    let roughness = Roughness { u: zero, v: zero, remap: true };
    // Dispersion, in a coloured medium: the case in which wavelengths must part early.
    let eta = Spectrum::piecewise_linear(&[360.0, 830.0], &[1.6, 1.3], SpectrumUse::Unbounded).expect("two samples");
    let glass = material(&mut s, Scattering::Dielectric { eta: Ior::Spectrum(eta), roughness });
    bound(&mut s, 0.0, homogeneous(coloured([0.0; 3], [0.4, 1.2, 2.0])), glass);
    check_mean(&run(s, 400), [1.0; 3], 3e-3, "glass");
}

/// A grid of ones is a homogeneous medium.
#[test]
fn a_constant_grid_is_homogeneous() {
    for color in MODES {
        let coefficients = || coloured([0.1, 0.2, 0.4], [0.4, 1.0, 1.5]);
        let render = |volume: Volume, seed: u64| {
            let mut s = scene(IntegratorKind::VolPath, 8, color);
            s.settings.sampler.seed = seed;
            surroundings(&mut s);
            fill(&mut s, 0.4, volume);
            run(s, 400)
        };
        let grid = grid_of_ones(coefficients(), None);
        check_same(&render(homogeneous(coefficients()), 1), &render(grid, 2), &format!("{color:?}"));
    }
}

/// Distances that lamps in the fog ask for lead to what transmittance alone leads to.
#[test]
fn a_lamp_in_fog_shines_as_in_a_grid_of_ones() {
    for color in MODES {
        let coefficients = || coloured([0.1, 0.2, 0.4], [0.4, 1.0, 1.5]);
        let render = |volume: Volume, seed: u64| {
            let mut s = scene(IntegratorKind::VolPath, 8, color);
            s.settings.sampler.seed = seed;
            environment(&mut s, 0.1);
            let black = diffuse(&mut s, [0.0; 3]);
            // Just out of sight.
            let lamp = sphere(0.05, Vec3::new(0.0, 0.5, -0.5), black);
            s.primitives.push(Primitive { area_light: Some(area_light(200.0, false)), ..lamp });
            fill(&mut s, 0.4, volume);
            run(s, 1000)
        };
        let grid = grid_of_ones(coefficients(), None);
        let (even, tracked) = (render(homogeneous(coefficients()), 1), render(grid, 2));
        check_same(&even, &tracked, &format!("{color:?}"));
        let noise = |r: &Rendered| r.film.variance().iter().map(|v| f64::from(v[1])).sum::<f64>();
        assert!(1.4 * noise(&even) < noise(&tracked), "{color:?}: {} and {}", noise(&even), noise(&tracked));
    }
}

/// Light sampling, ratio tracking and spectral weights find what the walk of a photon finds.
#[test]
fn both_integrators_agree_on_a_coloured_cloud() {
    let values = (0..64u32).map(|i| if i % 3 == 0 { 0.0 } else { (i % 7) as f32 * 0.4 }).collect();
    let density = VoxelGrid { size: [4; 3], values };
    for color in MODES {
        let render = |kind: IntegratorKind, spp: u32| {
            let mut s = scene(kind, 12, color);
            surroundings(&mut s);
            let volume = Volume::Grid {
                coefficients: coloured([0.3, 0.1, 0.05], [0.3, 0.9, 2.0]),
                bounds: Bounds3::new(Point3::splat(-1.0), Point3::splat(1.0)),
                density: density.clone(),
                glow: None,
            };
            fill(&mut s, 0.3, volume);
            let ball = diffuse(&mut s, [0.2, 0.7, 0.3]);
            s.primitives.push(sphere(0.4, Vec3::new(0.1, 0.0, 0.2), ball));
            run(s, spp)
        };
        let (walk, path) = (render(IntegratorKind::SimpleVolPath, 4000), render(IntegratorKind::VolPath, 400));
        check_same(&path, &walk, &format!("{color:?}"));
    }
}

/// Where there is no medium, both integrators are the path tracer; the walk needs more samples.
#[test]
fn lamps_seen_through_panes_are_as_bright_as_those_that_chance_finds() {
    for color in MODES {
        let of = |through_panes: bool| {
            let mut s = scene(IntegratorKind::VolPath, 100, color);
            s.settings.integrator.through_panes = through_panes;
            surroundings(&mut s);
            let pane = material(&mut s, Scattering::ThinDielectric { eta: Ior::Constant(1.6) });
            bound(&mut s, 0.3, homogeneous(coloured([0.1, 0.2, 0.05], [0.5, 0.3, 0.8])), pane);
            run(s, if through_panes { 1024 } else { 4096 })
        };
        check_same(&of(true), &of(false), "fog behind panes");
    }
}

#[test]
fn without_media_there_is_only_path_tracing() {
    let render = |kind, spp| {
        let mut s = scene(kind, 4, ColorMode::Spectral);
        surroundings(&mut s);
        run(s, spp)
    };
    let path = render(IntegratorKind::Path, 100);
    assert_eq!(path.film.mean(), render(IntegratorKind::VolPath, 100).film.mean());
    check_same(&path, &render(IntegratorKind::SimpleVolPath, 2000), "walk");
    // A medium that does nothing makes the other code run.
    let mut s = scene(IntegratorKind::VolPath, 4, ColorMode::Spectral);
    surroundings(&mut s);
    fill(&mut s, 0.0, homogeneous(grey(0.0, 0.0)));
    s.settings.sampler.seed = 7;
    check_same(&path, &run(s, 100), "empty medium");
}

/// Among media the switches of path tracing are not read: nothing is missing, and nothing is refused.
#[test]
fn light_sampling_is_not_a_switch_among_media() {
    let mut s = empty(4, 1, 4, ColorMode::Rgb, SamplerKind::Independent);
    let (intensity, scale) = white_light(1.0);
    s.lights.push(Light::Point { position: Point3::new(0.0, 2.0, 0.0), intensity, scale });
    s.settings.integrator.techniques.light_sampling = false;
    s.settings.integrator.kind = IntegratorKind::VolPath;
    assert!(World::build(s.clone()).is_err());
    fill(&mut s, 0.0, homogeneous(grey(0.1, 0.1)));
    assert!(World::build(s.clone()).is_ok());
    s.settings.integrator.kind = IntegratorKind::Path;
    assert!(World::build(s).is_err());
}
