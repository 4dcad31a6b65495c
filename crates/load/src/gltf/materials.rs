//! Materials of glTF 2.0 with the extensions that say more about them.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::textures::{Meaning, Part};
use steradian_math::{Transform, ln};
use steradian_scene::{
    AnisotropyInputs, AreaLight, Coefficients, FilmInputs, FloatInput, FloatTexture, Handle, ImageMap, Ior, Material,
    Medium, MediumInterface, MetallicRoughnessInputs, NormalMap, Phase, Scattering, SpectrumInput, Texture, Volume,
};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

/// What covers a surface.
#[derive(Clone, Debug)]
pub(super) struct Cover {
    pub material: Handle<Material>,
    pub light: Option<AreaLight>,
    pub alpha: Option<FloatInput>,
    pub media: Option<MediumInterface>,
}

/// A material as it depends on the mesh that it is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct CoverKey {
    /// None is the default material.
    pub material: Option<usize>,
    /// Whether the mesh has colours at its vertices, and opacity among them.
    pub colors: Option<bool>,
    /// Whether its bitangents point the other way.
    pub mirrored: bool,
}

/// Whether any texture of a material lives in the tangent frame.
pub(super) fn needs_tangents(material: &Json) -> bool {
    let coat = material.extension("KHR_materials_clearcoat");
    material.get("normalTexture").is_some()
        || material.extension("KHR_materials_anisotropy").is_some()
        || coat.is_some_and(|c| c.get("clearcoatNormalTexture").is_some())
}

impl Gltf<'_, '_> {
    /// What a material makes of a surface.
    pub(super) fn cover(&mut self, key: CoverKey, at: &Json) -> Result<Cover> {
        if let Some(cover) = self.covers.get(&key) {
            return cover.clone().ok_or_else(|| at.problem("its material could not be read"));
        }
        let json = match key.material {
            None => None,
            Some(i) => Some(
                self.materials
                    .get(i)
                    .cloned()
                    .ok_or_else(|| missing(at, "material", "material", i, self.materials.len()))?,
            ),
        };
        let cover = match json {
            None => self.default_cover(key),
            Some(json) => self.read_material(&json, key),
        };
        self.covers.insert(key, cover.as_ref().ok().cloned());
        cover
    }

    fn default_cover(&mut self, key: CoverKey) -> Result<Cover> {
        let base = self.with_vertex_colors([1.0; 3], None, key, SpectrumUse::Albedo)?;
        let one = self.float(1.0);
        let inputs = MetallicRoughnessInputs::plain(base, one, one);
        Ok(Cover { material: self.push_material("", inputs, None), light: None, alpha: None, media: None })
    }

    fn push_material(
        &mut self,
        name: &str,
        inputs: MetallicRoughnessInputs,
        normal_map: Option<NormalMap>,
    ) -> Handle<Material> {
        let scattering = Scattering::MetallicRoughness(Box::new(inputs));
        self.scene.materials.push(Material {
            name: name.to_string(),
            scattering,
            displacement: None,
            normal_map,
            tilt: None,
        })
    }

    /// A number between 0 and 1.
    fn share(&mut self, at: &Json, key: &str, absent: f32) -> Result<f32> {
        let Some(v) = at.get(key) else { return Ok(absent) };
        self.within(&v)
    }

    /// A number between 0 and 1 times a channel of a texture.
    fn share_map(&mut self, at: &Json, key: &str, absent: f32, (map, channel): (&str, u8)) -> Result<FloatInput> {
        let share = self.share(at, key, absent)?;
        self.scaled(at.get(map).as_ref(), channel, share)
    }

    /// Numbers between 0 and 1.
    fn shares<const N: usize>(&mut self, at: &Json, key: &str) -> Result<Option<[f32; N]>> {
        let Some(mut numbers) = at.numbers::<N>(key)? else { return Ok(None) };
        for (number, v) in numbers.iter_mut().zip(at.list(key)?) {
            *number = self.within(&v)?;
        }
        Ok(Some(numbers))
    }

    /// A number that should lie between 0 and 1, brought there: in silence where a writer has rounded it.
    fn within(&mut self, v: &Json) -> Result<f32> {
        let number = v.as_number()?;
        if number < -1e-3 {
            return Err(v.problem("must not be negative"));
        }
        let cut = number.clamp(0.0, 1.0);
        if number > 1.001 {
            self.warn_at(v, &format!("{number} is more than 1, and counts as 1"));
        }
        Ok(cut)
    }

    /// A colour, its texture, and the colours at the vertices.
    fn with_vertex_colors(
        &mut self,
        factor: [f32; 3],
        texture: Option<&Json>,
        key: CoverKey,
        usage: SpectrumUse,
    ) -> Result<SpectrumInput> {
        let a = self.tinted(texture, factor, usage)?;
        if key.colors.is_none() {
            return Ok(a);
        }
        let vertex = if usage == SpectrumUse::Illuminant { SpectrumUse::Unbounded } else { usage };
        let b = self.push_spectrum(vertex, Texture::Vertex);
        Ok(self.push_spectrum(usage, Texture::Product { a, b }))
    }

    fn read_material(&mut self, m: &Json, key: CoverKey) -> Result<Cover> {
        let name = m.text("name")?.unwrap_or("").to_string();
        let gloss = m.extension("KHR_materials_pbrSpecularGlossiness");
        let pbr = m.get("pbrMetallicRoughness");
        let (factor, texture) = match (&gloss, &pbr) {
            (Some(g), _) => (self.shares::<4>(g, "diffuseFactor")?, g.get("diffuseTexture")),
            (None, Some(p)) => (self.shares::<4>(p, "baseColorFactor")?, p.get("baseColorTexture")),
            (None, None) => (None, None),
        };
        let [r, g, b, opacity] = factor.unwrap_or([1.0; 4]);
        let alpha = self.alpha(m, texture.as_ref(), opacity, key)?;
        if m.extension("KHR_materials_unlit").is_some() {
            return self.unlit(&name, [r, g, b], texture.as_ref(), alpha, key);
        }
        let base = self.with_vertex_colors([r, g, b], texture.as_ref(), key, SpectrumUse::Albedo)?;
        let mut inputs = match (&gloss, &pbr) {
            (Some(g), _) => self.specular_glossiness(g, base)?,
            (None, Some(p)) => {
                let map = "metallicRoughnessTexture";
                let metallic = self.share_map(p, "metallicFactor", 1.0, (map, 2))?;
                let roughness = self.share_map(p, "roughnessFactor", 1.0, (map, 1))?;
                MetallicRoughnessInputs::plain(base, metallic, roughness)
            }
            (None, None) => {
                let one = self.float(1.0);
                MetallicRoughnessInputs::plain(base, one, one)
            }
        };
        self.interface(m, &mut inputs)?;
        self.layers(m, &mut inputs, key)?;
        let media = self.volume(m, &mut inputs)?;
        let normal_map = m.get("normalTexture").map(|t| self.normal_map(&t, key)).transpose()?;
        let coat_normal = m.extension("KHR_materials_clearcoat");
        if coat_normal.is_some_and(|c| c.get("clearcoatNormalTexture").is_some()) {
            self.approximate("KHR_materials_clearcoat: the coat has the normals of what it covers");
        }
        if m.get("occlusionTexture").is_some() {
            self.approximate("occlusion textures are not used: light that is traced knows what it meets");
        }
        let light = self.emission(m)?;
        Ok(Cover { material: self.push_material(&name, inputs, normal_map), light, alpha, media })
    }

    fn specular_glossiness(&mut self, g: &Json, base: SpectrumInput) -> Result<MetallicRoughnessInputs> {
        let map = g.get("specularGlossinessTexture");
        let specular = self.shares(g, "specularFactor")?.unwrap_or([1.0; 3]);
        let f0 = self.tinted(map.as_ref(), specular, SpectrumUse::Albedo)?;
        let glossiness = self.share(g, "glossinessFactor", 1.0)?;
        let roughness = self.complement(map.as_ref(), 3, glossiness)?;
        let zero = self.float(0.0);
        self.used("KHR_materials_pbrSpecularGlossiness");
        Ok(MetallicRoughnessInputs { f0: Some(f0), ..MetallicRoughnessInputs::plain(base, zero, roughness) })
    }

    /// Index, strength and colour of the dielectric's reflection; transmission.
    fn interface(&mut self, m: &Json, out: &mut MetallicRoughnessInputs) -> Result<()> {
        let mut eta = 1.5;
        if let Some(e) = m.extension("KHR_materials_ior") {
            eta = e.amount("ior", 1.5)?;
            if eta != 0.0 && eta < 1.0 {
                return Err(e.problem(format!("`ior` must be 0 or at least 1, not {eta}")));
            }
        }
        if let Some(e) = m.extension("KHR_materials_specular") {
            out.specular = Some(self.share_map(&e, "specularFactor", 1.0, ("specularTexture", 3))?);
            let tint = e.numbers("specularColorFactor")?.unwrap_or([1.0; 3]);
            out.specular_color =
                Some(self.tinted(e.get("specularColorTexture").as_ref(), tint, SpectrumUse::Unbounded)?);
        }
        if let Some(e) = m.extension("KHR_materials_transmission") {
            let share = self.share(&e, "transmissionFactor", 0.0)?;
            if share > 0.0 {
                out.transmission = Some(self.scaled(e.get("transmissionTexture").as_ref(), 0, share)?);
            }
        }
        if let Some(e) = m.extension("KHR_materials_diffuse_transmission") {
            let share = self.share(&e, "diffuseTransmissionFactor", 0.0)?;
            if share > 0.0 {
                let tint = self.shares(&e, "diffuseTransmissionColorFactor")?.unwrap_or([1.0; 3]);
                let share = self.scaled(e.get("diffuseTransmissionTexture").as_ref(), 3, share)?;
                let map = e.get("diffuseTransmissionColorTexture");
                out.diffuse_transmission = Some((share, self.tinted(map.as_ref(), tint, SpectrumUse::Albedo)?));
            }
        }
        // Zero stands for a surface that reflects everything at every angle.
        if eta == 0.0 {
            out.f0 = Some(self.color([1.0; 3], SpectrumUse::Albedo));
            eta = 1.5;
        }
        let dispersion = match m.extension("KHR_materials_dispersion") {
            Some(e) => e.amount("dispersion", 0.0)?,
            None => 0.0,
        };
        out.eta = Ior::Constant(eta);
        if dispersion > 0.0 && out.transmission.is_some() {
            out.eta = Ior::Spectrum(dispersive(eta, 20.0 / dispersion));
            self.disperses = true;
        }
        Ok(())
    }

    /// Coat, sheen, film, anisotropy.
    fn layers(&mut self, m: &Json, out: &mut MetallicRoughnessInputs, key: CoverKey) -> Result<()> {
        if let Some(e) = m.extension("KHR_materials_clearcoat") {
            let share = self.share(&e, "clearcoatFactor", 0.0)?;
            if share > 0.0 {
                let share = self.scaled(e.get("clearcoatTexture").as_ref(), 0, share)?;
                let map = ("clearcoatRoughnessTexture", 1);
                out.coat = Some([share, self.share_map(&e, "clearcoatRoughnessFactor", 0.0, map)?]);
            }
        }
        if let Some(e) = m.extension("KHR_materials_sheen") {
            let tint: [f32; 3] = self.shares(&e, "sheenColorFactor")?.unwrap_or([0.0; 3]);
            if tint != [0.0; 3] {
                let color = self.tinted(e.get("sheenColorTexture").as_ref(), tint, SpectrumUse::Albedo)?;
                let map = ("sheenRoughnessTexture", 3);
                out.sheen = Some((color, self.share_map(&e, "sheenRoughnessFactor", 0.0, map)?));
            }
        }
        if let Some(e) = m.extension("KHR_materials_iridescence") {
            let factor = self.share(&e, "iridescenceFactor", 0.0)?;
            if factor > 0.0 {
                let least = e.amount("iridescenceThicknessMinimum", 100.0)?;
                let most = e.amount("iridescenceThicknessMaximum", 400.0)?;
                let thickness = match e.get("iridescenceThicknessTexture") {
                    None => self.float(most),
                    Some(map) => {
                        let (a, b) = (self.float(least), self.float(most));
                        let amount = self.scaled(Some(&map), 1, 1.0)?;
                        self.scene.float_textures.push(FloatTexture(Texture::Mix { a, b, amount }))
                    }
                };
                let factor = self.scaled(e.get("iridescenceTexture").as_ref(), 0, factor)?;
                out.film = Some(FilmInputs { factor, eta: e.amount("iridescenceIor", 1.3)?.max(1.0), thickness });
            }
        }
        if let Some(e) = m.extension("KHR_materials_anisotropy") {
            let strength = self.share(&e, "anisotropyStrength", 0.0)?;
            if strength > 0.0 {
                let map = e.get("anisotropyTexture");
                let direction = map.as_ref().map(|t| self.image_map(t, Part::Color, Meaning::Data)).transpose()?;
                out.anisotropy = Some(AnisotropyInputs {
                    strength: self.scaled(map.as_ref(), 2, strength)?,
                    rotation: e.number("anisotropyRotation", 0.0)?,
                    direction,
                    mirrored: key.mirrored,
                });
            }
        }
        Ok(())
    }

    /// `KHR_materials_volume`: what is inside, if the surface is the boundary of something.
    fn volume(&mut self, m: &Json, out: &mut MetallicRoughnessInputs) -> Result<Option<MediumInterface>> {
        let Some(e) = m.extension("KHR_materials_volume") else { return Ok(None) };
        let thick = e.amount("thicknessFactor", 0.0)? > 0.0;
        if !thick || out.transmission.is_none() && out.diffuse_transmission.is_none() {
            return Ok(None);
        }
        out.thin = false;
        if e.get("thicknessTexture").is_some() {
            self.approximate("KHR_materials_volume: thickness is that of the geometry, not of `thicknessTexture`");
        }
        let color: [f32; 3] = self.shares(&e, "attenuationColor")?.unwrap_or([1.0; 3]);
        let distance = match e.get("attenuationDistance") {
            None => f32::INFINITY,
            Some(d) if d.as_number()? > 0.0 => d.as_number()?,
            Some(d) => return Err(d.problem("must be positive")),
        };
        let sigma = color.map(|c| -ln(c.clamp(1e-4, 1.0)) / distance);
        let inside = if sigma == [0.0; 3] {
            None
        } else {
            let of = |rgb| Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb);
            let coefficients =
                Coefficients { sigma_a: of(sigma), sigma_s: Spectrum::constant(0.0, SpectrumUse::Unbounded) };
            Some(self.scene.media.push(Medium {
                name: m.text("name")?.unwrap_or("").to_string(),
                phase: Phase::HenyeyGreenstein { g: 0.0 },
                scale: 1.0,
                world_from_medium: Transform::IDENTITY,
                volume: Volume::Homogeneous { coefficients, emission: None },
            }))
        };
        Ok(Some(MediumInterface { inside, outside: None }))
    }

    fn normal_map(&mut self, info: &Json, key: CoverKey) -> Result<NormalMap> {
        let ImageMap { image, mapping, .. } = self.image_map(info, Part::Color, Meaning::Data)?;
        Ok(NormalMap { image, mapping, scale: info.number("scale", 1.0)?, mirrored: key.mirrored })
    }

    /// Opacity, where the surface is not opaque.
    fn alpha(&mut self, m: &Json, texture: Option<&Json>, factor: f32, key: CoverKey) -> Result<Option<FloatInput>> {
        let mode = m.text("alphaMode")?.unwrap_or("OPAQUE");
        if mode == "OPAQUE" {
            return Ok(None);
        }
        let cutoff = m.number("alphaCutoff", 0.5)?;
        if mode == "BLEND" && texture.is_none() && factor >= 1.0 && key.colors != Some(true) {
            return Ok(None);
        }
        let mut alpha = self.scaled(texture, 3, factor)?;
        if key.colors == Some(true) {
            let b = self.scene.float_textures.push(FloatTexture(Texture::Vertex));
            alpha = self.scene.float_textures.push(FloatTexture(Texture::Product { a: alpha, b }));
        }
        match mode {
            "BLEND" => Ok(Some(alpha)),
            "MASK" => {
                Ok(Some(self.scene.float_textures.push(FloatTexture(Texture::Threshold { tex: alpha, at: cutoff }))))
            }
            other => Err(m.need("alphaMode")?.problem(format!("`{other}` is none of OPAQUE, MASK and BLEND"))),
        }
    }

    /// What a surface shines by itself.
    fn emission(&mut self, m: &Json) -> Result<Option<AreaLight>> {
        let factor: [f32; 3] = m.numbers("emissiveFactor")?.unwrap_or([0.0; 3]);
        let strength = match m.extension("KHR_materials_emissive_strength") {
            Some(e) => e.amount("emissiveStrength", 1.0)?,
            None => 1.0,
        };
        if factor.iter().any(|&v| v < 0.0) {
            return Err(m.need("emissiveFactor")?.problem("must not be negative"));
        }
        if factor == [0.0; 3] || strength == 0.0 {
            return Ok(None);
        }
        let texture = match m.get("emissiveTexture") {
            None => None,
            Some(map) => Some(self.tinted(Some(&map), factor, SpectrumUse::Illuminant)?),
        };
        Ok(Some(self.light(factor, texture, strength, m.flag("doubleSided")?)))
    }

    fn light(&self, rgb: [f32; 3], texture: Option<SpectrumInput>, strength: f32, two_sided: bool) -> AreaLight {
        let radiance = Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb);
        let scale = strength / ColorSpace::Srgb.photometric();
        AreaLight { radiance, scale, two_sided, power: None, image: None, texture, group: None }
    }

    /// A surface that shows its colour whatever shines on it: here, by shining itself.
    fn unlit(
        &mut self,
        name: &str,
        rgb: [f32; 3],
        texture: Option<&Json>,
        alpha: Option<FloatInput>,
        key: CoverKey,
    ) -> Result<Cover> {
        self.approximate("KHR_materials_unlit: the surface shines with its colour, so that it lights others as well");
        let texture = self.with_vertex_colors(rgb, texture, key, SpectrumUse::Illuminant)?;
        let black = self.color([0.0; 3], SpectrumUse::Albedo);
        let scattering = Scattering::Diffuse { reflectance: black };
        let material =
            Material { name: name.to_string(), scattering, displacement: None, normal_map: None, tilt: None };
        let light = Some(self.light(rgb, Some(texture), 1.0, true));
        Ok(Cover { material: self.scene.materials.push(material), light, alpha, media: None })
    }
}

/// Cauchy's formula through an index at the yellow line, with an Abbe number.
fn dispersive(eta: f32, abbe: f32) -> Spectrum {
    const BLUE: f32 = 486.1;
    const YELLOW: f32 = 587.6;
    const RED: f32 = 656.3;
    let square = |l: f32| 1.0 / (l * l);
    let b = (eta - 1.0) / (abbe * (square(BLUE) - square(RED)));
    let a = eta - b * square(YELLOW);
    let lambda: Vec<f32> = (0..=48).map(|i| 350.0 + 10.0 * i as f32).collect();
    let values: Vec<f32> = lambda.iter().map(|&l| (a + b * square(l)).max(1.0)).collect();
    Spectrum::piecewise_linear(&lambda, &values, SpectrumUse::Unbounded)
        .unwrap_or_else(|_| Spectrum::constant(eta, SpectrumUse::Unbounded))
}
