//! Lights as the user stated them, with scales already photometrically normalised by the loader.

use crate::{Handle, SpectrumInput, TextureImage};
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3};
use steradian_spectrum::{Spectrum, SpectrumUse};

/// Lights that a compositor turns up and down together; every light statement makes one, those with one name make one together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// The name that the user gave; empty for none.
    pub name: String,
}

/// Emission of the surface that carries it.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Emitted radiance over wavelength, up to `scale`.
    pub radiance: Spectrum,
    /// Factor.
    pub scale: f32,
    /// Whether the back emits as well.
    pub two_sided: bool,
    /// Total emitted power instead of `scale`'s radiance, given the area of each shape, in units where `radiance` has
    /// luminance one.
    pub power: Option<f32>,
    /// RGB emission over the surface's uv instead of `radiance`.
    pub image: Option<Handle<TextureImage>>,
    /// Emission as a texture instead of `radiance`, on triangles only: of illuminants, or of unbounded quantities, which are slides before an
    /// even lamp.
    pub texture: Option<SpectrumInput>,
    /// What it is turned up and down with.
    pub group: Option<Handle<LightGroup>>,
}

/// How an environment map covers the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvironmentMapping {
    /// Clarberg's equal-area octahedral square, z up: pbrt's.
    EqualArea,
    /// Latitude and longitude, z up: width is azimuth, the top row is +z.
    LatLong,
    /// The same, but the middles of the first row and of the last are the poles themselves: Mitsuba's.
    LatLongToPoles,
}

/// A light that is not a surface.
#[derive(Clone, Debug)]
pub enum Light {
    /// Isotropic point.
    Point {
        /// World position.
        position: Point3,
        /// Radiant intensity over wavelength, up to `scale`.
        intensity: Spectrum,
        /// Factor.
        scale: f32,
    },
    /// A cone along +z of light space, smooth between two angles.
    Spot {
        /// Light to world space.
        world_from_light: Transform,
        /// Radiant intensity on the axis, up to `scale`.
        intensity: Spectrum,
        /// Factor.
        scale: f32,
        /// Cosine of the angle where the light ends.
        cos_end: f32,
        /// Cosine of the angle where the falloff begins.
        cos_start: f32,
    },
    /// Parallel light from infinitely far.
    Distant {
        /// Unit vector towards the light, in world space.
        to_light: Vec3,
        /// Irradiance on a surface facing the light, up to `scale`.
        radiance: Spectrum,
        /// Factor.
        scale: f32,
    },
    /// A round disc infinitely far away, such as the sun.
    Sun {
        /// Unit vector towards its middle, in world space.
        to_light: Vec3,
        /// The angle from its middle to its edge, in radians, above 0 and at most a right angle.
        half_angle: f32,
        /// Radiance up to `scale`, as a polynomial in the height over the disc of the ball that it is the outline of, 1 in the
        /// middle and 0 at the edge: the coefficients of its powers 0, 1 and so on. An even disc has one.
        profile: Vec<Spectrum>,
        /// Factor.
        scale: f32,
    },
    /// A point whose intensity over directions is a picture.
    Goniometric {
        /// Light to world space; z is the pole of the picture.
        world_from_light: Transform,
        /// Radiant intensity where the picture is one, up to `scale`.
        intensity: Spectrum,
        /// A square picture in equal-area octahedral layout; colours are averaged.
        image: Handle<TextureImage>,
        /// Factor.
        scale: f32,
    },
    /// A cone along +z of light space whose intensity falls in proportion to the angle, perhaps through a slide.
    Cone {
        /// Light to world space.
        world_from_light: Transform,
        /// Radiant intensity on the axis, up to `scale`.
        intensity: Spectrum,
        /// Factor.
        scale: f32,
        /// The angle from the axis where the light ends, in radians.
        end: f32,
        /// The angle from the axis where the falloff begins, in radians.
        start: f32,
        /// What the light passes: its columns run along x, its rows along y, and it spans the cone's width on a plane across the axis.
        slide: Option<Handle<TextureImage>>,
    },
    /// A picture thrown along +z of light space, its top towards +y, its right towards +x.
    Projection {
        /// Light to world space.
        world_from_light: Transform,
        /// The picture: radiant intensity up to `scale`.
        image: Handle<TextureImage>,
        /// What the colours stand for where the picture is irradiance instead, of a plane across the axis one unit away, and interpolated
        /// between texels: lights, or what a slide passes of a light of equal energy.
        screen: Option<SpectrumUse>,
        /// Full angle along the shorter axis, in degrees.
        fov: f32,
        /// Factor.
        scale: f32,
    },
    /// The same radiance from everywhere.
    UniformInfinite {
        /// Radiance up to `scale`.
        radiance: Spectrum,
        /// Factor.
        scale: f32,
    },
    /// An environment map.
    ImageInfinite {
        /// Light to world space.
        world_from_light: Transform,
        /// The map.
        image: Handle<TextureImage>,
        /// Its layout.
        mapping: EnvironmentMapping,
        /// Factor.
        scale: f32,
    },
    /// An environment map that is seen through a rectangular opening only.
    PortalInfinite {
        /// Light to world space.
        world_from_light: Transform,
        /// The map, square, in equal-area layout.
        image: Handle<TextureImage>,
        /// Factor.
        scale: f32,
        /// The rectangle in world space, in order around it; light comes from the side of `(p3 - p0) x (p1 - p0)`.
        portal: [Point3; 4],
    },
    /// Any of the others but a portal, stated in a space that moves while the shutter is open.
    Moving {
        /// The light; its world is that space.
        light: Box<Light>,
        /// Where the space is.
        world_from_light: AnimatedTransform,
    },
}

impl TextureImage {
    /// The mean of a picture over all directions, colours averaged: what the total intensity of a goniometric light is
    /// relative to.
    pub fn mean_intensity(&self) -> f32 {
        crate::world::mean_intensity(self)
    }

    /// The integral of luminance over the solid angle that a projection light with this picture fills.
    pub fn projected_luminance(&self, fov: f32) -> f32 {
        crate::world::projected_luminance(self, fov)
    }
}

impl Light {
    /// Whether a ray can run into the light by chance.
    pub fn has_extent(&self) -> bool {
        match self {
            Self::Sun { .. }
            | Self::UniformInfinite { .. }
            | Self::ImageInfinite { .. }
            | Self::PortalInfinite { .. } => true,
            Self::Moving { light, .. } => light.has_extent(),
            _ => false,
        }
    }
}
