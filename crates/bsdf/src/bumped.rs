//! A lobe in a frame that a map has tilted, and what the tilt takes away: light from below the surface as it was, and of light that grazes it
//! what the bumps in its way would keep off (Conty Estevez, Lecocq and Stein 2019, "A microfacet-based shadowing function to solve the bump
//! terminator problem", Ray Tracing Gems, chapter 12).

use crate::altered::Altered;
use crate::bsdf::Bsdf;
use crate::diffuse::Diffuse;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::measured::Measured;
use crate::plastic::Plastic;
use crate::principled::Principled;
use steradian_math::{Vec3, sqr};
use steradian_spectrum::Lanes;

/// What can be tilted.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "each variant is documented at its type")]
pub enum TiltedLobe<'w> {
    Diffuse(Diffuse),
    Altered(Altered),
    Plastic(Plastic<'w>),
    Principled(Principled),
    Measured(Measured<'w>),
}

macro_rules! with_tilted {
    ($tilted:expr, $lobe:ident => $body:expr) => {
        match $tilted {
            TiltedLobe::Diffuse($lobe) => $body,
            TiltedLobe::Altered($lobe) => $body,
            TiltedLobe::Plastic($lobe) => $body,
            TiltedLobe::Principled($lobe) => $body,
            TiltedLobe::Measured($lobe) => $body,
        }
    };
}

/// A lobe about a tilted normal. Reciprocal it is not: the shadow falls on the light's side.
#[derive(Clone, Copy, Debug)]
pub struct Bumped<'w> {
    lobe: TiltedLobe<'w>,
    /// The normal that was tilted, in the frame of the lobe.
    up: Vec3,
    /// The squared roughness of a surface of such bumps; zero if they throw no shadow.
    alpha2: f32,
}

impl<'w> Bumped<'w> {
    /// `bsdf` about a normal that was at `up`, a unit vector of its frame, before a map tilted it; `None` for lobes that no such map is for.
    #[inline]
    pub fn new(bsdf: Bsdf<'w>, up: Vec3, shadowing: bool) -> Option<Self> {
        let lobe = match bsdf {
            Bsdf::Diffuse(lobe) => TiltedLobe::Diffuse(lobe),
            Bsdf::Altered(lobe) => TiltedLobe::Altered(lobe),
            Bsdf::Plastic(lobe) => TiltedLobe::Plastic(lobe),
            Bsdf::Principled(lobe) => TiltedLobe::Principled(lobe),
            Bsdf::Measured(lobe) => TiltedLobe::Measured(lobe),
            _ => return None,
        };
        let alpha2 = if shadowing { (0.125 * tan_squared(up.z)).min(1.0) } else { 0.0 };
        Some(Self { lobe, up, alpha2 })
    }

    /// The share of light from or to the light's side that the bumps let by.
    #[inline]
    fn unshadowed(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        let light = match mode {
            TransportMode::Radiance => wi,
            TransportMode::Importance => wo,
        };
        let cos = light.dot(self.up);
        if cos * light.z > 0.0 { 2.0 / (1.0 + (1.0 + self.alpha2 * tan_squared(cos)).sqrt()) } else { 0.0 }
    }
}

/// The squared tangent of an angle by its cosine.
#[inline]
fn tan_squared(cos: f32) -> f32 {
    let cos2 = sqr(cos);
    ((1.0 - cos2) / cos2.max(f32::MIN_POSITIVE)).max(0.0)
}

impl Lobe for Bumped<'_> {
    #[inline]
    fn flags(&self) -> Lobes {
        with_tilted!(&self.lobe, lobe => lobe.flags())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        let share = self.unshadowed(wo, wi, mode);
        if share > 0.0 { with_tilted!(&self.lobe, lobe => lobe.eval(wo, wi, mode)) * share } else { Lanes::ZERO }
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        if self.unshadowed(wo, wi, mode) > 0.0 {
            with_tilted!(&self.lobe, lobe => lobe.pdf_part(wo, wi, mode, part))
        } else {
            0.0
        }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        let share = self.unshadowed(wo, wi, mode);
        if share > 0.0 {
            let (f, pdf) = with_tilted!(&self.lobe, lobe => lobe.eval_and_pdf(wo, wi, mode));
            (f * share, pdf)
        } else {
            (Lanes::ZERO, 0.0)
        }
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        let mut sample = with_tilted!(&self.lobe, lobe => lobe.sample_part(wo, u_lobe, u, mode, part))?;
        let share = self.unshadowed(wo, sample.wi, mode);
        sample.weight *= share;
        (share > 0.0).then_some(sample)
    }

    fn regularize(&mut self) {
        with_tilted!(&mut self.lobe, lobe => lobe.regularize());
    }
}
