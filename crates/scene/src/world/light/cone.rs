//! A cone of light that falls off in proportion to the angle, as Mitsuba's `spot` does, with a slide in it perhaps.

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_point, stretch};
use super::environment::interpolated;
use super::far::{FarLight, FarSample, brightness};
use crate::world::texture::rgb_lanes;
use crate::{Arena, Handle, TextureImage};
use steradian_math::{Bounds3, PI, Point3, TAU, Transform, Vec3, cos, lerp, safe_acos, safe_sqrt, tan};
use steradian_spectrum::{Lanes, Spectrum, SpectrumUse, Wavelengths};

/// A point that shines into a cone around +z of light space.
#[derive(Clone, Debug)]
pub(super) struct Cone {
    p: Point3,
    axis: Vec3,
    light_from_world: Transform,
    intensity: Spectrum,
    scale: f32,
    start: f32,
    end: f32,
    cos_end: f32,
    slide: Option<Handle<TextureImage>>,
}

impl Cone {
    /// `start` is the angle where the falloff begins, `end` the one where nothing is left.
    pub fn new(
        world_from_light: &Transform,
        intensity: Spectrum,
        scale: f32,
        [start, end]: [f32; 2],
        slide: Option<Handle<TextureImage>>,
    ) -> Self {
        Self {
            p: world_from_light.point(Point3::default()),
            axis: world_from_light.vector(Vec3::new(0.0, 0.0, 1.0)).normalize(),
            light_from_world: world_from_light.inverse(),
            intensity,
            scale,
            start,
            end,
            cos_end: cos(end),
            slide,
        }
    }

    /// What is left at an angle from the axis.
    fn falloff(&self, cos: f32) -> f32 {
        let angle = safe_acos(cos);
        if angle <= self.start {
            1.0
        } else if angle < self.end {
            (self.end - angle) / (self.end - self.start)
        } else {
            0.0
        }
    }

    /// Intensity in local unit direction `d`.
    fn toward(&self, images: &Arena<TextureImage>, d: Vec3, w: &Wavelengths) -> Lanes {
        let falloff = self.falloff(d.z);
        if falloff == 0.0 {
            return Lanes::ZERO;
        }
        let light = self.intensity.eval(w) * (self.scale * falloff);
        let Some(slide) = self.slide else { return light };
        let width = 2.0 * d.z * tan(self.end);
        let image = &images[slide];
        let rgb = interpolated(image, [0.5 + d.x / width, 0.5 + d.y / width]).map(|v| v.max(0.0));
        light * rgb_lanes(rgb, image.color_space, SpectrumUse::Albedo, w)
    }

    /// Emission in direction `d`: even over the cone.
    fn densities(&self, d: Vec3) -> [f32; 2] {
        let inside = self.light_from_world.vector(d).normalize().z > self.cos_end;
        let even = if inside { 1.0 / (TAU * (1.0 - self.cos_end)) } else { 0.0 };
        [1.0, even * stretch(&self.light_from_world, d)]
    }
}

impl FarLight for Cone {
    const IS_DELTA: bool = true;

    fn sample(&self, images: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let d = self.light_from_world.vector(from - self.p).try_normalize()?;
        FarSample::point(self.p, from, self.toward(images, d, w))
    }

    fn emit(
        &self,
        images: &Arena<TextureImage>,
        _: &Ball,
        _: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let cos = lerp(ud[0], 1.0, self.cos_end);
        let local = Vec3::spherical(safe_sqrt(1.0 - cos * cos), cos, TAU * ud[1]);
        let d = self.light_from_world.inverse().vector(local).normalize();
        let [_, pdf] = self.densities(d);
        (pdf > 0.0).then(|| from_point(self.p, d, self.toward(images, local, w), pdf))
    }

    fn emission_pdf(&self, _: &Ball, d: Vec3) -> [f32; 2] {
        self.densities(d)
    }

    fn position(&self) -> Option<Point3> {
        Some(self.p)
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        brightness(&self.intensity) * self.scale * PI * ((1.0 - cos(self.start)) + (1.0 - self.cos_end))
    }

    fn bounds(&self, _: f32) -> Option<LightBounds> {
        let power = brightness(&self.intensity) * self.scale * 4.0 * PI;
        if !self.light_from_world.keeps_angles() {
            return Some(LightBounds::point(self.p, power));
        }
        let (core, rim) = (cos(self.start), cos(self.end - self.start));
        Some(LightBounds::new(Bounds3::new(self.p, self.p), self.axis, core, rim, power, false))
    }
}
