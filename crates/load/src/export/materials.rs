//! Materials and textures.

use super::{Writer, list, quoted, spectrum};
use std::fmt::Write;
use steradian_image::{Lookup, Wrap};
use steradian_scene::{
    CheckerMapping, Coat, FloatInput, HairColor, Handle, ImageMap, Ior, Mapping2, Material, Metal, Roughness,
    Scattering, SpectrumInput, Texture, Translucency,
};
use steradian_spectrum::SpectrumUse;

impl Writer<'_> {
    /// Declares a material, once; its name.
    pub(super) fn material(&mut self, handle: Handle<Material>) -> String {
        if let Some(name) = self.materials.get(&handle.index()) {
            return name.clone();
        }
        let name = format!("material{}", handle.index());
        // In case it contains itself.
        self.materials.insert(handle.index(), name.clone());
        let m = self.scene.materials[handle].clone();
        let mut text = self.scattering(&m.scattering);
        if let Some(height) = m.displacement {
            let _ = write!(text, " {}", self.float_param("displacement", height));
        }
        if let Some(map) = &m.normal_map {
            if map.scale != 1.0 || map.mapping != Mapping2::default() {
                self.note("normal maps keep neither strength nor mapping");
            }
            let file = self.image(map.image, true);
            let _ = write!(text, " \"string normalmap\" \"{}\"", quoted(&file));
        }
        self.line(&format!("MakeNamedMaterial \"{name}\" \"string type\" {text}"));
        name
    }

    fn scattering(&mut self, s: &Scattering) -> String {
        match s {
            Scattering::Diffuse { reflectance } => {
                format!("\"diffuse\" {}", self.spectrum_param("reflectance", *reflectance))
            }
            Scattering::Conductor { metal, roughness } => {
                format!("\"conductor\" {} {}", self.metal("", metal), self.roughness("", roughness))
            }
            Scattering::Dielectric { eta, roughness } => {
                format!("\"dielectric\" {} {}", ior("eta", eta), self.roughness("", roughness))
            }
            Scattering::ThinDielectric { eta } => format!("\"thindielectric\" {}", ior("eta", eta)),
            Scattering::DiffuseTransmission { reflectance, transmittance, scale } => format!(
                "\"diffusetransmission\" {} {} \"float scale\" {scale}",
                self.spectrum_param("reflectance", *reflectance),
                self.spectrum_param("transmittance", *transmittance)
            ),
            Scattering::CoatedDiffuse { reflectance, coat } => {
                let base = self.spectrum_param("reflectance", *reflectance);
                format!(
                    "\"coateddiffuse\" {base} {} {} {}",
                    ior("eta", &coat.eta),
                    self.coat(coat),
                    self.roughness("", &coat.roughness)
                )
            }
            Scattering::CoatedConductor { metal, roughness, coat } => format!(
                "\"coatedconductor\" {} {} {} {} {}",
                self.metal("conductor.", metal),
                self.roughness("conductor.", roughness),
                ior("interface.eta", &coat.eta),
                self.coat(coat),
                self.roughness("interface.", &coat.roughness)
            ),
            Scattering::Hair { color, eta, beta_m, beta_n, alpha } => {
                let color = match color {
                    HairColor::Absorption(s) => self.spectrum_param("sigma_a", *s),
                    HairColor::Reflectance(s) => self.spectrum_param("reflectance", *s),
                    HairColor::Melanin { eumelanin, pheomelanin } => format!(
                        "{} {}",
                        self.float_param("eumelanin", *eumelanin),
                        self.float_param("pheomelanin", *pheomelanin)
                    ),
                };
                let rest = [("eta", eta), ("beta_m", beta_m), ("beta_n", beta_n), ("alpha", alpha)];
                let rest: Vec<String> = rest.into_iter().map(|(n, t)| self.float_param(n, *t)).collect();
                format!("\"hair\" {color} {}", rest.join(" "))
            }
            Scattering::Subsurface { inside, scale, g, eta, roughness } => {
                let inside = match inside {
                    Translucency::Coefficients { sigma_a, sigma_s } => {
                        format!(
                            "{} {}",
                            self.spectrum_param("sigma_a", *sigma_a),
                            self.spectrum_param("sigma_s", *sigma_s)
                        )
                    }
                    Translucency::Reflectance { reflectance, mean_free_path } => format!(
                        "{} {}",
                        self.spectrum_param("reflectance", *reflectance),
                        self.spectrum_param("mfp", *mean_free_path)
                    ),
                };
                let rough = self.roughness("", roughness);
                format!("\"subsurface\" {inside} \"float scale\" {scale} \"float g\" {g} \"float eta\" {eta} {rough}")
            }
            Scattering::Mix { materials, amount } => {
                let names = materials.map(|m| self.material(m));
                let amount = self.float_param("amount", *amount);
                format!("\"mix\" \"string materials\" [ \"{}\" \"{}\" ] {amount}", names[0], names[1])
            }
            Scattering::Interface => "\"interface\"".into(),
            other => self.nearest(other),
        }
    }

    /// What stands for a material that pbrt has not.
    fn nearest(&mut self, s: &Scattering) -> String {
        match s {
            Scattering::Sides { front, back } => {
                if !self.is_black(*back) {
                    self.note("surfaces of two materials have the front's on both sides");
                } else {
                    self.note("backs that are black scatter as the front does");
                }
                let front = self.scene.materials[*front].scattering.clone();
                self.scattering(&front)
            }
            Scattering::Altered { interface, reflection, transmission, .. } => {
                if reflection.is_some() || transmission.is_some() {
                    self.note("factors of reflection and transmission are left out");
                }
                self.note("microfacets of Mitsuba become pbrt's, with the same roughness");
                let interface = self.scene.materials[*interface].scattering.clone();
                self.scattering(&interface)
            }
            Scattering::Plastic(p) => {
                self.note("plastic of Mitsuba becomes `coateddiffuse`");
                let base = self.spectrum_param("reflectance", p.reflectance);
                let alpha = p.roughness.map_or(0.0, |r| r.1);
                format!(
                    "\"coateddiffuse\" {base} \"float eta\" {} \"float roughness\" {alpha} \"bool remaproughness\" false",
                    p.eta
                )
            }
            Scattering::Principled(p) => {
                self.note("principled surfaces become `coateddiffuse`, without their other parts");
                let base = self.spectrum_param("reflectance", p.base);
                let rough = self.float_param("roughness", p.roughness);
                format!("\"coateddiffuse\" {base} {rough} \"float eta\" {}", p.eta)
            }
            Scattering::MetallicRoughness(m) => {
                let constant = |t: FloatInput| match self.scene.float_textures[t].0 {
                    Texture::Constant(v) => Some(v),
                    _ => None,
                };
                let (metal, glass) = (constant(m.metallic), m.transmission.and_then(constant).unwrap_or(0.0));
                // Their roughness is the square root of alpha; so is that of `remaproughness`, but for another power.
                let alpha = constant(m.roughness).map_or(0.25, |r| r * r);
                let rough = format!("\"float roughness\" {alpha} \"bool remaproughness\" false");
                self.note("surfaces of glTF become the one of conductor, dielectric and coateddiffuse that is nearest");
                match metal {
                    Some(v) if v > 0.5 => {
                        format!("\"conductor\" {} {rough}", self.spectrum_param("reflectance", m.base))
                    }
                    _ if glass > 0.5 && m.thin => format!("\"thindielectric\" {}", ior("eta", &m.eta)),
                    _ if glass > 0.5 => format!("\"dielectric\" {} {rough}", ior("eta", &m.eta)),
                    _ => {
                        let base = self.spectrum_param("reflectance", m.base);
                        format!("\"coateddiffuse\" {base} {} {rough}", ior("eta", &m.eta))
                    }
                }
            }
            _ => {
                self.note("measured materials are written as grey");
                "\"diffuse\"".into()
            }
        }
    }

    fn is_black(&self, m: Handle<Material>) -> bool {
        match self.scene.materials[m].scattering {
            Scattering::Diffuse { reflectance } => match &self.scene.spectrum_textures[reflectance].kind {
                Texture::Constant(s) => s.is_black(),
                _ => false,
            },
            _ => false,
        }
    }

    fn coat(&mut self, c: &Coat) -> String {
        format!(
            "{} {} {} \"integer maxdepth\" {} \"integer nsamples\" {}",
            self.float_param("thickness", c.thickness),
            self.spectrum_param("albedo", c.albedo),
            self.float_param("g", c.g),
            c.max_depth,
            c.samples
        )
    }

    fn metal(&mut self, prefix: &str, metal: &Metal) -> String {
        match metal {
            Metal::Ior { eta, k } => format!(
                "{} {}",
                self.spectrum_param(&format!("{prefix}eta"), *eta),
                self.spectrum_param(&format!("{prefix}k"), *k)
            ),
            Metal::Reflectance(r) => self.spectrum_param("reflectance", *r),
        }
    }

    fn roughness(&mut self, prefix: &str, r: &Roughness) -> String {
        format!(
            "{} {} \"bool remaproughness\" {}",
            self.float_param(&format!("{prefix}uroughness"), r.u),
            self.float_param(&format!("{prefix}vroughness"), r.v),
            r.remap
        )
    }

    fn spectrum_param(&mut self, name: &str, t: SpectrumInput) -> String {
        match &self.scene.spectrum_textures[t].kind {
            Texture::Constant(s) => spectrum(name, s),
            _ => match self.spectrum_texture(t) {
                Some(texture) => format!("\"texture {name}\" \"{texture}\""),
                None => String::new(),
            },
        }
    }

    /// Declares a texture of numbers; its name. `None` where pbrt has none such.
    pub(super) fn float_texture(&mut self, t: FloatInput) -> Option<String> {
        let name = format!("float{}", t.index());
        if !self.declared.insert(name.clone()) {
            return Some(name);
        }
        let text = match self.scene.float_textures[t].0.clone() {
            Texture::Constant(v) => format!("\"constant\" \"float value\" {v}"),
            Texture::Scale { tex, scale } => {
                format!("\"scale\" {} {}", self.float_param("tex", tex), self.float_param("scale", scale))
            }
            Texture::Product { a, b } => {
                format!("\"scale\" {} {}", self.float_param("tex", a), self.float_param("scale", b))
            }
            Texture::Mix { a, b, amount } => format!(
                "\"mix\" {} {} {}",
                self.float_param("tex1", a),
                self.float_param("tex2", b),
                self.float_param("amount", amount)
            ),
            Texture::Checkerboard { mapping, a, b } => {
                let mapping = self.checker(&mapping);
                format!("\"checkerboard\" {mapping} {} {}", self.float_param("tex1", a), self.float_param("tex2", b))
            }
            Texture::Image(map) => self.image_map(&map, false),
            _ => {
                self.note("textures that pbrt has not, or that this writer does not know, are left out");
                self.declared.remove(&name);
                return None;
            }
        };
        self.line(&format!("Texture \"{name}\" \"float\" {text}"));
        Some(name)
    }

    fn spectrum_texture(&mut self, t: SpectrumInput) -> Option<String> {
        let name = format!("spectrum{}", t.index());
        if !self.declared.insert(name.clone()) {
            return Some(name);
        }
        let text = match self.scene.spectrum_textures[t].kind.clone() {
            Texture::Constant(s) => format!("\"constant\" {}", spectrum("value", &s)),
            Texture::Scale { tex, scale } => {
                format!("\"scale\" {} {}", self.spectrum_param("tex", tex), self.float_param("scale", scale))
            }
            Texture::Mix { a, b, amount } => format!(
                "\"mix\" {} {} {}",
                self.spectrum_param("tex1", a),
                self.spectrum_param("tex2", b),
                self.float_param("amount", amount)
            ),
            Texture::Product { a, b } => {
                // A colour that is the same everywhere multiplies a picture as its brightness does.
                let constant = |t: SpectrumInput| match &self.scene.spectrum_textures[t].kind {
                    Texture::Constant(s) => Some(s.rgb()),
                    _ => None,
                };
                let (tex, rgb) = match (constant(a), constant(b)) {
                    (_, Some(rgb)) => (a, rgb),
                    (Some(rgb), _) => (b, rgb),
                    _ => (a, [1.0; 3]),
                };
                if rgb[0] != rgb[1] || rgb[1] != rgb[2] || constant(a).is_none() && constant(b).is_none() {
                    self.note("products of textures and colours keep the texture and the colour's brightness");
                }
                let grey = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
                format!("\"scale\" {} \"float scale\" {grey}", self.spectrum_param("tex", tex))
            }
            Texture::Checkerboard { mapping, a, b } => {
                let mapping = self.checker(&mapping);
                format!(
                    "\"checkerboard\" {mapping} {} {}",
                    self.spectrum_param("tex1", a),
                    self.spectrum_param("tex2", b)
                )
            }
            Texture::Image(map) => {
                if self.scene.spectrum_textures[t].usage != SpectrumUse::Albedo {
                    self.note("pictures of quantities other than reflectances are read as reflectances");
                }
                self.image_map(&map, false)
            }
            _ => {
                self.note("textures that pbrt has not, or that this writer does not know, are left out");
                self.declared.remove(&name);
                return None;
            }
        };
        self.line(&format!("Texture \"{name}\" \"spectrum\" {text}"));
        Some(name)
    }

    fn checker(&mut self, mapping: &CheckerMapping) -> String {
        match mapping {
            CheckerMapping::Plane(m) => format!("\"integer dimension\" 2 {}", self.mapping(m)),
            CheckerMapping::Space(_) => {
                self.note("checkerboards in space stand where the object's space is");
                "\"integer dimension\" 3".into()
            }
        }
    }

    fn image_map(&mut self, map: &ImageMap, color: bool) -> String {
        let image = &self.scene.images[map.image];
        let filter = match image.lookup {
            Lookup::Texel | Lookup::Point => "point",
            Lookup::Between | Lookup::Bilinear => "bilinear",
            Lookup::Trilinear => "trilinear",
            Lookup::Ewa { .. } => "ewa",
        };
        let wrap = match image.wrap[0] {
            Wrap::Black => "black",
            Wrap::Clamp => "clamp",
            Wrap::Octahedral => "octahedralsphere",
            Wrap::Mirror => {
                self.note("pictures that are mirrored at their edges repeat");
                "repeat"
            }
            _ => "repeat",
        };
        let file = self.image(map.image, color);
        let mapping = self.mapping(&map.mapping);
        format!(
            "\"imagemap\" \"string filename\" \"{}\" \"string filter\" \"{filter}\" \"string wrap\" \"{wrap}\" \"string encoding\" \"linear\" \"float scale\" {} \"bool invert\" {} {mapping}",
            quoted(&file),
            map.scale,
            map.invert
        )
    }

    fn mapping(&mut self, m: &Mapping2) -> String {
        let uv = |su: f32, sv: f32, du: f32, dv: f32| {
            format!("\"float uscale\" {su} \"float vscale\" {sv} \"float udelta\" {du} \"float vdelta\" {dv}")
        };
        match *m {
            Mapping2::Uv { su, sv, du, dv } => uv(su, sv, du, dv),
            Mapping2::Affine { set, rows } => {
                if set != 0 || rows[0][1] != 0.0 || rows[1][0] != 0.0 {
                    self.note("texture coordinates that are turned, or of a second set, are written as they were");
                }
                uv(rows[0][0], rows[1][1], rows[0][2], rows[1][2])
            }
            Mapping2::Planar { vs, vt, ds, dt, .. } => format!(
                "\"string mapping\" \"planar\" \"vector3 v1\" {} \"vector3 v2\" {} \"float udelta\" {ds} \"float vdelta\" {dt}",
                list(&[vs.x, vs.y, vs.z]),
                list(&[vt.x, vt.y, vt.z])
            ),
            Mapping2::Spherical { .. } => "\"string mapping\" \"spherical\"".into(),
            Mapping2::Cylindrical { .. } => "\"string mapping\" \"cylindrical\"".into(),
        }
    }
}

/// An index of refraction.
fn ior(name: &str, eta: &Ior) -> String {
    match eta {
        Ior::Constant(v) => format!("\"float {name}\" {v}"),
        Ior::Spectrum(s) => spectrum(name, s),
    }
}
