//! What the camera sees besides light, in the parts of a distributed render.
//!
//! [`features`](crate::features()) of a pixel are looked at in one go, and so each part takes some rows of the picture, however the samples
//! of light are shared. Put together they are the features of a render on one machine.

use crate::error::Error;
use crate::features::{Features, features_of_rows};
use crate::share::Part;
use crate::snapshot::{HASH, Reader};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use steradian_scene::World;

const MAGIC: [u8; 8] = *b"STERSEEN";
/// Numbers of a pixel whose count is known.
const FIXED: usize = 20;
/// Bytes of an object's or material's entry.
const OBJECT: usize = 3 * 4;
const MATERIAL: usize = 2 * 4;

/// The features of some rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Anything that whoever looked wants to find again; the same in all parts.
    pub note: Vec<u8>,
    /// By the number of the row in the full image, the film's pixels from left to right.
    pub rows: BTreeMap<u32, Vec<Features>>,
}

impl Seen {
    /// Looks at the rows of a part, each pixel with `spp` samples as [`features`](crate::features()) does; `None` if cancelled.
    pub fn look(
        world: &World,
        part: Part,
        note: Vec<u8>,
        spp: u32,
        threads: usize,
        cancel: &AtomicBool,
    ) -> Option<Self> {
        let [_, _, y0, y1] = world.settings().film.pixel_bounds;
        let wanted: Vec<u32> = (y0..y1).filter(|y| (y - y0) % part.count.max(1) == part.index).collect();
        let rows = features_of_rows(world, spp, &wanted, threads, cancel)?;
        Some(Self { note, rows: wanted.into_iter().zip(rows).collect() })
    }

    /// The features of all rows of a film from `parts`, one after the other.
    ///
    /// # Errors
    /// [`Error::Merge`] where a row is missing or of another width.
    pub fn join(parts: &[&Seen], bounds: [u32; 4]) -> Result<Vec<Features>, Error> {
        let [x0, x1, y0, y1] = bounds;
        let width = (x1 - x0) as usize;
        let mut out = Vec::with_capacity(width * (y1 - y0) as usize);
        for y in y0..y1 {
            let row = parts.iter().find_map(|p| p.rows.get(&y)).filter(|row| row.len() == width);
            out.extend_from_slice(row.ok_or_else(|| Error::Merge(format!("nobody has looked at row {y}")))?);
        }
        Ok(out)
    }

    /// The bytes of one that travels by itself.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        self.write(&mut out);
        let hash = blake3::hash(&out);
        out.extend_from_slice(hash.as_bytes());
        out
    }

    /// Reads what `encode` wrote, for a film of these bounds.
    ///
    /// # Errors
    /// [`Error::Damaged`].
    pub fn decode(bytes: &[u8], bounds: [u32; 4]) -> Result<Self, Error> {
        let (body, hash) = bytes.split_at(bytes.len().saturating_sub(HASH));
        if body.get(..8) != Some(&MAGIC) || blake3::hash(body).as_bytes() != hash {
            return Err(Error::Damaged("it is not what was seen".into()));
        }
        let mut r = Reader(&body[8..]);
        let seen = Self::read(&mut r, bounds)?;
        if r.0.is_empty() { Ok(seen) } else { Err(Error::Damaged("it goes on after its end".into())) }
    }

    /// Note and rows, little endian: of each row its number; of each pixel its numbers, its objects and its materials.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let word = |out: &mut Vec<u8>, v: u32| out.extend_from_slice(&v.to_le_bytes());
        word(out, self.note.len() as u32);
        out.extend_from_slice(&self.note);
        word(out, self.rows.len() as u32);
        for (&y, row) in &self.rows {
            word(out, y);
            for f in row {
                fixed(f).iter().for_each(|v| word(out, v.to_bits()));
                word(out, f.objects.len() as u32);
                for ((instance, primitive), share) in &f.objects {
                    [*instance, *primitive, share.to_bits()].iter().for_each(|&v| word(out, v));
                }
                word(out, f.materials.len() as u32);
                for (material, share) in &f.materials {
                    [*material, share.to_bits()].iter().for_each(|&v| word(out, v));
                }
            }
        }
    }

    /// Reads what `write` wrote. Takes no more memory than the bytes justify.
    pub(crate) fn read(r: &mut Reader, bounds: [u32; 4]) -> Result<Self, Error> {
        let [x0, x1, y0, y1] = bounds;
        let note = r.bytes()?.to_vec();
        let mut rows = BTreeMap::new();
        for _ in 0..r.u32()? {
            let y = r.u32()?;
            if !(y0..y1).contains(&y) {
                return Err(Error::Damaged("a row that was seen is none of the picture".into()));
            }
            let row = (x0..x1).map(|_| pixel(r)).collect::<Result<Vec<_>, _>>()?;
            rows.insert(y, row);
        }
        Ok(Self { note, rows })
    }
}

fn fixed(f: &Features) -> [f32; FIXED] {
    let ([a, b, c], [n0, n1, n2], [g0, g1, g2], [p0, p1, p2]) = (f.albedo, f.normal, f.geometric, f.position);
    let ([u, v], [mx, my], [sx, sy]) = (f.uv, f.motion, f.slope);
    [f.alpha, f.depth, a, b, c, n0, n1, n2, g0, g1, g2, p0, p1, p2, u, v, mx, my, sx, sy]
}

fn pixel(r: &mut Reader) -> Result<Features, Error> {
    let words = |data: &[u8]| -> Vec<u32> {
        data.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    };
    let v: Vec<f32> = words(r.take(FIXED * 4)?).into_iter().map(f32::from_bits).collect();
    let count = r.u32()? as usize;
    let objects = words(r.take(count.saturating_mul(OBJECT))?);
    let count = r.u32()? as usize;
    let materials = words(r.take(count.saturating_mul(MATERIAL))?);
    let three = |i: usize| [v[i], v[i + 1], v[i + 2]];
    Ok(Features {
        alpha: v[0],
        depth: v[1],
        albedo: three(2),
        normal: three(5),
        geometric: three(8),
        position: three(11),
        uv: [v[14], v[15]],
        motion: [v[16], v[17]],
        slope: [v[18], v[19]],
        objects: objects.chunks_exact(3).map(|o| ((o[0], o[1]), f32::from_bits(o[2]))).collect(),
        materials: materials.chunks_exact(2).map(|m| (m[0], f32::from_bits(m[1]))).collect(),
    })
}

/// One with all that there can be, for tests.
#[cfg(test)]
pub(crate) fn example([x0, x1, y0, _]: [u32; 4]) -> Seen {
    let f = |x: u32, y: u32| {
        let v = |k: u32| (x * 31 + y * 7 + k) as f32 * 0.37 - 3.0;
        let three = |k| [v(k), v(k + 1), v(k + 2)];
        Features {
            alpha: v(0),
            depth: v(1),
            albedo: three(2),
            normal: three(5),
            geometric: three(8),
            position: three(11),
            uv: [v(14), v(15)],
            motion: [v(16), v(17)],
            slope: [v(18), v(19)],
            objects: (0..x % 3).map(|i| ((i, y), v(20 + i))).collect(),
            materials: (0..y % 2).map(|i| (i, v(30 + i))).collect(),
        }
    };
    let rows = [y0, y0 + 3].map(|y| (y, (x0..x1).map(|x| f(x, y)).collect())).into();
    Seen { note: vec![9, 8], rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: [u32; 4] = [2, 9, 4, 10];

    #[test]
    fn what_is_written_is_read_and_nothing_else() {
        let seen = example(BOUNDS);
        let bytes = seen.encode();
        assert_eq!(Seen::decode(&bytes, BOUNDS), Ok(seen));
        for n in 0..bytes.len() {
            assert!(Seen::decode(&bytes[..n], BOUNDS).is_err(), "cut to {n} bytes");
        }
        assert!(Seen::decode(&bytes, [2, 9, 5, 10]).is_err(), "a row that is none of the picture");
    }

    #[test]
    fn rows_that_nobody_has_are_named() {
        let seen = example(BOUNDS);
        assert!(Seen::join(&[&seen], BOUNDS).unwrap_err().to_string().contains("row 5"));
        assert_eq!(Seen::join(&[&seen], [2, 9, 4, 5]).unwrap(), seen.rows[&4]);
    }
}
