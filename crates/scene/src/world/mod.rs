//! The world: a scene with everything that is derived from it once. Immutable, `Sync`, without locks.

mod build;
mod camera;
mod displacement;
mod grid_texture;
mod group;
mod lamp_rows;
mod lens;
mod light;
mod looks_at;
mod medium;
mod noise;
mod plastic;
mod reception;
mod rows;
mod shading;
mod subsurface;
mod surface;
mod texture;
mod view;

pub use camera::{CameraModel, CameraSample, DIFFERENTIAL_SCALE};
pub use lamp_rows::LightRows;
pub use light::{Emission, LightContext, LightEnd, LightPoint, LightSample, SkyRows};
pub(crate) use light::{mean_intensity, projected_luminance};
pub use medium::{Collision, FreeFlight, MediumPoint, MediumRay};
pub use reception::Reception;
pub use rows::{PlainHit, PlainLobe, PlainSurfaces, PointRows};
pub use shading::Shading;
pub use surface::{Footprint, Hit, Surface};
pub use texture::{MeshPoint, TextureContext};

use crate::{AreaLight, RenderSettings, Scene};
use group::{Group, Other};
use light::Lights;
use medium::BuiltMedium;
use std::cell::Cell;
use steradian_geometry::{NoTally, RayRows, Tally};
use steradian_image::{Pyramid, Texels};
use steradian_math::{AnimatedTransform, Bounds3, Ray, RayDifferential};
use steradian_sampling::rng::hash_f32;
use surface::HitShape;

/// An object in its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorldInstance {
    group: u32,
    world_from_object: AnimatedTransform,
    /// The number of the first light of its own, which those of the group's primitives add to.
    first_light: u32,
}

/// A camera ray with the rays of its neighbours, where textures care.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// Its neighbours.
    pub differential: Option<RayDifferential>,
    /// What radiance along the ray counts; zero where the lens lets nothing through, one without real lenses.
    pub weight: f32,
}

/// A scene ready to be rendered.
#[derive(Clone, Debug)]
pub struct World {
    scene: Scene,
    groups: Vec<Group>,
    instances: Vec<WorldInstance>,
    pyramids: Vec<Option<Pyramid>>,
    camera: CameraModel,
    area_lights: Vec<AreaLight>,
    lights: Lights,
    media: Vec<BuiltMedium>,
    needs_one_wavelength: bool,
    bounds: Bounds3,
    diffusion: subsurface::DiffusionTables,
    plastics: plastic::PlasticTables,
    has_motion: bool,
    uses_footprints: bool,
    has_interfaces: bool,
}

/// Numbers that describe a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Primitives, those of instanced objects once.
    pub primitives: usize,
    /// Triangles, those of instanced objects once.
    pub triangles: usize,
    /// Triangles as the camera could see them: counted for every instance.
    pub instanced_triangles: usize,
    /// Quadrics, patches, and pieces of curves.
    pub other_shapes: usize,
    /// Instances after flattening.
    pub instances: usize,
    /// Lights, each triangle of a mesh for itself.
    pub lights: usize,
    /// Triangles without area, which were left out.
    pub degenerate: usize,
    /// Bytes of trees and tables.
    pub tree_bytes: usize,
    /// Bytes of meshes.
    pub mesh_bytes: usize,
    /// Bytes of memory of pictures and their pyramids.
    pub image_bytes: usize,
    /// Bytes of those in a scratch file.
    pub scratch_bytes: usize,
    /// Bytes of the grids of media.
    pub medium_bytes: usize,
}

impl World {
    /// The scene that this was built from, its meshes moved to where they belong.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The settings to render by.
    #[inline]
    pub fn settings(&self) -> &RenderSettings {
        &self.scene.settings
    }

    /// The camera.
    #[inline]
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// A box around everything finite.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Whether anything moves while the shutter is open.
    #[inline]
    pub fn has_motion(&self) -> bool {
        self.has_motion
    }

    /// Whether there are surfaces that only separate media, so that light goes straight through.
    #[inline]
    pub fn has_interfaces(&self) -> bool {
        self.has_interfaces
    }

    /// The ray for a film position, with differentials if any texture will ask for them.
    #[inline]
    pub fn camera_ray(&self, sample: &CameraSample) -> CameraRay {
        let (ray, weight) = self.camera.weighted_ray(sample);
        let differential = self.uses_footprints.then(|| self.camera.differential(sample, &ray));
        CameraRay { ray, differential, weight }
    }

    /// Counts what is there.
    pub fn census(&self) -> Census {
        let triangles = |g: &Group| g.primitive_of_triangle.len();
        Census {
            primitives: self.groups.iter().map(|g| g.primitives.len()).sum(),
            triangles: self.groups.iter().map(triangles).sum(),
            instanced_triangles: triangles(&self.groups[0])
                + self.instances.iter().map(|i| triangles(&self.groups[i.group as usize])).sum::<usize>(),
            other_shapes: self
                .groups
                .iter()
                .map(|g| g.others.iter().filter(|o| !matches!(o, Other::Instance(_))).count())
                .sum(),
            instances: self.instances.len(),
            lights: self.light_count(),
            degenerate: self.groups.iter().map(|g| g.accel.dropped()).sum(),
            tree_bytes: self.groups.iter().map(Group::byte_size).sum(),
            mesh_bytes: self
                .scene
                .triangle_meshes
                .iter()
                .map(|m| {
                    size_of_val(m.positions.as_slice())
                        + size_of_val(m.normals.as_slice())
                        + size_of_val(m.tangents.as_slice())
                        + size_of_val(m.uvs.as_slice())
                        + size_of_val(m.indices.as_slice())
                })
                .sum(),
            image_bytes: self.pictures(Pyramid::memory, Texels::memory),
            scratch_bytes: self.pictures(Pyramid::bytes, Texels::bytes)
                - self.pictures(Pyramid::memory, Texels::memory),
            medium_bytes: self.medium_bytes(),
        }
    }

    fn pictures(&self, of_pyramid: fn(&Pyramid) -> usize, of_texels: fn(&Texels) -> usize) -> usize {
        self.pyramids.iter().flatten().map(of_pyramid).sum::<usize>()
            + self.scene.images.iter().map(|i| of_texels(&i.texels)).sum::<usize>()
    }

    /// The nearest surface that a ray meets.
    ///
    /// Hits at equal distance are told apart by number, so the answer does not depend on the order of traversal.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_group(0, ray, &NoTally)
    }

    /// As [`World::intersect`], counting intersection tests.
    pub fn intersect_counted(&self, ray: &Ray, tally: &impl Tally) -> Option<Hit> {
        self.intersect_group(0, ray, tally)
    }

    /// As [`World::intersect`] for many rays, which have been [prepared](RayRows::prepare): appends the answers to `hits`.
    pub fn intersect_rows(&self, rays: &RayRows, hits: &mut Vec<Option<Hit>>) {
        let group = &self.groups[0];
        let last = Cell::new(None);
        group.accel.closest_rows(
            rays,
            |id, ray| {
                let hit = self.intersect_other(0, group, group.others[id as usize], ray, &NoTally)?;
                last.set(Some(hit));
                Some(hit.t)
            },
            |id, _, b1, b2| self.triangle_is_there(group, id, b1, b2),
            |_, hit| hits.push(hit.and_then(|hit| Hit::of(hit, 0, last.get()))),
        );
    }

    fn intersect_group<T: Tally>(&self, group_index: u32, ray: &Ray, tally: &T) -> Option<Hit> {
        let group = &self.groups[group_index as usize];
        let mut last: Option<Hit> = None;
        let hit = group.accel.closest_counted(
            ray,
            |id, ray| {
                let hit = self.intersect_other(group_index, group, group.others[id as usize], ray, tally)?;
                last = Some(hit);
                Some(hit.t)
            },
            |id, _, b1, b2| self.triangle_is_there(group, id, b1, b2),
            tally,
        )?;
        Hit::of(hit, group_index, last)
    }

    fn intersect_other<T: Tally>(
        &self,
        group_index: u32,
        group: &Group,
        other: Other,
        ray: &Ray,
        tally: &T,
    ) -> Option<Hit> {
        match other {
            Other::Instance(i) => {
                let instance = &self.instances[i as usize];
                let local = instance.world_from_object.at(ray.time).inverse().ray(ray);
                let mut hit = self.intersect_group(instance.group, &local, tally)?;
                hit.instance = i;
                Some(hit)
            }
            Other::Quadric { primitive, index } => {
                let quadric = &group.quadrics[index as usize];
                let mut along = *ray;
                let mut passed = 0.0;
                // A hit that alpha makes a hole of: go on behind it.
                loop {
                    let mut hit = quadric.intersect(&along)?;
                    let there = group.primitives[primitive as usize].alpha.is_none() || {
                        let p = quadric.interaction(&hit);
                        self.is_there(group, primitive, (index, None), &p)
                    };
                    if there {
                        hit.t += passed;
                        let shape = HitShape::Quadric { primitive, index, hit };
                        return (hit.t <= ray.t_max).then_some(Hit {
                            t: hit.t,
                            shape,
                            group: group_index,
                            instance: 0,
                        });
                    }
                    let next = quadric.interaction(&hit).spawn(ray.d, ray.time);
                    passed += hit.t;
                    along = Ray { t_max: ray.t_max - passed, ..next };
                }
            }
            Other::Patch { primitive, face } => {
                let record = &group.primitives[primitive as usize];
                let mesh = &self.scene.bilinear_meshes[crate::Handle::from_index(record.mesh as usize)];
                let hit = mesh.patch(face as usize).intersect(ray)?;
                if record.alpha.is_some() {
                    let p = mesh.interaction(face as usize, hit.u, hit.v);
                    if !self.is_there(group, primitive, (face, None), &p) {
                        return None;
                    }
                }
                let shape = HitShape::Patch { primitive, face, u: hit.u, v: hit.v };
                Some(Hit { t: hit.t, shape, group: group_index, instance: 0 })
            }
            Other::Curve { primitive, set, piece } => {
                let curves = &group.curves[set as usize];
                let hit = curves.intersect(piece, ray)?;
                if group.primitives[primitive as usize].alpha.is_some() {
                    let p = curves.interaction(piece, ray, &hit);
                    if !self.is_there(group, primitive, (piece, None), &p) {
                        return None;
                    }
                }
                let shape = HitShape::Curve { primitive, set, piece, hit };
                Some(Hit { t: hit.t, shape, group: group_index, instance: 0 })
            }
            Other::Cell { primitive, grid, cell } => {
                let distances = &group.distances[grid as usize];
                let t = distances.intersect(&self.scene, cell, ray)?;
                if group.primitives[primitive as usize].alpha.is_some() {
                    let p = distances.interaction(&self.scene, cell, ray, t);
                    if !self.is_there(group, primitive, (cell, None), &p) {
                        return None;
                    }
                }
                Some(Hit { t, shape: HitShape::Cell { primitive, grid, cell }, group: group_index, instance: 0 })
            }
        }
    }

    /// Whether anything is in the way of a ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_in_group(0, ray, &NoTally)
    }

    /// As [`World::occluded`], counting intersection tests.
    pub fn occluded_counted(&self, ray: &Ray, tally: &impl Tally) -> bool {
        self.occluded_in_group(0, ray, tally)
    }

    /// As [`World::occluded`] for many rays, which have been [prepared](RayRows::prepare): bit `i` of the result answers ray `i`.
    pub fn occluded_rows(&self, rays: &RayRows) -> u64 {
        let group = &self.groups[0];
        group.accel.any_rows(
            rays,
            |id, ray| self.occluded_by(0, group, id, ray, &NoTally),
            |id, _, b1, b2| self.triangle_is_there(group, id, b1, b2),
        )
    }

    fn occluded_in_group<T: Tally>(&self, group_index: u32, ray: &Ray, tally: &T) -> bool {
        let group = &self.groups[group_index as usize];
        group.accel.any_counted(
            ray,
            |id, ray| self.occluded_by(group_index, group, id, ray, tally),
            |id, _, b1, b2| self.triangle_is_there(group, id, b1, b2),
            tally,
        )
    }

    fn occluded_by<T: Tally>(&self, group_index: u32, group: &Group, id: u32, ray: &Ray, tally: &T) -> bool {
        match group.others[id as usize] {
            Other::Instance(i) => {
                let instance = &self.instances[i as usize];
                let local = instance.world_from_object.at(ray.time).inverse().ray(ray);
                self.occluded_in_group(instance.group, &local, tally)
            }
            other => self.intersect_other(group_index, group, other, ray, tally).is_some(),
        }
    }

    /// The alpha test of a triangle.
    fn triangle_is_there(&self, group: &Group, id: u32, b1: f32, b2: f32) -> bool {
        let primitive = group.primitive_of_triangle[id as usize];
        let record = &group.primitives[primitive as usize];
        let face = id - record.first_triangle;
        let mesh = &self.scene.triangle_meshes[crate::Handle::from_index(record.mesh as usize)];
        let on_mesh = Some(MeshPoint { mesh: record.mesh, face, b: [b1, b2] });
        self.is_there(group, primitive, (face, on_mesh), &mesh.interaction(face as usize, b1, b2))
    }

    /// The alpha test: below one, a point of the surface is there with that probability, decided by a hash of the
    /// primitive and the point, so that every ray that comes to the point agrees.
    fn is_there(
        &self,
        group: &Group,
        primitive: u32,
        (element, on_mesh): (u32, Option<MeshPoint>),
        p: &steradian_geometry::SurfaceHit,
    ) -> bool {
        let Some(alpha) = group.primitives[primitive as usize].alpha else { return true };
        let context = TextureContext { p: p.p, n: p.n, uv: p.uv, on_mesh, ..TextureContext::default() };
        let alpha = self.float_texture(alpha, &context);
        if alpha >= 1.0 {
            return true;
        }
        if alpha <= 0.0 {
            return false;
        }
        let bits = |v: f32| u64::from(v.to_bits());
        let place = [bits(p.p.x) | bits(p.p.y) << 32, bits(p.p.z), u64::from(primitive) << 32 | u64::from(element)];
        hash_f32(&place) < alpha
    }
}
