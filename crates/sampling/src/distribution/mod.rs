//! Tabulated distributions (piecewise constant in one and two dimensions, alias tables, windows of summed-area tables)
//! and the running variance of a stream of numbers.

mod alias_table;
mod conditional_2d;
mod piecewise_1d;
mod piecewise_2d;
mod summed_area;
mod variance;

pub use alias_table::{AliasBin, AliasTable};
pub use conditional_2d::{BilinearTable, ConditionalBilinear2D, Slices, SquareSample};
pub use piecewise_1d::{ContinuousSample, DiscreteSample, Piecewise1D};
pub use piecewise_2d::Piecewise2D;
pub use summed_area::{SummedAreaTable, WindowedPiecewise2D};
pub use variance::VarianceEstimator;

/// Whether all the values may serve as an unnormalised density.
fn is_density(values: &[f32]) -> bool {
    !values.is_empty() && values.iter().all(|v| v.is_finite() && *v >= 0.0)
}

/// Pieces for each entry of a guide.
const GUIDED: usize = 8;

/// Where to begin looking in a distribution function (Chen and Asau 1974): entry `k` is the interval of `k` over their number.
fn fill_guide(cdf: &[f32], guide: &mut [u32]) {
    let last = (guide.len() - 1) as f32;
    for (k, at) in guide.iter_mut().enumerate() {
        *at = find_interval(cdf, k as f32 / last) as u32;
    }
}

/// The length of the guide of a distribution of `n` pieces.
fn guide_len(n: usize) -> usize {
    n.div_ceil(GUIDED) + 1
}

/// [`find_interval`] with the help of a guide, which must have been filled from this `cdf`.
#[inline]
fn find_guided(cdf: &[f32], guide: &[u32], u: f32) -> usize {
    find_between(cdf, guided(guide, u), u)
}

/// The first and the last interval that `u` may lie in.
#[inline]
fn guided(guide: &[u32], u: f32) -> [u32; 2] {
    let last = guide.len() - 1;
    let k = ((u * last as f32) as usize).min(last - 1);
    [guide[k], guide[k + 1]]
}

/// [`find_interval`] where to look first.
#[inline]
fn find_between(cdf: &[f32], [low, high]: [u32; 2], u: f32) -> usize {
    let (low, high) = (low as usize, high as usize);
    let found = low + cdf[low + 1..=high + 1].partition_point(|&c| c <= u);
    // Rounding may have led to the neighbour.
    let fits = cdf[low] <= u && (found <= high || high + 2 == cdf.len());
    if fits { found.min(cdf.len() - 2) } else { find_interval(cdf, u) }
}

/// The largest `i` in `0..cdf.len() - 1` with `cdf[i] <= u`; `cdf` starts with zero and does not decrease.
#[inline]
fn find_interval(cdf: &[f32], u: f32) -> usize {
    cdf.partition_point(|&c| c <= u).saturating_sub(1).min(cdf.len().saturating_sub(2))
}

#[cfg(test)]
mod guide_tests {
    use super::*;

    #[test]
    fn a_guide_leads_to_what_is_found_without() {
        let mut rng = crate::Rng::new(3, 1);
        for n in [1usize, 2, 7, 8, 9, 64, 1000] {
            for kind in 0..4 {
                let values: Vec<f32> = (0..n)
                    .map(|i| match kind {
                        0 => rng.f32(),
                        1 => f32::from(rng.below(10) == 0),
                        2 => {
                            if i == n / 3 {
                                1e6
                            } else {
                                1e-3
                            }
                        }
                        _ => 0.0,
                    })
                    .collect();
                let mut cdf = vec![0.0; n + 1];
                piecewise_1d::fill_cdf(&values, &mut cdf);
                let mut guide = vec![0; guide_len(n)];
                fill_guide(&cdf, &mut guide);
                let mut check = |u: f32| assert_eq!(find_guided(&cdf, &guide, u), find_interval(&cdf, u), "{u} of {n}");
                cdf.clone().into_iter().flat_map(|c| [c, c.next_down().max(0.0), c.next_up()]).for_each(&mut check);
                (0..guide.len()).map(|k| k as f32 / (guide.len() - 1) as f32).for_each(&mut check);
                (0..2000).map(|_| rng.f32()).for_each(&mut check);
            }
        }
    }
}
