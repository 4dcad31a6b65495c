//! Loop subdivision: a smooth surface from a coarse triangle mesh (Loop 1987; limit positions and tangents after Hoppe
//! et al. 1994; PBRT 3rd ed., 3.8).

use std::collections::BTreeMap;
use std::fmt;

use steradian_math::{PI, Point3, Vec3, cos, sin, sin_cos};

use crate::{MeshError, TriangleMesh};

/// Faces that a subdivision may end with.
const MAX_FACES: usize = 1 << 26;

const NONE: u32 = u32::MAX;

/// Why a mesh cannot be subdivided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubdivisionError {
    /// The mesh does not fit together.
    Mesh(MeshError),
    /// A face names a vertex twice.
    DegenerateFace {
        /// The face.
        face: usize,
    },
    /// Two faces run along an edge in the same direction: more than two faces share it, or they are turned differently.
    NotManifold {
        /// The second of the faces.
        face: usize,
        /// Where the edge starts.
        vertex: u32,
    },
    /// The result would have more than 2^26 faces.
    TooLarge {
        /// Faces at the start.
        faces: usize,
        /// Levels asked for.
        levels: u32,
    },
}

impl fmt::Display for SubdivisionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mesh(e) => e.fmt(f),
            Self::DegenerateFace { face } => write!(f, "face {face} names a vertex twice"),
            Self::NotManifold { face, vertex } => {
                write!(f, "face {face} shares an edge at vertex {vertex} with a face that is turned the same way")
            }
            Self::TooLarge { faces, levels } => write!(f, "{levels} levels of {faces} faces are too many"),
        }
    }
}

impl std::error::Error for SubdivisionError {}

impl From<MeshError> for SubdivisionError {
    fn from(e: MeshError) -> Self {
        Self::Mesh(e)
    }
}

const fn next(k: usize) -> usize {
    (k + 1) % 3
}

const fn previous(k: usize) -> usize {
    (k + 2) % 3
}

/// A triangle and its neighbours: `f[k]` lies across the edge from `v[k]` to `v[next(k)]`.
#[derive(Clone, Copy)]
struct Face {
    v: [u32; 3],
    f: [u32; 3],
}

impl Face {
    /// Which corner a vertex is.
    fn corner(&self, vertex: u32) -> usize {
        self.v.iter().position(|&v| v == vertex).unwrap_or(0)
    }

    /// The vertex that is neither.
    fn opposite(&self, a: u32, b: u32) -> u32 {
        self.v.into_iter().find(|&v| v != a && v != b).unwrap_or(a)
    }
}

#[derive(Clone, Copy)]
struct Vertex {
    p: Point3,
    /// A face that it belongs to; `NONE` if no face uses it.
    start: u32,
    boundary: bool,
}

struct Surface {
    vertices: Vec<Vertex>,
    faces: Vec<Face>,
}

impl Surface {
    fn new(positions: &[Point3], indices: &[[u32; 3]]) -> Result<Self, SubdivisionError> {
        crate::mesh::validate(positions, &[], indices)?;
        let mut vertices: Vec<_> = positions.iter().map(|&p| Vertex { p, start: NONE, boundary: false }).collect();
        let mut faces: Vec<_> = indices.iter().map(|&v| Face { v, f: [NONE; 3] }).collect();
        // Directed edges: of two neighbours that are turned alike, each runs along the edge in its own direction.
        let mut edges = BTreeMap::new();
        for (i, face) in faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (face.v[k], face.v[next(k)]);
                if a == b {
                    return Err(SubdivisionError::DegenerateFace { face: i });
                }
                if edges.insert((a, b), i as u32).is_some() {
                    return Err(SubdivisionError::NotManifold { face: i, vertex: a });
                }
                vertices[a as usize].start = i as u32;
            }
        }
        for face in &mut faces {
            face.f = std::array::from_fn(|k| edges.get(&(face.v[next(k)], face.v[k])).copied().unwrap_or(NONE));
        }
        let mut surface = Self { vertices, faces };
        for i in 0..surface.vertices.len() {
            surface.vertices[i].boundary = surface.is_boundary(i as u32);
        }
        Ok(surface)
    }

    fn next_face(&self, face: u32, vertex: u32) -> u32 {
        let f = &self.faces[face as usize];
        f.f[f.corner(vertex)]
    }

    fn previous_face(&self, face: u32, vertex: u32) -> u32 {
        let f = &self.faces[face as usize];
        f.f[previous(f.corner(vertex))]
    }

    fn is_boundary(&self, vertex: u32) -> bool {
        let start = self.vertices[vertex as usize].start;
        let mut face = start;
        while face != NONE {
            face = self.next_face(face, vertex);
            if face == start {
                return false;
            }
        }
        true
    }

    /// The neighbours of a vertex in order around it; on a boundary, from one end of it to the other.
    fn ring(&self, vertex: u32, ring: &mut Vec<Point3>) {
        ring.clear();
        let Vertex { start, boundary, .. } = self.vertices[vertex as usize];
        if start == NONE {
            return;
        }
        let p = |v: u32| self.vertices[v as usize].p;
        let mut face = start;
        if boundary {
            while self.next_face(face, vertex) != NONE {
                face = self.next_face(face, vertex);
            }
            let f = &self.faces[face as usize];
            ring.push(p(f.v[next(f.corner(vertex))]));
            while face != NONE {
                let f = &self.faces[face as usize];
                ring.push(p(f.v[previous(f.corner(vertex))]));
                face = self.previous_face(face, vertex);
            }
        } else {
            loop {
                let f = &self.faces[face as usize];
                ring.push(p(f.v[next(f.corner(vertex))]));
                face = self.next_face(face, vertex);
                if face == start {
                    break;
                }
            }
        }
    }

    /// A vertex moved towards its neighbours: by `inner(valence)` to each, or by `edge` to those along a boundary.
    fn weigh(&self, vertex: u32, inner: fn(usize) -> f32, edge: f32, ring: &mut Vec<Point3>) -> Point3 {
        self.ring(vertex, ring);
        let Vertex { p, boundary, .. } = self.vertices[vertex as usize];
        match ring.as_slice() {
            [] => p,
            [first, .., last] if boundary => p * (1.0 - 2.0 * edge) + (*first + *last) * edge,
            all => {
                let w = inner(all.len());
                all.iter().fold(p * (1.0 - all.len() as f32 * w), |sum, &q| sum + q * w)
            }
        }
    }

    /// Every face in four.
    fn refine(&self) -> Self {
        let mut ring = Vec::new();
        let mut vertices: Vec<Vertex> = (0..self.vertices.len() as u32)
            .map(|i| {
                let old = self.vertices[i as usize];
                let corner = if old.start == NONE { 0 } else { self.faces[old.start as usize].corner(i) };
                let start = if old.start == NONE { NONE } else { 4 * old.start + corner as u32 };
                Vertex { p: self.weigh(i, beta, 0.125, &mut ring), start, ..old }
            })
            .collect();
        // The vertex in the middle of each edge; the face of lower index makes it.
        let mut middle = vec![[NONE; 3]; self.faces.len()];
        for (i, face) in self.faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b, other) = (face.v[k], face.v[next(k)], face.f[k]);
                if other != NONE && (other as usize) < i {
                    middle[i][k] = middle[other as usize][self.faces[other as usize].corner(b)];
                    continue;
                }
                let at = |v: u32| self.vertices[v as usize].p;
                let boundary = other == NONE;
                let p = if boundary {
                    (at(a) + at(b)) * 0.5
                } else {
                    let sides = at(face.opposite(a, b)) + at(self.faces[other as usize].opposite(a, b));
                    (at(a) + at(b)) * 0.375 + sides * 0.125
                };
                middle[i][k] = vertices.len() as u32;
                vertices.push(Vertex { p, start: 4 * i as u32 + 3, boundary });
            }
        }
        // Child k keeps corner k; child 3 is the one in the middle.
        let mut faces = Vec::with_capacity(4 * self.faces.len());
        for (i, face) in self.faces.iter().enumerate() {
            let child = |k: usize| (4 * i + k) as u32;
            let across = |edge: usize, vertex: u32| match face.f[edge] {
                NONE => NONE,
                f => 4 * f + self.faces[f as usize].corner(vertex) as u32,
            };
            let m = middle[i];
            for k in 0..3 {
                let (mut v, mut f) = ([NONE; 3], [NONE; 3]);
                v[k] = face.v[k];
                v[next(k)] = m[k];
                v[previous(k)] = m[previous(k)];
                f[k] = across(k, face.v[k]);
                f[next(k)] = child(3);
                f[previous(k)] = across(previous(k), face.v[k]);
                faces.push(Face { v, f });
            }
            faces.push(Face { v: m, f: std::array::from_fn(|k| child(next(k))) });
        }
        Self { vertices, faces }
    }

    /// A vector along the normal of the limit surface, from two tangents.
    fn limit_normal(&self, vertex: u32, ring: &mut Vec<Point3>) -> Vec3 {
        self.ring(vertex, ring);
        let Vertex { p, boundary, .. } = self.vertices[vertex as usize];
        let n = ring.len();
        if n < 2 {
            return Vec3::default();
        }
        let r = |k: usize| ring[k].to_vec();
        let (s, t);
        if boundary {
            s = r(n - 1) - r(0);
            t = match n {
                2 => r(0) + r(1) - p.to_vec() * 2.0,
                3 => r(1) - p.to_vec(),
                4 => (r(1) + r(2)) * 2.0 - r(0) - r(3) - p.to_vec() * 2.0,
                _ => {
                    let theta = PI / (n - 1) as f32;
                    let ends = (r(0) + r(n - 1)) * sin(theta);
                    let c = 2.0 * cos(theta) - 2.0;
                    -(1..n - 1).fold(ends, |sum, k| sum + r(k) * (c * sin(k as f32 * theta)))
                }
            };
        } else {
            let (mut a, mut b) = (Vec3::default(), Vec3::default());
            for k in 0..n {
                let (sin, cos) = sin_cos(2.0 * PI * k as f32 / n as f32);
                a += r(k) * cos;
                b += r(k) * sin;
            }
            (s, t) = (a, b);
        }
        s.cross(t)
    }
}

/// Loop's weight of each neighbour, in Warren's form.
fn beta(valence: usize) -> f32 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f32) }
}

/// The weight of each neighbour in the limit position.
fn limit_weight(valence: usize) -> f32 {
    1.0 / (valence as f32 + 3.0 / (8.0 * beta(valence)))
}

/// The mesh after `levels` subdivisions, its vertices moved to the limit surface, with the limit surface's normals.
///
/// The normals point to the side from which the faces are seen in clockwise order. That is what the pbrt format means by
/// this shape, and decides which side is the inside of glass.
///
/// # Errors
/// If the mesh is not a surface with two sides, or the result would be very large.
pub fn loop_subdivide(
    positions: &[Point3],
    indices: &[[u32; 3]],
    levels: u32,
) -> Result<TriangleMesh, SubdivisionError> {
    let size = 4usize.checked_pow(levels).and_then(|n| n.checked_mul(indices.len().max(1)));
    if size.is_none_or(|n| n > MAX_FACES) {
        return Err(SubdivisionError::TooLarge { faces: indices.len(), levels });
    }
    let mut surface = Surface::new(positions, indices)?;
    for _ in 0..levels {
        surface = surface.refine();
    }
    let mut ring = Vec::new();
    let count = surface.vertices.len() as u32;
    let limit: Vec<Point3> = (0..count).map(|i| surface.weigh(i, limit_weight, 0.2, &mut ring)).collect();
    for (vertex, &p) in surface.vertices.iter_mut().zip(&limit) {
        vertex.p = p;
    }
    let normals = (0..count).map(|i| surface.limit_normal(i, &mut ring).to_normal()).collect();
    Ok(TriangleMesh {
        positions: limit,
        normals,
        indices: surface.faces.iter().map(|f| f.v).collect(),
        ..TriangleMesh::default()
    })
}
