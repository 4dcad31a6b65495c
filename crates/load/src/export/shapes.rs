//! Shapes, and the meshes that are written beside the scene.

use super::{Writer, list, transform};
use steradian_geometry::{CurveProfile, TriangleMesh};
use steradian_math::Transform;
use steradian_scene::{FloatInput, Handle, Primitive, Shape, Texture};

impl Writer<'_> {
    pub(super) fn primitive(&mut self, p: &Primitive, place: &Transform) {
        let material = self.material(p.material);
        let alpha = p.alpha.map(|a| self.float_param("alpha", a)).unwrap_or_default();
        let shapes = self.shapes(&p.shape);
        self.line("AttributeBegin");
        let t = place.mul(&p.world_from_object);
        if !t.is_identity() {
            self.line(&transform(&t));
        }
        if p.reverse_orientation {
            self.line("ReverseOrientation");
        }
        if let Some(m) = p.media {
            let name = |h: Option<Handle<_>>| {
                h.map_or(String::new(), |h: Handle<steradian_scene::Medium>| format!("medium{}", h.index()))
            };
            self.line(&format!("MediumInterface \"{}\" \"{}\"", name(m.inside), name(m.outside)));
        }
        self.line(&format!("NamedMaterial \"{material}\""));
        if let Some(light) = &p.area_light {
            let text = self.area_light(light);
            self.line(&text);
        }
        for shape in shapes {
            self.line(&format!("Shape {shape} {alpha}"));
        }
        self.line("AttributeEnd");
    }

    fn shapes(&mut self, shape: &Shape) -> Vec<String> {
        match shape {
            Shape::Triangles(mesh) => vec![format!("\"plymesh\" \"string filename\" \"{}\"", self.mesh(*mesh))],
            Shape::Bilinear(mesh) => {
                let m = &self.scene.bilinear_meshes[*mesh];
                let p: Vec<f32> = m.positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
                let indices: Vec<f32> = m.indices.iter().flatten().map(|&i| i as f32).collect();
                let mut text = format!("\"bilinearmesh\" \"point3 P\" {} \"integer indices\" {}", list(&p), list(&indices));
                if !m.normals.is_empty() {
                    let n: Vec<f32> = m.normals.iter().flat_map(|n| [n.x, n.y, n.z]).collect();
                    text += &format!(" \"normal N\" {}", list(&n));
                }
                if !m.uvs.is_empty() {
                    let uv: Vec<f32> = m.uvs.iter().flat_map(|uv| [uv.x, uv.y]).collect();
                    text += &format!(" \"point2 uv\" {}", list(&uv));
                }
                vec![text]
            }
            Shape::Sphere(s) => {
                let [radius, low, high, phi] = s.parameters();
                vec![format!(
                    "\"sphere\" \"float radius\" {radius} \"float zmin\" {low} \"float zmax\" {high} \"float phimax\" {phi}"
                )]
            }
            Shape::Disk(d) => {
                let [height, radius, inner, phi] = d.parameters();
                if d.is_radial() {
                    self.note("disks of Mitsuba have their texture coordinates the other way round in pbrt");
                }
                vec![format!(
                    "\"disk\" \"float height\" {height} \"float radius\" {radius} \"float innerradius\" {inner} \"float phimax\" {phi}"
                )]
            }
            Shape::Cylinder(c) => {
                let [radius, low, high, phi] = c.parameters();
                vec![format!(
                    "\"cylinder\" \"float radius\" {radius} \"float zmin\" {low} \"float zmax\" {high} \"float phimax\" {phi}"
                )]
            }
            Shape::Curves(curves) => curves
                .iter()
                .map(|c| {
                    let (p, width, profile) = c.parameters();
                    let points: Vec<f32> = p.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
                    let (kind, normals) = match profile {
                        CurveProfile::Flat => ("flat", String::new()),
                        CurveProfile::Cylinder => ("cylinder", String::new()),
                        CurveProfile::Ribbon(n) => {
                            let n: Vec<f32> = n.iter().flat_map(|n| [n.x, n.y, n.z]).collect();
                            ("ribbon", format!(" \"normal N\" {}", list(&n)))
                        }
                    };
                    format!(
                        "\"curve\" \"string type\" \"{kind}\" \"point3 P\" {} \"float width0\" {} \"float width1\" {}{normals}",
                        list(&points),
                        width[0],
                        width[1]
                    )
                })
                .collect(),
        }
    }

    fn mesh(&mut self, handle: Handle<TriangleMesh>) -> String {
        if let Some(name) = self.meshes.get(&handle.index()) {
            return name.clone();
        }
        let name = format!("{}/mesh{}.ply", self.folder, handle.index());
        let mesh = &self.scene.triangle_meshes[handle];
        if !mesh.more_uvs.is_empty() || !mesh.colors.is_empty() || !mesh.attributes.is_empty() {
            self.note("meshes keep one set of texture coordinates and no colours");
        }
        if self.scene.displacements.iter().any(|d| d.mesh == handle) {
            self.note("displacement is left out");
        }
        self.out.files.push((name.clone(), ply(mesh)));
        self.meshes.insert(handle.index(), name.clone());
        name
    }

    /// A parameter that is a number or the name of a texture.
    pub(super) fn float_param(&mut self, name: &str, t: FloatInput) -> String {
        match &self.scene.float_textures[t].0 {
            Texture::Constant(v) => format!("\"float {name}\" {v}"),
            _ => match self.float_texture(t) {
                Some(texture) => format!("\"texture {name}\" \"{texture}\""),
                None => String::new(),
            },
        }
    }
}

/// A mesh as binary PLY.
fn ply(m: &TriangleMesh) -> Vec<u8> {
    let (normals, uvs) = (!m.normals.is_empty(), !m.uvs.is_empty());
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", m.positions.len());
    let mut names = vec!["x", "y", "z"];
    names.extend(normals.then_some(["nx", "ny", "nz"]).into_iter().flatten());
    names.extend(uvs.then_some(["u", "v"]).into_iter().flatten());
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
        if uvs {
            [m.uvs[i].x, m.uvs[i].y].into_iter().for_each(&mut push);
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
