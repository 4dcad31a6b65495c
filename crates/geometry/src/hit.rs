//! What intersection and sampling give back: geometry, and nothing of materials or lights.

use steradian_math::{Normal3, Point2, Point3, Ray, Transform, Vec3, offset_ray_origin};

/// The frame in which light scatters: the true surface, or what interpolated normals and bump maps make of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shading {
    /// Unit normal.
    pub n: Normal3,
    /// Derivative of the position with respect to u.
    pub dpdu: Vec3,
    /// Derivative of the position with respect to v.
    pub dpdv: Vec3,
    /// Derivative of `n` with respect to u.
    pub dndu: Normal3,
    /// Derivative of `n` with respect to v.
    pub dndv: Normal3,
}

/// A point of a surface, with its surroundings to first order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceHit {
    /// Position.
    pub p: Point3,
    /// Bound on the absolute error of each coordinate.
    pub p_error: Vec3,
    /// Geometric unit normal: `dpdu x dpdv`, or its negative where the surface is flipped, and on the side of the
    /// interpolated normal where there is one.
    pub n: Normal3,
    /// Texture coordinates.
    pub uv: Point2,
    /// Derivative of the position with respect to u.
    pub dpdu: Vec3,
    /// Derivative of the position with respect to v.
    pub dpdv: Vec3,
    /// The scattering frame.
    pub shading: Shading,
}

impl SurfaceHit {
    /// A point whose scattering frame is that of the true surface.
    #[inline]
    pub(crate) fn smooth(p: Point3, p_error: Vec3, uv: Point2, d: [Vec3; 2], dn: [Vec3; 2]) -> Self {
        let n = d[0].cross(d[1]).normalize().to_normal();
        let shading = Shading { n, dpdu: d[0], dpdv: d[1], dndu: dn[0].to_normal(), dndv: dn[1].to_normal() };
        Self { p, p_error, n, uv, dpdu: d[0], dpdv: d[1], shading }
    }

    /// The other side out: both normals negated.
    #[must_use]
    #[inline]
    pub fn flipped(mut self) -> Self {
        self.n = -self.n;
        let s = &mut self.shading;
        (s.n, s.dndu, s.dndv) = (-s.n, -s.dndu, -s.dndv);
        self
    }

    /// The point in another space. The error bound grows by the rounding of the transform.
    ///
    /// Normals stay on the side they are on: a transform that swaps handedness turns `dpdu x dpdv` to the other side
    /// of the surface, but not the normal. (Scene formats that want it turned call [`SurfaceHit::flipped`].)
    #[must_use]
    pub fn transformed(&self, t: &Transform) -> Self {
        let (p, p_error) = t.point_with_error(self.p, self.p_error);
        let n = t.normal(self.n).normalize();
        let s = &self.shading;
        let ns = t.normal(s.n);
        let inv_length = 1.0 / ns.length();
        let unit = ns * inv_length;
        // The derivative of the unit normal, which is not the image of the derivative.
        let derivative = |d: Normal3| {
            let d = t.normal(d) * inv_length;
            d - unit * unit.dot(d)
        };
        Self {
            p,
            p_error,
            n,
            uv: self.uv,
            dpdu: t.vector(self.dpdu),
            dpdv: t.vector(self.dpdv),
            shading: Shading {
                n: unit.face_forward(n),
                dpdu: t.vector(s.dpdu),
                dpdv: t.vector(s.dpdv),
                dndu: derivative(s.dndu),
                dndv: derivative(s.dndv),
            },
        }
    }

    /// A ray that leaves in direction `w`.
    #[inline]
    pub fn spawn(&self, w: Vec3, time: f32) -> Ray {
        Ray::new(offset_ray_origin(self.p, self.p_error, self.n, w), w, time)
    }
}

/// A point chosen on a shape.
///
/// `pdf` is with respect to the measure that the function which made it names: area for `sample_area`, solid angle at
/// the reference point for `sample_solid_angle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample {
    /// Position.
    pub p: Point3,
    /// Bound on the absolute error of each coordinate.
    pub p_error: Vec3,
    /// Geometric unit normal, on the same side as at a [`SurfaceHit`] of the shape.
    pub n: Normal3,
    /// The coordinates that a [`SurfaceHit`] there has (of the shape alone, for [`Triangle`](crate::Triangle) and
    /// [`BilinearPatch`](crate::BilinearPatch): barycentric `b1`, `b2`, or patch coordinates).
    pub uv: Point2,
    /// Probability density. Positive and finite.
    pub pdf: f32,
}

impl ShapeSample {
    /// The other side out.
    #[must_use]
    #[inline]
    pub fn flipped(mut self) -> Self {
        self.n = -self.n;
        self
    }

    /// From density per area to density per solid angle at `from`; `None` if seen edge-on or at no distance.
    #[inline]
    pub(crate) fn seen_from(self, from: Point3) -> Option<Self> {
        let pdf = area_to_solid_angle(self.pdf, from, self.p, self.n);
        (pdf > 0.0 && pdf < f32::INFINITY).then_some(Self { pdf, ..self })
    }
}

/// The density per solid angle at `from` of a density per area at `p`, where the unit normal is `n`; infinite or NaN
/// where the surface is seen edge-on.
#[inline]
pub fn area_to_solid_angle(pdf_area: f32, from: Point3, p: Point3, n: Normal3) -> f32 {
    let d = p - from;
    let distance2 = d.length_squared();
    pdf_area * distance2 * distance2.sqrt() / n.abs_dot(d)
}

/// [`area_to_solid_angle`], with 0 where it is not finite: no direction sample has a density there.
#[inline]
pub(crate) fn finite_or_zero(pdf: f32) -> f32 {
    if pdf.is_finite() { pdf } else { 0.0 }
}

/// The point from which a shape is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Position.
    pub p: Point3,
    /// Bound on its absolute error.
    pub p_error: Vec3,
    /// Geometric unit normal; null in a medium.
    pub n: Normal3,
    /// Unit normal of the scattering frame; null in a medium, or if directions must not be chosen by cosine.
    pub ns: Normal3,
}

impl Reference {
    /// A point in a medium.
    pub fn point(p: Point3) -> Self {
        Self { p, ..Self::default() }
    }

    /// A point on a surface.
    pub fn surface(hit: &SurfaceHit) -> Self {
        Self { p: hit.p, p_error: hit.p_error, n: hit.n, ns: hit.shading.n }
    }

    /// A ray that leaves in direction `w`.
    #[inline]
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.origin(w), w, 0.0)
    }

    /// The origin of rays in direction `w`.
    #[inline]
    pub fn origin(&self, w: Vec3) -> Point3 {
        offset_ray_origin(self.p, self.p_error, self.n, w)
    }

    /// The reference in another space.
    #[must_use]
    pub fn transformed(&self, t: &Transform) -> Self {
        let (p, p_error) = t.point_with_error(self.p, self.p_error);
        let unit = |n: Normal3| t.normal(n).try_normalize().unwrap_or_default();
        Self { p, p_error, n: unit(self.n), ns: unit(self.ns) }
    }
}

/// The weights by which corners of a spherical polygon are preferred for their cosine at the reference point.
///
/// The least keeps directions at the horizon possible (PBRT 4th ed., 6.5.4).
#[inline(always)]
pub(crate) fn cosine_weight(ns: Normal3, w: Vec3) -> f32 {
    ns.abs_dot(w).max(0.01)
}
