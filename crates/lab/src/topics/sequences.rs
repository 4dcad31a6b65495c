//! Careful placement of samples: point sets compared by discrepancy, by integrals and by a picture.

use super::prelude::*;
use crate::experiment::Picture;
use crate::stage::Rgb;
use steradian_sampling::rng::{hash_u64, unit_f32};
use steradian_sampling::sequence::{
    hammersley, jittered_2d, multi_jittered, n_rooks, nested_uniform_scramble, r2, radical_inverse, regular_2d,
    sobol_02,
};
use steradian_sampling::statistics::{l2_star_discrepancy, star_discrepancy};

const TOPIC: Topic = Topic::Sequences;

/// A way to place `count` points; `seed` chooses one of its randomisations.
struct Placement {
    name: &'static str,
    points: fn(count: u32, seed: u64) -> Vec<[f32; 2]>,
}

fn wrapped(p: [f32; 2], seed: u64) -> [f32; 2] {
    // A random shift, modulo one (Cranley and Patterson 1976).
    let shift = [unit_f32((seed >> 32) as u32), unit_f32(seed as u32)];
    std::array::from_fn(|i| (p[i] + shift[i]).fract().min(1.0 - f32::EPSILON / 2.0))
}

fn side(count: u32) -> u32 {
    f64::from(count).sqrt().round() as u32
}

const PLACEMENTS: [Placement; 9] = [
    Placement {
        name: "random",
        points: |n, seed| {
            let mut rng = Rng::new(seed, 1);
            (0..n).map(|_| rng.f32_2d()).collect()
        },
    },
    Placement {
        name: "regular grid",
        points: |n, seed| (0..n).map(|i| wrapped(regular_2d(i, side(n), side(n)), seed)).collect(),
    },
    Placement { name: "jittered", points: |n, seed| (0..n).map(|i| jittered_2d(i, side(n), side(n), seed)).collect() },
    Placement { name: "N-rooks", points: |n, seed| (0..n).map(|i| n_rooks(i, n, seed)).collect() },
    Placement {
        name: "multi-jittered",
        points: |n, seed| (0..n).map(|i| multi_jittered(i, side(n), side(n), seed)).collect(),
    },
    Placement { name: "Hammersley", points: |n, seed| (0..n).map(|i| wrapped(hammersley(i, n), seed)).collect() },
    Placement {
        name: "Halton (2, 3)",
        points: |n, seed| (0..n).map(|i| wrapped([2, 3].map(|b| radical_inverse(b, u64::from(i))), seed)).collect(),
    },
    Placement {
        name: "scrambled Sobol'",
        points: |n, seed| {
            (0..n)
                .map(|i| {
                    let [x, y] = sobol_02(i);
                    [
                        unit_f32(nested_uniform_scramble(x, seed as u32)),
                        unit_f32(nested_uniform_scramble(y, (seed >> 32) as u32)),
                    ]
                })
                .collect()
        },
    },
    Placement { name: "R2", points: |n, seed| (0..n).map(|i| wrapped(r2(u64::from(i), [0.5; 2]), seed)).collect() },
];

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Careful placement of samples",
        "Stratified sampling gives a better distribution of samples. (The reading goes on to low-discrepancy sequences.)",
        "Nine ways to place points in the unit square, each randomised so that it is unbiased: their star discrepancy, their error on a \
         smooth integrand and on one with an edge, and the error of a picture of penumbrae with each of the renderer's samplers.",
    );
    let patterns: Vec<Picture> = PLACEMENTS.iter().enumerate().map(|(i, p)| dots(i, p, setting)).collect();
    e.pictures(patterns);
    let (random, sobol) = discrepancy(&mut e, setting);
    let order = integrals(&mut e, setting);
    let best = pictures(&mut e, setting)?;
    e.result = format!(
        "The star discrepancy of random points falls with slope {random:.2}, that of scrambled Sobol' points with {sobol:.2}. On a smooth \
         integrand the slopes of the error run from {order}. In the picture, {best}."
    );
    Ok(e)
}

/// The points as a picture.
fn dots(index: usize, p: &Placement, setting: &Setting) -> Picture {
    const SIZE: usize = 128;
    let mut values = vec![0.9; SIZE * SIZE];
    for [x, y] in (p.points)(64, setting.seed_for(TOPIC, 1)) {
        let (cx, cy) = ((x * SIZE as f32) as i32, (y * SIZE as f32) as i32);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)] {
            let (px, py) = (cx + dx, cy + dy);
            if (0..SIZE as i32).contains(&px) && (0..SIZE as i32).contains(&py) {
                values[py as usize * SIZE + px as usize] = 0.02;
            }
        }
    }
    paint::grey(&format!("points-{index}"), format!("64 points: {}", p.name), SIZE, &values)
}

fn discrepancy(e: &mut Experiment, setting: &Setting) -> (f64, f64) {
    let repeats = setting.effort.pick(4, 8, 8);
    let counts: &[u32] = setting.effort.pick(&[16, 64, 256], &[16, 64, 256, 1024], &[16, 64, 256, 1024, 4096]);
    let mut figure = Figure::new(
        "star-discrepancy",
        "Star discrepancy: the largest difference between the share of points in a box at the origin and the box's area.",
        Axis::log("points"),
        Axis::log("star discrepancy"),
    );
    let mut table = Table::new(
        "discrepancy",
        "256 points: mean over randomisations.",
        &["placement", "star discrepancy", "L2 star discrepancy"],
    );
    let mut slopes = Vec::new();
    let mut at_256 = Vec::new();
    for (j, p) in PLACEMENTS.iter().enumerate() {
        let seed = |r: u64| hash_u64(&[setting.seed_for(TOPIC, 2), j as u64, r]);
        let mut points = Vec::new();
        for &n in counts {
            let values = parallel::map(setting.threads, repeats, |r| star_discrepancy(&(p.points)(n, seed(r as u64))));
            let all: VarianceEstimator = values.into_iter().collect();
            points.push((f64::from(n), all.mean()));
            if n == 256 {
                let l2: VarianceEstimator =
                    (0..repeats).map(|r| l2_star_discrepancy(&(p.points)(n, seed(r as u64)))).collect();
                table.row([p.name.into(), format!("{:.4}", all.mean()), format!("{:.5}", l2.mean())]);
                at_256.push(all.mean());
            }
        }
        slopes.push(plain_slope(&points));
        figure = figure.with(p.name, Mark::LineDots, points);
    }
    e.figure(figure);
    e.table(table);
    let index = |name: &str| PLACEMENTS.iter().position(|p| p.name == name).unwrap_or(0);
    let (random, sobol) = (slopes[0], slopes[index("scrambled Sobol'")]);
    // The discrepancy of random points scatters by about a tenth of itself, which these repeats leave at 0.05 of slope.
    e.claim(Claim::within(TOPIC, "star discrepancy of random points: slope −1/2", -0.5, random, [-0.7, -0.3]));
    e.claim(Claim::within(
        TOPIC,
        "star discrepancy of scrambled Sobol' points: slope towards −1",
        -1.0,
        sobol,
        [-1.1, -0.7],
    ));
    for name in ["jittered", "multi-jittered", "Hammersley", "Halton (2, 3)", "scrambled Sobol'", "R2"] {
        let value = at_256[index(name)] / at_256[0];
        e.claim(Claim::at_most(TOPIC, format!("256 points: discrepancy of {name} over that of random"), 0.7, value));
    }
    (random, sobol)
}

fn integrals(e: &mut Experiment, setting: &Setting) -> String {
    let repeats = setting.effort.pick(200, 1_000, 8_000);
    let counts: &[u32] = setting.effort.pick(&[16, 64, 256], &[16, 64, 256, 1024], &[16, 64, 256, 1024, 4096]);
    type Integrand = (&'static str, fn([f64; 2]) -> f64, f64);
    let e1 = std::f64::consts::E - 1.0;
    let integrands: [Integrand; 2] =
        [("smooth", |p| (p[0] + p[1]).exp(), e1 * e1), ("edge", |p| f64::from(0.6 * p[0] + p[1] < 0.8), 0.0)];
    // Below the line 0.6 x + y = 0.8: a trapezoid of heights 0.8 and 0.2.
    let edge_truth = 0.5;
    let mut range = (0.0f64, -9.0f64);
    for (name, f, smooth_truth) in integrands {
        let truth = if name == "edge" { edge_truth } else { smooth_truth };
        let mut figure = Figure::new(
            &format!("integral-{name}"),
            if name == "edge" {
                "An integrand with an edge: 1 below a slanted line."
            } else {
                "A smooth integrand: e^(x + y)."
            },
            Axis::log("points"),
            Axis::log("rms error"),
        );
        for (j, p) in PLACEMENTS.iter().enumerate() {
            let points: Vec<ErrorAt> = counts
                .iter()
                .map(|&n| {
                    let errors = parallel::map(setting.threads, repeats, |r| {
                        let set =
                            (p.points)(n, hash_u64(&[setting.seed_for(TOPIC, 3), j as u64, r as u64, u64::from(n)]));
                        set.iter().map(|q| f(q.map(f64::from))).sum::<f64>() / f64::from(n) - truth
                    });
                    ErrorAt::of(f64::from(n), errors)
                })
                .collect();
            let s = slope(&points).expect("three points");
            if name == "smooth" {
                range = (range.0.min(s.value), range.1.max(s.value));
                match p.name {
                    "random" => e.claim(Claim::equal(
                        TOPIC,
                        "smooth integrand, random: slope −1/2",
                        -0.5,
                        s.value,
                        s.standard_error,
                    )),
                    "jittered" => e.claim(Claim::close(
                        TOPIC,
                        "smooth integrand, jittered: slope −1",
                        -1.0,
                        s.value,
                        s.standard_error,
                        0.05,
                    )),
                    "scrambled Sobol'" => e.claim(Claim::close(
                        TOPIC,
                        "smooth integrand, scrambled Sobol': slope −3/2",
                        -1.5,
                        s.value,
                        s.standard_error,
                        0.25,
                    )),
                    _ => {}
                }
            } else if matches!(p.name, "jittered" | "scrambled Sobol'") {
                e.claim(Claim::close(
                    TOPIC,
                    format!("integrand with an edge, {}: slope −3/4", p.name),
                    -0.75,
                    s.value,
                    s.standard_error,
                    0.06,
                ));
            }
            // Every placement is unbiased.
            let last = points[points.len() - 1];
            let deviation = last.rms() / (repeats as f64).sqrt();
            e.claim(Claim::equal(
                TOPIC,
                format!("{name} integrand, {}: bias with {} points", p.name, last.n),
                0.0,
                last.bias,
                deviation + 1e-7,
            ));
            figure = figure.with(p.name, Mark::LineDots, curve(&points));
        }
        e.figure(figure);
    }
    format!("{:.2} to {:.2}", range.1, range.0)
}

/// Means over blocks of 4 by 4 pixels: what is left of the error for an eye that stands back.
fn blocks(picture: &[Rgb], width: u32) -> Vec<Rgb> {
    let (width, side) = (width as usize, 4);
    let mean = |x: usize, y: usize| {
        let mut sum = [0.0; 3];
        for k in 0..side * side {
            let value = picture[(y * side + k / side) * width + x * side + k % side];
            sum = std::array::from_fn(|c| sum[c] + value[c]);
        }
        sum.map(|v| v / (side * side) as f32)
    };
    (0..picture.len() / width / side)
        .flat_map(|y| (0..width / side).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .collect()
}

/// How fine the grain of each sampler is: its error in blocks of pixels, which complement each other or know nothing of each other.
fn grain(e: &mut Experiment, blurred: &[(&str, Vec<(f64, f64)>)]) {
    let mut figure = Figure::new(
        "grain",
        "Mean squared error of the same picture's blocks of 4 x 4 pixels: small where neighbouring pixels complement each other.",
        Axis::log("samples per pixel"),
        Axis::log("mean squared error of blocks"),
    );
    let of = |name: &str| blurred.iter().find(|b| b.0 == name).map_or(&[][..], |b| &b.1);
    for (name, points) in blurred {
        figure = figure.with(*name, Mark::LineDots, points.clone());
    }
    e.figure(figure);
    let independent = of("independent");
    for (ours, independent) in of("progressive multi-jittered").iter().zip(independent) {
        e.claim(Claim::at_most(
            TOPIC,
            format!(
                "blocks of 4 x 4 pixels: squared error of progressive multi-jittered over independent, {} samples",
                ours.0
            ),
            0.4,
            ours.1 / independent.1,
        ));
    }
}

/// Samplers of the renderer on a picture of penumbrae.
fn pictures(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let size = setting.effort.pick([32, 24], [96, 72], [160, 120]);
    let world = stage::penumbra_world(size, SamplerKind::PaddedSobol)?;
    let reference_spp = setting.effort.pick(512, 1024, 4096);
    let seed = setting.seed_for(TOPIC, 4);
    let (truth, _) = stage::render_counted(&world, SamplerKind::PaddedSobol, reference_spp, seed ^ 99, setting.threads);
    let kinds = [
        ("independent", SamplerKind::Independent),
        ("stratified", SamplerKind::Stratified),
        ("Halton", SamplerKind::Halton),
        ("Sobol'", SamplerKind::Sobol),
        ("padded Sobol'", SamplerKind::PaddedSobol),
        ("Z-order Sobol'", SamplerKind::ZSobol),
        ("progressive multi-jittered", SamplerKind::Pmj02bn),
    ];
    let mut figure = Figure::new(
        "picture",
        "Mean squared error of a picture of penumbrae over the rays through each pixel.",
        Axis::log("samples per pixel"),
        Axis::log("mean squared error"),
    );
    let mut shown = Vec::new();
    let mut last = Vec::new();
    let counts: &[u32] = setting.effort.pick(&[4, 16], &[4, 16, 64], &[4, 16, 64, 256]);
    let blurred_truth = blocks(&truth, size[0]);
    let mut blurred = Vec::new();
    for (name, kind) in kinds {
        let mut points = Vec::new();
        let mut of_blocks = Vec::new();
        for &spp in counts {
            let (picture, _) = stage::render_counted(&world, kind, spp, seed, setting.threads);
            points.push((f64::from(spp), stage::mse(&picture, &truth)));
            of_blocks.push((f64::from(spp), stage::mse(&blocks(&picture, size[0]), &blurred_truth)));
            if spp == 16 {
                shown.push(paint::colour(
                    &format!("penumbra-{}", shown.len()),
                    format!("{name}, 16 samples: mse {:.2e}", points[points.len() - 1].1),
                    size[0] as usize,
                    &picture,
                ));
            }
        }
        last.push((name, points[points.len() - 1].1));
        figure = figure.with(name, Mark::LineDots, points);
        blurred.push((name, of_blocks));
    }
    e.figure(figure);
    grain(e, &blurred);
    e.pictures(shown);
    let independent = last[0].1;
    for (name, value) in &last[1..] {
        e.claim(Claim::at_most(
            TOPIC,
            format!(
                "picture: mean squared error of {name} over that of independent samples, {} per pixel",
                counts[counts.len() - 1]
            ),
            0.8,
            value / independent,
        ));
    }
    let best = last.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(("", 1.0), |b| (b.0, b.1));
    Ok(format!("{} samples had {:.1} times less squared error than independent ones", best.0, independent / best.1))
}
