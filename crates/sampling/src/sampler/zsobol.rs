//! Z-order Sobol' sampling (Ahmed and Wonka, "Screen-space blue-noise diffusion of Monte Carlo sampling error via
//! hierarchical ordering of pixels", 2020; and pbrt's formulation of it).

use super::{Randomization, SampleSource, SamplerSettings, randomize_bits};
use crate::rng::{hash_combine, mix_bits, unit_f32};
use crate::sequence::pascal;

/// The samples of all pixels are consecutive points of one (0,2)-sequence along a Morton curve whose quadrants are
/// shuffled per dimension: neighbouring pixels get complementary samples. Needs to know the number of samples beforehand;
/// samples beyond it start an independent round.
#[derive(Clone, Debug)]
pub struct ZSobolSampler {
    seed: u64,
    randomization: Randomization,
    log2_spp: u32,
    base4_digits: u32,
    morton: u64,
    round_seed: u64,
    dimension: u32,
    pixel_part: PixelPart,
}

/// The digits of the index that all samples of a pixel share, by dimension, as they were last worked out. It saves most of the work where
/// the samples of a pixel are taken one after another, and changes no number.
#[derive(Clone, Debug)]
struct PixelPart {
    /// Place of the pixel along the curve, and the seed of the round.
    pixel: [u64; 2],
    known: u64,
    digits: Box<[u64; Self::DIMENSIONS]>,
}

impl PixelPart {
    const DIMENSIONS: usize = 64;

    fn new() -> Self {
        Self { pixel: [0; 2], known: 0, digits: Box::new([0; Self::DIMENSIONS]) }
    }

    #[inline]
    fn go_to(&mut self, pixel: [u64; 2]) {
        if pixel != self.pixel {
            self.pixel = pixel;
            self.known = 0;
        }
    }
}

impl ZSobolSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        // Rounded up: with a smaller power of two, samples of neighbouring pixels would be the same ones.
        let log2_spp = settings.spp.clamp(1, 1 << 24).next_power_of_two().trailing_zeros();
        let side = settings.resolution[0].max(settings.resolution[1]).clamp(1, 1 << 16).next_power_of_two();
        Self {
            seed: settings.seed,
            randomization: settings.randomization,
            log2_spp,
            base4_digits: side.trailing_zeros() + log2_spp.div_ceil(2),
            morton: 0,
            round_seed: settings.seed,
            dimension: 0,
            pixel_part: PixelPart::new(),
        }
    }

    /// The base-4 digits `from..to` of the Morton index, lowest first, each permuted by a hash of the higher ones.
    #[inline(always)]
    fn shuffled_digits(&self, from: u32, to: u32, key: u64) -> u64 {
        let odd = self.log2_spp & 1;
        let mut index = 0;
        for i in (from..to).rev() {
            let shift = 2 * i - odd;
            let digit = (self.morton >> shift) & 3;
            let hash = mix_bits(self.morton >> (shift + 2) ^ key);
            index |= permute_base_4(digit, (hash >> 24) as u32) << shift;
        }
        index
    }

    /// The point's place in the sequence: its Morton index with the digits permuted.
    #[inline]
    fn shuffled_index(&mut self) -> u64 {
        let odd = self.log2_spp & 1;
        let key = hash_combine(self.round_seed, u64::from(self.dimension));
        let (first_of_pixel, d) = (self.log2_spp.div_ceil(2), self.dimension as usize);
        let mut index = if d >= PixelPart::DIMENSIONS {
            self.shuffled_digits(first_of_pixel, self.base4_digits, key)
        } else if self.pixel_part.known >> d & 1 == 1 {
            self.pixel_part.digits[d]
        } else {
            let digits = self.shuffled_digits(first_of_pixel, self.base4_digits, key);
            self.pixel_part.digits[d] = digits;
            self.pixel_part.known |= 1 << d;
            digits
        };
        index |= self.shuffled_digits(odd, first_of_pixel, key);
        if odd == 1 {
            // An odd power of two leaves one binary digit at the end.
            index |= (self.morton & 1) ^ (mix_bits(self.morton >> 1 ^ key) & 1);
        }
        index
    }
}

/// The 24 permutations of four elements, two bits each, the image of 0 lowest.
const PERMUTATIONS: [u8; 24] = permutations_of_four();

const fn permutations_of_four() -> [u8; 24] {
    let mut table = [0; 24];
    let (mut count, mut code) = (0, 0u16);
    while code < 256 {
        let images = (1 << (code & 3)) | (1 << (code >> 2 & 3)) | (1 << (code >> 4 & 3)) | (1 << (code >> 6 & 3));
        if images == 0b1111 {
            table[count] = code as u8;
            count += 1;
        }
        code += 1;
    }
    table
}

/// Applies permutation number `which` of 24 to a base-4 digit.
#[inline(always)]
fn permute_base_4(digit: u64, which: u32) -> u64 {
    u64::from(PERMUTATIONS[which as usize % 24] >> (2 * digit) & 3)
}

/// Interleaves the bits of `x` (even places) and `y` (odd places).
#[inline(always)]
fn morton_2d(x: u32, y: u32) -> u64 {
    let spread = |v: u32| {
        let mut v = u64::from(v);
        v = (v | v << 16) & 0x0000_ffff_0000_ffff;
        v = (v | v << 8) & 0x00ff_00ff_00ff_00ff;
        v = (v | v << 4) & 0x0f0f_0f0f_0f0f_0f0f;
        v = (v | v << 2) & 0x3333_3333_3333_3333;
        (v | v << 1) & 0x5555_5555_5555_5555
    };
    spread(x) | spread(y) << 1
}

impl SampleSource for ZSobolSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        let round = u64::from(sample_index) >> self.log2_spp;
        let within = u64::from(sample_index) & ((1 << self.log2_spp) - 1);
        // Pixels outside the stated resolution (a filter's border) must not share points with those inside.
        let outside = u64::from(pixel[0] >> 16) | u64::from(pixel[1] >> 16) << 16;
        self.morton = morton_2d(pixel[0] & 0xffff, pixel[1] & 0xffff) << self.log2_spp | within;
        let beyond = if 2 * self.base4_digits - (self.log2_spp & 1) < 64 {
            self.morton >> (2 * self.base4_digits - (self.log2_spp & 1))
        } else {
            0
        };
        self.round_seed = hash_combine(hash_combine(self.seed, round), outside | beyond << 32);
        self.dimension = dimension;
        self.pixel_part.go_to([self.morton >> self.log2_spp, self.round_seed]);
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let index = self.shuffled_index();
        let hash = hash_combine(!self.round_seed, u64::from(self.dimension));
        self.dimension = self.dimension.wrapping_add(1);
        unit_f32(randomize_bits((index as u32).reverse_bits(), self.randomization, hash as u32))
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let index = self.shuffled_index();
        let hash = hash_combine(!self.round_seed, u64::from(self.dimension));
        self.dimension = self.dimension.wrapping_add(2);
        // Pascal's triangle of 64 columns has the triangle of 32 twice in its upper rows, hence the XOR of the halves.
        let x = (index as u32).reverse_bits();
        let y = pascal(index as u32 ^ (index >> 32) as u32).reverse_bits();
        [
            unit_f32(randomize_bits(x, self.randomization, hash as u32)),
            unit_f32(randomize_bits(y, self.randomization, (hash >> 32) as u32)),
        ]
    }

    #[inline]
    fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_24_permutations_are_different_and_complete() {
        let mut seen = std::collections::BTreeSet::new();
        for which in 0..24 {
            let row: Vec<u64> = (0..4).map(|d| permute_base_4(d, which)).collect();
            let mut sorted = row.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3]);
            seen.insert(row);
        }
        assert_eq!(seen.len(), 24);
    }

    #[test]
    fn neighbouring_pixels_share_one_net() {
        // 4 x 4 pixels with 4 samples each are 64 consecutive points of a (0,2)-sequence in every dimension pair.
        let settings = SamplerSettings { spp: 4, resolution: [16, 16], seed: 3, ..Default::default() };
        let mut sampler = ZSobolSampler::new(&settings);
        for log_x in 0..=6u32 {
            let (nx, ny) = (1usize << log_x, 1usize << (6 - log_x));
            let mut seen = [false; 64];
            for k in 0..64u32 {
                sampler.start([4 + k % 4, 8 + k / 4 % 4], k / 16, 10);
                let [x, y] = sampler.next_2d();
                let cell = (y * ny as f32) as usize * nx + (x * nx as f32) as usize;
                assert!(!seen[cell]);
                seen[cell] = true;
            }
        }
    }
}
