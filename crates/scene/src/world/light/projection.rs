//! The projection light: a slide projector at a point (PBRT 4th ed., 12.2.2).

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_point, stretch};
use super::environment::{interpolated, rgb_at};
use super::far::{FarLight, FarSample};
use crate::world::texture::{rgb_lanes, slide_lanes};
use crate::{Arena, Handle, TextureImage};
use steradian_math::{Bounds3, Point3, Transform, Vec3, radians, tan};
use steradian_sampling::Piecewise2D;
use steradian_spectrum::{Lanes, SpectrumUse, Wavelengths};

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
    screen: Option<SpectrumUse>,
    /// Half the extent of the picture on the plane z = 1.
    half: [f32; 2],
    flux: f32,
    /// Of places of the picture, by brightness over solid angle.
    distribution: Option<Piecewise2D>,
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

/// How much more than its intensity a picture on a screen sends, at most: `1 / cos^3` in its corners.
fn screen_gain(half: [f32; 2]) -> f32 {
    let length = Vec3::new(half[0], half[1], 1.0).length();
    length * length * length
}

fn distribution(image: &TextureImage, half: [f32; 2], on_screen: bool) -> Option<Piecewise2D> {
    let (w, h) = (image.texels.width(), image.texels.height());
    let values: Vec<f32> = (0..w * h)
        .map(|i| {
            let at = |i: usize, n: usize| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
            let cos = 1.0 / Vec3::new(at(i % w, w) * half[0], at(i / w, h) * half[1], 1.0).length();
            let brightness = rgb_at(&image.texels, i % w, i / w).iter().map(|v| v.max(0.0)).sum::<f32>();
            if on_screen { brightness } else { brightness * cos * cos * cos }
        })
        .collect();
    values.iter().any(|&v| v > 0.0).then(|| Piecewise2D::new(values, w, h))?
}

impl Projection {
    /// `fov` is the angle of the shorter axis in degrees.
    pub fn new(
        world_from_light: &Transform,
        image: Handle<TextureImage>,
        screen: Option<SpectrumUse>,
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
            screen,
            half: half_extent(&images[image], fov),
            flux: projected_luminance(&images[image], fov)
                * if screen.is_some() { screen_gain(half_extent(&images[image], fov)) } else { 1.0 },
            distribution: distribution(&images[image], half_extent(&images[image], fov), screen.is_some()),
        }
    }

    /// The place of unit local direction `d` in the picture.
    fn uv_of(&self, d: Vec3) -> Option<[f32; 2]> {
        if d.z < LEAST_COS {
            return None;
        }
        let (u, v) = (0.5 * (d.x / (d.z * self.half[0]) + 1.0), 0.5 * (1.0 - d.y / (d.z * self.half[1])));
        ((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)).then_some([u, v])
    }

    fn lanes(&self, images: &Arena<TextureImage>, [u, v]: [f32; 2], w: &Wavelengths) -> Lanes {
        let image = &images[self.image];
        if let Some(usage) = self.screen {
            let rgb = interpolated(image, [u, v]).map(|v| v.max(0.0));
            let length = Vec3::new((2.0 * u - 1.0) * self.half[0], (2.0 * v - 1.0) * self.half[1], 1.0).length();
            let intensity = self.scale * length * length * length;
            let lanes = match usage {
                SpectrumUse::Illuminant => rgb_lanes(rgb, image.color_space, usage, w),
                _ => slide_lanes(rgb, image.color_space, w),
            };
            return lanes * intensity;
        }
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        let rgb = rgb_at(&image.texels, cell(u, image.texels.width()), cell(v, image.texels.height()));
        let rgb = rgb.map(|v| v.max(0.0));
        rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * self.scale
    }

    /// The density per solid angle, at unit local direction `d`, of the uniform density on the picture's square.
    fn square_density(&self, d: Vec3) -> f32 {
        1.0 / (4.0 * self.half[0] * self.half[1] * d.z * d.z * d.z)
    }
}

impl FarLight for Projection {
    const IS_DELTA: bool = true;

    fn sample(&self, images: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let d = self.light_from_world.vector(from - self.p).try_normalize()?;
        FarSample::point(self.p, from, self.lanes(images, self.uv_of(d)?, w))
    }

    fn emit(
        &self,
        images: &Arena<TextureImage>,
        _: &Ball,
        _: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let (uv, pdf) = self.distribution.as_ref()?.sample(ud);
        let local = Vec3::new((2.0 * uv[0] - 1.0) * self.half[0], (1.0 - 2.0 * uv[1]) * self.half[1], 1.0).normalize();
        let d = self.light_from_world.inverse().vector(local).normalize();
        let pdf = pdf * self.square_density(local) * stretch(&self.light_from_world, d);
        Some(from_point(self.p, d, self.lanes(images, uv, w), pdf))
    }

    fn emission_pdf(&self, _: &Ball, d: Vec3) -> [f32; 2] {
        let local = self.light_from_world.vector(d).normalize();
        let (Some(distribution), Some(uv)) = (&self.distribution, self.uv_of(local)) else { return [1.0, 0.0] };
        let pdf = distribution.pdf(uv) * self.square_density(local) * stretch(&self.light_from_world, d);
        [1.0, pdf]
    }

    fn position(&self) -> Option<Point3> {
        Some(self.p)
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
