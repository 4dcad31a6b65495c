//! Hair and fur: a rough dielectric cylinder with an absorbing inside and tilted scales (Chiang et al. 2016, after Marschner
//! et al. 2003 and d'Eon et al. 2011).
//!
//! `f |cos wi| = sum over p of M_p(theta_o, theta_i) A_p(theta_o, h) N_p(phi)`, where `p` counts the segments of the path
//! inside: 0 is reflection, 1 transmission, 2 one internal reflection, and the last term stands for all that are left.

use crate::fresnel::fresnel_dielectric;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{INV_2PI, PI, TAU, Vec3, atan2, exp, ln, radians, safe_asin, safe_sqrt, sin, sin_cos, sqr};
use steradian_spectrum::Lanes;

/// Number of orders that have a direction of their own; what is left is spread evenly around the fibre.
const ORDERS: usize = 3;

/// A fibre along x, seen where a ray meets it at offset `h`.
///
/// The frame's x axis is the fibre's tangent and `+z` the shading normal. Light is scattered to both sides of the tangent
/// plane. The model is not reciprocal: attenuation depends on the viewing direction alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hair {
    /// Offset of the ray from the axis in radii, in `[-1, 1]`.
    h: f32,
    eta: f32,
    sigma_a: Lanes,
    /// Longitudinal variance of reflection, transmission, and higher orders.
    variance: [f32; ORDERS],
    /// Scale of the azimuthal logistic distribution, and its mass within half a turn.
    scale: f32,
    mass: f32,
    /// Sine and cosine of the turn of the viewing direction by the scales, per order.
    tilt: [(f32, f32); ORDERS],
}

/// What depends on the viewing direction only.
struct View {
    sin_theta: f32,
    cos_theta: f32,
    phi: f32,
    /// Angles of the normal at the point of entry to the ray, outside and inside, in the plane across the fibre.
    gamma_o: f32,
    gamma_t: f32,
    /// Attenuation of each order, and that of all that are left.
    attenuation: [Lanes; ORDERS + 1],
    probability: [f32; ORDERS + 1],
}

impl Hair {
    /// A fibre with index `eta` inside, absorption `sigma_a` per radius, longitudinal and azimuthal roughness in
    /// `[0.01, 1]`, and scales tilted by `alpha` degrees. Values outside of their range are clamped.
    pub fn new(h: f32, eta: f32, sigma_a: Lanes, beta_m: f32, beta_n: f32, alpha: f32) -> Self {
        let (m, n) = (within(beta_m, 0.01, 1.0), within(beta_n, 0.01, 1.0));
        // Fits by Chiang et al. from perceptually even roughness to variance and logistic scale.
        let v = sqr(0.726 * m + 0.812 * m * m + 3.7 * power(m, 20));
        let scale = 0.626_657_07 * (0.265 * n + 1.194 * n * n + 5.372 * power(n, 22));
        let tail = exp(-PI / scale);
        let (s1, c1) = sin_cos(radians(alpha));
        let (s2, c2) = (2.0 * s1 * c1, c1 * c1 - s1 * s1);
        let (s4, c4) = (2.0 * s2 * c2, c2 * c2 - s2 * s2);
        Self {
            h: within(h, -1.0, 1.0),
            eta: eta.max(1e-3),
            sigma_a: sigma_a.clamp_zero(),
            variance: [v, 0.25 * v, 4.0 * v],
            scale,
            mass: (1.0 - tail) / (1.0 + tail),
            tilt: [(-s2, c2), (s1, c1), (s4, c4)],
        }
    }

    /// The absorption for which a full head of hair has this colour (Chiang et al., equation 9).
    pub fn absorption_of_reflectance(reflectance: Lanes, beta_n: f32) -> Lanes {
        let n = within(beta_n, 0.01, 1.0);
        let fit = 5.969 - 0.215 * n + 2.532 * n * n - 10.73 * power(n, 3) + 5.574 * power(n, 4) + 0.245 * power(n, 5);
        // Black would be infinite; this much is black.
        reflectance.map(|c| sqr(ln(c.clamp(1e-30, 1.0)) / fit))
    }

    /// Linear sRGB absorption of melanin in these concentrations (d'Eon et al. 2011).
    pub fn absorption_of_melanin(eumelanin: f32, pheomelanin: f32) -> [f32; 3] {
        let (brown, red) = ([0.419, 0.697, 1.37], [0.187, 0.4, 1.05]);
        std::array::from_fn(|i| eumelanin.max(0.0) * brown[i] + pheomelanin.max(0.0) * red[i])
    }

    #[inline]
    fn view(&self, wo: Vec3) -> View {
        // Denominators that only vanish for directions or indices that do not occur.
        const TINY: f32 = 1e-6;
        let sin_theta = wo.x.clamp(-1.0, 1.0);
        let cos_theta = safe_sqrt(1.0 - sqr(sin_theta));
        let cos_theta_t = safe_sqrt(1.0 - sqr(sin_theta / self.eta)).max(TINY);
        // In the plane across the fibre refraction has an index of its own (Marschner et al., Bravais).
        let sin_gamma_t = (self.h * cos_theta / safe_sqrt(sqr(self.eta) - sqr(sin_theta)).max(TINY)).clamp(-1.0, 1.0);
        let cos_gamma_t = safe_sqrt(1.0 - sqr(sin_gamma_t));
        let t = (self.sigma_a * (-2.0 * cos_gamma_t / cos_theta_t)).exp();
        let f = fresnel_dielectric(cos_theta * safe_sqrt(1.0 - sqr(self.h)), self.eta);
        let through = t * sqr(1.0 - f);
        let inside = through * t * f;
        let rest = (inside * t * f).safe_div(Lanes::ONE - t * f);
        let attenuation = [Lanes::splat(f), through, inside, rest];
        let sum: f32 = attenuation.iter().map(|a| a.average()).sum();
        View {
            sin_theta,
            cos_theta,
            phi: atan2(wo.z, wo.y),
            gamma_o: safe_asin(self.h),
            gamma_t: safe_asin(sin_gamma_t),
            attenuation,
            probability: attenuation.map(|a| if sum > 0.0 { a.average() / sum } else { 0.0 }),
        }
    }

    /// The viewing direction as order `p` sees it, turned by the scales: sine and cosine.
    #[inline]
    fn tilted(&self, view: &View, p: usize) -> (f32, f32) {
        let Some(&(s, c)) = self.tilt.get(p) else { return (view.sin_theta, view.cos_theta) };
        (view.sin_theta * c + view.cos_theta * s, (view.cos_theta * c - view.sin_theta * s).abs())
    }

    /// Angle by which an order turns around the fibre without roughness.
    #[inline]
    fn turn(view: &View, p: usize) -> f32 {
        let p = p as f32;
        2.0 * p * view.gamma_t - 2.0 * view.gamma_o + p * PI
    }

    /// Density of the angle around the fibre for order `p`.
    #[inline]
    fn azimuthal(&self, view: &View, p: usize, phi: f32) -> f32 {
        if p == ORDERS {
            return INV_2PI;
        }
        let mut d = phi - Self::turn(view, p);
        d -= TAU * (d * INV_2PI).round();
        let e = exp(-d.abs() / self.scale);
        e / (self.scale * sqr(1.0 + e) * self.mass)
    }

    /// The longitudinal part of order `p`.
    #[inline]
    fn longitudinal(&self, view: &View, p: usize, sin_i: f32, cos_i: f32) -> f32 {
        let (sin_o, cos_o) = self.tilted(view, p);
        longitudinal_density(sin_i, cos_i, sin_o, cos_o, self.variance[p.min(ORDERS - 1)])
    }

    /// Sum over the orders: `f |cos|` and density.
    fn sum(&self, view: &View, wi: Vec3) -> (Lanes, f32) {
        let sin_i = wi.x.clamp(-1.0, 1.0);
        let cos_i = safe_sqrt(1.0 - sqr(sin_i));
        let phi = atan2(wi.z, wi.y) - view.phi;
        let (mut value, mut pdf) = (Lanes::ZERO, 0.0);
        for p in 0..=ORDERS {
            let shape = self.longitudinal(view, p, sin_i, cos_i) * self.azimuthal(view, p, phi);
            value += view.attenuation[p] * shape;
            pdf += view.probability[p] * shape;
        }
        (value, pdf)
    }
}

/// `x` moved into a range; NaN becomes the lower end.
#[inline]
fn within(x: f32, low: f32, high: f32) -> f32 {
    if x > low { x.min(high) } else { low }
}

/// Integer power by squaring.
#[inline]
fn power(x: f32, n: u32) -> f32 {
    let (mut result, mut square, mut n) = (1.0, x, n);
    while n > 0 {
        if n & 1 == 1 {
            result *= square;
        }
        square *= square;
        n >>= 1;
    }
    result
}

/// `exp(-x) I_0(x)` for `x >= 0`, to 2e-7 (Abramowitz and Stegun 9.8.1 and 9.8.2).
#[inline]
fn scaled_bessel_i0(x: f32) -> f32 {
    const SMALL: [f32; 7] = [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
    const LARGE: [f32; 9] = [
        0.398_942_28,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    let horner = |c: &[f32], t: f32| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x <= 3.75 { horner(&SMALL, sqr(x / 3.75)) * exp(-x) } else { horner(&LARGE, 3.75 / x) / x.sqrt() }
}

/// Spread along the fibre (d'Eon et al. 2011): integrates to one over the sphere with an even azimuthal part.
///
/// All exponentials are gathered so that no term can overflow, for a variance however small.
#[inline]
fn longitudinal_density(sin_i: f32, cos_i: f32, sin_o: f32, cos_o: f32, v: f32) -> f32 {
    // (cos cos - sin sin - 1) / v without cancellation, for unit vectors.
    let exponent = -(sqr(cos_i - cos_o) + sqr(sin_i + sin_o)) / (2.0 * v);
    scaled_bessel_i0(cos_i * cos_o / v) * exp(exponent) / (v * (1.0 - exp(-2.0 / v)))
}

/// Whether a direction lies on the side that is asked for.
#[inline]
fn in_part(wo: Vec3, wi: Vec3, part: Part) -> bool {
    match part {
        Part::All => true,
        Part::Reflection => wo.z * wi.z > 0.0,
        Part::Transmission => wo.z * wi.z < 0.0,
    }
}

impl Lobe for Hair {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION | Lobes::TRANSMISSION | Lobes::GLOSSY
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
        if in_part(wo, wi, part) { self.eval_and_pdf(wo, wi, mode).1 } else { 0.0 }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Lanes, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Lanes::ZERO, 0.0);
        }
        self.sum(&self.view(wo), wi)
    }

    /// A part is had by rejection, so its density integrates to the share of that side.
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], _mode: TransportMode, part: Part) -> Option<LobeSample> {
        if wo.z == 0.0 {
            return None;
        }
        let view = self.view(wo);
        // Choose an order; what is left of the random number chooses the angle around the fibre.
        let (mut p, mut rest) = (0, u_lobe);
        while p < ORDERS && rest >= view.probability[p] {
            rest -= view.probability[p];
            p += 1;
        }
        if view.probability[p] <= 0.0 {
            return None;
        }
        let u_phi = (rest / view.probability[p]).clamp(1e-7, 1.0 - 1e-7);

        let (sin_o, cos_o) = self.tilted(&view, p);
        let v = self.variance[p.min(ORDERS - 1)];
        let cos = (1.0 + v * ln((1.0 - u[0]) + u[0] * exp(-2.0 / v))).clamp(-1.0, 1.0);
        let sin_theta = (safe_sqrt(1.0 - sqr(cos)) * sin_cos(TAU * u[1]).1 * cos_o - cos * sin_o).clamp(-1.0, 1.0);
        let cos_theta = safe_sqrt(1.0 - sqr(sin_theta));

        let turn = if p == ORDERS {
            TAU * u_phi
        } else {
            let cdf = 0.5 + self.mass * (u_phi - 0.5);
            Self::turn(&view, p) - self.scale * ln(1.0 / cdf - 1.0)
        };
        let phi = view.phi + turn;
        let wi = Vec3::new(sin_theta, cos_theta * sin_cos(phi).1, cos_theta * sin(phi)).try_normalize()?;
        if wi.z == 0.0 || !in_part(wo, wi, part) {
            return None;
        }
        let (value, pdf) = self.sum(&view, wi);
        let side = if wo.z * wi.z > 0.0 { Lobes::REFLECTION } else { Lobes::TRANSMISSION };
        (pdf > 0.0 && pdf.is_finite()).then(|| LobeSample {
            wi,
            weight: value / pdf,
            pdf,
            flags: side | Lobes::GLOSSY,
            eta: 1.0,
            pdf_is_proportional: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longitudinal_part_is_normalised() {
        for v in [6e-5f32, 0.003, 0.09, 0.4, 4.0] {
            for theta_o in [0.0f32, 0.6, -1.4] {
                let (sin_o, cos_o) = sin_cos(theta_o);
                let n = 40_000;
                let sum: f64 = (0..n)
                    .map(|i| {
                        let theta = PI * ((i as f32 + 0.5) / n as f32 - 0.5);
                        let (s, c) = sin_cos(theta);
                        f64::from(longitudinal_density(s, c, sin_o, cos_o, v) * c * PI) / f64::from(n)
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 2e-4, "variance {v}, theta {theta_o}: {sum}");
            }
        }
    }

    #[test]
    fn bessel_function_has_its_known_values() {
        // I_0(1) = 1.266065878, I_0(5) = 27.23987182, I_0(20) = 4.355828256e7.
        for (x, i0) in [(0.0f32, 1.0f64), (1.0, 1.266_065_878), (5.0, 27.239_871_82), (20.0, 4.355_828_256e7)] {
            let expected = i0 * f64::from(-x).exp();
            assert!((f64::from(scaled_bessel_i0(x)) / expected - 1.0).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn colour_and_absorption_are_inverse_in_order() {
        let s = Hair::absorption_of_reflectance(Lanes([0.1, 0.4, 0.8, 1.0]), 0.3);
        assert!(s[0] > s[1] && s[1] > s[2] && s[3] == 0.0);
        assert!(Hair::absorption_of_reflectance(Lanes::ZERO, 0.3).is_finite());
    }
}
