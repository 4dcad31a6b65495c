//! The spot light: a cone with a smooth rim (PBRT 4th ed., 12.2.1).

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_point, stretch};
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{
    Bounds3, ONE_MINUS_EPSILON, PI, Point3, TAU, Transform, Vec3, cos, lerp, safe_acos, safe_sqrt, smoothstep,
};
use steradian_sampling::warp::unit_to_smooth_step;
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

impl Spot {
    /// The solid angle inside the falloff, and the part of the falloff's that is lit.
    fn parts(&self) -> (f32, f32) {
        (TAU * (1.0 - self.cos_start), PI * (self.cos_start - self.cos_end))
    }

    /// Emission in direction `d`: in proportion to intensity.
    fn densities(&self, d: Vec3) -> [f32; 2] {
        let (core, rim) = self.parts();
        let cos = self.light_from_world.vector(d).normalize().z;
        let share = smoothstep(cos, self.cos_end, self.cos_start);
        [1.0, share / (core + rim) * stretch(&self.light_from_world, d)]
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

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        _: &Ball,
        _: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let [u_part, uy] = ud;
        let (core, rim) = self.parts();
        let p = core / (core + rim);
        let cos = if u_part < p {
            lerp(u_part / p, 1.0, self.cos_start)
        } else {
            unit_to_smooth_step(((u_part - p) / (1.0 - p)).min(ONE_MINUS_EPSILON), self.cos_end, self.cos_start)
        };
        let local = Vec3::spherical(safe_sqrt(1.0 - cos * cos), cos, TAU * uy);
        let d = self.light_from_world.inverse().vector(local).normalize();
        let share = smoothstep(cos, self.cos_end, self.cos_start);
        let [_, pdf] = self.densities(d);
        Some(from_point(self.p, d, self.intensity.eval(w) * (self.scale * share), pdf))
    }

    fn emission_pdf(&self, _: &Ball, d: Vec3) -> [f32; 2] {
        self.densities(d)
    }

    fn position(&self) -> Option<Point3> {
        Some(self.p)
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        let cone = 2.0 * PI * ((1.0 - self.cos_start) + (self.cos_start - self.cos_end) / 2.0);
        brightness(&self.intensity) * self.scale * cone
    }

    fn bounds(&self, _: f32) -> Option<LightBounds> {
        // As bright as the point light whose cone this is.
        let power = brightness(&self.intensity) * self.scale * 4.0 * PI;
        if !self.light_from_world.keeps_angles() {
            return Some(LightBounds::point(self.p, power));
        }
        let spread = cos(safe_acos(self.cos_end) - safe_acos(self.cos_start));
        Some(LightBounds::new(Bounds3::new(self.p, self.p), self.axis, self.cos_start, spread, power, false))
    }
}
