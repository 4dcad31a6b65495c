//! Radical inverses: van der Corput, Halton and Hammersley points, with digit permutations and Owen scrambling.

use super::permutation::permutation_element;
use crate::rng::mix_bits;
use steradian_math::ONE_MINUS_EPSILON;

/// Number of Halton dimensions: as many as there are [`PRIMES`].
pub const HALTON_DIMENSIONS: usize = 1000;

/// The first thousand primes, the bases of the Halton sequence.
pub static PRIMES: [u16; HALTON_DIMENSIONS] = first_primes();

const fn first_primes() -> [u16; HALTON_DIMENSIONS] {
    let mut primes = [0u16; HALTON_DIMENSIONS];
    primes[0] = 2;
    let mut count = 1;
    let mut candidate = 3u16;
    while count < HALTON_DIMENSIONS {
        let mut i = 0;
        let mut prime = true;
        while (primes[i] as u32) * (primes[i] as u32) <= candidate as u32 {
            if candidate.is_multiple_of(primes[i]) {
                prime = false;
                break;
            }
            i += 1;
        }
        if prime {
            primes[count] = candidate;
            count += 1;
        }
        candidate += 2;
    }
    primes
}

/// Base-2 radical inverse as a fraction of 2^32.
#[inline(always)]
pub const fn van_der_corput(index: u32) -> u32 {
    index.reverse_bits()
}

/// Mirrors the digits of `index` in `base` (at least 2) at the radix point.
#[inline]
pub fn radical_inverse(base: u32, index: u64) -> f32 {
    digits_mirrored(base, index, false, |digit, _, _| digit)
}

/// As [`radical_inverse`], every digit permuted; the permutation depends on the digit's place and on `seed`.
#[inline]
pub fn permuted_radical_inverse(base: u32, index: u64, seed: u32) -> f32 {
    digits_mirrored(base, index, true, |digit, place, _| {
        let key = mix_bits(u64::from(seed) | u64::from(place) << 32) as u32;
        permutation_element(digit, base, key)
    })
}

/// As [`radical_inverse`], every digit permuted depending on `seed` and on all the digits before it (Owen 1995).
#[inline]
pub fn owen_radical_inverse(base: u32, index: u64, seed: u32) -> f32 {
    digits_mirrored(base, index, true, |digit, place, reversed| {
        let key = mix_bits(mix_bits(u64::from(seed) | u64::from(place) << 32) ^ reversed) as u32;
        permutation_element(digit, base, key)
    })
}

/// `all_places`: leading zeros are digits as well (they may be permuted), so go on until they no longer matter.
#[inline(always)]
fn digits_mirrored(base: u32, mut index: u64, all_places: bool, digit_map: impl Fn(u32, u32, u64) -> u32) -> f32 {
    if base < 2 {
        return 0.0;
    }
    let base_64 = u64::from(base);
    // Beyond this limit one more digit might overflow.
    let limit = u64::MAX / base_64 - base_64;
    let inverse_base = 1.0 / f64::from(base);
    let (mut reversed, mut scale, mut place) = (0u64, 1.0f64, 0u32);
    // 2^-26 is below the resolution of a f32 just under one.
    while reversed < limit && if all_places { index != 0 || scale > 1.0 / 67_108_864.0 } else { index != 0 } {
        let next = index / base_64;
        let digit = (index - next * base_64) as u32;
        reversed = reversed * base_64 + u64::from(digit_map(digit, place, reversed));
        scale *= inverse_base;
        place += 1;
        index = next;
    }
    ((reversed as f64 * scale) as f32).min(ONE_MINUS_EPSILON)
}

/// The index whose `digit_count` lowest digits, mirrored, are the integer `inverse`.
#[inline]
pub const fn inverse_radical_inverse(mut inverse: u64, base: u64, digit_count: u32) -> u64 {
    let mut index = 0;
    let mut i = 0;
    while i < digit_count {
        index = index * base + inverse % base;
        inverse /= base;
        i += 1;
    }
    index
}

/// Coordinate `dimension` (modulo [`HALTON_DIMENSIONS`]) of Halton point `index`.
#[inline]
pub fn halton(index: u64, dimension: usize) -> f32 {
    radical_inverse(u32::from(PRIMES[dimension % HALTON_DIMENSIONS]), index)
}

/// Point `index` of the two-dimensional Hammersley set of `count` points.
#[inline]
pub fn hammersley(index: u32, count: u32) -> [f32; 2] {
    let x = (f64::from(index) / f64::from(count.max(1))) as f32;
    [x.min(ONE_MINUS_EPSILON), crate::rng::unit_f32(van_der_corput(index))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primes_are_the_first_thousand() {
        assert_eq!(&PRIMES[..6], &[2, 3, 5, 7, 11, 13]);
        assert_eq!(PRIMES[999], 7919);
    }

    #[test]
    fn small_radical_inverses_have_their_closed_values() {
        assert_eq!(radical_inverse(2, 1), 0.5);
        assert_eq!(radical_inverse(2, 6), 0.375);
        assert_eq!(radical_inverse(3, 5), ((2.0 * 3.0 + 1.0) / 9.0f64) as f32);
        assert!(radical_inverse(2, u64::MAX) < 1.0);
        assert!(radical_inverse(7919, u64::MAX) < 1.0);
    }

    #[test]
    fn scrambled_inverses_hit_every_interval_once() {
        for (base, digits) in [(2u32, 6u32), (3, 4), (5, 3), (97, 1)] {
            let count = base.pow(digits);
            for f in [permuted_radical_inverse, owen_radical_inverse] {
                let mut seen = vec![false; count as usize];
                for i in 0..count {
                    // Half an interval of slack is not needed: the digits land exactly, only the f32 may round up.
                    let cell = (f64::from(f(base, u64::from(i), 0x9e37)) * f64::from(count) + 1e-4) as usize;
                    assert!(cell < count as usize && !seen[cell], "cell {cell} of base {base} is hit twice");
                    seen[cell] = true;
                }
            }
        }
    }

    #[test]
    fn inverse_of_the_radical_inverse() {
        for i in 0..243u64 {
            let mirrored = (f64::from(radical_inverse(3, i)) * 243.0).round() as u64;
            assert_eq!(inverse_radical_inverse(mirrored, 3, 5), i);
        }
    }
}
