//! Pictures and samplers of a glTF asset, as textures of the scene.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Problem, Result};
use steradian_image::{Encoding, Lookup, Storage, Texels, Wrap, read_texels};
use steradian_math::sin_cos;
use steradian_scene::{
    FloatInput, FloatTexture, Handle, ImageMap, Mapping2, SpectrumInput, SpectrumTexture, Texture, TextureImage,
};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

/// Which part of a picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    Color,
    Channel(u8),
}

/// What makes two uses of a picture the same picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ImageKey {
    image: usize,
    part: Part,
    srgb: bool,
    wrap: [u8; 2],
    nearest: bool,
}

/// Linear data such as roughness, or colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Color,
    Data,
}

impl Gltf<'_, '_> {
    pub(super) fn float(&mut self, v: f32) -> FloatInput {
        self.scene.float_textures.push(FloatTexture(Texture::Constant(v)))
    }

    pub(super) fn spectrum(&mut self, s: Spectrum) -> SpectrumInput {
        self.push_spectrum(s.usage(), Texture::Constant(s))
    }

    pub(super) fn push_spectrum(
        &mut self,
        usage: SpectrumUse,
        kind: Texture<SpectrumInput, Spectrum>,
    ) -> SpectrumInput {
        self.scene.spectrum_textures.push(SpectrumTexture { usage, kind })
    }

    /// A constant colour.
    pub(super) fn color(&mut self, rgb: [f32; 3], usage: SpectrumUse) -> SpectrumInput {
        let s = match usage {
            SpectrumUse::Albedo => Spectrum::rgb_albedo(ColorSpace::Srgb, rgb),
            SpectrumUse::Unbounded => Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb),
            SpectrumUse::Illuminant => Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb),
        };
        self.spectrum(s)
    }

    /// A colour texture times a colour.
    pub(super) fn tinted(
        &mut self,
        info: Option<&Json>,
        factor: [f32; 3],
        usage: SpectrumUse,
    ) -> Result<SpectrumInput> {
        let Some(info) = info else { return Ok(self.color(factor, usage)) };
        let map = self.image_map(info, Part::Color, Meaning::Color)?;
        let a = self.push_spectrum(usage, Texture::Image(map));
        if factor == [1.0; 3] {
            return Ok(a);
        }
        // The factor of a light is not a light.
        let usage_of_factor = if usage == SpectrumUse::Illuminant { SpectrumUse::Unbounded } else { usage };
        let b = self.color(factor, usage_of_factor);
        Ok(self.push_spectrum(usage, Texture::Product { a, b }))
    }

    /// One channel of a texture times a number.
    pub(super) fn scaled(&mut self, info: Option<&Json>, channel: u8, factor: f32) -> Result<FloatInput> {
        let Some(info) = info else { return Ok(self.float(factor)) };
        let map = self.image_map(info, Part::Channel(channel), Meaning::Data)?;
        Ok(self.scene.float_textures.push(FloatTexture(Texture::Image(ImageMap { scale: factor, ..map }))))
    }

    /// One channel of a texture, which is 1 where it is 0.
    pub(super) fn complement(&mut self, info: Option<&Json>, channel: u8, factor: f32) -> Result<FloatInput> {
        let Some(info) = info else { return Ok(self.float(1.0 - factor)) };
        let map = self.image_map(info, Part::Channel(channel), Meaning::Data)?;
        let map = ImageMap { scale: factor, invert: true, ..map };
        Ok(self.scene.float_textures.push(FloatTexture(Texture::Image(map))))
    }

    /// A reference to a texture.
    pub(super) fn image_map(&mut self, info: &Json, part: Part, meaning: Meaning) -> Result<ImageMap> {
        let index = info.need("index")?.as_count()?;
        let texture = self
            .textures
            .get(index)
            .cloned()
            .ok_or_else(|| missing(info, "index", "texture", index, self.textures.len()))?;
        let image = self.image_of(&texture, part, meaning)?;
        Ok(ImageMap { mapping: self.mapping(info)?, image, scale: 1.0, invert: false })
    }

    /// Which set of coordinates, and how it is moved (`KHR_texture_transform`). Pictures have their origin at the top; the
    /// scene's t axis points up.
    pub(super) fn mapping(&mut self, info: &Json) -> Result<Mapping2> {
        let mut set = info.count("texCoord")?.unwrap_or(0);
        let mut rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        if let Some(t) = info.extension("KHR_texture_transform") {
            let [ox, oy] = t.numbers("offset")?.unwrap_or([0.0; 2]);
            let [sx, sy] = t.numbers("scale")?.unwrap_or([1.0; 2]);
            let (sin, cos) = sin_cos(t.number("rotation", 0.0)?);
            rows = [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]];
            set = t.count("texCoord")?.unwrap_or(set);
        }
        if set > 15 {
            return Err(info.problem(format!("set {set} of texture coordinates; at most 15 are read")));
        }
        let [u, v] = rows;
        Ok(Mapping2::Affine { set: set as u32, rows: [u, [-v[0], -v[1], 1.0 - v[2]]] })
    }

    fn image_of(&mut self, texture: &Json, part: Part, meaning: Meaning) -> Result<Handle<TextureImage>> {
        let (image, from) = self.source(texture)?;
        let (wrap, nearest) = self.sampler(texture)?;
        let code = |w: Wrap| match w {
            Wrap::Clamp => 1,
            Wrap::Mirror => 2,
            _ => 0,
        };
        let key = ImageKey { image, part, srgb: meaning == Meaning::Color, wrap: wrap.map(code), nearest };
        if let Some(handle) = self.image_handles.get(&key) {
            return Ok(*handle);
        }
        let texels = self.texels(image, meaning, &from)?;
        let texels = match part {
            Part::Channel(c) => texels.channel(usize::from(c)).map_err(|e| from.problem(e.to_string()))?,
            Part::Color if texels.channels() == 4 => texels.clone().truncated(3),
            Part::Color if texels.channels() == 2 => texels.clone().truncated(1),
            Part::Color => texels.clone(),
        };
        let lookup = if nearest { Lookup::Point } else { Lookup::Bilinear };
        let name = self.image_names.get(&image).cloned().unwrap_or_default();
        let handle = self.scene.images.push(TextureImage { name, texels, lookup, wrap, color_space: ColorSpace::Srgb });
        self.image_handles.insert(key, handle);
        Ok(handle)
    }

    /// The image of a texture, in a format that can be read.
    fn source<'d>(&mut self, texture: &Json<'d>) -> Result<(usize, Json<'d>)> {
        if let Some(webp) = texture.extension("EXT_texture_webp") {
            return Ok((webp.need("source")?.as_count()?, webp));
        }
        if let Some(basis) = texture.extension("KHR_texture_basisu") {
            if texture.get("source").is_none() {
                return Err(Problem {
                    hint: Some(
                        "textures in KTX2 are not read: convert with `ktx extract` or `gltf-transform ktxdecompress in.glb out.glb`"
                            .into(),
                    ),
                    ..basis.problem("a texture in KTX2 (KHR_texture_basisu)")
                });
            }
            self.warn_once("KHR_texture_basisu", "textures in KTX2 are not read; the fallback pictures are taken");
        }
        Ok((texture.need("source")?.as_count()?, texture.clone()))
    }

    fn sampler(&self, texture: &Json) -> Result<([Wrap; 2], bool)> {
        let Some(index) = texture.count("sampler")? else { return Ok(([Wrap::Repeat; 2], false)) };
        let samplers = self.root.list("samplers")?;
        let s = samplers.get(index).ok_or_else(|| missing(texture, "sampler", "sampler", index, samplers.len()))?;
        let wrap = |key: &str| {
            Ok(match s.count(key)?.unwrap_or(10497) {
                33071 => Wrap::Clamp,
                33648 => Wrap::Mirror,
                10497 => Wrap::Repeat,
                other => return Err(s.problem(format!("`{key}` cannot be {other}"))),
            })
        };
        Ok(([wrap("wrapS")?, wrap("wrapT")?], s.count("magFilter")? == Some(9728)))
    }

    /// The texels of an image.
    pub(super) fn texels(&mut self, index: usize, meaning: Meaning, from: &Json) -> Result<Texels> {
        let encoding = if meaning == Meaning::Color { Encoding::Srgb } else { Encoding::Linear };
        if let Some(texels) = self.texels.get(&index) {
            match texels {
                None => return Err(from.problem(format!("image {index} could not be read"))),
                // Codes of eight bits only change their meaning.
                Some(t) if t.encoding() == encoding => return Ok(t.clone()),
                Some(t) => {
                    if let Storage::U8(codes) = t.storage() {
                        let again = Storage::U8(codes.clone());
                        let again = Texels::new(t.width(), t.height(), t.channels(), again, encoding);
                        return again.map_err(|e| from.problem(e.to_string()));
                    }
                }
            }
        }
        let read = self.read_image(index, encoding, from);
        self.texels.insert(index, read.as_ref().ok().cloned());
        read
    }

    fn read_image(&mut self, index: usize, encoding: Encoding, from: &Json) -> Result<Texels> {
        let images = self.root.list("images")?;
        let image = images.get(index).ok_or_else(|| missing(from, "source", "image", index, images.len()))?;
        let (bytes, name) = match image.get("uri") {
            Some(uri) => self.folder.fetch(&uri)?,
            None => (self.buffers.view(image, "bufferView")?.bytes.to_vec(), String::new()),
        };
        let label = image.text("name")?.filter(|_| name.is_empty() || name == "data URI").unwrap_or(&name);
        let label = if label.is_empty() { format!("image {index}") } else { label.to_string() };
        self.image_names.insert(index, label.clone());
        if bytes.starts_with(&[0xab, b'K', b'T', b'X', b' ', b'2', b'0']) {
            return Err(Problem {
                hint: Some("convert with `ktx extract` or `gltf-transform ktxdecompress in.glb out.glb`".into()),
                ..image.problem(format!("{label} is a KTX2 texture, which is not read"))
            });
        }
        read_texels(&bytes, &label, Some(encoding)).map_err(|e| image.problem(e.to_string()))
    }
}
