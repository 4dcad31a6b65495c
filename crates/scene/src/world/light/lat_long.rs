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
    width: usize,
    height: usize,
    /// Of each row of cells.
    sines: Vec<f32>,
    /// Mean brightness over the sphere.
    mean: f32,
    all: Cells,
    /// Of what is above the mean.
    peaks: Option<Cells>,
}

/// The cells between nodes: as many columns as texels, one row more. Those at the poles are half as high.
#[derive(Clone, Debug)]
struct Cells {
    choice: Piecewise2D,
    /// What the density is where brightness times sine is one.
    per_value: f32,
    /// What brightness counts from.
    floor: f32,
}

impl LatLongDensity {
    /// The density of `brightness(x, y)` of texels. `None` if all are black.
    pub fn new(width: usize, height: usize, brightness: impl Fn(usize, usize) -> f32) -> Option<Self> {
        let nodes: Vec<f32> = (0..width * height).map(|i| brightness(i % width, i / width).max(0.0)).collect();
        let edge = |row: usize| PI * (row as f32 - 0.5).clamp(0.0, height as f32) / height as f32;
        let sines: Vec<f32> = (0..=height).map(|row| sin_cos(0.5 * (edge(row) + edge(row + 1))).0).collect();
        let (mut sum, mut weights) = (0.0f64, 0.0f64);
        for (y, row) in nodes.chunks_exact(width).enumerate() {
            let sine = f64::from(sin_cos(PI * (y as f32 + 0.5) / height as f32).0);
            sum += row.iter().map(|&v| f64::from(v)).sum::<f64>() * sine;
            weights += sine * width as f64;
        }
        let mean = (sum / weights) as f32;
        let cells = |floor| Cells::new(&nodes, [width, height], &sines, floor);
        let (all, peaks) = (cells(0.0)?, cells(mean));
        Some(Self { nodes, width, height, sines, mean, all, peaks })
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
        let corners = corners(&self.nodes, [self.width, self.height], [x, row], cells.floor);
        let [s, t] = square_to_bilinear(u, corners);
        let (w, h) = (self.width as f32, self.height as f32);
        let column = x as f32 + 0.5 + s;
        let u = if column >= w { column - w } else { column } / w;
        let v = match row {
            0 => 0.5 * t,
            _ if row == self.height => h - 0.5 + 0.5 * t,
            _ => row as f32 - 0.5 + t,
        } / h;
        ([u, v.min(1.0)], interpolate(corners, s, t) * self.sines[row] * cells.per_value)
    }

    /// The density of `sample`.
    #[inline]
    pub fn pdf(&self, [u, v]: [f32; 2], beside_lobes: bool) -> f32 {
        let cells = self.cells(beside_lobes);
        let x = u * self.width as f32 - 0.5;
        let y = v.clamp(0.0, 1.0) * self.height as f32;
        let row = ((y + 0.5) as usize).min(self.height);
        let t = match row {
            0 => 2.0 * y,
            _ if row == self.height => 2.0 * (y - self.height as f32 + 0.5),
            _ => y + 0.5 - row as f32,
        };
        let column = (x.floor() as i64).rem_euclid(self.width as i64) as usize;
        let corners = corners(&self.nodes, [self.width, self.height], [column, row], cells.floor);
        interpolate(corners, x - x.floor(), t.clamp(0.0, 1.0)) * self.sines[row] * cells.per_value
    }

    fn cells(&self, beside_lobes: bool) -> &Cells {
        // A map without features has no peaks.
        if beside_lobes { self.peaks.as_ref().unwrap_or(&self.all) } else { &self.all }
    }
}

impl Cells {
    fn new(nodes: &[f32], [width, height]: [usize; 2], sines: &[f32], floor: f32) -> Option<Self> {
        let mut masses = Vec::with_capacity(width * (height + 1));
        for (row, sine) in sines.iter().enumerate() {
            let share = if row == 0 || row == height { 0.125 * sine } else { 0.25 * sine };
            let mass = |x| share * corners(nodes, [width, height], [x, row], floor).iter().sum::<f32>();
            masses.extend((0..width).map(mass));
        }
        let choice = Piecewise2D::new(masses, width, height + 1)?;
        let per_value = height as f32 / ((height + 1) as f32 * choice.integral());
        (choice.integral() > 0.0 && per_value.is_finite()).then_some(Self { choice, per_value, floor })
    }
}

/// What is above the floor at the corners of a cell: left and right above, then below. In the rows at the poles brightness is even and the
/// sine is not, so that it falls from twice its mean to nothing there.
#[inline]
fn corners(nodes: &[f32], [width, height]: [usize; 2], [x, row]: [usize; 2], floor: f32) -> [f32; 4] {
    let right = if x + 1 == width { 0 } else { x + 1 };
    let pair = |y: usize| [x, right].map(|x| (nodes[y * width + x] - floor).max(0.0));
    let ([a, b], [c, d]) = match row {
        0 => ([0.0; 2], pair(0).map(|v| 2.0 * v)),
        _ if row == height => (pair(height - 1).map(|v| 2.0 * v), [0.0; 2]),
        _ => (pair(row - 1), pair(row)),
    };
    [a, b, c, d]
}

#[inline]
fn interpolate(w: [f32; 4], s: f32, t: f32) -> f32 {
    lerp(t, lerp(s, w[0], w[1]), lerp(s, w[2], w[3]))
}
