//! Models without a scene around them: OBJ, STL, PLY and glTF files are put on a stage where the file says nothing itself.

mod framing;
mod obj;
mod stage;
mod stl;
mod studio;

pub(crate) use obj::mesh as obj_mesh;

use crate::files::{FileAccess, describe, read_all};
use crate::pbrt::LoadOutcome;
use crate::{gltf, ply};
use std::path::{Path, PathBuf};
use steradian_geometry::TriangleMesh;
use steradian_image::{Filter, FilterKind};
use steradian_math::{Point3, Transform, Vec2};
use steradian_sampling::{SamplerKind, SamplerSettings};
use steradian_scene::{
    FilmSettings, IntegratorKind, IntegratorSettings, Material, MetallicRoughnessInputs, Primitive, RenderSettings,
    Scattering, Scene, Shape, SpectrumTexture, Texture,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Severity, SourceMap};

/// What the user says about a model that the file does not.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOptions {
    /// A camera of the file by its name or its number from 0.
    pub camera: Option<String>,
    /// A variant of the materials by its name or its number from 0.
    pub variant: Option<String>,
    /// The time of the animation when the shutter opens, in seconds; none leaves everything in its rest position.
    pub time: Option<f32>,
    /// How long the shutter stays open, in seconds.
    pub shutter: f32,
    /// Whether a ground is put under a model that stands alone.
    pub ground: bool,
    /// A picture of the surroundings instead of the lights that the stage would have.
    pub environment: Option<EnvironmentMap>,
    /// Which axis points up; by the kind of file if not given.
    pub up: Option<Up>,
    /// The default camera goes around the model by this many degrees.
    pub turn: f32,
    /// Whether files outside the model's folder may be read.
    pub allow_outside: bool,
    /// Values of the variables of a Mitsuba scene.
    pub defines: Vec<(String, String)>,
    /// Width and height of the picture, where they are not the usual ones.
    pub size: Option<[u32; 2]>,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self {
            camera: None,
            variant: None,
            time: None,
            shutter: 0.0,
            ground: true,
            environment: None,
            up: None,
            turn: 0.0,
            allow_outside: false,
            defines: Vec::new(),
            size: None,
        }
    }
}

/// A picture of the surroundings in latitudes and longitudes, the top row above.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// The file.
    pub file: PathBuf,
    /// By how many degrees it is turned about the vertical.
    pub rotation: f32,
    /// Factor of its brightness.
    pub strength: f32,
}

/// The axis that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// As in glTF.
    Y,
    /// As in most machines' drawings.
    Z,
}

/// What a file brought along.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    pub has_camera: bool,
    pub has_lights: bool,
    /// Whether any surface shines.
    pub glows: bool,
}

/// Whether a file of this name is a model.
pub fn is_model(path: &Path) -> bool {
    extension(path).is_some_and(|e| ["gltf", "glb", "obj", "stl", "ply"].contains(&e.as_str()))
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// Reads a model and sets the stage for it. Never fails as a whole: all problems are in the outcome.
pub fn load_model(path: &Path, files: &dyn FileAccess, options: &ModelOptions) -> LoadOutcome {
    let (mut diagnostics, mut uses) = (Vec::new(), std::collections::BTreeMap::new());
    let kind = extension(path).unwrap_or_default();
    let read = match kind.as_str() {
        "obj" => plain(path, files, &mut diagnostics, |bytes, d| obj::read(bytes, path, files, options, d)),
        "stl" => plain(path, files, &mut diagnostics, |bytes, _| stl::read(bytes).map(|m| single(path, m))),
        "ply" => plain(path, files, &mut diagnostics, |bytes, d| read_ply(bytes, path, d)),
        _ => {
            let (scene, mut found) = gltf::load(path, files, options, &mut uses);
            diagnostics.append(&mut found);
            scene
        }
    };
    let scene = read.and_then(|(mut scene, found)| {
        if scene.primitives.is_empty() && scene.instances.is_empty() {
            let message = format!("{}: there is no surface in it", path.display());
            diagnostics.push(Diagnostic::warning(message, None));
        }
        let up = options.up.unwrap_or(if kind == "stl" { Up::Z } else { Up::Y });
        match stage::set(&mut scene, found, up, files, options) {
            Ok(()) => Some(scene),
            Err(message) => {
                diagnostics.push(Diagnostic::error(message, None));
                None
            }
        }
    });
    let errors = diagnostics.iter().any(|d| d.severity == Severity::Error);
    LoadOutcome { scene: scene.filter(|_| !errors), sources: SourceMap::new(), diagnostics, uses }
}

/// A format that holds shapes only.
fn plain(
    path: &Path,
    files: &dyn FileAccess,
    diagnostics: &mut Vec<Diagnostic>,
    read: impl FnOnce(&[u8], &mut Vec<Diagnostic>) -> Result<Scene, String>,
) -> Option<(Scene, Found)> {
    let bytes = match read_all(files, path) {
        Ok(b) => b,
        Err(message) => {
            diagnostics.push(Diagnostic::error(message, None));
            return None;
        }
    };
    match read(&bytes, diagnostics) {
        Ok(scene) => Some((scene, Found::default())),
        Err(message) => {
            diagnostics.push(Diagnostic::error(format!("{}: {message}", path.display()), None));
            None
        }
    }
}

/// A scene of one mesh in neutral paint.
fn single(path: &Path, mesh: TriangleMesh) -> Scene {
    let mut scene = Scene::new(default_settings(&path.display().to_string()));
    let material = paint(&mut scene, "", [0.6, 0.6, 0.6], 0.0, 0.45);
    push_mesh(&mut scene, mesh, material);
    scene
}

fn push_mesh(scene: &mut Scene, mesh: TriangleMesh, material: steradian_scene::Handle<Material>) {
    let mesh = scene.triangle_meshes.push(mesh);
    scene.primitives.push(Primitive {
        shape: Shape::Triangles(mesh),
        world_from_object: Transform::IDENTITY,
        reverse_orientation: false,
        material,
        area_light: None,
        alpha: None,
        media: None,
    });
}

/// A material of constants.
fn paint(
    scene: &mut Scene,
    name: &str,
    rgb: [f32; 3],
    metallic: f32,
    roughness: f32,
) -> steradian_scene::Handle<Material> {
    let base = scene.spectrum_textures.push(SpectrumTexture {
        usage: SpectrumUse::Albedo,
        kind: Texture::Constant(Spectrum::rgb_albedo(ColorSpace::Srgb, rgb)),
    });
    let mut float = |v: f32| scene.float_textures.push(steradian_scene::FloatTexture(Texture::Constant(v)));
    let inputs = MetallicRoughnessInputs::plain(base, float(metallic), float(roughness));
    let scattering = Scattering::MetallicRoughness(Box::new(inputs));
    scene.materials.push(Material { name: name.into(), scattering, displacement: None, normal_map: None, tilt: None })
}

fn read_ply(bytes: &[u8], path: &Path, diagnostics: &mut Vec<Diagnostic>) -> Result<Scene, String> {
    let mut mesh = ply::parse(bytes).map_err(|e| e.to_string())?;
    // The corners of a patch are in the order of rows.
    mesh.triangles.extend(mesh.quads.iter().flat_map(|&[a, b, c, d]| [[a, b, d], [a, d, c]]));
    if mesh.triangles.is_empty() {
        return Err("the mesh has no faces".into());
    }
    let left_out = mesh.degenerate + mesh.other_faces;
    if left_out > 0 {
        let message =
            format!("{}: {left_out} faces have no area, or more than 4 corners, and are left out", path.display());
        diagnostics.push(Diagnostic::note(message, None));
    }
    Ok(single(
        path,
        TriangleMesh {
            positions: mesh.positions,
            normals: mesh.normals,
            uvs: mesh.uvs,
            indices: mesh.triangles,
            ..TriangleMesh::default()
        },
    ))
}

/// How models are rendered where nothing is said.
pub(crate) fn default_settings(name: &str) -> RenderSettings {
    let stem = Path::new(name).file_stem().map_or("model".into(), |s| s.to_string_lossy().into_owned());
    let mut film = FilmSettings::new(1024, 768);
    film.filename = format!("{stem}.exr");
    let filter = Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::new(1.5, 1.5));
    RenderSettings {
        film,
        filter: filter.unwrap_or_else(|_| Filter::pixel_box()),
        sampler: SamplerSettings {
            kind: SamplerKind::ZSobol,
            spp: 64,
            resolution: [1024, 768],
            ..SamplerSettings::default()
        },
        integrator: IntegratorSettings { kind: IntegratorKind::Path, max_depth: 16, ..IntegratorSettings::default() },
        color: ColorMode::Rgb,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: false,
    }
}

/// The bytes of a file, or a sentence.
fn bytes_of(path: &Path, files: &dyn FileAccess) -> Result<Vec<u8>, String> {
    files.read(path).map_err(|e| describe(path, &e))
}

/// A point from three numbers that are finite.
fn point([x, y, z]: [f32; 3]) -> Option<Point3> {
    let p = Point3::new(x, y, z);
    p.is_finite().then_some(p)
}
