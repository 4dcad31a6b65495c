//! Soft shadows: a point of light, a lamp, and the width of the penumbra against geometry.

use super::prelude::*;
use crate::stage::{Builder, Rgb, Vertex, Weights};
use steradian_math::{Point2, Point3, Ray};
use steradian_sampling::sequence::regular_2d;
use steradian_scene::World;

const TOPIC: Topic = Topic::SoftShadows;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Soft shadows",
        "Distributing rays over light source area gives soft shadows.",
        "A lamp of width w hangs at height h over a floor, and a plate with a straight edge at height z. Similar triangles make the \
         penumbra w z/(h − z) wide. Its width is measured with random shadow rays. Then a picture with a point of light, with the same \
         s × s points of the lamp for every pixel, and with random ones.",
    );
    let worst = widths(&mut e, setting)?;
    let line = pictures(&mut e, setting)?;
    e.result = format!("The penumbra is w z/(h − z) wide, to {:.2} % at worst. {line}", 100.0 * worst);
    Ok(e)
}

fn widths(e: &mut Experiment, setting: &Setting) -> Result<f64, Error> {
    let samples = setting.effort.pick(200_000u32, 1_000_000, 10_000_000);
    let height = 4.0f64;
    let mut measured = Vec::new();
    let mut table = Table::new(
        "widths",
        "Width of the penumbra under a lamp at height 4.",
        &["lamp width", "edge height", "w z/(h − z)", "measured", "± (95 %)"],
    );
    let mut worst = 0.0f64;
    for (i, (lamp, edge)) in
        [(1.0, 0.5), (1.0, 1.0), (1.0, 2.0), (1.0, 3.0), (0.25, 2.0), (2.0, 2.0)].into_iter().enumerate()
    {
        let mut b = Builder::new([1, 1], 1);
        let m = b.diffuse([0.5; 3]);
        b.quad(
            [
                [-60.0, edge as f32, -60.0],
                [-60.0, edge as f32, 60.0],
                [0.0, edge as f32, 60.0],
                [0.0, edge as f32, -60.0],
            ],
            m,
        );
        let world = b.build()?;
        let predicted = lamp * edge / (height - edge);
        let reach = predicted;
        let parts = parallel::map(setting.threads, 16, |part| {
            let mut rng = Rng::new(setting.seed_for(TOPIC, i as u64), part as u64);
            let mut moment = VarianceEstimator::default();
            for _ in 0..samples / 16 {
                let x = (2.0 * rng.f64() - 1.0) * reach;
                let on_lamp = [lamp * (rng.f64() - 0.5), height, rng.f64() - 0.5];
                let from = Point3::new(x as f32, 0.0, 0.0);
                let to = Point3::new(on_lamp[0] as f32, on_lamp[1] as f32, on_lamp[2] as f32);
                let ray = Ray { o: from, d: to - from, t_max: 0.9999, time: 0.0 };
                let visible = f64::from(!world.occluded(&ray));
                // Against a sharp shadow that ends at x = 0. A ramp of width W differs from it with moment -W²/24.
                moment.add(-24.0 * 2.0 * reach * x * (visible - f64::from(x > 0.0)));
            }
            moment
        });
        let mut square = VarianceEstimator::default();
        parts.iter().for_each(|p| square.merge(p));
        let width = square.mean().max(0.0).sqrt();
        let error = 0.5 * square.standard_error() / width;
        e.claim(Claim::equal(
            TOPIC,
            format!("penumbra of a lamp {lamp} wide at height 4, edge at height {edge}: w z/(h − z)"),
            predicted,
            width,
            error,
        ));
        worst = worst.max((width / predicted - 1.0).abs());
        if lamp == 1.0 {
            measured.push((edge, width));
        }
        table.row([
            format!("{lamp}"),
            format!("{edge}"),
            format!("{predicted:.4}"),
            format!("{width:.4}"),
            format!("{:.4}", 1.96 * error),
        ]);
    }
    let theory = (1..=62).map(|i| f64::from(i) * 0.05).map(|z| (z, z / (height - z))).collect();
    e.figure(
        Figure::new(
            "width",
            "Width of the penumbra over the height of the edge; the lamp is 1 wide and hangs at 4.",
            Axis::linear("height of the edge"),
            Axis::linear("width of the penumbra"),
        )
        .with("measured", Mark::Dots, measured)
        .with("w z/(h − z)", Mark::Line, theory),
    );
    e.table(table);
    Ok(worst)
}

/// The reflected light of one point of the lamp for each camera ray.
fn average(world: &World, setting: &Setting, kind: SamplerKind, spp: u32, salt: u64) -> Vec<Rgb> {
    let seed = setting.seed_for(TOPIC, 100) ^ salt;
    stage::average(world, setting.threads, kind, spp, seed, |pixel, s| {
        let v = Vertex::of_pixel(world, pixel, s);
        let direct = match &v {
            Vertex::Surface(p) => p.light(s.next_1d(), s.next_2d(), Weights::None),
            Vertex::Sky(_) => [0.0; 3],
        };
        stage::add(v.emitted(), direct)
    })
}

/// Four sub-pixels, and the same s x s points of the lamp for all of them.
fn grid(world: &World, setting: &Setting, s: u32) -> Vec<Rgb> {
    let source = stage::sampler(world, SamplerKind::Independent, 1, 0);
    stage::per_pixel(world, setting.threads, &source, |pixel, sampler| {
        let mut sum = [0.0f32; 3];
        for i in 0..4 {
            let [x, y] = regular_2d(i, 2, 2);
            let film = Point2::new(pixel[0] as f32 + x, pixel[1] as f32 + y);
            let v = Vertex::at(world, film, sampler);
            if let Vertex::Surface(p) = &v {
                for j in 0..s * s {
                    let light = p.light(0.5, regular_2d(j, s, s), Weights::None);
                    sum = stage::add(sum, stage::scaled(light, 1.0 / (s * s) as f32));
                }
            }
            sum = stage::add(sum, v.emitted());
        }
        stage::scaled(sum, 0.25)
    })
}

fn pictures(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([36, 27], [120, 90], [240, 180]);
    let width = size[0] as usize;
    let world = stage::penumbra_world(size, SamplerKind::Independent)?;
    let point = stage::penumbra(size, SamplerKind::Independent, false).build()?;
    let truth_spp = setting.effort.pick(1_024, 1_024, 4_096);
    let truth = average(&world, setting, SamplerKind::PaddedSobol, truth_spp, 9);
    let error = |picture: &[Rgb]| stage::mse(picture, &truth);
    let hard = average(&point, setting, SamplerKind::PaddedSobol, 16, 0);
    let random = average(&world, setting, SamplerKind::Independent, 16, 0);
    let stratified = average(&world, setting, SamplerKind::Stratified, 16, 0);
    let mut shown = vec![paint::colour("point", "a point of light: hard shadows", width, &hard)];
    let mut grids = Vec::new();
    for s in [1u32, 2, 4] {
        let picture = grid(&world, setting, s);
        grids.push(error(&picture));
        shown.push(paint::colour(
            &format!("grid-{s}"),
            format!("the same {s} × {s} points of the lamp, 2 × 2 per pixel: mse {:.1e}", error(&picture)),
            width,
            &picture,
        ));
    }
    let (h, r, t) = (error(&hard), error(&random), error(&stratified));
    let caption = format!("16 rays, a random point of the lamp each: mse {r:.1e}");
    shown.push(paint::colour("random", caption, width, &random));
    shown.push(paint::colour("stratified", format!("16 rays, stratified: mse {t:.1e}"), width, &stratified));
    shown.push(paint::colour("reference", "reference", width, &truth));
    e.pictures(shown);
    e.slider("grid-2", "stratified", "20 rays per pixel with 2 × 2 fixed points of the lamp, and 32 with random ones.");
    e.claim(Claim::at_most(
        TOPIC,
        "picture: squared error of 2 × 2 points of the lamp over that of its centre alone",
        0.8,
        grids[1] / grids[0],
    ));
    e.claim(Claim::at_most(
        TOPIC,
        "picture: squared error of 16 stratified rays over that of 16 random ones",
        0.8,
        t / r,
    ));
    e.claim(Claim::at_least(
        TOPIC,
        "picture: squared error of the point of light over that of 16 stratified lamp samples",
        2.0,
        h / t,
    ));
    Ok(format!(
        "A point of light leaves a squared error of {h:.1e} that no number of rays removes; 16 rays to random points of the lamp have {r:.1e}, \
         stratified {t:.1e}."
    ))
}
