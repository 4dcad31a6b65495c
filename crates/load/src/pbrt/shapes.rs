//! Shapes: geometry in object space, with what the graphics state puts on it.

use super::Loader;
use super::curves::curves;
use super::params::Params;
use crate::files::read_all;
use crate::ply;
use steradian_geometry::{BilinearMesh, Cylinder, Disk, Sphere, TriangleMesh, loop_subdivide};
use steradian_math::Transform;
use steradian_scene::{
    Displacement, FloatInput, FloatTexture, Handle, Instance, MediumInterface, Object, Primitive, Shape,
};
use steradian_syntax::{Diagnostic, Directive, Span};

const TYPES: [&str; 8] =
    ["trianglemesh", "plymesh", "bilinearmesh", "sphere", "disk", "cylinder", "loopsubdiv", "curve"];

impl Loader<'_> {
    /// `Shape "type"`.
    pub(super) fn shape(&mut self, mut d: Directive) {
        let kind = d.text(0).to_string();
        let mut params = self.params(&mut d);
        let p = &mut params;
        let shapes = match kind.as_str() {
            "trianglemesh" => self.triangle_mesh(p),
            "bilinearmesh" => self.bilinear_mesh(p),
            "plymesh" => self.ply_mesh(p),
            "sphere" => sphere(p),
            "disk" => disk(p),
            "cylinder" => cylinder(p),
            "loopsubdiv" => self.subdivision(p),
            "curve" => curves(p),
            _ => {
                let span = p.span;
                p.accept_all();
                self.unknown_type("shape", &kind, span, &TYPES);
                Vec::new()
            }
        };
        let alpha = self.alpha(&mut params);
        self.place(shapes, alpha, &mut params);
        self.diagnostics.append(&mut params.finish());
    }

    /// Gives shapes the material, light, media and place of the graphics state.
    fn place(&mut self, shapes: Vec<Shape>, alpha: Option<FloatInput>, params: &mut Params) {
        let light = self.state.area_light.clone();
        let has_power = light.as_ref().is_some_and(|l| l.0.power.is_some());
        self.traps_of_shapes(&shapes, has_power, params.span);
        let state = &self.state;
        let animated = state.is_animated();
        if light.is_some() && self.object.is_some() {
            let note = "each instance of the object shines here; in pbrt none does";
            params.diagnostics.push(Diagnostic::note(note, params.span));
        }
        if light.is_some() && shapes.iter().any(|s| matches!(s, Shape::Curves(_))) {
            params.warning("light from curves is found by chance only, and so is noisy", None);
        }
        if light.is_some() && animated {
            let note = "the light moves with its shape; pbrt refuses lights on shapes that move";
            params.diagnostics.push(Diagnostic::note(note, params.span));
        }
        // A boundary between equal media is none.
        let media =
            (state.inside != state.outside).then_some(MediumInterface { inside: state.inside, outside: state.outside });
        // A moving shape becomes an object of its own, whose only instance moves.
        let world_from_object = if animated { Transform::IDENTITY } else { state.ctm[0] };
        let primitives: Vec<Primitive> = shapes
            .into_iter()
            .map(|shape| Primitive {
                shape,
                world_from_object,
                reverse_orientation: state.reverse_orientation,
                material: state.material,
                area_light: light.as_ref().map(|l| l.0.clone()),
                alpha,
                media,
            })
            .collect();
        if primitives.is_empty() {
            return;
        }
        if animated {
            let motion = state.animated();
            let count = primitives.len();
            let object = self.scene.objects.push(Object { name: String::new(), primitives, instances: Vec::new() });
            if let Some(light) = &light {
                self.emitters.extend((0..count).map(|i| (Some(object), i, light.1)));
            }
            let instance = Instance { object, world_from_object: motion };
            match self.object {
                Some(handle) => self.scene.objects[handle].instances.push(instance),
                None => self.scene.instances.push(instance),
            }
            return;
        }
        let list = match self.object {
            Some(handle) => &mut self.scene.objects[handle].primitives,
            None => &mut self.scene.primitives,
        };
        if let Some(light) = &light {
            self.emitters.extend((0..primitives.len()).map(|i| (self.object, list.len() + i, light.1)));
        }
        list.extend(primitives);
    }

    fn triangle_mesh(&mut self, p: &mut Params) -> Vec<Shape> {
        let Some((positions, _)) = p.take_points("P") else {
            ask_mesh(p);
            p.error(format!("{} needs points `P`", p.what()), None);
            return Vec::new();
        };
        let n = positions.len();
        let indices = p.take_ints("indices");
        let indices = mesh_indices::<3>(p, indices, n);
        let normals = p.take_normals("N");
        let tangents = p.take_vectors("S");
        let uvs = p.take_points2("uv");
        // Which face of a Ptex file goes where: nothing reads it yet.
        p.take_ints("faceIndices");
        let mesh = TriangleMesh {
            normals: per_vertex(p, "N", normals, n),
            tangents: per_vertex(p, "S", tangents, n),
            uvs: per_vertex(p, "uv", uvs, n),
            positions,
            indices,
            flip: false,
            ..TriangleMesh::default()
        };
        self.push_triangles(p, mesh)
    }

    /// Puts a mesh into the scene without the triangles that have no area.
    fn push_triangles(&mut self, p: &mut Params, mut mesh: TriangleMesh) -> Vec<Shape> {
        let before = mesh.indices.len();
        let at = |i: u32| mesh.positions[i as usize];
        mesh.indices.retain(|&[a, b, c]| !ply::flat(at(a), at(b), at(c)));
        let dropped = before - mesh.indices.len();
        if dropped > 0 {
            let what = if dropped == 1 { "face has no area and is" } else { "faces have no area and are" };
            p.diagnostics.push(Diagnostic::note(format!("{}: {dropped} {what} left out", p.what()), p.span));
        }
        if mesh.indices.is_empty() {
            return Vec::new();
        }
        vec![Shape::Triangles(self.scene.triangle_meshes.push(mesh))]
    }

    fn bilinear_mesh(&mut self, p: &mut Params) -> Vec<Shape> {
        let Some((positions, _)) = p.take_points("P") else {
            ask_mesh(p);
            p.error(format!("{} needs points `P`", p.what()), None);
            return Vec::new();
        };
        let n = positions.len();
        let indices = p.take_ints("indices");
        let indices = mesh_indices::<4>(p, indices, n);
        let normals = p.take_normals("N");
        let uvs = p.take_points2("uv");
        p.take_ints("faceIndices");
        if let Some((_, span)) = p.string("emissionfilename") {
            // It tells pbrt where to sample the light; what the light emits is the area light's matter.
            let note = "`emissionfilename` changes how pbrt samples, not what the image tends to; it is not read";
            p.diagnostics.push(Diagnostic::note(note, span));
        }
        if indices.is_empty() {
            return Vec::new();
        }
        let mesh = BilinearMesh {
            normals: per_vertex(p, "N", normals, n),
            uvs: per_vertex(p, "uv", uvs, n),
            positions,
            indices,
            flip: false,
        };
        vec![Shape::Bilinear(self.scene.bilinear_meshes.push(mesh))]
    }

    fn ply_mesh(&mut self, p: &mut Params) -> Vec<Shape> {
        let displacement = p.has("displacement").then(|| self.float_texture(p, "displacement", 0.0));
        let edge_length = p.float("edgelength", 1.0);
        let Some((name, span)) = p.string("filename") else {
            p.error(format!("{} needs a `filename`", p.what()), None);
            return Vec::new();
        };
        let path = self.resolve(&name);
        let read = read_all(self.files, &path)
            .and_then(|bytes| ply::parse(&bytes).map_err(|e| format!("{}: {e}", path.display())));
        let mesh = match read {
            Ok(mesh) => mesh,
            Err(message) => {
                p.error(message, span);
                return Vec::new();
            }
        };
        self.report_ply(&mesh, &name, span);
        let ply::PlyMesh { positions, normals, uvs, mut triangles, quads, .. } = mesh;
        let mut shapes = Vec::new();
        if let Some(texture) = displacement {
            // Only triangles are displaced; the corners of a patch are in the order of rows.
            triangles.extend(quads.iter().flat_map(|&[a, b, c, d]| [[a, b, d], [a, d, c]]));
            let mesh = TriangleMesh {
                positions,
                normals,
                tangents: Vec::new(),
                uvs,
                indices: triangles,
                flip: false,
                ..TriangleMesh::default()
            };
            return self.displaced(p, mesh, texture, edge_length);
        }
        if !quads.is_empty() {
            // Shared vertices are kept twice where a file mixes both kinds of faces, which is rare.
            let (positions, normals, uvs) = (positions.clone(), normals.clone(), uvs.clone());
            let mesh = BilinearMesh { positions, normals, uvs, indices: quads, flip: false };
            shapes.push(Shape::Bilinear(self.scene.bilinear_meshes.push(mesh)));
        }
        if !triangles.is_empty() {
            let mesh = TriangleMesh {
                positions,
                normals,
                tangents: Vec::new(),
                uvs,
                indices: triangles,
                flip: false,
                ..TriangleMesh::default()
            };
            shapes.push(Shape::Triangles(self.scene.triangle_meshes.push(mesh)));
        }
        shapes
    }

    /// A mesh that a texture displaces when the world is built.
    fn displaced(
        &mut self,
        p: &mut Params,
        mesh: TriangleMesh,
        texture: Handle<FloatTexture>,
        edge_length: f32,
    ) -> Vec<Shape> {
        let edge_length = edge_length * self.declarations.displacement_edge_scale();
        if edge_length.is_nan() || edge_length <= 0.0 {
            let span = p.span_of("edgelength");
            p.error(format!("`edgelength` must be positive, not {edge_length}"), span);
            return Vec::new();
        }
        if mesh.uvs.is_empty() {
            let span = p.span_of("displacement");
            p.error("a mesh needs texture coordinates to be displaced", span);
            return Vec::new();
        }
        if mesh.indices.is_empty() {
            return Vec::new();
        }
        let mesh = self.scene.triangle_meshes.push(mesh);
        let world_from_object = self.state.ctm[0];
        self.scene.displacements.push(Displacement { mesh, texture, world_from_object, edge_length });
        vec![Shape::Triangles(mesh)]
    }

    fn report_ply(&mut self, mesh: &ply::PlyMesh, name: &str, span: Span) {
        let mut report = |count: usize, one: &str, many: &str| {
            if count > 0 {
                let what = if count == 1 { one.to_string() } else { format!("{count} {many}") };
                self.diagnostics.push(Diagnostic::note(format!("{name}: {what}"), span));
            }
        };
        report(mesh.degenerate, "1 face has no area and is left out", "faces have no area and are left out");
        report(
            mesh.other_faces,
            "1 face has neither 3 nor 4 corners and is left out",
            "faces have neither 3 nor 4 corners and are left out",
        );
        report(
            mesh.not_finite,
            "1 normal or texture coordinate is not finite and is set to zero",
            "normals or texture coordinates are not finite and are set to zero",
        );
        if mesh.triangles.is_empty() && mesh.quads.is_empty() {
            self.diagnostics.push(Diagnostic::warning(format!("{name}: the mesh has no faces"), span));
        }
    }

    fn subdivision(&mut self, p: &mut Params) -> Vec<Shape> {
        let levels = p.int_in("levels", 3, 0..=16) as u32;
        p.string("scheme");
        let Some((positions, _)) = p.take_points("P") else {
            p.take_ints("indices");
            p.error(format!("{} needs points `P`", p.what()), None);
            return Vec::new();
        };
        let indices = p.take_ints("indices");
        if indices.is_none() {
            p.error(format!("{} needs `indices`", p.what()), None);
            return Vec::new();
        }
        let indices = mesh_indices::<3>(p, indices, positions.len());
        if indices.is_empty() {
            return Vec::new();
        }
        match loop_subdivide(&positions, &indices, levels) {
            Ok(mesh) => self.push_triangles(p, mesh),
            Err(e) => {
                p.error(format!("{}: {e}", p.what()), None);
                Vec::new()
            }
        }
    }
}

/// Asks for the parameters of a mesh whose points are missing, so that only that is reported.
fn ask_mesh(p: &mut Params) {
    p.take_ints("indices");
    p.take_normals("N");
    p.take_vectors("S");
    p.take_points2("uv");
    p.take_ints("faceIndices");
}

/// Vertex attributes, of which there must be as many as vertices.
fn per_vertex<T>(p: &mut Params, name: &'static str, given: Option<(Vec<T>, Span)>, vertices: usize) -> Vec<T> {
    match given {
        Some((values, _)) if values.len() == vertices => values,
        Some((values, span)) => {
            p.error(format!("`{name}` of {} has {} items for {vertices} vertices", p.what(), values.len()), span);
            Vec::new()
        }
        None => Vec::new(),
    }
}

/// The corners of faces: groups of `N` indices in range. A mesh of one face may leave them out.
fn mesh_indices<const N: usize>(p: &mut Params, given: Option<(Vec<i32>, Span)>, vertices: usize) -> Vec<[u32; N]> {
    let Some((indices, span)) = given else {
        if vertices == N {
            return vec![std::array::from_fn(|i| i as u32)];
        }
        p.error(format!("{} needs `indices`, since it has {vertices} points and not {N}", p.what()), None);
        return Vec::new();
    };
    let (faces, rest) = indices.as_chunks::<N>();
    if !rest.is_empty() {
        p.error(format!("`indices` of {} needs {N} integers for each face, but has {}", p.what(), indices.len()), span);
        return Vec::new();
    }
    if let Some(i) = indices.iter().position(|&i| i < 0 || i as usize >= vertices) {
        let message = format!(
            "`indices` of {}: face {} uses vertex {}, but there are only {vertices}",
            p.what(),
            i / N,
            indices[i]
        );
        p.error(message, span);
        return Vec::new();
    }
    faces.iter().map(|f| f.map(|i| i as u32)).collect()
}

/// Reports a quadric that cannot be.
fn one(p: &mut Params, shape: Option<Shape>) -> Vec<Shape> {
    if shape.is_none() {
        p.error(format!("{} has no surface: a radius, height or angle makes no sense", p.what()), None);
    }
    shape.into_iter().collect()
}

fn sphere(p: &mut Params) -> Vec<Shape> {
    let radius = p.float("radius", 1.0);
    let (z_min, z_max) = (p.float("zmin", -radius), p.float("zmax", radius));
    let phi_max = p.float("phimax", 360.0);
    one(p, Sphere::new(radius, z_min, z_max, phi_max).map(Shape::Sphere))
}

fn disk(p: &mut Params) -> Vec<Shape> {
    let (height, radius) = (p.float("height", 0.0), p.float("radius", 1.0));
    let (inner, phi_max) = (p.float("innerradius", 0.0), p.float("phimax", 360.0));
    one(p, Disk::new(height, radius, inner, phi_max).map(Shape::Disk))
}

fn cylinder(p: &mut Params) -> Vec<Shape> {
    let radius = p.float("radius", 1.0);
    let (z_min, z_max) = (p.float("zmin", -1.0), p.float("zmax", 1.0));
    let phi_max = p.float("phimax", 360.0);
    one(p, Cylinder::new(radius, z_min, z_max, phi_max).map(Shape::Cylinder))
}
