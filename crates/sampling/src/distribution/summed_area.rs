//! Summed-area tables (Crow 1984), and sampling a piecewise constant density restricted to a window, as portals need it
//! (Bitterli, Novák and Jarosz, "Portal-masked environment map sampling", 2015).

use super::is_density;
use steradian_math::ONE_MINUS_EPSILON;

/// Sums of a grid of numbers over the unit square, so that the integral over any axis-aligned window takes constant time.
#[derive(Clone, Debug)]
pub struct SummedAreaTable {
    /// `(ny + 1)` rows of `(nx + 1)` sums, the first row and column are zero.
    sums: Vec<f64>,
    nx: usize,
    ny: usize,
}

impl SummedAreaTable {
    /// `values` are `ny` rows of `nx` numbers; `None` if the length does not fit.
    pub fn new(values: &[f32], nx: usize, ny: usize) -> Option<Self> {
        if nx == 0 || ny == 0 || nx.checked_mul(ny) != Some(values.len()) {
            return None;
        }
        let stride = nx + 1;
        let mut sums = vec![0.0; stride * (ny + 1)];
        for y in 0..ny {
            let mut row = 0.0;
            for x in 0..nx {
                row += f64::from(values[y * nx + x]);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
            }
        }
        Some(Self { sums, nx, ny })
    }

    /// Integral of the piecewise constant function over the window `[min, max]` within the unit square.
    #[inline]
    pub fn integral(&self, min: [f32; 2], max: [f32; 2]) -> f64 {
        let (x0, y0, x1, y1) = (f64::from(min[0]), f64::from(min[1]), f64::from(max[0]), f64::from(max[1]));
        let sum = (self.lookup(x1, y1) - self.lookup(x0, y1)) + (self.lookup(x0, y0) - self.lookup(x1, y0));
        (sum / (self.nx * self.ny) as f64).max(0.0)
    }

    /// Sum over `[0, x] x [0, y]`; the sums are bilinear inside a cell.
    #[inline]
    fn lookup(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x.clamp(0.0, 1.0) * self.nx as f64, y.clamp(0.0, 1.0) * self.ny as f64);
        let (ix, iy) = ((x as usize).min(self.nx - 1), (y as usize).min(self.ny - 1));
        let (tx, ty) = (x - ix as f64, y - iy as f64);
        let at = iy * (self.nx + 1) + ix;
        let (s00, s10) = (self.sums[at], self.sums[at + 1]);
        let (s01, s11) = (self.sums[at + self.nx + 1], self.sums[at + self.nx + 2]);
        (s00 * (1.0 - tx) + s10 * tx) * (1.0 - ty) + (s01 * (1.0 - tx) + s11 * tx) * ty
    }
}

/// A piecewise constant density on the unit square that can be restricted to any window at sampling time.
#[derive(Clone, Debug)]
pub struct WindowedPiecewise2D {
    table: SummedAreaTable,
    values: Vec<f32>,
}

impl WindowedPiecewise2D {
    /// `values` are `ny` rows of `nx` numbers. `None` if the length does not fit, or a value is negative or not finite.
    pub fn new(values: Vec<f32>, nx: usize, ny: usize) -> Option<Self> {
        let table = SummedAreaTable::new(&values, nx, ny)?;
        is_density(&values).then_some(Self { table, values })
    }

    /// Point of the window `[min, max]` with density proportional to the values, and that density with respect to area.
    ///
    /// `None` if the values vanish in the window.
    pub fn sample(&self, u: [f32; 2], min: [f32; 2], max: [f32; 2]) -> Option<([f32; 2], f32)> {
        let total = self.table.integral(min, max);
        if total <= 0.0 {
            return None;
        }
        let x = invert_monotone(f64::from(u[0]) * total, min[0], max[0], self.table.nx, |x| {
            self.table.integral(min, [x, max[1]])
        });
        // The cell column around x gives the conditional density of y.
        let nx = self.table.nx as f32;
        let column = ((x * nx) as usize).min(self.table.nx - 1) as f32;
        let (c0, c1) = (column / nx, (column + 1.0) / nx);
        let slice = |y: f32| self.table.integral([c0, min[1]], [c1, y]);
        let column_total = slice(max[1]);
        if column_total <= 0.0 {
            return None;
        }
        let y = invert_monotone(f64::from(u[1]) * column_total, min[1], max[1], self.table.ny, slice);
        let p = [x.min(ONE_MINUS_EPSILON), y.min(ONE_MINUS_EPSILON)];
        let value = f64::from(self.value(p));
        (value > 0.0).then(|| (p, (value / total) as f32))
    }

    /// Density of [`Self::sample`] at `p` with respect to area; zero outside the window.
    pub fn pdf(&self, p: [f32; 2], min: [f32; 2], max: [f32; 2]) -> f32 {
        let inside = (0..2).all(|i| p[i] >= min[i] && p[i] <= max[i]);
        let total = self.table.integral(min, max);
        if inside && total > 0.0 { (f64::from(self.value(p)) / total) as f32 } else { 0.0 }
    }

    #[inline]
    fn value(&self, p: [f32; 2]) -> f32 {
        let x = ((p[0].max(0.0) * self.table.nx as f32) as usize).min(self.table.nx - 1);
        let y = ((p[1].max(0.0) * self.table.ny as f32) as usize).min(self.table.ny - 1);
        self.values[y * self.table.nx + x]
    }
}

/// The `x` in `[min, max]` at which the non-decreasing function `f`, linear between multiples of `1 / n`, reaches `target`.
fn invert_monotone(target: f64, min: f32, max: f32, n: usize, f: impl Fn(f32) -> f64) -> f32 {
    // Find the cell by bisection over its borders, then solve the linear piece.
    let grid = n as f32;
    let (mut low, mut high) = ((min * grid).floor() as usize, ((max * grid).ceil() as usize).max(1));
    while high - low > 1 {
        let middle = (low + high) / 2;
        if f((middle as f32 / grid).clamp(min, max)) <= target {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (x0, x1) = ((low as f32 / grid).clamp(min, max), (high as f32 / grid).clamp(min, max));
    let (f0, f1) = (f(x0), f(x1));
    if f1 > f0 {
        let t = ((target - f0) / (f1 - f0)).clamp(0.0, 1.0);
        // Stay inside the cell, since the neighbour may have no density.
        ((f64::from(x0) + t * (f64::from(x1) - f64::from(x0))) as f32).clamp(x0, steradian_math::next_down(x1).max(x0))
    } else {
        x0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn values() -> Vec<f32> {
        let mut rng = Rng::new(1, 1);
        (0..7 * 5).map(|i| if i % 4 == 0 { 0.0 } else { rng.f32() }).collect()
    }

    #[test]
    fn integrals_equal_the_direct_sums() {
        let v = values();
        let table = SummedAreaTable::new(&v, 7, 5).unwrap();
        let n = 350;
        for (min, max) in [([0.0, 0.0], [1.0, 1.0]), ([0.2, 0.1], [0.9, 0.34]), ([0.5, 0.5], [0.52, 0.9])] {
            // The midpoint rule on a grid that divides the cells and the windows evenly.
            let mut sum = 0.0;
            for y in 0..n {
                for x in 0..n {
                    let p = [(x as f32 + 0.5) / n as f32, (y as f32 + 0.5) / n as f32];
                    if p[0] > min[0] && p[0] < max[0] && p[1] > min[1] && p[1] < max[1] {
                        sum += f64::from(v[(p[1] * 5.0) as usize * 7 + (p[0] * 7.0) as usize]) / f64::from(n * n);
                    }
                }
            }
            assert!((table.integral(min, max) - sum).abs() < 1e-3, "{} and {sum}", table.integral(min, max));
        }
    }

    #[test]
    fn windowed_samples_have_their_density() {
        let d = WindowedPiecewise2D::new(values(), 7, 5).unwrap();
        let (min, max) = ([0.15, 0.3], [0.81, 0.93]);
        let n = 200;
        let (mut integral, mut mass) = (0.0, 0.0);
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            let (p, pdf) = d.sample(u, min, max).unwrap();
            assert!(p[0] >= min[0] && p[0] <= max[0] && p[1] >= min[1] && p[1] <= max[1]);
            assert!((pdf - d.pdf(p, min, max)).abs() < 1e-4);
            if p[0] < 0.4 && p[1] < 0.7 {
                mass += 1.0 / f64::from(n * n);
            }
            let q = [min[0] + u[0] * (max[0] - min[0]), min[1] + u[1] * (max[1] - min[1])];
            if q[0] < 0.4 && q[1] < 0.7 {
                integral += f64::from(d.pdf(q, min, max) * (max[0] - min[0]) * (max[1] - min[1])) / f64::from(n * n);
            }
        }
        assert!((mass - integral).abs() < 0.02, "{mass} of the samples in a part with probability {integral}");
        assert!(WindowedPiecewise2D::new(vec![0.0; 4], 2, 2).unwrap().sample([0.5; 2], min, max).is_none());
    }
}
