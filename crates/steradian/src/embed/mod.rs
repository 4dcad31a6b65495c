//! For programs that hold scenes themselves, as the Python package does: a scene with its name, its edits and its files, rendered with
//! the words of the command line, whole or in parts.

mod pack;
mod parts;
mod words;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use steradian_image::{Image, Metadata};
use steradian_load::{Disk, FileAccess, Input, LoadOptions, LoadOutcome, Memory, load, load_pbrt};
use steradian_render::{Film, Label, Observer, Progress, Rendered, Share, Task};
use steradian_scene::{ParameterError, Scene, Value, World};
use steradian_syntax::Severity;

use crate::args::RenderArgs;
use crate::console::Console;
use crate::failure::Failure;
use crate::hashing::Hashing;
use crate::oidn::Oidn;
use crate::output::{self, Story};
use crate::{aov, denoise, keep, opened, overrides, render, stop};
use pack::{Asking, Pack};
use words::parse;

pub use parts::{Joined, Joining, join_parts, looks, write};
pub use words::{Asked, asked};

/// One problem of a scene.
#[derive(Clone, Debug)]
pub struct Report {
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// What is wrong.
    pub message: String,
    /// The file, if there is a place.
    pub file: Option<String>,
    /// Line, from 1.
    pub line: Option<u32>,
    /// Character in the line, from 1.
    pub column: Option<u32>,
    /// What to do about it.
    pub hint: Option<String>,
    /// All of that as a person reads it, with the line and a caret.
    pub text: String,
}

/// Why something did not work.
#[derive(Debug)]
pub enum Trouble {
    /// The scene has errors.
    Scene(Vec<Report>),
    /// What was asked for makes no sense.
    Input(String),
    /// The machine is at fault.
    Environment(String),
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Trouble {
        match failure {
            Failure::Reported => Trouble::Scene(Vec::new()),
            Failure::Input(what) => Trouble::Input(what),
            Failure::Environment(what) => Trouble::Environment(what),
        }
    }
}

impl From<ParameterError> for Trouble {
    fn from(e: ParameterError) -> Trouble {
        Trouble::Input(e.to_string())
    }
}

/// Where a scene comes from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// The one that is built in.
    Showcase,
    /// A file.
    File(PathBuf),
    /// A pbrt text; files that it names are these, or else on disk relative to the current folder.
    Text {
        /// What messages call it.
        name: String,
        /// The text.
        text: String,
        /// Files in memory.
        files: Memory,
    },
}

/// Files in memory where there are any of the name, else on disk.
struct Layered<'a>(&'a Memory);

impl FileAccess for Layered<'_> {
    fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        if self.0.exists(path) { self.0.read(path) } else { Disk.read(path) }
    }

    fn exists(&self, path: &Path) -> bool {
        self.0.exists(path) || Disk.exists(path)
    }
}

/// A scene that can be changed, rendered and sent.
#[derive(Clone, Debug)]
pub struct Held {
    /// The scene as it is now.
    scene: Scene,
    /// How a person would name it.
    pub name: String,
    /// What was noticed while reading.
    pub warnings: Vec<Report>,
    origin: Origin,
    options: Vec<String>,
    hash: String,
    read: BTreeSet<PathBuf>,
    there: BTreeSet<PathBuf>,
    edits: Vec<(String, Edit)>,
    built: Built,
}

/// The last world that parts were rendered of, and what it is of.
type Built = Arc<Mutex<Option<((String, String), Arc<World>)>>>;

/// A value that travels.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Edit {
    Float(f32),
    Integer(u64),
    Triple([f32; 3]),
    Matrix([[f32; 4]; 4]),
}

impl From<&Value> for Edit {
    fn from(v: &Value) -> Edit {
        match *v {
            Value::Float(v) => Edit::Float(v),
            Value::Integer(v) => Edit::Integer(v),
            Value::Triple(v) => Edit::Triple(v),
            Value::Matrix(v) => Edit::Matrix(v),
        }
    }
}

impl From<&Edit> for Value {
    fn from(v: &Edit) -> Value {
        match *v {
            Edit::Float(v) => Value::Float(v),
            Edit::Integer(v) => Value::Integer(v),
            Edit::Triple(v) => Value::Triple(v),
            Edit::Matrix(v) => Value::Matrix(v),
        }
    }
}

/// What a packed scene says about itself.
#[derive(Serialize, Deserialize)]
struct Head {
    name: String,
    /// The file to start with, or the text itself.
    file: Option<PathBuf>,
    text: Option<String>,
    options: Vec<String>,
    hash: String,
    edits: Vec<(String, Edit)>,
}

/// Who watches a render.
pub trait Watcher: Sync {
    /// How far it has come; called now and then from one thread at a time.
    fn progress(&self, _progress: &Progress) {}
    /// The picture at the end of a pass, on demand.
    fn pass(&self, _picture: &dyn Fn() -> Option<Image>) {}
}

/// Watches nothing.
pub struct Unwatched;

impl Watcher for Unwatched {}

struct Watching<'a> {
    watcher: &'a dyn Watcher,
    manifest: &'a Metadata,
}

impl Observer for Watching<'_> {
    fn progress(&self, progress: &Progress) {
        self.watcher.progress(progress);
    }

    fn pass(&self, film: &Film, progress: &Progress) {
        self.watcher.progress(progress);
        self.watcher.pass(&|| output::unfinished(film, self.manifest));
    }
}

/// A finished render.
pub struct Picture {
    /// The picture and its channels.
    pub image: Image,
    /// How it ended: `finished`, `error reached`, `time limit`, `interrupted`.
    pub outcome: &'static str,
    /// Samples that went wrong.
    pub bad_samples: u64,
}

impl Held {
    /// Reads a scene. `options` are words of `steradian render` that say how to read it: `--env`, `--camera`, `-D`.
    ///
    /// # Errors
    /// Every error of the scene, or words that make no sense.
    pub fn open(origin: Origin, options: &[String]) -> Result<Held, Trouble> {
        let none = Memory::new();
        let files: &dyn FileAccess = match &origin {
            Origin::Text { files, .. } => &Layered(files),
            Origin::File(_) => &Disk,
            Origin::Showcase => &none,
        };
        Self::open_through(files, origin.clone(), options)
    }

    fn open_through(files: &dyn FileAccess, origin: Origin, options: &[String]) -> Result<Held, Trouble> {
        let args = parse(options)?;
        let size = args.picture.size.map(|s| s.0);
        let load_options = LoadOptions { model: args.picture.model.options(size), ..LoadOptions::default() };
        let asking = Asking::new(files);
        let hashing = Hashing::new(&asking);
        let said = steradian_load::ModelOptions { size: None, ..load_options.model.clone() };
        if said != steradian_load::ModelOptions::default() {
            hashing.note("options", format!("{said:?}").as_bytes());
        }
        let (name, outcome) = match &origin {
            Origin::Showcase => {
                let (name, text) = (opened::SHOWCASE_NAME, opened::SHOWCASE);
                hashing.note(name, text.as_bytes());
                let input = Input::Text { name, text, directory: Path::new("") };
                (name.to_owned(), load_pbrt(input, &hashing, &load_options))
            }
            Origin::File(path) => (path.display().to_string(), load(Input::File(path), &hashing, &load_options)),
            Origin::Text { name, text, .. } => {
                hashing.note(name, text.as_bytes());
                let input = Input::Text { name, text, directory: Path::new("") };
                (name.clone(), load_pbrt(input, &hashing, &load_options))
            }
        };
        let hash = hashing.hash();
        drop(hashing);
        let (read, there) = asking.seen();
        let reports = reports(&outcome);
        let Some(scene) = outcome.scene else { return Err(Trouble::Scene(reports)) };
        let options = options.to_vec();
        Ok(Held {
            scene,
            name,
            warnings: reports,
            origin,
            options,
            hash,
            read,
            there,
            edits: Vec::new(),
            built: Built::default(),
        })
    }

    /// All parameters with their values.
    pub fn parameters(&mut self) -> Vec<(String, Value)> {
        self.scene.parameters()
    }

    /// Gives a parameter another value.
    ///
    /// # Errors
    /// Where the name is unknown or the value is not for it.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), Trouble> {
        self.scene.set_parameter(name, value)?;
        self.edits.retain(|(n, _)| n != name);
        self.edits.push((name.to_owned(), value.into()));
        Ok(())
    }

    /// Width and height of the picture that the scene asks for.
    pub fn size(&self) -> [u32; 2] {
        self.scene.settings.film.size()
    }

    /// A hash of everything that was read, and of what was changed since.
    pub fn hash(&self) -> String {
        if self.edits.is_empty() {
            return self.hash.clone();
        }
        let mut sorted: Vec<_> = self.edits.iter().map(|(name, value)| format!("{name}={value:?}")).collect();
        sorted.sort();
        let all = format!("{}\n{}", self.hash, sorted.join("\n"));
        blake3::hash(all.as_bytes()).to_hex()[..32].to_owned()
    }

    /// The scene with all its files, for another machine.
    ///
    /// # Errors
    /// Where a file is no longer what was read.
    pub fn pack(&self) -> Result<Vec<u8>, Trouble> {
        let (file, text, source): (_, _, &dyn FileAccess) = match &self.origin {
            Origin::Showcase => (None, None, &Disk),
            Origin::File(path) => (Some(path.clone()), None, &Disk),
            Origin::Text { text, files, .. } => (None, Some(text.clone()), &Layered(files)),
        };
        let mut pack = Pack { there: self.there.difference(&self.read).cloned().collect(), ..Pack::default() };
        for path in &self.read {
            let bytes = source.read(path).map_err(|e| {
                Trouble::Environment(format!("cannot read {} again: {}", path.display(), crate::failure::reason(&e)))
            })?;
            pack.files.insert(path.clone(), bytes);
        }
        let head = Head {
            name: self.name.clone(),
            file,
            text,
            options: self.options.clone(),
            hash: self.hash.clone(),
            edits: self.edits.clone(),
        };
        let head = serde_json::to_vec(&head).map_err(|e| Trouble::Environment(e.to_string()))?;
        Ok(pack.encode(&head))
    }

    /// A scene from [`Held::pack`]; no file of this machine is read.
    ///
    /// # Errors
    /// Where the bytes are damaged, or of another version.
    pub fn unpack(bytes: &[u8]) -> Result<Held, Trouble> {
        let (head, pack) = Pack::decode(bytes).map_err(Trouble::Input)?;
        let head: Head = serde_json::from_slice(&head)
            .map_err(|_| Trouble::Input("the packed scene is of another version of Steradian".into()))?;
        let origin = match (head.file, head.text) {
            (Some(path), _) => Origin::File(path),
            (None, Some(text)) => Origin::Text { name: head.name.clone(), text, files: Memory::new() },
            (None, None) => Origin::Showcase,
        };
        let mut held = Held::open_through(&pack, origin, &head.options)?;
        if held.hash != head.hash {
            return Err(Trouble::Environment(format!(
                "the files of {} changed between reading and sending: load it again",
                head.name
            )));
        }
        for (name, value) in &head.edits {
            held.set(name, &value.into())?;
        }
        Ok(held)
    }

    /// Renders with options in the words of `steradian render`, as far as they do not name files.
    ///
    /// # Errors
    /// Words that make no sense, and scenes that cannot be put together.
    pub fn render(&self, words: &[String], watcher: &dyn Watcher, cancel: &AtomicBool) -> Result<Picture, Trouble> {
        let args = parse(words)?;
        if args.keep.shard.is_some() {
            return Err(Trouble::Input("--shard makes a part, not a picture".into()));
        }
        let oidn = if args.denoise { Some(Oidn::load().map_err(Trouble::Environment)?) } else { None };
        self.run(&args, false, watcher, cancel, |prepared, rendered| {
            let of_us = |e: steradian_image::Error| Trouble::Input(format!("the channels cannot be added: {e}"));
            let (mut image, _) = output::images(rendered, &prepared.manifest, Some(prepared.threads));
            output::add_layers(&mut image, &rendered.film, prepared.layers.names()).map_err(of_us)?;
            aov::add(&mut image, &args.aov, rendered, prepared.world, prepared.threads, cancel).map_err(of_us)?;
            if let Some(oidn) = &oidn {
                denoise::denoise(oidn, &mut image, prepared.world, (prepared.threads, rendered.spp), u64::MAX)
                    .map_err(Trouble::Environment)?;
            }
            Ok(Picture { image, outcome: stop::outcome_name(rendered.outcome), bad_samples: rendered.bad_count })
        })
    }

    /// Renders a part: the words name it with `--shard I/N`. The bytes are those of the file that `steradian render` would write, unless
    /// the render is to be cut by samples where it would be cut by tiles, or without what is seen besides light, which [`Held::seen`] then
    /// has.
    ///
    /// # Errors
    /// As [`Held::render`]; a part that was interrupted is none.
    pub fn part(
        &self,
        words: &[String],
        (by_samples, light_only): (bool, bool),
        cancel: &AtomicBool,
    ) -> Result<Vec<u8>, Trouble> {
        let args = part_words(words)?;
        let stopped = || Trouble::Environment("interrupted".into());
        self.run(&args, by_samples, &Unwatched, cancel, |prepared, rendered| {
            if rendered.outcome != steradian_render::Outcome::Finished {
                return Err(stopped());
            }
            let (share, spp) = rendered.share();
            let look = || aov::seen(&args.aov, prepared.world, (share.part(), spp), prepared.threads, cancel);
            let seen = if light_only { None } else { look().ok_or_else(stopped)? };
            Ok(rendered.encode_part(&prepared.label, seen.as_ref()))
        })
    }

    /// What a part sees besides light, by itself: [`join_parts`] adds it to parts that have light only.
    ///
    /// # Errors
    /// As [`Held::part`].
    pub fn seen(&self, words: &[String], cancel: &AtomicBool) -> Result<Vec<u8>, Trouble> {
        let args = part_words(words)?;
        let mut scene = self.scene.clone();
        overrides::apply(&args.picture, &mut scene, &Console::new().quiet(true));
        let spp = args.stop.most_spp(args.picture.spp, scene.settings.sampler.spp);
        let world = self.world(scene, overrides::as_typed(&args.picture), true)?;
        let threads = args.run.threads.map_or_else(render::default_threads, usize::from);
        let part = args.keep.shard.map_or(steradian_render::Part { index: 0, count: 1 }, |s| s.0);
        let seen = aov::seen(&args.aov, &world, (part, spp), threads, cancel);
        let seen = seen.ok_or_else(|| Trouble::Environment("interrupted".into()))?;
        Ok(seen.unwrap_or_default().encode())
    }

    /// Whether a render with these words looks at the scene again for what is seen besides light.
    ///
    /// # Errors
    /// Words that make no sense.
    pub fn looks_again(&self, words: &[String]) -> Result<bool, Trouble> {
        let args = parse(words)?;
        let mut scene = self.scene.clone();
        overrides::apply(&args.picture, &mut scene, &Console::new().quiet(true));
        Ok(aov::looks_again(&args.aov, &scene.settings.film.kind))
    }

    /// What rendering needs. For the parts of one render it is made once.
    fn world(&self, scene: Scene, options: String, keep: bool) -> Result<Arc<World>, Trouble> {
        if !keep {
            return Ok(Arc::new(opened::build(scene, None)?));
        }
        let mut built = self.built.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (self.hash(), options);
        match &*built {
            Some((of, world)) if *of == key => Ok(Arc::clone(world)),
            _ => {
                let world = Arc::new(opened::build(scene, None)?);
                *built = Some((key, Arc::clone(&world)));
                Ok(world)
            }
        }
    }

    /// Puts everything together as `steradian render` does, renders, and makes something of it.
    fn run<T>(
        &self,
        args: &RenderArgs,
        by_samples: bool,
        watcher: &dyn Watcher,
        cancel: &AtomicBool,
        make: impl FnOnce(&Prepared, &Rendered) -> Result<T, Trouble>,
    ) -> Result<T, Trouble> {
        let console = Console::new().quiet(true);
        let mut scene = self.scene.clone();
        overrides::apply(&args.picture, &mut scene, &console);
        let spp = args.stop.most_spp(args.picture.spp, scene.settings.sampler.spp);
        let world = self.world(scene, overrides::as_typed(&args.picture), args.keep.shard.is_some())?;
        let world = &*world;
        let layers = aov::layers(&args.aov, args.picture.filter_outliers, world)?;
        opened::check_cost(world, args.run.yes)?;
        let threads = args.run.threads.map_or_else(render::default_threads, usize::from);
        let share = match args.keep.shard {
            Some(shard) if by_samples => Share::Samples(shard.0),
            shard => keep::share(shard, world.settings()),
        };
        let goals = render::goals(args, world.settings(), share, &layers)?;
        let hash = self.hash();
        let identity = keep::identity(world.settings(), &hash, goals.adaptive, share, &layers);
        let story = Story {
            scene: &self.name,
            scene_hash: &hash,
            settings: world.settings(),
            picture: &args.picture,
            stop: &args.stop,
        };
        let manifest = output::manifest(&story);
        let note = output::note_of_metadata(&manifest);
        let label = Label { identity: &identity, note: &note };
        let plan = args.stop.plan(spp, threads);
        let task = Task { world, plan, goals, layers: &layers, label, resume: None };
        let watching = Watching { watcher, manifest: &manifest };
        let rendered = render::quietly(|| steradian_render::run(task, &watching, cancel));
        make(&Prepared { world, layers: &layers, manifest: manifest.clone(), threads, label }, &rendered)
    }
}

struct Prepared<'a> {
    world: &'a World,
    layers: &'a steradian_render::Layers,
    manifest: Metadata,
    threads: usize,
    label: Label<'a>,
}

/// The words of a part.
fn part_words(words: &[String]) -> Result<RenderArgs, Trouble> {
    let args = parse(words)?;
    if args.keep.shard.is_none() {
        return Err(Trouble::Input("a part needs --shard I/N".into()));
    }
    if args.stop.is_open_ended() || args.stop.adaptive.is_some() {
        return Err(Trouble::Input("a part has a fixed number of samples: no --time, --error or --adaptive".into()));
    }
    Ok(args)
}

fn reports(outcome: &LoadOutcome) -> Vec<Report> {
    let of = |d: &steradian_syntax::Diagnostic| {
        let at = d.span.and_then(|span| {
            let source = outcome.sources.get(span.file)?;
            Some((source.name.clone(), source.location(span.start)))
        });
        Report {
            severity: match d.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
                Severity::Note => "note",
            },
            message: d.message.clone(),
            file: at.as_ref().map(|(name, _)| name.clone()),
            line: at.as_ref().map(|(_, at)| at.line),
            column: at.as_ref().map(|(_, at)| at.column),
            hint: d.hint.clone(),
            text: d.render(&outcome.sources),
        }
    };
    outcome.diagnostics.iter().map(of).collect()
}
