//! Progressive multi-jittered (0,2)-points for every pixel that also complement each other between pixels.
//!
//! Every power-of-two prefix of a (0,2)-sequence lies once in each elementary interval, which is what Christensen, Kensler and Kilpatrick
//! ("Progressive multi-jittered sample sequences", 2018) ask of their points; with Owen scrambling it is one of their random sequences (Helmer,
//! Christensen and Kensler, "Stochastic generation of (t, s) sample sequences", 2021). What is added here is how pixels differ.

use super::pascal;

/// Multiplies the bit vector `v` (lowest bit first) by Pascal's lower triangle modulo 2: the transpose of [`pascal`], its own inverse too.
#[inline(always)]
pub const fn pascal_transposed(mut v: u32) -> u32 {
    v ^= (v & 0x5555_5555) << 1;
    v ^= (v & 0x3333_3333) << 2;
    v ^= (v & 0x0f0f_0f0f) << 4;
    v ^= (v & 0x00ff_00ff) << 8;
    v ^ (v << 16)
}

/// Multiplies by an upper triangle with ones in its diagonal, which the second coordinate is free to have. This one was searched for among
/// products of shifts: with it any 2^k samples of an aligned block of 2^j x 2^j pixels, for k up to 7 and j up to 5, are a (t, k + 2j, 2)-net
/// with t of 1.5 in the mean and 3 at most; without it the mean is 2 and the most 6. (No choice gives 0 everywhere: that would be a (0, 4)-sequence.)
#[inline(always)]
const fn untangled(mut v: u32) -> u32 {
    v ^= (v >> 4) & 0x7777_7777;
    v ^= (v >> 6) & 0xeeee_eeee;
    v ^= (v >> 6) & 0x1111_1111;
    v ^ ((v >> 1) & 0x5555_5555)
}

/// The bits of point `sample` of the pixel with place `pixel` on a Z curve, before [`pascal`] is applied to the second; lowest bit first.
#[inline(always)]
pub const fn pixel_net_bits(sample: u32, pixel: u32) -> [u32; 2] {
    [sample ^ pascal_transposed(pixel), sample ^ pascal(untangled(pixel)).reverse_bits()]
}

/// Point `sample` of the pixel with place `pixel` on a Z curve, as fractions of 2^32; no table is read.
///
/// The points of a pixel are the first two Sobol' dimensions, shifted digit by digit. The shifts are such that, in each of the two
/// coordinates, the first 2^k samples of any aligned block of 2^j pixels lie one to each of 2^(k + j) equal intervals, for
/// *all* k and j with k + j up to 32. So what pixels have too much, their neighbours lack, at every power of two alike.
///
/// In words of matrices, U and L being Pascal's upper and lower triangles and B another upper one: x = s + L p and y = U s + L B p. The
/// first columns of U span what those of the identity span, the first of L B what those of L do, and rows k to k + j of the first j columns of
/// L have determinant 1 (binomial coefficients, Vandermonde), which proves the claim. L = U J U, where J reverses all bits, saves a step.
#[inline(always)]
pub const fn pixel_net(sample: u32, pixel: u32) -> [u32; 2] {
    let [x, y] = pixel_net_bits(sample, pixel);
    [x.reverse_bits(), pascal(y).reverse_bits()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::sobol_02;

    #[test]
    fn the_transpose_is_that_of_the_triangle() {
        for row in 0..32 {
            for column in 0..32 {
                assert_eq!(pascal_transposed(1 << column) >> row & 1, pascal(1 << row) >> column & 1);
            }
        }
        assert_eq!(pascal_transposed(pascal_transposed(0x1234_5678)), 0x1234_5678);
    }

    #[test]
    fn pixels_shift_the_sequence_digit_by_digit() {
        for pixel in [0, 1, 2, 77, 0x89ab_cdef] {
            let shift = pixel_net(0, pixel);
            for sample in [0, 1, 5, 1000, u32::MAX] {
                let [x, y] = sobol_02(sample);
                assert_eq!(pixel_net(sample, pixel), [x ^ shift[0], y ^ shift[1]]);
            }
        }
    }

    #[test]
    fn each_coordinate_of_a_block_of_pixels_is_stratified_for_any_number_of_samples() {
        for log_samples in 0..=8u32 {
            for log_pixels in 0..=8u32 {
                let n = log_samples + log_pixels;
                // Aligned blocks that are not the first, of samples and of pixels.
                for (first_sample, first_pixel) in [(0, 0), (0, 5 << log_pixels), (3 << log_samples, 1 << log_pixels)] {
                    let mut seen = vec![[false; 2]; 1 << n];
                    for s in first_sample..first_sample + (1 << log_samples) {
                        for p in first_pixel..first_pixel + (1 << log_pixels) {
                            for (axis, v) in pixel_net(s, p).into_iter().enumerate() {
                                let cell = (u64::from(v) << n >> 32) as usize;
                                assert!(
                                    !seen[cell][axis],
                                    "axis {axis}, 2^{log_samples} samples, 2^{log_pixels} pixels"
                                );
                                seen[cell][axis] = true;
                            }
                        }
                    }
                }
            }
        }
    }
}
