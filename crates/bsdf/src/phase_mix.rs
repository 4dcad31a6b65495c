//! The closed set of phase functions, and mixtures of them.

use crate::{HenyeyGreenstein, PhaseSample, Rayleigh, TabulatedPhase};
use steradian_math::{ONE_MINUS_EPSILON, Vec3};

/// Parts of a mixture, at most.
pub const MOST_PHASES: usize = 4;

/// One phase function.
#[derive(Clone, Debug, PartialEq)]
pub enum PhaseFunction {
    /// Of one mean cosine.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Of molecules.
    Rayleigh(Rayleigh),
    /// Of a table.
    Tabulated(TabulatedPhase),
}

/// The only `match` over the kinds of phase functions.
macro_rules! with_phase {
    ($phase:expr, $p:ident => $body:expr) => {
        match $phase {
            PhaseFunction::HenyeyGreenstein($p) => $body,
            PhaseFunction::Rayleigh($p) => $body,
            PhaseFunction::Tabulated($p) => $body,
        }
    };
}

/// Phase functions and how much of each there is, at a point of a medium.
///
/// `wo` and `wi` both point away from the point. The mixture is normalised and sampled exactly, as its parts are.
#[derive(Clone, Copy, Debug)]
pub struct PhaseMix<'w> {
    parts: &'w [PhaseFunction],
    weights: [f32; MOST_PHASES],
}

impl<'w> PhaseMix<'w> {
    /// The parts, one to [`MOST_PHASES`], and their weights, which add up to one.
    #[inline]
    pub fn new(parts: &'w [PhaseFunction], weights: [f32; MOST_PHASES]) -> Self {
        debug_assert!((1..=MOST_PHASES).contains(&parts.len()), "{} phase functions", parts.len());
        Self { parts, weights }
    }

    /// A name, for those who look at paths.
    pub fn name(&self) -> &'static str {
        match self.parts {
            [PhaseFunction::HenyeyGreenstein(_)] => "henyey-greenstein",
            [PhaseFunction::Rayleigh(_)] => "rayleigh",
            [PhaseFunction::Tabulated(_)] => "tabulated",
            _ => "blend",
        }
    }

    /// Value per steradian, which is also the density of [`Self::sample`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.parts {
            [one] => with_phase!(one, p => p.eval(wo, wi)),
            parts => parts.iter().zip(self.weights).map(|(f, w)| w * with_phase!(f, p => p.eval(wo, wi))).sum(),
        }
    }

    /// Density of [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(wo, wi)
    }

    /// Takes a direction: of one part, chosen by weight with the first number, which then serves that part.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> PhaseSample {
        if let [one] = self.parts {
            return with_phase!(one, p => p.sample(wo, u));
        }
        let mut left = u[0];
        let mut chosen = 0;
        for (i, &w) in self.weights[..self.parts.len()].iter().enumerate().filter(|(_, w)| **w > 0.0) {
            chosen = i;
            if left < w {
                break;
            }
            left -= w;
        }
        let again = (left / self.weights[chosen]).clamp(0.0, ONE_MINUS_EPSILON);
        let wi = with_phase!(&self.parts[chosen], p => p.sample(wo, [again, u[1]])).wi;
        PhaseSample { wi, pdf: self.eval(wo, wi) }
    }
}
