//! Everything that goes on beside a render: progress, checkpoints, the preview.

use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use steradian_image::Metadata;
use steradian_render::{Film, Observer, Progress, Tile};

use crate::args::RenderArgs;
use crate::console::Console;
use crate::keep::Keeper;
use crate::output::{self, Outputs};
use crate::progress::Display;
use crate::sampler_error::SamplerError;
use crate::tev::Tev;

/// The observer of a render that a person or a program has asked for.
pub(crate) struct Watch<'a> {
    /// Progress.
    pub display: Display,
    /// Checkpoints.
    pub keeper: Option<Keeper>,
    /// Whether pixels are numbers that no exposure may change.
    pub raw: bool,
    /// How far the sampler is from what is known, where that is measured.
    pub sampler_error: Option<SamplerError>,
    preview: Option<Preview>,
    tev: Option<Tev>,
    outputs: &'a Outputs,
    manifest: &'a Metadata,
    console: Console,
}

struct Preview {
    path: PathBuf,
    /// When to write next; none once it could not be written.
    next: Mutex<Option<Instant>>,
}

impl<'a> Watch<'a> {
    /// As the command line asks.
    pub fn new(
        display: Display,
        args: &RenderArgs,
        outputs: &'a Outputs,
        manifest: &'a Metadata,
        raw: bool,
        viewer: Option<TcpStream>,
        console: &Console,
    ) -> Self {
        let tev = viewer.map(|stream| Tev::start(stream, &name(outputs), manifest));
        let preview = args.run.preview.clone();
        let preview = preview.map(|path| Preview { path, next: Mutex::new(Some(Instant::now())) });
        let keeper = Keeper::new(&args.keep);
        Self { display, keeper, raw, sampler_error: None, preview, tev, outputs, manifest, console: *console }
    }

    /// The last word to whoever watches.
    pub fn finish(&self, film: &Film) {
        self.display.finish();
        if let Some(tev) = &self.tev {
            tev.finish(film);
            self.report_tev(tev);
        }
    }

    fn report_tev(&self, tev: &Tev) {
        if let Some(what) = tev.take_failure() {
            self.console.warning(format_args!("{what}; rendering goes on without it"));
        }
    }

    fn show(&self, film: &Film, preview: &Preview) {
        /// At least so long between two pictures, and so many times what one takes to write.
        const PAUSE: (Duration, u32) = (Duration::from_secs(1), 30);
        let Ok(mut next) = preview.next.lock() else { return };
        let start = Instant::now();
        if next.is_none_or(|next| start < next) {
            return;
        }
        let Some(picture) = output::unfinished(film, self.manifest) else { return };
        *next = match self.outputs.write_preview(&preview.path, &picture, self.raw) {
            None => Some(Instant::now() + PAUSE.0.max(start.elapsed() * PAUSE.1)),
            Some(what) => {
                self.console.warning(format_args!("{what}; there will be no preview"));
                None
            }
        };
    }
}

/// What a viewer calls the picture.
fn name(outputs: &Outputs) -> String {
    let file = outputs.pictures.first().and_then(|p| p.file_name());
    file.map_or("steradian".into(), |n| n.to_string_lossy().into_owned())
}

impl Observer for Watch<'_> {
    fn progress(&self, progress: &Progress) {
        self.display.progress(progress);
        if let Some(what) = self.keeper.as_ref().and_then(Keeper::take_failure) {
            self.console.warning(format_args!("{what}; rendering goes on without this checkpoint"));
        }
    }

    fn tile(&self, tile: &Tile) {
        if let Some(tev) = &self.tev {
            tev.tile(tile);
        }
    }

    fn pass(&self, film: &Film, progress: &Progress) {
        self.display.progress(progress);
        self.sampler_error.iter().for_each(|e| e.measure(film));
        if let Some(tev) = &self.tev {
            tev.pass(film);
            self.report_tev(tev);
        }
        if let Some(preview) = &self.preview {
            self.show(film, preview);
        }
    }

    fn checkpoint_due(&self) -> bool {
        self.keeper.as_ref().is_some_and(Keeper::is_due)
    }

    fn checkpoint(&self, bytes: Vec<u8>, took: Duration) {
        if let Some(keeper) = &self.keeper {
            keeper.write(bytes, took);
        }
    }
}
