//! Gloss and translucency: the mirror-like approximation against rays distributed over the lobe.

use super::prelude::*;
use crate::stage::{Builder, Rgb, Vertex, Weights};
use steradian_scene::World;

const TOPIC: Topic = Topic::Gloss;
/// Index of refraction of the pane.
const GLASS: f32 = 1.5;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Gloss and translucency",
        "The mirror-like form of reflection, when used to approximate glossy surfaces, introduces a kind of aliasing, because we are \
         under-sampling reflection (and refraction).",
        "A rough metal plate reflects shining stripes, and a pane of rough glass stands before them. Each is drawn with one ray in the \
         ideal direction and with 1, 4, 16 and 64 rays distributed over the lobe.",
    );
    let gloss = compare(&mut e, setting, "gloss", &plate(setting)?, None)?;
    let translucency = compare(&mut e, setting, "translucency", &pane(setting)?, Some(GLASS))?;
    let roughness = rings(&mut e, setting)?;
    e.result = format!(
        "More mirror-like rays do not help: 64 of them leave {gloss:.0} times (glass: {translucency:.0} times) the squared error of 64 rays \
         over the lobe, whose error falls with slope −1. {roughness}"
    );
    Ok(e)
}

fn size(setting: &Setting) -> [u32; 2] {
    setting.effort.pick([36, 24], [120, 80], [240, 160])
}

fn stripes(b: &mut Builder, z: f32, low: f32, high: f32) {
    let colours = [
        [1.6, 0.25, 0.15],
        [0.03; 3],
        [0.2, 0.9, 0.3],
        [0.03; 3],
        [0.25, 0.4, 1.6],
        [0.03; 3],
        [1.2, 1.1, 0.4],
        [0.03; 3],
    ];
    for (i, rgb) in colours.into_iter().enumerate() {
        let (a, c) = (-2.4 + 0.6 * i as f32, -2.4 + 0.6 * (i + 1) as f32);
        b.coloured_lamp([[a, low, z], [a, high, z], [c, high, z], [c, low, z]], rgb);
    }
}

fn plate(setting: &Setting) -> Result<World, Error> {
    let mut b = Builder::new(size(setting), 1);
    b.camera([0.0, 1.3, -4.0], [0.0, 0.35, 0.6], 34.0);
    let metal = b.metal([0.85, 0.83, 0.8], 0.12);
    b.quad([[-4.0, 0.0, -3.0], [-4.0, 0.0, 1.99], [4.0, 0.0, 1.99], [4.0, 0.0, -3.0]], metal);
    stripes(&mut b, 2.0, 0.0, 1.6);
    Ok(b.build()?)
}

fn pane(setting: &Setting) -> Result<World, Error> {
    let mut b = Builder::new(size(setting), 1);
    b.camera([0.0, 0.8, -4.0], [0.0, 0.8, 0.0], 30.0);
    let glass = b.glass(GLASS, 0.15);
    b.quad([[-0.2, 0.1, 0.0], [-0.2, 1.5, 0.0], [1.3, 1.5, 0.0], [1.3, 0.1, 0.0]], glass);
    stripes(&mut b, 1.0, -0.6, 2.2);
    Ok(b.build()?)
}

fn lobe(world: &World, setting: &Setting, kind: SamplerKind, rays: u32, seed: u64) -> Vec<Rgb> {
    stage::average(world, setting.threads, kind, rays, seed, |pixel, s| {
        let v = Vertex::of_pixel(world, pixel, s);
        match &v {
            Vertex::Surface(p) => stage::add(p.emitted, p.lobe(s.next_1d(), s.next_2d(), Weights::None)),
            Vertex::Sky(c) => *c,
        }
    })
}

fn mirror(world: &World, setting: &Setting, refraction: Option<f32>, rays: u32, seed: u64) -> Vec<Rgb> {
    stage::average(world, setting.threads, SamplerKind::Stratified, rays, seed, |pixel, s| {
        let v = Vertex::of_pixel(world, pixel, s);
        match &v {
            Vertex::Surface(p) => stage::add(p.emitted, p.ideal(refraction)),
            Vertex::Sky(c) => *c,
        }
    })
}

fn compare(
    e: &mut Experiment,
    setting: &Setting,
    name: &str,
    world: &World,
    refraction: Option<f32>,
) -> Result<f64, Error> {
    let seed = setting.seed_for(TOPIC, name.len() as u64);
    let width = size(setting)[0] as usize;
    let truth = lobe(world, setting, SamplerKind::PaddedSobol, setting.effort.pick(1_024, 1_024, 4_096), seed ^ 9);
    let ideal = mirror(world, setting, refraction, 64, seed);
    let mut shown = vec![paint::colour(
        &format!("{name}-ideal"),
        format!("{name}: the ideal direction only, 64 rays"),
        width,
        &ideal,
    )];
    let counts = [1u32, 4, 16, 64];
    let mut points = Vec::new();
    let mut mirrors = Vec::new();
    for n in counts {
        let picture = lobe(world, setting, SamplerKind::Independent, n, seed);
        points.push(stage::error_at(f64::from(n), &picture, &truth, false));
        mirrors.push((f64::from(n), stage::mse(&mirror(world, setting, refraction, n, seed ^ 1), &truth)));
        if n >= 4 {
            shown.push(paint::colour(
                &format!("{name}-{n}"),
                format!("{name}: {n} rays over the lobe"),
                width,
                &picture,
            ));
        }
    }
    shown.push(paint::colour(&format!("{name}-reference"), format!("{name}: reference"), width, &truth));
    e.pictures(shown);
    e.slider(
        &format!("{name}-ideal"),
        &format!("{name}-64"),
        "64 rays each: in the ideal direction, and over the lobe.",
    );
    e.claim(Claim::falls(TOPIC, format!("{name}: squared error of rays over the lobe, slope −1"), -1.0, &points));
    let stays = mirrors[3].1 / mirrors[1].1;
    e.claim(Claim::at_least(
        TOPIC,
        format!("{name}: squared error of 64 ideal rays over that of 4: a bias does not fall"),
        0.7,
        stays,
    ));
    let ratio = mirrors[3].1 / points[3].mean_square;
    e.claim(Claim::at_least(
        TOPIC,
        format!("{name}: squared error of the ideal direction over that of the lobe, 64 rays each"),
        2.0,
        ratio,
    ));
    e.figure(
        Figure::new(
            &format!("{name}-error"),
            format!("{name}: squared error over rays per pixel."),
            Axis::log("rays per pixel"),
            Axis::log("mean squared error"),
        )
        .with("distributed over the lobe", Mark::LineDots, squares(&points))
        .with("ideal direction", Mark::LineDots, mirrors),
    );
    Ok(ratio)
}

/// The same plate from nearly a mirror to satin: how much error the ideal direction makes.
fn rings(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let small = setting.effort.pick([30, 20], [60, 40], [120, 80]);
    let mut points = Vec::new();
    for alpha in [0.01f32, 0.03, 0.1, 0.3] {
        let mut b = Builder::new(small, 1);
        b.camera([0.0, 1.3, -4.0], [0.0, 0.35, 0.6], 34.0);
        let metal = b.metal([0.85, 0.83, 0.8], alpha);
        b.quad([[-4.0, 0.0, -3.0], [-4.0, 0.0, 1.99], [4.0, 0.0, 1.99], [4.0, 0.0, -3.0]], metal);
        stripes(&mut b, 2.0, 0.0, 1.6);
        let world = b.build()?;
        let seed = setting.seed_for(TOPIC, 50);
        let truth = lobe(&world, setting, SamplerKind::PaddedSobol, setting.effort.pick(512, 512, 4_096), seed);
        points.push((f64::from(alpha), stage::mse(&mirror(&world, setting, None, 64, seed), &truth).sqrt()));
    }
    let rising = points.windows(2).filter(|w| w[1].1 > w[0].1).count() as f64;
    e.claim(Claim::within(
        TOPIC,
        "steps of roughness (0.01, 0.03, 0.1, 0.3) at which the error of the mirror rises",
        3.0,
        rising,
        [3.0, 3.0],
    ));
    let line =
        format!("The mirror's rms error rises from {:.3} at roughness 0.01 to {:.3} at 0.3.", points[0].1, points[3].1);
    e.figure(
        Figure::new(
            "roughness",
            "Rms error of the mirror-like approximation over the roughness that it ignores.",
            Axis::log("roughness (microfacet width)"),
            Axis::log("rms error"),
        )
        .with("ideal direction", Mark::LineDots, points),
    );
    Ok(line)
}
