//! Photon mapping and Metropolis light transport: against paths, over seeds, since neither's pixels are independent.

use crate::bidirectional::{foggy, rough_room, with};
use crate::continuing::{go, kept, parts_join, refused};
use crate::furnace::run;
use crate::scenes::*;
use crate::techniques::{room, room_in_motion};
use steradian_math::{Point3, Vec3};
use steradian_render::{Goals, Rendered, Snapshot};
use steradian_sampling::SamplerKind;
use steradian_scene::{
    Bidirectional, IntegratorKind, Ior, Light, LightSelection, Medium, Metropolis, Phase, PhotonMapping, Projection,
    Roughness, Scattering, Scene, SettingsError, SphericalMapping, Volume, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};
use steradian_testkit::{bonferroni, student_t_two_sided};

const MLT: IntegratorKind = IntegratorKind::Mlt(Metropolis {
    bootstrap_samples: 20_000,
    chains: 100,
    large_step_probability: 0.3,
    sigma: 0.02,
});

pub fn sppm(radius: f32, per_iteration: u32) -> IntegratorKind {
    IntegratorKind::Sppm(PhotonMapping { radius: Some(radius), per_iteration: Some(per_iteration), seed: None })
}

/// Means of the upper and the lower half of the image, channel by channel.
pub fn halves(r: &Rendered) -> Vec<f64> {
    let mean = r.film.mean();
    let n = mean.len() / 2;
    let of = |half: &[[f32; 3]], c: usize| half.iter().map(|p| f64::from(p[c])).sum::<f64>() / n as f64;
    [&mean[..n], &mean[n..]].iter().flat_map(|half| (0..3).map(|c| of(half, c))).collect()
}

/// Mean and variance of the mean over seeds.
fn over_seeds(scene: &Scene, spp: u32, seeds: u64) -> Vec<(f64, f64)> {
    let all: Vec<Vec<f64>> = (0..seeds)
        .map(|seed| {
            let mut s = scene.clone();
            s.settings.sampler.seed = seed;
            halves(&run(s, spp))
        })
        .collect();
    let n = seeds as f64;
    (0..all[0].len())
        .map(|i| {
            let mean = all.iter().map(|v| v[i]).sum::<f64>() / n;
            (mean, all.iter().map(|v| (v[i] - mean) * (v[i] - mean)).sum::<f64>() / (n * (n - 1.0)))
        })
        .collect()
}

/// Whether both find the same, but for a relative bias of the first. False alarms: 1e-6 for each test here, which makes at
/// most four comparisons of six means.
/// The noise may be so large that a missing path length or a wrong factor still shows.
fn agree(scene: &Scene, [kind, reference]: [IntegratorKind; 2], [spp, paths]: [u32; 2], bias: f64, what: &str) {
    const SEEDS: u64 = 10;
    let limit = bonferroni(1e-6, 4 * 6);
    let a = over_seeds(&with(scene, kind), spp, SEEDS);
    let b = over_seeds(&with(scene, reference), paths, SEEDS);
    for (i, ((ma, va), (mb, vb))) in a.into_iter().zip(b).enumerate() {
        let error = (va + vb).sqrt();
        let t = ((ma - mb).abs() - bias * mb).max(0.0) / error;
        // Welch's degrees of freedom are at least those of one of the two.
        let p = student_t_two_sided(t, (SEEDS - 1) as f64);
        assert!(p > limit, "{what}: half {}, channel {}: {ma} is not {mb}, p = {p:e}", i / 3, i % 3);
        assert!(error < 0.12 * mb, "{what}: the noise hides everything: {error} of {mb}");
    }
}

/// The bias bound: at a radius of a hundredth of the room it is below a hundredth of the light.
#[test]
fn photons_bring_the_light_of_paths() {
    let s = rough_room(16, ColorMode::Spectral);
    agree(&s, [sppm(0.03, 3000), IntegratorKind::Path], [48, 300], 0.01, "rough surfaces");
    let mut s = room(16, 1, SamplerKind::PaddedSobol);
    agree(&s, [sppm(0.03, 3000), IntegratorKind::Path], [48, 300], 0.01, "mirrors, panes and varnish");
    s.settings.integrator.max_depth = 1;
    agree(&s, [sppm(0.03, 10), IntegratorKind::Path], [200, 200], 0.0, "one bounce needs no photons");
    let s = room_in_motion(12, 1, SamplerKind::PaddedSobol);
    agree(&s, [sppm(0.03, 3000), IntegratorKind::Path], [81, 300], 0.01, "through a lens, in motion");
}

/// A point of light behind smooth glass; the wavelengths go their own ways in one of them.
#[test]
fn photons_find_caustics() {
    let mut s = empty(12, 1, 6, ColorMode::Spectral, SamplerKind::PaddedSobol);
    s.camera = camera([0.0, 2.0, -4.0], [0.0, 0.0, 0.0], 40.0);
    let white = diffuse(&mut s, [0.8; 3]);
    let floor = quad(&mut s, [[-3.0, -1.0, -3.0], [-3.0, -1.0, 3.0], [3.0, -1.0, 3.0], [3.0, -1.0, -3.0]], white);
    s.primitives.push(floor);
    let zero = float(&mut s, 0.0);
    let (intensity, scale) = white_light(20.0);
    s.lights.push(Light::Point { position: Point3::new(0.0, 3.0, 0.0), intensity, scale });
    let bdpt = IntegratorKind::Bdpt(Bidirectional::default());
    for dispersive in [false, true] {
        let mut s = s.clone();
        let roughness = Roughness { u: zero, v: zero, remap: false };
        let eta = if dispersive {
            let eta = Spectrum::piecewise_linear(&[360.0, 830.0], &[1.6, 1.4], SpectrumUse::Unbounded);
            Ior::Spectrum(eta.expect("a glass"))
        } else {
            Ior::Constant(1.5)
        };
        let glass = material(&mut s, Scattering::Dielectric { eta, roughness });
        s.primitives.push(sphere(0.6, Vec3::default(), glass));
        let what = format!("dispersive: {dispersive}");
        agree(&s, [sppm(0.04, 4000), bdpt], [64, if dispersive { 1500 } else { 600 }], 0.015, &what);
    }
}

#[test]
fn chains_find_the_light_of_paths() {
    let s = room(16, 1, SamplerKind::Independent);
    agree(&s, [MLT, IntegratorKind::Path], [160, 200], 0.0, "mirrors, panes and varnish");
    let mut s = rough_room(16, ColorMode::Spectral);
    let gaussian = steradian_image::FilterKind::Gaussian { sigma: 0.6 };
    s.settings.filter = steradian_image::Filter::new(gaussian, steradian_math::Vec2::new(1.7, 1.4)).expect("a filter");
    s.settings.film.pixel_bounds = [0, 12, 2, 16];
    agree(&s, [MLT, IntegratorKind::Path], [160, 200], 0.0, "a filter and a crop");
    let s = foggy(0.4, [0.1, 0.3, 0.8], [1.5, 0.8, 0.3], true);
    agree(&s, [MLT, IntegratorKind::VolPath], [200, 800], 0.0, "fog");
}

/// Threads, kills and shares change no bit.
#[test]
fn the_same_bits_however_a_render_is_cut_up() {
    let few = Metropolis { bootstrap_samples: 300, chains: 30, ..Metropolis::default() };
    for kind in [IntegratorKind::Mlt(few), sppm(0.05, 300)] {
        let mut scene = cornell(24, 100, ColorMode::Spectral, SamplerKind::PaddedSobol, LightSelection::Tree);
        scene.settings.integrator.max_depth = 3;
        let world = World::build(with(&scene, kind)).expect("a scene");
        let (whole, _) = go(&world, &Goals::default(), 1, None, None);
        assert!(whole.film.mean().iter().map(|p| p[1]).sum::<f32>() > 10.0);
        let mut stored: Option<Vec<u8>> = None;
        let mut kills = 0;
        let resumed = loop {
            let resume = stored.as_ref().map(|bytes| Snapshot::decode(bytes).unwrap());
            let stop = 5 + (kills as u32 * 7) % 31;
            let (rendered, last) = go(&world, &Goals::default(), 1 + kills % 3, resume, Some(stop));
            if rendered.outcome != steradian_render::Outcome::Interrupted {
                break rendered;
            }
            stored = if kills % 2 == 0 { last.or(stored) } else { Some(kept(&rendered).encode()) };
            kills += 1;
        };
        assert!(kills >= 3 && resumed.film == whole.film, "{kind:?}: {kills} kills");
        parts_join(&world, &whole, 100, &format!("{kind:?}"));
    }
}

#[test]
fn what_cannot_work_is_refused() {
    let room = rough_room(4, ColorMode::Rgb);
    let mut s = with(&room, MLT);
    s.camera.projection = Projection::Spherical { mapping: SphericalMapping::EqualArea };
    assert_eq!(refused(s.clone()), SettingsError::Receiver { integrator: "mlt" });
    // Photons are met by any camera.
    s.settings.integrator.kind = sppm(0.1, 10);
    assert!(World::build(s).is_ok());
    let mut s = with(&room, MLT);
    let grey = Spectrum::rgb_unbounded(ColorSpace::Srgb, [0.5; 3]);
    let coefficients = steradian_scene::Coefficients { sigma_a: grey.clone(), sigma_s: grey.clone() };
    let volume = Volume::Homogeneous { coefficients, emission: Some((grey, 1.0)) };
    let world_from_medium = steradian_math::Transform::IDENTITY;
    s.media.push(Medium {
        name: "fire".into(),
        phase: Phase::HenyeyGreenstein { g: 0.0 },
        scale: 1.0,
        world_from_medium,
        volume,
    });
    assert_eq!(refused(s), SettingsError::GlowingMedia { integrator: "mlt" });
    for kind in [
        sppm(0.0, 10),
        sppm(f32::NAN, 10),
        sppm(1.0, 0),
        IntegratorKind::Mlt(Metropolis { chains: 0, ..Metropolis::default() }),
        IntegratorKind::Mlt(Metropolis { sigma: -1.0, ..Metropolis::default() }),
        IntegratorKind::Mlt(Metropolis { large_step_probability: f32::NAN, ..Metropolis::default() }),
        IntegratorKind::Mlt(Metropolis { bootstrap_samples: u32::MAX, ..Metropolis::default() }),
    ] {
        assert!(matches!(refused(with(&room, kind)), SettingsError::Range { .. }), "{kind:?}");
    }
}
