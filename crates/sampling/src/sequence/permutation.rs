//! A pseudo-random permutation evaluated one element at a time (Kensler, "Correlated multi-jittered sampling", 2013).

/// Element `index` of a pseudo-random permutation of `0..length` chosen by `seed`; an index beyond it is taken modulo `length`.
///
/// A bijective hash on the next power of two is repeated until it lands inside ("cycle walking"). `length` of zero gives zero.
pub fn permutation_element(index: u32, length: u32, seed: u32) -> u32 {
    if length <= 1 {
        return 0;
    }
    let mask = u32::MAX >> (length - 1).leading_zeros();
    let mut i = index % length;
    loop {
        i = masked_hash(i, mask, seed);
        if i < length {
            // The final rotation makes small permutations, where the hash alone is poor, start anywhere.
            return ((u64::from(i) + u64::from(seed)) % u64::from(length)) as u32;
        }
    }
}

/// Bijection of `0..=mask`: every step is invertible on that many bits. The constants are Kensler's.
#[inline]
fn masked_hash(mut i: u32, w: u32, p: u32) -> u32 {
    i ^= p;
    i = i.wrapping_mul(0xe170_893d);
    i ^= p >> 16;
    i ^= (i & w) >> 4;
    i ^= p >> 8;
    i = i.wrapping_mul(0x0929_eb3f);
    i ^= p >> 23;
    i ^= (i & w) >> 1;
    i = i.wrapping_mul(1 | (p >> 27));
    i = i.wrapping_mul(0x6935_fa69);
    i ^= (i & w) >> 11;
    i = i.wrapping_mul(0x74dc_b303);
    i ^= (i & w) >> 2;
    i = i.wrapping_mul(0x9e50_1cc3);
    i ^= (i & w) >> 2;
    i = i.wrapping_mul(0xc860_a3df);
    i &= w;
    i ^ (i >> 5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_length_and_seed_gives_a_permutation() {
        for length in [1u32, 2, 3, 7, 16, 17, 100, 257] {
            for seed in [0u32, 1, 0xdead_beef, u32::MAX] {
                let mut seen = vec![false; length as usize];
                for i in 0..length {
                    let e = permutation_element(i, length, seed) as usize;
                    assert!(!seen[e], "element {e} appears twice for length {length} and seed {seed}");
                    seen[e] = true;
                }
            }
        }
        assert_eq!(permutation_element(5, 0, 1), 0);
        assert!(permutation_element(7, u32::MAX, 3) < u32::MAX);
    }

    #[test]
    fn different_seeds_give_different_permutations() {
        let row = |seed| (0..16).map(|i| permutation_element(i, 16, seed)).collect::<Vec<_>>();
        assert_ne!(row(1), row(2));
    }
}
