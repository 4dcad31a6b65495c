//! Sheen: fibres that stand up, as an inverted microfacet distribution (Estevez and Kulla 2017, "Production friendly
//! microfacet sheen BRDF") with the visibility of Ashikhmin and Premoze (2007).

use steradian_math::{INV_2PI, Vec3, powf, safe_sqrt};

/// The scattering function of white sheen, for two directions of one side.
#[inline]
pub(super) fn value(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    let Some(wm) = (wo + wi).try_normalize() else { return 0.0 };
    let sin = safe_sqrt(1.0 - wm.z * wm.z);
    let exponent = 1.0 / alpha;
    let density = (2.0 + exponent) * powf(sin, exponent) * INV_2PI;
    let (o, i) = (wo.z.abs(), wi.z.abs());
    density / (4.0 * (o + i - o * i))
}
