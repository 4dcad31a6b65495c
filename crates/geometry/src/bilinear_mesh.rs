//! Meshes of bilinear patches (PBRT 4th ed., 6.6).

use steradian_math::{Normal3, Point2, Point3, Transform, Vec3};

use crate::curvature::weingarten;
use crate::mesh::validate;
use crate::{BilinearPatch, MeshError, Reference, ShapeSample, SurfaceHit};

/// Patches by indices into vertices, in the order 00, 10, 01, 11.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BilinearMesh {
    /// Vertex positions.
    pub positions: Vec<Point3>,
    /// Normals at the vertices, of any length; or none.
    pub normals: Vec<Normal3>,
    /// Texture coordinates at the vertices; or none, which stands for the patch coordinates.
    pub uvs: Vec<Point2>,
    /// Four vertices for each patch.
    pub indices: Vec<[u32; 4]>,
    /// Whether the geometric normal is opposite to `dpdu x dpdv`. Normals at vertices decide if there are any.
    pub flip: bool,
}

/// The rotation of `v` that takes unit vector `a` to unit vector `b`, which is not opposite to it.
fn rotate(v: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let h = a + b;
    v - h * (h.dot(v) / (1.0 + a.dot(b))) + b * (2.0 * a.dot(v))
}

/// How texture coordinates of a patch change: the inverses of their derivatives by u and v, one by one, which is the
/// inverse of the Jacobian where the axes match.
struct TextureScale {
    duds: f32,
    dudt: f32,
    dvds: f32,
    dvdt: f32,
}

impl TextureScale {
    fn new(uv: &[Point2; 4], u: f32, v: f32) -> Self {
        let [uv00, uv10, uv01, uv11] = *uv;
        let du = uv10.lerp(uv11, v) - uv00.lerp(uv01, v);
        let dv = uv01.lerp(uv11, u) - uv00.lerp(uv10, u);
        let inverse = |x: f32| if x.abs() < 1e-8 { 0.0 } else { 1.0 / x };
        Self { duds: inverse(du.x), dudt: inverse(du.y), dvds: inverse(dv.x), dvdt: inverse(dv.y) }
    }

    fn apply(&self, [du, dv]: [Vec3; 2]) -> [Vec3; 2] {
        [du * self.duds + dv * self.dvds, du * self.dudt + dv * self.dvdt]
    }
}

impl BilinearMesh {
    /// Checks that indices refer to vertices, that attributes are complete or absent, and that positions are finite.
    pub fn validate(&self) -> Result<(), MeshError> {
        let attributes = [("normals", self.normals.len()), ("uvs", self.uvs.len())];
        validate(&self.positions, &attributes, &self.indices)
    }

    /// The mesh in another space; orientation as in [`TriangleMesh::transformed`](crate::TriangleMesh::transformed).
    #[must_use]
    pub fn transformed(&self, t: &Transform, reverse_orientation: bool) -> Self {
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        let normal = |&n: &Normal3| t.normal(n).try_normalize().unwrap_or_default() * sign;
        Self {
            positions: self.positions.iter().map(|&p| t.point(p)).collect(),
            normals: self.normals.iter().map(normal).collect(),
            uvs: self.uvs.clone(),
            indices: self.indices.clone(),
            flip: self.flip ^ reverse_orientation ^ t.swaps_handedness(),
        }
    }

    /// Patch `i` by its corners.
    #[inline]
    pub fn patch(&self, i: usize) -> BilinearPatch {
        BilinearPatch { p: self.indices[i].map(|v| self.positions[v as usize]) }
    }

    fn face_uvs(&self, i: usize) -> Option<[Point2; 4]> {
        (!self.uvs.is_empty()).then(|| self.indices[i].map(|v| self.uvs[v as usize]))
    }

    /// The texture coordinates at patch coordinates `(u, v)` of patch `i`.
    pub fn uv(&self, i: usize, u: f32, v: f32) -> Point2 {
        self.face_uvs(i)
            .map_or(Point2::new(u, v), |[uv00, uv10, uv01, uv11]| uv00.lerp(uv01, v).lerp(uv10.lerp(uv11, v), u))
    }

    fn face_normals(&self, i: usize) -> Option<[Normal3; 4]> {
        (!self.normals.is_empty()).then(|| self.indices[i].map(|v| self.normals[v as usize]))
    }

    fn vertex_normal(&self, i: usize, u: f32, v: f32) -> Option<Normal3> {
        let [n00, n10, n01, n11] = self.face_normals(i)?;
        n00.lerp(n01, v).lerp(n10.lerp(n11, v), u).try_normalize()
    }

    fn orient(&self, n: Normal3, vertex_normal: Option<Normal3>) -> Normal3 {
        match vertex_normal {
            Some(ns) => n.face_forward(ns),
            None if self.flip && self.normals.is_empty() => -n,
            None => n,
        }
    }

    /// Everything about the point at patch coordinates `(u, v)` of patch `i`.
    pub fn interaction(&self, i: usize, u: f32, v: f32) -> SurfaceHit {
        let patch = self.patch(i);
        let (p, p_error) = patch.point(u, v);
        let [mut dpdu, mut dpdv] = patch.derivatives(u, v);
        let identity = TextureScale { duds: 1.0, dudt: 0.0, dvds: 0.0, dvdt: 1.0 };
        let scale = self.face_uvs(i).map_or(identity, |uv| TextureScale::new(&uv, u, v));
        let normal = dpdu.cross(dpdv);
        let dn = scale.apply(weingarten(dpdu, dpdv, Vec3::default(), patch.twist(), Vec3::default()));
        let [dpds, dpdt] = scale.apply([dpdu, dpdv]);
        if dpds.cross(dpdt) != Vec3::default() {
            (dpdu, dpdv) = (dpds, dpdt);
        }
        let mut hit = SurfaceHit::smooth(p, p_error, self.uv(i, u, v), [dpdu, dpdv], dn);
        // The texture may be mirrored; the surface is not.
        hit.n = normal.normalize().to_normal();
        hit.shading.n = hit.n;
        let vertex_normal = self.vertex_normal(i, u, v);
        if self.orient(hit.n, vertex_normal) != hit.n {
            hit = hit.flipped();
        }
        if let (Some(ns), Some([n00, n10, n01, n11])) = (vertex_normal, self.face_normals(i)) {
            let du = n10.lerp(n11, v) - n00.lerp(n01, v);
            let dv = n01.lerp(n11, u) - n00.lerp(n10, u);
            let [dndu, dndv] = scale.apply([du.to_vec(), dv.to_vec()]);
            let turn = |w: Vec3| rotate(w, hit.n.to_vec(), ns.to_vec());
            hit.shading = crate::Shading {
                n: ns,
                dpdu: turn(dpdu),
                dpdv: turn(dpdv),
                dndu: dndu.to_normal(),
                dndv: dndv.to_normal(),
            };
        }
        hit
    }

    fn finish(&self, i: usize, s: ShapeSample) -> ShapeSample {
        let (u, v) = (s.uv.x, s.uv.y);
        ShapeSample { n: self.orient(s.n, self.vertex_normal(i, u, v)), uv: self.uv(i, u, v), ..s }
    }

    /// A point of patch `i`; see [`BilinearPatch::sample_area`]. `pdf` is per area.
    pub fn sample_area(&self, i: usize, u: [f32; 2]) -> Option<ShapeSample> {
        Some(self.finish(i, self.patch(i).sample_area(u)?))
    }

    /// A point of patch `i` seen from `from`; see [`BilinearPatch::sample_solid_angle`]. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, i: usize, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        Some(self.finish(i, self.patch(i).sample_solid_angle(from, u)?))
    }
}
