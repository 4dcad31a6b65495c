//! Open cylinders around the z axis (PBRT 4th ed., 6.3).

use steradian_math::{Bounds3, Normal3, Point2, Point3, Ray, Vec3, gamma, lerp, sin_cos, sqr};

use crate::curvature::weingarten;
use crate::hit::{area_to_solid_angle, finite_or_zero};
use crate::quadric::{PreciseRay, azimuth, phi_max, point};
use crate::{QuadricHit, Reference, ShapeSample, SurfaceHit};

/// The part of a cylinder with `z_min <= z <= z_max` and azimuth up to `phi_max`.
///
/// u follows the azimuth, v goes from `z_min` to `z_max`; `dpdu x dpdv` points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    radius: f32,
    z: [f32; 2],
    phi_max: f32,
}

impl Cylinder {
    /// A cylinder; `phi_max` in degrees. `None` unless the radius is positive, there is some height, and everything is
    /// finite.
    pub fn new(radius: f32, z_min: f32, z_max: f32, phi_max_degrees: f32) -> Option<Self> {
        let finite = radius.is_finite() && z_min.is_finite() && z_max.is_finite() && phi_max_degrees.is_finite();
        let z = [z_min.min(z_max), z_min.max(z_max)];
        (finite && radius > 0.0 && z[0] < z[1]).then(|| Self { radius, z, phi_max: phi_max(phi_max_degrees) })
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
        r.roots::<2>(radius)?.into_iter().find_map(|t| {
            let q = r.at(t);
            if !r.accepts(t, [q[0] / radius, q[1] / radius, 0.0]) {
                return None;
            }
            let scale = radius / (q[0] * q[0] + q[1] * q[1]).sqrt();
            let p = point([q[0] * scale, q[1] * scale, q[2]]);
            let inside =
                p.z >= self.z[0] && p.z <= self.z[1] && (self.phi_max >= phi_max(360.0) || azimuth(p) <= self.phi_max);
            inside.then_some(QuadricHit { t: t as f32, p })
        })
    }

    fn uv(&self, p: Point3) -> Point2 {
        Point2::new(azimuth(p) / self.phi_max, (p.z - self.z[0]) / (self.z[1] - self.z[0]))
    }

    /// Along z, a point is where the ray says, so its error is that of the ray, at most a rounding of the root.
    fn p_error(p: Point3) -> Vec3 {
        let e = gamma(3) * p.to_vec().abs();
        Vec3::new(e.x, e.y, 0.0)
    }

    /// Everything about a point of the cylinder.
    pub fn interaction(&self, hit: &QuadricHit) -> SurfaceHit {
        let p = hit.p;
        let dpdu = Vec3::new(-self.phi_max * p.y, self.phi_max * p.x, 0.0);
        let dpdv = Vec3::new(0.0, 0.0, self.z[1] - self.z[0]);
        let duu = -sqr(self.phi_max) * Vec3::new(p.x, p.y, 0.0);
        let dn = weingarten(dpdu, dpdv, duu, Vec3::default(), Vec3::default());
        SurfaceHit::smooth(p, Self::p_error(p), self.uv(p), [dpdu, dpdv], dn)
    }

    /// The area.
    pub fn area(&self) -> f32 {
        (self.z[1] - self.z[0]) * self.radius * self.phi_max
    }

    /// A uniform point. `pdf` is per area. `None` if there is no area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        let (s, c) = sin_cos(u[1] * self.phi_max);
        let p = Point3::new(self.radius * c, self.radius * s, lerp(u[0], self.z[0], self.z[1]));
        let n = Normal3::new(c, s, 0.0).normalize();
        let pdf = 1.0 / self.area();
        pdf.is_finite().then(|| ShapeSample { p, p_error: Self::p_error(p), n, uv: self.uv(p), pdf })
    }

    /// A point seen from `from`, uniform by area. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        self.sample_area(u)?.seen_from(from.p)
    }

    /// The density per solid angle with which [`Cylinder::sample_solid_angle`] gives the direction to `p`, if no other
    /// point of the cylinder lies in that direction; else the part of the density that is due to `p`.
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3, n: Normal3) -> f32 {
        finite_or_zero(area_to_solid_angle(1.0 / self.area(), from.p, p, n))
    }
}
