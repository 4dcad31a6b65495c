//! Convergence of every integrator on one scene: error against rays and against time, and the agreement of every combination
//! of the switches of path tracing.

use super::prelude::*;
use crate::stage::Rgb;
use std::time::Instant;
use steradian_scene::{
    Distribution, IntegratorKind, LobeSampling, MisHeuristic, Stratification, Stratify, Techniques, Whitted, World,
};

const TOPIC: Topic = Topic::Convergence;
/// Bounces: few enough for brute force.
const DEPTH: u32 = 3;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Convergence of every integrator",
        "Ray tracing amounts to estimating a multi-dimensional integral at each pixel: over the pixel area, the aperture, each light source \
         and all diffuse and glossy reflections (recursively).",
        "One closed room, three bounces deep, by every integrator and with every technique switched on and off: relMSE against a converged \
         path-traced picture, over all rays traced (camera, shadow and scattered) and over time. Then every valid combination of light \
         sampling, lobe sampling and weights is tested for the same mean.",
    );
    let line = curves(&mut e, setting)?;
    let worst = matrix(&mut e, setting)?;
    e.result = format!(
        "{line} The {} combinations of switches agree in the mean: the largest deviation is {worst:.1} standard errors.",
        combinations().len()
    );
    Ok(e)
}

fn world(size: [u32; 2], kind: IntegratorKind, techniques: Techniques, spp: u32) -> Result<World, Error> {
    let mut b = stage::room(size, DEPTH);
    b.scene.settings.integrator.kind = kind;
    b.scene.settings.integrator.techniques = techniques;
    // The domains that ask for a grid of their own take its size from here.
    b.scene.settings.sampler.spp = spp;
    Ok(b.build()?)
}

struct Curve {
    name: &'static str,
    kind: IntegratorKind,
    techniques: Techniques,
    sampler: SamplerKind,
    /// Whether its picture is meant to converge to that of path tracing.
    same: bool,
}

fn all_curves() -> Vec<Curve> {
    let path = |name, sampler, techniques| Curve { name, kind: IntegratorKind::Path, techniques, sampler, same: true };
    let t = Techniques::default();
    let none = Techniques { mis: MisHeuristic::None, ..t };
    let dark = Techniques { light_sampling: false, ..t };
    let independent = SamplerKind::Independent;
    let brute = Distribution { subpixels: 2, aperture: 1, light: 2, lobe: 2, time: 1, jitter: true };
    vec![
        path("path", independent, t),
        path("path, scrambled Sobol'", SamplerKind::PaddedSobol, t),
        path(
            "path, all domains jittered",
            independent,
            Techniques { stratify: Stratify::all(Stratification::Jittered), ..t },
        ),
        path("path, no weights (MIS none)", independent, none),
        path("path, no light sampling", independent, dark),
        path(
            "path, no light sampling, uniform directions",
            independent,
            Techniques { lobe_sampling: LobeSampling::Uniform, ..dark },
        ),
        path("path, no roulette", independent, Techniques { roulette: None, ..t }),
        path("path, split 4", independent, Techniques { split: 4, ..t }),
        Curve {
            name: "distribution, s = r = 2",
            kind: IntegratorKind::Distribution(brute),
            techniques: t,
            sampler: independent,
            same: true,
        },
        Curve {
            name: "Whitted",
            kind: IntegratorKind::Whitted(Whitted { ambient: 0.0 }),
            techniques: t,
            sampler: independent,
            same: false,
        },
    ]
}

fn curves(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([20, 20], [48, 48], [128, 128]);
    let width = size[0] as usize;
    let seed = setting.seed_for(TOPIC, 1);
    let reference = world(size, IntegratorKind::Path, Techniques::default(), 1)?;
    let reference_spp = setting.effort.pick(1_024, 1_024, 4_096);
    let truth = stage::render_counted(&reference, SamplerKind::PaddedSobol, reference_spp, seed ^ 9, setting.threads).0;
    let counts: &[u32] = setting.effort.pick(&[4, 16, 36], &[4, 16, 64], &[4, 16, 64, 256]);
    let mut by_rays = Figure::new(
        "rays",
        "relMSE over all rays traced per pixel. Parallel lines of slope −1 differ in efficiency; what levels off is biased.",
        Axis::log("rays per pixel"),
        Axis::log("relMSE"),
    );
    let mut by_time = Figure::new(
        "time",
        "The same over time (this machine; not judged).",
        Axis::log("milliseconds"),
        Axis::log("relMSE"),
    );
    let mut table = Table::new(
        "slopes",
        "Slope of relMSE over rays, and rays per pixel for a relMSE of 0.01 by the fitted line.",
        &["integrator", "slope", "rays per pixel for 0.01", "rays per sample"],
    );
    let mut shown = Vec::new();
    let mut whitted_stays = 0.0;
    let mut slopes = (0.0f64, -9.0f64);
    for c in all_curves() {
        let mut points = Vec::new();
        let mut times = Vec::new();
        let mut per_sample = 0.0;
        for &spp in counts {
            let w = world(size, c.kind, c.techniques, spp)?;
            let start = Instant::now();
            let (picture, rays) = stage::render_counted(&w, c.sampler, spp, seed, setting.threads);
            let mut at = stage::error_at(f64::from(spp), &picture, &truth, true);
            let error = at.mean_square;
            times.push((start.elapsed().as_secs_f64() * 1e3, error));
            let per_pixel = rays.total() as f64 / f64::from(size[0] * size[1]);
            per_sample = per_pixel / f64::from(spp);
            at.n = per_pixel;
            points.push(at);
            if spp == 16 {
                shown.push(paint::colour(
                    &format!("picture-{}", shown.len()),
                    format!("{}, 16 samples: relMSE {error:.3}", c.name),
                    width,
                    &picture,
                ));
            }
        }
        let s = slope(&points).map_or(f64::NAN, |s| 2.0 * s.value);
        let last = (points[points.len() - 1].n, points[points.len() - 1].mean_square);
        if c.same {
            slopes = (slopes.0.min(s), slopes.1.max(s));
            if c.sampler == SamplerKind::Independent
                && c.techniques.stratify == Stratify::default()
                && c.kind == IntegratorKind::Path
            {
                e.claim(Claim::falls(TOPIC, format!("{}: slope of relMSE over rays", c.name), -1.0, &points));
            } else {
                e.claim(Claim::falls_faster(TOPIC, format!("{}: slope of relMSE over rays", c.name), -0.75, &points));
            }
            table.row([
                c.name.into(),
                format!("{s:.2}"),
                format!("{:.0}", last.0 * (last.1 / 0.01).powf(-1.0 / s)),
                format!("{per_sample:.1}"),
            ]);
        } else {
            whitted_stays = last.1 / points[0].mean_square;
            table.row([
                c.name.into(),
                format!("{s:.2}"),
                "never: it leaves out the light between surfaces".into(),
                format!("{per_sample:.1}"),
            ]);
            e.claim(Claim::at_least(
                TOPIC,
                format!("{}: relMSE with the most rays over that with the fewest: a bias stays", c.name),
                0.5,
                whitted_stays,
            ));
        }
        by_rays = by_rays.with(c.name, Mark::LineDots, squares(&points));
        by_time = by_time.with(c.name, Mark::LineDots, times);
    }
    shown.push(paint::colour("reference", "reference", width, &truth));
    e.pictures(shown);
    e.figure(by_rays);
    e.figure(by_time);
    e.table(table);
    Ok(format!(
        "Every unbiased integrator's error falls with a slope of relMSE between {:.2} and {:.2}; Whitted's stays at {whitted_stays:.2} of what it was.",
        slopes.0, slopes.1
    ))
}

fn combinations() -> Vec<(String, Techniques)> {
    let t = Techniques::default();
    let mut all = Vec::new();
    for lobe_sampling in [LobeSampling::Uniform, LobeSampling::Cosine, LobeSampling::Lobe] {
        for (light_sampling, mis) in [
            (false, MisHeuristic::Power),
            (true, MisHeuristic::None),
            (true, MisHeuristic::Balance),
            (true, MisHeuristic::Power),
        ] {
            let light =
                if light_sampling { format!("light sampling, MIS {mis:?}") } else { "no light sampling".into() };
            let name = format!("{lobe_sampling:?} directions, {light}").to_lowercase();
            all.push((name, Techniques { light_sampling, lobe_sampling, mis, ..t }));
        }
    }
    for (name, extra) in [
        ("no roulette", Techniques { roulette: None, ..t }),
        ("roulette below 1", Techniques { roulette: Some(1.0), ..t }),
        ("split 4", Techniques { split: 4, ..t }),
        ("all domains jittered", Techniques { stratify: Stratify::all(Stratification::Jittered), ..t }),
        ("all domains low-discrepancy", Techniques { stratify: Stratify::all(Stratification::LowDiscrepancy), ..t }),
    ] {
        all.push((name.into(), extra));
    }
    all
}

/// Mean of the picture for each combination, over independent pictures, against each other.
fn matrix(e: &mut Experiment, setting: &Setting) -> Result<f64, Error> {
    let size = [12, 12];
    let repeats = setting.effort.pick(24usize, 48, 96);
    let spp = setting.effort.pick(16u32, 16, 144);
    let mean = |p: &[Rgb]| p.iter().map(|c| paint::luminance(*c)).sum::<f64>() / p.len() as f64;
    let measure = |techniques: Techniques, kind: IntegratorKind, part: u64| -> Result<VarianceEstimator, Error> {
        let repeated = parallel::map(setting.threads, repeats, |r| {
            // Domains with grids of their own take their seed from the scene.
            let mut b = stage::room(size, DEPTH);
            let seed = setting.seed_for(TOPIC, 1_000 * part + r as u64);
            b.scene.settings.integrator.kind = kind;
            b.scene.settings.integrator.techniques = techniques;
            b.scene.settings.sampler.spp = spp;
            b.scene.settings.sampler.seed = seed;
            b.build().map(|w| mean(&stage::render_counted(&w, SamplerKind::Independent, spp, seed, 1).0))
        });
        let mut all = VarianceEstimator::default();
        for value in repeated {
            all.add(value?);
        }
        Ok(all)
    };
    let reference = measure(Techniques::default(), IntegratorKind::Path, 1)?;
    let mut rows = combinations();
    let mut table = Table::new(
        "matrix",
        format!("Mean of the picture over {repeats} independent pictures of {spp} samples."),
        &["switches", "mean", "standard error", "deviation in standard errors"],
    );
    let mut worst = 0.0f64;
    let brute = Distribution { subpixels: 4, aperture: 1, light: 2, lobe: 1, time: 1, jitter: true };
    rows.push(("distribution, s = 2, r = 1".into(), Techniques::default()));
    let last = rows.len() - 1;
    for (i, (name, techniques)) in rows.into_iter().enumerate() {
        let kind = if i == last { IntegratorKind::Distribution(brute) } else { IntegratorKind::Path };
        let all = measure(techniques, kind, 2 + i as u64)?;
        let error = all.standard_error().hypot(reference.standard_error());
        let z = (all.mean() - reference.mean()) / error;
        worst = worst.max(z.abs());
        // Student's limit: the error was itself estimated from the repeats.
        let half = t_limit(repeats as u64) * error;
        let (a, b) = (reference.mean() - half, reference.mean() + half);
        e.claim(Claim::within(
            TOPIC,
            format!("{name}: mean of the picture against that of the default switches"),
            reference.mean(),
            all.mean(),
            [a, b],
        ));
        table.row([name, format!("{:.5}", all.mean()), format!("{:.5}", all.standard_error()), format!("{z:+.2}")]);
    }
    e.table(table);
    Ok(worst)
}
