//! Builds the binary tables of the spectrum crate from the CSV files next to them.
//!
//! The RGB-to-spectrum tables follow Jakob and Hanika, "A Low-Dimensional Function Space for Efficient Spectral Upsampling"
//! (Eurographics 2019): a Gauss-Newton fit, in CIELAB, of `sigmoid(quadratic(lambda))` under the colour space's white.

use std::path::Path;
use std::{fs, thread};

use anyhow::{Context, Result, ensure};

/// Whole nanometres from 360 to 830.
const SAMPLES: usize = 471;
/// Nodes along each axis of a coefficient table. The spectrum crate knows the same number.
const RESOLUTION: usize = 40;

/// Writes `cie1931.f32`, `blackbody_log_xyz.f32`, `illuminant_d65.f32`, `illuminant_aces_d60.f32` and `uplift_*.f32` into `data`, the spectrum crate's data folder.
///
/// # Errors
/// When a CSV file is missing or malformed, or a table cannot be written.
pub fn run(data: &Path) -> Result<()> {
    let observer = read_csv(&data.join("cie1931.csv"), 3)?;
    ensure!(observer.len() == SAMPLES, "cie1931.csv has {} rows, not {SAMPLES}", observer.len());
    let xyz: [Vec<f64>; 3] = [1, 2, 3].map(|column| observer.iter().map(|row| row[column]).collect());
    write_f32(&data.join("cie1931.f32"), xyz.iter().flatten().copied())?;

    write_f32(&data.join("blackbody_log_xyz.f32"), blackbody_log_xyz(&xyz).into_iter())?;

    let mut whites = Vec::new();
    for (source, target) in [("stdillum-D65", "illuminant_d65"), ("illum-acesD60", "illuminant_aces_d60")] {
        let rows = read_csv(&data.join(format!("named/{source}.csv")), 1)?;
        let white = normalized_white(&rows, &xyz[1]);
        write_f32(&data.join(format!("{target}.f32")), white.iter().copied())?;
        whites.push(white);
    }
    for (name, primaries, white) in [
        ("srgb", [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], &whites[0]),
        ("dci_p3", [[0.68, 0.32], [0.265, 0.690], [0.15, 0.06]], &whites[0]),
        ("rec2020", [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], &whites[0]),
        ("aces2065_1", [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], &whites[1]),
    ] {
        let table = Gamut::new(&xyz, white, primaries).table();
        write_f32(&data.join(format!("uplift_{name}.f32")), table.into_iter())?;
    }
    Ok(())
}

/// Rows of `1 + columns` numbers; lines that start with `#` are comments.
fn read_csv(path: &Path, columns: usize) -> Result<Vec<Vec<f64>>> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut rows = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty()) {
        let row: Vec<f64> = line
            .split(',')
            .map(|cell| cell.trim().parse().with_context(|| format!("{}: not a number in '{line}'", path.display())))
            .collect::<Result<_>>()?;
        ensure!(row.len() == columns + 1, "{}: '{line}' should have {} cells", path.display(), columns + 1);
        rows.push(row);
    }
    Ok(rows)
}

fn write_f32(path: &Path, values: impl Iterator<Item = f64>) -> Result<()> {
    let bytes: Vec<u8> = values.flat_map(|value| (value as f32).to_le_bytes()).collect();
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The illuminant at whole nanometres, its ends continued, scaled so that it has the luminance of an equal-energy spectrum of 1.
fn normalized_white(rows: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    let at = |lambda: f64| {
        let k = rows.partition_point(|row| row[0] <= lambda);
        match (k.checked_sub(1).map(|k| &rows[k]), rows.get(k)) {
            (None, Some(only)) | (Some(only), None) => only[1],
            (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (lambda - a[0]) / (b[0] - a[0]),
            (None, None) => 0.0,
        }
    };
    let white: Vec<f64> = (0..SAMPLES).map(|i| at(360.0 + i as f64)).collect();
    let luminance: f64 = white.iter().zip(y).map(|(w, y)| w * y).sum();
    let scale = y.iter().sum::<f64>() / luminance;
    white.iter().map(|w| w * scale).collect()
}

/// `ln X, ln Y, ln Z` of black bodies with peak 1, from 10 to 2500 mired in steps of 5: nearly straight lines, so that few rows serve.
fn blackbody_log_xyz(xyz: &[Vec<f64>; 3]) -> Vec<f64> {
    let planck = |lambda: f64, kelvin: f64| 1.0 / (lambda.powi(5) * (1.438776877e7 / (lambda * kelvin)).exp_m1());
    (2..=500)
        .flat_map(|step| {
            let kelvin = 1e6 / (5.0 * f64::from(step));
            let peak = planck(2.897771955e6 / kelvin, kelvin);
            [0, 1, 2].map(|c: usize| {
                let sum: f64 = (0..SAMPLES).map(|i| xyz[c][i] * planck(360.0 + i as f64, kelvin)).sum();
                (sum / peak).ln()
            })
        })
        .collect()
}

/// What the fit needs to know of one colour space.
struct Gamut {
    /// Per nanometre: XYZ of the reflected white light, normalised to Y = 1 for a perfect reflector.
    weights: Vec<[f64; 3]>,
    xyz_from_rgb: [[f64; 3]; 3],
    white: [f64; 3],
}

impl Gamut {
    fn new(xyz: &[Vec<f64>; 3], illuminant: &[f64], primaries: [[f64; 2]; 3]) -> Gamut {
        let luminance: f64 = illuminant.iter().zip(&xyz[1]).map(|(s, y)| s * y).sum();
        let weights: Vec<[f64; 3]> =
            (0..SAMPLES).map(|i| [0, 1, 2].map(|c| xyz[c][i] * illuminant[i] / luminance)).collect();
        let white = [0, 1, 2].map(|c| weights.iter().map(|w| w[c]).sum::<f64>());
        let columns = primaries.map(|[x, y]| [x / y, 1.0, (1.0 - x - y) / y]);
        let matrix = [0, 1, 2].map(|row| columns.map(|column| column[row]));
        let scale = solve(matrix, white);
        let xyz_from_rgb = matrix.map(|row| [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]]);
        Gamut { weights, xyz_from_rgb, white }
    }

    /// Coefficients for all nodes, weighted and compressed: largest channel, its value, then the other two channels relative to it; the last runs fastest.
    fn table(&self) -> Vec<f64> {
        let n = RESOLUTION;
        let rows: Vec<(usize, usize)> = (0..3).flat_map(|l| (0..n).map(move |j| (l, j))).collect();
        let threads = thread::available_parallelism().map_or(1, |count| count.get());
        let chunk = rows.len().div_ceil(threads);
        let mut table = vec![0.0; 3 * n * n * n * 3];
        thread::scope(|scope| {
            let workers: Vec<_> = rows
                .chunks(chunk)
                .map(|rows| scope.spawn(move || rows.iter().map(|&(l, j)| (l, j, self.slab(l, j))).collect::<Vec<_>>()))
                .collect();
            for worker in workers {
                for (l, j, slab) in worker.join().expect("a fit cannot panic") {
                    for (k, row) in slab.iter().enumerate() {
                        let start = ((l * n + k) * n + j) * n * 3;
                        table[start..start + n * 3].copy_from_slice(row.as_flattened());
                    }
                }
            }
        });
        table
    }

    /// All fits for one largest channel `l` and one node `j` of the second ratio, by level and first ratio.
    fn slab(&self, l: usize, j: usize) -> Vec<[[f64; 3]; RESOLUTION]> {
        let mut slab = vec![[[0.0; 3]; RESOLUTION]; RESOLUTION];
        for i in 0..RESOLUTION {
            let rgb = |b: f64| {
                let mut rgb = [0.0; 3];
                rgb[l] = b;
                rgb[(l + 1) % 3] = ratio(i) * b;
                rgb[(l + 2) % 3] = ratio(j) * b;
                rgb
            };
            let walk = self.walk(rgb);
            for (k, row) in slab.iter_mut().enumerate() {
                let b = level(k);
                // From the nearest stop of the walk that is not farther from its start.
                let after = (0..STOPS).position(|m| stop(m) >= b).unwrap_or(STOPS - 1);
                let near = if after > START && stop(after) > b { after - 1 } else { after };
                let mut c = walk[near];
                self.fit(rgb(b), &mut c);
                row[i] = compress(centred(c).map(|v| v * weight(b)));
            }
        }
        slab
    }

    /// Fits of `rgb(b)` for growing and for shrinking `b`, each from the one before it, so that no first guess is far off.
    ///
    /// Where no smooth reflectance has the colour, the outcome is not a minimum of anything but the place where steps and limit balance. Its
    /// starting point and its stops are those of the published tables, so that such colours look the same here as in other renderers.
    fn walk(&self, rgb: impl Fn(f64) -> [f64; 3]) -> [[f64; 3]; STOPS] {
        let mut walk = [[0.0; 3]; STOPS];
        let mut c = [0.0; 3];
        for m in START..STOPS {
            self.fit(rgb(stop(m)), &mut c);
            walk[m] = c;
        }
        c = [0.0; 3];
        for m in (0..=START).rev() {
            self.fit(rgb(stop(m)), &mut c);
            walk[m] = c;
        }
        walk
    }

    /// At most 15 steps of Gauss and Newton from the guess `c`, undamped; polynomials with a coefficient above [`limit`] are scaled down to it.
    fn fit(&self, rgb: [f64; 3], c: &mut [f64; 3]) {
        let target = self.lab(multiply(&self.xyz_from_rgb, rgb)).0;
        let limit = limit(rgb.into_iter().fold(0.0, f64::max));
        for _ in 0..15 {
            let (xyz, derivative) = self.reflect(*c);
            let (lab, slope) = self.lab(xyz);
            let residual = [0, 1, 2].map(|r| target[r] - lab[r]);
            // As many equations as unknowns: no normal equations.
            let step = solve(multiply_matrices(slope, derivative), residual);
            if step.iter().any(|v| !v.is_finite()) {
                break;
            }
            for p in 0..3 {
                c[p] += step[p];
            }
            let largest = c.iter().fold(0.0f64, |m, &v| m.max(v));
            if largest > limit {
                *c = c.map(|v| v * limit / largest);
            }
            if residual.iter().map(|v| v * v).sum::<f64>() < 1e-6 {
                break;
            }
        }
    }

    /// XYZ of the reflectance with the coefficients `c` in `t = (lambda - 360) / 470` under white, and its derivative by the coefficients.
    fn reflect(&self, c: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let mut xyz = [0.0; 3];
        let mut derivative = [[0.0; 3]; 3];
        for (i, weight) in self.weights.iter().enumerate() {
            let t = i as f64 / 470.0;
            let x = (c[0] * t + c[1]) * t + c[2];
            let root = 1.0 / (1.0 + x * x).sqrt();
            let (s, slope) = (0.5 + 0.5 * x * root, 0.5 * root * root * root);
            let powers = [slope * t * t, slope * t, slope];
            for m in 0..3 {
                xyz[m] += weight[m] * s;
                for p in 0..3 {
                    derivative[m][p] += weight[m] * powers[p];
                }
            }
        }
        (xyz, derivative)
    }

    /// CIELAB of `xyz` relative to the white, and its derivative by XYZ.
    fn lab(&self, xyz: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        const DELTA: f64 = 6.0 / 29.0;
        let mut f = [0.0; 3];
        let mut slope = [0.0; 3];
        for m in 0..3 {
            let t = xyz[m] / self.white[m];
            if t > DELTA * DELTA * DELTA {
                f[m] = t.cbrt();
                slope[m] = 1.0 / (3.0 * f[m] * f[m] * self.white[m]);
            } else {
                f[m] = t / (3.0 * DELTA * DELTA) + 4.0 / 29.0;
                slope[m] = 1.0 / (3.0 * DELTA * DELTA * self.white[m]);
            }
        }
        let lab = [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])];
        let derivative = [
            [0.0, 116.0 * slope[1], 0.0],
            [500.0 * slope[0], -500.0 * slope[1], 0.0],
            [0.0, 200.0 * slope[1], -200.0 * slope[2]],
        ];
        (lab, derivative)
    }
}

/// No positive coefficient of a fit at `level` grows beyond this; negative ones may. The published tables have 200 throughout, with which dark
/// saturated colours come out up to twice as bright as they should, although smooth reflectances have them.
fn limit(level: f64) -> f64 {
    200.0 * (0.05 / level.max(1e-6)).sqrt().max(1.0)
}

/// How many levels a walk visits, and the one in the middle where it starts.
const STOPS: usize = 64;
const START: usize = 12;

/// Level `m` of a walk.
fn stop(m: usize) -> f64 {
    smooth(smooth(m as f64 / (STOPS - 1) as f64))
}

/// The polynomial in `t = (lambda - 360) / 470`, rewritten in `u = 2 t - 1`.
fn centred([a, b, c]: [f64; 3]) -> [f64; 3] {
    [a / 4.0, (a + b) / 2.0, a / 4.0 + b / 2.0 + c]
}

/// Node `k` of the largest component: dense near black and white, where the coefficients change fast. Not quite 0, where they have no limit.
fn level(k: usize) -> f64 {
    let once = smooth(k as f64 / (RESOLUTION - 1) as f64);
    (0.5 * once + 0.5 * smooth(once)).max(1e-6)
}

/// Node `i` of a smaller component relative to the largest: somewhat denser near 0 and 1.
fn ratio(i: usize) -> f64 {
    let t = i as f64 / (RESOLUTION - 1) as f64;
    0.4 * smooth(t) + 0.6 * t
}

fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// What the coefficients are multiplied by before they are stored: with it they are nearly linear in the level, since a sigmoid has the value `s` at
/// `(s - 1/2) / sqrt(s (1 - s))`. Not quite 0 at 1, where coefficients of saturated colours stay finite.
fn weight(level: f64) -> f64 {
    (level * (1.03 - level)).sqrt()
}

/// Weighted coefficients as they are stored, within the unit ball: near the end of what smooth reflectances reach, coefficients grow as the reciprocal of
/// the distance from it, and what is stored then changes linearly.
fn compress(c: [f64; 3]) -> [f64; 3] {
    let length = c.iter().map(|v| v * v).sum::<f64>().sqrt();
    c.map(|v| v / (20.0 + length))
}

fn multiply(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn multiply_matrices(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| [0, 1, 2].map(|c| (0..3).map(|k| row[k] * b[k][c]).sum()))
}

/// Solves `m x = b` by Gaussian elimination with row pivots; not finite when `m` is singular.
fn solve(mut m: [[f64; 3]; 3], mut b: [f64; 3]) -> [f64; 3] {
    for k in 0..3 {
        let pivot = (k..3).max_by(|&a, &c| m[a][k].abs().total_cmp(&m[c][k].abs())).unwrap_or(k);
        m.swap(k, pivot);
        b.swap(k, pivot);
        for r in k + 1..3 {
            let factor = m[r][k] / m[k][k];
            for c in k..3 {
                m[r][c] -= factor * m[k][c];
            }
            b[r] -= factor * b[k];
        }
    }
    let mut x = [0.0; 3];
    for k in (0..3).rev() {
        let rest: f64 = (k + 1..3).map(|c| m[k][c] * x[c]).sum();
        x[k] = (b[k] - rest) / m[k][k];
    }
    x
}
