//! `EXT_meshopt_compression`: buffer views packed for the decoder of meshoptimizer, after the extension's own specification of the
//! bit streams.

use super::json::{Json, Result};

/// Groups of this many elements share a width of their deltas.
const GROUP: usize = 16;
/// Nobody packs more into one view; a stream of a few bytes may claim anything.
const MOST_BYTES: usize = 1 << 31;
/// Sixteen bytes of a stream stand for no more elements than these.
const MOST_EXPANSION: usize = 4096;

/// The bytes of a packed view.
pub(super) fn unpack(e: &Json, packed: &[u8]) -> Result<Vec<u8>> {
    let stride = e.need("byteStride")?.as_count()?;
    let count = e.need("count")?.as_count()?;
    let mode = e.need("mode")?;
    let size = stride.checked_mul(count).filter(|&n| n <= MOST_BYTES && n / MOST_EXPANSION <= packed.len() + 64);
    let Some(size) = size else {
        return Err(e.problem(format!("{count} elements of {stride} bytes do not come out of {} bytes", packed.len())));
    };
    let out = match mode.as_str()? {
        "ATTRIBUTES" if (1..=256).contains(&stride) && stride % 4 == 0 => attributes(packed, count, stride),
        "TRIANGLES" if (stride == 2 || stride == 4) && count % 3 == 0 => {
            triangles(packed, count).map(|i| narrow(&i, stride))
        }
        "INDICES" if stride == 2 || stride == 4 => indices(packed, count).map(|i| narrow(&i, stride)),
        "ATTRIBUTES" | "TRIANGLES" | "INDICES" => {
            return Err(e.problem("`byteStride` or `count` does not suit its `mode`"));
        }
        other => return Err(mode.problem(format!("`{other}` is no mode"))),
    };
    let Some(mut out) = out.filter(|o| o.len() == size) else {
        return Err(e.problem("the compressed data are damaged"));
    };
    match e.text("filter")?.unwrap_or("NONE") {
        "NONE" => {}
        "OCTAHEDRAL" if stride == 4 => octahedral(&mut out, |b| f32::from(b[0] as i8), 1, 127.0),
        "OCTAHEDRAL" if stride == 8 => {
            octahedral(&mut out, |b| f32::from(i16::from_le_bytes([b[0], b[1]])), 2, 32767.0)
        }
        "QUATERNION" if stride == 8 => quaternion(&mut out),
        "EXPONENTIAL" if stride % 4 == 0 => exponential(&mut out),
        other => return Err(e.problem(format!("the filter `{other}` does not suit elements of {stride} bytes"))),
    }
    Ok(out)
}

fn narrow(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|i| i.to_le_bytes().into_iter().take(stride)).collect()
}

/// Vertex attributes: for each byte of an element, deltas from element to element, in groups with 0, 2, 4 or 8 bits each.
fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    if *data.first()? != 0xa0 {
        return None;
    }
    let mut last: Vec<u8> = data.get(data.len().checked_sub(stride)?..)?.to_vec();
    let per_block = ((8192 / stride) & !(GROUP - 1)).clamp(GROUP, 256);
    let mut out = vec![0u8; count * stride];
    let (mut at, mut first) = (1, 0);
    let mut deltas = [0u8; 256];
    while first < count {
        let n = per_block.min(count - first);
        let groups = n.div_ceil(GROUP);
        for k in 0..stride {
            let header = data.get(at..at + groups.div_ceil(4))?;
            at += header.len();
            for g in 0..groups {
                let bits = header[g / 4] >> (2 * (g % 4)) & 3;
                at += group(data.get(at..)?, bits, &mut deltas[g * GROUP..(g + 1) * GROUP])?;
            }
            for i in 0..n {
                let d = deltas[i];
                let delta = if d & 1 != 0 { !(d >> 1) } else { d >> 1 };
                last[k] = last[k].wrapping_add(delta);
                out[(first + i) * stride + k] = last[k];
            }
        }
        first += n;
    }
    Some(out)
}

/// One group of sixteen deltas; how many bytes it took.
fn group(data: &[u8], bits: u8, out: &mut [u8]) -> Option<usize> {
    let width = match bits {
        0 => {
            out.fill(0);
            return Some(0);
        }
        1 => 2,
        2 => 4,
        _ => {
            out.copy_from_slice(data.get(..GROUP)?);
            return Some(GROUP);
        }
    };
    let (per_byte, sentinel) = (8 / width, (1u8 << width) - 1);
    let packed = GROUP / per_byte;
    let mut extra = packed;
    for (i, o) in out.iter_mut().enumerate() {
        // The first of a byte is in its highest bits; what does not fit follows behind the group.
        let byte = *data.get(i / per_byte)?;
        let v = byte >> (8 - width * (i % per_byte + 1)) & sentinel;
        *o = if v == sentinel {
            extra += 1;
            *data.get(extra - 1)?
        } else {
            v
        };
    }
    Some(extra)
}

/// A variable-length number that changes the last index.
fn index(data: &[u8], at: &mut usize, last: u32) -> Option<u32> {
    let v = variable(data, at)?;
    Some(last.wrapping_add((v >> 1) ^ (v & 1).wrapping_neg()))
}

fn variable(data: &[u8], at: &mut usize) -> Option<u32> {
    let mut v = 0u32;
    for shift in [0, 7, 14, 21, 28] {
        let byte = *data.get(*at)?;
        *at += 1;
        v |= u32::from(byte & 0x7f).wrapping_shl(shift);
        if byte & 0x80 == 0 {
            return Some(v);
        }
    }
    None
}

/// The most recent sixteen of something.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn push(&mut self, v: T) {
        self.items[self.next & 15] = v;
        self.next = self.next.wrapping_add(1);
    }

    /// The one `back` before the next.
    fn get(&self, back: usize) -> T {
        self.items[self.next.wrapping_sub(back) & 15]
    }
}

/// Triangles that share edges and vertices with recent ones.
fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    if *data.first()? & 0xf0 != 0xe0 || *data.first()? & 15 > 1 {
        return None;
    }
    let version = data[0] & 15;
    // Codes from 13 say that the vertex is near the last one; the first version has none of these.
    let most_recent = if version >= 1 { 13 } else { 15 };
    let faces = count / 3;
    let codes = data.get(1..1 + faces)?;
    let table = data.get(data.len().checked_sub(16)?..)?;
    let mut at = 1 + faces;
    let mut out = Vec::with_capacity(count);
    let mut edges = Recent { items: [[0u32; 2]; 16], next: 0 };
    let mut vertices = Recent { items: [0u32; 16], next: 0 };
    let (mut next, mut last) = (0u32, 0u32);
    for &code in codes {
        let (high, low) = (usize::from(code >> 4), usize::from(code & 15));
        if high < 15 {
            let [a, b] = edges.get(1 + high);
            let c;
            if low < most_recent {
                if low == 0 {
                    c = next;
                    next = next.wrapping_add(1);
                    vertices.push(c);
                } else {
                    c = vertices.get(1 + low);
                }
            } else {
                c = if low != 15 {
                    last.wrapping_add(low as u32).wrapping_sub(low as u32 ^ 3)
                } else {
                    index(data, &mut at, last)?
                };
                last = c;
                vertices.push(c);
            }
            out.extend([a, b, c]);
            edges.push([c, b]);
            edges.push([a, c]);
            continue;
        }
        let from_table = low < 14;
        let aux = if from_table {
            table[low]
        } else {
            let byte = *data.get(at)?;
            at += 1;
            byte
        };
        let (fb, fc) = (usize::from(aux >> 4), usize::from(aux & 15));
        let fa = if !from_table && low == 15 { 15 } else { 0 };
        if !from_table && aux == 0 {
            next = 0;
        }
        let mut new = || {
            let v = next;
            next = next.wrapping_add(1);
            v
        };
        let mut a = if fa == 0 { new() } else { 0 };
        let mut b = if fb == 0 { new() } else { vertices.get(fb) };
        let mut c = if fc == 0 { new() } else { vertices.get(fc) };
        if !from_table {
            for (f, v) in [(fa, &mut a), (fb, &mut b), (fc, &mut c)] {
                if f == 15 {
                    *v = index(data, &mut at, last)?;
                    last = *v;
                }
            }
        }
        out.extend([a, b, c]);
        let explicit = |f: usize| f == 0 || !from_table && f == 15;
        vertices.push(a);
        if explicit(fb) {
            vertices.push(b);
        }
        if explicit(fc) {
            vertices.push(c);
        }
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
    }
    Some(out)
}

/// Indices in any order: differences from one of two earlier ones.
fn indices(data: &[u8], count: usize) -> Option<Vec<u32>> {
    if *data.first()? & 0xf0 != 0xd0 || *data.first()? & 15 > 1 {
        return None;
    }
    let mut last = [0u32; 2];
    let mut at = 1;
    (0..count)
        .map(|_| {
            let v = variable(data, &mut at)?;
            let (which, v) = ((v & 1) as usize, v >> 1);
            last[which] = last[which].wrapping_add((v >> 1) ^ (v & 1).wrapping_neg());
            Some(last[which])
        })
        .collect()
}

/// Unit vectors on an octahedron: x and y, with the scale in z. The fourth component stays.
fn octahedral(data: &mut [u8], read: impl Fn(&[u8]) -> f32, size: usize, most: f32) {
    for e in data.chunks_exact_mut(4 * size) {
        let v: [f32; 3] = std::array::from_fn(|k| read(&e[k * size..]));
        let (mut x, mut y) = (v[0] / v[2], v[1] / v[2]);
        let z = 1.0 - x.abs() - y.abs();
        let fold = z.min(0.0);
        x += if x >= 0.0 { fold } else { -fold };
        y += if y >= 0.0 { fold } else { -fold };
        let l = most / (x * x + y * y + z * z).sqrt();
        for (k, v) in [x, y, z].into_iter().enumerate() {
            let rounded = (v * l).round() as i32;
            e[k * size..(k + 1) * size].copy_from_slice(&rounded.to_le_bytes()[..size]);
        }
    }
}

/// Rotations: the three smallest components, and which is the largest.
fn quaternion(data: &mut [u8]) {
    for e in data.chunks_exact_mut(8) {
        let word = |k: usize| i16::from_le_bytes([e[2 * k], e[2 * k + 1]]);
        let w = word(3);
        let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(w | 3);
        let [x, y, z] = [word(0), word(1), word(2)].map(|v| f32::from(v) * scale);
        let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let which = usize::from(w as u16 & 3);
        for (k, v) in [(1, x), (2, y), (3, z), (0, largest)] {
            let at = 2 * ((which + k) & 3);
            e[at..at + 2].copy_from_slice(&((v * 32767.0).round() as i16).to_le_bytes());
        }
    }
}

/// Floats as 24 bits of mantissa and 8 of exponent.
fn exponential(data: &mut [u8]) {
    for e in data.chunks_exact_mut(4) {
        let v = i32::from_le_bytes([e[0], e[1], e[2], e[3]]);
        let (exponent, mantissa) = (v >> 24, v << 8 >> 8);
        // Two steps, since the power alone may be below the smallest float.
        let power = |n: i32| f32::from_bits(((n.clamp(-126, 127) + 127) as u32) << 23);
        let half = exponent / 2;
        let value = mantissa as f32 * power(half) * power(exponent - half);
        e.copy_from_slice(&value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What meshoptimizer's encoder makes of a grid of 5 x 5 vertices of eight bytes, and of its triangles.
    const VERTICES: &str = "a00a0eeeefeeeefeeeef373737eeeefeeee0000000370500300c0316161600c00000160a000000222274444f0f6666f888800000\
        00170515755d5708080855d5400008000600000026aef4cfff1f141c3fffffc00006121e2a5f0818283800000000000000000000000000000000000000\
        00000000000000000000c8ff000300";
    const TRIANGLES: &str =
        "e1fe1e100e100e100ece1e160e150e140ece1e140e140e140ece1e140e140e140e0f0a007687566778a9866589689801690000";
    const INDICES: &str = "d10004100e14020e04100e14020e04100e14020e04100e14020a04100e14020e04100e14020e04100e14020e04100e14020a0410\
        0e14020e04100e14020e04100e14020e04100e14020a04100e14020e04100e14020e04100e14020e04100e140200000000";

    fn bytes(hex: &str) -> Vec<u8> {
        let digits: Vec<u8> = hex.bytes().filter_map(|b| (b as char).to_digit(16).map(|d| d as u8)).collect();
        digits.chunks_exact(2).map(|d| d[0] << 4 | d[1]).collect()
    }

    fn grid() -> (Vec<u8>, Vec<u32>) {
        let n = 5u32;
        let vertex = |i: u32, j: u32| [i * 7, j * 11, i * j, 200 - i, 255, i * i * j, 3, 0].map(|v| v as u8);
        let vertices = (0..n).flat_map(|j| (0..n).flat_map(move |i| vertex(i, j))).collect();
        let square = |i: u32, j: u32| {
            let a = j * n + i;
            [a, a + 1, a + n, a + 1, a + n + 1, a + n]
        };
        let indices = (0..n - 1).flat_map(|j| (0..n - 1).flat_map(move |i| square(i, j))).collect();
        (vertices, indices)
    }

    /// A triangle with its smallest corner first: the encoder may turn them.
    fn turned(indices: &[u32]) -> Vec<[u32; 3]> {
        let turn = |t: &[u32; 3]| {
            let least = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
            [t[least], t[(least + 1) % 3], t[(least + 2) % 3]]
        };
        indices.as_chunks::<3>().0.iter().map(turn).collect()
    }

    #[test]
    fn streams_of_the_encoder_come_out_as_they_went_in() {
        let (vertices, faces) = grid();
        assert_eq!(attributes(&bytes(VERTICES), 25, 8).unwrap(), vertices);
        assert_eq!(turned(&triangles(&bytes(TRIANGLES), faces.len()).unwrap()), turned(&faces));
        assert_eq!(indices(&bytes(INDICES), faces.len()).unwrap(), faces);
    }

    #[test]
    fn damaged_streams_end() {
        for (stream, count) in [(VERTICES, 25), (TRIANGLES, 96), (INDICES, 96)] {
            let whole = bytes(stream);
            for n in 0..whole.len() {
                for flip in [0u8, 1, 0x55, 0xff] {
                    let mut cut = whole[..n].to_vec();
                    if let Some(last) = cut.last_mut() {
                        *last ^= flip;
                    }
                    attributes(&cut, count, 8);
                    triangles(&cut, count / 3 * 3);
                    indices(&cut, count);
                }
            }
        }
    }

    #[test]
    fn filters_undo_what_they_should() {
        let mut e = 3i32.wrapping_shl(0).to_le_bytes().to_vec();
        e[3] = (-2i8) as u8;
        exponential(&mut e);
        assert_eq!(f32::from_le_bytes([e[0], e[1], e[2], e[3]]), 0.75);
        let mut n = vec![0u8, 0, 127, 9];
        octahedral(&mut n, |b| f32::from(b[0] as i8), 1, 127.0);
        assert_eq!(n, [0, 0, 127, 9]);
    }
}
