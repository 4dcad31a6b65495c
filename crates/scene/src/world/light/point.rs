//! The isotropic point light (PBRT 4th ed., 12.2).

use super::bounds::LightBounds;
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{PI, Point3};
use steradian_spectrum::{Spectrum, Wavelengths};

/// A point that shines alike to all sides.
#[derive(Clone, Debug)]
pub(super) struct PointLight {
    /// Position in world space.
    pub p: Point3,
    /// Radiant intensity up to `scale`.
    pub intensity: Spectrum,
    /// Factor.
    pub scale: f32,
}

impl FarLight for PointLight {
    const IS_DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        FarSample::point(self.p, from, self.intensity.eval(w) * self.scale)
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        brightness(&self.intensity) * self.scale * 4.0 * PI
    }

    fn bounds(&self, power: f32) -> Option<LightBounds> {
        Some(LightBounds::point(self.p, power))
    }
}
