//! Radiance by bands of wavelengths: the mean of what samples found in each. Each of the four wavelengths of a sample falls into
//! some band, so that a band is a ratio of two sums: of radiance, and of the weights of the samples that looked there.

use crate::film::Film;
use crate::layers::layer_width;
use crate::sample::Sampled;
use steradian_scene::{Bands, MOST_BANDS};
use steradian_spectrum::{Lanes, cie};

/// What layers of bands are called, before their number and range.
const NAME: &str = "spectrum";

/// Three numbers to a slot, two for each band.
pub(crate) fn slots_of(count: u32) -> usize {
    (2 * count as usize).div_ceil(3)
}

/// All there is to know of the layer, in one word.
pub(crate) fn name_of(bands: Bands) -> String {
    format!("{NAME}:{}:{}:{}", bands.count, bands.range[0], bands.range[1])
}

/// And back.
pub(crate) fn from_name(name: &str) -> Option<Bands> {
    let mut words = name.strip_prefix(NAME)?.strip_prefix(':')?.split(':');
    let count = words.next()?.parse().ok().filter(|n| (1..=MOST_BANDS).contains(n))?;
    let range = [words.next()?.parse().ok()?, words.next()?.parse().ok()?];
    (range[0] < range[1]).then_some(Bands { count, range })
}

/// Sorts the radiance of a sample into bands.
pub(crate) fn sort(bands: Bands, sample: &Sampled, slots: &mut [[f32; 3]]) {
    slots.fill([0.0; 3]);
    let mut add = |i: u32, v: f32| slots[i as usize / 3][i as usize % 3] += v;
    // Lamps are normalised to photometric units; this undoes it.
    let scale = sample.weight * sample.kept * cie::Y_INTEGRAL;
    let (lambda, pdf) = (sample.wavelengths.lambda(), sample.wavelengths.pdf());
    for k in (0..Lanes::COUNT).filter(|&k| pdf[k] > 0.0) {
        let band = bands.of(lambda[k]);
        add(band, sample.radiance[k] * scale);
        add(bands.count + band, sample.weight);
    }
}

/// The spectra of a film among its layers of these names: the bands, and for each, row by row, the radiance in
/// W m^-2 sr^-1 nm^-1 where lamps have theirs so. `None` if the film keeps none.
///
/// # Panics
/// If the film has other layers.
pub fn read_spectrum(film: &Film, names: &[String]) -> Option<(Bands, Vec<Vec<f32>>)> {
    assert_eq!(film.layers(), layer_width(names), "the film has other layers");
    let at = names.iter().position(|n| from_name(n).is_some())?;
    let bands = from_name(&names[at])?;
    let from = layer_width(&names[..at]);
    let means = film.layer_means();
    let of = |m: &[[f32; 3]], i: u32| m[from + i as usize / 3][i as usize % 3];
    let mean = |m: &[[f32; 3]], band: u32| {
        let weight = of(m, bands.count + band);
        if weight != 0.0 { of(m, band) / weight } else { 0.0 }
    };
    Some((bands, (0..bands.count).map(|b| means.iter().map(|m| mean(m, b)).collect()).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_all() {
        let bands = Bands { count: 16, range: [380.5, 730.0] };
        assert_eq!(from_name(&name_of(bands)), Some(bands));
        for wrong in ["direct", "spectrum", "spectrum:0:360:830", "spectrum:257:360:830", "spectrum:4:830:360"] {
            assert_eq!(from_name(wrong), None);
        }
        assert_eq!((bands.of(380.5), bands.of(729.9), bands.of(730.0)), (0, 15, 15));
        assert_eq!(layer_width(&["direct".into(), name_of(bands)]), 1 + 11);
    }
}
