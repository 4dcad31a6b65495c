//! Spheres and parts of spheres around the origin (PBRT 4th ed., 6.2).

use steradian_math::{
    Bounds3, Frame, INV_2PI, Normal3, Point2, Point3, Ray, Vec3, gamma, lerp, safe_acos, safe_sqrt, sin_cos, sqr,
};

use crate::curvature::weingarten;
use crate::hit::{area_to_solid_angle, finite_or_zero};
use crate::quadric::{PreciseRay, azimuth, phi_max, point};
use crate::{QuadricHit, Reference, ShapeSample, SurfaceHit};

/// The part of a sphere with `z_min <= z <= z_max` and azimuth up to `phi_max`.
///
/// u follows the azimuth, v goes from `z_min` to `z_max`; `dpdu x dpdv` points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: f32,
    z: [f32; 2],
    /// Polar angles of `z`.
    theta: [f32; 2],
    phi_max: f32,
}

impl Sphere {
    /// A part of a sphere; `phi_max` in degrees. `None` unless the radius is positive and everything is finite.
    pub fn new(radius: f32, z_min: f32, z_max: f32, phi_max_degrees: f32) -> Option<Self> {
        let finite = radius.is_finite() && z_min.is_finite() && z_max.is_finite() && phi_max_degrees.is_finite();
        if !finite || radius <= 0.0 {
            return None;
        }
        let z = [z_min.min(z_max), z_min.max(z_max)].map(|z| z.clamp(-radius, radius));
        Some(Self { radius, z, theta: z.map(|z| safe_acos(z / radius)), phi_max: phi_max(phi_max_degrees) })
    }

    /// A whole sphere. `None` unless the radius is positive and finite.
    pub fn full(radius: f32) -> Option<Self> {
        Self::new(radius, -radius, radius, 360.0)
    }

    /// The radius.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    fn is_full(&self) -> bool {
        self.z == [-self.radius, self.radius] && self.phi_max == phi_max(360.0)
    }

    /// Radius, least and greatest z, and the azimuth in degrees: what it was made of.
    pub fn parameters(&self) -> [f32; 4] {
        [self.radius, self.z[0], self.z[1], self.phi_max.to_degrees()]
    }

    /// A box around it.
    pub fn bounds(&self) -> Bounds3 {
        let r = self.radius;
        Bounds3 { min: Point3::new(-r, -r, self.z[0]), max: Point3::new(r, r, self.z[1]) }
    }

    /// The nearest hit with `0 < t <= ray.t_max`; `o_error` bounds the error of the ray's origin.
    pub fn intersect(&self, ray: &Ray, o_error: Vec3) -> Option<QuadricHit> {
        let r = PreciseRay::new(ray, o_error);
        let radius = f64::from(self.radius);
        r.roots::<3>(radius)?.into_iter().find_map(|t| {
            let q = r.at(t);
            if !r.accepts(t, q.map(|x| x / radius)) {
                return None;
            }
            let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]).sqrt();
            let mut p = point(q.map(|x| x * (radius / length)));
            if p.x == 0.0 && p.y == 0.0 {
                p.x = 1e-5 * self.radius;
            }
            let clipped = self.z[0] > -self.radius && p.z < self.z[0]
                || self.z[1] < self.radius && p.z > self.z[1]
                || self.phi_max < phi_max(360.0) && azimuth(p) > self.phi_max;
            (!clipped).then_some(QuadricHit { t: t as f32, p })
        })
    }

    fn uv(&self, p: Point3) -> Point2 {
        let theta = safe_acos(p.z / self.radius);
        Point2::new(azimuth(p) / self.phi_max, (theta - self.theta[0]) / (self.theta[1] - self.theta[0]))
    }

    /// Everything about a point of the sphere.
    pub fn interaction(&self, hit: &QuadricHit) -> SurfaceHit {
        let p = hit.p;
        let cos_theta = p.z / self.radius;
        let sin_theta = safe_sqrt(1.0 - sqr(cos_theta));
        let z_radius = (sqr(p.x) + sqr(p.y)).sqrt();
        let (cos_phi, sin_phi) = (p.x / z_radius, p.y / z_radius);
        let span = self.theta[1] - self.theta[0];
        let dpdu = Vec3::new(-self.phi_max * p.y, self.phi_max * p.x, 0.0);
        let dpdv = span * Vec3::new(p.z * cos_phi, p.z * sin_phi, -self.radius * sin_theta);
        let duu = -sqr(self.phi_max) * Vec3::new(p.x, p.y, 0.0);
        let duv = span * p.z * self.phi_max * Vec3::new(-sin_phi, cos_phi, 0.0);
        let dvv = -sqr(span) * p.to_vec();
        let dn = weingarten(dpdu, dpdv, duu, duv, dvv);
        SurfaceHit::smooth(p, gamma(5) * p.to_vec().abs(), self.uv(p), [dpdu, dpdv], dn)
    }

    /// The area.
    pub fn area(&self) -> f32 {
        self.phi_max * self.radius * (self.z[1] - self.z[0])
    }

    /// A uniform point. `pdf` is per area. `None` if there is no area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        // Archimedes: equal slices have equal areas.
        let z = lerp(u[0], self.z[1], self.z[0]);
        let r = safe_sqrt(sqr(self.radius) - sqr(z));
        let (sin_phi, cos_phi) = sin_cos(u[1] * self.phi_max);
        let p = Vec3::new(r * cos_phi, r * sin_phi, z);
        let p = p * (self.radius / p.length());
        let pdf = 1.0 / self.area();
        pdf.is_finite().then(|| self.sample_at(p, pdf))
    }

    fn sample_at(&self, p: Vec3, pdf: f32) -> ShapeSample {
        let n: Normal3 = p.to_normal() * (1.0 / self.radius);
        let uv = self.uv(p.to_point());
        ShapeSample { p: p.to_point(), p_error: gamma(5) * p.abs(), n: n.normalize(), uv, pdf }
    }

    /// `1 - cos` and squared sine of the half angle that the sphere fills, seen from `from`; `None` if it surrounds the
    /// reference, or is but a part, and has to be sampled by area.
    fn cone(&self, from: &Reference) -> Option<(f32, f32)> {
        let center = Point3::default();
        let origin = from.origin(center - from.p);
        if !self.is_full() || origin.to_vec().length_squared() <= sqr(self.radius) {
            return None;
        }
        let sin2 = sqr(self.radius) / from.p.to_vec().length_squared();
        let one_minus_cos = sin2 / (1.0 + safe_sqrt(1.0 - sin2));
        (sin2 < 1.0 && one_minus_cos > 0.0).then_some((one_minus_cos, sin2))
    }

    /// A point seen from `from`: uniform by solid angle if the sphere is whole and seen from outside, else by area.
    /// `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        let Some((one_minus_cos_max, sin2_max)) = self.cone(from) else {
            return self.sample_area(u)?.seen_from(from.p);
        };
        let one_minus_cos = u[0] * one_minus_cos_max;
        let cos = 1.0 - one_minus_cos;
        let sin2 = one_minus_cos * (1.0 + cos);
        // The angle at the centre between the reference and the point (PBRT 4th ed., 6.2.4).
        let cos_alpha = sin2 / sin2_max.sqrt() + cos * safe_sqrt(1.0 - sin2 / sin2_max);
        let sin_alpha = safe_sqrt(1.0 - sqr(cos_alpha));
        let frame = Frame::from_z(from.p.to_vec().normalize());
        let (sin_phi, cos_phi) = sin_cos(u[1] * 2.0 * steradian_math::PI);
        let w = frame.from_local(Vec3::new(sin_alpha * cos_phi, sin_alpha * sin_phi, cos_alpha));
        Some(self.sample_at(w * (self.radius / w.length()), INV_2PI / one_minus_cos_max))
    }

    /// The density per solid angle with which [`Sphere::sample_solid_angle`] gives the direction to `p`, the nearest
    /// point of the sphere in its direction, where the unit normal is `n`.
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3, n: Normal3) -> f32 {
        match self.cone(from) {
            Some((one_minus_cos_max, _)) => INV_2PI / one_minus_cos_max,
            None => finite_or_zero(area_to_solid_angle(1.0 / self.area(), from.p, p, n)),
        }
    }
}
