//! Pearson's chi-square test of a sampling routine against the density that it claims to have.

use crate::integrate::integrate_rectangle;
use crate::random::TestRng;
use crate::special::chi_square_survival;
use std::f64::consts::TAU;
use std::fmt::Write;

/// How a chi-square test is done. The histogram has `columns * rows` cells and one more for samples that failed.
#[derive(Clone, Debug)]
pub struct ChiSquareTest {
    /// Cells along x, or along the azimuth.
    pub columns: usize,
    /// Cells along y, or along the polar axis (equal steps of the cosine; an even number puts a border on the equator).
    pub rows: usize,
    /// Number of samples drawn.
    pub samples: u32,
    /// Cells are pooled until this many samples are expected.
    pub min_expected: f64,
    /// Relative to one: the error of integration that is tolerated in each cell.
    pub tolerance: f64,
    /// Depth of subdivision when the density is integrated.
    pub depth: u32,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for ChiSquareTest {
    fn default() -> Self {
        Self { columns: 32, rows: 16, samples: 100_000, min_expected: 5.0, tolerance: 1e-7, depth: 5, seed: 1 }
    }
}

/// What came out.
#[derive(Clone, Debug)]
pub struct ChiSquareResult {
    /// Chance of a deviation at least this large if sampler and density agree.
    pub p_value: f64,
    /// The statistic.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub freedom: f64,
    /// Integral of the density over the domain.
    pub integral: f64,
    /// Fraction of the samples that failed.
    pub failed: f64,
    /// What happened, in words, with the worst cells.
    pub report: String,
}

impl ChiSquareResult {
    /// Panics with the report if the p-value is below `significance`, or the density's integral exceeds one.
    #[track_caller]
    pub fn assert(&self, significance: f64) {
        assert!(self.integral < 1.0 + 2e-3, "the density integrates to more than one\n{}", self.report);
        assert!(self.p_value > significance, "p-value below {significance:e}\n{}", self.report);
    }
}

impl ChiSquareTest {
    /// Tests directions of the unit sphere; `pdf` is per solid angle. A sample of `None` has failed, which the density must leave room for.
    pub fn sphere(
        &self,
        name: &str,
        mut sample: impl FnMut(&mut TestRng) -> Option<[f32; 3]>,
        pdf: impl Fn([f32; 3]) -> f32,
    ) -> ChiSquareResult {
        let place = |w: [f32; 3]| {
            let phi = f64::from(w[1]).atan2(f64::from(w[0]));
            [(phi / TAU).rem_euclid(1.0), 0.5 * (f64::from(w[2]) + 1.0)]
        };
        let density = |x: f64, y: f64| {
            let z = 2.0 * y - 1.0;
            let r = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (TAU * x).sin_cos();
            // Area on the sphere per area of the (azimuth, cosine) square.
            f64::from(pdf([(r * cos) as f32, (r * sin) as f32, z as f32])) * 2.0 * TAU
        };
        self.run(name, |rng| sample(rng).map(place), &density)
    }

    /// Tests points of the unit square; `pdf` is per area.
    pub fn square(
        &self,
        name: &str,
        mut sample: impl FnMut(&mut TestRng) -> Option<[f32; 2]>,
        pdf: impl Fn([f32; 2]) -> f32,
    ) -> ChiSquareResult {
        let density = |x: f64, y: f64| f64::from(pdf([x as f32, y as f32]));
        self.run(name, |rng| sample(rng).map(|p| p.map(f64::from)), &density)
    }

    fn run(
        &self,
        name: &str,
        mut sample: impl FnMut(&mut TestRng) -> Option<[f64; 2]>,
        density: &dyn Fn(f64, f64) -> f64,
    ) -> ChiSquareResult {
        let (nx, ny) = (self.columns, self.rows);
        let mut rng = TestRng::new(self.seed);
        let mut observed = vec![0u32; nx * ny + 1];
        for _ in 0..self.samples {
            let cell = match sample(&mut rng) {
                Some([x, y]) => ((y * ny as f64) as usize).min(ny - 1) * nx + ((x * nx as f64) as usize).min(nx - 1),
                None => nx * ny,
            };
            observed[cell] += 1;
        }
        let count = f64::from(self.samples);
        let mut expected = vec![0.0; nx * ny + 1];
        for y in 0..ny {
            for x in 0..nx {
                let side = |i: usize, n: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
                expected[y * nx + x] =
                    count * integrate_rectangle(density, side(x, nx), side(y, ny), self.tolerance, self.depth);
            }
        }
        let integral = expected.iter().sum::<f64>() / count;
        // What the density leaves out should be the failures; a rest below the accuracy of integration is none.
        let rest = 1.0 - integral;
        expected[nx * ny] = if rest > 1e-4 { count * rest } else { 0.0 };
        if expected[nx * ny] == 0.0 && f64::from(observed[nx * ny]) < 1e-3 * count {
            // A few failures at the rim of the random numbers are not worth a verdict.
            observed[nx * ny] = 0;
        }
        let failed = f64::from(observed[nx * ny]) / count;
        judge(name, self, &observed, &expected, integral, failed)
    }
}

fn judge(
    name: &str,
    test: &ChiSquareTest,
    observed: &[u32],
    expected: &[f64],
    integral: f64,
    failed: f64,
) -> ChiSquareResult {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut statistic, mut cells) = (0.0, 0u32);
    let (mut pool_expected, mut pool_observed) = (0.0, 0.0);
    let mut worst: Vec<(f64, usize)> = Vec::new();
    let mut impossible = 0;
    for &i in &order {
        if expected[i] == 0.0 {
            impossible += observed[i];
            continue;
        }
        pool_expected += expected[i];
        pool_observed += f64::from(observed[i]);
        if pool_expected >= test.min_expected {
            let term = (pool_observed - pool_expected) * (pool_observed - pool_expected) / pool_expected;
            statistic += term;
            cells += 1;
            worst.push((term, i));
            (pool_expected, pool_observed) = (0.0, 0.0);
        }
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let freedom = f64::from(cells.max(2) - 1);
    // A handful of samples may cross the border of the support by rounding.
    let p_value = if !statistic.is_finite() || f64::from(impossible) > 1e-4 * f64::from(test.samples) {
        0.0
    } else if cells < 2 {
        1.0
    } else {
        chi_square_survival(statistic, freedom)
    };
    let mut report = format!(
        "{name}: p-value {p_value:e}, chi-square {statistic:.1} with {freedom} degrees of freedom, density integrates to \
         {integral:.5}, {:.3} % of the samples failed, {impossible} samples where the density is zero\n",
        100.0 * failed
    );
    for &(term, i) in worst.iter().take(5) {
        let (x, y) = (i % test.columns, i / test.columns);
        let _ = writeln!(
            report,
            "  cell column {x} row {y}: {} observed, {:.1} expected, contributes {term:.1}",
            observed[i], expected[i]
        );
    }
    ChiSquareResult { p_value, statistic, freedom, integral, failed, report }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cosine(rng: &mut TestRng) -> Option<[f32; 3]> {
        let (r, phi) = (rng.f64().sqrt(), TAU * rng.f64());
        Some([(r * phi.cos()) as f32, (r * phi.sin()) as f32, (1.0 - r * r).sqrt() as f32])
    }

    #[test]
    fn right_density_passes_and_wrong_ones_fail() {
        let test = ChiSquareTest::default();
        let right = test.sphere("cosine", cosine, |w| w[2].max(0.0) / std::f32::consts::PI);
        right.assert(1e-6);
        assert!((right.integral - 1.0).abs() < 1e-5);
        let wrong = test.sphere("uniform", cosine, |w| if w[2] > 0.0 { 0.5 / std::f32::consts::PI } else { 0.0 });
        assert!(wrong.p_value < 1e-12);
        let shifted = test.sphere("tilted", cosine, |w| w[2].max(0.0) / std::f32::consts::PI * (1.0 + 0.1 * w[0]));
        assert!(shifted.p_value < 1e-12, "{}", shifted.report);
    }

    #[test]
    fn failures_have_to_be_paid_for() {
        let test = ChiSquareTest { columns: 8, rows: 8, ..Default::default() };
        let half = |rng: &mut TestRng| {
            let p = rng.f32_2d();
            (rng.f32() < 0.5).then_some(p)
        };
        test.square("half", half, |_| 0.5).assert(1e-6);
        assert!(test.square("whole", half, |_| 1.0).p_value < 1e-12);
    }

    #[test]
    fn p_values_of_a_true_hypothesis_are_spread_out() {
        let p: Vec<f64> = (0..200)
            .map(|seed| {
                let test = ChiSquareTest { columns: 6, rows: 6, samples: 2000, seed, ..Default::default() };
                test.square("uniform", |rng| Some(rng.f32_2d()), |_| 1.0).p_value
            })
            .collect();
        // Mean 1/2 with standard deviation 1/sqrt(12 * 200); six of them, false alarm 2e-9.
        let mean = p.iter().sum::<f64>() / 200.0;
        assert!((mean - 0.5).abs() < 6.0 / 2400.0f64.sqrt(), "mean p-value {mean}");
    }
}
