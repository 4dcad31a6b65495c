//! Thin curves: cubic Bezier segments swept by a flat, round or oriented profile (PBRT 4th ed., 6.7; the refinement
//! depth after Nakamaru and Ohno 2002).
//!
//! A curve is met by projecting it on the plane across the ray and halving it until it is straight within a twentieth of
//! its width.

use steradian_math::{
    Bounds3, FRAC_PI_2, Frame, Normal3, Point2, Point3, Ray, SQRT_2, Transform, Vec3, lerp, sin, sin_cos, sqr,
};

use crate::SurfaceHit;

/// The most halvings of one piece; a curve that would need more is drawn as if this were enough.
const MAX_DEPTH: i32 = 10;

/// What a curve looks like across its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CurveProfile {
    /// A ribbon that always faces the ray.
    Flat,
    /// As `Flat`, with the normals of a cylinder.
    Cylinder,
    /// A ribbon that faces along normals given for both ends, turned evenly in between.
    Ribbon([Normal3; 2]),
}

/// A piece of a cubic Bezier curve with a width.
///
/// u runs along the curve, v across it; where they are on the whole curve does not depend on how it is split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Control points of the whole curve.
    pub p: [Point3; 4],
    /// Width at u = 0 and at u = 1 of the whole curve.
    pub width: [f32; 2],
    /// The profile.
    pub profile: CurveProfile,
    /// The piece, within `[0, 1]`.
    pub u: [f32; 2],
}

/// Where a ray meets a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveHit {
    /// Ray parameter.
    pub t: f32,
    /// Position along the whole curve.
    pub u: f32,
    /// Position across the curve.
    pub v: f32,
    /// The width there, as seen along the ray.
    pub width: f32,
}

/// The control points of both halves, which share the middle one.
fn halves(p: &[Point3; 4]) -> ([Point3; 4], [Point3; 4]) {
    let mid = |a: Point3, b: Point3| (a + b) * 0.5;
    let (a, b, c) = (mid(p[0], p[1]), mid(p[1], p[2]), mid(p[2], p[3]));
    let (d, e) = (mid(a, b), mid(b, c));
    let m = mid(d, e);
    ([p[0], a, d, m], [m, e, c, p[3]])
}

/// The polar form of the curve: symmetric, affine in each argument, and on the curve if they agree.
fn blossom(p: &[Point3; 4], u: [f32; 3]) -> Point3 {
    let a = [p[0].lerp(p[1], u[0]), p[1].lerp(p[2], u[0]), p[2].lerp(p[3], u[0])];
    let b = [a[0].lerp(a[1], u[1]), a[1].lerp(a[2], u[1])];
    b[0].lerp(b[1], u[2])
}

/// The point at `u`, and the derivative by u.
fn evaluate(p: &[Point3; 4], u: f32) -> (Point3, Vec3) {
    let a = [p[0].lerp(p[1], u), p[1].lerp(p[2], u), p[2].lerp(p[3], u)];
    let b = [a[0].lerp(a[1], u), a[1].lerp(a[2], u)];
    let d = b[1] - b[0];
    // At a double control point, the chord still tells the direction.
    let d = if d.length_squared() > 0.0 { d * 3.0 } else { p[3] - p[0] };
    (b[0].lerp(b[1], u), d)
}

/// A piece in coordinates in which the ray starts at zero and runs along +z, at unit speed.
struct Projected<'a> {
    curve: &'a Curve,
    ray: &'a Ray,
    length: f32,
}

impl Curve {
    /// A whole curve. `None` unless everything is finite and no width is negative.
    pub fn new(p: [Point3; 4], width: [f32; 2], profile: CurveProfile) -> Option<Self> {
        let widths = width.iter().all(|w| w.is_finite() && *w >= 0.0);
        let normals = match profile {
            CurveProfile::Ribbon(n) => n.iter().all(|n| n.is_finite()),
            _ => true,
        };
        let profile = match profile {
            CurveProfile::Ribbon(n) => CurveProfile::Ribbon(n.map(|n| n.try_normalize().unwrap_or_default())),
            other => other,
        };
        (widths && normals && p.iter().all(|p| p.is_finite())).then_some(Self { p, width, profile, u: [0.0, 1.0] })
    }

    /// Control points, widths at both ends, and the profile: what it was made of.
    pub fn parameters(&self) -> ([Point3; 4], [f32; 2], CurveProfile) {
        (self.p, self.width, self.profile)
    }

    /// The curve in `2^depth` pieces, whose boxes are tighter than that of the whole.
    pub fn split(&self, depth: u32) -> impl Iterator<Item = Self> + use<> {
        let n = 1u32 << depth.min(16);
        let whole = *self;
        let at = move |i: u32| lerp(i as f32 / n as f32, whole.u[0], whole.u[1]);
        (0..n).map(move |i| Self { u: [at(i), at(i + 1)], ..whole })
    }

    /// The curve in another space. Widths grow by the mean scale of the transform.
    #[must_use]
    pub fn transformed(&self, t: &Transform) -> Self {
        let volume = t.determinant3().abs();
        let scale = if volume > 0.0 { steradian_math::powf(volume, 1.0 / 3.0) } else { 0.0 };
        let profile = match self.profile {
            CurveProfile::Ribbon(n) => CurveProfile::Ribbon(n.map(|n| t.normal(n).try_normalize().unwrap_or_default())),
            other => other,
        };
        Self { p: self.p.map(|p| t.point(p)), width: self.width.map(|w| w * scale), profile, u: self.u }
    }

    fn width_at(&self, u: f32) -> f32 {
        lerp(u, self.width[0], self.width[1])
    }

    fn max_width(&self, u: [f32; 2]) -> f32 {
        self.width_at(u[0]).max(self.width_at(u[1]))
    }

    /// The control points of the piece.
    fn piece(&self) -> [Point3; 4] {
        let [a, b] = self.u;
        [[a, a, a], [a, a, b], [a, b, b], [b, b, b]].map(|u| blossom(&self.p, u))
    }

    /// A box around the piece.
    pub fn bounds(&self) -> Bounds3 {
        let b = self.piece().iter().fold(Bounds3::EMPTY, |b, &p| b.union_point(p));
        b.expand(0.5 * self.max_width(self.u))
    }

    /// About the area that the piece shows from the side.
    pub fn area(&self) -> f32 {
        let p = self.piece();
        let length: f32 = p.windows(2).map(|w| w[0].distance(w[1])).sum();
        length * 0.5 * (self.width_at(self.u[0]) + self.width_at(self.u[1]))
    }

    /// The normal of a ribbon at `u`.
    fn ribbon_normal(n: &[Normal3; 2], u: f32) -> Normal3 {
        let angle = n[0].to_vec().angle_between(n[1].to_vec());
        let inv_sin = 1.0 / sin(angle);
        if angle == 0.0 || !inv_sin.is_finite() {
            return n[0];
        }
        n[0] * (sin((1.0 - u) * angle) * inv_sin) + n[1] * (sin(u * angle) * inv_sin)
    }

    /// The nearest hit with `0 < t <= ray.t_max`.
    pub fn intersect(&self, ray: &Ray) -> Option<CurveHit> {
        let piece = self.piece();
        let length = ray.d.length();
        let z = ray.d * (1.0 / length);
        // x along the curve as it appears across the ray, so that boxes around its halves are slim.
        let frame = match ray.d.cross(piece[3] - piece[0]).try_normalize() {
            Some(y) => Frame { x: y.cross(z), y, z },
            None => Frame::from_z(z),
        };
        let p = piece.map(|p| frame.to_local(p - ray.o).to_point());
        let projected = Projected { curve: self, ray, length };
        let mut best = None;
        projected.refine(&p, self.u, self.depth(&p), &mut best);
        best
    }

    /// How often to halve: the fourth part of the second differences remains after each time.
    fn depth(&self, p: &[Point3; 4]) -> i32 {
        let bend = |i: usize| {
            let d = (p[i] - p[i + 1]) - (p[i + 1] - p[i + 2]);
            d.abs().max_component()
        };
        let bend = bend(0).max(bend(1));
        let tolerance = self.width[0].max(self.width[1]) * 0.05;
        let ratio = SQRT_2 * 6.0 * bend / (8.0 * tolerance);
        if !ratio.is_finite() {
            return if bend > 0.0 { MAX_DEPTH } else { 0 };
        }
        // The exponent of a positive `f32` is its binary logarithm, rounded down.
        let log2 = ((ratio.to_bits() >> 23) as i32 - 127).max(0);
        (log2 / 2).clamp(0, MAX_DEPTH)
    }

    /// Everything about the point where `ray` met the curve.
    ///
    /// Where the profile does not say otherwise, the normal points along the ray, away from the viewer.
    pub fn interaction(&self, ray: &Ray, hit: &CurveHit) -> SurfaceHit {
        let (_, dpdu) = evaluate(&self.p, hit.u);
        let z = ray.d.normalize();
        let across = match self.profile {
            CurveProfile::Ribbon(n) => Self::ribbon_normal(&n, hit.u).cross(dpdu),
            _ => z.cross(dpdu),
        };
        let across = across.try_normalize().unwrap_or_else(|| Frame::from_z(z).x);
        let mut dpdv = across * hit.width;
        if self.profile == CurveProfile::Cylinder {
            let (s, c) = sin_cos(-lerp(hit.v, -FRAC_PI_2, FRAC_PI_2));
            // Rotation about the tangent, to which `dpdv` is orthogonal.
            let tangent = dpdu.try_normalize().unwrap_or(z);
            dpdv = dpdv * c + tangent.cross(dpdv) * s;
        }
        // The projection is only as exact as the curve is thin.
        let p_error = Vec3::splat(hit.width);
        SurfaceHit::smooth(ray.at(hit.t), p_error, Point2::new(hit.u, hit.v), [dpdu, dpdv], [Vec3::default(); 2])
    }
}

impl Projected<'_> {
    fn limit(&self, best: &Option<CurveHit>) -> f32 {
        best.map_or(self.ray.t_max, |b| b.t)
    }

    fn refine(&self, p: &[Point3; 4], u: [f32; 2], depth: i32, best: &mut Option<CurveHit>) {
        let reach = 0.5 * self.curve.max_width(u);
        let b = p.iter().fold(Bounds3::EMPTY, |b, &p| b.union_point(p)).expand(reach);
        let far = self.length * self.limit(best);
        if b.min.x > 0.0 || b.max.x < 0.0 || b.min.y > 0.0 || b.max.y < 0.0 || b.min.z > far || b.max.z < 0.0 {
            return;
        }
        if depth == 0 {
            if let Some(hit) = self.meet(p, u)
                && hit.t <= self.limit(best)
            {
                *best = Some(hit);
            }
            return;
        }
        let middle = 0.5 * (u[0] + u[1]);
        let (first, second) = halves(p);
        self.refine(&first, [u[0], middle], depth - 1, best);
        self.refine(&second, [middle, u[1]], depth - 1, best);
    }

    /// The ray against a piece that is as good as straight.
    fn meet(&self, p: &[Point3; 4], u: [f32; 2]) -> Option<CurveHit> {
        // Between the lines across the curve through its ends?
        let edge = (p[1].y - p[0].y) * -p[0].y + p[0].x * (p[0].x - p[1].x);
        let other = (p[2].y - p[3].y) * -p[3].y + p[3].x * (p[3].x - p[2].x);
        if edge < 0.0 || other < 0.0 {
            return None;
        }
        let (dx, dy) = (p[3].x - p[0].x, p[3].y - p[0].y);
        let denominator = sqr(dx) + sqr(dy);
        if denominator == 0.0 {
            return None;
        }
        let w = -(p[0].x * dx + p[0].y * dy) / denominator;
        let u = lerp(w, u[0], u[1]).clamp(u[0], u[1]);
        let mut width = self.curve.width_at(u);
        if let CurveProfile::Ribbon(n) = self.curve.profile {
            width *= Curve::ribbon_normal(&n, u).abs_dot(self.ray.d) / self.length;
        }
        let (point, tangent) = evaluate(p, w.clamp(0.0, 1.0));
        let distance2 = sqr(point.x) + sqr(point.y);
        let t = point.z / self.length;
        if distance2 > sqr(width) * 0.25 || point.z <= 0.0 || t > self.ray.t_max || width <= 0.0 {
            return None;
        }
        let offset = distance2.sqrt() / width;
        let side = tangent.x * -point.y + point.x * tangent.y;
        let v = if side > 0.0 { 0.5 + offset } else { 0.5 - offset };
        Some(CurveHit { t, u, v, width })
    }
}
