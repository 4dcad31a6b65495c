//! "The error is below 1 %" as a statement that can be wrong with a stated probability only.
//!
//! The statement: with confidence `c`, at least the fraction `f` of the pixels lie within the bound `E` of what endless
//! rendering would give. Each pixel's mean is about normal around its true value, with a standard error that its samples
//! tell; so each pixel misses the bound with a known probability, and the number of misses is a sum of such coin flips.
//!
//! The picture is looked at many times, and each look could be lucky. The allowed probability of error `1 - c` is
//! therefore spent over the looks, `1 / (k (k + 1))` of it at look `k` (Lan and DeMets 1983), which adds up to all of it.
//!
//! What makes it hold in practice: the standard error is taken as if the samples were independent (an upper estimate for
//! low-discrepancy samplers); the three colours as if they erred together; a pixel is never trusted to be much quieter
//! than its neighbours, since few samples of a rare bright path often miss it, and then measure too little noise.

use crate::film::{Film, Tile};
use steradian_image::{PreparedToneMap, linear_to_srgb};
use steradian_math::exp;

/// In which terms a pixel's error is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorMeasure {
    /// Luminance relative to the pixel's own, or to [`DARKEST`] of the picture's mean where the pixel is darker than that.
    Linear,
    /// Luminance of the tone-mapped, sRGB-encoded picture, as a fraction of its full range.
    Display(PreparedToneMap),
}

/// Pixels darker than this fraction of the picture's mean are measured as if they were so bright.
pub const DARKEST: f64 = 0.05;

/// When a picture is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorGoal {
    /// The bound `E`.
    pub bound: f64,
    /// What it bounds.
    pub measure: ErrorMeasure,
    /// The fraction `f` of pixels that shall lie within the bound.
    pub pixels: f64,
    /// The confidence `c`.
    pub confidence: f64,
}

impl ErrorGoal {
    /// 95 % of the pixels within a relative error, with 95 % confidence.
    pub fn linear(bound: f64) -> Self {
        Self { bound, measure: ErrorMeasure::Linear, pixels: 0.95, confidence: 0.95 }
    }

    /// The probability of error that look `k`, from 1, may spend.
    fn spent_at(&self, look: u32) -> f64 {
        let k = f64::from(look.max(1));
        (1.0 - self.confidence) / (k * (k + 1.0))
    }
}

/// What a look at the picture found.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// The least bound for which the statement holds now; infinite where nothing can be said.
    pub bound: f64,
    /// For each tile, the expected fraction of its pixels beyond the goal's bound.
    pub misses: Vec<f64>,
    /// For each tile, the mean over its pixels of (standard error of one sample / what a bound of 1 allows) squared.
    pub noise: Vec<f64>,
}

/// Looks at the picture for the `look`-th time, from 1.
pub fn assess(film: &Film, goal: &ErrorGoal, look: u32) -> Assessment {
    let scores = guarded_scores(film, &goal.measure);
    let mut histogram = Histogram::default();
    let mut misses = Vec::with_capacity(film.tiles.len());
    let mut noise = Vec::with_capacity(film.tiles.len());
    for tile in &film.tiles {
        let (mut missed, mut sum) = (0.0, 0.0);
        for i in 0..tile.len() {
            let q = scores[index_of(film, tile, i)];
            missed += tail(goal.bound / q.sqrt().max(1e-300));
            sum += q * f64::from(tile.samples());
            histogram.add(q);
        }
        misses.push(missed / tile.len() as f64);
        noise.push(sum / tile.len() as f64);
    }
    let bound = histogram.bound(1.0 - goal.pixels, quantile(goal.spent_at(look)));
    Assessment { bound, misses, noise }
}

/// For each pixel, row by row, the standard error that [`assess`] takes it to have, in units of the measure: multiply by the normal
/// quantile of a confidence level for the half width of its interval.
pub fn pixel_errors(film: &Film, measure: &ErrorMeasure) -> Vec<f32> {
    guarded_scores(film, measure).into_iter().map(|q| q.sqrt() as f32).collect()
}

fn index_of(film: &Film, tile: &Tile, i: usize) -> usize {
    let [x, y] = tile.pixel(i);
    (y - film.bounds[2]) as usize * film.size()[0] + (x - film.bounds[0]) as usize
}

/// Luminance of sRGB primaries; close enough for other primaries, since it only weighs errors.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// For each pixel the square of (standard error / what a bound of 1 allows), not below the mean around it.
fn guarded_scores(film: &Film, measure: &ErrorMeasure) -> Vec<f64> {
    let mean_luminance = mean_luminance(film);
    let raw = film.map(|sum, n| {
        if n < 2 {
            return f64::INFINITY;
        }
        let (mean, deviation) = (sum.mean(n).map(f64::from), sum.variance_of_mean(n).map(|v| f64::from(v).sqrt()));
        // The quantiles of Student's distribution against those of the normal one, where it matters (Cornish and Fisher).
        let few = 1.0 + 1.5 / f64::from(n - 1);
        let error = match measure {
            ErrorMeasure::Linear => {
                let y: f64 = (0..3).map(|c| LUMINANCE[c] * mean[c].abs()).sum();
                let sd: f64 = (0..3).map(|c| LUMINANCE[c] * deviation[c]).sum();
                if sd == 0.0 { 0.0 } else { sd / y.max(DARKEST * mean_luminance).max(1e-300) }
            }
            ErrorMeasure::Display(tone_map) => display_error(tone_map, mean, deviation),
        };
        (error * few) * (error * few)
    });
    guard(&raw, film.size())
}

/// How far the displayed luminance moves when the pixel moves by its standard error, up or down.
fn display_error(tone_map: &PreparedToneMap, mean: [f64; 3], deviation: [f64; 3]) -> f64 {
    let code = |sign: f64| {
        let rgb = tone_map.apply(std::array::from_fn(|c| (mean[c] + sign * deviation[c]) as f32));
        (0..3).map(|c| LUMINANCE[c] * f64::from(linear_to_srgb(rgb[c].clamp(0.0, 1.0)))).sum::<f64>()
    };
    let here = code(0.0);
    (code(1.0) - here).abs().max((here - code(-1.0)).abs())
}

fn mean_luminance(film: &Film) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for tile in film.tiles.iter().filter(|t| t.samples() > 0) {
        for i in 0..tile.len() {
            let mean = tile.sum(i).mean(tile.samples());
            sum += (0..3).map(|c| LUMINANCE[c] * f64::from(mean[c].abs())).sum::<f64>();
            pixels += 1.0;
        }
    }
    if pixels > 0.0 { sum / pixels } else { 0.0 }
}

/// No score below the mean of the 5 x 5 around it. Half of that mean is not enough: the promise was then broken in a fifth of the
/// renders of a box with a caustic, at 95 % confidence.
fn guard(raw: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    const REACH: usize = 2;
    // Along rows, then along columns.
    let blur = |v: &[f64], n: usize, stride: usize, at: &dyn Fn(usize) -> usize| {
        let mut out = vec![0.0; v.len()];
        for i in 0..v.len() {
            let x = at(i);
            let (low, high) = (x.saturating_sub(REACH), (x + REACH).min(n - 1));
            let sum: f64 = (low..=high).map(|j| v[i - x * stride + j * stride]).sum();
            out[i] = sum / (high - low + 1) as f64;
        }
        out
    };
    if raw.is_empty() {
        return Vec::new();
    }
    let rows = blur(raw, width, 1, &|i| i % width);
    let around = blur(&rows, height, width, &|i| i / width);
    raw.iter().zip(around).map(|(&q, a)| q.max(a)).collect()
}

/// Scores by size, fine enough that rounding up loses a percent: 32 bins for each factor of two in the square.
struct Histogram {
    counts: Vec<u32>,
    infinite: u32,
    total: u32,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: vec![0; 255 * 32], infinite: 0, total: 0 }
    }
}

impl Histogram {
    fn add(&mut self, q: f64) {
        self.total += 1;
        let bin = ((q as f32).to_bits() >> 18) as usize;
        match self.counts.get_mut(bin) {
            Some(count) => *count += 1,
            None => self.infinite += 1,
        }
    }

    /// The least bound that not more than `allowed` of the pixels miss, at `z` standard deviations of their number.
    fn bound(&self, allowed: f64, z: f64) -> f64 {
        let total = f64::from(self.total).max(1.0);
        let holds = |bound: f64| {
            let (mut mean, mut variance) = (f64::from(self.infinite), 0.0);
            for (bin, &count) in self.counts.iter().enumerate().filter(|(_, c)| **c > 0) {
                let upper = f64::from(f32::from_bits(((bin + 1) as u32) << 18));
                let p = if bin == 0 { 0.0 } else { tail(bound / upper.sqrt()) };
                mean += f64::from(count) * p;
                variance += f64::from(count) * p * (1.0 - p);
            }
            mean + z * variance.sqrt() <= allowed * total
        };
        let (mut low, mut high) = (1e-9, 1e9);
        if !holds(high) {
            return f64::INFINITY;
        }
        for _ in 0..60 {
            let middle = f64::sqrt(low * high);
            if holds(middle) { high = middle } else { low = middle }
        }
        high
    }
}

/// `P(|Z| > x)` of a normal Z: Abramowitz and Stegun 7.1.26, to 2e-7. Portable, since decisions hang on it.
fn tail(x: f64) -> f64 {
    if x > 12.0 {
        return 0.0;
    }
    let t = 1.0 / (1.0 + 0.327_591_1 * x * std::f64::consts::FRAC_1_SQRT_2);
    let polynomial =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    (polynomial * f64::from(exp((-0.5 * x * x) as f32))).clamp(0.0, 1.0)
}

/// The `z` that a normal number exceeds with probability `p` below one half.
fn quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 12.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 0.5 * tail(middle) > p { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sums::PixelSum;

    #[test]
    fn normal_tails() {
        for (x, p) in [(0.0, 1.0), (1.0, 0.317_311), (1.959_964, 0.05), (3.0, 0.002_699_8)] {
            assert!((tail(x) - p).abs() < 1e-6, "{x}");
        }
        assert!((quantile(0.025) - 1.96).abs() < 1e-3 && (quantile(0.001) - 3.0902).abs() < 1e-3);
        let goal = ErrorGoal::linear(0.01);
        let spent: f64 = (1..10_000).map(|k| goal.spent_at(k)).sum();
        assert!(spent < 0.05 && spent > 0.0499, "the looks spend what there is: {spent}");
    }

    /// Pixels with a mean of 1 and a known deviation: the bound must be the one that tables give.
    #[test]
    fn a_picture_of_known_noise() {
        let n = 10_000;
        let mut film = Film::new([0, 64, 0, 64]);
        for tile in &mut film.tiles {
            // Two values, 0.9 and 1.1: a deviation of 0.1, and of 0.001 for the mean.
            tile.extend(n, |_, range, stack| {
                range.for_each(|s| stack.push(PixelSum::of([if s % 2 == 0 { 0.9 } else { 1.1 }; 3])));
            });
        }
        // 4096 pixels: 5 % may miss, less 1.96 deviations of their number: 4.33 %, which is 2.02 standard errors.
        let found = assess(&film, &ErrorGoal::linear(0.002), 1);
        assert!((found.bound / 0.002_02 - 1.0).abs() < 0.03, "{}", found.bound);
        assert!((found.misses[0] - 0.0455).abs() < 1e-3, "{}", found.misses[0]);
        assert!((found.noise[0] / 0.01 - 1.0).abs() < 1e-2, "{}", found.noise[0]);
    }

    #[test]
    fn nothing_can_be_said_of_one_sample_and_all_of_a_picture_without_noise() {
        let mut film = Film::new([0, 8, 0, 8]);
        for tile in &mut film.tiles {
            tile.extend(1, |_, range, stack| range.for_each(|_| stack.push(PixelSum::of([1.0; 3]))));
        }
        assert_eq!(assess(&film, &ErrorGoal::linear(0.1), 1).bound, f64::INFINITY);
        for tile in &mut film.tiles {
            tile.extend(32, |_, range, stack| range.for_each(|_| stack.push(PixelSum::of([1.0; 3]))));
        }
        assert!(assess(&film, &ErrorGoal::linear(0.1), 1).bound < 1e-6);
    }
}
