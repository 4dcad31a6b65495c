//! Adaptive integration over rectangles, for the expected counts of histograms.

/// Gauss-Legendre points and weights on `[-1, 1]`, four points.
const NODES: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Integral of `f` over `[x0, x1] x [y0, y1]`; quarters are split while they change the result by more than `tolerance`, down to `depth` levels.
///
/// The first two levels are always done. A peak much narrower than a twentieth of a side may still be overlooked.
pub fn integrate_rectangle(
    f: &dyn Fn(f64, f64) -> f64,
    [x0, x1]: [f64; 2],
    [y0, y1]: [f64; 2],
    tolerance: f64,
    depth: u32,
) -> f64 {
    refine(f, [x0, x1], [y0, y1], f64::INFINITY, tolerance, depth)
}

fn refine(
    f: &dyn Fn(f64, f64) -> f64,
    [x0, x1]: [f64; 2],
    [y0, y1]: [f64; 2],
    whole: f64,
    tolerance: f64,
    depth: u32,
) -> f64 {
    let (xm, ym) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    let quarters = [([x0, xm], [y0, ym]), ([xm, x1], [y0, ym]), ([x0, xm], [ym, y1]), ([xm, x1], [ym, y1])];
    let parts = quarters.map(|(x, y)| gauss(f, x, y));
    let sum: f64 = parts.iter().sum();
    if depth == 0 || (sum - whole).abs() <= tolerance {
        return sum;
    }
    // Nothing was known before the first level, so the second one is the first that can be trusted.
    let known = |part| if whole.is_finite() { part } else { f64::MAX };
    quarters.iter().zip(parts).map(|(&(x, y), part)| refine(f, x, y, known(part), 0.5 * tolerance, depth - 1)).sum()
}

fn gauss(f: &dyn Fn(f64, f64) -> f64, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> f64 {
    let (cx, hx, cy, hy) = (0.5 * (x0 + x1), 0.5 * (x1 - x0), 0.5 * (y0 + y1), 0.5 * (y1 - y0));
    let mut sum = 0.0;
    for (x, wx) in NODES {
        for (y, wy) in NODES {
            sum += wx * wy * f(cx + hx * x, cy + hy * y);
        }
    }
    sum * hx * hy
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_peaked_and_cut_functions() {
        let f = |x: f64, y: f64| x * x * y;
        assert!((integrate_rectangle(&f, [0.0, 3.0], [1.0, 2.0], 1e-9, 6) - 13.5).abs() < 1e-12);
        let peak = |x: f64, y: f64| (-(x * x + y * y) * 1e3).exp();
        let expected = std::f64::consts::PI / 1e3;
        assert!((integrate_rectangle(&peak, [-1.0, 1.0], [-1.0, 1.0], 1e-9, 12) / expected - 1.0).abs() < 1e-4);
        let cut = |x: f64, y: f64| f64::from(u8::from(x + 0.7 * y < 0.9));
        assert!((integrate_rectangle(&cut, [0.0, 1.0], [0.0, 1.0], 1e-6, 9) - 0.55).abs() < 1e-4);
    }
}
