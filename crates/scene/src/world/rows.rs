//! Plain surfaces and lamps side by side: what many paths ask of them in one step, with the bits that each path alone would have got.
//!
//! Plain is what most of most scenes is made of: matte and rough metallic triangles that do not shine, and triangles that do, seen from
//! some way off. Everything else is left to the functions for one path, and so are textures, which are looked up path by path.

use super::light::{EmitterShape, LightContext, LightSample, PickRows};
use super::looks_at::LooksAt;
use super::surface::{Hit, HitShape};
use super::{CameraRay, CameraSample, MeshPoint, TextureContext, World};
use crate::{Handle, Material, Metal, Scattering, SpectrumTexture};
use steradian_bsdf::{Diffuse, RoughConductor};
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_geometry::{PreparedTriangle, Reference, Triangle};
use steradian_math::{Frame, ONE_MINUS_EPSILON, Point2, Ray, Row, Rows3, Vec3, offset_ray_origin, row_end};
use steradian_sampling::warp::square_to_uniform_triangle;
use steradian_spectrum::{LaneRows, Wavelengths};

/// For each primitive of the world that is plain, how it scatters.
#[derive(Clone, Debug, Default)]
pub struct PlainSurfaces(Vec<Option<Plain>>);

#[derive(Clone, Copy, Debug)]
struct Plain {
    material: Handle<Material>,
    looks_at: LooksAt,
    /// The reading in RGB mode of what is the same everywhere.
    rgb: Option<PlainLobe>,
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

/// Samples of lights.
#[derive(Clone, Debug, Default)]
pub struct LightRows {
    corners: [Rows3; 3],
    n: Rows3,
    p_error: Rows3,
    inv_area: Row,
    u: [Row; 2],
    probability: Row,
    two_sided: Row<u32>,
    picks: PickRows,
    far: Vec<(usize, LightSample)>,
    /// Whether there is any light.
    pub lit: Row<u32>,
    /// See [`LightSample`].
    pub radiance: LaneRows,
    /// Unit direction to the light.
    pub wi: Rows3,
    /// The end of the shadow ray; without meaning if `infinite`.
    pub end: Rows3,
    /// Density per solid angle times the probability of the light.
    pub pdf: Row,
    /// Whether the light cannot be hit by chance.
    pub is_delta: Row<u32>,
    /// Whether the shadow ray has no end.
    pub infinite: Row<u32>,
}

/// One of two, without a branch.
#[inline(always)]
fn either(first: bool, a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(if first { a.x } else { b.x }, if first { a.y } else { b.y }, if first { a.z } else { b.z })
}

impl PointRows {
    /// The shading frame at a place.
    #[inline(always)]
    pub fn frame(&self, i: usize) -> Frame {
        let [x, y, z] = &self.frame;
        Frame { x: x.vec(i), y: y.vec(i), z: z.vec(i) }
    }

    /// The point at a place, as light sampling wants it beside lobes.
    #[inline]
    pub fn light_context(&self, i: usize) -> LightContext {
        let (p, p_error) = (self.p.point(i), self.p_error.vec(i));
        LightContext::of_reference(Reference { p, p_error, n: self.n.normal(i), ns: self.frame[2].normal(i) })
            .beside_lobes()
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

/// Points on lamps, and their densities, as `PreparedTriangle` and `World::sample_light` have them.
#[inline(always)]
fn illuminate(rows: &mut LightRows, from: &Rows3, n: usize) {
    for i in 0..row_end(n) {
        let [b0, b1, b2] = square_to_uniform_triangle([rows.u[0].0[i], rows.u[1].0[i]]);
        let [q0, q1, q2] = [rows.corners[0].point(i), rows.corners[1].point(i), rows.corners[2].point(i)];
        let p = q0 * b0 + q1 * b1 + q2 * b2;
        let n = rows.n.normal(i);
        let d = p - from.point(i);
        let pdf = PreparedTriangle::density(rows.inv_area.0[i], n, d);
        let wi = d * (1.0 / d.length());
        let behind = n.dot(-wi) <= 0.0;
        let lit = (pdf > 0.0) & (pdf < f32::INFINITY) & ((rows.two_sided.0[i] != 0) | !behind);
        rows.lit.0[i] &= u32::from(lit);
        rows.wi.set(i, wi);
        rows.end.set(i, offset_ray_origin(p, rows.p_error.vec(i), n, -wi));
        rows.pdf.0[i] = pdf * rows.probability.0[i];
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
        if self.scene.settings.force_diffuse || self.uses_footprints {
            return PlainSurfaces::default();
        }
        let lobe = |record: &super::group::PrimitiveRecord| {
            let dark = record.first_light.is_none() && record.unsampled_emission.is_none();
            if !(dark && record.is_mesh && record.isotropic) {
                return None;
            }
            let material = &self.scene.materials[record.material].scattering;
            let of = |t: Handle<SpectrumTexture>| self.scene.spectrum_looks_at(t);
            let looks_at = match material {
                Scattering::Diffuse { reflectance } => of(*reflectance),
                Scattering::Conductor { metal, roughness } if !regularize => {
                    let of_metal = match metal {
                        Metal::Ior { eta, k } => of(*eta) | of(*k),
                        Metal::Reflectance(r) => of(*r),
                    };
                    of_metal | self.scene.float_looks_at(roughness.u)
                }
                _ => return None,
            };
            if looks_at.varies {
                return Some(Plain { material: record.material, looks_at, rgb: None });
            }
            let rgb = self.lobe_of(record.material, &TextureContext::default(), &Wavelengths::rgb())?;
            Some(Plain { material: record.material, looks_at, rgb: Some(rgb) })
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

    /// The lobe where a ray has met a surface, if that is plain.
    #[inline]
    pub fn plain_lobe(&self, plain: &PlainSurfaces, hit: &Hit, ray: &Ray, w: &Wavelengths) -> Option<PlainLobe> {
        let HitShape::Triangle { id, b1, b2 } = hit.shape else { return None };
        if hit.group != 0 {
            return None;
        }
        let primitive = self.groups[0].primitive_of_triangle[id as usize];
        let plain = plain.0.get(primitive as usize)?.as_ref()?;
        if !plain.looks_at.varies {
            let anywhere = || self.lobe_of(plain.material, &TextureContext::default(), w);
            return if w.is_rgb() { plain.rgb } else { anywhere() };
        }
        let context = if plain.looks_at.place {
            self.texture_context(&self.surface(ray, hit))
        } else {
            let record = &self.groups[0].primitives[primitive as usize];
            let face = id - record.first_triangle;
            let mesh = &self.scene.triangle_meshes[Handle::from_index(record.mesh as usize)];
            let on_mesh = Some(MeshPoint { mesh: record.mesh, face, b: [b1, b2] });
            TextureContext { uv: mesh.uv(face as usize, b1, b2), on_mesh, ..TextureContext::default() }
        };
        self.lobe_of(plain.material, &context, w)
    }

    /// Puts a hit of a plain surface by a ray of direction `d` into a place.
    #[inline]
    pub fn place_hit(&self, hit: &Hit, d: Vec3, rows: &mut PointRows, i: usize) {
        let HitShape::Triangle { id, b1, b2 } = hit.shape else { return };
        let group = &self.groups[0];
        let record = &group.primitives[group.primitive_of_triangle[id as usize] as usize];
        let mesh = &self.scene.triangle_meshes[Handle::from_index(record.mesh as usize)];
        let corners = mesh.indices[(id - record.first_triangle) as usize];
        let smooth = !mesh.normals.is_empty();
        for (k, v) in corners.into_iter().enumerate() {
            rows.corners[k].set(i, mesh.positions[v as usize]);
            if smooth {
                rows.normals[k].set(i, mesh.normals[v as usize]);
            }
        }
        rows.b[0].0[i] = b1;
        rows.b[1].0[i] = b2;
        rows.smooth.0[i] = u32::from(smooth);
        rows.flipped.0[i] = u32::from(mesh.flip && !smooth);
        rows.d.set(i, d);
    }

    /// Samples light for `contexts`, which are the first places of the points: as [`World::sample_light`].
    pub fn sample_lights<'a>(
        &self,
        level: Level,
        (contexts, points): (&[LightContext], &PointRows),
        u: &Row,
        u2: &[Row; 2],
        wavelengths: impl Fn(usize) -> &'a Wavelengths,
        rows: &mut LightRows,
    ) {
        rows.far.clear();
        let together = self.pick_lights(level, (&points.p, &points.frame[2]), &u2[0], contexts.len(), &mut rows.picks);
        for (i, context) in contexts.iter().enumerate() {
            rows.lit.0[i] = 0;
            let pick = if together { rows.picks.pick(i) } else { self.pick_light(context, u2[0].0[i]) };
            let Some(pick) = pick else { continue };
            let x = pick.u + u.0[i] * (0.5 * f32::EPSILON) / pick.probability;
            let u = [x.min(ONE_MINUS_EPSILON), u2[1].0[i]];
            let w = wavelengths(i);
            if !self.place_lamp(context, pick.light, w, rows, i) {
                let sample = self.sample_picked(context, pick.light, pick.probability, u, w);
                rows.far.extend(sample.map(|s| (i, s)));
                continue;
            }
            (rows.u[0].0[i], rows.u[1].0[i]) = (u[0], u[1]);
            rows.probability.0[i] = pick.probability;
        }
        let n = contexts.len();
        dispatch!(level, _simd => illuminate(rows, &points.p, n));
        for k in 0..rows.far.len() {
            let (i, s) = rows.far[k];
            rows.lit.0[i] = 1;
            rows.radiance.set(i, s.radiance);
            rows.wi.set(i, s.wi);
            rows.end.set(i, s.end.to_vec());
            rows.pdf.0[i] = s.pdf;
            rows.is_delta.0[i] = u32::from(s.is_delta);
            rows.infinite.0[i] = u32::from(s.distance == f32::INFINITY);
        }
    }

    /// Puts a triangle that shines evenly and is far away into a place; `false` if the light is anything else.
    #[inline]
    fn place_lamp(&self, context: &LightContext, light: u32, w: &Wavelengths, rows: &mut LightRows, i: usize) -> bool {
        let Some(emitter) = self.lights.emitters.get(light as usize) else { return false };
        let (EmitterShape::Triangle(..), Some(triangle)) = (emitter.shape, &emitter.prepared) else { return false };
        let emission = &self.area_lights[emitter.emission as usize];
        if emission.image.is_some() || emission.texture.is_some() || !triangle.is_far(context.position()) {
            return false;
        }
        for (row, p) in rows.corners.iter_mut().zip(triangle.corners()) {
            row.set(i, p);
        }
        rows.n.set(i, triangle.normal());
        rows.p_error.set(i, triangle.p_error());
        rows.inv_area.0[i] = triangle.inv_area();
        rows.two_sided.0[i] = u32::from(emission.two_sided);
        let radiance = emission.radiance.eval(w) * emitter.scale;
        rows.radiance.set(i, radiance);
        rows.lit.0[i] = u32::from(!radiance.is_black());
        rows.is_delta.0[i] = 0;
        rows.infinite.0[i] = 0;
        true
    }
}
