//! Adaptive sampling: the classical contrast criterion and the statistical one, where they send their rays, what they gain,
//! and the bias of stopping early.

use super::prelude::*;
use crate::stage::Builder;
use std::sync::atomic::AtomicBool;
use steradian_render::{Adaptive, Goals, Identity, Label, Plan, Quiet, Rendered, Task, contrast, run as run_task};
use steradian_scene::World;

const TOPIC: Topic = Topic::Adaptive;
/// Rays before the decision in the model of one pixel.
const PILOT: u32 = 4;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Adaptive sampling",
        "Casting many rays per pixel can be unnecessarily costly. If there are no rapid changes in intensity at the pixel, maybe only a few \
         samples are needed. When do we decide to cast more rays in a particular area?",
        "The renderer's own adaptive sampling, by two criteria. Contrast, the classical one (Whitted 1980, Mitchell 1987): the first two rays \
         of each pixel are averaged, and where (I_max − I_min)/(I_max + I_min) over a pixel and its neighbours passes a threshold, a tile of \
         4 x 4 pixels gets eight times the rays of the others. Error, the statistical one: from 32 rays on, tiles of 16 x 16 get rays in \
         proportion to the deviation that was measured. Then the bias: rays that decide may not be counted, or what is stopped at is what \
         looked as if nothing was there; that bias is known in closed form for a pixel that an edge crosses, and measured for the renderer.",
    );
    let [contrast, statistical] = pictures(&mut e, setting)?;
    let [(bias, within), (kept_bias, kept_within)] = renderer_bias(&mut e, setting)?;
    let one_pixel = stopping(&mut e, setting);
    e.result = format!(
        "At equal rays, the contrast criterion has {contrast:.2} and the statistical one {statistical:.2} times the squared relative error of uniform \
         sampling. Keeping the rays that decided makes a pixel of which 1/20 is covered {one_pixel:.0} % too dark. The renderer avoids that: \
         contrast throws the two rays away that decide, and its bias is {bias:+.1} ± {within:.1} %. The statistical criterion keeps its rays, \
         but decides late, over many pixels, and again and again: {kept_bias:+.1} ± {kept_within:.1} % here, falling like 1/N where the error \
         falls like 1/√N."
    );
    e.answer(
        3,
        format!(
            "Where the contrast between the rays of a pixel and of its neighbours, or their estimated variance, is high: edges, textures, \
             penumbrae. At equal rays that leaves {contrast:.2} (contrast) and {statistical:.2} (error) of the squared relative error. The rays that \
             decide must not be counted twice, or the mean shifts."
        ),
    );
    Ok(e)
}

/// The criteria, with their names.
const CRITERIA: [(Adaptive, &str); 3] =
    [(Adaptive::No, "uniform"), (Adaptive::Contrast, "contrast"), (Adaptive::Error, "error")];

/// One render with the renderer's own adaptive sampling.
fn rendered(world: &World, criterion: Adaptive, spp: u32, threads: usize) -> Rendered {
    let identity = Identity::new();
    let task = Task {
        world,
        plan: Plan { spp, threads, time_limit: None },
        goals: Goals { adaptive: criterion, ..Goals::default() },
        layers: &steradian_render::Layers::default(),
        label: Label { identity: &identity, note: &[] },
        resume: None,
    };
    run_task(task, &Quiet, &AtomicBool::new(false))
}

/// Rays per pixel, those included that decided and do not count.
fn spent(rendered: &Rendered, criterion: Adaptive) -> f64 {
    let pilot = if criterion == Adaptive::Contrast { f64::from(contrast::PILOT) } else { 0.0 };
    rendered.film.average_samples() + pilot
}

/// Flat colours: the rapid changes are edges and shadows.
fn world(size: [u32; 2], seed: u64) -> Result<World, Error> {
    let mut b = stage::penumbra(size, SamplerKind::Independent, true);
    let flat = b.diffuse([0.7; 3]);
    if let Some(floor) = b.scene.primitives.first_mut() {
        floor.material = flat;
    }
    b.scene.settings.sampler.seed = seed;
    Ok(b.build()?)
}

/// The same scene with as many rays by each criterion: pictures, densities, errors over that of uniform sampling.
fn pictures(e: &mut Experiment, setting: &Setting) -> Result<[f64; 2], Error> {
    let size = setting.effort.pick([64, 48], [160, 120], [240, 180]);
    let width = size[0] as usize;
    let budget = setting.effort.pick(64, 64, 192);
    let seed = setting.seed_for(TOPIC, 1);
    let truth_spp = setting.effort.pick(1_024, 1_024, 4_096);
    let reference = world(size, seed)?;
    let truth = stage::render_counted(&reference, SamplerKind::PaddedSobol, truth_spp, seed ^ 9, setting.threads).0;
    let mut shown = Vec::new();
    let mut errors = Vec::new();
    for (i, (criterion, name)) in CRITERIA.into_iter().enumerate() {
        let world = world(size, seed ^ (i as u64 + 1))?;
        let rendered = rendered(&world, criterion, budget, setting.threads);
        let picture = rendered.film.mean();
        let rays = spent(&rendered, criterion);
        let at = stage::error_at(rays, &picture, &truth, true);
        shown.push(paint::colour(
            name,
            format!("{name}, {rays:.1} rays a pixel: relMSE {:.1e}", at.mean_square),
            width,
            &picture,
        ));
        if criterion != Adaptive::No {
            let density = rendered.film.map(|_, n| f64::from(n).log2());
            let caption = format!("rays per pixel, {name} (logarithmic, dark is few)");
            let range = [f64::from(budget / 8).log2(), f64::from(budget * 8).log2()];
            shown.push(paint::heat(&format!("{name}-density"), caption, width, &density, range));
            e.claim(Claim::at_most(
                TOPIC,
                format!("{name} criterion: rays per pixel, those that decide included"),
                f64::from(budget),
                rays,
            ));
        }
        errors.push(at);
    }
    e.pictures(shown);
    e.slider("uniform", "contrast", "Equal numbers of rays: everywhere the same, and where intensity changes rapidly.");
    let ratio = |i: usize| errors[i].mean_square / errors[0].mean_square;
    for (i, bound) in [(1, 0.9), (2, 0.9)] {
        let name = CRITERIA[i].1;
        e.claim(Claim::better(
            TOPIC,
            format!("squared relative error, {name} criterion over uniform"),
            bound,
            &errors[i],
            &errors[0],
        ));
    }
    Ok([ratio(1), ratio(2)])
}

/// A wall of black of which a strip in each column of pixels shines, so that each pixel's mean is the strip's share of it.
fn strips(side: u32, share: f32, seed: u64) -> Result<World, Error> {
    let mut b = Builder::new([side; 2], 0);
    b.parallel_camera([0.0, 0.0, -2.0], [0.0; 3], 1.0);
    for i in 0..side {
        let x = 2.0 * (i as f32 + 0.5) / side as f32 - 1.0;
        let half = share / side as f32;
        b.lamp([[x - half, -1.0, 0.0], [x - half, 1.0, 0.0], [x + half, 1.0, 0.0], [x + half, -1.0, 0.0]], 1.0);
    }
    b.scene.settings.sampler.seed = seed;
    Ok(b.build()?)
}

/// What the renderer's criteria do to a mean that chance decides about: half of the tiles have seen nothing when contrast decides.
fn renderer_bias(e: &mut Experiment, setting: &Setting) -> Result<[(f64, f64); 2], Error> {
    let share = 0.01;
    let repeats = setting.effort.pick(48u64, 200, 1_000);
    let mut table = Table::new(
        "renderer-bias",
        format!(
            "Mean of {repeats} pictures of which every pixel is white to a share of {share}. Tiles that have met no white so far get an eighth of \
             the rays of the others (contrast), or fewer (error)."
        ),
        &["criterion", "rays per pixel", "mean", "standard error", "bias"],
    );
    let mut found = [(0.0, 0.0); 2];
    for (i, (criterion, name, spp)) in
        [(Adaptive::Contrast, "contrast", 8), (Adaptive::Error, "error", 48)].into_iter().enumerate()
    {
        let pictures = parallel::map(setting.threads, repeats as usize, |r| {
            let world = strips(32, share as f32, setting.seed_for(TOPIC, 100 + 10_000 * i as u64 + r as u64))?;
            let film = rendered(&world, criterion, spp, 1).film;
            let mean = film.mean();
            Ok::<_, Error>(mean.iter().map(|p| f64::from(p[1])).sum::<f64>() / mean.len() as f64)
        });
        let mut all = VarianceEstimator::default();
        for mean in pictures {
            all.add(mean?);
        }
        let error = all.standard_error();
        found[i] = (100.0 * (all.mean() / share - 1.0), 100.0 * t_limit(repeats) * error / share);
        table.row([
            name.into(),
            spp.to_string(),
            format!("{:.5}", all.mean()),
            format!("{error:.5}"),
            format!("{:+.1} %", found[i].0),
        ]);
        let half = t_limit(repeats) * error;
        let (claim, tolerance) = match criterion {
            Adaptive::Contrast => ("contrast criterion of the renderer: mean of a picture that is 1 % white", 0.0),
            _ => ("error criterion of the renderer, which keeps its rays: the same within a twentieth", 0.05 * share),
        };
        let interval = [share - half - tolerance, share + half + tolerance];
        e.claim(Claim::within(TOPIC, claim, share, all.mean(), interval));
    }
    e.table(table);
    Ok(found)
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
