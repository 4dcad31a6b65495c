//! Bilinear patches: intersection (Reshetov, "Cool patches", Ray Tracing Gems 2019), area and solid-angle sampling
//! (PBRT 4th ed., 6.6).

use steradian_math::{Bounds3, Normal3, Point2, Point3, Ray, Vec3, gamma};
use steradian_sampling::warp::{SphericalRectangle, square_to_bilinear, square_to_bilinear_pdf};

use crate::hit::{cosine_weight, finite_or_zero};
use crate::{Reference, ShapeSample, area_to_solid_angle};

/// Below this solid angle, a rectangle is sampled by area.
const MIN_SPHERICAL: f32 = 1e-4;

/// The surface `lerp(v, lerp(u, p00, p10), lerp(u, p01, p11))`. Its normal is along `dpdu x dpdv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilinearPatch {
    /// p00, p10, p01, p11: the first index is u.
    pub p: [Point3; 4],
}

/// Where a ray meets a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilinearHit {
    /// Ray parameter.
    pub t: f32,
    /// Patch coordinate u.
    pub u: f32,
    /// Patch coordinate v.
    pub v: f32,
}

type Triple = [f64; 3];

fn dot(a: Triple, b: Triple) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Triple, b: Triple) -> Triple {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn sub(a: Triple, b: Triple) -> Triple {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn mix(t: f64, a: Triple, b: Triple) -> Triple {
    std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
}

/// The real roots of `a t^2 + b t + c`; one root twice if the quadratic is a line.
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    if a == 0.0 {
        return (b != 0.0).then(|| [-c / b; 2]);
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    Some(if q == 0.0 { [0.0; 2] } else { [q / a, c / q] })
}

impl BilinearPatch {
    /// The box around the corners.
    pub fn bounds(&self) -> Bounds3 {
        self.p.iter().fold(Bounds3::EMPTY, |b, &p| b.union_point(p))
    }

    /// The nearest hit with `0 < t <= ray.t_max`.
    ///
    /// Worked out in double precision: on patches that are flat or nearly so, the coefficients of the quadratic cancel.
    pub fn intersect(&self, ray: &Ray) -> Option<BilinearHit> {
        let [p00, p10, p01, p11] = self.p.map(|p| p.to_array().map(f64::from));
        let (o, d) = (ray.o.to_array().map(f64::from), ray.d.to_array().map(f64::from));
        // u at which the ray comes nearest to, that is, meets, the line of constant u.
        let qn = cross(sub(p10, p00), sub(p01, p11));
        let mut a = dot(qn, d);
        let c = dot(cross(sub(p00, o), d), sub(p01, p00));
        let b = dot(cross(sub(p10, o), d), sub(p11, p10)) - (a + c);
        // For a flat trapezoid the quadratic term is rounding noise, and one of the roots with it.
        if a.abs() < 1e-14 * (b.abs() + c.abs()) {
            a = 0.0;
        }
        // A ray that starts on the patch meets it at zero, give or take what double precision leaves of the coordinates.
        let extent = |v: Triple| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let size = [p00, p10, p01, p11, o].into_iter().map(extent).fold(0.0, f64::max);
        let t_min = 1e-12 * size / dot(d, d).sqrt();
        let mut best: Option<BilinearHit> = None;
        for u in roots(a, b, c)? {
            if !(0.0..=1.0).contains(&u) {
                continue;
            }
            let start = mix(u, p00, p10);
            let along = sub(mix(u, p01, p11), start);
            let to_start = sub(start, o);
            let perp = cross(d, along);
            let p2 = dot(perp, perp);
            let (v, t) = (dot(cross(to_start, d), perp) / p2, dot(cross(to_start, along), perp) / p2);
            // Written so that a ray along the line (0 / 0) misses.
            if (0.0..=1.0).contains(&v)
                && t > t_min
                && (t as f32) <= best.map_or(ray.t_max, |b| b.t)
                && t < f64::from(f32::MAX)
            {
                best = Some(BilinearHit { t: t as f32, u: u as f32, v: v as f32 });
            }
        }
        best
    }

    /// The point at `(u, v)`, and a bound on its error.
    pub fn point(&self, u: f32, v: f32) -> (Point3, Vec3) {
        let [p00, p10, p01, p11] = self.p;
        let sum = p00.abs() + p10.abs() + p01.abs() + p11.abs();
        (p00.lerp(p01, v).lerp(p10.lerp(p11, v), u), gamma(6) * sum.to_vec())
    }

    /// `dpdu` and `dpdv` at `(u, v)`.
    pub fn derivatives(&self, u: f32, v: f32) -> [Vec3; 2] {
        let [p00, p10, p01, p11] = self.p;
        [p10.lerp(p11, v) - p00.lerp(p01, v), p01.lerp(p11, u) - p00.lerp(p10, u)]
    }

    /// The mixed second derivative; the others are null.
    pub(crate) fn twist(&self) -> Vec3 {
        (self.p[0] - self.p[2]) + (self.p[3] - self.p[1])
    }

    /// Whether the patch is flat and has four right angles, up to rounding.
    pub fn is_rectangle(&self) -> bool {
        let [p00, p10, p01, p11] = self.p;
        if p00 == p01 || p01 == p11 || p11 == p10 || p10 == p00 {
            return false;
        }
        let n = (p10 - p00).cross(p01 - p00).normalize();
        // Not `>`: a normal that is not a number is no rectangle's.
        let flat = (p11 - p00).normalize().abs_dot(n) <= 1e-5;
        let center = (p00 + p01 + p10 + p11) * 0.25;
        let d = self.p.map(|p| p.distance_squared(center));
        flat && d.iter().all(|&x| (x - d[0]).abs() <= 1e-4 * d[0])
    }

    /// The area: exact for parallelograms, else by quadrature.
    pub fn area(&self) -> f32 {
        const N: usize = 8;
        let mid = |i: usize| (i as f32 + 0.5) / N as f32;
        let cells = (0..N * N).map(|i| {
            let [du, dv] = self.derivatives(mid(i % N), mid(i / N));
            f64::from(du.cross(dv).length())
        });
        (cells.sum::<f64>() / (N * N) as f64) as f32
    }

    /// The differential areas at the corners: a bilinear approximation to the differential area.
    fn corner_areas(&self) -> [f32; 4] {
        let [p00, p10, p01, p11] = self.p;
        [
            (p10 - p00).cross(p01 - p00).length(),
            (p10 - p00).cross(p11 - p10).length(),
            (p01 - p00).cross(p11 - p01).length(),
            (p11 - p10).cross(p11 - p01).length(),
        ]
    }

    fn sample_at(&self, u: f32, v: f32, pdf: f32) -> Option<ShapeSample> {
        let (p, p_error) = self.point(u, v);
        let [du, dv] = self.derivatives(u, v);
        let n: Normal3 = du.cross(dv).try_normalize()?.to_normal();
        (pdf > 0.0 && pdf.is_finite()).then_some(ShapeSample { p, p_error, n, uv: Point2::new(u, v), pdf })
    }

    /// A point, uniform on a parallelogram and nearly so on others. `pdf` is per area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        let [u, v] = square_to_bilinear(u, self.corner_areas());
        self.sample_at(u, v, self.pdf_area(u, v))
    }

    /// The density per area of [`BilinearPatch::sample_area`] at `(u, v)`.
    pub fn pdf_area(&self, u: f32, v: f32) -> f32 {
        let [du, dv] = self.derivatives(u, v);
        square_to_bilinear_pdf([u, v], self.corner_areas()) / du.cross(dv).length()
    }

    /// The rectangle on the unit sphere around the reference, if it is to be sampled there, and corner weights.
    fn spherical(&self, from: &Reference) -> Option<(SphericalRectangle, Option<[f32; 4]>)> {
        if !self.is_rectangle() {
            return None;
        }
        let [p00, p10, p01, _] = self.p;
        let rectangle = SphericalRectangle::new(from.p, p00, p10 - p00, p01 - p00)?;
        if rectangle.solid_angle() <= MIN_SPHERICAL {
            return None;
        }
        let weights = (from.ns != Normal3::default())
            .then(|| self.p.map(|p| cosine_weight(from.ns, (p - from.p).try_normalize().unwrap_or_default())));
        Some((rectangle, weights))
    }

    /// A point seen from `from`: rectangles by solid angle, with preference for directions near `from.ns`, unless they
    /// look very small; others by area. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        let Some((rectangle, weights)) = self.spherical(from) else {
            return self.sample_area(u)?.seen_from(from.p);
        };
        let (u, mut pdf) = match weights {
            Some(w) => {
                let u = square_to_bilinear(u, w);
                (u, square_to_bilinear_pdf(u, w))
            }
            None => (u, 1.0),
        };
        pdf *= rectangle.pdf();
        let [p00, p10, p01, _] = self.p;
        let (eu, ev) = (p10 - p00, p01 - p00);
        let q = rectangle.sample(u) - p00;
        let coordinate = |e: Vec3| (q.dot(e) / e.length_squared()).clamp(0.0, 1.0);
        self.sample_at(coordinate(eu), coordinate(ev), pdf)
    }

    /// The density per solid angle with which [`BilinearPatch::sample_solid_angle`] gives the direction to the point at
    /// `(u, v)`, if no other point of the patch lies in that direction; else the part of it that is due to this point.
    pub fn pdf_solid_angle(&self, from: &Reference, u: f32, v: f32) -> f32 {
        let (p, _) = self.point(u, v);
        match self.spherical(from) {
            Some((rectangle, weights)) => {
                rectangle.pdf() * weights.map_or(1.0, |w| square_to_bilinear_pdf(rectangle.invert(p), w))
            }
            None => {
                let [du, dv] = self.derivatives(u, v);
                let n = du.cross(dv).normalize().to_normal();
                finite_or_zero(area_to_solid_angle(self.pdf_area(u, v), from.p, p, n))
            }
        }
    }
}
