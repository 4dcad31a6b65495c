//! The closed set of lobes that a surface can have.

use crate::altered::Altered;
use crate::bumped::Bumped;
use crate::conductor::Conductor;
use crate::dielectric::Dielectric;
use crate::diffuse::Diffuse;
use crate::diffuse_transmission::DiffuseTransmission;
use crate::hair::Hair;
use crate::layered::{CoatedConductor, CoatedDiffuse};
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::measured::Measured;
use crate::metallic_roughness::MetallicRoughness;
use crate::plastic::Plastic;
use crate::principled::Principled;
use crate::subsurface::SubsurfaceExit;
use crate::thin_dielectric::{Straight, ThinDielectric};
use steradian_math::Vec3;
use steradian_spectrum::Lanes;

/// What a surface does to light; large tables are borrowed from the world. The methods are those of [`Lobe`], whose contract they obey.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "each variant is documented at its type")]
pub enum Bsdf<'w> {
    Diffuse(Diffuse),
    Conductor(Conductor),
    Dielectric(Dielectric),
    ThinDielectric(ThinDielectric),
    DiffuseTransmission(DiffuseTransmission),
    CoatedDiffuse(CoatedDiffuse),
    CoatedConductor(CoatedConductor),
    Hair(Hair),
    Measured(Measured<'w>),
    SubsurfaceExit(SubsurfaceExit),
    MetallicRoughness(MetallicRoughness),
    Plastic(Plastic<'w>),
    Altered(Altered),
    Principled(Principled),
    Bumped(Bumped<'w>),
}

/// The only `match` over the kinds of lobes.
macro_rules! with_lobe {
    ($bsdf:expr, $lobe:ident => $body:expr) => {
        match $bsdf {
            Bsdf::Diffuse($lobe) => $body,
            Bsdf::Conductor($lobe) => $body,
            Bsdf::Dielectric($lobe) => $body,
            Bsdf::ThinDielectric($lobe) => $body,
            Bsdf::DiffuseTransmission($lobe) => $body,
            Bsdf::CoatedDiffuse($lobe) => $body,
            Bsdf::CoatedConductor($lobe) => $body,
            Bsdf::Hair($lobe) => $body,
            Bsdf::Measured($lobe) => $body,
            Bsdf::SubsurfaceExit($lobe) => $body,
            Bsdf::MetallicRoughness($lobe) => $body,
            Bsdf::Plastic($lobe) => $body,
            Bsdf::Altered($lobe) => $body,
            Bsdf::Principled($lobe) => $body,
            Bsdf::Bumped($lobe) => $body,
        }
    };
}

impl Lobe for Bsdf<'_> {
    #[inline]
    fn flags(&self) -> Lobes {
        with_lobe!(self, lobe => lobe.flags())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        with_lobe!(self, lobe => lobe.eval(wo, wi, mode))
    }

    #[inline]
    fn eval_cos(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        with_lobe!(self, lobe => lobe.eval_cos(wo, wi, mode))
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        with_lobe!(self, lobe => lobe.pdf_part(wo, wi, mode, part))
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        with_lobe!(self, lobe => lobe.pdf(wo, wi, mode))
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        with_lobe!(self, lobe => lobe.eval_and_pdf(wo, wi, mode))
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        with_lobe!(self, lobe => lobe.sample_part(wo, u_lobe, u, mode, part))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<LobeSample> {
        with_lobe!(self, lobe => lobe.sample(wo, u_lobe, u, mode))
    }

    #[inline]
    fn regularize(&mut self) {
        with_lobe!(self, lobe => lobe.regularize());
    }
}

impl Bsdf<'_> {
    /// What gets through without being turned, if the lobe is a pane.
    #[inline]
    pub fn straight(&self, wo: Vec3) -> Option<Straight> {
        match self {
            Self::ThinDielectric(pane) => Some(pane.straight(wo)),
            Self::Altered(altered) => altered.straight(wo),
            _ => None,
        }
    }

    /// The name of the kind of lobe, for people.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Diffuse(_) => "diffuse",
            Self::Conductor(_) => "conductor",
            Self::Dielectric(_) => "dielectric",
            Self::ThinDielectric(_) => "thin dielectric",
            Self::DiffuseTransmission(_) => "diffuse transmission",
            Self::CoatedDiffuse(_) => "coated diffuse",
            Self::CoatedConductor(_) => "coated conductor",
            Self::Hair(_) => "hair",
            Self::Measured(_) => "measured",
            Self::SubsurfaceExit(_) => "subsurface exit",
            Self::MetallicRoughness(_) => "metallic-roughness",
            Self::Plastic(_) => "plastic",
            Self::Altered(_) => "altered interface",
            Self::Principled(_) => "principled",
            Self::Bumped(_) => "bumped",
        }
    }

    /// Estimate of the fraction of light from `wo` that is scattered anywhere, from sixteen fixed points; the same for
    /// every caller. For albedo images and denoisers, not for transport.
    pub fn albedo(&self, wo: Vec3) -> Lanes {
        match self {
            Self::Diffuse(lobe) => lobe.reflectance,
            Self::DiffuseTransmission(lobe) => lobe.reflectance + lobe.transmittance,
            other => crate::albedo::estimate(other, wo, 16),
        }
    }
}

macro_rules! from_lobe {
    ($($lobe:ident),+) => {
        $(impl From<$lobe> for Bsdf<'_> {
            #[inline]
            fn from(lobe: $lobe) -> Self {
                Self::$lobe(lobe)
            }
        })+
    };
}

from_lobe!(
    Diffuse,
    Conductor,
    Dielectric,
    ThinDielectric,
    DiffuseTransmission,
    CoatedDiffuse,
    CoatedConductor,
    Hair,
    SubsurfaceExit,
    MetallicRoughness,
    Altered,
    Principled
);

impl<'w> From<Plastic<'w>> for Bsdf<'w> {
    #[inline]
    fn from(lobe: Plastic<'w>) -> Self {
        Self::Plastic(lobe)
    }
}

impl<'w> From<Bumped<'w>> for Bsdf<'w> {
    #[inline]
    fn from(lobe: Bumped<'w>) -> Self {
        Self::Bumped(lobe)
    }
}

impl<'w> From<Measured<'w>> for Bsdf<'w> {
    #[inline]
    fn from(lobe: Measured<'w>) -> Self {
        Self::Measured(lobe)
    }
}
