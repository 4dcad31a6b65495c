//! The same radiance from everywhere (PBRT 4th ed., 12.5.1).

use super::emission::{Ball, FarEmission, from_infinity};
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{INV_4PI, PI, Point3, Ray, Vec3};
use steradian_sampling::warp::square_to_uniform_sphere;
use steradian_spectrum::{Lanes, Spectrum, Wavelengths};

/// A uniform sky all around.
#[derive(Clone, Debug)]
pub(super) struct Uniform {
    /// Radiance up to `scale`.
    pub radiance: Spectrum,
    /// Factor.
    pub scale: f32,
}

impl FarLight for Uniform {
    const IS_DELTA: bool = false;

    #[inline]
    fn sample(&self, _: &Arena<TextureImage>, _: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        FarSample::infinite(self.radiance.eval(w) * self.scale, square_to_uniform_sphere(u), INV_4PI)
    }

    #[inline]
    fn pdf(&self, _: Point3, _: Vec3) -> f32 {
        INV_4PI
    }

    /// A lobe's directions are better than any that a sky without features could propose.
    fn is_left_to_lobes(&self) -> bool {
        true
    }

    #[inline]
    fn radiance(&self, _: &Arena<TextureImage>, _: &Ray, w: &Wavelengths) -> Lanes {
        self.radiance.eval(w) * self.scale
    }

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        ball: &Ball,
        up: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let radiance = self.radiance.eval(w) * self.scale;
        Some(from_infinity(ball, square_to_uniform_sphere(ud), radiance, INV_4PI, up))
    }

    fn emission_pdf(&self, ball: &Ball, _: Vec3) -> [f32; 2] {
        [INV_4PI, ball.pdf()]
    }

    fn power(&self, _: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        brightness(&self.radiance) * self.scale * 4.0 * PI * PI * scene_radius * scene_radius
    }
}
