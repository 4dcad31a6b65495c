//! Independent uniform numbers from a counter-based hash (no state to carry: Salmon et al., "Parallel random numbers:
//! as easy as 1, 2, 3", 2011).

use super::{SampleSource, SamplerSettings, pixel_hash};
use crate::rng::{hash_combine, mix_bits, unit_f32};

/// Uniform and independent numbers: the baseline that the other samplers are compared with.
#[derive(Clone, Debug)]
pub struct IndependentSampler {
    seed: u64,
    key: u64,
    dimension: u32,
}

impl IndependentSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        Self { seed: settings.seed, key: 0, dimension: 0 }
    }

    #[inline(always)]
    fn bits(&self) -> u64 {
        // A SplitMix64 stream: the key is the start, the dimension counts golden steps.
        mix_bits(self.key.wrapping_add((u64::from(self.dimension) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)))
    }
}

impl SampleSource for IndependentSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        self.key = hash_combine(pixel_hash(pixel, self.seed), u64::from(sample_index));
        self.dimension = dimension;
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let bits = self.bits();
        self.dimension = self.dimension.wrapping_add(1);
        unit_f32((bits >> 32) as u32)
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let bits = self.bits();
        self.dimension = self.dimension.wrapping_add(2);
        [unit_f32((bits >> 32) as u32), unit_f32(bits as u32)]
    }

    #[inline]
    fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }
}
