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
use steradian_image::{Filter, FilterKind, srgb_to_linear};
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
    let material = neutral(&mut scene, !mesh.colors.is_empty());
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

/// What covers a mesh of which nothing is known but, perhaps, the colours of its vertices.
fn neutral(scene: &mut Scene, has_colors: bool) -> steradian_scene::Handle<Material> {
    let material = paint(scene, "", [0.6, 0.6, 0.6], 0.0, 0.45);
    if has_colors {
        let kind = Texture::Vertex;
        let base = scene.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind });
        if let Scattering::MetallicRoughness(inputs) = &mut scene.materials[material].scattering {
            inputs.base = base;
        }
    }
    material
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
    let mut mesh = ply::parse_with_attributes(bytes).map_err(|e| e.to_string())?;
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
    if mesh.attributes.iter().any(|a| a.name == "face_color") {
        diagnostics.push(Diagnostic::warning(format!("{}: colours of faces are not shown", path.display()), None));
    }
    let colors = mesh.attributes.iter().find(|a| a.name == "vertex_color" && a.width == 3);
    let colors = colors.map_or(Vec::new(), |a| vertex_colors(a.values.as_chunks::<3>().0));
    Ok(single(
        path,
        TriangleMesh {
            positions: mesh.positions,
            normals: mesh.normals,
            uvs: mesh.uvs,
            colors,
            indices: mesh.triangles,
            ..TriangleMesh::default()
        },
    ))
}

/// Colours of vertices as scanners write them, in the encoding of photographs: from 0 to 255 or from 0 to 1.
fn vertex_colors(rgb: &[[f32; 3]]) -> Vec<[f32; 4]> {
    let scale = if rgb.iter().flatten().any(|&v| v > 1.0) { 1.0 / 255.0 } else { 1.0 };
    let linear = |v: f32| srgb_to_linear((v * scale).clamp(0.0, 1.0));
    rgb.iter().map(|c| c.map(linear)).map(|[r, g, b]| [r, g, b, 1.0]).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::Memory;

    fn load(name: &str, files: &[(&str, &str)]) -> Scene {
        let files = files.iter().fold(Memory::new(), |all, (name, text)| all.with(*name, *text));
        let outcome = load_model(Path::new(name), &files, &ModelOptions { ground: false, ..ModelOptions::default() });
        outcome.scene.unwrap_or_else(|| panic!("{:?}", outcome.diagnostics))
    }

    fn base(scene: &Scene) -> (&Texture<steradian_scene::SpectrumInput, Spectrum>, f32) {
        let Scattering::MetallicRoughness(m) = &scene.materials[scene.primitives[0].material].scattering else {
            panic!("another surface")
        };
        let Texture::Constant(metallic) = scene.float_textures[m.metallic].0 else { panic!("a texture") };
        (&scene.spectrum_textures[m.base].kind, metallic)
    }

    #[test]
    fn vertices_keep_their_colours() {
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
            property list uchar int vertex_indices\nend_header\n0 0 0 255 128 0\n1 0 0 0 0 255\n0 1 0 0 255 0\n3 0 1 2\n";
        let obj = "v 0 0 0 1 0.50196081 0\nv 1 0 0 0 0 1\nv 0 1 0 0 1 0\nf 1 2 3\n";
        for (name, text) in [("a.ply", ply), ("a.obj", obj)] {
            let s = load(name, &[(name, text)]);
            assert!(matches!(base(&s).0, Texture::Vertex), "{name}");
            let Shape::Triangles(mesh) = s.primitives[0].shape else { panic!("no triangles") };
            let [r, g, b, _] = s.triangle_meshes[mesh].colors[0];
            assert!((r - 1.0).abs() < 1e-6 && (g - 0.21586).abs() < 1e-4 && b == 0.0, "{name}: {r} {g} {b}");
        }
        let plain = load("a.obj", &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")]);
        assert!(matches!(base(&plain).0, Texture::Constant(_)));
    }

    #[test]
    fn black_with_bright_highlights_is_metal_and_glass_is_not() {
        let obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let metallic = |mtl: &str| base(&load("a.obj", &[("a.obj", obj), ("a.mtl", mtl)])).1;
        assert_eq!(metallic("newmtl m\nKd 0.05 0.03 0.01\nKs 1.0 0.78 0.34\nNs 200\n"), 1.0);
        assert_eq!(metallic("newmtl m\nKd 0.6 0.6 0.6\nKs 0.5 0.5 0.5\nNs 96\n"), 0.0);
        assert_eq!(metallic("newmtl m\nKd 0 0 0\nKs 1 1 1\nNi 1.5\nillum 7\n"), 0.0);
    }
}
