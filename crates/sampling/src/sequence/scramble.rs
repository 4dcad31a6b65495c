//! Owen scrambling: the exact tree version, and the hash of Laine and Karras with the constants of Vegdahl (2021,
//! "Building a better LK hash"), which does all the levels at once. See also Burley, "Practical hash-based Owen
//! scrambling", JCGT 2020.

use crate::rng::mix_bits;

/// Laine-Karras hash: every bit is flipped depending on the *lower* bits only. It is the Owen scramble of the bit-reversed number.
#[inline(always)]
pub const fn laine_karras(mut v: u32, seed: u32) -> u32 {
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^ v.wrapping_mul(0x53a2_2864)
}

/// Fast nested uniform scramble: every bit is flipped depending on the *higher* bits. Applied to a sample it is a
/// random Owen scramble, applied to an index it shuffles the sequence and keeps aligned power-of-two blocks together.
#[inline(always)]
pub const fn nested_uniform_scramble(v: u32, seed: u32) -> u32 {
    laine_karras(v.reverse_bits(), seed).reverse_bits()
}

/// The exact Owen scramble, one hash per bit: the reference for [`nested_uniform_scramble`].
pub fn owen_scramble(mut v: u32, seed: u32) -> u32 {
    v ^= (mix_bits(u64::from(seed)) as u32) & 0x8000_0000;
    for bit in 1..32u32 {
        // The flip of one digit depends on the digits above it, and on its depth so that a prefix of zeros is not special.
        let prefix = v >> (32 - bit);
        let key = (u64::from(bit) << 32 | u64::from(prefix)) ^ (u64::from(seed) << 37);
        if mix_bits(key ^ mix_bits(u64::from(seed))) & 1 == 1 {
            v ^= 1 << (31 - bit);
        }
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two numbers that share their first k bits must share the first k bits of the result, and bit k must differ.
    fn preserves_prefixes(f: impl Fn(u32) -> u32) {
        for k in 0..32u32 {
            let a = 0x5a3c_96e1u32;
            let b = a ^ (1 << (31 - k));
            assert_eq!((f(a) ^ f(b)).leading_zeros(), k, "prefix of length {k}");
        }
    }

    #[test]
    fn scrambles_are_nested() {
        for seed in [0, 1, 0x1234_5678, u32::MAX] {
            preserves_prefixes(|v| nested_uniform_scramble(v, seed));
            preserves_prefixes(|v| owen_scramble(v, seed));
        }
    }

    #[test]
    fn bits_flip_half_of_the_time_over_seeds() {
        for f in [nested_uniform_scramble as fn(u32, u32) -> u32, owen_scramble] {
            for bit in 0..32 {
                let flips = (0..4000u64)
                    .filter(|&s| {
                        let seed = mix_bits(s + 1) as u32;
                        (f(0x0f1e_2d3c, seed) ^ 0x0f1e_2d3c) >> bit & 1 == 1
                    })
                    .count();
                // Seven standard deviations of 31.6: false alarm below 1e-10 over the 64 checks.
                assert!((1779..=2221).contains(&flips), "bit {bit} flips {flips} times in 4000");
            }
        }
    }
}
