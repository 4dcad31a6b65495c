//! Motion blur of a moving box against its exact temporal coverage.

use super::prelude::*;
use crate::stage::{Builder, Vertex, shining};
use steradian_math::Point2;
use steradian_scene::{CameraSample, Primitive, World};

const TOPIC: Topic = Topic::MotionBlur;
/// Width and height of the picture; one unit of the scene is one pixel.
const SIZE: [u32; 2] = [64, 40];
/// The box at time 0, in pixels from the top left, and how far it moves.
const BOX: [f64; 4] = [7.3, 15.6, 9.2, 18.4];
const SHIFT: [f64; 2] = [36.5, 11.25];

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Motion blur",
        "Distributing rays over time gives motion blur. How can we use super-sampling and averaging down to get it?",
        "A bright box moves across the picture while the shutter is open. The share of the shutter time and pixel area that it covers \
         is known exactly. It is compared with one sharp picture, the same 4 and 16 times for every pixel, and times drawn at random \
         and stratified for every ray.",
    );
    let (world, exact) = (world()?, exact());
    pictures(&mut e, &world, &exact, setting);
    let (rays, scores) = against_exact(&mut e, &world, &exact, setting);
    let [random, low_discrepancy] = slopes(&mut e, &world, &exact, setting);
    e.result = format!(
        "The renderer’s times reproduce the exact coverage: mean z² = {:.3} over {} pixels. Random times err with slope {random:.2} over the \
         rays, low-discrepancy ones with {low_discrepancy:.2}; the same few times for all pixels make ghosts in place of noise.",
        scores.mean(),
        scores.count()
    );
    e.answer(
        4,
        format!(
            "By giving each of the pixel’s rays a time of its own while the shutter is open, and averaging. With {rays} random times every pixel \
             agrees with the exact temporal coverage (mean z² {:.3}). One time per sub-pixel ray is enough: no rays are added.",
            scores.mean()
        ),
    );
    Ok(e)
}

/// The box on its way.
fn world() -> Result<World, Error> {
    let mut b = Builder::new(SIZE, 1);
    let (w, h) = (SIZE[0] as f32, SIZE[1] as f32);
    b.parallel_camera([0.0, 0.0, -10.0], [0.0, 0.0, 0.0], 0.5 * h);
    let place = |x: f64, y: f64| [x as f32 - 0.5 * w, 0.5 * h - y as f32, 0.0];
    let black = b.diffuse([0.0; 3]);
    let quad = b.quad_primitive(
        [place(BOX[0], BOX[2]), place(BOX[1], BOX[2]), place(BOX[1], BOX[3]), place(BOX[0], BOX[3])],
        black,
    );
    b.moving(vec![Primitive { area_light: Some(shining(1.0)), ..quad }], [SHIFT[0] as f32, -SHIFT[1] as f32, 0.0]);
    Ok(b.build()?)
}

fn pictures(e: &mut Experiment, world: &World, exact: &[f64], setting: &Setting) {
    let (width, seed) = (SIZE[0] as usize, setting.seed_for(TOPIC, 1));
    let one = regular_times(world, 1, setting.threads);
    let four = regular_times(world, 4, setting.threads);
    let sixteen = random_times(world, SamplerKind::Independent, 16, seed, setting.threads);
    e.pictures(vec![
        paint::grey("sharp", "one time for all rays", width, &one),
        paint::grey("ghosts", "the same 4 times for every pixel: ghosts", width, &four),
        paint::grey("random", "16 rays at random times", width, &sixteen),
        paint::grey("exact", "exact coverage", width, exact),
    ]);
    e.slider("ghosts", "random", "Four sharp pictures averaged, and 16 rays at random times.");
}

/// Each pixel counts hits: binomial with the exact coverage. The rays, and the squares of the scores.
fn against_exact(e: &mut Experiment, world: &World, exact: &[f64], setting: &Setting) -> (u32, VarianceEstimator) {
    let n = setting.effort.pick(256u32, 1024, 8192);
    let seed = setting.seed_for(TOPIC, 1) ^ 1;
    let counted = random_times(world, SamplerKind::Independent, n, seed, setting.threads);
    let mut scores = VarianceEstimator::default();
    for (v, c) in counted.iter().zip(exact) {
        let variance = c * (1.0 - c) / f64::from(n);
        if c * f64::from(n) > 10.0 && variance > 0.0 {
            scores.add((v - c) * (v - c) / variance);
        }
    }
    e.claim(Claim::equal(
        TOPIC,
        format!("random times, {n} rays: mean of z² over {} pixels, against the exact coverage", scores.count()),
        1.0,
        scores.mean(),
        scores.standard_error(),
    ));
    let empty: f64 = counted.iter().zip(exact).filter(|(_, c)| **c == 0.0).map(|(v, _)| *v).sum();
    e.claim(Claim::within(TOPIC, "light in pixels that the box never covers", 0.0, empty, [0.0, 0.0]));
    (n, scores)
}

/// How the error falls over the rays: with random times, and with low-discrepancy ones.
fn slopes(e: &mut Experiment, world: &World, exact: &[f64], setting: &Setting) -> [f64; 2] {
    let counts: &[u32] = setting.effort.pick(&[4, 16, 64], &[4, 16, 64, 256], &[4, 16, 64, 256, 1024]);
    let rms = |v: &[f64]| (v.iter().zip(exact).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / v.len() as f64).sqrt();
    let over_rays = |times: &dyn Fn(u32) -> Vec<f64>| -> Vec<(f64, f64)> {
        counts.iter().map(|&n| (f64::from(n), rms(&times(n)))).collect()
    };
    let mut figure = Figure::new(
        "error",
        "Rms error against the exact coverage over the rays per pixel. Evenly spaced times that all pixels share leave the least, but what they \
         leave is the edges of ghosts.",
        Axis::log("rays per pixel"),
        Axis::log("rms error"),
    );
    let mut slopes = Vec::new();
    for (name, kind) in [
        ("random times", SamplerKind::Independent),
        ("stratified times", SamplerKind::Stratified),
        ("low-discrepancy times", SamplerKind::PaddedSobol),
    ] {
        let seed = setting.seed_for(TOPIC, 1) ^ 2;
        let points = over_rays(&|n| random_times(world, kind, n, seed, setting.threads));
        slopes.push(plain_slope(&points));
        figure = figure.with(name, Mark::LineDots, points);
    }
    let regular = over_rays(&|n| regular_times(world, n, setting.threads));
    e.figure(figure.with("the same times for every pixel", Mark::LineDots, regular));
    // Thousands of pixels, each with its own noise: the slope scatters by less than 0.01.
    e.claim(Claim::within(TOPIC, "random times: slope of the rms error over rays", -0.5, slopes[0], [-0.56, -0.44]));
    e.claim(Claim::at_most(TOPIC, "low-discrepancy times: slope steeper than random", -0.55, slopes[2]));
    [slopes[0], slopes[2]]
}

fn hit(world: &World, pixel: [u32; 2], u: [f32; 2], time: f32) -> f64 {
    let film = Point2::new(pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]);
    let ray = world.camera_ray(&CameraSample { film, lens: [0.5; 2], time }).ray;
    f64::from(Vertex::trace(world, &ray).emitted()[1] > 0.0)
}

/// `n` times, the middles of equal parts, each with one ray through the middle of the pixel's part of a regular grid.
fn regular_times(world: &World, n: u32, threads: usize) -> Vec<f64> {
    let source = stage::sampler(world, SamplerKind::Independent, n, 0);
    stage::per_pixel(world, threads, &source, |pixel, _| {
        (0..n).map(|i| hit(world, pixel, [0.5; 2], (i as f32 + 0.5) / n as f32)).sum::<f64>() / f64::from(n)
    })
}

fn random_times(world: &World, kind: SamplerKind, n: u32, seed: u64, threads: usize) -> Vec<f64> {
    let source = stage::sampler(world, kind, n, seed);
    stage::per_pixel(world, threads, &source, |pixel, s| {
        let hits: f64 = (0..n)
            .map(|i| {
                s.start(pixel, i, 0);
                let u = s.pixel_2d();
                hit(world, pixel, u, s.next_1d())
            })
            .sum();
        hits / f64::from(n)
    })
}

/// Exact: between the times at which an edge of the box meets an edge of the pixel, the overlap is a quadratic of time,
/// which Simpson's rule integrates without error.
fn exact() -> Vec<f64> {
    let [x0, x1, y0, y1] = BOX;
    let overlap = |a: f64, b: f64, p: f64| (b.min(p + 1.0) - a.max(p)).max(0.0);
    (0..SIZE[0] * SIZE[1])
        .map(|at| {
            let (px, py) = (f64::from(at % SIZE[0]), f64::from(at / SIZE[0]));
            let covered = |t: f64| {
                let (dx, dy) = (t * SHIFT[0], t * SHIFT[1]);
                overlap(x0 + dx, x1 + dx, px) * overlap(y0 + dy, y1 + dy, py)
            };
            let mut times = vec![0.0, 1.0];
            for p in [px, px + 1.0] {
                times.extend([x0, x1].map(|x| (p - x) / SHIFT[0]));
            }
            for p in [py, py + 1.0] {
                times.extend([y0, y1].map(|y| (p - y) / SHIFT[1]));
            }
            times.retain(|t| (0.0..=1.0).contains(t));
            times.sort_by(f64::total_cmp);
            times
                .windows(2)
                .map(|w| (w[1] - w[0]) / 6.0 * (covered(w[0]) + 4.0 * covered(0.5 * (w[0] + w[1])) + covered(w[1])))
                .sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn exact_coverage_adds_up_to_the_area_of_the_box() {
        let [x0, x1, y0, y1] = super::BOX;
        let total: f64 = super::exact().iter().sum();
        assert!((total - (x1 - x0) * (y1 - y0)).abs() < 1e-9, "{total}");
    }
}
