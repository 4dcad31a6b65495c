//! A round disc of light infinitely far away: the sun, with soft shadows.

use super::emission::{Ball, FarEmission, from_infinity};
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, TextureImage};
use steradian_math::{Frame, INV_2PI, PI, Point3, Ray, Vec3, safe_sqrt, sin_cos};
use steradian_sampling::warp::square_to_uniform_cone;
use steradian_spectrum::{Lanes, Spectrum, Wavelengths};

/// A disc of light infinitely far away, sampled evenly over its solid angle.
#[derive(Clone, Debug)]
pub(super) struct Sun {
    frame: Frame,
    /// One less the cosine of the angle from the middle to the edge: the cosine itself cannot tell small discs apart.
    one_minus_cos: f32,
    sine: f32,
    /// Coefficients of powers of the height over the disc, which is that of a ball with the same outline.
    profile: Vec<Spectrum>,
    scale: f32,
}

impl Sun {
    /// A disc around the unit vector `to_light`.
    pub fn new(to_light: Vec3, half_angle: f32, profile: Vec<Spectrum>, scale: f32) -> Self {
        let half = sin_cos(0.5 * half_angle).0;
        let sine = sin_cos(half_angle).0;
        Self { frame: Frame::from_z(to_light), one_minus_cos: 2.0 * half * half, sine, profile, scale }
    }

    fn solid_angle(&self) -> f32 {
        2.0 * PI * self.one_minus_cos
    }

    /// The radiance seen in a direction that is `sin_theta` away from the middle.
    fn lanes(&self, sin_theta: f32, w: &Wavelengths) -> Lanes {
        let r = sin_theta / self.sine;
        let height = safe_sqrt(1.0 - r * r);
        let value = self.profile.iter().rev().fold(Lanes::ZERO, |sum, s| sum * height + s.eval(w));
        // Darkening is a polynomial that was fitted, and colours may lie outside of what a screen has.
        Lanes(value.0.map(|v| v.max(0.0))) * self.scale
    }

    fn sample_direction(&self, u: [f32; 2]) -> (Vec3, f32) {
        let local = square_to_uniform_cone(u, self.one_minus_cos);
        let sin_theta = safe_sqrt(local.x * local.x + local.y * local.y);
        (self.frame.from_local(local).normalize(), sin_theta)
    }

    /// The sine of the angle from the middle, if the direction meets the disc.
    fn meets(&self, d: Vec3) -> Option<f32> {
        // The length of the difference is exact where a dot product is not.
        let chord = (d.normalize() - self.frame.z).length_squared();
        let one_minus_cos = 0.5 * chord;
        (one_minus_cos <= self.one_minus_cos).then(|| safe_sqrt(chord * (1.0 - 0.25 * chord)))
    }

    fn density(&self) -> f32 {
        INV_2PI / self.one_minus_cos
    }
}

impl FarLight for Sun {
    const IS_DELTA: bool = false;

    #[inline]
    fn sample(&self, _: &Arena<TextureImage>, _: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let (wi, sin_theta) = self.sample_direction(u);
        FarSample::infinite(self.lanes(sin_theta, w), wi, self.density())
    }

    #[inline]
    fn pdf(&self, _: Point3, wi: Vec3) -> f32 {
        if self.meets(wi).is_some() { self.density() } else { 0.0 }
    }

    #[inline]
    fn radiance(&self, _: &Arena<TextureImage>, ray: &Ray, w: &Wavelengths) -> Lanes {
        self.meets(ray.d).map_or(Lanes::ZERO, |sin_theta| self.lanes(sin_theta, w))
    }

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        ball: &Ball,
        up: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let (wi, sin_theta) = self.sample_direction(ud);
        Some(from_infinity(ball, wi, self.lanes(sin_theta, w), self.density(), up))
    }

    fn emission_pdf(&self, ball: &Ball, d: Vec3) -> [f32; 2] {
        [self.pdf(Point3::default(), -d), ball.pdf()]
    }

    fn power(&self, _: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        // The mean of a power of the height over a disc is 2 / (power + 2).
        let mean: f32 = (2u8..).zip(&self.profile).map(|(k, s)| s.luminance() * 2.0 / f32::from(k)).sum();
        let least = self.profile.first().map_or(0.0, |s| 1e-3 * brightness(s));
        mean.max(least).max(0.0) * self.scale * self.solid_angle() * PI * scene_radius * scene_radius
    }
}
