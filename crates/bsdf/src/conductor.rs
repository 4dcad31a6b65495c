//! Metals: a mirror or rough microfacet reflection with the Fresnel equations for complex indices (Torrance and Sparrow 1967).

use crate::direction::{mirror, reflect, same_hemisphere};
use crate::fresnel::fresnel_conductor_lanes;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::microfacet::TrowbridgeReitz;
use crate::microfacets::Microfacets;
use steradian_math::Vec3;
use steradian_spectrum::Lanes;

/// Reflection off a metal with complex index `eta + i k` relative to the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// The microfacets.
    pub distribution: Microfacets,
    /// Real part of the index.
    pub eta: Lanes,
    /// Imaginary part of the index.
    pub k: Lanes,
}

impl Conductor {
    /// A lobe with this roughness and index.
    #[inline]
    pub fn new(distribution: impl Into<Microfacets>, eta: Lanes, k: Lanes) -> Self {
        Self { distribution: distribution.into(), eta, k }
    }

    /// Half vector of a reflection, in the upper hemisphere.
    #[inline]
    fn half_vector(&self, wo: Vec3, wi: Vec3) -> Option<Vec3> {
        if !same_hemisphere(wo, wi) || self.distribution.is_smooth() {
            return None;
        }
        let wm = (wo + wi).try_normalize()?;
        Some(if wm.z < 0.0 { -wm } else { wm })
    }
}

/// A rough metal for loops over many paths: the numbers of [`Conductor`] with the usual microfacets, without branches.
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    /// The microfacets, which are not smooth.
    pub distribution: TrowbridgeReitz,
    /// Real part of the index.
    pub eta: Lanes,
    /// Imaginary part of the index.
    pub k: Lanes,
}

impl RoughConductor {
    /// As [`Lobe::eval_and_pdf`].
    #[inline(always)]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Lanes, f32) {
        let d = &self.distribution;
        let sum = wo + wi;
        let l = sum.length();
        let wm = sum / l;
        let sign = if wm.z < 0.0 { -1.0 } else { 1.0 };
        let wm = Vec3::new(wm.x * sign, wm.y * sign, wm.z * sign);
        let there = same_hemisphere(wo, wi) & (l > 0.0) & (l < f32::INFINITY);
        let common = d.normals(wm) / (4.0 * wo.z.abs());
        let fresnel = fresnel_conductor_lanes(wo.abs_dot(wm), self.eta, self.k);
        let f = fresnel * (common * d.masking_shadowing(wo, wi));
        let pdf = common * d.masking(wo);
        let only = |v: f32| if there { v } else { 0.0 };
        (Lanes([only(f.0[0]), only(f.0[1]), only(f.0[2]), only(f.0[3])]), only(pdf))
    }

    /// As [`Lobe::sample`]: direction, weight, density, and whether there is any.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> (Vec3, Lanes, f32, bool) {
        let d = &self.distribution;
        let wm = d.sample_visible_normal(wo, u);
        let wi = reflect(wo, wm);
        let masking = d.masking(wo);
        let pdf = masking * d.normals(wm) / (4.0 * wo.z.abs());
        let fresnel = fresnel_conductor_lanes(wo.abs_dot(wm), self.eta, self.k);
        let weight = fresnel * (d.masking_shadowing(wo, wi) / masking);
        (wi, weight, pdf, (wo.z != 0.0) & same_hemisphere(wo, wi))
    }
}

impl Lobe for Conductor {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION | if self.distribution.is_smooth() { Lobes::SPECULAR } else { Lobes::GLOSSY }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> Lanes {
        let Some(wm) = self.half_vector(wo, wi) else { return Lanes::ZERO };
        let d = &self.distribution;
        fresnel_conductor_lanes(wo.abs_dot(wm), self.eta, self.k)
            * (d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z * wi.z))
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _mode: TransportMode, part: Part) -> f32 {
        match self.half_vector(wo, wi) {
            Some(wm) if part != Part::Transmission => {
                // visible_normals / (4 |wo . wm|), the dot product cancelled
                self.distribution.masking(wo) * self.distribution.normals(wm) / (4.0 * wo.z.abs())
            }
            _ => 0.0,
        }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Lanes, f32) {
        let Some(wm) = self.half_vector(wo, wi) else { return (Lanes::ZERO, 0.0) };
        let d = &self.distribution;
        // f cos = D G F / (4 cos_o)
        let common = d.normals(wm) / (4.0 * wo.z.abs());
        let fresnel = fresnel_conductor_lanes(wo.abs_dot(wm), self.eta, self.k);
        (fresnel * (common * d.masking_shadowing(wo, wi)), common * d.masking(wo))
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, _: f32, u: [f32; 2], _mode: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission || wo.z == 0.0 {
            return None;
        }
        let d = &self.distribution;
        if d.is_smooth() {
            let weight = fresnel_conductor_lanes(wo.z.abs(), self.eta, self.k);
            return Some(LobeSample::reflected(mirror(wo), weight, 1.0, Lobes::SPECULAR));
        }
        let wm = d.sample_visible_normal(wo, u);
        let wi = reflect(wo, wm);
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let masking = d.masking(wo);
        let pdf = masking * d.normals(wm) / (4.0 * wo.z.abs());
        let fresnel = fresnel_conductor_lanes(wo.abs_dot(wm), self.eta, self.k);
        // Density and distribution cancel: what is left of f cos / pdf is the shadowing.
        Some(LobeSample::reflected(wi, fresnel * (d.masking_shadowing(wo, wi) / masking), pdf, Lobes::GLOSSY))
    }

    fn regularize(&mut self) {
        self.distribution.regularize();
    }
}
