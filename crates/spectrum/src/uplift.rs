//! RGB to spectrum: reflectances of the form `sigmoid(c0 u^2 + c1 u + c2)`, looked up in precomputed tables.
//!
//! Jakob and Hanika, "A Low-Dimensional Function Space for Efficient Spectral Upsampling" (Eurographics 2019). The tables are made by
//! `cargo run -p xtask -- tables`.

use crate::{ColorSpace, Lanes};

/// Nodes along each axis of a table.
const RES: usize = 40;

static SRGB: &[u8] = include_bytes!("../data/uplift_srgb.f32");
static DCI_P3: &[u8] = include_bytes!("../data/uplift_dci_p3.f32");
static REC2020: &[u8] = include_bytes!("../data/uplift_rec2020.f32");
static ACES2065: &[u8] = include_bytes!("../data/uplift_aces2065_1.f32");

/// The nodes of the largest component: dense near black and white, where the coefficients change fast.
static LEVELS: [f32; RES] = {
    let mut levels = [0.0; RES];
    let mut k = 0;
    while k < RES {
        let once = smooth(k as f64 / (RES - 1) as f64);
        let level = 0.5 * once + 0.5 * smooth(once);
        levels[k] = if level < 1e-6 { 1e-6 } else { level as f32 };
        k += 1;
    }
    levels
};

/// The nodes of a smaller component relative to the largest: somewhat denser near 0 and 1.
static RATIOS: [f32; RES] = {
    let mut ratios = [0.0; RES];
    let mut i = 0;
    while i < RES {
        let t = i as f64 / (RES - 1) as f64;
        ratios[i] = (0.4 * smooth(t) + 0.6 * t) as f32;
        i += 1;
    }
    ratios
};

const fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// A smooth spectrum with values in (0,1): `1/2 + x / (2 sqrt(1 + x^2))` of `x = c0 u^2 + c1 u + c2`, where `u = (lambda - 595 nm) / 235 nm`
/// runs from -1 to 1 over 360..830 nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmoid(pub [f32; 3]);

impl Sigmoid {
    /// A coefficient so large that the sigmoid is exactly 0 or 1, and its square still finite.
    const SATURATED: f32 = 1e19;

    /// The flat spectrum `value`, clamped to `[0,1]`.
    #[inline]
    pub fn flat(value: f32) -> Sigmoid {
        let x = (value - 0.5) / (value * (1.0 - value)).max(0.0).sqrt();
        Sigmoid([0.0, 0.0, x.clamp(-Self::SATURATED, Self::SATURATED)])
    }

    /// The value at `lambda` nanometres.
    #[inline]
    pub fn eval_at(&self, lambda: f32) -> f32 {
        let [c0, c1, c2] = self.0;
        let u = (lambda - 595.0) * (1.0 / 235.0);
        let x = (c0 * u + c1) * u + c2;
        // The same as in the definition, but without cancellation in the dark.
        let root = (1.0 + x * x).sqrt();
        let tail = 1.0 / (2.0 * root * (root + x.abs()));
        if x < 0.0 { tail } else { 1.0 - tail }
    }

    /// The values at four wavelengths in nanometres.
    #[inline]
    pub fn eval(&self, lambda: [f32; 4]) -> Lanes {
        Lanes(lambda.map(|l| self.eval_at(l)))
    }

    /// The largest value within 360..830 nm.
    pub fn max_value(&self) -> f32 {
        let [c0, c1, _] = self.0;
        let ends = self.eval_at(360.0).max(self.eval_at(830.0));
        let vertex = -c1 / (2.0 * c0);
        if vertex.abs() < 1.0 { ends.max(self.eval_at(595.0 + 235.0 * vertex)) } else { ends }
    }
}

/// The spectrum that looks like `rgb` under the white of `space`; components are clamped to `[0,1]`; NaN stays NaN.
pub(crate) fn coefficients(space: ColorSpace, rgb: [f32; 3]) -> Sigmoid {
    let rgb = rgb.map(|v| v.clamp(0.0, 1.0));
    let [r, g, b] = rgb;
    if r == g && g == b {
        return Sigmoid::flat(r);
    }
    let table = match space {
        ColorSpace::Srgb => SRGB,
        ColorSpace::DciP3 => DCI_P3,
        ColorSpace::Rec2020 => REC2020,
        ColorSpace::Aces2065 => ACES2065,
    };
    let largest = if r > g {
        if r > b { 0 } else { 2 }
    } else if g > b {
        1
    } else {
        2
    };
    let z = rgb[largest];
    let (xi, dx) = locate(&RATIOS, rgb[(largest + 1) % 3] / z);
    let (yi, dy) = locate(&RATIOS, rgb[(largest + 2) % 3] / z);
    let (zi, dz) = locate(&LEVELS, z);

    let mut c = [0.0; 3];
    for (k, wz) in [(0, 1.0 - dz), (1, dz)] {
        for (j, wy) in [(0, 1.0 - dy), (1, dy)] {
            let first = (((largest * RES + zi + k) * RES + yi + j) * RES + xi) * 3;
            let (left, right) = (triple(table, first), triple(table, first + 3));
            let (a, b) = (wz * wy * (1.0 - dx), wz * wy * dx);
            for p in 0..3 {
                c[p] += a * left[p] + b * right[p];
            }
        }
    }
    // What is stored changes nearly linearly, within the gamut of smooth reflectances and across its edge: coefficients `c` are stored as
    // `w c / (20 + |w c|)`, where `w = sqrt(z (1.03 - z))`. Bounded here, so that squares stay finite.
    let length = (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt();
    let weight = (z.max(1e-12) * (1.03 - z)).sqrt();
    let expand = 20.0 / ((1.0 - length) * weight);
    Sigmoid(c.map(|v| v * expand))
}

/// The interval between two nodes in which `v` lies, and where in it, in 0..=1.
#[inline]
fn locate(nodes: &[f32; RES], v: f32) -> (usize, f32) {
    // Counting all nodes vectorises, and so is faster than a binary search among so few.
    let below: u32 = nodes.iter().map(|&node| u32::from(node < v)).sum();
    let i = (below as usize).clamp(1, RES - 1) - 1;
    (i, ((v - nodes[i]) / (nodes[i + 1] - nodes[i])).clamp(0.0, 1.0))
}

/// Three little-endian numbers, from the `first`-th on.
#[inline]
pub(crate) fn triple(table: &[u8], first: usize) -> [f32; 3] {
    let bytes = &table[4 * first..4 * first + 12];
    [0, 4, 8].map(|k| f32::from_le_bytes([bytes[k], bytes[k + 1], bytes[k + 2], bytes[k + 3]]))
}
