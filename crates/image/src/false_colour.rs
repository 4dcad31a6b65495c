//! Numbers as colours: a scale from black over purple and orange to pale yellow whose lightness rises all the way.

use crate::{Encoding, Error, Image};

/// Nine colours, evenly spaced, of the "magma" scale (van der Walt and Smith 2015, released under CC0), sRGB codes.
const MAGMA: [[u8; 3]; 9] = [
    [0, 0, 4],
    [29, 17, 71],
    [81, 18, 124],
    [131, 38, 129],
    [183, 55, 121],
    [231, 82, 99],
    [252, 137, 97],
    [254, 195, 136],
    [252, 253, 191],
];

/// The sRGB codes of a value in `[0,1]`; smaller and larger ones take the end colours. NaN is bright green, which the scale lacks.
pub fn false_colour(t: f32) -> [u8; 3] {
    if t.is_nan() {
        return [0, 255, 0];
    }
    let x = t.clamp(0.0, 1.0) * (MAGMA.len() - 1) as f32;
    let i = (x as usize).min(MAGMA.len() - 2);
    let f = x - i as f32;
    std::array::from_fn(|c| (f32::from(MAGMA[i][c]) * (1.0 - f) + f32::from(MAGMA[i + 1][c]) * f + 0.5) as u8)
}

/// The same as linear light.
pub fn false_colour_rgb(t: f32) -> [f32; 3] {
    false_colour(t).map(|code| Encoding::Srgb.to_linear(f32::from(code) / 255.0))
}

/// A picture of a plane of numbers, of which `low` is drawn darkest and `high` palest.
///
/// # Errors
/// `Error::Shape` if there are not `width * height` values.
pub fn false_colour_image(width: usize, height: usize, values: &[f32], low: f32, high: f32) -> Result<Image, Error> {
    let span = if high > low { high - low } else { 1.0 };
    let pixels: Vec<_> = values.iter().map(|v| false_colour_rgb((v - low) / span)).collect();
    Image::from_rgb(width, height, &pixels)
        .ok_or_else(|| Error::shape(format!("{} values do not make {width} x {height} pixels", values.len())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_rises_and_nan_stands_out() {
        let light = |t: f32| crate::tonemap::luminance(false_colour_rgb(t));
        for i in 0..100 {
            assert!(light((i + 1) as f32 / 100.0) > light(i as f32 / 100.0) - 1e-4, "{i}");
        }
        assert_eq!(false_colour(0.0), [0, 0, 4]);
        assert_eq!(false_colour(7.0), [252, 253, 191]);
        assert_eq!(false_colour(f32::NAN), [0, 255, 0]);
    }
}
