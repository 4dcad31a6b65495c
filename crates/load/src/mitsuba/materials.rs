//! BSDFs of Mitsuba as materials.

use super::Mitsuba;
use super::tree::Object;
use crate::files::read_all;
use crate::tensor::measured_material;
use steradian_image::{Encoding, Lookup, Storage, Texels, Wrap};
use steradian_scene::{
    FloatInput, FloatTexture, HairColor, Handle, ImageMap, Ior, Mapping2, Material, Metal, NormalMap, PlasticInputs,
    PrincipledInputs, Roughness, Scattering, Slopes, SpectrumInput, SpectrumTexture, Texture, Tilt,
};
use steradian_spectrum::{Spectrum, SpectrumUse};

/// A material, and what lets light through it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    pub material: Handle<Material>,
    pub alpha: Option<FloatInput>,
    /// Whether the back is black.
    one_sided: bool,
}

/// Materials inside of materials, at most.
const MOST_NESTED: usize = 32;

impl Mitsuba<'_> {
    /// What a shape wears: the material of a BSDF, and its black back if it has one.
    pub(super) fn worn(&mut self, bsdf: Option<usize>) -> (Handle<Material>, Option<FloatInput>) {
        let cover = match bsdf {
            Some(index) => self.cover(index, 0),
            None => self.default_cover(),
        };
        (self.both_sides(cover, bsdf), cover.alpha)
    }

    /// The material with its back, made once for each BSDF.
    fn both_sides(&mut self, cover: Cover, bsdf: Option<usize>) -> Handle<Material> {
        if !cover.one_sided {
            return cover.material;
        }
        if let Some(known) = self.sides.get(&bsdf) {
            return *known;
        }
        let reflectance = self.constant(Spectrum::constant(0.0, SpectrumUse::Albedo));
        let back = self.plain(Scattering::Diffuse { reflectance }).material;
        let sides = self.plain(Scattering::Sides { front: cover.material, back }).material;
        self.sides.insert(bsdf, sides);
        sides
    }

    fn cover(&mut self, index: usize, depth: usize) -> Cover {
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

    fn default_cover(&mut self) -> Cover {
        let reflectance = self.constant(Spectrum::constant(0.5, SpectrumUse::Albedo));
        self.opaque(Scattering::Diffuse { reflectance })
    }

    fn plain(&mut self, scattering: Scattering) -> Cover {
        let material = Material { name: String::new(), scattering, displacement: None, normal_map: None, tilt: None };
        Cover { material: self.scene.materials.push(material), alpha: None, one_sided: false }
    }

    /// What scatters on its front only.
    fn opaque(&mut self, scattering: Scattering) -> Cover {
        Cover { one_sided: true, ..self.plain(scattering) }
    }

    /// A conductor or dielectric with Mitsuba's statistics of slopes and its factors.
    fn altered(&mut self, o: &Object, scattering: Scattering) -> Cover {
        let interface = self.plain(scattering).material;
        let reflection = self.maybe_spectrum(o, "specular_reflectance", SpectrumUse::Albedo);
        let transmission = self.maybe_spectrum(o, "specular_transmittance", SpectrumUse::Albedo);
        let slopes = self.slopes(o);
        self.plain(Scattering::Altered { interface, slopes, reflection, transmission })
    }

    fn slopes(&mut self, o: &Object) -> Slopes {
        // How Mitsuba samples changes nothing in what it shows.
        o.get("sample_visible");
        match self.text(o, "distribution").as_deref() {
            None | Some("beckmann") => Slopes::Beckmann,
            Some("ggx") => Slopes::TrowbridgeReitz,
            Some(other) => {
                self.error(format!("`{other}` is none of the distributions beckmann and ggx"), o.span);
                Slopes::Beckmann
            }
        }
    }

    /// The BSDFs inside of another, in order.
    fn inner(&mut self, o: &Object) -> Vec<usize> {
        let children = self.children(&o.children).into_iter().map(|c| c.1);
        children.filter(|&i| self.reader.tree.objects[i].class == "bsdf").collect()
    }

    /// The one BSDF inside of another.
    fn nested(&mut self, o: &Object, depth: usize) -> Cover {
        match self.inner(o).first() {
            Some(&inner) => self.cover(inner, depth + 1),
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
                let reflectance = self.spectrum(o, "reflectance", albedo, 0.5);
                self.opaque(Scattering::Diffuse { reflectance })
            }
            "twosided" => match self.inner(o)[..] {
                [front, back] => {
                    let (front, back) = (self.cover(front, depth + 1), self.cover(back, depth + 1));
                    self.plain(Scattering::Sides { front: front.material, back: back.material })
                }
                _ => Cover { one_sided: false, ..self.nested(o, depth) },
            },
            "null" => self.plain(Scattering::Interface),
            "dielectric" | "roughdielectric" => {
                let eta = Ior::Constant(self.relative_index(o, 1.5046));
                let roughness = if o.kind == "dielectric" { self.smooth() } else { self.roughness(o) };
                self.altered(o, Scattering::Dielectric { eta, roughness })
            }
            "thindielectric" => {
                self.has_panes = true;
                let eta = Ior::Constant(self.relative_index(o, 1.5046));
                self.altered(o, Scattering::ThinDielectric { eta })
            }
            "polarizer" | "retarder" | "circular" => self.filter_of_polarised_light(o),
            "conductor" | "roughconductor" => {
                let roughness = if o.kind == "conductor" { self.smooth() } else { self.roughness(o) };
                let metal = self.metal_of(o);
                Cover { one_sided: true, ..self.altered(o, Scattering::Conductor { metal, roughness }) }
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
                let tilt = self.tilt(o);
                let inner = self.nested(o, depth);
                let map = self.named(o, "normalmap").map(|i| self.object(i));
                let Some(map) = map.and_then(|t| self.normals(&t)) else {
                    self.error("a normal map needs a texture of that name", o.span);
                    return inner;
                };
                let map = NormalMap { mapping: map.mapping, ..NormalMap::new(map.image) };
                self.tilted(inner, |m| (m.normal_map, m.tilt) = (Some(map.clone()), Some(tilt)))
            }
            "bumpmap" => {
                let tilt = self.tilt(o);
                let inner = self.nested(o, depth);
                let Some(height) = self.child(o, "texture").map(|i| self.object(i)) else {
                    self.error("a bump map needs a texture", o.span);
                    return inner;
                };
                let (tex, scale) = (self.float_texture(&height), self.float(o, "scale", 1.0));
                let Some(tex) = tex else { return inner };
                let scale = self.number(scale);
                let height = self.scene.float_textures.push(FloatTexture(Texture::Scale { tex, scale }));
                self.tilted(inner, |m| (m.displacement, m.tilt) = (Some(height), Some(tilt)))
            }
            "principled" | "principledthin" => self.principled(o),
            "hair" => self.hair(o),
            "measured" => self.measured(o),
            _ => {
                self.not_built(o);
                self.default_cover()
            }
        }
    }

    /// The picture of a normal map; of one normal everywhere, a texel.
    fn normals(&mut self, t: &Object) -> Option<ImageMap> {
        if t.kind == "bitmap" {
            return self.bitmap(t, false);
        }
        let texture = self.texture(t, SpectrumUse::Unbounded)?;
        let Texture::Constant(s) = &self.scene.spectrum_textures[texture].kind else {
            self.error("a normal map is a `bitmap`, or the same everywhere", t.span);
            return None;
        };
        let texels = Texels::new(1, 1, 3, Storage::F32(s.rgb().to_vec()), Encoding::Linear).ok()?;
        let image = self.push_image("normal", texels, Lookup::Point, Wrap::Repeat);
        Some(ImageMap { mapping: Mapping2::default(), image, scale: 1.0, invert: false })
    }

    /// What filters of polarised light do to light that is not: a polariser takes half of it, a retarder nothing.
    fn filter_of_polarised_light(&mut self, o: &Object) -> Cover {
        let said = "light is not polarised here: filters of polarised light only dim it, as in Mitsuba's variants without polarisation";
        self.note_once(said, o.span);
        for ignored in ["theta", "delta", "polarizing", "left_handed"] {
            o.get(ignored);
        }
        self.has_panes = true;
        let usage = SpectrumUse::Albedo;
        let share = if o.kind == "retarder" { 1.0 } else { 0.5 };
        let tex = self.spectrum(o, "transmittance", usage, 1.0);
        let kind = Texture::Scale { tex, scale: self.number(share) };
        let transmission = Some(self.scene.spectrum_textures.push(SpectrumTexture { usage, kind }));
        // A pane of the index of what is around reflects nothing.
        let interface = self.plain(Scattering::ThinDielectric { eta: Ior::Constant(1.0) }).material;
        self.plain(Scattering::Altered { interface, slopes: Slopes::Beckmann, reflection: None, transmission })
    }

    /// What Mitsuba's maps do besides tilting the normal.
    fn tilt(&mut self, o: &Object) -> Tilt {
        Tilt {
            shadowing: self.flag(o, "use_shadowing_function", true),
            mirrors: self.flag(o, "flip_invalid_normals", true),
        }
    }

    /// A cover whose materials are changed, also those that it chooses among.
    fn tilted(&mut self, cover: Cover, change: impl Fn(&mut Material)) -> Cover {
        Cover { material: self.changed(cover.material, &change), ..cover }
    }

    fn changed(&mut self, material: Handle<Material>, change: &impl Fn(&mut Material)) -> Handle<Material> {
        let mut m = self.scene.materials[material].clone();
        match &mut m.scattering {
            Scattering::Mix { materials, .. } => *materials = materials.map(|inner| self.changed(inner, change)),
            Scattering::Sides { front, back } => {
                (*front, *back) = (self.changed(*front, change), self.changed(*back, change));
            }
            _ => change(&mut m),
        }
        self.scene.materials.push(m)
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

    fn smooth(&mut self) -> Roughness {
        let zero = self.number(0.0);
        Roughness { u: zero, v: zero, remap: false }
    }

    fn roughness(&mut self, o: &Object) -> Roughness {
        let both = self.float_input(o, "alpha", 0.1);
        let has = |name: &str| o.params.contains_key(name) || o.children.iter().any(|c| c.0 == name);
        let u = if has("alpha_u") { self.float_input(o, "alpha_u", 0.1) } else { both };
        let v = if has("alpha_v") { self.float_input(o, "alpha_v", 0.1) } else { both };
        Roughness { u, v, remap: false }
    }

    fn metal_of(&mut self, o: &Object) -> Metal {
        let unbounded = SpectrumUse::Unbounded;
        let name = self.text(o, "material");
        if let Some(name) = name.clone().filter(|n| n != "none") {
            if let Some([eta, k]) = self.metal(&name, o.span) {
                return Metal::Ior { eta: self.constant(eta), k: self.constant(k) };
            }
        } else if o.params.contains_key("eta") || o.children.iter().any(|c| c.0 == "eta") {
            let (eta, k) = (self.spectrum(o, "eta", unbounded, 0.0), self.spectrum(o, "k", unbounded, 1.0));
            return Metal::Ior { eta, k };
        }
        if name.is_none() && (o.params.contains_key("k") || o.children.iter().any(|c| c.0 == "k")) {
            let (eta, k) = (self.constant(Spectrum::constant(0.0, unbounded)), self.spectrum(o, "k", unbounded, 1.0));
            return Metal::Ior { eta, k };
        }
        // A perfect mirror.
        let (eta, k) = (Spectrum::constant(0.0, unbounded), Spectrum::constant(1e4, unbounded));
        Metal::Ior { eta: self.constant(eta), k: self.constant(k) }
    }

    fn plastic(&mut self, o: &Object) -> Cover {
        let eta = self.relative_index(o, 1.49);
        if eta <= 1.0 {
            self.error("plastic must be denser than what is around it", o.span);
        }
        let roughness = (o.kind == "roughplastic").then(|| (self.slopes(o), self.float(o, "alpha", 0.1)));
        let inputs = PlasticInputs {
            eta,
            roughness,
            reflectance: self.spectrum(o, "diffuse_reflectance", SpectrumUse::Albedo, 0.5),
            specular: self.maybe_spectrum(o, "specular_reflectance", SpectrumUse::Albedo),
            nonlinear: self.flag(o, "nonlinear", false),
        };
        self.opaque(Scattering::Plastic(inputs))
    }

    fn blend(&mut self, o: &Object, depth: usize) -> Cover {
        let [a, b] = self.inner(o)[..] else {
            self.error("a blend needs two BSDFs inside", o.span);
            return self.default_cover();
        };
        let covers = [a, b].map(|i| self.cover(i, depth + 1));
        let amount = self.float_input(o, "weight", 0.5);
        let one_sided = covers.iter().all(|c| c.one_sided);
        // Diffuse surfaces blend as their colours do, without a choice by chance.
        if let [Some(a), Some(b)] = covers.map(|c| self.diffuse_color(c.material)) {
            let kind = Texture::Mix { a, b, amount };
            let usage = SpectrumUse::Albedo;
            let reflectance = self.scene.spectrum_textures.push(SpectrumTexture { usage, kind });
            return Cover { one_sided, ..self.plain(Scattering::Diffuse { reflectance }) };
        }
        let sides = [a, b].map(Some);
        let materials: [_; 2] =
            std::array::from_fn(|i| if one_sided { covers[i].material } else { self.both_sides(covers[i], sides[i]) });
        Cover { one_sided, ..self.plain(Scattering::Mix { materials, amount }) }
    }

    /// The reflectance of a diffuse material that nothing perturbs.
    fn diffuse_color(&self, material: Handle<Material>) -> Option<SpectrumInput> {
        let m = &self.scene.materials[material];
        match m.scattering {
            Scattering::Diffuse { reflectance } if m.displacement.is_none() && m.normal_map.is_none() => {
                Some(reflectance)
            }
            _ => None,
        }
    }

    /// Mitsuba's hair is pbrt's, with pigments in place of absorption where that is not given.
    fn hair(&mut self, o: &Object) -> Cover {
        let usage = SpectrumUse::Unbounded;
        let scale = self.float(o, "scale", 1.0);
        let color = match self.maybe_spectrum(o, "sigma_a", usage) {
            Some(tex) if scale == 1.0 => HairColor::Absorption(tex),
            Some(tex) => {
                let kind = Texture::Scale { tex, scale: self.number(scale) };
                HairColor::Absorption(self.scene.spectrum_textures.push(SpectrumTexture { usage, kind }))
            }
            None => HairColor::Melanin {
                eumelanin: self.float_input(o, "eumelanin", 1.3),
                pheomelanin: self.float_input(o, "pheomelanin", 0.2),
            },
        };
        let eta = self.relative_index(o, 1.55);
        let hair = Scattering::Hair {
            color,
            eta: self.number(eta),
            beta_m: self.float_input(o, "longitudinal_roughness", 0.3),
            beta_n: self.float_input(o, "azimuthal_roughness", 0.3),
            alpha: self.float_input(o, "scale_tilt", 2.0),
        };
        self.plain(hair)
    }

    /// A material of the database of Dupuy and Jakob (2018).
    fn measured(&mut self, o: &Object) -> Cover {
        let Some(name) = self.text(o, "filename") else {
            self.error("a measured material needs a `filename`", o.span);
            return self.default_cover();
        };
        let read = self.reader.resolve(&name).and_then(|p| read_all(self.files, &p));
        match read.and_then(|bytes| measured_material(&bytes).map_err(|e| format!("{name}: {e}"))) {
            Ok(tables) => {
                let handle = self.scene.measured.push(tables);
                self.opaque(Scattering::Measured(handle))
            }
            Err(message) => {
                self.error(message, o.span);
                self.default_cover()
            }
        }
    }

    fn principled(&mut self, o: &Object) -> Cover {
        let thin = o.kind == "principledthin";
        let eta = if thin || o.params.contains_key("eta") {
            self.float(o, "eta", 1.5)
        } else {
            // The index that reflects eight hundredths of it.
            2.0 / (1.0 - (0.08 * self.float(o, "specular", 0.5).clamp(0.0, 1.0)).sqrt()) - 1.0
        };
        let inputs = PrincipledInputs {
            base: self.spectrum(o, "base_color", SpectrumUse::Albedo, 0.5),
            roughness: self.float_input(o, "roughness", 0.5),
            anisotropic: self.float_input(o, "anisotropic", 0.0),
            metallic: self.float_input(o, "metallic", 0.0),
            transmission: self.float_input(o, "spec_trans", 0.0),
            eta: eta.max(1.001),
            specular_tint: self.float_input(o, "spec_tint", 0.0),
            coat: [self.float_input(o, "clearcoat", 0.0), self.float_input(o, "clearcoat_gloss", 0.0)],
            sheen: [self.float_input(o, "sheen", 0.0), self.float_input(o, "sheen_tint", 0.0)],
            flatness: self.float_input(o, "flatness", 0.0),
            thin: thin.then(|| self.float_input(o, "diff_trans", 0.0)),
        };
        // How often parts are sampled changes nothing in what is shown.
        for part in
            ["main_specular", "clearcoat", "diffuse_reflectance", "specular_reflectance", "specular_transmittance"]
        {
            o.get(&format!("{part}_sampling_rate"));
        }
        o.get("diffuse_transmittance_sampling_rate");
        self.plain(Scattering::Principled(Box::new(inputs)))
    }
}
