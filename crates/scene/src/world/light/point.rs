//! The isotropic point light (PBRT 4th ed., 12.2).

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_point};
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{INV_4PI, PI, Point3, Vec3};
use steradian_sampling::warp::square_to_uniform_sphere;
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

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        _: &Ball,
        _: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        Some(from_point(self.p, square_to_uniform_sphere(ud), self.intensity.eval(w) * self.scale, INV_4PI))
    }

    fn emission_pdf(&self, _: &Ball, _: Vec3) -> [f32; 2] {
        [1.0, INV_4PI]
    }

    fn position(&self) -> Option<Point3> {
        Some(self.p)
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        brightness(&self.intensity) * self.scale * 4.0 * PI
    }

    fn bounds(&self, power: f32) -> Option<LightBounds> {
        Some(LightBounds::point(self.p, power))
    }
}
