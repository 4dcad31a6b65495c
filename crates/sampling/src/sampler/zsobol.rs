//! Z-order Sobol' sampling (Ahmed and Wonka, "Screen-space blue-noise diffusion of Monte Carlo sampling error via
//! hierarchical ordering of pixels", 2020; and pbrt's formulation of it).

use super::{Randomization, SampleSource, SamplerSettings, randomize_bits};
use crate::rng::{hash_combine, mix_bits_32, unit_f32};
use crate::sequence::{laine_karras, pascal};

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
    /// What the round's seed was made of.
    round: [u64; 2],
    memory: Memory,
}

/// What was last worked out for a dimension. A digit depends on the higher ones only, so the next sample of the pixel, or the pixel next
/// to it, changes few of them.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    morton: u64,
    index: u64,
    /// Hashes of round and dimension, for shuffling and for scrambling.
    key: u64,
    hash: u64,
}

/// [`Known`] of the first dimensions. It saves most of the work and changes no number.
#[derive(Clone, Debug)]
struct Memory {
    filled: u64,
    known: Box<[Known; Self::DIMENSIONS]>,
}

impl Memory {
    const DIMENSIONS: usize = 64;
}

/// The lowest digits of an index, which are still to be shuffled.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowDigits {
    /// The first base-4 digit: 1 where one binary digit comes before it.
    pub from: u32,
    /// The digit after the last.
    pub to: u32,
    /// All that lies above.
    pub kept: u64,
    key: u64,
}

impl LowDigits {
    /// Digits up to this one lie in the lower half of a Morton index, and so does the digit after it.
    const IN_LOW_HALF: u32 = 15;

    /// The place of base-4 digit `i` in a Morton index.
    #[inline(always)]
    pub fn shift(&self, i: u32) -> u32 {
        2 * i - self.from
    }

    /// Whether all digits that are to be shuffled lie in the lower half.
    pub fn are_in_low_half(&self) -> bool {
        self.to <= Self::IN_LOW_HALF
    }

    /// What the upper half of `above`, the digits above one that is to be permuted, adds to the hash of its lower half.
    #[inline(always)]
    pub fn key_of(&self, above: u64) -> u32 {
        let key = self.key ^ (above >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (key ^ key >> 32) as u32
    }

    /// Base-4 digit `i` of a Morton index in its place, permuted by a hash of the higher ones.
    #[inline(always)]
    fn shuffled(&self, i: u32, morton: u64) -> u64 {
        let shift = self.shift(i);
        let above = morton >> (shift + 2);
        let hash = mix_bits_32(above as u32 ^ self.key_of(above));
        u64::from(look_up_permuted((morton >> shift) as u32 & 3, hash)) << shift
    }

    /// The binary digit before the first.
    #[inline(always)]
    fn last_bit(&self, morton: u64) -> u64 {
        let above = morton >> 1;
        (morton & 1) ^ u64::from(mix_bits_32(above as u32 ^ self.key_of(above)) & 1)
    }
}

impl ZSobolSampler {
    pub(super) fn randomization(&self) -> Randomization {
        self.randomization
    }

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
            round: [u64::MAX; 2],
            memory: Memory { filled: 0, known: Box::new([Known::default(); Memory::DIMENSIONS]) },
        }
    }

    /// The Morton index of the first sample of a pixel, and a name for where it lies, other than 0 outside of the stated resolution.
    #[inline(always)]
    pub(super) fn pixel_on_curve(&self, pixel: [u32; 2]) -> (u64, u64) {
        // Pixels outside the stated resolution (a filter's border) must not share points with those inside.
        let outside = u64::from(pixel[0] >> 16) | u64::from(pixel[1] >> 16) << 16;
        let morton = morton_2d(pixel[0] & 0xffff, pixel[1] & 0xffff) << self.log2_spp;
        let bits = 2 * self.base4_digits - (self.log2_spp & 1);
        let beyond = if bits < 64 { morton >> bits } else { 0 };
        (morton, outside | beyond << 32)
    }

    /// The number of a sample within its round, and the number of the round.
    #[inline(always)]
    pub(super) fn in_round(&self, sample_index: u32) -> (u64, u64) {
        let index = u64::from(sample_index);
        (index & ((1 << self.log2_spp) - 1), index >> self.log2_spp)
    }

    /// The digits of the current dimension up to the highest of the bits `varying`; the higher ones are taken from `index`.
    #[inline]
    pub(super) fn low_digits(&self, varying: u64, index: u64) -> LowDigits {
        let key = match self.memory.known.get(self.dimension as usize) {
            Some(known) => known.key,
            None => hash_combine(self.round_seed, u64::from(self.dimension)),
        };
        let odd = self.log2_spp & 1;
        let to = if varying == 0 { odd } else { (63 - varying.leading_zeros() + odd) / 2 + 1 };
        self.digits_below(to, index, key)
    }

    #[inline(always)]
    fn digits_below(&self, to: u32, index: u64, key: u64) -> LowDigits {
        let odd = self.log2_spp & 1;
        let to = to.min(self.base4_digits);
        let shift = 2 * to - odd;
        LowDigits { from: odd, to, key, kept: if shift < 64 { index >> shift << shift } else { 0 } }
    }

    /// The Morton index with its lowest digits, up to number `to`, permuted; the higher ones are taken from `index`.
    #[inline(always)]
    fn shuffled(&self, to: u32, index: u64, key: u64) -> u64 {
        let digits = self.digits_below(to, index, key);
        let index =
            (digits.from..digits.to).rev().fold(digits.kept, |index, i| index | digits.shuffled(i, self.morton));
        // An odd power of two leaves one binary digit at the end.
        if digits.from == 1 { index | digits.last_bit(self.morton) } else { index }
    }

    /// Goes on by some dimensions.
    #[inline(always)]
    pub(super) fn skip(&mut self, dimensions: u32) {
        self.dimension = self.dimension.wrapping_add(dimensions);
    }

    /// The point's place in the sequence, which is its Morton index with the digits permuted, and a hash of the dimension.
    #[inline]
    pub(super) fn place(&mut self) -> (u64, u64) {
        let d = self.dimension as usize;
        let key = || hash_combine(self.round_seed, u64::from(self.dimension));
        let hash = || hash_combine(!self.round_seed, u64::from(self.dimension));
        if d >= Memory::DIMENSIONS {
            return (self.shuffled(self.base4_digits, 0, key()), hash());
        }
        let mut known = self.memory.known[d];
        if self.memory.filled >> d & 1 == 0 {
            (known.key, known.hash) = (key(), hash());
            known.index = self.shuffled(self.base4_digits, 0, known.key);
            self.memory.filled |= 1 << d;
        } else {
            let changed = self.morton ^ known.morton;
            if changed != 0 {
                let digit = (63 - changed.leading_zeros() + (self.log2_spp & 1)) / 2;
                known.index = self.shuffled(digit + 1, known.index, known.key);
            }
        }
        known.morton = self.morton;
        self.memory.known[d] = known;
        (known.index, known.hash)
    }
}

/// One of the 24 permutations of a base-4 digit, as likely as any other: the digits are parted into two pairs, in one of three ways; then
/// the pairs change places or not, and so do the two of each pair. Arithmetic, so that loops over rows need no table.
#[inline(always)]
pub(super) const fn permute_base_4(digit: u32, hash: u32) -> u32 {
    permuted(digit, way_of(hash), hash)
}

/// Which of the three ways: 0, 1 or 2.
#[inline(always)]
const fn way_of(hash: u32) -> u32 {
    ((hash >> 16) + 2 * (hash >> 16)) >> 16
}

#[inline(always)]
const fn permuted(digit: u32, way: u32, flips: u32) -> u32 {
    let (high, low) = (digit >> 1, digit & 1);
    let (crossed, diagonal) = (way & 1, way >> 1);
    let differ = high ^ low;
    let pair = high ^ (differ & crossed) ^ (low & diagonal);
    let member = low ^ (differ & crossed);
    let flip = (flips >> 1) ^ (pair & (flips >> 2));
    (pair ^ (flips & 1)) << 1 | (member ^ (flip & 1))
}

/// The same permutations, the images of the four digits in two bits each, by the three bits that flip and then the way.
static PERMUTATIONS: [u8; 24] = {
    let mut table = [0; 24];
    let mut i = 0;
    while i < 96 {
        table[i / 4] |= (permuted(i as u32 % 4, i as u32 / 32, i as u32 / 4 % 8) as u8) << (2 * (i % 4));
        i += 1;
    }
    table
};

/// As [`permute_base_4`], faster for one digit alone.
#[inline(always)]
fn look_up_permuted(digit: u32, hash: u32) -> u32 {
    u32::from(PERMUTATIONS[(way_of(hash) << 3 | (hash & 7)) as usize] >> (2 * digit)) & 3
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
        let (morton, outside) = self.pixel_on_curve(pixel);
        let (within, round) = self.in_round(sample_index);
        let round = [round, outside];
        self.morton = morton | within;
        if self.round != round {
            self.round = round;
            self.round_seed = hash_combine(hash_combine(self.seed, round[0]), round[1]);
            self.memory.filled = 0;
        }
        self.dimension = dimension;
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let (index, hash) = self.place();
        self.skip(1);
        let (x, seed) = (index as u32, hash as u32);
        // As in padded Sobol': the fast scramble works on reversed bits, and two reversals cancel.
        unit_f32(match self.randomization {
            Randomization::FastOwen => laine_karras(x, seed).reverse_bits(),
            other => randomize_bits(x.reverse_bits(), other, seed),
        })
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let (index, hash) = self.place();
        self.skip(2);
        // Pascal's triangle of 64 columns has the triangle of 32 twice in its upper rows, hence the XOR of the halves.
        let (x, y) = (index as u32, pascal(index as u32 ^ (index >> 32) as u32));
        let (seed_x, seed_y) = (hash as u32, (hash >> 32) as u32);
        match self.randomization {
            Randomization::FastOwen => {
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
            // Three ways to make pairs, eight to flip.
            let hash = ((which / 8) * 0x5556_0000) | (which % 8);
            let row: Vec<u32> = (0..4).map(|d| permute_base_4(d, hash)).collect();
            assert!((0..4).all(|d| look_up_permuted(d, hash) == row[d as usize]));
            let mut sorted = row.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3]);
            seen.insert(row);
        }
        assert_eq!(seen.len(), 24);
    }

    #[test]
    fn what_is_remembered_changes_no_number() {
        for spp in [1, 2, 8, 16, 100] {
            let settings = SamplerSettings { spp, resolution: [40, 24], seed: 3, ..Default::default() };
            let mut old = ZSobolSampler::new(&settings);
            let mut rng = crate::Rng::new(5, u64::from(spp));
            let (mut pixel, mut sample) = ([0, 0], 0);
            for _ in 0..2000 {
                // Mostly the next sample, sometimes another pixel, now and then one far outside or another round.
                match rng.below(8) {
                    0 => pixel = [rng.below(40), rng.below(24)],
                    1 => (pixel, sample) = ([rng.below(1 << 20), rng.below(1 << 10)], rng.below(300)),
                    _ => sample = (sample + 1) % 130,
                }
                let mut new = ZSobolSampler::new(&settings);
                let dimension = if rng.below(9) == 0 { 60 } else { 0 };
                old.start(pixel, sample, dimension);
                new.start(pixel, sample, dimension);
                for _ in 0..4 {
                    assert_eq!((old.next_1d(), old.next_2d()), (new.next_1d(), new.next_2d()));
                }
            }
        }
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
