//! Orthonormal frames: the local coordinates in which lobes are written, with z along the normal.

use crate::{Normal3, Vec3};

/// An orthonormal, right-handed basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// The normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around a unit vector, continuous except at `z.z = -0` (Duff et al. 2017).
    #[inline(always)]
    pub fn from_z(z: impl Into<Vec3>) -> Self {
        let z = z.into();
        let sign = 1.0f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * (z.x * z.x) * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + (z.y * z.y) * a, -z.y),
            z,
        }
    }

    /// A frame with unit `z` and its x axis as near to `x` as orthogonality allows; any tangent if `x` is parallel to `z`.
    #[inline]
    pub fn from_xz(x: Vec3, z: impl Into<Vec3>) -> Self {
        let z = z.into();
        let t = x - z * z.dot(x);
        let l = t.length_squared();
        if l > 1e-10 * x.length_squared() && l.is_finite() {
            let x = (t - z * z.dot(t)) * (1.0 / l.sqrt());
            Self { x, y: z.cross(x), z }
        } else {
            Self::from_z(z)
        }
    }

    /// World to local coordinates.
    #[inline(always)]
    pub fn to_local(&self, v: impl Into<Vec3>) -> Vec3 {
        let v = v.into();
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// Local to world coordinates.
    #[inline(always)]
    pub fn from_local(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The z axis as a normal.
    #[inline]
    pub fn normal(&self) -> Normal3 {
        self.z.to_normal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, -0.8, 0.1), (-0.2, 0.1, -0.999)] {
            let n = Vec3::new(x, y, z).normalize();
            for f in [Frame::from_z(n), Frame::from_xz(Vec3::new(0.2, 0.7, 0.4), n), Frame::from_xz(n, n)] {
                assert!((f.x.cross(f.y) - f.z).length() < 1e-6);
                assert!((f.x.length() - 1.0).abs() < 1e-6 && f.x.dot(f.y).abs() < 1e-6);
                let v = Vec3::new(0.1, 0.2, -0.7);
                assert!((f.from_local(f.to_local(v)) - v).length() < 1e-6);
            }
        }
    }
}
