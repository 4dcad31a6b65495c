//! Environment maps: radiance from infinitely far as a picture, sampled in proportion to its brightness (PBRT 4th ed.,
//! 12.5.2).

use super::emission::{Ball, FarEmission, from_infinity};
use super::far::{FarLight, FarSample};
use crate::world::texture::rgb_lanes;
use crate::{Arena, EnvironmentMapping, Handle, TextureImage};
use steradian_image::Texels;
use steradian_image::Wrap;
use steradian_math::{INV_4PI, PI, Point3, Ray, Transform, Vec3, safe_sqrt, sin_cos};
use steradian_sampling::Piecewise2D;
use steradian_sampling::warp::{lat_long_to_square, octahedral_to_square, square_to_lat_long, square_to_octahedral};
use steradian_spectrum::{Lanes, SpectrumUse, Wavelengths};

/// An environment map with the tables to sample it.
#[derive(Clone, Debug)]
pub(super) struct Environment {
    pub(super) image: Handle<TextureImage>,
    scale: f32,
    pub(super) mapping: EnvironmentMapping,
    pub(super) world_from_light: Transform,
    distribution: Option<Piecewise2D>,
    /// The same less its mean: where lobes find the rest.
    pub(super) beside_lobes: Option<Piecewise2D>,
}

/// The colour of a texel; grey where there is one colour channel only.
pub(super) fn rgb_at(texels: &Texels, x: usize, y: usize) -> [f32; 3] {
    if texels.channels() < 3 { [texels.texel(x, y, 0); 3] } else { texels.texel3(x, y) }
}

/// A picture at `(u, v)` of the unit square, v down, between texels in proportion, outside as the picture is wrapped.
pub(super) fn interpolated(image: &TextureImage, [u, v]: [f32; 2]) -> [f32; 3] {
    let texels = &image.texels;
    let size = [texels.width() as i64, texels.height() as i64];
    let at = [u * size[0] as f32 - 0.5, v * size[1] as f32 - 0.5];
    let cell = at.map(|x| x.floor());
    let t = [at[0] - cell[0], at[1] - cell[1]];
    let place = |axis: usize, k: i64| {
        let (i, n) = (cell[axis] as i64 + k, size[axis]);
        let inside = match image.wrap[axis] {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
            _ => i.clamp(0, n - 1),
        };
        inside as usize
    };
    let mut out = [0.0; 3];
    for k in 0..4 {
        let (x, y) = (k % 2, k / 2);
        let weight = [1.0 - t[0], t[0]][x] * [1.0 - t[1], t[1]][y];
        let rgb = rgb_at(texels, place(0, x as i64), place(1, y as i64));
        (0..3).for_each(|c| out[c] += weight * rgb[c]);
    }
    out
}

impl Environment {
    /// Tabulates the brightness of a picture.
    pub fn new(
        image: Handle<TextureImage>,
        texels: &Texels,
        mapping: EnvironmentMapping,
        world_from_light: Transform,
        scale: f32,
    ) -> Self {
        let (w, h) = (texels.width(), texels.height());
        let mut values = vec![0.0f32; w * h];
        // The solid angle of a row, relative to the equator.
        let weight = |y: usize| match mapping {
            EnvironmentMapping::EqualArea => 1.0,
            EnvironmentMapping::LatLong => sin_cos(PI * (y as f32 + 0.5) / h as f32).0,
        };
        for y in 0..h {
            for x in 0..w {
                let rgb = rgb_at(texels, x, y);
                values[y * w + x] = (rgb.iter().sum::<f32>() / 3.0).max(0.0) * weight(y);
            }
        }
        // Where the picture is interpolated, a dark pixel beside a bright one still shines: give it a share.
        if mapping == EnvironmentMapping::LatLong {
            values = spread(&values, w, h);
        }
        let total = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>();
        let mean = total(&mut values.iter().copied()) / (total(&mut (0..h).map(weight)) * w as f64);
        let peaks = (0..w * h).map(|i| (values[i] - mean as f32 * weight(i / w)).max(0.0)).collect();
        let distribution = Piecewise2D::new(values, w, h);
        // A map without features has no peaks.
        let beside_lobes = Piecewise2D::new(peaks, w, h).or_else(|| distribution.clone());
        Self { image, scale, mapping, world_from_light, distribution, beside_lobes }
    }

    #[inline(always)]
    pub(super) fn local(&self, d: Vec3) -> Vec3 {
        self.world_from_light.inverse_vector(d).normalize()
    }

    fn square_of(&self, local: Vec3) -> [f32; 2] {
        match self.mapping {
            EnvironmentMapping::EqualArea => octahedral_to_square(local),
            EnvironmentMapping::LatLong => lat_long_to_square(local),
        }
    }

    /// The colour from the direction that a point of the square stands for, before `scale`.
    #[inline]
    fn rgb(&self, texels: &Texels, [u, v]: [f32; 2]) -> [f32; 3] {
        let (w, h) = (texels.width(), texels.height());
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        match self.mapping {
            EnvironmentMapping::EqualArea => rgb_at(texels, cell(u, w), cell(v, h)),
            EnvironmentMapping::LatLong => {
                let (x, y) = (u * w as f32 - 0.5, (v * h as f32 - 0.5).clamp(0.0, (h - 1) as f32));
                let (x0, y0) = (x.floor(), y.floor());
                let (fx, fy) = (x - x0, y - y0);
                let column = |x: f32| (x as i64).rem_euclid(w as i64) as usize;
                let row = |y: f32| (y as usize).min(h - 1);
                let corner = |dx: f32, dy: f32| rgb_at(texels, column(x0 + dx), row(y0 + dy));
                let (a, b, c, d) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0));
                std::array::from_fn(|i| {
                    (1.0 - fy) * ((1.0 - fx) * a[i] + fx * b[i]) + fy * ((1.0 - fx) * c[i] + fx * d[i])
                })
            }
        }
    }

    /// A direction towards the map (world space) and its density per solid angle. `None` for a black map.
    fn sample_direction(&self, distribution: Option<&Piecewise2D>, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let (uv, pdf) = distribution?.sample(u);
        let local = match self.mapping {
            EnvironmentMapping::EqualArea => square_to_octahedral(uv),
            EnvironmentMapping::LatLong => square_to_lat_long(uv),
        };
        let pdf = pdf * self.square_to_sphere_density(local);
        (pdf > 0.0 && pdf.is_finite()).then(|| (self.world_from_light.vector(local).normalize(), pdf))
    }

    /// The density per solid angle of `sample_direction`.
    fn pdf_direction(&self, distribution: Option<&Piecewise2D>, d: Vec3) -> f32 {
        let Some(distribution) = distribution else { return 0.0 };
        let local = self.local(d);
        let pdf = distribution.pdf(self.square_of(local)) * self.square_to_sphere_density(local);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The density on the sphere of the uniform density on the square.
    fn square_to_sphere_density(&self, local: Vec3) -> f32 {
        match self.mapping {
            EnvironmentMapping::EqualArea => INV_4PI,
            EnvironmentMapping::LatLong => 1.0 / (2.0 * PI * PI * safe_sqrt(1.0 - local.z * local.z)),
        }
    }

    /// The mean brightness over the sphere, before `scale`: for choosing among lights.
    fn mean_brightness(&self) -> f32 {
        let weight = if self.mapping == EnvironmentMapping::LatLong { PI / 2.0 } else { 1.0 };
        self.distribution.as_ref().map_or(0.0, |d| d.integral() * weight)
    }
}

impl Environment {
    fn lanes(&self, images: &Arena<TextureImage>, d: Vec3, w: &Wavelengths) -> Lanes {
        self.lanes_at_square(images, self.square_of(self.local(d)), w)
    }

    /// The radiance from the direction that a point of the square stands for.
    #[inline]
    pub(super) fn lanes_at_square(&self, images: &Arena<TextureImage>, square: [f32; 2], w: &Wavelengths) -> Lanes {
        let image = &images[self.image];
        let rgb = self.rgb(&image.texels, square).map(|v| v.max(0.0));
        rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * self.scale
    }
}

impl FarLight for Environment {
    const IS_DELTA: bool = false;

    #[inline]
    fn sample(&self, images: &Arena<TextureImage>, _: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let (wi, pdf) = self.sample_direction(self.distribution.as_ref(), u)?;
        FarSample::infinite(self.lanes(images, wi, w), wi, pdf)
    }

    #[inline]
    fn pdf(&self, _: Point3, wi: Vec3) -> f32 {
        self.pdf_direction(self.distribution.as_ref(), wi)
    }

    #[inline]
    fn sample_beside_lobes(
        &self,
        images: &Arena<TextureImage>,
        _: Point3,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        let (wi, pdf) = self.sample_direction(self.beside_lobes.as_ref(), u)?;
        FarSample::infinite(self.lanes(images, wi, w), wi, pdf)
    }

    #[inline]
    fn pdf_beside_lobes(&self, _: Point3, wi: Vec3) -> f32 {
        self.pdf_direction(self.beside_lobes.as_ref(), wi)
    }

    #[inline]
    fn radiance(&self, images: &Arena<TextureImage>, ray: &Ray, w: &Wavelengths) -> Lanes {
        self.lanes(images, ray.d, w)
    }

    fn emit(
        &self,
        images: &Arena<TextureImage>,
        ball: &Ball,
        up: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let (wi, pdf) = self.sample_direction(self.distribution.as_ref(), ud)?;
        Some(from_infinity(ball, wi, self.lanes(images, wi, w), pdf, up))
    }

    fn emission_pdf(&self, ball: &Ball, d: Vec3) -> [f32; 2] {
        [self.pdf_direction(self.distribution.as_ref(), -d), ball.pdf()]
    }

    fn power(&self, images: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        let unit = images[self.image].color_space.photometric() * self.scale;
        self.mean_brightness() * unit * 4.0 * PI * PI * scene_radius * scene_radius
    }
}

/// Raises each value to a share of its brightest neighbour.
fn spread(values: &[f32], w: usize, h: usize) -> Vec<f32> {
    const SHARE: f32 = 0.25;
    let mut out = values.to_vec();
    for y in 0..h {
        for x in 0..w {
            let mut most = 0.0f32;
            for dy in -1i64..=1 {
                let yy = (y as i64 + dy).clamp(0, h as i64 - 1) as usize;
                for dx in -1i64..=1 {
                    let xx = (x as i64 + dx).rem_euclid(w as i64) as usize;
                    most = most.max(values[yy * w + xx]);
                }
            }
            out[y * w + x] = values[y * w + x].max(SHARE * most);
        }
    }
    out
}
