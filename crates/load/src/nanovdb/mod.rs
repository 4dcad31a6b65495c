//! NanoVDB files (Museth 2021, "NanoVDB: A GPU-friendly and portable VDB data structure"), layout of version 32: sparse
//! grids of single-precision numbers, plain or zipped.
//!
//! A file is a row of segments. Each has a header, then the description of each grid with its name, then the grids.

mod tree;

use steradian_scene::{MediumError, SparseGrid};

/// Why a NanoVDB file cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NanoVdbError {
    /// The first eight bytes are others.
    #[error("not a NanoVDB file")]
    NotNanoVdb,
    /// A layout that is not known.
    #[error("NanoVDB files of version {0} are not supported, only those of version 32")]
    Version(u32),
    /// The file ends too early.
    #[error("truncated NanoVDB file: {what} needs {need} bytes at offset {offset}, but the file has {len}")]
    Truncated {
        /// What was to be read.
        what: &'static str,
        /// Where.
        offset: u64,
        /// How much.
        need: u64,
        /// Size of the file, or of the unpacked grid.
        len: u64,
    },
    /// Values that are not single-precision numbers.
    #[error("grid {name:?} holds values of type {kind}, not single-precision numbers")]
    ValueType {
        /// Name of the grid.
        name: String,
        /// The type's number in the format.
        kind: u32,
    },
    /// A grid that is not a density.
    #[error("grid {name:?} is of class {class}, not a fog volume")]
    Class {
        /// Name of the grid.
        name: String,
        /// The class's number in the format.
        class: u32,
    },
    /// A way of compression that is not known.
    #[error("grid {name:?} is compressed by codec {codec}; only none and zip are supported")]
    Codec {
        /// Name of the grid.
        name: String,
        /// The codec's number in the format.
        codec: u16,
    },
    /// The compressed data are damaged.
    #[error("grid {0:?} cannot be unpacked")]
    Unzip(String),
    /// The tree contradicts itself.
    #[error("damaged NanoVDB grid: {0}")]
    Tree(&'static str),
    /// The grid cannot be held in memory.
    #[error("{0}")]
    Grid(#[from] MediumError),
}

/// Little-endian numbers at byte offsets.
#[derive(Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn slice(self, what: &'static str, offset: u64, need: u64) -> Result<&'a [u8], NanoVdbError> {
        let len = self.0.len() as u64;
        match offset.checked_add(need) {
            Some(end) if end <= len => Ok(&self.0[offset as usize..end as usize]),
            _ => Err(NanoVdbError::Truncated { what, offset, need, len }),
        }
    }

    fn array<const N: usize>(self, what: &'static str, offset: u64) -> Result<[u8; N], NanoVdbError> {
        let mut out = [0; N];
        out.copy_from_slice(self.slice(what, offset, N as u64)?);
        Ok(out)
    }

    fn u16(self, what: &'static str, offset: u64) -> Result<u16, NanoVdbError> {
        Ok(u16::from_le_bytes(self.array(what, offset)?))
    }

    fn u32(self, what: &'static str, offset: u64) -> Result<u32, NanoVdbError> {
        Ok(u32::from_le_bytes(self.array(what, offset)?))
    }

    fn i32(self, what: &'static str, offset: u64) -> Result<i32, NanoVdbError> {
        Ok(i32::from_le_bytes(self.array(what, offset)?))
    }

    fn u64(self, what: &'static str, offset: u64) -> Result<u64, NanoVdbError> {
        Ok(u64::from_le_bytes(self.array(what, offset)?))
    }

    fn f32(self, what: &'static str, offset: u64) -> Result<f32, NanoVdbError> {
        Ok(f32::from_le_bytes(self.array(what, offset)?))
    }

    fn f64(self, what: &'static str, offset: u64) -> Result<f64, NanoVdbError> {
        Ok(f64::from_le_bytes(self.array(what, offset)?))
    }
}

/// Sizes of the header of a segment and of the description of a grid.
const HEADER: u64 = 16;
const DESCRIPTION: u64 = 176;
const FLOAT: u32 = 1;
const UNKNOWN_CLASS: u32 = 0;
const FOG: u32 = 2;

/// The first grid of a name in a file; `None` if there is none.
///
/// # Errors
/// If the file is damaged, or the grid is not one of single-precision densities.
pub fn read_grid(bytes: &[u8], name: &str) -> Result<Option<SparseGrid>, NanoVdbError> {
    let file = Bytes(bytes);
    if !(bytes.starts_with(b"NanoVDB0") || bytes.starts_with(b"NanoVDB2")) {
        return Err(NanoVdbError::NotNanoVdb);
    }
    let mut at = 0;
    while at < bytes.len() as u64 {
        let what = "the header of a segment";
        let magic: [u8; 8] = file.array(what, at)?;
        if !magic.starts_with(b"NanoVDB") {
            return Err(NanoVdbError::NotNanoVdb);
        }
        let version = file.u32(what, at + 8)? >> 21;
        if version != 32 {
            return Err(NanoVdbError::Version(version));
        }
        let grids = file.u16(what, at + 12)?;
        let segment_codec = file.u16(what, at + 14)?;
        at += HEADER;
        let mut found = None;
        // The grids come after all descriptions.
        let mut data = 0u64;
        for _ in 0..grids {
            let what = "the description of a grid";
            let (size, stored) = (file.u64(what, at)?, file.u64(what, at + 8)?);
            let (kind, class) = (file.u32(what, at + 32)?, file.u32(what, at + 36)?);
            let name_size = u64::from(file.u32(what, at + 136)?);
            let codec = file.u16(what, at + 168)?.max(segment_codec);
            let its_name = file.slice("the name of a grid", at + DESCRIPTION, name_size)?;
            let its_name = its_name.split(|&b| b == 0).next().unwrap_or_default();
            if found.is_none() && its_name == name.as_bytes() {
                found = Some((data, size, stored, kind, class, codec));
            }
            data = data.saturating_add(stored);
            at += DESCRIPTION + name_size;
        }
        if let Some((offset, size, stored, kind, class, codec)) = found {
            if kind != FLOAT {
                return Err(NanoVdbError::ValueType { name: name.into(), kind });
            }
            if class != FOG && class != UNKNOWN_CLASS {
                return Err(NanoVdbError::Class { name: name.into(), class });
            }
            let stored = file.slice("a grid", at.saturating_add(offset), stored)?;
            return match codec {
                0 => tree::flatten(Bytes(stored)).map(Some),
                1 => tree::flatten(Bytes(&unzip(stored, size, name)?)).map(Some),
                _ => Err(NanoVdbError::Codec { name: name.into(), codec }),
            };
        }
        at = at.saturating_add(data);
    }
    Ok(None)
}

/// Unpacks a zipped grid: its length, then a zlib stream.
fn unzip(stored: &[u8], size: u64, name: &str) -> Result<Vec<u8>, NanoVdbError> {
    use std::io::Read;
    let packed = Bytes(stored);
    let length = packed.u64("the length of a zipped grid", 0)?;
    let stream = packed.slice("a zipped grid", 8, length)?;
    let mut out = Vec::new();
    let read = flate2::read::ZlibDecoder::new(stream).take(size).read_to_end(&mut out);
    match read {
        Ok(n) if n as u64 == size => Ok(out),
        _ => Err(NanoVdbError::Unzip(name.into())),
    }
}

#[cfg(test)]
mod tests;
