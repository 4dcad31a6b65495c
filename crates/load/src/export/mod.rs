//! Scenes as text of pbrt-v4 (Pharr, Jakob and Humphreys, the file format of version 4), with the files that it names.
//!
//! What the format cannot say is written as the nearest thing that it can, and named in the notes with the things that it concerns.

mod bake;
mod layered;
mod lights;
mod materials;
mod media;
mod settings;
mod shapes;
mod text;
mod textures;

use std::collections::{BTreeMap, BTreeSet};
use steradian_math::Transform;
use steradian_scene::{Handle, Instance, Object, Primitive, Scene};
use text::transform;

/// A scene as pbrt-v4 has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exported {
    /// The scene file.
    pub text: String,
    /// The files that it names, by their paths beside it.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the format could not say, and what stands for it.
    pub notes: Vec<String>,
}

/// How the text of every scene written here begins.
pub const PBRT_MARK: &str = "# Written by steradian convert\n";

/// So many shapes may come of laying nested instances open.
const MOST_SHAPES: u64 = 4_000_000;

/// Writes a scene. The names of its files begin with `folder`, which lies beside the scene file.
///
/// # Errors
/// A sentence, where instances in instances would make more text than anybody can read, or a picture cannot be written.
pub fn to_pbrt(scene: &Scene, folder: &str) -> Result<Exported, String> {
    let mut w = Writer {
        scene,
        folder,
        head: PBRT_MARK.to_string(),
        body: String::new(),
        files: Vec::new(),
        notes: BTreeMap::new(),
        pictures: BTreeMap::new(),
        materials: BTreeMap::new(),
        meshes: BTreeMap::new(),
        declared: BTreeMap::new(),
        failure: None,
        straight: false,
        subject: String::new(),
        shining: shining(scene),
    };
    w.check_size()?;
    w.settings();
    w.head("WorldBegin");
    w.media();
    w.lights();
    w.objects();
    for p in &scene.primitives {
        w.primitive(p, &Transform::IDENTITY);
    }
    for i in &scene.instances {
        w.instance(i);
    }
    match w.failure {
        Some(message) => Err(message),
        None => Ok(Exported { text: w.head + &w.body, files: w.files, notes: told(w.notes) }),
    }
}

/// Notes with the things that they are about.
fn told(notes: BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    const MOST_NAMED: usize = 5;
    notes
        .into_iter()
        .map(|(note, about)| {
            let names: Vec<&str> = about.iter().map(String::as_str).filter(|n| !n.is_empty()).collect();
            let more = names.len().saturating_sub(MOST_NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            match names.len() {
                0 => note,
                _ => format!("{note} ({}{more})", names[..names.len().min(MOST_NAMED)].join(", ")),
            }
        })
        .collect()
}

struct Writer<'s> {
    scene: &'s Scene,
    folder: &'s str,
    /// Settings, textures and materials.
    head: String,
    /// What stands in the world.
    body: String,
    files: Vec<(String, Vec<u8>)>,
    notes: BTreeMap<String, BTreeSet<String>>,
    /// Pictures that were written: their names, and how their numbers stand for light.
    pictures: BTreeMap<String, (String, String)>,
    materials: BTreeMap<(usize, bool), String>,
    meshes: BTreeMap<String, String>,
    /// Textures that were declared, by what they are, and their names.
    declared: BTreeMap<String, String>,
    failure: Option<String>,
    /// Whether the coordinates of the mesh at hand are already those of its pictures.
    straight: bool,
    /// What is being written, for the notes.
    subject: String,
    /// Which objects have a lamp somewhere in them.
    shining: Vec<bool>,
}

/// Which objects have a lamp in them, or in what is nested in them.
fn shining(scene: &Scene) -> Vec<bool> {
    let of_itself = |o: &Object| o.primitives.iter().any(|p| p.area_light.is_some());
    let mut out: Vec<bool> = scene.objects.iter().map(of_itself).collect();
    // Once more for each level of nesting.
    for _ in 0..=MOST_NESTING {
        let before = out.clone();
        for (shines, o) in out.iter_mut().zip(scene.objects.iter()) {
            *shines |= o.instances.iter().any(|i| before.get(i.object.index()).copied().unwrap_or(false));
        }
        if out == before {
            break;
        }
    }
    out
}

impl Writer<'_> {
    fn head(&mut self, text: &str) {
        self.head.push_str(text);
        self.head.push('\n');
    }

    fn line(&mut self, text: &str) {
        self.body.push_str(text);
        self.body.push('\n');
    }

    fn note(&mut self, text: &str) {
        self.notes.entry(text.to_string()).or_default().insert(self.subject.clone());
    }

    fn path(&self, name: &str) -> String {
        format!("{}/{name}", self.folder)
    }

    /// Refuses scenes whose nested instances, laid open, would have no end.
    fn check_size(&self) -> Result<(), String> {
        let mut sizes = BTreeMap::new();
        let objects = (0..self.scene.objects.len()).map(Handle::from_index);
        let all = objects.fold(0u64, |n, o| n.saturating_add(self.size(o, &mut sizes, 0)));
        let emitting = self.scene.instances.iter().fold(0u64, |n, i| {
            n.saturating_add(if self.shines(i.object) { self.size(i.object, &mut sizes, 0) } else { 0 })
        });
        match all.saturating_add(emitting) {
            n if n > MOST_SHAPES => Err(format!(
                "instances inside of instances are laid open in pbrt-v4's format, which makes {n} shapes; at most {MOST_SHAPES} are written"
            )),
            _ => Ok(()),
        }
    }

    fn size(&self, object: Handle<Object>, sizes: &mut BTreeMap<usize, u64>, depth: u32) -> u64 {
        if let Some(&known) = sizes.get(&object.index()) {
            return known;
        }
        if depth > MOST_NESTING {
            return u64::MAX;
        }
        let o = &self.scene.objects[object];
        let inner = o.instances.iter().map(|i| self.size(i.object, sizes, depth + 1));
        let all = inner.fold(o.primitives.len() as u64, u64::saturating_add);
        sizes.insert(object.index(), all);
        all
    }

    /// Whether anything in an object is a lamp. pbrt's instances do not shine.
    fn shines(&self, object: Handle<Object>) -> bool {
        self.shining.get(object.index()).copied().unwrap_or(false)
    }

    /// Objects that instances repeat; what is nested in them is laid open.
    fn objects(&mut self) {
        let repeated: BTreeSet<usize> = self.scene.instances.iter().map(|i| i.object.index()).collect();
        for (index, object) in self.scene.objects.iter().enumerate() {
            if repeated.contains(&index) && !self.laid_open(Handle::from_index(index)) {
                self.line(&format!("ObjectBegin \"object{index}\""));
                self.members(object, &Transform::IDENTITY, 0);
                self.line("ObjectEnd");
            }
        }
    }

    /// Whether an object is written where it stands instead of as an instance.
    fn laid_open(&self, object: Handle<Object>) -> bool {
        let moves = self.scene.instances.iter().any(|i| i.object == object && i.world_from_object.is_animated());
        !moves && self.shines(object)
    }

    fn members(&mut self, object: &Object, place: &Transform, depth: u32) {
        for p in &object.primitives {
            self.primitive(p, place);
        }
        if depth > MOST_NESTING {
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

    fn instance(&mut self, i: &Instance) {
        let moving = i.world_from_object;
        if self.laid_open(i.object) {
            let place = moving.at(self.scene.camera.shutter[0]);
            return self.members(&self.scene.objects[i.object], &place, 0);
        }
        if self.shines(i.object) {
            self.note("what moves does not shine in pbrt");
        }
        self.line("AttributeBegin");
        let [open, close] = self.scene.camera.shutter;
        if moving.is_animated() {
            self.line(&format!("ActiveTransform StartTime {}", transform(&moving.at(open))));
            self.line(&format!("ActiveTransform EndTime {}\nActiveTransform All", transform(&moving.at(close))));
        } else {
            self.line(&transform(&moving.at(open)));
        }
        self.line(&format!("ObjectInstance \"object{}\"\nAttributeEnd", i.object.index()));
    }

    /// What a primitive is called in the notes.
    fn called(&self, p: &Primitive) -> String {
        let m = &self.scene.materials[p.material];
        if m.name.is_empty() { String::new() } else { format!("\"{}\"", m.name) }
    }
}

/// Objects inside of objects, at most; no loader makes deeper ones.
const MOST_NESTING: u32 = 64;
