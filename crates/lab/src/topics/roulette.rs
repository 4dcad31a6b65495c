//! Russian roulette and splitting: efficiency 1/(variance x cost), with the cost in counted rays.

use super::prelude::*;
use crate::stage::{Rgb, Vertex, Weights};
use steradian_sampling::Sampler;
use steradian_scene::World;

const TOPIC: Topic = Topic::Roulette;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Russian roulette and splitting",
        "(The reading:) efficiency is 1/(V × cost). Roulette ends paths that matter little and raises the variance; splitting takes \
         several samples where most of the variance is.",
        "A path that meets albedo ρ at every bounce, finds light of 0 or 2 there, and survives with probability q: mean, variance and cost are known \
         in closed form. Then roulette of several strengths in a closed room, and 1 to 16 shadow rays for each camera ray in a picture \
         of penumbrae, with all rays counted.",
    );
    let best = walk(&mut e, setting);
    let room = room(&mut e, setting)?;
    let split = splitting(&mut e, setting)?;
    e.result = format!(
        "In the closed form, the survival probability with the best efficiency is {best:.2} for ρ = 0.5. In the room, {room} In penumbrae, \
         {split}"
    );
    Ok(e)
}

/// Mean, variance and bounces of the walk: `X = E + B (rho/q) X'`, with B = 1 with probability q, and E = 0 or 2.
fn theory(rho: f64, q: f64) -> (f64, f64, f64) {
    let mean = 1.0 / (1.0 - rho);
    // E[X^2] = E[E^2] + 2 rho E[X] + rho^2 / q E[X^2], with E[E^2] = 2.
    let square = (2.0 + 2.0 * rho * mean) / (1.0 - rho * rho / q);
    (mean, if rho * rho < q { square - mean * mean } else { f64::INFINITY }, 1.0 / (1.0 - q))
}

fn walk(e: &mut Experiment, setting: &Setting) -> f64 {
    let draws = setting.effort.pick(40_000u64, 400_000, 4_000_000);
    let rho = 0.5;
    let mut rng = Rng::new(setting.seed_for(TOPIC, 1), 1);
    let mut measured = Vec::new();
    let mut table = Table::new(
        "walk",
        format!("Albedo ρ = {rho}, {draws} paths for each survival probability q; the answer is 2."),
        &["q", "mean", "variance", "predicted", "bounces", "predicted", "efficiency"],
    );
    // Below q = 0.4 the fourth moment is infinite, and the variance cannot be judged by its own scatter.
    for q in [0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
        let (mean, variance, cost) = theory(rho, q);
        let (mut values, mut bounces) = (Vec::with_capacity(draws as usize), VarianceEstimator::default());
        for _ in 0..draws {
            // The light found at a bounce is itself uncertain: nothing or twice its mean.
            let coin = |rng: &mut Rng| if rng.f64() < 0.5 { 2.0 } else { 0.0 };
            let (mut sum, mut weight, mut n) = (coin(&mut rng), 1.0, 1u32);
            while rng.f64() < q {
                weight *= rho / q;
                sum += weight * coin(&mut rng);
                n += 1;
            }
            values.push(sum);
            bounces.add(f64::from(n));
        }
        let all: VarianceEstimator = values.iter().copied().collect();
        let (v, v_error) = variance_with_error(&values);
        e.claim(Claim::equal(TOPIC, format!("walk, q = {q}: unbiased"), mean, all.mean(), all.standard_error()));
        e.claim(Claim::equal(
            TOPIC,
            format!("walk, q = {q}: bounces 1/(1 − q)"),
            cost,
            bounces.mean(),
            bounces.standard_error(),
        ));
        if q >= 0.5 {
            e.claim(Claim::close(TOPIC, format!("walk, q = {q}: variance"), variance, v, v_error, 1e-9));
        }
        let efficiency = 1.0 / (v * bounces.mean());
        measured.push((q, efficiency));
        table.row([
            format!("{q}"),
            format!("{:.4}", all.mean()),
            format!("{v:.3}"),
            format!("{variance:.3}"),
            format!("{:.3}", bounces.mean()),
            format!("{cost:.3}"),
            format!("{efficiency:.3}"),
        ]);
    }
    let curve: Vec<(f64, f64)> = (26..=98)
        .map(|i| f64::from(i) / 100.0)
        .map(|q| {
            let (_, v, c) = theory(rho, q);
            (q, 1.0 / (v * c))
        })
        .collect();
    let best = curve.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |p| p.0);
    e.figure(
        Figure::new("walk", "Efficiency of the walk over its survival probability. At q ≤ ρ² the variance is infinite; at q → 1 the cost is.", Axis::linear("survival probability q"), Axis::linear("efficiency 1/(V × bounces)"))
            .with("measured", Mark::Dots, measured)
            .with("closed form", Mark::Line, curve),
    );
    e.table(table);
    best
}

/// Direct light at every bounce with roulette of a given strength; returns the light and the rays traced.
fn path(world: &World, pixel: [u32; 2], s: &mut Sampler, threshold: f32) -> (Rgb, u32) {
    let mut vertex = Vertex::of_pixel(world, pixel, s);
    let (mut light, mut beta, mut rays) = (vertex.emitted(), [1.0f32; 3], 1);
    for _ in 0..16 {
        let Vertex::Surface(p) = &vertex else { break };
        let direct = p.light(s.next_1d(), s.next_2d(), Weights::None);
        rays += 1;
        light = std::array::from_fn(|c| light[c] + beta[c] * direct[c]);
        let Some(sample) = p.sample(s.next_1d(), s.next_2d()) else { break };
        beta = std::array::from_fn(|c| beta[c] * sample.weight.0[c]);
        // Below the threshold a path survives with probability (largest throughput / threshold).
        let survival = (beta[0].max(beta[1]).max(beta[2]) / threshold).min(1.0);
        if survival <= 0.0 || s.next_1d() >= survival {
            break;
        }
        beta = beta.map(|b| b / survival);
        vertex = Vertex::trace(world, &p.spawn(sample.wi));
        rays += 1;
    }
    (light, rays)
}

fn room(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([16, 16], [48, 48], [96, 96]);
    let world = stage::room(size, 16).build()?;
    let spp = setting.effort.pick(16u32, 32, 128);
    let seed = setting.seed_for(TOPIC, 2);
    let mut points = Vec::new();
    let mut table = Table::new(
        "room",
        "A closed room, up to 16 bounces. A path survives with probability min(1, throughput/threshold).",
        &["threshold", "rays per path", "mean", "variance of one path", "efficiency"],
    );
    let mut means = Vec::new();
    for threshold in [1e-6f32, 0.1, 0.3, 0.6, 1.0, 1.5, 3.0, 6.0, 12.0] {
        let source = stage::sampler(&world, SamplerKind::Independent, spp, seed ^ u64::from(threshold.to_bits()));
        let pixels = stage::per_pixel(&world, setting.threads, &source, |pixel, s| {
            let (mut values, mut rays) = (VarianceEstimator::default(), 0u64);
            for i in 0..spp {
                s.start(pixel, i, 0);
                let (light, n) = path(&world, pixel, s, threshold);
                values.add(paint::luminance(light));
                rays += u64::from(n);
            }
            (values, rays)
        });
        let count = pixels.len() as f64;
        let mean = pixels.iter().map(|p| p.0.mean()).sum::<f64>() / count;
        let of_mean = pixels.iter().map(|p| p.0.variance_of_mean()).sum::<f64>() / (count * count);
        let variance = pixels.iter().map(|p| p.0.variance()).sum::<f64>() / count;
        let rays = pixels.iter().map(|p| p.1 as f64).sum::<f64>() / (count * f64::from(spp));
        let efficiency = 1.0 / (variance * rays);
        table.row([
            format!("{threshold}"),
            format!("{rays:.2}"),
            format!("{mean:.4}"),
            format!("{variance:.4}"),
            format!("{efficiency:.3}"),
        ]);
        points.push((f64::from(threshold), efficiency, rays));
        means.push((threshold, mean, of_mean));
    }
    let (_, reference, reference_variance) = means[0];
    for &(threshold, mean, variance) in &means[1..] {
        e.claim(Claim::equal(
            TOPIC,
            format!("room: roulette below {threshold} does not change the mean"),
            reference,
            mean,
            (variance + reference_variance).sqrt(),
        ));
    }
    let best = points.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0, 0.0));
    let gain = best.1 / points[0].1;
    e.claim(Claim::at_least(TOPIC, "room: efficiency of the best threshold over that of no roulette", 1.05, gain));
    e.figure(
        Figure::new(
            "room",
            "Efficiency over the threshold of roulette in a closed room.",
            Axis::log("threshold"),
            Axis::linear("efficiency 1/(V × rays)"),
        )
        .with("measured", Mark::LineDots, points[1..].iter().map(|p| (p.0, p.1)).collect()),
    );
    e.table(table);
    Ok(format!(
        "a threshold of {} is {gain:.2} times as efficient as no roulette ({:.1} rays per path against {:.1}).",
        best.0, best.2, points[0].2
    ))
}

fn splitting(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([32, 24], [64, 48], [128, 96]);
    let world = stage::wide_lamp_world(size)?;
    let spp = setting.effort.pick(16u32, 64, 256);
    let seed = setting.seed_for(TOPIC, 3);
    let splits = [1u32, 2, 4, 8, 16];
    let mut points = Vec::new();
    for &split in &splits {
        let source = stage::sampler(&world, SamplerKind::Independent, spp, seed ^ u64::from(split));
        let pixels = stage::per_pixel(&world, setting.threads, &source, |pixel, s| {
            let (mut values, mut rays) = (VarianceEstimator::default(), 0u64);
            for i in 0..spp {
                s.start(pixel, i, 0);
                let v = Vertex::of_pixel(&world, pixel, s);
                rays += 1;
                let mut sum = [0.0f32; 3];
                if let Vertex::Surface(p) = &v {
                    for _ in 0..split {
                        sum = stage::add(sum, p.light(s.next_1d(), s.next_2d(), Weights::None));
                        rays += 1;
                    }
                }
                values.add(paint::luminance(stage::add(v.emitted(), stage::scaled(sum, 1.0 / split as f32))));
            }
            (values.variance(), rays)
        });
        let count = pixels.len() as f64;
        let all: VarianceEstimator = pixels.iter().map(|p| p.0).collect();
        let rays = pixels.iter().map(|p| p.1 as f64).sum::<f64>() / (count * f64::from(spp));
        // The variance of a variance: of each pixel's from its samples, so that pixels need not be alike.
        points.push((f64::from(split), all.mean(), rays));
    }
    // V(s) = V1 + V2/s: two numbers from the ends foretell the middle.
    let (v1, v16) = (points[0].1, points[4].1);
    let within = (v1 - v16) * 16.0 / 15.0;
    let across = v1 - within;
    for &(s, v, _) in &points[1..4] {
        let predicted = across + within / s;
        e.claim(Claim::within(
            TOPIC,
            format!("splitting into {s} shadow rays: variance V₁ + V₂/s"),
            predicted,
            v,
            [0.7 * predicted, 1.3 * predicted],
        ));
    }
    let efficiency: Vec<(f64, f64)> = points.iter().map(|&(s, v, rays)| (s, 1.0 / (v * rays))).collect();
    let model = (0..=40)
        .map(|i| 16f64.powf(f64::from(i) / 40.0))
        .map(|s| (s, 1.0 / ((across + within / s) * (1.0 + s))))
        .collect();
    let optimum = (within / across.max(1e-12)).sqrt();
    let best = efficiency.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1.0, 1.0));
    let nearest = splits
        .iter()
        .copied()
        .map(f64::from)
        .min_by(|a, b| (a / optimum).ln().abs().total_cmp(&(b / optimum).ln().abs()))
        .unwrap_or(1.0);
    e.claim(Claim::within(
        TOPIC,
        "the most efficient number of shadow rays: √(V₂/V₁) when every ray costs the same",
        nearest,
        best.0,
        [nearest / 2.0, nearest * 2.0],
    ));
    e.figure(
        Figure::new("splitting", format!("Efficiency over the number of shadow rays for each camera ray. The two variances put the optimum at {optimum:.2}. Measured efficiency lies above the model because camera rays that \
             meet nothing need no shadow rays."), Axis::log("shadow rays per camera ray"), Axis::linear("efficiency 1/(V × rays)"))
            .with("measured", Mark::Dots, efficiency)
            .with("1/((V₁ + V₂/s)(1 + s))", Mark::Line, model),
    );
    Ok(format!(
        "{:.0} shadow ray{} per camera ray {} best; the variances foretell √(V₂/V₁) = {optimum:.2}.",
        best.0,
        if best.0 > 1.0 { "s" } else { "" },
        if best.0 > 1.0 { "are" } else { "is" }
    ))
}
