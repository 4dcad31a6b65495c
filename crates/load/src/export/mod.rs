//! Scenes as text of pbrt-v4 (Pharr, Jakob and Humphreys, the file format of version 4), with the files that it names.
//!
//! What the format cannot say is written as the nearest thing that it can, and named in the notes.

mod lights;
mod materials;
mod shapes;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use steradian_image::{FilterKind, Format, Image, Precision, Texels, WriteOptions, encode};
use steradian_math::{Point3, Transform, Vec3};
use steradian_sampling::SamplerKind;
use steradian_scene::{
    Handle, IntegratorKind, LightSelection, Object, Projection, Scene, SphericalMapping, TextureImage,
};
use steradian_spectrum::{Spectrum, SpectrumUse};

/// A scene as pbrt-v4 has it.
#[derive(Clone, Debug, Default)]
pub struct Exported {
    /// The scene file.
    pub text: String,
    /// The files that it names, by their paths beside it.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the format could not say, and what stands for it.
    pub notes: Vec<String>,
}

/// Writes a scene. The names of its files begin with `folder`, which lies beside the scene file.
pub fn to_pbrt(scene: &Scene, folder: &str) -> Exported {
    let mut w = Writer {
        scene,
        folder,
        out: Exported::default(),
        notes: BTreeSet::new(),
        images: BTreeMap::new(),
        materials: BTreeMap::new(),
        meshes: BTreeMap::new(),
        declared: BTreeSet::new(),
    };
    w.settings();
    w.line("WorldBegin");
    w.media();
    w.lights();
    w.objects();
    for p in &scene.primitives {
        w.primitive(p, &Transform::IDENTITY);
    }
    for i in &scene.instances {
        w.instance(i);
    }
    w.out.notes = w.notes.into_iter().collect();
    w.out
}

struct Writer<'s> {
    scene: &'s Scene,
    folder: &'s str,
    out: Exported,
    notes: BTreeSet<String>,
    /// Names of pictures that were written, and of textures and materials that were declared.
    images: BTreeMap<(usize, bool), String>,
    materials: BTreeMap<usize, String>,
    meshes: BTreeMap<usize, String>,
    declared: BTreeSet<String>,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) {
        self.out.text.push_str(text);
        self.out.text.push('\n');
    }

    fn note(&mut self, text: &str) {
        self.notes.insert(text.to_string());
    }

    fn settings(&mut self) {
        let s = &self.scene.settings;
        if s.disable_texture_filtering {
            self.line("Option \"bool disabletexturefiltering\" true");
        }
        let camera = &self.scene.camera;
        let moving = camera.world_from_camera;
        if moving.is_animated() {
            self.note("the camera moves, which is left out");
        }
        let matrix = transform(&moving.at(camera.shutter[0]).inverse());
        self.line(&matrix);
        let mut text = match &camera.projection {
            Projection::Perspective { fov } => format!("Camera \"perspective\" \"float fov\" {fov}"),
            Projection::Orthographic => "Camera \"orthographic\"".into(),
            Projection::Spherical { mapping } => {
                let name = if *mapping == SphericalMapping::EqualArea { "equalarea" } else { "equirectangular" };
                format!("Camera \"spherical\" \"string mapping\" \"{name}\"")
            }
            Projection::Realistic { .. } => {
                self.note("a camera with a real lens is written as a perspective of 50 degrees");
                "Camera \"perspective\" \"float fov\" 50".into()
            }
        };
        let [open, close] = camera.shutter;
        let _ = write!(text, "\n  \"float shutteropen\" {open} \"float shutterclose\" {close}");
        if camera.lens_radius > 0.0 {
            let (r, d) = (camera.lens_radius, camera.focal_distance);
            let _ = write!(text, "\n  \"float lensradius\" {r} \"float focaldistance\" {d}");
        }
        if let Some(window) = camera.screen_window {
            let _ = write!(text, "\n  \"float screenwindow\" {}", list(&window));
        }
        if let Some(aspect) = camera.frame_aspect_ratio {
            let _ = write!(text, "\n  \"float frameaspectratio\" {aspect}");
        }
        self.line(&text);
        let film = &s.film;
        let [x, y] = film.resolution;
        let bounds = film.pixel_bounds.map(|v| v as f32);
        self.line(&format!(
            "Film \"rgb\" \"integer xresolution\" {x} \"integer yresolution\" {y} \"integer pixelbounds\" {}\n  \"string filename\" \"{}\"",
            list(&bounds),
            quoted(&film.filename)
        ));
        let filter = &s.filter;
        let radius = filter.radius();
        let (name, more) = match filter.kind() {
            FilterKind::Box => ("box", String::new()),
            FilterKind::Triangle => ("triangle", String::new()),
            FilterKind::Gaussian { sigma } => ("gaussian", format!(" \"float sigma\" {sigma}")),
            FilterKind::Mitchell { b, c } => ("mitchell", format!(" \"float B\" {b} \"float C\" {c}")),
            FilterKind::Sinc { tau } => ("sinc", format!(" \"float tau\" {tau}")),
        };
        let (rx, ry) = (radius.x, radius.y);
        self.line(&format!("PixelFilter \"{name}\" \"float xradius\" {rx} \"float yradius\" {ry}{more}"));
        let sampler = match s.sampler.kind {
            SamplerKind::Independent => "independent",
            SamplerKind::Stratified => "stratified",
            SamplerKind::Halton => "halton",
            SamplerKind::Sobol => "sobol",
            SamplerKind::PaddedSobol => "paddedsobol",
            SamplerKind::ZSobol => "zsobol",
        };
        let count = if sampler == "stratified" {
            let side = (s.sampler.spp as f32).sqrt().ceil();
            format!("\"integer xsamples\" {side} \"integer ysamples\" {side}")
        } else {
            format!("\"integer pixelsamples\" {}", s.sampler.spp)
        };
        self.line(&format!("Sampler \"{sampler}\" {count}"));
        self.integrator();
    }

    fn integrator(&mut self) {
        let i = &self.scene.settings.integrator;
        let name = match i.kind {
            IntegratorKind::Path => "path",
            IntegratorKind::VolPath => "volpath",
            IntegratorKind::SimpleVolPath => "simplevolpath",
            IntegratorKind::LightPath => "lightpath",
            IntegratorKind::Bdpt(_) => "bdpt",
            IntegratorKind::AmbientOcclusion { .. } => "ambientocclusion",
            _ => {
                self.note("the integrator is one that pbrt has not; `path` stands for it");
                "path"
            }
        };
        let lights = match i.light_selection {
            LightSelection::Uniform => "uniform",
            LightSelection::Power => "power",
            LightSelection::Tree => "bvh",
        };
        let depth = i.max_depth;
        self.line(&format!("Integrator \"{name}\" \"integer maxdepth\" {depth} \"string lightsampler\" \"{lights}\""));
    }

    /// Writes a picture as OpenEXR, once; its name. `color`: three channels whatever it has.
    fn image(&mut self, handle: Handle<TextureImage>, color: bool) -> String {
        let key = (handle.index(), color);
        if let Some(name) = self.images.get(&key) {
            return name.clone();
        }
        let name = format!("{}/image{}{}.exr", self.folder, handle.index(), if color { "c" } else { "" });
        let bytes = exr(&self.scene.images[handle].texels, color);
        self.out.files.push((name.clone(), bytes));
        self.images.insert(key, name.clone());
        name
    }

    /// Objects that instances repeat; what is nested in them is laid open.
    fn objects(&mut self) {
        for (index, object) in self.scene.objects.iter().enumerate() {
            self.line(&format!("ObjectBegin \"object{index}\""));
            self.members(object, &Transform::IDENTITY, 0);
            self.line("ObjectEnd");
        }
    }

    fn members(&mut self, object: &Object, place: &Transform, depth: u32) {
        for p in &object.primitives {
            self.primitive(p, place);
        }
        if depth > 64 {
            return;
        }
        for i in &object.instances {
            if i.world_from_object.is_animated() {
                self.note("instances inside of instances do not move");
            }
            let inner = place.mul(&i.world_from_object.at(self.scene.camera.shutter[0]));
            self.members(&self.scene.objects[i.object], &inner, depth + 1);
        }
    }

    fn instance(&mut self, i: &steradian_scene::Instance) {
        self.line("AttributeBegin");
        let [open, close] = self.scene.camera.shutter;
        let moving = i.world_from_object;
        if moving.is_animated() {
            self.line(&format!("ActiveTransform StartTime {}", transform(&moving.at(open))));
            self.line(&format!("ActiveTransform EndTime {}\nActiveTransform All", transform(&moving.at(close))));
        } else {
            self.line(&transform(&moving.at(open)));
        }
        self.line(&format!("ObjectInstance \"object{}\"\nAttributeEnd", i.object.index()));
    }
}

/// Channels that are grey, or red, green and blue.
fn exr(texels: &Texels, color: bool) -> Vec<u8> {
    let (w, h) = (texels.width(), texels.height());
    let mut image = Image::new(w, h);
    let plane = |c: usize| (0..w * h).map(|i| texels.texel(i % w, i / w, c)).collect::<Vec<f32>>();
    let of = |c: usize| if texels.channels() < 3 { 0 } else { c };
    let names: &[&str] = if texels.channels() < 3 && !color { &["Y"] } else { &["R", "G", "B"] };
    for (c, name) in names.iter().enumerate() {
        // Planes of one picture have one length.
        let _ = image.add(name, plane(of(c)), Precision::Float);
    }
    encode(&image, Format::Exr, "image.exr", &WriteOptions::default()).unwrap_or_default()
}

/// A matrix in the order of the format, which is by columns.
fn transform(t: &Transform) -> String {
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    let mut columns: Vec<f32> = axes.iter().map(|&a| t.vector(a)).flat_map(|v| [v.x, v.y, v.z, 0.0]).collect();
    let o = t.point(Point3::default());
    columns.extend([o.x, o.y, o.z, 1.0]);
    format!("Transform {}", list(&columns))
}

fn list(values: &[f32]) -> String {
    let words: Vec<String> = values.iter().map(f32::to_string).collect();
    format!("[ {} ]", words.join(" "))
}

fn quoted(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

/// A parameter that is a spectrum.
fn spectrum(name: &str, s: &Spectrum) -> String {
    if s.is_rgb() {
        // Of an illuminant, what it shows as.
        let factor = if s.usage() == SpectrumUse::Illuminant { 1.0 / s.photometric() } else { 1.0 };
        return format!("\"rgb {name}\" {}", list(&s.rgb().map(|v| v * factor)));
    }
    let step = if s.is_constant() { 470 } else { 1 };
    let pairs: Vec<f32> = (360..=830).step_by(step).flat_map(|l| [l as f32, s.eval_at(l as f32)]).collect();
    format!("\"spectrum {name}\" {}", list(&pairs))
}
