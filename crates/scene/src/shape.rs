//! Shapes with what covers them, and instances.

use crate::{AreaLight, FloatTexture, Handle, Material, Medium};
use steradian_geometry::{BilinearMesh, Curve, Cylinder, Disk, DistanceGrid, Sphere, TriangleMesh};
use steradian_math::{AnimatedTransform, Transform};

/// The geometry of a primitive, in object space.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles.
    Triangles(Handle<TriangleMesh>),
    /// Bilinear patches.
    Bilinear(Handle<BilinearMesh>),
    /// A sphere or part of it.
    Sphere(Sphere),
    /// A disk, ring or sector.
    Disk(Disk),
    /// An open cylinder.
    Cylinder(Cylinder),
    /// Thin curves. They cannot be sampled as lights: what shines on them is found by chance.
    Curves(Vec<Curve>),
    /// Where signed distances on a grid are zero. As with curves, what shines on them is found by chance.
    Distances(Handle<DistanceGrid>),
}

/// The media on the two sides of a boundary; `None` is vacuum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MediumInterface {
    /// On the side that the normal points away from.
    pub inside: Option<Handle<Medium>>,
    /// On the side that the normal points to.
    pub outside: Option<Handle<Medium>>,
}

/// A shape in its place, with material and emission.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Geometry.
    pub shape: Shape,
    /// Object to world space (or to the space of the instanced object).
    pub world_from_object: Transform,
    /// Whether the normal is flipped. A transform that swaps handedness flips it once more.
    pub reverse_orientation: bool,
    /// Scattering.
    pub material: Handle<Material>,
    /// Emission.
    pub area_light: Option<AreaLight>,
    /// Opacity: below one, the surface lets rays pass with the complementary probability.
    pub alpha: Option<Handle<FloatTexture>>,
    /// Media, where the surface separates two; `None` continues the medium that the ray is in.
    pub media: Option<MediumInterface>,
}

/// A mesh that a texture pushes along its normals before anything is built from it. The mesh needs texture coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Displacement {
    /// Which mesh.
    pub mesh: Handle<TriangleMesh>,
    /// By how much, in object space. The texture sees the position in object space and the texture coordinates.
    pub texture: Handle<FloatTexture>,
    /// Object to world space, for the lengths of edges.
    pub world_from_object: Transform,
    /// Edges are halved until they are shorter than this in world space.
    pub edge_length: f32,
}

/// A group of primitives that instances repeat.
#[derive(Clone, Debug, Default)]
pub struct Object {
    /// Name, for messages.
    pub name: String,
    /// The members, in the object's space.
    pub primitives: Vec<Primitive>,
    /// Nested instances.
    pub instances: Vec<Instance>,
}

/// An object put somewhere, perhaps moving.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What.
    pub object: Handle<Object>,
    /// Where: object to world space over time.
    pub world_from_object: AnimatedTransform,
}
