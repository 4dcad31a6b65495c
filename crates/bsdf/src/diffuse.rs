//! Lambertian reflection: the same radiance in every direction of the side that is lit.

use crate::direction::same_hemisphere;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{INV_PI, Vec3};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// `f = reflectance / pi` on both sides of the surface, each lit from its own side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Fraction of the light that is reflected, in `[0, 1]`.
    pub reflectance: Lanes,
}

impl Diffuse {
    /// A lobe with this albedo.
    #[inline]
    pub const fn new(reflectance: Lanes) -> Self {
        Self { reflectance }
    }
}

impl Lobe for Diffuse {
    #[inline]
    fn flags(&self) -> Lobes {
        if self.reflectance.is_black() { Lobes::NONE } else { Lobes::REFLECTION | Lobes::DIFFUSE }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> Lanes {
        if same_hemisphere(wo, wi) { self.reflectance * INV_PI } else { Lanes::ZERO }
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _mode: TransportMode, part: Part) -> f32 {
        if part != Part::Transmission && same_hemisphere(wo, wi) { wi.z.abs() * INV_PI } else { 0.0 }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Lanes, f32) {
        if !same_hemisphere(wo, wi) {
            return (Lanes::ZERO, 0.0);
        }
        let pdf = wi.z.abs() * INV_PI;
        (self.reflectance * pdf, pdf)
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, _: f32, u: [f32; 2], _mode: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission || self.reflectance.is_black() {
            return None;
        }
        let mut wi = square_to_cosine_hemisphere(u);
        let pdf = wi.z * INV_PI;
        wi.z = wi.z.copysign(wo.z);
        (pdf > 0.0 && wo.z != 0.0).then_some(LobeSample::reflected(wi, self.reflectance, pdf, Lobes::DIFFUSE))
    }
}
