//! The projection light: a slide projector at a point (PBRT 4th ed., 12.2.2).

use super::bounds::LightBounds;
use super::environment::rgb_at;
use super::far::{FarLight, FarSample};
use crate::world::texture::rgb_lanes;
use crate::{Arena, Handle, TextureImage};
use steradian_math::{Bounds3, Point3, Transform, Vec3, radians, tan};
use steradian_spectrum::{SpectrumUse, Wavelengths};

/// The least share of +z in directions that are lit.
const LEAST_COS: f32 = 1e-3;

/// A picture thrown along +z of light space, its top towards +y and its right towards +x.
#[derive(Clone, Debug)]
pub(super) struct Projection {
    p: Point3,
    axis: Vec3,
    light_from_world: Transform,
    image: Handle<TextureImage>,
    scale: f32,
    /// Half the extent of the picture on the plane z = 1.
    half: [f32; 2],
    flux: f32,
}

/// Half the extent on the plane z = 1 of a picture whose shorter axis spans `fov` degrees.
fn half_extent(image: &TextureImage, fov: f32) -> [f32; 2] {
    let aspect = image.texels.width() as f32 / image.texels.height() as f32;
    let short = tan(radians(fov) * 0.5);
    if aspect > 1.0 { [aspect * short, short] } else { [short, short / aspect] }
}

/// The integral of the picture's luminance over solid angle.
pub(crate) fn projected_luminance(image: &TextureImage, fov: f32) -> f32 {
    let half = half_extent(image, fov);
    let (w, h) = (image.texels.width(), image.texels.height());
    let weights = image.color_space.xyz_from_rgb().0[1];
    let mut sum = 0.0f64;
    for y in 0..h {
        for x in 0..w {
            let at = |i: usize, n: usize| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
            let direction = Vec3::new(at(x, w) * half[0], at(y, h) * half[1], 1.0);
            let cos = 1.0 / direction.length();
            let rgb = rgb_at(&image.texels, x, y);
            let luminance = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2];
            sum += f64::from(luminance) * f64::from(cos * cos * cos);
        }
    }
    (sum / (w * h).max(1) as f64) as f32 * 4.0 * half[0] * half[1]
}

impl Projection {
    /// `fov` is the angle of the shorter axis in degrees.
    pub fn new(
        world_from_light: &Transform,
        image: Handle<TextureImage>,
        fov: f32,
        scale: f32,
        images: &Arena<TextureImage>,
    ) -> Self {
        Self {
            p: world_from_light.point(Point3::default()),
            axis: world_from_light.vector(Vec3::new(0.0, 0.0, 1.0)).normalize(),
            light_from_world: world_from_light.inverse(),
            image,
            scale,
            half: half_extent(&images[image], fov),
            flux: projected_luminance(&images[image], fov),
        }
    }
}

impl FarLight for Projection {
    const IS_DELTA: bool = true;

    fn sample(&self, images: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let d = self.light_from_world.vector(from - self.p).try_normalize()?;
        if d.z < LEAST_COS {
            return None;
        }
        let (u, v) = (0.5 * (d.x / (d.z * self.half[0]) + 1.0), 0.5 * (1.0 - d.y / (d.z * self.half[1])));
        if !(0.0..=1.0).contains(&u) || !(0.0..=1.0).contains(&v) {
            return None;
        }
        let image = &images[self.image];
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        let rgb = rgb_at(&image.texels, cell(u, image.texels.width()), cell(v, image.texels.height()));
        let rgb = rgb.map(|v| v.max(0.0));
        let intensity = rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * self.scale;
        FarSample::point(self.p, from, intensity)
    }

    fn power(&self, images: &Arena<TextureImage>, _: f32) -> f32 {
        self.flux.max(0.0) * images[self.image].color_space.photometric() * self.scale
    }

    fn bounds(&self, power: f32) -> Option<LightBounds> {
        // All light leaves along the axis, give or take the angle of a corner; a non-uniform scale may widen it, so that
        // corners are looked at in world space.
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        let world_from_light = self.light_from_world.inverse();
        let cos = corners.iter().map(|[x, y]| {
            world_from_light.vector(Vec3::new(x * self.half[0], y * self.half[1], 1.0)).normalize().dot(self.axis)
        });
        let cos = cos.fold(1.0, f32::min).max(-1.0);
        Some(LightBounds::new(Bounds3::new(self.p, self.p), self.axis, 1.0, cos, power, false))
    }
}
