//! `Image` -> the bytes of a file, or a file that is either whole or not there.

mod atomic;
mod exr;
mod hdr;
mod pfm;
mod raster;

use std::path::Path;

pub use atomic::{remove_leftovers, write_bytes_atomically};

use crate::{Encoding, Error, Format, Image, ToneMap};

/// Lossless compression of EXR files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Compression {
    /// None.
    Uncompressed,
    /// Deflate over 16 rows.
    #[default]
    Zip,
}

/// How to write.
#[derive(Clone, Debug)]
pub struct WriteOptions {
    /// EXR compression.
    pub compression: Compression,
    /// For PNG: 16 bits per sample in place of 8.
    pub sixteen_bits: bool,
    /// For JPEG: quality from 1 to 100.
    pub jpeg_quality: u8,
    /// For PNG and JPEG: how light becomes codes.
    pub encoding: Encoding,
    /// For PNG and JPEG: the tone map applied before encoding. `None`: values are clipped to `[0,1]`.
    pub tone_map: Option<ToneMap>,
}

impl Default for WriteOptions {
    fn default() -> WriteOptions {
        WriteOptions {
            compression: Compression::Zip,
            sixteen_bits: false,
            jpeg_quality: 92,
            encoding: Encoding::Srgb,
            tone_map: None,
        }
    }
}

/// The bytes of a file of this format. EXR keeps every channel and all metadata; the others keep the colour (`R G B` or `Y`), PNG
/// also alpha. Equal images make equal bytes. `name` is for the messages.
///
/// # Errors
/// `Error::Unsupported` for a format that is read only; `Error::Shape` if there is no colour; `Error::Malformed` if an encoder refuses.
pub fn encode(image: &Image, format: Format, name: &str, options: &WriteOptions) -> Result<Vec<u8>, Error> {
    if image.width() == 0 || image.height() == 0 || image.channels().is_empty() {
        return Err(Error::shape(format!("{name}: an image without pixels or channels cannot be written")));
    }
    match format {
        Format::Exr => exr::encode(image, name, options.compression),
        Format::Hdr => hdr::encode(image, name),
        Format::Pfm => pfm::encode(image, name),
        Format::Png => raster::encode_png(image, name, options),
        Format::Jpeg => raster::encode_jpeg(image, name, options),
        Format::Tga | Format::Bmp | Format::Qoi | Format::WebP => {
            Err(Error::unsupported(name, format!("{} files are read but not written", format.label())))
        }
    }
}

/// Writes a file in the format that its extension names. Nothing half-written is ever seen under the final name.
///
/// # Errors
/// As `encode`, `Error::UnknownFormat` for the extension, and `Error::Io`.
pub fn write_file(image: &Image, path: &Path, options: &WriteOptions) -> Result<(), Error> {
    let name = path.display().to_string();
    let format = Format::from_name(&name).ok_or_else(|| Error::UnknownFormat { name: name.clone() })?;
    write_bytes_atomically(path, &encode(image, format, &name, options)?)
}

/// The colour planes, or the error that says which channels there are.
fn colour_planes<'a>(image: &'a Image, name: &str) -> Result<[&'a [f32]; 3], Error> {
    image.colour_planes().ok_or_else(|| {
        let names: Vec<_> = image.channels().iter().map(|c| c.name.as_str()).collect();
        Error::shape(format!("{name}: no channels R, G, B or Y among {}", names.join(", ")))
    })
}
