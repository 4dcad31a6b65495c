//! Coefficients of any colour on a regular grid. Spectra are interpolated, not RGB values, so each cell has its own.

use super::MediumPoint;
use super::majorant::MajorantGrid;
use crate::medium::{RgbGrid, VoxelGrid};
use std::ops::{Add, Mul};
use steradian_math::{Bounds3, Point3};
use steradian_spectrum::{ColorSpace, Lanes, Sigmoid, SpectrumUse, Wavelengths};

/// An RGB grid with the spectra of its cells worked out.
#[derive(Clone, Debug)]
pub(super) struct BuiltRgbGrid {
    bounds: Bounds3,
    space: ColorSpace,
    sigma_a: Option<VoxelGrid<Cell>>,
    sigma_s: Option<VoxelGrid<Cell>>,
    emission: Option<(VoxelGrid<Cell>, f32)>,
    /// Bounds on the sum of both coefficients, without the medium's factor.
    pub majorants: MajorantGrid,
}

/// A smooth spectrum, and what it is in RGB mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    scale: f32,
    sigmoid: Sigmoid,
    rgb: [f32; 3],
}

/// A spectrum and its factor.
#[derive(Clone, Copy, Default)]
pub(super) struct Tinted {
    pub hue: Lanes,
    pub amount: f32,
}

impl Add for Tinted {
    type Output = Tinted;

    #[inline]
    fn add(self, b: Tinted) -> Tinted {
        Tinted { hue: self.hue + b.hue, amount: self.amount + b.amount }
    }
}

impl Mul<f32> for Tinted {
    type Output = Tinted;

    #[inline]
    fn mul(self, s: f32) -> Tinted {
        Tinted { hue: self.hue * s, amount: self.amount * s }
    }
}

impl Cell {
    pub fn new(space: ColorSpace, usage: SpectrumUse, rgb: [f32; 3]) -> Self {
        // Half of what a sigmoid can reach, where it is smoothest.
        let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
        let sigmoid = if scale > 0.0 { space.to_coefficients(rgb.map(|v| v / scale)) } else { Sigmoid([0.0; 3]) };
        let reading = match usage {
            SpectrumUse::Illuminant => space.illuminant_lanes(rgb, &Wavelengths::rgb()),
            SpectrumUse::Albedo | SpectrumUse::Unbounded => space.unbounded_lanes(rgb, &Wavelengths::rgb()),
        };
        Self { scale, sigmoid, rgb: reading.rgb() }
    }

    #[inline]
    pub fn eval(&self, w: &Wavelengths) -> Lanes {
        if w.is_rgb() { Lanes::from_rgb(self.rgb) } else { self.sigmoid.eval(w.lambda()) * self.scale }
    }

    /// A spectrum of at most one and its factor, which Mitsuba interpolates each on its own.
    #[inline]
    pub fn tinted(&self, w: &Wavelengths) -> Tinted {
        Tinted { hue: self.sigmoid.eval(w.lambda()), amount: self.scale }
    }

    pub fn most_hue(&self) -> f32 {
        self.sigmoid.max_value()
    }

    pub fn amount(&self) -> f32 {
        self.scale
    }

    pub fn most(&self) -> f32 {
        (self.sigmoid.max_value() * self.scale).max(Lanes::from_rgb(self.rgb).max_component())
    }
}

impl BuiltRgbGrid {
    pub fn new(grid: &RgbGrid) -> Self {
        let cells = |v: &VoxelGrid<[f32; 3]>, usage| VoxelGrid {
            size: v.size,
            values: v.values.iter().map(|&rgb| Cell::new(grid.color_space, usage, rgb)).collect(),
        };
        let sigma_a = grid.sigma_a.as_ref().map(|v| cells(v, SpectrumUse::Unbounded));
        let sigma_s = grid.sigma_s.as_ref().map(|v| cells(v, SpectrumUse::Unbounded));
        let emission = grid.emission.as_ref().map(|(v, scale)| (cells(v, SpectrumUse::Illuminant), *scale));
        let most =
            |v: &Option<VoxelGrid<Cell>>, b: &Bounds3| v.as_ref().map_or(1.0, |v| v.max_of(b, |i| v.values[i].most()));
        let majorants = MajorantGrid::new(grid.bounds, super::GRID_CELLS, |b| most(&sigma_a, b) + most(&sigma_s, b));
        Self { bounds: grid.bounds, space: grid.color_space, sigma_a, sigma_s, emission, majorants }
    }

    /// The medium at a point of its space, given the factors of its coefficients.
    pub fn at(&self, p: Point3, scale_a: Lanes, scale_s: Lanes, w: &Wavelengths) -> MediumPoint {
        let q = self.bounds.offset(p);
        let look_up = |v: &VoxelGrid<Cell>| v.interpolate(q, |i| v.values[i].eval(w));
        let coefficient = |v: &Option<VoxelGrid<Cell>>| v.as_ref().map_or(Lanes::ONE, look_up);
        let emission = self.emission.as_ref().map_or(Lanes::ZERO, |(v, scale)| {
            let tint = look_up(v) * *scale;
            // In RGB mode the readings contain the illuminant.
            if w.is_rgb() { tint } else { tint * self.space.illuminant().eval(w.lambda()) }
        });
        MediumPoint {
            sigma_a: coefficient(&self.sigma_a) * scale_a,
            sigma_s: coefficient(&self.sigma_s) * scale_s,
            emission,
        }
    }

    pub fn bytes(&self) -> usize {
        let all = self.sigma_a.iter().chain(&self.sigma_s).chain(self.emission.iter().map(|e| &e.0));
        all.map(|v| size_of_val(v.values.as_slice())).sum::<usize>() + self.majorants.bytes()
    }
}
