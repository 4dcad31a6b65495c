//! A polygon's edge under k x k samples against its exact coverage.

use super::prelude::*;
use steradian_sampling::sequence::{jittered_2d, regular_2d};

const TOPIC: Topic = Topic::Supersampling;
type P = [f64; 2];

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Supersampling and averaging down",
        "Consider rendering a white polygon against a black background. We would instead like to get a smoother transition: cast more \
         than one ray per pixel and average the result.",
        "A white triangle, for which the exact coverage of every pixel is known by clipping it with the pixel's square. k × k regular, \
         jittered and random samples per pixel are compared with it, over many triangles.",
    );
    let size = setting.effort.pick(32, 48, 64);
    shown(&mut e, size);
    let edges = Edges::measure(setting, size);
    edges.claims(&mut e);
    edges.figure(&mut e);
    let [regular, jittered, random] = &edges.slopes;
    e.result = format!(
        "k × k rays turn two grey levels into k² + 1. The error on edges falls with k to the power {regular} (regular), {jittered} (jittered) and \
         {random} (random): per ray, order pays twice, first on average and then again because only cells that the edge crosses can be wrong."
    );
    let rms = |i: usize| edges.curves[1][i].rms();
    e.answer(
        2,
        format!(
            "By an integral over the pixel, which k × k point samples estimate: rms error on edges {:.3} with 1 ray, {:.3} with 4 × 4 and {:.4} \
             with 16 × 16 jittered ones.",
            rms(0),
            rms(2),
            rms(4)
        ),
    );
    Ok(e)
}

/// One triangle with k x k regular samples: the grey levels that a pixel can take.
fn shown(e: &mut Experiment, size: usize) {
    let triangle = [[0.12, 0.2], [0.93, 0.33], [0.38, 0.9]].map(|p: P| p.map(|v| v * size as f64));
    let exact = coverage(&triangle, size);
    let mut pictures = Vec::new();
    let mut levels = Table::new(
        "levels",
        "The triangle shown, with k × k regular samples.",
        &["k", "grey levels", "k² + 1", "largest error", "rms error on the edge"],
    );
    for k in [1u32, 2, 4, 8] {
        let values = sample(&triangle, size, |i, _| regular_2d(i, k, k), k * k);
        pictures.push(paint::grey(
            &format!("k{k}"),
            format!("k = {k}: {} per pixel", if k == 1 { "1 ray".into() } else { format!("{} rays", k * k) }),
            size,
            &values,
        ));
        let mut distinct: Vec<u32> = values.iter().map(|v| (v * f64::from(k * k)).round() as u32).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let (found, most) = (distinct.len() as f64, f64::from(k * k + 1));
        e.claim(Claim::within(TOPIC, format!("grey levels with k = {k}: at most k² + 1"), most, found, [2.0, most]));
        let errors: Vec<f64> = on_edge(&values, &exact).collect();
        let largest = errors.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let rms = root_mean_square(&errors);
        levels.row([k.to_string(), found.to_string(), most.to_string(), format!("{largest:.3}"), format!("{rms:.4}")]);
    }
    pictures.push(paint::grey("exact", "exact coverage", size, &exact));
    e.pictures(pictures);
    e.slider("k1", "exact", "One ray per pixel against the exact average.");
    e.table(levels);
}

/// The errors of the pixels that an edge crosses.
fn on_edge<'a>(values: &'a [f64], exact: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    values.iter().zip(exact).filter(|(_, c)| **c > 0.0 && **c < 1.0).map(|(v, c)| v - c)
}

fn root_mean_square(errors: &[f64]) -> f64 {
    (errors.iter().map(|v| v * v).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

/// Errors on the edges of many triangles, each of which is a repeat: regular, jittered, random.
struct Edges {
    triangles: usize,
    curves: [Vec<ErrorAt>; 3],
    slopes: [Slope; 3],
}

impl Edges {
    fn measure(setting: &Setting, size: usize) -> Self {
        let seed = setting.seed_for(TOPIC, 1);
        let triangles: Vec<[P; 3]> = (0..setting.effort.pick(12, 40, 200))
            .map(|i| {
                let mut rng = Rng::new(seed, 1_000 + i);
                std::array::from_fn(|_| [rng.f64() * size as f64, rng.f64() * size as f64])
            })
            .collect();
        let truths: Vec<Vec<f64>> = triangles.iter().map(|p| coverage(p, size)).collect();
        let mut curves: [Vec<ErrorAt>; 3] = Default::default();
        for k in [1u32, 2, 4, 8, 16] {
            let errors = parallel::map(setting.threads, triangles.len(), |t| {
                errors_of(&triangles[t], &truths[t], size, k, seed ^ ((t as u64) << 20) ^ u64::from(k))
            });
            for (i, curve) in curves.iter_mut().enumerate() {
                curve.push(ErrorAt::of(f64::from(k), errors.iter().map(|of_triangle| of_triangle[i])));
            }
        }
        let slopes = std::array::from_fn(|i| slope(&curves[i][1..]).expect("four points"));
        Self { triangles: triangles.len(), curves, slopes }
    }

    fn claims(&self, e: &mut Experiment) {
        let [regular, jittered, random] = &self.slopes;
        e.claim(Claim::close(
            TOPIC,
            "random samples: rms error on the edge over k, slope −1",
            -1.0,
            random.value,
            random.standard_error,
            0.02,
        ));
        e.claim(Claim::close(
            TOPIC,
            "jittered samples: slope −3/2, because the edge crosses only about k of the k² cells",
            -1.5,
            jittered.value,
            jittered.standard_error,
            0.08,
        ));
        let scatter = z_limit() * regular.standard_error;
        e.claim(Claim::within(
            TOPIC,
            "regular samples: slope near −3/2 on edges of random slope",
            -1.5,
            regular.value,
            [-1.9 - scatter, -1.2 + scatter],
        ));
    }

    fn figure(&self, e: &mut Experiment) {
        let [regular, jittered, random] = &self.slopes;
        let mut figure = Figure::new(
            "edge",
            format!(
                "Rms error of pixels on the edges of {} random triangles. Slopes over k: regular {regular}, jittered {jittered}, random {random}.",
                self.triangles
            ),
            Axis::log("k (k × k rays per pixel)"),
            Axis::log("rms error on the edge"),
        );
        for (name, points) in ["regular", "jittered", "random"].iter().zip(&self.curves) {
            figure = figure.with(*name, Mark::LineDots, curve(points));
        }
        let start = self.curves[2][0].rms();
        let line = |s: f64| vec![(1.0, start), (16.0, start * 16f64.powf(s))];
        e.figure(figure.with("slope −1", Mark::Dashed, line(-1.0)).with("slope −3/2", Mark::Dashed, line(-1.5)));
    }
}

/// Rms errors on the edges of one triangle with k x k regular, jittered and random samples.
fn errors_of(triangle: &[P; 3], exact: &[f64], size: usize, k: u32, salt: u64) -> [f64; 3] {
    let rng = std::cell::RefCell::new(Rng::new(salt, 50_000));
    let patterns: [&dyn Fn(u32, u64) -> [f32; 2]; 3] =
        [&|i, _| regular_2d(i, k, k), &|i, pixel| jittered_2d(i, k, k, salt.wrapping_add(pixel << 32)), &|_, _| {
            rng.borrow_mut().f32_2d()
        }];
    patterns.map(|pattern| {
        let values = sample(triangle, size, pattern, k * k);
        root_mean_square(&on_edge(&values, exact).collect::<Vec<_>>())
    })
}

fn inside(t: &[P; 3], p: P) -> bool {
    let side = |a: P, b: P| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let s = [side(t[0], t[1]), side(t[1], t[2]), side(t[2], t[0])];
    s.iter().all(|v| *v >= 0.0) || s.iter().all(|v| *v <= 0.0)
}

fn sample(t: &[P; 3], size: usize, pattern: impl Fn(u32, u64) -> [f32; 2], count: u32) -> Vec<f64> {
    (0..size * size)
        .map(|at| {
            let (x, y) = ((at % size) as f64, (at / size) as f64);
            let hits = (0..count)
                .filter(|&i| {
                    let [u, v] = pattern(i, at as u64);
                    inside(t, [x + f64::from(u), y + f64::from(v)])
                })
                .count();
            hits as f64 / f64::from(count)
        })
        .collect()
}

/// The exact area of the triangle in each pixel: Sutherland and Hodgman (1974), then the shoelace formula.
fn coverage(t: &[P; 3], size: usize) -> Vec<f64> {
    (0..size * size)
        .map(|at| {
            let (x, y) = ((at % size) as f64, (at / size) as f64);
            let mut polygon = t.to_vec();
            for (axis, bound, sign) in [(0, x, 1.0), (0, x + 1.0, -1.0), (1, y, 1.0), (1, y + 1.0, -1.0)] {
                polygon = clip(&polygon, axis, bound, sign);
            }
            let n = polygon.len();
            let twice: f64 = (0..n)
                .map(|i| {
                    let (a, b) = (polygon[i], polygon[(i + 1) % n]);
                    (a[0] - x) * (b[1] - y) - (b[0] - x) * (a[1] - y)
                })
                .sum();
            (0.5 * twice.abs()).min(1.0)
        })
        .map(|c| {
            if c < 1e-12 {
                0.0
            } else if c > 1.0 - 1e-12 {
                1.0
            } else {
                c
            }
        })
        .collect()
}

fn clip(polygon: &[P], axis: usize, bound: f64, sign: f64) -> Vec<P> {
    let distance = |p: P| sign * (p[axis] - bound);
    let n = polygon.len();
    let mut out = Vec::with_capacity(n + 1);
    for i in 0..n {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let (da, db) = (distance(a), distance(b));
        if da >= 0.0 {
            out.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            let s = da / (da - db);
            out.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_adds_up_to_the_area() {
        let t = [[1.3, 0.7], [7.1, 2.2], [3.9, 6.6]];
        let area = 0.5 * ((7.1f64 - 1.3) * (6.6 - 0.7) - (2.2 - 0.7) * (3.9 - 1.3)).abs();
        assert!((coverage(&t, 8).iter().sum::<f64>() - area).abs() < 1e-9);
    }
}
