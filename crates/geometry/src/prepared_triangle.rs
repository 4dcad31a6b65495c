//! A triangle with what sampling it again and again needs: an area light's facet.

use steradian_math::{Normal3, Point2, Point3, Vec3, gamma};
use steradian_sampling::warp::square_to_uniform_triangle;

use crate::hit::finite_or_zero;
use crate::{Reference, ShapeSample, Triangle, TriangleMesh};

/// Seen from farther than this many of its longest edges, uniform points are nearly as good as uniform directions, and
/// much cheaper.
const FAR: f32 = 1.0;

/// A face of a mesh, with area, normal and error bound worked out once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedTriangle {
    triangle: Triangle,
    /// On the outside of the mesh.
    n: Normal3,
    inv_area: f32,
    centre: Point3,
    /// Squared distance from the centre beyond which the triangle is far.
    far2: f32,
    p_error: Vec3,
}

impl PreparedTriangle {
    /// Face `i` of a mesh; `None` if it has no area, or if its normals disagree about which side is out.
    pub fn new(mesh: &TriangleMesh, i: usize) -> Option<Self> {
        let triangle = mesh.triangle(i);
        let [p0, p1, p2] = triangle.p;
        let inv_area = 1.0 / triangle.area();
        // Points within the face, not at its corners, where interpolated normals may be null.
        let outside = |b1: f32, b2: f32| mesh.interaction(i, b1, b2).n;
        if triangle.is_degenerate() || !inv_area.is_finite() {
            return None;
        }
        let n = outside(1.0 / 3.0, 1.0 / 3.0);
        let agree = [(0.01, 0.01), (0.98, 0.01), (0.01, 0.98)].iter().all(|&(b1, b2)| outside(b1, b2).dot(n) > 0.0);
        if !agree || !n.is_finite() {
            return None;
        }
        let centre = p0 + ((p1 - p0) + (p2 - p0)) * (1.0 / 3.0);
        let edge = p0.distance(p1).max(p1.distance(p2)).max(p2.distance(p0));
        let radius = centre.distance(p0).max(centre.distance(p1)).max(centre.distance(p2));
        let far = FAR * edge + radius;
        let p_error = gamma(7) * (p0.abs() + p1.abs() + p2.abs()).to_vec();
        Some(Self { triangle, n, inv_area, centre, far2: far * far, p_error })
    }

    /// Whether points are taken by area from there.
    #[inline]
    pub fn is_far(&self, from: Point3) -> bool {
        from.distance_squared(self.centre) > self.far2
    }

    /// A point seen from `from`; as [`Triangle::sample_solid_angle`] at close quarters, uniform on the area from afar. `pdf`
    /// is per solid angle, `uv` are barycentric coordinates `b1`, `b2`.
    #[inline]
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        if !self.is_far(from.p) {
            return self.triangle.sample_solid_angle(from, u).map(|s| ShapeSample { n: self.n, ..s });
        }
        let [b0, b1, b2] = square_to_uniform_triangle(u);
        let [p0, p1, p2] = self.triangle.p;
        let p = p0 * b0 + p1 * b1 + p2 * b2;
        let pdf = self.area_pdf(from.p, p);
        (pdf > 0.0 && pdf < f32::INFINITY).then(|| ShapeSample {
            p,
            p_error: self.p_error,
            n: self.n,
            uv: Point2::new(b1, b2),
            pdf,
        })
    }

    #[inline]
    fn area_pdf(&self, from: Point3, p: Point3) -> f32 {
        Self::density(self.inv_area, self.n, p - from)
    }

    /// The density per solid angle of a uniform point of a triangle with normal `n`, that lies at `d` from where it is seen.
    #[inline(always)]
    pub fn density(inv_area: f32, n: Normal3, d: Vec3) -> f32 {
        let d2 = d.length_squared();
        inv_area * d2 * d2.sqrt() / n.abs_dot(d)
    }

    /// The corners.
    #[inline]
    pub fn corners(&self) -> [Point3; 3] {
        self.triangle.p
    }

    /// The normal on the outside of the mesh.
    #[inline]
    pub fn normal(&self) -> Normal3 {
        self.n
    }

    /// One over the area.
    #[inline]
    pub fn inv_area(&self) -> f32 {
        self.inv_area
    }

    /// Bound on the error of a point of the triangle.
    #[inline]
    pub fn p_error(&self) -> Vec3 {
        self.p_error
    }

    /// The density per solid angle with which [`PreparedTriangle::sample_solid_angle`] gives the direction to `p`.
    #[inline]
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3) -> f32 {
        if self.is_far(from.p) {
            finite_or_zero(self.area_pdf(from.p, p))
        } else {
            self.triangle.pdf_solid_angle(from, p)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.2), Point3::new(0.1, 0.8, 0.0)],
            indices: vec![[0, 1, 2], [0, 1, 1]],
            flip: true,
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn near_and_far_it_samples_the_density_that_it_states() {
        let mesh = mesh();
        let prepared = PreparedTriangle::new(&mesh, 0).expect("a triangle");
        assert!(PreparedTriangle::new(&mesh, 1).is_none());
        for z in [0.4, 1.0, 2.5, 4.0, 40.0] {
            let from = Reference::point(Point3::new(0.2, -0.3, -z));
            let solid_angle = mesh.triangle(0).solid_angle(from.p);
            // E[1 / pdf] is the solid angle.
            const N: usize = 64;
            let mut sum = 0.0f64;
            for i in 0..N * N {
                let u = [(i % N) as f32 + 0.5, (i / N) as f32 + 0.5].map(|v| v / N as f32);
                let s = prepared.sample_solid_angle(&from, u).expect("a point");
                let pdf = prepared.pdf_solid_angle(&from, s.p);
                assert!((pdf - s.pdf).abs() < 1e-3 * s.pdf, "at {z}: {pdf} {}", s.pdf);
                assert_eq!(s.n, mesh.interaction(0, s.uv.x, s.uv.y).n);
                sum += 1.0 / f64::from(s.pdf);
            }
            let mean = (sum / (N * N) as f64) as f32;
            assert!((mean / solid_angle - 1.0).abs() < 5e-3, "at {z}: {mean} is not {solid_angle}");
        }
    }
}
