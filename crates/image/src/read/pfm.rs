//! Portable float maps (Debevec): `PF` or `Pf`, size, a scale whose sign is the byte order, then rows from the bottom up.

use crate::{Error, Image, Precision, read::Limits};

/// Reads three channels `R G B` or one channel `Y`.
pub(super) fn read(bytes: &[u8], name: &str, limits: Limits) -> Result<Image, Error> {
    let bad = |what: &str| Error::malformed(name, "PFM", what);
    let mut at = 0;
    let channels = match token(bytes, &mut at) {
        Some("PF") => 3,
        Some("Pf") => 1,
        _ => return Err(bad("it does not start with PF or Pf")),
    };
    let mut size = |what| token(bytes, &mut at).and_then(|t| t.parse::<u32>().ok()).ok_or_else(|| bad(what));
    let (width, height) = (size("no width")? as usize, size("no height")? as usize);
    let scale: f32 = token(bytes, &mut at).and_then(|t| t.parse().ok()).ok_or_else(|| bad("no scale"))?;
    if scale == 0.0 || !scale.is_finite() || width == 0 || height == 0 {
        return Err(bad("its size or scale is zero or not finite"));
    }
    limits.check(name, bytes.len(), width as u64, height as u64, 4 * channels as u64)?;
    let need = width * height * channels * 4;
    // One whitespace character ends the header, and everything after it is data.
    let data = bytes.get(at + 1..).filter(|d| d.len() >= need).ok_or_else(|| bad("it ends before its last row"))?;

    let little = scale < 0.0;
    let sample = |i: usize| {
        let b = [data[4 * i], data[4 * i + 1], data[4 * i + 2], data[4 * i + 3]];
        scale.abs() * if little { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }
    };
    let mut image = Image::new(width, height);
    let names: &[&str] = if channels == 3 { &["R", "G", "B"] } else { &["Y"] };
    for (c, channel) in names.iter().enumerate() {
        let rows = (0..height).rev();
        let samples = rows.flat_map(|y| (0..width).map(move |x| (y * width + x) * channels + c)).map(sample).collect();
        image.add(channel, samples, Precision::Float)?;
    }
    Ok(image)
}

/// The next word, leaving `at` on the character after it.
fn token<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a str> {
    while bytes.get(*at)?.is_ascii_whitespace() {
        *at += 1;
    }
    let start = *at;
    while bytes.get(*at).is_some_and(|b| !b.is_ascii_whitespace()) {
        *at += 1;
    }
    std::str::from_utf8(&bytes[start..*at]).ok()
}
