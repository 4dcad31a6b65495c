//! Environment maps side by side: directions to them, what they show, and how likely they are, as each path alone would have it.
//!
//! Look-ups wait for memory. Each step is therefore a loop of its own over all paths, so that their waits overlap.

use super::LightContext;
use super::environment::Environment;
use super::far::Far;
use crate::EnvironmentMapping;
use crate::world::World;
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_math::{INV_4PI, Row, Rows3, row_end};
use steradian_sampling::warp::{octahedral_to_square, square_to_octahedral};
use steradian_spectrum::{Lanes, Wavelengths};

/// Directions to an environment map. Memory to be used again and again.
#[derive(Clone, Debug, Default)]
pub struct SkyRows {
    /// Where in other rows each of them belongs.
    pub(in crate::world) places: Vec<usize>,
    /// Random numbers, then points of the map's square.
    pub(in crate::world) u: [Row; 2],
    /// Unit directions.
    pub(in crate::world) wi: Rows3,
    /// Their densities per solid angle.
    pub(in crate::world) pdf: Row,
    /// Whether there is a direction.
    pub(in crate::world) lit: Row<u32>,
    square: [Row; 2],
}

/// Directions of points of the square, as `Environment::sample_direction` has them, and the squares' points again.
#[inline(always)]
fn point_at(sky: &Environment, rows: &mut SkyRows, end: usize) {
    for i in 0..end {
        let local = square_to_octahedral([rows.u[0].0[i], rows.u[1].0[i]]);
        let pdf = rows.pdf.0[i] * INV_4PI;
        let wi = sky.world_from_light.vector(local).normalize();
        rows.pdf.0[i] = pdf;
        rows.lit.0[i] = u32::from((pdf > 0.0) & (pdf < f32::INFINITY));
        rows.wi.set(i, wi);
        let [x, y] = octahedral_to_square(sky.local(wi));
        (rows.square[0].0[i], rows.square[1].0[i]) = (x, y);
    }
}

/// The points of the square that directions lead to.
#[inline(always)]
fn look(sky: &Environment, d: &Rows3, rows: &mut SkyRows, end: usize) {
    for i in 0..end {
        let [x, y] = octahedral_to_square(sky.local(d.vec(i)));
        (rows.square[0].0[i], rows.square[1].0[i]) = (x, y);
    }
}

impl World {
    /// An environment map in equal-area layout.
    #[inline]
    fn sky(&self, light: u32) -> Option<&Environment> {
        match self.lights.far.get((light as usize).checked_sub(self.lights.emitters.len())?)?.still()? {
            Far::Map(sky) if sky.mapping == EnvironmentMapping::EqualArea => Some(sky),
            _ => None,
        }
    }

    /// Whether a light is worked on in rows here.
    #[inline]
    pub(in crate::world) fn has_sky_rows(&self, light: u32) -> bool {
        self.sky(light).is_some()
    }

    /// Samples directions to a light with rows beside lobes, for as many pairs of random numbers as there are places.
    pub(in crate::world) fn sample_sky(&self, level: Level, light: u32, rows: &mut SkyRows) {
        let n = rows.places.len();
        rows.lit = Row::default();
        let Some(sky) = self.sky(light) else { return };
        let Some(distribution) = sky.peaks() else { return };
        distribution.sample_rows(&mut rows.u, &mut rows.pdf, n);
        dispatch!(level, _simd => point_at(sky, rows, row_end(n)));
    }

    /// Looks in the first `n` directions; `false` if the light has no rows.
    pub fn look_at_sky(&self, level: Level, light: u32, d: &Rows3, n: usize, rows: &mut SkyRows) -> bool {
        let Some(sky) = self.sky(light) else { return false };
        dispatch!(level, _simd => look(sky, d, rows, row_end(n)));
        true
    }

    /// What has been seen at a place: as [`World::environment`].
    #[inline]
    pub fn sky_at(&self, light: u32, rows: &SkyRows, i: usize, w: &Wavelengths) -> Lanes {
        let square = [rows.square[0].0[i], rows.square[1].0[i]];
        self.sky(light).map_or(Lanes::ZERO, |sky| sky.lanes_at_square(&self.scene.images, square, w))
    }

    /// The density of what has been seen at a place: as [`World::light_pdf`] for a point beside lobes.
    #[inline]
    pub fn sky_pdf_at(&self, context: &LightContext, light: u32, rows: &SkyRows, i: usize) -> f32 {
        let probability = self.pick_probability(context, light);
        if probability == 0.0 {
            return 0.0;
        }
        let square = [rows.square[0].0[i], rows.square[1].0[i]];
        let distribution = self.sky(light).and_then(Environment::peaks);
        let pdf = distribution.map_or(0.0, |d| d.pdf(square) * INV_4PI);
        if pdf.is_finite() { pdf * probability } else { 0.0 }
    }
}
