//! A point where a ray met the scene: geometry, where it leads, and what surrounds it.

use super::World;
use super::light::LightSample;
use crate::Handle;
use std::ops::Deref;
use steradian_bsdf::{LobeSample, Lobes};
use steradian_geometry::{AccelHit, CurveHit, HitKind, QuadricHit, SurfaceHit};
use steradian_math::{Frame, Ray, RayDifferential, Transform, Vec2, Vec3, difference_of_products, offset_ray_origin};

/// What intersection remembers of the nearest hit: enough to work out the rest once.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    pub(super) shape: HitShape,
    /// Index into the groups: 0 is the world, others are instanced objects.
    pub(super) group: u32,
    /// Index into the instances, where the group is an object.
    pub(super) instance: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum HitShape {
    Triangle { id: u32, b1: f32, b2: f32 },
    Patch { primitive: u32, face: u32, u: f32, v: f32 },
    Quadric { primitive: u32, index: u32, hit: QuadricHit },
    Curve { primitive: u32, set: u32, piece: u32, hit: CurveHit },
    Cell { primitive: u32, grid: u32, cell: u32 },
}

impl Hit {
    /// What the tree of a group has found; `last` is the last hit of one of its others.
    #[inline(always)]
    pub(super) fn of(hit: AccelHit, group: u32, last: Option<Self>) -> Option<Self> {
        match hit.kind {
            HitKind::Triangle => {
                let shape = HitShape::Triangle { id: hit.id, b1: hit.b1, b2: hit.b2 };
                Some(Self { t: hit.t, shape, group, instance: 0 })
            }
            HitKind::Other => last,
        }
    }
}

/// The size of a sample on the surface: how position and coordinates change to the next sample in x and in y.
#[derive(Clone, Copy, Debug, Default)]
pub struct Footprint {
    /// Change of position in x.
    pub dpdx: Vec3,
    /// Change of position in y.
    pub dpdy: Vec3,
    /// Change of (u, v) in x.
    pub duv_dx: Vec2,
    /// Change of (u, v) in y.
    pub duv_dy: Vec2,
}

/// A point on a surface in world space. Dereferences to its geometry.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position, normals, derivatives.
    pub geometry: SurfaceHit,
    /// Unit direction back along the ray.
    pub wo: Vec3,
    /// Time of the ray.
    pub time: f32,
    /// Footprint; zero until [`World::shading`] has worked it out, and where nothing needs it.
    pub footprint: Footprint,
    /// The number of the light that the surface is, if it can be sampled.
    pub light: Option<u32>,
    /// Which primitive of the group.
    pub primitive: u32,
    /// The group: 0 for the world itself, others for instanced objects.
    pub group: u32,
    /// The instance, where the group is an object.
    pub instance: Option<u32>,
    /// Which face of its mesh.
    pub(super) element: u32,
    /// Barycentric or patch coordinates.
    pub coordinates: [f32; 2],
    /// Which area light, and its factor.
    pub(super) emission: Option<(u32, f32)>,
}

impl Deref for Surface {
    type Target = SurfaceHit;
    #[inline]
    fn deref(&self) -> &SurfaceHit {
        &self.geometry
    }
}

impl Surface {
    /// Whether the surface shines.
    #[inline]
    pub fn is_emitter(&self) -> bool {
        self.emission.is_some()
    }

    /// A ray that leaves in direction `w`.
    #[inline]
    pub fn spawn_ray(&self, w: Vec3) -> Ray {
        self.geometry.spawn(w, self.time)
    }

    /// The ray that goes on through the surface unchanged.
    #[inline]
    pub fn continue_ray(&self, ray: &Ray) -> Ray {
        self.geometry.spawn(ray.d, self.time)
    }

    /// The ray to a sampled light. Both ends are moved off their surfaces; it ends just before the light.
    #[inline]
    pub fn shadow_ray(&self, sample: &LightSample) -> Ray {
        let o = offset_ray_origin(self.p, self.p_error, self.n, sample.wi);
        if sample.distance == f32::INFINITY {
            return Ray::new(o, sample.wi, self.time);
        }
        Ray::between(o, sample.end, self.time)
    }

    /// The differential of a ray scattered specularly to `wi` (Igehy 1999; Suykens and Willems 2001); `None` where it
    /// would not be one ray: then the footprint is taken from the camera.
    pub fn scattered_differential(
        &self,
        ray: &Ray,
        d: &RayDifferential,
        frame: &Frame,
        wi: Vec3,
        sample: &LobeSample,
    ) -> Option<RayDifferential> {
        if !sample.flags.contains(Lobes::SPECULAR) {
            return None;
        }
        let f = &self.footprint;
        let wo = -ray.d;
        let mut n = frame.z;
        let along = |c: Vec2| self.shading.dndu.to_vec() * c.x + self.shading.dndv.to_vec() * c.y;
        let (mut dndx, mut dndy) = (along(f.duv_dx), along(f.duv_dy));
        let (dwodx, dwody) = (-d.rx_d - wo, -d.ry_d - wo);
        let (rx_o, ry_o) = (self.p + f.dpdx, self.p + f.dpdy);
        let out = if sample.flags.contains(Lobes::REFLECTION) {
            let turned = |dwo: Vec3, dn: Vec3| wi - dwo + (dn * wo.dot(n) + n * (dwo.dot(n) + wo.dot(dn))) * 2.0;
            RayDifferential { rx_o, ry_o, rx_d: turned(dwodx, dndx), ry_d: turned(dwody, dndy) }
        } else {
            if wo.dot(n) < 0.0 {
                (n, dndx, dndy) = (-n, -dndx, -dndy);
            }
            let eta = 1.0 / sample.eta;
            let (cos_o, cos_i) = (wo.dot(n), wi.dot(n));
            let mu = eta * cos_o - cos_i.abs();
            let turned = |dwo: Vec3, dn: Vec3| {
                let dcos = dwo.dot(n) + wo.dot(dn);
                let dmu = dcos * (eta + eta * eta * cos_o / cos_i);
                wi - dwo * eta + dn * mu + n * dmu
            };
            RayDifferential { rx_o, ry_o, rx_d: turned(dwodx, dndx), ry_d: turned(dwody, dndy) }
        };
        // After grazing bounces the first order says nothing any more.
        const LIMIT: f32 = 1e16;
        let sane = |v: Vec3| v.length_squared() < LIMIT;
        (sane(out.rx_d) && sane(out.ry_d) && sane(out.rx_o.to_vec()) && sane(out.ry_o.to_vec())).then_some(out)
    }
}

impl World {
    /// Everything about a hit.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let group = &self.groups[hit.group as usize];
        let (primitive, element, coordinates, mut geometry) = match hit.shape {
            HitShape::Triangle { id, b1, b2 } => {
                let primitive = group.primitive_of_triangle[id as usize];
                let p = &group.primitives[primitive as usize];
                let face = id - p.first_triangle;
                let mesh = &self.scene.triangle_meshes[Handle::from_index(p.mesh as usize)];
                let geometry = if p.isotropic {
                    let mut geometry = mesh.isotropic_interaction(face as usize, b1, b2);
                    if p.footprint {
                        [geometry.dpdu, geometry.dpdv] = mesh.position_derivatives(face as usize);
                    }
                    geometry
                } else {
                    mesh.interaction(face as usize, b1, b2)
                };
                (primitive, face, [b1, b2], geometry)
            }
            HitShape::Patch { primitive, face, u, v } => {
                let p = &group.primitives[primitive as usize];
                let mesh = &self.scene.bilinear_meshes[Handle::from_index(p.mesh as usize)];
                (primitive, face, [u, v], mesh.interaction(face as usize, u, v))
            }
            HitShape::Quadric { primitive, index, hit } => {
                (primitive, 0, [0.0; 2], group.quadrics[index as usize].interaction(&hit))
            }
            HitShape::Curve { primitive, set, piece, hit: curve } => {
                let local = self.ray_in_group(ray, hit);
                let p = group.curves[set as usize].interaction(piece, &local, &curve);
                (primitive, 0, [curve.u, curve.v], p)
            }
            HitShape::Cell { primitive, grid, cell } => {
                let local = self.ray_in_group(ray, hit);
                let p = group.distances[grid as usize].interaction(&self.scene, cell, &local, hit.t);
                (primitive, 0, [0.0; 2], p)
            }
        };
        let instance = (hit.group != 0).then_some(hit.instance);
        if let Some(i) = instance {
            let t: Transform = self.instances[i as usize].world_from_object.at(ray.time);
            geometry = geometry.transformed(&t);
        }
        let record = &group.primitives[primitive as usize];
        let own = instance.map_or(0, |i| self.instances[i as usize].first_light);
        let light = record.first_light.map(|first| own + first + element);
        let emission = match light {
            Some(id) => {
                let e = &self.lights.emitters[id as usize];
                Some((e.emission, e.scale))
            }
            None => record.unsampled_emission,
        };
        let length2 = ray.d.length_squared();
        let wo = if (length2 - 1.0).abs() < 1e-6 { -ray.d } else { -ray.d.normalize() };
        Surface {
            geometry,
            wo,
            time: ray.time,
            footprint: Footprint::default(),
            light,
            primitive,
            group: hit.group,
            instance,
            element,
            coordinates,
            emission,
        }
    }

    /// The ray in the space of the group that it hit.
    fn ray_in_group(&self, ray: &Ray, hit: &Hit) -> Ray {
        match hit.group {
            0 => *ray,
            _ => self.instances[hit.instance as usize].world_from_object.at(ray.time).inverse().ray(ray),
        }
    }

    /// How far a point of a surface moves over the picture while the shutter is open, in pixels; y down. Zero where that is
    /// not known.
    pub fn raster_motion(&self, surface: &Surface) -> Vec2 {
        if !self.has_motion {
            return Vec2::default();
        }
        let [open, close] = self.camera.shutter();
        let at = |time: f32| {
            let p = match surface.instance {
                None => surface.p,
                Some(i) => {
                    let moving = &self.instances[i as usize].world_from_object;
                    moving.at(time).point(moving.at(surface.time).inverse().point(surface.p))
                }
            };
            self.camera.raster(p, time)
        };
        match (at(open), at(close)) {
            (Some(a), Some(b)) => b - a,
            _ => Vec2::default(),
        }
    }

    /// Works out the footprint of the sample at a surface, if anything there asks for it.
    #[inline]
    pub(super) fn measure(&self, surface: &mut Surface, ray: &Ray, differential: Option<&RayDifferential>) {
        if self.groups[surface.group as usize].primitives[surface.primitive as usize].footprint {
            surface.footprint = self.footprint(surface, ray, differential);
        }
    }

    /// The footprint of the sample at a surface: from the differential where there is one, else as if seen from the
    /// camera.
    pub(super) fn footprint(&self, surface: &Surface, ray: &Ray, differential: Option<&RayDifferential>) -> Footprint {
        if self.scene.settings.disable_texture_filtering {
            return Footprint::default();
        }
        let n = surface.n;
        let (dpdx, dpdy) = match differential.filter(|d| n.dot(d.rx_d) != 0.0 && n.dot(d.ry_d) != 0.0) {
            Some(d) => {
                // Where the neighbouring rays meet the tangent plane.
                let plane =
                    |o: steradian_math::Point3, w: Vec3| o + w * ((surface.p - o).dot(n) / n.dot(w)) - surface.p;
                (plane(d.rx_o, d.rx_d), plane(d.ry_o, d.ry_d))
            }
            None => self.camera.approximate_footprint(surface.p, n, ray.time),
        };
        // Least squares for (du, dv): the position has three equations for two unknowns.
        let (u, v) = (surface.dpdu, surface.dpdv);
        let (a00, a01, a11) = (u.dot(u), u.dot(v), v.dot(v));
        let det = 1.0 / difference_of_products(a00, a11, a01, a01);
        let det = if det.is_finite() { det } else { 0.0 };
        let solve = |dp: Vec3| {
            let (b0, b1) = (u.dot(dp), v.dot(dp));
            let du = difference_of_products(a11, b0, a01, b1) * det;
            let dv = difference_of_products(a00, b1, a01, b0) * det;
            let sane = |x: f32| if x.is_finite() { x.clamp(-1e8, 1e8) } else { 0.0 };
            Vec2::new(sane(du), sane(dv))
        };
        Footprint { dpdx, dpdy, duv_dx: solve(dpdx), duv_dy: solve(dpdy) }
    }
}
