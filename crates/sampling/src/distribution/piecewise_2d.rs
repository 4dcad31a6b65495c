//! A piecewise constant density on the unit square: rows are chosen by the marginal, then a point by the row's own density.

use super::piecewise_1d::fill_cdf;
use super::{Piecewise1D, fill_guide, find_between, guide_len, guided, is_density};
use steradian_math::{ONE_MINUS_EPSILON, ROW, Row, lerp};

/// Density proportional to `values[y * nx + x]` on the cells of a grid over the unit square; uniform if all are zero.
///
/// All rows share one flat array of distribution functions.
#[derive(Clone, Debug)]
pub struct Piecewise2D {
    values: Vec<f32>,
    /// `ny` rows of `nx + 1` entries.
    row_cdfs: Vec<f32>,
    /// And as many guides.
    row_guides: Vec<u32>,
    marginal: Piecewise1D,
    nx: usize,
    ny: usize,
    mean: f32,
}

impl Piecewise2D {
    /// `values` are `ny` rows of `nx` numbers. `None` if the length does not fit, or a value is negative or not finite.
    pub fn new(values: Vec<f32>, nx: usize, ny: usize) -> Option<Self> {
        if nx == 0 || ny == 0 || nx.checked_mul(ny) != Some(values.len()) || !is_density(&values) {
            return None;
        }
        let mut row_cdfs = vec![0.0; (nx + 1) * ny];
        let rows: Vec<f32> = values
            .chunks_exact(nx)
            .zip(row_cdfs.chunks_exact_mut(nx + 1))
            .map(|(row, cdf)| fill_cdf(row, cdf) as f32)
            .collect();
        let mut row_guides = vec![0; guide_len(nx) * ny];
        for (cdf, guide) in row_cdfs.chunks_exact(nx + 1).zip(row_guides.chunks_exact_mut(guide_len(nx))) {
            fill_guide(cdf, guide);
        }
        let marginal = Piecewise1D::new(&rows, 0.0, 1.0)?;
        let mean = marginal.integral();
        Some(Self { values, row_cdfs, row_guides, marginal, nx, ny, mean })
    }

    /// Integral of the unnormalised values over the square, which is their mean.
    #[inline]
    pub fn integral(&self) -> f32 {
        self.mean
    }

    /// Number of cells in x and y.
    #[inline]
    pub fn resolution(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// A cell with probability proportional to its value, and where in the cell the numbers point to, uniformly.
    #[inline]
    pub fn sample_cell(&self, u: [f32; 2]) -> ([usize; 2], [f32; 2]) {
        let row = self.marginal.sample_discrete(u[1]);
        let cdf = self.row_cdf(row.index);
        let column = find_between(cdf, guided(self.row_guide(row.index), u[0]), u[0]);
        ([column, row.index], [inside(cdf, column, u[0]), row.remapped])
    }

    /// A point with density proportional to the values, and that density with respect to area.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let row = self.marginal.sample(u[1]);
        let cell = guided(self.row_guide(row.index), u[0]);
        let (x, column) = self.column(row.index, cell, u[0]);
        ([x, row.x.min(ONE_MINUS_EPSILON)], self.cell_pdf(column, row.index))
    }

    /// [`Piecewise2D::sample`] for the first `n` pairs of a row, which become points: step by step, so that their waits for memory
    /// overlap.
    pub fn sample_rows(&self, u: &mut [Row; 2], pdf: &mut Row, n: usize) {
        let n = n.min(ROW);
        let [ux, uy] = u;
        let (mut rows, mut cells) = ([0u32; ROW], [[0u32; 2]; ROW]);
        for i in 0..n {
            let row = self.marginal.sample(uy.0[i]);
            rows[i] = row.index as u32;
            uy.0[i] = row.x.min(ONE_MINUS_EPSILON);
        }
        for i in 0..n {
            cells[i] = guided(self.row_guide(rows[i] as usize), ux.0[i]);
        }
        for i in 0..n {
            let row = rows[i] as usize;
            let (x, column) = self.column(row, cells[i], ux.0[i]);
            ux.0[i] = x;
            pdf.0[i] = self.cell_pdf(column, row);
        }
    }

    /// The point of a row for a random number that lies between two cells, and its cell.
    #[inline]
    fn column(&self, row: usize, between: [u32; 2], u: f32) -> (f32, usize) {
        let cdf = self.row_cdf(row);
        let column = find_between(cdf, between, u);
        (((column as f32 + inside(cdf, column, u)) / self.nx as f32).min(ONE_MINUS_EPSILON), column)
    }

    /// Density at `p` with respect to area; zero outside the square.
    #[inline]
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        match self.cell(p) {
            Some((x, y)) => self.cell_pdf(x, y),
            None => 0.0,
        }
    }

    /// The random numbers that make [`Self::sample`] return `p`; `None` outside the square.
    #[inline]
    pub fn invert(&self, p: [f32; 2]) -> Option<[f32; 2]> {
        let (x, y) = self.cell(p)?;
        let cdf = self.row_cdf(y);
        Some([lerp((p[0] * self.nx as f32 - x as f32).min(1.0), cdf[x], cdf[x + 1]), self.marginal.invert(p[1])?])
    }

    #[inline]
    fn cell(&self, p: [f32; 2]) -> Option<(usize, usize)> {
        let inside = p.iter().all(|x| (0.0..=1.0).contains(x));
        let x = ((p[0] * self.nx as f32) as usize).min(self.nx - 1);
        let y = ((p[1] * self.ny as f32) as usize).min(self.ny - 1);
        inside.then_some((x, y))
    }

    #[inline]
    fn cell_pdf(&self, x: usize, y: usize) -> f32 {
        if self.mean > 0.0 { self.values[y * self.nx + x] / self.mean } else { 1.0 }
    }

    #[inline]
    fn row_guide(&self, y: usize) -> &[u32] {
        let n = guide_len(self.nx);
        &self.row_guides[y * n..(y + 1) * n]
    }

    #[inline]
    fn row_cdf(&self, y: usize) -> &[f32] {
        &self.row_cdfs[y * (self.nx + 1)..(y + 1) * (self.nx + 1)]
    }
}

/// How far a random number is on its way through a cell of its row.
#[inline]
fn inside(cdf: &[f32], column: usize, u: f32) -> f32 {
    let (low, high) = (cdf[column], cdf[column + 1]);
    if high > low { ((u - low) / (high - low)).min(ONE_MINUS_EPSILON) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_density_and_inverse_agree() {
        let values = vec![0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 5.0, 0.0, 4.0];
        let d = Piecewise2D::new(values.clone(), 3, 3).unwrap();
        let mut counts = [0u32; 9];
        let n = 300;
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            let (p, pdf) = d.sample(u);
            assert!(pdf > 0.0 && (pdf - d.pdf(p)).abs() < 1e-5);
            let (cell, inside) = d.sample_cell(u);
            for k in 0..2 {
                assert!((3.0 * p[k] - cell[k] as f32 - inside[k]).abs() < 1e-4);
            }
            let v = d.invert(p).unwrap();
            assert!((v[0] - u[0]).abs() < 1e-5 && (v[1] - u[1]).abs() < 1e-5);
            counts[(p[1] * 3.0) as usize * 3 + (p[0] * 3.0) as usize] += 1;
        }
        for (count, value) in counts.iter().zip(&values) {
            assert!((f64::from(*count) / f64::from(n * n) - f64::from(*value) / 12.0).abs() < 0.01);
        }
        assert_eq!(d.pdf([1.5, 0.5]), 0.0);
        assert!(Piecewise2D::new(values, 2, 3).is_none());
        assert_eq!(Piecewise2D::new(vec![0.0; 6], 2, 3).unwrap().pdf([0.3, 0.9]), 1.0);
    }
}
