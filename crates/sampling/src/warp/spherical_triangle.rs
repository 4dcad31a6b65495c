//! Uniform directions of a spherical triangle (Arvo, "Stratified sampling of spherical triangles", 1995).

use steradian_math::{PI, Vec3, atan2, difference_of_products, lerp, safe_sqrt, sin_cos, sqr, sum_of_products};

/// Solid angle of the triangle with unit vectors as corners (Van Oosterom and Strackee 1983); exact also when it is tiny.
#[inline(always)]
pub fn spherical_triangle_area(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    // Edge vectors keep the determinant free of cancellation for small triangles.
    let determinant = a.dot((b - a).cross(c - a)).abs();
    2.0 * atan2(determinant, 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// A spherical triangle that is ready to be sampled.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    /// Unit vector in the plane of `a` and `c`, orthogonal to `a`.
    toward_c: Vec3,
    sin_alpha: f32,
    cos_alpha: f32,
    cos_c: f32,
    area: f32,
}

impl SphericalTriangle {
    /// Prepares the triangle whose corners are three unit vectors; `None` if it is degenerate.
    #[inline]
    pub fn new(a: Vec3, b: Vec3, c: Vec3) -> Option<Self> {
        let (triangle, usable) = Self::prepare(a, b, c);
        usable.then_some(triangle)
    }

    /// The same without branches, for loops over many: whether the triangle can be used comes beside it.
    #[inline(always)]
    pub fn prepare(a: Vec3, b: Vec3, c: Vec3) -> (Self, bool) {
        let (toward_b, has_b) = orthogonal(b, a);
        let (toward_c, has_c) = orthogonal(c, a);
        let area = spherical_triangle_area(a, b, c);
        // The angle at `a`, between the planes of the two edges that meet there.
        let cos_alpha = toward_b.dot(toward_c).clamp(-1.0, 1.0);
        let sin_alpha = toward_b.cross(toward_c).length();
        let usable = has_b & has_c & (area > 0.0) & (area < 4.0 * PI) & (sin_alpha > 0.0);
        (Self { a, b, c, toward_c, sin_alpha, cos_alpha, cos_c: a.dot(b), area }, usable)
    }

    /// Solid angle in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> f32 {
        self.area
    }

    /// Density of [`Self::sample`] per solid angle, inside the triangle.
    #[inline(always)]
    pub fn pdf(&self) -> f32 {
        1.0 / self.area
    }

    /// Uniform direction of the triangle.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        // u[0] picks the sub-triangle (a, b, c') of area u[0] * area; c' lies on the edge from a to c.
        let (sin_s, cos_s) = sin_cos(u[0] * self.area);
        // sin and cos of (sub-area - alpha)
        let s = sin_s * self.cos_alpha - cos_s * self.sin_alpha;
        let t = cos_s * self.cos_alpha + sin_s * self.sin_alpha;
        let p = t - self.cos_alpha;
        let q = s + self.sin_alpha * self.cos_c;
        let numerator = difference_of_products(q, t, p, s) * self.cos_alpha - q;
        let denominator = sum_of_products(q, s, p, t) * self.sin_alpha;
        let cos_b = if denominator == 0.0 { 1.0 } else { (numerator / denominator).clamp(-1.0, 1.0) };
        let c_sub = self.a * cos_b + self.toward_c * safe_sqrt(1.0 - sqr(cos_b));
        // u[1] picks the height on the arc from b to c'.
        let (toward, has_height) = orthogonal(c_sub, self.b);
        if !has_height {
            return self.b;
        }
        let one_minus_z = u[1] * half_chord_squared(c_sub, self.b);
        self.b * (1.0 - one_minus_z) + toward * safe_sqrt(one_minus_z * (2.0 - one_minus_z))
    }

    /// The random numbers that make [`Self::sample`] return `w`, a unit vector inside the triangle.
    pub fn invert(&self, w: Vec3) -> [f32; 2] {
        let on_edge = self.b.cross(w).cross(self.c.cross(self.a));
        let Some(mut c_sub) = on_edge.try_normalize() else { return [0.0, 0.0] };
        if c_sub.dot(self.a + self.c) < 0.0 {
            c_sub = -c_sub;
        }
        let height = half_chord_squared(c_sub, self.b);
        let u1 = if height > 0.0 { half_chord_squared(w, self.b) / height } else { 0.0 };
        let u0 = spherical_triangle_area(self.a, self.b, c_sub) / self.area;
        [lerp(u0.clamp(0.0, 1.0), 0.0, 1.0), u1.clamp(0.0, 1.0)]
    }
}

/// `1 - cos` of the angle between two unit vectors, without cancellation.
#[inline(always)]
fn half_chord_squared(v: Vec3, w: Vec3) -> f32 {
    0.5 * (v - w).length_squared()
}

/// The part of `v` orthogonal to the unit vector `w`, normalised, and whether there is one.
#[inline(always)]
fn orthogonal(v: Vec3, w: Vec3) -> (Vec3, bool) {
    // Both have unit length, so subtracting first costs nothing and avoids cancellation when they are close.
    let d = v - w;
    let d = d - w * d.dot(w);
    let l = d.length();
    (d / l, (l > 0.0) & (l < f32::INFINITY))
}
