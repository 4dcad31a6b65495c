//! Points and directions to triangles: by area, and by solid angle (Arvo 1995; PBRT 4th ed., 6.5.4).

use steradian_math::{Normal3, Point2, Point3, Vec3, gamma};
use steradian_sampling::warp::{
    SphericalTriangle, spherical_triangle_area, square_to_bilinear, square_to_bilinear_pdf, square_to_uniform_triangle,
};

use crate::hit::{cosine_weight, finite_or_zero};
use crate::{Reference, ShapeSample, Triangle, area_to_solid_angle};

/// Solid angles between which sampling by solid angle is stable.
const SPHERICAL: std::ops::RangeInclusive<f32> = 3e-4..=6.22;

/// Seen from farther than this many of its longest edges, a triangle looks nearly the same from everywhere on it: then
/// uniform points are as good as uniform directions, at a fraction of the price.
const FAR: f32 = 2.0;

/// A triangle's area and unit normal, worked out together.
struct Plane {
    area: f32,
    n: Normal3,
}

impl Triangle {
    /// The area.
    #[inline]
    pub fn area(&self) -> f32 {
        0.5 * (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]).length()
    }

    /// The unit normal `(p1 - p0) x (p2 - p0)`; not finite if the triangle has no area.
    #[inline(always)]
    pub fn normal(&self) -> Normal3 {
        (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]).normalize().to_normal()
    }

    /// The point with barycentric coordinates `b1`, `b2`, and a bound on its error.
    #[inline(always)]
    pub fn point(&self, b1: f32, b2: f32) -> (Point3, Vec3) {
        let [p0, p1, p2] = [self.p[0] * (1.0 - b1 - b2), self.p[1] * b1, self.p[2] * b2];
        let sum = p0.abs() + p1.abs() + p2.abs();
        (p0 + p1 + p2, gamma(7) * sum.to_vec())
    }

    /// `None` if there is no area.
    #[inline]
    fn plane(&self) -> Option<Plane> {
        let cross = (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]);
        let twice = cross.length();
        let n = (cross * (1.0 / twice)).to_normal();
        // The reciprocal of a tiny area may overflow: no density is infinite.
        (twice > 0.0 && (2.0 / twice).is_finite() && n.is_finite()).then_some(Plane { area: 0.5 * twice, n })
    }

    #[inline]
    fn sample_at(&self, plane: &Plane, b1: f32, b2: f32, pdf: f32) -> ShapeSample {
        let (p, p_error) = self.point(b1, b2);
        ShapeSample { p, p_error, n: plane.n, uv: Point2::new(b1, b2), pdf }
    }

    #[inline]
    fn sample_plane(&self, plane: &Plane, u: [f32; 2]) -> ShapeSample {
        let [_, b1, b2] = square_to_uniform_triangle(u);
        self.sample_at(plane, b1, b2, 1.0 / plane.area)
    }

    /// A uniform point. `pdf` is per area. `None` if there is no area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        self.plane().map(|plane| self.sample_plane(&plane, u))
    }

    /// Whether the triangle is far away for its size.
    #[inline(always)]
    fn is_far(&self, from: Point3) -> bool {
        let [p0, p1, p2] = self.p;
        let edge2 = p0.distance_squared(p1).max(p1.distance_squared(p2)).max(p2.distance_squared(p0));
        let near2 = from.distance_squared(p0).min(from.distance_squared(p1)).min(from.distance_squared(p2));
        // The nearest point may be nearer than the nearest vertex, but at this distance not by much.
        near2 > FAR * FAR * edge2
    }

    /// The unit vectors from `from` to the vertices; `None` if it is a vertex.
    fn seen_from(&self, from: Point3) -> Option<[Vec3; 3]> {
        let [a, b, c] = self.p.map(|p| (p - from).try_normalize());
        Some([a?, b?, c?])
    }

    /// The solid angle that the triangle fills, seen from `from`.
    pub fn solid_angle(&self, from: Point3) -> f32 {
        self.seen_from(from).map_or(0.0, |[a, b, c]| spherical_triangle_area(a, b, c))
    }

    /// The triangle on the unit sphere around the reference, if it is to be sampled there, and the weights of the
    /// corners of the unit square, whose images are b, b, a and c.
    #[inline]
    fn spherical(&self, from: &Reference) -> Option<(SphericalTriangle, Option<[f32; 4]>)> {
        if self.is_far(from.p) {
            return None;
        }
        let [a, b, c] = self.seen_from(from.p)?;
        let solid_angle = spherical_triangle_area(a, b, c);
        if !SPHERICAL.contains(&solid_angle) {
            return None;
        }
        let triangle = SphericalTriangle::new(a, b, c)?;
        let weights = (from.ns != Normal3::default()).then(|| {
            let [a, b, c] = [a, b, c].map(|w| cosine_weight(from.ns, w));
            [b, b, a, c]
        });
        Some((triangle, weights))
    }

    /// A point seen from `from`: by solid angle, with preference for directions near `from.ns`, unless the triangle is
    /// far away or looks very small or very large; then by area. `pdf` is per solid angle.
    #[inline]
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        let plane = self.plane()?;
        let Some((triangle, weights)) = self.spherical(from) else {
            return self.sample_plane(&plane, u).seen_from(from.p);
        };
        let (u, mut pdf) = match weights {
            Some(w) => {
                let u = square_to_bilinear(u, w);
                (u, square_to_bilinear_pdf(u, w))
            }
            None => (u, 1.0),
        };
        pdf *= triangle.pdf();
        let [b1, b2] = self.barycentric(from.p, triangle.sample(u));
        (pdf > 0.0 && pdf.is_finite()).then(|| self.sample_at(&plane, b1, b2, pdf))
    }

    /// The usual case of [`Triangle::sample_solid_angle`] for loops over many triangles that have an area, without branches: barycentric
    /// coordinates, density, and whether this is the usual case. Only then do the others mean anything.
    #[inline(always)]
    pub fn sample_near(&self, from: Point3, ns: Normal3, u: [f32; 2]) -> ([f32; 2], f32, bool) {
        let seen = |p: Point3| {
            let d = p - from;
            let l = d.length();
            (d / l, (l > 0.0) & (l < f32::INFINITY))
        };
        let [(a, has_a), (b, has_b), (c, has_c)] = [seen(self.p[0]), seen(self.p[1]), seen(self.p[2])];
        let (triangle, usable) = SphericalTriangle::prepare(a, b, c);
        let stable = SPHERICAL.contains(&triangle.solid_angle());
        let turned = (ns.x != 0.0) | (ns.y != 0.0) | (ns.z != 0.0);
        let usual = !self.is_far(from) & has_a & has_b & has_c & usable & stable & turned;
        let [a, b, c] = [cosine_weight(ns, a), cosine_weight(ns, b), cosine_weight(ns, c)];
        let weights = [b, b, a, c];
        let u = square_to_bilinear(u, weights);
        let pdf = square_to_bilinear_pdf(u, weights) * triangle.pdf();
        (self.barycentric(from, triangle.sample(u)), pdf, usual)
    }

    /// The density per solid angle with which [`Triangle::sample_solid_angle`] gives the direction to `p` of the
    /// triangle.
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3) -> f32 {
        let Some(plane) = self.plane() else { return 0.0 };
        match self.spherical(from) {
            Some((triangle, weights)) => {
                let Some(w) = (p - from.p).try_normalize() else { return 0.0 };
                triangle.pdf() * weights.map_or(1.0, |weights| square_to_bilinear_pdf(triangle.invert(w), weights))
            }
            None => finite_or_zero(area_to_solid_angle(1.0 / plane.area, from.p, p, plane.n)),
        }
    }

    /// Barycentric coordinates of the point in direction `w`, brought into the triangle.
    #[inline(always)]
    fn barycentric(&self, from: Point3, w: Vec3) -> [f32; 2] {
        let (e1, e2) = (self.p[1] - self.p[0], self.p[2] - self.p[0]);
        let s1 = w.cross(e2);
        let divisor = s1.dot(e1);
        if divisor == 0.0 {
            return [1.0 / 3.0; 2];
        }
        let s = from - self.p[0];
        let b1 = (s.dot(s1) / divisor).clamp(0.0, 1.0);
        let b2 = (w.dot(s.cross(e1)) / divisor).clamp(0.0, 1.0);
        let sum = (b1 + b2).max(1.0);
        [b1 / sum, b2 / sum]
    }
}
