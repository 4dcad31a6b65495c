//! The classical criterion of adaptive sampling: more rays where intensity changes rapidly (Whitted 1980; the contrast and its
//! thresholds are those of Mitchell 1987).
//!
//! Each pixel's first [`PILOT`] samples are averaged. Where their contrast `(max - min) / (max + min)` over a pixel and its eight
//! neighbours passes the threshold of its colour, the tile of 4 x 4 pixels gets [`FAVOUR`] times the samples of the others. The pilot
//! decides once, and is then thrown away: what counts is independent of the decision, so that the picture has no bias. (It
//! would have: keeping what one stops at is keeping what looked as if nothing was there.)

use crate::film::Film;
use crate::schedule::{Schedule, round_end, spend};

/// Samples of each pixel that decide, and do not count.
pub const PILOT: u32 = 2;
/// The round at whose end they have been taken.
pub(crate) const PILOT_ROUND: u32 = 1;

/// How many times the samples of the others a tile gets that has contrast.
pub const FAVOUR: f64 = 8.0;

/// The contrast in red, green and blue beyond which there is an edge: eyes are best at green and worst at blue.
pub const THRESHOLDS: [f32; 3] = [0.4, 0.3, 0.6];

/// What each tile shall have at the end of the next round.
pub(crate) fn targets(film: &Film, schedule: &Schedule) -> Vec<u32> {
    let favoured = if schedule.round == PILOT_ROUND { busy(film) } else { favoured(schedule) };
    let next = round_end(schedule.round + 1);
    spend(film, next, 2.0 * FAVOUR * f64::from(next), |i, scale| {
        let wanted = if favoured[i] { scale } else { scale / FAVOUR };
        (wanted as u32).max(PILOT + 1).max(schedule.targets[i])
    })
}

/// Which tiles were favoured before: the targets tell, since there was enough to spend to make a difference. If all are alike, so they
/// stay.
fn favoured(schedule: &Schedule) -> Vec<bool> {
    let least = schedule.targets.iter().min().copied().unwrap_or(0);
    schedule.targets.iter().map(|&t| t > least).collect()
}

/// Which tiles have a pixel with contrast.
fn busy(film: &Film) -> Vec<bool> {
    let means = film.mean();
    let [width, height] = film.size();
    film.tiles
        .iter()
        .map(|tile| {
            (0..tile.len()).any(|i| {
                let [x, y] = tile.pixel(i);
                let at = [(x - film.bounds[0]) as usize, (y - film.bounds[2]) as usize];
                has_contrast(&means, [width, height], at)
            })
        })
        .collect()
}

fn has_contrast(means: &[[f32; 3]], [width, height]: [usize; 2], [x, y]: [usize; 2]) -> bool {
    let (mut low, mut high) = ([f32::INFINITY; 3], [0.0f32; 3]);
    for row in y.saturating_sub(1)..(y + 2).min(height) {
        for mean in &means[row * width + x.saturating_sub(1)..row * width + (x + 2).min(width)] {
            for c in 0..3 {
                low[c] = low[c].min(mean[c].max(0.0));
                high[c] = high[c].max(mean[c]);
            }
        }
    }
    (0..3).any(|c| high[c] - low[c] > THRESHOLDS[c] * (high[c] + low[c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FINE_TILE_SIZE;
    use crate::sums::PixelSum;

    /// White right of a column, black or grey left of it.
    fn step(edge: u32, left: f32) -> Film {
        let mut film = Film::with_tiles([8, 48, 3, 43], FINE_TILE_SIZE, 0);
        for tile in &mut film.tiles {
            tile.extend(PILOT, |[x, _], range, stack| {
                range.for_each(|_| stack.push(PixelSum::of([if x >= edge { 1.0 } else { left }; 3])));
            });
        }
        film
    }

    #[test]
    fn contrast_is_where_the_edge_is() {
        for (edge, left, columns) in [(20, 0.0, vec![2, 3]), (22, 0.0, vec![3]), (22, 0.5, vec![3]), (22, 0.6, vec![])]
        {
            let film = step(edge, left);
            let busy = busy(&film);
            let found: Vec<usize> = (0..10).filter(|&c| busy[c]).collect();
            assert_eq!(found, columns, "edge at {edge}, {left} left of it");
            assert!((0..10).all(|row| (0..10).all(|c| busy[row * 10 + c] == busy[c])));
        }
    }

    #[test]
    fn contrast_gets_its_favour_and_the_budget_holds() {
        let film = step(22, 0.0);
        let mut schedule = Schedule { round: PILOT_ROUND, base: vec![1; 100], targets: vec![PILOT; 100] };
        while round_end(schedule.round) < 64 {
            let targets = targets(&film, &schedule);
            let average = targets.iter().sum::<u32>() / 100;
            let nominal = round_end(schedule.round + 1);
            assert!(average <= nominal && average + 1 >= nominal, "{average} of {nominal}");
            schedule.advance(targets);
        }
        let (busy, idle) = (schedule.targets[3], schedule.targets[7]);
        assert!((7 * idle..=8 * idle + 8).contains(&busy), "{busy} and {idle}");
    }

    #[test]
    fn without_contrast_all_are_alike() {
        let film = step(0, 0.0);
        let schedule = Schedule { round: PILOT_ROUND, base: vec![1; 100], targets: vec![PILOT; 100] };
        assert_eq!(targets(&film, &schedule), vec![round_end(PILOT_ROUND + 1); 100]);
    }
}
