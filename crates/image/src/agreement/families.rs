//! The five families of tests.

use super::{
    Family, Report, Settings,
    noise::{Block, CHANNELS, Pair},
    statistics::{Spread, normal_from_chi2, normal_from_t, z_limit},
};

/// Blocks with fewer pixels (slivers at a border) say nothing about their own scatter.
const SMALLEST_BLOCK: usize = 4;
/// One wild block or pixel adds at most this much to a sum of squares.
const CAP_BLOCK: f64 = 30.0;
const CAP_PIXEL: f64 = 50.0;

pub(super) fn run(pair: &Pair, settings: &Settings) -> Report {
    let count = if pair.noise_is_known() { 5.0 } else { 4.0 };
    let alpha = settings.alpha / count;
    let levels: Vec<Level> =
        settings.block_sizes.iter().filter(|s| **s > 0).map(|&s| Level::new(pair, s, settings)).collect();

    let global = Global::new(pair);
    let mut families = vec![global.family(alpha, settings)];
    families.push(block_family(&levels, alpha));
    families.push(pattern_family(&levels, alpha));
    let (pixel, squares) = pixel_family(pair, alpha, settings);
    families.push(pixel);
    let mean_squared_deviation = squares / (3 * pair.width * pair.height) as f64;
    if pair.noise_is_known() {
        families.push(dispersion_family(pair, mean_squared_deviation, alpha, settings));
    }

    let sums = |f: fn(&(f64, f64, Spread)) -> f64| global.channels.iter().map(f).sum::<f64>();
    let relative_error = sums(|c| c.2.variance).sqrt() / sums(|c| c.1).max(1e-12);
    let detectable_bias = settings.tolerance_global + families[0].z_limit * relative_error;
    Report {
        agree: families.iter().all(|f| f.agrees),
        reason: None,
        bias: global.channels.map(|(d, m, _)| d / m.max(1e-12)),
        bias_error: global.channels.map(|(_, m, s)| s.variance.sqrt() / m.max(1e-12)),
        detectable_bias,
        is_weak: detectable_bias > settings.weak_above,
        noise_scale: pair.noise_scale,
        mean_squared_deviation,
        families,
    }
}

/// Normal deviate of the part of a difference that the tolerance does not excuse.
fn score(difference: f64, magnitude: f64, spread: Spread, tolerance: f64) -> f64 {
    let excess = (difference.abs() - tolerance * magnitude).max(0.0);
    if excess == 0.0 {
        return 0.0;
    }
    // A difference where there can be no noise at all is as sure as can be.
    normal_from_t(if spread.variance > 0.0 { excess / spread.variance.sqrt() } else { 1e6 }, spread.dof)
}

/// Difference, magnitude of the reference and spread of the whole picture, for R, G, B.
struct Global {
    channels: [(f64, f64, Spread); 3],
}

impl Global {
    fn new(pair: &Pair) -> Global {
        let n = (pair.width * pair.height) as f64;
        // Sums of blocks: in a block of 8 x 8 the picture itself hardly changes, so that its scatter is noise.
        let blocks = pair.blocks(8);
        let channels = std::array::from_fn(|c| {
            let spread = Spread::sum(blocks.iter().map(|&b| {
                let size = (b.width * b.height) as f64;
                let s = pair.block_spread(b, c);
                Spread { variance: s.variance * size * size, dof: s.dof }
            }));
            let mut spread = spread.over(n);
            spread.variance += pair.floor / n;
            let difference = pair.difference[c].iter().sum::<f64>() / n;
            (difference, (pair.reference[c].iter().sum::<f64>() / n).abs(), spread)
        });
        Global { channels }
    }

    fn family(&self, alpha: f64, settings: &Settings) -> Family {
        let mut f = Tally::new("global", alpha, 3);
        for (c, &(d, m, s)) in self.channels.iter().enumerate() {
            f.add(score(d, m, s, settings.tolerance_global), d / m.max(1e-12), || format!("channel {}", NAMES[c]));
        }
        f.finish(0)
    }
}

const NAMES: [&str; CHANNELS] = ["R", "G", "B", "mean"];

/// Scores of the blocks of one size.
struct Level {
    size: usize,
    /// Block, score and relative difference for each channel.
    scores: Vec<(Block, [f64; CHANNELS], [f64; CHANNELS])>,
}

impl Level {
    fn new(pair: &Pair, size: usize, settings: &Settings) -> Level {
        let big_enough = |b: &Block| b.width * b.height >= SMALLEST_BLOCK;
        let scores = pair.blocks(size).into_iter().filter(big_enough).map(|block| {
            let n = (block.width * block.height) as f64;
            let (mut z, mut relative) = ([0.0; CHANNELS], [0.0; CHANNELS]);
            for c in 0..CHANNELS {
                let mean = |plane: &[f64]| pair.pixels(block).map(|i| plane[i]).sum::<f64>() / n;
                let (d, m) = (mean(&pair.difference[c]), mean(&pair.reference[c]).abs());
                let mut spread = pair.block_spread(block, c);
                spread.variance += pair.floor / n;
                z[c] = score(d, m, spread, settings.tolerance_block);
                relative[c] = d / m.max(1e-12);
            }
            (block, z, relative)
        });
        Level { size, scores: scores.collect() }
    }
}

fn block_family(levels: &[Level], alpha: f64) -> Family {
    let tests = levels.iter().map(|l| 3 * l.scores.len()).sum();
    let mut f = Tally::new("block", alpha, tests);
    for level in levels {
        for (b, z, relative) in &level.scores {
            for c in 0..3 {
                let place = || format!("channel {}, {} x {} pixels at {}, {}", NAMES[c], b.width, b.height, b.x, b.y);
                f.add(z[c], relative[c], place);
            }
        }
    }
    f.finish(0)
}

fn pattern_family(levels: &[Level], alpha: f64) -> Family {
    let used: Vec<&Level> = levels.iter().filter(|l| !l.scores.is_empty()).collect();
    let mut f = Tally::new("pattern", alpha, CHANNELS * used.len());
    for level in used {
        let n = level.scores.len();
        for c in 0..CHANNELS {
            let squares: f64 = level.scores.iter().map(|(_, z, _)| (z[c] * z[c]).min(CAP_BLOCK)).sum();
            let place = || format!("channel {}, all blocks of {}", NAMES[c], level.size);
            f.add(normal_from_chi2(squares / n as f64, n), 0.0, place);
        }
    }
    f.finish(0)
}

/// The pixel tests, and the sum of their squared scores.
fn pixel_family(pair: &Pair, alpha: f64, settings: &Settings) -> (Family, f64) {
    let tests = 3 * pair.width * pair.height;
    let mut f = Tally::new("pixel", alpha, tests);
    let mut squares = 0.0;
    for c in 0..3 {
        for (i, &d) in pair.difference[c].iter().enumerate() {
            let magnitude = pair.reference[c][i].abs();
            let z = score(d, magnitude, pair.pixel_spread(i, c), settings.tolerance_pixel);
            squares += (z * z).min(CAP_PIXEL);
            f.add(z, d / magnitude.max(1e-12), || {
                format!("channel {}, pixel {}, {}", NAMES[c], i % pair.width, i / pair.width)
            });
        }
    }
    (f.finish((settings.pixel_outliers * tests as f64).ceil() as usize), squares)
}

fn dispersion_family(pair: &Pair, mean_square: f64, alpha: f64, settings: &Settings) -> Family {
    let mut f = Tally::new("dispersion", alpha, 1);
    // The three channels of a pixel are nearly one number, so only pixels count as independent.
    let z = (mean_square - 1.0 - settings.dispersion_slack) / (2.0 / (pair.width * pair.height) as f64).sqrt();
    f.add(z, mean_square - 1.0, || "all pixels".to_owned());
    f.finish(0)
}

/// A family in the making.
struct Tally(Family);

impl Tally {
    fn new(name: &'static str, alpha: f64, tests: usize) -> Tally {
        Tally(Family {
            name,
            agrees: true,
            z_max: f64::NEG_INFINITY,
            z_limit: z_limit(alpha / tests.max(1) as f64),
            tests,
            failed: 0,
            allowed: 0,
            place: String::new(),
            relative: 0.0,
        })
    }

    fn add(&mut self, z: f64, relative: f64, place: impl FnOnce() -> String) {
        let f = &mut self.0;
        f.failed += usize::from(z > f.z_limit);
        if z > f.z_max {
            (f.z_max, f.relative, f.place) = (z, relative, place());
        }
    }

    fn finish(mut self, allowed: usize) -> Family {
        let f = &mut self.0;
        if f.tests == 0 {
            f.z_max = 0.0;
        }
        f.allowed = allowed;
        f.agrees = f.failed <= allowed;
        self.0
    }
}
