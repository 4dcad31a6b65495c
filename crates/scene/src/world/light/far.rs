//! Lights that are not surfaces: one closed set, and the contract that each of them is written against.

use super::bounds::LightBounds;
use super::cone::Cone;
use super::distant::Distant;
use super::emission::{Ball, FarEmission};
use super::environment::Environment;
use super::goniometric::Goniometric;
use super::point::PointLight;
use super::portal::Portal;
use super::projection::Projection;
use super::spot::Spot;
use super::sun::Sun;
use super::uniform::Uniform;
use crate::{Arena, Light, TextureImage};
use steradian_math::{Point3, Ray, Vec3};
use steradian_spectrum::{Lanes, Spectrum, Wavelengths};

/// A light as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct FarSample {
    /// Radiance towards the point; for delta lights the irradiance on a surface that faces the light.
    pub radiance: Lanes,
    /// Unit direction to the light, in world space.
    pub wi: Vec3,
    /// Distance to the light; infinite where it has none.
    pub distance: f32,
    /// Where the light is; meaningless if the distance is infinite.
    pub end: Point3,
    /// Density per solid angle; one for delta lights.
    pub pdf: f32,
}

impl FarSample {
    /// A sample of a light without a place.
    pub fn infinite(radiance: Lanes, wi: Vec3, pdf: f32) -> Option<Self> {
        (!radiance.is_black()).then_some(Self { radiance, wi, distance: f32::INFINITY, end: Point3::default(), pdf })
    }

    /// The sample of a light at the point `end` with the given intensity towards `from`.
    pub fn point(end: Point3, from: Point3, intensity: Lanes) -> Option<Self> {
        let d = end - from;
        let distance = d.length();
        let radiance = intensity * (1.0 / (distance * distance));
        let valid = distance > 0.0 && !radiance.is_black();
        valid.then(|| Self { radiance, wi: d * (1.0 / distance), distance, end, pdf: 1.0 })
    }
}

/// What a light that is not a surface can do. `images` is the scene's arena of pictures.
pub(super) trait FarLight {
    /// Whether no ray meets the light by chance.
    const IS_DELTA: bool;

    /// The light that arrives at `from`, visibility aside. `None` if there is none.
    fn sample(&self, images: &Arena<TextureImage>, from: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample>;

    /// The density per solid angle with which `sample` gives direction `wi`; zero for delta lights.
    fn pdf(&self, _from: Point3, _wi: Vec3) -> f32 {
        0.0
    }

    /// As [`FarLight::sample`], for a caller that finds the light by its lobes as well and weights both: a light may leave directions
    /// to the lobes where they are good enough (Karlik et al., "MIS compensation", 2019).
    #[inline]
    fn sample_beside_lobes(
        &self,
        images: &Arena<TextureImage>,
        from: Point3,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        self.sample(images, from, u, w)
    }

    /// The density of [`FarLight::sample_beside_lobes`].
    #[inline]
    fn pdf_beside_lobes(&self, from: Point3, wi: Vec3) -> f32 {
        self.pdf(from, wi)
    }

    /// Whether the light is left to the lobes altogether.
    fn is_left_to_lobes(&self) -> bool {
        false
    }

    /// The radiance that arrives against a ray which leaves the scene; black for delta lights.
    fn radiance(&self, _images: &Arena<TextureImage>, _ray: &Ray, _w: &Wavelengths) -> Lanes {
        Lanes::ZERO
    }

    /// Emitted power in common, photometric units: only to choose among lights.
    fn power(&self, images: &Arena<TextureImage>, scene_radius: f32) -> f32;

    /// Takes a ray that leaves the light; see [`super::emission`] for its densities. `ball` holds everything finite.
    fn emit(
        &self,
        images: &Arena<TextureImage>,
        ball: &Ball,
        u_place: [f32; 2],
        u_direction: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission>;

    /// The densities of `emit` for a ray in direction `d`: of the light's end, and of the ray given the end.
    fn emission_pdf(&self, ball: &Ball, d: Vec3) -> [f32; 2];

    /// Where the light is, if it has a place.
    fn position(&self) -> Option<Point3> {
        None
    }

    /// Where and to where the light shines, if it has a place; `power` is what [`FarLight::power`] returned.
    fn bounds(&self, _power: f32) -> Option<LightBounds> {
        None
    }
}

/// A light that is not a surface, ready to be sampled.
#[derive(Clone, Debug)]
pub(super) enum Far {
    Point(PointLight),
    Spot(Spot),
    Cone(Cone),
    Distant(Distant),
    Sun(Sun),
    Goniometric(Goniometric),
    Projection(Projection),
    Uniform(Uniform),
    Map(Environment),
    Portal(Portal),
}

/// The only `match` over the kinds of lights.
macro_rules! with_far {
    ($far:expr, $l:ident => $body:expr) => {
        match $far {
            Far::Point($l) => $body,
            Far::Spot($l) => $body,
            Far::Cone($l) => $body,
            Far::Distant($l) => $body,
            Far::Sun($l) => $body,
            Far::Goniometric($l) => $body,
            Far::Projection($l) => $body,
            Far::Uniform($l) => $body,
            Far::Map($l) => $body,
            Far::Portal($l) => $body,
        }
    };
}

impl Far {
    /// Builds the tables of a light.
    pub fn new(light: &Light, images: &Arena<TextureImage>) -> Self {
        match light {
            Light::Point { position, intensity, scale } => {
                Self::Point(PointLight { p: *position, intensity: intensity.clone(), scale: *scale })
            }
            Light::Spot { world_from_light, intensity, scale, cos_end, cos_start } => {
                Self::Spot(Spot::new(world_from_light, intensity.clone(), *scale, *cos_end, *cos_start))
            }
            Light::Distant { to_light, radiance, scale } => {
                Self::Distant(Distant { to_light: *to_light, radiance: radiance.clone(), scale: *scale })
            }
            Light::Sun { to_light, half_angle, profile, scale } => {
                Self::Sun(Sun::new(*to_light, *half_angle, profile.clone(), *scale))
            }
            Light::Goniometric { world_from_light, intensity, image, scale } => {
                Self::Goniometric(Goniometric::new(world_from_light, intensity.clone(), *image, *scale, images))
            }
            Light::Cone { world_from_light, intensity, scale, end, start, slide } => {
                Self::Cone(Cone::new(world_from_light, intensity.clone(), *scale, [*start, *end], *slide))
            }
            Light::Projection { world_from_light, image, screen, fov, scale } => {
                Self::Projection(Projection::new(world_from_light, *image, *screen, *fov, *scale, images))
            }
            Light::UniformInfinite { radiance, scale } => {
                Self::Uniform(Uniform { radiance: radiance.clone(), scale: *scale })
            }
            Light::ImageInfinite { world_from_light, image, mapping, scale } => {
                let texels = &images[*image].texels;
                Self::Map(Environment::new(*image, texels, *mapping, *world_from_light, *scale))
            }
            Light::PortalInfinite { world_from_light, image, scale, portal } => {
                Self::Portal(Portal::new(world_from_light, &images[*image], *scale, portal))
            }
            // In its own space; see `MovingFar`.
            Light::Moving { light, .. } => Self::new(light, images),
        }
    }

    /// Whether no ray meets the light by chance.
    #[inline]
    pub fn is_delta(&self) -> bool {
        fn of<L: FarLight>(_: &L) -> bool {
            L::IS_DELTA
        }
        with_far!(self, l => of(l))
    }

    /// See [`FarLight::sample`].
    #[inline]
    pub fn sample(
        &self,
        images: &Arena<TextureImage>,
        from: Point3,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        with_far!(self, l => l.sample(images, from, u, w))
    }

    /// See [`FarLight::pdf`].
    #[inline]
    pub fn pdf(&self, from: Point3, wi: Vec3) -> f32 {
        with_far!(self, l => l.pdf(from, wi))
    }

    /// See [`FarLight::sample_beside_lobes`].
    #[inline]
    pub fn sample_beside_lobes(
        &self,
        images: &Arena<TextureImage>,
        from: Point3,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        with_far!(self, l => l.sample_beside_lobes(images, from, u, w))
    }

    /// See [`FarLight::pdf_beside_lobes`].
    #[inline]
    pub fn pdf_beside_lobes(&self, from: Point3, wi: Vec3) -> f32 {
        with_far!(self, l => l.pdf_beside_lobes(from, wi))
    }

    /// See [`FarLight::is_left_to_lobes`].
    pub fn is_left_to_lobes(&self) -> bool {
        with_far!(self, l => l.is_left_to_lobes())
    }

    /// See [`FarLight::radiance`].
    #[inline]
    pub fn radiance(&self, images: &Arena<TextureImage>, ray: &Ray, w: &Wavelengths) -> Lanes {
        with_far!(self, l => l.radiance(images, ray, w))
    }

    /// See [`FarLight::power`].
    pub fn power(&self, images: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        with_far!(self, l => l.power(images, scene_radius))
    }

    /// See [`FarLight::emit`].
    #[inline]
    pub fn emit(
        &self,
        images: &Arena<TextureImage>,
        ball: &Ball,
        u_place: [f32; 2],
        u_direction: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        with_far!(self, l => l.emit(images, ball, u_place, u_direction, w))
    }

    /// See [`FarLight::emission_pdf`].
    #[inline]
    pub fn emission_pdf(&self, ball: &Ball, d: Vec3) -> [f32; 2] {
        with_far!(self, l => l.emission_pdf(ball, d))
    }

    /// See [`FarLight::position`].
    #[inline]
    pub fn position(&self) -> Option<Point3> {
        with_far!(self, l => l.position())
    }

    /// Whether the light shines from infinitely far.
    #[inline]
    pub fn is_infinite(&self) -> bool {
        self.position().is_none()
    }

    /// See [`FarLight::bounds`].
    pub fn bounds(&self, power: f32) -> Option<LightBounds> {
        with_far!(self, l => l.bounds(power))
    }
}

/// A measure of strength that is positive for every spectrum that is not black.
pub(super) fn brightness(s: &Spectrum) -> f32 {
    s.luminance().max(1e-3 * s.max_value())
}
