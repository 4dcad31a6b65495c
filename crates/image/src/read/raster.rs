//! PNG, JPEG, TGA, BMP, QOI and WebP through the `image` crate, kept at 8 bits where the file has 8 bits.

use std::io::Cursor;

use image::{ColorType, ImageDecoder, ImageFormat, ImageReader};

use crate::{Encoding, Error, Format, Storage, Texels, read::Limits};

/// Reads texels; 16-bit samples become linear floats.
pub(super) fn read(
    bytes: &[u8],
    name: &str,
    format: Format,
    encoding: Option<Encoding>,
    limits: Limits,
) -> Result<Texels, Error> {
    let bad = |e: image::ImageError| match e {
        image::ImageError::Unsupported(_) => Error::unsupported(name, e),
        _ => Error::malformed(name, format.label(), e),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), library_format(name, format)?);
    let mut library_limits = image::Limits::default();
    library_limits.max_alloc = Some(limits.max_bytes);
    reader.limits(library_limits);
    let decoder = reader.into_decoder().map_err(bad)?;

    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    limits.check(name, bytes.len(), width.into(), height.into(), color.bytes_per_pixel().into())?;
    // The check above bounds this product.
    let mut raw = vec![0_u8; decoder.total_bytes() as usize];
    decoder.read_image(&mut raw).map_err(bad)?;

    let encoding = encoding.unwrap_or(Encoding::Srgb);
    let channels = usize::from(color.channel_count());
    let storage = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Storage::U8(raw),
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let codes = raw.chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]]));
            // Alpha is coverage and never encoded.
            let alpha = if channels % 2 == 0 { channels - 1 } else { usize::MAX };
            let decode = |(i, code): (usize, u16)| {
                let v = f32::from(code) / 65535.0;
                if i % channels == alpha { v } else { encoding.to_linear(v) }
            };
            Storage::F32(codes.enumerate().map(decode).collect())
        }
        other => return Err(Error::unsupported(name, format!("samples of kind {other:?}"))),
    };
    let shaped = Texels::new(width as usize, height as usize, channels, storage, encoding);
    shaped.map_err(|e| Error::malformed(name, format.label(), e))
}

fn library_format(name: &str, format: Format) -> Result<ImageFormat, Error> {
    Ok(match format {
        Format::Png => ImageFormat::Png,
        Format::Jpeg => ImageFormat::Jpeg,
        Format::Tga => ImageFormat::Tga,
        Format::Bmp => ImageFormat::Bmp,
        Format::Qoi => ImageFormat::Qoi,
        Format::WebP => ImageFormat::WebP,
        Format::Exr | Format::Hdr | Format::Pfm => {
            return Err(Error::unsupported(name, "a format of floats where one of integers was expected"));
        }
    })
}
