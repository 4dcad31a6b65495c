//! The data of a PLY file. Fixed layouts of little-endian files have a path of their own: they are what large scenes are made of.

use super::attributes::{self, Group};
use super::header::{Element, Encoding, Header, Property, Scalar};
use super::{PlyError, PlyMesh};
use steradian_math::{Normal3, Point2, Point3, Vec3};

/// Reads all elements; `vertex` and `face` are kept, others passed over.
pub(super) fn read(bytes: &[u8], header: &Header, with_attributes: bool) -> Result<PlyMesh, PlyError> {
    let mut mesh = PlyMesh::default();
    let mut faces = Faces::default();
    let mut input = Input { bytes, at: header.data, encoding: header.encoding };
    let vertex = header.elements.iter().find(|e| e.name == "vertex").ok_or(PlyError::Missing("vertices"))?;
    if vertex.count > u32::MAX as usize {
        return Err(PlyError::TooManyVertices(vertex.count));
    }
    if !header.elements.iter().any(|e| e.name == "face") {
        return Err(PlyError::Missing("faces"));
    }
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices(&mut input, element, &mut mesh, with_attributes)?,
            "face" => read_faces(&mut input, element, &mut faces, with_attributes)?,
            _ => skip(&mut input, element)?,
        }
    }
    faces.into_mesh(&mut mesh)?;
    Ok(mesh)
}

/// A place in the data. Numbers come back as `f64`, which holds every type of the format exactly.
struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

/// What stopped a number from being read.
enum Stop {
    End,
    NotANumber(String),
}

impl Stop {
    fn at(self, element: &Element, index: usize) -> PlyError {
        let name = element.name.clone();
        match self {
            Stop::End => PlyError::Truncated { element: name, index, count: element.count },
            Stop::NotANumber(text) => PlyError::NotANumber { element: name, index, text },
        }
    }
}

impl<'a> Input<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], Stop> {
        let end = self.at.checked_add(n).filter(|&e| e <= self.bytes.len()).ok_or(Stop::End)?;
        let out = &self.bytes[self.at..end];
        self.at = end;
        Ok(out)
    }

    fn number(&mut self, ty: Scalar) -> Result<f64, Stop> {
        match self.encoding {
            Encoding::Ascii => self.word(ty),
            Encoding::LittleEndian => Ok(decode::<false>(self.take(ty.size())?, ty)),
            Encoding::BigEndian => Ok(decode::<true>(self.take(ty.size())?, ty)),
        }
    }

    fn word(&mut self, ty: Scalar) -> Result<f64, Stop> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or(Stop::End)?;
        let end = rest[start..].iter().position(|b| b.is_ascii_whitespace()).map_or(rest.len(), |n| start + n);
        self.at += end;
        let text = std::str::from_utf8(&rest[start..end]).ok();
        let value = match ty {
            // Rounding a decimal to f64 and then to f32 may differ from rounding once.
            Scalar::F32 => text.and_then(|t| t.parse::<f32>().ok()).map(f64::from),
            _ => text.and_then(|t| t.parse::<f64>().ok()),
        };
        let lossy = || String::from_utf8_lossy(&rest[start..end]).chars().take(40).collect();
        value.ok_or_else(|| Stop::NotANumber(lossy()))
    }

    /// The length of a list, which the rest of the file must be able to hold.
    fn length(&mut self, list: Scalar, ty: Scalar) -> Result<usize, Stop> {
        let n = self.number(list)?;
        let each = if self.encoding == Encoding::Ascii { 1 } else { ty.size() };
        if n.is_nan() || n < 0.0 || n > ((self.bytes.len() - self.at) / each) as f64 {
            return Err(Stop::End);
        }
        Ok(n as usize)
    }

    fn skip_property(&mut self, p: &Property) -> Result<(), Stop> {
        let n = match p.list {
            Some(list) => self.length(list, p.ty)?,
            None => 1,
        };
        match self.encoding {
            Encoding::Ascii => {
                for _ in 0..n {
                    self.word(p.ty)?;
                }
            }
            _ => _ = self.take(n * p.ty.size())?,
        }
        Ok(())
    }
}

/// One number from exactly `ty.size()` bytes.
fn decode<const BIG: bool>(b: &[u8], ty: Scalar) -> f64 {
    macro_rules! number {
        ($t:ty, $n:literal) => {{
            let mut a = [0u8; $n];
            a.copy_from_slice(b);
            f64::from(if BIG { <$t>::from_be_bytes(a) } else { <$t>::from_le_bytes(a) })
        }};
    }
    match ty {
        Scalar::I8 => number!(i8, 1),
        Scalar::U8 => number!(u8, 1),
        Scalar::I16 => number!(i16, 2),
        Scalar::U16 => number!(u16, 2),
        Scalar::I32 => number!(i32, 4),
        Scalar::U32 => number!(u32, 4),
        Scalar::F32 => number!(f32, 4),
        Scalar::F64 => number!(f64, 8),
    }
}

fn skip(input: &mut Input, element: &Element) -> Result<(), PlyError> {
    // Elements without properties take no bytes, so any number of them may be promised.
    if element.properties.is_empty() {
        return Ok(());
    }
    for i in 0..element.count {
        for p in &element.properties {
            input.skip_property(p).map_err(|s| s.at(element, i))?;
        }
    }
    Ok(())
}

/// Which property holds what: x y z, nx ny nz, u v.
struct Columns {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
}

impl Columns {
    fn find(element: &Element) -> Result<Columns, PlyError> {
        let column = |name: &str| element.properties.iter().position(|p| p.name == name && p.list.is_none());
        let (Some(x), Some(y), Some(z)) = (column("x"), column("y"), column("z")) else {
            return Err(PlyError::Missing("vertex coordinates x, y and z"));
        };
        let normal = match (column("nx"), column("ny"), column("nz")) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        };
        let names = [("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t")];
        let uv = names.iter().find_map(|&(u, v)| Some([column(u)?, column(v)?]));
        Ok(Columns { position: [x, y, z], normal, uv })
    }
}

/// Names of vertices' properties that are no attributes though they end like some.
const GEOMETRY: [&str; 4] = ["texture_u", "texture_v", "texture_s", "texture_t"];

fn vertices(input: &mut Input, element: &Element, mesh: &mut PlyMesh, with_attributes: bool) -> Result<(), PlyError> {
    let columns = Columns::find(element)?;
    let mut groups = if with_attributes { attributes::groups(element, false, &GEOMETRY) } else { Vec::new() };
    let n = element.count;
    mesh.positions.reserve_exact(n);
    mesh.normals.reserve_exact(if columns.normal.is_some() { n } else { 0 });
    mesh.uvs.reserve_exact(if columns.uv.is_some() { n } else { 0 });
    let all_f32 = element.properties.iter().all(|p| p.ty == Scalar::F32);
    match element.stride() {
        Some(stride) if all_f32 && input.encoding == Encoding::LittleEndian => {
            let available = (input.bytes.len() - input.at) / stride;
            if available < n {
                return Err(Stop::End.at(element, available));
            }
            let records = input.take(n * stride).map_err(|s| s.at(element, 0))?;
            for (i, record) in records.chunks_exact(stride).enumerate() {
                let get = |column: usize| {
                    let b = &record[4 * column..4 * column + 4];
                    f32::from_le_bytes([b[0], b[1], b[2], b[3]])
                };
                push_vertex(mesh, &columns, i, get)?;
                attributes::push_row(&mut groups, get);
            }
        }
        _ => {
            let mut row = vec![0.0f32; element.properties.len()];
            for i in 0..n {
                for (value, p) in row.iter_mut().zip(&element.properties) {
                    match p.list {
                        None => *value = input.number(p.ty).map_err(|s| s.at(element, i))? as f32,
                        Some(_) => input.skip_property(p).map_err(|s| s.at(element, i))?,
                    }
                }
                push_vertex(mesh, &columns, i, |column| row[column])?;
                attributes::push_row(&mut groups, |column| row[column]);
            }
        }
    }
    mesh.attributes.extend(attributes::attributes(groups));
    Ok(())
}

#[inline]
fn push_vertex(mesh: &mut PlyMesh, columns: &Columns, i: usize, get: impl Fn(usize) -> f32) -> Result<(), PlyError> {
    let [x, y, z] = columns.position;
    let p = Point3::new(get(x), get(y), get(z));
    if !p.is_finite() {
        return Err(PlyError::NotFinite { vertex: i });
    }
    mesh.positions.push(p);
    if let Some([x, y, z]) = columns.normal {
        let n = Normal3::new(get(x), get(y), get(z));
        mesh.not_finite += usize::from(!n.is_finite());
        mesh.normals.push(if n.is_finite() { n } else { Normal3::default() });
    }
    if let Some([u, v]) = columns.uv {
        let uv = Point2::new(get(u), get(v));
        mesh.not_finite += usize::from(!uv.is_finite());
        mesh.uvs.push(if uv.is_finite() { uv } else { Point2::default() });
    }
    Ok(())
}

/// Corner indices as the file has them. They are checked when all vertices are known, since faces may come first.
#[derive(Default)]
struct Faces {
    triangles: Vec<[i64; 3]>,
    quads: Vec<[i64; 4]>,
    /// Number in the file of each triangle and of each quadrilateral; empty while all faces are triangles.
    triangle_numbers: Vec<u32>,
    quad_numbers: Vec<u32>,
    /// Little-endian files of nothing but triangles.
    packed: Vec<[u32; 3]>,
    other: usize,
    /// Attributes of the faces of the file, one row for each.
    groups: Vec<Group>,
}

fn read_faces(input: &mut Input, element: &Element, faces: &mut Faces, with_attributes: bool) -> Result<(), PlyError> {
    let wanted = |p: &Property| p.list.is_some() && (p.name == "vertex_indices" || p.name == "vertex_index");
    let column =
        element.properties.iter().position(wanted).ok_or(PlyError::Missing("face property `vertex_indices`"))?;
    if with_attributes {
        faces.groups = attributes::groups(element, true, &[]);
    }
    let mut row = vec![0.0f32; element.properties.len()];
    let mut first = 0;
    if let [p] = element.properties.as_slice() {
        let four_bytes = matches!(p.ty, Scalar::I32 | Scalar::U32);
        if input.encoding == Encoding::LittleEndian && p.list == Some(Scalar::U8) && four_bytes {
            first = packed_triangles(input, element.count, faces);
        }
    }
    for i in first..element.count {
        for (c, p) in element.properties.iter().enumerate() {
            if c != column {
                match p.list {
                    None if !faces.groups.is_empty() => {
                        row[c] = input.number(p.ty).map_err(|s| s.at(element, i))? as f32;
                    }
                    _ => input.skip_property(p).map_err(|s| s.at(element, i))?,
                }
                continue;
            }
            let list = p.list.unwrap_or(Scalar::U8);
            let n = input.length(list, p.ty).map_err(|s| s.at(element, i))?;
            if n != 3 && n != 4 {
                for _ in 0..n {
                    input.number(p.ty).map_err(|s| s.at(element, i))?;
                }
                faces.other += 1;
                continue;
            }
            let mut corners = [0i64; 4];
            for corner in corners.iter_mut().take(n) {
                *corner = input.number(p.ty).map_err(|s| s.at(element, i))? as i64;
            }
            let [a, b, c, d] = corners;
            let number = i.min(u32::MAX as usize) as u32;
            if n == 3 {
                faces.triangles.push([a, b, c]);
                faces.triangle_numbers.push(number);
            } else {
                // Corners go round the face in the file; a patch lists its second row from the same side as its first.
                faces.quads.push([a, b, d, c]);
                faces.quad_numbers.push(number);
            }
        }
        attributes::push_row(&mut faces.groups, |column| row[column]);
    }
    Ok(())
}

/// Takes triangles of 13 bytes for as long as the faces are triangles; returns how many it took.
fn packed_triangles(input: &mut Input, count: usize, faces: &mut Faces) -> usize {
    let rest = &input.bytes[input.at..];
    faces.packed.reserve_exact(count.min(rest.len() / 13));
    let word = |b: &[u8], i: usize| u32::from_le_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]);
    for record in rest.chunks_exact(13).take(count) {
        if record[0] != 3 {
            break;
        }
        faces.packed.push([word(record, 1), word(record, 5), word(record, 9)]);
    }
    input.at += 13 * faces.packed.len();
    faces.packed.len()
}

impl Faces {
    fn into_mesh(self, mesh: &mut PlyMesh) -> Result<(), PlyError> {
        let vertices = mesh.positions.len();
        let check = |face: usize, index: i64| match u32::try_from(index) {
            Ok(i) if (i as usize) < vertices => Ok(i),
            _ => Err(PlyError::Index { face, index, vertices }),
        };
        mesh.other_faces = self.other;
        mesh.triangles = self.packed;
        for (f, t) in mesh.triangles.iter().enumerate() {
            for &i in t {
                // As a signed number, since that is how most files declare it.
                check(f, i64::from(i as i32))?;
            }
        }
        mesh.triangles.reserve_exact(self.triangles.len());
        for (t, &f) in self.triangles.iter().zip(&self.triangle_numbers) {
            let f = f as usize;
            mesh.triangles.push([check(f, t[0])?, check(f, t[1])?, check(f, t[2])?]);
        }
        mesh.quads.reserve_exact(self.quads.len());
        for (q, &f) in self.quads.iter().zip(&self.quad_numbers) {
            let f = f as usize;
            mesh.quads.push([check(f, q[0])?, check(f, q[1])?, check(f, q[2])?, check(f, q[3])?]);
        }
        let p = |i: u32| mesh.positions[i as usize];
        let before = mesh.triangles.len() + mesh.quads.len();
        let is_flat = |&[a, b, c]: &[u32; 3]| flat(p(a), p(b), p(c));
        // A patch is without area when all four of its corner triangles are.
        let is_flat_patch =
            |&[a, b, c, d]: &[u32; 4]| flat(p(a), p(b), p(c)) && flat(p(d), p(b), p(c)) && flat(p(a), p(b), p(d));
        if !self.groups.is_empty() {
            let numbers =
                |i: usize| if self.triangle_numbers.is_empty() { i } else { self.triangle_numbers[i] as usize };
            let triangles = (0..mesh.triangles.len()).filter(|&i| !is_flat(&mesh.triangles[i])).map(numbers);
            let quads = (0..mesh.quads.len()).filter(|&i| !is_flat_patch(&mesh.quads[i]));
            let order: Vec<usize> = triangles.chain(quads.map(|i| self.quad_numbers[i] as usize)).collect();
            mesh.attributes.extend(attributes::attributes(self.groups).map(|mut a| {
                let w = a.width;
                a.values = order.iter().flat_map(|&f| a.values[f * w..(f + 1) * w].to_vec()).collect();
                a
            }));
        }
        mesh.triangles.retain(|t| !is_flat(t));
        mesh.quads.retain(|q| !is_flat_patch(q));
        mesh.degenerate = before - mesh.triangles.len() - mesh.quads.len();
        Ok(())
    }
}

/// Whether the corners lie on a line, exactly or as far as `f32` can tell.
pub(crate) fn flat(a: Point3, b: Point3, c: Point3) -> bool {
    let n: Vec3 = (b - a).cross(c - a);
    // A triangle can be so small that its area underflows; scaled up it still has one.
    n == Vec3::default() && {
        let scale = |v: Vec3| v * 1e18;
        scale(b - a).cross(scale(c - a)) == Vec3::default()
    }
}
