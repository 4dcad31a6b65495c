//! Colours, spectra, textures and indices of refraction of Mitsuba scenes.

use super::Mitsuba;
use super::tree::{Object, Value};
use crate::files::describe;
use steradian_image::{Encoding, Lookup, Texels, Wrap, read_texels};
use steradian_math::{Point3, Transform, Vec3};
use steradian_scene::{
    CheckerMapping, FloatInput, FloatTexture, Handle, ImageMap, Mapping2, SpectrumInput, SpectrumTexture, Texture,
    TextureImage,
};
use steradian_spectrum::{CIE_Y, ColorSpace, Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Span};

/// Indices of refraction at the yellow line, by Mitsuba's names.
pub(super) fn index_of(name: &str) -> Option<f32> {
    const KNOWN: [(&str, f32); 21] = [
        ("vacuum", 1.0),
        ("helium", 1.000_036),
        ("hydrogen", 1.000_132),
        ("air", 1.000_277),
        ("carbon dioxide", 1.000_45),
        ("water", 1.333),
        ("acetone", 1.36),
        ("ethanol", 1.361),
        ("carbon tetrachloride", 1.461),
        ("glycerol", 1.4729),
        ("benzene", 1.501),
        ("silicone oil", 1.52045),
        ("bromine", 1.661),
        ("water ice", 1.31),
        ("fused quartz", 1.458),
        ("pyrex", 1.47),
        ("acrylic glass", 1.49),
        ("polypropylene", 1.49),
        ("bk7", 1.5046),
        ("sodium chloride", 1.544),
        ("amber", 1.55),
    ];
    let name = name.to_ascii_lowercase();
    match name.as_str() {
        "pet" => Some(1.575),
        "diamond" => Some(2.419),
        _ => KNOWN.iter().find(|k| k.0 == name).map(|k| k.1),
    }
}

impl Mitsuba<'_> {
    pub(super) fn constant(&mut self, s: Spectrum) -> SpectrumInput {
        self.scene.spectrum_textures.push(SpectrumTexture { usage: s.usage(), kind: Texture::Constant(s) })
    }

    pub(super) fn number(&mut self, v: f32) -> FloatInput {
        self.scene.float_textures.push(FloatTexture(Texture::Constant(v)))
    }

    /// A spectrum from a parameter.
    pub(super) fn spectrum_of(&mut self, value: &Value, usage: SpectrumUse, span: Span) -> Option<Spectrum> {
        let space = ColorSpace::Srgb;
        let of_rgb = |rgb: [f32; 3]| match usage {
            SpectrumUse::Albedo => Spectrum::rgb_albedo(space, rgb),
            SpectrumUse::Unbounded => Spectrum::rgb_unbounded(space, rgb),
            SpectrumUse::Illuminant => Spectrum::rgb_illuminant(space, rgb.map(|v| v.max(0.0))),
        };
        // A number of a lamp means white light; an even spectrum is what it says.
        let white = |v: f32| match usage {
            SpectrumUse::Illuminant => of_rgb([v; 3]),
            _ => Spectrum::constant(v, usage),
        };
        match value {
            Value::Rgb(rgb) => Some(of_rgb(*rgb)),
            Value::Float(v) => Some(white(*v)),
            Value::Integer(v) => Some(white(*v as f32)),
            Value::Spectrum(s) if s.len() == 1 => Some(Spectrum::constant(s[0].1, usage)),
            Value::Spectrum(s) => {
                let (l, v): (Vec<f32>, Vec<f32>) = s.iter().copied().unzip();
                let s = Spectrum::piecewise_linear(&l, &v, usage).map_err(|e| self.error(e.to_string(), span)).ok()?;
                Some(as_seen(s))
            }
            Value::SpectrumFile(name) => self.spectrum_file(name, usage, span),
            _ => {
                self.error("must be a colour or a spectrum", span);
                None
            }
        }
    }

    /// Lines of a wavelength and a value.
    fn spectrum_file(&mut self, name: &str, usage: SpectrumUse, span: Span) -> Option<Spectrum> {
        let read = self.reader.resolve(name).and_then(|p| self.files.read(&p).map_err(|e| describe(&p, &e)));
        let bytes = read.map_err(|m| self.error(m, span)).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        let mut pairs = Vec::new();
        for line in text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#')) {
            let mut numbers = line.split_ascii_whitespace().map(|w| w.parse::<f32>().ok());
            match (numbers.next().flatten(), numbers.next().flatten()) {
                (Some(l), Some(v)) => pairs.push((l, v)),
                _ => {
                    self.error(format!("{name}: `{line}` is not a wavelength and a value"), span);
                    return None;
                }
            }
        }
        let (l, v): (Vec<f32>, Vec<f32>) = pairs.into_iter().unzip();
        let s = Spectrum::piecewise_linear(&l, &v, usage).map_err(|e| self.error(format!("{name}: {e}"), span)).ok()?;
        Some(as_seen(s))
    }

    /// A parameter that is a colour, a spectrum or a texture; none where it is not given.
    pub(super) fn maybe_spectrum(&mut self, o: &Object, name: &str, usage: SpectrumUse) -> Option<SpectrumInput> {
        if let Some(child) = self.named(o, name) {
            let t = self.object(child);
            return self.texture(&t, usage);
        }
        let p = o.get(name)?.clone();
        let s = self.spectrum_of(&p.value, usage, p.span)?;
        Some(self.constant(s))
    }

    pub(super) fn spectrum(&mut self, o: &Object, name: &str, usage: SpectrumUse, absent: f32) -> SpectrumInput {
        self.maybe_spectrum(o, name, usage).unwrap_or_else(|| self.constant(Spectrum::constant(absent, usage)))
    }

    /// A parameter that is a number or a texture.
    pub(super) fn float_input(&mut self, o: &Object, name: &str, absent: f32) -> FloatInput {
        if let Some(child) = self.named(o, name) {
            let t = self.object(child);
            return self.float_texture(&t).unwrap_or_else(|| self.number(absent));
        }
        let v = self.float(o, name, absent);
        self.number(v)
    }

    pub(super) fn float_texture(&mut self, t: &Object) -> Option<FloatInput> {
        match t.kind.as_str() {
            "bitmap" => {
                let color = !self.is_raw(t);
                let map = self.bitmap(t, color)?;
                self.finish(t);
                Some(self.scene.float_textures.push(FloatTexture(Texture::Image(map))))
            }
            "checkerboard" => {
                // As a number, Mitsuba's checkerboard has its colours the other way round.
                let (b, a) = (self.float_input(t, "color0", 0.4), self.float_input(t, "color1", 0.2));
                let mapping = CheckerMapping::Plane(self.mapping(t, 2.0));
                self.finish(t);
                Some(self.scene.float_textures.push(FloatTexture(Texture::Checkerboard { mapping, a, b })))
            }
            "mesh_attribute" => {
                let name = self.text(t, "name").unwrap_or_default();
                let tex = self.scene.float_textures.push(FloatTexture(Texture::Attribute(name)));
                let scale = self.float(t, "scale", 1.0);
                let scale = self.number(scale);
                self.finish(t);
                Some(self.scene.float_textures.push(FloatTexture(Texture::Scale { tex, scale })))
            }
            "uniform" | "rawconstant" | "constvolume" => {
                let v = self.float(t, "value", 1.0);
                self.finish(t);
                Some(self.number(v))
            }
            "gridvolume" => {
                let grid = self.grid_texture(t)?;
                Some(self.scene.float_textures.push(FloatTexture(Texture::Grid(grid))))
            }
            "volume" => {
                let Some(v) = self.named(t, "volume").map(|i| self.object(i)).filter(|v| v.kind != "volume") else {
                    return Some(self.float_input(t, "volume", 0.75));
                };
                self.finish(t);
                self.float_texture(&v)
            }
            _ => {
                self.not_built(t);
                None
            }
        }
    }

    pub(super) fn texture(&mut self, t: &Object, usage: SpectrumUse) -> Option<SpectrumInput> {
        let kind = match t.kind.as_str() {
            "bitmap" => Texture::Image(self.bitmap(t, !self.is_raw(t))?),
            "checkerboard" => {
                let (a, b) = (self.spectrum(t, "color0", usage, 0.4), self.spectrum(t, "color1", usage, 0.2));
                Texture::Checkerboard { mapping: CheckerMapping::Plane(self.mapping(t, 2.0)), a, b }
            }
            "mesh_attribute" => {
                let name = self.text(t, "name").unwrap_or_default();
                let scale = self.float(t, "scale", 1.0);
                if scale != 1.0 {
                    let kind = Texture::Attribute(name);
                    let tex = self.scene.spectrum_textures.push(SpectrumTexture { usage, kind });
                    Texture::Scale { tex, scale: self.number(scale) }
                } else {
                    Texture::Attribute(name)
                }
            }
            "gridvolume" => Texture::Grid(self.grid_texture(t)?),
            "constvolume" => {
                let p = t.get("value").cloned();
                let value = p.map_or(Value::Float(1.0), |p| p.value);
                Texture::Constant(self.spectrum_of(&value, usage, t.span)?)
            }
            "volume" => {
                let inner = self.named(t, "volume").map(|i| self.object(i)).filter(|v| v.kind != "volume");
                let texture = match inner {
                    Some(v) => self.texture(&v, usage),
                    None => Some(self.spectrum(t, "volume", usage, 0.75)),
                };
                self.finish(t);
                return texture;
            }
            "srgb" | "uniform" | "rawconstant" | "d65" | "irregular" | "regular" | "blackbody" => {
                let s = self.named_spectrum(t, usage)?;
                Texture::Constant(s)
            }
            _ => {
                self.not_built(t);
                return None;
            }
        };
        self.finish(t);
        Some(self.scene.spectrum_textures.push(SpectrumTexture { usage, kind }))
    }

    fn named_spectrum(&mut self, t: &Object, usage: SpectrumUse) -> Option<Spectrum> {
        match t.kind.as_str() {
            "blackbody" => {
                let kelvin = self.float(t, "temperature", 5000.0);
                Spectrum::blackbody(kelvin).map_err(|e| self.error(e.to_string(), t.span)).ok()
            }
            "d65" => {
                let scale = self.float(t, "scale", 1.0);
                let color = match t.get("color").map(|p| p.value.clone()) {
                    Some(Value::Rgb(rgb)) => rgb,
                    _ => [1.0; 3],
                };
                Some(Spectrum::rgb_illuminant(ColorSpace::Srgb, color.map(|v| (v * scale).max(0.0))).with_use(usage))
            }
            "regular" | "irregular" => {
                let pairs = match t.get("value").map(|p| p.value.clone()) {
                    Some(Value::Spectrum(pairs)) if pairs.len() > 1 => pairs,
                    _ => self.pairs(t)?,
                };
                self.spectrum_of(&Value::Spectrum(pairs), usage, t.span)
            }
            "srgb" => {
                let p = t.get("color").cloned()?;
                self.spectrum_of(&p.value, usage, p.span)
            }
            // Three numbers, which are no colour of anything.
            "rawconstant" if matches!(t.params.get("value").map(|p| &p.value), Some(Value::Vector(_))) => {
                let [r, g, b] = self.vector(t, "value")?.to_array();
                Some(Spectrum::constant((r + g + b) / 3.0, usage).with_rgb([r, g, b]))
            }
            "uniform" | "rawconstant" => {
                let v = self.float(t, "value", 1.0);
                Some(Spectrum::constant(v, usage))
            }
            _ => {
                self.not_built(t);
                None
            }
        }
    }

    /// `values` over `wavelengths`, or evenly from `wavelength_min` to `wavelength_max`.
    fn pairs(&mut self, t: &Object) -> Option<Vec<(f32, f32)>> {
        let mut list = |name: &str| -> Option<Vec<f32>> {
            let text = self.text(t, name)?;
            let words = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty());
            words.map(|w| w.parse::<f32>().ok().filter(|v| v.is_finite())).collect()
        };
        let values = list("values").filter(|v| v.len() > 1);
        let wavelengths = if t.kind == "irregular" {
            list("wavelengths")
        } else {
            let (low, high) = (self.float(t, "wavelength_min", 360.0), self.float(t, "wavelength_max", 830.0));
            let n = values.as_ref().map_or(2, Vec::len);
            Some((0..n).map(|i| low + (high - low) * i as f32 / (n - 1) as f32).collect())
        };
        match (wavelengths, values) {
            (Some(l), Some(v)) if l.len() == v.len() => Some(l.into_iter().zip(v).collect()),
            _ => {
                self.error("a tabulated spectrum needs as many wavelengths as values, two or more", t.span);
                None
            }
        }
    }

    fn is_raw(&self, t: &Object) -> bool {
        matches!(t.get("raw").map(|p| &p.value), Some(Value::Boolean(true)))
    }

    /// A picture as a texture.
    pub(super) fn bitmap(&mut self, t: &Object, color: bool) -> Option<ImageMap> {
        let raw = self.is_raw(t);
        let name = self.text(t, "filename");
        let Some(name) = name else {
            self.error("a bitmap needs a `filename`", t.span);
            return None;
        };
        let texels = self.picture(&name, color && !raw, t.span)?;
        if let Some(what) = texels.not_finite() {
            let message = format!("{name}: {what}: samples that meet them are reported");
            self.reader.diagnostics.push(Diagnostic::warning(message, t.span));
        }
        let wrap = match self.text(t, "wrap_mode").as_deref() {
            None | Some("repeat") => Wrap::Repeat,
            Some("mirror") => Wrap::Mirror,
            Some("clamp") => Wrap::Clamp,
            Some(other) => {
                self.error(format!("`{other}` is none of repeat, mirror and clamp"), t.span);
                Wrap::Repeat
            }
        };
        let lookup = match self.text(t, "filter_type").as_deref() {
            Some("nearest") => Lookup::Point,
            _ => Lookup::Bilinear,
        };
        let image = self.push_image(&name, texels, lookup, wrap);
        // The first row of texels lies at v = 0.
        let mut mapping = self.mapping(t, 1.0);
        if let Mapping2::Affine { rows, .. } = &mut mapping {
            let [u, v, shift] = rows[1];
            rows[1] = [-u, -v, 1.0 - shift];
        }
        Some(ImageMap { mapping, image, scale: 1.0, invert: false })
    }

    pub(super) fn push_image(
        &mut self,
        name: &str,
        texels: Texels,
        lookup: Lookup,
        wrap: Wrap,
    ) -> Handle<TextureImage> {
        let texels = match texels.channels() {
            4 => texels.truncated(3),
            2 => texels.truncated(1),
            _ => texels,
        };
        self.scene.images.push(TextureImage {
            name: name.into(),
            texels,
            lookup,
            wrap: [wrap; 2],
            color_space: ColorSpace::Srgb,
        })
    }

    /// The texels of a file, read once.
    pub(super) fn picture(&mut self, name: &str, color: bool, span: Span) -> Option<Texels> {
        let key = (name.to_string(), color);
        if let Some(known) = self.pictures.borrow().get(&key) {
            return Some(known.clone());
        }
        let encoding = if color { Encoding::Srgb } else { Encoding::Linear };
        let read = self
            .reader
            .resolve(name)
            .and_then(|p| self.files.read(&p).map_err(|e| describe(&p, &e)))
            .and_then(|b| read_texels(&b, name, Some(encoding)).map_err(|e| e.to_string()));
        let texels = read.map_err(|m| self.error(m, span)).ok()?;
        self.pictures.borrow_mut().insert(key, texels.clone());
        Some(texels)
    }

    /// `to_uv`, and a further factor: a checkerboard's squares are half a unit here and a unit there.
    fn mapping(&mut self, t: &Object, factor: f32) -> Mapping2 {
        let m = match t.get("to_uv").map(|p| p.value.clone()) {
            Some(Value::Transform(m)) => m,
            _ => self.old_mapping(t),
        };
        let (x, y) = (m.vector(Vec3::new(1.0, 0.0, 0.0)), m.vector(Vec3::new(0.0, 1.0, 0.0)));
        let o = m.point(Point3::default());
        let row = |i: usize| [x[i] * factor, y[i] * factor, o[i] * factor];
        Mapping2::Affine { set: 0, rows: [row(0), row(1)] }
    }

    /// Before version 2, textures were scaled and shifted by numbers.
    fn old_mapping(&mut self, t: &Object) -> Transform {
        let mut of = |name: &str, absent: f32| self.float(t, name, absent);
        let (scale, shift) = ([of("uscale", 1.0), of("vscale", 1.0)], [of("uoffset", 0.0), of("voffset", 0.0)]);
        let shift = Transform::translate(Vec3::new(shift[0], shift[1], 0.0));
        match Transform::scale(scale[0], scale[1], 1.0) {
            Some(scale) => scale.then(&shift),
            None => {
                self.error("a texture that is scaled to nothing", t.span);
                shift
            }
        }
    }
}

/// In RGB, Mitsuba takes a tabulated quantity that is neither a reflectance nor a lamp's for the colour of a light of that spectrum.
pub(super) fn as_seen(s: Spectrum) -> Spectrum {
    if s.usage() != SpectrumUse::Unbounded {
        return s;
    }
    let light = s.clone().with_use(SpectrumUse::Illuminant);
    s.with_rgb(light.rgb().map(|v| v / CIE_Y))
}
