//! How light spreads under the surface of a translucent half-space: photon beam diffusion with single scattering (Habel,
//! Christensen and Jarosz 2013; d'Eon and Irving 2011), tabulated over albedo and distance as in pbrt-v4.

use crate::fresnel::{fresnel_dielectric, fresnel_moment_1, fresnel_moment_2};
use crate::phase::HenyeyGreenstein;
use steradian_math::{INV_4PI, TAU, exp, ln, safe_sqrt, sqr};
use steradian_sampling::spline::{SplineWeights, invert_spline, sample_spline, spline_integrals, spline_weights};

const ALBEDOS: usize = 100;
const RADII: usize = 64;
/// Depths that each profile is averaged over.
const DEPTHS: usize = 100;

/// Profiles `2 pi r S(r)` of the light that comes out at distance `r` from a pencil beam that goes in, in units of the mean
/// free path, for one phase function and one relative index.
#[derive(Clone, Debug)]
pub struct DiffusionTable {
    albedo: Vec<f32>,
    radius: Vec<f32>,
    /// For each albedo the profile at each radius.
    profile: Vec<f32>,
    /// For each albedo the integral of the profile up to each radius.
    integral: Vec<f32>,
    /// For each albedo the fraction of the light that comes out.
    effective: Vec<f32>,
}

impl DiffusionTable {
    /// Works out the table for a mean cosine `g` in `(-1, 1)` and an index `eta` inside relative to outside, positive.
    pub fn new(g: f32, eta: f32) -> Self {
        let mut radius = vec![0.0, 2.5e-3];
        for i in 2..RADII {
            radius.push(radius[i - 1] * 1.2);
        }
        // Denser towards one, where the profile changes fastest.
        let albedo: Vec<f32> =
            (0..ALBEDOS).map(|i| (1.0 - exp(-8.0 * i as f32 / (ALBEDOS - 1) as f32)) / (1.0 - exp(-8.0))).collect();
        let (mut profile, mut integral, mut effective) = (Vec::new(), Vec::new(), Vec::new());
        let boundary = Boundary::new(eta);
        for &rho in &albedo {
            let row: Vec<f32> = radius
                .iter()
                .map(|&r| TAU * r * (single_scattering(rho, g, eta, r) + boundary.multiple_scattering(rho, g, r)))
                .collect();
            let sums = spline_integrals(&radius, &row);
            effective.push(sums[RADII - 1]);
            profile.extend(row);
            integral.extend(sums);
        }
        Self { albedo, radius, profile, integral, effective }
    }

    /// The single-scattering albedo for which this fraction of the light comes out.
    pub fn albedo_of_reflectance(&self, reflectance: f32) -> f32 {
        invert_spline(&self.albedo, &self.effective, reflectance)
    }

    /// The fraction of the light that comes out for this albedo.
    pub fn reflectance(&self, albedo: f32) -> f32 {
        spline_weights(&self.albedo, albedo).map_or(0.0, |w| blend(&w, |i| self.effective[i]))
    }

    /// `S` at distance `r` mean free paths, per unit area, and the fraction of the light that comes out anywhere.
    #[inline]
    pub fn eval(&self, albedo: f32, r: f32) -> (f32, f32) {
        let (Some(a), Some(b)) = (spline_weights(&self.albedo, albedo), spline_weights(&self.radius, r)) else {
            return (0.0, 0.0);
        };
        let value = blend(&a, |i| blend(&b, |k| self.profile[i * RADII + k]));
        let value = if r > 0.0 { value / (TAU * r) } else { value };
        (value.max(0.0), blend(&a, |i| self.effective[i]))
    }

    /// A distance with density proportional to the profile; `None` where nothing comes out.
    #[inline]
    pub fn sample_radius(&self, albedo: f32, u: f32) -> Option<f32> {
        let a = spline_weights(&self.albedo, albedo)?;
        let of = |table: &[f32], k: usize| blend(&a, |i| table[i * RADII + k]);
        sample_spline(&self.radius, |k| of(&self.profile, k), |k| of(&self.integral, k), u)
    }
}

#[inline]
fn blend(w: &SplineWeights, f: impl Fn(usize) -> f32) -> f32 {
    // Weights of zero stand for nodes that are not there.
    (0..4).filter(|&k| w.weight[k] != 0.0).map(|k| w.weight[k] * f(w.index[k])).sum()
}

/// The place of sample `i` of an exponential distribution, stratified.
fn exponential(i: usize, rate: f32) -> f32 {
    -ln(1.0 - (i as f32 + 0.5) / DEPTHS as f32) / rate
}

/// Light that goes in, is scattered once below the surface, and comes out at distance `r`; extinction is one.
fn single_scattering(rho: f32, g: f32, eta: f32, r: f32) -> f32 {
    // Below the angle of total reflection.
    let shallowest = r * safe_sqrt(sqr(eta) - 1.0);
    let phase = HenyeyGreenstein::new(g);
    let mut sum = 0.0;
    for i in 0..DEPTHS {
        let t = shallowest + exponential(i, 1.0);
        let d = (sqr(r) + sqr(t)).sqrt();
        let cos = t / d;
        sum +=
            rho * exp(-(d + shallowest)) / sqr(d) * phase.of_cosine(cos) * (1.0 - fresnel_dielectric(-cos, eta)) * cos;
    }
    sum / DEPTHS as f32
}

/// What the surface does to diffuse light from inside.
struct Boundary {
    /// Distance of the extrapolated boundary per diffusion coefficient.
    extrapolation: f32,
    /// How fluence and flux come out.
    c_fluence: f32,
    c_flux: f32,
}

impl Boundary {
    fn new(eta: f32) -> Self {
        let (m1, m2) = (fresnel_moment_1(eta), fresnel_moment_2(eta));
        Self {
            extrapolation: -2.0 * (1.0 + 3.0 * m2) / (1.0 - 2.0 * m1),
            c_fluence: 0.25 * (1.0 - 2.0 * m1),
            c_flux: 0.5 * (1.0 - 3.0 * m2),
        }
    }

    /// Light scattered more than once, as diffusion from sources along the beam and their mirror images; extinction is one.
    fn multiple_scattering(&self, rho: f32, g: f32, r: f32) -> f32 {
        let (sigma_a, sigma_s) = (1.0 - rho, rho * (1.0 - g));
        let sigma_t = sigma_a + sigma_s;
        let albedo = sigma_s / sigma_t;
        // Grosjean's diffusion coefficient also holds for low albedo.
        let diffusion = (2.0 * sigma_a + sigma_s) / (3.0 * sqr(sigma_t));
        let sigma_tr = safe_sqrt(sigma_a / diffusion);
        let extrapolated = diffusion * self.extrapolation;
        let mut sum = 0.0;
        for i in 0..DEPTHS {
            let real = exponential(i, sigma_t);
            let image = 2.0 * extrapolated - real;
            let (dr, dv) = ((sqr(r) + sqr(real)).sqrt(), (sqr(r) + sqr(image)).sqrt());
            let (er, ev) = (exp(-sigma_tr * dr), exp(-sigma_tr * dv));
            let fluence = INV_4PI / diffusion * (er / dr - ev / dv);
            let flux = INV_4PI
                * (real * (1.0 + sigma_tr * dr) * er / (dr * dr * dr)
                    - image * (1.0 + sigma_tr * dv) * ev / (dv * dv * dv));
            // Near the source diffusion gives too much; this corrects it empirically.
            let near = 1.0 - exp(-2.0 * sigma_t * (dr + real));
            sum += near * sqr(albedo) * (fluence * self.c_fluence + flux * self.c_flux);
        }
        sum / DEPTHS as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_albedo_lets_more_light_out_but_never_more_than_came_in() {
        let table = DiffusionTable::new(0.0, 1.33);
        assert!(table.effective.windows(2).all(|w| w[0] < w[1]), "{:?}", table.effective);
        assert_eq!(table.effective[0], 0.0);
        // The fits are good to a few percent.
        let white = table.effective[ALBEDOS - 1];
        assert!((0.85..1.02).contains(&white), "{white}");
        for r in [0.05f32, 0.3, 0.7] {
            let albedo = table.albedo_of_reflectance(r);
            assert!((table.reflectance(albedo) - r).abs() < 1e-4);
        }
    }

    #[test]
    fn sampled_distances_follow_the_profile() {
        let table = DiffusionTable::new(0.2, 1.4);
        for albedo in [0.3f32, 0.9, 0.999] {
            let limit = 0.7;
            let (n, mut share, mut integral) = (20_000, 0.0f64, 0.0f64);
            for i in 0..n {
                let u = (i as f32 + 0.5) / n as f32;
                share += f64::from(u8::from(table.sample_radius(albedo, u).unwrap() < limit)) / f64::from(n);
                let r = limit * u;
                let (s, total) = table.eval(albedo, r);
                integral += f64::from(s * TAU * r * limit / total) / f64::from(n);
            }
            assert!((share - integral).abs() < 2e-3, "albedo {albedo}: {share} and {integral}");
        }
        assert!(table.sample_radius(0.0, 0.5).is_none());
    }
}
