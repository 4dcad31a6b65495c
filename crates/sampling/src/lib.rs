//! The lecture's toolbox: random numbers, sample sequences, samplers, warps, distributions, estimators, statistics and
//! multiple importance sampling. Nothing here knows about light; a student can use it alone.
//!
//! Conventions: random numbers lie in `[0, 1)`. A warp is a triple `square_to_x`, `square_to_x_pdf`, `x_to_square`:
//! the map, its density with respect to the natural measure of the target, and the inverse map.
//! Directions are unit vectors, the local pole is `z`.
//!
//! The irradiance under a sky of radiance `z`, which is `2 pi / 3`, with 256 cosine-weighted samples:
//!
//! ```
//! use steradian_sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};
//! use steradian_sampling::{Sampler, SamplerSettings, VarianceEstimator};
//!
//! let mut sampler = Sampler::new(&SamplerSettings::default());
//! let mut irradiance = VarianceEstimator::default();
//! for index in 0..256 {
//!     sampler.start([0, 0], index, 0);
//!     let w = square_to_cosine_hemisphere(sampler.next_2d());
//!     irradiance.add(f64::from(w.z * w.z / square_to_cosine_hemisphere_pdf(w)));
//! }
//! assert!((irradiance.mean() - 2.0 / 3.0 * std::f64::consts::PI).abs() < 0.01);
//! ```

pub mod distribution;
pub mod estimator;
pub mod mis;
pub mod rng;
pub mod sampler;
pub mod sequence;
pub mod spline;
pub mod statistics;
pub mod warp;

pub use distribution::{AliasTable, Piecewise1D, Piecewise2D, SummedAreaTable, VarianceEstimator, WindowedPiecewise2D};
pub use mis::{balance_heuristic, power_heuristic};
pub use rng::Rng;
pub use sampler::{Randomization, Sampler, SamplerKind, SamplerSettings};
