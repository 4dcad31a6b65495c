//! Sampling and quantisation, alias frequencies, zone plate and receding checkerboard under every pattern and filter, and
//! the spectra of the errors.

use super::prelude::*;
use crate::experiment::Picture;
use crate::measure::{power_spectrum_2d, spectrum};
use std::f64::consts::{PI, TAU};
use steradian_image::{Filter, FilterKind};
use steradian_math::{Point2, Vec2};
use steradian_sampling::rng::{hash_u64, unit_f32};
use steradian_sampling::sequence::{jittered_2d, nested_uniform_scramble, regular_2d, sobol_02};

const TOPIC: Topic = Topic::Aliasing;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Aliasing",
        "After sampling, the higher frequency sinusoid has taken on a new “alias”, i.e., changed its identity to be a lower frequency \
         sinusoid. How well does f[i] = quantize[f(iΔ)] approximate f(x)?",
        "Sinusoids of every frequency up to four times Nyquist's are sampled and their strongest frequency is found by a Fourier \
         transform. Then supersampled and jittered pixels of a sinusoid beyond Nyquist, a zone plate and a receding checkerboard are \
         compared with converged pictures, and the spectra of the errors with each other.",
    );
    let bits = quantisation(&mut e);
    aliases(&mut e);
    averaging(&mut e, setting);
    let [regular, jittered] = ghosts(&mut e, setting);
    plates(&mut e, setting)?;
    e.result = format!(
        "Below Nyquist the sampled frequency is the true one; above, it is |f − f_s round(f/f_s)|, with no exception among the 256 \
         frequencies tried. k regular samples per pixel move the first alias to k times the sampling frequency; jittered samples turn \
         what is left into noise: neighbouring pixels of a wave of 4.05 cycles per \
         pixel err alike with 4 × 4 regular samples (correlation {regular:.2}: a false wave) and not with jittered ones (within {:.2} of zero). Quantisation adds an rms error of q/√12 ({bits}).",
        jittered.abs()
    );
    Ok(e)
}

fn quantisation(e: &mut Experiment) -> String {
    // A frequency without relation to the sampling visits all levels.
    let f = |i: u32| 0.5 + 0.5 * (TAU * 0.137_035_999 * f64::from(i)).sin();
    let mut points = Vec::new();
    for bits in 1..=10u32 {
        let steps = f64::from((1u32 << bits) - 1);
        let n = 20_000;
        let square: f64 = (0..n).map(|i| ((f(i) * steps).round() / steps - f(i)).powi(2)).sum::<f64>() / f64::from(n);
        points.push((f64::from(bits), square.sqrt()));
        if bits == 8 {
            let predicted = 1.0 / steps / 12f64.sqrt();
            e.claim(Claim::within(
                TOPIC,
                "rms error of quantisation to 8 bits: q/√12",
                predicted,
                square.sqrt(),
                [0.97 * predicted, 1.03 * predicted],
            ));
        }
    }
    let theory = (1..=10).map(|b| (f64::from(b), 1.0 / (f64::from((1u32 << b) - 1) * 12f64.sqrt()))).collect();
    let eight = points[7].1;
    e.figure(
        Figure::new(
            "quantisation",
            "Rounding to 2^bits levels errs by up to q/2, evenly distributed: q/√12 in the root mean square.",
            Axis::linear("bits"),
            Axis::log("rms error"),
        )
        .with("measured", Mark::Dots, points)
        .with("q/√12", Mark::Dashed, theory),
    );
    e.answer(
        1,
        format!("As well as its frequencies allow. Quantisation costs q/√12 (8 bits: {eight:.2e} measured). Sampling costs nothing if f has no frequency above 1/(2Δ), because then f can be rebuilt from f[i]; every frequency above comes back as a lower one and cannot be told from it."),
    );
    format!("8 bits: {eight:.1e}")
}

fn aliases(e: &mut Experiment) {
    let (rate, count) = (64.0, 256usize);
    let mut measured = Vec::new();
    let mut wrong = 0;
    for step in 1..=256u32 {
        // Half a Fourier bin apart would smear; whole bins of 1/4 do not.
        let frequency = f64::from(step) * 0.5;
        let samples: Vec<f64> = (0..count).map(|i| (TAU * frequency * i as f64 / rate + 0.7).sin()).collect();
        let found = spectrum(&samples)
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0))
            .map_or(0.0, |(k, _)| k as f64 * rate / count as f64);
        let predicted = (frequency - rate * (frequency / rate).round()).abs();
        wrong += u32::from((found - predicted).abs() > 1e-9);
        measured.push((frequency, found));
    }
    e.claim(Claim::within(
        TOPIC,
        "frequencies (of 256, up to 4 times Nyquist's) whose alias is not |f − f_s round(f/f_s)|",
        0.0,
        f64::from(wrong),
        [0.0, 0.0],
    ));
    let theory = (0..=512).map(|i| f64::from(i) * 0.25).map(|f| (f, (f - rate * (f / rate).round()).abs())).collect();
    let wave = |f: f64| {
        (0..=400).map(move |i| f64::from(i) / 400.0).map(move |x| (x, (TAU * f * x).sin())).collect::<Vec<_>>()
    };
    // Frequencies 1 and 11 at 10 samples per unit: the slide's two pictures.
    let samples: Vec<(f64, f64)> = (0..=10).map(|i| f64::from(i) / 10.0).map(|x| (x, (TAU * x).sin())).collect();
    let worst = samples.iter().map(|&(x, y)| (y - (TAU * 11.0 * x).sin()).abs()).fold(0.0, f64::max);
    e.claim(Claim::within(
        TOPIC,
        "largest difference between the samples of sinusoids of frequency 1 and 11, 10 samples per unit",
        0.0,
        worst,
        [0.0, 1e-12],
    ));
    e.figure(
        Figure::new(
            "two-waves",
            "Ten samples per unit cannot tell frequency 11 from frequency 1.",
            Axis::linear("x"),
            Axis::linear("f(x)"),
        )
        .with("frequency 1", Mark::Line, wave(1.0))
        .with("frequency 11", Mark::Dashed, wave(11.0))
        .with("samples of both", Mark::Dots, samples),
    );
    e.figure(
        Figure::new(
            "alias",
            "The strongest frequency among 256 samples at 64 per unit.",
            Axis::linear("true frequency"),
            Axis::linear("frequency after sampling"),
        )
        .with("measured", Mark::Dots, measured)
        .with("|f − f_s round(f/f_s)|", Mark::Line, theory),
    );
}

/// Pixels of a one-dimensional picture.
const PIXELS: usize = 256;
/// In cycles per pixel, on a Fourier bin: it aliases to 0.34375.
const FREQUENCY: f64 = 1.34375;

fn wave(x: f64, frequency: f64) -> f64 {
    (TAU * frequency * x).sin()
}

/// One-dimensional pixels that average k samples: regular ones follow the Dirichlet kernel, jittered ones its envelope.
fn averaging(e: &mut Experiment, setting: &Setting) {
    regular_average(e);
    jittered_average(e, setting);
}

/// The amplitude after averaging k regular samples.
fn dirichlet(k: f64, f: f64) -> f64 {
    if (PI * f / k).sin().abs() < 1e-12 { 1.0 } else { ((PI * f).sin() / (k * (PI * f / k).sin())).abs() }
}

fn regular_average(e: &mut Experiment) {
    let mut figure = Figure::new(
        "regular-average",
        "Strength of the alias after averaging k regular samples per pixel. Regular supersampling does not remove frequencies near k samples \
         per pixel: there the alias is back at full strength.",
        Axis::linear("frequency (cycles per pixel)"),
        Axis::linear("amplitude after averaging"),
    );
    let mut worst = 0.0f64;
    for k in [1u32, 2, 4] {
        let mut points = Vec::new();
        for f in (1..=145u32).map(|step| f64::from(step) * 0.03125) {
            let folded = (f - f.round()).abs();
            let bin = (folded * PIXELS as f64).round() as usize;
            if bin == 0 || 2 * bin == PIXELS {
                continue;
            }
            let at = |i: usize, j: u32| wave(i as f64 + (f64::from(j) + 0.5) / f64::from(k), f);
            let values: Vec<f64> = (0..PIXELS).map(|i| (0..k).map(|j| at(i, j)).sum::<f64>() / f64::from(k)).collect();
            let amplitude = spectrum(&values)[bin].0;
            worst = worst.max((amplitude - dirichlet(f64::from(k), f)).abs());
            points.push((f, amplitude));
        }
        figure = figure.with(format!("k = {k}"), Mark::LineDots, points);
    }
    let sinc = (1..=180).map(|i| f64::from(i) * 0.025).map(|f| (f, ((PI * f).sin() / (PI * f)).abs())).collect();
    e.figure(figure.with("exact average: |sin πf|/πf", Mark::Dashed, sinc));
    e.claim(Claim::within(
        TOPIC,
        "amplitude after averaging k regular samples: |sin πf|/(k |sin πf/k|), worst deviation",
        0.0,
        worst,
        [0.0, 1e-9],
    ));
}

/// One jittered sample per pixel: the alias is attenuated as by the exact average, the rest is noise.
fn jittered_average(e: &mut Experiment, setting: &Setting) {
    let repeats = setting.effort.pick(200u64, 1_000, 5_000);
    let mut rng = Rng::new(setting.seed_for(TOPIC, 1), 1);
    let (mut aligned, mut total) = (VarianceEstimator::default(), VarianceEstimator::default());
    let mut jittered = vec![0.0; PIXELS / 2 + 1];
    for _ in 0..repeats {
        let values: Vec<f64> = (0..PIXELS).map(|i| wave(i as f64 + rng.f64(), FREQUENCY)).collect();
        // The alias has a known phase: that of the exact average over each pixel.
        let reference = |i: usize| wave(i as f64 + 0.5, FREQUENCY);
        aligned.add(2.0 / PIXELS as f64 * (0..PIXELS).map(|i| values[i] * reference(i)).sum::<f64>());
        total.add(values.iter().map(|v| v * v).sum::<f64>() / PIXELS as f64);
        for (sum, (a, _)) in jittered.iter_mut().zip(spectrum(&values)) {
            *sum += a * a / repeats as f64;
        }
    }
    // Negative here: the alias comes back upside down.
    let predicted = (PI * FREQUENCY).sin() / (PI * FREQUENCY);
    e.claim(Claim::equal(
        TOPIC,
        "one jittered sample per pixel: mean amplitude of the alias of frequency 1.34: sin πf/πf",
        predicted,
        aligned.mean(),
        aligned.standard_error(),
    ));
    e.claim(Claim::equal(
        TOPIC,
        "… and the power that it loses is not gone: total power stays 1/2",
        0.5,
        total.mean(),
        total.standard_error(),
    ));
    let middles: Vec<f64> = (0..PIXELS).map(|i| wave(i as f64 + 0.5, FREQUENCY)).collect();
    let regular: Vec<f64> = spectrum(&middles).iter().map(|(a, _)| a * a).collect();
    let over_frequency = |power: &[f64]| -> Vec<(f64, f64)> {
        power.iter().enumerate().skip(1).map(|(k, p)| (k as f64 / PIXELS as f64, p.max(1e-8))).collect()
    };
    e.figure(
        Figure::new(
            "jitter-spectrum",
            format!(
                "Power over frequency for one sample per pixel of a sinusoid of 1.34 cycles per pixel. Regular: one spike at 0.34, a false \
                 sinusoid. Jittered: the spike is {:.1} times lower in amplitude, and the rest is white noise.",
                1.0 / predicted.abs()
            ),
            Axis::linear("frequency (cycles per pixel)"),
            Axis::log("power").from_to(1e-6, 2.0),
        )
        .with("regular", Mark::LineDots, over_frequency(&regular).into_iter().filter(|p| p.1 > 1e-6).collect())
        .with("jittered", Mark::Line, over_frequency(&jittered)),
    );
}

/// A wave that 4 x 4 regular samples take for one of 1/20 cycle per pixel: how the errors of neighbours correlate.
fn ghosts(e: &mut Experiment, setting: &Setting) -> [f64; 2] {
    const SIZE: usize = 120;
    let seed = setting.seed_for(TOPIC, 3);
    // The exact average over a pixel is below 1/200 of the wave: nearly all of the picture is error.
    let wave = |x: f64, _: f64, _: f64| (TAU * 4.05 * x).sin();
    let correlation = |pattern: Pattern| {
        let values = picture(wave, SIZE, pattern, &Filter::pixel_box(), seed, setting.threads);
        let power = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        let pairs = values.chunks(SIZE).flat_map(|row| row.windows(2)).map(|w| w[0] * w[1]);
        let products: VarianceEstimator = pairs.collect();
        (products.mean() / power, products.standard_error() / power, values)
    };
    let (regular, _, a) = correlation(Pattern::Regular(4));
    let (jittered, error, b) = correlation(Pattern::Jittered(4));
    let predicted = (TAU * 0.05).cos();
    e.claim(Claim::within(
        TOPIC,
        "wave of 4.05 cycles per pixel, 4 × 4 regular samples: correlation of neighbouring errors, that of a wave of 0.05",
        predicted,
        regular,
        [predicted - 0.02, predicted + 0.02],
    ));
    e.claim(Claim::close(TOPIC, "the same, 4 × 4 jittered samples: noise", 0.0, jittered, error, 0.01));
    let shown = |v: &[f64]| v.iter().map(|v| 0.5 + 0.5 * v).collect::<Vec<_>>();
    e.pictures(vec![
        paint::grey(
            "ghost-regular",
            "a wave of 4.05 cycles per pixel, 4 × 4 regular samples: a false wave",
            SIZE,
            &shown(&a),
        ),
        paint::grey(
            "ghost-jittered",
            "the same wave, 4 × 4 jittered samples: noise around the right grey",
            SIZE,
            &shown(&b),
        ),
    ]);
    [regular, jittered]
}

/// A pattern of sample points in the unit square.
#[derive(Clone, Copy)]
enum Pattern {
    One,
    Regular(u32),
    Jittered(u32),
    LowDiscrepancy(u32),
}

impl Pattern {
    fn count(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Regular(k) | Self::Jittered(k) => k * k,
            Self::LowDiscrepancy(n) => n,
        }
    }

    fn point(self, i: u32, pixel: u64, seed: u64) -> [f32; 2] {
        let seed = hash_u64(&[seed, pixel]);
        match self {
            Self::One => [0.5; 2],
            Self::Regular(k) => regular_2d(i, k, k),
            Self::Jittered(k) => jittered_2d(i, k, k, seed),
            Self::LowDiscrepancy(_) => {
                let [x, y] = sobol_02(i);
                [
                    unit_f32(nested_uniform_scramble(x, seed as u32)),
                    unit_f32(nested_uniform_scramble(y, (seed >> 32) as u32)),
                ]
            }
        }
    }
}

fn zone_plate(x: f64, y: f64, size: f64) -> f64 {
    // The local frequency is 5 cycles per pixel at the right and lower edges: beyond the first alias of 4 x 4 samples.
    0.5 + 0.5 * (PI * 5.0 * (x * x + y * y) / size).cos()
}

fn checkerboard(x: f64, y: f64, size: f64) -> f64 {
    // A floor seen from a height of one over a horizon at a tenth of the picture.
    let down = (y / size - 0.1) * 1.6;
    if down <= 0.0 {
        return 0.75;
    }
    let depth = 1.0 / down;
    let across = (x / size - 0.5) * 1.8 * depth;
    let cell = (across * 1.6).floor() + (depth * 1.6).floor();
    if cell.rem_euclid(2.0) < 1.0 { 0.9 } else { 0.05 }
}

type Pattern2 = (&'static str, Pattern);

fn picture(
    f: impl Fn(f64, f64, f64) -> f64 + Sync,
    size: usize,
    pattern: Pattern,
    filter: &Filter,
    seed: u64,
    threads: usize,
) -> Vec<f64> {
    parallel::map(threads, size, |y| {
        (0..size)
            .map(|x| {
                let n = pattern.count();
                let pixel = (y * size + x) as u64;
                let sum: f64 = (0..n)
                    .map(|i| {
                        let s = filter.sample(Point2::from(pattern.point(i, pixel, seed)));
                        let at = |c: usize, d: f32| c as f64 + 0.5 + f64::from(d);
                        f64::from(s.weight) * f(at(x, s.offset.x), at(y, s.offset.y), size as f64)
                    })
                    .sum();
                sum / f64::from(n)
            })
            .collect::<Vec<_>>()
    })
    .into_iter()
    .flatten()
    .collect()
}

fn filters() -> Vec<(&'static str, Filter)> {
    let radius = |r: f32| Vec2::new(r, r);
    let kinds = [
        ("triangle", FilterKind::Triangle, radius(1.0)),
        ("gaussian", FilterKind::Gaussian { sigma: 0.5 }, radius(1.5)),
        ("mitchell", FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, radius(2.0)),
        ("sinc", FilterKind::Sinc { tau: 3.0 }, radius(4.0)),
    ];
    let made = kinds.into_iter().filter_map(|(name, kind, r)| Filter::new(kind, r).ok().map(|f| (name, f)));
    std::iter::once(("box", Filter::pixel_box())).chain(made).collect()
}

fn plates(e: &mut Experiment, setting: &Setting) -> Result<(), Error> {
    let size = setting.effort.pick(64, 128, 256);
    let reference_k = setting.effort.pick(12, 16, 48);
    let seed = setting.seed_for(TOPIC, 2);
    let patterns: [Pattern2; 4] = [
        ("1 sample", Pattern::One),
        ("4 × 4 regular", Pattern::Regular(4)),
        ("4 × 4 jittered", Pattern::Jittered(4)),
        ("16 scrambled Sobol'", Pattern::LowDiscrepancy(16)),
    ];
    type Scene = (&'static str, fn(f64, f64, f64) -> f64);
    let scenes: [Scene; 2] = [("zone plate", zone_plate), ("checkerboard", checkerboard)];
    let mut table = Table::new(
        "filters",
        "Rms error of each pattern under each filter, against the converged picture under the same filter.",
        &["scene", "filter", "1 sample", "4 × 4 regular", "4 × 4 jittered", "16 scrambled Sobol'"],
    );
    for (scene, f) in scenes {
        let slug = scene.replace(' ', "-");
        for (name, filter) in filters() {
            let truth = picture(f, size, Pattern::Jittered(reference_k), &filter, seed ^ 7, setting.threads);
            let mut pictures: Vec<Picture> = Vec::new();
            let mut errors = Vec::new();
            for (j, (label, pattern)) in patterns.into_iter().enumerate() {
                let values = picture(f, size, pattern, &filter, seed, setting.threads);
                let error: Vec<f64> = values.iter().zip(&truth).map(|(a, b)| a - b).collect();
                errors.push((error.iter().map(|v| v * v).sum::<f64>() / error.len() as f64).sqrt());
                pictures.push(paint::grey(
                    &format!("{slug}-{name}-{j}"),
                    format!("{scene}, {name} filter, {label}"),
                    size,
                    &values,
                ));
                if name == "box" && scene == "zone plate" && (j == 1 || j == 2) {
                    let power = power_spectrum_2d(&error, size);
                    let mean = power.iter().sum::<f64>() / power.len() as f64;
                    let what = if j == 1 { "regular" } else { "jittered" };
                    pictures.push(paint::heat(
                        &format!("{slug}-spectrum-{what}"),
                        format!("Spectrum of the error, {label} (logarithmic, zero frequency in the middle)"),
                        size,
                        &paint::log10(&power.iter().map(|p| p / mean).collect::<Vec<_>>()),
                        [-2.0, 2.0],
                    ));
                }
            }
            table.row([scene.into(), name.into()].into_iter().chain(errors.iter().map(|v| format!("{v:.4}"))));
            if name == "box" {
                e.claim(Claim::at_most(
                    TOPIC,
                    format!("{scene}: rms error of 4 × 4 jittered samples over that of 1 sample"),
                    0.5,
                    errors[2] / errors[0],
                ));
                e.claim(Claim::at_most(
                    TOPIC,
                    format!("{scene}: rms error of 16 scrambled Sobol' points over that of 1 sample"),
                    0.5,
                    errors[3] / errors[0],
                ));
            }
            pictures.push(paint::grey(
                &format!("{slug}-{name}-truth"),
                format!("{scene}, {name} filter, converged"),
                size,
                &truth,
            ));
            e.pictures(pictures);
        }
    }
    e.slider(
        "zone-plate-box-0",
        "zone-plate-box-2",
        "Zone plate: rings that are not there, and the grain that replaces them.",
    );
    e.slider(
        "checkerboard-box-0",
        "checkerboard-mitchell-3",
        "Receding checkerboard: towards the horizon the squares are smaller than a pixel.",
    );
    e.table(table);
    Ok(())
}
