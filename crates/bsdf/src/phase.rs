//! Phase functions: scattering inside a medium. Any frame will do, there is no normal.

use steradian_math::{Frame, INV_4PI, TAU, Vec3, safe_sqrt, sqr};

/// A sampled direction; the value of the phase function there is `pdf`, so the weight is one.
#[derive(Clone, Copy, Debug)]
pub struct PhaseSample {
    /// The direction.
    pub wi: Vec3,
    /// Density per solid angle, and value of the phase function.
    pub pdf: f32,
}

/// The phase function of Henyey and Greenstein (1941).
///
/// `wo` and `wi` both point away from the point, so going straight on is `wi = -wo`. It is normalised and sampled exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    /// Mean cosine between the directions of travel before and after; positive scatters forward.
    g: f32,
}

impl HenyeyGreenstein {
    /// `g` is clamped to `[-0.99, 0.99]`: closer to one the function is a numerically hopeless Dirac.
    #[inline]
    pub fn new(g: f32) -> Self {
        Self { g: g.clamp(-0.99, 0.99) }
    }

    /// The mean cosine.
    #[inline]
    pub fn g(&self) -> f32 {
        self.g
    }

    /// Value per steradian, which is also the density of [`Self::sample`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.of_cosine(wo.dot(wi))
    }

    /// Density of [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(wo, wi)
    }

    /// Takes a direction by inverting the distribution of the cosine.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> PhaseSample {
        let g = self.g;
        let cos = if g.abs() < 1e-3 {
            1.0 - 2.0 * u[0]
        } else {
            -1.0 / (2.0 * g) * (1.0 + sqr(g) - sqr((1.0 - sqr(g)) / (1.0 + g - 2.0 * g * u[0])))
        };
        let cos = cos.clamp(-1.0, 1.0);
        let local = Vec3::spherical(safe_sqrt(1.0 - cos * cos), cos, TAU * u[1]);
        PhaseSample { wi: Frame::from_z(wo).from_local(local), pdf: self.of_cosine(cos) }
    }

    #[inline]
    pub(crate) fn of_cosine(&self, cos: f32) -> f32 {
        let g = self.g;
        let d = 1.0 + g * g + 2.0 * g * cos;
        INV_4PI * (1.0 - g * g) / (d * safe_sqrt(d))
    }
}
