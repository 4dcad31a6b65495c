//! Maps between the whole square and the whole sphere: equal-area octahedral (Clarberg, "Fast equal-area mapping of the
//! (hemi)sphere using SIMD", 2008), as environment maps use it, and latitude-longitude.

use super::disk::turn;
use steradian_math::{FRAC_PI_2, FRAC_PI_4, INV_4PI, PI, TAU, Vec3, acos, atan, safe_sqrt, sin_cos};

/// Direction of a point of the unit square under the equal-area octahedral map; the centre is `+z`, the corners are `-z`.
#[inline(always)]
pub fn square_to_octahedral(p: [f32; 2]) -> Vec3 {
    let (u, v) = (2.0 * p[0] - 1.0, 2.0 * p[1] - 1.0);
    let (au, av) = (u.abs(), v.abs());
    // Signed distance from the diagonal that is the equator.
    let distance = 1.0 - (au + av);
    let r = 1.0 - distance.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((av - au) / r + 1.0) * FRAC_PI_4 };
    let z = (1.0 - r * r).copysign(distance);
    let (sin_phi, cos_phi) = sin_cos(phi);
    let s = r * safe_sqrt(2.0 - r * r);
    Vec3::new((s * cos_phi).copysign(u), (s * sin_phi).copysign(v), z)
}

/// Density of [`square_to_octahedral`] per solid angle: the map preserves area.
#[inline]
pub fn square_to_octahedral_pdf(_w: Vec3) -> f32 {
    INV_4PI
}

/// Inverse of [`square_to_octahedral`]; `w` has unit length.
#[inline(always)]
pub fn octahedral_to_square(w: Vec3) -> [f32; 2] {
    let (x, y) = (w.x.abs(), w.y.abs());
    let r = safe_sqrt(1.0 - w.z.abs());
    let (large, small) = if x > y { (x, y) } else { (y, x) };
    let mut phi = if large == 0.0 { 0.0 } else { atan(small / large) / FRAC_PI_2 };
    if x < y {
        phi = 1.0 - phi;
    }
    let mut v = phi * r;
    let mut u = r - v;
    if w.z < 0.0 {
        // The southern triangle is the northern one mirrored at the diagonal.
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [0.5 * (u.copysign(w.x) + 1.0), 0.5 * (v.copysign(w.y) + 1.0)]
}

/// Brings a point a little outside the square to the place that continues the sphere across the edge (for filtering).
#[inline]
pub fn wrap_octahedral(mut p: [f32; 2]) -> [f32; 2] {
    for axis in 0..2 {
        if p[axis] < 0.0 {
            p[axis] = -p[axis];
            p[1 - axis] = 1.0 - p[1 - axis];
        } else if p[axis] > 1.0 {
            p[axis] = 2.0 - p[axis];
            p[1 - axis] = 1.0 - p[1 - axis];
        }
    }
    p
}

/// Direction of a latitude-longitude map: `p[0]` is the fraction of the turn around `z`, `p[1]` the polar angle over pi.
#[inline]
pub fn square_to_lat_long(p: [f32; 2]) -> Vec3 {
    let (sin_theta, cos_theta) = sin_cos(PI * p[1]);
    let (sin_phi, cos_phi) = sin_cos(TAU * p[0]);
    Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// Density of [`square_to_lat_long`] per solid angle: not uniform, infinite at the poles.
#[inline]
pub fn square_to_lat_long_pdf(w: Vec3) -> f32 {
    let sin_theta = safe_sqrt(w.x * w.x + w.y * w.y);
    1.0 / (2.0 * PI * PI * sin_theta)
}

/// Inverse of [`square_to_lat_long`].
#[inline]
pub fn lat_long_to_square(w: Vec3) -> [f32; 2] {
    // Close to the poles acos is useless; the sine is exact there.
    let s = safe_sqrt(w.x * w.x + w.y * w.y);
    let theta = if s < 0.5 {
        let small = steradian_math::asin(s);
        if w.z > 0.0 { small } else { PI - small }
    } else {
        acos(w.z.clamp(-1.0, 1.0))
    };
    [turn([w.x, w.y]), theta / PI]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_points_are_neighbours_on_the_sphere() {
        for k in 1..20 {
            let t = k as f32 / 20.0;
            for (inside, outside) in [([0.001, t], [-0.001, t]), ([t, 0.999], [t, 1.001])] {
                let d = square_to_octahedral(inside) - square_to_octahedral(wrap_octahedral(outside));
                assert!(d.length() < 0.02, "{inside:?} and {outside:?} are {} apart", d.length());
            }
        }
    }

    #[test]
    fn lat_long_density_is_the_inverse_sine() {
        let w = square_to_lat_long([0.3, 0.25]);
        assert!((square_to_lat_long_pdf(w) - 1.0 / (2.0 * PI * PI * steradian_math::sin(FRAC_PI_4))).abs() < 1e-5);
    }
}
