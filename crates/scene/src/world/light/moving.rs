//! Lights that are not surfaces, some in a space of their own, which moves while the shutter is open.
//!
//! A light that moves is asked in the space that it stands still in, with the point carried there, and its answer is carried back. Densities
//! of directions change by the stretch of the transform, irradiance with the squared distance.

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_infinity, from_point, stretch};
use super::far::{Far, FarSample};
use crate::{Arena, Light, TextureImage};
use steradian_math::{AnimatedTransform, Bounds3, Point3, Ray, Transform, Vec3};
use steradian_spectrum::{Lanes, Wavelengths};

/// A light, and where the space is that it is stated in, if that is not the world.
#[derive(Clone, Debug)]
pub(super) struct MovingFar {
    light: Far,
    world_from_light: Option<Box<AnimatedTransform>>,
}

/// Point lights are asked for their light from `from` as it is in their own space.
fn carried(s: FarSample, from: Point3, local: Point3, t: &Transform) -> Option<FarSample> {
    if s.distance == f32::INFINITY {
        let wi = t.vector(s.wi).try_normalize()?;
        return Some(FarSample { wi, pdf: s.pdf * stretch(&t.inverse(), wi), ..s });
    }
    let end = t.point(s.end);
    let d = end - from;
    let distance2 = d.length_squared();
    // The intensity stays; the distance that it falls off with is that of the world.
    let radiance = s.radiance * (s.end.distance_squared(local) / distance2);
    let distance = distance2.sqrt();
    (distance > 0.0).then(|| FarSample { radiance, wi: d * (1.0 / distance), distance, end, pdf: s.pdf })
}

impl MovingFar {
    /// Builds the tables of a light.
    pub fn new(light: &Light, images: &Arena<TextureImage>) -> Self {
        match light {
            Light::Moving { light, world_from_light } => {
                Self { light: Far::new(light, images), world_from_light: Some(Box::new(*world_from_light)) }
            }
            _ => Self { light: Far::new(light, images), world_from_light: None },
        }
    }

    /// Whether it moves.
    pub fn is_animated(&self) -> bool {
        self.world_from_light.as_ref().is_some_and(|t| t.is_animated())
    }

    /// The light if it is stated in the world.
    #[inline]
    pub fn still(&self) -> Option<&Far> {
        self.world_from_light.is_none().then_some(&self.light)
    }

    /// Whether no ray meets the light by chance.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.light.is_delta()
    }

    /// See [`Far::is_left_to_lobes`].
    pub fn is_left_to_lobes(&self) -> bool {
        self.light.is_left_to_lobes()
    }

    /// Whether the light shines from infinitely far.
    #[inline]
    pub fn is_infinite(&self) -> bool {
        self.light.is_infinite()
    }

    /// See [`super::far::FarLight::sample`], or `sample_beside_lobes`.
    #[inline]
    pub fn sample(
        &self,
        images: &Arena<TextureImage>,
        (from, time): (Point3, f32),
        beside_lobes: bool,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        let ask = |from: Point3| {
            if beside_lobes {
                self.light.sample_beside_lobes(images, from, u, w)
            } else {
                self.light.sample(images, from, u, w)
            }
        };
        let Some(motion) = &self.world_from_light else { return ask(from) };
        let t = motion.at(time);
        let local = t.inverse().point(from);
        carried(ask(local)?, from, local, &t)
    }

    /// See [`super::far::FarLight::pdf`], or `pdf_beside_lobes`.
    #[inline]
    pub fn pdf(&self, (from, time): (Point3, f32), beside_lobes: bool, wi: Vec3) -> f32 {
        let ask = |from: Point3, wi: Vec3| {
            if beside_lobes { self.light.pdf_beside_lobes(from, wi) } else { self.light.pdf(from, wi) }
        };
        let Some(motion) = &self.world_from_light else { return ask(from, wi) };
        let inverse = motion.at(time).inverse();
        let Some(local) = inverse.vector(wi).try_normalize() else { return 0.0 };
        ask(inverse.point(from), local) * stretch(&inverse, wi)
    }

    /// See [`super::far::FarLight::radiance`].
    #[inline]
    pub fn radiance(&self, images: &Arena<TextureImage>, ray: &Ray, w: &Wavelengths) -> Lanes {
        let Some(motion) = &self.world_from_light else { return self.light.radiance(images, ray, w) };
        let local = motion.at(ray.time).inverse().ray(ray);
        let Some(d) = local.d.try_normalize() else { return Lanes::ZERO };
        self.light.radiance(images, &Ray { d, ..local }, w)
    }

    /// See [`super::far::FarLight::power`].
    pub fn power(&self, images: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        self.light.power(images, scene_radius)
    }

    /// See [`super::far::FarLight::emit`].
    pub fn emit(
        &self,
        images: &Arena<TextureImage>,
        (ball, time): (&Ball, f32),
        u_place: [f32; 2],
        u_direction: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let e = self.light.emit(images, ball, u_place, u_direction, w)?;
        let Some(motion) = &self.world_from_light else { return Some(e) };
        let t = motion.at(time);
        let d = t.vector(e.d).try_normalize()?;
        let stretched = stretch(&t.inverse(), d);
        Some(if self.is_infinite() {
            from_infinity(ball, -d, e.value, self.end_pdf(e.pdf_end, stretched), u_place)
        } else {
            from_point(t.point(e.o), d, e.value, e.pdf_ray * stretched)
        })
    }

    /// The density of a direction towards an infinite light; that of a single one is a probability.
    fn end_pdf(&self, pdf: f32, stretched: f32) -> f32 {
        if self.is_delta() { pdf } else { pdf * stretched }
    }

    /// See [`super::far::FarLight::emission_pdf`].
    pub fn emission_pdf(&self, ball: &Ball, d: Vec3, time: f32) -> [f32; 2] {
        let Some(motion) = &self.world_from_light else { return self.light.emission_pdf(ball, d) };
        let inverse = motion.at(time).inverse();
        let Some(local) = inverse.vector(d).try_normalize() else { return [0.0; 2] };
        let ([end, ray], stretched) = (self.light.emission_pdf(ball, local), stretch(&inverse, d));
        if self.is_infinite() { [self.end_pdf(end, stretched), ray] } else { [end, ray * stretched] }
    }

    /// Where the light is at a time, if it has a place.
    pub fn position(&self, time: f32) -> Option<Point3> {
        let p = self.light.position()?;
        Some(self.world_from_light.as_ref().map_or(p, |motion| motion.at(time).point(p)))
    }

    /// Where and to where the light shines, if it has a place: all the way that it goes, and then to every side.
    pub fn bounds(&self, power: f32) -> Option<LightBounds> {
        let bounds = self.light.bounds(power)?;
        let Some(motion) = &self.world_from_light else { return Some(bounds) };
        let p = self.light.position()?;
        let way = motion.motion_bounds(&Bounds3::new(p, p));
        Some(LightBounds::new(way, Vec3::new(0.0, 0.0, 1.0), -1.0, 0.0, bounds.power, false))
    }
}
