//! The density of a map of latitude and longitude that is interpolated between texels: piecewise bilinear, so that a lone bright texel is
//! met where it shines and nowhere else (PBRT 4th ed., A.5.2, on the cells between the centres of texels).

use steradian_math::{PI, lerp, sin_cos};
use steradian_sampling::Piecewise2D;
use steradian_sampling::warp::square_to_bilinear;

/// A density on the unit square: bilinear in the brightness of texels between their centres, times the mean sine of the row of cells, so that
/// no sample is worth much more than the mean.
#[derive(Clone, Debug)]
pub(super) struct LatLongDensity {
    /// Brightness at the centres of texels, row by row.
    nodes: Vec<f32>,
    grid: Nodes,
    /// Of each row of cells.
    sines: Vec<f32>,
    /// Mean brightness over the sphere.
    mean: f32,
    all: Cells,
    /// Of what is above the mean.
    peaks: Option<Box<Cells>>,
}

/// How the nodes lie.
#[derive(Clone, Copy, Debug)]
struct Nodes {
    width: usize,
    height: usize,
    /// Whether the first and the last row of nodes lie at the poles, not half a row from them.
    at_poles: bool,
}

/// Where a row of cells is.
enum Row {
    /// Half as high, below the pole at v = 0 and above the one at v = 1.
    HalfAtTop,
    HalfAtBottom,
    /// As high as the others, with nodes at the pole.
    AtTop,
    AtBottom,
    /// Below the row of nodes of this number.
    Below(usize),
}

impl Nodes {
    /// Rows of cells.
    fn rows(self) -> usize {
        if self.at_poles { self.height - 1 } else { self.height + 1 }
    }

    fn row(self, row: usize) -> Row {
        match (self.at_poles, row) {
            (false, 0) => Row::HalfAtTop,
            (false, r) if r == self.height => Row::HalfAtBottom,
            (false, r) => Row::Below(r - 1),
            (true, 0) => Row::AtTop,
            (true, r) if r + 2 == self.height => Row::AtBottom,
            (true, r) => Row::Below(r),
        }
    }

    /// The angle from the pole at v = 0 of the upper edge of a row of cells.
    fn edge(self, row: usize) -> f32 {
        if self.at_poles {
            PI * row as f32 / (self.height - 1) as f32
        } else {
            PI * (row as f32 - 0.5).clamp(0.0, self.height as f32) / self.height as f32
        }
    }
}

/// The cells between nodes: as many columns as texels, and of rows one more, those at the poles half as high, or, with nodes at the poles, one
/// less.
#[derive(Clone, Debug)]
struct Cells {
    choice: Piecewise2D,
    /// What the density is where brightness times sine is one.
    per_value: f32,
    /// What brightness counts from.
    floor: f32,
}

impl LatLongDensity {
    /// The density of `brightness(x, y)` of texels, whose first and last row lie at the poles or half a row from them. `None` if all are black.
    pub fn new(width: usize, height: usize, at_poles: bool, brightness: impl Fn(usize, usize) -> f32) -> Option<Self> {
        // One row alone has no two poles to lie at.
        let grid = Nodes { width, height, at_poles: at_poles && height > 1 };
        let nodes: Vec<f32> = (0..width * height).map(|i| brightness(i % width, i / width).max(0.0)).collect();
        let sines: Vec<f32> =
            (0..grid.rows()).map(|row| sin_cos(0.5 * (grid.edge(row) + grid.edge(row + 1))).0).collect();
        let (mut sum, mut weights) = (0.0f64, 0.0f64);
        for (y, row) in nodes.chunks_exact(width).enumerate() {
            let angle = if grid.at_poles { grid.edge(y) } else { PI * (y as f32 + 0.5) / height as f32 };
            let sine = f64::from(sin_cos(angle).0);
            sum += row.iter().map(|&v| f64::from(v)).sum::<f64>() * sine;
            weights += sine * width as f64;
        }
        // Of two rows at the poles neither has any weight.
        let mean = if weights > 1e-6 { (sum / weights) as f32 } else { nodes.iter().sum::<f32>() / nodes.len() as f32 };
        let cells = |floor| Cells::new(&nodes, grid, &sines, floor);
        let (all, peaks) = (cells(0.0)?, cells(mean).map(Box::new));
        Some(Self { nodes, grid, sines, mean, all, peaks })
    }

    /// Mean brightness over the sphere.
    pub fn mean(&self) -> f32 {
        self.mean
    }

    /// A point of the square and its density; of the peaks alone if `beside_lobes`.
    #[inline]
    pub fn sample(&self, u: [f32; 2], beside_lobes: bool) -> ([f32; 2], f32) {
        let cells = self.cells(beside_lobes);
        let ([x, row], u) = cells.choice.sample_cell(u);
        let corners = corners(&self.nodes, self.grid, [x, row], cells.floor);
        let [s, t] = square_to_bilinear(u, corners);
        let (w, h) = (self.grid.width as f32, self.grid.height as f32);
        let column = x as f32 + 0.5 + s;
        let u = if column >= w { column - w } else { column } / w;
        let v = match self.grid.row(row) {
            Row::HalfAtTop => 0.5 * t / h,
            Row::HalfAtBottom => (h - 0.5 + 0.5 * t) / h,
            _ if self.grid.at_poles => (row as f32 + t) / (h - 1.0),
            _ => (row as f32 - 0.5 + t) / h,
        };
        ([u, v.min(1.0)], interpolate(corners, s, t) * self.sines[row] * cells.per_value)
    }

    /// The density of `sample`.
    #[inline]
    pub fn pdf(&self, [u, v]: [f32; 2], beside_lobes: bool) -> f32 {
        let cells = self.cells(beside_lobes);
        let (width, height) = (self.grid.width, self.grid.height);
        let x = u * width as f32 - 0.5;
        let v = v.clamp(0.0, 1.0);
        let (row, t) = if self.grid.at_poles {
            let y = v * (height - 1) as f32;
            let row = (y as usize).min(height - 2);
            (row, y - row as f32)
        } else {
            let y = v * height as f32;
            let row = ((y + 0.5) as usize).min(height);
            let t = match self.grid.row(row) {
                Row::HalfAtTop => 2.0 * y,
                Row::HalfAtBottom => 2.0 * (y - height as f32 + 0.5),
                _ => y + 0.5 - row as f32,
            };
            (row, t)
        };
        let column = (x.floor() as i64).rem_euclid(width as i64) as usize;
        let corners = corners(&self.nodes, self.grid, [column, row], cells.floor);
        interpolate(corners, x - x.floor(), t.clamp(0.0, 1.0)) * self.sines[row] * cells.per_value
    }

    fn cells(&self, beside_lobes: bool) -> &Cells {
        // A map without features has no peaks.
        if beside_lobes { self.peaks.as_deref().unwrap_or(&self.all) } else { &self.all }
    }
}

impl Cells {
    fn new(nodes: &[f32], grid: Nodes, sines: &[f32], floor: f32) -> Option<Self> {
        let (width, rows) = (grid.width, grid.rows());
        let mut masses = Vec::with_capacity(width * rows);
        for (row, sine) in sines.iter().enumerate() {
            let half = matches!(grid.row(row), Row::HalfAtTop | Row::HalfAtBottom);
            let share = if half { 0.125 * sine } else { 0.25 * sine };
            let mass = |x| share * corners(nodes, grid, [x, row], floor).iter().sum::<f32>();
            masses.extend((0..width).map(mass));
        }
        let choice = Piecewise2D::new(masses, width, rows)?;
        // Whole rows are as high as the distance of two nodes.
        let nodes_apart = if grid.at_poles { rows } else { grid.height };
        let per_value = nodes_apart as f32 / (rows as f32 * choice.integral());
        (choice.integral() > 0.0 && per_value.is_finite()).then_some(Self { choice, per_value, floor })
    }
}

/// What is above the floor at the corners of a cell: left and right above, then below. In the rows at the poles the sine falls from twice its
/// mean to nothing there; brightness is even in half a row, and at most the sum of both ends in a whole one.
#[inline]
fn corners(nodes: &[f32], grid: Nodes, [x, row]: [usize; 2], floor: f32) -> [f32; 4] {
    let (width, height) = (grid.width, grid.height);
    let right = if x + 1 == width { 0 } else { x + 1 };
    let pair = |y: usize| [x, right].map(|x| (nodes[y * width + x] - floor).max(0.0));
    let both = |y: usize| {
        let (a, b) = (pair(y), pair(y + 1));
        [a[0] + b[0], a[1] + b[1]]
    };
    let ([a, b], [c, d]) = match grid.row(row) {
        Row::HalfAtTop => ([0.0; 2], pair(0).map(|v| 2.0 * v)),
        Row::HalfAtBottom => (pair(height - 1).map(|v| 2.0 * v), [0.0; 2]),
        // Two rows of nodes are one of cells, with a pole at either end.
        Row::AtTop if height == 2 => (both(0), both(0)),
        Row::AtTop => ([0.0; 2], both(0)),
        Row::AtBottom => (both(row), [0.0; 2]),
        Row::Below(y) => (pair(y), pair(y + 1)),
    };
    [a, b, c, d]
}

#[inline]
fn interpolate(w: [f32; 4], s: f32, t: f32) -> f32 {
    lerp(t, lerp(s, w[0], w[1]), lerp(s, w[2], w[3]))
}
