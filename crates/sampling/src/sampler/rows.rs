//! Numbers for many samples side by side: the same ones that each sample alone would have got.

use super::pmj02bn::{dimension_hash, shuffled_in_prefixes};
use super::zsobol::{LowDigits, permute_base_4};
use super::{PaddedSobolSampler, Pmj02bnSampler, Randomization, SampleSource, Sampler, ZSobolSampler, pixel_hash};
use crate::rng::{mix_bits, mix_bits_32, unit_f32};
use crate::sequence::{laine_karras, pascal, pixel_net_bits};
use fearless_simd::{Level, dispatch};
use steradian_math::{ROW, Row, row_end};

/// A sample of a pixel, and the dimension that it has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplePlace {
    /// The pixel.
    pub pixel: [u32; 2],
    /// The number of the sample in its pixel.
    pub sample: u32,
    /// The next dimension.
    pub dimension: u32,
}

/// Points before their bits are scrambled, and what to scramble them by.
#[derive(Default)]
struct Raw {
    x: Row<u32>,
    y: Row<u32>,
    seed_x: Row<u32>,
    seed_y: Row<u32>,
}

impl Sampler {
    /// Whether [`Sampler::rows`] can be asked.
    pub fn has_rows(&self) -> bool {
        match self {
            Self::PaddedSobol(s) => s.randomization() == Randomization::FastOwen,
            Self::ZSobol(s) => s.randomization() == Randomization::FastOwen,
            Self::Pmj02bn(s) => s.randomization() == Randomization::FastOwen,
            Self::Independent(_) | Self::Stratified(_) | Self::Halton(_) | Self::Sobol(_) => false,
        }
    }

    /// The points of the dimensions `offsets[k]` after those at which the samples stand, to `out[k]`: what `next_2d` gives there, whose
    /// first number is what `next_1d` gives. Where the sampler stands afterwards is not said.
    ///
    /// # Panics
    /// If there are more samples than [`ROW`], or not [`Sampler::has_rows`].
    pub fn rows(&mut self, level: Level, samples: &[SamplePlace], offsets: &[u32], out: &mut [[Row; 2]]) {
        assert!(samples.len() <= ROW, "{} samples in a row", samples.len());
        let mut raw = Raw::default();
        match self {
            Self::PaddedSobol(sampler) => {
                let keys = sampler.keys(samples);
                for (&offset, out) in offsets.iter().zip(out) {
                    sampler.raw(level, samples, offset, &keys, &mut raw);
                    dispatch!(level, _simd => scramble(samples.len(), &raw, out));
                }
            }
            Self::ZSobol(sampler) => {
                let mortons = sampler.mortons(samples);
                for (&offset, out) in offsets.iter().zip(out) {
                    sampler.raw(level, samples, offset, &mortons, &mut raw);
                    dispatch!(level, _simd => scramble(samples.len(), &raw, out));
                }
            }
            Self::Pmj02bn(sampler) => {
                for (&offset, out) in offsets.iter().zip(out) {
                    sampler.raw(level, samples, offset, &mut raw);
                    dispatch!(level, _simd => scramble(samples.len(), &raw, out));
                }
            }
            other => panic!("{other:?} has no rows"),
        }
    }
}

#[inline(always)]
fn scramble(n: usize, raw: &Raw, out: &mut [Row; 2]) {
    for i in 0..row_end(n) {
        out[0].0[i] = unit_f32(laine_karras(raw.x.0[i], raw.seed_x.0[i]).reverse_bits());
        out[1].0[i] = unit_f32(laine_karras(pascal(raw.y.0[i]), raw.seed_y.0[i]).reverse_bits());
    }
}

impl PaddedSobolSampler {
    fn keys(&self, samples: &[SamplePlace]) -> Row<u64> {
        let mut keys = Row::default();
        for (i, s) in samples.iter().enumerate() {
            keys.0[i] = pixel_hash(s.pixel, self.seed());
        }
        keys
    }

    fn raw(&self, level: Level, samples: &[SamplePlace], offset: u32, keys: &Row<u64>, raw: &mut Raw) {
        for (i, s) in samples.iter().enumerate() {
            raw.x.0[i] = s.sample.reverse_bits();
            raw.y.0[i] = s.dimension.wrapping_add(offset);
        }
        dispatch!(level, _simd => shuffle(samples.len(), keys, raw));
    }
}

#[inline(always)]
fn shuffle(n: usize, keys: &Row<u64>, raw: &mut Raw) {
    for i in 0..row_end(n) {
        let hash = mix_bits(keys.0[i].wrapping_add(u64::from(raw.y.0[i]).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let index = laine_karras(raw.x.0[i], (hash ^ (hash >> 32)) as u32).reverse_bits();
        (raw.x.0[i], raw.y.0[i]) = (index, index);
        (raw.seed_x.0[i], raw.seed_y.0[i]) = (hash as u32, (hash >> 32) as u32);
    }
}

/// Places on the curve of [`ZSobolSampler`].
#[derive(Default)]
struct Mortons {
    /// The lower halves of the indices.
    low: Row<u32>,
    /// The upper half, which is the same everywhere, in its place.
    high: u64,
    /// Which bits vary, if all samples are of one round and stand at one dimension.
    varying: Option<u64>,
}

impl ZSobolSampler {
    fn mortons(&self, samples: &[SamplePlace]) -> Mortons {
        let mut mortons = Mortons::default();
        let Some(first) = samples.first() else { return mortons };
        let mut pixel = first.pixel;
        let (mut base, first_outside) = self.pixel_on_curve(pixel);
        let (within, round) = self.in_round(first.sample);
        let (morton, mut varying) = (base | within, 0);
        let mut alike = true;
        for (i, s) in samples.iter().enumerate() {
            if s.pixel != pixel {
                pixel = s.pixel;
                let outside;
                (base, outside) = self.pixel_on_curve(pixel);
                alike &= outside == first_outside;
            }
            let (within, r) = self.in_round(s.sample);
            mortons.low.0[i] = (base | within) as u32;
            varying |= (base | within) ^ morton;
            alike &= (r == round) & (s.dimension == first.dimension);
        }
        mortons.high = morton >> 32 << 32;
        mortons.varying = alike.then_some(varying);
        mortons
    }

    fn raw(&mut self, level: Level, samples: &[SamplePlace], offset: u32, mortons: &Mortons, raw: &mut Raw) {
        let Some(first) = samples.first() else { return };
        self.start(first.pixel, first.sample, first.dimension.wrapping_add(offset));
        if let Some(varying) = mortons.varying {
            // The high digits are those of the first sample; the low ones are shuffled side by side.
            let (index, hash) = self.place();
            let digits = self.low_digits(varying, index);
            if digits.are_in_low_half() {
                dispatch!(level, _simd => digits.shuffle_rows(samples.len(), mortons, hash, raw));
                return;
            }
        }
        for (i, s) in samples.iter().enumerate() {
            self.start(s.pixel, s.sample, s.dimension.wrapping_add(offset));
            let (index, hash) = self.place();
            raw.set(i, index, hash);
        }
    }
}

impl Pmj02bnSampler {
    fn raw(&mut self, level: Level, samples: &[SamplePlace], offset: u32, raw: &mut Raw) {
        let mut keys = Row::default();
        let (mut numbers, mut dimensions) = (Row::default(), Row::default());
        // The curve goes over pixels alone.
        let mut pixels = [SamplePlace { pixel: [0; 2], sample: 0, dimension: 0 }; ROW];
        for (i, &s) in samples.iter().enumerate() {
            pixels[i] = SamplePlace { sample: 0, ..s };
            keys.0[i] = pixel_hash(s.pixel, self.seed());
            (numbers.0[i], dimensions.0[i]) = (s.sample, s.dimension.wrapping_add(offset));
        }
        let pixels = &pixels[..samples.len()];
        let mortons = self.curve().mortons(pixels);
        self.curve().raw(level, pixels, offset, &mortons, raw);
        dispatch!(level, _simd => fill_pixels(samples.len(), &keys, &numbers, &dimensions, raw));
    }
}

/// From places of pixels on the curve to the bits of points.
#[inline(always)]
fn fill_pixels(n: usize, keys: &Row<u64>, numbers: &Row<u32>, dimensions: &Row<u32>, raw: &mut Raw) {
    for i in 0..row_end(n) {
        let sample = shuffled_in_prefixes(numbers.0[i], dimension_hash(keys.0[i], dimensions.0[i]));
        [raw.x.0[i], raw.y.0[i]] = pixel_net_bits(sample, raw.x.0[i]);
    }
}

impl Raw {
    #[inline(always)]
    fn set(&mut self, i: usize, index: u64, hash: u64) {
        (self.x.0[i], self.y.0[i]) = (index as u32, index as u32 ^ (index >> 32) as u32);
        (self.seed_x.0[i], self.seed_y.0[i]) = (hash as u32, (hash >> 32) as u32);
    }
}

impl LowDigits {
    /// The digits of [`LowDigits::are_in_low_half`] in 32 bits, as [`ZSobolSampler`] has them in 64.
    #[inline(always)]
    fn shuffle_rows(&self, n: usize, mortons: &Mortons, hash: u64, raw: &mut Raw) {
        let mut index = Row([self.kept as u32; ROW]);
        for digit in self.from..self.to {
            let shift = self.shift(digit);
            let above = mortons.high >> (shift + 2);
            let key = above as u32 ^ self.key_of(above);
            for i in 0..row_end(n) {
                let morton = mortons.low.0[i];
                let hash = mix_bits_32(morton >> (shift + 2) ^ key);
                index.0[i] |= permute_base_4(morton >> shift & 3, hash) << shift;
            }
        }
        if self.from == 1 {
            let above = mortons.high >> 1;
            let key = above as u32 ^ self.key_of(above);
            for i in 0..row_end(n) {
                let morton = mortons.low.0[i];
                index.0[i] |= (morton & 1) ^ (mix_bits_32(morton >> 1 ^ key) & 1);
            }
        }
        let high = (self.kept >> 32) as u32;
        for i in 0..row_end(n) {
            (raw.x.0[i], raw.y.0[i]) = (index.0[i], index.0[i] ^ high);
            (raw.seed_x.0[i], raw.seed_y.0[i]) = (hash as u32, (hash >> 32) as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SamplerKind, SamplerSettings};
    use super::*;

    /// The numbers of rows and those of the samples alone, for each of three offsets.
    fn hold_the_same(settings: &SamplerSettings, samples: &[SamplePlace]) {
        let (mut side_by_side, mut alone) = (Sampler::new(settings), Sampler::new(settings));
        assert!(side_by_side.has_rows());
        let mut out = [[Row::default(); 2]; 3];
        side_by_side.rows(Level::new(), samples, &[0, 1, 4], &mut out);
        for (i, s) in samples.iter().enumerate() {
            for (k, offset) in [0, 1, 4].into_iter().enumerate() {
                alone.start(s.pixel, s.sample, s.dimension + offset);
                assert_eq!([out[k][0].0[i], out[k][1].0[i]], alone.next_2d());
                alone.start(s.pixel, s.sample, s.dimension + offset);
                assert_eq!(out[k][0].0[i], alone.next_1d());
            }
        }
    }

    const KINDS: [SamplerKind; 3] = [SamplerKind::PaddedSobol, SamplerKind::ZSobol, SamplerKind::Pmj02bn];

    #[test]
    fn rows_hold_the_numbers_of_their_samples() {
        for kind in KINDS {
            let settings = SamplerSettings { kind, spp: 16, seed: 9, resolution: [40, 30], ..Default::default() };
            for n in [1, 7, 16, 33, ROW] {
                let samples: Vec<_> = (0..n as u32)
                    .map(|i| SamplePlace {
                        pixel: [3 + i / 16, 5 + i / 30],
                        sample: i % 19,
                        dimension: 2 + 7 * u32::from(i % 5 == 0) + 70 * u32::from(i % 11 == 0),
                    })
                    .collect();
                hold_the_same(&settings, &samples);
            }
        }
    }

    #[test]
    fn rows_of_one_dimension_hold_the_numbers_of_their_samples() {
        // Even and odd powers of two, small pictures and such as need more than 32 bits; pixels side by side, and pixels far apart.
        for kind in KINDS {
            for (spp, side) in [(16, 40), (8, 40), (1, 64), (2, 3000), (64, 60_000), (2048, 60_000)] {
                let settings = SamplerSettings { kind, spp, seed: 4, resolution: [side, side], ..Default::default() };
                for (step, first) in [(1, 0), (1, side - 5), (side / 5, 3)] {
                    let samples: Vec<_> = (0..ROW as u32)
                        .map(|i| SamplePlace {
                            pixel: [first + i / 16 * step, first / 2 + i % 3 * step],
                            sample: i % spp.min(7) as u32,
                            dimension: 9,
                        })
                        .collect();
                    hold_the_same(&settings, &samples);
                }
            }
        }
    }
}
