//! Textures worked out texel by texel, where the format has no words for them, and pictures as files.

use super::Writer;
use std::collections::BTreeSet;
use steradian_image::{Encoding, Format, Image, Precision, Storage, Texels, WriteOptions, encode};
use steradian_scene::{
    AreaLight, CheckerMapping, FloatInput, Handle, ImageMap, Mapping2, Material, Metal, MetallicRoughnessInputs,
    Primitive, Scattering, Shape, SpectrumInput, Texture, TextureImage,
};

/// What a texture is when it is worked out: linear red, green and blue.
#[derive(Clone, Debug)]
pub(super) enum Flat {
    Even([f32; 3]),
    Picture(Box<Baked>),
}

/// A picture over one mapping.
#[derive(Clone, Debug)]
pub(super) struct Baked {
    pub width: usize,
    pub height: usize,
    pub values: Vec<[f32; 3]>,
    pub mapping: Mapping2,
    /// Whose edges and filter it has.
    pub like: Handle<TextureImage>,
}

/// The most texels of a picture that is worked out.
const MOST_TEXELS: usize = 1 << 26;

impl Flat {
    pub fn even(&self) -> Option<[f32; 3]> {
        match self {
            Flat::Even(v) => Some(*v),
            Flat::Picture(_) => None,
        }
    }

    /// The value, if it is one number everywhere.
    pub fn number(&self) -> Option<f32> {
        self.even().map(|v| v[0])
    }

    /// The first component's mean.
    pub fn mean(&self) -> f32 {
        match self {
            Flat::Even(v) => v[0],
            Flat::Picture(p) => {
                let sum: f64 = p.values.iter().map(|v| f64::from(v[0])).sum();
                (sum / p.values.len().max(1) as f64) as f32
            }
        }
    }

    pub fn map(self, f: impl Fn([f32; 3]) -> [f32; 3]) -> Flat {
        match self {
            Flat::Even(v) => Flat::Even(f(v)),
            Flat::Picture(mut p) => {
                p.values.iter_mut().for_each(|v| *v = f(*v));
                Flat::Picture(p)
            }
        }
    }

    pub fn each(self, f: impl Fn(f32) -> f32) -> Flat {
        self.map(|v| v.map(&f))
    }
}

/// Two textures together; none where their pictures lie differently.
pub(super) fn join(a: &Flat, b: &Flat, f: impl Fn(f32, f32) -> f32) -> Option<Flat> {
    let both = |x: [f32; 3], y: [f32; 3]| std::array::from_fn(|c| f(x[c], y[c]));
    Some(match (a, b) {
        (Flat::Even(x), Flat::Even(y)) => Flat::Even(both(*x, *y)),
        (Flat::Even(x), Flat::Picture(_)) => b.clone().map(|y| both(*x, y)),
        (Flat::Picture(_), Flat::Even(y)) => a.clone().map(|x| both(x, *y)),
        (Flat::Picture(p), Flat::Picture(q)) => {
            let (width, height) = (p.width.max(q.width), p.height.max(q.height));
            if p.mapping != q.mapping || width.saturating_mul(height) > MOST_TEXELS {
                return None;
            }
            let at = |t: &Baked, x: usize, y: usize| t.values[(y * t.height / height) * t.width + x * t.width / width];
            let cells = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            let values = cells.map(|(x, y)| both(at(p, x, y), at(q, x, y))).collect();
            Flat::Picture(Box::new(Baked { width, height, values, mapping: p.mapping.clone(), like: p.like }))
        }
    })
}

/// A map of surface coordinates as the set it starts from and two rows.
pub(super) fn affine(m: &Mapping2) -> Option<(u32, [[f32; 3]; 2])> {
    match *m {
        Mapping2::Uv { su, sv, du, dv } => Some((0, [[su, 0.0, du], [0.0, sv, dv]])),
        Mapping2::Affine { set, rows } => Some((set, rows)),
        _ => None,
    }
}

/// Whether pbrt's four numbers can say it.
pub(super) fn is_sayable(m: &Mapping2) -> bool {
    affine(m).is_none_or(|(set, rows)| set == 0 && rows[0][1] == 0.0 && rows[1][0] == 0.0)
}

fn is_identity(m: &Mapping2) -> bool {
    affine(m) == Some((0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
}

/// One triple of a texel, grey where it has one channel.
fn texel(t: &Texels, x: usize, y: usize) -> [f32; 3] {
    if t.channels() < 3 { [t.texel(x, y, 0); 3] } else { [0, 1, 2].map(|c| t.texel(x, y, c)) }
}

impl Writer<'_> {
    /// A picture as it is.
    pub(super) fn flat_picture(&self, image: Handle<TextureImage>) -> Flat {
        let map = ImageMap { mapping: Mapping2::default(), image, scale: 1.0, invert: false };
        self.flat_image(&map).unwrap_or(Flat::Even([0.5, 0.5, 1.0]))
    }

    fn flat_image(&self, map: &ImageMap) -> Option<Flat> {
        let t = &self.scene.images[map.image].texels;
        let (width, height) = (t.width(), t.height());
        if width.saturating_mul(height) > MOST_TEXELS {
            return None;
        }
        let value = |v: f32| {
            let v = (v * map.scale).max(0.0);
            if map.invert { (1.0 - v).max(0.0) } else { v }
        };
        let cells = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let values = cells.map(|(x, y)| texel(t, x, y).map(value)).collect();
        Some(Flat::Picture(Box::new(Baked { width, height, values, mapping: map.mapping.clone(), like: map.image })))
    }

    /// A texture of numbers, worked out.
    pub(super) fn flat_float(&mut self, t: FloatInput) -> Option<Flat> {
        let scene = self.scene;
        match &scene.float_textures[t].0 {
            Texture::Constant(v) => Some(Flat::Even([*v; 3])),
            Texture::Image(map) => {
                let mean = |v: [f32; 3]| [(v[0] + v[1] + v[2]) / 3.0; 3];
                self.flat_image(map).map(|f| f.map(mean))
            }
            Texture::Scale { tex: a, scale: b } | Texture::Product { a, b } => {
                join(&self.flat_float(*a)?, &self.flat_float(*b)?, |x, y| x * y)
            }
            Texture::Threshold { tex, at } => Some(self.flat_float(*tex)?.each(|v| if v >= *at { 1.0 } else { 0.0 })),
            Texture::Mix { a, b, amount } => {
                let amount = self.flat_float(*amount)?;
                mixed(&self.flat_float(*a)?, &self.flat_float(*b)?, &amount)
            }
            Texture::Vertex => Some(self.without_vertices()),
            _ => None,
        }
    }

    /// A texture of colours, worked out.
    pub(super) fn flat_color(&mut self, t: SpectrumInput) -> Option<Flat> {
        let scene = self.scene;
        match &scene.spectrum_textures[t].kind {
            Texture::Constant(s) => Some(Flat::Even(s.rgb())),
            Texture::Image(map) => self.flat_image(map),
            Texture::Scale { tex, scale } => join(&self.flat_color(*tex)?, &self.flat_float(*scale)?, |x, y| x * y),
            Texture::Product { a, b } => join(&self.flat_color(*a)?, &self.flat_color(*b)?, |x, y| x * y),
            Texture::Mix { a, b, amount } => {
                let amount = self.flat_float(*amount)?;
                mixed(&self.flat_color(*a)?, &self.flat_color(*b)?, &amount)
            }
            Texture::Vertex => Some(self.without_vertices()),
            _ => None,
        }
    }

    fn without_vertices(&mut self) -> Flat {
        self.note("colours and opacities at the vertices of meshes are left out");
        Flat::Even([1.0; 3])
    }

    /// Whether all that a primitive looks up is the opacity at its vertices, which can stand in its texture coordinates.
    pub(super) fn fades_only(&self, p: &Primitive) -> bool {
        let Shape::Triangles(mesh) = p.shape else { return false };
        let fades = p.alpha.is_some_and(|a| matches!(self.scene.float_textures[a].0, Texture::Vertex));
        if !fades || self.scene.triangle_meshes[mesh].colors.is_empty() {
            return false;
        }
        let mut found = Found { writer: self, mappings: Vec::new(), strict: false, seen: BTreeSet::new() };
        found.material(p.material);
        p.area_light.iter().for_each(|l| found.light(l));
        found.mappings.is_empty()
    }

    /// The map that all pictures of a primitive lie under, where pbrt cannot say it, so that the mesh must.
    pub(super) fn straightened(&mut self, p: &Primitive) -> Option<Mapping2> {
        if !matches!(p.shape, Shape::Triangles(_)) {
            return None;
        }
        let mut found = Found { writer: self, mappings: Vec::new(), strict: false, seen: BTreeSet::new() };
        found.material(p.material);
        p.alpha.iter().for_each(|a| found.float(*a));
        p.area_light.iter().for_each(|l| found.light(l));
        let Found { mappings, strict, .. } = found;
        let all_sayable = if strict { mappings.iter().all(is_identity) } else { mappings.iter().all(is_sayable) };
        let first = mappings.first()?.clone();
        if all_sayable || affine(&first).is_none() {
            return None;
        }
        if mappings.iter().any(|m| *m != first) {
            self.note(
                "pictures that lie differently on one surface: those that pbrt cannot place stay as the mesh has them",
            );
            return None;
        }
        Some(first)
    }

    /// Writes a picture once, as it is: 8-bit codes as PNG, the rest as OpenEXR. Its name, and what its codes stand for.
    pub(super) fn picture(&mut self, handle: Handle<TextureImage>) -> (String, String) {
        let t = &self.scene.images[handle].texels;
        let key = format!("image{}", handle.index());
        if let Some(known) = self.pictures.get(&key) {
            return known.clone();
        }
        let number = self.pictures.len();
        if !matches!(t.storage(), Storage::U8(_)) {
            let name = self.path(&format!("image{number}.exr"));
            return self.exr(key, name, t);
        }
        let name = self.path(&format!("image{number}.png"));
        let options = WriteOptions { encoding: t.encoding(), ..WriteOptions::default() };
        self.file(&name, image(t, Precision::Float), Format::Png, &options);
        let encoding = match t.encoding() {
            Encoding::Srgb => "sRGB".into(),
            Encoding::Linear => "linear".into(),
            Encoding::Gamma(g) => format!("gamma {g}"),
        };
        self.pictures.insert(key, (name.clone(), encoding.clone()));
        (name, encoding)
    }

    /// Writes the picture of a light, which has three channels.
    pub(super) fn light_picture(&mut self, handle: Handle<TextureImage>) -> String {
        let t = &self.scene.images[handle].texels;
        let values = (0..t.width() * t.height()).map(|i| texel(t, i % t.width(), i / t.width())).collect();
        let baked = Baked { width: t.width(), height: t.height(), values, mapping: Mapping2::default(), like: handle };
        self.baked(&format!("light{}", handle.index()), &baked, Precision::Float)
    }

    fn exr(&mut self, key: String, name: String, t: &Texels) -> (String, String) {
        let precision = if matches!(t.storage(), Storage::F16(_)) { Precision::Half } else { Precision::Float };
        self.file(&name, image(t, precision), Format::Exr, &WriteOptions::default());
        self.pictures.insert(key, (name.clone(), "linear".into()));
        (name, "linear".into())
    }

    /// Writes a picture that was worked out, once under one key; its name.
    pub(super) fn baked(&mut self, key: &str, b: &Baked, precision: Precision) -> String {
        if let Some(known) = self.pictures.get(key) {
            return known.0.clone();
        }
        let name = self.path(&format!("image{}.exr", self.pictures.len()));
        let mut image = Image::new(b.width, b.height);
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            // Planes of one picture have one length.
            let _ = image.add(channel, b.values.iter().map(|v| v[c]).collect(), precision);
        }
        image.metadata.chromaticities = self.scene.images[b.like].texels.chromaticities;
        self.file(&name, image, Format::Exr, &WriteOptions::default());
        self.pictures.insert(key.into(), (name.clone(), "linear".into()));
        name
    }

    pub(super) fn file(&mut self, name: &str, image: Image, format: Format, options: &WriteOptions) {
        match encode(&image, format, name, options) {
            Ok(bytes) => self.files.push((name.to_string(), bytes)),
            Err(e) => self.failure = Some(e.to_string()),
        }
    }
}

fn mixed(a: &Flat, b: &Flat, amount: &Flat) -> Option<Flat> {
    let (far, near) = (join(b, amount, |v, t| v * t)?, join(a, amount, |v, t| v * (1.0 - t))?);
    join(&near, &far, |x, y| x + y)
}

/// Channels that are grey, or red, green and blue.
fn image(t: &Texels, precision: Precision) -> Image {
    let (w, h) = (t.width(), t.height());
    let mut image = Image::new(w, h);
    let names: &[&str] = if t.channels() < 3 { &["Y"] } else { &["R", "G", "B"] };
    for (c, name) in names.iter().enumerate() {
        // Planes of one picture have one length.
        let _ = image.add(name, (0..w * h).map(|i| t.texel(i % w, i / w, c)).collect(), precision);
    }
    image.metadata.chromaticities = t.chromaticities;
    image
}

/// The maps of all pictures that something looks up.
struct Found<'w, 's> {
    writer: &'w Writer<'s>,
    mappings: Vec<Mapping2>,
    /// Whether one of them knows no map at all in pbrt.
    strict: bool,
    seen: BTreeSet<usize>,
}

impl Found<'_, '_> {
    fn add(&mut self, m: &Mapping2) {
        self.mappings.push(m.clone());
    }

    fn float(&mut self, t: FloatInput) {
        match &self.writer.scene.float_textures[t].0 {
            Texture::Image(map) => self.add(&map.mapping),
            Texture::Scale { tex: a, scale: b } | Texture::Product { a, b } => {
                [a, b].into_iter().for_each(|t| self.float(*t))
            }
            Texture::Threshold { tex, .. } => self.float(*tex),
            Texture::Mix { a, b, amount } => [a, b, amount].into_iter().for_each(|t| self.float(*t)),
            Texture::DirectionMix { a, b, .. } => [a, b].into_iter().for_each(|t| self.float(*t)),
            Texture::Bilerp { mapping, .. } => self.add(mapping),
            Texture::Checkerboard { mapping, a, b } => {
                if let CheckerMapping::Plane(m) = mapping {
                    self.add(m);
                }
                [a, b].into_iter().for_each(|t| self.float(*t));
            }
            Texture::Dots { mapping, inside, outside } => {
                self.add(mapping);
                [inside, outside].into_iter().for_each(|t| self.float(*t));
            }
            Texture::Constant(_)
            | Texture::Vertex
            | Texture::Attribute(_)
            | Texture::Grid(_)
            | Texture::Noise { .. } => {}
        }
    }

    fn color(&mut self, t: SpectrumInput) {
        match &self.writer.scene.spectrum_textures[t].kind {
            Texture::Image(map) => self.add(&map.mapping),
            Texture::Product { a, b } | Texture::DirectionMix { a, b, .. } => {
                [a, b].into_iter().for_each(|t| self.color(*t))
            }
            Texture::Scale { tex, scale } => {
                self.color(*tex);
                self.float(*scale);
            }
            Texture::Threshold { tex, .. } => self.color(*tex),
            Texture::Mix { a, b, amount } => {
                [a, b].into_iter().for_each(|t| self.color(*t));
                self.float(*amount);
            }
            Texture::Bilerp { mapping, .. } => self.add(mapping),
            Texture::Checkerboard { mapping, a, b } => {
                if let CheckerMapping::Plane(m) = mapping {
                    self.add(m);
                }
                [a, b].into_iter().for_each(|t| self.color(*t));
            }
            Texture::Dots { mapping, inside, outside } => {
                self.add(mapping);
                [inside, outside].into_iter().for_each(|t| self.color(*t));
            }
            Texture::Constant(_)
            | Texture::Vertex
            | Texture::Attribute(_)
            | Texture::Grid(_)
            | Texture::Noise { .. } => {}
        }
    }

    fn light(&mut self, l: &AreaLight) {
        if let Some(t) = l.texture {
            let before = self.mappings.len();
            self.color(t);
            self.strict |= self.mappings.len() > before;
        }
        if l.image.is_some() {
            self.add(&Mapping2::default());
        }
    }

    fn material(&mut self, m: Handle<Material>) {
        if !self.seen.insert(m.index()) {
            return;
        }
        let m = &self.writer.scene.materials[m];
        if let Some(map) = &m.normal_map {
            self.add(&map.mapping);
            self.strict = true;
        }
        m.displacement.iter().for_each(|t| self.float(*t));
        match &m.scattering {
            Scattering::Diffuse { reflectance } => self.color(*reflectance),
            Scattering::DiffuseTransmission { reflectance, transmittance, .. } => {
                self.color(*reflectance);
                self.color(*transmittance);
            }
            Scattering::CoatedDiffuse { reflectance, .. } => self.color(*reflectance),
            Scattering::Conductor { metal: Metal::Reflectance(r), .. } => self.color(*r),
            Scattering::Plastic(p) => self.color(p.reflectance),
            Scattering::Principled(p) => {
                self.color(p.base);
                [p.roughness, p.metallic, p.transmission].into_iter().for_each(|t| self.float(t));
            }
            Scattering::Mix { materials, amount } => {
                self.float(*amount);
                materials.iter().for_each(|m| self.material(*m));
            }
            Scattering::Sides { front, .. } => self.material(*front),
            Scattering::Altered { interface, .. } => self.material(*interface),
            Scattering::MetallicRoughness(inputs) => self.layers(inputs),
            _ => {}
        }
        if let Scattering::Conductor { roughness: r, .. } | Scattering::Dielectric { roughness: r, .. } = &m.scattering
        {
            self.float(r.u);
            self.float(r.v);
        }
    }

    fn layers(&mut self, m: &MetallicRoughnessInputs) {
        self.color(m.base);
        [m.metallic, m.roughness].into_iter().chain(m.transmission).for_each(|t| self.float(t));
        if let Some((share, color)) = m.diffuse_transmission {
            self.float(share);
            self.color(color);
        }
        m.coat.iter().flatten().for_each(|t| self.float(*t));
    }
}
