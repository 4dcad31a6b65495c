//! Tensor files: named arrays of numbers, the container of the RGL material database (Dupuy and Jakob 2018), and measured
//! materials in them.

use std::collections::BTreeMap;
use steradian_bsdf::{MeasuredMaterial, MeasuredTables};

/// Why a measured material cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum TensorError {
    #[error("not a tensor file")]
    NotATensor,
    #[error("tensor file of version {0}.{1}, but only 1.0 is known")]
    Version(u8, u8),
    #[error("truncated tensor file: it ends in the description of field {0}")]
    Truncated(usize),
    #[error("damaged tensor file: field `{0}` reaches past the end of the file")]
    PastEnd(String),
    #[error("damaged tensor file: field `{0}` has the unknown type {1}")]
    Type(String, u8),
    #[error("not a measured material: there is no field `{0}`")]
    Missing(&'static str),
    #[error("not a measured material: field `{0}` must hold {1}")]
    Shape(&'static str, &'static str),
    #[error("measured material whose azimuths cover {0} of a turn; only whole turns are known")]
    Reduction(f32),
    #[error("damaged measured material: {0}")]
    Material(&'static str),
}

/// One array, still as bytes.
#[derive(Clone, Debug)]
struct Field<'a> {
    kind: u8,
    shape: Vec<usize>,
    bytes: &'a [u8],
}

/// The code of 32-bit floats.
const FLOAT32: u8 = 10;

/// Bytes per number for each type code: integers of 1, 2, 4, 8 bytes by turns unsigned and signed, then floats.
fn width(kind: u8) -> Option<usize> {
    [1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8].get(usize::from(kind).checked_sub(1)?).copied()
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let out = self.bytes.get(self.at..self.at.checked_add(n)?)?;
        self.at += n;
        Some(out)
    }

    fn number<const N: usize>(&mut self) -> Option<u64> {
        let mut le = [0; 8];
        le[..N].copy_from_slice(self.take(N)?);
        Some(u64::from_le_bytes(le))
    }
}

/// The fields by name; nothing is copied.
fn fields(bytes: &[u8]) -> Result<BTreeMap<String, Field<'_>>, TensorError> {
    let mut r = Reader { bytes, at: 0 };
    if r.take(12) != Some(b"tensor_file\0") {
        return Err(TensorError::NotATensor);
    }
    let version = r.take(2).ok_or(TensorError::NotATensor)?;
    if version != [1, 0] {
        return Err(TensorError::Version(version[0], version[1]));
    }
    let count = r.number::<4>().ok_or(TensorError::NotATensor)?;
    let mut out = BTreeMap::new();
    for i in 0..count as usize {
        let (name, field) = field(&mut r).unwrap_or(Err(TensorError::Truncated(i)))?;
        out.insert(name, field);
    }
    Ok(out)
}

/// The next field; `None` if the file ends in its description.
fn field<'a>(r: &mut Reader<'a>) -> Option<Result<(String, Field<'a>), TensorError>> {
    let length = r.number::<2>()? as usize;
    let name = String::from_utf8_lossy(r.take(length)?).into_owned();
    let rank = r.number::<2>()? as usize;
    let kind = r.number::<1>()? as u8;
    let offset = r.number::<8>()?;
    let mut shape = Vec::new();
    for _ in 0..rank {
        shape.push(r.number::<8>()?);
    }
    let Some(width) = width(kind) else { return Some(Err(TensorError::Type(name, kind))) };
    let size = shape.iter().try_fold(width as u64, |n, &d| n.checked_mul(d));
    let range = size.and_then(|size| Some(offset as usize..usize::try_from(offset.checked_add(size)?).ok()?));
    Some(match range.and_then(|range| r.bytes.get(range)) {
        Some(bytes) => Ok((name, Field { kind, shape: shape.iter().map(|&d| d as usize).collect(), bytes })),
        None => Err(TensorError::PastEnd(name)),
    })
}

/// An array of 32-bit floats of that rank, with its shape.
fn floats(
    fields: &BTreeMap<String, Field<'_>>,
    name: &'static str,
    rank: usize,
    what: &'static str,
) -> Result<(Vec<f32>, Vec<usize>), TensorError> {
    let field = fields.get(name).ok_or(TensorError::Missing(name))?;
    if field.kind != FLOAT32 || field.shape.len() != rank {
        return Err(TensorError::Shape(name, what));
    }
    Ok((field.bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(), field.shape.clone()))
}

/// Reads a measured material that is already in memory. Memory stays within a small multiple of the length of the file.
pub(crate) fn measured_material(bytes: &[u8]) -> Result<MeasuredMaterial, TensorError> {
    let fields = fields(bytes)?;
    let list = |name| floats(&fields, name, 1, "a list of floats").map(|f| f.0);
    let (phi, theta, wavelengths) = (list("phi_i")?, list("theta_i")?, list("wavelengths")?);
    let grid = |name| floats(&fields, name, 2, "a table of floats").map(|(v, s)| (v, [s[1], s[0]]));
    let (ndf, sigma) = (grid("ndf")?, grid("sigma")?);
    let stack = |name, rank: usize, third: Option<usize>| {
        let what = "a table of floats for each direction";
        let (values, shape) = floats(&fields, name, rank, what)?;
        let fits = shape[0] == phi.len() && shape[1] == theta.len() && third.is_none_or(|n| shape[2] == n);
        if fits { Ok((values, [shape[rank - 1], shape[rank - 2]])) } else { Err(TensorError::Shape(name, what)) }
    };
    let (vndf, luminance) = (stack("vndf", 4, None)?, stack("luminance", 4, None)?);
    let spectra = stack("spectra", 5, Some(wavelengths.len()))?;
    // An isotropic material is measured from one azimuth.
    if let (&[first, .., last], true) = (phi.as_slice(), phi.len() > 2) {
        let turn = (last - first) / std::f32::consts::TAU;
        if !((0.67..1.5).contains(&turn)) {
            return Err(TensorError::Reduction(turn));
        }
    }
    let tables = MeasuredTables { phi, theta, wavelengths, ndf, sigma, vndf, luminance, spectra };
    MeasuredMaterial::new(tables).map_err(TensorError::Material)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small file with the fields of a measured material.
    fn file() -> Vec<u8> {
        let fields: [(&str, &[usize]); 8] = [
            ("phi_i", &[1]),
            ("theta_i", &[2]),
            ("wavelengths", &[3]),
            ("ndf", &[2, 2]),
            ("sigma", &[2, 3]),
            ("vndf", &[1, 2, 2, 2]),
            ("luminance", &[1, 2, 2, 2]),
            ("spectra", &[1, 2, 3, 2, 2]),
        ];
        let header: usize = 18 + fields.iter().map(|(n, s)| 2 + n.len() + 2 + 1 + 8 + 8 * s.len()).sum::<usize>();
        let mut head = b"tensor_file\0\x01\x00".to_vec();
        head.extend((fields.len() as u32).to_le_bytes());
        let mut data = Vec::new();
        for (name, shape) in fields {
            head.extend((name.len() as u16).to_le_bytes());
            head.extend(name.as_bytes());
            head.extend((shape.len() as u16).to_le_bytes());
            head.push(FLOAT32);
            head.extend(((header + data.len()) as u64).to_le_bytes());
            shape.iter().for_each(|&d| head.extend((d as u64).to_le_bytes()));
            for i in 0..shape.iter().product::<usize>() {
                let v = if name == "wavelengths" { 400.0 + 100.0 * i as f32 } else { 0.5 + i as f32 };
                data.extend(v.to_le_bytes());
            }
        }
        head.extend(data);
        head
    }

    #[test]
    fn a_sound_file_is_read_and_a_cut_one_is_an_error() {
        let good = file();
        assert!(measured_material(&good).is_ok());
        for cut in 0..good.len() {
            assert!(measured_material(&good[..cut]).is_err(), "cut at {cut}");
        }
        assert_eq!(measured_material(b"ply").unwrap_err(), TensorError::NotATensor);
    }

    #[test]
    fn bad_bytes_never_panic() {
        let good = file();
        for i in 0..good.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut bad = good.clone();
                bad[i] = value;
                // Whatever comes out, it comes out.
                let _ = measured_material(&bad).is_ok();
            }
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        let mut bad = file();
        let at = bad.windows(4).position(|w| w == b"vndf").unwrap();
        bad[at] = b'w';
        assert_eq!(measured_material(&bad).unwrap_err(), TensorError::Missing("vndf"));
    }
}
