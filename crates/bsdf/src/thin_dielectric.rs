//! A pane so thin that refraction displaces nothing: all orders of internal reflection summed (Stokes 1862).

use crate::direction::mirror;
use crate::fresnel::fresnel_dielectric;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{Vec3, sqr};
use steradian_spectrum::Lanes;

/// What gets through a surface without being turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Straight {
    /// The share of the light.
    pub transmittance: Lanes,
    /// The probability with which sampling the lobe goes straight on: that is where its first number is `1 - chance` or more.
    pub chance: f32,
}

/// Two parallel smooth interfaces; light is mirrored or goes straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of refraction of the pane over that of its surroundings.
    pub eta: f32,
}

impl ThinDielectric {
    /// A pane of this relative index.
    #[inline]
    pub const fn new(eta: f32) -> Self {
        Self { eta }
    }

    /// Reflectance of the pane: `R + T R T + T R^3 T + ...`.
    #[inline]
    fn reflectance(&self, wo: Vec3) -> f32 {
        let r = fresnel_dielectric(wo.z.abs(), self.eta);
        if r < 1.0 { r + sqr(1.0 - r) * r / (1.0 - r * r) } else { 1.0 }
    }

    /// What goes straight on, and the chance with which `sample` lets it.
    #[inline]
    pub(crate) fn straight(&self, wo: Vec3) -> Straight {
        let t = if wo.z == 0.0 { 0.0 } else { 1.0 - self.reflectance(wo) };
        Straight { transmittance: Lanes::splat(t), chance: t }
    }
}

impl Lobe for ThinDielectric {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION | Lobes::TRANSMISSION | Lobes::SPECULAR
    }

    #[inline]
    fn eval(&self, _wo: Vec3, _wi: Vec3, _mode: TransportMode) -> Lanes {
        Lanes::ZERO
    }

    #[inline]
    fn pdf_part(&self, _wo: Vec3, _wi: Vec3, _mode: TransportMode, _part: Part) -> f32 {
        0.0
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, _: [f32; 2], _: TransportMode, part: Part) -> Option<LobeSample> {
        let r = self.reflectance(wo);
        let (pr, pt) = part.mask(r, 1.0 - r);
        let sum = pr + pt;
        if sum == 0.0 || wo.z == 0.0 {
            return None;
        }
        let (wi, pdf, flag) = if u_lobe < pr / sum {
            (mirror(wo), pr / sum, Lobes::REFLECTION)
        } else {
            (-wo, pt / sum, Lobes::TRANSMISSION)
        };
        Some(LobeSample {
            wi,
            weight: Lanes::splat(sum),
            pdf,
            flags: flag | Lobes::SPECULAR,
            eta: 1.0,
            pdf_is_proportional: false,
        })
    }
}
