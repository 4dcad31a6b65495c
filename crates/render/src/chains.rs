//! Passes of Metropolis light transport: a bootstrap, and chains that each take their share of the mutations.
//!
//! A pixel's samples are mutations: `n` of them are `n` times the number of pixels, over all chains together. Chain `i` of
//! `c` has then made `floor((n pixels + i) / c)`, whatever the passes in between. What they bring is added up exactly, so
//! that it does not matter who makes them when; the parts of a distributed render share the chains.

use crate::film::Film;
use crate::renderer::{Canvas, Found, Job, Pass, locked};
use crate::schedule::Schedule;
use crate::splats::Landed;
use crate::sums::PixelSum;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use steradian_integrator::record::{Count, RayCounts};
use steradian_integrator::{Mlt, Place, Scratch, Splat};
use steradian_sampling::rng::{hash_u64, unit_f64};

/// A chain, and what it has done.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ChainState {
    pub place: Place,
    pub rays: RayCounts,
    /// Steps that went wrong, and were not taken.
    pub bad: u64,
}

/// The chains of a film. One that another part of the render has is at its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Chains {
    pub(crate) states: Vec<ChainState>,
}

impl Chains {
    /// None has begun.
    pub fn new(count: u32) -> Self {
        Self { states: vec![ChainState::default(); count as usize] }
    }

    /// Takes the chains that another part has made. False if these are other chains.
    pub(crate) fn merge(&mut self, o: &Self) -> bool {
        for (a, b) in self.states.iter_mut().zip(&o.states) {
            if b.place.step > a.place.step {
                *a = b.clone();
            }
        }
        self.states.len() == o.states.len()
    }

    pub(crate) fn rays(&self) -> RayCounts {
        let mut sum = RayCounts::default();
        self.states.iter().for_each(|s| sum.merge(&s.rays));
        sum
    }

    pub(crate) fn bad_count(&self) -> u64 {
        self.states.iter().map(|s| s.bad).sum()
    }
}

/// What independent paths say about the light, and where each chain starts.
#[derive(Debug)]
pub(crate) struct Bootstrap {
    /// Light in all: the sum over path lengths of the mean brightness.
    light: f64,
    /// Running sums of brightness, one path length after the other.
    sums: Vec<f64>,
    /// Paths of each length.
    samples: u64,
}

impl Bootstrap {
    /// Mean brightness of the paths of a length.
    fn mean(&self, depth: u32) -> f64 {
        let until = |lengths: u64| (lengths * self.samples).checked_sub(1).map_or(0.0, |i| self.sums[i as usize]);
        let depth = u64::from(depth);
        (until(depth + 1) - until(depth)) / self.samples as f64
    }

    /// The path that a chain of `count` starts from, each in proportion to its brightness. Chains go through the running sums in equal
    /// steps, so that each length of path has its share of them: they never change it.
    fn start(&self, seed: u64, chain: usize, count: usize) -> Option<u64> {
        let total = *self.sums.last()?;
        if total <= 0.0 {
            return None;
        }
        let u = (chain as f64 + unit_f64(hash_u64(&[seed, 0x6368_6169]))) / count as f64;
        let i = self.sums.partition_point(|&s| s <= u * total).min(self.sums.len() - 1) as u64;
        let lengths = self.sums.len() as u64 / self.samples;
        Some(i % self.samples * lengths + i / self.samples)
    }
}

/// A thread takes so many bootstrap paths at a time.
const CHUNK: u64 = 1 << 10;

impl<'w, C: Count> Job<'_, 'w, C> {
    /// The bootstrap, made on first use: some paths of each length. `None` if cancelled.
    fn bootstrap(&self, mlt: Mlt) -> Option<&Bootstrap> {
        if let Some(made) = self.bootstrap.get() {
            return Some(made);
        }
        let samples = mlt.parameters.bootstrap_samples;
        let total = u64::from(samples) * (u64::from(mlt.max_depth) + 1);
        let chunks = total.div_ceil(CHUNK) as usize;
        let parts: Vec<Mutex<Vec<f32>>> = (0..chunks).map(|_| Mutex::default()).collect();
        self.each(chunks, |k, scratch, counts: &mut C| {
            let of = |i: u64| {
                let made = catch_unwind(AssertUnwindSafe(|| {
                    mlt.chain(self.sampler.world, [i, u64::MAX - 1], Place::default(), scratch.paths(), counts)
                }));
                // The path of a bug brings no light, like that of a chain.
                made.map_or(0.0, |chain| chain.brightness())
            };
            let first = k as u64 * CHUNK;
            *locked(&parts[k]) = (first..(first + CHUNK).min(total)).map(of).collect();
            true
        });
        if self.cancel.load(Ordering::Relaxed) {
            return None;
        }
        let values: Vec<f32> =
            parts.into_iter().flat_map(|p| p.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
        let lengths = mlt.max_depth as usize + 1;
        let mut sum = 0.0;
        let by_length = (0..lengths).flat_map(|d| values.iter().skip(d).step_by(lengths));
        let sums: Vec<f64> = by_length
            .map(|&v| {
                sum += f64::from(v);
                sum
            })
            .collect();
        let light = sum / f64::from(samples);
        Some(self.bootstrap.get_or_init(|| Bootstrap { light, sums, samples: u64::from(samples) }))
    }

    /// Does pieces of work on all threads until one says that it was cancelled.
    fn each(&self, count: usize, work: impl Fn(usize, &mut Scratch<'w>, &mut C) -> bool + Sync) {
        let next = AtomicUsize::new(0);
        let run = || {
            let mut scratch = Scratch::default();
            let mut counts = C::default();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                if i >= count || self.cancel.load(Ordering::Relaxed) || !work(i, &mut scratch, &mut counts) {
                    break;
                }
            }
            self.rays.fetch_add(counts.rays().total(), Ordering::Relaxed);
            locked(&self.counts).merge(&counts);
        };
        std::thread::scope(|scope| {
            for _ in 1..self.plan.threads.max(1).min(count) {
                scope.spawn(run);
            }
            run();
        });
    }

    /// Mutations up to `nominal` per pixel. On cancellation the film is as before, and how far chains had come is given back.
    pub(crate) fn chain_pass(
        &self,
        film: &mut Film,
        schedule: &Schedule,
        mlt: Mlt,
        (ranges, nominal): (&[[u32; 2]], u32),
        found: Found,
    ) -> Pass {
        let pixels: u64 = film.tiles.iter().map(|t| t.len() as u64).sum();
        let Some(chains) = &film.chains else { return Pass::Nothing };
        let count = chains.states.len() as u64;
        let part = self.goals.share.part();
        let mine = |i: usize| i as u64 % u64::from(part.count) == u64::from(part.index);
        let end = |i: usize| ((u128::from(nominal) * u128::from(pixels) + i as u128) / u128::from(count)) as u64;
        let behind: Vec<usize> =
            (0..count as usize).filter(|&i| mine(i) && chains.states[i].place.step < end(i)).collect();
        if behind.is_empty() && film.tiles.iter().zip(ranges).all(|(tile, r)| tile.end.max(r[0]) >= r[1]) {
            return Pass::Nothing;
        }
        let Some(bootstrap) = self.bootstrap(mlt) else { return Pass::Interrupted(None) };
        let backup = film.clone();
        let (size, bounds, before) = (film.size(), film.bounds, film.total_samples());
        let stopped = AtomicBool::new(false);
        if let (Some(chains), Some(splats)) = (&mut film.chains, &mut film.splats) {
            let states: Vec<Mutex<ChainState>> =
                std::mem::take(&mut chains.states).into_iter().map(Mutex::new).collect();
            let splats = Mutex::new(splats);
            let tiles: Vec<_> = film.tiles.iter_mut().map(Mutex::new).collect();
            let canvas = Canvas { tiles: &tiles, splats: Some(&splats), chains: Some(&states) };
            let per_chain = pixels * u64::from(nominal) / count;
            self.each(behind.len(), |k, scratch, counts| {
                let i = behind[k];
                let mut state = locked(&states[i]).clone();
                let mut landed = Vec::new();
                let first = state.place.step;
                if !self.advance(mlt, bootstrap, i, &mut state, end(i), (scratch, &mut landed), counts) {
                    stopped.store(true, Ordering::Relaxed);
                    return false;
                }
                self.samples.fetch_add((end(i) - first).min(per_chain), Ordering::Relaxed);
                // A chain and what it has brought change together.
                let mut splats = locked(&splats);
                splats.add(&landed);
                *locked(&states[i]) = state;
                drop(splats);
                self.maybe_report(&size, found);
                self.maybe_store(&canvas, schedule, bounds);
                true
            });
            drop(tiles);
            chains.states =
                states.into_iter().map(|s| s.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
        }
        if stopped.into_inner() || self.cancel.load(Ordering::Relaxed) {
            let partial = std::mem::replace(film, backup);
            return Pass::Interrupted(Some(partial));
        }
        for (tile, &[first, end]) in film.tiles.iter_mut().zip(ranges) {
            if end > tile.end.max(first) {
                tile.begin_at(first);
                tile.extend(end, |_, range, stack| range.for_each(|_| stack.push(PixelSum::default())));
            }
        }
        self.samples.store(film.total_samples().max(before), Ordering::Relaxed);
        Pass::Done
    }

    /// Takes a chain to `end` steps. False if cancelled; then nothing of it counts.
    fn advance(
        &self,
        mlt: Mlt,
        bootstrap: &Bootstrap,
        index: usize,
        state: &mut ChainState,
        end: u64,
        (scratch, landed): (&mut Scratch<'w>, &mut Vec<Landed>),
        counts: &mut C,
    ) -> bool {
        let world = self.sampler.world;
        // Without any light there is nothing to explore.
        let Some(start) = bootstrap.start(world.settings().sampler.seed, index, mlt.parameters.chains as usize) else {
            state.place.step = end;
            return true;
        };
        let mut own = C::default();
        let place = std::mem::take(&mut state.place);
        // To look again at where it stands is work that is not counted.
        let mut chain = mlt.chain(world, [start, index as u64], place, scratch.paths(), counts);
        let mean = bootstrap.mean(chain.depth) as f32;
        while chain.place().step < end {
            if self.cancel.load(Ordering::Relaxed) {
                return false;
            }
            let step = catch_unwind(AssertUnwindSafe(|| mlt.step(world, &mut chain, mean, scratch.paths(), &mut own)));
            let Ok(lights) = step else {
                chain.reject();
                state.bad += 1;
                continue;
            };
            for (light, weight) in lights {
                if weight > 0.0 {
                    let value = light.splat.value * (weight * bootstrap.light as f32);
                    scratch.splats.clear();
                    scratch.splats.push(Splat { value, ..light.splat });
                    state.bad += u64::from(!self.sampler.land(scratch, &light.wavelengths, landed));
                }
            }
        }
        state.place = chain.place().clone();
        state.rays.merge(&own.rays());
        counts.merge(&own);
        true
    }
}
