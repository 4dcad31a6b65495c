//! Bilinear functions on the unit square that depend on further parameters, and sampling proportional to them (Dupuy and
//! Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering", section 4).

use steradian_math::{ONE_MINUS_EPSILON, safe_sqrt};

/// Samples on a grid over the unit square for each combination of `D` parameters, everything interpolated linearly.
///
/// Axis 0 of a point runs along rows. Outside its range a parameter counts as the nearest end.
#[derive(Clone, Debug)]
pub struct BilinearTable<const D: usize> {
    size: [usize; 2],
    parameters: [Vec<f32>; D],
    data: Vec<f32>,
}

/// A [`BilinearTable`] as a density: each slice integrates to one over the square.
#[derive(Clone, Debug)]
pub struct ConditionalBilinear2D<const D: usize> {
    table: BilinearTable<D>,
    /// Distribution function over rows, per slice.
    marginal: Vec<f32>,
    /// Unnormalised distribution function along each row, per slice.
    conditional: Vec<f32>,
}

/// A point of the square and a density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquareSample {
    /// The point.
    pub p: [f32; 2],
    /// Density per area of the square.
    pub pdf: f32,
}

/// The slices that a set of parameters lies between, with their weights.
#[derive(Clone, Copy, Debug)]
pub struct Slices {
    entries: [(usize, f32); 8],
    count: usize,
}

impl Slices {
    #[inline]
    fn lookup(&self, data: &[f32], slice_size: usize, i: usize) -> f32 {
        self.entries[..self.count].iter().map(|&(slice, weight)| weight * data[slice * slice_size + i]).sum()
    }
}

/// The cell of a grid with `n` points that holds `x` in `[0, 1]`, and the place in it.
#[inline]
fn cell(x: f32, n: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

/// The `x` in `[0, 1]` at which the integral of a line from `a` to `b` reaches `area`.
#[inline]
fn invert_linear(area: f32, a: f32, b: f32) -> f32 {
    let x = if (a - b).abs() < 1e-4 * (a + b) {
        2.0 * area / (a + b)
    } else {
        // The stable form of (a - sqrt(a^2 - 2 area (a - b))) / (a - b).
        2.0 * area / (a + safe_sqrt(a * a - 2.0 * area * (a - b)))
    };
    // A line that is zero has no area to be inverted.
    if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.5 }
}

impl<const D: usize> BilinearTable<D> {
    /// `data` is indexed by the parameters in order, then row, then column. Parameters increase strictly. `None` if sizes
    /// do not fit, a number is not finite, the grid is smaller than 2 x 2, or `D` is more than 3.
    pub fn new(size: [usize; 2], parameters: [Vec<f32>; D], data: Vec<f32>) -> Option<Self> {
        let mut count = size[0].checked_mul(size[1])?;
        for p in &parameters {
            count = count.checked_mul(p.len())?;
            if !p.is_sorted_by(|a, b| a < b) || !p.iter().all(|v| v.is_finite()) {
                return None;
            }
        }
        let sound = D <= 3 && size[0] >= 2 && size[1] >= 2 && count == data.len() && count > 0;
        (sound && data.iter().all(|v| v.is_finite())).then_some(Self { size, parameters, data })
    }

    /// Bytes of the numbers.
    pub fn bytes(&self) -> usize {
        size_of_val(self.data.as_slice())
    }

    #[inline]
    fn slice_size(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Where the parameters lie.
    #[inline]
    pub fn slices(&self, at: [f32; D]) -> Slices {
        let mut s = Slices { entries: [(0, 1.0); 8], count: 1 };
        for (values, x) in self.parameters.iter().zip(at) {
            let n = values.len();
            for e in &mut s.entries[..s.count] {
                e.0 *= n;
            }
            if n == 1 {
                continue;
            }
            let i = values.partition_point(|&v| v <= x).saturating_sub(1).min(n - 2);
            let t = ((x - values[i]) / (values[i + 1] - values[i])).clamp(0.0, 1.0);
            let old = s.count;
            for k in 0..old {
                let (slice, weight) = s.entries[k];
                s.entries[k] = (slice + i, weight * (1.0 - t));
                // Weights of zero need no look-up.
                if t > 0.0 {
                    s.entries[s.count] = (slice + i + 1, weight * t);
                    s.count += 1;
                }
            }
        }
        s
    }

    /// The four values around a point and the place between them.
    #[inline]
    fn corners(&self, slices: &Slices, p: [f32; 2]) -> ([f32; 4], [usize; 2], [f32; 2]) {
        let (x, tx) = cell(p[0], self.size[0]);
        let (y, ty) = cell(p[1], self.size[1]);
        let i = x + y * self.size[0];
        let (n, row) = (self.slice_size(), self.size[0]);
        let of = |i| slices.lookup(&self.data, n, i);
        ([of(i), of(i + 1), of(i + row), of(i + row + 1)], [x, y], [tx, ty])
    }

    /// The function at a point of the square.
    #[inline]
    pub fn eval(&self, p: [f32; 2], slices: &Slices) -> f32 {
        let ([v00, v10, v01, v11], _, [tx, ty]) = self.corners(slices, p);
        (1.0 - ty) * ((1.0 - tx) * v00 + tx * v10) + ty * ((1.0 - tx) * v01 + tx * v11)
    }
}

impl<const D: usize> ConditionalBilinear2D<D> {
    /// The density proportional to `table`; a slice that is zero everywhere is taken as even. `None` if a number is negative.
    pub fn new(mut table: BilinearTable<D>) -> Option<Self> {
        if table.data.iter().any(|&v| v < 0.0) {
            return None;
        }
        let [nx, ny] = table.size;
        let slices = table.data.len() / table.slice_size();
        let (mut marginal, mut conditional) = (Vec::with_capacity(slices * ny), Vec::with_capacity(table.data.len()));
        let cells = ((nx - 1) * (ny - 1)) as f64;
        for slice in table.data.chunks_exact_mut(nx * ny) {
            let total: f64 = slice
                .chunks_exact(nx)
                .enumerate()
                .map(|(y, row)| {
                    let ends = f64::from(row[0]) + f64::from(row[nx - 1]);
                    let sum = row.iter().map(|&v| f64::from(v)).sum::<f64>() - 0.5 * ends;
                    if y == 0 || y == ny - 1 { 0.5 * sum } else { sum }
                })
                .sum();
            // Cells have unit area inside here, so that distribution functions need no factors.
            for v in slice.iter_mut() {
                *v = if total > 0.0 { (f64::from(*v) / total) as f32 } else { (1.0 / cells) as f32 };
            }
            let (mut below, mut previous) = (0.0f64, None);
            for row in slice.chunks_exact(nx) {
                let mut sum = 0.0f64;
                conditional.push(0.0);
                for pair in row.windows(2) {
                    sum += 0.5 * (f64::from(pair[0]) + f64::from(pair[1]));
                    conditional.push(sum as f32);
                }
                if let Some(previous) = previous {
                    below += 0.5 * (previous + sum);
                }
                previous = Some(sum);
                marginal.push(below as f32);
            }
        }
        Some(Self { table, marginal, conditional })
    }

    /// Bytes of the numbers.
    pub fn bytes(&self) -> usize {
        self.table.bytes() + size_of_val(self.marginal.as_slice()) + size_of_val(self.conditional.as_slice())
    }

    /// Where the parameters lie.
    #[inline]
    pub fn slices(&self, at: [f32; D]) -> Slices {
        self.table.slices(at)
    }

    #[inline]
    fn cells(&self) -> f32 {
        ((self.table.size[0] - 1) * (self.table.size[1] - 1)) as f32
    }

    /// Density at a point of the square.
    #[inline]
    pub fn pdf(&self, p: [f32; 2], slices: &Slices) -> f32 {
        self.table.eval(p, slices) * self.cells()
    }

    /// The point that a uniform point is moved to.
    #[inline]
    pub fn sample(&self, u: [f32; 2], slices: &Slices) -> SquareSample {
        let [nx, ny] = self.table.size;
        let n = nx * ny;
        let u = u.map(|v| v.clamp(f32::MIN_POSITIVE, ONE_MINUS_EPSILON));
        // The row, then the place between it and the next.
        let marginal = |i: usize| slices.lookup(&self.marginal, ny, i);
        let row = last_below(ny, u[1] * marginal(ny - 1), marginal);
        let conditional = |i: usize| slices.lookup(&self.conditional, n, i);
        let (r0, r1) = (conditional((row + 1) * nx - 1), conditional((row + 2) * nx - 1));
        let ty = invert_linear(u[1] * marginal(ny - 1) - marginal(row), r0, r1);
        // The same along it.
        let between = |i: usize| (1.0 - ty) * conditional(row * nx + i) + ty * conditional((row + 1) * nx + i);
        let target = u[0] * between(nx - 1);
        let column = last_below(nx, target, between);
        let data = |i: usize| slices.lookup(&self.table.data, n, i);
        let i = row * nx + column;
        let c0 = (1.0 - ty) * data(i) + ty * data(i + nx);
        let c1 = (1.0 - ty) * data(i + 1) + ty * data(i + nx + 1);
        let tx = invert_linear(target - between(column), c0, c1);
        SquareSample {
            p: [(column as f32 + tx) / (nx - 1) as f32, (row as f32 + ty) / (ny - 1) as f32],
            pdf: ((1.0 - tx) * c0 + tx * c1) * self.cells(),
        }
    }

    /// The uniform point that [`Self::sample`] moves to `p`, with the density at `p`.
    #[inline]
    pub fn invert(&self, p: [f32; 2], slices: &Slices) -> SquareSample {
        let [nx, ny] = self.table.size;
        let n = nx * ny;
        let ([v00, v10, v01, v11], [x, y], [tx, ty]) = self.table.corners(slices, p);
        let (c0, c1) = ((1.0 - ty) * v00 + ty * v01, (1.0 - ty) * v10 + ty * v11);
        let marginal = |i: usize| slices.lookup(&self.marginal, ny, i);
        let conditional = |i: usize| slices.lookup(&self.conditional, n, i);
        let between = |i: usize| (1.0 - ty) * conditional(y * nx + i) + ty * conditional((y + 1) * nx + i);
        let (r0, r1) = (conditional((y + 1) * nx - 1), conditional((y + 2) * nx - 1));
        let along = between(x) + tx * (c0 + 0.5 * tx * (c1 - c0));
        let up = marginal(y) + ty * (r0 + 0.5 * ty * (r1 - r0));
        let ratio = |a: f32, b: f32| if b > 0.0 { (a / b).clamp(0.0, 1.0) } else { 0.5 };
        SquareSample {
            p: [ratio(along, (1.0 - ty) * r0 + ty * r1), ratio(up, marginal(ny - 1))],
            pdf: ((1.0 - tx) * c0 + tx * c1) * self.cells(),
        }
    }
}

/// The largest `i < n - 1` with `f(i) < x`, or 0; `f` does not decrease.
#[inline]
fn last_below(n: usize, x: f32, f: impl Fn(usize) -> f32) -> usize {
    let (mut low, mut high) = (0, n - 1);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if f(middle) < x {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ConditionalBilinear2D<2> {
        let (nx, ny) = (4, 3);
        let mut data: Vec<f32> = (0..2 * 3 * nx * ny).map(|i| ((i * 7919) % 13) as f32).collect();
        // One slice that is zero.
        data[2 * nx * ny..3 * nx * ny].fill(0.0);
        let t = BilinearTable::new([nx, ny], [vec![-1.0, 1.0], vec![0.0, 0.3, 2.0]], data).unwrap();
        ConditionalBilinear2D::new(t).unwrap()
    }

    #[test]
    fn sampling_and_inversion_undo_each_other_and_densities_integrate_to_one() {
        let d = table();
        for at in [[-1.0, 0.0], [0.3, 0.2], [0.9, 1.5], [5.0, -3.0], [-1.0, 2.0]] {
            let slices = d.slices(at);
            let n = 200;
            let (mut integral, mut worst) = (0.0f64, 0.0f32);
            for i in 0..n * n {
                let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
                integral += f64::from(d.pdf(u, &slices)) / f64::from(n * n);
                let s = d.sample(u, &slices);
                assert!((s.pdf - d.pdf(s.p, &slices)).abs() < 1e-3 * (1.0 + s.pdf), "{at:?} {u:?} {s:?}");
                let back = d.invert(s.p, &slices);
                assert!((back.pdf - s.pdf).abs() < 1e-3 * (1.0 + s.pdf));
                worst = worst.max((back.p[0] - u[0]).abs()).max((back.p[1] - u[1]).abs());
            }
            assert!((integral - 1.0).abs() < 1e-3, "{at:?}: {integral}");
            assert!(worst < 1e-3, "{at:?}: {worst}");
        }
    }

    #[test]
    fn the_share_of_a_window_is_its_integral() {
        let d = table();
        let slices = d.slices([0.3, 0.2]);
        let (n, window) = (1000, 0.35f32);
        let (mut share, mut integral) = (0.0f64, 0.0f64);
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            let inside = |p: [f32; 2]| p[0] < window && p[1] < window;
            share += f64::from(u8::from(inside(d.sample(u, &slices).p))) / f64::from(n * n);
            if inside(u) {
                integral += f64::from(d.pdf(u, &slices)) / f64::from(n * n);
            }
        }
        assert!((share - integral).abs() < 2e-3, "{share} and {integral}");
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(BilinearTable::new([1, 4], [], vec![1.0; 4]).is_none());
        assert!(BilinearTable::new([2, 2], [], vec![1.0; 5]).is_none());
        assert!(BilinearTable::new([2, 2], [vec![1.0, 1.0]], vec![1.0; 8]).is_none());
        assert!(BilinearTable::new([2, 2], [], vec![1.0, f32::NAN, 1.0, 1.0]).is_none());
        let negative = BilinearTable::new([2, 2], [], vec![1.0, -1.0, 1.0, 1.0]).unwrap();
        assert!(ConditionalBilinear2D::new(negative).is_none());
    }
}
