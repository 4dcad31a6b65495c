//! pbrt-v4 scene text to `Scene`: directives in order, one graphics state, names resolved at the end.

mod ahead;
mod curves;
mod directives;
mod images;
mod lens;
mod lights;
mod materials;
mod media;
mod names;
mod params;
mod settings;
mod shapes;
mod spectra;
mod state;
mod textures;
mod traps;
mod upgrade;
mod world;

pub(crate) use curves::b_spline;

use crate::files::{FileAccess, read_all};
use images::LoadedImage;
use materials::PendingMaterial;
use names::Names;
use settings::Declarations;
use state::{State, Transforms};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, mpsc};
use steradian_bsdf::MeasuredMaterial;
use steradian_scene::{Handle, Material, Medium, Object, Scene};
use steradian_spectrum::{Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Directive, FileId, Parser, Severity, SourceMap, Span, pieces};

/// Limits and overrides of a load.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// The most memory that the film's pixels may take, in bytes. A scene that asks for more is refused.
    pub max_film_bytes: u64,
    /// How deep files may include each other.
    pub max_include_depth: usize,
    /// What is said about a model that its file does not say.
    pub model: crate::ModelOptions,
    /// Whether to note what is allowed in pbrt scenes and often not what was meant.
    pub traps: bool,
}

impl Default for LoadOptions {
    fn default() -> LoadOptions {
        LoadOptions {
            max_film_bytes: 64 << 30,
            max_include_depth: 64,
            model: crate::ModelOptions::default(),
            traps: false,
        }
    }
}

/// Where the scene's text is.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A file; other files are looked for next to it.
    File(&'a Path),
    /// A text that is already here, such as standard input.
    Text {
        /// The name to show in messages.
        name: &'a str,
        /// The text.
        text: &'a str,
        /// Where other files are looked for.
        directory: &'a Path,
    },
}

/// What came of a load.
#[derive(Debug)]
pub struct LoadOutcome {
    /// The scene; `None` when there are errors.
    pub scene: Option<Scene>,
    /// All texts that were read, for [`Diagnostic::render`].
    pub sources: SourceMap,
    /// All problems, in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
    /// What of its format a file uses, by name and how often: extensions of glTF, plugins of Mitsuba.
    pub uses: BTreeMap<String, u64>,
}

impl LoadOutcome {
    /// Number of errors.
    pub fn errors(&self) -> usize {
        self.diagnostics.iter().filter(|d| d.severity == Severity::Error).count()
    }
}

/// Reads a pbrt-v4 scene. Never fails as a whole: all problems are in the outcome, and there is a scene if none is an error.
pub fn load_pbrt(input: Input, files: &dyn FileAccess, options: &LoadOptions) -> LoadOutcome {
    let base = match input {
        Input::File(path) => path.parent().unwrap_or(Path::new("")),
        Input::Text { directory, .. } => directory,
    };
    let mut loader = Loader::new(files, options, base.to_path_buf());
    match input {
        Input::File(path) => loader.top_file(path),
        Input::Text { name, text, .. } => {
            let file = loader.sources.add(name, text);
            loader.run(file);
        }
    }
    loader.finish()
}

/// A text of any size is fine, but no tower of small files that include each other many times over.
const MOST_INCLUDES: usize = 100_000;

/// Nobody reads more than this many reports, and each costs a pass over the text.
const MOST_DIAGNOSTICS: usize = 500;

/// Texts above twice this size are parsed in pieces of it, at the same time.
const PIECE: usize = 1 << 20;

/// Blocks this deep are a mistake or an attack; each keeps a copy of the state.
const MOST_BLOCKS: usize = 10_000;

/// What a block must be closed by.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Block {
    Attribute,
    Transform,
    Object,
}

impl Block {
    fn name(self) -> &'static str {
        match self {
            Block::Attribute => "Attribute",
            Block::Transform => "Transform",
            Block::Object => "Object",
        }
    }
}

/// Everything that a load carries along.
struct Loader<'a> {
    files: &'a dyn FileAccess,
    options: &'a LoadOptions,
    /// The folder of the top-level file.
    base: PathBuf,
    sources: SourceMap,
    diagnostics: Vec<Diagnostic>,
    scene: Scene,
    state: State,
    blocks: Vec<(Block, Span, State)>,
    coordinate_systems: BTreeMap<String, Transforms>,
    /// Where `WorldBegin` is, once it was read.
    world: Option<Span>,
    declarations: Declarations,
    /// The object that shapes go to, between `ObjectBegin` and `ObjectEnd`.
    object: Option<Handle<Object>>,
    materials: Names<Material>,
    media: Names<Medium>,
    objects: Names<Object>,
    textures: textures::Textures,
    pending_materials: Vec<PendingMaterial>,
    /// Shapes that emit, and where their light is declared.
    emitters: Vec<(Option<Handle<Object>>, usize, Span)>,
    spectrum_files: BTreeMap<(String, UseKey), Spectrum>,
    images: Vec<LoadedImage>,
    measured: BTreeMap<String, Handle<MeasuredMaterial>>,
    /// The files that are being read, outermost first.
    including: Vec<(PathBuf, FileId)>,
    included: BTreeMap<PathBuf, FileId>,
    includes: usize,
    ahead: ahead::Ahead,
    /// Where a medium is first put to use.
    media_span: Option<Span>,
    /// Whether the scene is one of pbrt-v3.
    is_v3: bool,
    /// Warnings that were given and need no repetition.
    said: BTreeSet<String>,
}

/// A directive with the problems before it; the last one is none.
type Parsed = (Vec<Diagnostic>, Option<Directive>);

/// What a parser reads.
fn read_all_of(mut parser: Parser<'_>) -> Vec<Parsed> {
    let mut read = Vec::new();
    loop {
        let next = parser.next_directive();
        let is_last = next.is_none();
        read.push((parser.take_diagnostics(), next));
        if is_last {
            return read;
        }
    }
}

/// `SpectrumUse` as a key of an ordered map.
type UseKey = u8;

fn use_key(usage: SpectrumUse) -> UseKey {
    match usage {
        SpectrumUse::Albedo => 0,
        SpectrumUse::Unbounded => 1,
        SpectrumUse::Illuminant => 2,
    }
}

impl<'a> Loader<'a> {
    fn new(files: &'a dyn FileAccess, options: &'a LoadOptions, base: PathBuf) -> Loader<'a> {
        let mut scene = Scene::new(settings::default_settings());
        let default_material = materials::push_default(&mut scene);
        Loader {
            files,
            options,
            base,
            sources: SourceMap::new(),
            diagnostics: Vec::new(),
            scene,
            state: State::new(default_material),
            blocks: Vec::new(),
            coordinate_systems: BTreeMap::new(),
            world: None,
            declarations: Declarations::default(),
            object: None,
            materials: Names::default(),
            media: Names::default(),
            objects: Names::default(),
            textures: textures::Textures::default(),
            pending_materials: Vec::new(),
            emitters: Vec::new(),
            spectrum_files: BTreeMap::new(),
            images: Vec::new(),
            measured: BTreeMap::new(),
            including: Vec::new(),
            included: BTreeMap::new(),
            includes: 0,
            ahead: ahead::Ahead::default(),
            media_span: None,
            is_v3: false,
            said: BTreeSet::new(),
        }
    }

    fn error(&mut self, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::error(message, span));
    }

    /// A warning that is not repeated for every shape of a scene.
    fn warning_once(&mut self, message: &str, span: Span) {
        if self.said.insert(message.to_string()) {
            self.warning(message, span);
        }
    }

    fn warning(&mut self, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::warning(message, span));
    }

    /// The path that a name in the scene stands for: as it is if absolute, else next to the top-level scene file, else, if
    /// there is nothing there, relative to the working directory.
    fn resolve(&self, name: &str) -> PathBuf {
        let path = Path::new(name);
        let beside = self.base.join(path);
        if path.is_absolute() || self.files.exists(&beside) || !self.files.exists(path) {
            beside
        } else {
            path.to_path_buf()
        }
    }

    fn top_file(&mut self, path: &Path) {
        match self.open(path) {
            Ok(file) => {
                self.including.push((normal(path), file));
                self.run(file);
                self.including.pop();
            }
            Err(message) => self.diagnostics.push(Diagnostic::error(message, None)),
        }
    }

    /// Reads a text into the source map, or finds it there.
    fn open(&mut self, path: &Path) -> Result<FileId, String> {
        if let Some(&file) = self.included.get(&normal(path)) {
            return Ok(file);
        }
        let bytes = read_all(self.files, path)?;
        let at = |what: String| format!("{}: {what}", path.display());
        if bytes.len() > u32::MAX as usize {
            return Err(at("text files above 4 GiB are not supported".into()));
        }
        if bytes.starts_with(&[0xfe, 0xff]) || bytes.starts_with(&[0xff, 0xfe]) {
            return Err(at("UTF-16 text; save it as UTF-8".into()));
        }
        let text = String::from_utf8(bytes).map_err(|e| {
            at(format!("not UTF-8 text (byte {} is not part of a character)", e.utf8_error().valid_up_to()))
        })?;
        let file = self.sources.add(path.display().to_string(), text);
        self.included.insert(normal(path), file);
        Ok(file)
    }

    fn run(&mut self, file: FileId) {
        let Some(text) = self.sources.get(file).map(|s| Arc::clone(&s.text)) else { return };
        if file == FileId(0) && upgrade::is_v3(&text) {
            self.is_v3 = true;
            let note = "a scene of pbrt-v3, by its `WorldEnd`: its names are read as pbrt-v4 calls them";
            self.diagnostics.push(Diagnostic::note(note, None));
        }
        if text.len() > 2 * PIECE && rayon::current_thread_index().is_none() {
            self.run_in_pieces(file, &text);
            return;
        }
        if let Some(read) = self.parsed_ahead(file) {
            self.obey_all(read);
            return;
        }
        self.look_ahead(file, &text);
        let mut parser = Parser::new(file, &text).accepting_v3(self.is_v3);
        loop {
            let next = parser.next_directive();
            self.diagnostics.append(&mut parser.take_diagnostics());
            let Some(directive) = next else { return };
            self.obey(directive);
        }
    }

    fn obey_all(&mut self, read: Vec<Parsed>) {
        for (mut problems, directive) in read {
            self.diagnostics.append(&mut problems);
            directive.into_iter().for_each(|d| self.obey(d));
        }
    }

    fn obey(&mut self, mut directive: Directive) {
        if self.is_v3 {
            self.upgrade(&mut directive);
        }
        names::normalize(&mut directive);
        self.directive(directive);
    }

    /// Parses a long text on all threads, and does what it says meanwhile, in its order. Never from one of those threads, which
    /// must not wait for each other.
    fn run_in_pieces(&mut self, file: FileId, text: &str) {
        let pieces = pieces(text, PIECE);
        let is_v3 = self.is_v3;
        let (send, receive) = mpsc::channel();
        rayon::in_place_scope(|scope| {
            let start = |i: usize| {
                let (send, piece) = (send.clone(), pieces.get(i).cloned());
                scope.spawn(move |_| {
                    let Some(piece) = piece else { return };
                    let parser = Parser::of_piece(file, text, piece).accepting_v3(is_v3);
                    let read = catch_unwind(AssertUnwindSafe(|| read_all_of(parser)));
                    // Whoever listens waits for every piece, unless it panics.
                    let _ = send.send((i, read));
                });
            };
            // Few pieces at a time, so that a text is never held twice.
            let ahead = 2 * rayon::current_num_threads();
            (0..ahead.min(pieces.len())).for_each(start);
            let mut ready = BTreeMap::new();
            for i in 0..pieces.len() {
                while !ready.contains_key(&i) {
                    let Ok((k, read)) = receive.recv() else { return };
                    ready.insert(k, read);
                }
                start(i + ahead);
                let read = match ready.remove(&i) {
                    Some(Err(bug)) => resume_unwind(bug),
                    Some(Ok(read)) => read,
                    None => Vec::new(),
                };
                self.obey_all(read);
            }
        });
    }

    /// `Include` and `Import`: the directives of another file. What an imported file does to the state stays inside it.
    fn include(&mut self, d: &Directive, import: bool) {
        let span = d.arg_span(0);
        let path = self.resolve(d.text(0));
        if let Some(at) = self.including.iter().position(|(p, _)| *p == normal(&path)) {
            let chain: Vec<String> = self.including[at..].iter().map(|(p, _)| p.display().to_string()).collect();
            let message = format!("recursive {}: {} includes itself", d.kind.name(), path.display());
            let mut diagnostic = Diagnostic::error(message, span);
            if chain.len() > 1 {
                diagnostic = diagnostic.with_hint(format!("by way of {}", chain[1..].join(", ")));
            }
            self.diagnostics.push(diagnostic);
            return;
        }
        self.includes += 1;
        if self.including.len() >= self.options.max_include_depth || self.includes > MOST_INCLUDES {
            let message = if self.includes > MOST_INCLUDES {
                format!("more than {MOST_INCLUDES} files are included")
            } else {
                format!("files include each other more than {} deep", self.options.max_include_depth)
            };
            // Once is enough: an explosion of includes would say so at every one of them.
            if !self.diagnostics.iter().any(|d| d.message == message) {
                self.error(message, span);
            }
            return;
        }
        let file = match self.open(&path) {
            Ok(file) => file,
            Err(message) => {
                self.error(message, span);
                return;
            }
        };
        self.including.push((normal(&path), file));
        if import {
            let (state, depth) = (self.state.clone(), self.blocks.len());
            let systems = self.coordinate_systems.clone();
            self.run(file);
            self.close_blocks(depth);
            self.state = state;
            self.coordinate_systems = systems;
        } else {
            self.run(file);
        }
        self.including.pop();
    }

    /// Reports and drops the blocks that are open beyond `depth`.
    fn close_blocks(&mut self, depth: usize) {
        while self.blocks.len() > depth {
            let Some((block, span, state)) = self.blocks.pop() else { return };
            let name = block.name();
            self.diagnostics.push(
                Diagnostic::error(format!("`{name}Begin` is not closed"), span).with_hint(format!("add `{name}End`")),
            );
            if block == Block::Object {
                self.object = None;
            }
            self.state = state;
        }
    }

    fn finish(mut self) -> LoadOutcome {
        self.close_blocks(0);
        let failed_to_open = self.sources.iter().next().is_none();
        if self.world.is_none() && !failed_to_open {
            let end = self.sources.get(FileId(0)).map_or(0, |s| s.text.trim_end().len());
            let span = Span::new(FileId(0), end, end);
            self.diagnostics.push(
                Diagnostic::error("the scene has no `WorldBegin`", span)
                    .with_hint("camera, film and the like come before it, shapes and lights after it"),
            );
        }
        if !failed_to_open {
            self.build_settings();
            self.finish_world();
        }
        let failed = self.diagnostics.iter().any(|d| d.severity == Severity::Error);
        let mut seen = BTreeSet::new();
        let place = |d: &Diagnostic| d.span.map(|s| (s.file, s.start, s.end));
        self.diagnostics.retain(|d| seen.insert((place(d), d.message.clone())));
        if self.diagnostics.len() > MOST_DIAGNOSTICS {
            // What stops the load comes first.
            self.diagnostics.sort_by_key(|d| d.severity);
            let rest = self.diagnostics.len() - MOST_DIAGNOSTICS;
            self.diagnostics.truncate(MOST_DIAGNOSTICS);
            self.diagnostics.push(Diagnostic::note(format!("{rest} more problems are not shown"), None));
        }
        LoadOutcome {
            scene: (!failed).then_some(self.scene),
            sources: self.sources,
            diagnostics: self.diagnostics,
            uses: BTreeMap::new(),
        }
    }
}

/// A path without `.` and, where that is safe to say without looking at the disk, without `..`.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => _ = out.pop(),
            part => out.push(part),
        }
    }
    out
}
