//! Additive recurrences: the golden ratio sequence and its generalisation R_d (Roberts, "The unreasonable
//! effectiveness of quasirandom sequences", 2018).

use crate::rng::unit_f64;
use steradian_math::ONE_MINUS_EPSILON;

/// Element `index` of the golden ratio sequence started at `offset`.
#[inline]
pub fn golden_ratio(index: u64, offset: f32) -> f32 {
    additive(index, 0x9e37_79b9_7f4a_7c15, offset)
}

/// Point `index` of the R2 sequence started at `offset`; the steps are the inverse powers of the plastic number.
#[inline]
pub fn r2(index: u64, offset: [f32; 2]) -> [f32; 2] {
    [additive(index, 0xc13f_a9a9_02a6_328f, offset[0]), additive(index, 0x91e1_0da5_c79e_7b1d, offset[1])]
}

/// Coordinate `axis` of point `index` of the R_d sequence in `dimensions` dimensions (at least one).
///
/// The step is phi^-(axis + 1), where phi is the positive root of x^(d + 1) = x + 1.
pub fn rd(index: u64, axis: u32, dimensions: u32) -> f32 {
    let power = |x: f64, n: u32| (0..n).fold(1.0, |p, _| p * x);
    let d = dimensions.max(1);
    let mut phi = 2.0f64;
    // Newton's method from above on a convex function: it descends monotonically.
    for _ in 0..64 {
        phi -= (power(phi, d + 1) - phi - 1.0) / (f64::from(d + 1) * power(phi, d) - 1.0);
    }
    let step = 1.0 / power(phi, axis + 1);
    additive(index, (step * 18_446_744_073_709_551_616.0) as u64, 0.0)
}

/// `offset + index * step` modulo one, in 64-bit fixed point so that large indices keep their precision.
#[inline(always)]
fn additive(index: u64, step: u64, offset: f32) -> f32 {
    let start = (f64::from(offset) * 18_446_744_073_709_551_616.0) as u64;
    (unit_f64(start.wrapping_add(index.wrapping_mul(step))) as f32).min(ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_the_inverse_powers() {
        assert!((golden_ratio(1, 0.0) - 0.618_034).abs() < 1e-6);
        let p = r2(1, [0.0; 2]);
        assert!((p[0] - 0.754_877_7).abs() < 1e-6 && (p[1] - 0.569_840_3).abs() < 1e-6);
        for i in [1u64, 10, 1000] {
            assert!((rd(i, 0, 1) - golden_ratio(i, 0.0)).abs() < 1e-5);
            assert!((rd(i, 1, 2) - r2(i, [0.0; 2])[1]).abs() < 1e-5);
        }
    }

    #[test]
    fn golden_points_have_at_most_three_gaps() {
        for n in [5usize, 34, 100] {
            let mut x: Vec<f32> = (0..n as u64).map(|i| golden_ratio(i, 0.0)).collect();
            x.sort_by(f32::total_cmp);
            let mut gaps: Vec<i64> = x.windows(2).map(|w| ((w[1] - w[0]) * 1e4).round() as i64).collect();
            gaps.sort_unstable();
            gaps.dedup_by(|a, b| (*a - *b).abs() <= 2);
            assert!(gaps.len() <= 3, "{n} points leave the gaps {gaps:?}");
        }
    }
}
