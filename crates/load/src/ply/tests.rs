//! Well-made files of every encoding, and files that lie.

use super::*;
use proptest::prelude::*;

const QUAD_ASCII: &str = "ply\nformat ascii 1.0\ncomment x\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
    property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\nelement face 3\n\
    property list uchar int vertex_indices\nend_header\n\
    0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1\n2 0 0.5 0 0 1 2 0\n3 0 1 2\n4 0 1 2 3\n3 1 4 2\n";

/// The same mesh in binary, with the types and the order of bytes that are asked for.
fn binary(big: bool, coordinate: &str, index: &str, extra_face_property: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let extra = if extra_face_property { "property uchar material\n" } else { "" };
    let mut out = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 5\nproperty {coordinate} x\nproperty {coordinate} y\nproperty {coordinate} z\n\
         property {coordinate} nx\nproperty {coordinate} ny\nproperty {coordinate} nz\nproperty {coordinate} s\nproperty {coordinate} t\n\
         element junk 2\nproperty list ushort short stuff\nelement face 3\n{extra}property list uchar {index} vertex_indices\nend_header\n"
    )
    .into_bytes();
    let mut put = |v: f64, ty: &str| {
        let mut bytes = match ty {
            "float" => (v as f32).to_be_bytes().to_vec(),
            "double" => v.to_be_bytes().to_vec(),
            "int" | "uint" => (v as i32).to_be_bytes().to_vec(),
            "ushort" | "short" => (v as u16).to_be_bytes().to_vec(),
            _ => vec![v as u8],
        };
        if !big {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    let body = QUAD_ASCII.split("end_header\n").nth(1).unwrap();
    for line in body.lines().take(5) {
        line.split(' ').for_each(|w| put(w.parse().unwrap(), coordinate));
    }
    put(2.0, "ushort");
    put(7.0, "short");
    put(7.0, "short");
    put(0.0, "ushort");
    for line in body.lines().skip(5) {
        if extra_face_property {
            put(9.0, "uchar");
        }
        let mut words = line.split(' ').map(|w| w.parse::<f64>().unwrap());
        put(words.next().unwrap(), "uchar");
        words.for_each(|v| put(v, index));
    }
    out
}

#[test]
fn every_encoding_gives_the_same_mesh() {
    let mesh = parse(QUAD_ASCII.as_bytes()).unwrap();
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.positions[4], Point3::new(2.0, 0.0, 0.5));
    assert_eq!(mesh.normals, vec![Normal3::new(0.0, 0.0, 1.0); 5]);
    assert_eq!(mesh.uvs[2], Point2::new(1.0, 1.0));
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 4, 2]]);
    assert_eq!(mesh.quads, [[0, 1, 3, 2]], "a loop of four corners becomes the rows of a patch");
    for big in [false, true] {
        for coordinate in ["float", "double"] {
            for index in ["int", "uint", "ushort", "uchar"] {
                for extra in [false, true] {
                    assert_eq!(
                        parse(&binary(big, coordinate, index, extra)).unwrap(),
                        mesh,
                        "{big} {coordinate} {index}"
                    );
                }
            }
        }
    }
}

fn mesh(vertices: &[[f32; 3]], faces: &str) -> String {
    let count = faces.lines().count();
    let v: String = vertices.iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {count}\n\
         property list uchar int vertex_indices\nend_header\n{v}{faces}",
        vertices.len()
    )
}

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn lies_are_named() {
    let error = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    assert_eq!(error(b""), "not a PLY file");
    assert_eq!(error(b"\x89PNG\r\n"), "not a PLY file");
    assert_eq!(error(b"ply\nformat ascii 1.0\n"), "damaged PLY header: it has no `end_header`");
    assert_eq!(error(b"ply\nend_header\n"), "damaged PLY header: it has no `format`");
    assert_eq!(
        error(b"ply\nformat ascii 1.0\nelement vertex -3\nend_header\n"),
        "damaged PLY header: `element vertex -3` is not understood"
    );
    assert_eq!(error(b"ply\nformat ascii 1.0\nend_header\n"), "the PLY file has no vertices");
    let huge = b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\nabcd";
    assert_eq!(
        error(huge),
        "damaged PLY file: the header promises 4000000000 of element `vertex`, which take at least 16000000000 bytes, but only 4 are left"
    );
    assert_eq!(
        error(mesh(&TRIANGLE, "3 0 1 3\n").as_bytes()),
        "face 0 of the PLY file uses vertex 3, but there are only 3"
    );
    assert_eq!(
        error(mesh(&TRIANGLE, "3 0 1 2\n3 0 -1 2\n").as_bytes()),
        "face 1 of the PLY file uses vertex -1, but there are only 3"
    );
    let nan = mesh(&[[0.0; 3], [f32::NAN, 0.0, 0.0], [1.0; 3]], "3 0 1 2\n");
    assert_eq!(error(nan.as_bytes()), "vertex 1 of the PLY file has a coordinate that is not finite");
    let word = mesh(&TRIANGLE, "3 0 1 2\n").replace("0 1 0", "0 one 0");
    assert_eq!(
        error(word.as_bytes()),
        "damaged PLY file: element `vertex` number 2 has `one` where a number should be"
    );
    let cut = binary(false, "float", "int", false);
    assert_eq!(error(&cut[..cut.len() - 1]), "truncated PLY file: it ends in element `face` number 2 of 3");
    let text = mesh(&TRIANGLE, "3 0 1 2\n");
    assert_eq!(
        error(&text.as_bytes()[..text.len() - 3]),
        "truncated PLY file: it ends in element `face` number 0 of 1"
    );
}

#[test]
fn a_truncated_file_of_nothing_but_vertices_and_triangles_names_the_place() {
    let mut out = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        .to_vec();
    let data = out.len();
    TRIANGLE.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
    out.push(3);
    [0u32, 1, 2].iter().for_each(|v| out.extend(v.to_le_bytes()));
    assert_eq!(parse(&out).unwrap().triangles, [[0, 1, 2]]);
    for end in 0..out.len() {
        let e = parse(&out[..end]).unwrap_err();
        let expected = match end {
            _ if end < 4 => matches!(e, PlyError::NotPly),
            _ if end < data => matches!(e, PlyError::Header(_)),
            _ if end < data + 37 => matches!(e, PlyError::Promise { .. }),
            _ => matches!(e, PlyError::Truncated { .. }),
        };
        assert!(expected, "{end}: {e}");
    }
}

#[test]
fn faces_without_area_and_polygons_are_left_out_and_counted() {
    let faces = "3 0 1 2\n3 0 1 1\n3 0 0 0\n5 0 1 2 0 1\n4 0 0 1 1\n2 0 1\n";
    let m = parse(mesh(&TRIANGLE, faces).as_bytes()).unwrap();
    assert_eq!((m.triangles.len(), m.quads.len(), m.degenerate, m.other_faces), (1, 0, 3, 2));
    let tiny = TRIANGLE.map(|p| p.map(|x| x * 1e-25));
    let m = parse(mesh(&tiny, "3 0 1 2\n").as_bytes()).unwrap();
    assert_eq!((m.triangles.len(), m.degenerate), (1, 0), "small is not flat");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_bytes_are_an_error_or_a_mesh_but_never_a_panic(
        big: bool, kind in 0usize..4, cut in 0.0f64..1.0, changes in proptest::collection::vec((0.0f64..1.0, any::<u8>()), 0..6)
    ) {
        let mut bytes = match kind {
            0 => QUAD_ASCII.as_bytes().to_vec(),
            1 => binary(big, "double", "ushort", true),
            _ => binary(big, "float", "int", false),
        };
        for (at, value) in changes {
            let i = (at * bytes.len() as f64) as usize;
            bytes[i] = value;
        }
        bytes.truncate((bytes.len() as f64 * (1.0 - cut * cut * cut)) as usize);
        if let Ok(m) = parse(&bytes) {
            let n = m.positions.len() as u32;
            prop_assert!(m.triangles.iter().flatten().chain(m.quads.iter().flatten()).all(|&i| i < n));
            prop_assert!(m.normals.is_empty() || m.normals.len() == m.positions.len());
        }
    }
}
