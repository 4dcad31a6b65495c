//! Shapes of Mitsuba scenes, and the meshes that they read.

use super::Mitsuba;
use super::tree::{Object, Value};
use crate::files::read_all;
use crate::ply;
use std::io::Read;
use steradian_geometry::{Curve, CurveProfile, Cylinder, Disk, MeshAttribute, Sphere, TriangleMesh};
use steradian_math::{Frame, Normal3, Point2, Point3, Transform, Vec3, safe_acos};
use steradian_scene::{AreaLight, Handle, Instance, Primitive, Shape};

impl Mitsuba<'_> {
    /// Adds a shape to the scene, or to a group.
    pub(super) fn shape(&mut self, index: usize, o: &Object, group: Option<Handle<steradian_scene::Object>>) {
        let world = self.transform(o, "to_world");
        match o.kind.as_str() {
            "shapegroup" => {
                self.group(index, o);
                return;
            }
            // It only makes the tree of rays smaller.
            "merge" => {
                for (_, i) in self.children(&o.children) {
                    let inner = self.object(i);
                    // No shape contains itself but by a reference, and those to what is being read have no object yet.
                    if inner.class == "shape" && i < index {
                        self.shape(i, &inner, group);
                    }
                }
                self.finish(o);
                return;
            }
            "instance" => {
                let inner = self.child(o, "shape");
                let Some(object) = inner.and_then(|i| {
                    self.objects.get(&i).copied().or_else(|| {
                        let g = self.object(i);
                        self.group(i, &g)
                    })
                }) else {
                    self.error("an instance needs a shape group", o.span);
                    return;
                };
                self.finish(o);
                let instance = Instance { object, world_from_object: world.into() };
                match group {
                    Some(g) => self.scene.objects[g].instances.push(instance),
                    None => self.scene.instances.push(instance),
                }
                return;
            }
            _ => {}
        }
        let flip = self.flag(o, "flip_normals", false);
        let Some((shape, local)) = self.geometry(o, &world) else { return };
        let bsdf = self.child(o, "bsdf");
        let (material, alpha) = self.worn(bsdf);
        let area_light = self.child(o, "emitter").and_then(|e| {
            let e = self.object(e);
            self.area_light(&e)
        });
        let media = self.media_of(o);
        self.finish(o);
        let primitive = Primitive {
            shape,
            world_from_object: world.mul(&local),
            reverse_orientation: flip,
            material,
            area_light,
            alpha,
            media,
        };
        // A transform that swaps handedness turns over what has no normals of its own, but not so in Mitsuba.
        let has_normals = match &primitive.shape {
            Shape::Triangles(m) => !self.scene.triangle_meshes[*m].normals.is_empty(),
            _ => false,
        };
        let primitive = Primitive {
            reverse_orientation: flip ^ (!has_normals && primitive.world_from_object.swaps_handedness()),
            ..primitive
        };
        match group {
            Some(g) => self.scene.objects[g].primitives.push(primitive),
            None => self.scene.primitives.push(primitive),
        }
    }

    fn group(&mut self, index: usize, o: &Object) -> Option<Handle<steradian_scene::Object>> {
        if let Some(h) = self.objects.get(&index) {
            return Some(*h);
        }
        if o.kind != "shapegroup" {
            return None;
        }
        let handle = self.scene.objects.push(steradian_scene::Object::default());
        self.objects.insert(index, handle);
        for (_, i) in self.children(&o.children) {
            let inner = self.object(i);
            if inner.class == "shape" {
                self.shape(i, &inner, Some(handle));
            }
        }
        Some(handle)
    }

    pub(super) fn transform(&mut self, o: &Object, name: &str) -> Transform {
        match o.get(name).map(|p| (p.value.clone(), p.span)) {
            Some((Value::Transform(t), _)) => t,
            Some((_, span)) => {
                self.error(format!("`{name}` must be a transform"), span);
                Transform::IDENTITY
            }
            None => Transform::IDENTITY,
        }
    }

    pub(super) fn vector(&mut self, o: &Object, name: &str) -> Option<Vec3> {
        let p = o.get(name)?;
        match p.value {
            Value::Vector(v) => Some(Vec3::from_array(v)),
            _ => {
                let span = p.span;
                self.error(format!("`{name}` must be three numbers"), span);
                None
            }
        }
    }

    /// The shape, and a transform of its own.
    fn geometry(&mut self, o: &Object, world: &Transform) -> Option<(Shape, Transform)> {
        let identity = Transform::IDENTITY;
        let whole = 360.0;
        match o.kind.as_str() {
            "sphere" => {
                let radius = self.float(o, "radius", 1.0);
                let center = self.vector(o, "center").unwrap_or_default();
                let sphere = Sphere::new(radius, -radius, radius, whole);
                let Some(sphere) = sphere else {
                    self.error("a sphere needs a positive radius", o.span);
                    return None;
                };
                // v runs from +z to -z: upside down.
                let local = Transform::translate(center).mul(&Transform::scale(1.0, 1.0, -1.0)?);
                Some((Shape::Sphere(sphere), local))
            }
            "disk" => Some((Shape::Disk(Disk::new(0.0, 1.0, 0.0, whole)?.radial()), identity)),
            "cylinder" => {
                let radius = self.float(o, "radius", 1.0);
                let p0 = self.vector(o, "p0").unwrap_or_default();
                let p1 = self.vector(o, "p1").unwrap_or(Vec3::new(0.0, 0.0, 1.0));
                let axis = p1 - p0;
                let cylinder = Cylinder::new(radius, 0.0, axis.length(), whole);
                let (Some(cylinder), Some(z)) = (cylinder, axis.try_normalize()) else {
                    self.error("a cylinder needs a radius and a length", o.span);
                    return None;
                };
                let f = Frame::from_z(z);
                let row = |i: usize| [f.x[i], f.y[i], f.z[i], p0[i]];
                let t = Transform::from_matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]);
                Some((Shape::Cylinder(cylinder), t?))
            }
            "rectangle" => Some((self.push_mesh(rectangle()), identity)),
            "cube" => Some((self.push_mesh(cube()), identity)),
            "sdfgrid" => Some((self.distances(o)?, identity)),
            "linearcurve" | "bsplinecurve" => Some((self.curves(o)?, identity)),
            "obj" | "ply" | "serialized" => {
                let mesh = self.mesh(o, world)?;
                Some((self.push_mesh(mesh), identity))
            }
            _ => {
                self.not_built(o);
                None
            }
        }
    }

    /// Tubes along control points and their radii, one to a line; an empty line ends a curve.
    fn curves(&mut self, o: &Object) -> Option<Shape> {
        let Some(name) = self.text(o, "filename") else {
            self.error(format!("the shape `{}` needs a `filename`", o.kind), o.span);
            return None;
        };
        o.get("silhouette_discontinuities");
        let read = self.reader.resolve(&name).and_then(|p| read_all(self.files, &p));
        let straight = o.kind == "linearcurve";
        let curves = read
            .and_then(|bytes| tubes(&String::from_utf8_lossy(&bytes), straight).map_err(|m| format!("{name}: {m}")));
        if straight {
            self.note_once("joints of linear curves are not rounded", o.span);
        }
        curves.map(Shape::Curves).map_err(|m| self.error(m, o.span)).ok()
    }

    fn push_mesh(&mut self, mesh: TriangleMesh) -> Shape {
        Shape::Triangles(self.scene.triangle_meshes.push(mesh))
    }

    fn mesh(&mut self, o: &Object, world: &Transform) -> Option<TriangleMesh> {
        let Some(name) = self.text(o, "filename") else {
            self.error(format!("the shape `{}` needs a `filename`", o.kind), o.span);
            return None;
        };
        let flip_v = self.flag(o, "flip_tex_coords", o.kind == "obj");
        let flat = self.flag(o, "face_normals", false);
        let which = self.count(o, "shape_index", 0);
        let read = self.reader.resolve(&name).and_then(|p| read_all(self.files, &p));
        let read = read.and_then(|bytes| {
            let mesh = match o.kind.as_str() {
                "obj" => obj(&bytes),
                "ply" => from_ply(&bytes),
                _ => serialized(&bytes, which as usize),
            };
            mesh.map_err(|m| format!("{name}: {m}"))
        });
        let mut mesh = read.map_err(|m| self.error(m, o.span)).ok()?;
        if flat {
            mesh.normals = Vec::new();
        } else if mesh.normals.is_empty() {
            mesh.normals = smooth_normals(&mesh, world);
        }
        if flip_v {
            mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
        }
        Some(mesh)
    }

    pub(super) fn area_light(&mut self, e: &Object) -> Option<AreaLight> {
        if e.kind != "area" {
            self.not_built(e);
            return None;
        }
        let (radiance, scale, texture) = self.emission(e, "radiance");
        self.finish(e);
        Some(AreaLight { radiance, scale, two_sided: false, power: None, image: None, texture, group: None })
    }
}

/// The curves of a file: straight pieces, or those of uniform cubic B-splines.
fn tubes(text: &str, straight: bool) -> Result<Vec<Curve>, String> {
    let mut strands: Vec<Vec<(Point3, f32)>> = vec![Vec::new()];
    for (n, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if words.is_empty() {
            strands.push(Vec::new());
            continue;
        }
        let numbers: Option<Vec<f32>> = words.iter().map(|w| w.parse().ok().filter(|v: &f32| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[x, y, z, r]) if r >= 0.0 => {
                strands.last_mut().into_iter().for_each(|s| s.push((Point3::new(x, y, z), r)));
            }
            _ => return Err(format!("line {}: not three coordinates and a radius", n + 1)),
        }
    }
    let least = if straight { 2 } else { 4 };
    let mut out = Vec::new();
    for strand in strands.iter().filter(|s| !s.is_empty()) {
        if strand.len() < least {
            return Err(format!("a curve of {} points; it takes {least}", strand.len()));
        }
        for w in strand.windows(least) {
            let p: Vec<Point3> = w.iter().map(|v| v.0).collect();
            let (control, width) = if straight {
                ([p[0], p[0].lerp(p[1], 1.0 / 3.0), p[0].lerp(p[1], 2.0 / 3.0), p[1]], [w[0].1, w[1].1])
            } else {
                // A radius is a spline as well; at the joints it is a mean of three.
                let radius = |a: f32, b: f32, c: f32| (a + 4.0 * b + c) / 6.0;
                let width = [radius(w[0].1, w[1].1, w[2].1), radius(w[1].1, w[2].1, w[3].1)];
                (crate::pbrt::b_spline([p[0], p[1], p[2], p[3]]), width)
            };
            // Segments without length show nothing.
            out.extend(Curve::new(control, width.map(|r| 2.0 * r), CurveProfile::Cylinder));
        }
    }
    if out.is_empty() { Err("no curves".into()) } else { Ok(out) }
}

fn rectangle() -> TriangleMesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    TriangleMesh {
        positions: corners.iter().map(|&(x, y)| Point3::new(x, y, 0.0)).collect(),
        normals: vec![Normal3::new(0.0, 0.0, 1.0); 4],
        uvs: corners.iter().map(|&(x, y)| Point2::new((x + 1.0) / 2.0, (y + 1.0) / 2.0)).collect(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// Six squares from -1 to 1, each with the whole of the texture.
fn cube() -> TriangleMesh {
    // By bits: the signs of x, y and z.
    const CORNERS: [[u32; 4]; 6] = [[1, 5, 4, 0], [3, 2, 6, 7], [1, 3, 7, 5], [5, 7, 6, 4], [4, 6, 2, 0], [3, 1, 0, 2]];
    const UVS: [(f32, f32); 4] = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)];
    let mut mesh = TriangleMesh::default();
    for side in CORNERS {
        let p = side.map(|c| {
            let sign = |bit: u32| if c >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Point3::new(sign(0), sign(1), sign(2))
        });
        let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize().to_normal();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(p);
        mesh.normals.extend([n; 4]);
        mesh.uvs.extend(UVS.map(|(u, v)| Point2::new(u, v)));
        mesh.indices.extend([[first, first + 1, first + 2], [first + 3, first, first + 2]]);
    }
    mesh
}

/// Normals of a mesh that has none: those of the faces, weighted by their angles in world space (Thuermer and Wuethrich 1998).
fn smooth_normals(mesh: &TriangleMesh, world: &Transform) -> Vec<Normal3> {
    let p: Vec<Point3> = mesh.positions.iter().map(|&p| world.point(p)).collect();
    let mut sums = vec![Vec3::default(); p.len()];
    for &face in &mesh.indices {
        let corners = face.map(|i| p[i as usize]);
        let Some(n) = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize() else { continue };
        for k in 0..3 {
            let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
            let (Some(a), Some(b)) = (a.try_normalize(), b.try_normalize()) else { continue };
            sums[face[k] as usize] += n * safe_acos(a.dot(b));
        }
    }
    // The way back, so that the normals are right after the mesh is put in its place.
    let back = world.inverse();
    let up = Vec3::new(0.0, 0.0, 1.0);
    sums.iter().map(|n| back.normal(n.try_normalize().unwrap_or(up).to_normal())).collect()
}

fn from_ply(bytes: &[u8]) -> Result<TriangleMesh, String> {
    let mut m = ply::parse_with_attributes(bytes).map_err(|e| e.to_string())?;
    // A face of four corners is two triangles, and both have what the face has.
    let (triangles, quads) = (m.triangles.len(), m.quads.len());
    for a in m.attributes.iter_mut().filter(|a| a.per_face) {
        let w = a.width;
        for q in (0..quads).rev() {
            let at = (triangles + q) * w;
            let row = a.values[at..at + w].to_vec();
            a.values.splice(at..at, row);
        }
    }
    let attributes = m.attributes.into_iter();
    let attributes = attributes
        .map(|a| MeshAttribute { name: a.name, per_face: a.per_face, width: a.width, values: a.values })
        .collect();
    m.triangles.extend(m.quads.iter().flat_map(|&[a, b, c, d]| [[a, b, d], [a, d, c]]));
    Ok(TriangleMesh {
        positions: m.positions,
        normals: m.normals,
        uvs: m.uvs,
        attributes,
        indices: m.triangles,
        ..TriangleMesh::default()
    })
}

/// All groups of an OBJ file as one mesh, without materials.
fn obj(bytes: &[u8]) -> Result<TriangleMesh, String> {
    let settings = tobj::LoadOptions { triangulate: true, single_index: true, ..tobj::LoadOptions::default() };
    let mut text = bytes;
    let (models, _) = tobj::load_obj_buf(&mut text, &settings, |_| Ok(Default::default()))
        .map_err(|e| format!("damaged OBJ file: {e}"))?;
    let mut out = TriangleMesh::default();
    let (mut with_normals, mut with_uvs) = (true, true);
    for model in models {
        let m = crate::model::obj_mesh(model.mesh)?;
        let first = out.positions.len() as u32;
        with_normals &= !m.normals.is_empty();
        with_uvs &= !m.uvs.is_empty();
        out.positions.extend(m.positions);
        out.normals.extend(m.normals);
        out.uvs.extend(m.uvs);
        out.indices.extend(m.indices.iter().map(|f| f.map(|i| first + i)));
    }
    if !with_normals {
        out.normals = Vec::new();
    }
    if !with_uvs {
        out.uvs = Vec::new();
    }
    Ok(out)
}

/// Mitsuba's own format: meshes one after the other, each compressed, and a table of where they begin.
fn serialized(bytes: &[u8], which: usize) -> Result<TriangleMesh, String> {
    let word = |at: usize, n: usize| -> Result<u64, String> {
        let b = bytes.get(at..at.wrapping_add(n)).ok_or("truncated file")?;
        Ok(b.iter().rev().fold(0u64, |v, &b| v << 8 | u64::from(b)))
    };
    if word(0, 2)? != 0x041c {
        return Err("not a serialized mesh".into());
    }
    let version = word(2, 2)?;
    let size = if version >= 4 { 8 } else { 4 };
    let end = bytes.len();
    let count = word(end.checked_sub(4).ok_or("truncated file")?, 4)? as usize;
    if which >= count {
        return Err(format!("shape {which} of a file that has {count}"));
    }
    let table = count.checked_mul(size).and_then(|n| end.checked_sub(4 + n)).ok_or("truncated table")?;
    let start = word(table + which * size, size)? as usize;
    let data = bytes.get(start.saturating_add(4)..).ok_or("truncated file")?;
    let mut plain = Vec::new();
    let mut reader = flate2::read::ZlibDecoder::new(data).take(crate::files::MOST_DECOMPRESSED);
    reader.read_to_end(&mut plain).map_err(|_| "damaged compressed data".to_string())?;
    Serialized { bytes: &plain, at: 0 }.mesh(version)
}

/// A cursor over unpacked bytes.
struct Serialized<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl Serialized<'_> {
    fn take(&mut self, n: usize) -> Result<&[u8], String> {
        let end = self.at.checked_add(n).ok_or("truncated mesh")?;
        let b = self.bytes.get(self.at..end).ok_or("truncated mesh")?;
        self.at = end;
        Ok(b)
    }

    fn whole(&mut self) -> Result<u64, String> {
        Ok(self.take(8)?.iter().rev().fold(0u64, |v, &b| v << 8 | u64::from(b)))
    }

    fn floats(&mut self, n: usize, double: bool) -> Result<Vec<f32>, String> {
        let size = if double { 8 } else { 4 };
        let b = self.take(n.checked_mul(size).ok_or("truncated mesh")?)?;
        let value = |c: &[u8]| {
            if double {
                f64::from_le_bytes([c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]]) as f32
            } else {
                f32::from_le_bytes([c[0], c[1], c[2], c[3]])
            }
        };
        Ok(b.chunks_exact(size).map(value).collect())
    }

    fn mesh(&mut self, version: u64) -> Result<TriangleMesh, String> {
        let flags = self.take(4)?.iter().rev().fold(0u32, |v, &b| v << 8 | u32::from(b));
        if version >= 4 {
            // A name that ends with zero.
            while self.take(1)?[0] != 0 {}
        }
        let (vertices, faces) = (self.whole()? as usize, self.whole()? as usize);
        let double = flags & 0x2000 != 0;
        let n3 = vertices.checked_mul(3).ok_or("truncated mesh")?;
        let positions = self.floats(n3, double)?;
        let normals = if flags & 1 != 0 { self.floats(n3, double)? } else { Vec::new() };
        let uvs = if flags & 2 != 0 { self.floats(vertices * 2, double)? } else { Vec::new() };
        if flags & 8 != 0 {
            self.floats(n3, double)?;
        }
        let b = self.take(faces.checked_mul(12).ok_or("truncated mesh")?)?;
        let index = |c: &[u8]| u32::from_le_bytes([c[0], c[1], c[2], c[3]]);
        let indices: Vec<[u32; 3]> = b.chunks_exact(12).map(|f| [index(f), index(&f[4..]), index(&f[8..])]).collect();
        if indices.iter().flatten().any(|&i| i as usize >= vertices) {
            return Err("a face uses a vertex that does not exist".into());
        }
        if positions.iter().any(|v| !v.is_finite()) {
            return Err("a vertex is not finite".into());
        }
        let triples = |v: &[f32]| v.as_chunks::<3>().0.to_vec();
        Ok(TriangleMesh {
            positions: triples(&positions).into_iter().map(|[x, y, z]| Point3::new(x, y, z)).collect(),
            normals: triples(&normals).into_iter().map(|[x, y, z]| Normal3::new(x, y, z)).collect(),
            uvs: uvs.as_chunks::<2>().0.iter().map(|&[u, v]| Point2::new(u, v)).collect(),
            indices,
            ..TriangleMesh::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_the_cube_look_outwards() {
        let m = cube();
        assert_eq!((m.positions.len(), m.indices.len()), (24, 12));
        for f in 0..12 {
            let t = m.triangle(f);
            assert!(t.normal().to_vec().dot(t.p[0].to_vec()) > 0.9);
        }
    }
}
