//! The scene: what the user said, as plain data.

use crate::{
    Arena, Camera, Displacement, FloatTexture, GridTexture, Handle, Instance, Light, LightGroup, Material, Medium,
    Object, Primitive, RenderSettings, SpectrumTexture, TextureImage,
};
use steradian_bsdf::MeasuredMaterial;
use steradian_geometry::{BilinearMesh, DistanceGrid, TriangleMesh};

/// Everything that a file says, without anything derived from it.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Triangle meshes, in object space.
    pub triangle_meshes: Arena<TriangleMesh>,
    /// Meshes of bilinear patches, in object space.
    pub bilinear_meshes: Arena<BilinearMesh>,
    /// Grids of signed distances, in object space.
    pub distance_grids: Arena<DistanceGrid>,
    /// Triangle meshes that textures displace.
    pub displacements: Vec<Displacement>,
    /// Pictures.
    pub images: Arena<TextureImage>,
    /// Grids of values that textures look up.
    pub grids: Arena<GridTexture>,
    /// Scalar textures.
    pub float_textures: Arena<FloatTexture>,
    /// Spectral textures.
    pub spectrum_textures: Arena<SpectrumTexture>,
    /// Materials.
    pub materials: Arena<Material>,
    /// Tables of measured materials.
    pub measured: Arena<MeasuredMaterial>,
    /// Media.
    pub media: Arena<Medium>,
    /// Things to instance.
    pub objects: Arena<Object>,
    /// Shapes in world space.
    pub primitives: Vec<Primitive>,
    /// Instances in world space.
    pub instances: Vec<Instance>,
    /// Lights that are not surfaces.
    pub lights: Vec<Light>,
    /// Groups of lights.
    pub light_groups: Arena<LightGroup>,
    /// The groups of `lights`, in their order; a light beyond the end has none.
    pub groups_of_lights: Vec<Option<Handle<LightGroup>>>,
    /// The camera.
    pub camera: Camera,
    /// Film, filter, sampler, integrator.
    pub settings: RenderSettings,
}

impl Scene {
    /// An empty scene.
    pub fn new(settings: RenderSettings) -> Self {
        Self {
            triangle_meshes: Arena::default(),
            bilinear_meshes: Arena::default(),
            distance_grids: Arena::default(),
            displacements: Vec::new(),
            images: Arena::default(),
            grids: Arena::default(),
            float_textures: Arena::default(),
            spectrum_textures: Arena::default(),
            materials: Arena::default(),
            measured: Arena::default(),
            media: Arena::default(),
            objects: Arena::default(),
            primitives: Vec::new(),
            instances: Vec::new(),
            lights: Vec::new(),
            light_groups: Arena::default(),
            groups_of_lights: Vec::new(),
            camera: Camera::default(),
            settings,
        }
    }
}
