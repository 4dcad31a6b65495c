//! One file for each topic.

use crate::experiment::{Experiment, Setting};
use crate::{Error, Topic};

mod adaptive;
mod aliasing;
mod convergence;
mod cost;
mod depth_of_field;
mod estimator;
mod gloss;
mod importance;
mod mis;
mod motion_blur;
mod penumbra;
mod quadrature;
mod roulette;
mod sequences;
mod soft_shadows;
mod stratified;
mod supersampling;

/// What most topics need.
mod prelude {
    pub use crate::claim::{Claim, t_limit, z_limit};
    pub use crate::experiment::{Axis, Experiment, Figure, Mark, Setting, Table};
    pub use crate::measure::{ErrorAt, Slope, curve, plain_slope, slope, squares, variance_with_error};
    pub use crate::{Error, Topic};
    pub(crate) use crate::{paint, parallel, stage};
    pub use steradian_sampling::estimator::monte_carlo;
    pub use steradian_sampling::statistics::{mean_interval, normal_pdf};
    pub use steradian_sampling::{Rng, SamplerKind, VarianceEstimator};
}

/// Runs one topic.
pub fn run(topic: Topic, setting: &Setting) -> Result<Experiment, Error> {
    match topic {
        Topic::Aliasing => aliasing::run(setting),
        Topic::Supersampling => supersampling::run(setting),
        Topic::Adaptive => adaptive::run(setting),
        Topic::Gloss => gloss::run(setting),
        Topic::SoftShadows => soft_shadows::run(setting),
        Topic::DepthOfField => depth_of_field::run(setting),
        Topic::MotionBlur => motion_blur::run(setting),
        Topic::Cost => cost::run(setting),
        Topic::Penumbra => penumbra::run(setting),
        Topic::Quadrature => quadrature::run(setting),
        Topic::Estimator => estimator::run(setting),
        Topic::Importance => importance::run(setting),
        Topic::Stratified => stratified::run(setting),
        Topic::Mis => mis::run(setting),
        Topic::Roulette => roulette::run(setting),
        Topic::Sequences => sequences::run(setting),
        Topic::Convergence => convergence::run(setting),
    }
}
