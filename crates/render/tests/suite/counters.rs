//! Counters: right, the same for any number of threads, and without influence on the image.

use crate::scenes::*;
use std::sync::atomic::AtomicBool;
use steradian_integrator::record::Counters;
use steradian_math::Vec3;
use steradian_render::{Plan, Quiet, Rendered, render, render_counted};
use steradian_sampling::SamplerKind;
use steradian_scene::{LightSelection, Primitive, Scene, Techniques, World};
use steradian_spectrum::ColorMode;

fn counted(scene: &Scene, spp: u32, threads: usize) -> (Rendered, Counters) {
    let world = World::build(scene.clone()).expect("a sound scene");
    render_counted(&world, &Plan { spp, threads, time_limit: None }, &Quiet, &AtomicBool::new(false))
}

#[test]
fn counting_changes_nothing() {
    let scene = cornell(20, 4, ColorMode::Rgb, SamplerKind::PaddedSobol, LightSelection::Tree);
    let (image, counts) = counted(&scene, 4, 1);
    let world = World::build(scene.clone()).expect("a sound scene");
    let plain = render(&world, &Plan { spp: 4, threads: 2, time_limit: None }, &Quiet, &AtomicBool::new(false));
    assert_eq!(image.film.mean(), plain.film.mean());
    assert_eq!((image.rays, counts.rays), (plain.rays, plain.rays));
    assert_eq!(counts, counted(&scene, 4, 3).1);
    assert_eq!(counts.path_lengths.iter().sum::<u64>(), 20 * 20 * 4);
    assert!(counts.box_tests > counts.rays.total() && counts.primitive_tests > counts.rays.total() / 2);
}

/// In a ball that shines there is one primitive, which every ray tests, and every path has the length it may have.
#[test]
fn what_is_known_is_counted_so() {
    let mut s = empty(4, 3, 5, ColorMode::Rgb, SamplerKind::Independent);
    s.settings.integrator.techniques = Techniques { roulette: None, ..Techniques::default() };
    let m = diffuse(&mut s, [0.5; 3]);
    let shell = sphere(1.0, Vec3::default(), m);
    s.primitives.push(Primitive { area_light: Some(area_light(1.0, true)), ..shell });
    let (_, counts) = counted(&s, 3, 2);
    let paths = 4 * 4 * 3;
    assert_eq!((counts.rays.camera, counts.rays.scattered, counts.rays.shadow), (paths, 5 * paths, 5 * paths));
    assert_eq!((counts.box_tests, counts.primitive_tests), (11 * paths, 11 * paths));
    assert_eq!((counts.path_lengths[5], counts.mean_path_length()), (paths, 5.0));

    // The same with splitting: three paths from the first hit of each.
    s.settings.integrator.techniques.split = 3;
    let (_, counts) = counted(&s, 3, 2);
    assert_eq!((counts.path_lengths[5], counts.mean_path_length()), (3 * paths, 5.0));
    assert_eq!((counts.rays.scattered, counts.rays.shadow), (15 * paths, 13 * paths));
}
