//! Portable float maps: little endian, rows from the bottom up.

use crate::{Error, Image};

pub(super) fn encode(image: &Image, name: &str) -> Result<Vec<u8>, Error> {
    let planes = super::colour_planes(image, name)?;
    // One grey plane stands for all three.
    let channels = if image.planes("").is_some() { 3 } else { 1 };
    let (w, h) = (image.width(), image.height());
    let mut out = format!("{}\n{w} {h}\n-1.0\n", if channels == 3 { "PF" } else { "Pf" }).into_bytes();
    out.reserve(w * h * channels * 4);
    for y in (0..h).rev() {
        for i in y * w..(y + 1) * w {
            for plane in &planes[..channels] {
                out.extend_from_slice(&plane[i].to_le_bytes());
            }
        }
    }
    Ok(out)
}
