//! Progressive multi-jittered (0,2)-points with blue noise between pixels (Christensen, Kensler and Kilpatrick 2018), without a table:
//! see [`pixel_net`](crate::sequence::pixel_net).

use super::zsobol::ZSobolSampler;
use super::{Randomization, SampleSource, SamplerSettings, pixel_hash, randomize_bits};
use crate::rng::{mix_bits, unit_f32};
use crate::sequence::{laine_karras, pascal, pixel_net_bits};

/// Every power-of-two prefix of a pixel's samples is perfectly stratified in each 1D and 2D projection that was asked for, and so are, in
/// 1D, those of a block of pixels together: the error of the picture is high in frequency.
///
/// The sequence does not depend on how many samples are planned, other than that of `ZSobol`.
#[derive(Clone, Debug)]
pub struct Pmj02bnSampler {
    seed: u64,
    key: u64,
    sample: u32,
    /// The Z curve over pixels, whose quadrants are shuffled anew in each dimension.
    curve: ZSobolSampler,
}

/// The order of a pixel's samples in one dimension: blocks `2^k..2^(k + 1)` are shuffled each in itself, so that prefixes stay what they
/// are while dimensions have nothing to do with each other.
#[inline(always)]
pub(super) fn shuffled_in_prefixes(sample: u32, hash: u64) -> u32 {
    let shuffled = laine_karras(sample.reverse_bits(), (hash ^ (hash >> 32)) as u32).reverse_bits();
    let mut below = sample;
    below |= below >> 1;
    below |= below >> 2;
    below |= below >> 4;
    below |= below >> 8;
    below |= below >> 16;
    below >>= 1;
    (shuffled & below) | (sample & !below)
}

/// One hash for a pixel's dimension, by that of the pixel.
#[inline(always)]
pub(super) fn dimension_hash(key: u64, dimension: u32) -> u64 {
    mix_bits(key.wrapping_add(u64::from(dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

impl Pmj02bnSampler {
    pub(super) fn new(settings: &SamplerSettings) -> Self {
        let curve = ZSobolSampler::new(&SamplerSettings { spp: 1, ..*settings });
        Self { seed: settings.seed, key: 0, sample: 0, curve }
    }

    pub(super) fn randomization(&self) -> Randomization {
        self.curve.randomization()
    }

    pub(super) fn seed(&self) -> u64 {
        self.seed
    }

    pub(super) fn curve(&mut self) -> &mut ZSobolSampler {
        &mut self.curve
    }

    /// The point's bits before they are scrambled, as [`pixel_net_bits`], and what to scramble them by, which all pixels share.
    #[inline(always)]
    fn bits(&mut self) -> ([u32; 2], u64) {
        let hash = dimension_hash(self.key, self.curve.dimension());
        let (pixel, scramble) = self.curve.place();
        (pixel_net_bits(shuffled_in_prefixes(self.sample, hash), pixel as u32), scramble)
    }

    fn scrambled(&self, bits: u32, seed: u32) -> f32 {
        unit_f32(match self.randomization() {
            // As in padded Sobol': the fast scramble works on reversed bits, and two reversals cancel.
            Randomization::FastOwen => laine_karras(bits, seed).reverse_bits(),
            other => randomize_bits(bits.reverse_bits(), other, seed),
        })
    }
}

impl SampleSource for Pmj02bnSampler {
    #[inline]
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        self.key = pixel_hash(pixel, self.seed);
        self.sample = sample_index;
        self.curve.start(pixel, 0, dimension);
    }

    #[inline]
    fn dimension(&self) -> u32 {
        self.curve.dimension()
    }

    #[inline]
    fn next_1d(&mut self) -> f32 {
        let ([x, _], hash) = self.bits();
        self.curve.skip(1);
        self.scrambled(x, hash as u32)
    }

    #[inline]
    fn next_2d(&mut self) -> [f32; 2] {
        let ([x, y], hash) = self.bits();
        self.curve.skip(2);
        [self.scrambled(x, hash as u32), self.scrambled(pascal(y), (hash >> 32) as u32)]
    }

    #[inline]
    fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Sampler, SamplerKind};
    use super::*;
    use steradian_testkit::{ChiSquareTest, TestRng};

    const SIDE: u32 = 16;

    /// Mean square over blocks of `block` pixels a side of the error of the block's mean, for what share of `spp` points of a pixel lies
    /// beside a line through its centre, over seeds, dimensions and lines.
    fn block_error(kind: SamplerKind, spp: u32, block: u32) -> f64 {
        let (mut sum, mut count) = (0.0, 0u32);
        for seed in 0..120 {
            let mut sampler =
                Sampler::new(&SamplerSettings { kind, seed, spp, resolution: [SIDE, SIDE], ..Default::default() });
            let (sin, cos) = steradian_math::sin_cos(seed as f32);
            for k in 0..(SIDE / block).pow(2) {
                let (x0, y0) = (k % (SIDE / block) * block, k / (SIDE / block) * block);
                let mut below = 0u32;
                for i in 0..block * block * spp {
                    let pixel = [x0 + i / spp % block, y0 + i / spp / block];
                    sampler.start(pixel, i % spp, 4 + 2 * (seed as u32 % 8));
                    let [x, y] = sampler.next_2d();
                    below += u32::from((x - 0.5) * cos + (y - 0.5) * sin < 0.0);
                }
                sum += (f64::from(below) / f64::from(block * block * spp) - 0.5).powi(2);
                count += 1;
            }
        }
        sum / f64::from(count)
    }

    /// Neighbours make good what a pixel lacks: the mean of a block of pixels is nearer to the truth than with pixels that know nothing of
    /// each other. (Over many more seeds and lines the squares are 0.2 to 0.7 of the others; of Z-order points, made for one number, 0.2 to 0.5.)
    #[test]
    fn the_error_of_blocks_of_pixels_is_small_for_every_power_of_two() {
        for spp in [1, 2, 4, 16] {
            for block in [2, 4] {
                let [ours, padded] =
                    [SamplerKind::Pmj02bn, SamplerKind::PaddedSobol].map(|kind| block_error(kind, spp, block));
                assert!(ours < 0.8 * padded, "{spp} samples, {block} x {block} pixels: {ours:.2e} of {padded:.2e}");
            }
        }
    }

    /// Any one point is uniform over seeds, wherever it is.
    #[test]
    fn single_points_are_uniform() {
        for (pixel, sample, dimension) in [([0, 0], 0, 0), ([5, 12], 3, 8), ([15, 15], 1000, 70)] {
            let draw = |rng: &mut TestRng| {
                let settings = SamplerSettings { seed: rng.u64(), resolution: [SIDE, SIDE], ..Default::default() };
                let mut sampler = Pmj02bnSampler::new(&settings);
                sampler.start(pixel, sample, dimension);
                Some(sampler.next_2d())
            };
            ChiSquareTest::default().square("a point over seeds", draw, |_| 1.0).assert(1e-7);
        }
    }
}
