//! The Sobol' sequence spread over the image: one sequence, whose first two dimensions are the film position.

use super::{Randomization, SampleSource, SamplerSettings, randomize_bits};
use crate::rng::{hash_combine, unit_f32};
use crate::sequence::{SOBOL_DIMENSIONS, sobol_bits, sobol_index_of_pixel};

/// Sobol' points in up to 1024 dimensions; beyond that the dimensions are used again, scrambled differently.
#[derive(Clone, Debug)]
pub struct SobolSampler {
    seed: u64,
    randomization: Randomization,
    log2_resolution: u32,
    index: u64,
    dimension: u32,
}

impl SobolSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        let side = settings.resolution[0].max(settings.resolution[1]).clamp(1, 1 << 16);
        Self {
            seed: settings.seed,
            randomization: settings.randomization,
            log2_resolution: side.next_power_of_two().trailing_zeros(),
            index: 0,
            dimension: 2,
        }
    }

    #[inline]
    fn coordinate(&self, dimension: u32) -> f32 {
        let bits = sobol_bits(self.index, (dimension as usize - 2) % (SOBOL_DIMENSIONS - 2) + 2);
        unit_f32(randomize_bits(bits, self.randomization, hash_combine(self.seed, u64::from(dimension)) as u32))
    }

    #[inline]
    fn take(&mut self, count: u32) -> u32 {
        let first = self.dimension;
        self.dimension = first.checked_add(count).unwrap_or(2);
        first
    }
}

impl SampleSource for SobolSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        self.index = sobol_index_of_pixel(self.log2_resolution, u64::from(sample_index), pixel[0], pixel[1]);
        self.dimension = dimension.max(2);
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let dimension = self.take(1);
        self.coordinate(dimension)
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let dimension = self.take(2);
        [self.coordinate(dimension), self.coordinate(dimension.wrapping_add(1).max(2))]
    }

    #[inline]
    fn pixel_2d(&mut self) -> [f32; 2] {
        // The bits that chose the pixel are shifted out, what is left is the position inside it.
        [0, 1].map(|axis| unit_f32(sobol_bits(self.index, axis) << self.log2_resolution))
    }
}
