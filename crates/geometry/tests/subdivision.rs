//! Loop subdivision: known limits, topology, boundaries, and meshes that are none.

use steradian_geometry::{SubdivisionError, TriangleMesh, loop_subdivide};
use steradian_math::{Point3, Vec3};

fn octahedron() -> (Vec<Point3>, Vec<[u32; 3]>) {
    let p = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let f = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (p.map(Point3::from).to_vec(), f.to_vec())
}

/// Twice the signed volume around the origin, which is positive if faces are turned outwards.
fn volume(mesh: &TriangleMesh) -> f32 {
    (0..mesh.indices.len())
        .map(|i| {
            let [a, b, c] = mesh.triangle(i).p.map(Point3::to_vec);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[test]
fn a_closed_mesh_becomes_a_smooth_one() {
    let (p, f) = octahedron();
    let mut last = None;
    for levels in 0..5 {
        let mesh = loop_subdivide(&p, &f, levels).unwrap();
        mesh.validate().unwrap();
        let faces = 8usize << (2 * levels);
        assert_eq!((mesh.indices.len(), mesh.positions.len()), (faces, faces / 2 + 2), "Euler's formula");
        // The limit of a vertex does not depend on when it is taken.
        for i in 0..6 {
            let limit = mesh.positions[i];
            // A vertex of valence 4: 1 - 4/8 of itself, and its ring cancels.
            assert!((limit.to_vec().length() - 0.5).abs() < 1e-6);
            if let Some(last) = &last {
                let last: &TriangleMesh = last;
                assert!(limit.distance(last.positions[i]) < 1e-6, "{levels} {i}");
            }
        }
        for (n, p) in mesh.normals.iter().zip(&mesh.positions) {
            assert!(n.normalize().dot(p.to_vec().normalize()) < -0.9, "{n:?} {p:?}");
        }
        assert!(volume(&mesh) > 0.0);
        last = Some(mesh);
    }
    // Normals of the mesh and normals of its faces agree ever better.
    let mesh = last.unwrap();
    for i in 0..mesh.indices.len() {
        let s = mesh.interaction(i, 0.3, 0.3);
        assert!(s.shading.n.dot(s.n) > 0.98);
    }
}

#[test]
fn the_limit_of_a_regular_plane_is_the_plane() {
    // A grid with a boundary; every inner vertex has six neighbours.
    let n = 5u32;
    let p: Vec<Point3> =
        (0..n * n).map(|i| Point3::new((i % n) as f32, (i / n) as f32, 0.5 * (i % n) as f32)).collect();
    let mut f = Vec::new();
    for y in 0..n - 1 {
        for x in 0..n - 1 {
            let i = y * n + x;
            f.push([i, i + 1, i + n + 1]);
            f.push([i, i + n + 1, i + n]);
        }
    }
    for levels in 0..3 {
        let mesh = loop_subdivide(&p, &f, levels).unwrap();
        let normal = Vec3::new(-0.5, 0.0, 1.0).normalize();
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((p.z - 0.5 * p.x).abs() < 1e-5, "{p:?}");
            assert!(n.normalize().dot(normal) < -0.9999, "{n:?}");
        }
        // An inner vertex of a regular, linear grid stays where it is.
        assert!(mesh.positions[12].distance(p[12]) < 1e-6);
        // So does the middle of a straight boundary.
        assert!(mesh.positions[2].distance(p[2]) < 1e-6);
    }
}

#[test]
fn what_is_no_surface_is_refused() {
    let (p, mut f) = octahedron();
    assert!(matches!(loop_subdivide(&p, &[[0, 0, 1]], 1), Err(SubdivisionError::DegenerateFace { face: 0 })));
    assert!(matches!(loop_subdivide(&p, &[[0, 1, 9]], 1), Err(SubdivisionError::Mesh(_))));
    assert!(matches!(loop_subdivide(&p, &f, 40), Err(SubdivisionError::TooLarge { .. })));
    assert!(matches!(loop_subdivide(&p, &f, u32::MAX), Err(SubdivisionError::TooLarge { .. })));
    f.push([0, 2, 5]);
    assert!(matches!(loop_subdivide(&p, &f, 1), Err(SubdivisionError::NotManifold { face: 8, .. })));
    // Nothing, and vertices that no face uses, are fine.
    assert!(loop_subdivide(&[], &[], 3).unwrap().indices.is_empty());
    let mesh = loop_subdivide(&p, &f[..2], 2).unwrap();
    assert_eq!(mesh.indices.len(), 32);
    assert_eq!(mesh.positions[5], p[5]);
}
