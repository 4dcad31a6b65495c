//! Tangents where a mesh has none: MikkTSpace, as the specification demands, so that normal maps look as they were baked.

use super::meshes::Geometry;
use super::patches::Patches;
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

/// Some of the faces of a mesh.
struct Corners<'g> {
    geometry: &'g Geometry,
    set: usize,
    faces: &'g [u32],
    tangents: Vec<[[f32; 4]; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.geometry.indices[self.faces[face] as usize][vert] as usize
    }
}

impl bevy_mikktspace::Geometry<Portable> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
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
        self.tangents[face][vert] = space.map_or(NONE, |s| s.tangent_encoded());
    }
}

/// Where there is no telling.
const NONE: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

/// The tangents at the corners of some faces, as if there were no others.
fn tangents_of(geometry: &Geometry, set: usize, faces: &[u32]) -> Vec<[[f32; 4]; 3]> {
    let mut corners = Corners { geometry, set, faces, tangents: vec![[NONE; 3]; faces.len()] };
    // It fails on meshes of more corners than can be numbered; those keep the tangents they have.
    let _ = generate_tangents::<_, Portable>(&mut corners);
    corners.tangents
}

/// Gives a mesh tangents by its normals and its set of texture coordinates. Vertices where they differ from face to face are
/// doubled.
pub(super) fn generate(geometry: &mut Geometry, set: usize) {
    if geometry.normals.is_empty() {
        flatten(geometry);
    }
    let all = &*geometry;
    let tangents = Patches::new(all, set).each([NONE; 3], |faces| tangents_of(all, set, faces));
    let count = geometry.positions.len();
    // The copies of each vertex, chained.
    let mut given: Vec<Option<[f32; 4]>> = vec![None; count];
    let mut next: Vec<u32> = vec![u32::MAX; count];
    for face in 0..geometry.indices.len() {
        for corner in 0..3 {
            let tangent = tangents[face][corner];
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
    geometry.tangents = given.into_iter().map(|t| t.unwrap_or(NONE)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::sin_cos;

    /// A bent sheet of `n` by `n` squares with seams, mirrored stripes, and squares that are points in the texture.
    fn sheet(n: usize) -> Geometry {
        let mut g = Geometry { uvs: vec![Vec::new()], ..Geometry::default() };
        for y in 0..=n {
            for x in 0..=n {
                let (s, t) = (x as f32 / n as f32, y as f32 / n as f32);
                let (sin, cos) = sin_cos(7.0 * s + 3.0 * t);
                g.positions.push([s, 0.1 * sin, t]);
                g.normals.push([-0.5 * cos, 0.8, -0.1 * cos]);
                let u = if x % 17 == 0 { s.floor() } else { (5.0 * s).fract() };
                g.uvs[0].push(if (x / 9 + y / 9) % 23 == 0 { [0.25, 0.5] } else { [u, t * t] });
            }
        }
        for y in 0..n {
            for x in 0..n {
                let [a, b, c, d] =
                    [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| (y * (n + 1) + x) as u32);
                g.indices.extend([[a, b, c], [a, c, d]]);
            }
        }
        // An order in which neighbours are not always near.
        let count = g.indices.len();
        for i in 0..count / 64 {
            g.indices.swap(61 * i % count, 64 * i);
        }
        g
    }

    #[test]
    fn patches_give_the_tangents_of_the_whole() {
        let g = sheet(150);
        let all: Vec<u32> = (0..g.indices.len() as u32).collect();
        let patches = Patches::new(&g, 0);
        assert!(patches.count() > 2, "{}", patches.count());
        let found = patches.each([NONE; 3], |faces| tangents_of(&g, 0, faces));
        assert!(found == tangents_of(&g, 0, &all));
    }

    #[test]
    fn a_fan_of_many_faces_ends_soon_and_takes_no_stack() {
        let n = 100_000u32;
        let mut g = Geometry { uvs: vec![vec![[0.0; 2]]], positions: vec![[0.0; 3]], ..Geometry::default() };
        for i in 0..n {
            let (sin, cos) = sin_cos(i as f32 / n as f32 * std::f32::consts::TAU);
            g.positions.push([cos, 0.0, sin]);
            g.uvs[0].push([cos, sin]);
            g.indices.push([0, 1 + (i + 1) % n, 1 + i]);
        }
        g.normals = vec![[0.0, 1.0, 0.0]; g.positions.len()];
        generate(&mut g, 0);
        let along = |t: &[f32; 4]| t[0] > 0.99 && t[1] == 0.0;
        // Faces this thin may be none in single precision.
        let off = g.tangents.iter().filter(|t| !along(t)).count();
        assert!(off < 10, "{off} of {}", g.tangents.len());
    }
}
