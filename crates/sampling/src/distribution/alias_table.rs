//! Walker's alias method: an index with given probabilities in constant time (Vose 1991).

use super::{DiscreteSample, is_density};
use steradian_math::ONE_MINUS_EPSILON;

/// One bin: stay with probability `keep`, else go to `alias`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AliasBin {
    /// Probability of keeping the bin's own index.
    pub keep: f32,
    /// Probability of the index in the whole distribution.
    pub probability: f32,
    /// The other index of this bin.
    pub alias: u32,
}

/// A discrete distribution sampled in constant time. If all the weights are zero it is uniform.
#[derive(Clone, Debug)]
pub struct AliasTable {
    bins: Vec<AliasBin>,
    sum: f64,
}

impl AliasTable {
    /// `None` if there is no weight, more than 2^32 - 1, or one is negative or not finite.
    pub fn new(weights: &[f32]) -> Option<Self> {
        if !is_density(weights) || u32::try_from(weights.len()).is_err() {
            return None;
        }
        let n = weights.len();
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let probability = |w: f32| if sum > 0.0 { f64::from(w) / sum } else { 1.0 / n as f64 };
        let mut bins: Vec<AliasBin> = (0..n)
            .map(|i| AliasBin { keep: 1.0, probability: probability(weights[i]) as f32, alias: i as u32 })
            .collect();
        let mut scaled: Vec<f64> = weights.iter().map(|&w| probability(w) * n as f64).collect();
        let (mut under, mut over): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
        while let (Some(small), Some(&large)) = (under.pop(), over.last()) {
            bins[small].keep = scaled[small] as f32;
            bins[small].alias = large as u32;
            scaled[large] -= 1.0 - scaled[small];
            if scaled[large] < 1.0 {
                over.pop();
                under.push(large);
            }
        }
        // What is left differs from one by rounding only and keeps itself; but nothing may keep an impossible index.
        let possible = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        if sum > 0.0 {
            for i in 0..n {
                if weights[i] == 0.0 && bins[i].keep > 0.0 {
                    bins[i] = AliasBin { keep: 0.0, alias: possible as u32, ..bins[i] };
                }
            }
        }
        Some(Self { bins, sum })
    }

    /// Number of indices.
    #[inline]
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Never true; here since there is a `len`.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// The bins, for copying to another device.
    pub fn bins(&self) -> &[AliasBin] {
        &self.bins
    }

    /// Sum of the weights.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// Index with probability proportional to its weight.
    #[inline]
    pub fn sample(&self, u: f32) -> DiscreteSample {
        // In double precision the fraction keeps some bits even with millions of bins.
        let place = f64::from(u) * self.len() as f64;
        let bin_index = (place as usize).min(self.len() - 1);
        let fraction = (place - bin_index as f64) as f32;
        let bin = self.bins[bin_index];
        let (index, remapped) = if fraction < bin.keep {
            (bin_index, fraction / bin.keep)
        } else {
            (bin.alias as usize, (fraction - bin.keep) / (1.0 - bin.keep))
        };
        DiscreteSample {
            index,
            probability: self.bins[index].probability,
            remapped: if remapped >= 0.0 { remapped.min(ONE_MINUS_EPSILON) } else { 0.0 },
        }
    }

    /// Probability of `index`; zero beyond the last one.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.bins.get(index).map_or(0.0, |bin| bin.probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_carry_exactly_the_probabilities() {
        for weights in [vec![1.0], vec![0.0, 1.0, 3.0, 0.0, 4.0, 0.5], vec![1e-20, 1.0, 1e20], vec![0.0; 3]] {
            let table = AliasTable::new(&weights).unwrap();
            let mut mass = vec![0.0f64; weights.len()];
            for (i, bin) in table.bins().iter().enumerate() {
                mass[i] += f64::from(bin.keep) / weights.len() as f64;
                mass[bin.alias as usize] += (1.0 - f64::from(bin.keep)) / weights.len() as f64;
            }
            for (i, m) in mass.iter().enumerate() {
                assert!((m - f64::from(table.probability(i))).abs() < 1e-6, "{weights:?}: index {i} has mass {m}");
            }
        }
    }

    #[test]
    fn impossible_indices_are_never_chosen_and_the_remainder_is_uniform() {
        let table = AliasTable::new(&[0.0, 1.0, 0.0, 2.0, 0.0]).unwrap();
        let mut mean = [0.0f64; 2];
        let mut count = [0u32; 2];
        for i in 0..30_000 {
            let s = table.sample((i as f32 + 0.5) / 30_000.0);
            assert!(s.index == 1 || s.index == 3);
            mean[s.index / 2] += f64::from(s.remapped);
            count[s.index / 2] += 1;
        }
        assert_eq!(count[0] + count[1], 30_000);
        assert!((f64::from(count[0]) / 10_000.0 - 1.0).abs() < 1e-2);
        assert!(
            (mean[0] / f64::from(count[0]) - 0.5).abs() < 1e-2 && (mean[1] / f64::from(count[1]) - 0.5).abs() < 1e-2
        );
        assert!(AliasTable::new(&[]).is_none() && AliasTable::new(&[-1.0]).is_none());
    }
}
