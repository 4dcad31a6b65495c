//! Textures: one builder for both kinds, which differ in what a constant and an input is.

use super::images::ImageUse;
use super::names::defined_twice;
use super::params::{FLOAT_TEXTURE, Params, SPECTRUM_TEXTURE};
use super::{Loader, use_key};
use std::collections::BTreeMap;
use steradian_image::{Encoding, Lookup, Wrap};
use steradian_math::{Transform, Vec3};
use steradian_scene::{CheckerMapping, FloatTexture, Handle, ImageMap, Mapping2, Noise, SpectrumTexture, Texture};
use steradian_spectrum::{Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Directive, ParamType, Span, Values, did_you_mean};

/// The two name spaces of textures. A texture may use those defined before it; everything else may use any.
#[derive(Default)]
pub(super) struct Textures {
    float: BTreeMap<String, FloatEntry>,
    spectrum: BTreeMap<String, SpectrumEntry>,
    float_constants: BTreeMap<u32, Handle<FloatTexture>>,
    /// How deep textures nest, by handle. Evaluation recurses, so the depth is bounded.
    float_depth: BTreeMap<usize, u32>,
    spectrum_depth: BTreeMap<usize, u32>,
    /// The deepest input of the texture that is being built.
    nesting: u32,
}

struct FloatEntry {
    handle: Handle<FloatTexture>,
    defined: Option<Span>,
    used: Span,
}

/// A spectral texture is made once for each use, since the use decides what RGB numbers stand for.
struct SpectrumEntry {
    handles: [Option<Handle<SpectrumTexture>>; 3],
    defined: Span,
    /// What is wrong with it as a reflectance only; reported when it is used as one.
    albedo_problems: Vec<Diagnostic>,
}

/// Deeper nesting than this is a mistake or an attack.
const MOST_NESTING: u32 = 64;

const FLOAT_CLASSES: [&str; 12] = [
    "constant",
    "scale",
    "mix",
    "directionmix",
    "bilerp",
    "imagemap",
    "checkerboard",
    "dots",
    "fbm",
    "wrinkled",
    "windy",
    "ptex",
];
const SPECTRUM_CLASSES: [&str; 10] =
    ["constant", "scale", "mix", "directionmix", "bilerp", "imagemap", "checkerboard", "dots", "marble", "ptex"];

/// What the two kinds of texture do differently.
trait Kind {
    type Input: Copy;
    type Constant;
    fn input(&self, loader: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> Self::Input;
    fn constant(&self, loader: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> Self::Constant;
}

struct FloatKind;
struct SpectrumKind(SpectrumUse);

impl Kind for FloatKind {
    type Input = Handle<FloatTexture>;
    type Constant = f32;
    fn input(&self, loader: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> Self::Input {
        loader.float_texture(params, name, default)
    }
    fn constant(&self, _: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> f32 {
        params.float(name, default)
    }
}

impl Kind for SpectrumKind {
    type Input = Handle<SpectrumTexture>;
    type Constant = Spectrum;
    fn input(&self, loader: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> Self::Input {
        loader.spectrum_texture(params, name, self.0, default)
    }
    fn constant(&self, loader: &mut Loader, params: &mut Params, name: &'static str, default: f32) -> Spectrum {
        loader.spectrum(params, name, self.0).unwrap_or_else(|| Spectrum::constant(default, self.0))
    }
}

impl Loader<'_> {
    /// `Texture "name" "kind" "class"`.
    pub(super) fn texture(&mut self, mut d: Directive) {
        let (name, kind, class) = (d.text(0).to_string(), d.text(1).to_string(), d.text(2).to_string());
        let (name_span, kind_span) = (d.arg_span(0), d.arg_span(1));
        let mut params = self.params(&mut d);
        let ctm = self.state.ctm[0];
        if self.state.is_animated() {
            params.warning("textures do not move; the transform at the start is used", None);
        }
        match kind.as_str() {
            "float" => self.define_float(&name, name_span, &class, params, &ctm),
            "spectrum" => self.define_spectrum(&name, name_span, &class, params, &ctm),
            _ => {
                let e = Diagnostic::error(
                    format!("a texture is of kind \"float\" or \"spectrum\", not \"{kind}\""),
                    kind_span,
                );
                self.diagnostics.push(if kind == "color" { e.with_hint("pbrt-v4 calls it \"spectrum\"") } else { e });
            }
        }
    }

    fn define_float(&mut self, name: &str, span: Span, class: &str, mut params: Params, ctm: &Transform) {
        if let Some(FloatEntry { defined: Some(first), .. }) = self.textures.float.get(name) {
            self.diagnostics.push(defined_twice("float texture", name, span, *first));
            return;
        }
        self.textures.nesting = 0;
        let texture = match class {
            "fbm" | "wrinkled" | "windy" => Some(Texture::Noise {
                texture_from_world: ctm.inverse(),
                noise: match class {
                    "windy" => Noise::Windy,
                    _ => {
                        let octaves = params.int_in("octaves", 8, 0..=64) as u32;
                        let omega = params.float("roughness", 0.5);
                        if class == "fbm" { Noise::Fbm { octaves, omega } } else { Noise::Wrinkled { octaves, omega } }
                    }
                },
            }),
            _ => self.build_texture(&FloatKind, class, &mut params, ctm, &FLOAT_CLASSES),
        };
        let texture = FloatTexture(texture.unwrap_or(Texture::Constant(1.0)));
        let depth = self.depth(&mut params);
        // A shape may have used the name already: then its handle is there, and waits for this.
        let handle = match self.textures.float.get_mut(name) {
            Some(entry) => {
                entry.defined = Some(span);
                self.scene.float_textures[entry.handle] = texture;
                entry.handle
            }
            None => {
                let handle = self.scene.float_textures.push(texture);
                self.textures.float.insert(name.to_string(), FloatEntry { handle, defined: Some(span), used: span });
                handle
            }
        };
        self.textures.float_depth.insert(handle.index(), depth);
        self.diagnostics.append(&mut params.finish());
    }

    fn define_spectrum(&mut self, name: &str, span: Span, class: &str, mut params: Params, ctm: &Transform) {
        if let Some(entry) = self.textures.spectrum.get(name) {
            self.diagnostics.push(defined_twice("spectrum texture", name, span, entry.defined));
            return;
        }
        let mut entry = SpectrumEntry { handles: [None; 3], defined: span, albedo_problems: Vec::new() };
        let mut common = Vec::new();
        for usage in [SpectrumUse::Unbounded, SpectrumUse::Illuminant, SpectrumUse::Albedo] {
            self.textures.nesting = 0;
            let kind = match class {
                "marble" => Some(Texture::Noise {
                    texture_from_world: ctm.inverse(),
                    noise: Noise::Marble {
                        octaves: params.int_in("octaves", 8, 0..=64) as u32,
                        omega: params.float("roughness", 0.5),
                        scale: params.float("scale", 1.0),
                        variation: params.float("variation", 0.2),
                    },
                }),
                _ => self.build_texture(&SpectrumKind(usage), class, &mut params, ctm, &SPECTRUM_CLASSES),
            };
            let depth = self.depth(&mut params);
            let kind = kind.unwrap_or_else(|| Texture::Constant(Spectrum::constant(0.5, usage)));
            let handle = self.scene.spectrum_textures.push(SpectrumTexture { usage, kind });
            self.textures.spectrum_depth.insert(handle.index(), depth);
            entry.handles[usize::from(use_key(usage))] = Some(handle);
            let problems = std::mem::take(&mut params.diagnostics);
            match usage {
                SpectrumUse::Unbounded => common = problems,
                SpectrumUse::Illuminant => {}
                SpectrumUse::Albedo => {
                    entry.albedo_problems = problems.into_iter().filter(|p| !common.contains(p)).collect()
                }
            }
        }
        self.textures.spectrum.insert(name.to_string(), entry);
        params.diagnostics = common;
        self.diagnostics.append(&mut params.finish());
    }

    /// The depth of the texture just built; too deep is an error.
    fn depth(&mut self, params: &mut Params) -> u32 {
        let depth = self.textures.nesting + 1;
        if depth > MOST_NESTING {
            params.error(format!("textures nest more than {MOST_NESTING} deep"), None);
        }
        depth
    }

    fn build_texture<K: Kind>(
        &mut self,
        kind: &K,
        class: &str,
        params: &mut Params,
        ctm: &Transform,
        classes: &[&'static str],
    ) -> Option<Texture<K::Input, K::Constant>> {
        let p = params;
        Some(match class {
            "constant" => Texture::Constant(kind.constant(self, p, "value", 1.0)),
            "scale" => {
                Texture::Scale { tex: kind.input(self, p, "tex", 1.0), scale: self.float_texture(p, "scale", 1.0) }
            }
            "mix" => Texture::Mix {
                a: kind.input(self, p, "tex1", 0.0),
                b: kind.input(self, p, "tex2", 1.0),
                amount: self.float_texture(p, "amount", 0.5),
            },
            "directionmix" => {
                let dir = p.vector("dir", Vec3::new(0.0, 1.0, 0.0));
                let dir = ctm.vector(dir).try_normalize().unwrap_or_else(|| {
                    let span = p.span_of("dir");
                    p.error("`dir` cannot be zero", span);
                    Vec3::new(0.0, 1.0, 0.0)
                });
                Texture::DirectionMix { a: kind.input(self, p, "tex1", 0.0), b: kind.input(self, p, "tex2", 1.0), dir }
            }
            "bilerp" => Texture::Bilerp {
                mapping: mapping(p, ctm),
                corners: [
                    kind.constant(self, p, "v00", 0.0),
                    kind.constant(self, p, "v01", 1.0),
                    kind.constant(self, p, "v10", 0.0),
                    kind.constant(self, p, "v11", 1.0),
                ],
            },
            "imagemap" => Texture::Image(self.image_map(p, ctm)?),
            "checkerboard" => {
                let mapping = match p.int_in("dimension", 2, 2..=3) {
                    3 => CheckerMapping::Space(ctm.inverse()),
                    _ => CheckerMapping::Plane(mapping(p, ctm)),
                };
                Texture::Checkerboard {
                    mapping,
                    a: kind.input(self, p, "tex1", 1.0),
                    b: kind.input(self, p, "tex2", 0.0),
                }
            }
            "dots" => Texture::Dots {
                mapping: mapping(p, ctm),
                // pbrt-v4 hands the two to its texture the other way round, and its scenes are written for what it shows.
                outside: kind.input(self, p, "inside", 1.0),
                inside: kind.input(self, p, "outside", 0.0),
            },
            "ptex" => {
                p.error("`ptex` textures are not supported yet", None);
                p.accept_all();
                return None;
            }
            _ => {
                let known = did_you_mean(class, classes.iter().copied());
                let d = Diagnostic::error(format!("unknown texture \"{class}\""), p.span);
                p.diagnostics.push(match known {
                    Some(_) => d.with_suggestion(known),
                    None => d.with_hint(format!("it can be {}", classes.join(", "))),
                });
                p.accept_all();
                return None;
            }
        })
    }

    fn image_map(&mut self, p: &mut Params, ctm: &Transform) -> Option<ImageMap> {
        let mapping = mapping(p, ctm);
        let max_anisotropy = p.float("maxanisotropy", 8.0);
        let lookup = match p.string("filter") {
            None => Lookup::Bilinear,
            Some((name, span)) => Lookup::from_name(&name, max_anisotropy).unwrap_or_else(|| {
                unknown_word(p, "filter", &name, span, &["point", "bilinear", "trilinear", "ewa"]);
                Lookup::Bilinear
            }),
        };
        let wrap = match p.string("wrap") {
            None => Wrap::Repeat,
            Some((name, span)) => Wrap::from_name(&name).unwrap_or_else(|| {
                unknown_word(p, "wrap", &name, span, &["repeat", "clamp", "black", "octahedralsphere"]);
                Wrap::Repeat
            }),
        };
        let encoding = match p.string("encoding") {
            None => None,
            Some((name, span)) => Encoding::from_name(&name).or_else(|| {
                unknown_word(p, "encoding", &name, span, &["sRGB", "linear", "gamma 2.2"]);
                None
            }),
        };
        let (scale, invert) = (p.float("scale", 1.0), p.boolean("invert", false));
        let Some((file, span)) = p.string("filename") else {
            p.error(format!("{} needs a `filename`", p.what()), None);
            return None;
        };
        let image = self.image(p, &file, span, ImageUse { encoding, lookup, wrap: [wrap; 2] })?;
        Some(ImageMap { mapping, image, scale, invert })
    }

    /// A constant scalar texture; equal ones are shared.
    pub(super) fn float_constant(&mut self, value: f32) -> Handle<FloatTexture> {
        let arena = &mut self.scene.float_textures;
        *self
            .textures
            .float_constants
            .entry(value.to_bits())
            .or_insert_with(|| arena.push(FloatTexture(Texture::Constant(value))))
    }

    /// A constant spectral texture.
    pub(super) fn spectrum_constant(&mut self, spectrum: Spectrum) -> Handle<SpectrumTexture> {
        let usage = spectrum.usage();
        self.scene.spectrum_textures.push(SpectrumTexture { usage, kind: Texture::Constant(spectrum) })
    }

    /// A scalar texture.
    pub(super) fn float_texture(
        &mut self,
        params: &mut Params,
        name: &'static str,
        default: f32,
    ) -> Handle<FloatTexture> {
        match self.maybe_float_texture(params, name) {
            Some(handle) => handle,
            None => self.float_constant(default),
        }
    }

    /// A scalar texture, if it is given: a number, or the name of a texture that is defined.
    pub(super) fn maybe_float_texture(
        &mut self,
        params: &mut Params,
        name: &'static str,
    ) -> Option<Handle<FloatTexture>> {
        let (param, _) = params.raw(name, FLOAT_TEXTURE)?;
        match &param.values {
            Values::Floats(v) => match v.as_slice() {
                &[v] => Some(self.float_constant(v)),
                v => {
                    params.error(
                        format!("parameter `{name}` of {} takes one value, but {} are given", params.what(), v.len()),
                        param.values_span,
                    );
                    None
                }
            },
            Values::Strings(v) => {
                let [(texture, span)] = v.as_slice() else { return None };
                let defined = self.textures.float.get(texture).filter(|e| e.defined.is_some()).map(|e| e.handle);
                match defined {
                    Some(handle) => {
                        let depth = self.textures.float_depth.get(&handle.index()).copied().unwrap_or(1);
                        self.textures.nesting = self.textures.nesting.max(depth);
                        Some(handle)
                    }
                    None => {
                        let d = self.no_texture("float", texture, *span);
                        params.diagnostics.push(d);
                        None
                    }
                }
            }
            _ => None,
        }
    }

    /// The opacity of a shape: unlike other textures it may be defined later.
    pub(super) fn alpha(&mut self, params: &mut Params) -> Option<Handle<FloatTexture>> {
        let (param, _) = params.raw("alpha", FLOAT_TEXTURE)?;
        let Values::Strings(v) = &param.values else {
            let value = params.float("alpha", 1.0);
            return (value < 1.0).then(|| self.float_constant(value));
        };
        let [(name, span)] = v.as_slice() else { return None };
        if let Some(entry) = self.textures.float.get(name) {
            return Some(entry.handle);
        }
        let handle = self.scene.float_textures.push(FloatTexture(Texture::Constant(1.0)));
        self.textures.float.insert(name.clone(), FloatEntry { handle, defined: None, used: *span });
        Some(handle)
    }

    /// A spectral texture.
    pub(super) fn spectrum_texture(
        &mut self,
        params: &mut Params,
        name: &'static str,
        usage: SpectrumUse,
        default: f32,
    ) -> Handle<SpectrumTexture> {
        match self.maybe_spectrum_texture(params, name, usage) {
            Some(handle) => handle,
            None => self.spectrum_constant(Spectrum::constant(default, usage)),
        }
    }

    /// A spectral texture, if it is given.
    pub(super) fn maybe_spectrum_texture(
        &mut self,
        params: &mut Params,
        name: &'static str,
        usage: SpectrumUse,
    ) -> Option<Handle<SpectrumTexture>> {
        let (param, space) = params.raw(name, SPECTRUM_TEXTURE)?;
        if param.ty != ParamType::Texture {
            let spectrum = self.spectrum_of(params, &param, space, usage)?;
            return Some(self.spectrum_constant(spectrum));
        }
        let Values::Strings(v) = &param.values else { return None };
        let [(texture, span)] = v.as_slice() else { return None };
        match self.textures.spectrum.get_mut(texture) {
            Some(entry) => {
                if usage == SpectrumUse::Albedo {
                    params.diagnostics.append(&mut entry.albedo_problems);
                }
                let handle = entry.handles[usize::from(use_key(usage))]?;
                let depth = self.textures.spectrum_depth.get(&handle.index()).copied().unwrap_or(1);
                self.textures.nesting = self.textures.nesting.max(depth);
                Some(handle)
            }
            None => {
                let d = self.no_texture("spectrum", texture, *span);
                params.diagnostics.push(d);
                None
            }
        }
    }

    fn no_texture(&self, kind: &str, name: &str, span: Span) -> Diagnostic {
        let d = Diagnostic::error(format!("there is no {kind} texture \"{name}\""), span);
        let (float, spectrum) = (&self.textures.float, &self.textures.spectrum);
        let (other, near) = if kind == "float" {
            let defined = float.iter().filter(|(_, e)| e.defined.is_some()).map(|(n, _)| n.as_str());
            (spectrum.contains_key(name), did_you_mean(name, defined))
        } else {
            (float.contains_key(name), did_you_mean(name, spectrum.keys().map(String::as_str)))
        };
        if other {
            let other = if kind == "float" { "spectrum" } else { "float" };
            return d
                .with_hint(format!("there is a {other} texture of that name, but a {kind} texture is needed here"));
        }
        d.with_suggestion(near)
    }

    /// Errors for opacity textures that never came.
    pub(super) fn undefined_textures(&self) -> Vec<Diagnostic> {
        let missing = self.textures.float.iter().filter(|(_, e)| e.defined.is_none());
        missing.map(|(name, e)| self.no_texture("float", name, e.used)).collect()
    }
}

fn unknown_word(p: &mut Params, what: &str, word: &str, span: Span, known: &[&'static str]) {
    let d = Diagnostic::error(format!("`{what}` of {} cannot be \"{word}\"", p.what()), span);
    p.diagnostics.push(match did_you_mean(word, known.iter().copied()) {
        Some(near) => d.with_suggestion(Some(near)),
        None => d.with_hint(format!("it can be {}", known.join(", "))),
    });
}

/// How the surface is laid onto the plane of the texture.
fn mapping(p: &mut Params, ctm: &Transform) -> Mapping2 {
    let texture_from_world = ctm.inverse();
    let kind = p.choice("mapping", &[("uv", 0), ("spherical", 1), ("cylindrical", 2), ("planar", 3)]);
    match kind {
        1 => Mapping2::Spherical { texture_from_world },
        2 => Mapping2::Cylindrical { texture_from_world },
        3 => Mapping2::Planar {
            texture_from_world,
            vs: p.vector("v1", Vec3::new(1.0, 0.0, 0.0)),
            vt: p.vector("v2", Vec3::new(0.0, 1.0, 0.0)),
            ds: p.float("udelta", 0.0),
            dt: p.float("vdelta", 0.0),
        },
        _ => Mapping2::Uv {
            su: p.float("uscale", 1.0),
            sv: p.float("vscale", 1.0),
            du: p.float("udelta", 0.0),
            dv: p.float("vdelta", 0.0),
        },
    }
}
