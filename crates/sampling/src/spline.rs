//! Catmull-Rom splines through values at uneven nodes: weights, integrals, inverses, and sampling proportional to one
//! (Pharr, Jakob and Humphreys, Physically Based Rendering, 3rd ed., section 8.6).
//!
//! Slopes are central differences, one-sided at the ends. Nodes increase strictly; there are at least two.

use steradian_math::sqr;

/// The four nodes that a value in between depends on, and their weights. At the ends some are repeated with weight zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplineWeights {
    /// Indices of nodes.
    pub index: [usize; 4],
    /// Their weights; they add to one.
    pub weight: [f32; 4],
}

/// The spline on one interval: values at its ends, and slopes times its width.
#[derive(Clone, Copy, Debug)]
struct Segment {
    f: [f32; 2],
    d: [f32; 2],
}

impl Segment {
    #[inline]
    fn new(nodes: &[f32], i: usize, f: impl Fn(usize) -> f32) -> Self {
        let (x0, x1) = (nodes[i], nodes[i + 1]);
        let (f0, f1, width) = (f(i), f(i + 1), x1 - x0);
        let d0 = if i > 0 { width * (f1 - f(i - 1)) / (x1 - nodes[i - 1]) } else { f1 - f0 };
        let d1 = if i + 2 < nodes.len() { width * (f(i + 2) - f0) / (nodes[i + 2] - x0) } else { f1 - f0 };
        Self { f: [f0, f1], d: [d0, d1] }
    }

    /// Coefficients of the powers of `t`.
    #[inline]
    fn polynomial(&self) -> [f32; 4] {
        let ([f0, f1], [d0, d1]) = (self.f, self.d);
        [f0, d0, 3.0 * (f1 - f0) - 2.0 * d0 - d1, d0 + d1 - 2.0 * (f1 - f0)]
    }

    #[inline]
    fn eval(&self, t: f32) -> f32 {
        let [a, b, c, d] = self.polynomial();
        a + t * (b + t * (c + t * d))
    }

    #[inline]
    fn slope(&self, t: f32) -> f32 {
        let [_, b, c, d] = self.polynomial();
        b + t * (2.0 * c + t * 3.0 * d)
    }

    /// Integral from 0 to `t`, in units of the interval.
    #[inline]
    fn integral(&self, t: f32) -> f32 {
        let [a, b, c, d] = self.polynomial();
        t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
    }
}

/// The interval that holds `x`, which lies within the nodes.
#[inline]
fn interval(nodes: &[f32], x: f32) -> usize {
    nodes.partition_point(|&n| n <= x).saturating_sub(1).min(nodes.len() - 2)
}

/// A zero in `[0, 1]` of an increasing function with its slope, by Newton steps kept inside a shrinking interval.
#[inline]
fn solve(mut f: impl FnMut(f32) -> (f32, f32)) -> f32 {
    let (mut low, mut high, mut t) = (0.0f32, 1.0f32, 0.5f32);
    for _ in 0..40 {
        let (value, slope) = f(t);
        if value.abs() < 1e-7 || high - low < 1e-6 {
            break;
        }
        if value < 0.0 {
            low = t;
        } else {
            high = t;
        }
        let newton = t - value / slope;
        t = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    t
}

/// How the spline's value at `x` depends on its nodes; `None` outside of them.
#[inline]
pub fn spline_weights(nodes: &[f32], x: f32) -> Option<SplineWeights> {
    let last = nodes.len() - 1;
    if !(x >= nodes[0] && x <= nodes[last]) {
        return None;
    }
    let i = interval(nodes, x);
    let (x0, x1) = (nodes[i], nodes[i + 1]);
    let t = (x - x0) / (x1 - x0);
    let (t2, t3) = (sqr(t), sqr(t) * t);
    let (start, end) = (t3 - 2.0 * t2 + t, t3 - t2);
    let mut weight = [0.0, 2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, 0.0];
    if i > 0 {
        let w = start * (x1 - x0) / (x1 - nodes[i - 1]);
        weight[0] -= w;
        weight[2] += w;
    } else {
        weight[1] -= start;
        weight[2] += start;
    }
    if i + 2 <= last {
        let w = end * (x1 - x0) / (nodes[i + 2] - x0);
        weight[1] -= w;
        weight[3] += w;
    } else {
        weight[1] -= end;
        weight[2] += end;
    }
    Some(SplineWeights { index: [i.saturating_sub(1), i, i + 1, (i + 2).min(last)], weight })
}

/// The integral of the spline up to each node.
pub fn spline_integrals(nodes: &[f32], values: &[f32]) -> Vec<f32> {
    let mut sum = 0.0;
    let mut out = vec![0.0];
    for i in 0..nodes.len() - 1 {
        sum += (nodes[i + 1] - nodes[i]) * Segment::new(nodes, i, |k| values[k]).integral(1.0);
        out.push(sum);
    }
    out
}

/// Where an increasing spline takes the value `y`; the nearest end if nowhere.
pub fn invert_spline(nodes: &[f32], values: &[f32], y: f32) -> f32 {
    let last = nodes.len() - 1;
    if y >= values[last] {
        return nodes[last];
    }
    if y <= values[0] || y.is_nan() {
        return nodes[0];
    }
    let i = interval(values, y);
    let segment = Segment::new(nodes, i, |k| values[k]);
    nodes[i] + solve(|t| (segment.eval(t) - y, segment.slope(t))) * (nodes[i + 1] - nodes[i])
}

/// A point with density proportional to a spline given by its values and its integrals at the nodes, from a uniform `u`.
/// `None` if there is nothing to sample.
#[inline]
pub fn sample_spline(
    nodes: &[f32],
    values: impl Fn(usize) -> f32,
    integrals: impl Fn(usize) -> f32,
    u: f32,
) -> Option<f32> {
    let last = nodes.len() - 1;
    let total = integrals(last);
    if total <= 0.0 || total.is_nan() {
        return None;
    }
    let target = u * total;
    let (mut low, mut high) = (0, last);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if integrals(middle) <= target {
            low = middle;
        } else {
            high = middle;
        }
    }
    let width = nodes[low + 1] - nodes[low];
    let segment = Segment::new(nodes, low, values);
    let rest = (target - integrals(low)) / width;
    Some(nodes[low] + width * solve(|t| (segment.integral(t) - rest, segment.eval(t))))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [f32; 6] = [0.0, 0.1, 0.5, 1.0, 1.2, 2.0];
    const VALUES: [f32; 6] = [0.2, 0.5, 1.0, 1.4, 2.0, 2.1];

    fn eval(x: f32) -> f32 {
        let w = spline_weights(&NODES, x).unwrap();
        (0..4).map(|k| w.weight[k] * VALUES[w.index[k]]).sum()
    }

    #[test]
    fn the_spline_goes_through_its_nodes_and_has_straight_lines_for_straight_data() {
        for (x, y) in NODES.iter().zip(VALUES) {
            assert!((eval(*x) - y).abs() < 1e-6);
        }
        for i in 0..=40 {
            let x = i as f32 / 20.0;
            let w = spline_weights(&NODES, x).unwrap();
            let line: f32 = (0..4).map(|k| w.weight[k] * (3.0 * NODES[w.index[k]] - 1.0)).sum();
            // Straight data come back straight, except where one-sided slopes meet uneven nodes.
            assert!((line - (3.0 * x - 1.0)).abs() < 1e-5, "{x}: {line}");
        }
        assert!(spline_weights(&NODES, 2.1).is_none() && spline_weights(&NODES, f32::NAN).is_none());
    }

    #[test]
    fn integrals_inverses_and_samples_agree() {
        let integrals = spline_integrals(&NODES, &VALUES);
        let n = 20_000;
        let sum: f64 = (0..n).map(|i| f64::from(eval((i as f32 + 0.5) / n as f32 * 2.0)) * 2.0 / f64::from(n)).sum();
        assert!((sum - f64::from(integrals[5])).abs() < 1e-3);
        let mut previous = 0.0;
        for i in 0..1000 {
            let u = (i as f32 + 0.5) / 1000.0;
            let y = 0.2 + 1.9 * u;
            assert!((eval(invert_spline(&NODES, &VALUES, y)) - y).abs() < 1e-5);
            let x = sample_spline(&NODES, |k| VALUES[k], |k| integrals[k], u).unwrap();
            assert!(x > previous);
            // Between two samples lies the same area each time.
            if i > 0 {
                let area = eval(0.5 * (x + previous)) * (x - previous);
                assert!((area - integrals[5] / 1000.0).abs() < 1e-5, "{u}: {area}");
            }
            previous = x;
        }
        assert!(sample_spline(&NODES, |_| 0.0, |_| 0.0, 0.5).is_none());
    }
}
