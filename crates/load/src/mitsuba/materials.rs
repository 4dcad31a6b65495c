//! BSDFs of Mitsuba as materials.

use super::Mitsuba;
use super::tree::{Object, Value};
use steradian_math::sqr;
use steradian_scene::{
    AnisotropyInputs, Coat, FloatInput, Handle, Ior, Material, Metal, MetallicRoughnessInputs, NormalMap, Roughness,
    Scattering, SpectrumInput, Texture,
};
use steradian_spectrum::{Spectrum, SpectrumUse};

/// A material, and what lets light through it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    pub material: Handle<Material>,
    pub alpha: Option<FloatInput>,
}

/// Materials inside of materials, at most.
const MOST_NESTED: usize = 32;

impl Mitsuba<'_> {
    /// The material of a BSDF.
    pub(super) fn cover(&mut self, index: usize, depth: usize) -> Cover {
        if let Some(cover) = self.covers.get(&index) {
            return *cover;
        }
        let o = self.object(index);
        if depth > MOST_NESTED {
            self.error("materials are nested too deep, or contain themselves", o.span);
            return self.default_cover();
        }
        let cover = self.bsdf(&o, depth);
        self.finish(&o);
        self.covers.insert(index, cover);
        cover
    }

    pub(super) fn default_cover(&mut self) -> Cover {
        let reflectance = self.constant(Spectrum::constant(0.5, SpectrumUse::Albedo));
        self.plain(Scattering::Diffuse { reflectance })
    }

    fn plain(&mut self, scattering: Scattering) -> Cover {
        let material = Material { name: String::new(), scattering, displacement: None, normal_map: None };
        Cover { material: self.scene.materials.push(material), alpha: None }
    }

    /// The one BSDF inside of another.
    fn nested(&mut self, o: &Object, depth: usize) -> Cover {
        match self.child(o, "bsdf") {
            Some(inner) => self.cover(inner, depth + 1),
            None => {
                self.error(format!("the bsdf `{}` needs another inside", o.kind), o.span);
                self.default_cover()
            }
        }
    }

    fn bsdf(&mut self, o: &Object, depth: usize) -> Cover {
        let albedo = SpectrumUse::Albedo;
        match o.kind.as_str() {
            "diffuse" => {
                self.note_once("surfaces of opaque BSDFs scatter on both sides, with or without `twosided`", o.span);
                let reflectance = self.spectrum(o, "reflectance", albedo, 0.5);
                self.plain(Scattering::Diffuse { reflectance })
            }
            "twosided" => self.nested(o, depth),
            "null" => self.plain(Scattering::Interface),
            "dielectric" => {
                let eta = Ior::Constant(self.relative_index(o, 1.5046));
                self.only_white(o, &["specular_reflectance", "specular_transmittance"]);
                let roughness = self.smooth();
                self.plain(Scattering::Dielectric { eta, roughness })
            }
            "roughdielectric" => {
                let eta = Ior::Constant(self.relative_index(o, 1.5046));
                self.only_white(o, &["specular_reflectance", "specular_transmittance"]);
                let roughness = self.roughness(o);
                self.plain(Scattering::Dielectric { eta, roughness })
            }
            "thindielectric" => {
                let eta = Ior::Constant(self.relative_index(o, 1.5046));
                self.only_white(o, &["specular_reflectance", "specular_transmittance"]);
                self.plain(Scattering::ThinDielectric { eta })
            }
            "conductor" | "roughconductor" => {
                let roughness = if o.kind == "conductor" { self.smooth() } else { self.roughness(o) };
                self.only_white(o, &["specular_reflectance"]);
                let metal = self.metal_of(o);
                self.plain(Scattering::Conductor { metal, roughness })
            }
            "plastic" | "roughplastic" => self.plastic(o),
            "mask" => {
                let inner = self.nested(o, depth);
                let alpha = self.float_input(o, "opacity", 0.5);
                if inner.alpha.is_some() {
                    self.error("a mask inside of a mask", o.span);
                }
                Cover { alpha: Some(alpha), ..inner }
            }
            "blendbsdf" => self.blend(o, depth),
            "normalmap" => {
                let inner = self.nested(o, depth);
                let map = self.named(o, "normalmap").map(|i| self.object(i));
                let Some(map) = map.and_then(|t| self.bitmap(&t, false)) else {
                    self.error("a normal map needs a texture of that name", o.span);
                    return inner;
                };
                let mut material = self.scene.materials[inner.material].clone();
                material.normal_map = Some(NormalMap { mapping: map.mapping, ..NormalMap::new(map.image) });
                Cover { material: self.scene.materials.push(material), ..inner }
            }
            "bumpmap" => {
                let inner = self.nested(o, depth);
                let Some(height) = self.child(o, "texture").map(|i| self.object(i)) else {
                    self.error("a bump map needs a texture", o.span);
                    return inner;
                };
                let (tex, scale) = (self.float_texture(&height), self.float(o, "scale", 1.0));
                let scale = self.number(scale);
                let mut material = self.scene.materials[inner.material].clone();
                material.displacement = tex.map(|tex| {
                    self.scene.float_textures.push(steradian_scene::FloatTexture(Texture::Scale { tex, scale }))
                });
                Cover { material: self.scene.materials.push(material), ..inner }
            }
            "principled" | "principledthin" => self.principled(o),
            _ => {
                self.not_built(o);
                self.default_cover()
            }
        }
    }

    /// Index inside over the index outside.
    fn relative_index(&mut self, o: &Object, absent: f32) -> f32 {
        let inside = self.float(o, "int_ior", absent);
        let outside = self.float(o, "ext_ior", 1.000_277);
        if inside > 0.0 && outside > 0.0 {
            return inside / outside;
        }
        self.error("indices of refraction must be positive", o.span);
        absent
    }

    /// Parameters that can only be 1 here.
    fn only_white(&mut self, o: &Object, names: &[&str]) {
        for name in names {
            let textured = self.named(o, name).is_some();
            let Some(p) = o.get(name).cloned() else {
                if textured {
                    self.note_once(&format!("`{name}` is not used: all light is reflected"), o.span);
                }
                continue;
            };
            let is_one = match &p.value {
                Value::Float(v) => *v == 1.0,
                Value::Integer(v) => *v == 1,
                Value::Rgb(rgb) => *rgb == [1.0; 3],
                Value::Spectrum(s) => s.iter().all(|v| v.1 == 1.0),
                _ => false,
            };
            if !is_one {
                self.note_once(&format!("`{name}` is not used: all light is reflected"), p.span);
            }
        }
    }

    fn smooth(&mut self) -> Roughness {
        let zero = self.number(0.0);
        Roughness { u: zero, v: zero, remap: false }
    }

    fn roughness(&mut self, o: &Object) -> Roughness {
        let both = self.float_input(o, "alpha", 0.1);
        let has = |name: &str| o.params.contains_key(name) || o.children.iter().any(|c| c.0 == name);
        let u = if has("alpha_u") { self.float_input(o, "alpha_u", 0.1) } else { both };
        let v = if has("alpha_v") { self.float_input(o, "alpha_v", 0.1) } else { both };
        // How Mitsuba samples changes nothing in what it shows.
        o.get("sample_visible");
        match self.text(o, "distribution").as_deref() {
            Some("ggx") => {}
            // Beckmann's is the default.
            _ => self.note_once(
                "rough surfaces have the distribution `ggx` instead of `beckmann`, with the same alpha",
                o.span,
            ),
        }
        Roughness { u, v, remap: false }
    }

    fn metal_of(&mut self, o: &Object) -> Metal {
        let unbounded = SpectrumUse::Unbounded;
        let name = self.text(o, "material");
        if let Some(name) = name.filter(|n| n != "none") {
            if let Some([eta, k]) = self.metal(&name, o.span) {
                return Metal::Ior { eta: self.constant(eta), k: self.constant(k) };
            }
        } else if o.params.contains_key("eta") || o.children.iter().any(|c| c.0 == "eta") {
            let (eta, k) = (self.spectrum(o, "eta", unbounded, 0.0), self.spectrum(o, "k", unbounded, 1.0));
            return Metal::Ior { eta, k };
        }
        // A perfect mirror.
        let (eta, k) = (Spectrum::constant(0.0, unbounded), Spectrum::constant(1e4, unbounded));
        Metal::Ior { eta: self.constant(eta), k: self.constant(k) }
    }

    /// A dielectric coat over a diffuse base. Mitsuba leaves the base's colour as it is however often light comes back to it,
    /// unless told to be `nonlinear`: the colour is chosen here that gives the same.
    fn plastic(&mut self, o: &Object) -> Cover {
        let eta = self.relative_index(o, 1.49);
        let nonlinear = self.flag(o, "nonlinear", false);
        self.only_white(o, &["specular_reflectance"]);
        let roughness = if o.kind == "plastic" { self.smooth() } else { self.roughness(o) };
        let reflectance = match o.get("diffuse_reflectance").cloned() {
            Some(p) if !nonlinear => {
                let f = internal_reflectance(eta);
                let darker = |r: f32| r / (1.0 - f + r * f);
                let value = match &p.value {
                    Value::Rgb(rgb) => Value::Rgb(rgb.map(darker)),
                    Value::Float(v) => Value::Float(darker(*v)),
                    Value::Spectrum(s) => Value::Spectrum(s.iter().map(|&(l, v)| (l, darker(v))).collect()),
                    other => other.clone(),
                };
                let s = self.spectrum_of(&value, SpectrumUse::Albedo, p.span);
                s.map(|s| self.constant(s))
            }
            _ => None,
        };
        if reflectance.is_none() && !nonlinear && self.named(o, "diffuse_reflectance").is_some() {
            self.note_once("textured plastic has its colour multiplied as if `nonlinear`", o.span);
        }
        let reflectance =
            reflectance.unwrap_or_else(|| self.spectrum(o, "diffuse_reflectance", SpectrumUse::Albedo, 0.5));
        let (thickness, g) = (self.number(1e-6), self.number(0.0));
        let albedo = self.constant(Spectrum::constant(0.0, SpectrumUse::Albedo));
        let coat = Coat { roughness, eta: Ior::Constant(eta), thickness, albedo, g, max_depth: 100, samples: 1 };
        self.plain(Scattering::CoatedDiffuse { reflectance, coat })
    }

    fn blend(&mut self, o: &Object, depth: usize) -> Cover {
        let inner: Vec<usize> = self
            .children(&o.children)
            .into_iter()
            .map(|c| c.1)
            .filter(|&i| self.tree().objects[i].class == "bsdf")
            .collect();
        let [a, b] = inner[..] else {
            self.error("a blend needs two BSDFs inside", o.span);
            return self.default_cover();
        };
        let (a, b) = (self.cover(a, depth + 1), self.cover(b, depth + 1));
        let amount = self.float_input(o, "weight", 0.5);
        self.plain(Scattering::Mix { materials: [a.material, b.material], amount })
    }

    fn principled(&mut self, o: &Object) -> Cover {
        self.note_once(
            "`principled` is shown by the layered surface of glTF, which differs in its diffuse part and sheen",
            o.span,
        );
        let thin = o.kind == "principledthin";
        let base: SpectrumInput = self.spectrum(o, "base_color", SpectrumUse::Albedo, 0.5);
        let metallic = self.float_input(o, "metallic", 0.0);
        let roughness = self.float_input(o, "roughness", 0.5);
        let eta = if o.params.contains_key("eta") {
            self.float(o, "eta", 1.5)
        } else {
            // Disney's: the index that reflects eight hundredths of it.
            let root = (0.08 * self.float(o, "specular", 0.5).clamp(0.0, 1.0)).sqrt();
            (1.0 + root) / (1.0 - root)
        };
        let has = |name: &str| o.params.contains_key(name) || o.children.iter().any(|c| c.0 == name);
        let transmission = has("spec_trans").then(|| self.float_input(o, "spec_trans", 0.0));
        let coat = has("clearcoat").then(|| {
            let share = self.float_input(o, "clearcoat", 0.0);
            let gloss = self.float(o, "clearcoat_gloss", 0.0);
            // Alpha from a tenth to a thousandth, as roughness.
            [share, self.number((0.1 + gloss * (0.001 - 0.1)).max(0.0).sqrt())]
        });
        let sheen = has("sheen").then(|| {
            let s = self.float(o, "sheen", 0.0).clamp(0.0, 1.0);
            (self.constant(Spectrum::constant(s, SpectrumUse::Albedo)), self.number(0.5))
        });
        let back = has("diff_trans").then(|| {
            let share = self.float(o, "diff_trans", 0.0);
            (self.number(share / 2.0), base)
        });
        let stretch = has("anisotropic").then(|| self.float_input(o, "anisotropic", 0.0));
        let inputs = MetallicRoughnessInputs {
            base,
            metallic,
            roughness,
            eta: Ior::Constant(eta.max(1.0)),
            specular: None,
            specular_color: None,
            f0: None,
            transmission,
            thin,
            diffuse_transmission: back,
            coat,
            sheen,
            film: None,
            anisotropy: stretch.map(|strength| AnisotropyInputs {
                strength,
                rotation: 0.0,
                direction: None,
                mirrored: false,
            }),
        };
        for name in ["spec_tint", "sheen_tint", "flatness"] {
            if has(name) {
                self.note_once(&format!("`{name}` of `principled` is not used"), o.span);
                o.get(name);
            }
        }
        self.plain(Scattering::MetallicRoughness(Box::new(inputs)))
    }
}

/// Share of diffuse light that a smooth interface sends back to below it: `2 int F(cos) cos dcos`.
fn internal_reflectance(eta: f32) -> f32 {
    const STEPS: u32 = 4096;
    (0..STEPS)
        .map(|i| {
            let cos = (i as f32 + 0.5) / STEPS as f32;
            let sin2 = (1.0 - sqr(cos)) * sqr(eta);
            let f = if sin2 >= 1.0 { 1.0 } else { steradian_bsdf::fresnel_dielectric(-cos, eta) };
            2.0 * f * cos / STEPS as f32
        })
        .sum()
}
