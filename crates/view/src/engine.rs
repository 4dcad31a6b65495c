//! The thread that renders: it does what was asked last, a slice at a time, and leaves a slice as soon as something else is asked.

use crate::hub::{Ask, Hub, PANES, Staged, lock};
use crate::look;
use crate::pass::{self, Work};
use crate::stage::{Options, Said};
use serde_json::json;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use steradian_integrator::Integrator;
use steradian_render::{ErrorGoal, Film, PixelSampler, Splats, TILE_SIZE, assess};
use steradian_scene::{Scene, World};

/// The first picture after a change shall be there after this.
const FIRST_PICTURE: Duration = Duration::from_millis(40);
/// A tile shall not take longer than this, so that tabs see life.
const TILE_TIME: f64 = 0.12;
/// Passes add this many samples at most.
const LARGEST_PASS: u32 = 16;
/// Enough, unless somebody says otherwise.
const ENOUGH_SPP: u32 = 4096;

/// A pane as the engine knows it.
struct Progressing {
    film: Film,
    order: Vec<usize>,
    /// Pixels between the samples of the next coarse picture; 1 for tiles.
    stride: u32,
    asked: Instant,
    busy: Duration,
    latency: Option<Duration>,
    samples: AtomicU64,
    rays: AtomicU64,
    error: Option<f64>,
    assessed: Option<(Instant, Duration)>,
    finished: bool,
    /// The largest number of samples that tiles are on their way to.
    target: u32,
    ends: Vec<u32>,
}

/// The engine.
pub(crate) struct Engine {
    hub: Arc<Hub>,
    /// What the scene itself says.
    said: Said,
    options: Vec<Options>,
    panes: Vec<Progressing>,
    generation: u32,
    paused: bool,
    adaptive: bool,
    spp: Option<u32>,
    goal: Option<f64>,
    /// Samples a second, in each pane's last picture.
    rates: [Option<f64>; PANES],
    problems: Vec<String>,
    refused: Option<String>,
    last_report: Mutex<Instant>,
}

impl Progressing {
    fn new(bounds: [u32; 4], stride: u32, asked: Instant) -> Self {
        let film = Film::new(bounds);
        let order = pass::from_the_middle(&film);
        let ends = vec![0; film.tiles.len()];
        Self {
            film,
            order,
            stride,
            asked,
            busy: Duration::ZERO,
            latency: None,
            samples: AtomicU64::new(0),
            rays: AtomicU64::new(0),
            error: None,
            assessed: None,
            finished: false,
            target: 0,
            ends,
        }
    }
}

impl Engine {
    /// Builds the world of a scene that has been read.
    ///
    /// # Errors
    /// What is wrong with the scene or the options.
    pub fn new(hub: Arc<Hub>, scene: Scene) -> Result<Self, String> {
        let said = Said { camera: scene.camera.clone(), settings: scene.settings.clone() };
        let mut this = Self {
            options: vec![hub.stage.options()],
            hub,
            said,
            panes: Vec::new(),
            generation: 0,
            paused: false,
            adaptive: false,
            spp: Some(ENOUGH_SPP),
            goal: None,
            rates: [None; PANES],
            problems: Vec::new(),
            refused: None,
            last_report: Mutex::new(Instant::now()),
        };
        this.build(0, this.options[0].clone(), Some(scene))?;
        Ok(this)
    }

    /// Renders until the end.
    pub fn run(mut self) {
        self.publish_state();
        while !self.hub.closing.load(Ordering::SeqCst) {
            let next = self.next_pane();
            let patience = if next.is_some() { Duration::ZERO } else { Duration::from_secs(1) };
            let asked = self.hub.asked(patience);
            if asked.is_empty() {
                if let Some(pane) = next {
                    self.slice(pane);
                }
            } else {
                self.answer(asked);
                self.publish_state();
            }
        }
    }

    /// Of the panes that have something to do, the one that has had least time.
    fn next_pane(&self) -> Option<usize> {
        let open = (0..self.panes.len()).filter(|&p| !self.paused && !self.panes[p].finished);
        open.min_by_key(|&p| self.panes[p].busy)
    }

    fn answer(&mut self, asked: Vec<Ask>) {
        let mut sets: [Option<Options>; PANES] = Default::default();
        for ask in asked {
            match ask {
                // Of many moves of the camera only the last one counts.
                Ask::Set { pane, options } if pane < self.panes.len() => sets[pane] = Some(options),
                Ask::Set { .. } => {}
                Ask::Compare(options) => self.compare(options),
                Ask::Pause(on) => self.paused = on,
                Ask::Goal { spp, error } => {
                    (self.spp, self.goal) = (spp, error);
                    self.panes.iter_mut().for_each(|p| p.finished = false);
                }
                Ask::Adaptive(on) => {
                    self.adaptive = on;
                    self.panes.iter_mut().for_each(|p| p.finished = false);
                }
                Ask::Reload => self.reload(),
                Ask::State => {}
                Ask::Picture { pane, reply } => {
                    // Whoever asked may be gone.
                    let _ = reply.try_send(self.picture(pane));
                }
            }
        }
        for (pane, options) in sets.into_iter().enumerate() {
            if let Some(options) = options {
                self.refused = self.set(pane, options).err();
            }
        }
    }

    fn set(&mut self, pane: usize, mut options: Options) -> Result<(), String> {
        let said = self.hub.stage.apply(&mut options, self.said.clone())?;
        check_cost(&said)?;
        let kept = {
            let mut staged = self.hub.panes[pane].staged.write().unwrap_or_else(PoisonError::into_inner);
            match staged.as_mut() {
                Some(staged) => {
                    let kept = staged.world.look_again(said.camera, said.settings).map_err(|e| e.to_string())?;
                    if kept {
                        staged.options = options.clone();
                    }
                    kept
                }
                None => false,
            }
        };
        if kept {
            self.restart(pane, options);
            return Ok(());
        }
        self.build(pane, options, None)
    }

    /// Builds the world of a pane anew; from the files unless the scene is at hand.
    fn build(&mut self, pane: usize, mut options: Options, scene: Option<Scene>) -> Result<(), String> {
        let mut scene = match scene {
            Some(scene) => scene,
            None => self.hub.stage.open().map_err(|reports| reports.join("\n"))?,
        };
        let said = Said { camera: scene.camera.clone(), settings: scene.settings.clone() };
        let now = self.hub.stage.apply(&mut options, said.clone())?;
        check_cost(&now)?;
        self.said = said;
        (scene.camera, scene.settings) = (now.camera, now.settings);
        let world = World::build(scene).map_err(|e| e.to_string())?;
        let staged = Staged { world, options: options.clone(), generation: self.generation + 1 };
        *self.hub.panes[pane].staged.write().unwrap_or_else(PoisonError::into_inner) = Some(staged);
        self.restart(pane, options);
        Ok(())
    }

    /// Starts a pane's picture again.
    fn restart(&mut self, pane: usize, options: Options) {
        self.generation += 1;
        let asked = Instant::now();
        let rate = self.rates[pane].or(self.rates[0]);
        let mut slot = self.hub.panes[pane].staged.write().unwrap_or_else(PoisonError::into_inner);
        let Some(staged) = slot.as_mut() else { return };
        staged.generation = self.generation;
        let settings = staged.world.settings();
        let bounds = settings.film.pixel_bounds;
        let stride = first_stride(bounds, rate);
        let mut work = Progressing::new(bounds, stride, asked);
        let pixels = PixelSampler::new(&staged.world);
        if pixels.splats() {
            work.film.splats = Some(Splats::new(settings.film.resolution, bounds));
        }
        drop(slot);
        lock(&self.hub.panes[pane].canvas).reset(self.generation, bounds);
        if pane < self.panes.len() {
            (self.panes[pane], self.options[pane]) = (work, options);
        } else {
            self.panes.push(work);
            self.options.truncate(self.panes.len() - 1);
            self.options.push(options);
        }
        // Side by side, both start from the same line.
        if self.panes.len() > 1 && self.panes.iter().any(|p| p.busy > Duration::ZERO) {
            for other in (0..self.panes.len()).filter(|&p| p != pane) {
                let options = self.options[other].clone();
                if self.panes[other].busy > Duration::ZERO {
                    self.restart(other, options);
                }
            }
        }
    }

    fn compare(&mut self, options: Option<Options>) {
        match options {
            Some(options) if self.panes.len() < PANES => {
                if let Err(why) = self.build(1, options, None) {
                    self.refused = Some(why);
                }
            }
            Some(options) => self.refused = self.set(1, options).err(),
            None => {
                self.panes.truncate(1);
                self.options.truncate(1);
                *self.hub.panes[1].staged.write().unwrap_or_else(PoisonError::into_inner) = None;
                lock(&self.hub.panes[1].canvas).reset(0, [0; 4]);
            }
        }
    }

    fn reload(&mut self) {
        self.problems.clear();
        let scene = match self.hub.stage.open() {
            Ok(scene) => scene,
            Err(reports) => return self.problems = reports,
        };
        let mut scene = Some(scene);
        for pane in 0..self.panes.len() {
            if let Err(why) = self.build(pane, self.options[pane].clone(), scene.take()) {
                self.problems.push(why);
            }
        }
    }

    fn picture(&self, pane: usize) -> Result<Vec<u8>, String> {
        let work = self.panes.get(pane).ok_or("there is no such pane")?;
        let made = self.hub.with_world(pane, |staged| {
            self.hub.stage.picture(&staged.options, staged.world.settings(), &work.film, work.busy)
        });
        made.ok_or("there is no picture yet")?
    }

    /// Renders for a while.
    fn slice(&mut self, pane: usize) {
        let start = Instant::now();
        let hub = self.hub.clone();
        let slot = hub.panes[pane].staged.read().unwrap_or_else(PoisonError::into_inner);
        let Some(staged) = slot.as_ref() else {
            self.panes[pane].finished = true;
            return;
        };
        let pixels = PixelSampler::new(&staged.world);
        self.plan(pane);
        let mut film = std::mem::replace(&mut self.panes[pane].film, Film::new([0; 4]));
        let this = &self.panes[pane];
        let seen = |samples: u64, rays: u64| {
            this.samples.fetch_add(samples, Ordering::Relaxed);
            this.rays.fetch_add(rays, Ordering::Relaxed);
            hub.notify();
            if let Ok(mut last) = self.last_report.try_lock()
                && last.elapsed() >= Duration::from_millis(200)
            {
                *last = Instant::now();
                self.publish_progress(Some((pane, start)));
            }
        };
        let canvas = &hub.panes[pane].canvas;
        // The first picture is always finished: who drags the camera wants to see where it goes.
        let interrupt = if this.latency.is_none() { &hub.closing } else { &hub.interrupt };
        let mut stride = this.stride;
        let interrupt = if stride > 1 { interrupt } else { &hub.interrupt };
        let work = Work { pixels: &pixels, canvas, interrupt, threads: hub.threads, seen: &seen };
        if stride > 1 {
            if work.coarse(film.bounds, stride) {
                // Each coarse picture costs a quarter of the next: together less than a half of the first pass.
                stride = if stride <= 3 { 1 } else { stride.div_ceil(2) };
            }
        } else {
            work.tiles(&mut film, &this.order, &this.ends);
            if film.splats.is_some() {
                pass::show(&film, canvas);
                hub.notify();
            }
        }
        drop(slot);
        let this = &mut self.panes[pane];
        if this.latency.is_none() && (stride != this.stride || film.total_samples() > 0) {
            this.latency = Some(this.asked.elapsed());
        }
        (this.film, this.stride) = (film, stride);
        this.busy += start.elapsed();
        self.rates[pane] = rate(this).or(self.rates[pane]);
        self.judge(pane);
        self.publish_progress(None);
    }

    /// How far each tile shall come in the next pass.
    fn plan(&mut self, pane: usize) {
        let most = self.spp.unwrap_or(u32::MAX);
        let rate = self.rates[pane].unwrap_or(1e5);
        let this = &mut self.panes[pane];
        let behind = this.film.tiles.iter().zip(&this.ends).any(|(t, &end)| t.end < end.min(most));
        if this.stride > 1 || behind {
            return;
        }
        let tile = f64::from(TILE_SIZE * TILE_SIZE) * self.hub.threads as f64;
        let quick = ((rate * TILE_TIME / tile) as u32).clamp(1, LARGEST_PASS);
        let step = this.target.clamp(1, quick);
        let noisy = if self.adaptive && this.target >= LARGEST_PASS { noisy_tiles(&this.film) } else { None };
        this.target = this.target.saturating_add(step).min(most);
        for (i, end) in this.ends.iter_mut().enumerate() {
            *end = match &noisy {
                None => (*end + step).min(most),
                Some(noisy) if noisy[i] => (*end + step * 2).min(most),
                Some(_) => *end,
            };
        }
    }

    /// Whether a pane is good enough.
    fn judge(&mut self, pane: usize) {
        const SHARE: u32 = 30;
        let goal = self.goal;
        let this = &mut self.panes[pane];
        let [least, most] = this.film.samples();
        let due = this.assessed.is_none_or(|(at, took)| at.elapsed() > (took * SHARE).max(Duration::from_millis(400)));
        if least > 1 && due {
            let start = Instant::now();
            let bound = assess(&this.film, &ErrorGoal::linear(1.0), 1).bound;
            this.error = Some(bound).filter(|b| b.is_finite());
            this.assessed = Some((Instant::now(), start.elapsed()));
        }
        let enough = self.spp.is_some_and(|n| if self.adaptive { most >= n } else { least >= n });
        let good = goal.is_some_and(|goal| least >= 8 && this.error.is_some_and(|e| e <= goal));
        this.finished = enough || good;
    }

    fn publish_state(&self) {
        let panes: Vec<_> = (0..self.panes.len())
            .filter_map(|pane| {
                self.hub.with_world(pane, |staged| {
                    let settings = staged.world.settings();
                    let [x0, x1, y0, y1] = settings.film.pixel_bounds;
                    let primaries = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                    let to_srgb = primaries.map(|c| settings.film.color_space.emission_to_srgb(c));
                    let integrator = Integrator::new(&staged.world);
                    let kind = format!("{:?}", settings.integrator.kind).to_lowercase();
                    json!({
                        "options": staged.options, "generation": staged.generation,
                        "camera": look::describe(&staged.world),
                        "size": [x1 - x0, y1 - y0], "origin": [x0, y0],
                        "command": self.hub.stage.command("render", &staged.options, ""),
                        "to_srgb": to_srgb,
                        "max_depth": settings.integrator.max_depth,
                        "integrator": kind.split(['(', ' ']).next(),
                        "raw": matches!(integrator, Integrator::View(_)),
                        "triangles": staged.world.census().instanced_triangles,
                        "lights": staged.world.light_count(),
                    })
                })
            })
            .collect();
        let reference = lock(&self.hub.board).reference.clone();
        let state = json!({
            "type": "state", "panes": panes, "paused": self.paused, "adaptive": self.adaptive,
            "goal": { "spp": self.spp, "error": self.goal },
            "problems": self.problems, "refused": self.refused,
            "reference": reference.map(|r| json!({ "name": r.name, "stamp": r.stamp, "size": r.size })),
        });
        self.hub.publish(|board| &mut board.state, &state);
        self.publish_progress(None);
    }

    fn publish_progress(&self, at_work: Option<(usize, Instant)>) {
        let panes: Vec<_> = self
            .panes
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let now = at_work.filter(|(pane, _)| *pane == i).map_or(Duration::ZERO, |(_, start)| start.elapsed());
                let seconds = (p.busy + now).as_secs_f64();
                let [w, h] = lock(&self.hub.panes[i].canvas).size.map(f64::from);
                let rays = p.rays.load(Ordering::Relaxed);
                json!({
                    "spp": p.samples.load(Ordering::Relaxed) as f64 / (w * h).max(1.0),
                    "seconds": seconds, "rays": rays,
                    "mrays": if seconds > 0.05 { rays as f64 / seconds / 1e6 } else { 0.0 },
                    "error": p.error, "finished": p.finished,
                    "latency_ms": p.latency.map(|l| l.as_secs_f64() * 1e3),
                })
            })
            .collect();
        let progress = json!({ "type": "progress", "panes": panes, "memory": memory(), "threads": self.hub.threads });
        self.hub.publish(|board| &mut board.progress, &progress);
    }
}

/// Samples a second so far.
fn rate(pane: &Progressing) -> Option<f64> {
    let seconds = pane.busy.as_secs_f64();
    let samples = pane.samples.load(Ordering::Relaxed);
    (seconds > 1e-3 && samples > 500).then(|| samples as f64 / seconds)
}

/// Pixels between the samples of the first picture, so that it is there in time.
fn first_stride(bounds: [u32; 4], rate: Option<f64>) -> u32 {
    let [x0, x1, y0, y1] = bounds.map(f64::from);
    let samples = rate.unwrap_or(1e5) * FIRST_PICTURE.as_secs_f64();
    let stride = ((x1 - x0) * (y1 - y0) / samples.max(1.0)).sqrt().ceil();
    // Whatever fits into the time is rendered as it is.
    if stride <= 1.5 { 1 } else { (stride as u32).clamp(2, 64) }
}

/// The tiles whose noise is above the mean of all; none where nothing can be told yet.
fn noisy_tiles(film: &Film) -> Option<Vec<bool>> {
    let found = assess(film, &ErrorGoal::linear(1.0), 1);
    let left: Vec<f64> = found.noise.iter().zip(&film.tiles).map(|(n, t)| n / f64::from(t.samples().max(1))).collect();
    let mean = left.iter().sum::<f64>() / left.len().max(1) as f64;
    (mean > 0.0 && mean.is_finite()).then(|| left.iter().map(|&n| n >= mean).collect())
}

/// Refuses what would not end, as the command line does.
fn check_cost(said: &Said) -> Result<(), String> {
    let [w, h] = said.settings.film.size();
    let pixels = u64::from(w) * u64::from(h);
    if pixels > 64 << 20 {
        return Err(format!("{w} x {h} pixels are more than a page can show"));
    }
    Ok(())
}

/// Bytes of memory in use, where the system says.
fn memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_picture_suits_the_machine() {
        assert_eq!(first_stride([0, 720, 0, 450], Some(350_000.0)), 5);
        assert_eq!(first_stride([0, 720, 0, 450], None), 9);
        assert_eq!(first_stride([0, 64, 0, 64], Some(1e7)), 1);
        assert_eq!(first_stride([0, 8000, 0, 8000], Some(1.0)), 64);
    }
}
