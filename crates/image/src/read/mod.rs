//! Bytes of an image file -> `Image` (all channels, `f32`) or `Texels` (a texture, in the file's own precision).
//!
//! Files are hostile: the size that a header claims is held against the limits before anything is allocated.

mod exr;
mod hdr;
mod pfm;
mod raster;

use crate::{Encoding, Error, Format, Image, Texels};

/// How much memory a file may ask for.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most bytes of decoded samples, whatever the file.
    pub max_bytes: u64,
    /// Most bytes of decoded samples per byte of file. No real picture is near the default of 4096 (deflate's best is 1030 to 1).
    pub max_expansion: u64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { max_bytes: 16 << 30, max_expansion: 4096 }
    }
}

impl Limits {
    /// Small files may be of one colour and large: up to this much is never held against them.
    const FREE_BYTES: u64 = 64 << 20;

    /// Refuses `width x height` pixels of `bytes_per_pixel` if that is more than the limits allow to a file of `file_len` bytes.
    pub(crate) fn check(
        &self,
        name: &str,
        file_len: usize,
        width: u64,
        height: u64,
        bytes_per_pixel: u64,
    ) -> Result<(), Error> {
        let bytes = width.saturating_mul(height).saturating_mul(bytes_per_pixel);
        let by_file = (file_len as u64).saturating_mul(self.max_expansion).max(Limits::FREE_BYTES);
        let limit = self.max_bytes.min(by_file);
        if bytes > limit {
            return Err(Error::TooLarge { name: name.to_owned(), width, height, bytes, limit });
        }
        Ok(())
    }
}

/// Reads an image of any known format; `name` is for the messages and, where the bytes do not tell, for the format.
/// 8-bit and 16-bit formats are taken to be sRGB.
///
/// # Errors
/// Any `Error` but `Io`.
pub fn read(bytes: &[u8], name: &str) -> Result<Image, Error> {
    read_limited(bytes, name, Limits::default())
}

/// `read` with limits of the caller's.
///
/// # Errors
/// Any `Error` but `Io`.
pub fn read_limited(bytes: &[u8], name: &str, limits: Limits) -> Result<Image, Error> {
    match detect(bytes, name)? {
        Format::Exr => guarded(name, "EXR", || exr::read(bytes, name, limits)),
        Format::Hdr => hdr::read(bytes, name, limits),
        Format::Pfm => pfm::read(bytes, name, limits),
        other => Ok(guarded(name, other.label(), || raster::read(bytes, name, other, None, limits))?.to_image()),
    }
}

/// Reads a texture. `encoding` overrides what the samples of an 8-bit or 16-bit file mean, which otherwise is sRGB; formats that
/// hold floats are linear and do not heed it.
///
/// # Errors
/// Any `Error` but `Io`.
pub fn read_texels(bytes: &[u8], name: &str, encoding: Option<Encoding>) -> Result<Texels, Error> {
    read_texels_limited(bytes, name, encoding, Limits::default())
}

/// `read_texels` with limits of the caller's.
///
/// # Errors
/// Any `Error` but `Io`.
pub fn read_texels_limited(
    bytes: &[u8],
    name: &str,
    encoding: Option<Encoding>,
    limits: Limits,
) -> Result<Texels, Error> {
    match detect(bytes, name)? {
        Format::Exr | Format::Hdr | Format::Pfm => {
            Texels::from_image(&read_limited(bytes, name, limits)?).map_err(|e| Error::unsupported(name, e))
        }
        other => guarded(name, other.label(), || raster::read(bytes, name, other, encoding, limits)),
    }
}

fn detect(bytes: &[u8], name: &str) -> Result<Format, Error> {
    Format::detect(bytes, name).ok_or_else(|| Error::UnknownFormat { name: name.to_owned() })
}

/// Runs a library's decoder so that a panic inside it, which would be its bug, is the file's error and not our crash.
fn guarded<T>(name: &str, format: &'static str, decode: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(Error::malformed(name, format, "the decoder gave up on it")))
}
