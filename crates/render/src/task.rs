//! What a render is asked to do, and who watches it.

use crate::error_goal::ErrorGoal;
use crate::film::{Film, Tile};
use crate::layers::Layers;
use crate::share::Share;
use crate::snapshot::{Label, Snapshot};
use std::time::Duration;
use steradian_scene::World;

/// How long and with what to render.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Samples per pixel, at most: of every pixel, or on average where [`Goals::adaptive`] spreads them.
    pub spp: u32,
    /// Threads; at least one.
    pub threads: usize,
    /// Stop after this time, at the end of a pass. Time spent before a resumption counts.
    pub time_limit: Option<Duration>,
}

/// More samples per pixel than anybody waits for: stands for no limit.
pub const ENDLESS_SPP: u32 = 1 << 24;

/// What decides where more samples are taken than elsewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adaptive {
    /// Nothing.
    #[default]
    No,
    /// The error that the samples tell, measured again and again. Samples that have decided are kept: the bias falls like the
    /// reciprocal of their number, faster than the error.
    Error,
    /// The contrast between the first samples of a pixel and of its neighbours, once ([`crate::contrast`]). Samples that have decided are
    /// thrown away, so that there is no bias.
    Contrast,
}

/// What else decides which samples are taken.
#[derive(Clone, Debug, Default)]
pub struct Goals {
    /// Stop when the picture is this good.
    pub error: Option<ErrorGoal>,
    /// What decides where more samples are taken; whole shares only.
    pub adaptive: Adaptive,
    /// The part to render.
    pub share: Share,
}

impl Goals {
    /// What decides; nothing does where a part of the picture is rendered, which knows nothing of the others.
    pub(crate) fn criterion(&self) -> Adaptive {
        if self.share == Share::Whole { self.adaptive } else { Adaptive::No }
    }
}

/// A render to start or to go on with.
pub struct Task<'a> {
    /// The scene.
    pub world: &'a World,
    /// How long and with what.
    pub plan: Plan,
    /// What else.
    pub goals: Goals,
    /// What to keep beside the picture.
    pub layers: &'a Layers,
    /// What checkpoints say they are of.
    pub label: Label<'a>,
    /// Where to go on, if not at the start: a snapshot of the same scene, settings and goals.
    pub resume: Option<Snapshot>,
}

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Finished,
    /// The picture is as good as was asked for.
    ErrorReached,
    /// The time was up.
    TimeLimit,
    /// Somebody asked to stop.
    Interrupted,
}

/// How far rendering has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples per pixel taken (on average, where they differ), and to take; [`ENDLESS_SPP`] where there is no plan.
    pub spp: [u32; 2],
    /// Fraction done, including the current pass, by whichever limit is nearest.
    pub fraction: f64,
    /// Rays traced in this run.
    pub rays: u64,
    /// Time since the start of this run.
    pub elapsed: Duration,
    /// The bound for which the statement of the error goal would hold if this were the only look, or that of
    /// [`ErrorGoal::linear`] without a goal; known after the second sample.
    pub error: Option<f64>,
    /// The bound for which the error goal's statement held at the last look.
    pub bound: Option<f64>,
}

/// Watches a render.
pub trait Observer: Sync {
    /// Called now and then from one thread at a time.
    fn progress(&self, _progress: &Progress) {}
    /// Called by its thread when a tile has all samples of a pass.
    fn tile(&self, _tile: &Tile) {}
    /// Called at the end of each pass with the film as it stands.
    fn pass(&self, _film: &Film, _progress: &Progress) {}
    /// Whether a checkpoint is due. Asked after every tile, so it had better be quick.
    fn checkpoint_due(&self) -> bool {
        false
    }
    /// Takes a checkpoint: the bytes of a [`Snapshot`], and how long it took to make them.
    fn checkpoint(&self, _bytes: Vec<u8>, _took: Duration) {}
}

/// Watches nothing.
pub struct Quiet;

impl Observer for Quiet {}
