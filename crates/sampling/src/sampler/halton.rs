//! The Halton sequence spread over the image (Keller; pbrt's pixel enumeration by the Chinese remainder theorem).

use super::{Randomization, SampleSource, SamplerSettings};
use crate::rng::hash_combine;
use crate::sequence::{
    HALTON_DIMENSIONS, PRIMES, inverse_radical_inverse, owen_radical_inverse, permuted_radical_inverse, radical_inverse,
};

/// The pattern repeats beyond this many pixels: more would cost precision and gain nothing.
const MAX_TILE: u32 = 128;

/// Halton points: dimension d is a radical inverse in the d-th prime; the first two are the position on a tile of pixels.
#[derive(Clone, Debug)]
pub struct HaltonSampler {
    seed: u64,
    randomization: Randomization,
    scales: [u64; 2],
    exponents: [u32; 2],
    /// `remainder_weights[i]` is 1 modulo `scales[i]` and 0 modulo the other scale.
    remainder_weights: [u64; 2],
    index: u64,
    dimension: u32,
}

impl HaltonSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        let mut scales = [1u64; 2];
        let mut exponents = [0u32; 2];
        for (axis, base) in [2u64, 3].into_iter().enumerate() {
            while scales[axis] < u64::from(settings.resolution[axis].min(MAX_TILE)) {
                scales[axis] *= base;
                exponents[axis] += 1;
            }
        }
        let weight = |scale: u64, other: u64| {
            // The scales are powers of 2 and 3, at most a few hundred: the search for the inverse is short and always ends.
            (0..scale).map(|k| k * other).find(|w| w % scale == 1 % scale).unwrap_or(0)
        };
        let remainder_weights = [weight(scales[0], scales[1]), weight(scales[1], scales[0])];
        Self {
            seed: settings.seed,
            randomization: settings.randomization,
            scales,
            exponents,
            remainder_weights,
            index: 0,
            dimension: 2,
        }
    }

    #[inline]
    fn coordinate(&self, dimension: u32) -> f32 {
        // Dimensions beyond the table use the bases again, with other digit permutations.
        let table = HALTON_DIMENSIONS as u32 - 2;
        let base = u32::from(PRIMES[((dimension - 2) % table) as usize + 2]);
        let hash = hash_combine(self.seed, u64::from(dimension)) as u32;
        match self.randomization {
            Randomization::None => radical_inverse(base, self.index),
            Randomization::PermuteDigits => permuted_radical_inverse(base, self.index, hash),
            Randomization::FastOwen | Randomization::Owen => owen_radical_inverse(base, self.index, hash),
        }
    }

    #[inline]
    fn take(&mut self, count: u32) -> u32 {
        let first = self.dimension;
        self.dimension = first.checked_add(count).unwrap_or(2);
        first
    }
}

impl SampleSource for HaltonSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        let stride = self.scales[0] * self.scales[1];
        let mut first = 0;
        for (axis, base) in [2u64, 3].into_iter().enumerate() {
            let place = u64::from(pixel[axis] % MAX_TILE);
            first += inverse_radical_inverse(place, base, self.exponents[axis]) * self.remainder_weights[axis];
        }
        self.index = first % stride + u64::from(sample_index) * stride;
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
        // The digits that chose the pixel are dropped, what is left is the position inside it.
        [radical_inverse(2, self.index >> self.exponents[0]), radical_inverse(3, self.index / self.scales[1])]
    }
}
