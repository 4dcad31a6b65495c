//! Parts of the light add up to the picture, and asking for them changes no bit of it.

use crate::scenes::*;
use std::sync::atomic::AtomicBool;
use steradian_render::*;
use steradian_sampling::SamplerKind;
use steradian_scene::{Handle, IntegratorKind, LightGroup, LightSelection, MisHeuristic, Scene, Techniques, World};
use steradian_spectrum::ColorMode;

/// A box with a lamp in a group and a sky in another.
fn scene(color: ColorMode, kind: IntegratorKind) -> Scene {
    let mut s = cornell(20, 16, color, SamplerKind::PaddedSobol, LightSelection::Tree);
    s.settings.integrator.kind = kind;
    environment(&mut s, 0.3);
    let [lamp, sky] = ["lamp", "sky"].map(|n| s.light_groups.push(LightGroup { name: n.to_owned() }));
    for light in s.primitives.iter_mut().filter_map(|p| p.area_light.as_mut()) {
        light.group = Some(lamp);
    }
    s.groups_of_lights = vec![Some(sky)];
    s
}

fn rendered(world: &World, list: &[Layer], spp: u32) -> (Rendered, Vec<(String, Vec<[f32; 3]>)>) {
    let layers = Layers::new(list.to_vec(), world);
    let identity = Identity::new();
    let label = Label { identity: &identity, note: &[] };
    let plan = Plan { spp, threads: 2, time_limit: None };
    let task = Task { world, plan, goals: Goals::default(), layers: &layers, label, resume: None };
    let r = run(task, &Quiet, &AtomicBool::new(false));
    let read = read_layers(&r.film, layers.names());
    (r, read)
}

fn total(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|&v| f64::from(v)).sum()
}

#[test]
fn parts_add_up_to_the_picture() {
    let switched = Techniques { mis: MisHeuristic::Balance, split: 3, ..Techniques::default() };
    for (color, kind, techniques) in [
        (ColorMode::Rgb, IntegratorKind::Path, Techniques::default()),
        (ColorMode::Spectral, IntegratorKind::Path, Techniques::default()),
        (ColorMode::Rgb, IntegratorKind::Path, switched),
        (ColorMode::Spectral, IntegratorKind::SimpleVolPath, Techniques::default()),
    ] {
        let mut s = scene(color, kind);
        s.settings.integrator.techniques = techniques;
        let world = World::build(s).unwrap();
        assert_eq!(light_groups(&world).0, ["lamp", "sky", "default"]);
        let sets: [&[Layer]; 3] = [
            &[Layer::Emission, Layer::Direct, Layer::Indirect],
            &[Layer::FoundByLobe, Layer::FoundByLight],
            &[Layer::Group(0), Layer::Group(1), Layer::Group(2)],
        ];
        let (plain, _) = rendered(&world, &[], 16);
        for set in sets {
            let (with, read) = rendered(&world, set, 16);
            assert_eq!(with.film.mean(), plain.film.mean(), "{set:?} change the picture");
            let sum: Vec<[f32; 3]> = (0..plain.film.mean().len())
                .map(|i| std::array::from_fn(|c| read.iter().map(|(_, p)| p[i][c]).sum()))
                .collect();
            for (a, b) in sum.iter().flatten().zip(plain.film.mean().iter().flatten()) {
                assert!((a - b).abs() < 1e-4 * (1.0 + b.abs()), "{kind:?} {set:?}: {a} and {b}");
            }
            let shares: Vec<f64> = read.iter().map(|(_, p)| total(p)).collect();
            let lonely = kind == IntegratorKind::SimpleVolPath && set.contains(&Layer::FoundByLight);
            let expected = |i: usize| !(lonely && i == 1 || set[i] == Layer::Group(2));
            assert!((0..set.len()).all(|i| (shares[i] > 0.0) == expected(i)), "{kind:?} {set:?}: {shares:?}");
        }
    }
}

#[test]
fn what_a_limit_takes_away_is_kept() {
    let mut s = scene(ColorMode::Rgb, IntegratorKind::Path);
    let free = World::build(s.clone()).unwrap();
    s.settings.film.max_component_value = 0.5;
    let limited = World::build(s).unwrap();
    let (whole, _) = rendered(&free, &[], 16);
    let (rest, read) = rendered(&limited, &[Layer::Clamped, Layer::Direct, Layer::Emission, Layer::Indirect], 16);
    assert_eq!(read[0].0, CLAMPED);
    let [all, left, taken] = [total(&whole.film.mean()), total(&rest.film.mean()), total(&read[0].1)];
    assert!(taken > 0.05 * all && (left + taken - all).abs() < 1e-4 * all, "{left} + {taken} of {all}");
    let parts: f64 = read[1..].iter().map(|(_, p)| total(p)).sum();
    assert!((parts - left).abs() < 1e-4 * all, "the other layers are limited as the picture is");
}

/// A handle of nothing: what has no group is in `default`.
#[test]
fn lights_without_names_are_groups_of_their_own() {
    let mut s = scene(ColorMode::Rgb, IntegratorKind::Path);
    s.light_groups = Default::default();
    for _ in 0..2 {
        s.light_groups.push(LightGroup { name: String::new() });
    }
    s.groups_of_lights = vec![Some(Handle::from_index(1))];
    let world = World::build(s).unwrap();
    let (names, lights) = light_groups(&world);
    assert_eq!(names, ["light1", "light2", "default"]);
    assert_eq!(lights, [0, 0, 1]);
}

/// The filter takes a third at least of what sticks out, says what it took, and leaves most of the light alone.
#[test]
fn the_outlier_filter_takes_fireflies_and_little_else() {
    let mut s = scene(ColorMode::Rgb, IntegratorKind::SimpleVolPath);
    s.settings.sampler.kind = SamplerKind::Independent;
    let world = World::build(s).unwrap();
    let (truth, _) = rendered(&world, &[], 4096);
    let (r, read) = rendered(&world, &[Layer::Outliers], 64);
    let (truth, noisy, taken) = (truth.film.mean(), r.film.mean(), &read[0].1);
    // What a person calls a firefly: a pixel that is far above the truth. Squared errors do not fall, for the filter takes true light too.
    let mean = (total(&truth) / (3.0 * truth.len() as f64)) as f32;
    let fireflies = |of: &dyn Fn(usize, usize) -> f32| {
        (0..truth.len()).filter(|&i| (0..3).any(|c| of(i, c) > truth[i][c] + mean)).count()
    };
    let before = fireflies(&|i, c| noisy[i][c]);
    let after = fireflies(&|i, c| noisy[i][c] - taken[i][c]);
    assert!(before >= 20 && 3 * after <= 2 * before, "{after} against {before}");
    let share = total(taken) / total(&truth);
    assert!(share.abs() < 0.4, "it took {share}");
}
