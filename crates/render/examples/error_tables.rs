//! Tables of what `--error` promises and keeps, and of what adaptive sampling gains. Takes minutes.

#![allow(clippy::print_stdout, reason = "tables for a person")]

#[allow(dead_code, reason = "shared with the tests")]
#[path = "../tests/suite/scenes.rs"]
mod scenes;

#[path = "../tests/suite/coverage.rs"]
mod coverage;

use steradian_render::{Adaptive, DARKEST, ErrorGoal, Goals, Share};

/// Pixels a side.
const SIZE: u32 = 16;
/// Renders for each line.
const REPEATS: u64 = 100;

fn main() {
    coverage_table();
    adaptive_table();
}

fn coverage_table() {
    println!("scene         adaptive  bound  broken     within: mean, least   spp    bias/bound  overhead");
    for name in ["box", "sky", "spectral box"] {
        let truth = coverage::truth(name, SIZE, 1 << 13);
        for adaptive in [Adaptive::No, Adaptive::Error] {
            let error = Some(ErrorGoal::linear(0.2));
            let c = coverage::coverage(name, &Goals { error, adaptive, share: Share::Whole }, &truth, REPEATS);
            println!(
                "{name:12}  {adaptive:<8?}  20 %   {:3}/{REPEATS}    {:.3}, {:.3}         {:6.1}  {:+.3}     {:.2}",
                c.broken, c.within[0], c.within[1], c.spp, c.bias, c.overhead
            );
            assert!(c.broken <= REPEATS as u32 / 7 && c.bias.abs() < 0.1);
        }
    }
}

/// Mean square relative error of adaptive against uniform sampling with as many samples.
fn adaptive_table() {
    println!("scene         spp    uniform/adaptive mean square error");
    for name in ["box", "sky", "spectral box"] {
        let truth = coverage::truth(name, SIZE, 1 << 13);
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        for spp in [64, 256] {
            let error = |adaptive: Adaptive| {
                (0..24)
                    .map(|seed| {
                        let r = coverage::at(name, SIZE, seed, spp, &Goals { adaptive, ..Goals::default() });
                        assert!(r.film.average_samples() <= f64::from(spp));
                        let relative = |(g, t): (&f64, &f64)| ((g - t) / t.max(DARKEST * mean)).powi(2);
                        coverage::luminance(&r.film).iter().zip(&truth).map(relative).sum::<f64>()
                    })
                    .sum::<f64>()
            };
            let ratio = error(Adaptive::No) / error(Adaptive::Error);
            println!("{name:12}  {spp:4}   {ratio:.3}");
            assert!(spp < 256 || ratio > 1.0 / 1.05);
        }
    }
}
