//! Padded Sobol' points: every dimension (pair) is its own randomly shuffled and scrambled copy of the (0,2)-sequence
//! (Burley, "Practical hash-based Owen scrambling", JCGT 2020). The default sampler, so its path reads no table.

use super::{Randomization, SampleSource, SamplerSettings, pixel_hash, randomize_bits};
use crate::rng::{mix_bits, unit_f32};
use crate::sequence::{laine_karras, pascal};

/// Every aligned block of 2^k samples of a pixel is perfectly stratified in each 1D and 2D projection that was asked for.
///
/// The sequence goes on up to 2^32 samples and does not depend on how many are planned.
#[derive(Clone, Debug)]
pub struct PaddedSobolSampler {
    seed: u64,
    key: u64,
    reversed_index: u32,
    dimension: u32,
    randomization: Randomization,
}

impl PaddedSobolSampler {
    pub(super) fn randomization(&self) -> Randomization {
        self.randomization
    }

    pub(super) fn seed(&self) -> u64 {
        self.seed
    }

    pub(super) fn new(settings: &SamplerSettings) -> Self {
        Self { seed: settings.seed, key: 0, reversed_index: 0, dimension: 0, randomization: settings.randomization }
    }

    /// Hash of pixel, seed and dimension, and the sample index shuffled by it (an Owen scramble of the index, so that
    /// aligned blocks stay together).
    #[inline(always)]
    fn hash_and_index(&mut self, dimensions: u32) -> (u64, u32) {
        let hash = mix_bits(self.key.wrapping_add(u64::from(self.dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        self.dimension = self.dimension.wrapping_add(dimensions);
        let index = laine_karras(self.reversed_index, (hash ^ (hash >> 32)) as u32).reverse_bits();
        (hash, index)
    }
}

impl SampleSource for PaddedSobolSampler {
    #[inline(always)]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        self.key = pixel_hash(pixel, self.seed);
        self.reversed_index = sample_index.reverse_bits();
        self.dimension = dimension;
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline(always)]
    fn next_1d(&mut self) -> f32 {
        let (hash, index) = self.hash_and_index(1);
        // The van der Corput bits are the reversed index, and the fast scramble works on reversed bits: two reversals cancel.
        let bits = match self.randomization {
            Randomization::FastOwen => laine_karras(index, hash as u32).reverse_bits(),
            other => randomize_bits(index.reverse_bits(), other, hash as u32),
        };
        unit_f32(bits)
    }

    #[inline(always)]
    fn next_2d(&mut self) -> [f32; 2] {
        let (hash, index) = self.hash_and_index(2);
        let (x, y) = (index, pascal(index));
        let (seed_x, seed_y) = (hash as u32, (hash >> 32) as u32);
        match self.randomization {
            Randomization::FastOwen => {
                // One reversal of 64 bits is cheaper than two of 32; it swaps the halves.
                let pair = u64::from(laine_karras(x, seed_x)) << 32 | u64::from(laine_karras(y, seed_y));
                let reversed = pair.reverse_bits();
                [unit_f32(reversed as u32), unit_f32((reversed >> 32) as u32)]
            }
            other => [
                unit_f32(randomize_bits(x.reverse_bits(), other, seed_x)),
                unit_f32(randomize_bits(y.reverse_bits(), other, seed_y)),
            ],
        }
    }

    #[inline(always)]
    fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }
}
