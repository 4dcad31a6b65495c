//! How evenly a point set fills the unit square.

/// Star discrepancy of points in the unit square: the largest difference between the share of points in a box anchored at
/// the origin and the box's area. Exact, in time `n^2 log n`.
pub fn star_discrepancy(points: &[[f32; 2]]) -> f64 {
    let n = points.len() as f64;
    if points.is_empty() {
        return 1.0;
    }
    let mut by_x: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::from)).collect();
    by_x.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // The supremum is at boxes whose sides pass through points (or end at 1), approached from inside or outside.
    let mut worst = 0.0f64;
    let mut ys: Vec<f64> = Vec::with_capacity(points.len());
    for i in 0..=by_x.len() {
        let x = if i < by_x.len() { by_x[i][0] } else { 1.0 };
        // Open box: points with a smaller x, which are in `ys` already.
        for j in 0..=ys.len() {
            let y = if j < ys.len() { ys[j] } else { 1.0 };
            let below = ys.partition_point(|&v| v < y) as f64;
            worst = worst.max(x * y - below / n);
        }
        // Closed box: points with the same x count as well.
        if i < by_x.len() {
            let at = ys.partition_point(|&v| v <= by_x[i][1]);
            ys.insert(at, by_x[i][1]);
            if by_x.get(i + 1).is_some_and(|next| next[0] == x) {
                continue;
            }
        }
        for &y in &ys {
            let within = ys.partition_point(|&v| v <= y) as f64;
            worst = worst.max(within / n - x * y);
        }
    }
    worst
}

/// L2 star discrepancy of points in the unit cube of any dimension (Warnock 1972): the root mean square over all anchored boxes.
///
/// Every point has the same number of coordinates; exact, in time `n^2 d`.
pub fn l2_star_discrepancy<P: AsRef<[f32]>>(points: &[P]) -> f64 {
    let n = points.len() as f64;
    let Some(first) = points.first() else { return 1.0 };
    let d = first.as_ref().len();
    let constant = (0..d).fold(1.0, |c, _| c / 3.0);
    let coordinate = |p: &P, k: usize| p.as_ref().get(k).map_or(0.0, |&v| f64::from(v));
    let single: f64 =
        points.iter().map(|p| (0..d).map(|k| 0.5 * (1.0 - coordinate(p, k) * coordinate(p, k))).product::<f64>()).sum();
    let pairs: f64 = points
        .iter()
        .map(|p| {
            let row = |q: &P| (0..d).map(|k| 1.0 - coordinate(p, k).max(coordinate(q, k))).product::<f64>();
            points.iter().map(row).sum::<f64>()
        })
        .sum();
    (constant - 2.0 / n * single + pairs / (n * n)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, unit_f32};
    use crate::sequence::sobol_02;

    #[test]
    fn closed_values() {
        // One point at the centre: the box that just includes it has a quarter of the area and the only point.
        assert!((star_discrepancy(&[[0.5, 0.5]]) - 0.75).abs() < 1e-12);
        assert!((star_discrepancy(&[[0.0, 0.0]]) - 1.0).abs() < 1e-12);
        // In one dimension, n centred points have L2 star discrepancy 1 / (2 n sqrt 3).
        let centred: Vec<[f32; 1]> = (0..8).map(|i| [(i as f32 + 0.5) / 8.0]).collect();
        assert!((l2_star_discrepancy(&centred) - 1.0 / (16.0 * 3.0f64.sqrt())).abs() < 1e-7);
    }

    #[test]
    fn star_discrepancy_equals_the_definition() {
        let mut rng = Rng::new(8, 1);
        for n in 1..12 {
            // Coordinates on a coarse grid make ties.
            let points: Vec<[f32; 2]> =
                (0..n).map(|_| [rng.below(5) as f32 / 5.0, rng.below(5) as f32 / 5.0]).collect();
            let mut worst = 0.0f64;
            for a in 0..=5u32 {
                for b in 0..=5u32 {
                    let (x, y) = (a as f32 / 5.0, b as f32 / 5.0);
                    let area = f64::from(x) * f64::from(y);
                    let open = points.iter().filter(|p| p[0] < x && p[1] < y).count() as f64 / f64::from(n);
                    let closed = points.iter().filter(|p| p[0] <= x && p[1] <= y).count() as f64 / f64::from(n);
                    worst = worst.max(area - open).max(closed - area);
                }
            }
            assert!((star_discrepancy(&points) - worst).abs() < 1e-9, "{points:?}");
        }
    }

    #[test]
    fn low_discrepancy_points_have_low_discrepancy() {
        let mut rng = Rng::new(5, 5);
        let random: Vec<_> = (0..256).map(|_| rng.f32_2d()).collect();
        let sobol: Vec<_> = (0..256).map(|i| sobol_02(i).map(unit_f32)).collect();
        assert!(star_discrepancy(&sobol) < 0.3 * star_discrepancy(&random));
        assert!(l2_star_discrepancy(&sobol) < 0.3 * l2_star_discrepancy(&random));
    }
}
