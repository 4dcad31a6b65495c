//! What the user said (`Scene`), and what is built from it once (`World`).

mod camera;
mod error;
mod handle;
mod lens;
mod light;
mod material;
mod medium;
mod parameters;
mod scene;
mod settings;
mod shape;
mod sparse_grid;
mod technique;
mod test_function;
mod texture;
mod world;

pub use camera::{Camera, Projection, SphericalMapping};
pub use error::Error;
pub use handle::{Arena, Handle};
pub use lens::{ApertureImage, LensError, LensInterface, LensRay, LensSystem};
pub use light::{AreaLight, EnvironmentMapping, Light, LightGroup};
pub use material::{
    AnisotropyInputs, Coat, FilmInputs, FloatInput, HairColor, Ior, Material, Metal, MetallicRoughnessInputs,
    NormalMap, PlasticInputs, PrincipledInputs, Roughness, Scattering, Slopes, SpectrumInput, Tilt, Translucency,
};
pub use medium::{Cloud, Coefficients, Field, Fields, Glow, Medium, MediumError, Phase, RgbGrid, Volume, VoxelGrid};
pub use parameters::{ParameterError, Value};
pub use scene::Scene;
pub use settings::{
    Bands, FilmKind, FilmSettings, IntegratorKind, IntegratorSettings, LightSelection, MOST_BANDS, RenderSettings,
};
pub use shape::{Displacement, Instance, MediumInterface, Object, Primitive, Shape};
pub use sparse_grid::{BRICK, SparseGrid, SparseLayout};
pub use technique::{
    ABSURD_RAYS, Bidirectional, Distribution, LightCensus, LobeSampling, MOST_BOOTSTRAP_PATHS, MOST_BRANCHES,
    MOST_PHOTONS, Metropolis, MisHeuristic, PhotonMapping, SettingsError, Stratification, Stratify, Techniques,
    Whitted,
};
pub use test_function::TestFunction;
pub use texture::{
    CheckerMapping, FloatTexture, GridTexture, ImageMap, Mapping2, Noise, SpectrumTexture, Texture, TextureImage,
};
pub use world::{
    CameraModel, CameraRay, CameraSample, Census, Collision, DIFFERENTIAL_SCALE, Emission, Footprint, FreeFlight, Hit,
    LightContext, LightEnd, LightPoint, LightRows, LightSample, MediumPoint, MediumRay, MeshPoint, PlainHit, PlainLobe,
    PlainSurfaces, PointRows, Reception, Shading, SkyRows, Surface, TextureContext, World,
};
