//! The lane that decides where a path through a coloured medium goes, and the average over all that could have decided.
//!
//! Spectral multiple importance sampling (Wilkie et al. 2014; Miller et al. 2019): a path carries, for each lane, the
//! density with which that lane would have made it, over the density of the lane that did. A contribution divided by the
//! average of these ratios is weighted with the balance heuristic, if each lane is as often the hero as any other.

use crate::numbers::{Domain, Numbers};
use steradian_spectrum::{Lanes, Wavelengths};

/// The lane that decides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hero {
    /// Its index.
    pub lane: usize,
}

impl Hero {
    /// The hero wavelength, which is random already; one of red, green and blue in RGB mode.
    #[inline]
    pub fn choose(w: &Wavelengths, numbers: &mut impl Numbers) -> Self {
        let lane = if w.is_rgb() { ((numbers.one(Domain::Other) * 3.0) as usize).min(2) } else { w.hero_lane() };
        Self { lane }
    }

    /// The mean ratio over the lanes that could have been the hero: all four wavelengths, or red, green and blue, or the
    /// hero alone once the path has been dispersed, since no other wavelength can have come this way.
    #[inline]
    pub fn average(self, ratios: Lanes, w: &Wavelengths) -> f32 {
        if w.is_rgb() {
            (ratios[0] + ratios[1] + ratios[2]) * (1.0 / 3.0)
        } else if w.secondary_terminated() {
            ratios[self.lane]
        } else {
            ratios.average()
        }
    }
}
