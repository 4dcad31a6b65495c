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

/// The largest `i` in `0..cdf.len() - 1` with `cdf[i] <= u`; `cdf` starts with zero and does not decrease.
#[inline]
fn find_interval(cdf: &[f32], u: f32) -> usize {
    cdf.partition_point(|&c| c <= u).saturating_sub(1).min(cdf.len().saturating_sub(2))
}
