//! The render loop: passes over tiles on all threads, progress, stopping, and what went wrong.

use crate::film::{Film, Tile};
use crate::sample::PixelSampler;
use crate::sums::{PixelStack, PixelSum};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use steradian_integrator::record::{Count, Counters, RayCounts};
use steradian_sampling::Sampler;
use steradian_scene::World;

/// How long and with what to render.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Samples per pixel.
    pub spp: u32,
    /// Threads; at least one.
    pub threads: usize,
    /// Stop after this time, at the end of a pass.
    pub time_limit: Option<Duration>,
}

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Finished,
    /// The time was up.
    TimeLimit,
    /// Somebody asked to stop.
    Interrupted,
}

/// What is wrong with one sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The radiance is NaN or infinite; it counts as black.
    NotFinite,
    /// The code broke one of its own rules; the sample counts as black.
    Panic(String),
}

/// A sample that went wrong, with what is needed to replay it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadSample {
    /// The pixel, in the full image.
    pub pixel: [u32; 2],
    /// The index of the sample.
    pub sample: u32,
    /// What happened.
    pub fault: Fault,
}

/// How far rendering has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples per pixel taken, and to take.
    pub spp: [u32; 2],
    /// Fraction done, including the current pass.
    pub fraction: f64,
    /// Rays traced.
    pub rays: u64,
    /// Time since the start.
    pub elapsed: Duration,
    /// See [`Film::relative_error`]; known after the second sample.
    pub relative_error: Option<f32>,
}

/// Watches a render.
pub trait Observer: Sync {
    /// Called now and then from one thread at a time.
    fn progress(&self, _progress: &Progress) {}
    /// Called at the end of each pass with the film as it stands.
    fn pass(&self, _film: &Film, _progress: &Progress) {}
}

/// Watches nothing.
pub struct Quiet;

impl Observer for Quiet {}

/// What came out.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The sums.
    pub film: Film,
    /// Samples per pixel taken everywhere.
    pub spp: u32,
    /// Why it ended.
    pub outcome: Outcome,
    /// Rays by kind.
    pub rays: RayCounts,
    /// Wall-clock time.
    pub elapsed: Duration,
    /// The first samples that went wrong, in the order of pixels and samples.
    pub bad: Vec<BadSample>,
    /// How many went wrong in all.
    pub bad_count: u64,
}

/// So many bad samples are remembered.
const REMEMBERED: usize = 16;

/// Passes double up to this many samples: an interruption throws away one pass at most.
const LARGEST_PASS: u32 = 16;

/// Renders the world's film. The image depends on nothing in `plan` but `spp`.
pub fn render(world: &World, plan: &Plan, observer: &dyn Observer, cancel: &AtomicBool) -> Rendered {
    run::<RayCounts>(world, plan, observer, cancel).0
}

/// As [`render`], counting intersection tests and path lengths as well; slower, and the image is the same. The counts
/// are those of what was traced, an abandoned pass included.
pub fn render_counted(
    world: &World,
    plan: &Plan,
    observer: &dyn Observer,
    cancel: &AtomicBool,
) -> (Rendered, Counters) {
    run::<Counters>(world, plan, observer, cancel)
}

fn run<C: Count>(world: &World, plan: &Plan, observer: &dyn Observer, cancel: &AtomicBool) -> (Rendered, C) {
    let start = Instant::now();
    let sampler = PixelSampler::new(world);
    let mut film = Film::new(world.settings().film.pixel_bounds);
    let job = Job {
        sampler: &sampler,
        observer,
        cancel,
        start,
        done: AtomicUsize::new(0),
        tally: Mutex::new(Tally::<C>::default()),
        last_report: Mutex::new(start),
    };
    let mut taken = 0;
    let mut relative_error = None;
    let outcome = loop {
        if taken >= plan.spp {
            break Outcome::Finished;
        }
        if taken > 0 && plan.time_limit.is_some_and(|limit| start.elapsed() >= limit) {
            break Outcome::TimeLimit;
        }
        let end = (taken + taken.clamp(1, LARGEST_PASS)).min(plan.spp);
        let spp = [taken, plan.spp];
        if !job.pass(&mut film, spp, end, plan.threads, relative_error) {
            break Outcome::Interrupted;
        }
        taken = end;
        relative_error = film.relative_error();
        observer.pass(&film, &job.report([taken, plan.spp], 0.0, relative_error));
    };
    let tally = job.tally.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let rendered = Rendered {
        film,
        spp: taken,
        outcome,
        rays: tally.counts.rays(),
        elapsed: start.elapsed(),
        bad: tally.bad,
        bad_count: tally.bad_count,
    };
    (rendered, tally.counts)
}

#[derive(Default)]
struct Tally<C> {
    counts: C,
    bad: Vec<BadSample>,
    bad_count: u64,
}

impl<C> Tally<C> {
    fn remember(&mut self, mut bad: Vec<BadSample>, count: u64) {
        self.bad_count += count;
        self.bad.append(&mut bad);
        // By place, not by time: the report is the same for any number of threads as long as few are bad.
        self.bad.sort_by_key(|b| (b.sample, b.pixel[1], b.pixel[0]));
        self.bad.truncate(REMEMBERED);
    }
}

struct Job<'a, 'w, C> {
    sampler: &'a PixelSampler<'w>,
    observer: &'a dyn Observer,
    cancel: &'a AtomicBool,
    start: Instant,
    done: AtomicUsize,
    tally: Mutex<Tally<C>>,
    last_report: Mutex<Instant>,
}

impl<C: Count> Job<'_, '_, C> {
    fn report(&self, spp: [u32; 2], part: f64, relative_error: Option<f32>) -> Progress {
        let rays = self.tally.lock().map_or(0, |t| t.counts.rays().total());
        Progress {
            spp,
            fraction: ((f64::from(spp[0]) + part) / f64::from(spp[1].max(1))).min(1.0),
            rays,
            elapsed: self.start.elapsed(),
            relative_error,
        }
    }

    /// One pass over all tiles up to sample `end`. On cancellation during the first pass, tiles not reached stay empty;
    /// later passes are abandoned whole, so that every pixel keeps the same number of samples. Returns whether it was
    /// completed.
    fn pass(&self, film: &mut Film, spp: [u32; 2], end: u32, threads: usize, error: Option<f32>) -> bool {
        let backup = (spp[0] > 0).then(|| film.clone());
        let count = film.tiles.len();
        self.done.store(0, Ordering::Relaxed);
        {
            let tiles: Vec<Mutex<&mut Tile>> = film.tiles.iter_mut().map(Mutex::new).collect();
            let next = AtomicUsize::new(0);
            let work = || {
                let mut sampler = Sampler::new(&self.sampler.world.settings().sampler);
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= count || self.cancel.load(Ordering::Relaxed) {
                        return;
                    }
                    let mut tile = tiles[i].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    self.tile(&mut tile, end, &mut sampler);
                    let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
                    self.maybe_report(spp, f64::from(end - spp[0]) * done as f64 / count as f64, error);
                }
            };
            std::thread::scope(|scope| {
                for _ in 1..threads.max(1).min(count.max(1)) {
                    scope.spawn(work);
                }
                work();
            });
        }
        let complete = self.done.load(Ordering::Relaxed) == count;
        if !complete && let Some(backup) = backup {
            *film = backup;
        }
        complete
    }

    fn maybe_report(&self, spp: [u32; 2], part: f64, error: Option<f32>) {
        // Whoever finds the lock taken has nothing to add.
        if let Ok(mut last) = self.last_report.try_lock()
            && last.elapsed() >= Duration::from_millis(100)
        {
            *last = Instant::now();
            self.observer.progress(&self.report(spp, part, error));
        }
    }

    fn tile(&self, tile: &mut Tile, end: u32, sampler: &mut Sampler) {
        let mut counts = C::default();
        let (mut bad, mut bad_count) = (Vec::new(), 0);
        tile.extend(end, |pixel, range, stack| {
            let mut next = range.start;
            while next < range.end {
                let run = catch_unwind(AssertUnwindSafe(|| {
                    self.pixel(
                        pixel,
                        next..range.end,
                        &mut next,
                        sampler,
                        stack,
                        &mut counts,
                        &mut bad,
                        &mut bad_count,
                    );
                }));
                if let Err(payload) = run {
                    let sample = next;
                    bad_count += 1;
                    if bad.len() < REMEMBERED {
                        bad.push(BadSample { pixel, sample, fault: Fault::Panic(message(payload.as_ref())) });
                    }
                    stack.push(PixelSum::default());
                    next += 1;
                }
            }
        });
        let mut tally = self.tally.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        tally.counts.merge(&counts);
        if bad_count > 0 {
            tally.remember(bad, bad_count);
        }
    }

    fn pixel(
        &self,
        pixel: [u32; 2],
        range: std::ops::Range<u32>,
        next: &mut u32,
        sampler: &mut Sampler,
        stack: &mut PixelStack,
        counts: &mut C,
        bad: &mut Vec<BadSample>,
        bad_count: &mut u64,
    ) {
        for index in range {
            *next = index;
            let sampled = self.sampler.sample(sampler, pixel, index, counts);
            let sum = if sampled.rgb.iter().all(|v| v.is_finite()) {
                PixelSum::of(sampled.rgb)
            } else {
                *bad_count += 1;
                if bad.len() < REMEMBERED {
                    bad.push(BadSample { pixel, sample: index, fault: Fault::NotFinite });
                }
                PixelSum::default()
            };
            stack.push(sum);
            *next = index + 1;
        }
    }
}

fn message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into())
}
