//! Samples of a few pixels made side by side, ahead of being asked for: the ones that each pixel alone would have got.

use crate::sample::PixelSampler;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use steradian_integrator::Batch;
use steradian_integrator::record::Count;
use steradian_sampling::Sampler;

/// Paths in a batch, about: enough for full rows after a few bounces, and few enough for the caches.
const PATHS: usize = 256;

/// A thread's batch and what has come out of it.
#[derive(Debug)]
pub(crate) struct Ahead {
    batch: Batch,
    colors: Vec<[f32; 3]>,
    /// Of these pixels of the tile.
    pixels: Range<usize>,
}

impl Ahead {
    /// Where the algorithm, the sampler and the record allow batches.
    pub fn new<C: Count>(sampler: &PixelSampler, numbers: &Sampler) -> Option<Self> {
        let batch = if C::LIGHT { None } else { sampler.batch(numbers) };
        batch.map(|batch| Self { batch, colors: Vec::new(), pixels: 0..0 })
    }

    /// Begins with the first pixel of a tile.
    pub fn begin(&mut self) {
        self.pixels = 0..0;
    }

    /// The colours of samples `range` of pixel `i` of `pixels`, which are asked for in order. `None` if something went wrong in one of the
    /// paths: then they are better made one by one.
    pub fn pixel<C: Count>(
        &mut self,
        sampler: &PixelSampler,
        numbers: &mut Sampler,
        (pixels, i): (&[[u32; 2]], usize),
        range: &Range<u32>,
        counts: &mut C,
    ) -> Option<&[[f32; 3]]> {
        let n = range.len();
        if i >= self.pixels.end {
            self.pixels = i..(i + PATHS.div_ceil(n.max(1))).min(pixels.len());
            self.colors.clear();
            let before = counts.clone();
            let run = catch_unwind(AssertUnwindSafe(|| {
                let chosen = &pixels[self.pixels.clone()];
                sampler.sample_many(&mut self.batch, numbers, chosen, range.clone(), counts, &mut self.colors);
            }));
            if run.is_err() {
                self.colors.clear();
                *counts = before;
            }
        }
        let first = (i - self.pixels.start) * n;
        self.colors.get(first..first + n)
    }
}
