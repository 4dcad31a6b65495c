//! Stratified (jittered) sampling in every dimension pair, the strata visited in a random order per pixel and pair.

use super::{SampleSource, SamplerSettings, pixel_hash};
use crate::rng::{hash_combine, unit_f32};
use crate::sequence::permutation_element;
use steradian_math::ONE_MINUS_EPSILON;

/// One sample per cell of an `nx` by `ny` grid. Beyond `nx * ny` samples the grid is filled again, independently.
#[derive(Clone, Debug)]
pub struct StratifiedSampler {
    seed: u64,
    nx: u32,
    count: u32,
    ny: u32,
    jitter: bool,
    explicit: bool,
    key: u64,
    index: u32,
    round: u32,
    dimension: u32,
}

impl StratifiedSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        let explicit = settings.strata[0] > 0 && settings.strata[1] > 0;
        // 2^16 a side keeps the number of cells in a u32.
        let [nx, ny] = if explicit { settings.strata.map(|n| n.min(65_535)) } else { squarest_grid(settings.spp) };
        Self {
            seed: settings.seed,
            nx,
            ny,
            count: nx * ny,
            jitter: settings.jitter,
            explicit,
            key: 0,
            index: 0,
            round: 0,
            dimension: 0,
        }
    }

    pub(super) fn has_explicit_strata(&self) -> bool {
        self.explicit
    }

    /// The stratum of this sample in the current dimension, and a position inside it.
    #[inline]
    fn stratum(&self) -> (u32, [f32; 2]) {
        let order = hash_combine(self.key, u64::from(self.dimension) | u64::from(self.round) << 32);
        let stratum = permutation_element(self.index, self.count, order as u32);
        let bits = hash_combine(order, u64::from(self.index));
        let offset = if self.jitter { [unit_f32(bits as u32), unit_f32((bits >> 32) as u32)] } else { [0.5; 2] };
        (stratum, offset)
    }
}

/// The factorisation of `count` whose factors are closest, the larger one first.
fn squarest_grid(count: u32) -> [u32; 2] {
    let count = count.max(1);
    let mut ny = (f64::from(count)).sqrt() as u32;
    while ny > 1 && !count.is_multiple_of(ny) {
        ny -= 1;
    }
    let ny = ny.max(1);
    [count / ny, ny]
}

#[inline(always)]
fn place(stratum: u32, count: u32, offset: f32) -> f32 {
    (((f64::from(stratum) + f64::from(offset)) / f64::from(count)) as f32).min(ONE_MINUS_EPSILON)
}

impl SampleSource for StratifiedSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        self.key = pixel_hash(pixel, self.seed);
        self.index = sample_index % self.count;
        self.round = sample_index / self.count;
        self.dimension = dimension;
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let (stratum, offset) = self.stratum();
        self.dimension = self.dimension.wrapping_add(1);
        place(stratum, self.count, offset[0])
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let (stratum, offset) = self.stratum();
        self.dimension = self.dimension.wrapping_add(2);
        [place(stratum % self.nx, self.nx, offset[0]), place(stratum / self.nx, self.ny, offset[1])]
    }

    #[inline]
    fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }
}
