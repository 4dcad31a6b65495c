//! Penumbra revisited: brute force, path tracing, clumped and stratified samples for equal numbers of rays.

use super::prelude::*;
use crate::stage::{Rgb, Vertex, Weights};
use steradian_sampling::Sampler;
use steradian_sampling::sequence::regular_2d;
use steradian_scene::World;

const TOPIC: Topic = Topic::Penumbra;

/// The four pictures of the slides.
#[derive(Clone, Copy, PartialEq)]
enum Method {
    /// k x k fixed places of the pixel, s x s fixed points of the lamp from each.
    BruteForce { k: u32, s: u32 },
    /// A random place and a random point of the lamp for each ray.
    Random,
    /// As random, but all of a pixel's points of the lamp fall into one quarter of it, which is chosen at random.
    Clumped,
    /// One ray for each cell of the pixel and of the lamp.
    Stratified,
}

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Penumbra revisited",
        "We can get a similar result with much less computation: choose a random location within the pixel, at the first intersection \
         choose a random location on the area light source. Stratified sampling gives a better distribution of samples.",
        "One picture four times for the same number of rays, camera and shadow rays together, which are counted: k × k sub-pixels with \
         s × s shadow rays each, random rays, rays that clump (each pixel looks at one random quarter of the lamp only: as unlucky as \
         can be, and still unbiased), and stratified ones.",
    );
    let size = setting.effort.pick([36, 27], [120, 90], [200, 150]);
    let world = stage::penumbra_world(size, SamplerKind::Independent)?;
    let seed = setting.seed_for(TOPIC, 1);
    let reference_rays = setting.effort.pick(2_048, 2_048, 4_096);
    let truth =
        stage::render_counted(&world, SamplerKind::PaddedSobol, reference_rays / 2, seed ^ 9, setting.threads).0;
    let width = size[0] as usize;

    // 4 * (1 + 9) = 40 rays by brute force, 20 * 2 along paths.
    let brute = Method::BruteForce { k: 2, s: 3 };
    let methods = [
        ("brute force, 2 × 2 × (1 + 3 × 3) rays", "brute", brute, 4u32),
        ("path tracing, random", "random", Method::Random, 20),
        ("clumped", "clumped", Method::Clumped, 20),
        ("stratified", "stratified", Method::Stratified, 20),
    ];
    let mut table = Table::new(
        "rays",
        "Rays traced for each pixel that sees a surface, and the error that they leave.",
        &["method", "rays per pixel", "mean squared error", "rays for the error of the stratified picture"],
    );
    let mut shown = Vec::new();
    let mut results = Vec::new();
    for (name, id, method, n) in methods {
        let (picture, rays) = render(&world, setting, method, n, seed);
        let error = stage::mse(&picture, &truth);
        shown.push(paint::colour(id, format!("{name}: {rays:.0} rays per pixel, mse {error:.1e}"), width, &picture));
        results.push((name, rays, error));
    }
    shown.push(paint::colour("reference", "reference", width, &truth));
    e.pictures(shown);
    e.slider("random", "stratified", "40 rays per pixel, random and stratified.");
    e.slider("brute", "stratified", "40 rays per pixel: brute force and stratified paths.");
    let best = results[3].2;
    for (name, rays, error) in &results {
        // Random errors fall with the number of rays; brute force leaves steps that do not.
        let needed = if *name == methods[0].0 { "—".to_string() } else { format!("{:.0}", rays * error / best) };
        table.row([(*name).into(), format!("{rays:.1}"), format!("{error:.2e}"), needed]);
    }
    e.table(table);
    for (name, rays, _) in &results {
        e.claim(Claim::within(TOPIC, format!("{name}: rays per pixel, counted"), 40.0, *rays, [39.99, 40.01]));
    }
    e.claim(Claim::at_most(TOPIC, "squared error, stratified over random", 0.7, results[3].2 / results[1].2));
    e.claim(Claim::at_least(TOPIC, "squared error, clumped over random", 1.2, results[2].2 / results[1].2));
    e.claim(Claim::at_most(TOPIC, "squared error, stratified over brute force", 1.0, results[3].2 / results[0].2));
    unbiased(&mut e, &world, setting, &truth);
    falling(&mut e, &world, setting, &truth);
    e.result = format!(
        "For 40 rays per pixel the squared errors are {:.1e} (brute force), {:.1e} (random), {:.1e} (clumped) and {:.1e} (stratified).",
        results[0].2, results[1].2, results[2].2, results[3].2
    );
    Ok(e)
}

fn estimate(world: &World, pixel: [u32; 2], s: &mut Sampler, method: Method, quarter: [f32; 2]) -> (Rgb, u32) {
    let v = Vertex::of_pixel(world, pixel, s);
    let Vertex::Surface(p) = &v else { return (v.emitted(), 1) };
    let (u, mut u2) = (s.next_1d(), s.next_2d());
    if method == Method::Clumped {
        u2 = [0.5 * (u2[0] + quarter[0]), 0.5 * (u2[1] + quarter[1])];
    }
    (stage::add(p.emitted, p.light(u, u2, Weights::None)), 2)
}

/// The picture and the rays per pixel that sees a surface (all of them do here).
fn render(world: &World, setting: &Setting, method: Method, n: u32, seed: u64) -> (Vec<Rgb>, f64) {
    let kind = if method == Method::Stratified { SamplerKind::Stratified } else { SamplerKind::Independent };
    let source = stage::sampler(world, kind, n, seed);
    let pixels = stage::per_pixel(world, setting.threads, &source, |pixel, sampler| {
        let (mut sum, mut rays) = ([0.0f32; 3], 0u32);
        if let Method::BruteForce { k, s } = method {
            for i in 0..k * k {
                let [x, y] = regular_2d(i, k, k);
                let v =
                    Vertex::at(world, steradian_math::Point2::new(pixel[0] as f32 + x, pixel[1] as f32 + y), sampler);
                rays += 1;
                sum = stage::add(sum, v.emitted());
                if let Vertex::Surface(p) = &v {
                    for j in 0..s * s {
                        sum = stage::add(
                            sum,
                            stage::scaled(p.light(0.5, regular_2d(j, s, s), Weights::None), 1.0 / (s * s) as f32),
                        );
                        rays += 1;
                    }
                }
            }
            return (stage::scaled(sum, 1.0 / (k * k) as f32), rays);
        }
        sampler.start(pixel, n, 0);
        let quarter = [0, 1].map(|_| if sampler.next_1d() < 0.5 { 0.0 } else { 1.0 });
        for i in 0..n {
            sampler.start(pixel, i, 0);
            let (value, traced) = estimate(world, pixel, sampler, method, quarter);
            sum = stage::add(sum, value);
            rays += traced;
        }
        (stage::scaled(sum, 1.0 / n as f32), rays)
    });
    // Pixels of sky or lamp have no shadow rays: they are left out of the count.
    let most = pixels.iter().map(|p| p.1).max().unwrap_or(0);
    (pixels.into_iter().map(|p| p.0).collect(), f64::from(most))
}

/// Each random method has the same expectation: mean over the picture, over independent repeats.
fn unbiased(e: &mut Experiment, world: &World, setting: &Setting, truth: &[Rgb]) {
    let repeats = 12;
    let mean = |p: &[Rgb]| p.iter().map(|c| paint::luminance(*c)).sum::<f64>() / p.len() as f64;
    let expected = mean(truth);
    for (name, method) in [("random", Method::Random), ("clumped", Method::Clumped), ("stratified", Method::Stratified)]
    {
        let all: VarianceEstimator = (0..repeats)
            .map(|r| mean(&render(world, setting, method, 4, setting.seed_for(TOPIC, 100 + r)).0))
            .collect();
        // The reference's own mean is off by no more than its share of the error.
        let half = t_limit(repeats) * all.standard_error() + 2e-4 * expected;
        e.claim(Claim::within(
            TOPIC,
            format!("{name}: mean of the picture against the reference (unbiased)"),
            expected,
            all.mean(),
            [expected - half, expected + half],
        ));
    }
}

fn falling(e: &mut Experiment, world: &World, setting: &Setting, truth: &[Rgb]) {
    let counts: &[u32] = setting.effort.pick(&[4, 16, 64], &[4, 16, 64, 256], &[4, 16, 64, 256, 1024]);
    let mut figure = Figure::new(
        "error",
        "Squared error of the picture over all rays traced per pixel.",
        Axis::log("rays per pixel"),
        Axis::log("mean squared error"),
    );
    for (name, method) in [("random", Method::Random), ("clumped", Method::Clumped), ("stratified", Method::Stratified)]
    {
        let points: Vec<ErrorAt> = counts
            .iter()
            .map(|&n| {
                stage::error_at(
                    2.0 * f64::from(n),
                    &render(world, setting, method, n, setting.seed_for(TOPIC, 3)).0,
                    truth,
                    false,
                )
            })
            .collect();
        if method == Method::Random {
            e.claim(Claim::falls(TOPIC, "random: slope of the squared error over rays", -1.0, &points));
        }
        figure = figure.with(name, Mark::LineDots, squares(&points));
    }
    let brute: Vec<(f64, f64)> = [(1u32, 1u32), (2, 2), (2, 4), (4, 4), (4, 8)]
        .into_iter()
        .map(|(k, s)| {
            let (picture, rays) = render(world, setting, Method::BruteForce { k, s }, k * k, 0);
            (rays, stage::mse(&picture, truth))
        })
        .collect();
    e.figure(figure.with("brute force", Mark::LineDots, brute));
}
