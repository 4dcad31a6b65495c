//! Lanes of many paths side by side.

use crate::Lanes;
use steradian_math::Row;

/// [`Lanes`] for each place of a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct LaneRows(pub [Row; Lanes::COUNT]);

impl LaneRows {
    /// The lanes at a place.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Lanes {
        let [a, b, c, d] = &self.0;
        Lanes([a.0[i], b.0[i], c.0[i], d.0[i]])
    }

    /// Writes the lanes at a place.
    #[inline(always)]
    pub fn set(&mut self, i: usize, lanes: Lanes) {
        let [a, b, c, d] = &mut self.0;
        [a.0[i], b.0[i], c.0[i], d.0[i]] = lanes.0;
    }
}
