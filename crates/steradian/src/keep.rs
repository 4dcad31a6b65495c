//! Nothing that was rendered is lost: checkpoints, going on with them, and the parts of a distributed render.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use clap::{Args, ValueHint};
use steradian_image::write_bytes_atomically;
use steradian_render::{Adaptive, Error, Film, Identity, Layers, Share, Snapshot};
use steradian_sampling::Sampler;
use steradian_scene::{IntegratorKind, RenderSettings};

use crate::failure::{Failure, reason};
use crate::numbers::{ShardArg, Span};
use crate::{output, overrides};

/// The options.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Long and distributed renders")]
pub(crate) struct KeepArgs {
    /// Keep what has been rendered in FILE, every now and then and at the end; it must not exist yet, unless --resume is given
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub checkpoint: Option<PathBuf>,

    /// How often to write the checkpoint; less often where that would cost more than a hundredth of the time
    #[arg(long, value_name = "TIME", default_value = "60s", requires = "checkpoint")]
    pub checkpoint_every: Span,

    /// Go on where the checkpoint ends, or start if there is none; more --spp continue a finished render
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// Render part I of N, from 1, into -o FILE.part; `steradian merge` joins the parts to the bits of the whole
    #[arg(long, value_name = "I/N")]
    pub shard: Option<ShardArg>,
}

/// The extension of parts.
pub(crate) const PART: &str = "part";

/// Whether a file is, or is to be, a part of a distributed render.
pub(crate) fn is_part(path: &Path) -> bool {
    path.extension() == Some(OsStr::new(PART))
}

/// What makes two renders one and the same but for how long they run.
pub(crate) fn identity(
    settings: &RenderSettings,
    scene_hash: &str,
    adaptive: Adaptive,
    share: Share,
    layers: &Layers,
) -> Identity {
    let film = &settings.film;
    let sampler = &settings.sampler;
    let mut rest = settings.clone();
    // These have entries of their own, or decide nothing of the picture.
    rest.film.filename = String::new();
    rest.film.half = false;
    rest.sampler.spp = 0;
    rest.sampler.seed = 0;
    // Most samplers' points do not depend on how many were planned.
    let points = if Sampler::new(sampler).prefix_independent_of_spp() { "any".into() } else { sampler.spp.to_string() };
    let named = [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("scene", scene_hash.to_owned()),
        ("size", film.resolution.map(|n| n.to_string()).join("x")),
        ("pixels", film.pixel_bounds.map(|n| n.to_string()).join(",")),
        ("seed", sampler.seed.to_string()),
        ("sampler", sampler.kind.name().to_owned()),
        ("sampler-spp", points),
        ("integrator", overrides::integrator_name(settings.integrator.kind).to_owned()),
        ("max-depth", settings.integrator.max_depth.to_string()),
        ("color", overrides::color_name(settings.color).to_owned()),
        ("adaptive", adaptive_name(adaptive).to_owned()),
        ("share", share_name(share)),
        (LAYERS, if layers.is_empty() { "none".into() } else { layers.names().join(" ") }),
    ];
    named.into_iter().map(|(name, value)| (name.to_owned(), value)).chain(fields(&rest)).collect()
}

/// Each field of the settings by its path, as in `integrator.regularize`; long values by their hash.
fn fields(settings: &RenderSettings) -> BTreeMap<String, String> {
    const LONGEST: usize = 60;
    // These are entries already.
    const NAMED: [&str; 5] =
        ["film.resolution", "film.pixel_bounds", "sampler.kind", "sampler.resolution", "integrator.max_depth"];
    let mut path: Vec<(usize, &str)> = Vec::new();
    let mut values = BTreeMap::<String, String>::new();
    let text = format!("{settings:#?}");
    for line in text.lines().skip(1) {
        let word = line.trim_start();
        let depth = line.len() - word.len();
        path.retain(|(d, _)| *d < depth);
        let (name, value) = word.split_once(": ").unwrap_or(("", word));
        if !name.is_empty() {
            path.push((depth, name));
        }
        let brackets = |c: char| "[](){},".contains(c) || c.is_whitespace();
        let value = value.trim_matches(brackets);
        if !value.is_empty() {
            let name = path.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(".");
            let all = values.entry(name).or_default();
            *all += if all.is_empty() { "" } else { " " };
            *all += value;
        }
    }
    // Tables of filters follow from their kind.
    values.retain(|name, _| !NAMED.contains(&name.as_str()) && !name.starts_with("filter.tables"));
    for value in values.values_mut().filter(|v| v.len() > LONGEST) {
        *value = blake3::hash(value.as_bytes()).to_hex()[..32].to_owned();
    }
    values
}

/// The entry that says what is kept beside the picture.
const LAYERS: &str = "kept beside the picture";

/// The names of a stored render's layers.
pub(crate) fn layer_names(identity: &Identity) -> Vec<String> {
    let names = identity.get(LAYERS).filter(|n| *n != "none");
    names.map(|n| n.split(' ').map(str::to_owned).collect()).unwrap_or_default()
}

fn adaptive_name(adaptive: Adaptive) -> &'static str {
    match adaptive {
        Adaptive::No => "false",
        Adaptive::Error => "true",
        Adaptive::Contrast => "contrast",
    }
}

/// `2/8 by tiles`.
pub(crate) fn share_name(share: Share) -> String {
    match share {
        Share::Whole => "whole".into(),
        Share::Tiles(p) => format!("{}/{} by tiles", p.index + 1, p.count),
        Share::Samples(p) => format!("{}/{} by samples", p.index + 1, p.count),
        Share::Blocks { part: p, .. } => format!("{}/{} by tiles and samples", p.index + 1, p.count),
    }
}

/// The share that `--shard` asks for.
pub(crate) fn share(shard: Option<ShardArg>, settings: &RenderSettings) -> Share {
    match (shard, settings.integrator.kind) {
        (None, _) => Share::Whole,
        // Whoever has a pixel's iteration sends out all its photons.
        (Some(s), IntegratorKind::Sppm(_)) => Share::Samples(s.0),
        (Some(s), _) => Share::of(&Film::new(settings.film.pixel_bounds), s.0),
    }
}

/// Reads a stored render.
pub(crate) fn read(path: &Path) -> Result<Snapshot, Failure> {
    let name = path.display();
    let bytes = std::fs::read(path).map_err(|e| Failure::Environment(format!("cannot read {name}: {}", reason(&e))))?;
    Snapshot::decode(&bytes).map_err(|e| Failure::Input(format!("{name}: {e}")))
}

/// The checkpoint to go on from, if there is one; refuses to overwrite one that nobody spoke of.
pub(crate) fn open(args: &KeepArgs) -> Result<Option<Snapshot>, Failure> {
    let Some(path) = &args.checkpoint else { return Ok(None) };
    let name = path.display();
    if is_part(path) {
        return Err(Failure::Input(format!("{name}: a checkpoint needs another name than the part that it leads to")));
    }
    output::check(path)?;
    match (path.try_exists(), args.resume) {
        (Ok(true), true) => read(path).map(Some),
        (Ok(true), false) => Err(Failure::Input(format!(
            "{name}: there is a checkpoint already; --resume goes on from it, another name starts anew"
        ))),
        (Ok(false), _) => Ok(None),
        (Err(e), _) => Err(Failure::Environment(format!("cannot read {name}: {}", reason(&e)))),
    }
}

/// Refuses a checkpoint of another render, with everything that differs.
pub(crate) fn check(path: &Path, snapshot: &Snapshot, wanted: &Identity) -> Result<(), Failure> {
    snapshot.check(wanted).map_err(|e| match e {
        Error::Foreign(differences) => {
            let list = differences.iter().map(|d| format!("\n  {d}")).collect::<String>();
            Failure::Input(format!("{}: a checkpoint of another render{list}", path.display()))
        }
        other => Failure::Input(format!("{}: {other}", path.display())),
    })
}

/// Writes checkpoints beside the rendering threads.
pub(crate) struct Keeper {
    path: PathBuf,
    every: Duration,
    start: Instant,
    /// Milliseconds after `start`.
    due: AtomicU64,
    writing: Mutex<Option<JoinHandle<Result<(), String>>>>,
    failure: Mutex<Option<String>>,
    store: Store,
}

/// How bytes come to a file.
type Store = fn(&Path, &[u8]) -> Result<(), String>;

impl Keeper {
    /// Writes to the checkpoint of `args`, if it names one.
    pub fn new(args: &KeepArgs) -> Option<Keeper> {
        let path = args.checkpoint.clone()?;
        let every = args.checkpoint_every.0;
        Some(Keeper {
            path,
            every,
            start: Instant::now(),
            due: AtomicU64::new(every.as_millis() as u64),
            writing: Mutex::new(None),
            failure: Mutex::new(None),
            store,
        })
    }

    /// Whether it is time, and the last one is on disk: a slow disk keeps nobody waiting.
    pub fn is_due(&self) -> bool {
        self.start.elapsed().as_millis() as u64 >= self.due.load(Ordering::Relaxed)
            && self.writing.try_lock().is_ok_and(|w| w.as_ref().is_none_or(JoinHandle::is_finished))
    }

    /// Writes in the background.
    pub fn write(&self, bytes: Vec<u8>, took: Duration) {
        /// Making checkpoints takes less than this share of a thread's time.
        const SHARE: u32 = 100;
        self.wait();
        let (path, store) = (self.path.clone(), self.store);
        let write = move || store(&path, &bytes);
        *self.writing.lock().unwrap_or_else(PoisonError::into_inner) = Some(std::thread::spawn(write));
        let pause = self.every.max(took.saturating_mul(SHARE));
        self.due.store((self.start.elapsed() + pause).as_millis() as u64, Ordering::Relaxed);
    }

    /// Until the last checkpoint is on disk.
    fn wait(&self) {
        let last = self.writing.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(Ok(Err(what))) = last.map(JoinHandle::join) {
            *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(what);
        }
    }

    /// Writes the last one; the error of any if that did not go well.
    pub fn finish(&self, bytes: &[u8]) -> Result<(), String> {
        self.wait();
        (self.store)(&self.path, bytes)
    }

    /// Why a checkpoint could not be written, once.
    pub fn take_failure(&self) -> Option<String> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Writes a stored render.
pub(crate) fn store(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write_bytes_atomically(path, bytes).map_err(|e| said(path, e))
}

fn said(path: &Path, error: steradian_image::Error) -> String {
    match error {
        steradian_image::Error::Io { source, .. } => format!("cannot write {}: {}", path.display(), reason(&source)),
        other => format!("cannot write {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOW: Duration = Duration::from_millis(400);

    /// A disk that takes its time.
    fn slowly(path: &Path, bytes: &[u8]) -> Result<(), String> {
        std::thread::sleep(SLOW);
        store(path, bytes)
    }

    #[test]
    fn a_slow_disk_keeps_nobody_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let args = KeepArgs {
            checkpoint: Some(folder.path().join("c")),
            checkpoint_every: Span(Duration::ZERO),
            ..KeepArgs::default()
        };
        let keeper = Keeper { store: slowly, ..Keeper::new(&args).unwrap() };
        let (start, mut writes, mut longest) = (Instant::now(), 0, Duration::ZERO);
        while writes < 3 && start.elapsed() < 100 * SLOW {
            if keeper.is_due() {
                let before = Instant::now();
                keeper.write(vec![writes; 1 << 16], Duration::ZERO);
                longest = longest.max(before.elapsed());
                writes += 1;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(writes == 3 && start.elapsed() >= 2 * SLOW, "one after the other: {writes} in {:?}", start.elapsed());
        assert!(longest < SLOW, "{longest:?}");
        keeper.finish(b"the last").unwrap();
        assert_eq!(std::fs::read(folder.path().join("c")).unwrap(), b"the last");
    }
}
