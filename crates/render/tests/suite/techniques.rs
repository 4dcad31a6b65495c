//! Every valid combination of the path tracer's switches has the same expectation.

use crate::scenes::*;
use std::sync::atomic::AtomicBool;
use steradian_integrator::{Integrator, Scratch, SwitchedPath};
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3};
use steradian_render::{PixelSampler, Plan, Quiet, Rendered, render};
use steradian_sampling::{Sampler, SamplerKind};
use steradian_scene::{
    Coat, Error, Ior, Light, LightSelection, LobeSampling, Metal, MisHeuristic, Roughness, Scattering, Scene,
    SettingsError, Shape, Stratification, Stratify, Techniques, Translucency, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum};
use steradian_testkit::{bonferroni, z_test};

/// A room with a large lamp and an open front to a dim sky: a diffuse wall, a rough metal ball, a thin pane of glass in the
/// shape of a ball, and a varnished one, whose lobe is Dirac in part.
pub fn room(size: u32, spp: u32, sampler: SamplerKind) -> Scene {
    let mut s = cornell(size, spp, ColorMode::Rgb, sampler, LightSelection::Tree);
    s.settings.integrator.max_depth = 3;
    let lamp = s.primitives.iter_mut().find(|p| p.area_light.is_some()).expect("a lamp");
    lamp.area_light = Some(area_light(2.0, false));
    let Shape::Triangles(mesh) = lamp.shape else { panic!("the lamp is a mesh") };
    for p in &mut s.triangle_meshes[mesh].positions {
        *p = Point3::new(p.x * 2.5, p.y, p.z * 2.5);
    }
    environment(&mut s, 0.3);
    let (rough, smooth, thin) = (float(&mut s, 0.5), float(&mut s, 0.0), float(&mut s, 0.01));
    let gold = spectrum(&mut s, Spectrum::rgb_albedo(ColorSpace::Srgb, [0.9, 0.7, 0.3]));
    let roughness = Roughness { u: rough, v: rough, remap: false };
    let metal = material(&mut s, Scattering::Conductor { metal: Metal::Reflectance(gold), roughness });
    let black = spectrum(&mut s, Spectrum::constant(0.0, steradian_spectrum::SpectrumUse::Albedo));
    let coat = Coat {
        roughness: Roughness { u: smooth, v: smooth, remap: false },
        eta: Ior::Constant(1.5),
        thickness: thin,
        albedo: black,
        g: smooth,
        max_depth: 10,
        samples: 1,
    };
    let varnished = material(&mut s, Scattering::CoatedDiffuse { reflectance: gold, coat });
    let ball = s.primitives.len() - 2;
    s.primitives[ball].material = metal;
    s.primitives.push(sphere(0.45, Vec3::new(0.45, 1.25, 0.4), varnished));
    s
}

/// The room with the metal ball replaced by one of wax, under a skin that is `alpha` rough.
fn room_with_wax(size: u32, spp: u32, sampler: SamplerKind, alpha: f32) -> Scene {
    let mut s = room(size, spp, sampler);
    let alpha = float(&mut s, alpha);
    let reflectance = spectrum(&mut s, Spectrum::rgb_albedo(ColorSpace::Srgb, [0.8, 0.6, 0.5]));
    let mean_free_path = spectrum(&mut s, Spectrum::rgb_unbounded(ColorSpace::Srgb, [0.2, 0.1, 0.05]));
    let wax = Scattering::Subsurface {
        inside: Translucency::Reflectance { reflectance, mean_free_path },
        scale: 1.0,
        g: 0.0,
        eta: 1.3,
        roughness: Roughness { u: alpha, v: alpha, remap: false },
    };
    let wax = material(&mut s, wax);
    let metal = s.primitives.len() - 3;
    s.primitives[metal].material = wax;
    s
}

/// The same through a lens, by a camera that moves: every domain of random numbers is in use.
pub fn room_in_motion(size: u32, spp: u32, sampler: SamplerKind) -> Scene {
    let mut s = room(size, spp, sampler);
    s.camera.lens_radius = 0.05;
    s.camera.focal_distance = 3.4;
    let start = s.camera.world_from_camera.start;
    let end = Transform::translate(Vec3::new(0.1, 0.0, 0.0)).mul(&start);
    s.camera.world_from_camera = AnimatedTransform::new(start, 0.0, end, 1.0);
    s
}

fn run(scene: Scene, spp: u32) -> Rendered {
    let world = World::build(scene).expect("a sound scene");
    let r = render(&world, &Plan { spp, threads: 2, time_limit: None }, &Quiet, &AtomicBool::new(false));
    assert_eq!(r.bad_count, 0, "{:?}", r.bad);
    r
}

/// Means of the four quarters of the image, channel by channel, and their variances.
fn quarters(r: &Rendered) -> Vec<(f64, f64)> {
    let [width, height] = r.film.size();
    let (mean, variance) = (r.film.mean(), r.film.variance());
    let mut sums = [(0.0, 0.0); 12];
    for (i, (m, v)) in mean.iter().zip(&variance).enumerate() {
        let quarter = usize::from(i % width >= width / 2) + 2 * usize::from(i / width >= height / 2);
        for c in 0..3 {
            sums[3 * quarter + c].0 += f64::from(m[c]);
            sums[3 * quarter + c].1 += f64::from(v[c]);
        }
    }
    let n = (width * height / 4) as f64;
    sums.iter().map(|(m, v)| (m / n, v / (n * n))).collect()
}

/// How often a test here fails though all is well: all its comparisons together.
const FALSE_ALARM: f64 = 5e-7;

/// Whether two renderings have the same mean, in every quarter and channel. False alarms: [`FALSE_ALARM`] over `comparisons`.
pub fn same_mean(a: &Rendered, b: &Rendered, comparisons: u32, what: &str) {
    let limit = bonferroni(FALSE_ALARM, 12 * comparisons);
    for (i, ((ma, va), (mb, vb))) in quarters(a).into_iter().zip(quarters(b)).enumerate() {
        let p = z_test(ma, va + vb, mb);
        assert!(p > limit, "{what}: quarter {}, channel {}: {ma} is not {mb}, p = {p:e}", i / 3, i % 3);
        // A comparison that could not see a missing third is none.
        assert!((va + vb).sqrt() < 0.06 * mb, "{what}: the noise hides everything: {} of {mb}", (va + vb).sqrt());
    }
}

/// All combinations of light sampling, lobe sampling, heuristic, roulette and splitting that differ in what they do, the
/// kinds of stratification going round.
fn combinations() -> Vec<Techniques> {
    let kinds =
        [Stratification::None, Stratification::Jittered, Stratification::LowDiscrepancy, Stratification::Sampler];
    let mut all = Vec::new();
    let joined = [MisHeuristic::None, MisHeuristic::Balance, MisHeuristic::Power].map(|mis| (true, mis));
    for (light_sampling, mis) in joined.into_iter().chain([(false, MisHeuristic::Power)]) {
        for lobe_sampling in [LobeSampling::Uniform, LobeSampling::Cosine, LobeSampling::Lobe] {
            for roulette in [None, Some(0.5)] {
                for split in [1, 3] {
                    let i = all.len();
                    let stratify = Stratify {
                        pixel: kinds[i % 4],
                        lens: kinds[(i / 2) % 4],
                        time: kinds[(i / 3) % 4],
                        light: kinds[(i + i / 4) % 4],
                        lobe: kinds[(i + i / 4 + i / 16) % 4],
                    };
                    all.push(Techniques { light_sampling, lobe_sampling, mis, stratify, roulette, split });
                }
            }
        }
    }
    for kind in kinds {
        all.push(Techniques { stratify: Stratify::all(kind), ..Techniques::default() });
    }
    all
}

#[test]
fn every_combination_of_switches_has_the_same_expectation() {
    let reference = run(room_in_motion(8, 1024, SamplerKind::PaddedSobol), 1024);
    let all = combinations();
    assert_eq!(all.len(), 52);
    for techniques in &all {
        let spp = if techniques.light_sampling { 400 } else { 800 };
        let mut scene = room_in_motion(8, spp, SamplerKind::Independent);
        scene.settings.sampler.seed = 77;
        scene.settings.integrator.techniques = *techniques;
        same_mean(&run(scene, spp), &reference, all.len() as u32, &format!("{techniques:?}"));
    }
}

/// Light that comes out of a translucent body elsewhere is found by every combination.
#[test]
fn switches_see_below_surfaces() {
    for alpha in [0.0, 0.4] {
        let reference = run(room_with_wax(8, 1024, SamplerKind::PaddedSobol, alpha), 1024);
        // Other directions through a rough skin are too noisy to show anything.
        let quiet = |t: &Techniques| alpha == 0.0 || t.lobe_sampling == LobeSampling::Lobe;
        let all: Vec<_> = combinations().into_iter().filter(quiet).step_by(5).collect();
        for techniques in &all {
            let spp = if techniques.light_sampling { 500 } else { 1000 };
            let mut scene = room_with_wax(8, spp, SamplerKind::Independent, alpha);
            scene.settings.sampler.seed = 79;
            scene.settings.integrator.techniques = *techniques;
            same_mean(&run(scene, spp), &reference, 2 * all.len() as u32, &format!("{alpha}: {techniques:?}"));
        }
    }
}

/// Each domain has a switch of its own: it changes the picture, and not its mean.
#[test]
fn every_domain_is_stratified_by_itself() {
    type Domain = fn(&mut Stratify) -> &mut Stratification;
    let domains: [(&str, Domain); 5] = [
        ("pixel", |s| &mut s.pixel),
        ("lens", |s| &mut s.lens),
        ("time", |s| &mut s.time),
        ("light", |s| &mut s.light),
        ("lobe", |s| &mut s.lobe),
    ];
    let reference = run(room_in_motion(8, 1024, SamplerKind::PaddedSobol), 1024);
    let picture = |stratify: Stratify| {
        let mut scene = room_in_motion(8, 256, SamplerKind::Independent);
        scene.settings.sampler.seed = 78;
        scene.settings.integrator.techniques.stratify = stratify;
        run(scene, 256)
    };
    let none = picture(Stratify::all(Stratification::None));
    let mut seen = vec![none.film.mean()];
    for (name, domain) in domains {
        for kind in [Stratification::Jittered, Stratification::LowDiscrepancy] {
            let mut stratify = Stratify::all(Stratification::None);
            *domain(&mut stratify) = kind;
            let r = picture(stratify);
            same_mean(&r, &reference, 10, &format!("{name}, {kind:?}"));
            assert!(!seen.contains(&r.film.mean()), "{name}, {kind:?} is one of those before");
            seen.push(r.film.mean());
        }
    }
}

/// The general loop and the fast one are the same estimator, bit for bit.
#[test]
fn the_default_switches_are_the_fast_loop() {
    let rooms = [room(16, 4, SamplerKind::PaddedSobol), room_with_wax(16, 4, SamplerKind::PaddedSobol, 0.0)];
    for scene in rooms {
        same_bits(scene);
    }
}

fn same_bits(mut scene: Scene) {
    scene.settings.integrator.max_depth = 8;
    scene.settings.color = ColorMode::Spectral;
    let world = World::build(scene).expect("a sound scene");
    let fast = PixelSampler::new(&world);
    let Integrator::Path(path) = fast.integrator else { panic!("not the fast loop") };
    let mut general = fast.clone();
    general.integrator = Integrator::SwitchedPath(SwitchedPath {
        max_depth: path.max_depth,
        regularize: path.regularize,
        techniques: Techniques::default(),
    });
    let mut sampler = Sampler::new(&world.settings().sampler);
    for i in 0..16 * 16 * 4 {
        let mut sample = |p: &PixelSampler<'_>| {
            let none = &mut steradian_integrator::record::NoRecord;
            p.sample(&mut sampler, [i % 16, i / 16 % 16], i / 256, none, &mut Scratch::default()).rgb.map(f32::to_bits)
        };
        assert_eq!(sample(&fast), sample(&general), "sample {i}");
    }
}

#[test]
fn a_point_light_needs_light_sampling() {
    let mut scene = room(4, 1, SamplerKind::Independent);
    let (intensity, scale) = white_light(1.0);
    scene.lights.push(Light::Point { position: Point3::new(0.0, 1.0, 0.0), intensity, scale });
    assert!(World::build(scene.clone()).is_ok());
    scene.settings.integrator.techniques.light_sampling = false;
    let error = World::build(scene).expect_err("a light that nobody finds");
    assert_eq!(error, Error::Settings(SettingsError::DeltaLight { count: 1 }));
    assert!(error.to_string().contains("no ray meets such a light by chance"), "{error}");
}

/// The point of each technique: less variance for the same number of samples. All are safe by a factor, measured once.
#[test]
fn techniques_reduce_the_variance() {
    let variance = |techniques: Techniques| {
        let mut scene = cornell(8, 64, ColorMode::Rgb, SamplerKind::Independent, LightSelection::Tree);
        scene.settings.integrator.techniques = techniques;
        // The median over pixels: edges of the lamp, which the camera sees, have a variance of their own.
        let mut variances: Vec<f32> = run(scene, 64).film.variance().iter().map(|v| v[1]).collect();
        variances.sort_by(f32::total_cmp);
        variances[variances.len() / 2]
    };
    let best = Techniques::default();
    let with = variance(best);
    let no_lights = variance(Techniques { light_sampling: false, ..best });
    let uniform = variance(Techniques { lobe_sampling: LobeSampling::Uniform, ..best });
    let split = variance(Techniques { split: 8, ..best });
    assert!(no_lights > 5.0 * with, "{no_lights} {with}");
    assert!(uniform > 1.05 * with, "{uniform} {with}");
    assert!(split < 0.9 * with, "{split} {with}");
}

/// Stratified samples of the same number are nearer to the truth, although their estimated variance does not know it.
#[test]
fn stratification_reduces_the_error() {
    let world = |kind: Stratification, spp: u32, seed: u64| {
        let mut scene = room(8, spp, SamplerKind::Independent);
        scene.settings.integrator.max_depth = 1;
        scene.settings.integrator.techniques.stratify = Stratify::all(kind);
        scene.settings.sampler.seed = seed;
        run(scene, spp).film.mean()
    };
    let truth = world(Stratification::LowDiscrepancy, 4096, 1);
    let error = |kind| {
        let mut sum = 0.0;
        for seed in 2..6 {
            let image = world(kind, 64, seed);
            sum += image.iter().zip(&truth).map(|(a, b)| f64::from((a[1] - b[1]) * (a[1] - b[1]))).sum::<f64>();
        }
        sum
    };
    let independent = error(Stratification::None);
    for kind in [Stratification::Jittered, Stratification::LowDiscrepancy] {
        let e = error(kind);
        assert!(e < 0.5 * independent, "{kind:?}: {e} against {independent}");
    }
}
