//! The closed set of statistics that a rough surface can have, and what follows from any of them (Walter et al. 2007; Heitz 2014).

use crate::beckmann::Beckmann;
use crate::microfacet::TrowbridgeReitz;
use steradian_math::Vec3;

/// Distribution of microfacet normals around `+z`, with its masking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Microfacets {
    /// Trowbridge-Reitz, masking and shadowing correlated through height.
    TrowbridgeReitz(TrowbridgeReitz),
    /// Trowbridge-Reitz, masking and shadowing independent: darker at grazing angles.
    SeparableTrowbridgeReitz(TrowbridgeReitz),
    /// Beckmann, masking and shadowing independent.
    Beckmann(Beckmann),
}

impl From<TrowbridgeReitz> for Microfacets {
    #[inline]
    fn from(d: TrowbridgeReitz) -> Self {
        Self::TrowbridgeReitz(d)
    }
}

macro_rules! with_distribution {
    ($microfacets:expr, $d:ident => $body:expr) => {
        match $microfacets {
            Microfacets::TrowbridgeReitz($d) | Microfacets::SeparableTrowbridgeReitz($d) => $body,
            Microfacets::Beckmann($d) => $body,
        }
    };
}

impl Microfacets {
    /// Roughness along x and y.
    #[inline]
    pub fn alpha(&self) -> [f32; 2] {
        with_distribution!(self, d => d.alpha())
    }

    /// Whether the surface is so smooth that it is treated as a mirror.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::TrowbridgeReitz(d) | Self::SeparableTrowbridgeReitz(d) => d.is_smooth(),
            Self::Beckmann(_) => false,
        }
    }

    /// Area density of microfacets with normal `wm` per area of surface; `wm` may point to either side.
    #[inline]
    pub fn normals(&self, wm: Vec3) -> f32 {
        with_distribution!(self, d => d.normals(wm))
    }

    /// Fraction of the microfacets seen from `w` that are not masked.
    #[inline]
    pub fn masking(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + with_distribution!(self, d => d.lambda(w)))
    }

    /// Fraction visible from both directions.
    #[inline]
    pub fn masking_shadowing(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::TrowbridgeReitz(d) => d.masking_shadowing(wo, wi),
            Self::SeparableTrowbridgeReitz(_) | Self::Beckmann(_) => self.masking(wo) * self.masking(wi),
        }
    }

    /// Density per solid angle of the normals visible from `w`; what [`Self::sample_visible_normal`] has.
    #[inline]
    pub fn visible_normals(&self, w: Vec3, wm: Vec3) -> f32 {
        if w.z == 0.0 {
            return 0.0;
        }
        match self {
            Self::TrowbridgeReitz(d) | Self::SeparableTrowbridgeReitz(d) => d.visible_normals(w, wm),
            Self::Beckmann(_) => self.masking(w) / w.z.abs() * self.normals(wm) * w.abs_dot(wm),
        }
    }

    /// A normal in the upper hemisphere, visible from `w` (or from `-w` if that is the one above).
    #[inline]
    pub fn sample_visible_normal(&self, w: Vec3, u: [f32; 2]) -> Vec3 {
        with_distribution!(self, d => d.sample_visible_normal(w, u))
    }

    /// Roughens to an alpha of 0.1 to 0.3.
    pub fn regularize(&mut self) {
        with_distribution!(self, d => d.regularize());
    }
}
