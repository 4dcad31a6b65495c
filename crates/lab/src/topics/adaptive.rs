//! Adaptive sampling: the classical contrast criterion and the statistical one, where they send their rays, what they gain,
//! and the bias of stopping early.

use super::prelude::*;
use crate::stage::{Rgb, Vertex, Weights};
use steradian_sampling::Sampler;
use steradian_scene::World;

const TOPIC: Topic = Topic::Adaptive;
/// Rays per pixel before the first decision.
const PILOT: u32 = 4;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Adaptive sampling",
        "Casting many rays per pixel can be unnecessarily costly. If there are no rapid changes in intensity at the pixel, maybe only a few \
         samples are needed. When do we decide to cast more rays in a particular area?",
        "Four rays per pixel, then more where the contrast (I_max − I_min)/(I_max + I_min) of the pixel and its neighbours passes a threshold \
         (Mitchell 1987), or where the estimated variance is largest. The first rays decide and are then thrown away, or kept: keeping \
         them is the bias of stopping early, which is known in closed form for a pixel that an edge crosses.",
    );
    let (contrast, statistical) = pictures(&mut e, setting)?;
    let bias = stopping(&mut e, setting);
    e.result = format!(
        "At equal rays, the contrast criterion has {contrast:.2} and the statistical one {statistical:.2} times the squared error of uniform \
         sampling. Keeping the rays that decided makes a pixel of which 1/20 is covered {bias:.0} % too dark or bright; with fresh rays after \
         the decision the mean is right."
    );
    e.answer(
        3,
        format!("Where the contrast between the rays of a pixel and of its neighbours, or their estimated variance, is high: edges, textures, penumbrae. At equal rays that leaves {contrast:.2} (contrast) and {statistical:.2} (variance) of the squared error. The rays that decide must not be counted twice, or the mean shifts."),
    );
    Ok(e)
}

fn shade(world: &World, pixel: [u32; 2], s: &mut Sampler) -> Rgb {
    let v = Vertex::of_pixel(world, pixel, s);
    match &v {
        Vertex::Surface(p) => stage::add(p.emitted, p.light(s.next_1d(), s.next_2d(), Weights::None)),
        Vertex::Sky(c) => *c,
    }
}

/// What the pilot rays of a pixel told.
#[derive(Clone, Copy)]
struct Pilot {
    low: f64,
    high: f64,
    variance: f64,
}

fn pictures(e: &mut Experiment, setting: &Setting) -> Result<(f64, f64), Error> {
    let size = setting.effort.pick([40, 30], [120, 90], [280, 210]);
    let (width, height) = (size[0] as usize, size[1] as usize);
    let mut b = stage::penumbra(size, SamplerKind::Independent, true);
    // Flat colours: the rapid changes are edges and shadows.
    let flat = b.diffuse([0.7; 3]);
    if let Some(floor) = b.scene.primitives.first_mut() {
        floor.material = flat;
    }
    let world = b.build()?;
    let seed = setting.seed_for(TOPIC, 1);
    let truth = stage::average(
        &world,
        setting.threads,
        SamplerKind::PaddedSobol,
        setting.effort.pick(1_024, 1_024, 4_096),
        seed ^ 9,
        |p, s| shade(&world, p, s),
    );
    let source = stage::sampler(&world, SamplerKind::Independent, PILOT, seed);
    let pilots: Vec<Pilot> = stage::per_pixel(&world, setting.threads, &source, |pixel, s| {
        let mut all = VarianceEstimator::default();
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for i in 0..PILOT {
            s.start(pixel, i, 0);
            let v = paint::luminance(shade(&world, pixel, s));
            all.add(v);
            (low, high) = (low.min(v), high.max(v));
        }
        Pilot { low, high, variance: all.variance() }
    });
    let around = |at: usize, f: &dyn Fn(&Pilot)| {
        let (x, y) = ((at % width) as i64, (at / width) as i64);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let (px, py) = (x + dx, y + dy);
            if (0..width as i64).contains(&px) && (0..height as i64).contains(&py) {
                f(&pilots[py as usize * width + px as usize]);
            }
        }
    };
    // The contrast of the pixel and its neighbours; beyond 0.3 it gets the large share of the rays.
    let contrast: Vec<f64> = (0..pilots.len())
        .map(|at| {
            let ends = std::cell::Cell::new((f64::INFINITY, 0.0f64));
            around(at, &|p| ends.set((ends.get().0.min(p.low), ends.get().1.max(p.high))));
            let (low, high) = ends.get();
            if high > 0.0 { (high - low) / (high + low) } else { 0.0 }
        })
        .collect();
    // The deviation of the pixel and its neighbours: rays in proportion to it are best (Neyman 1934).
    let deviation: Vec<f64> = (0..pilots.len())
        .map(|at| {
            let sum = std::cell::Cell::new((0.0, 0.0));
            around(at, &|p| sum.set((sum.get().0 + p.variance, sum.get().1 + 1.0)));
            (sum.get().0 / sum.get().1).sqrt()
        })
        .collect();
    let budget = setting.effort.pick(32.0, 32.0, 64.0f64);
    let spread = |wish: &[f64]| -> Vec<u32> {
        // Every pixel gets two fresh rays at least; the rest go where they are wished for.
        let total: f64 = wish.iter().sum::<f64>().max(1e-12);
        let rest = (budget - f64::from(PILOT) - 2.0) * wish.len() as f64;
        wish.iter().map(|w| 2 + (w / total * rest) as u32).collect()
    };
    let by_contrast = spread(&contrast.iter().map(|&c| if c > 0.3 { 1.0 } else { 0.05 }).collect::<Vec<_>>());
    let by_variance = spread(&deviation);
    let render = |counts: &[u32], seed: u64| -> Vec<Rgb> {
        let source = stage::sampler(&world, SamplerKind::Independent, 1, seed);
        stage::per_pixel(&world, setting.threads, &source, |pixel, s| {
            let n = counts[pixel[1] as usize * width + pixel[0] as usize];
            let mut sum = [0.0f32; 3];
            for i in 0..n {
                s.start(pixel, i, 0);
                sum = stage::add(sum, shade(&world, pixel, s));
            }
            stage::scaled(sum, 1.0 / n as f32)
        })
    };
    let uniform = render(&vec![budget as u32; pilots.len()], seed ^ 1);
    let (a, v) = (render(&by_contrast, seed ^ 2), render(&by_variance, seed ^ 3));
    let rays = |counts: &[u32]| counts.iter().map(|&c| f64::from(c + PILOT)).sum::<f64>() / counts.len() as f64;
    let at = [&uniform, &a, &v].map(|p| stage::error_at(budget, p, &truth, false));
    let errors = at.map(|e| e.mean_square);
    let density = |counts: &[u32]| counts.iter().map(|&c| f64::from(c + PILOT).log2()).collect::<Vec<_>>();
    let range = [2.0, (budget * 6.0).log2()];
    e.pictures(vec![
        paint::colour("uniform", format!("{budget} rays everywhere: mse {:.1e}", errors[0]), width, &uniform),
        paint::colour(
            "contrast",
            format!("contrast criterion, {:.1} rays on average: mse {:.1e}", rays(&by_contrast), errors[1]),
            width,
            &a,
        ),
        paint::heat(
            "contrast-density",
            "rays per pixel, contrast criterion (logarithmic)",
            width,
            &density(&by_contrast),
            range,
        ),
        paint::colour(
            "variance",
            format!("statistical criterion, {:.1} rays on average: mse {:.1e}", rays(&by_variance), errors[2]),
            width,
            &v,
        ),
        paint::heat(
            "variance-density",
            "rays per pixel, statistical criterion (logarithmic)",
            width,
            &density(&by_variance),
            range,
        ),
    ]);
    e.slider("uniform", "variance", "Equal numbers of rays: everywhere the same, and where the variance is.");
    e.claim(Claim::at_most(
        TOPIC,
        "rays per pixel of the contrast criterion, pilot included",
        budget,
        rays(&by_contrast),
    ));
    e.claim(Claim::at_most(
        TOPIC,
        "rays per pixel of the statistical criterion, pilot included",
        budget,
        rays(&by_variance),
    ));
    e.claim(Claim::better(TOPIC, "squared error, contrast criterion over uniform", 0.9, &at[1], &at[0]));
    e.claim(Claim::better(TOPIC, "squared error, statistical criterion over uniform", 0.9, &at[2], &at[0]));
    Ok((errors[1] / errors[0], errors[2] / errors[0]))
}

/// Expectation of the mean that keeps its pilot: `p` of the pixel is white; with pilots all alike it stops, else it takes
/// `more` rays.
fn kept_pilot(p: f64, more: u32) -> f64 {
    let n = PILOT;
    let q = 1.0 - p;
    let choose = |k: u32| (0..k).fold(1.0, |c, i| c * f64::from(n - i) / f64::from(i + 1));
    let mixed: f64 = (1..n)
        .map(|j| {
            choose(j) * p.powi(j as i32) * q.powi((n - j) as i32) * (f64::from(j) + p * f64::from(more))
                / f64::from(n + more)
        })
        .sum();
    p.powi(n as i32) + mixed
}

fn stopping(e: &mut Experiment, setting: &Setting) -> f64 {
    let repeats = setting.effort.pick(40_000u32, 400_000, 4_000_000);
    let more = 28;
    let mut rng = Rng::new(setting.seed_for(TOPIC, 2), 1);
    let mut table = Table::new(
        "bias",
        format!(
            "Mean of a pixel of which the share p is white: {PILOT} pilot rays, {more} more unless they are all alike."
        ),
        &["p", "pilot kept", "closed form", "fresh rays after the decision"],
    );
    let mut kept_points = Vec::new();
    let mut at_twentieth = 0.0;
    for p in [0.02, 0.05, 0.2, 0.5, 0.8, 0.95] {
        let (mut kept, mut fresh) = (VarianceEstimator::default(), VarianceEstimator::default());
        for _ in 0..repeats {
            let mut draw = |n: u32| (0..n).filter(|_| rng.f64() < p).count() as f64;
            let pilot = draw(PILOT);
            let alike = pilot == 0.0 || pilot == f64::from(PILOT);
            kept.add(if alike { pilot / f64::from(PILOT) } else { (pilot + draw(more)) / f64::from(PILOT + more) });
            let n = if alike { PILOT } else { more };
            fresh.add(draw(n) / f64::from(n));
        }
        let predicted = kept_pilot(p, more);
        e.claim(Claim::equal(
            TOPIC,
            format!("pixel {p} white, pilot kept: mean"),
            predicted,
            kept.mean(),
            kept.standard_error(),
        ));
        e.claim(Claim::equal(
            TOPIC,
            format!("pixel {p} white, fresh rays after the decision: unbiased"),
            p,
            fresh.mean(),
            fresh.standard_error(),
        ));
        kept_points.push((p, kept.mean() - p));
        if p == 0.05 {
            at_twentieth = 100.0 * (predicted / p - 1.0).abs();
        }
        table.row([
            format!("{p}"),
            format!("{:.5}", kept.mean()),
            format!("{predicted:.5}"),
            format!("{:.5}", fresh.mean()),
        ]);
    }
    let theory = (0..=100).map(|i| f64::from(i) / 100.0).map(|p| (p, kept_pilot(p, more) - p)).collect();
    e.figure(
        Figure::new(
            "bias",
            "Bias of a pixel's mean when the rays that decided are kept, over the share of the pixel that is white.",
            Axis::linear("share that is white"),
            Axis::linear("bias"),
        )
        .with("measured", Mark::Dots, kept_points)
        .with("closed form", Mark::Line, theory),
    );
    e.table(table);
    at_twentieth
}
