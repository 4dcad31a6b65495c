//! Triangles: watertight intersection (Woop, Benthin and Wald 2013; PBRT 4th ed., 6.5.3 and 6.8.7).

use steradian_math::{Bounds3, Point3, Ray, Vec3, gamma};

/// A triangle by its vertices, in counter-clockwise order seen from the side the normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The vertices.
    pub p: [Point3; 3],
}

/// Where a ray meets a triangle: `p = (1 - b1 - b2) p0 + b1 p1 + b2 p2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of the second vertex.
    pub b1: f32,
    /// Barycentric coordinate of the third vertex.
    pub b2: f32,
}

/// What the triangle test needs of a ray: the axis along which it runs fastest (last of `axes`), and the shear that
/// makes it run along that axis alone.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    pub(crate) axes: [usize; 3],
    /// Origin, in the order of `axes`.
    pub(crate) o: [f32; 3],
    /// Shear along the first two axes, scale along the third.
    pub(crate) s: [f32; 3],
}

/// The order of axes for each fastest one.
pub(crate) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl ShearedRay {
    /// Prepares a ray; its direction must not be null.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let (major, shear) = Self::shear(ray.d);
        let o = ray.o.to_array();
        let axes = AXES[major as usize % 3];
        Self { axes, o: axes.map(|k| o[k]), s: shear.to_array() }
    }

    /// The axis along which a direction runs fastest, and the shear. Without branches, so that loops over rows can be vectors.
    #[inline(always)]
    pub(crate) fn shear(d: Vec3) -> (u32, Vec3) {
        let a = d.abs();
        let x = (a.x > a.y) & (a.x > a.z);
        let major = if x { 0 } else { 2 - u32::from(a.y > a.z) };
        let d = Self::turned(major, d);
        (major, Vec3::new(-d.x / d.z, -d.y / d.z, 1.0 / d.z))
    }

    /// A triple in the order of [`AXES`].
    #[inline(always)]
    pub(crate) fn turned(major: u32, v: Vec3) -> Vec3 {
        let [x, y] = [major == 0, major == 1];
        let pick = |of_x: f32, of_y: f32, of_z: f32| {
            let rest = if y { of_y } else { of_z };
            if x { of_x } else { rest }
        };
        Vec3::new(pick(v.y, v.z, v.x), pick(v.z, v.x, v.y), pick(v.x, v.y, v.z))
    }
}

/// The edge functions in double precision, for rays that pass through an edge or a vertex as `f32` sees it.
pub(crate) fn edges_f64(x: [f32; 3], y: [f32; 3]) -> [f32; 3] {
    let (x, y) = (x.map(f64::from), y.map(f64::from));
    let edge = |i: usize, j: usize| (x[i] * y[j] - y[i] * x[j]) as f32;
    [edge(1, 2), edge(2, 0), edge(0, 1)]
}

impl Triangle {
    /// A triangle of three vertices.
    pub const fn new(p0: Point3, p1: Point3, p2: Point3) -> Self {
        Self { p: [p0, p1, p2] }
    }

    /// The box around the vertices.
    #[inline]
    pub fn bounds(&self) -> Bounds3 {
        let [a, b, c] = self.p;
        Bounds3 { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    /// Whether the triangle has no area to speak of: no ray meets it.
    #[inline]
    pub fn is_degenerate(&self) -> bool {
        (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]).length_squared() == 0.0
    }

    /// The nearest hit with `0 < t <= t_max`, by scalar arithmetic: bit for bit what blocks of triangles give.
    ///
    /// A ray through a shared edge or vertex never slips between triangles. `t` exceeds the bound on its own rounding
    /// error, so that a ray that starts on the triangle does not meet it again.
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<TriangleHit> {
        if self.is_degenerate() {
            return None;
        }
        self.intersect_sheared(&ShearedRay::new(ray), t_max)
    }

    pub(crate) fn intersect_sheared(&self, r: &ShearedRay, t_max: f32) -> Option<TriangleHit> {
        let relative = |axis: usize| self.p.map(|p| p[r.axes[axis]] - r.o[axis]);
        let z = relative(2);
        let (mut x, mut y) = (relative(0), relative(1));
        for i in 0..3 {
            x[i] += r.s[0] * z[i];
            y[i] += r.s[1] * z[i];
        }
        let edge = |i: usize, j: usize| x[i] * y[j] - y[i] * x[j];
        let mut e = [edge(1, 2), edge(2, 0), edge(0, 1)];
        let inside = |e: [f32; 3]| e.iter().all(|&e| e >= 0.0) || e.iter().all(|&e| e <= 0.0);
        if !inside(e) {
            return None;
        }
        if e.contains(&0.0) {
            e = edges_f64(x, y);
            if !inside(e) {
                return None;
            }
        }
        let det = (e[0] + e[1]) + e[2];
        if det == 0.0 {
            return None;
        }
        let z = z.map(|z| z * r.s[2]);
        let inv_det = 1.0 / det;
        let t = ((e[0] * z[0] + e[1] * z[1]) + e[2] * z[2]) * inv_det;
        let max_abs = |v: [f32; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let (max_x, max_y, max_z, max_e) = (max_abs(x), max_abs(y), max_abs(z), max_abs(e));
        let delta_z = gamma(3) * max_z;
        let delta_x = gamma(5) * (max_x + max_z);
        let delta_y = gamma(5) * (max_y + max_z);
        let delta_e = 2.0 * ((gamma(2) * max_x * max_y + delta_y * max_x) + delta_x * max_y);
        let delta_t = 3.0 * ((gamma(3) * max_e * max_z + delta_e * max_z) + delta_z * max_e) * inv_det.abs();
        (t > delta_t && t <= t_max && t < f32::INFINITY).then_some(TriangleHit {
            t,
            b1: e[1] * inv_det,
            b2: e[2] * inv_det,
        })
    }
}
