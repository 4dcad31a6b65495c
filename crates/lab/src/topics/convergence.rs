//! Convergence of every integrator on one scene: error against rays and against time, and the agreement of every combination
//! of the switches of path tracing.

use super::prelude::*;
use crate::claim::t_limit_of;
use crate::stage::{Builder, Rgb};
use std::time::Instant;
use steradian_integrator::record::RayCounts;
use steradian_sampling::SamplerSettings;
use steradian_scene::{
    Bidirectional, Distribution, IntegratorKind, LobeSampling, MisHeuristic, Stratification, Stratify, Techniques,
    Whitted, World,
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
         path-traced picture, over all rays traced (from the camera, from lamps, and between vertices) and over time. Then every valid \
         combination of light sampling, lobe sampling and weights, brute force, and paths from the lamps are tested for the same mean.",
    );
    let line = curves(&mut e, setting)?;
    let worst = matrix(&mut e, setting)?;
    e.result = format!(
        "{line} All {} ways of estimating the light agree in the mean: the largest deviation is {worst:.1} standard errors.",
        estimators().len()
    );
    Ok(e)
}

const BDPT: IntegratorKind = IntegratorKind::Bdpt(Bidirectional { strategy: None, unweighted: false });

/// A room that is to be seen by an integrator.
fn seen_by(mut b: Builder, kind: IntegratorKind, techniques: Techniques, spp: u32, seed: u64) -> Result<World, Error> {
    b.scene.settings.integrator.kind = kind;
    b.scene.settings.integrator.techniques = techniques;
    // Domains that ask for a grid of their own, and the renderer itself, take their numbers from here.
    b.scene.settings.sampler.spp = spp;
    b.scene.settings.sampler.seed = seed;
    Ok(b.build()?)
}

/// The picture and its rays. Light that paths from lamps bring to other pixels is gathered by the renderer alone.
fn picture(world: &World, sampler: SamplerKind, threads: usize) -> (Vec<Rgb>, RayCounts) {
    let SamplerSettings { spp, seed, .. } = world.settings().sampler;
    if world.settings().integrator.kind.starts_at_lights() {
        return stage::render_film(world, threads);
    }
    stage::render_counted(world, sampler, spp, seed, threads)
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
        Curve { name: "bidirectional", kind: BDPT, techniques: t, sampler: independent, same: true },
        Curve {
            name: "light paths only",
            kind: IntegratorKind::LightPath,
            techniques: t,
            sampler: independent,
            same: true,
        },
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

/// What one integrator did.
struct Measured {
    /// relMSE over rays per pixel.
    points: Vec<ErrorAt>,
    /// relMSE over milliseconds.
    times: Vec<(f64, f64)>,
    /// The picture of 16 samples.
    shown: Vec<Rgb>,
    rays_per_sample: f64,
}

impl Measured {
    fn of(c: &Curve, size: [u32; 2], counts: &[u32], truth: &[Rgb], setting: &Setting) -> Result<Self, Error> {
        let mut out = Self { points: Vec::new(), times: Vec::new(), shown: Vec::new(), rays_per_sample: 0.0 };
        for &spp in counts {
            let w = seen_by(stage::room(size, DEPTH), c.kind, c.techniques, spp, setting.seed_for(TOPIC, 1))?;
            let start = Instant::now();
            let (picture, rays) = picture(&w, c.sampler, setting.threads);
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            let mut at = stage::error_at(f64::from(spp), &picture, truth, true);
            at.n = rays.total() as f64 / f64::from(size[0] * size[1]);
            out.rays_per_sample = at.n / f64::from(spp);
            out.times.push((milliseconds, at.mean_square));
            out.points.push(at);
            if spp == 16 {
                out.shown = picture;
            }
        }
        Ok(out)
    }

    fn slope(&self) -> f64 {
        slope(&self.points).map_or(f64::NAN, |s| 2.0 * s.value)
    }

    /// The error with the most rays over that with the fewest.
    fn left(&self) -> f64 {
        self.points[self.points.len() - 1].mean_square / self.points[0].mean_square
    }

    fn row(&self, c: &Curve) -> [String; 4] {
        let (s, last) = (self.slope(), self.points[self.points.len() - 1]);
        let rays = if c.same {
            format!("{:.0}", last.n * (last.mean_square / 0.01).powf(-1.0 / s))
        } else {
            "never: it leaves out the light between surfaces".into()
        };
        [c.name.into(), format!("{s:.2}"), rays, format!("{:.1}", self.rays_per_sample)]
    }

    fn claim(&self, c: &Curve) -> Claim {
        let what = format!("{}: slope of relMSE over rays", c.name);
        let independent = c.sampler == SamplerKind::Independent
            && c.techniques.stratify == Stratify::default()
            && !matches!(c.kind, IntegratorKind::Distribution(_));
        match (c.same, independent) {
            (true, true) => Claim::falls(TOPIC, what, -1.0, &self.points),
            (true, false) => Claim::falls_faster(TOPIC, what, -0.75, &self.points),
            (false, _) => Claim::at_least(
                TOPIC,
                format!("{}: relMSE with the most rays over that with the fewest: a bias stays", c.name),
                0.5,
                self.left(),
            ),
        }
    }
}

fn curves(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([20, 20], [48, 48], [96, 96]);
    let width = size[0] as usize;
    let spp = setting.effort.pick(1_024, 1_024, 4_096);
    let seed = setting.seed_for(TOPIC, 1) ^ 9;
    let reference = seen_by(stage::room(size, DEPTH), IntegratorKind::Path, Techniques::default(), spp, seed)?;
    let truth = picture(&reference, SamplerKind::PaddedSobol, setting.threads).0;
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
        let m = Measured::of(&c, size, counts, &truth, setting)?;
        let error = m.points[counts.iter().position(|&n| n == 16).unwrap_or(0)].mean_square;
        let caption = format!("{}, 16 samples: relMSE {error:.3}", c.name);
        shown.push(paint::colour(&format!("picture-{}", shown.len()), caption, width, &m.shown));
        if c.same {
            slopes = (slopes.0.min(m.slope()), slopes.1.max(m.slope()));
        } else {
            whitted_stays = m.left();
        }
        e.claim(m.claim(&c));
        table.row(m.row(&c));
        by_rays = by_rays.with(c.name, Mark::LineDots, squares(&m.points));
        by_time = by_time.with(c.name, Mark::LineDots, m.times);
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
            let name = format!("{lobe_sampling:?} directions, {light}").to_lowercase().replace("mis", "MIS");
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
    for (kind, word) in [
        (Stratification::None, "none"),
        (Stratification::Jittered, "jittered"),
        (Stratification::LowDiscrepancy, "low-discrepancy"),
    ] {
        for (name, domain) in DOMAINS {
            let mut stratify = Stratify::all(Stratification::None);
            *domain(&mut stratify) = kind;
            // Without any stratification there is one row, not one for each domain.
            if kind != Stratification::None {
                all.push((format!("{name} {word}, the others not stratified"), Techniques { stratify, ..t }));
            } else if name == "pixel" {
                all.push(("no domain stratified".into(), Techniques { stratify, ..t }));
            }
        }
    }
    all
}

type Domain = fn(&mut Stratify) -> &mut Stratification;

/// What `--stratify` calls them.
const DOMAINS: [(&str, Domain); 5] = [
    ("pixel", |s| &mut s.pixel),
    ("lens", |s| &mut s.lens),
    ("light", |s| &mut s.light),
    ("lobe", |s| &mut s.lobe),
    ("time", |s| &mut s.time),
];

/// The room through a lens, with a ball that moves while the shutter is open: every domain is in use.
fn room_in_motion(size: [u32; 2]) -> Builder {
    let mut b = stage::room(size, DEPTH);
    b.scene.camera.lens_radius = 0.1;
    b.scene.camera.focal_distance = 3.4;
    if let Some(ball) = b.scene.primitives.pop() {
        b.moving(vec![ball], [0.15, 0.1, 0.0]);
    }
    b
}

/// All that is to have the mean of path tracing with its default switches.
fn estimators() -> Vec<(String, IntegratorKind, Techniques)> {
    let brute = Distribution { subpixels: 4, aperture: 1, light: 2, lobe: 1, time: 1, jitter: true };
    let others = [
        ("distribution, s = 2, r = 1", IntegratorKind::Distribution(brute)),
        ("bidirectional", BDPT),
        ("light paths only", IntegratorKind::LightPath),
    ];
    let others = others.map(|(name, kind)| (name.to_owned(), kind, Techniques::default()));
    combinations().into_iter().map(|(name, t)| (name, IntegratorKind::Path, t)).chain(others).collect()
}

/// Mean of the picture by each estimator, over independent pictures, against that of the default.
fn matrix(e: &mut Experiment, setting: &Setting) -> Result<f64, Error> {
    let size = setting.effort.pick([8, 8], [12, 12], [12, 12]);
    let repeats = setting.effort.pick(24usize, 48, 96);
    let spp = setting.effort.pick(16u32, 16, 64);
    let mean = |p: &[Rgb]| p.iter().map(|c| paint::luminance(*c)).sum::<f64>() / p.len() as f64;
    let measure = |techniques: Techniques, kind: IntegratorKind, part: u64| -> Result<VarianceEstimator, Error> {
        let repeated: Vec<Result<f64, Error>> = parallel::map(setting.threads, repeats, |r| {
            let seed = setting.seed_for(TOPIC, 1_000 * part + r as u64);
            let w = seen_by(room_in_motion(size), kind, techniques, spp, seed)?;
            Ok(mean(&picture(&w, SamplerKind::Independent, 1).0))
        });
        let mut all = VarianceEstimator::default();
        for value in repeated {
            all.add(value?);
        }
        Ok(all)
    };
    let reference = measure(Techniques::default(), IntegratorKind::Path, 1)?;
    let rows = estimators();
    let mut table = Table::new(
        "matrix",
        format!("Mean of the picture over {repeats} independent pictures of {spp} samples."),
        &["estimator", "mean", "standard error", "deviation in standard errors"],
    );
    let mut worst = 0.0f64;
    let tests = rows.len() as u64;
    for (i, (name, kind, techniques)) in rows.into_iter().enumerate() {
        let all = measure(techniques, kind, 2 + i as u64)?;
        let error = all.standard_error().hypot(reference.standard_error());
        let z = (all.mean() - reference.mean()) / error;
        worst = worst.max(z.abs());
        // Student's limit: the error was itself estimated from the repeats. The rows are one claim.
        let half = t_limit_of(repeats as u64, tests) * error;
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
