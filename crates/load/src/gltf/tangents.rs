//! Tangents where a mesh has none: MikkTSpace, as the specification demands, so that normal maps look as they were baked.

use super::meshes::Geometry;
use bevy_mikktspace::{Ops, TangentSpace, generate_tangents};
use steradian_math::acos;

/// The same bits everywhere.
struct Portable;

impl Ops for Portable {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        acos(x)
    }
}

struct Corners<'g> {
    geometry: &'g Geometry,
    set: usize,
    tangents: Vec<[f32; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.geometry.indices[face][vert] as usize
    }
}

impl bevy_mikktspace::Geometry<Portable> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.geometry.indices.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.geometry.positions[self.vertex(face, vert)]
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.geometry.normals[self.vertex(face, vert)]
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        let [u, v] = self.geometry.uvs[self.set][self.vertex(face, vert)];
        // Tangent space is right-handed with v pointing up.
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        self.tangents[3 * face + vert] = space.map_or([1.0, 0.0, 0.0, 1.0], |s| s.tangent_encoded());
    }
}

/// Gives a mesh tangents by its normals and its set of texture coordinates. Vertices where they differ from face to face are
/// doubled.
pub(super) fn generate(geometry: &mut Geometry, set: usize) {
    if geometry.normals.is_empty() {
        flatten(geometry);
    }
    let mut corners = Corners { geometry, set, tangents: vec![[1.0, 0.0, 0.0, 1.0]; 3 * geometry.indices.len()] };
    // It fails on meshes of more corners than can be numbered; those keep the tangents they have.
    let _ = generate_tangents::<_, Portable>(&mut corners);
    let tangents = corners.tangents;
    let count = geometry.positions.len();
    // The copies of each vertex, chained.
    let mut given: Vec<Option<[f32; 4]>> = vec![None; count];
    let mut next: Vec<u32> = vec![u32::MAX; count];
    for face in 0..geometry.indices.len() {
        for corner in 0..3 {
            let tangent = tangents[3 * face + corner];
            let mut v = geometry.indices[face][corner] as usize;
            loop {
                match given[v] {
                    None => {
                        given[v] = Some(tangent);
                        break;
                    }
                    Some(t) if t == tangent => break,
                    Some(_) if next[v] != u32::MAX => v = next[v] as usize,
                    Some(_) => {
                        let copy = geometry.double(v);
                        next[v] = copy;
                        given.push(Some(tangent));
                        next.push(u32::MAX);
                        v = copy as usize;
                        break;
                    }
                }
            }
            geometry.indices[face][corner] = v as u32;
        }
    }
    geometry.tangents = given.into_iter().map(|t| t.unwrap_or([1.0, 0.0, 0.0, 1.0])).collect();
}

/// Gives each face vertices of its own, with the normal of the face.
pub(super) fn flatten(geometry: &mut Geometry) {
    let old = std::mem::take(geometry);
    let corners: Vec<usize> = old.indices.iter().flatten().map(|&v| v as usize).collect();
    fn pick<T: Copy>(from: &[T], corners: &[usize]) -> Vec<T> {
        if from.is_empty() { Vec::new() } else { corners.iter().map(|&v| from[v]).collect() }
    }
    geometry.positions = pick(&old.positions, &corners);
    geometry.uvs = old.uvs.iter().map(|set| pick(set, &corners)).collect();
    geometry.colors = pick(&old.colors, &corners);
    geometry.color_alpha = old.color_alpha;
    geometry.indices = (0..old.indices.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    geometry.normals = geometry
        .positions
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|p| steradian_math::Vec3::from_array(*p));
            let n = (b - a).cross(c - a).try_normalize().unwrap_or(steradian_math::Vec3::new(0.0, 0.0, 1.0));
            [n.to_array(); 3]
        })
        .collect();
}
