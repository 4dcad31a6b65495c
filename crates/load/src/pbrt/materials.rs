//! Materials: noted where they stand, built when all textures are known.

use super::Loader;
use super::images::ImageUse;
use super::media::presets;
use super::names::defined_twice;
use super::params::Params;
use crate::files::read_all;
use crate::tensor::measured_material;
use steradian_image::{Encoding, Lookup, Wrap};
use steradian_scene::{
    Coat, FloatInput, HairColor, Handle, Ior, Material, Metal, NormalMap, Roughness, Scattering, Scene,
    SpectrumTexture, Texture, Translucency,
};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse, named};
use steradian_syntax::{Diagnostic, Directive, ParamType, Span, Values, did_you_mean};

/// A material whose handle is in use but which is not built yet.
pub(super) struct PendingMaterial {
    handle: Handle<Material>,
    /// Empty for one without a name.
    name: String,
    kind: String,
    params: Params,
}

const TYPES: [&str; 12] = [
    "diffuse",
    "conductor",
    "dielectric",
    "thindielectric",
    "coateddiffuse",
    "coatedconductor",
    "diffusetransmission",
    "mix",
    "hair",
    "measured",
    "subsurface",
    "interface",
];

/// The names of the roughness parameters of one interface: both, u, v.
type RoughnessNames = [&'static str; 3];
const ROUGHNESS: RoughnessNames = ["roughness", "uroughness", "vroughness"];

/// The material that a scene starts with: diffuse, half of the light reflected.
pub(super) fn push_default(scene: &mut Scene) -> Handle<Material> {
    let half = Spectrum::constant(0.5, SpectrumUse::Albedo);
    let reflectance =
        scene.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind: Texture::Constant(half) });
    scene.materials.push(Material {
        name: String::new(),
        scattering: Scattering::Diffuse { reflectance },
        displacement: None,
        normal_map: None,
        tilt: None,
    })
}

/// What stands for a material until it is built.
fn placeholder(name: &str) -> Material {
    Material {
        name: name.to_string(),
        scattering: Scattering::Interface,
        displacement: None,
        normal_map: None,
        tilt: None,
    }
}

impl Loader<'_> {
    pub(super) fn material(&mut self, mut d: Directive) {
        let kind = d.text(0).to_string();
        let params = self.params(&mut d);
        let handle = self.scene.materials.push(placeholder(""));
        self.state.material = handle;
        self.pending_materials.push(PendingMaterial { handle, name: String::new(), kind, params });
    }

    pub(super) fn make_named_material(&mut self, mut d: Directive) {
        let (name, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        let Some((kind, kind_span)) = params.string("type") else {
            let d = Diagnostic::error(format!("material \"{name}\" has no `string type`"), span);
            self.diagnostics.push(d);
            return;
        };
        match self.materials.defined(&name, span, &mut self.scene.materials, || placeholder(&name)) {
            Ok(handle) => {
                params.rename(format!("material \"{name}\" ({kind})"));
                params.span = kind_span;
                self.pending_materials.push(PendingMaterial { handle, name, kind, params });
            }
            Err(first) => self.diagnostics.push(defined_twice("material", &name, span, first)),
        }
    }

    pub(super) fn named_material(&mut self, d: &Directive) {
        let name = d.text(0);
        self.state.material = self.materials.used(name, d.arg_span(0), &mut self.scene.materials, || placeholder(name));
    }

    /// Builds all materials in the order of the text, so that a `mix` finds those before it.
    pub(super) fn build_materials(&mut self) {
        let mut built = std::collections::BTreeMap::new();
        for pending in std::mem::take(&mut self.pending_materials) {
            let PendingMaterial { handle, name, kind, mut params } = pending;
            let scattering = self.scattering(&kind, &mut params, &built);
            let mut material = Material { name, scattering, displacement: None, normal_map: None, tilt: None };
            if !matches!(material.scattering, Scattering::Mix { .. } | Scattering::Hair { .. } | Scattering::Interface)
            {
                material.displacement = self.maybe_float_texture(&mut params, "displacement");
                if material.displacement.is_some() {
                    self.trap_of_bumps(&params);
                }
                if let Some((file, span)) = params.string("normalmap") {
                    let usage = ImageUse {
                        encoding: Some(Encoding::Linear),
                        lookup: Lookup::Bilinear,
                        wrap: [Wrap::Repeat; 2],
                    };
                    material.normal_map = self.image(&mut params, &file, span, usage).map(NormalMap::new);
                }
            }
            if !material.name.is_empty() {
                let depth = match &material.scattering {
                    Scattering::Mix { materials, .. } => {
                        1 + materials
                            .iter()
                            .map(|m| built.values().find(|b: &&Built| b.handle == *m).map_or(0, |b| b.depth))
                            .max()
                            .unwrap_or(0)
                    }
                    _ => 0,
                };
                if depth > MOST_NESTING {
                    params.error(format!("materials mix each other more than {MOST_NESTING} deep"), None);
                }
                built.insert(material.name.clone(), Built { handle, depth });
            }
            self.scene.materials[handle] = material;
            self.diagnostics.append(&mut params.finish());
        }
    }

    fn scattering(&mut self, kind: &str, p: &mut Params, built: &BuiltMaterials) -> Scattering {
        let albedo = SpectrumUse::Albedo;
        match kind {
            "diffuse" => Scattering::Diffuse { reflectance: self.spectrum_texture(p, "reflectance", albedo, 0.5) },
            "conductor" => {
                Scattering::Conductor { metal: self.metal(p, "eta", "k"), roughness: self.roughness(p, ROUGHNESS) }
            }
            "dielectric" => Scattering::Dielectric { eta: self.eta(p, "eta"), roughness: self.roughness(p, ROUGHNESS) },
            "thindielectric" => Scattering::ThinDielectric { eta: self.eta(p, "eta") },
            "diffusetransmission" => Scattering::DiffuseTransmission {
                reflectance: self.spectrum_texture(p, "reflectance", albedo, 0.25),
                transmittance: self.spectrum_texture(p, "transmittance", albedo, 0.25),
                scale: p.float("scale", 1.0),
            },
            "coateddiffuse" => Scattering::CoatedDiffuse {
                reflectance: self.spectrum_texture(p, "reflectance", albedo, 0.5),
                coat: self.coat(p, "eta", ROUGHNESS),
            },
            "coatedconductor" => Scattering::CoatedConductor {
                metal: self.metal(p, "conductor.eta", "conductor.k"),
                roughness: self.roughness(p, ["conductor.roughness", "conductor.uroughness", "conductor.vroughness"]),
                coat: self.coat(
                    p,
                    "interface.eta",
                    ["interface.roughness", "interface.uroughness", "interface.vroughness"],
                ),
            },
            "hair" => Scattering::Hair {
                color: self.hair_color(p),
                eta: self.float_texture(p, "eta", 1.55),
                beta_m: self.float_texture(p, "beta_m", 0.3),
                beta_n: self.float_texture(p, "beta_n", 0.3),
                alpha: self.float_texture(p, "alpha", 2.0),
            },
            "measured" => self.measured(p),
            "mix" => self.mix(p, built),
            "interface" => Scattering::Interface,
            "none" | "" => {
                p.warning(format!("material \"{kind}\" is deprecated; write \"interface\""), None);
                Scattering::Interface
            }
            "subsurface" => self.subsurface(p),
            _ => {
                let d = Diagnostic::error(format!("unknown material \"{kind}\""), p.span);
                p.diagnostics.push(match (did_you_mean(kind, TYPES), v3_name(kind)) {
                    (_, Some(new)) => d.with_hint(format!("pbrt-v4 has \"{new}\" instead")),
                    (Some(near), None) => d.with_suggestion(Some(near)),
                    _ => d.with_hint(format!("it can be {}", TYPES.join(", "))),
                });
                p.accept_all();
                Scattering::Interface
            }
        }
    }

    fn roughness(&mut self, p: &mut Params, [both, u, v]: RoughnessNames) -> Roughness {
        let u = self.maybe_float_texture(p, u);
        let v = self.maybe_float_texture(p, v);
        // Asked for even when both are there, since it may then be given as well.
        let both: FloatInput = self.float_texture(p, both, 0.0);
        Roughness { u: u.unwrap_or(both), v: v.unwrap_or(both), remap: p.boolean("remaproughness", true) }
    }

    /// An index of refraction: a number or a spectrum.
    fn eta(&mut self, p: &mut Params, name: &'static str) -> Ior {
        if let Some((values, span)) = p.floats(name) {
            return match values.first() {
                Some(&eta) if eta > 0.0 => Ior::Constant(eta),
                _ => {
                    p.error(format!("`{name}` of {} must be positive", p.what()), span);
                    Ior::Constant(1.5)
                }
            };
        }
        match self.spectrum(p, name, SpectrumUse::Unbounded) {
            Some(s) if s.is_constant() => Ior::Constant(s.eval_at(550.0)),
            Some(s) => {
                self.trap_of_dispersion(p, name);
                Ior::Spectrum(s)
            }
            None => Ior::Constant(1.5),
        }
    }

    fn metal(&mut self, p: &mut Params, eta_name: &'static str, k_name: &'static str) -> Metal {
        let eta = self.maybe_spectrum_texture(p, eta_name, SpectrumUse::Unbounded);
        let k = self.maybe_spectrum_texture(p, k_name, SpectrumUse::Unbounded);
        if let Some(reflectance) = self.maybe_spectrum_texture(p, "reflectance", SpectrumUse::Albedo) {
            if eta.is_some() || k.is_some() {
                let span = p.span_of("reflectance");
                p.error(format!("{} has both `reflectance` and `{eta_name}` or `{k_name}`", p.what()), span);
            }
            return Metal::Reflectance(reflectance);
        }
        let mut copper = |given: Option<_>, name: &str| {
            given.unwrap_or_else(|| {
                let table = named::spectrum(name).unwrap_or_else(|| Spectrum::constant(1.0, SpectrumUse::Unbounded));
                self.spectrum_constant(table)
            })
        };
        Metal::Ior { eta: copper(eta, "metal-Cu-eta"), k: copper(k, "metal-Cu-k") }
    }

    fn coat(&mut self, p: &mut Params, eta: &'static str, roughness: RoughnessNames) -> Coat {
        Coat {
            roughness: self.roughness(p, roughness),
            eta: self.eta(p, eta),
            thickness: self.float_texture(p, "thickness", 0.01),
            albedo: self.spectrum_texture(p, "albedo", SpectrumUse::Albedo, 0.0),
            g: self.float_texture(p, "g", 0.0),
            max_depth: p.int_in("maxdepth", 10, 1..=10_000) as u32,
            samples: p.int_in("nsamples", 1, 1..=10_000) as u32,
        }
    }

    /// Whichever quantity is given first in the order of absorption, colour, pigments; the others are then idle.
    fn hair_color(&mut self, p: &mut Params) -> HairColor {
        let absorption = self.maybe_spectrum_texture(p, "sigma_a", SpectrumUse::Unbounded);
        let reflectance = self.maybe_spectrum_texture(p, "reflectance", SpectrumUse::Albedo);
        let color = self.maybe_spectrum_texture(p, "color", SpectrumUse::Albedo);
        let eumelanin = self.maybe_float_texture(p, "eumelanin");
        let pheomelanin = self.maybe_float_texture(p, "pheomelanin");
        let given = [
            ("sigma_a", absorption.is_some()),
            ("reflectance", reflectance.is_some()),
            ("color", color.is_some()),
            ("eumelanin", eumelanin.is_some()),
            ("pheomelanin", pheomelanin.is_some()),
        ];
        let used = given.iter().find(|g| g.1).map_or("", |g| g.0);
        for (name, _) in given.iter().filter(|g| g.1 && g.0 != used && !(used == "eumelanin" && g.0 == "pheomelanin")) {
            let span = p.span_of(name);
            p.warning(format!("`{name}` of {} is ignored, since `{used}` is given", p.what()), span);
        }
        if let Some(sigma_a) = absorption {
            return HairColor::Absorption(sigma_a);
        }
        if let Some(color) = reflectance.or(color) {
            return HairColor::Reflectance(color);
        }
        // Brown, if nothing is said.
        let brown = if used.is_empty() { 1.3 } else { 0.0 };
        HairColor::Melanin {
            eumelanin: eumelanin.unwrap_or_else(|| self.float_constant(brown)),
            pheomelanin: pheomelanin.unwrap_or_else(|| self.float_constant(0.0)),
        }
    }

    fn subsurface(&mut self, p: &mut Params) -> Scattering {
        let mut g = p.float("g", 0.0);
        if !(g > -1.0 && g < 1.0) {
            let span = p.span_of("g");
            p.error(format!("`g` of {} must be between -1 and 1, not {g}", p.what()), span);
            g = 0.0;
        }
        let mut eta = p.float("eta", 1.33);
        if !(eta > 0.0 && eta.is_finite()) {
            let span = p.span_of("eta");
            p.error(format!("`eta` of {} must be positive", p.what()), span);
            eta = 1.33;
        }
        let inside = match self.preset(p) {
            Some(inside) => {
                if g != 0.0 {
                    let span = p.span_of("g");
                    p.warning("`g` is ignored, since named media have reduced coefficients", span);
                    g = 0.0;
                }
                inside
            }
            None => self.translucency(p),
        };
        Scattering::Subsurface { inside, scale: p.float("scale", 1.0), g, eta, roughness: self.roughness(p, ROUGHNESS) }
    }

    /// The coefficients of a named medium, if a name is given.
    fn preset(&mut self, p: &mut Params) -> Option<Translucency> {
        let (name, span) = p.string("name").filter(|(name, _)| !name.is_empty())?;
        let Some(preset) = presets::find(&name) else {
            let d = Diagnostic::error(format!("unknown medium preset \"{name}\""), span);
            p.diagnostics.push(d.with_suggestion(did_you_mean(&name, presets::names())));
            return None;
        };
        let mut of = |rgb| self.spectrum_constant(Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb));
        Some(Translucency::Coefficients { sigma_a: of(preset.sigma_a), sigma_s: of(preset.sigma_s) })
    }

    fn translucency(&mut self, p: &mut Params) -> Translucency {
        let unbounded = SpectrumUse::Unbounded;
        let sigma_a = self.maybe_spectrum_texture(p, "sigma_a", unbounded);
        let sigma_s = self.maybe_spectrum_texture(p, "sigma_s", unbounded);
        for (given, name, other) in [(sigma_a, "sigma_a", "sigma_s"), (sigma_s, "sigma_s", "sigma_a")] {
            if given.is_some() && (sigma_a.is_none() || sigma_s.is_none()) {
                let span = p.span_of(name);
                p.error(format!("{} has `{name}` without `{other}`", p.what()), span);
            }
        }
        if let (Some(sigma_a), Some(sigma_s)) = (sigma_a, sigma_s) {
            return Translucency::Coefficients { sigma_a, sigma_s };
        }
        if let Some(reflectance) = self.maybe_spectrum_texture(p, "reflectance", SpectrumUse::Albedo) {
            let mean_free_path = self.spectrum_texture(p, "mfp", unbounded, 1.0);
            return Translucency::Reflectance { reflectance, mean_free_path };
        }
        // Whole milk, per millimetre.
        let mut of = |rgb| self.spectrum_constant(Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb));
        Translucency::Coefficients { sigma_a: of([0.0011, 0.0024, 0.014]), sigma_s: of([2.55, 3.21, 3.77]) }
    }

    fn measured(&mut self, p: &mut Params) -> Scattering {
        let Some((name, span)) = p.string("filename") else {
            p.error(format!("{} needs a `string filename`", p.what()), None);
            return Scattering::Interface;
        };
        if let Some(&known) = self.measured.get(&name) {
            return Scattering::Measured(known);
        }
        let path = self.resolve(&name);
        let read = read_all(self.files, &path)
            .and_then(|bytes| measured_material(&bytes).map_err(|e| format!("{}: {e}", path.display())));
        match read {
            Ok(tables) => {
                let handle = self.scene.measured.push(tables);
                self.measured.insert(name, handle);
                Scattering::Measured(handle)
            }
            Err(message) => {
                p.error(message, span);
                Scattering::Interface
            }
        }
    }

    fn mix(&mut self, p: &mut Params, built: &BuiltMaterials) -> Scattering {
        let amount = self.float_texture(p, "amount", 0.5);
        self.trap_of_mix(p);
        let Some((names, span)) = p.strings("materials") else {
            p.error(format!("{} needs the names of two materials in `materials`", p.what()), None);
            return Scattering::Interface;
        };
        let [a, b] = names.as_slice() else {
            p.error(format!("`materials` of {} takes two names, but {} are given", p.what(), names.len()), span);
            return Scattering::Interface;
        };
        let mut find = |(name, span): &(String, Span)| {
            if let Some(known) = built.get(name) {
                if matches!(self.scene.materials[known.handle].scattering, Scattering::Interface) {
                    p.error(format!("`interface` material \"{name}\" cannot be mixed"), *span);
                }
                return Some(known.handle);
            }
            let d = match self.materials.get(name) {
                Some(_) => Diagnostic::error(format!("material \"{name}\" must be defined before it is mixed"), *span),
                None => Diagnostic::error(format!("there is no material \"{name}\""), *span)
                    .with_suggestion(did_you_mean(name, self.materials.known())),
            };
            p.diagnostics.push(d);
            None
        };
        match (find(a), find(b)) {
            (Some(a), Some(b)) => Scattering::Mix { materials: [a, b], amount },
            _ => Scattering::Interface,
        }
    }

    /// The type in `string type`, for media.
    pub(super) fn type_of(params: &mut Params) -> Option<(String, Span)> {
        let (param, _) = params.raw("type", &[ParamType::String])?;
        match param.values {
            Values::Strings(mut v) if v.len() == 1 => v.pop(),
            _ => None,
        }
    }
}

/// A named material that is built, and how deep it mixes others.
struct Built {
    handle: Handle<Material>,
    depth: u32,
}

type BuiltMaterials = std::collections::BTreeMap<String, Built>;

/// Evaluation follows mixes one inside the other; deeper ones than this are a mistake or an attack.
const MOST_NESTING: u32 = 64;

/// What became of the materials of pbrt-v3.
fn v3_name(kind: &str) -> Option<&'static str> {
    Some(match kind {
        "matte" | "disney" => "diffuse",
        "plastic" | "uber" | "substrate" => "coateddiffuse",
        "glass" => "dielectric",
        "metal" | "mirror" => "conductor",
        "translucent" => "diffusetransmission",
        "kdsubsurface" => "subsurface",
        "fourier" => "measured",
        _ => return None,
    })
}
