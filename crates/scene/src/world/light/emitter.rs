//! Emitting shapes: what area lights sample. Those of instances that move are asked in the instance's space, as it is at the time.

use super::emission::stretch;
use crate::world::{Surface, TextureContext, World};
use crate::{FloatTexture, Handle};
use steradian_geometry::{BilinearMesh, PlacedQuadric, PreparedTriangle, Reference, ShapeSample, TriangleMesh};
use steradian_math::{Bounds3, Normal3, Point3, Transform, Vec3};

/// The geometry of an emitter.
#[derive(Clone, Copy, Debug)]
pub enum EmitterShape {
    /// A face of a triangle mesh.
    Triangle(Handle<TriangleMesh>, u32),
    /// A patch of a bilinear mesh.
    Patch(Handle<BilinearMesh>, u32),
    /// A quadric: an index into those of its group.
    Quadric(u32),
}

/// A shape that emits.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// What it is, in world space or that of its instance.
    pub shape: EmitterShape,
    /// The instance that it is part of; the world if none.
    pub instance: Option<u32>,
    /// Which emission: an index into the world's area lights.
    pub emission: u32,
    /// Factor of the emission, derived from power where that is given.
    pub scale: f32,
    /// Mean radiance in photometric units, where it varies over the surface.
    pub brightness: Option<f32>,
    /// A triangle, made ready for sampling.
    pub prepared: Option<PreparedTriangle>,
    /// How much of it is there.
    pub alpha: Option<Handle<FloatTexture>>,
}

impl World {
    /// The quadrics that an emitter's number counts in: the world's, or those of its object.
    fn emitting_quadric(&self, index: u32, instance: Option<u32>) -> &PlacedQuadric {
        let group = instance.map_or(0, |i| self.instances[i as usize].group);
        &self.groups[group as usize].quadrics[index as usize]
    }

    /// Where the space of an instance is at a time.
    fn world_from_instance(&self, instance: u32, time: f32) -> Transform {
        self.instances[instance as usize].world_from_object.at(time)
    }

    /// The area of an emitter; of one that moves when it sets out, and roughly if its space is stretched.
    pub(crate) fn emitter_area(&self, e: &Emitter) -> f32 {
        let own = match e.shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].triangle(face as usize).area(),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].patch(face as usize).area(),
            EmitterShape::Quadric(i) => self.emitting_quadric(i, e.instance).area(),
        };
        let Some(instance) = e.instance else { return own };
        let volume = self.instances[instance as usize].world_from_object.start.determinant3().abs();
        own * steradian_math::powf(volume, 2.0 / 3.0)
    }

    /// In its own space.
    fn shape_bounds(&self, e: &Emitter) -> Bounds3 {
        match e.shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].triangle(face as usize).bounds(),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].patch(face as usize).bounds(),
            EmitterShape::Quadric(i) => self.emitting_quadric(i, e.instance).bounds(),
        }
    }

    /// Everything that an emitter passes through.
    pub(crate) fn emitter_bounds(&self, e: &Emitter) -> Bounds3 {
        let own = self.shape_bounds(e);
        e.instance.map_or(own, |i| self.instances[i as usize].world_from_object.motion_bounds(&own))
    }

    /// The centre of a triangle's area; others have the middle of their box. In the emitter's own space.
    pub(crate) fn emitter_centre(&self, e: &Emitter) -> Point3 {
        let EmitterShape::Triangle(mesh, face) = e.shape else { return self.shape_bounds(e).centroid() };
        let [a, b, c] = self.scene.triangle_meshes[mesh].triangle(face as usize).p;
        a + ((b - a) + (c - a)) * (1.0 / 3.0)
    }

    fn sample_shape_area(&self, e: &Emitter, u: [f32; 2]) -> Option<ShapeSample> {
        match e.shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].sample_area(face as usize, u),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].sample_area(face as usize, u),
            EmitterShape::Quadric(i) => self.emitting_quadric(i, e.instance).sample_area(u),
        }
    }

    /// A point of an emitter at a time, with its density per area.
    pub(super) fn sample_emitter_area(&self, e: &Emitter, time: f32, u: [f32; 2]) -> Option<ShapeSample> {
        let s = self.sample_shape_area(e, u)?;
        let Some(instance) = e.instance else { return Some(s) };
        let t = self.world_from_instance(instance, time);
        let (p, p_error) = t.point_with_error(s.p, s.p_error);
        let n = t.normal(s.n);
        let pdf = s.pdf / (n.length() * t.determinant3().abs());
        (pdf > 0.0 && pdf.is_finite()).then(|| ShapeSample { p, p_error, n: n.normalize(), pdf, ..s })
    }

    /// The density of that where the normal is `n`; points of a bent patch count as uniform.
    pub(super) fn emitter_pdf_area(&self, e: &Emitter, time: f32, n: Normal3) -> f32 {
        let own = |n: Normal3| match e.shape {
            EmitterShape::Triangle(mesh, face) => 1.0 / self.scene.triangle_meshes[mesh].triangle(face as usize).area(),
            EmitterShape::Patch(mesh, face) => 1.0 / self.scene.bilinear_meshes[mesh].patch(face as usize).area(),
            EmitterShape::Quadric(i) => self.emitting_quadric(i, e.instance).pdf_area(n),
        };
        let Some(instance) = e.instance else { return own(n) };
        let inverse = self.world_from_instance(instance, time).inverse();
        let local = inverse.normal(n);
        own(local.normalize()) * local.length() * inverse.determinant3().abs()
    }

    /// How much of an emitter is there at a sampled point: the probability that a ray meets it.
    pub(super) fn emitter_presence(&self, e: &Emitter, s: &ShapeSample) -> f32 {
        let Some(alpha) = e.alpha else { return 1.0 };
        let context = TextureContext { p: s.p, n: s.n, uv: s.uv, ..TextureContext::default() };
        self.float_texture(alpha, &context).clamp(0.0, 1.0)
    }

    /// An axis and the cosine of the angle around it that holds all emitting normals, in the emitter's own space.
    pub(super) fn shape_normals(&self, e: &Emitter) -> (Vec3, f32) {
        // Normals at a few points: equal ones mean a flat shape. Anything else is given the whole sphere.
        let normal = |&u: &[f32; 2]| self.sample_shape_area(e, u).map(|s| s.n.to_vec());
        let places = [[0.3, 0.4], [0.1, 0.1], [0.9, 0.05], [0.05, 0.9], [0.5, 0.5], [0.95, 0.95], [0.7, 0.2]];
        let flat = |axis: &Vec3| places.iter().all(|u| normal(u).is_some_and(|n| n.dot(*axis) > 1.0 - 1e-5));
        match normal(&places[0]).filter(flat) {
            Some(axis) => (axis, 1.0),
            None => (Vec3::new(0.0, 0.0, 1.0), -1.0),
        }
    }

    /// The same in the world; what moves may face anywhere.
    pub(crate) fn emitter_normals(&self, e: &Emitter) -> (Vec3, f32) {
        match e.instance {
            None => self.shape_normals(e),
            Some(_) => (Vec3::new(0.0, 0.0, 1.0), -1.0),
        }
    }

    /// A point of an emitter seen from `from` at a time, with its density per solid angle; the normal is the emitting side's.
    #[inline]
    pub(crate) fn sample_emitter(
        &self,
        emitter: &Emitter,
        (from, time): (&Reference, f32),
        u: [f32; 2],
    ) -> Option<ShapeSample> {
        match emitter.instance {
            None => self.sample_shape(emitter, from, u),
            Some(instance) => self.sample_moving(emitter, (from, &self.world_from_instance(instance, time)), u),
        }
    }

    /// Asks in the space of the instance, and carries the answer back.
    fn sample_moving(&self, e: &Emitter, (from, t): (&Reference, &Transform), u: [f32; 2]) -> Option<ShapeSample> {
        let inverse = t.inverse();
        let s = self.sample_shape(e, &from.transformed(&inverse), u)?;
        let (p, p_error) = t.point_with_error(s.p, s.p_error);
        let n = t.normal(s.n).try_normalize()?;
        let pdf = s.pdf * stretch(&inverse, (p - from.p).try_normalize()?);
        (pdf > 0.0 && pdf.is_finite()).then_some(ShapeSample { p, p_error, n, pdf, ..s })
    }

    #[inline]
    fn sample_shape(&self, emitter: &Emitter, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        match emitter.shape {
            EmitterShape::Triangle(mesh, face) => match &emitter.prepared {
                Some(triangle) => {
                    let mut s = triangle.sample_solid_angle(from, u)?;
                    // Coordinates matter to pictures only.
                    if self.area_lights[emitter.emission as usize].image.is_some() || emitter.alpha.is_some() {
                        s.uv = self.scene.triangle_meshes[mesh].uv(face as usize, s.uv.x, s.uv.y);
                    }
                    Some(s)
                }
                None => {
                    let (mesh, face) = (&self.scene.triangle_meshes[mesh], face as usize);
                    let mut s = mesh.sample_solid_angle(face, from, u)?;
                    // Textures want barycentric coordinates.
                    if self.area_lights[emitter.emission as usize].texture.is_some() {
                        s.uv = mesh.triangle(face).sample_solid_angle(from, u)?.uv;
                    }
                    Some(s)
                }
            },
            EmitterShape::Patch(mesh, face) => {
                self.scene.bilinear_meshes[mesh].sample_solid_angle(face as usize, from, u)
            }
            EmitterShape::Quadric(i) => self.emitting_quadric(i, emitter.instance).sample_solid_angle(from, u),
        }
    }

    /// The density of `sample_emitter` for the point that a ray hit.
    #[inline]
    pub(crate) fn emitter_pdf(&self, emitter: &Emitter, from: (&Reference, f32), hit: &Surface) -> f32 {
        self.emitter_pdf_at(emitter, from, hit.p, hit.n, hit.coordinates)
    }

    /// The same for a point that is given by what matters of it.
    #[inline]
    pub(super) fn emitter_pdf_at(
        &self,
        emitter: &Emitter,
        (from, time): (&Reference, f32),
        p: Point3,
        n: Normal3,
        coordinates: [f32; 2],
    ) -> f32 {
        let Some(instance) = emitter.instance else { return self.shape_pdf(emitter, from, p, n, coordinates) };
        let inverse = self.world_from_instance(instance, time).inverse();
        let (Some(wi), Some(n)) = ((p - from.p).try_normalize(), inverse.normal(n).try_normalize()) else { return 0.0 };
        let local = from.transformed(&inverse);
        self.shape_pdf(emitter, &local, inverse.point(p), n, coordinates) * stretch(&inverse, wi)
    }

    #[inline]
    fn shape_pdf(&self, emitter: &Emitter, from: &Reference, p: Point3, n: Normal3, [u, v]: [f32; 2]) -> f32 {
        match emitter.shape {
            EmitterShape::Triangle(mesh, face) => match &emitter.prepared {
                Some(triangle) => triangle.pdf_solid_angle(from, p),
                None => self.scene.triangle_meshes[mesh].triangle(face as usize).pdf_solid_angle(from, p),
            },
            EmitterShape::Patch(mesh, face) => {
                self.scene.bilinear_meshes[mesh].patch(face as usize).pdf_solid_angle(from, u, v)
            }
            EmitterShape::Quadric(i) => self.emitting_quadric(i, emitter.instance).pdf_solid_angle(from, p, n),
        }
    }
}
