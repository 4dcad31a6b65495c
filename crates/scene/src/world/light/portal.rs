//! An environment seen through a rectangular opening: the picture is rectified so that what a point sees of it is an
//! axis-aligned window, which a summed-area table samples (Bitterli, Novák and Jarosz, "Portal-masked environment map
//! sampling", 2015; PBRT 4th ed., 12.5.3).
//!
//! As in pbrt-v4 the rectified picture, of the resolution of the original, *is* the light from then on.

use super::emission::{Ball, FarEmission};
use super::environment::rgb_at;
use super::far::{FarLight, FarSample};
use crate::world::texture::rgb_lanes;
use crate::{Arena, TextureImage};
use steradian_image::Texels;
use steradian_math::{Frame, PI, Point3, Ray, Transform, Vec3, atan2, tan};
use steradian_sampling::WindowedPiecewise2D;
use steradian_sampling::warp::{octahedral_to_square, wrap_octahedral};
use steradian_spectrum::{ColorSpace, Lanes, SpectrumUse, Wavelengths};

/// An environment map behind a portal.
#[derive(Clone, Debug)]
pub(super) struct Portal {
    /// Opposite corners in world space.
    corners: [Point3; 2],
    /// x and y along the edges; z points outside.
    frame: Frame,
    /// The rectified picture, row by row.
    rgb: Vec<[f32; 3]>,
    size: [usize; 2],
    color_space: ColorSpace,
    scale: f32,
    distribution: Option<WindowedPiecewise2D>,
    mean: f32,
}

/// The window of the picture that is seen from a point.
type Window = ([f32; 2], [f32; 2]);

/// Solid angle per area of the picture in local direction `w`.
fn dw_duv(w: Vec3) -> f32 {
    PI * PI * (1.0 - w.x * w.x) * (1.0 - w.y * w.y) / w.z
}

/// The local direction at `uv`.
fn direction(uv: [f32; 2]) -> Vec3 {
    let [x, y] = uv.map(|v| tan((v - 0.5) * PI));
    Vec3::new(x, y, 1.0).normalize()
}

/// The colour of an equal-area map between texels, continued across its edges.
fn interpolated(t: &Texels, uv: [f32; 2]) -> [f32; 3] {
    let (w, h) = (t.width(), t.height());
    let (x, y) = (uv[0] * w as f32 - 0.5, uv[1] * h as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let corner = |dx: f32, dy: f32| {
        let [u, v] = wrap_octahedral([(x0 + dx + 0.5) / w as f32, (y0 + dy + 0.5) / h as f32]);
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        rgb_at(t, cell(u, w), cell(v, h))
    };
    let (a, b, c, d) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0));
    std::array::from_fn(|i| (1.0 - fy) * ((1.0 - fx) * a[i] + fx * b[i]) + fy * ((1.0 - fx) * c[i] + fx * d[i]))
}

impl Portal {
    /// `portal` is a rectangle in world space, in order around it; `image` an equal-area map around z of light space.
    pub fn new(world_from_light: &Transform, image: &TextureImage, scale: f32, portal: &[Point3; 4]) -> Self {
        let along = |to: usize| (portal[to] - portal[0]).try_normalize().unwrap_or(Vec3::new(1.0, 0.0, 0.0));
        let (x, y) = (along(3), along(1));
        let frame = Frame { x, y, z: x.cross(y) };
        let (w, h) = (image.texels.width(), image.texels.height());
        let light_from_world = world_from_light.inverse();
        let mut rgb = Vec::with_capacity(w * h);
        let mut values = Vec::with_capacity(w * h);
        for y in 0..h {
            for x in 0..w {
                let uv = [(x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32];
                let local = direction(uv);
                let d = light_from_world.vector(frame.from_local(local)).normalize();
                let c = interpolated(&image.texels, octahedral_to_square(d));
                rgb.push(c.map(|v| v.max(0.0)));
                values.push((c.iter().sum::<f32>() / 3.0).max(0.0) * dw_duv(local));
            }
        }
        let mean = (values.iter().map(|&v| f64::from(v)).sum::<f64>() / (w * h).max(1) as f64) as f32;
        // Power: the flux through the portal, as if all of it were seen from everywhere.
        let area = (portal[1] - portal[0]).cross(portal[3] - portal[0]).length();
        Self {
            corners: [portal[0], portal[2]],
            frame,
            rgb,
            size: [w, h],
            color_space: image.color_space,
            scale,
            distribution: WindowedPiecewise2D::new(values, w, h),
            mean: mean * area,
        }
    }

    /// The place of local direction `w` in the picture; `None` on the inner side.
    fn uv_of(&self, w: Vec3) -> Option<[f32; 2]> {
        (w.z > 0.0).then(|| [w.x, w.y].map(|c| (atan2(c, w.z) / PI + 0.5).clamp(0.0, 1.0)))
    }

    /// What `p` sees of the picture through the portal.
    fn window(&self, p: Point3) -> Option<Window> {
        let corner = |c: Point3| self.uv_of(self.frame.to_local(c - p));
        let (a, b) = (corner(self.corners[0])?, corner(self.corners[1])?);
        Some(([a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])]))
    }

    /// The density, per area perpendicular to local direction `w`, of rays through uniform points of the opening.
    fn rays_through(&self, w: Vec3) -> f32 {
        let across = self.frame.to_local(self.corners[1] - self.corners[0]);
        1.0 / ((across.x * across.y).abs() * w.z)
    }

    fn lanes(&self, uv: [f32; 2], w: &Wavelengths) -> Lanes {
        let cell = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
        let rgb = self.rgb[cell(uv[1], self.size[1]) * self.size[0] + cell(uv[0], self.size[0])];
        rgb_lanes(rgb, self.color_space, SpectrumUse::Illuminant, w) * self.scale
    }
}

impl FarLight for Portal {
    const IS_DELTA: bool = false;

    fn sample(&self, _: &Arena<TextureImage>, from: Point3, u: [f32; 2], w: &Wavelengths) -> Option<FarSample> {
        let (min, max) = self.window(from)?;
        let (uv, pdf) = self.distribution.as_ref()?.sample(u, min, max)?;
        let local = direction(uv);
        let pdf = pdf / dw_duv(local);
        let valid = pdf > 0.0 && pdf.is_finite();
        valid.then(|| FarSample::infinite(self.lanes(uv, w), self.frame.from_local(local), pdf))?
    }

    fn pdf(&self, from: Point3, wi: Vec3) -> f32 {
        let local = self.frame.to_local(wi);
        let (Some(distribution), Some(uv)) = (&self.distribution, self.uv_of(local)) else { return 0.0 };
        let Some((min, max)) = self.window(from) else { return 0.0 };
        let pdf = distribution.pdf(uv, min, max) / dw_duv(local);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    fn radiance(&self, _: &Arena<TextureImage>, ray: &Ray, w: &Wavelengths) -> Lanes {
        let Some(uv) = self.uv_of(self.frame.to_local(ray.d.normalize())) else { return Lanes::ZERO };
        match self.window(ray.o) {
            Some((min, max)) if (0..2).all(|i| uv[i] >= min[i] && uv[i] <= max[i]) => self.lanes(uv, w),
            _ => Lanes::ZERO,
        }
    }

    fn emit(
        &self,
        _: &Arena<TextureImage>,
        ball: &Ball,
        up: [f32; 2],
        ud: [f32; 2],
        w: &Wavelengths,
    ) -> Option<FarEmission> {
        let (uv, pdf) = self.distribution.as_ref()?.sample(ud, [0.0; 2], [1.0; 2])?;
        let local = direction(uv);
        let d = -self.frame.from_local(local);
        // Through a point of the opening, from outside everything.
        let across = self.frame.to_local(self.corners[1] - self.corners[0]);
        let through = self.corners[0] + self.frame.x * (across.x * up[0]) + self.frame.y * (across.y * up[1]);
        let o = through - d * (through.distance(ball.centre) + ball.radius);
        let pdf_ray = self.rays_through(local);
        Some(FarEmission { o, d, value: self.lanes(uv, w), pdf_end: pdf / dw_duv(local), pdf_ray })
    }

    fn emission_pdf(&self, _: &Ball, d: Vec3) -> [f32; 2] {
        let local = -self.frame.to_local(d);
        let (Some(distribution), Some(uv)) = (&self.distribution, self.uv_of(local)) else { return [0.0; 2] };
        let pdf = distribution.pdf(uv, [0.0; 2], [1.0; 2]) / dw_duv(local);
        [if pdf.is_finite() { pdf } else { 0.0 }, self.rays_through(local)]
    }

    fn power(&self, _: &Arena<TextureImage>, _: f32) -> f32 {
        self.mean * self.color_space.photometric() * self.scale
    }
}
