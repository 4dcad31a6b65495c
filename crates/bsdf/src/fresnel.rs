//! Fresnel equations for unpolarised light at dielectrics and conductors (Born and Wolf; Pharr, Jakob and Humphreys, section 9.3).

use steradian_math::{safe_sqrt, sqr};
use steradian_spectrum::Lanes;

/// Reflectance of a dielectric. `eta` is the index below the normal over the index above; `cos_i` is negative from below.
#[inline]
pub fn fresnel_dielectric(cos_i: f32, mut eta: f32) -> f32 {
    let mut cos_i = cos_i.clamp(-1.0, 1.0);
    if cos_i < 0.0 {
        eta = 1.0 / eta;
        cos_i = -cos_i;
    }
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = safe_sqrt(1.0 - sin2_t);
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (sqr(parallel) + sqr(perpendicular))
}

/// Reflectance of a conductor with complex index `eta + i k` relative to the outside; `cos_i` is clamped to `[0, 1]`.
#[inline(always)]
pub fn fresnel_conductor(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    let difference = eta * eta - k * k - sin2;
    // NaN stays NaN.
    let root = |x: f32| {
        let root = x.sqrt();
        if x <= 0.0 { 0.0 } else { root }
    };
    // With cos_t' = a + i b (scaled by the index): a^2 + b^2 and a.
    let a2_plus_b2 = root(difference * difference + 4.0 * eta * eta * k * k);
    let a = root(0.5 * (a2_plus_b2 + difference));
    let sum = a2_plus_b2 + cos2;
    let cross = 2.0 * cos_i * a;
    let perpendicular = (sum - cross) / (sum + cross);
    let sum = cos2 * a2_plus_b2 + sin2 * sin2;
    let cross = cross * sin2;
    // Grazing light on an index of one makes this 0/0 in the limit only; the sums are positive for every real metal.
    let ratio = (sum - cross) / (sum + cross);
    let parallel = perpendicular * if sum + cross > 0.0 { ratio } else { 1.0 };
    0.5 * (perpendicular + parallel)
}

/// [`fresnel_conductor`] lane by lane.
#[inline(always)]
pub fn fresnel_conductor_lanes(cos_i: f32, eta: Lanes, k: Lanes) -> Lanes {
    eta.zip(
        k,
        #[inline(always)]
        |eta, k| fresnel_conductor(cos_i, eta, k),
    )
}

/// The `k` for which a conductor with `eta = 1` reflects `reflectance` at normal incidence: `2 sqrt(r / (1 - r))`.
///
/// pbrt-v4's reading of a conductor given by reflectance; the reflectance is clamped to `[0, 0.9999]`.
#[inline]
pub fn index_of_reflectance(reflectance: Lanes) -> (Lanes, Lanes) {
    let k = reflectance.map(|r| {
        let r = r.clamp(0.0, 0.9999);
        2.0 * r.sqrt() / (1.0 - r).sqrt()
    });
    (Lanes::ONE, k)
}

/// Half of the mean reflectance of diffuse light, `int_0^1 F(cos) cos dcos`, for the index of the side it goes to over the
/// one it comes from, inverted: a fit by d'Eon and Irving (2011).
pub(crate) fn fresnel_moment_1(eta: f32) -> f32 {
    let horner = |c: [f32; 6]| c.iter().rev().fold(0.0, |sum, c| sum * eta + c);
    if eta < 1.0 {
        horner([0.459_66, -1.739_65, 3.376_68, -3.904_945, 2.492_77, -0.684_41])
    } else {
        horner([-4.616_86, 11.113_6, -10.464_6, 5.114_55, -1.271_98, 0.127_46])
    }
}

/// The second moment `int_0^1 F(cos) cos^2 dcos`; see [`fresnel_moment_1`].
pub(crate) fn fresnel_moment_2(eta: f32) -> f32 {
    let horner = |c: &[f32], x: f32| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
    if eta < 1.0 {
        horner(&[0.276_14, -0.873_5, 1.120_77, -0.650_95, 0.078_83, 0.048_6], eta)
    } else {
        horner(&[-547.033, 404.557, -189.519, 54.932_7, -9.006_03, 0.639_42], eta)
            + horner(&[0.0, 458.843, -218.725, 45.308_7], 1.0 / eta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_and_grazing_have_closed_values() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert!((fresnel_dielectric(-1.0, 1.5) - 0.04).abs() < 1e-7);
        assert!((fresnel_dielectric(0.0, 1.5) - 1.0).abs() < 1e-6);
        assert!(fresnel_dielectric(0.3, 1.0) < 1e-12);
        // Beyond the critical angle.
        assert_eq!(fresnel_dielectric(-0.5, 1.5), 1.0);
        let normal = |n: f32, k: f32| (sqr(n - 1.0) + k * k) / (sqr(n + 1.0) + k * k);
        for (n, k) in [(0.2f32, 3.9f32), (1.1, 2.5), (3.0, 3.3)] {
            assert!((fresnel_conductor(1.0, n, k) - normal(n, k)).abs() < 1e-5);
            assert!((fresnel_conductor(0.0, n, k) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn brewster_angle_has_no_parallel_reflection() {
        // At tan = eta only the perpendicular part is left, ((eta^2 - 1) / (eta^2 + 1))^2.
        let cos = 1.0 / (1.0f32 + 2.25).sqrt();
        assert!((fresnel_dielectric(cos, 1.5) - 0.5 * sqr(1.25 / 3.25)).abs() < 1e-6);
    }

    #[test]
    fn conductor_without_absorption_is_a_dielectric() {
        for i in 1..=50 {
            let cos = i as f32 / 50.0;
            assert!((fresnel_conductor(cos, 1.5, 0.0) - fresnel_dielectric(cos, 1.5)).abs() < 1e-5);
        }
    }

    #[test]
    fn index_of_reflectance_gives_the_reflectance_back() {
        let r = Lanes([0.0, 0.3, 0.9, 0.99]);
        let (eta, k) = index_of_reflectance(r);
        let back = fresnel_conductor_lanes(1.0, eta, k);
        for i in 0..4 {
            assert!((back[i] - r[i]).abs() < 1e-4);
        }
    }
}
