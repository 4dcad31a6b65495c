//! Importance sampling in one dimension and of reflection: what a density that follows the integrand saves.

use super::prelude::*;
use crate::stage::{Rgb, Vertex};
use steradian_sampling::SamplerKind::Independent;

const TOPIC: Topic = Topic::Importance;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Importance sampling",
        "If f(x) is non-negative, the optimal choice would be to set p(x) ∼ f(x): V[f(x)/p(x)] = 0. Why don't we just do that?",
        "A peaked function is integrated with a uniform, a poor, a good and the ideal density; the variances are compared with their \
         integrals. Then balls of metal reflect a lamp, with directions drawn uniformly from the hemisphere and from the lobe, at the \
         ray counts of the slides.",
    );
    let line = one_dimension(&mut e, setting);
    let equal = lobes(&mut e, setting)?;
    furnace(&mut e, setting);
    e.result = format!(
        "{line} With directions drawn from the lobe, 100 rays per pixel have the error that takes {equal:.0} uniformly drawn rays."
    );
    Ok(e)
}

/// A peak of half-width 0.05 at 0.35 on a low ground.
fn f(x: f64) -> f64 {
    0.1 + 1.0 / (1.0 + ((x - 0.35) / 0.05) * ((x - 0.35) / 0.05))
}

fn primitive(x: f64) -> f64 {
    0.1 * x + 0.05 * ((x - 0.35) / 0.05).atan()
}

fn invert(cumulative: impl Fn(f64) -> f64, u: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..54 {
        let middle = 0.5 * (low + high);
        if cumulative(middle) < u { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A density over the unit interval, with the inverse of its distribution.
struct Density {
    name: &'static str,
    pdf: Box<dyn Fn(f64) -> f64>,
    inverse: Box<dyn Fn(f64) -> f64>,
}

impl Density {
    fn new(name: &'static str, pdf: impl Fn(f64) -> f64 + 'static, inverse: impl Fn(f64) -> f64 + 'static) -> Self {
        Self { name, pdf: Box::new(pdf), inverse: Box::new(inverse) }
    }

    /// `f/p` for a number of draws.
    fn draws(&self, count: u64, rng: &mut Rng) -> Vec<f64> {
        (0..count).map(|_| (self.inverse)(rng.f64())).map(|x| f(x) / (self.pdf)(x)).collect()
    }

    /// `∫ f²/p − F²`. The midpoint rule with so many cells is exact to nine digits here.
    fn variance(&self, truth: f64) -> f64 {
        let cells = 200_000;
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(cells);
        let square = (0..cells).map(at).map(|x| f(x) * f(x) / (self.pdf)(x)).sum::<f64>() / f64::from(cells);
        (square - truth * truth).max(0.0)
    }

    fn curve(&self) -> Vec<(f64, f64)> {
        (0..=400).map(|i| f64::from(i) / 400.0).map(|x| (x, (self.pdf)(x))).collect()
    }
}

/// From no idea of the integrand to all of it.
fn densities(truth: f64) -> [Density; 4] {
    let tent = |x: f64| 0.25 + 0.75 * ((1.0 - (x - 0.35).abs() / 0.15).max(0.0) / 0.15);
    let tent_sum = |x: f64| {
        let t = ((x - 0.2) / 0.15).clamp(0.0, 2.0);
        0.25 * x + 0.75 * (if t < 1.0 { 0.5 * t * t } else { 1.0 - 0.5 * (2.0 - t) * (2.0 - t) })
    };
    [
        Density::new("uniform", |_| 1.0, |u| u),
        Density::new("poor: p(x) = 0.1 + 1.8 x", |x| 0.1 + 1.8 * x, |u| (-0.1 + (0.01f64 + 3.6 * u).sqrt()) / 1.8),
        Density::new("good: a tent over the peak", tent, move |u| invert(tent_sum, u)),
        Density::new(
            "ideal: p = K f",
            move |x| f(x) / truth,
            move |u| invert(|x| (primitive(x) - primitive(0.0)) / truth, u),
        ),
    ]
}

fn one_dimension(e: &mut Experiment, setting: &Setting) -> String {
    let draws = setting.effort.pick(20_000u64, 200_000, 2_000_000);
    let truth = primitive(1.0) - primitive(0.0);
    let densities = densities(truth);
    let mut rng = Rng::new(setting.seed_for(TOPIC, 1), 1);
    let mut table = Table::new(
        "densities",
        format!("{draws} draws each; F = {truth:.6}."),
        &["density", "estimate", "variance of f/p", "∫ f²/p − F²", "draws that equal 100 uniform ones"],
    );
    let mut shapes = Figure::new(
        "shapes",
        "The integrand over its integral, and the densities.",
        Axis::linear("x"),
        Axis::linear("density"),
    )
    .with("f / F", Mark::Line, densities[3].curve());
    let mut variances = Vec::new();
    for density in &densities {
        let name = density.name;
        let values = density.draws(draws, &mut rng);
        let all: VarianceEstimator = values.iter().copied().collect();
        let (variance, error) = variance_with_error(&values);
        let theory = density.variance(truth);
        if name.starts_with("ideal") {
            e.claim(Claim::at_most(
                TOPIC,
                "p = K f: variance of f/p over F², zero up to rounding",
                1e-20,
                variance / (truth * truth),
            ));
        } else {
            e.claim(Claim::equal(TOPIC, format!("{name}: E[f/p] = F"), truth, all.mean(), all.standard_error()));
            e.claim(Claim::equal(TOPIC, format!("{name}: variance of f/p"), theory, variance, error));
            shapes = shapes.with(name, Mark::Dashed, density.curve());
        }
        variances.push(variance);
        table.row([
            name.to_string(),
            format!("{:.6}", all.mean()),
            format!("{variance:.3e}"),
            format!("{theory:.3e}"),
            format!("{:.2}", 100.0 * variance / variances[0]),
        ]);
    }
    e.claim(Claim::at_most(
        TOPIC,
        "variance of the good density over that of the uniform one",
        0.5,
        variances[2] / variances[0],
    ));
    e.claim(Claim::at_least(
        TOPIC,
        "variance of the poor density over that of the uniform one: a bad guess costs",
        1.2,
        variances[1] / variances[0],
    ));
    e.figure(shapes);
    e.table(table);
    questions(e, &variances);
    format!("With p = K f every draw gives F: variance {:.1e}.", variances[3])
}

/// What the slides ask, with the variances of the four densities.
fn questions(e: &mut Experiment, variances: &[f64]) {
    e.answer(17, "By drawing X from a density p that is large where f is large.");
    e.answer(18, "The density: p(x) says how close, 1/p(x) how far apart; each sample is weighted by 1/p(x).");
    e.answer(
        20,
        format!(
            "N and p. On the peak the variance of one draw is {:.3} with uniform p, {:.3} with a poor one, {:.4} with a tent over the peak; N \
             divides each of them.",
            variances[0], variances[1], variances[2]
        ),
    );
    e.answer(
        21,
        format!(
            "Because K = 1/∫f: whoever can normalise f knows the answer already. It works where it can be done (measured variance {:.0e}), and \
             the BRDF times the cosine is the part of the integrand for which it often can.",
            variances[3]
        ),
    );
}

/// A surface that reflects half of what comes from everywhere: what the slide's weight without importance sampling gives.
fn furnace(e: &mut Experiment, setting: &Setting) {
    let mut rng = Rng::new(setting.seed_for(TOPIC, 3), 0);
    // f = 1/(2 pi), the radiance is 1, and the cosine of a uniform direction is uniform: the answer is 1/2.
    let draws = setting.effort.pick(20_000, 200_000, 2_000_000);
    let all: VarianceEstimator = (0..draws).map(|_| rng.f64() / std::f64::consts::TAU).collect();
    let (bare, error) = (all.mean(), all.standard_error());
    let whole = std::f64::consts::TAU * bare;
    e.claim(Claim::equal(
        TOPIC,
        "albedo 1/2 under radiance 1: mean of f cos over uniform directions, 1/(4π)",
        0.5 / std::f64::consts::TAU,
        bare,
        error,
    ));
    e.claim(Claim::equal(
        TOPIC,
        "… and over their density 1/(2π): the albedo",
        0.5,
        whole,
        std::f64::consts::TAU * error,
    ));
    e.erratum(
        "“Importance sampling of reflection”: without importance sampling, weight the result by f_r(ω_in, ω_out) (ω_in · N)",
        format!(
            "A uniform direction has a density too, 1/(2π), and the weight is f_r cos over it. A surface of albedo 1/2 under radiance 1 \
             reflects 0.5: the weight of the slide measures {bare:.4}, 2π times it {whole:.4}."
        ),
    );
}

fn lobes(e: &mut Experiment, setting: &Setting) -> Result<f64, Error> {
    let size = setting.effort.pick([36, 24], [120, 80], [240, 160]);
    let world = stage::glossy_world(size)?;
    let seed = setting.seed_for(TOPIC, 2);
    let width = size[0] as usize;
    let render = |important: bool, kind: SamplerKind, rays: u32, seed: u64| -> Vec<Rgb> {
        stage::average(&world, setting.threads, kind, rays, seed, |pixel, s| {
            let v = Vertex::of_pixel(&world, pixel, s);
            let Vertex::Surface(p) = &v else { return v.emitted() };
            let reflected =
                if important { p.lobe(s.next_1d(), s.next_2d(), stage::Weights::None) } else { p.uniform(s.next_2d()) };
            stage::add(p.emitted, reflected)
        })
    };
    let reference = render(true, SamplerKind::PaddedSobol, setting.effort.pick(2_048, 1_024, 4_096), seed ^ 99);
    let mut pictures = Vec::new();
    let mut mse = Vec::new();
    // The row of the slides, and 900 without to compare with.
    for (rays, important) in [(100, false), (100, true), (200, false), (900, true)] {
        let picture = render(important, Independent, rays, seed ^ u64::from(rays));
        let at = stage::error_at(f64::from(rays), &picture, &reference, false);
        let error = at.mean_square;
        let word = if important { "with" } else { "without" };
        pictures.push(paint::colour(
            &format!("rays-{rays}-{word}"),
            format!("{rays} rays per pixel {word} importance sampling: mse {error:.1e}"),
            width,
            &picture,
        ));
        mse.push(at);
    }
    pictures.push(paint::colour("rays-reference", "reference", width, &reference));
    e.pictures(pictures);
    e.slider("rays-100-without", "rays-100-with", "100 rays per pixel each.");
    let equal = 100.0 * mse[0].mean_square / mse[1].mean_square;
    e.claim(Claim::at_least(TOPIC, "reflection: rays without importance sampling that equal 100 with", 150.0, equal));
    e.claim(Claim::ratio(
        TOPIC,
        "reflection: squared error of 200 uniform rays over that of 100",
        0.5,
        &mse[2],
        &mse[0],
        0.02,
    ));
    // The reference has an error of its own, a fifth of that of 900 rays or less.
    e.claim(Claim::ratio(
        TOPIC,
        "reflection: squared error of 900 rays over that of 100, both with",
        1.0 / 9.0,
        &mse[3],
        &mse[1],
        0.2,
    ));
    let counts: &[u32] = setting.effort.pick(&[4, 16, 64], &[4, 16, 64, 256], &[4, 16, 64, 256, 1024]);
    let mut figure = Figure::new(
        "reflection",
        "Squared error of the picture over rays per pixel: two parallel lines, and the distance between them is what importance sampling saves.",
        Axis::log("rays per pixel"),
        Axis::log("mean squared error"),
    );
    for (name, important) in [("uniform over the hemisphere", false), ("from the lobe", true)] {
        let points: Vec<ErrorAt> = counts
            .iter()
            .map(|&n| stage::error_at(f64::from(n), &render(important, Independent, n, seed ^ 5), &reference, false))
            .collect();
        e.claim(Claim::falls(
            TOPIC,
            format!("reflection, {name}: slope of the squared error over rays"),
            -1.0,
            &points,
        ));
        figure = figure.with(name, Mark::LineDots, squares(&points));
    }
    e.figure(figure);
    Ok(equal)
}
