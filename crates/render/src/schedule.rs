//! Which samples are taken when: rounds, the passes inside them, and what each tile gets.
//!
//! Everything here is a function of the sums alone, so that threads, interruptions and resumption change nothing.
//!
//! A round ends where the picture is looked at: after 1, 2, 4, 8, 16, 32, 48, 64, 96, 128, 192 ... samples. At its start
//! each tile gets a target. Inside a round, passes of at most 16 samples move all tiles towards their targets in step, so
//! that rendering can stop after any of them.

use crate::error_goal::Assessment;
use crate::film::Film;

/// Samples per pixel, nominally, at the end of a round.
pub(crate) fn round_end(round: u32) -> u32 {
    match round {
        0..=5 => 1 << round,
        r if r.is_multiple_of(2) => 3 << (r / 2 + 1),
        r => 1 << (r.div_ceil(2) + 2),
    }
}

/// And at its start.
pub(crate) fn round_begin(round: u32) -> u32 {
    if round == 0 { 0 } else { round_end(round - 1) }
}

/// The first round at whose end there is enough to judge by, and which look that is, from 1.
pub(crate) fn look_at(round: u32) -> Option<u32> {
    const FIRST: u32 = 5;
    (round >= FIRST).then(|| round + 1 - FIRST)
}

/// Whether the samples at the end of a round tell how noisy a tile is: eight of each pixel are five hundred of the tile.
pub(crate) fn tells_noise(round: u32) -> bool {
    round >= 3
}

/// The numbers of samples per pixel at which an error goal is looked at, each with which look that is.
pub fn looks() -> impl Iterator<Item = (u32, u32)> {
    (0..).filter_map(|round| Some((round_end(round), look_at(round)?))).take_while(|&(spp, _)| spp < crate::ENDLESS_SPP)
}

/// Passes double up to this many samples: an interruption throws away one pass at most.
const LARGEST_PASS: u32 = 16;

/// The end of the pass that comes after `taken` nominal samples.
pub(crate) fn pass_end(taken: u32) -> u32 {
    if taken < LARGEST_PASS { (taken + 1).next_power_of_two() } else { (taken / LARGEST_PASS + 1) * LARGEST_PASS }
}

/// Where rendering stands inside its schedule: what a checkpoint holds besides the film.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// The round in progress.
    pub(crate) round: u32,
    /// For each tile, its samples at the start of the round.
    pub(crate) base: Vec<u32>,
    /// For each tile, its samples at the end of the round.
    pub(crate) targets: Vec<u32>,
}

impl Schedule {
    /// Before the first sample.
    pub(crate) fn new(tiles: usize) -> Self {
        Self { round: 0, base: vec![0; tiles], targets: vec![round_end(0); tiles] }
    }

    /// The samples that tile `i` shall have when `nominal` have been reached.
    pub(crate) fn end_of(&self, i: usize, nominal: u32) -> u32 {
        let (begin, end) = (round_begin(self.round), round_end(self.round));
        let (base, target) = (u64::from(self.base[i]), u64::from(self.targets[i]));
        let along = u64::from(nominal.clamp(begin, end) - begin);
        (base + target.saturating_sub(base) * along / u64::from(end - begin)) as u32
    }

    /// On to the next round, with these targets.
    pub(crate) fn advance(&mut self, targets: Vec<u32>) {
        self.base = std::mem::replace(&mut self.targets, targets);
        self.round += 1;
    }
}

/// The same for every tile.
pub(crate) fn uniform(film: &Film, round: u32) -> Vec<u32> {
    vec![round_end(round); film.tiles.len()]
}

/// Under an error goal: tiles that have reached it rest, the others go on together. A tile next to a bad one is not
/// trusted to be good.
pub(crate) fn towards_goal(film: &Film, found: &Assessment, pixels: f64, schedule: &Schedule) -> Vec<u32> {
    let next = round_end(schedule.round + 1);
    let [width, height] = film.grid();
    let doubt: Vec<f64> = (0..film.tiles.len())
        .map(|i| around(i, width, height).map(|j| 0.5 * found.misses[j]).fold(found.misses[i], f64::max))
        .collect();
    let mut limit = 0.7 * (1.0 - pixels);
    if doubt.iter().all(|&d| d <= limit) {
        // Each tile is good, but the picture as a whole is not yet: the worse half goes on.
        let mut sorted = doubt.clone();
        sorted.sort_by(f64::total_cmp);
        limit = sorted[sorted.len() / 2].min(sorted[sorted.len() - 1] * 0.999);
    }
    (0..film.tiles.len()).map(|i| if doubt[i] > limit { next } else { schedule.targets[i] }).collect()
}

/// With a number of samples to spend: in proportion to the standard deviation of one sample, which makes the mean square
/// error least (Neyman 1934). A tenth is spent evenly, and deviations are smoothed, since they are estimates.
pub(crate) fn by_noise(film: &Film, found: &Assessment, schedule: &Schedule) -> Vec<u32> {
    /// Shares are smoothed by the mean over the tiles around.
    const EVEN: f64 = 0.1;
    /// No tile gets more than this many times the average.
    const MOST: f64 = 16.0;
    let next = f64::from(round_end(schedule.round + 1));
    let [width, height] = film.grid();
    let deviation: Vec<f64> = found.noise.iter().map(|v| if v.is_finite() { v.sqrt() } else { 0.0 }).collect();
    let smooth: Vec<f64> = (0..deviation.len())
        .map(|i| {
            let (sum, n) = around(i, width, height).fold((0.0, 0.0), |(s, n), j| (s + deviation[j], n + 1.0));
            if n > 0.0 { deviation[i].max(0.5 * (deviation[i] + sum / n)) } else { deviation[i] }
        })
        .collect();
    let mean = smooth.iter().sum::<f64>() / smooth.len().max(1) as f64;
    let share: Vec<f64> =
        smooth.iter().map(|s| if mean > 0.0 { EVEN + (1.0 - EVEN) * s / mean } else { 1.0 }).collect();
    spend_by_steps(film, next as u32, MOST * next / EVEN, |i, scale| {
        well_spread((scale * share[i]).min(MOST * next) as u32).max(schedule.targets[i])
    })
}

/// The largest number up to `n` of the form 4, 5, 6 or 7 times a power of two: low-discrepancy points are best spread at round numbers.
fn well_spread(n: u32) -> u32 {
    let odd = n.checked_ilog2().unwrap_or(0).saturating_sub(2);
    n >> odd << odd
}

/// The most generous `ends(tile, scale)` that takes `average` samples per pixel at most; it grows with the scale, up to `most`.
pub(crate) fn spend(film: &Film, average: u32, most: f64, ends: impl Fn(usize, f64) -> u32) -> Vec<u32> {
    let ([low, _], _) = affordable(film, average, most, &ends);
    (0..film.tiles.len()).map(|i| ends(i, low)).collect()
}

/// The same where many tiles take a large step at the same scale: as many of them as can be paid do, from the first on.
fn spend_by_steps(film: &Film, average: u32, most: f64, ends: impl Fn(usize, f64) -> u32) -> Vec<u32> {
    let ([low, high], mut left) = affordable(film, average, most, &ends);
    let step = |i: usize| {
        let (end, next) = (ends(i, low), ends(i, high));
        let price = u64::from(next - end) * film.tiles[i].len() as u64;
        if price > left {
            return end;
        }
        left -= price;
        next
    };
    (0..film.tiles.len()).map(step).collect()
}

/// Two scales next to each other, of which the larger is beyond the budget, or is `most`; and the samples that the smaller leaves.
fn affordable(film: &Film, average: u32, most: f64, ends: &impl Fn(usize, f64) -> u32) -> ([f64; 2], u64) {
    let total = |ends: &dyn Fn(usize) -> u32| -> u64 {
        film.tiles.iter().enumerate().map(|(i, t)| u64::from(ends(i)) * t.len() as u64).sum()
    };
    let budget = total(&|_| average);
    let (mut low, mut high) = (0.0, most);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if total(&|i| ends(i, middle)) <= budget { low = middle } else { high = middle }
    }
    ([low, high], budget.saturating_sub(total(&|i| ends(i, low))))
}

/// The tiles left, right, above and below.
fn around(i: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then(|| i + 1),
        (y > 0).then(|| i - width),
        (y + 1 < height).then(|| i + width),
    ]
    .into_iter()
    .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_and_passes_fit_into_each_other() {
        let ends: Vec<u32> = (0..12).map(round_end).collect();
        assert_eq!(ends, [1, 2, 4, 8, 16, 32, 48, 64, 96, 128, 192, 256]);
        let (mut passes, mut at) = (vec![], 0);
        while at < 256 {
            at = pass_end(at);
            passes.push(at);
        }
        assert!(ends.iter().all(|e| passes.contains(e)));
        assert_eq!(passes[..8], [1, 2, 4, 8, 16, 32, 48, 64]);
        assert_eq!(pass_end(7), 8, "a render that ended between passes goes on to where it would have been");
    }

    #[test]
    fn inside_a_round_tiles_keep_step() {
        let schedule = Schedule { round: 9, base: vec![96, 96, 100], targets: vec![128, 96, 400] };
        let at = |nominal| (0..3).map(|i| schedule.end_of(i, nominal)).collect::<Vec<_>>();
        assert_eq!(at(96), [96, 96, 100]);
        assert_eq!(at(112), [112, 96, 250]);
        assert_eq!(at(128), [128, 96, 400]);
        assert_eq!(at(1000), [128, 96, 400]);
    }

    #[test]
    fn round_numbers_are_near() {
        for n in 0..1000 {
            let w = well_spread(n);
            assert!(w <= n && 5 * w >= 4 * n && (w < 8 || w >> w.trailing_zeros() < 8), "{n}: {w}");
        }
    }

    #[test]
    fn noise_attracts_samples_and_the_budget_holds() {
        let film = Film::new([0, 64, 0, 64]);
        let mut noise = vec![0.01; 16];
        noise[5] = 4.0;
        let found = Assessment { bound: 1.0, misses: vec![0.0; 16], noise };
        let schedule = Schedule { round: 7, base: vec![48; 16], targets: vec![64; 16] };
        let targets = by_noise(&film, &found, &schedule);
        assert!(targets[5] > 3 * targets[15], "{targets:?}");
        assert!(targets.iter().all(|&t| t >= 64));
        let total: u32 = targets.iter().sum();
        assert!(total <= 96 * 16 && total > 90 * 16, "{total}");
        // Where all are alike, all is spent.
        let found = Assessment { bound: 1.0, misses: vec![0.0; 16], noise: vec![1.0; 16] };
        assert_eq!(by_noise(&film, &found, &schedule), [96; 16]);
    }

    #[test]
    fn tiles_that_are_good_rest_unless_all_are() {
        let film = Film::new([0, 64, 0, 16]);
        let schedule = Schedule { round: 7, base: vec![48; 4], targets: vec![64; 4] };
        let go = |misses: [f64; 4]| {
            let found = Assessment { bound: 1.0, misses: misses.to_vec(), noise: vec![1.0; 4] };
            towards_goal(&film, &found, 0.95, &schedule)
        };
        assert_eq!(go([0.3, 0.0, 0.0, 0.0]), [96, 96, 64, 64], "the neighbour of a bad tile goes on too");
        let all_good = go([0.03, 0.02, 0.01, 0.0]);
        assert!(all_good.contains(&96) && all_good.contains(&64), "{all_good:?}");
        assert!(go([0.01; 4]).contains(&96), "there is always a way on");
    }
}
