//! The Beckmann distribution: microfacets of a surface whose slopes are normally distributed (Beckmann and Spizzichino 1963), with
//! Smith masking (Walter et al. 2007) and visible normals sampled by numerical inversion (Heitz and d'Eon 2014; Jakob 2014).

use steradian_math::{INV_PI, TAU, Vec3, erf, erf_inv, exp, ln, safe_sqrt, sin_cos, sqr};

/// `1 / sqrt(pi)`.
const INV_SQRT_PI: f32 = 0.564_189_6;

/// Distribution of microfacet normals around `+z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    alpha_x: f32,
    alpha_y: f32,
}

impl Beckmann {
    /// Root mean square slopes along x and y, times the square root of two; at least 1e-4.
    #[inline(never)]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        Self { alpha_x: alpha_x.max(1e-4), alpha_y: alpha_y.max(1e-4) }
    }

    /// Roughness along x and y.
    #[inline(never)]
    pub fn alpha(&self) -> [f32; 2] {
        [self.alpha_x, self.alpha_y]
    }

    /// Area density of microfacets with normal `wm` per area of surface; `wm` may point to either side.
    #[inline(never)]
    pub fn normals(&self, wm: Vec3) -> f32 {
        let cos2 = sqr(wm.z);
        if cos2 < 1e-10 {
            return 0.0;
        }
        let tan2 = (sqr(wm.x / self.alpha_x) + sqr(wm.y / self.alpha_y)) / cos2;
        exp(-tan2) * INV_PI / (self.alpha_x * self.alpha_y * sqr(cos2))
    }

    /// Ratio of invisible to visible area seen from `w` (Smith's auxiliary function).
    #[inline(never)]
    pub fn lambda(&self, w: Vec3) -> f32 {
        let tangential = sqr(self.alpha_x * w.x) + sqr(self.alpha_y * w.y);
        if tangential == 0.0 {
            return 0.0;
        }
        let a = w.z.abs() / tangential.sqrt();
        if a > 4.0 {
            return 0.0;
        }
        (0.5 * (erf(a) - 1.0) + 0.5 * INV_SQRT_PI * exp(-a * a) / a).max(0.0)
    }

    /// A normal in the upper hemisphere, visible from `w` (or from `-w` if that is the one above).
    pub fn sample_visible_normal(&self, w: Vec3, u: [f32; 2]) -> Vec3 {
        let side = if w.z < 0.0 { -1.0 } else { 1.0 };
        let stretched = Vec3::new(self.alpha_x * w.x * side, self.alpha_y * w.y * side, w.z.abs()).normalize();
        let sin_theta = (sqr(stretched.x) + sqr(stretched.y)).sqrt();
        let (x, y) = if sin_theta < 1e-4 {
            let r = safe_sqrt(-ln((1.0 - u[0]).max(1e-7)));
            let (sin, cos) = sin_cos(TAU * u[1]);
            (r * cos, r * sin)
        } else {
            let (along, across) = (visible_slope(stretched.z / sin_theta, u[0]), erf_inv(inner(2.0 * u[1] - 1.0)));
            let (cos, sin) = (stretched.x / sin_theta, stretched.y / sin_theta);
            (cos * along - sin * across, sin * along + cos * across)
        };
        Vec3::new(-self.alpha_x * x, -self.alpha_y * y, 1.0).normalize()
    }

    /// Roughens to an alpha of 0.1 to 0.3, as other rough surfaces are.
    pub fn regularize(&mut self) {
        for alpha in [&mut self.alpha_x, &mut self.alpha_y] {
            if *alpha < 0.3 {
                *alpha = (2.0 * *alpha).clamp(0.1, 0.3);
            }
        }
    }
}

/// Away from where the inverse error function has its poles.
#[inline]
fn inner(y: f32) -> f32 {
    y.clamp(-0.999_999, 0.999_999)
}

/// The slope along the view whose share `u` of what is visible lies below, for a surface of unit roughness that is seen at an angle of
/// cotangent `cot`. Slopes are found by their error function `b`, in which the shares are nearly linear.
fn visible_slope(cot: f32, u: f32) -> f32 {
    let tan = 1.0 / cot.max(1e-6);
    let share = |b: f32, slope: f32| 1.0 + b + INV_SQRT_PI * tan * exp(-sqr(slope));
    let (mut low, mut high) = (-1.0f32, erf(cot));
    let target = u.clamp(1e-6, 1.0 - 1e-6) * share(high, cot);
    let mut b = 0.5 * (low + high);
    // Newton's steps, and halving where they leave the bracket.
    for _ in 0..12 {
        let slope = erf_inv(inner(b));
        let excess = share(b, slope) - target;
        if excess > 0.0 {
            high = b;
        } else {
            low = b;
        }
        let next = b - excess / (1.0 - slope * tan);
        b = if next > low && next < high { next } else { 0.5 * (low + high) };
    }
    erf_inv(inner(b)).min(cot)
}
