//! Tables of what `--error` promises and keeps, and of what adaptive sampling gains. Takes some ten minutes on two cores; another
//! number than 200 renders for each line of the first (0 leaves it out), and the scenes, are arguments.

#![allow(clippy::print_stdout, reason = "tables for a person")]

#[allow(dead_code, reason = "shared with the tests")]
#[path = "../tests/suite/scenes.rs"]
mod scenes;

#[path = "../tests/suite/coverage.rs"]
mod coverage;

use steradian_render::{Adaptive, DARKEST, ErrorGoal, Goals, Share};

/// Pixels a side: nine tiles or more, so that some can rest while others go on.
const SIZE: u32 = 40;
/// Scenes, and bounds that each needs some hundreds of samples for.
const SCENES: [(&str, f64); 3] = [("box", 0.35), ("sky", 0.04), ("caustic", 0.4)];

fn main() {
    let mut args = std::env::args().skip(1);
    let repeats = args.next().map_or(200, |n| n.parse().expect("how many renders"));
    let names: Vec<String> = args.collect();
    let wanted = |(name, _): &(&str, f64)| names.is_empty() || names.iter().any(|n| n == name);
    let scenes: Vec<_> =
        SCENES.into_iter().filter(wanted).map(|(n, b)| (n, b, coverage::truth(n, SIZE, 1 << 13))).collect();
    if repeats > 0 {
        coverage_table(&scenes, repeats);
    }
    adaptive_table(&scenes);
}

fn coverage_table(scenes: &[(&str, f64, Vec<f64>)], repeats: u64) {
    println!("| scene | samples | bound | broken | within: mean, least | spp | bias / bound | samples / needed |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for &(name, bound, ref truth) in scenes {
        for adaptive in [Adaptive::No, Adaptive::Error] {
            let error = Some(ErrorGoal::linear(bound));
            let c = coverage::coverage(name, &Goals { error, adaptive, share: Share::Whole }, truth, repeats);
            println!(
                "| {name} | {} | {} % | {} of {repeats} | {:.3}, {:.3} | {:.0} | {:+.3} | {:.2} |",
                if adaptive == Adaptive::No { "even" } else { "adaptive" },
                bound * 100.0,
                c.broken,
                c.within[0],
                c.within[1],
                c.spp,
                c.bias,
                c.overhead
            );
            // At the promised rate of 5 in 100, three times as many of 200 come once in a hundred million tables.
            assert!(u64::from(c.broken) <= 3 * repeats / 20 && c.bias.abs() < 0.1);
        }
    }
}

/// Mean square relative error of even against adaptive sampling with as many samples.
fn adaptive_table(scenes: &[(&str, f64, Vec<f64>)]) {
    println!("\n| scene | spp | even / adaptive mean square error |\n| --- | --- | --- |");
    for &(name, _, ref truth) in scenes {
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        for spp in [64, 256] {
            let error = |adaptive: Adaptive| {
                (0..24)
                    .map(|seed| {
                        let r = coverage::at(name, SIZE, seed, spp, &Goals { adaptive, ..Goals::default() });
                        assert!(r.film.average_samples() <= f64::from(spp));
                        let relative = |(g, t): (&f64, &f64)| ((g - t) / t.max(DARKEST * mean)).powi(2);
                        coverage::luminance(&r.film).iter().zip(truth).map(relative).sum::<f64>()
                    })
                    .sum::<f64>()
            };
            let ratio = error(Adaptive::No) / error(Adaptive::Error);
            println!("| {name} | {spp} | {ratio:.3} |");
            assert!(spp < 256 || ratio > 1.0 / 1.05);
        }
    }
}
