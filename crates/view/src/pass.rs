//! Samples for a pane, until somebody wants something else: coarse pictures first, then passes over tiles.
//!
//! A sample is the same function of pixel and index as in any other render, and sums are taken in the same fixed tree: a pane that
//! has reached n samples holds the bits of `steradian render --spp n`.

use crate::canvas::{Canvas, UNKNOWN_ERROR, encode};
use crate::hub::lock;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use steradian_integrator::Scratch;
use steradian_integrator::record::RayCounts;
use steradian_render::{Film, Landed, PixelSampler, PixelSum, Splats, Tile};
use steradian_sampling::Sampler;

/// What it takes to render.
pub(crate) struct Work<'a, 'w> {
    /// Samples.
    pub pixels: &'a PixelSampler<'w>,
    /// Where what is done can be seen.
    pub canvas: &'a Mutex<Canvas>,
    /// Set when somebody wants something else.
    pub interrupt: &'a AtomicBool,
    /// Threads.
    pub threads: usize,
    /// Called for each tile, and each coarse picture: samples taken, rays traced.
    pub seen: &'a (dyn Fn(u64, u64) + Sync),
}

/// One sample: a colour, black where it went wrong; the rays it took.
fn sample<'w>(
    pixels: &PixelSampler<'w>,
    sampler: &mut Sampler,
    scratch: &mut Scratch<'w>,
    at: ([u32; 2], u32),
    rays: &mut RayCounts,
    landed: &mut Vec<Landed>,
) -> [f32; 3] {
    let one = catch_unwind(AssertUnwindSafe(|| {
        let sampled = pixels.sample(sampler, at.0, at.1, rays, scratch);
        let finite = sampled.rgb.iter().all(|v| v.is_finite());
        (finite && pixels.land(scratch, &sampled.wavelengths, landed)).then_some(sampled.rgb)
    }));
    one.ok().flatten().unwrap_or_default()
}

impl<'w> Work<'_, 'w> {
    fn stopped(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    fn on_all_threads(&self, work: impl Fn() + Sync) {
        std::thread::scope(|scope| {
            for _ in 1..self.threads.max(1) {
                scope.spawn(&work);
            }
            work();
        });
    }

    fn start(&self) -> (Sampler, Scratch<'w>) {
        (Sampler::new(&self.pixels.world.settings().sampler), Scratch::default())
    }

    /// One sample of every `stride`-th pixel. False if interrupted.
    pub fn coarse(&self, bounds: [u32; 4], stride: u32) -> bool {
        let [x0, x1, y0, y1] = bounds;
        let size = [x1 - x0, y1 - y0].map(|n| n.div_ceil(stride));
        let place = |i: u32, a: u32, b: u32| (a + i * stride + stride / 2).min(b - 1);
        let rows: Vec<Mutex<Vec<u16>>> = (0..size[1]).map(|_| Mutex::default()).collect();
        let (next, rays) = (AtomicUsize::new(0), AtomicU64::new(0));
        self.on_all_threads(|| {
            let (mut sampler, mut scratch) = self.start();
            loop {
                let row = next.fetch_add(1, Ordering::Relaxed);
                if row >= rows.len() || self.stopped() {
                    return;
                }
                let mut counts = RayCounts::default();
                let mut texels = Vec::with_capacity(size[0] as usize * 4);
                for i in 0..size[0] {
                    let pixel = [place(i, x0, x1), place(row as u32, y0, y1)];
                    let at = (pixel, 0);
                    let rgb = sample(self.pixels, &mut sampler, &mut scratch, at, &mut counts, &mut Vec::new());
                    texels.extend(encode(rgb, UNKNOWN_ERROR));
                }
                *lock(&rows[row]) = texels;
                rays.fetch_add(counts.total(), Ordering::Relaxed);
            }
        });
        if self.stopped() {
            return false;
        }
        let texels: Vec<u16> = rows.iter().flat_map(|row| std::mem::take(&mut *lock(row))).collect();
        lock(self.canvas).put_coarse(stride, size, texels);
        (self.seen)(u64::from(size[0]) * u64::from(size[1]), rays.into_inner());
        true
    }

    /// Brings tiles to the numbers of samples that `ends` says. Tiles that were not reached when interrupted stay as they were.
    pub fn tiles(&self, film: &mut Film, order: &[usize], ends: &[u32]) {
        let todo: Vec<usize> = order.iter().copied().filter(|&i| film.tiles[i].end < ends[i]).collect();
        let tiles: Vec<Mutex<&mut Tile>> = film.tiles.iter_mut().map(Mutex::new).collect();
        let splats = film.splats.as_mut().map(Mutex::new);
        let next = AtomicUsize::new(0);
        self.on_all_threads(|| {
            let (mut sampler, mut scratch) = self.start();
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                if k >= todo.len() || self.stopped() {
                    return;
                }
                let i = todo[k];
                let mut tile = lock(&tiles[i]).clone();
                if self.tile(&mut tile, ends[i], &mut sampler, &mut scratch, splats.as_ref()) {
                    if splats.is_none() {
                        lock(self.canvas).put(i, tile.samples(), texels_of(&tile));
                    }
                    **lock(&tiles[i]) = tile;
                }
            }
        });
    }

    /// Adds samples to a tile. False, with the tile of no use, if interrupted.
    fn tile(
        &self,
        tile: &mut Tile,
        end: u32,
        sampler: &mut Sampler,
        scratch: &mut Scratch<'w>,
        splats: Option<&Mutex<&mut Splats>>,
    ) -> bool {
        let (mut rays, mut landed, before) = (RayCounts::default(), Vec::new(), tile.samples());
        let mut whole = true;
        tile.extend(end, |pixel, range, stack| {
            whole &= !self.stopped();
            for index in range {
                let at = (pixel, index);
                let rgb =
                    if whole { sample(self.pixels, sampler, scratch, at, &mut rays, &mut landed) } else { [0.0; 3] };
                stack.push(PixelSum::of(rgb));
            }
        });
        if whole {
            tile.rays.merge(&rays);
            if let Some(splats) = splats {
                lock(splats).add(&landed);
            }
            (self.seen)(u64::from(tile.samples() - before) * tile.len() as u64, rays.total());
        }
        whole
    }
}

/// Relative standard error of a luminance; colours err together.
fn relative_error(mean: [f32; 3], variance: [f32; 3]) -> f32 {
    const Y: [f32; 3] = [0.2126, 0.7152, 0.0722];
    let sum = |v: [f32; 3]| Y[0] * v[0] + Y[1] * v[1] + Y[2] * v[2];
    let (y, deviation) = (sum(mean), sum(variance.map(f32::sqrt)));
    if !deviation.is_finite() {
        UNKNOWN_ERROR
    } else if deviation == 0.0 {
        0.0
    } else {
        (deviation / y.abs().max(1e-6)).min(UNKNOWN_ERROR)
    }
}

fn texels_of(tile: &Tile) -> Vec<u16> {
    let n = tile.samples();
    (0..tile.len())
        .flat_map(|i| {
            let sum = tile.sum(i);
            encode(sum.mean(n), relative_error(sum.mean(n), sum.variance_of_mean(n)))
        })
        .collect()
}

/// Shows the whole film again: for pictures whose samples bring light to other pixels.
pub(crate) fn show(film: &Film, canvas: &Mutex<Canvas>) {
    let width = film.size()[0];
    let all = film.map(|e| encode(e.mean, relative_error(e.mean, e.variance)));
    let mut canvas = lock(canvas);
    for (i, tile) in film.tiles.iter().enumerate() {
        let at = |k: usize| {
            let [x, y] = tile.pixel(k);
            (y - film.bounds[2]) as usize * width + (x - film.bounds[0]) as usize
        };
        let texels = (0..tile.len()).flat_map(|k| all[at(k)]).collect();
        canvas.put(i, tile.samples(), texels);
    }
}

/// Tiles from the middle of the picture outwards, which is where people look first.
pub(crate) fn from_the_middle(film: &Film) -> Vec<usize> {
    let [x0, x1, y0, y1] = film.bounds.map(i64::from);
    let far = |t: &Tile| {
        let [dx, dy] =
            [i64::from(2 * t.origin[0] + t.size[0]) - x0 - x1, i64::from(2 * t.origin[1] + t.size[1]) - y0 - y1];
        dx * dx + dy * dy
    };
    let mut order: Vec<usize> = (0..film.tiles.len()).collect();
    order.sort_by_key(|&i| (far(&film.tiles[i]), i));
    order
}
