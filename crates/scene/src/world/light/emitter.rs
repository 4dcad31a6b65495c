//! Emitting shapes in world space: what area lights sample.

use crate::Handle;
use crate::world::{Surface, World};
use steradian_geometry::{BilinearMesh, PlacedQuadric, PreparedTriangle, Reference, ShapeSample, TriangleMesh};
use steradian_math::{Bounds3, Point3, Vec3};

/// The geometry of an emitter.
#[derive(Clone, Copy, Debug)]
pub enum EmitterShape {
    /// A face of a triangle mesh.
    Triangle(Handle<TriangleMesh>, u32),
    /// A patch of a bilinear mesh.
    Patch(Handle<BilinearMesh>, u32),
    /// A quadric: an index into the quadrics of the world's top level.
    Quadric(u32),
}

/// A shape that emits.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Where it is.
    pub shape: EmitterShape,
    /// Which emission: an index into the world's area lights.
    pub emission: u32,
    /// Factor of the emission, derived from power where that is given.
    pub scale: f32,
    /// Mean radiance in photometric units, where it varies over the surface.
    pub brightness: Option<f32>,
    /// A triangle, made ready for sampling.
    pub prepared: Option<PreparedTriangle>,
}

impl World {
    fn emitting_quadric(&self, index: u32) -> &PlacedQuadric {
        &self.groups[0].quadrics[index as usize]
    }

    pub(crate) fn emitter_area(&self, shape: &EmitterShape) -> f32 {
        match *shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].triangle(face as usize).area(),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].patch(face as usize).area(),
            EmitterShape::Quadric(i) => self.emitting_quadric(i).area(),
        }
    }

    pub(crate) fn emitter_bounds(&self, shape: &EmitterShape) -> Bounds3 {
        match *shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].triangle(face as usize).bounds(),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].patch(face as usize).bounds(),
            EmitterShape::Quadric(i) => self.emitting_quadric(i).bounds(),
        }
    }

    /// The centre of a triangle's area; others have the middle of their box.
    pub(crate) fn emitter_centre(&self, shape: &EmitterShape) -> Point3 {
        let EmitterShape::Triangle(mesh, face) = *shape else { return self.emitter_bounds(shape).centroid() };
        let [a, b, c] = self.scene.triangle_meshes[mesh].triangle(face as usize).p;
        a + ((b - a) + (c - a)) * (1.0 / 3.0)
    }

    fn sample_emitter_area(&self, shape: &EmitterShape, u: [f32; 2]) -> Option<ShapeSample> {
        match *shape {
            EmitterShape::Triangle(mesh, face) => self.scene.triangle_meshes[mesh].sample_area(face as usize, u),
            EmitterShape::Patch(mesh, face) => self.scene.bilinear_meshes[mesh].sample_area(face as usize, u),
            EmitterShape::Quadric(i) => self.emitting_quadric(i).sample_area(u),
        }
    }

    /// An axis and the cosine of the angle around it that holds all emitting normals.
    pub(crate) fn emitter_normals(&self, shape: &EmitterShape) -> (Vec3, f32) {
        // Normals at a few points: equal ones mean a flat shape. Anything else is given the whole sphere.
        let normal = |&u: &[f32; 2]| self.sample_emitter_area(shape, u).map(|s| s.n.to_vec());
        let places = [[0.3, 0.4], [0.1, 0.1], [0.9, 0.05], [0.05, 0.9], [0.5, 0.5], [0.95, 0.95], [0.7, 0.2]];
        let flat = |axis: &Vec3| places.iter().all(|u| normal(u).is_some_and(|n| n.dot(*axis) > 1.0 - 1e-5));
        match normal(&places[0]).filter(flat) {
            Some(axis) => (axis, 1.0),
            None => (Vec3::new(0.0, 0.0, 1.0), -1.0),
        }
    }

    /// A point of an emitter seen from `from`, with its density per solid angle; the normal is the emitting side's.
    #[inline]
    pub(crate) fn sample_emitter(&self, emitter: &Emitter, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        match emitter.shape {
            EmitterShape::Triangle(mesh, face) => match &emitter.prepared {
                Some(triangle) => {
                    let mut s = triangle.sample_solid_angle(from, u)?;
                    // Coordinates matter to pictures only.
                    if self.area_lights[emitter.emission as usize].image.is_some() {
                        s.uv = self.scene.triangle_meshes[mesh].uv(face as usize, s.uv.x, s.uv.y);
                    }
                    Some(s)
                }
                None => self.scene.triangle_meshes[mesh].sample_solid_angle(face as usize, from, u),
            },
            EmitterShape::Patch(mesh, face) => {
                self.scene.bilinear_meshes[mesh].sample_solid_angle(face as usize, from, u)
            }
            EmitterShape::Quadric(i) => self.emitting_quadric(i).sample_solid_angle(from, u),
        }
    }

    /// The density of `sample_emitter` for the point that a ray hit.
    #[inline]
    pub(crate) fn emitter_pdf(&self, emitter: &Emitter, from: &Reference, hit: &Surface) -> f32 {
        match emitter.shape {
            EmitterShape::Triangle(mesh, face) => match &emitter.prepared {
                Some(triangle) => triangle.pdf_solid_angle(from, hit.p),
                None => self.scene.triangle_meshes[mesh].triangle(face as usize).pdf_solid_angle(from, hit.p),
            },
            EmitterShape::Patch(mesh, face) => {
                let [u, v] = hit.coordinates;
                self.scene.bilinear_meshes[mesh].patch(face as usize).pdf_solid_angle(from, u, v)
            }
            EmitterShape::Quadric(i) => self.emitting_quadric(i).pdf_solid_angle(from, hit.p, hit.n),
        }
    }
}
