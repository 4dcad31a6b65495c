//! True displacement: a mesh is refined until no edge is too long, and its vertices are moved along their normals (Cook,
//! "Shade trees", 1984; refinement by the longest edge: Rivara 1984).

use super::World;
use super::light::Lights;
use super::texture::TextureContext;
use crate::{Camera, Displacement, Error, Scene};
use rayon::prelude::*;
use std::collections::HashMap;
use steradian_geometry::TriangleMesh;
use steradian_image::Pyramid;
use steradian_math::{Bounds3, Normal3, Transform};

/// A displaced mesh may have this many triangles.
const MOST_TRIANGLES: usize = 1 << 25;
/// One triangle is halved this often at most: each edge can be halved until nothing is left of a `f32`'s digits.
const MOST_HALVINGS: u32 = 96;

/// Displaces all meshes that the scene wants displaced.
pub(super) fn displace_meshes(
    mut scene: Scene,
    pyramids: Vec<Option<Pyramid>>,
) -> Result<(Scene, Vec<Option<Pyramid>>), Error> {
    let displacements = std::mem::take(&mut scene.displacements);
    if displacements.is_empty() {
        return Ok((scene, pyramids));
    }
    // Textures are evaluated by a world; one with nothing in it is enough.
    let mut world = World {
        groups: Vec::new(),
        instances: Vec::new(),
        pyramids,
        camera: super::CameraModel::new(&Camera::default(), [1, 1], false),
        has_motion: false,
        uses_footprints: false,
        has_interfaces: false,
        needs_one_wavelength: false,
        media: Vec::new(),
        diffusion: super::subsurface::DiffusionTables::default(),
        plastics: super::plastic::PlasticTables::default(),
        area_lights: Vec::new(),
        lights: Lights::default(),
        bounds: Bounds3::EMPTY,
        scene,
    };
    for d in &displacements {
        let mesh = &world.scene.triangle_meshes[d.mesh];
        mesh.validate().map_err(|source| Error::Mesh { mesh: d.mesh.index(), source })?;
        if mesh.uvs.is_empty() || d.edge_length.is_nan() || d.edge_length <= 0.0 {
            return Err(Error::Displacement {
                mesh: d.mesh.index(),
                message: "it needs texture coordinates and a positive edge length",
            });
        }
        let displaced = world.displaced(mesh, d)?;
        world.scene.triangle_meshes[d.mesh] = displaced;
    }
    Ok((world.scene, world.pyramids))
}

impl World {
    fn displaced(&self, mesh: &TriangleMesh, d: &Displacement) -> Result<TriangleMesh, Error> {
        let mut mesh = refined(mesh, &d.world_from_object, d.edge_length).ok_or(Error::Displacement {
            mesh: d.mesh.index(),
            message: "its edges are so long for the edge length that there would be too many triangles",
        })?;
        let offsets: Vec<f32> = (0..mesh.positions.len())
            .into_par_iter()
            .map(|i| {
                let context = TextureContext { p: mesh.positions[i], uv: mesh.uvs[i], ..TextureContext::default() };
                self.float_texture(d.texture, &context)
            })
            .collect();
        for ((p, n), offset) in mesh.positions.iter_mut().zip(&mesh.normals).zip(offsets) {
            *p += n.to_vec() * offset;
        }
        mesh.normals = smooth_normals(&mesh);
        Ok(mesh)
    }
}

/// The mean of the normals of the triangles around each vertex, each counted alike.
fn smooth_normals(mesh: &TriangleMesh) -> Vec<Normal3> {
    let mut normals = vec![Normal3::default(); mesh.positions.len()];
    for face in &mesh.indices {
        let [a, b, c] = face.map(|i| mesh.positions[i as usize]);
        if let Some(n) = (b - a).cross(c - b).try_normalize() {
            for &i in face {
                normals[i as usize] += n.to_normal();
            }
        }
    }
    normals.into_iter().map(|n| n.try_normalize().unwrap_or(n)).collect()
}

/// The mesh with every edge of `edge_length` or more halved, measured after `t`; with normals, and without tangents.
fn refined(mesh: &TriangleMesh, t: &Transform, edge_length: f32) -> Option<TriangleMesh> {
    let mut out = TriangleMesh { indices: Vec::new(), tangents: Vec::new(), ..mesh.clone() };
    if out.normals.is_empty() {
        out.normals = smooth_normals(mesh);
    }
    // Refinement makes about this many triangles; the limit in the loop is for what the estimate does not see.
    let expected: f64 = mesh
        .indices
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|i| t.point(mesh.positions[i as usize]));
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let halves = f64::from(longest / edge_length);
            halves * halves
        })
        .sum();
    if expected.is_nan() || expected > MOST_TRIANGLES as f64 {
        return None;
    }
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut waiting: Vec<([u32; 3], u32)> = Vec::new();
    for &face in &mesh.indices {
        waiting.push((face, 0));
        while let Some((face, depth)) = waiting.pop() {
            let length = |i: usize, j: usize| {
                let place = |k: usize| t.point(out.positions[face[k] as usize]);
                place(i).distance(place(j))
            };
            let sides = [length(0, 1), length(1, 2), length(2, 0)];
            if sides.iter().all(|&s| s < edge_length) || depth == MOST_HALVINGS {
                out.indices.push(face);
                if out.indices.len() > MOST_TRIANGLES {
                    return None;
                }
                continue;
            }
            // The longest edge first; of equal ones the last, as pbrt does.
            let first = match sides {
                [a, b, c] if a > b && a > c => 0,
                [a, b, c] if b >= a && b > c => 1,
                _ => 2,
            };
            let [a, b, c] = [0, 1, 2].map(|i| face[(first + i) % 3]);
            let middle = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| add_middle(&mut out, a, b));
            // Depth first, in order.
            waiting.push(([middle, b, c], depth + 1));
            waiting.push(([a, middle, c], depth + 1));
        }
    }
    Some(out)
}

/// A new vertex halfway between two.
fn add_middle(mesh: &mut TriangleMesh, a: u32, b: u32) -> u32 {
    let (a, b) = (a as usize, b as usize);
    let n = mesh.normals[a] + mesh.normals[b];
    mesh.positions.push(mesh.positions[a].lerp(mesh.positions[b], 0.5));
    mesh.normals.push(n.try_normalize().unwrap_or(n));
    let (u, v) = (mesh.uvs[a], mesh.uvs[b]);
    mesh.uvs.push(u + (v - u) * 0.5);
    mesh.positions.len() as u32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::{Point2, Point3, Vec3};

    fn square() -> TriangleMesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        TriangleMesh {
            positions: corners.map(|[x, y]| Point3::new(x, y, 0.0)).to_vec(),
            uvs: corners.map(|[x, y]| Point2::new(x, y)).to_vec(),
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn refinement_keeps_the_surface_closed_and_its_edges_short() {
        let t = Transform::scale(2.0, 2.0, 2.0).unwrap();
        let mesh = refined(&square(), &t, 0.3).unwrap();
        assert!(mesh.validate().is_ok());
        let at = |i: u32| mesh.positions[i as usize];
        let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
        let mut area = 0.0;
        for &[a, b, c] in &mesh.indices {
            area += 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).z;
            for (i, j) in [(a, b), (b, c), (c, a)] {
                assert!(2.0 * at(i).distance(at(j)) < 0.3);
                *edges.entry([i.min(j), i.max(j)]).or_default() += 1;
            }
        }
        assert!((area - 1.0).abs() < 1e-5);
        // An edge of one triangle only is on the border of the square: no cracks.
        for ([i, j], count) in edges {
            let on = |f: fn(Point3) -> f32, v: f32| f(at(i)) == v && f(at(j)) == v;
            let border = on(|p| p.x, 0.0) || on(|p| p.x, 1.0) || on(|p| p.y, 0.0) || on(|p| p.y, 1.0);
            assert_eq!(count, if border { 1 } else { 2 });
        }
        assert!(mesh.normals.iter().all(|n| (n.to_vec() - Vec3::new(0.0, 0.0, 1.0)).length() < 1e-6));
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            assert!((p.x - uv.x).abs() < 1e-6 && (p.y - uv.y).abs() < 1e-6);
        }
        assert!(refined(&square(), &t, 1e-30).is_none());
    }
}
