//! The spot light: a cone with a smooth rim (PBRT 4th ed., 12.2.1).

use super::bounds::LightBounds;
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{Bounds3, PI, Point3, Transform, Vec3, cos, safe_acos, smoothstep};
use steradian_spectrum::{Spectrum, Wavelengths};

/// A point that shines into a cone around +z of light space.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    p: Point3,
    axis: Vec3,
    light_from_world: Transform,
    intensity: Spectrum,
    scale: f32,
    cos_end: f32,
    cos_start: f32,
}

impl Spot {
    /// `cos_start` is the cosine of the angle where the falloff begins, `cos_end` of the one where nothing is left.
    pub fn new(world_from_light: &Transform, intensity: Spectrum, scale: f32, cos_end: f32, cos_start: f32) -> Self {
        Self {
            p: world_from_light.point(Point3::default()),
            axis: world_from_light.vector(Vec3::new(0.0, 0.0, 1.0)).normalize(),
            light_from_world: world_from_light.inverse(),
            intensity,
            scale,
            cos_end,
            cos_start,
        }
    }
}

impl FarLight for Spot {
    const IS_DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let cos = self.light_from_world.vector(from - self.p).normalize().z;
        let share = smoothstep(cos, self.cos_end, self.cos_start);
        FarSample::point(self.p, from, self.intensity.eval(w) * (self.scale * share))
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        let cone = 2.0 * PI * ((1.0 - self.cos_start) + (self.cos_start - self.cos_end) / 2.0);
        brightness(&self.intensity) * self.scale * cone
    }

    fn bounds(&self, _: f32) -> Option<LightBounds> {
        let spread = cos(safe_acos(self.cos_end) - safe_acos(self.cos_start));
        // As bright as the point light whose cone this is.
        let power = brightness(&self.intensity) * self.scale * 4.0 * PI;
        Some(LightBounds::new(Bounds3::new(self.p, self.p), self.axis, self.cos_start, spread, power, false))
    }
}
