//! Paths from lights: against exact values, against paths from the camera, and every strategy against every other.

use crate::continuing::{go, parts_join, refused};
use crate::furnace::{check_mean, run};
use crate::scenes::*;
use crate::techniques::{room, same_mean};
use steradian_geometry::{BilinearMesh, TriangleMesh};
use steradian_math::{Normal3, Point3, Transform, Vec3};
use steradian_render::{Goals, Rendered, Snapshot};
use steradian_sampling::SamplerKind;
use steradian_scene::{
    Bidirectional, Coefficients, IntegratorKind, Ior, Light, LightSelection, Medium, MediumInterface, Phase, Primitive,
    Projection, Roughness, Scattering, Scene, SettingsError, Shape, SphericalMapping, Volume, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

const BDPT: IntegratorKind = IntegratorKind::Bdpt(Bidirectional { strategy: None, unweighted: false });

pub fn with(scene: &Scene, kind: IntegratorKind) -> Scene {
    let mut s = scene.clone();
    s.settings.integrator.kind = kind;
    s
}

fn strategy(scene: &Scene, s: u32, t: u32, unweighted: bool) -> Scene {
    with(scene, IntegratorKind::Bdpt(Bidirectional { strategy: Some([s, t]), unweighted }))
}

/// A room without mirrors: a diffuse box, a rough metal ball, a rough glass ball, a lamp and a little sky.
pub fn rough_room(size: u32, color: ColorMode) -> Scene {
    let mut s = room(size, 1, SamplerKind::Independent);
    s.settings.color = color;
    s.settings.integrator.max_depth = 4;
    s.primitives.pop();
    let rough = float(&mut s, 0.4);
    let roughness = Roughness { u: rough, v: rough, remap: false };
    let glass = material(&mut s, Scattering::Dielectric { eta: Ior::Constant(1.4), roughness });
    let last = s.primitives.len() - 1;
    s.primitives[last].material = glass;
    s
}

#[test]
fn light_that_comes_from_everywhere_is_kept() {
    // An albedo of a half below a sky of one, seen from outside; a ball cannot shine on itself.
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        for kind in [BDPT, IntegratorKind::LightPath] {
            let mut s = empty(8, 1, 4, color, SamplerKind::Independent);
            let m = diffuse(&mut s, [0.5; 3]);
            s.primitives.push(sphere(1.0, Vec3::new(0.0, 0.0, 5.0), m));
            environment(&mut s, 1.0);
            s.camera = camera([0.0; 3], [0.0, 0.0, 5.0], 8.0);
            check_mean(&run(with(&s, kind), 2000), [0.5; 3], 2e-3, &format!("{kind:?} {color:?}"));
        }
    }
}

/// Inside a shining ball of albedo one half radiance is a geometric series.
#[test]
fn a_furnace_is_a_geometric_series() {
    for kind in [BDPT, IntegratorKind::LightPath] {
        for selection in
            [LightSelection::Uniform, LightSelection::Power, LightSelection::Tree, LightSelection::Exhaustive]
        {
            let depth = 4;
            let mut s = empty(4, 1, depth, ColorMode::Spectral, SamplerKind::PaddedSobol);
            s.settings.integrator.light_selection = selection;
            let m = diffuse(&mut s, [0.5; 3]);
            let shell = sphere(1.0, Vec3::default(), m);
            s.primitives.push(Primitive { area_light: Some(area_light(1.0, true)), ..shell });
            let expected = 2.0 - steradian_math::powf(0.5, depth as f32);
            check_mean(&run(with(&s, kind), 1000), [expected; 3], 2e-3, &format!("{kind:?} {selection:?}"));
        }
    }
}

/// A point above a plane, seen from straight above by a camera of either kind: `albedo / pi * I cos / d^2`.
#[test]
fn a_point_lights_a_plane() {
    for projection in [Projection::Perspective { fov: 0.5 }, Projection::Orthographic] {
        for kind in [BDPT, IntegratorKind::LightPath] {
            let mut s = empty(4, 1, 1, ColorMode::Rgb, SamplerKind::Independent);
            let m = diffuse(&mut s, [0.6; 3]);
            let floor = quad(&mut s, [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]], m);
            s.primitives.push(floor);
            let (intensity, scale) = white_light(3.0);
            s.lights.push(Light::Point { position: Point3::new(0.6, 0.8, 0.0), intensity, scale });
            s.camera = camera([0.0, 30.0, 0.0], [0.0, 0.0, 0.001], 1.0);
            s.camera.projection = projection.clone();
            s.camera.screen_window =
                matches!(projection, Projection::Orthographic).then_some([-0.01, 0.01, -0.01, 0.01]);
            // Distance 1, cosine 0.8; over the small window hardly more or less.
            let expected = 0.6 / std::f32::consts::PI * 3.0 * 0.8;
            let what = format!("{kind:?} {projection:?}");
            if kind == BDPT {
                check_mean(&run(with(&s, kind), 4), [expected; 3], 0.01, &what);
            } else {
                // Hardly any photon lands in such a window; on a larger one enough do.
                if matches!(projection, Projection::Perspective { .. }) {
                    s.camera.projection = Projection::Perspective { fov: 2.0 };
                }
                s.camera.screen_window = s.camera.screen_window.map(|w| w.map(|v| v * 40.0));
                let exact = run(with(&s, BDPT), 64);
                same_mean(&run(with(&s, kind), 40_000), &exact, 2, &what);
            }
        }
    }
}

/// Among surfaces and lights that every algorithm can find, all agree.
#[test]
fn paths_from_both_ends_find_the_same_light() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let s = rough_room(16, color);
        let path = run(with(&s, IntegratorKind::Path), 1500);
        same_mean(&run(with(&s, BDPT), 500), &path, 12, &format!("bdpt {color:?}"));
        same_mean(&run(with(&s, IntegratorKind::LightPath), 1500), &path, 12, &format!("lightpath {color:?}"));
    }
    let s = room(16, 1, SamplerKind::PaddedSobol);
    let path = run(with(&s, IntegratorKind::Path), 1500);
    same_mean(&run(with(&s, BDPT), 500), &path, 12, "mirrors, panes and varnish");
}

/// A lamp and a floor below a ceiling, at any height: the ends of rays must not take themselves for obstacles where
/// coordinates are zero, and the ends' own errors vanish.
#[test]
fn planes_through_the_origin_are_lit_like_others() {
    let at = |y: f32, kind: IntegratorKind| {
        let mut s = empty(8, 1, 2, ColorMode::Rgb, SamplerKind::Independent);
        let grey = diffuse(&mut s, [0.5; 3]);
        for (h, r) in [(0.0, 2.0), (1.7, 1.5)] {
            let corners = [[-r, y + h, -r], [-r, y + h, r], [r, y + h, r], [r, y + h, -r]];
            let plane = quad(&mut s, corners, grey);
            s.primitives.push(plane);
        }
        let lamp = quad(&mut s, [[-2.6, y, -0.5], [-2.6, y, 0.5], [-2.1, y, 0.5], [-2.1, y, -0.5]], grey);
        s.primitives.push(Primitive { area_light: Some(area_light(9.0, false)), ..lamp });
        s.camera = camera([0.0, y + 0.85, -3.2], [0.0, y + 0.85, 0.0], 50.0);
        run(with(&s, kind), if kind == IntegratorKind::LightPath { 4000 } else { 1500 })
    };
    let path = at(0.37, IntegratorKind::Path);
    for (kind, y) in [(IntegratorKind::Path, 0.0), (BDPT, 0.37), (BDPT, 0.0), (IntegratorKind::LightPath, 0.0)] {
        same_mean(&at(y, kind), &path, 4, &format!("{kind:?} at {y}"));
    }
}

/// A lamp of which half is there gives half of its light, whoever asks for it.
#[test]
fn lamps_that_are_half_there_give_half_of_their_light() {
    let lit = |radiance: f32, alpha: Option<f32>, kind: IntegratorKind| {
        let mut s = empty(8, 1, 1, ColorMode::Rgb, SamplerKind::Independent);
        let grey = diffuse(&mut s, [0.5; 3]);
        let floor = quad(&mut s, [[-2.0, 0.0, -2.0], [-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0]], grey);
        let lamp = quad(&mut s, [[-0.7, 1.5, -0.7], [0.7, 1.5, -0.7], [0.7, 1.5, 0.7], [-0.7, 1.5, 0.7]], grey);
        let alpha = alpha.map(|a| float(&mut s, a));
        s.primitives = vec![floor, Primitive { area_light: Some(area_light(radiance, true)), alpha, ..lamp }];
        s.camera = camera([0.0, 1.2, -1.6], [0.0, 0.0, 0.0], 30.0);
        run(with(&s, kind), 1000)
    };
    let path = lit(4.0, None, IntegratorKind::Path);
    for kind in [IntegratorKind::Path, BDPT, IntegratorKind::LightPath] {
        same_mean(&lit(8.0, Some(0.5), kind), &path, 4, &format!("{kind:?}"));
    }
}

/// Lights without extent, a picture of a lens, a slanted parallel camera, a wide filter and a crop.
#[test]
fn points_lenses_filters_and_crops() {
    let mut s = rough_room(16, ColorMode::Rgb);
    s.settings.integrator.max_depth = 3;
    let position = Point3::new(-0.5, 1.5, -0.6);
    for (i, scale) in [1.0, 2.0, 0.5].into_iter().enumerate() {
        let (intensity, scale) = white_light(scale);
        s.lights.push(match i {
            0 => Light::Point { position, intensity, scale },
            1 => {
                let look = Transform::look_at(position, Point3::new(0.3, 0.0, 0.2), Vec3::new(0.0, 1.0, 0.0));
                let world_from_light = look.expect("a view").inverse();
                Light::Spot { world_from_light, intensity, scale, cos_end: 0.8, cos_start: 0.9 }
            }
            _ => Light::Distant { to_light: Vec3::new(0.1, 0.3, -1.0).normalize(), radiance: intensity, scale },
        });
    }
    let gaussian = steradian_image::FilterKind::Gaussian { sigma: 0.6 };
    s.settings.filter = steradian_image::Filter::new(gaussian, steradian_math::Vec2::new(1.7, 1.4)).expect("a filter");
    s.settings.film.pixel_bounds = [0, 12, 2, 16];
    for parallel in [false, true] {
        s.camera.lens_radius = 0.08;
        s.camera.focal_distance = 3.0;
        if parallel {
            s.camera.projection = Projection::Orthographic;
            s.camera.screen_window = Some([-0.9, 0.9, -0.9, 0.9]);
        }
        let path = run(with(&s, IntegratorKind::Path), 2000);
        same_mean(&run(with(&s, BDPT), 700), &path, 4, &format!("bdpt, parallel: {parallel}"));
        same_mean(
            &run(with(&s, IntegratorKind::LightPath), 2000),
            &path,
            4,
            &format!("lightpath, parallel: {parallel}"),
        );
    }
}

/// Normals that lean away from their surfaces scatter light from lamps and importance from the camera alike, if the
/// adjoint is right.
#[test]
fn leaning_normals_make_no_difference() {
    let mut s = empty(12, 1, 3, ColorMode::Rgb, SamplerKind::Independent);
    s.camera = camera([0.0, 1.5, -3.0], [0.0, 0.0, 0.0], 40.0);
    let white = diffuse(&mut s, [0.8; 3]);
    let tips =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let mesh = TriangleMesh {
        positions: tips.map(Point3::from_array).to_vec(),
        normals: tips.map(|[x, y, z]| Normal3::new(x, y, z)).to_vec(),
        indices: faces.to_vec(),
        ..TriangleMesh::default()
    };
    let mesh = s.triangle_meshes.push(mesh);
    s.primitives.push(primitive(Shape::Triangles(mesh), Transform::IDENTITY, white));
    let floor = BilinearMesh {
        positions: [[-3.0, -1.0, -3.0], [3.0, -1.0, -3.0], [-3.0, -1.0, 3.0], [3.0, -1.0, 3.0]]
            .map(Point3::from_array)
            .to_vec(),
        normals: [[-0.6, 1.0, 0.2], [0.7, 1.0, 0.0], [0.0, 1.0, -0.8], [0.4, 1.0, 0.5]]
            .map(|[x, y, z]| Vec3::new(x, y, z).normalize().to_normal())
            .to_vec(),
        uvs: Vec::new(),
        indices: vec![[0, 1, 2, 3]],
        flip: false,
    };
    let floor = s.bilinear_meshes.push(floor);
    s.primitives.push(primitive(Shape::Bilinear(floor), Transform::IDENTITY, white));
    let lamp = quad(&mut s, [[-1.5, 3.0, -1.0], [0.5, 3.0, -1.0], [0.5, 3.0, 1.0], [-1.5, 3.0, 1.0]], white);
    s.primitives.push(Primitive { area_light: Some(area_light(4.0, true)), ..lamp });
    environment(&mut s, 0.2);
    let path = run(with(&s, IntegratorKind::Path), 3000);
    same_mean(&run(with(&s, BDPT), 1000), &path, 2, "bdpt");
    same_mean(&run(with(&s, IntegratorKind::LightPath), 3000), &path, 2, "lightpath");
}

/// A body of something in a room, with the camera outside or a lamp inside it.
pub fn foggy(g: f32, sigma_a: [f32; 3], sigma_s: [f32; 3], lamp_inside: bool) -> Scene {
    let mut s = empty(8, 1, 4, ColorMode::Spectral, SamplerKind::Independent);
    s.camera = camera([0.0, 0.3, -4.5], [0.0, 0.0, 0.0], 32.0);
    let of = |rgb| Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb);
    let coefficients = Coefficients { sigma_a: of(sigma_a), sigma_s: of(sigma_s) };
    let volume = Volume::Homogeneous { coefficients, emission: None };
    let inside = s.media.push(Medium {
        name: "fog".into(),
        phase: Phase::HenyeyGreenstein { g },
        scale: 1.0,
        world_from_medium: Transform::IDENTITY,
        volume,
    });
    let boundary = material(&mut s, Scattering::Interface);
    let shell = sphere(1.2, Vec3::default(), boundary);
    s.primitives.push(Primitive { media: Some(MediumInterface { inside: Some(inside), outside: None }), ..shell });
    let grey = diffuse(&mut s, [0.6, 0.4, 0.3]);
    let floor = quad(&mut s, [[-4.0, -1.5, -4.0], [-4.0, -1.5, 4.0], [4.0, -1.5, 4.0], [4.0, -1.5, -4.0]], grey);
    s.primitives.push(floor);
    let black = diffuse(&mut s, [0.0; 3]);
    let y = if lamp_inside { 0.5 } else { 2.5 };
    let h = if lamp_inside { 0.4 } else { 1.0 };
    let lamp = quad(&mut s, [[-h, y, -h], [h, y, -h], [h, y, h], [-h, y, h]], black);
    s.primitives.push(Primitive { area_light: Some(area_light(6.0, true)), ..lamp });
    environment(&mut s, 0.3);
    s
}

#[test]
fn media_scatter_light_from_both_ends_alike() {
    for (g, sigma_a, sigma_s, lamp_inside) in [
        (0.0, [0.3; 3], [1.2; 3], false),
        (0.6, [0.1, 0.3, 0.8], [1.5, 0.8, 0.3], false),
        (-0.3, [0.2; 3], [0.9; 3], true),
    ] {
        let s = foggy(g, sigma_a, sigma_s, lamp_inside);
        let path = run(with(&s, IntegratorKind::VolPath), 2500);
        let what = format!("g {g}, lamp inside {lamp_inside}");
        same_mean(&run(with(&s, BDPT), 1200), &path, 6, &format!("bdpt, {what}"));
        same_mean(&run(with(&s, IntegratorKind::LightPath), 4000), &path, 6, &format!("lightpath, {what}"));
    }
}

/// Where all strategies can find all paths of a length, each alone finds the same; with their weights they add up.
#[test]
fn strategies_agree_and_their_weights_add_up_to_one() {
    let mut s = rough_room(12, ColorMode::Rgb);
    s.settings.integrator.max_depth = 1;
    s.primitives.truncate(s.primitives.len() - 2);
    let whole = run(with(&s, BDPT), 600);
    let mut direct = Vec::new();
    for (n, t) in [(0, 3), (1, 2), (2, 1)] {
        direct.push(run(strategy(&s, n, t, true), 3000));
    }
    same_mean(&direct[1], &direct[0], 3, "light sampling against chance");
    same_mean(&direct[2], &direct[0], 3, "light tracing against chance");
    let mean = |r: &Rendered| r.film.mean().iter().map(|p| f64::from(p[1])).sum::<f64>() / r.film.mean().len() as f64;
    let parts: f64 =
        [(0, 2), (0, 3), (1, 2), (2, 1)].iter().map(|&(n, t)| mean(&run(strategy(&s, n, t, false), 600))).sum();
    // The same samples, taken apart: only the random numbers of connections differ.
    assert!((parts / mean(&whole) - 1.0).abs() < 0.02, "{parts} and {}", mean(&whole));
}

/// Caustics of a point of light behind smooth glass: no path from the camera ever finds them.
#[test]
fn light_through_glass_is_found_from_the_lamp() {
    let mut s = empty(12, 1, 6, ColorMode::Rgb, SamplerKind::Independent);
    s.camera = camera([0.0, 2.0, -4.0], [0.0, 0.0, 0.0], 40.0);
    let white = diffuse(&mut s, [0.8; 3]);
    let floor = quad(&mut s, [[-3.0, -1.0, -3.0], [-3.0, -1.0, 3.0], [3.0, -1.0, 3.0], [3.0, -1.0, -3.0]], white);
    s.primitives.push(floor);
    let zero = float(&mut s, 0.0);
    let roughness = Roughness { u: zero, v: zero, remap: false };
    let glass = material(&mut s, Scattering::Dielectric { eta: Ior::Constant(1.5), roughness });
    s.primitives.push(sphere(0.6, Vec3::default(), glass));
    let (intensity, scale) = white_light(20.0);
    s.lights.push(Light::Point { position: Point3::new(0.0, 3.0, 0.0), intensity, scale });
    // A lamp so small that it is nearly a point can be found from both ends, and has the same caustic.
    let mut small = s.clone();
    small.lights.clear();
    let r = 0.05;
    let lamp = sphere(r, Vec3::new(0.0, 3.0, 0.0), white);
    let light = area_light(20.0 / (std::f32::consts::PI * r * r), false);
    small.primitives.push(Primitive { area_light: Some(light), ..lamp });
    let mean = |r: &Rendered| r.film.mean().iter().map(|p| f64::from(p[1])).sum::<f64>() / r.film.mean().len() as f64;
    let (point, ball) = (mean(&run(with(&s, BDPT), 1000)), mean(&run(with(&small, BDPT), 1000)));
    let path = mean(&run(with(&s, IntegratorKind::Path), 1000));
    assert!((point / ball - 1.0).abs() < 0.02, "a point and a small ball: {point} and {ball}");
    assert!(path < 0.95 * point, "the path tracer misses the caustic: {path} of {point}");
}

/// Threads, kills and shares change no bit.
#[test]
fn splats_have_the_same_bits_however_a_render_is_cut_up() {
    for kind in [BDPT, IntegratorKind::LightPath] {
        let mut scene = cornell(24, 100, ColorMode::Spectral, SamplerKind::PaddedSobol, LightSelection::Tree);
        scene.settings.integrator.max_depth = 3;
        let gaussian = steradian_image::FilterKind::Gaussian { sigma: 0.5 };
        scene.settings.filter =
            steradian_image::Filter::new(gaussian, steradian_math::Vec2::splat(1.5)).expect("a filter");
        let world = World::build(with(&scene, kind)).expect("a scene");
        let goals = Goals::default();
        let (whole, _) = go(&world, &goals, 1, None, None);
        assert!(whole.film.splats.is_some());
        let mut stored: Option<Vec<u8>> = None;
        let mut kills = 0;
        let resumed = loop {
            let resume = stored.as_ref().map(|bytes| Snapshot::decode(bytes).unwrap());
            let (rendered, last) = go(&world, &goals, 1 + kills % 3, resume, Some(3 + (kills as u32 * 7) % 11));
            if rendered.outcome != steradian_render::Outcome::Interrupted {
                break rendered;
            }
            stored = last.or(stored);
            kills += 1;
        };
        assert!(kills >= 1 && resumed.film == whole.film, "{kind:?}: {kills} kills");
        parts_join(&world, &whole, 100, &format!("{kind:?}"));
    }
}

#[test]
fn what_cannot_work_is_refused() {
    for (kind, name) in [(BDPT, "bdpt"), (IntegratorKind::LightPath, "lightpath")] {
        let mut s = with(&rough_room(4, ColorMode::Rgb), kind);
        s.camera.projection = Projection::Spherical { mapping: SphericalMapping::EqualArea };
        assert_eq!(refused(s), SettingsError::Receiver { integrator: name });
        let mut s = with(&rough_room(4, ColorMode::Rgb), kind);
        let (zero, one) = (float(&mut s, 0.0), spectrum(&mut s, Spectrum::constant(1.0, SpectrumUse::Unbounded)));
        let inside = steradian_scene::Translucency::Coefficients { sigma_a: one, sigma_s: one };
        let roughness = Roughness { u: zero, v: zero, remap: false };
        material(&mut s, Scattering::Subsurface { inside, scale: 1.0, g: 0.0, eta: 1.3, roughness });
        assert_eq!(refused(s), SettingsError::Subsurface { integrator: name });
    }
}
