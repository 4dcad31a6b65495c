//! glTF 2.0 (Khronos, ISO/IEC 12113) to `Scene`: `.gltf` and `.glb`, with the extensions that say more about materials, lights
//! and meshes.
//!
//! Every problem names its place as a JSON pointer. What the format can say and this renderer does not do is a warning; an
//! extension that a file requires and that is not known is an error.

mod accessor;
mod animation;
mod buffers;
mod camera;
mod json;
mod lights;
mod materials;
mod meshes;
mod meshopt;
mod nodes;
mod patches;
mod skins;
mod tangents;
mod textures;

pub(crate) use buffers::inside;
pub(crate) use camera::look;

use crate::files::{FileAccess, describe};
use crate::model::{Found, ModelOptions, default_settings};
use buffers::{Folder, split_glb};
use json::{Json, Problem, Result};
use materials::{Cover, CoverKey};
use nodes::Local;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use steradian_image::Texels;
use steradian_scene::{Handle, IntegratorKind, Scene, TextureImage};
use steradian_spectrum::ColorMode;
use steradian_syntax::Diagnostic;

/// Extensions that are read.
const KNOWN: [&str; 24] = [
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    // Each is answered where it is met: with the fallback, or an error that says how to convert.
    "KHR_texture_basisu",
    "KHR_draco_mesh_compression",
    "KHR_node_visibility",
    // It changes nothing in a picture.
    "KHR_xmp_json_ld",
];

/// What is known of an asset while it is read.
struct Gltf<'d, 'b> {
    folder: &'b Folder<'b>,
    root: Json<'d>,
    buffers: accessor::Buffers<'d, 'b>,
    accessors: Vec<Json<'d>>,
    meshes: Vec<Json<'d>>,
    nodes: Vec<Json<'d>>,
    materials: Vec<Json<'d>>,
    textures: Vec<Json<'d>>,
    /// Poses of the nodes when the shutter opens and when it closes.
    locals: [Vec<Local>; 2],
    /// Where the nodes that the scene shows are when the shutter opens, whether or not anything can be seen there.
    joint_places: BTreeMap<usize, skins::Rows>,
    scene: Scene,
    covers: BTreeMap<CoverKey, Option<Cover>>,
    image_handles: BTreeMap<textures::ImageKey, Handle<TextureImage>>,
    image_names: BTreeMap<usize, String>,
    texels: BTreeMap<usize, Option<Texels>>,
    variant: Option<usize>,
    /// Lights of the file that are not surfaces.
    lights: usize,
    disperses: bool,
    /// Triangles without area, and nodes squeezed to nothing.
    dropped: usize,
    squeezed: usize,
    name: &'b str,
    said: BTreeSet<String>,
    diagnostics: Vec<Diagnostic>,
}

impl Gltf<'_, '_> {
    fn report(&mut self, p: Problem) {
        self.diagnostics.push(diagnostic(self.name, p));
    }

    fn warn_once(&mut self, what: &str, message: &str) {
        if self.said.insert(what.to_string()) {
            self.diagnostics.push(Diagnostic::warning(format!("{}: {message}", self.name), None));
        }
    }

    fn warn_at(&mut self, at: &Json, message: &str) {
        let message = format!("{}#{}: {message}", self.name, at.pointer());
        self.diagnostics.push(Diagnostic::warning(message, None));
    }

    /// Notes something that is shown otherwise than the format says.
    fn approximate(&mut self, message: &str) {
        if self.said.insert(message.to_string()) {
            self.diagnostics.push(Diagnostic::note(format!("{}: {message}", self.name), None));
        }
    }

    /// The extensions that the file says it needs, and those that it says it uses.
    fn extensions(&mut self) -> Result<()> {
        for e in self.root.list("extensionsRequired")? {
            let name = e.as_str()?;
            if name == "KHR_draco_mesh_compression" {
                return Err(draco(&e));
            }
            if !KNOWN.contains(&name) {
                return Err(e.problem(format!("the file requires the extension `{name}`, which is not known")));
            }
        }
        for e in self.root.list("extensionsUsed")? {
            let name = e.as_str()?;
            if !KNOWN.contains(&name) {
                let message = format!("the extension `{name}` is not known; what it says is not shown");
                self.warn_once(name, &message);
            }
        }
        Ok(())
    }

    /// The variant that was asked for.
    fn choose_variant(&mut self, wanted: Option<&str>) -> Result<()> {
        let Some(wanted) = wanted else { return Ok(()) };
        let variants = match self.root.extension("KHR_materials_variants") {
            Some(e) => e.list("variants")?,
            None => Vec::new(),
        };
        let mut names = Vec::new();
        for (i, v) in variants.iter().enumerate() {
            let name = v.text("name")?.unwrap_or("");
            if name == wanted || wanted.parse() == Ok(i) {
                self.variant = Some(i);
                return Ok(());
            }
            names.push(name);
        }
        let list = if names.is_empty() { "there are none".into() } else { format!("there are {}", names.join(", ")) };
        Err(Problem { hint: Some(list), ..self.root.problem(format!("no variant `{wanted}`")) })
    }
}

fn draco(at: &Json) -> Problem {
    Problem {
        hint: Some("convert with `gltf-transform copy in.glb out.glb`, which writes plain meshes".into()),
        ..at.problem("meshes compressed with Draco (KHR_draco_mesh_compression) are not read")
    }
}

fn diagnostic(name: &str, p: Problem) -> Diagnostic {
    let pointer = if p.pointer.is_empty() { String::new() } else { format!("#{}", p.pointer) };
    let mut d = Diagnostic::error(format!("{name}{pointer}: {}", p.message), None);
    d.hint = p.hint;
    d
}

/// Reads an asset. The scene is there if no diagnostic is an error; cameras and lights may be missing from it.
pub(crate) fn load(
    path: &Path,
    files: &dyn FileAccess,
    options: &ModelOptions,
    uses: &mut BTreeMap<String, u64>,
) -> (Option<(Scene, Found)>, Vec<Diagnostic>) {
    let name = path.display().to_string();
    let fail = |message: String| (None, vec![Diagnostic::error(message, None)]);
    let bytes = match files.read(path) {
        Ok(b) => b,
        Err(e) => return fail(describe(path, &e)),
    };
    let (text, binary) = if bytes.starts_with(b"glTF") {
        match split_glb(&bytes) {
            Ok(parts) => parts,
            Err(e) => return fail(format!("{name}: {e}")),
        }
    } else {
        (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes), None)
    };
    let value: serde_json::Value = match serde_json::from_slice(text) {
        Ok(v) => v,
        Err(e) => return fail(format!("{name}{}", not_json(text, &e))),
    };
    count_extensions(&value, uses);
    let base = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let folder = Folder { files, base, allow_outside: options.allow_outside };
    let mut diagnostics = Vec::new();
    let read = read(&name, &folder, &value, binary, options, &mut diagnostics);
    match read {
        Ok(found) => {
            let errors = diagnostics.iter().any(|d| d.severity == steradian_syntax::Severity::Error);
            (found.filter(|_| !errors), diagnostics)
        }
        Err(p) => {
            diagnostics.push(diagnostic(&name, p));
            (None, diagnostics)
        }
    }
}

/// Why a text is not JSON, with its place.
fn not_json(text: &[u8], e: &serde_json::Error) -> String {
    if text.is_empty() {
        return ": the file is empty".into();
    }
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        return ": UTF-16 text; save it as UTF-8".into();
    }
    // The place stands in front already.
    let said = e.to_string();
    let what = said.split(" at line ").next().unwrap_or(&said);
    format!(":{}:{}: not JSON: {what}", e.line(), e.column())
}

/// How often each extension is used, anywhere in a document.
fn count_extensions(value: &serde_json::Value, uses: &mut BTreeMap<String, u64>) {
    match value {
        // The parser has bounded the depth.
        serde_json::Value::Array(items) => items.iter().for_each(|v| count_extensions(v, uses)),
        serde_json::Value::Object(members) => {
            for (key, inner) in members {
                if let ("extensions", Some(all)) = (key.as_str(), inner.as_object()) {
                    all.keys().for_each(|name| *uses.entry(name.clone()).or_default() += 1);
                }
                count_extensions(inner, uses);
            }
        }
        _ => {}
    }
}

fn read(
    name: &str,
    folder: &Folder,
    value: &serde_json::Value,
    binary: Option<&[u8]>,
    options: &ModelOptions,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<Option<(Scene, Found)>> {
    let root = Json::root(value);
    json::shapes(value)?;
    let asset = root.need("asset")?;
    let version = asset.need("version")?;
    let stated = version.as_str()?;
    if stated != "2" && !stated.starts_with("2.") {
        return Err(version.problem(format!("version {stated} of glTF; only 2 is known")));
    }
    if let Some(least) = asset.get("minVersion").filter(|v| v.as_str() != Ok("2.0")) {
        return Err(least.problem(format!("a reader of version {} is asked for; 2.0 is known", least.as_str()?)));
    }
    let mut data = Vec::new();
    for (i, buffer) in root.list("buffers")?.iter().enumerate() {
        match read_buffer(buffer, i, folder, binary) {
            Ok(bytes) => data.push(Some(bytes)),
            Err(p) => {
                diagnostics.push(diagnostic(name, p));
                data.push(None);
            }
        }
    }
    let views = root.list("bufferViews")?;
    let mut unpacked = Vec::new();
    for v in &views {
        unpacked.push(match v.extension("EXT_meshopt_compression") {
            None => None,
            Some(e) => {
                let packed = buffers::view(&e, &data, "buffer")?;
                Some(meshopt::unpack(&e, packed.bytes)?)
            }
        });
    }
    let nodes = root.list("nodes")?;
    let locals = nodes.iter().map(Local::read).collect::<Result<Vec<_>>>()?;
    let mut gltf = Gltf {
        folder,
        root: root.clone(),
        buffers: accessor::Buffers { views, data: &data, unpacked: &unpacked },
        accessors: root.list("accessors")?,
        meshes: root.list("meshes")?,
        nodes,
        materials: root.list("materials")?,
        textures: root.list("textures")?,
        locals: [locals.clone(), locals],
        joint_places: BTreeMap::new(),
        scene: Scene::new(default_settings(name)),
        covers: BTreeMap::new(),
        image_handles: BTreeMap::new(),
        image_names: BTreeMap::new(),
        texels: BTreeMap::new(),
        variant: None,
        lights: 0,
        disperses: false,
        dropped: 0,
        squeezed: 0,
        name,
        said: BTreeSet::new(),
        diagnostics: Vec::new(),
    };
    let result = gltf.build(options);
    diagnostics.append(&mut gltf.diagnostics);
    let found = result?;
    Ok(Some((gltf.scene, found)))
}

fn read_buffer(buffer: &Json, index: usize, folder: &Folder, binary: Option<&[u8]>) -> Result<Vec<u8>> {
    let length = buffer.need("byteLength")?.as_count()?;
    let bytes = match (buffer.get("uri"), binary) {
        (Some(uri), _) => folder.fetch(&uri)?.0,
        (None, Some(chunk)) if index == 0 => chunk.to_vec(),
        // It stands for what compressed views unpack to.
        (None, _) if buffer.extension("EXT_meshopt_compression").is_some() => return Ok(Vec::new()),
        (None, _) => return Err(buffer.problem("a buffer without a `uri`, and there is no binary chunk for it")),
    };
    if bytes.len() < length {
        return Err(buffer.problem(format!("`byteLength` is {length}, but there are only {} bytes", bytes.len())));
    }
    Ok(bytes)
}

impl Gltf<'_, '_> {
    fn build(&mut self, options: &ModelOptions) -> Result<Found> {
        self.extensions()?;
        self.choose_variant(options.variant.as_deref())?;
        self.animate(options)?;
        let placed = self.place()?;
        let cameras = self.populate(&placed);
        let has_camera = self.choose_camera(&cameras, options)?;
        let emits = |p: &steradian_scene::Primitive| p.area_light.is_some();
        let glows = self.scene.primitives.iter().any(emits)
            || self.scene.objects.iter().any(|o| o.primitives.iter().any(emits));
        if self.disperses {
            self.scene.settings.color = ColorMode::Spectral;
        }
        if !self.scene.media.is_empty() {
            self.scene.settings.integrator.kind = IntegratorKind::VolPath;
        }
        if self.dropped > 0 {
            let n = self.dropped;
            self.diagnostics
                .push(Diagnostic::note(format!("{}: {n} triangles have no area and are left out", self.name), None));
        }
        if self.squeezed > 0 {
            let n = self.squeezed;
            self.diagnostics
                .push(Diagnostic::note(format!("{}: {n} nodes are squeezed to nothing and left out", self.name), None));
        }
        Ok(Found { has_camera, has_lights: self.lights > 0, glows })
    }

    /// That an old extension is read.
    fn used(&mut self, name: &str) {
        self.said.insert(name.to_string());
    }
}
