//! Shapes, and the meshes that are written beside the scene.

use super::Writer;
use super::bake::affine;
use super::text::{integers, list, number, transform, triples};
use steradian_geometry::{BilinearMesh, Curve, CurveProfile, TriangleMesh};
use steradian_math::{Point2, Transform};
use steradian_scene::{FloatInput, Handle, Mapping2, Medium, Primitive, Shape, Texture};

impl Writer<'_> {
    /// Writes a primitive, `place` being where its object stands.
    pub(super) fn primitive(&mut self, p: &Primitive, place: &Transform) {
        self.subject = self.called(p);
        let straightened = self.straightened(p);
        self.straight = straightened.is_some();
        let material = self.material(p.material);
        let fades = self.fades_only(p);
        let alpha = match p.alpha {
            Some(_) if fades => self.ramp(),
            Some(a) => self.float_param("alpha", a),
            None => String::new(),
        };
        let light = p.area_light.as_ref().map(|l| self.area_light(l));
        let shapes = self.shapes(&p.shape, straightened.as_ref(), fades);
        self.straight = false;
        self.subject = String::new();
        self.line("AttributeBegin");
        let t = place.mul(&p.world_from_object);
        if !t.is_identity() {
            self.line(&transform(&t));
        }
        if p.reverse_orientation {
            self.line("ReverseOrientation");
        }
        if let Some(m) = p.media {
            let name = |h: Option<Handle<Medium>>| h.map_or(String::new(), |h| format!("medium{}", h.index()));
            self.line(&format!("MediumInterface \"{}\" \"{}\"", name(m.inside), name(m.outside)));
        }
        self.line(&format!("NamedMaterial \"{material}\""));
        if let Some(light) = light {
            self.line(&light);
        }
        for shape in shapes {
            self.line(&format!("Shape {shape} {alpha}"));
        }
        self.line("AttributeEnd");
    }

    fn shapes(&mut self, shape: &Shape, straightened: Option<&Mapping2>, fades: bool) -> Vec<String> {
        match shape {
            Shape::Triangles(mesh) => vec![self.mesh(*mesh, straightened, fades)],
            Shape::Bilinear(mesh) => vec![bilinear(&self.scene.bilinear_meshes[*mesh])],
            Shape::Sphere(s) => {
                let [radius, low, high, phi] = s.parameters().map(number);
                vec![format!(
                    "\"sphere\" \"float radius\" {radius} \"float zmin\" {low} \"float zmax\" {high} \"float phimax\" {phi}"
                )]
            }
            Shape::Disk(d) => {
                let [height, radius, inner, phi] = d.parameters().map(number);
                if d.is_radial() {
                    self.note("disks of Mitsuba have their texture coordinates the other way round in pbrt");
                }
                vec![format!(
                    "\"disk\" \"float height\" {height} \"float radius\" {radius} \"float innerradius\" {inner} \"float phimax\" {phi}"
                )]
            }
            Shape::Cylinder(c) => {
                let [radius, low, high, phi] = c.parameters().map(number);
                vec![format!(
                    "\"cylinder\" \"float radius\" {radius} \"float zmin\" {low} \"float zmax\" {high} \"float phimax\" {phi}"
                )]
            }
            Shape::Curves(curves) => curves.iter().map(curve).collect(),
            Shape::Distances(_) => {
                self.note("surfaces of signed distances are left out");
                Vec::new()
            }
        }
    }

    /// The statement of a mesh, whose file is written once.
    fn mesh(&mut self, handle: Handle<TriangleMesh>, straightened: Option<&Mapping2>, fades: bool) -> String {
        let mesh = &self.scene.triangle_meshes[handle];
        let key = format!("{} {straightened:?} {fades}", handle.index());
        if !self.meshes.contains_key(&key) {
            let name = self.path(&format!("mesh{}.ply", self.meshes.len()));
            let uvs = match straightened.and_then(affine) {
                _ if fades => Some(mesh.colors.iter().map(|c| Point2::new(c[3], 0.5)).collect()),
                Some((set, rows)) => Some(mapped(mesh, set, &rows)),
                None => None,
            };
            self.files.push((name.clone(), ply(mesh, uvs.as_deref().unwrap_or(&mesh.uvs))));
            self.meshes.insert(key.clone(), name);
        }
        let mut text = format!("\"plymesh\" \"string filename\" \"{}\"", self.meshes[&key]);
        if let Some(d) = self.scene.displacements.iter().find(|d| d.mesh == handle) {
            let displacement = self.float_param("displacement", d.texture);
            text += &format!(" {displacement} \"float edgelength\" {}", number(d.edge_length));
        }
        text
    }

    /// An opacity that is the first texture coordinate.
    fn ramp(&mut self) -> String {
        let (name, is_new) = self.texture_name("ramp".into());
        if is_new {
            let corners = "\"float v00\" 0 \"float v01\" 0 \"float v10\" 1 \"float v11\" 1";
            self.head(&format!("Texture \"{name}\" \"float\" \"bilerp\" {corners}"));
        }
        format!("\"texture alpha\" \"{name}\"")
    }

    /// A parameter that is a number or the name of a texture.
    pub(super) fn float_param(&mut self, name: &str, t: FloatInput) -> String {
        match &self.scene.float_textures[t].0 {
            Texture::Constant(v) => format!("\"float {name}\" {}", number(*v)),
            _ => match self.float_texture(t) {
                Some(texture) => format!("\"texture {name}\" \"{texture}\""),
                None => String::new(),
            },
        }
    }
}

/// Coordinates of a set under an affine map; those of a mesh without any stay so.
fn mapped(mesh: &TriangleMesh, set: u32, rows: &[[f32; 3]; 2]) -> Vec<Point2> {
    let of = match set {
        0 => mesh.uvs.as_slice(),
        n => mesh.more_uvs.get(n as usize - 1).map_or(&[][..], Vec::as_slice),
    };
    let row = |r: &[f32; 3], p: &Point2| r[0] * p.x + r[1] * p.y + r[2];
    of.iter().map(|p| Point2::new(row(&rows[0], p), row(&rows[1], p))).collect()
}

fn bilinear(m: &BilinearMesh) -> String {
    let corners = |&[a, b, c, d]: &[u32; 4]| if m.flip && m.normals.is_empty() { [b, a, d, c] } else { [a, b, c, d] };
    let mut text = format!(
        "\"bilinearmesh\" \"point3 P\" {} \"integer indices\" {}",
        triples(m.positions.iter().map(|p| [p.x, p.y, p.z])),
        integers(m.indices.iter().flat_map(corners))
    );
    if !m.normals.is_empty() {
        text += &format!(" \"normal N\" {}", triples(m.normals.iter().map(|n| [n.x, n.y, n.z])));
    }
    if !m.uvs.is_empty() {
        let uvs: Vec<f32> = m.uvs.iter().flat_map(|uv| [uv.x, uv.y]).collect();
        text += &format!(" \"point2 uv\" {}", list(&uvs));
    }
    text
}

fn curve(c: &Curve) -> String {
    let (p, width, profile) = c.parameters();
    let (kind, normals) = match profile {
        CurveProfile::Flat => ("flat", String::new()),
        CurveProfile::Cylinder => ("cylinder", String::new()),
        CurveProfile::Ribbon(n) => ("ribbon", format!(" \"normal N\" {}", triples(n.iter().map(|n| [n.x, n.y, n.z])))),
    };
    let points = triples(p.iter().map(|p| [p.x, p.y, p.z]));
    let [first, last] = width.map(number);
    format!(
        "\"curve\" \"string type\" \"{kind}\" \"point3 P\" {points} \"float width0\" {first} \"float width1\" {last}{normals}"
    )
}

/// A mesh as binary PLY.
fn ply(m: &TriangleMesh, uvs: &[Point2]) -> Vec<u8> {
    let (normals, uvs) = (!m.normals.is_empty(), (uvs.len() == m.positions.len()).then_some(uvs));
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", m.positions.len());
    let mut names = vec!["x", "y", "z"];
    names.extend(normals.then_some(["nx", "ny", "nz"]).into_iter().flatten());
    names.extend(uvs.and(Some(["u", "v"])).into_iter().flatten());
    for name in names {
        header += &format!("property float {name}\n");
    }
    header += &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", m.indices.len());
    let mut out = header.into_bytes();
    let mut push = |v: f32| out.extend(v.to_le_bytes());
    for (i, p) in m.positions.iter().enumerate() {
        [p.x, p.y, p.z].into_iter().for_each(&mut push);
        if normals {
            [m.normals[i].x, m.normals[i].y, m.normals[i].z].into_iter().for_each(&mut push);
        }
        if let Some(uvs) = uvs {
            [uvs[i].x, uvs[i].y].into_iter().for_each(&mut push);
        }
    }
    for &[a, b, c] in &m.indices {
        // The order of corners says which side is outside where no normals do.
        let face = if m.flip && !normals { [a, c, b] } else { [a, b, c] };
        out.push(3);
        face.iter().for_each(|i| out.extend(i.to_le_bytes()));
    }
    out
}
