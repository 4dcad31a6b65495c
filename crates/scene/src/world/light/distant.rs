//! Parallel light from infinitely far (PBRT 4th ed., 12.3).

use super::emission::{Ball, FarEmission, from_infinity};
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{PI, Point3, Vec3};
use steradian_spectrum::{Spectrum, Wavelengths};

/// Light from one direction.
#[derive(Clone, Debug)]
pub(super) struct Distant {
    /// Unit vector towards the light, in world space.
    pub to_light: Vec3,
    /// Irradiance on a surface that faces the light, up to `scale`.
    pub radiance: Spectrum,
    /// Factor.
    pub scale: f32,
}

impl FarLight for Distant {
    const IS_DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &Arena<TextureImage>, _: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        FarSample::infinite(self.radiance.eval(w) * self.scale, self.to_light, 1.0)
    }

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        ball: &Ball,
        up: [f32; 2],
        _: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        Some(from_infinity(ball, self.to_light, self.radiance.eval(w) * self.scale, 1.0, up))
    }

    fn emission_pdf(&self, ball: &Ball, _: Vec3) -> [f32; 2] {
        [1.0, ball.pdf()]
    }

    fn power(&self, _: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        brightness(&self.radiance) * self.scale * PI * scene_radius * scene_radius
    }
}
