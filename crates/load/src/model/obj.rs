//! Wavefront OBJ with MTL: polygons, normals, texture coordinates, and materials as far as they have a meaning in light
//! transport.

use super::{ModelOptions, neutral, paint, push_mesh, vertex_colors};
use crate::files::{FileAccess, read_all};
use crate::gltf::inside;
use crate::ply::flat;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use steradian_geometry::TriangleMesh;
use steradian_image::{Encoding, Lookup, Texels, Wrap, read_texels};
use steradian_math::{Normal3, Point2, Point3};
use steradian_scene::{
    AreaLight, FloatInput, FloatTexture, Handle, ImageMap, Ior, Mapping2, Material, Scattering, Scene, SpectrumTexture,
    Texture, TextureImage,
};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};
use steradian_syntax::Diagnostic;

/// Reads an OBJ file and the libraries of materials beside it.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    files: &dyn FileAccess,
    options: &ModelOptions,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<Scene, String> {
    let mut scene = Scene::new(super::default_settings(&path.display().to_string()));
    let base = path.parent().unwrap_or(Path::new(""));
    let missing = RefCell::new(Vec::new());
    let settings = tobj::LoadOptions { triangulate: true, single_index: true, ..tobj::LoadOptions::default() };
    let library = |name: &Path| {
        let read =
            inside(files, base, &name.to_string_lossy(), options.allow_outside).and_then(|p| read_all(files, &p));
        match read {
            Ok(bytes) => tobj::load_mtl_buf(&mut bytes.as_slice()),
            Err(message) => {
                missing.borrow_mut().push(message);
                Err(tobj::LoadError::OpenFileFailed)
            }
        }
    };
    let mut text = bytes;
    let (models, materials) =
        tobj::load_obj_buf(&mut text, &settings, library).map_err(|e| format!("damaged OBJ file: {e}"))?;
    let materials = match materials {
        Ok(m) => m,
        Err(e) => {
            let why = missing.borrow_mut().pop().unwrap_or_else(|| e.to_string());
            let message = format!("{}: the materials are not read: {why}", path.display());
            diagnostics.push(Diagnostic::warning(message, None));
            Vec::new()
        }
    };
    let mut reader =
        Reader { scene: &mut scene, base, files, options, images: BTreeMap::new(), said: BTreeSet::new(), diagnostics };
    let covers: Vec<Cover> = materials.iter().map(|m| reader.material(m)).collect();
    let plain =
        [false, true].map(|has_colors| Cover { material: neutral(reader.scene, has_colors), alpha: None, light: None });
    let mut dropped = 0;
    for model in models {
        let known = model.mesh.material_id.and_then(|i| covers.get(i));
        let faces = model.mesh.indices.len() / 3;
        let mut mesh = mesh(model.mesh).map_err(|e| format!("{}: {e}", model.name))?;
        let rgb: Vec<[f32; 3]> = mesh.colors.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        mesh.colors = vertex_colors(&rgb);
        let cover = known.unwrap_or(&plain[usize::from(!rgb.is_empty())]).clone();
        dropped += faces - mesh.indices.len();
        if mesh.indices.is_empty() {
            continue;
        }
        push_mesh(&mut scene, mesh, cover.material);
        if let Some(p) = scene.primitives.last_mut() {
            (p.alpha, p.area_light) = (cover.alpha, cover.light);
        }
    }
    if dropped > 0 {
        let message = format!("{}: {dropped} faces have no area and are left out", path.display());
        diagnostics.push(Diagnostic::note(message, None));
    }
    if scene.primitives.is_empty() { Err("the file has no faces".into()) } else { Ok(scene) }
}

pub(crate) fn mesh(m: tobj::Mesh) -> Result<TriangleMesh, String> {
    let positions: Vec<Point3> = m.positions.as_chunks::<3>().0.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect();
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("vertex {i} is not finite"));
    }
    let mut indices = m.indices.as_chunks::<3>().0.to_vec();
    if indices.iter().flatten().any(|&i| i as usize >= positions.len()) {
        return Err("a face uses a vertex that does not exist".into());
    }
    indices.retain(|&[a, b, c]| !flat(positions[a as usize], positions[b as usize], positions[c as usize]));
    let sane = |v: f32| if v.is_finite() { v } else { 0.0 };
    let normals = m.normals.as_chunks::<3>().0.iter().map(|n| {
        let [x, y, z] = n.map(sane);
        Normal3::new(x, y, z)
    });
    let uvs = m.texcoords.as_chunks::<2>().0.iter().map(|uv| Point2::new(sane(uv[0]), sane(uv[1])));
    let complete = |n: usize| n == positions.len();
    let colors = m.vertex_color.as_chunks::<3>().0.iter().map(|c| {
        let [r, g, b] = c.map(sane);
        [r, g, b, 1.0]
    });
    Ok(TriangleMesh {
        normals: if complete(m.normals.len() / 3) { normals.collect() } else { Vec::new() },
        uvs: if complete(m.texcoords.len() / 2) { uvs.collect() } else { Vec::new() },
        colors: if complete(m.vertex_color.len() / 3) { colors.collect() } else { Vec::new() },
        positions,
        indices,
        ..TriangleMesh::default()
    })
}

#[derive(Clone)]
struct Cover {
    material: Handle<Material>,
    alpha: Option<FloatInput>,
    light: Option<AreaLight>,
}

struct Reader<'a> {
    scene: &'a mut Scene,
    base: &'a Path,
    files: &'a dyn FileAccess,
    options: &'a ModelOptions,
    images: BTreeMap<(String, bool), Option<Handle<TextureImage>>>,
    said: BTreeSet<String>,
    diagnostics: &'a mut Vec<Diagnostic>,
}

impl Reader<'_> {
    fn warn_once(&mut self, message: String) {
        if self.said.insert(message.clone()) {
            self.diagnostics.push(Diagnostic::warning(message, None));
        }
    }

    fn material(&mut self, m: &tobj::Material) -> Cover {
        let other =
            |key: &str| -> Option<f32> { m.unknown_param.get(key)?.split_ascii_whitespace().next()?.parse().ok() };
        // A highlight of Phong's, as the rough surface that looks most like it.
        let from_exponent = m.shininess.map(|n| (2.0 / (n.max(0.0) + 2.0)).sqrt().sqrt());
        let roughness = other("Pr").or(from_exponent).unwrap_or(0.6).clamp(0.0, 1.0);
        let diffuse = m.diffuse.unwrap_or([0.6; 3]);
        let illum = m.illumination_model.unwrap_or(2);
        let glass =
            (illum == 4 || illum == 6 || illum == 7 || illum == 9) && m.optical_density.is_some_and(|n| n > 1.0);
        // What is nearly black and has bright highlights is metal.
        let brightest = |rgb: [f32; 3]| rgb[0].max(rgb[1]).max(rgb[2]);
        let highlight = m.specular.filter(|&s| brightest(s) > 0.3 && brightest(diffuse) < 0.2 * brightest(s));
        let metal = highlight.filter(|_| !glass && m.diffuse_texture.is_none() && other("Pm").is_none());
        let metallic = if metal.is_some() { 1.0 } else { other("Pm").unwrap_or(0.0) };
        let handle = paint(self.scene, &m.name, metal.unwrap_or(diffuse), metallic, roughness);
        let base = m.diffuse_texture.as_deref().and_then(|t| self.picture(t, true));
        let opacity = m.dissolve.unwrap_or(1.0);
        let one = self.scene.float_textures.push(FloatTexture(Texture::Constant(1.0)));
        let white = self.scene.spectrum_textures.push(SpectrumTexture {
            usage: SpectrumUse::Albedo,
            kind: Texture::Constant(Spectrum::rgb_albedo(ColorSpace::Srgb, [1.0; 3])),
        });
        if let Scattering::MetallicRoughness(inputs) = &mut self.scene.materials[handle].scattering {
            if let Some(image) = base {
                let map = ImageMap { mapping: Mapping2::default(), image, scale: 1.0, invert: false };
                let kind = Texture::Image(map);
                // With a picture, the colour beside it is often black by mistake; the picture is what was meant.
                inputs.base = self.scene.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind });
            }
            if glass {
                inputs.transmission = Some(one);
                inputs.thin = false;
                inputs.eta = Ior::Constant(m.optical_density.unwrap_or(1.5).clamp(1.01, 4.0));
                inputs.base = white;
            }
        }
        let mask = m.dissolve_texture.as_deref().and_then(|t| self.picture(t, false));
        let alpha = match mask {
            Some(image) => {
                let map = ImageMap { mapping: Mapping2::default(), image, scale: opacity, invert: false };
                Some(self.scene.float_textures.push(FloatTexture(Texture::Image(map))))
            }
            None if opacity < 1.0 && !glass => {
                Some(self.scene.float_textures.push(FloatTexture(Texture::Constant(opacity.max(0.0)))))
            }
            None => None,
        };
        let unread = [&m.normal_texture, &m.specular_texture, &m.shininess_texture];
        if unread.iter().any(|t| t.is_some()) {
            self.warn_once("maps of normals, bumps, highlights and shininess in MTL files are not read".into());
        }
        let glow = m.emissive.filter(|e| e.iter().any(|&v| v > 0.0));
        let light = glow.map(|rgb| AreaLight {
            radiance: Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb),
            scale: 1.0 / ColorSpace::Srgb.photometric(),
            two_sided: false,
            power: None,
            image: None,
            texture: None,
            group: None,
        });
        Cover { material: handle, alpha, light }
    }

    /// A picture beside the file; options before its name are passed over.
    fn picture(&mut self, statement: &str, color: bool) -> Option<Handle<TextureImage>> {
        let name = statement.trim();
        let name = if name.starts_with('-') { name.split_ascii_whitespace().last().unwrap_or(name) } else { name };
        let name = name.replace('\\', "/");
        let key = (name, color);
        if let Some(known) = self.images.get(&key) {
            return *known;
        }
        let encoding = if color { Encoding::Srgb } else { Encoding::Linear };
        let read = inside(self.files, self.base, &key.0, self.options.allow_outside)
            .and_then(|p| read_all(self.files, &p))
            .and_then(|b| read_texels(&b, &key.0, Some(encoding)).map_err(|e| e.to_string()));
        let handle = match read {
            Ok(texels) => {
                if let Some(what) = texels.not_finite() {
                    self.warn_once(format!("{}: {what}: samples that meet them are reported", key.0));
                }
                Some(self.push(key.0.clone(), texels, color))
            }
            Err(message) => {
                self.warn_once(format!("a picture is left out: {message}"));
                None
            }
        };
        self.images.insert(key, handle);
        handle
    }

    fn push(&mut self, name: String, texels: Texels, color: bool) -> Handle<TextureImage> {
        let texels = if color { texels.truncated(3) } else { texels.channel(0).unwrap_or(texels) };
        self.scene.images.push(TextureImage {
            name,
            texels,
            lookup: Lookup::Bilinear,
            wrap: [Wrap::Repeat; 2],
            color_space: ColorSpace::Srgb,
        })
    }
}
