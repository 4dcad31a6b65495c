//! Textures.

use super::Writer;
use super::bake::{Baked, Flat, affine, is_sayable};
use super::text::{list, number, quoted, spectrum, transform};
use steradian_image::{Lookup, Precision, Wrap};
use steradian_math::Transform;
use steradian_scene::{
    CheckerMapping, FloatInput, Handle, ImageMap, Mapping2, Noise, SpectrumInput, Texture, TextureImage,
};

impl Writer<'_> {
    fn declare(&mut self, name: &str, kind: &str, text: &str, place: Option<Transform>) {
        let line = format!("Texture \"{name}\" \"{kind}\" {text}");
        match place.filter(|t| !t.is_identity()) {
            Some(t) => self.head(&format!("AttributeBegin\n{}\n{line}\nAttributeEnd", transform(&t))),
            None => self.head(&line),
        }
    }

    /// The name of a texture, and whether it has to be declared still.
    pub(super) fn texture_name(&mut self, key: String) -> (String, bool) {
        let key = format!("{key}{}", if self.straight { " straight" } else { "" });
        if let Some(known) = self.declared.get(&key) {
            return (known.clone(), false);
        }
        let name = format!("texture{}", self.declared.len());
        self.declared.insert(key, name.clone());
        (name, true)
    }

    /// A parameter that is a spectrum or the name of a texture.
    pub(super) fn spectrum_param(&mut self, name: &str, t: SpectrumInput) -> String {
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
        let (name, is_new) = self.texture_name(format!("float {}", t.index()));
        if !is_new {
            return Some(name).filter(|n| !n.is_empty());
        }
        let scene = self.scene;
        let mut place = None;
        let text = match &scene.float_textures[t].0 {
            Texture::Constant(v) => format!("\"constant\" \"float value\" {}", number(*v)),
            Texture::Scale { tex: a, scale: b } | Texture::Product { a, b } => {
                format!("\"scale\" {} {}", self.float_param("tex", *a), self.float_param("scale", *b))
            }
            Texture::Mix { a, b, amount } => format!(
                "\"mix\" {} {} {}",
                self.float_param("tex1", *a),
                self.float_param("tex2", *b),
                self.float_param("amount", *amount)
            ),
            Texture::DirectionMix { a, b, dir } => format!(
                "\"directionmix\" {} {} \"vector3 dir\" {}",
                self.float_param("tex1", *a),
                self.float_param("tex2", *b),
                list(&[dir.x, dir.y, dir.z])
            ),
            Texture::Bilerp { mapping, corners } => {
                let [a, b, c, d] = corners.map(number);
                let m = self.mapping(mapping, &mut place);
                format!("\"bilerp\" {m} \"float v00\" {a} \"float v01\" {b} \"float v10\" {c} \"float v11\" {d}")
            }
            Texture::Checkerboard { mapping, a, b } => {
                let m = self.checker(mapping, &mut place);
                format!("\"checkerboard\" {m} {} {}", self.float_param("tex1", *a), self.float_param("tex2", *b))
            }
            Texture::Dots { mapping, inside, outside } => {
                // pbrt hands the two to its texture the other way round.
                let m = self.mapping(mapping, &mut place);
                format!(
                    "\"dots\" {m} {} {}",
                    self.float_param("inside", *outside),
                    self.float_param("outside", *inside)
                )
            }
            Texture::Image(map) => self.image_map(map, &mut place),
            Texture::Noise { texture_from_world, noise } => {
                place = Some(texture_from_world.inverse());
                noise_of(noise)
            }
            Texture::Threshold { .. } | Texture::Vertex | Texture::Attribute(_) | Texture::Grid(_) => {
                match self.flat_float(t) {
                    Some(Flat::Even(v)) => format!("\"constant\" \"float value\" {}", number(v[0])),
                    Some(Flat::Picture(p)) => self.baked_map(&name, &p, &mut place),
                    None => return self.unsaid(&name),
                }
            }
        };
        self.declare(&name, "float", &text, place);
        Some(name)
    }

    pub(super) fn spectrum_texture(&mut self, t: SpectrumInput) -> Option<String> {
        let (name, is_new) = self.texture_name(format!("spectrum {}", t.index()));
        if !is_new {
            return Some(name).filter(|n| !n.is_empty());
        }
        let scene = self.scene;
        let mut place = None;
        let text = match &scene.spectrum_textures[t].kind {
            Texture::Constant(s) => format!("\"constant\" {}", spectrum("value", s)),
            Texture::Scale { tex, scale } => {
                format!("\"scale\" {} {}", self.spectrum_param("tex", *tex), self.float_param("scale", *scale))
            }
            Texture::Mix { a, b, amount } => format!(
                "\"mix\" {} {} {}",
                self.spectrum_param("tex1", *a),
                self.spectrum_param("tex2", *b),
                self.float_param("amount", *amount)
            ),
            Texture::DirectionMix { a, b, dir } => format!(
                "\"directionmix\" {} {} \"vector3 dir\" {}",
                self.spectrum_param("tex1", *a),
                self.spectrum_param("tex2", *b),
                list(&[dir.x, dir.y, dir.z])
            ),
            Texture::Bilerp { mapping, corners } => {
                let [a, b, c, d] = corners;
                let all = [("v00", a), ("v01", b), ("v10", c), ("v11", d)].map(|(n, s)| spectrum(n, s));
                format!("\"bilerp\" {} {}", self.mapping(mapping, &mut place), all.join(" "))
            }
            Texture::Checkerboard { mapping, a, b } => {
                let m = self.checker(mapping, &mut place);
                format!("\"checkerboard\" {m} {} {}", self.spectrum_param("tex1", *a), self.spectrum_param("tex2", *b))
            }
            Texture::Dots { mapping, inside, outside } => {
                let m = self.mapping(mapping, &mut place);
                let (a, b) = (self.spectrum_param("inside", *outside), self.spectrum_param("outside", *inside));
                format!("\"dots\" {m} {a} {b}")
            }
            Texture::Image(map) => self.image_map(map, &mut place),
            Texture::Noise { texture_from_world, noise } => {
                place = Some(texture_from_world.inverse());
                noise_of(noise)
            }
            Texture::Product { .. }
            | Texture::Threshold { .. }
            | Texture::Vertex
            | Texture::Attribute(_)
            | Texture::Grid(_) => match self.flat_color(t) {
                Some(Flat::Even(v)) => format!("\"constant\" \"rgb value\" {}", list(&v)),
                Some(Flat::Picture(p)) => self.baked_map(&name, &p, &mut place),
                None => return self.unsaid(&name),
            },
        };
        self.declare(&name, "spectrum", &text, place);
        Some(name)
    }

    fn unsaid(&mut self, name: &str) -> Option<String> {
        self.note("textures that pbrt has not, such as attributes of meshes, are left out");
        self.declared.values_mut().filter(|n| *n == name).for_each(String::clear);
        None
    }

    /// A parameter that was worked out, as numbers or as a picture under a key of its own.
    pub(super) fn flat_param(&mut self, name: &str, key: &str, value: &Flat, is_color: bool) -> String {
        match value {
            Flat::Even(v) if is_color => format!("\"rgb {name}\" {}", list(v)),
            Flat::Even(v) => format!("\"float {name}\" {}", number(v[0])),
            Flat::Picture(p) => {
                let (mut place, kind) = (None, if is_color { "spectrum" } else { "float" });
                let (texture, is_new) = self.texture_name(format!("{kind} {key}"));
                if is_new {
                    let text = self.baked_map(&texture, p, &mut place);
                    self.declare(&texture, kind, &text, place);
                }
                format!("\"texture {name}\" \"{texture}\"")
            }
        }
    }

    fn baked_map(&mut self, key: &str, p: &Baked, place: &mut Option<Transform>) -> String {
        let file = self.baked(key, p, Precision::Half);
        let (look, mapping) = (self.look(p.like), self.mapping(&p.mapping, place));
        format!("\"imagemap\" \"string filename\" \"{}\" {look} {mapping}", quoted(&file))
    }

    fn checker(&mut self, mapping: &CheckerMapping, place: &mut Option<Transform>) -> String {
        match mapping {
            CheckerMapping::Plane(m) => format!("\"integer dimension\" 2 {}", self.mapping(m, place)),
            CheckerMapping::Space(texture_from_world) => {
                *place = Some(texture_from_world.inverse());
                "\"integer dimension\" 3".into()
            }
        }
    }

    fn image_map(&mut self, map: &ImageMap, place: &mut Option<Transform>) -> String {
        let (file, encoding) = self.picture(map.image);
        let (look, mapping) = (self.look(map.image), self.mapping(&map.mapping, place));
        let invert = if map.invert { " \"bool invert\" true" } else { "" };
        format!(
            "\"imagemap\" \"string filename\" \"{}\" \"string encoding\" \"{encoding}\" {look} \"float scale\" {}{invert} {mapping}",
            quoted(&file),
            number(map.scale)
        )
    }

    /// Filter and edges.
    fn look(&mut self, image: Handle<TextureImage>) -> String {
        let image = &self.scene.images[image];
        let filter = match image.lookup {
            Lookup::Point => "point",
            Lookup::Bilinear => "bilinear",
            Lookup::Trilinear => "trilinear",
            Lookup::Ewa { .. } => "ewa",
        };
        if image.wrap[0] != image.wrap[1] {
            self.note("pictures that end differently to the sides than above end alike");
        }
        let wrap = match image.wrap[0] {
            Wrap::Black => "black",
            Wrap::Clamp => "clamp",
            Wrap::Octahedral => "octahedralsphere",
            Wrap::Mirror => {
                self.note("pictures that are mirrored at their edges repeat");
                "repeat"
            }
            Wrap::Repeat => "repeat",
        };
        format!("\"string filter\" \"{filter}\" \"string wrap\" \"{wrap}\"")
    }

    fn mapping(&mut self, m: &Mapping2, place: &mut Option<Transform>) -> String {
        if self.straight && affine(m).is_some() {
            return String::new();
        }
        match m {
            Mapping2::Uv { .. } | Mapping2::Affine { .. } => {
                if !is_sayable(m) {
                    self.note(
                        "texture coordinates that are turned, or of a second set, are those of the first, not turned",
                    );
                }
                let [[su, _, du], [_, sv, dv]] = affine(m).unwrap_or_default().1.map(|row| row.map(number));
                format!("\"float uscale\" {su} \"float vscale\" {sv} \"float udelta\" {du} \"float vdelta\" {dv}")
            }
            Mapping2::Planar { texture_from_world, vs, vt, ds, dt } => {
                *place = Some(texture_from_world.inverse());
                format!(
                    "\"string mapping\" \"planar\" \"vector3 v1\" {} \"vector3 v2\" {} \"float udelta\" {} \"float vdelta\" {}",
                    list(&[vs.x, vs.y, vs.z]),
                    list(&[vt.x, vt.y, vt.z]),
                    number(*ds),
                    number(*dt)
                )
            }
            Mapping2::Spherical { texture_from_world } => {
                *place = Some(texture_from_world.inverse());
                "\"string mapping\" \"spherical\"".into()
            }
            Mapping2::Cylindrical { texture_from_world } => {
                *place = Some(texture_from_world.inverse());
                "\"string mapping\" \"cylindrical\"".into()
            }
        }
    }
}

fn noise_of(noise: &Noise) -> String {
    let octaves = |kind: &str, n: u32, omega: f32| {
        format!("\"{kind}\" \"integer octaves\" {n} \"float roughness\" {}", number(omega))
    };
    match *noise {
        Noise::Fbm { octaves: n, omega } => octaves("fbm", n, omega),
        Noise::Wrinkled { octaves: n, omega } => octaves("wrinkled", n, omega),
        Noise::Windy => "\"windy\"".into(),
        Noise::Marble { octaves: n, omega, scale, variation } => {
            let rest = format!("\"float scale\" {} \"float variation\" {}", number(scale), number(variation));
            format!("{} {rest}", octaves("marble", n, omega))
        }
    }
}
