//! Plain surfaces side by side: what many paths ask of them in one step, with the bits that each path alone would have got.
//!
//! Plain is what most of most scenes is made of: matte and rough metallic triangles that do not shine. Everything else is left to the
//! functions for one path, and so are textures, which are looked up path by path.

use super::light::LightContext;
use super::looks_at::LooksAt;
use super::surface::{Hit, HitShape};
use super::{CameraRay, CameraSample, MeshPoint, TextureContext, World};
use crate::{Handle, Material, Scattering};
use steradian_bsdf::{Diffuse, RoughConductor};
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_geometry::{Reference, Triangle};
use steradian_math::{Frame, Point2, Ray, RayDifferential, Row, Rows3, Vec3, row_end};
use steradian_spectrum::Wavelengths;

/// For each primitive of the world that is plain, how it scatters.
#[derive(Clone, Debug, Default)]
pub struct PlainSurfaces(Vec<Option<Plain>>);

#[derive(Clone, Copy, Debug)]
struct Plain {
    material: Handle<Material>,
    looks_at: LooksAt,
    /// Whether it takes all of a surface to look up its textures.
    whole: bool,
    /// The reading in RGB mode of what is the same everywhere.
    rgb: Option<PlainLobe>,
}

/// A hit of a plain surface.
#[derive(Clone, Copy, Debug)]
pub struct PlainHit {
    primitive: u32,
    mesh: u32,
    face: u32,
    /// Vertices of the mesh.
    corners: [u32; 3],
    /// Barycentric coordinates.
    b: [f32; 2],
}

/// How a plain surface scatters.
#[derive(Clone, Copy, Debug)]
pub enum PlainLobe {
    /// Of an albedo, which is not black.
    Diffuse(Diffuse),
    /// A rough metal.
    Metal(RoughConductor),
}

/// Points on plain surfaces: what they are made of, and what follows from it.
#[derive(Clone, Debug, Default)]
pub struct PointRows {
    corners: [Rows3; 3],
    normals: [Rows3; 3],
    b: [Row; 2],
    smooth: Row<u32>,
    flipped: Row<u32>,
    /// Direction of the ray.
    d: Rows3,
    /// Position.
    pub p: Rows3,
    /// Bound on its error.
    pub p_error: Rows3,
    /// Geometric normal.
    pub n: Rows3,
    /// The shading frame.
    pub frame: [Rows3; 3],
    /// Direction back along the ray, in that frame.
    pub wo: Rows3,
}

/// One of two, without a branch.
#[inline(always)]
pub(super) fn either(first: bool, a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(if first { a.x } else { b.x }, if first { a.y } else { b.y }, if first { a.z } else { b.z })
}

impl PointRows {
    /// The shading frame at a place.
    #[inline(always)]
    pub fn frame(&self, i: usize) -> Frame {
        let [x, y, z] = &self.frame;
        Frame { x: x.vec(i), y: y.vec(i), z: z.vec(i) }
    }

    /// The point at a place at a time, as light sampling wants it beside lobes.
    #[inline]
    pub fn light_context(&self, i: usize, time: f32) -> LightContext {
        let (p, p_error) = (self.p.point(i), self.p_error.vec(i));
        let reference = Reference { p, p_error, n: self.n.normal(i), ns: self.frame[2].normal(i) };
        LightContext::of_reference(reference, time).beside_lobes()
    }

    /// Works out the first `n` places.
    pub fn work_out(&mut self, level: Level, n: usize) {
        dispatch!(level, _simd => interact(self, n));
    }
}

/// As `TriangleMesh::isotropic_interaction`, and the frame as [`World::shading`] has it.
#[inline(always)]
fn interact(rows: &mut PointRows, n: usize) {
    for i in 0..row_end(n) {
        let triangle = Triangle { p: [rows.corners[0].point(i), rows.corners[1].point(i), rows.corners[2].point(i)] };
        let (b1, b2) = (rows.b[0].0[i], rows.b[1].0[i]);
        let (p, p_error) = triangle.point(b1, b2);
        let flat = triangle.normal().to_vec();
        let [n0, n1, n2] = [rows.normals[0].vec(i), rows.normals[1].vec(i), rows.normals[2].vec(i)];
        let interpolated = n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2;
        let smooth = (rows.smooth.0[i] != 0) & (interpolated.length_squared() > 0.0);
        let flip = (smooth & (flat.dot(interpolated) < 0.0)) | (!smooth & (rows.flipped.0[i] != 0));
        let n = either(flip, -flat, flat);
        let l = interpolated.length();
        let ns = either(smooth & (l > 0.0) & (l < f32::INFINITY), interpolated / l, n);
        let frame = Frame::from_z(ns);
        rows.p.set(i, p);
        rows.p_error.set(i, p_error);
        rows.n.set(i, n);
        rows.frame[0].set(i, frame.x);
        rows.frame[1].set(i, frame.y);
        rows.frame[2].set(i, frame.z);
        rows.wo.set(i, frame.to_local(-rows.d.vec(i)));
    }
}

impl World {
    /// The instruction set that queries use.
    pub fn level(&self) -> Level {
        self.groups[0].accel.level()
    }

    /// As [`World::camera_ray`] for the first `n` film positions, if nothing moves and the lens is a point; `d` is for their directions.
    pub fn camera_rays(
        &self,
        level: Level,
        film: &[Row; 2],
        n: usize,
        d: &mut Rows3,
        mut each: impl FnMut(usize, CameraRay),
    ) -> bool {
        let still = (!self.has_motion).then(|| self.camera.pinhole_rays(level, film, n, d));
        let Some((o, time)) = still.flatten() else { return false };
        for i in 0..n {
            let ray = Ray::new(o, d.vec(i), time);
            let sample = CameraSample { film: Point2::new(film[0].0[i], film[1].0[i]), lens: [0.5, 0.5], time: 0.5 };
            let differential = self.uses_footprints.then(|| self.camera.differential(&sample, &ray));
            each(i, CameraRay { ray, differential, weight: 1.0 });
        }
        true
    }

    /// Which surfaces are plain. Metals are not if they may yet be made rougher.
    pub fn plain_surfaces(&self, regularize: bool) -> PlainSurfaces {
        if self.scene.settings.force_diffuse {
            return PlainSurfaces::default();
        }
        let lobe = |record: &super::group::PrimitiveRecord| {
            let dark = record.first_light.is_none() && record.unsampled_emission.is_none();
            if !(dark && record.is_mesh && record.isotropic) {
                return None;
            }
            let material = &self.scene.materials[record.material].scattering;
            let fits = match material {
                Scattering::Diffuse { .. } => true,
                Scattering::Conductor { .. } => !regularize,
                _ => false,
            };
            let looks_at = fits.then(|| self.scene.scattering_looks_at(material))??;
            if looks_at.varies {
                let whole = looks_at.place || record.footprint;
                return Some(Plain { material: record.material, looks_at, whole, rgb: None });
            }
            let rgb = self.lobe_of(record.material, &TextureContext::default(), &Wavelengths::rgb())?;
            Some(Plain { material: record.material, looks_at, whole: false, rgb: Some(rgb) })
        };
        PlainSurfaces(self.groups[0].primitives.iter().map(lobe).collect())
    }

    /// The lobe of a material at a point; `None` for black and for mirrors.
    #[inline]
    fn lobe_of(&self, material: Handle<Material>, c: &TextureContext, w: &Wavelengths) -> Option<PlainLobe> {
        match &self.scene.materials[material].scattering {
            Scattering::Diffuse { reflectance } => {
                let albedo = self.spectrum_texture(*reflectance, c, w).clamp(0.0, 1.0);
                (!albedo.is_black()).then_some(PlainLobe::Diffuse(Diffuse::new(albedo)))
            }
            Scattering::Conductor { metal, roughness } => {
                let distribution = self.microfacets(roughness, c);
                let (eta, k) = self.metal(metal, c, w);
                (!distribution.is_smooth()).then_some(PlainLobe::Metal(RoughConductor { distribution, eta, k }))
            }
            _ => None,
        }
    }

    /// Which plain triangle has been hit, if it is one: what the look-ups for all hits of a row begin with, so that they wait for memory
    /// together.
    #[inline]
    pub fn plain_triangle(&self, plain: &PlainSurfaces, hit: &Hit) -> Option<PlainHit> {
        let HitShape::Triangle { id, b1, b2 } = hit.shape else { return None };
        if hit.group != 0 {
            return None;
        }
        let group = &self.groups[0];
        let primitive = group.primitive_of_triangle[id as usize];
        plain.0.get(primitive as usize)?.as_ref()?;
        let record = &group.primitives[primitive as usize];
        let face = id - record.first_triangle;
        let mesh = &self.scene.triangle_meshes[Handle::from_index(record.mesh as usize)];
        Some(PlainHit { primitive, mesh: record.mesh, face, corners: mesh.indices[face as usize], b: [b1, b2] })
    }

    /// The lobe where a ray has met a plain surface; `None` where it is not so plain after all.
    #[inline]
    pub fn plain_lobe(
        &self,
        plain: &PlainSurfaces,
        (at, hit): (&PlainHit, &Hit),
        (ray, differential): (&Ray, Option<&RayDifferential>),
        w: &Wavelengths,
    ) -> Option<PlainLobe> {
        let plain = plain.0.get(at.primitive as usize)?.as_ref()?;
        if !plain.looks_at.varies {
            return if w.is_rgb() { plain.rgb } else { self.lobe_of(plain.material, &TextureContext::default(), w) };
        }
        let context = if plain.whole {
            let mut surface = self.surface(ray, hit);
            self.measure(&mut surface, ray, differential);
            self.texture_context(&surface)
        } else {
            let PlainHit { mesh, face, corners, b, .. } = *at;
            let uv = self.scene.triangle_meshes[Handle::from_index(mesh as usize)].uv_between(corners, b[0], b[1]);
            TextureContext { uv, on_mesh: Some(MeshPoint { mesh, face, b }), ..TextureContext::default() }
        };
        self.lobe_of(plain.material, &context, w)
    }

    /// Puts a hit of a plain surface by a ray of direction `d` into a place.
    #[inline]
    pub fn place_hit(&self, at: &PlainHit, d: Vec3, rows: &mut PointRows, i: usize) {
        let mesh = &self.scene.triangle_meshes[Handle::from_index(at.mesh as usize)];
        let smooth = !mesh.normals.is_empty();
        for (k, v) in at.corners.into_iter().enumerate() {
            rows.corners[k].set(i, mesh.positions[v as usize]);
            if smooth {
                rows.normals[k].set(i, mesh.normals[v as usize]);
            }
        }
        rows.b[0].0[i] = at.b[0];
        rows.b[1].0[i] = at.b[1];
        rows.smooth.0[i] = u32::from(smooth);
        rows.flipped.0[i] = u32::from(mesh.flip && !smooth);
        rows.d.set(i, d);
    }
}
