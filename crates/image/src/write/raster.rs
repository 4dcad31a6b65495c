//! PNG and JPEG through the `image` crate.

use image::{ExtendedColorType, ImageEncoder, codecs::jpeg::JpegEncoder, codecs::png::PngEncoder};

use crate::{Error, Image, WriteOptions};

/// The picture as interleaved display-referred linear values.
struct Flat {
    channels: usize,
    /// Index of alpha within a pixel, past the end if there is none.
    alpha: usize,
    values: Vec<f32>,
}

fn flatten(image: &Image, name: &str, options: &WriteOptions, with_alpha: bool) -> Result<Flat, Error> {
    let planes = super::colour_planes(image, name)?;
    let grey = image.planes("").is_none();
    let alpha = image.channel("A").filter(|_| with_alpha);
    let tone = options.tone_map.as_ref().map(|t| t.prepared(planes));
    let colours = if grey { 1 } else { 3 };
    let channels = colours + usize::from(alpha.is_some());
    let mut values = Vec::with_capacity(planes[0].len() * channels);
    for i in 0..planes[0].len() {
        let rgb = planes.map(|p| p[i]);
        let rgb = tone.as_ref().map_or(rgb, |t| t.apply(rgb));
        values.extend_from_slice(&rgb[..colours]);
        values.extend(alpha.map(|a| a[i]));
    }
    Ok(Flat { channels, alpha: if alpha.is_some() { colours } else { usize::MAX }, values })
}

pub(super) fn encode_png(image: &Image, name: &str, options: &WriteOptions) -> Result<Vec<u8>, Error> {
    let flat = flatten(image, name, options, true)?;
    let encoding = |i: usize| if i % flat.channels == flat.alpha { crate::Encoding::Linear } else { options.encoding };
    let values = flat.values.iter().enumerate();
    let (bytes, color) = if options.sixteen_bits {
        // The library takes 16-bit samples in the machine's byte order.
        let bytes: Vec<u8> = values.flat_map(|(i, &v)| encoding(i).quantize16(v).to_ne_bytes()).collect();
        let kinds =
            [ExtendedColorType::L16, ExtendedColorType::La16, ExtendedColorType::Rgb16, ExtendedColorType::Rgba16];
        (bytes, kinds[flat.channels - 1])
    } else {
        let bytes = values.map(|(i, &v)| encoding(i).quantize8(v)).collect();
        let kinds = [ExtendedColorType::L8, ExtendedColorType::La8, ExtendedColorType::Rgb8, ExtendedColorType::Rgba8];
        (bytes, kinds[flat.channels - 1])
    };
    let mut out = Vec::new();
    let (w, h) = size(image, name, u32::MAX)?;
    PngEncoder::new(&mut out).write_image(&bytes, w, h, color).map_err(|e| Error::malformed(name, "PNG", e))?;
    Ok(out)
}

pub(super) fn encode_jpeg(image: &Image, name: &str, options: &WriteOptions) -> Result<Vec<u8>, Error> {
    let flat = flatten(image, name, options, false)?;
    let bytes: Vec<u8> = flat.values.iter().map(|&v| options.encoding.quantize8(v)).collect();
    let color = if flat.channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let mut out = Vec::new();
    let (w, h) = size(image, name, u32::from(u16::MAX))?;
    let encoder = JpegEncoder::new_with_quality(&mut out, options.jpeg_quality.clamp(1, 100));
    encoder.write_image(&bytes, w, h, color).map_err(|e| Error::malformed(name, "JPEG", e))?;
    Ok(out)
}

fn size(image: &Image, name: &str, largest: u32) -> Result<(u32, u32), Error> {
    let fit = |n: usize| u32::try_from(n).ok().filter(|n| *n <= largest);
    fit(image.width()).zip(fit(image.height())).ok_or_else(|| {
        let (w, h) = (image.width(), image.height());
        Error::unsupported(
            name,
            format!("{w} x {h} pixels are more than the {largest} per side that this format can hold"),
        )
    })
}
