//! Triangle meshes: shared vertices, and what is interpolated between them (PBRT 4th ed., 6.5.1 and 6.5.3).

use std::fmt;

use steradian_math::{Frame, Normal3, Point2, Point3, Transform, Vec3, difference_of_products};

use crate::{Reference, Shading, ShapeSample, SurfaceHit, Triangle};

/// Triangles by indices into vertices. Plain data; [`TriangleMesh::validate`] says whether it fits together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Point3>,
    /// Normals at the vertices, of any length; or none.
    pub normals: Vec<Normal3>,
    /// Tangents at the vertices, along which `dpdu` of the scattering frame points; or none.
    pub tangents: Vec<Vec3>,
    /// Texture coordinates at the vertices; or none, which stands for (0,0), (1,0), (1,1) in each triangle.
    pub uvs: Vec<Point2>,
    /// Further sets of texture coordinates, each as long as the positions.
    pub more_uvs: Vec<Vec<Point2>>,
    /// Red, green, blue and opacity at the vertices; or none, which is white.
    pub colors: Vec<[f32; 4]>,
    /// Further quantities by name.
    pub attributes: Vec<MeshAttribute>,
    /// Three vertices for each triangle.
    pub indices: Vec<[u32; 3]>,
    /// Whether the geometric normal is opposite to `(p1 - p0) x (p2 - p0)`. Normals at vertices decide if there are any.
    pub flip: bool,
}

/// A named quantity of one or three numbers at each vertex, or of each face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshAttribute {
    /// The name that textures ask for.
    pub name: String,
    /// Whether the values belong to faces.
    pub per_face: bool,
    /// Numbers of each vertex or face: 1 or 3.
    pub width: usize,
    /// The numbers, one vertex or face after the other.
    pub values: Vec<f32>,
}

/// What does not fit together in a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshError {
    /// A face refers to a vertex that does not exist.
    BadIndex {
        /// The face.
        face: usize,
        /// The vertex.
        index: u32,
    },
    /// A list of vertex attributes is not as long as the list of positions.
    BadLength {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of positions.
        expected: usize,
    },
    /// A position is not finite.
    NotFinite {
        /// The vertex.
        index: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadIndex { face, index } => write!(f, "face {face} refers to vertex {index}, which does not exist"),
            Self::BadLength { what, found, expected } => write!(f, "{found} {what} for {expected} vertices"),
            Self::NotFinite { index } => write!(f, "vertex {index} is not finite"),
        }
    }
}

impl std::error::Error for MeshError {}

/// Checks what all meshes have in common.
pub(crate) fn validate<const N: usize>(
    positions: &[Point3],
    attributes: &[(&'static str, usize)],
    indices: &[[u32; N]],
) -> Result<(), MeshError> {
    let expected = positions.len();
    for &(what, found) in attributes {
        if found != 0 && found != expected {
            return Err(MeshError::BadLength { what, found, expected });
        }
    }
    if let Some(index) = positions.iter().position(|p| !p.is_finite()) {
        return Err(MeshError::NotFinite { index });
    }
    for (face, corners) in indices.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= expected) {
            return Err(MeshError::BadIndex { face, index });
        }
    }
    Ok(())
}

/// Derivatives with respect to texture coordinates of a quantity linear over a triangle, from its differences to the
/// third vertex. `None` if the coordinates are degenerate.
fn derivatives(uv: &[Point2; 3], d02: Vec3, d12: Vec3) -> Option<[Vec3; 2]> {
    let (duv02, duv12) = (uv[0] - uv[2], uv[1] - uv[2]);
    let det = difference_of_products(duv02.x, duv12.y, duv02.y, duv12.x);
    if det.abs() < 1e-9 {
        return None;
    }
    let combine = |a: f32, b: f32| {
        let c = |i: usize| difference_of_products(a, d02[i], b, d12[i]) / det;
        Vec3::new(c(0), c(1), c(2))
    };
    Some([combine(duv12.y, duv02.y), -combine(duv12.x, duv02.x)])
}

impl TriangleMesh {
    /// Checks that indices refer to vertices, that attributes are complete or absent, and that positions are finite.
    pub fn validate(&self) -> Result<(), MeshError> {
        let mut attributes = vec![
            ("normals", self.normals.len()),
            ("tangents", self.tangents.len()),
            ("uvs", self.uvs.len()),
            ("colors", self.colors.len()),
        ];
        attributes.extend(self.more_uvs.iter().map(|set| ("further uvs", set.len())));
        for a in &self.attributes {
            let (expected, found) =
                (if a.per_face { self.indices.len() } else { self.positions.len() }, a.values.len());
            if !matches!(a.width, 1 | 3) || found != a.width * expected {
                return Err(MeshError::BadLength { what: "values of an attribute", found, expected });
            }
        }
        validate(&self.positions, &attributes, &self.indices)
    }

    /// The mesh in another space.
    ///
    /// As in the pbrt format, `reverse_orientation` negates normals, those at vertices too, while a transform that swaps
    /// handedness turns over the geometric normal only where no normals are given.
    #[must_use]
    pub fn transformed(&self, t: &Transform, reverse_orientation: bool) -> Self {
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        let normal = |&n: &Normal3| t.normal(n).try_normalize().unwrap_or_default() * sign;
        Self {
            positions: self.positions.iter().map(|&p| t.point(p)).collect(),
            normals: self.normals.iter().map(normal).collect(),
            tangents: self.tangents.iter().map(|&s| t.vector(s)).collect(),
            uvs: self.uvs.clone(),
            more_uvs: self.more_uvs.clone(),
            colors: self.colors.clone(),
            attributes: self.attributes.clone(),
            indices: self.indices.clone(),
            flip: self.flip ^ reverse_orientation ^ t.swaps_handedness(),
        }
    }

    /// Face `i` by its vertices.
    #[inline]
    pub fn triangle(&self, i: usize) -> Triangle {
        Triangle { p: self.indices[i].map(|v| self.positions[v as usize]) }
    }

    /// The texture coordinates at the vertices of face `i`.
    #[inline]
    pub fn face_uvs(&self, i: usize) -> [Point2; 3] {
        self.corner_uvs(self.indices[i])
    }

    #[inline]
    fn corner_uvs(&self, corners: [u32; 3]) -> [Point2; 3] {
        if self.uvs.is_empty() {
            [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(1.0, 1.0)]
        } else {
            corners.map(|v| self.uvs[v as usize])
        }
    }

    /// The texture coordinates at barycentric `b1`, `b2` of face `i`.
    #[inline]
    pub fn uv(&self, i: usize, b1: f32, b2: f32) -> Point2 {
        self.uv_between(self.indices[i], b1, b2)
    }

    /// The texture coordinates at barycentric `b1`, `b2` between three vertices, which are those of a face.
    #[inline]
    pub fn uv_between(&self, corners: [u32; 3], b1: f32, b2: f32) -> Point2 {
        let uv = self.corner_uvs(corners);
        uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2
    }

    /// The texture coordinates of a set at barycentric `b1`, `b2` of face `i`; set 0 is `uvs`. The origin if there is no such
    /// set.
    pub fn uv_of_set(&self, set: usize, i: usize, b1: f32, b2: f32) -> Point2 {
        if set == 0 {
            return self.uv(i, b1, b2);
        }
        let Some(uvs) = self.more_uvs.get(set - 1).filter(|u| !u.is_empty()) else { return Point2::default() };
        let uv = self.indices[i].map(|v| uvs[v as usize]);
        uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2
    }

    /// Red, green, blue and opacity at barycentric `b1`, `b2` of face `i`.
    pub fn color(&self, i: usize, b1: f32, b2: f32) -> [f32; 4] {
        if self.colors.is_empty() {
            return [1.0; 4];
        }
        let [c0, c1, c2] = self.indices[i].map(|v| self.colors[v as usize]);
        std::array::from_fn(|k| c0[k] * (1.0 - b1 - b2) + c1[k] * b1 + c2[k] * b2)
    }

    /// An attribute at barycentric `b1`, `b2` of face `i`, one number repeated; `None` if the mesh has no such attribute.
    pub fn attribute(&self, name: &str, i: usize, b1: f32, b2: f32) -> Option<[f32; 3]> {
        let a = self.attributes.iter().find(|a| a.name == name)?;
        let of = |at: usize| -> [f32; 3] { std::array::from_fn(|k| a.values[at * a.width + k % a.width]) };
        if a.per_face {
            return Some(of(i));
        }
        let [v0, v1, v2] = self.indices[i].map(|v| of(v as usize));
        Some(std::array::from_fn(|k| v0[k] * (1.0 - b1 - b2) + v1[k] * b1 + v2[k] * b2))
    }

    /// The interpolated normal, not of unit length; `None` if there are none, or they cancel.
    fn vertex_normal(&self, i: usize, b1: f32, b2: f32) -> Option<Normal3> {
        if self.normals.is_empty() {
            return None;
        }
        let [n0, n1, n2] = self.indices[i].map(|v| self.normals[v as usize]);
        let n = n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2;
        (n.length_squared() > 0.0).then_some(n)
    }

    /// The unit geometric normal `n`, on the side that counts as outside at this point.
    fn orient(&self, n: Normal3, vertex_normal: Option<Normal3>) -> Normal3 {
        match vertex_normal {
            Some(ns) => n.face_forward(ns),
            None if self.flip && self.normals.is_empty() => -n,
            None => n,
        }
    }

    /// As [`TriangleMesh::interaction`], without tangents and derivatives, which are null: enough for surfaces that look the
    /// same whichever way they are turned.
    #[inline]
    pub fn isotropic_interaction(&self, i: usize, b1: f32, b2: f32) -> SurfaceHit {
        let triangle = self.triangle(i);
        let (p, p_error) = triangle.point(b1, b2);
        let vertex_normal = self.vertex_normal(i, b1, b2);
        let n = self.orient(triangle.normal(), vertex_normal);
        let ns = vertex_normal.and_then(Normal3::try_normalize).unwrap_or(n);
        SurfaceHit {
            p,
            p_error,
            n,
            uv: self.uv(i, b1, b2),
            shading: Shading { n: ns, ..Shading::default() },
            ..SurfaceHit::default()
        }
    }

    /// The derivatives of position with respect to texture coordinates on face `i`, which must have an area; any tangents where
    /// there are no such coordinates.
    pub fn position_derivatives(&self, i: usize) -> [Vec3; 2] {
        let triangle = self.triangle(i);
        let [p0, p1, p2] = triangle.p;
        derivatives(&self.face_uvs(i), p0 - p2, p1 - p2)
            .filter(|[u, v]| u.cross(*v).length_squared() > 0.0)
            .unwrap_or_else(|| {
                let frame = Frame::from_z(triangle.normal());
                [frame.x, frame.y]
            })
    }

    /// Everything about the point with barycentric coordinates `b1`, `b2` of face `i`, which must have an area.
    pub fn interaction(&self, i: usize, b1: f32, b2: f32) -> SurfaceHit {
        let triangle = self.triangle(i);
        let uvs = self.face_uvs(i);
        let n = triangle.normal();
        let [dpdu, dpdv] = self.position_derivatives(i);
        let (p, p_error) = triangle.point(b1, b2);
        let vertex_normal = self.vertex_normal(i, b1, b2);
        let n = self.orient(n, vertex_normal);
        let mut hit = SurfaceHit {
            p,
            p_error,
            n,
            uv: uvs[0] * (1.0 - b1 - b2) + uvs[1] * b1 + uvs[2] * b2,
            dpdu,
            dpdv,
            shading: Shading { n, dpdu, dpdv, ..Shading::default() },
        };
        if !self.normals.is_empty() || !self.tangents.is_empty() {
            hit.shading = self.shading(i, b1, b2, &hit, vertex_normal, &uvs);
        }
        hit
    }

    fn shading(
        &self,
        i: usize,
        b1: f32,
        b2: f32,
        hit: &SurfaceHit,
        vertex_normal: Option<Normal3>,
        uvs: &[Point2; 3],
    ) -> Shading {
        let n = vertex_normal.and_then(Normal3::try_normalize).unwrap_or(hit.n);
        let mut s = hit.dpdu;
        if !self.tangents.is_empty() {
            let [s0, s1, s2] = self.indices[i].map(|v| self.tangents[v as usize]);
            let t = s0 * (1.0 - b1 - b2) + s1 * b1 + s2 * b2;
            if t.length_squared() > 0.0 {
                s = t;
            }
        }
        let t = n.cross(s);
        let (dpdu, dpdv) = if t.length_squared() > 0.0 {
            (t.cross(n), t)
        } else {
            let frame = Frame::from_z(n);
            (frame.x, frame.y)
        };
        let [dndu, dndv] = self.normal_derivatives(i, uvs);
        Shading { n, dpdu, dpdv, dndu: dndu.to_normal(), dndv: dndv.to_normal() }
    }

    fn normal_derivatives(&self, i: usize, uvs: &[Point2; 3]) -> [Vec3; 2] {
        if self.normals.is_empty() {
            return [Vec3::default(); 2];
        }
        let [n0, n1, n2] = self.indices[i].map(|v| self.normals[v as usize].to_vec());
        derivatives(uvs, n0 - n2, n1 - n2).unwrap_or_else(|| {
            // Without coordinates, any frame around the change of the normal, as for the position.
            let dn = (n2 - n0).cross(n1 - n0);
            dn.try_normalize().map_or([Vec3::default(); 2], |z| {
                let frame = Frame::from_z(z);
                [frame.x, frame.y]
            })
        })
    }

    /// A sample of a face, from the triangle's own coordinates to texture coordinates and the mesh's outside.
    fn finish(&self, i: usize, s: ShapeSample) -> ShapeSample {
        let (b1, b2) = (s.uv.x, s.uv.y);
        ShapeSample { n: self.orient(s.n, self.vertex_normal(i, b1, b2)), uv: self.uv(i, b1, b2), ..s }
    }

    /// A uniform point of face `i`. `pdf` is per area.
    pub fn sample_area(&self, i: usize, u: [f32; 2]) -> Option<ShapeSample> {
        Some(self.finish(i, self.triangle(i).sample_area(u)?))
    }

    /// A point of face `i` seen from `from`; see [`Triangle::sample_solid_angle`]. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, i: usize, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        Some(self.finish(i, self.triangle(i).sample_solid_angle(from, u)?))
    }
}
