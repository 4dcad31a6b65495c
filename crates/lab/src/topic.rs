//! The topics of the lecture, in its order.

use crate::Error;
use serde::{Serialize, Serializer};
use steradian_syntax::did_you_mean;

/// One section of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// Sampling, quantisation and the frequencies that masquerade as others.
    Aliasing,
    /// Many regular samples for each pixel of a polygon's edge.
    Supersampling,
    /// More rays where intensity changes rapidly.
    Adaptive,
    /// Rays distributed over reflection and refraction.
    Gloss,
    /// Rays distributed over a lamp.
    SoftShadows,
    /// Rays distributed over a lens.
    DepthOfField,
    /// Rays distributed over the time of exposure.
    MotionBlur,
    /// What brute force costs.
    Cost,
    /// The same penumbra four times for the same number of rays.
    Penumbra,
    /// Quadrature rules against random points, by dimension.
    Quadrature,
    /// The sample mean as a random variable.
    Estimator,
    /// Densities that follow the integrand.
    Importance,
    /// One sample for each part of equal probability.
    Stratified,
    /// Two densities for one integral.
    Mis,
    /// Ending paths at random, and splitting them.
    Roulette,
    /// Careful placement of samples.
    Sequences,
    /// Error against rays for every integrator.
    Convergence,
}

impl Topic {
    /// All topics in the order of the lecture.
    pub const ALL: [Topic; 17] = [
        Self::Aliasing,
        Self::Supersampling,
        Self::Adaptive,
        Self::Gloss,
        Self::SoftShadows,
        Self::DepthOfField,
        Self::MotionBlur,
        Self::Cost,
        Self::Penumbra,
        Self::Quadrature,
        Self::Estimator,
        Self::Importance,
        Self::Stratified,
        Self::Mis,
        Self::Roulette,
        Self::Sequences,
        Self::Convergence,
    ];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aliasing => "aliasing",
            Self::Supersampling => "supersampling",
            Self::Adaptive => "adaptive",
            Self::Gloss => "gloss",
            Self::SoftShadows => "soft-shadows",
            Self::DepthOfField => "depth-of-field",
            Self::MotionBlur => "motion-blur",
            Self::Cost => "cost",
            Self::Penumbra => "penumbra",
            Self::Quadrature => "quadrature",
            Self::Estimator => "estimator",
            Self::Importance => "importance",
            Self::Stratified => "stratified",
            Self::Mis => "mis",
            Self::Roulette => "roulette",
            Self::Sequences => "sequences",
            Self::Convergence => "convergence",
        }
    }

    /// The topic of this name.
    ///
    /// # Errors
    /// `Error::UnknownTopic`, with the nearest name if one is near.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| Error::UnknownTopic {
            name: name.chars().take(80).collect(),
            hint: did_you_mean(name, Self::ALL.map(Self::name)),
        })
    }
}

impl std::fmt::Display for Topic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Topic {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str(self.name())
    }
}
