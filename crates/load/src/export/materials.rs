//! Materials that pbrt has.

use super::Writer;
use super::bake::{Flat, affine};
use super::text::{number, quoted, spectrum};
use std::fmt::Write;
use steradian_image::Precision;
use steradian_scene::{
    Coat, HairColor, Handle, Ior, Material, Metal, NormalMap, Roughness, Scattering, Texture, Translucency,
};

impl Writer<'_> {
    /// Declares a material, once; its name.
    pub(super) fn material(&mut self, handle: Handle<Material>) -> String {
        let key = (handle.index(), self.straight);
        if let Some(name) = self.materials.get(&key) {
            return name.clone();
        }
        let name = format!("material{}", self.materials.len());
        // In case it contains itself.
        self.materials.insert(key, name.clone());
        let text = self.stated(&name, handle, "");
        self.make(&name, &text);
        name
    }

    pub(super) fn make(&mut self, name: &str, text: &str) {
        self.head(&format!("MakeNamedMaterial \"{name}\" \"string type\" {text}"));
    }

    /// The type of a material and its parameters. `relief` is what perturbs the normals of what surrounds it.
    pub(super) fn stated(&mut self, name: &str, handle: Handle<Material>, relief: &str) -> String {
        let m = &self.scene.materials[handle];
        let own = self.relief(m);
        let relief = if own.is_empty() { relief } else { &own };
        match self.plain(&m.scattering) {
            Some(text) if matches!(m.scattering, Scattering::Interface | Scattering::Hair { .. }) => text,
            Some(text) => text + relief,
            None => match &m.scattering {
                Scattering::Mix { materials, amount } => {
                    let names = materials.map(|m| self.material(m));
                    let amount = self.float_param("amount", *amount);
                    format!("\"mix\" \"string materials\" [ \"{}\" \"{}\" ] {amount}", names[0], names[1])
                }
                other => self.nearest(name, other, relief),
            },
        }
    }

    /// What perturbs the normals.
    fn relief(&mut self, m: &Material) -> String {
        let mut text = String::new();
        if m.tilt.is_some() {
            self.note("bumps do not shadow each other in pbrt");
        }
        if let Some(map) = &m.normal_map {
            let file = self.normal_map(map);
            let _ = write!(text, " \"string normalmap\" \"{}\"", quoted(&file));
        } else if let Some(height) = m.displacement {
            let _ = write!(text, " {}", self.float_param("displacement", height));
        }
        text
    }

    /// A normal map with its strength in it.
    fn normal_map(&mut self, map: &NormalMap) -> String {
        if !self.straight && affine(&map.mapping) != Some((0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])) {
            self.note("normal maps lie as the mesh's first texture coordinates do");
        }
        if map.scale == 1.0 && !map.mirrored {
            return self.picture(map.image).0;
        }
        let key = format!("normal{}-{}{}", map.image.index(), map.scale.to_bits(), if map.mirrored { "m" } else { "" });
        let picture = self.flat_picture(map.image).map(|rgb| {
            let [x, y, z] = rgb.map(|v| 2.0 * v - 1.0);
            let (x, y) = (x * map.scale, if map.mirrored { -y } else { y } * map.scale);
            let length = (x * x + y * y + z * z).sqrt().max(1e-6);
            [x, y, z].map(|v| 0.5 + 0.5 * v / length)
        });
        match picture {
            Flat::Picture(p) => self.baked(&key, &p, Precision::Half),
            Flat::Even(_) => String::new(),
        }
    }

    fn plain(&mut self, s: &Scattering) -> Option<String> {
        Some(match s {
            Scattering::Diffuse { reflectance } => {
                format!("\"diffuse\" {}", self.spectrum_param("reflectance", *reflectance))
            }
            Scattering::Conductor { metal, roughness } => {
                format!("\"conductor\" {} {}", self.metal("", metal), self.roughness(roughness))
            }
            Scattering::Dielectric { eta, roughness } => {
                format!("\"dielectric\" {} {}", ior("eta", eta), self.roughness(roughness))
            }
            Scattering::ThinDielectric { eta } => format!("\"thindielectric\" {}", ior("eta", eta)),
            Scattering::DiffuseTransmission { reflectance, transmittance, scale } => format!(
                "\"diffusetransmission\" {} {} \"float scale\" {}",
                self.spectrum_param("reflectance", *reflectance),
                self.spectrum_param("transmittance", *transmittance),
                number(*scale)
            ),
            Scattering::CoatedDiffuse { reflectance, coat } => {
                let base = self.spectrum_param("reflectance", *reflectance);
                let (eta, layer) = (ior("eta", &coat.eta), self.coat(coat));
                format!("\"coateddiffuse\" {base} {eta} {layer} {}", self.roughness(&coat.roughness))
            }
            Scattering::CoatedConductor { metal, roughness, coat } => {
                if roughness.remap != coat.roughness.remap {
                    self.note("one rule for the roughness of a coat and of the metal below it");
                }
                format!(
                    "\"coatedconductor\" {} {} {} {} {} \"bool remaproughness\" {}",
                    self.metal("conductor.", metal),
                    self.rough("conductor.", roughness),
                    ior("interface.eta", &coat.eta),
                    self.coat(coat),
                    self.rough("interface.", &coat.roughness),
                    roughness.remap
                )
            }
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
                let [(first, a), (second, b)] = match inside {
                    Translucency::Coefficients { sigma_a, sigma_s } => [("sigma_a", *sigma_a), ("sigma_s", *sigma_s)],
                    Translucency::Reflectance { reflectance, mean_free_path } => {
                        [("reflectance", *reflectance), ("mfp", *mean_free_path)]
                    }
                };
                let inside = format!("{} {}", self.spectrum_param(first, a), self.spectrum_param(second, b));
                let rough = self.roughness(roughness);
                let [scale, g, eta] = [*scale, *g, *eta].map(number);
                format!("\"subsurface\" {inside} \"float scale\" {scale} \"float g\" {g} \"float eta\" {eta} {rough}")
            }
            Scattering::Interface => "\"interface\"".into(),
            _ => return None,
        })
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

    fn roughness(&mut self, r: &Roughness) -> String {
        format!("{} \"bool remaproughness\" {}", self.rough("", r), r.remap)
    }

    fn rough(&mut self, prefix: &str, r: &Roughness) -> String {
        format!(
            "{} {}",
            self.float_param(&format!("{prefix}uroughness"), r.u),
            self.float_param(&format!("{prefix}vroughness"), r.v)
        )
    }

    /// Whether a roughness is zero everywhere.
    pub(super) fn is_smooth(&self, r: &Roughness) -> bool {
        let zero = |t| matches!(self.scene.float_textures[t].0, Texture::Constant(v) if v == 0.0);
        zero(r.u) && zero(r.v)
    }
}

/// An index of refraction.
pub(super) fn ior(name: &str, eta: &Ior) -> String {
    match eta {
        Ior::Constant(v) => format!("\"float {name}\" {}", number(*v)),
        Ior::Spectrum(s) => spectrum(name, s),
    }
}
