//! Sobol' points (Sobol' 1967) with the direction numbers of Joe and Kuo (2008), and the index of the i-th point that
//! falls into a given pixel (Grünschloß, Raab and Keller, "Enumerating quasi-Monte Carlo point sequences in elementary
//! intervals", 2012).

/// Number of dimensions that have direction numbers.
pub const SOBOL_DIMENSIONS: usize = 1024;

/// Generator columns of every dimension: column `c` is XORed in when bit `c` of the index is set.
static COLUMNS: [[u32; 64]; SOBOL_DIMENSIONS] = generator_columns();

/// Expands the published parameters (see `data/README.md`) with the recurrence of the primitive polynomials.
const fn generator_columns() -> [[u32; 64]; SOBOL_DIMENSIONS] {
    let data = include_bytes!("../../data/joe-kuo-6-1024.bin");
    let mut columns = [[0u32; 64]; SOBOL_DIMENSIONS];
    let mut c = 0;
    while c < 32 {
        columns[0][c] = 0x8000_0000 >> c;
        c += 1;
    }
    let mut at = 0;
    let mut dimension = 1;
    while dimension < SOBOL_DIMENSIONS {
        let degree = data[at] as usize;
        let inner = data[at + 1] as u32 | (data[at + 2] as u32) << 8;
        at += 3;
        let mut c = 0;
        while c < 64 {
            columns[dimension][c] = if c < degree {
                let m = data[at + 2 * c] as u32 | (data[at + 2 * c + 1] as u32) << 8;
                m << (31 - c)
            } else {
                let mut v = columns[dimension][c - degree];
                v ^= v >> degree;
                let mut j = 1;
                while j < degree {
                    if (inner >> (degree - 1 - j)) & 1 == 1 {
                        v ^= columns[dimension][c - j];
                    }
                    j += 1;
                }
                v
            };
            c += 1;
        }
        at += 2 * degree;
        dimension += 1;
    }
    columns
}

/// Coordinate `dimension` (modulo [`SOBOL_DIMENSIONS`]) of Sobol' point `index`, as a fraction of 2^32.
#[inline]
pub fn sobol_bits(mut index: u64, dimension: usize) -> u32 {
    let columns = &COLUMNS[dimension % SOBOL_DIMENSIONS];
    let mut v = 0;
    while index != 0 {
        v ^= columns[index.trailing_zeros() as usize];
        index &= index - 1;
    }
    v
}

/// Multiplies the bit vector `v` (lowest bit first) by Pascal's upper triangle modulo 2.
///
/// The triangle is the fifth Kronecker power of `[[1, 1], [0, 1]]`, hence five steps. It is its own inverse.
#[inline(always)]
pub const fn pascal(mut v: u32) -> u32 {
    v ^= (v & 0xaaaa_aaaa) >> 1;
    v ^= (v & 0xcccc_cccc) >> 2;
    v ^= (v & 0xf0f0_f0f0) >> 4;
    v ^= (v & 0xff00_ff00) >> 8;
    v ^ (v >> 16)
}

/// The first two Sobol' dimensions of point `index`, a (0,2)-sequence, as fractions of 2^32; no table is read.
#[inline(always)]
pub const fn sobol_02(index: u32) -> [u32; 2] {
    [index.reverse_bits(), pascal(index).reverse_bits()]
}

/// Index of the `sample`-th Sobol' point that falls into pixel (`x`, `y`) of a square grid of 2^`log2_resolution` pixels a side.
///
/// The grid has at most 2^16 pixels a side. Bits `m..2m` of the index are the only unknowns: the low `m` bits are the
/// mirrored `x`, the high bits are `sample`. In the second dimension they enter by the matrix of binomials
/// `C(m + c, r)`, which is the Toeplitz matrix of `(1 + t)^m` times Pascal's triangle (Vandermonde's identity), and
/// both factors have closed inverses modulo 2.
pub fn sobol_index_of_pixel(log2_resolution: u32, sample: u64, x: u32, y: u32) -> u64 {
    let m = log2_resolution.min(16);
    if m == 0 {
        return sample;
    }
    let mask = (1u32 << m) - 1;
    let low = (x & mask).reverse_bits() >> (32 - m);
    let known = u64::from(low) | sample << (2 * m);
    // Bit r of `rest` is digit r of y that the unknown bits still have to produce.
    let rest = ((y & mask).reverse_bits() >> (32 - m)) ^ (sobol_bits(known, 1).reverse_bits() & mask);
    // (1 + t)^(2^k) = 1 + t^(2^k) modulo 2, so (1 + t)^(2^k - m) inverts (1 + t)^m modulo t^m when 2^k >= m.
    let mut exponent = m.next_power_of_two() - m;
    let mut divided = rest;
    while exponent > 0 {
        let power = exponent & exponent.wrapping_neg();
        divided ^= divided << power;
        exponent ^= power;
    }
    known | u64::from(pascal(divided & mask)) << m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_points_are_the_published_ones() {
        // Points 1..4 of the first three dimensions.
        let point = |i: u64| [0, 1, 2].map(|d| f64::from(sobol_bits(i, d)) / 4_294_967_296.0);
        assert_eq!(point(1), [0.5, 0.5, 0.5]);
        assert_eq!(point(2), [0.25, 0.75, 0.75]);
        assert_eq!(point(3), [0.75, 0.25, 0.25]);
        assert_eq!(point(4), [0.125, 0.625, 0.375]);
    }

    #[test]
    fn generator_matrices_are_unit_upper_triangular() {
        for (d, columns) in COLUMNS.iter().enumerate() {
            for c in 0..32 {
                assert_eq!(columns[c] << c, 0x8000_0000, "column {c} of dimension {d}");
            }
        }
    }

    #[test]
    fn bit_trick_equals_the_matrices() {
        for i in [0u32, 1, 2, 3, 0x1234_5678, 0xffff_ffff, 0xdead_beef] {
            assert_eq!(sobol_02(i), [sobol_bits(u64::from(i), 0), sobol_bits(u64::from(i), 1)]);
            assert_eq!(pascal(pascal(i)), i);
        }
    }

    #[test]
    fn pixel_points_fall_into_their_pixel() {
        for m in [1u32, 2, 3, 5, 7, 8, 11, 16] {
            let side = 1u32 << m;
            for k in 0..200u32 {
                let (x, y) = (k.wrapping_mul(2_654_435_761) % side, k.wrapping_mul(40_503).wrapping_add(k >> 3) % side);
                let sample = u64::from(k % 37);
                let index = sobol_index_of_pixel(m, sample, x, y);
                assert_eq!(index >> (2 * m), sample);
                assert_eq!((sobol_bits(index, 0) >> (32 - m), sobol_bits(index, 1) >> (32 - m)), (x, y));
            }
        }
    }

    #[test]
    fn every_elementary_interval_of_the_first_two_dimensions_is_hit_once() {
        for log2 in 0..10u32 {
            for split in 0..=log2 {
                let mut seen = vec![false; 1 << log2];
                // An aligned block that is not the first one, since samplers use those as well.
                for i in 0..1u32 << log2 {
                    let [x, y] = sobol_02((5 << log2) + i);
                    let cell = (u64::from(x) << split >> 32) << (log2 - split) | u64::from(y) << (log2 - split) >> 32;
                    assert!(!seen[cell as usize], "cell {cell} of {log2}/{split}");
                    seen[cell as usize] = true;
                }
            }
        }
    }
}
