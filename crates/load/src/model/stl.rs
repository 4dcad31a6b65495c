//! STL (3D Systems 1989): triangles without shared vertices, as text or binary. Vertices at the same place are joined; faces stay
//! flat.

use super::point;
use crate::ply::flat;
use std::collections::BTreeMap;
use steradian_geometry::TriangleMesh;
use steradian_math::Point3;

/// Reads an STL file of either kind.
pub(super) fn read(bytes: &[u8]) -> Result<TriangleMesh, String> {
    let corners = if is_binary(bytes) { binary(bytes)? } else { text(bytes)? };
    let mut mesh = TriangleMesh::default();
    let mut numbers: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    for face in corners.chunks_exact(3) {
        let indices = [0, 1, 2].map(|k| {
            let p = face[k];
            *numbers.entry([p.x, p.y, p.z].map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(p);
                mesh.positions.len() as u32 - 1
            })
        });
        if !flat(face[0], face[1], face[2]) {
            mesh.indices.push(indices);
        }
    }
    if mesh.indices.is_empty() { Err("the mesh has no faces".into()) } else { Ok(mesh) }
}

/// A binary file is as long as it says. Some of them begin with the word that starts texts.
fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    count.is_some_and(|n| n.checked_mul(50).and_then(|n| n.checked_add(84)) == Some(bytes.len()))
        || !bytes.trim_ascii_start().starts_with(b"solid")
}

fn binary(bytes: &[u8]) -> Result<Vec<Point3>, String> {
    let Some(head) = bytes.get(80..84) else { return Err("truncated STL file: its header is not complete".into()) };
    let count = u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize;
    let faces = bytes[84..].chunks_exact(50);
    if faces.len() < count {
        return Err(format!("truncated STL file: it promises {count} triangles, but has {}", faces.len()));
    }
    let mut out = Vec::with_capacity(3 * count);
    for (i, face) in faces.take(count).enumerate() {
        for corner in face[12..48].chunks_exact(12) {
            let value = |k: usize| f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]]);
            out.push(point([value(0), value(4), value(8)]).ok_or(format!("triangle {i} is not finite"))?);
        }
    }
    Ok(out)
}

fn text(bytes: &[u8]) -> Result<Vec<Point3>, String> {
    let text =
        std::str::from_utf8(bytes).map_err(|e| format!("byte {} is not part of a character", e.valid_up_to()))?;
    let mut out = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        if words.next() != Some("vertex") {
            continue;
        }
        let mut next = || words.next().and_then(|w| w.parse::<f32>().ok());
        let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
            return Err(format!("line {}: a vertex needs three numbers", i + 1));
        };
        out.push(point([x, y, z]).ok_or(format!("line {}: a vertex that is not finite", i + 1))?);
    }
    if out.len() % 3 == 0 { Ok(out) } else { Err("truncated STL file: a face with fewer than three vertices".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
                        facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

    #[test]
    fn text_and_binary_say_the_same() {
        let mesh = read(TEXT.as_bytes()).unwrap();
        assert_eq!((mesh.positions.len(), mesh.indices.len()), (4, 2));
        let mut bytes = vec![b's'; 80];
        bytes.extend(2u32.to_le_bytes());
        for face in &mesh.indices {
            bytes.extend([0; 12]);
            for v in face {
                let p = mesh.positions[*v as usize];
                [p.x, p.y, p.z].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        assert_eq!(read(&bytes).unwrap(), mesh);
        assert!(read(&bytes[..bytes.len() - 1]).unwrap_err().starts_with("truncated STL file: it promises 2"));
    }
}
