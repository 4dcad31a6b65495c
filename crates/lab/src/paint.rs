//! Pictures from numbers.

use crate::experiment::Picture;
use steradian_image::{Image, false_colour_rgb};

/// A grey picture of `width` columns from linear values.
pub fn grey(id: &str, caption: impl Into<String>, width: usize, values: &[f64]) -> Picture {
    let pixels: Vec<[f32; 3]> = values.iter().map(|&v| [v as f32; 3]).collect();
    colour(id, caption, width, &pixels)
}

/// A picture of `width` columns from linear colours.
pub fn colour(id: &str, caption: impl Into<String>, width: usize, pixels: &[[f32; 3]]) -> Picture {
    let height = pixels.len() / width;
    let image = Image::from_rgb(width, height, pixels).unwrap_or_else(|| Image::new(0, 0));
    Picture { id: id.into(), caption: caption.into(), image }
}

/// A picture in false colours: `low` is the dark end, `high` the bright one.
pub fn heat(id: &str, caption: impl Into<String>, width: usize, values: &[f64], [low, high]: [f64; 2]) -> Picture {
    let pixels: Vec<[f32; 3]> =
        values.iter().map(|v| false_colour_rgb(((v - low) / (high - low)).clamp(0.0, 1.0) as f32)).collect();
    colour(id, caption, width, &pixels)
}

/// The decimal logarithm, kept finite.
pub fn log10(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| v.max(1e-12).log10()).collect()
}

/// Rec. 709 luminance.
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}
