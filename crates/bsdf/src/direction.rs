//! Directions in the local frame: hemispheres, mirror and refracted directions.

use steradian_math::Vec3;

/// Whether both directions lie on the same side of the surface; the tangent plane belongs to neither.
#[inline(always)]
pub fn same_hemisphere(a: Vec3, b: Vec3) -> bool {
    a.z * b.z > 0.0
}

/// Mirror image of `wo` about the local normal `+z`.
#[inline(always)]
pub fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

/// Mirror image of `wo` about the unit vector `n`.
#[inline(always)]
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * wo.dot(n)) - wo
}

/// Direction refracted at a surface with unit normal `n`, and the index on its side relative to the side of `w`.
///
/// `eta` is the index below `n` over the index above it; `w` may come from either side. `None` under total reflection.
#[inline]
pub fn refract(w: Vec3, mut n: Vec3, mut eta: f32) -> Option<(Vec3, f32)> {
    let mut cos_i = n.dot(w);
    if cos_i < 0.0 {
        eta = 1.0 / eta;
        cos_i = -cos_i;
        n = -n;
    }
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((n * (cos_i / eta - cos_t) - w / eta, eta))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refraction_obeys_snell_and_is_reversible() {
        let n = Vec3::new(0.0, 0.0, 1.0);
        for k in 0..20 {
            let w = Vec3::spherical((k as f32 / 20.0).sqrt(), (1.0 - k as f32 / 20.0).sqrt(), 0.7);
            let (t, eta) = refract(w, n, 1.5).unwrap();
            assert!(t.z < 0.0 && eta == 1.5 && (t.length() - 1.0).abs() < 1e-5);
            assert!((t.x + w.x / 1.5).abs() < 1e-6 && (t.y + w.y / 1.5).abs() < 1e-6);
            let (back, eta) = refract(t, n, 1.5).unwrap();
            assert!((back - w).length() < 1e-4 && (eta * 1.5 - 1.0).abs() < 1e-6);
        }
        assert!(refract(Vec3::new(0.8, 0.0, -0.6), n, 1.5).is_none());
        assert_eq!(reflect(Vec3::new(0.6, 0.0, 0.8), n), mirror(Vec3::new(0.6, 0.0, 0.8)));
    }
}
