//! A thin film on a surface: the colours of soap bubbles (Belcour and Barla 2017, "A practical extension to microfacet
//! theory for the modeling of varying iridescence"), evaluated at each lane's wavelength.

use crate::fresnel::fresnel_dielectric;
use steradian_math::{PI, TAU, cos, exp, safe_sqrt, sqr};
use steradian_spectrum::Lanes;

/// Orders of interference that are summed; what is left out is a fraction of a percent.
const ORDERS: u32 = 4;

/// A film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// How much of the surface it covers, in `[0, 1]`.
    pub factor: f32,
    /// Its index of refraction.
    pub eta: f32,
    /// Its thickness in nanometres.
    pub thickness: f32,
    /// Wavelengths of the lanes in nanometres.
    pub lambda: Lanes,
    /// Half width of the band that a lane stands for, in nanometres; zero for single wavelengths.
    pub width: f32,
}

impl Film {
    /// Reflectance of the film on a base that reflects `f0` at normal incidence, for light that arrives from air.
    pub(super) fn reflectance(&self, cos_i: f32, f0: Lanes) -> Lanes {
        // A film that thins out to nothing must not leave a jump of the index.
        let eta = 1.0 + (self.eta - 1.0) * smooth(self.thickness / 30.0);
        let sin2 = (1.0 - sqr(cos_i)) / sqr(eta);
        if sin2 >= 1.0 {
            return Lanes::ONE;
        }
        let cos_t = safe_sqrt(1.0 - sin2);
        let r12 = fresnel_dielectric(cos_i, eta);
        let through = 1.0 - r12;
        // Light gains half a wave where it is reflected off something denser: from below by the air, and by the base.
        let turned_above = if eta < 1.0 { PI } else { 0.0 };
        let path = 2.0 * eta * self.thickness * cos_t;
        let mut out = Lanes::ZERO;
        for i in 0..4 {
            let root = f0[i].clamp(0.0, 0.9999).sqrt();
            let base = (1.0 + root) / (1.0 - root);
            let normal = sqr((base - eta) / (base + eta));
            let r23 = normal + (1.0 - normal) * fifth(1.0 - cos_t);
            let turned_below = if base > eta { PI } else { 0.0 };
            let both = r12 * r23;
            let between = sqr(through) * r23 / (1.0 - both).max(1e-6);
            let (mut sum, mut amplitude) = (r12 + between, between - through);
            let phase = TAU * path / self.lambda[i] + turned_above + turned_below;
            let blur = TAU * path * self.width / sqr(self.lambda[i]);
            for m in 1..=ORDERS {
                amplitude *= both.sqrt();
                let m = m as f32;
                sum += 2.0 * amplitude * cos(m * phase) * exp(-0.5 * sqr(m * blur));
            }
            out[i] = sum.clamp(0.0, 1.0);
        }
        out
    }

    /// The least `f0` with which Schlick's curve, rising to one, lies nowhere below the reflectance.
    pub(super) fn bound(&self, f0: Lanes, f90: f32) -> Lanes {
        const ANGLES: u32 = 12;
        let mut out = f0;
        for k in 0..ANGLES {
            let c = (k as f32 + 0.5) / ANGLES as f32;
            let rise = fifth(1.0 - c);
            let schlick = f0 * (1.0 - rise) + Lanes::splat(f90 * rise);
            let here = schlick.lerp(self.reflectance(c, f0), self.factor);
            out = out.max(here.map(|r| (r - rise) / (1.0 - rise)));
        }
        // Angles between those that were looked at.
        (out * 1.02).clamp(0.0, 1.0)
    }
}

#[inline]
pub(super) fn fifth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(thickness: f32) -> Film {
        let lambda = Lanes([450.0, 532.0, 580.0, 650.0]);
        Film { factor: 1.0, eta: 1.38, thickness, lambda, width: 0.0 }
    }

    #[test]
    fn a_film_without_thickness_is_not_there() {
        let f0 = Lanes([0.04, 0.2, 0.5, 0.9]);
        let r = film(0.0).reflectance(1.0, f0);
        assert!((0..4).all(|i| (r[i] - f0[i]).abs() < 2e-3), "{r:?}");
    }

    #[test]
    fn a_quarter_wave_film_of_the_root_index_takes_the_reflection_away() {
        // eta = sqrt(1.9044), thickness lambda / 4 eta: the two waves cancel (Rayleigh 1879).
        let f0 = Lanes::splat(sqr(0.9044 / 2.9044));
        let r = film(580.0 / (4.0 * 1.38)).reflectance(1.0, f0);
        assert!(r[2] < 1e-3 && r[0] > 2e-3, "{r:?}");
    }
}
