//! The lecture's toolbox: random numbers, sample sequences, samplers, warps, distributions, estimators, statistics and
//! multiple importance sampling. Nothing here knows about light; a student can use it alone.
//!
//! Conventions: random numbers lie in `[0, 1)`. A warp is a triple `square_to_x`, `square_to_x_pdf`, `x_to_square`:
//! the map, its density with respect to the natural measure of the target, and the inverse map.
//! Directions are unit vectors, the local pole is `z`.

pub mod distribution;
pub mod estimator;
pub mod mis;
pub mod rng;
pub mod sampler;
pub mod sequence;
pub mod statistics;
pub mod warp;

pub use distribution::{AliasTable, Piecewise1D, Piecewise2D, SummedAreaTable, VarianceEstimator, WindowedPiecewise2D};
pub use mis::{balance_heuristic, power_heuristic};
pub use rng::Rng;
pub use sampler::{Randomization, Sampler, SamplerKind, SamplerSettings};
