//! A thin translucent sheet: Lambertian reflection and Lambertian transmission.

use crate::direction::same_hemisphere;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{INV_PI, Vec3};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// `f = reflectance / pi` on the side of `wo`, `transmittance / pi` on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Fraction of the light that is reflected.
    pub reflectance: Lanes,
    /// Fraction of the light that is transmitted; the sum of both is at most 1.
    pub transmittance: Lanes,
}

impl DiffuseTransmission {
    /// A lobe with these two albedos.
    #[inline]
    pub const fn new(reflectance: Lanes, transmittance: Lanes) -> Self {
        Self { reflectance, transmittance }
    }

    /// Probabilities of the two sides; both zero if nothing is scattered.
    #[inline]
    fn probabilities(&self, part: Part) -> (f32, f32) {
        let (r, t) = part.mask(self.reflectance.max_component(), self.transmittance.max_component());
        let sum = r + t;
        if sum > 0.0 { (r / sum, t / sum) } else { (0.0, 0.0) }
    }
}

impl Lobe for DiffuseTransmission {
    #[inline]
    fn flags(&self) -> Lobes {
        let mut flags = Lobes::NONE;
        if !self.reflectance.is_black() {
            flags |= Lobes::REFLECTION | Lobes::DIFFUSE;
        }
        if !self.transmittance.is_black() {
            flags |= Lobes::TRANSMISSION | Lobes::DIFFUSE;
        }
        flags
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> Lanes {
        let albedo = if same_hemisphere(wo, wi) { self.reflectance } else { self.transmittance };
        albedo * INV_PI
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _mode: TransportMode, part: Part) -> f32 {
        let (pr, pt) = self.probabilities(part);
        let side = if same_hemisphere(wo, wi) { pr } else { pt };
        side * wi.z.abs() * INV_PI
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], _: TransportMode, part: Part) -> Option<LobeSample> {
        let (pr, pt) = self.probabilities(part);
        let mut wi = square_to_cosine_hemisphere(u);
        let cos = wi.z;
        let (albedo, probability, side, flag) = if u_lobe < pr {
            (self.reflectance, pr, wo.z, Lobes::REFLECTION)
        } else {
            (self.transmittance, pt, -wo.z, Lobes::TRANSMISSION)
        };
        wi.z = cos.copysign(side);
        (probability > 0.0 && cos > 0.0 && wo.z != 0.0).then(|| LobeSample {
            wi,
            weight: albedo / probability,
            pdf: probability * cos * INV_PI,
            flags: flag | Lobes::DIFFUSE,
            eta: 1.0,
            pdf_is_proportional: false,
        })
    }
}
