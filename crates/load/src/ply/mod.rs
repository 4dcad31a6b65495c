//! PLY meshes (Turk 1994; the subset of pbrt-v4): text and binary of both byte orders, triangles and quadrilaterals.
//!
//! Quadrilaterals come back in the order of a bilinear patch, (0,0) (1,0) (0,1) (1,1), as pbrt-v4 makes them.

mod attributes;
mod body;
mod header;

pub(crate) use body::flat;
use steradian_math::{Normal3, Point2, Point3};

/// Why a PLY file cannot be used.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum PlyError {
    /// The first line is not `ply`.
    #[error("not a PLY file")]
    NotPly,
    /// The header breaks the rules.
    #[error("damaged PLY header: {0}")]
    Header(String),
    /// The header promises more than the file can hold.
    #[error(
        "damaged PLY file: the header promises {count} of element `{element}`, which take at least {need} bytes, but only {left} are left"
    )]
    Promise {
        /// The element.
        element: String,
        /// How many are promised.
        count: usize,
        /// Fewest bytes that they can take.
        need: u128,
        /// Bytes left.
        left: u128,
    },
    /// The data end early.
    #[error("truncated PLY file: it ends in element `{element}` number {index} of {count}")]
    Truncated {
        /// The element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// How many there should be.
        count: usize,
    },
    /// Something in a text file is not a number.
    #[error("damaged PLY file: element `{element}` number {index} has `{text}` where a number should be")]
    NotANumber {
        /// The element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// What stands there.
        text: String,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} of the PLY file has a coordinate that is not finite")]
    NotFinite {
        /// Which one, from 0.
        vertex: usize,
    },
    /// A face uses a vertex that does not exist.
    #[error("face {face} of the PLY file uses vertex {index}, but there are only {vertices}")]
    Index {
        /// Which face, from 0.
        face: usize,
        /// The index as written.
        index: i64,
        /// Number of vertices.
        vertices: usize,
    },
    /// Something that a mesh must have is not there.
    #[error("the PLY file has no {0}")]
    Missing(&'static str),
    /// More vertices than 32-bit indices can name.
    #[error("the PLY file has {0} vertices, more than 32-bit indices can name")]
    TooManyVertices(usize),
}

/// One or three properties with a common name: `name_0`, `name_1`, `name_2` or with x, y, z or r, g, b.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PlyAttribute {
    /// The name.
    pub name: String,
    /// Whether the values belong to faces.
    pub per_face: bool,
    /// Numbers of each vertex or face.
    pub width: usize,
    /// The numbers.
    pub values: Vec<f32>,
}

/// What a PLY file holds.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PlyMesh {
    /// Vertex positions.
    pub positions: Vec<Point3>,
    /// Vertex normals as in the file, or empty.
    pub normals: Vec<Normal3>,
    /// Texture coordinates, or empty.
    pub uvs: Vec<Point2>,
    /// Further properties of vertices and faces, for those who asked; faces are the triangles, then the quadrilaterals.
    pub attributes: Vec<PlyAttribute>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Bilinear patches: corners at (0,0), (1,0), (0,1), (1,1).
    pub quads: Vec<[u32; 4]>,
    /// Faces left out because they have no area.
    pub degenerate: usize,
    /// Faces left out because they have neither 3 nor 4 corners.
    pub other_faces: usize,
    /// Normals and texture coordinates that were not finite and were set to zero.
    pub not_finite: usize,
}

/// Reads a PLY file that is already in memory and not compressed.
///
/// # Errors
/// Any [`PlyError`]. Memory stays within a small multiple of the length of `bytes`, whatever the header says.
pub fn parse(bytes: &[u8]) -> Result<PlyMesh, PlyError> {
    body::read(bytes, &header::parse(bytes)?, false)
}

/// As [`parse`], with properties that are neither positions, normals nor texture coordinates.
pub(crate) fn parse_with_attributes(bytes: &[u8]) -> Result<PlyMesh, PlyError> {
    body::read(bytes, &header::parse(bytes)?, true)
}

#[cfg(test)]
mod tests;
