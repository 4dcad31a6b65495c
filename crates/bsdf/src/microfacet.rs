//! The Trowbridge-Reitz (GGX) microfacet distribution, anisotropic, with Smith masking (Walter et al. 2007; Heitz 2014) and
//! visible normals sampled by spherical caps (Dupuy and Benyoub 2023).

use steradian_math::{INV_PI, TAU, Vec3, safe_sqrt, sin_cos, sqr};

/// Below this roughness a surface counts as smooth, and its lobe as Dirac.
const SMOOTH_BELOW: f32 = 1e-3;

/// Distribution of microfacet normals around `+z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrowbridgeReitz {
    alpha_x: f32,
    alpha_y: f32,
}

impl TrowbridgeReitz {
    /// Roughness along x and y; negative and NaN values count as zero.
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        let (alpha_x, alpha_y) = (alpha_x.max(0.0), alpha_y.max(0.0));
        let smooth = alpha_x.max(alpha_y) < SMOOTH_BELOW;
        // If one direction is rough the other one must not be a Dirac, for the density would not be finite.
        let floor = if smooth { 0.0 } else { 1e-4 };
        Self { alpha_x: alpha_x.max(floor), alpha_y: alpha_y.max(floor) }
    }

    /// A perfectly smooth surface.
    #[inline]
    pub const fn smooth() -> Self {
        Self { alpha_x: 0.0, alpha_y: 0.0 }
    }

    /// The alpha of a user's roughness in `[0, 1]`: its square root, as in pbrt-v4.
    #[inline]
    pub fn roughness_to_alpha(roughness: f32) -> f32 {
        safe_sqrt(roughness)
    }

    /// Roughness along x and y.
    #[inline]
    pub fn alpha(&self) -> [f32; 2] {
        [self.alpha_x, self.alpha_y]
    }

    /// Whether the surface is so smooth that it is treated as a mirror.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.alpha_x.max(self.alpha_y) < SMOOTH_BELOW
    }

    /// Area density of microfacets with normal `wm` per area of surface; `wm` may point to either side.
    #[inline(always)]
    pub fn normals(&self, wm: Vec3) -> f32 {
        let e = sqr(wm.x / self.alpha_x) + sqr(wm.y / self.alpha_y) + sqr(wm.z);
        INV_PI / (self.alpha_x * self.alpha_y * e * e)
    }

    /// Ratio of invisible to visible area seen from `w` (Smith's auxiliary function).
    #[inline(always)]
    pub fn lambda(&self, w: Vec3) -> f32 {
        let a2_tan2 = (sqr(self.alpha_x * w.x) + sqr(self.alpha_y * w.y)) / sqr(w.z);
        // (sqrt(1 + t) - 1) / 2 without cancellation
        let lambda = 0.5 * a2_tan2 / ((1.0 + a2_tan2).sqrt() + 1.0);
        if w.z == 0.0 { f32::INFINITY } else { lambda }
    }

    /// Fraction of the microfacets seen from `w` that are not masked.
    #[inline(always)]
    pub fn masking(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Fraction visible from both directions, height-correlated.
    #[inline(always)]
    pub fn masking_shadowing(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// Density per solid angle of the normals visible from `w`; what [`Self::sample_visible_normal`] has.
    #[inline]
    pub fn visible_normals(&self, w: Vec3, wm: Vec3) -> f32 {
        if w.z == 0.0 {
            return 0.0;
        }
        self.masking(w) / w.z.abs() * self.normals(wm) * w.abs_dot(wm)
    }

    /// A normal in the upper hemisphere, visible from `w` (or from `-w` if that is the one above).
    #[inline(always)]
    pub fn sample_visible_normal(&self, w: Vec3, u: [f32; 2]) -> Vec3 {
        let side = if w.z < 0.0 { -1.0 } else { 1.0 };
        // Stretched so that the surface is a unit hemisphere of mirrors.
        let stretched = Vec3::new(self.alpha_x * w.x * side, self.alpha_y * w.y * side, w.z.abs()).normalize();
        // Reflections off that hemisphere fill the cap z >= -stretched.z uniformly; the normal is the half vector.
        let half_z = (1.0 - u[0]) * (1.0 + stretched.z);
        let cap_z = half_z - stretched.z;
        let sin_theta = safe_sqrt(1.0 - cap_z * cap_z);
        let (sin_phi, cos_phi) = sin_cos(TAU * u[1]);
        Vec3::new(
            self.alpha_x * (sin_theta * cos_phi + stretched.x),
            self.alpha_y * (sin_theta * sin_phi + stretched.y),
            half_z.max(1e-6),
        )
        .normalize()
    }

    /// Roughens to an alpha of 0.1 to 0.3, as pbrt-v4 does.
    pub fn regularize(&mut self) {
        for alpha in [&mut self.alpha_x, &mut self.alpha_y] {
            if *alpha < 0.3 {
                *alpha = (2.0 * *alpha).clamp(0.1, 0.3);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::PI;

    /// Integral over the upper hemisphere by the midpoint rule in (cos^2, phi), dense near the pole.
    fn integrate(f: impl Fn(Vec3) -> f32) -> f64 {
        let (nt, np) = (2000, 64);
        let mut sum = 0.0f64;
        for i in 0..nt {
            // theta = pi/2 t^2 puts the points where the density is
            let t = (i as f32 + 0.5) / nt as f32;
            let theta = 0.5 * PI * t * t;
            let (sin, cos) = sin_cos(theta);
            for j in 0..np {
                let w = Vec3::spherical(sin, cos, TAU * (j as f32 + 0.5) / np as f32);
                sum += f64::from(f(w) * sin * PI * t * TAU) / f64::from(nt * np);
            }
        }
        sum
    }

    #[test]
    fn projected_area_of_all_normals_is_one() {
        for (ax, ay) in [(0.05, 0.05), (0.1, 0.4), (0.5, 0.5), (1.0, 0.3)] {
            let d = TrowbridgeReitz::new(ax, ay);
            let area = integrate(|wm| d.normals(wm) * wm.z);
            assert!((area - 1.0).abs() < 2e-3, "alpha {ax}, {ay}: {area}");
        }
    }

    #[test]
    fn visible_normals_are_normalised() {
        for (ax, ay) in [(0.1, 0.1), (0.3, 0.6), (0.8, 0.2)] {
            let d = TrowbridgeReitz::new(ax, ay);
            for cos in [0.1f32, 0.5, 1.0] {
                let w = Vec3::spherical((1.0 - cos * cos).sqrt(), cos, 0.4);
                let total = integrate(|wm| if w.dot(wm) > 0.0 { d.visible_normals(w, wm) } else { 0.0 });
                assert!((total - 1.0).abs() < 5e-3, "alpha {ax}, {ay}, cos {cos}: {total}");
            }
        }
    }

    #[test]
    fn smoothness_and_regularisation() {
        assert!(TrowbridgeReitz::new(0.0009, 0.0).is_smooth());
        assert!(!TrowbridgeReitz::new(0.5, 0.0).is_smooth());
        assert_eq!(TrowbridgeReitz::new(0.5, 0.0).alpha(), [0.5, 1e-4]);
        let mut d = TrowbridgeReitz::smooth();
        d.regularize();
        assert_eq!(d.alpha(), [0.1, 0.1]);
        assert_eq!(TrowbridgeReitz::roughness_to_alpha(0.25), 0.5);
    }
}
