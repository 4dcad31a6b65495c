//! Extinction and albedo that vary independently, each looked up on its own: products of interpolated values are no interpolated products.

use super::MediumPoint;
use super::majorant::MajorantGrid;
use super::rgb_grid::{Cell, Tinted};
use crate::GridTexture;
use crate::medium::{Field, Fields};
use steradian_math::{Bounds3, Point3, Vec3};
use steradian_spectrum::{ColorSpace, Lanes, Spectrum, SpectrumUse, Wavelengths};

/// Two fields with the spectra of their cells worked out, and bounds on the extinction.
#[derive(Clone, Debug)]
pub(super) struct BuiltFields {
    /// The spectra of cells of three channels; empty for others.
    sigma_t: Vec<Cell>,
    albedo: Vec<Cell>,
    /// Whether wavelengths differ.
    pub coloured: bool,
    /// Bounds on what varies of the extinction.
    pub majorants: MajorantGrid,
}

fn cells(field: &Field) -> Vec<Cell> {
    match field {
        Field::Grid(g) if g.channels == 3 => {
            let of = |rgb: &[f32; 3]| Cell::new(ColorSpace::Srgb, SpectrumUse::Unbounded, *rgb);
            g.values.as_chunks::<3>().0.iter().map(of).collect()
        }
        _ => Vec::new(),
    }
}

impl Field {
    /// What the field is everywhere, if it does not vary; otherwise one.
    pub(super) fn factor(&self) -> Spectrum {
        match self {
            Self::Even(s) => s.clone(),
            Self::Grid(_) => Spectrum::constant(1.0, SpectrumUse::Unbounded),
        }
    }

    /// What it is in RGB at a point of the medium's space.
    pub fn rgb(&self, p: Point3) -> [f32; 3] {
        match self {
            Self::Even(s) => s.rgb(),
            Self::Grid(g) => g.look_up(p),
        }
    }

    fn is_coloured(&self) -> bool {
        match self {
            Self::Even(s) => !s.is_constant(),
            Self::Grid(g) => g.channels == 3,
        }
    }

    /// What varies of the field at a point.
    #[inline]
    fn at(&self, cells: &[Cell], p: Point3, w: &Wavelengths) -> Lanes {
        match self {
            Self::Even(_) => Lanes::ONE,
            Self::Grid(g) if g.channels == 3 && w.is_rgb() => g.interpolate(p, |i| cells[i].eval(w)),
            Self::Grid(g) if g.channels == 3 => {
                let Tinted { hue, amount } = g.interpolate(p, |i| cells[i].tinted(w));
                hue * amount
            }
            Self::Grid(g) => Lanes::splat(g.interpolate(p, |i| g.values[i])),
        }
    }
}

impl Fields {
    pub(super) fn bytes(&self) -> usize {
        let of = |f: &Field| match f {
            Field::Even(_) => 0,
            Field::Grid(g) => size_of_val(g.values.as_slice()),
        };
        of(&self.sigma_t) + of(&self.albedo)
    }
}

impl BuiltFields {
    pub fn new(fields: &Fields) -> Self {
        let (sigma_t, albedo) = (cells(&fields.sigma_t), cells(&fields.albedo));
        let (low, d) = (fields.bounds.min, fields.bounds.diagonal());
        let most = |g: &GridTexture, b: &Bounds3| {
            let at = |p: Point3| low + Vec3::new(p.x * d.x, p.y * d.y, p.z * d.z);
            let b = Bounds3::new(at(b.min), at(b.max));
            if g.channels == 1 {
                return g.most_in(&b, |i| g.values[i]);
            }
            let (hue, amount) = (g.most_in(&b, |i| sigma_t[i].most_hue()), g.most_in(&b, |i| sigma_t[i].amount()));
            (hue * amount).max(g.most_in(&b, |i| sigma_t[i].most()))
        };
        let majorants = MajorantGrid::new(fields.bounds, super::GRID_CELLS, |b| match &fields.sigma_t {
            Field::Even(_) => 1.0,
            Field::Grid(g) => most(g, b),
        });
        let coloured = fields.sigma_t.is_coloured() || fields.albedo.is_coloured();
        Self { sigma_t, albedo, coloured, majorants }
    }

    /// The medium at a point of its space, given the factors of extinction and albedo. Saturated colours of Mitsuba have albedos above one at some
    /// wavelengths, and there absorption is less than nothing.
    #[inline]
    pub fn at(&self, fields: &Fields, p: Point3, [sigma_t, albedo]: [Lanes; 2], w: &Wavelengths) -> MediumPoint {
        let sigma_t = sigma_t * fields.sigma_t.at(&self.sigma_t, p, w);
        let albedo = albedo * fields.albedo.at(&self.albedo, p, w);
        let albedo = albedo.clamp_zero();
        MediumPoint { sigma_a: sigma_t * (Lanes::ONE - albedo), sigma_s: sigma_t * albedo, emission: Lanes::ZERO }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.sigma_t.as_slice()) + size_of_val(self.albedo.as_slice()) + self.majorants.bytes()
    }
}
