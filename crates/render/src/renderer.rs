//! The render loop: rounds and passes over tiles on all threads, progress, looking, stopping, checkpoints.

use crate::ahead::Ahead;
use crate::chains::{Bootstrap, ChainState, Chains};
use crate::contrast;
use crate::error_goal::{Assessment, ErrorGoal, assess};
use crate::fault::{BadSample, Fault};
use crate::film::{FINE_TILE_SIZE, Film, NOISE_TILE_SIZE, REMEMBERED, TILE_SIZE, Tile};
use crate::layers::{LayerSampler, Layers, finite};
use crate::photons::{self, Sent};
use crate::sample::PixelSampler;
use crate::schedule::{self, Schedule};
use crate::seen::Seen;
use crate::share::Share;
use crate::snapshot::{Identity, Label, Writer};
use crate::splats::{Landed, Splats};
use crate::sums::{PixelStack, PixelSum};
use crate::task::{Adaptive, Goals, Observer, Outcome, Plan, Progress, Task};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use steradian_integrator::record::{Count, Counters, RayCounts};
use steradian_integrator::{Integrator, Scratch};
use steradian_sampling::Sampler;
use steradian_scene::World;

/// What came out.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The sums.
    pub film: Film,
    /// Samples per pixel taken everywhere.
    pub spp: u32,
    /// The number of samples per pixel to ask for to end here: of every pixel, or for an adaptive render, of its schedule.
    pub nominal: u32,
    /// Why it ended.
    pub outcome: Outcome,
    /// What can be said of the error, if a goal was set and there are samples enough.
    pub bound: Option<f64>,
    /// See [`Progress::error`].
    pub error: Option<f64>,
    /// Rays by kind.
    pub rays: RayCounts,
    /// Wall-clock time, that of earlier runs included.
    pub elapsed: Duration,
    /// The first samples that went wrong, in the order of samples and pixels.
    pub bad: Vec<BadSample>,
    /// How many went wrong in all.
    pub bad_count: u64,
    /// Where to go on.
    schedule: Schedule,
    /// An interrupted pass, which the film leaves out.
    unfinished: Option<Film>,
    share: Share,
    planned: u32,
}

impl Rendered {
    /// From where rendering can go on: the bytes of a [`crate::Snapshot`].
    pub fn encode(&self, label: &Label) -> Vec<u8> {
        self.encode_part(label, None)
    }

    /// As [`Rendered::encode`], with what a part of a distributed render has seen.
    pub fn encode_part(&self, label: &Label, seen: Option<&Seen>) -> Vec<u8> {
        let film = self.unfinished.as_ref().unwrap_or(&self.film);
        let (round, tiles) = (self.schedule.round, film.tiles.len());
        let counts = [tiles, film.layers()];
        let mut w = Writer::new(label, self.share, self.planned, self.elapsed, film.bounds, round, counts);
        for (i, tile) in film.tiles.iter().enumerate() {
            w.tile(tile, self.schedule.base[i], self.schedule.targets[i]);
        }
        w.splats(film.splats.as_ref());
        w.chains(film.chains.as_ref().map(|c| c.states.iter()));
        w.seen(seen);
        w.finish()
    }

    /// The share that this is, and samples per pixel that were asked for.
    pub fn share(&self) -> (Share, u32) {
        (self.share, self.planned)
    }

    /// The result that a film amounts to which was put together from parts.
    pub fn from_parts(film: Film, elapsed: Duration) -> Self {
        let [spp, _] = film.samples();
        let (bad, bad_count) = film.bad();
        let schedule = Schedule::new(film.tiles.len());
        Self {
            spp,
            nominal: spp,
            outcome: Outcome::Finished,
            bound: None,
            error: error_of(&film, &Goals::default()),
            rays: film.rays(),
            elapsed,
            bad,
            bad_count,
            schedule,
            unfinished: None,
            share: Share::Whole,
            planned: spp,
            film,
        }
    }
}

/// Renders the world's film. The image depends on nothing in `plan` but `spp`.
pub fn render(world: &World, plan: &Plan, observer: &dyn Observer, cancel: &AtomicBool) -> Rendered {
    plain::<RayCounts>(world, plan, observer, cancel).0
}

/// As [`render`], counting intersection tests and path lengths as well; slower, and the image is the same. The counts
/// are those of what was traced, an abandoned pass included.
pub fn render_counted(
    world: &World,
    plan: &Plan,
    observer: &dyn Observer,
    cancel: &AtomicBool,
) -> (Rendered, Counters) {
    plain(world, plan, observer, cancel)
}

fn plain<C: Count>(world: &World, plan: &Plan, observer: &dyn Observer, cancel: &AtomicBool) -> (Rendered, C) {
    let identity = Identity::new();
    let label = Label { identity: &identity, note: &[] };
    let layers = Layers::default();
    let task = Task { world, plan: plan.clone(), goals: Goals::default(), layers: &layers, label, resume: None };
    counted(task, observer, cancel)
}

/// Renders, or goes on rendering, under any of the stop rules.
///
/// # Panics
/// If `resume` is of a film with other bounds or layers.
pub fn run(task: Task, observer: &dyn Observer, cancel: &AtomicBool) -> Rendered {
    counted::<RayCounts>(task, observer, cancel).0
}

/// As [`run`], counting intersection tests and path lengths as well: of what this run traces, an abandoned pass included.
/// The picture is the same; rendering is slower.
///
/// # Panics
/// As [`run`].
pub fn run_counted(task: Task, observer: &dyn Observer, cancel: &AtomicBool) -> (Rendered, Counters) {
    counted(task, observer, cancel)
}

fn counted<C: Count>(task: Task, observer: &dyn Observer, cancel: &AtomicBool) -> (Rendered, C) {
    let start = Instant::now();
    let sampler = PixelSampler::new(task.world);
    let bounds = task.world.settings().film.pixel_bounds;
    let (film, schedule, before) = match task.resume {
        Some(s) => {
            assert_eq!(s.film.bounds, bounds, "the snapshot is of another film");
            assert_eq!(s.film.layers(), task.layers.width(), "the snapshot has other layers");
            (s.film, s.schedule, s.elapsed)
        }
        None => {
            let tile_size = match task.goals.criterion() {
                Adaptive::Contrast => FINE_TILE_SIZE,
                Adaptive::Error if task.goals.error.is_none() => NOISE_TILE_SIZE,
                Adaptive::No | Adaptive::Error => TILE_SIZE,
            };
            let mut film = Film::with_tiles(bounds, tile_size, task.layers.width());
            film.splats = sampler.splats().then(|| Splats::new(task.world.settings().film.resolution, bounds));
            if let Integrator::Mlt(mlt) = &sampler.integrator {
                film.chains = Some(Chains::new(mlt.parameters.chains));
            }
            let schedule = Schedule::new(film.tiles.len());
            (film, schedule, Duration::ZERO)
        }
    };
    let job = Job {
        sampler: &sampler,
        observer,
        cancel,
        start,
        before,
        plan: &task.plan,
        goals: &task.goals,
        layers: task.layers,
        label: task.label,
        done: AtomicUsize::new(0),
        samples: AtomicU64::new(film.total_samples()),
        rays: AtomicU64::new(0),
        last_report: Mutex::new(start),
        storing: AtomicBool::new(false),
        counts: Mutex::new(C::default()),
        bootstrap: OnceLock::new(),
    };
    let rendered = job.run(film, schedule);
    (rendered, job.counts.into_inner().unwrap_or_else(PoisonError::into_inner))
}

pub(crate) struct Job<'a, 'w, C> {
    pub sampler: &'a PixelSampler<'w>,
    observer: &'a dyn Observer,
    pub cancel: &'a AtomicBool,
    start: Instant,
    /// Time spent in earlier runs.
    before: Duration,
    pub plan: &'a Plan,
    pub goals: &'a Goals,
    layers: &'a Layers,
    label: Label<'a>,
    /// Tiles done in the current pass.
    done: AtomicUsize,
    /// Samples of all pixels.
    pub samples: AtomicU64,
    /// Rays of this run.
    pub rays: AtomicU64,
    last_report: Mutex<Instant>,
    /// Whether a thread is making a checkpoint.
    storing: AtomicBool,
    /// What was counted in this run.
    pub counts: Mutex<C>,
    /// What chains start from, once it is known.
    pub bootstrap: OnceLock<Bootstrap>,
}

/// The bound for which the goal's statement, or that of [`ErrorGoal::linear`], would hold at an only look.
fn error_of(film: &Film, goals: &Goals) -> Option<f64> {
    let goal = goals.error.unwrap_or(ErrorGoal::linear(1.0));
    let sampled = film.chains.is_none() && film.tiles.iter().all(|t| t.samples() > 1);
    sampled.then(|| assess(film, &goal, 1).bound).filter(|b| b.is_finite())
}

/// When the error was last asked for.
#[derive(Default)]
struct Asked {
    last: Option<Instant>,
    took: Duration,
}

/// What the last look found, for progress.
#[derive(Clone, Copy, Default)]
pub(crate) struct Found {
    error: Option<f64>,
    bound: Option<f64>,
}

impl<'w, C: Count> Job<'_, 'w, C> {
    fn run(&self, mut film: Film, mut schedule: Schedule) -> Rendered {
        let mut found = Found::default();
        let mut unfinished = None;
        let mut asked = Asked::default();
        let mut nominal = schedule::round_begin(schedule.round);
        let outcome = loop {
            if nominal >= self.plan.spp {
                break Outcome::Finished;
            }
            let started = nominal > 0 || film.total_samples() > 0;
            if started && self.plan.time_limit.is_some_and(|limit| self.elapsed() >= limit) {
                break Outcome::TimeLimit;
            }
            let end = match self.sampler.integrator {
                // Photons are those of one sample.
                Integrator::Sppm(_) => nominal + 1,
                _ => schedule::pass_end(nominal).min(self.plan.spp),
            };
            match self.pass(&mut film, &schedule, end, found) {
                Pass::Nothing => {}
                Pass::Done => {
                    found.error = self.error_now(&film, &mut asked).or(found.error);
                    self.observer.pass(&film, &self.report(&film.size(), found));
                }
                Pass::Interrupted(partial) => {
                    unfinished = partial;
                    break Outcome::Interrupted;
                }
            }
            nominal = end;
            if nominal == schedule::round_end(schedule.round) && self.look(&film, &mut schedule, &mut found) {
                break Outcome::ErrorReached;
            }
        };
        self.result(film, schedule, unfinished, (outcome, nominal), found)
    }

    /// Looks at the picture at the end of a round, and plans the next one. Whether the error goal is reached.
    fn look(&self, film: &Film, schedule: &mut Schedule, found: &mut Found) -> bool {
        let together = film.splats.is_some() || matches!(self.sampler.integrator, Integrator::Sppm(_));
        let adaptive = if together { Adaptive::No } else { self.goals.criterion() };
        let goal = self.goals.error.as_ref();
        // Where nothing is promised, there is nothing to correct for.
        let look = if goal.is_some() {
            schedule::look_at(schedule.round)
        } else {
            schedule::tells_noise(schedule.round).then_some(1)
        };
        let seen = self.assess(film, look);
        if let (Some(goal), Some(seen)) = (goal, &seen) {
            found.bound = Some(seen.bound);
            if seen.bound <= goal.bound {
                return true;
            }
        }
        let targets = match (adaptive, &seen, goal) {
            (Adaptive::Error, Some(seen), Some(goal)) => schedule::towards_goal(film, seen, goal.pixels, schedule),
            (Adaptive::Error, Some(seen), None) => schedule::by_noise(film, seen, schedule),
            (Adaptive::Contrast, ..) if schedule.round >= contrast::PILOT_ROUND => contrast::targets(film, schedule),
            _ => schedule::uniform(film, schedule.round + 1),
        };
        schedule.advance(targets);
        false
    }

    /// What could be said of the error now, for progress: asked seldom enough to take no time to speak of.
    fn error_now(&self, film: &Film, asked: &mut Asked) -> Option<f64> {
        const SHARE: u32 = 50;
        if asked.last.is_some_and(|last| last.elapsed() < asked.took * SHARE) {
            return None;
        }
        let start = Instant::now();
        let error = error_of(film, self.goals);
        *asked = Asked { last: Some(start), took: start.elapsed() };
        error
    }

    /// What there is to see at a look, if anybody wants to know.
    fn assess(&self, film: &Film, look: Option<u32>) -> Option<Assessment> {
        let goal = match &self.goals.error {
            Some(goal) => *goal,
            None if self.goals.criterion() == Adaptive::Error => ErrorGoal::linear(1.0),
            None => return None,
        };
        Some(assess(film, &goal, look?))
    }

    fn result(
        &self,
        film: Film,
        schedule: Schedule,
        unfinished: Option<Film>,
        (outcome, nominal): (Outcome, u32),
        found: Found,
    ) -> Rendered {
        let next_look = schedule::look_at(schedule.round.max(5));
        let bound = match outcome {
            Outcome::ErrorReached => found.bound,
            // Between looks: as if this were the next one.
            _ if self.goals.error.is_some() && film.samples()[0] >= 2 => {
                self.assess(&film, next_look).map(|seen| seen.bound)
            }
            _ => None,
        };
        let (bad, bad_count) = film.bad();
        Rendered {
            spp: film.samples()[0],
            nominal,
            outcome,
            bound: bound.filter(|b| b.is_finite()),
            error: error_of(&film, self.goals),
            rays: film.rays(),
            elapsed: self.elapsed(),
            bad,
            bad_count,
            film,
            schedule,
            unfinished,
            share: self.goals.share,
            planned: self.plan.spp,
        }
    }

    fn elapsed(&self) -> Duration {
        self.before + self.start.elapsed()
    }

    fn report(&self, size: &[usize; 2], found: Found) -> Progress {
        let pixels = (size[0] * size[1]).max(1) as f64;
        let average = self.samples.load(Ordering::Relaxed) as f64 / pixels;
        let parts = f64::from(self.goals.share.part().count);
        let mut fraction = average * parts / f64::from(self.plan.spp);
        if let Some(limit) = self.plan.time_limit {
            fraction = fraction.max(self.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9));
        }
        if let (Some(goal), Some(bound)) = (&self.goals.error, found.bound) {
            // Half the error takes four times the samples.
            fraction = fraction.max((goal.bound / bound) * (goal.bound / bound));
        }
        Progress {
            spp: [average as u32, self.plan.spp],
            fraction: fraction.min(1.0),
            rays: self.rays.load(Ordering::Relaxed),
            elapsed: self.start.elapsed(),
            error: found.error,
            bound: found.bound,
        }
    }

    /// The range of samples that tile `i` shall have at the end of a pass.
    fn range(&self, schedule: &Schedule, i: usize, width: usize, nominal: u32) -> [u32; 2] {
        let [first, last] = self.goals.share.samples(i, width, self.plan.spp);
        let end = schedule.end_of(i, nominal);
        if self.goals.criterion() == Adaptive::Contrast && nominal > contrast::PILOT {
            // Whoever has decided does not count.
            return [contrast::PILOT, end.max(contrast::PILOT + 1)];
        }
        [first, if self.goals.share == Share::Whole { end } else { end.clamp(first, last) }]
    }

    /// One pass over all tiles up to `nominal` samples. On cancellation later passes are abandoned whole, so that every
    /// pixel keeps the samples that it had; during the first pass, tiles not reached stay empty.
    fn pass(&self, film: &mut Film, schedule: &Schedule, nominal: u32, found: Found) -> Pass {
        let [width, _] = film.grid();
        let ranges: Vec<_> = (0..film.tiles.len()).map(|i| self.range(schedule, i, width, nominal)).collect();
        let todo: Vec<usize> =
            (0..ranges.len()).filter(|&i| ranges[i][1] > film.tiles[i].end.max(ranges[i][0])).collect();
        if let Integrator::Mlt(mlt) = &self.sampler.integrator {
            return self.chain_pass(film, schedule, *mlt, (&ranges, nominal), found);
        }
        if todo.is_empty() {
            return Pass::Nothing;
        }
        let photons = match &self.sampler.integrator {
            Integrator::Sppm(sppm) => {
                let sent = photons::send::<C>(self.sampler.world, sppm, nominal - 1, self.plan.threads, self.cancel);
                let Some(sent) = sent else { return Pass::Interrupted(None) };
                self.rays.fetch_add(sent.counts.rays().total(), Ordering::Relaxed);
                Some(sent)
            }
            _ => None,
        };
        let backup = (film.total_samples() > 0).then(|| film.clone());
        self.done.store(0, Ordering::Relaxed);
        let (size, bounds) = (film.size(), film.bounds);
        {
            let tiles: Vec<Mutex<&mut Tile>> = film.tiles.iter_mut().map(Mutex::new).collect();
            let splats = film.splats.as_mut().map(Mutex::new);
            let canvas = Canvas { tiles: &tiles, splats: splats.as_ref(), chains: None };
            let next = AtomicUsize::new(0);
            let work = || {
                let mut sampler = Sampler::new(&self.sampler.world.settings().sampler);
                let mut ahead = if self.layers.is_empty() { Ahead::new::<C>(self.sampler, &sampler) } else { None };
                let mut scratch = Scratch::default();
                scratch.photons = photons.as_ref().map(|sent| sent.map.clone());
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= todo.len() || self.cancel.load(Ordering::Relaxed) {
                        return;
                    }
                    let i = todo[k];
                    let sent = photons.as_ref().filter(|_| i == 0);
                    self.render_tile(&canvas, i, ranges[i], sent, (&mut sampler, &mut ahead), &mut scratch);
                    self.observer.tile(&locked(&tiles[i]));
                    self.done.fetch_add(1, Ordering::Relaxed);
                    self.maybe_report(&size, found);
                    self.maybe_store(&canvas, schedule, bounds);
                }
            };
            std::thread::scope(|scope| {
                for _ in 1..self.plan.threads.max(1).min(todo.len()) {
                    scope.spawn(work);
                }
                work();
            });
        }
        if self.done.load(Ordering::Relaxed) == todo.len() {
            return Pass::Done;
        }
        Pass::Interrupted(backup.map(|backup| std::mem::replace(film, backup)))
    }

    pub fn maybe_report(&self, size: &[usize; 2], found: Found) {
        // Whoever finds the lock taken has nothing to add.
        if let Ok(mut last) = self.last_report.try_lock()
            && last.elapsed() >= Duration::from_millis(100)
        {
            *last = Instant::now();
            self.observer.progress(&self.report(size, found));
        }
    }

    /// Makes a checkpoint while the other threads go on. Each tile is taken as it is: the schedule says what each still needs.
    pub fn maybe_store(&self, canvas: &Canvas, schedule: &Schedule, bounds: [u32; 4]) {
        if !self.observer.checkpoint_due() || self.storing.swap(true, Ordering::Acquire) {
            return;
        }
        let start = Instant::now();
        let mut writer = Writer::new(
            &self.label,
            self.goals.share,
            self.plan.spp,
            self.elapsed(),
            bounds,
            schedule.round,
            [canvas.tiles.len(), self.layers.width()],
        );
        // Whoever holds the splats sees them with just the tiles that they came from.
        let splats = canvas.splats.map(locked);
        for (i, tile) in canvas.tiles.iter().enumerate() {
            writer.tile(&locked(tile), schedule.base[i], schedule.targets[i]);
        }
        writer.splats(splats.as_ref().map(|s| &***s));
        let chains: Option<Vec<_>> = canvas.chains.map(|all| all.iter().map(|c| locked(c).clone()).collect());
        writer.chains(chains.as_ref().map(|c| c.iter()));
        writer.seen(None);
        drop(splats);
        self.observer.checkpoint(writer.finish(), start.elapsed());
        self.storing.store(false, Ordering::Release);
    }

    /// Renders a tile. Where samples bring light to other pixels, the tile changes at the same moment as those.
    fn render_tile(
        &self,
        canvas: &Canvas,
        i: usize,
        range: [u32; 2],
        sent: Option<&Sent<C>>,
        numbers: (&mut Sampler, &mut Option<Ahead>),
        scratch: &mut Scratch<'w>,
    ) {
        let mut landed = Vec::new();
        match canvas.splats {
            None => {
                let tile = &mut locked(&canvas.tiles[i]);
                self.tile(tile, range, numbers, scratch, &mut landed);
                sent.into_iter().for_each(|sent| self.account(tile, sent));
            }
            Some(splats) => {
                let mut tile = locked(&canvas.tiles[i]).clone();
                self.tile(&mut tile, range, numbers, scratch, &mut landed);
                let mut splats = locked(splats);
                splats.add(&landed);
                **locked(&canvas.tiles[i]) = tile;
            }
        }
    }

    /// Photons count with the first tile, so that all parts of a render together count them once.
    fn account(&self, tile: &mut Tile, sent: &Sent<C>) {
        tile.rays.merge(&sent.counts.rays());
        locked(&self.counts).merge(&sent.counts);
        tile.remember(sent.bad.clone(), sent.bad_count);
    }

    fn tile(
        &self,
        tile: &mut Tile,
        [first, end]: [u32; 2],
        (sampler, ahead): (&mut Sampler, &mut Option<Ahead>),
        scratch: &mut Scratch<'w>,
        landed: &mut Vec<Landed>,
    ) {
        tile.begin_at(first);
        let mut counts = C::default();
        let mut layers = LayerSampler::new(self.layers);
        let (mut bad, mut bad_count) = (Vec::new(), 0);
        let before = tile.samples();
        let pixels: Vec<_> = (0..tile.len()).map(|i| tile.pixel(i)).collect();
        let mut asked = 0..pixels.len();
        ahead.iter_mut().for_each(Ahead::begin);
        tile.extend(end, |pixel, range, stack| {
            let mut next = range.start;
            let made = asked
                .next()
                .zip(ahead.as_mut())
                .and_then(|(i, ahead)| ahead.pixel(self.sampler, sampler, (&pixels, i), &range, &mut counts));
            for &rgb in made.into_iter().flatten() {
                if rgb.iter().all(|v| v.is_finite()) {
                    stack.push(PixelSum::of(rgb));
                } else {
                    bad_count += 1;
                    note(&mut bad, BadSample { pixel, sample: next, fault: Fault::NotFinite });
                    stack.push(PixelSum::default());
                }
                next += 1;
            }
            while next < range.end {
                let run = catch_unwind(AssertUnwindSafe(|| {
                    self.pixel(
                        pixel,
                        next..range.end,
                        &mut next,
                        (sampler, scratch),
                        landed,
                        stack,
                        &mut layers,
                        &mut counts,
                        &mut bad,
                        &mut bad_count,
                    );
                }));
                if let Err(payload) = run {
                    let sample = next;
                    bad_count += 1;
                    note(&mut bad, BadSample { pixel, sample, fault: Fault::Panic(message(payload.as_ref())) });
                    stack.push(PixelSum::default());
                    next += 1;
                }
            }
        });
        let rays = counts.rays();
        tile.rays.merge(&rays);
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).merge(&counts);
        tile.remember(bad, bad_count);
        self.rays.fetch_add(rays.total(), Ordering::Relaxed);
        self.samples.fetch_add(u64::from(tile.samples() - before) * tile.len() as u64, Ordering::Relaxed);
    }

    fn pixel(
        &self,
        pixel: [u32; 2],
        range: std::ops::Range<u32>,
        next: &mut u32,
        (sampler, scratch): (&mut Sampler, &mut Scratch<'w>),
        landed: &mut Vec<Landed>,
        stack: &mut PixelStack,
        layers: &mut LayerSampler,
        counts: &mut C,
        bad: &mut Vec<BadSample>,
        bad_count: &mut u64,
    ) {
        for index in range {
            *next = index;
            let good = if self.layers.is_empty() {
                let sampled = self.sampler.sample(sampler, pixel, index, counts, scratch);
                let finite = sampled.rgb.iter().all(|v| v.is_finite());
                let landed = finite && self.sampler.land(scratch, &sampled.wavelengths, landed);
                landed.then(|| stack.push(PixelSum::of(sampled.rgb)))
            } else {
                let (sampled, colors) = layers.sample(self.sampler, (sampler, scratch), (pixel, index), counts);
                finite(&sampled, colors)
                    .filter(|_| self.sampler.land(scratch, &sampled.wavelengths, landed))
                    .map(|(sum, colors)| stack.push_layers(sum, colors))
            };
            if good.is_none() {
                *bad_count += 1;
                note(bad, BadSample { pixel, sample: index, fault: Fault::NotFinite });
                stack.push(PixelSum::default());
            }
            *next = index + 1;
        }
    }
}

/// The film while threads work on it.
pub(crate) struct Canvas<'c, 't> {
    pub tiles: &'c [Mutex<&'t mut Tile>],
    pub splats: Option<&'c Mutex<&'t mut Splats>>,
    pub chains: Option<&'c [Mutex<ChainState>]>,
}

/// What became of a pass.
pub(crate) enum Pass {
    /// Every tile had its samples already.
    Nothing,
    /// All tiles were done.
    Done,
    /// Cancelled; the film is as before, and this is how far the pass had come.
    Interrupted(Option<Film>),
}

/// What a panic left behind is as whole as any: sums change only at the end.
pub(crate) fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Remembers the first few by sample number; a broken scene has millions.
fn note(bad: &mut Vec<BadSample>, one: BadSample) {
    const SLACK: usize = 8 * REMEMBERED;
    bad.push(one);
    if bad.len() > SLACK {
        crate::film::sort_bad(bad);
    }
}

pub(crate) fn message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into())
}
