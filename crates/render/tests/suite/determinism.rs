//! The same bits for any number of threads, any grouping into passes, with and without an end in between.

use crate::scenes::*;
use std::sync::atomic::AtomicBool;
use steradian_render::{Plan, Quiet, render};
use steradian_sampling::SamplerKind;
use steradian_scene::{LightSelection, World};
use steradian_spectrum::ColorMode;

fn image(world: &World, spp: u32, threads: usize) -> Vec<[u32; 3]> {
    let plan = Plan { spp, threads, time_limit: None };
    let r = render(world, &plan, &Quiet, &AtomicBool::new(false));
    assert_eq!(r.bad_count, 0);
    r.film.mean().iter().map(|p| p.map(f32::to_bits)).collect()
}

#[test]
fn threads_do_not_show() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let world =
            World::build(cornell(40, 9, color, SamplerKind::PaddedSobol, LightSelection::Tree)).expect("a scene");
        let one = image(&world, 9, 1);
        assert_eq!(one, image(&world, 9, 2));
        assert_eq!(one, image(&world, 9, 7));
    }
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let whole =
        World::build(cornell(40, 4, ColorMode::Rgb, SamplerKind::ZSobol, LightSelection::Power)).expect("a scene");
    let whole = image(&whole, 4, 2);
    let mut scene = cornell(40, 4, ColorMode::Rgb, SamplerKind::ZSobol, LightSelection::Power);
    scene.settings.film.pixel_bounds = [7, 31, 5, 20];
    let crop = image(&World::build(scene).expect("a scene"), 4, 2);
    for y in 0..15 {
        for x in 0..24 {
            assert_eq!(crop[y * 24 + x], whole[(y + 5) * 40 + x + 7]);
        }
    }
}
