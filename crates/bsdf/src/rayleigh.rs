//! Scattering by what is much smaller than the wavelength, without polarisation (Rayleigh 1871).

use crate::PhaseSample;
use steradian_math::{Frame, INV_PI, TAU, Vec3, safe_sqrt, sqr};

/// The phase function of molecules: `3 / (16 pi) (1 + cos^2)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rayleigh;

impl Rayleigh {
    /// Value per steradian, which is also the density of [`Self::sample`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        Self::of_cosine(wo.dot(wi))
    }

    /// Density of [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(wo, wi)
    }

    /// Takes a direction by inverting the distribution of the cosine.
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> PhaseSample {
        // Where c^3 + 3 c = 8 u - 4: Newton's steps on a curve that is almost a line.
        let target = 8.0 * u[0] - 4.0;
        let mut cos = 0.25 * target;
        for _ in 0..5 {
            cos -= (cos * (sqr(cos) + 3.0) - target) / (3.0 * sqr(cos) + 3.0);
        }
        let cos = cos.clamp(-1.0, 1.0);
        let local = Vec3::spherical(safe_sqrt(1.0 - sqr(cos)), cos, TAU * u[1]);
        PhaseSample { wi: Frame::from_z(wo).from_local(local), pdf: Self::of_cosine(cos) }
    }

    #[inline]
    fn of_cosine(cos: f32) -> f32 {
        3.0 / 16.0 * INV_PI * (1.0 + sqr(cos))
    }
}
