//! Pseudo-random numbers and hashes: PCG32 (O'Neill 2014) with jump-ahead (Brown 1994), and integer mixers in the
//! SplitMix64 family (Stafford's variant 13). All of them are pure functions of their arguments.

const PCG_MULTIPLIER: u64 = 6_364_136_223_846_793_005;
const GOLDEN_64: u64 = 0x9e37_79b9_7f4a_7c15;

/// Maps the top 24 bits of `bits` to `[0, 1)`.
///
/// Only bits that a `f32` can hold exactly are used, so nothing rounds up to 1 and no point leaves its stratum.
#[inline(always)]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Maps the top 53 bits of `bits` to `[0, 1)`.
#[inline(always)]
pub fn unit_f64(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// A bijection of 64-bit integers in which every input bit affects every output bit (Stafford's mix 13).
#[inline(always)]
pub const fn mix_bits(mut v: u64) -> u64 {
    v ^= v >> 30;
    v = v.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v ^= v >> 27;
    v = v.wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

/// A bijection of 32-bit integers, as [`mix_bits`] for half as many (constants of Wellons' search, "lowbias32").
#[inline(always)]
pub const fn mix_bits_32(mut v: u32) -> u32 {
    v ^= v >> 16;
    v = v.wrapping_mul(0x7feb_352d);
    v ^= v >> 15;
    v = v.wrapping_mul(0x846c_a68b);
    v ^ (v >> 16)
}

/// Joins a hash and one more word into a new hash; the order of the words matters.
#[inline(always)]
pub const fn hash_combine(hash: u64, word: u64) -> u64 {
    mix_bits(hash.wrapping_mul(GOLDEN_64) ^ word.wrapping_add(GOLDEN_64))
}

/// Hashes a sequence of words; sequences of different lengths differ.
#[inline]
pub fn hash_u64(words: &[u64]) -> u64 {
    words.iter().fold(mix_bits(words.len() as u64 ^ GOLDEN_64), |hash, &word| hash_combine(hash, word))
}

/// Hashes a sequence of words to a number in `[0, 1)`.
#[inline]
pub fn hash_f32(words: &[u64]) -> f32 {
    unit_f32((hash_u64(words) >> 32) as u32)
}

/// Hashes the bit patterns of floats; `-0.0` and `0.0` are the same.
#[inline]
pub fn hash_floats(values: &[f32]) -> u64 {
    values.iter().fold(mix_bits(values.len() as u64 ^ GOLDEN_64), |hash, &value| {
        hash_combine(hash, u64::from((value + 0.0).to_bits()))
    })
}

/// PCG32 (XSH-RR): 64 bits of state, 2^63 independent streams, period 2^64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    state: u64,
    increment: u64,
}

impl Rng {
    /// A generator for a `seed` within one of 2^63 streams.
    #[inline]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = Self { state: 0, increment: (stream << 1) | 1 };
        rng.u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.u32();
        rng
    }

    /// The next 32 uniform bits.
    #[inline]
    pub fn u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(PCG_MULTIPLIER).wrapping_add(self.increment);
        let word = (((old >> 18) ^ old) >> 27) as u32;
        word.rotate_right((old >> 59) as u32)
    }

    /// The next 64 uniform bits.
    #[inline]
    pub fn u64(&mut self) -> u64 {
        let high = u64::from(self.u32());
        (high << 32) | u64::from(self.u32())
    }

    /// The next uniform number in `[0, 1)`.
    #[inline]
    pub fn f32(&mut self) -> f32 {
        unit_f32(self.u32())
    }

    /// The next uniform number in `[0, 1)` in double precision.
    #[inline]
    pub fn f64(&mut self) -> f64 {
        unit_f64(self.u64())
    }

    /// The next uniform point of the unit square.
    #[inline]
    pub fn f32_2d(&mut self) -> [f32; 2] {
        let x = self.f32();
        [x, self.f32()]
    }

    /// A uniform integer in `0..bound`, without bias (Lemire 2019); `bound` of zero gives zero.
    #[inline]
    pub fn below(&mut self, bound: u32) -> u32 {
        if bound == 0 {
            return 0;
        }
        let threshold = bound.wrapping_neg() % bound;
        loop {
            let product = u64::from(self.u32()) * u64::from(bound);
            if product as u32 >= threshold {
                return (product >> 32) as u32;
            }
        }
    }

    /// Skips `delta` steps of [`Rng::u32`] in logarithmic time; the period wraps, so `-1i64 as u64` steps back.
    pub fn advance(&mut self, mut delta: u64) {
        let (mut multiplier, mut increment) = (PCG_MULTIPLIER, self.increment);
        let (mut total_multiplier, mut total_increment) = (1u64, 0u64);
        while delta > 0 {
            if delta & 1 == 1 {
                total_multiplier = total_multiplier.wrapping_mul(multiplier);
                total_increment = total_increment.wrapping_mul(multiplier).wrapping_add(increment);
            }
            increment = multiplier.wrapping_add(1).wrapping_mul(increment);
            multiplier = multiplier.wrapping_mul(multiplier);
            delta >>= 1;
        }
        self.state = total_multiplier.wrapping_mul(self.state).wrapping_add(total_increment);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pcg32_gives_the_published_demo_numbers() {
        // First outputs of the PCG reference demo for seed 42, stream 54.
        let mut rng = Rng::new(42, 54);
        let expected = [0xa15c_02b7u32, 0x7b47_f409, 0xba1d_3330, 0x83d2_f293, 0xbfa4_784b, 0xcbed_606e];
        for value in expected {
            assert_eq!(rng.u32(), value);
        }
    }

    #[test]
    fn advance_equals_stepping_and_wraps() {
        let mut stepped = Rng::new(7, 3);
        let mut jumped = stepped;
        for _ in 0..1234 {
            stepped.u32();
        }
        jumped.advance(1234);
        assert_eq!(stepped, jumped);
        jumped.advance((-1234i64) as u64);
        assert_eq!(jumped, Rng::new(7, 3));
    }

    #[test]
    fn unit_maps_stay_below_one() {
        assert_eq!(unit_f32(0), 0.0);
        assert!(unit_f32(u32::MAX) < 1.0);
        assert!(unit_f64(u64::MAX) < 1.0);
    }

    #[test]
    fn hashes_separate_order_length_and_sign_of_zero() {
        assert_ne!(hash_u64(&[1, 2]), hash_u64(&[2, 1]));
        assert_ne!(hash_u64(&[0]), hash_u64(&[0, 0]));
        assert_eq!(hash_floats(&[0.0]), hash_floats(&[-0.0]));
        assert!((0.0..1.0).contains(&hash_f32(&[9])));
    }

    #[test]
    fn below_is_unbiased_over_a_small_range() {
        let mut rng = Rng::new(1, 1);
        let mut counts = [0u32; 3];
        for _ in 0..30_000 {
            counts[rng.below(3) as usize] += 1;
        }
        // Six standard deviations of a binomial count: false alarm below 1e-8.
        assert!(counts.iter().all(|&c| (f64::from(c) - 10_000.0).abs() < 6.0 * (30_000.0f64 * 2.0 / 9.0).sqrt()));
    }
}
