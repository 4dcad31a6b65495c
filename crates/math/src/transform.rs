//! Affine and projective transforms, kept together with their inverses.

use crate::{Bounds3, Normal3, Point3, Ray, RayDifferential, Vec3};

type Matrix = [[f32; 4]; 4];

/// A 4 x 4 matrix (row-major, column vectors) and its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The matrix.
    pub m: Matrix,
    /// Its inverse.
    pub inv: Matrix,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut r = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            let sum: f64 = (0..4).map(|k| f64::from(a[i][k]) * f64::from(b[k][j])).sum();
            r[i][j] = sum as f32;
        }
    }
    r
}

fn transpose(m: &Matrix) -> Matrix {
    let mut r = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            r[i][j] = m[j][i];
        }
    }
    r
}

/// Gauss-Jordan elimination with full pivoting, in double precision; `None` for a singular matrix.
fn invert(m: &Matrix) -> Option<Matrix> {
    let mut a = m.map(|row| row.map(f64::from));
    let mut b = IDENTITY.map(|row| row.map(f64::from));
    for col in 0..4 {
        let pivot = (col..4).max_by(|&i, &j| a[i][col].abs().total_cmp(&a[j][col].abs()))?;
        if a[pivot][col] == 0.0 || !a[pivot][col].is_finite() {
            return None;
        }
        a.swap(col, pivot);
        b.swap(col, pivot);
        let s = 1.0 / a[col][col];
        for j in 0..4 {
            a[col][j] *= s;
            b[col][j] *= s;
        }
        for i in 0..4 {
            if i != col {
                let f = a[i][col];
                for j in 0..4 {
                    a[i][j] -= f * a[col][j];
                    b[i][j] -= f * b[col][j];
                }
            }
        }
    }
    let r = b.map(|row| row.map(|v| v as f32));
    r.iter().flatten().all(|v| v.is_finite()).then_some(r)
}

/// The upper left part of a matrix times a vector.
#[inline(always)]
fn linear(m: &[[f32; 4]; 4], v: Vec3) -> Vec3 {
    Vec3::new(
        m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
        m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
        m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z,
    )
}

impl Transform {
    /// The identity.
    pub const IDENTITY: Self = Self { m: IDENTITY, inv: IDENTITY };

    /// From a matrix; `None` when it is singular or not finite.
    pub fn from_matrix(m: Matrix) -> Option<Self> {
        Some(Self { m, inv: invert(&m)? })
    }

    /// From 16 numbers in column-major order, as scene files write them.
    pub fn from_column_major(v: &[f32; 16]) -> Option<Self> {
        let mut m = [[0.0; 4]; 4];
        for (i, &x) in v.iter().enumerate() {
            m[i % 4][i / 4] = x;
        }
        Self::from_matrix(m)
    }

    /// The inverse transform.
    #[inline]
    pub const fn inverse(&self) -> Self {
        Self { m: self.inv, inv: self.m }
    }

    /// The transform that applies `inner` first and then `self`: the matrix product `self * inner`.
    pub fn mul(&self, inner: &Self) -> Self {
        Self { m: product(&self.m, &inner.m), inv: product(&inner.inv, &self.inv) }
    }

    /// The transform that applies `self` first and then `next`.
    pub fn then(&self, next: &Self) -> Self {
        next.mul(self)
    }

    /// A translation.
    pub fn translate(d: Vec3) -> Self {
        let at = |d: Vec3| [[1.0, 0.0, 0.0, d.x], [0.0, 1.0, 0.0, d.y], [0.0, 0.0, 1.0, d.z], [0.0, 0.0, 0.0, 1.0]];
        Self { m: at(d), inv: at(-d) }
    }

    /// A scaling along the axes; `None` if a factor is zero or not finite.
    pub fn scale(x: f32, y: f32, z: f32) -> Option<Self> {
        let at = |x, y, z| [[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let ok = |v: f32| v.is_finite() && (1.0 / v).is_finite();
        (ok(x) && ok(y) && ok(z)).then(|| Self { m: at(x, y, z), inv: at(1.0 / x, 1.0 / y, 1.0 / z) })
    }

    /// A rotation by `degrees` around `axis`; `None` for a null axis.
    pub fn rotate(degrees: f32, axis: Vec3) -> Option<Self> {
        let a = axis.try_normalize()?;
        // Exact quarter turns matter to people: sine and cosine in double precision.
        let (s, c) = crate::portable::sin_cos_f64(f64::from(degrees).to_radians());
        let (ax, ay, az) = (f64::from(a.x), f64::from(a.y), f64::from(a.z));
        let e = |v: f64| v as f32;
        let m = [
            [e(ax * ax + (1.0 - ax * ax) * c), e(ax * ay * (1.0 - c) - az * s), e(ax * az * (1.0 - c) + ay * s), 0.0],
            [e(ax * ay * (1.0 - c) + az * s), e(ay * ay + (1.0 - ay * ay) * c), e(ay * az * (1.0 - c) - ax * s), 0.0],
            [e(ax * az * (1.0 - c) - ay * s), e(ay * az * (1.0 - c) + ax * s), e(az * az + (1.0 - az * az) * c), 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        Some(Self { m, inv: transpose(&m) })
    }

    /// Camera from world: the camera at `eye` looks along +z at `look`, y up, x to the right (left handed, as in PBRT).
    /// `None` when the points coincide or `up` is parallel to the view direction.
    pub fn look_at(eye: Point3, look: Point3, up: Vec3) -> Option<Self> {
        let dir = (look - eye).try_normalize()?;
        let right = up.try_normalize()?.cross(dir).try_normalize()?;
        let new_up = dir.cross(right);
        let world_from_camera = [
            [right.x, new_up.x, dir.x, eye.x],
            [right.y, new_up.y, dir.y, eye.y],
            [right.z, new_up.z, dir.z, eye.z],
            [0.0, 0.0, 0.0, 1.0],
        ];
        Some(Self::from_matrix(world_from_camera)?.inverse())
    }

    /// A perspective projection of field of view `fov` degrees, mapping depth `near..far` to `0..1`.
    pub fn perspective(fov: f32, near: f32, far: f32) -> Option<Self> {
        let projection = Self::from_matrix([
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, far / (far - near), -far * near / (far - near)],
            [0.0, 0.0, 1.0, 0.0],
        ])?;
        let (sin, cos) = crate::portable::sin_cos_f64(f64::from(fov).to_radians() * 0.5);
        let s = (cos / sin) as f32;
        Some(Self::scale(s, s, 1.0)?.mul(&projection))
    }

    /// An orthographic projection, mapping depth `near..far` to `0..1`.
    pub fn orthographic(near: f32, far: f32) -> Option<Self> {
        Some(Self::scale(1.0, 1.0, 1.0 / (far - near))?.mul(&Self::translate(Vec3::new(0.0, 0.0, -near))))
    }

    /// Applies to a point, with the homogeneous division where the matrix is projective.
    #[inline]
    pub fn point(&self, p: Point3) -> Point3 {
        let m = &self.m;
        let r = Point3::new(
            m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3],
            m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3],
            m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3],
        );
        let w = m[3][0] * p.x + m[3][1] * p.y + m[3][2] * p.z + m[3][3];
        if w == 1.0 { r } else { r / w }
    }

    /// Applies to a point known up to `error`, and returns the point with its new absolute error (affine part only).
    pub fn point_with_error(&self, p: Point3, error: Vec3) -> (Point3, Vec3) {
        let q = self.point(p);
        let m = &self.m;
        let row = |i: usize| {
            let inherited = m[i][0].abs() * error.x + m[i][1].abs() * error.y + m[i][2].abs() * error.z;
            let rounding = (m[i][0] * p.x).abs() + (m[i][1] * p.y).abs() + (m[i][2] * p.z).abs() + m[i][3].abs();
            (crate::gamma(3) + 1.0) * inherited + crate::gamma(4) * rounding
        };
        (q, Vec3::new(row(0), row(1), row(2)))
    }

    /// Applies to a vector.
    #[inline(always)]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        linear(&self.m, v)
    }

    /// Applies the inverse to a vector.
    #[inline(always)]
    pub fn inverse_vector(&self, v: Vec3) -> Vec3 {
        linear(&self.inv, v)
    }

    /// Applies to a normal: the inverse transpose. The length is not kept.
    #[inline]
    pub fn normal(&self, n: Normal3) -> Normal3 {
        let i = &self.inv;
        Normal3::new(
            i[0][0] * n.x + i[1][0] * n.y + i[2][0] * n.z,
            i[0][1] * n.x + i[1][1] * n.y + i[2][1] * n.z,
            i[0][2] * n.x + i[1][2] * n.y + i[2][2] * n.z,
        )
    }

    /// Applies to a ray; the parameter keeps its meaning because the direction is not normalised.
    #[inline]
    pub fn ray(&self, r: &Ray) -> Ray {
        Ray { o: self.point(r.o), d: self.vector(r.d), ..*r }
    }

    /// Applies to the offset rays.
    pub fn differential(&self, d: &RayDifferential) -> RayDifferential {
        RayDifferential {
            rx_o: self.point(d.rx_o),
            ry_o: self.point(d.ry_o),
            rx_d: self.vector(d.rx_d),
            ry_d: self.vector(d.ry_d),
        }
    }

    /// The least box around the transformed box.
    pub fn bounds(&self, b: &Bounds3) -> Bounds3 {
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        (0..8).fold(Bounds3::EMPTY, |r, i| r.union_point(self.point(b.corner(i))))
    }

    /// The determinant of the upper-left 3 x 3 block.
    pub fn determinant3(&self) -> f32 {
        let m = &self.m;
        let minor = |a: f32, b: f32, c: f32, d: f32| crate::difference_of_products(a, d, b, c);
        m[0][0] * minor(m[1][1], m[1][2], m[2][1], m[2][2]) - m[0][1] * minor(m[1][0], m[1][2], m[2][0], m[2][2])
            + m[0][2] * minor(m[1][0], m[1][1], m[2][0], m[2][1])
    }

    /// Whether right-handed frames become left-handed.
    pub fn swaps_handedness(&self) -> bool {
        self.determinant3() < 0.0
    }

    /// Whether lengths are all scaled alike, so that angles stay: up to rounding, the columns of the linear part are
    /// orthogonal and of one length.
    pub fn keeps_angles(&self) -> bool {
        let [x, y, z] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
        let [x, y, z] = [x, y, z].map(|e| self.vector(e));
        let l = x.length_squared();
        let near = |a: f32| a.abs() <= 1e-4 * l;
        near(y.length_squared() - l)
            && near(z.length_squared() - l)
            && near(x.dot(y))
            && near(y.dot(z))
            && near(z.dot(x))
    }

    /// Whether this is exactly the identity.
    pub fn is_identity(&self) -> bool {
        self.m == IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_and_order() {
        let t = Transform::translate(Vec3::new(1.0, 2.0, 3.0));
        let r = Transform::rotate(90.0, Vec3::new(0.0, 0.0, 1.0)).unwrap();
        let s = Transform::scale(2.0, 3.0, -1.0).unwrap();
        let m = t.mul(&r).mul(&s);
        let p = Point3::new(0.5, -1.0, 2.0);
        let q = m.point(p);
        assert!(q.distance(Point3::new(4.0, 3.0, 1.0)) < 1e-6);
        assert!(m.inverse().point(q).distance(p) < 1e-6);
        assert!(m.swaps_handedness() && !r.swaps_handedness());
        let again = Transform::from_matrix(m.m).unwrap();
        for i in 0..4 {
            for j in 0..4 {
                assert!((again.inv[i][j] - m.inv[i][j]).abs() < 1e-6);
            }
        }
        assert!(Transform::scale(1.0, 0.0, 1.0).is_none());
        assert!(Transform::from_matrix([[1.0; 4]; 4]).is_none());
    }

    #[test]
    fn look_at_puts_the_target_on_the_axis() {
        let eye = Point3::new(3.0, 4.0, 5.0);
        let look = Point3::new(0.0, 1.0, 0.0);
        let t = Transform::look_at(eye, look, Vec3::new(0.0, 1.0, 0.0)).unwrap();
        let p = t.point(look);
        assert!(p.x.abs() < 1e-5 && p.y.abs() < 1e-5 && (p.z - eye.distance(look)).abs() < 1e-5);
        assert!(t.point(eye).distance(Point3::default()) < 1e-5);
        assert!(Transform::look_at(eye, eye, Vec3::new(0.0, 1.0, 0.0)).is_none());
    }

    #[test]
    fn normals_stay_perpendicular() {
        let t =
            Transform::scale(1.0, 5.0, 2.0).unwrap().mul(&Transform::rotate(30.0, Vec3::new(1.0, 1.0, 0.0)).unwrap());
        let (u, v) = (Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.0, 0.3, 1.0));
        let n = t.normal(u.cross(v).to_normal());
        assert!(n.dot(t.vector(u)).abs() < 1e-5 && n.dot(t.vector(v)).abs() < 1e-5);
    }
}
