//! Environment maps: radiance from infinitely far as a picture, sampled in proportion to its brightness (PBRT 4th ed.,
//! 12.5.2).

use super::emission::{Ball, FarEmission, from_infinity};
use super::far::{FarLight, FarSample};
use super::lat_long::LatLongDensity;
use crate::world::texture::rgb_lanes;
use crate::{Arena, EnvironmentMapping, Handle, TextureImage};
use steradian_image::Texels;
use steradian_math::{INV_4PI, PI, Point3, Ray, Transform, Vec3};
use steradian_sampling::Piecewise2D;
use steradian_sampling::warp::{
    lat_long_to_square, octahedral_to_square, square_to_lat_long, square_to_lat_long_pdf, square_to_octahedral,
};
use steradian_spectrum::{Lanes, SpectrumUse, Wavelengths};

/// An environment map with the tables to sample it.
#[derive(Clone, Debug)]
pub(super) struct Environment {
    pub(super) image: Handle<TextureImage>,
    scale: f32,
    pub(super) mapping: EnvironmentMapping,
    pub(super) world_from_light: Transform,
    /// `None` for a black map.
    density: Option<Density>,
}

/// How directions are chosen: as the picture is looked up.
#[derive(Clone, Debug)]
enum Density {
    /// Texel by texel; and the same less its mean, where lobes find the rest.
    Texels { all: Piecewise2D, peaks: Piecewise2D },
    /// Between texels.
    LatLong(LatLongDensity),
}

impl Density {
    fn sample(&self, u: [f32; 2], beside_lobes: bool) -> ([f32; 2], f32) {
        match self {
            Self::Texels { all, peaks } => if beside_lobes { peaks } else { all }.sample(u),
            Self::LatLong(d) => d.sample(u, beside_lobes),
        }
    }

    fn pdf(&self, uv: [f32; 2], beside_lobes: bool) -> f32 {
        match self {
            Self::Texels { all, peaks } => if beside_lobes { peaks } else { all }.pdf(uv),
            Self::LatLong(d) => d.pdf(uv, beside_lobes),
        }
    }
}

/// The colour of a texel; grey where there is one colour channel only.
pub(super) fn rgb_at(texels: &Texels, x: usize, y: usize) -> [f32; 3] {
    if texels.channels() < 3 { [texels.texel(x, y, 0); 3] } else { texels.texel3(x, y) }
}

/// A picture at `(u, v)` of the unit square, v down, between texels in proportion, outside as the picture is wrapped.
pub(super) fn interpolated(image: &TextureImage, [u, v]: [f32; 2]) -> [f32; 3] {
    let texels = &image.texels;
    let size = [texels.width(), texels.height()];
    let at = [u * size[0] as f32 - 0.5, v * size[1] as f32 - 0.5];
    let cell = at.map(|x| x.floor());
    let t = [at[0] - cell[0], at[1] - cell[1]];
    let place = |axis: usize, k: i64| {
        let (i, n) = (cell[axis] as i64 + k, size[axis]);
        image.wrap[axis].along(i, n).unwrap_or(i.clamp(0, n as i64 - 1) as usize)
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
        let brightness = |x: usize, y: usize| (rgb_at(texels, x, y).iter().sum::<f32>() / 3.0).max(0.0);
        let density = match mapping {
            EnvironmentMapping::EqualArea => by_texels(w, h, brightness),
            EnvironmentMapping::LatLong => LatLongDensity::new(w, h, false, brightness).map(Density::LatLong),
            EnvironmentMapping::LatLongToPoles => LatLongDensity::new(w, h, true, brightness).map(Density::LatLong),
        };
        Self { image, scale, mapping, world_from_light, density }
    }

    /// The density beside lobes of a map that is looked up texel by texel.
    #[inline]
    pub(super) fn peaks(&self) -> Option<&Piecewise2D> {
        match &self.density {
            Some(Density::Texels { peaks, .. }) => Some(peaks),
            _ => None,
        }
    }

    #[inline(always)]
    pub(super) fn local(&self, d: Vec3) -> Vec3 {
        self.world_from_light.inverse_vector(d).normalize()
    }

    fn square_of(&self, local: Vec3) -> [f32; 2] {
        match self.mapping {
            EnvironmentMapping::EqualArea => octahedral_to_square(local),
            EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => lat_long_to_square(local),
        }
    }

    /// The colour from the direction that a point of the square stands for, before `scale`. Maps to the poles are Mitsuba's, which in spectral
    /// mode interpolates colour and brightness each on its own.
    #[inline]
    fn rgb(&self, texels: &Texels, [u, v]: [f32; 2], spectral: bool) -> [f32; 3] {
        let (w, h) = (texels.width(), texels.height());
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        match self.mapping {
            EnvironmentMapping::EqualArea => rgb_at(texels, cell(u, w), cell(v, h)),
            EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => {
                let last = (h - 1) as f32;
                let y = if self.mapping == EnvironmentMapping::LatLong { v * h as f32 - 0.5 } else { v * last };
                let (x, y) = (u * w as f32 - 0.5, y.clamp(0.0, last));
                let (x0, y0) = (x.floor(), y.floor());
                let (fx, fy) = (x - x0, y - y0);
                let column = |x: f32| (x as i64).rem_euclid(w as i64) as usize;
                let row = |y: f32| (y as usize).min(h - 1);
                let corner = |dx: f32, dy: f32| rgb_at(texels, column(x0 + dx), row(y0 + dy));
                let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
                let between =
                    |[a, b, c, d]: [f32; 4]| (1.0 - fy) * ((1.0 - fx) * a + fx * b) + fy * ((1.0 - fx) * c + fx * d);
                if spectral && self.mapping == EnvironmentMapping::LatLongToPoles {
                    let most = corners.map(|c| c[0].max(c[1]).max(c[2]).max(1e-8));
                    let brightness = between(most);
                    let hue: [[f32; 3]; 4] = std::array::from_fn(|k| corners[k].map(|v| v / most[k]));
                    return std::array::from_fn(|i| brightness * between(hue.map(|c| c[i])));
                }
                std::array::from_fn(|i| between(corners.map(|c| c[i])))
            }
        }
    }

    /// A direction towards the map (world space) and its density per solid angle. `None` for a black map.
    fn sample_direction(&self, u: [f32; 2], beside_lobes: bool) -> Option<(Vec3, f32)> {
        let (uv, pdf) = self.density.as_ref()?.sample(u, beside_lobes);
        let local = match self.mapping {
            EnvironmentMapping::EqualArea => square_to_octahedral(uv),
            EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => square_to_lat_long(uv),
        };
        let pdf = pdf * self.square_to_sphere_density(local);
        (pdf > 0.0 && pdf.is_finite()).then(|| (self.world_from_light.vector(local).normalize(), pdf))
    }

    /// The density per solid angle of `sample_direction`.
    fn pdf_direction(&self, d: Vec3, beside_lobes: bool) -> f32 {
        let Some(density) = &self.density else { return 0.0 };
        let local = self.local(d);
        let pdf = density.pdf(self.square_of(local), beside_lobes) * self.square_to_sphere_density(local);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The density on the sphere of the uniform density on the square.
    fn square_to_sphere_density(&self, local: Vec3) -> f32 {
        match self.mapping {
            EnvironmentMapping::EqualArea => INV_4PI,
            EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => square_to_lat_long_pdf(local),
        }
    }

    /// The mean brightness over the sphere, before `scale`: for choosing among lights.
    fn mean_brightness(&self) -> f32 {
        match &self.density {
            None => 0.0,
            Some(Density::Texels { all, .. }) => all.integral(),
            Some(Density::LatLong(d)) => d.mean(),
        }
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
        let rgb = self.rgb(&image.texels, square, !w.is_rgb()).map(|v| v.max(0.0));
        rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * self.scale
    }
}

impl FarLight for Environment {
    const IS_DELTA: bool = false;

    #[inline]
    fn sample(&self, images: &Arena<TextureImage>, _: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let (wi, pdf) = self.sample_direction(u, false)?;
        FarSample::infinite(self.lanes(images, wi, w), wi, pdf)
    }

    #[inline]
    fn pdf(&self, _: Point3, wi: Vec3) -> f32 {
        self.pdf_direction(wi, false)
    }

    #[inline]
    fn sample_beside_lobes(
        &self,
        images: &Arena<TextureImage>,
        _: Point3,
        u: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarSample> {
        let (wi, pdf) = self.sample_direction(u, true)?;
        FarSample::infinite(self.lanes(images, wi, w), wi, pdf)
    }

    #[inline]
    fn pdf_beside_lobes(&self, _: Point3, wi: Vec3) -> f32 {
        self.pdf_direction(wi, true)
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
        let (wi, pdf) = self.sample_direction(ud, false)?;
        Some(from_infinity(ball, wi, self.lanes(images, wi, w), pdf, up))
    }

    fn emission_pdf(&self, ball: &Ball, d: Vec3) -> [f32; 2] {
        [self.pdf_direction(-d, false), ball.pdf()]
    }

    fn power(&self, images: &Arena<TextureImage>, scene_radius: f32) -> f32 {
        let unit = images[self.image].color_space.photometric() * self.scale;
        self.mean_brightness() * unit * 4.0 * PI * PI * scene_radius * scene_radius
    }
}

/// The density of a picture that is looked up texel by texel, all of which are equally large.
fn by_texels(w: usize, h: usize, brightness: impl Fn(usize, usize) -> f32) -> Option<Density> {
    let values: Vec<f32> = (0..w * h).map(|i| brightness(i % w, i / w)).collect();
    let mean = (values.iter().map(|&v| f64::from(v)).sum::<f64>() / (w * h) as f64) as f32;
    if mean == 0.0 {
        return None;
    }
    let peaks: Vec<f32> = values.iter().map(|v| (v - mean).max(0.0)).collect();
    let all = Piecewise2D::new(values, w, h)?;
    // A map without features has no peaks.
    let peaks = if peaks.iter().any(|&p| p > 0.0) { Piecewise2D::new(peaks, w, h)? } else { all.clone() };
    Some(Density::Texels { all, peaks })
}
