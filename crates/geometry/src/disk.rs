//! Disks, rings and sectors in a plane of constant z (PBRT 4th ed., 6.4).

use steradian_math::{Bounds3, Normal3, Point2, Point3, Ray, Vec3, lerp, sin_cos, sqr};
use steradian_sampling::warp::square_to_uniform_disk_concentric;

use crate::hit::{area_to_solid_angle, finite_or_zero};
use crate::quadric::{PreciseRay, azimuth, phi_max, point};
use crate::{QuadricHit, Reference, ShapeSample, SurfaceHit};

/// A disk at z = `height`, without its inner part, and up to an azimuth.
///
/// u follows the azimuth, v goes from the rim inwards; `dpdu x dpdv` points along +z. A [`Disk::radial`] one has u from the centre to the
/// rim and v along the azimuth instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    height: f32,
    radius: f32,
    inner_radius: f32,
    phi_max: f32,
    is_radial: bool,
}

impl Disk {
    /// A disk; `phi_max` in degrees. `None` unless `0 <= inner_radius < radius` and everything is finite.
    pub fn new(height: f32, radius: f32, inner_radius: f32, phi_max_degrees: f32) -> Option<Self> {
        let finite = height.is_finite() && radius.is_finite() && phi_max_degrees.is_finite();
        (finite && inner_radius >= 0.0 && inner_radius < radius).then(|| Self {
            height,
            radius,
            inner_radius,
            phi_max: phi_max(phi_max_degrees),
            is_radial: false,
        })
    }

    /// The same disk with u along the radius and v along the azimuth: Mitsuba's.
    #[must_use]
    pub fn radial(self) -> Self {
        Self { is_radial: true, ..self }
    }

    fn is_full(&self) -> bool {
        self.inner_radius == 0.0 && self.phi_max == phi_max(360.0)
    }

    /// Height, radius, inner radius, and the azimuth in degrees: what it was made of.
    pub fn parameters(&self) -> [f32; 4] {
        [self.height, self.radius, self.inner_radius, self.phi_max.to_degrees()]
    }

    /// Whether u follows the radius; see [`Disk::radial`].
    pub fn is_radial(&self) -> bool {
        self.is_radial
    }

    /// A box around it.
    pub fn bounds(&self) -> Bounds3 {
        let (r, h) = (self.radius, self.height);
        Bounds3 { min: Point3::new(-r, -r, h), max: Point3::new(r, r, h) }
    }

    /// The hit with `0 < t <= ray.t_max`; `o_error` bounds the error of the ray's origin.
    pub fn intersect(&self, ray: &Ray, o_error: Vec3) -> Option<QuadricHit> {
        if ray.d.z == 0.0 {
            return None;
        }
        let r = PreciseRay::new(ray, o_error);
        let t = (f64::from(self.height) - r.o[2]) / r.d[2];
        if !r.accepts(t, [0.0, 0.0, 1.0]) {
            return None;
        }
        let mut p = point(r.at(t));
        p.z = self.height;
        let d2 = sqr(p.x) + sqr(p.y);
        let inside = d2 <= sqr(self.radius)
            && d2 >= sqr(self.inner_radius)
            && (self.phi_max >= phi_max(360.0) || azimuth(p) <= self.phi_max);
        inside.then_some(QuadricHit { t: t as f32, p })
    }

    fn uv(&self, p: Point3) -> Point2 {
        let r = (sqr(p.x) + sqr(p.y)).sqrt();
        let (around, inwards) = (azimuth(p) / self.phi_max, (self.radius - r) / (self.radius - self.inner_radius));
        if self.is_radial { Point2::new(1.0 - inwards, around) } else { Point2::new(around, inwards) }
    }

    /// Everything about a point of the disk.
    pub fn interaction(&self, hit: &QuadricHit) -> SurfaceHit {
        let mut p = hit.p;
        let uv = self.uv(p);
        if p.x == 0.0 && p.y == 0.0 {
            // The azimuth of the centre is a matter of choice; that its derivatives exist is not.
            p.x = 1e-5 * self.radius;
        }
        let r = (sqr(p.x) + sqr(p.y)).sqrt();
        let dpdu = Vec3::new(-self.phi_max * p.y, self.phi_max * p.x, 0.0);
        let dpdv = Vec3::new(p.x, p.y, 0.0) * ((self.inner_radius - self.radius) / r);
        let mut hit = SurfaceHit::smooth(
            hit.p,
            Vec3::default(),
            uv,
            if self.is_radial { [-dpdv, dpdu] } else { [dpdu, dpdv] },
            [Vec3::default(); 2],
        );
        hit.n = Normal3::new(0.0, 0.0, 1.0);
        hit.shading.n = hit.n;
        hit
    }

    /// The area.
    pub fn area(&self) -> f32 {
        self.phi_max * 0.5 * (sqr(self.radius) - sqr(self.inner_radius))
    }

    /// A uniform point. `pdf` is per area. `None` if there is no area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        let [x, y] = if self.is_full() {
            square_to_uniform_disk_concentric(u).map(|x| x * self.radius)
        } else {
            let r = lerp(u[0], sqr(self.inner_radius), sqr(self.radius)).sqrt();
            let (s, c) = sin_cos(u[1] * self.phi_max);
            [r * c, r * s]
        };
        let p = Point3::new(x, y, self.height);
        let pdf = 1.0 / self.area();
        let n = Normal3::new(0.0, 0.0, 1.0);
        pdf.is_finite().then(|| ShapeSample { p, p_error: Vec3::default(), n, uv: self.uv(p), pdf })
    }

    /// A point seen from `from`, uniform by area. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        self.sample_area(u)?.seen_from(from.p)
    }

    /// The density per solid angle with which [`Disk::sample_solid_angle`] gives the direction to `p` of the disk.
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3, n: Normal3) -> f32 {
        finite_or_zero(area_to_solid_angle(1.0 / self.area(), from.p, p, n))
    }
}
