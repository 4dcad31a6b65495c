//! Multiple importance sampling weights (Veach 1997, chapter 9), safe at zero and infinite densities.

/// Balance heuristic: the weight of the strategy with density `pdf`, taken `count` times, against the other one.
///
/// An infinite density (a Dirac lobe or light) takes all the weight; both zero gives zero.
#[inline]
pub fn balance_heuristic(count: f32, pdf: f32, other_count: f32, other_pdf: f32) -> f32 {
    ratio(count * pdf, other_count * other_pdf, |x| x)
}

/// Power heuristic with exponent 2; arguments as in [`balance_heuristic`].
#[inline]
pub fn power_heuristic(count: f32, pdf: f32, other_count: f32, other_pdf: f32) -> f32 {
    ratio(count * pdf, other_count * other_pdf, |x| x * x)
}

/// Power heuristic (exponent 2) for one sample of each strategy, the common case.
#[inline(always)]
pub fn power_weight(pdf: f32, other_pdf: f32) -> f32 {
    ratio(pdf, other_pdf, |x| x * x)
}

#[inline(always)]
fn ratio(a: f32, b: f32, f: impl Fn(f32) -> f32) -> f32 {
    if a.is_infinite() {
        // Two infinite densities share the weight, so that the weights still sum to one.
        return if b.is_infinite() { 0.5 } else { 1.0 };
    }
    // 1 / (1 + (b/a)^n) cannot overflow to inf/inf as a^n / (a^n + b^n) does.
    let share = 1.0 / (1.0 + f(b / a));
    if a > 0.0 { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_also_at_the_extremes() {
        for (a, b) in
            [(1.0, 2.0), (1e-30, 1e30), (1e30, 1e30), (f32::INFINITY, 3.0), (f32::INFINITY, f32::INFINITY), (0.0, 1.0)]
        {
            for f in [balance_heuristic, power_heuristic] {
                let sum = f(1.0, a, 1.0, b) + f(1.0, b, 1.0, a);
                assert!((sum - 1.0).abs() < 1e-6, "weights of {a} and {b} sum to {sum}");
            }
        }
        assert_eq!(power_heuristic(1.0, 0.0, 1.0, 0.0), 0.0);
        assert_eq!(balance_heuristic(1.0, 1.0, 3.0, 1.0), 0.25);
        assert!((power_weight(1.0, 2.0) - 0.2).abs() < 1e-7);
    }
}
