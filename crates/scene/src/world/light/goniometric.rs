//! The goniometric light: a point whose intensity over directions is a picture (PBRT 4th ed., 12.2.3).

use super::bounds::LightBounds;
use super::emission::{Ball, FarEmission, from_point, stretch};
use super::environment::rgb_at;
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, Handle, TextureImage};
use steradian_math::{INV_4PI, PI, Point3, Transform, Vec3};
use steradian_sampling::Piecewise2D;
use steradian_sampling::warp::{octahedral_to_square, square_to_octahedral};
use steradian_spectrum::{Spectrum, Wavelengths};

/// A point with a directional distribution in equal-area octahedral layout, around z of light space.
#[derive(Clone, Debug)]
pub(super) struct Goniometric {
    p: Point3,
    light_from_world: Transform,
    intensity: Spectrum,
    image: Handle<TextureImage>,
    scale: f32,
    mean: f32,
    /// Of directions, on the square.
    distribution: Option<Piecewise2D>,
}

/// The relative intensity in a texel: colours are averaged.
fn intensity_at(image: &TextureImage, x: usize, y: usize) -> f32 {
    let [r, g, b] = rgb_at(&image.texels, x, y);
    (r + g + b) / 3.0
}

/// And at a place of the square; never negative.
fn intensity_at_uv(image: &TextureImage, [u, v]: [f32; 2]) -> f32 {
    let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
    intensity_at(image, cell(u, image.texels.width()), cell(v, image.texels.height())).max(0.0)
}

fn distribution(image: &TextureImage) -> Option<Piecewise2D> {
    let (w, h) = (image.texels.width(), image.texels.height());
    let values: Vec<f32> = (0..w * h).map(|i| intensity_at(image, i % w, i / w).max(0.0)).collect();
    // A picture without light has none to emit.
    values.iter().any(|&v| v > 0.0).then(|| Piecewise2D::new(values, w, h))?
}

/// The mean relative intensity over the sphere.
pub(crate) fn mean_intensity(image: &TextureImage) -> f32 {
    let (w, h) = (image.texels.width(), image.texels.height());
    let sum: f64 = (0..w * h).map(|i| f64::from(intensity_at(image, i % w, i / w))).sum();
    (sum / (w * h).max(1) as f64) as f32
}

impl Goniometric {
    /// `image` scales `intensity` over directions.
    pub fn new(
        world_from_light: &Transform,
        intensity: Spectrum,
        image: Handle<TextureImage>,
        scale: f32,
        images: &Arena<TextureImage>,
    ) -> Self {
        Self {
            p: world_from_light.point(Point3::default()),
            light_from_world: world_from_light.inverse(),
            intensity,
            image,
            scale,
            mean: mean_intensity(&images[image]),
            distribution: distribution(&images[image]),
        }
    }
}

impl FarLight for Goniometric {
    const IS_DELTA: bool = true;

    fn sample(&self, images: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let image = &images[self.image];
        let direction = self.light_from_world.vector(from - self.p).try_normalize()?;
        let share = intensity_at_uv(image, octahedral_to_square(direction));
        FarSample::point(self.p, from, self.intensity.eval(w) * (self.scale * share))
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
        let image = &images[self.image];
        let d = self.light_from_world.inverse().vector(square_to_octahedral(uv)).normalize();
        let share = intensity_at_uv(image, uv);
        let pdf = pdf * INV_4PI * stretch(&self.light_from_world, d);
        Some(from_point(self.p, d, self.intensity.eval(w) * (self.scale * share), pdf))
    }

    fn emission_pdf(&self, _: &Ball, d: Vec3) -> [f32; 2] {
        let Some(distribution) = &self.distribution else { return [0.0; 2] };
        let local = self.light_from_world.vector(d).normalize();
        let pdf = distribution.pdf(octahedral_to_square(local)) * INV_4PI * stretch(&self.light_from_world, d);
        [1.0, pdf]
    }

    fn position(&self) -> Option<Point3> {
        Some(self.p)
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        brightness(&self.intensity) * self.scale * self.mean * 4.0 * PI
    }

    fn bounds(&self, power: f32) -> Option<LightBounds> {
        Some(LightBounds::point(self.p, power))
    }
}
