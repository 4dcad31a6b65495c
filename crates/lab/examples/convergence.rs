//! Slide "Ray tracing as integration": one pixel as an integral over pixel, lens and lamp, five dimensions in all, and how fast
//! the error falls with random, jittered and low-discrepancy points.
#![expect(clippy::print_stdout, reason = "an example talks")]

use steradian_sampling::sequence::{jittered_2d, owen_radical_inverse, permutation_element};
use steradian_sampling::statistics::log_log_slope;
use steradian_sampling::{Rng, VarianceEstimator};

/// The light that arrives for a place in the pixel, a point of the lens and a height of the lamp; its mean is 1.
fn light([x, y, u, v, w]: [f64; 5]) -> f64 {
    (1.0 + 0.5 * (x - y)) * (0.5 + 1.5 * u * u) * (0.5 + v) * (0.75 + 0.75 * w * w)
}

fn main() {
    let error = |n: u32, points: &dyn Fn(u32, u64) -> [f64; 5]| {
        let mean = |seed: u64| (0..n).map(|i| light(points(i, seed))).sum::<f64>() / f64::from(n);
        (0..500).map(|seed| mean(seed) - 1.0).map(|e| e * e).collect::<VarianceEstimator>().mean().sqrt()
    };
    let random = |i: u32, seed: u64| {
        let mut rng = Rng::new(seed, u64::from(i));
        std::array::from_fn(|_| rng.f64())
    };
    let low = |i: u32, seed: u64| {
        let bases = [2u32, 3, 5, 7, 11];
        let number = |d: usize| owen_radical_inverse(bases[d], u64::from(i), (5 * seed) as u32 + d as u32);
        std::array::from_fn(|d| f64::from(number(d)))
    };
    let mut curves = [Vec::new(), Vec::new(), Vec::new()];
    println!("rays   random   jittered  Halton");
    for side in [4u32, 8, 16, 32] {
        let n = side * side;
        // The pixel has one grid, the lens another; which cells go together is shuffled.
        let jittered = |i: u32, seed: u64| {
            let lens = permutation_element(i, n, seed as u32);
            let ([x, y], [u, v]) = (jittered_2d(i, side, side, seed), jittered_2d(lens, side, side, !seed));
            [x, y, u, v, Rng::new(seed, u64::from(i)).f32()].map(f64::from)
        };
        let errors = [error(n, &random), error(n, &jittered), error(n, &low)];
        println!("{n:4}  {:.5}   {:.5}   {:.5}", errors[0], errors[1], errors[2]);
        for (curve, e) in curves.iter_mut().zip(errors) {
            curve.push((f64::from(n), e));
        }
    }
    let [a, b, c] = curves.map(|c| log_log_slope(&c).map_or(f64::NAN, |r| r.slope));
    println!("slope {a:.2}    {b:.2}     {c:.2}");
}
