//! The goniometric light: a point whose intensity over directions is a picture (PBRT 4th ed., 12.2.3).

use super::bounds::LightBounds;
use super::environment::rgb_at;
use super::far::{FarLight, FarSample, brightness};
use crate::{Arena, Handle, TextureImage};
use steradian_math::{PI, Point3, Transform};
use steradian_sampling::warp::octahedral_to_square;
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
}

/// The relative intensity in a texel: colours are averaged.
fn intensity_at(image: &TextureImage, x: usize, y: usize) -> f32 {
    let [r, g, b] = rgb_at(&image.texels, x, y);
    (r + g + b) / 3.0
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
        }
    }
}

impl FarLight for Goniometric {
    const IS_DELTA: bool = true;

    fn sample(&self, images: &Arena<TextureImage>, from: Point3, _: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let image = &images[self.image];
        let direction = self.light_from_world.vector(from - self.p).try_normalize()?;
        let [u, v] = octahedral_to_square(direction);
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        let share = intensity_at(image, cell(u, image.texels.width()), cell(v, image.texels.height()));
        FarSample::point(self.p, from, self.intensity.eval(w) * (self.scale * share.max(0.0)))
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        brightness(&self.intensity) * self.scale * self.mean * 4.0 * PI
    }

    fn bounds(&self, power: f32) -> Option<LightBounds> {
        Some(LightBounds::point(self.p, power))
    }
}
