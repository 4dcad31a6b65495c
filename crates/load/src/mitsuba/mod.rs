//! Scenes of Mitsuba 3 (and of its older dialects, by their published rules of renaming) to `Scene`.
//!
//! Names and parameters are those of Mitsuba's plugins. A plugin that is not built here is an error with its name and line;
//! where one is shown otherwise than Mitsuba shows it, a note says so.

mod emitters;
mod grids;
mod materials;
mod media;
mod metals;
mod sensors;
mod shapes;
mod spectra;
mod sunsky;
mod tree;

use crate::files::FileAccess;
use crate::model::{ModelOptions, default_settings};
use crate::pbrt::LoadOutcome;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use steradian_image::Texels;
use steradian_scene::{Handle, IntegratorKind, Material, Medium, RenderSettings, Scene};
use steradian_syntax::{Diagnostic, Severity, Span};
use tree::{Child, Object, Reader, Tree, Value};

/// What is known while a scene is put together.
struct Mitsuba<'a> {
    files: &'a dyn FileAccess,
    reader: Reader<'a>,
    scene: Scene,
    covers: BTreeMap<usize, materials::Cover>,
    /// Materials with their backs, by their BSDF.
    sides: BTreeMap<Option<usize>, Handle<Material>>,
    objects: BTreeMap<usize, Handle<steradian_scene::Object>>,
    media: BTreeMap<usize, Handle<Medium>>,
    pictures: RefCell<BTreeMap<(String, bool), Texels>>,
    has_sensor: bool,
    has_panes: bool,
    said: BTreeSet<String>,
}

/// Reads a scene. All problems are in the outcome, each with its place.
pub(crate) fn load(path: &Path, files: &dyn FileAccess, options: &ModelOptions) -> LoadOutcome {
    let base = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut reader = Reader::new(files, base, options.allow_outside, &options.defines);
    reader.file(path, None);
    let mut m = Mitsuba {
        files,
        reader,
        scene: Scene::new(RenderSettings {
            // Mitsuba looks at texels as they are.
            disable_texture_filtering: true,
            ..default_settings(&path.display().to_string())
        }),
        covers: BTreeMap::new(),
        sides: BTreeMap::new(),
        objects: BTreeMap::new(),
        media: BTreeMap::new(),
        pictures: RefCell::default(),
        has_sensor: false,
        has_panes: false,
        said: BTreeSet::new(),
    };
    let errors = |d: &[Diagnostic]| d.iter().any(|d| d.severity == Severity::Error);
    if !errors(&m.reader.diagnostics) {
        m.build();
    }
    let Mitsuba { reader, scene, .. } = m;
    let scene = (!errors(&reader.diagnostics)).then_some(scene);
    let mut uses = BTreeMap::new();
    for o in &reader.tree.objects {
        *uses.entry(format!("{} {}", o.class, o.kind)).or_default() += 1;
    }
    LoadOutcome { scene, sources: reader.sources, diagnostics: reader.diagnostics, uses }
}

impl Mitsuba<'_> {
    fn tree(&self) -> &Tree {
        &self.reader.tree
    }

    fn error(&mut self, message: impl Into<String>, span: Span) {
        self.reader.error(message, span);
    }

    fn note_once(&mut self, message: &str, span: Span) {
        if self.said.insert(message.to_string()) {
            self.reader.diagnostics.push(Diagnostic::note(message, span));
        }
    }

    /// Something that Mitsuba has and this loader has not.
    fn not_built(&mut self, o: &Object) {
        let message = format!("the {} `{}` is not built", o.class, o.kind);
        self.error(message, o.span);
    }

    /// The children of an object with their names, references found.
    fn children(&mut self, list: &[(String, Child)]) -> Vec<(String, usize)> {
        let mut out = Vec::new();
        for (name, child) in list {
            match child {
                Child::Here(i) => out.push((name.clone(), *i)),
                Child::Reference(id, span) => match self.tree().ids.get(id) {
                    Some(&i) => out.push((name.clone(), i)),
                    None => self.error(format!("nothing has the id `{id}`"), *span),
                },
            }
        }
        out
    }

    fn object(&self, i: usize) -> Object {
        self.tree().objects[i].clone()
    }

    fn child(&mut self, o: &Object, class: &str) -> Option<usize> {
        let children = self.children(&o.children);
        children.into_iter().map(|c| c.1).find(|&i| self.tree().objects[i].class == class)
    }

    /// A child by the name of the parameter that it is.
    fn named(&mut self, o: &Object, name: &str) -> Option<usize> {
        self.children(&o.children).into_iter().find(|c| c.0 == name).map(|c| c.1)
    }

    fn build(&mut self) {
        let top = self.reader.tree.top.clone();
        let top = self.children(&top);
        for &(_, i) in &top {
            let o = self.object(i);
            match o.class.as_str() {
                "integrator" => self.integrator(&o),
                "sensor" | "camera" if !self.has_sensor => self.sensor(&o),
                "sensor" | "camera" => self.note_once("the first of several sensors is taken", o.span),
                "shape" => self.shape(i, &o, None),
                "emitter" => self.emitter(&o),
                // They are built where they are used.
                "bsdf" | "medium" | "texture" | "film" | "sampler" | "rfilter" | "phase" | "volume" => {}
                _ => self.not_built(&o),
            }
        }
        if !self.has_sensor {
            self.reader.diagnostics.push(Diagnostic::error("the scene has no sensor", None));
        }
        // Mitsuba's integrators of media see straight through panes, the others do not.
        let among_media = self.scene.settings.integrator.kind == IntegratorKind::VolPath;
        self.scene.settings.integrator.through_panes = self.has_panes && among_media;
        if !self.scene.media.is_empty() && self.scene.settings.integrator.kind == IntegratorKind::Path {
            self.scene.settings.integrator.kind = IntegratorKind::VolPath;
        }
    }

    fn integrator(&mut self, o: &Object) {
        let s = &mut self.scene.settings.integrator;
        let depth = |o: &Object, absent: i64| match o.get("max_depth").map(|p| &p.value) {
            Some(Value::Integer(n)) => *n,
            _ => absent,
        };
        // A depth counts what a path meets, here it counts where it turns.
        let bounces = |n: i64| if n < 0 { 1000 } else { (n - 1).clamp(0, 1_000_000) as u32 };
        match o.kind.as_str() {
            "path" | "prb" | "prb_basic" => (s.kind, s.max_depth) = (IntegratorKind::Path, bounces(depth(o, -1))),
            "ptracer" => {
                (s.kind, s.max_depth) = (IntegratorKind::Path, bounces(depth(o, -1)));
                let said = "`ptracer` is rendered by `path`, which has the same expectation; `--integrator lightpath` starts at lights";
                self.note_once(said, o.span);
            }
            "volpath" | "volpathmis" | "prbvolpath" => {
                (s.kind, s.max_depth) = (IntegratorKind::VolPath, bounces(depth(o, -1)));
            }
            "direct" => (s.kind, s.max_depth) = (IntegratorKind::Path, 1),
            "depth" => s.kind = IntegratorKind::Depth,
            "moment" | "aov" => {
                let said = "channels beside the picture are asked for on the command line: `--aov`, `--variance`";
                self.note_once(said, o.span);
                if let Some(inner) = self.child(o, "integrator") {
                    let inner = self.object(inner);
                    self.integrator(&inner);
                }
            }
            _ => self.not_built(o),
        }
        if self.flag(o, "hide_emitters", false) {
            self.scene.settings.integrator.hide_lights = true;
        }
    }

    /// A number by its name; a name of a material is an index of refraction.
    fn float(&mut self, o: &Object, name: &str, absent: f32) -> f32 {
        let Some(p) = o.get(name) else { return absent };
        match &p.value {
            Value::Float(v) => *v,
            Value::Integer(v) => *v as f32,
            Value::Spectrum(s) if s.len() == 1 => s[0].1,
            Value::Rgb([r, g, b]) if r == g && g == b => *r,
            Value::Text(text) => match spectra::index_of(text) {
                Some(v) => v,
                None => {
                    self.error(format!("`{text}` is no index of refraction that is known"), p.span);
                    absent
                }
            },
            _ => {
                self.error(format!("`{name}` must be a number"), p.span);
                absent
            }
        }
    }

    fn text(&mut self, o: &Object, name: &str) -> Option<String> {
        let p = o.get(name)?;
        match &p.value {
            Value::Text(t) => Some(t.clone()),
            _ => {
                self.error(format!("`{name}` must be a text"), p.span);
                None
            }
        }
    }

    fn flag(&mut self, o: &Object, name: &str, absent: bool) -> bool {
        match o.get(name).map(|p| &p.value) {
            Some(Value::Boolean(b)) => *b,
            _ => absent,
        }
    }

    fn count(&mut self, o: &Object, name: &str, absent: u32) -> u32 {
        match o.get(name).map(|p| (&p.value, p.span)) {
            Some((Value::Integer(n), span)) => u32::try_from(*n).unwrap_or_else(|_| {
                self.error(format!("`{name}` must not be negative"), span);
                absent
            }),
            _ => absent,
        }
    }

    /// Tells of parameters that nobody asked for.
    fn finish(&mut self, o: &Object) {
        let unasked: Vec<(String, Span)> = o.unasked().map(|(n, p)| (n.clone(), p.span)).collect();
        for (name, span) in unasked {
            let message = format!("`{name}` of the {} `{}` is not used", o.class, o.kind);
            self.reader.diagnostics.push(Diagnostic::warning(message, span));
        }
    }
}
