//! Measured reflectance in the adaptive parameterisation of Dupuy and Jakob (2018), as in the public RGL material database.
//!
//! For each viewing direction, directions of light are found through two warps of the square: one that follows the measured
//! luminance, and one that follows the visible normals of a microfacet surface fitted to the retroreflection. The spectra
//! are stored between the two, where they vary slowly.

use crate::direction::{reflect, same_hemisphere};
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{FRAC_PI_2, INV_2PI, PI, TAU, Vec3, atan2, sin_cos, sqr};
use steradian_sampling::distribution::{BilinearTable, ConditionalBilinear2D, Slices};
use steradian_spectrum::{LAMBDA_MAX, LAMBDA_MIN, Lanes, Spectrum, SpectrumUse, Wavelengths};

/// The numbers of a material file. Grids are indexed row by row; the columns of `ndf`, `sigma`, and `vndf` run over the
/// polar angle of a direction as `sqrt(2 theta / pi)`, the rows over its azimuth as `phi / 2 pi + 1/2`.
#[derive(Clone, Debug)]
pub struct MeasuredTables {
    /// Azimuths of the viewing direction in radians; one or two for an isotropic material.
    pub phi: Vec<f32>,
    /// Polar angles of the viewing direction in radians.
    pub theta: Vec<f32>,
    /// Wavelengths in nanometres.
    pub wavelengths: Vec<f32>,
    /// Distribution of normals, and its columns and rows.
    pub ndf: (Vec<f32>, [usize; 2]),
    /// Projected area of the microsurface.
    pub sigma: (Vec<f32>, [usize; 2]),
    /// Visible normals for each azimuth and polar angle.
    pub vndf: (Vec<f32>, [usize; 2]),
    /// Luminance for each azimuth and polar angle, over the square of the visible normals.
    pub luminance: (Vec<f32>, [usize; 2]),
    /// The same for each wavelength: azimuth, polar angle, wavelength, row, column.
    pub spectra: (Vec<f32>, [usize; 2]),
}

/// A measured material, ready for use.
#[derive(Clone, Debug)]
pub struct MeasuredMaterial {
    isotropic: bool,
    ndf: BilinearTable<0>,
    sigma: BilinearTable<0>,
    vndf: ConditionalBilinear2D<2>,
    luminance: ConditionalBilinear2D<2>,
    spectra: BilinearTable<3>,
    /// The spectra as linear sRGB: the third parameter is the channel.
    rgb: BilinearTable<3>,
}

impl MeasuredMaterial {
    /// Prepares the tables.
    ///
    /// # Errors
    /// What is wrong, as a sentence fragment: sizes that do not fit, numbers that are negative or not finite.
    pub fn new(t: MeasuredTables) -> Result<Self, &'static str> {
        let angles = [t.phi.clone(), t.theta.clone()];
        let (values, size) = t.spectra;
        let rgb = rgb_of_spectra(&t.wavelengths, size, &values).ok_or("`wavelengths` or `spectra` are not sound")?;
        let [phi, theta] = angles.clone();
        let channels = vec![0.0, 1.0, 2.0];
        let density = |(values, size), what| {
            BilinearTable::new(size, angles.clone(), values).and_then(ConditionalBilinear2D::new).ok_or(what)
        };
        Ok(Self {
            isotropic: t.phi.len() <= 2,
            ndf: BilinearTable::new(t.ndf.1, [], t.ndf.0).ok_or("`ndf` is not sound")?,
            sigma: BilinearTable::new(t.sigma.1, [], t.sigma.0).ok_or("`sigma` is not sound")?,
            vndf: density(t.vndf, "`vndf` is not sound")?,
            luminance: density(t.luminance, "`luminance` is not sound")?,
            rgb: BilinearTable::new(size, [phi.clone(), theta.clone(), channels], rgb)
                .ok_or("`spectra` are not sound")?,
            spectra: BilinearTable::new(size, [phi, theta, t.wavelengths], values).ok_or("`spectra` are not sound")?,
        })
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> usize {
        self.ndf.bytes()
            + self.sigma.bytes()
            + self.vndf.bytes()
            + self.luminance.bytes()
            + self.spectra.bytes()
            + self.rgb.bytes()
    }
}

/// For RGB mode: each stack of wavelengths as linear sRGB under the white of daylight, ends extended to the visible range.
fn rgb_of_spectra(lambda: &[f32], size: [usize; 2], values: &[f32]) -> Option<Vec<f32>> {
    let n = lambda.len();
    let cells = size[0].checked_mul(size[1])?;
    let block = cells.checked_mul(n).filter(|b| *b > 0)?;
    if !values.len().is_multiple_of(block)
        || !lambda.is_sorted_by(|a, b| a < b)
        || !lambda.iter().all(|v| v.is_finite())
    {
        return None;
    }
    // Conversion is linear, so the colours of the hat functions say everything. Each rides on a constant, since a
    // reflectance's colour is not allowed below zero, and that of a narrow band is.
    let mut x = lambda.to_vec();
    x.insert(0, lambda[0].min(LAMBDA_MIN) - 1.0);
    x.push(lambda[n - 1].max(LAMBDA_MAX) + 1.0);
    let hats: Vec<[f32; 3]> = (0..n)
        .map(|k| {
            let nearest = |i: usize| i.saturating_sub(1).min(n - 1);
            let y: Vec<f32> = (0..n + 2).map(|i| if nearest(i) == k { 2.0 } else { 1.0 }).collect();
            let rgb = Spectrum::piecewise_linear(&x, &y, SpectrumUse::Albedo).ok()?.rgb();
            Some(rgb.map(|v| v - 1.0))
        })
        .collect::<Option<_>>()?;
    let mut out = Vec::with_capacity(values.len() / n * 3);
    for stack in values.chunks_exact(block) {
        for channel in 0..3 {
            out.extend((0..cells).map(|i| {
                let sum: f32 = hats.iter().enumerate().map(|(k, hat)| hat[channel] * stack[k * cells + i]).sum();
                sum.max(0.0)
            }));
        }
    }
    Some(out)
}

/// A measured material at the wavelengths of a path. It reflects on both sides of the surface alike.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'w> {
    material: &'w MeasuredMaterial,
    /// Wavelengths, or channels in RGB mode.
    third: [f32; 4],
    is_rgb: bool,
}

/// The viewing direction as the tables know it.
struct View {
    wo: Vec3,
    theta: f32,
    phi: f32,
    /// Projected area of the microsurface.
    sigma: f32,
}

#[inline]
fn theta_to_u(theta: f32) -> f32 {
    (theta * (1.0 / FRAC_PI_2)).sqrt()
}

#[inline]
fn phi_to_u(phi: f32) -> f32 {
    let u = phi * INV_2PI + 0.5;
    u - u.floor()
}

/// Polar and azimuth angle, exact also near the pole.
#[inline]
fn angles(w: Vec3) -> (f32, f32) {
    (atan2((sqr(w.x) + sqr(w.y)).sqrt(), w.z), atan2(w.y, w.x))
}

impl<'w> Measured<'w> {
    /// The material at these wavelengths.
    #[inline]
    pub fn new(material: &'w MeasuredMaterial, wavelengths: &Wavelengths) -> Self {
        let is_rgb = wavelengths.is_rgb();
        Self { material, third: if is_rgb { [0.0, 1.0, 2.0, 2.0] } else { wavelengths.lambda() }, is_rgb }
    }

    #[inline]
    fn view(&self, wo: Vec3) -> View {
        let (theta, phi) = angles(wo);
        let sigma = &self.material.sigma;
        View { wo, theta, phi, sigma: sigma.eval([theta_to_u(theta), phi_to_u(phi)], &sigma.slices([])) }
    }

    #[inline]
    fn conditional(&self, view: &View) -> (Slices, Slices) {
        let at = [view.phi, view.theta];
        (self.material.vndf.slices(at), self.material.luminance.slices(at))
    }

    /// `f cos` for a point between the two warps and the normal that it leads to.
    #[inline]
    fn value(&self, view: &View, u: [f32; 2], u_wm: [f32; 2]) -> Lanes {
        let m = self.material;
        let table = if self.is_rgb { &m.rgb } else { &m.spectra };
        let spectrum = Lanes(self.third.map(|l| table.eval(u, &table.slices([view.phi, view.theta, l])).max(0.0)));
        let area = 4.0 * view.sigma;
        if area > 0.0 { spectrum * (m.ndf.eval(u_wm, &m.ndf.slices([])).max(0.0) / area) } else { Lanes::ZERO }
    }

    /// Density of a direction of light per density of its normal in the square.
    #[inline]
    fn jacobian(view: &View, wm: Vec3, u_theta: f32) -> f32 {
        let sin_theta = (sqr(wm.x) + sqr(wm.y)).sqrt();
        4.0 * view.wo.dot(wm) * (2.0 * PI * PI * u_theta * sin_theta).max(1e-6)
    }
}

impl Lobe for Measured<'_> {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION | Lobes::GLOSSY
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        self.eval_cos(wo, wi, mode) / wi.z.abs().max(1e-20)
    }

    #[inline]
    fn eval_cos(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        self.eval_and_pdf(wo, wi, mode).0
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        if part == Part::Transmission { 0.0 } else { self.eval_and_pdf(wo, wi, mode).1 }
    }

    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Lanes, f32) {
        if !same_hemisphere(wo, wi) {
            return (Lanes::ZERO, 0.0);
        }
        // The other side is the same turned round.
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        let Some(wm) = (wo + wi).try_normalize() else { return (Lanes::ZERO, 0.0) };
        let view = self.view(wo);
        let (theta, phi) = angles(wm);
        let turn = if self.material.isotropic { view.phi } else { 0.0 };
        let u_wm = [theta_to_u(theta), phi_to_u(phi - turn)];
        let (visible, bright) = self.conditional(&view);
        let inverse = self.material.vndf.invert(u_wm, &visible);
        let pdf = inverse.pdf * self.material.luminance.pdf(inverse.p, &bright) / Self::jacobian(&view, wm, u_wm[0]);
        (self.value(&view, inverse.p, u_wm), pdf)
    }

    fn sample_part(&self, wo: Vec3, _: f32, u: [f32; 2], _mode: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission || wo.z == 0.0 {
            return None;
        }
        let flipped = wo.z < 0.0;
        let view = self.view(if flipped { -wo } else { wo });
        let (visible, bright) = self.conditional(&view);
        let between = self.material.luminance.sample(u, &bright);
        let normal = self.material.vndf.sample(between.p, &visible);
        let theta = sqr(normal.p[0]) * FRAC_PI_2;
        let turn = if self.material.isotropic { view.phi } else { 0.0 };
        let (sin_theta, cos_theta) = sin_cos(theta);
        let wm = Vec3::spherical(sin_theta, cos_theta, TAU * (normal.p[1] - 0.5) + turn);
        let wi = reflect(view.wo, wm).try_normalize()?;
        if wi.z <= 0.0 {
            return None;
        }
        let pdf = between.pdf * normal.pdf / Self::jacobian(&view, wm, normal.p[0]);
        let weight = self.value(&view, between.p, normal.p) / pdf;
        (pdf > 0.0 && pdf.is_finite() && weight.is_finite()).then(|| LobeSample {
            wi: if flipped { -wi } else { wi },
            weight,
            pdf,
            flags: Lobes::REFLECTION | Lobes::GLOSSY,
            eta: 1.0,
            pdf_is_proportional: false,
        })
    }
}
