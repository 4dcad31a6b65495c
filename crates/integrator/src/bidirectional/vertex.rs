//! A vertex of a path that was made from the camera or from a light.

use steradian_bsdf::{Bsdf, Lobe, PhaseMix, TransportMode};
use steradian_math::{Frame, Normal3, Point3, Ray, Vec3, offset_ray_origin};
use steradian_scene::{Handle, LightContext, LightEnd, Medium, Surface, World};
use steradian_spectrum::Lanes;

/// What is at a vertex.
#[expect(
    clippy::large_enum_variant,
    reason = "most vertices are surfaces, and paths are kept in one list that is used again"
)]
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind<'w> {
    /// The lens.
    Camera,
    /// A point of a light that a path starts at.
    Light(LightEnd),
    /// A surface.
    Surface { surface: Surface, frame: Frame, bsdf: Bsdf<'w> },
    /// A point in a medium.
    Medium(PhaseMix<'w>),
    /// Nothing: a path from the camera has left the scene.
    Escaped,
}

/// A vertex, with what its path carries on arrival.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex<'w> {
    pub kind: Kind<'w>,
    pub p: Point3,
    /// Unit direction to the previous vertex; null at the first.
    pub wo: Vec3,
    /// Throughput over the density of the hero's lane; at a light, its radiance over density.
    pub beta: Lanes,
    /// The densities of all lanes over that of the hero's.
    pub ratios: Lanes,
    /// The medium through which the path came.
    pub medium: Option<Handle<Medium>>,
    pub time: f32,
    /// Density with which the path that it lies on makes it from the vertex before: per area, or volume.
    pub pdf: f32,
    /// Density with which a path from the other end makes it from the vertex behind.
    pub pdf_reverse: f32,
    /// Whether the path was scattered here by a Dirac lobe, so that only a path that is made through it has this vertex.
    pub is_dirac: bool,
}

/// What scattering into a direction amounts to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scattered {
    /// The scattering function, with the cosine that belongs to the outgoing direction.
    pub value: Lanes,
    /// Density per solid angle of the direction, given the previous vertex.
    pub pdf: f32,
    /// Density per solid angle of the previous vertex's direction, given that one.
    pub pdf_reverse: f32,
}

impl<'w> Vertex<'w> {
    /// Whether another path's end can be connected here.
    pub fn is_connectible(&self) -> bool {
        match &self.kind {
            Kind::Camera | Kind::Medium(_) => true,
            Kind::Surface { bsdf, .. } => bsdf.flags().is_non_specular(),
            Kind::Light(_) | Kind::Escaped => false,
        }
    }

    /// The geometric normal; null where there is none.
    pub fn normal(&self) -> Normal3 {
        match &self.kind {
            Kind::Surface { surface, .. } => surface.n,
            Kind::Light(end) => end.n,
            _ => Normal3::default(),
        }
    }

    /// From density per solid angle at another vertex to density per area or volume here; `d` is the unit direction
    /// between them.
    #[inline]
    pub fn area_density(&self, pdf_solid_angle: f32, d: Vec3, distance2: f32) -> f32 {
        self.crossing(pdf_solid_angle / distance2, d)
    }

    /// From density per area perpendicular to `d` to density per area here.
    #[inline]
    pub fn crossing(&self, pdf_perpendicular: f32, d: Vec3) -> f32 {
        let n = self.normal();
        if n == Normal3::default() { pdf_perpendicular } else { pdf_perpendicular * n.abs_dot(d) }
    }

    /// Scattering from the previous vertex towards unit `wi`.
    ///
    /// Light that comes from a lamp scatters with the adjoint of the lobe, which where shading and true normal differ is not
    /// the lobe itself (Veach 1997, 5.3.2).
    pub fn scatter(&self, wi: Vec3, mode: TransportMode) -> Scattered {
        match &self.kind {
            Kind::Surface { surface, frame, bsdf } => {
                let (wo_local, wi_local) = (frame.to_local(self.wo), frame.to_local(wi));
                let (mut value, pdf) = bsdf.eval_and_pdf(wo_local, wi_local, mode);
                if mode == TransportMode::Importance {
                    value *= adjoint_factor(surface.n, self.wo, wi, wo_local.z, wi_local.z);
                }
                let pdf_reverse = if pdf > 0.0 { bsdf.pdf(wi_local, wo_local, mode.flipped()) } else { 0.0 };
                Scattered { value, pdf, pdf_reverse }
            }
            Kind::Medium(phase) => {
                let p = phase.eval(self.wo, wi);
                Scattered { value: Lanes::splat(p), pdf: p, pdf_reverse: p }
            }
            _ => Scattered::default(),
        }
    }

    /// A ray to another vertex's point; it ends just before that. `n` is the normal there.
    pub fn ray_to(&self, other: &Vertex<'_>) -> Ray {
        let o = self.origin(other.p - self.p);
        let end = other.origin(self.p - other.p);
        Ray::between(o, end, self.time)
    }

    /// A ray to a point that lies on no surface, or off it already.
    pub fn ray_to_point(&self, end: Point3) -> Ray {
        let o = self.origin(end - self.p);
        Ray::between(o, end, self.time)
    }

    /// A ray that leaves in direction `d`.
    pub fn ray_along(&self, d: Vec3) -> Ray {
        Ray::new(self.origin(d), d, self.time)
    }

    fn origin(&self, d: Vec3) -> Point3 {
        match &self.kind {
            Kind::Surface { surface, .. } => offset_ray_origin(surface.p, surface.p_error, surface.n, d),
            _ => self.p,
        }
    }

    /// The medium that a ray leaves into.
    pub fn medium_towards(&self, world: &World, d: Vec3) -> Option<Handle<Medium>> {
        match &self.kind {
            Kind::Surface { surface, .. } => world.medium_beyond(surface, d, self.medium),
            Kind::Light(end) => world.medium_of_light(end, d),
            _ => self.medium,
        }
    }

    /// What light is sampled for here.
    pub fn light_context(&self) -> LightContext {
        match &self.kind {
            Kind::Surface { surface, frame, .. } => LightContext::of_surface(surface, frame),
            _ => LightContext::of_point(self.p, self.time),
        }
    }
}

/// What the adjoint lobe has more than the lobe: `|wo ns| |wi ng| / (|wo ng| |wi ns|)`; the local z are the cosines with `ns`.
#[inline]
pub(crate) fn adjoint_factor(ng: Normal3, wo: Vec3, wi: Vec3, wo_ns: f32, wi_ns: f32) -> f32 {
    let denominator = ng.abs_dot(wo) * wi_ns.abs();
    if denominator > 0.0 { wo_ns.abs() * ng.abs_dot(wi) / denominator } else { 0.0 }
}
