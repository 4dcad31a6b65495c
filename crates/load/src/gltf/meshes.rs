//! Mesh primitives: attributes, indices and modes, posed by morph targets and skins, as triangle meshes of the scene.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::materials::{Cover, CoverKey, needs_tangents};
use super::skins::Rows;
use super::tangents;
use crate::ply::flat;
use steradian_geometry::TriangleMesh;
use steradian_math::{Normal3, Point2, Point3, Transform, Vec3};
use steradian_scene::{Handle, Primitive, Shape};

/// A mesh as it is read.
#[derive(Clone, Debug, Default)]
pub(super) struct Geometry {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    /// With the side of the bitangent.
    pub tangents: Vec<[f32; 4]>,
    pub uvs: Vec<Vec<[f32; 2]>>,
    pub colors: Vec<[f32; 4]>,
    /// Whether the colours have an opacity.
    pub color_alpha: bool,
    pub indices: Vec<[u32; 3]>,
}

/// What bends a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    /// Weights of the morph targets.
    pub weights: Vec<f32>,
    /// Where the joints put what was bound to them; empty without a skin.
    pub joints: Vec<Rows>,
}

/// A mesh in the scene, and what covers it.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub mesh: Handle<TriangleMesh>,
    pub cover: Cover,
}

impl Part {
    pub fn primitive(&self, world_from_object: Transform) -> Primitive {
        Primitive {
            shape: Shape::Triangles(self.mesh),
            world_from_object,
            reverse_orientation: false,
            material: self.cover.material,
            area_light: self.cover.light.clone(),
            alpha: self.cover.alpha,
            media: self.cover.media,
        }
    }
}

impl Geometry {
    /// Another vertex like vertex `v`; its number.
    pub fn double(&mut self, v: usize) -> u32 {
        fn again<T: Copy>(list: &mut Vec<T>, v: usize) {
            if !list.is_empty() {
                list.push(list[v]);
            }
        }
        again(&mut self.positions, v);
        again(&mut self.normals, v);
        again(&mut self.colors, v);
        self.uvs.iter_mut().for_each(|set| again(set, v));
        self.positions.len() as u32 - 1
    }

    /// The triangles among `faces` with the vertices that they use.
    fn subset(&self, faces: Vec<[u32; 3]>) -> TriangleMesh {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut used = Vec::new();
        let indices = faces
            .into_iter()
            .map(|f| {
                f.map(|v| {
                    let n = &mut number[v as usize];
                    if *n == u32::MAX {
                        *n = used.len() as u32;
                        used.push(v as usize);
                    }
                    *n
                })
            })
            .collect();
        fn pick<T: Copy, U>(from: &[T], used: &[usize], f: impl Fn(T) -> U) -> Vec<U> {
            if from.is_empty() { Vec::new() } else { used.iter().map(|&v| f(from[v])).collect() }
        }
        let uv = |set: &Vec<[f32; 2]>| pick(set, &used, |[u, v]| Point2::new(u, v));
        TriangleMesh {
            positions: pick(&self.positions, &used, |[x, y, z]| Point3::new(x, y, z)),
            normals: pick(&self.normals, &used, |[x, y, z]| Normal3::new(x, y, z)),
            tangents: pick(&self.tangents, &used, |[x, y, z, _]| Vec3::new(x, y, z)),
            uvs: self.uvs.first().map(uv).unwrap_or_default(),
            more_uvs: self.uvs.iter().skip(1).map(uv).collect(),
            colors: pick(&self.colors, &used, |c| c),
            attributes: Vec::new(),
            indices,
            flip: false,
        }
    }
}

impl<'d, 'b> Gltf<'d, 'b> {
    /// The parts of a mesh in a pose. What is wrong with one part is reported, and the others are read.
    pub(super) fn parts(&mut self, mesh: usize, pose: &Pose) -> Vec<Part> {
        let Some(json) = self.meshes.get(mesh).cloned() else { return Vec::new() };
        let primitives = match json.need("primitives").and_then(|p| p.items()) {
            Ok(p) => p,
            Err(e) => {
                self.report(e);
                return Vec::new();
            }
        };
        let mut parts = Vec::new();
        for p in &primitives {
            match self.primitive(p, pose) {
                Ok(found) => parts.extend(found),
                Err(e) => self.report(e),
            }
        }
        parts
    }

    fn primitive(&mut self, p: &Json<'d>, pose: &Pose) -> Result<Vec<Part>> {
        let mode = p.count("mode")?.unwrap_or(4);
        match mode {
            0..=3 => {
                let what = if mode == 0 { "points" } else { "lines" };
                self.warn_once(what, &format!("{what} have no area and are left out ({})", p.pointer()));
                return Ok(Vec::new());
            }
            4..=6 => {}
            other => return Err(p.problem(format!("mode {other} is none of the seven there are"))),
        }
        if let Some(draco) = p.extension("KHR_draco_mesh_compression") {
            return Err(super::draco(&draco));
        }
        let mut g = self.attributes(p, pose)?;
        let count = g.positions.len();
        let order: Vec<u32> = match p.get("indices") {
            Some(_) => self.accessor(p, "indices")?.indices()?,
            None => (0..count as u32).collect(),
        };
        if let Some(at) = order.iter().position(|&i| i as usize >= count) {
            let message = format!("index {at} refers to vertex {}, but there are only {count}", order[at]);
            return Err(p.get("indices").unwrap_or_else(|| p.clone()).problem(message));
        }
        if mode == 4 && !order.len().is_multiple_of(3) {
            let message = format!("{} corners of triangles; what is beyond a multiple of 3 is left out", order.len());
            self.warn_at(p, &message);
        }
        g.indices = triangles(&order, mode);
        let before = g.indices.len();
        let at = |i: u32| {
            let [x, y, z] = g.positions[i as usize];
            Point3::new(x, y, z)
        };
        g.indices.retain(|&[a, b, c]| !flat(at(a), at(b), at(c)));
        self.dropped += before - g.indices.len();
        if g.indices.is_empty() {
            return Ok(Vec::new());
        }
        self.covered(p, g)
    }

    /// Splits a mesh by the side of its bitangents, where anything asks for them, and finds what covers the parts.
    fn covered(&mut self, p: &Json<'d>, mut g: Geometry) -> Result<Vec<Part>> {
        let material = self.material_of(p)?;
        let colors = (!g.colors.is_empty()).then_some(g.color_alpha);
        let key = CoverKey { material, colors, mirrored: false };
        let json = match material {
            Some(i) => self.materials.get(i).cloned(),
            None => None,
        };
        let set = json.as_ref().filter(|j| needs_tangents(j)).map(|j| tangent_set(j)).transpose()?;
        match set {
            Some(set) if g.uvs.get(set).is_some_and(|s| !s.is_empty()) => {
                if g.tangents.is_empty() || g.normals.is_empty() {
                    tangents::generate(&mut g, set);
                }
            }
            _ => g.tangents = Vec::new(),
        }
        let is_mirrored = |f: &[u32; 3]| g.tangents[f[0] as usize][3] < 0.0;
        let faces = std::mem::take(&mut g.indices);
        let (mirrored, straight): (Vec<_>, Vec<_>) =
            if g.tangents.is_empty() { (Vec::new(), faces) } else { faces.into_iter().partition(is_mirrored) };
        let mut parts = Vec::new();
        for (faces, mirrored) in [(straight, false), (mirrored, true)] {
            if !faces.is_empty() {
                let cover = self.cover(CoverKey { mirrored, ..key }, p)?;
                let mesh = self.scene.triangle_meshes.push(g.subset(faces));
                parts.push(Part { mesh, cover });
            }
        }
        Ok(parts)
    }

    /// The material of a primitive, in the variant that was asked for.
    fn material_of(&mut self, p: &Json<'d>) -> Result<Option<usize>> {
        if let (Some(variant), Some(e)) = (self.variant, p.extension("KHR_materials_variants")) {
            for mapping in e.list("mappings")? {
                for v in mapping.list("variants")? {
                    if v.as_count()? == variant {
                        return Ok(Some(mapping.need("material")?.as_count()?));
                    }
                }
            }
        }
        p.count("material")
    }

    fn attributes(&mut self, p: &Json<'d>, pose: &Pose) -> Result<Geometry> {
        let attributes = p.need("attributes")?;
        let mut g = Geometry { positions: self.accessor(&attributes, "POSITION")?.floats()?, ..Geometry::default() };
        let count = g.positions.len();
        if u32::try_from(count).is_err() {
            return Err(attributes.problem(format!("{count} vertices are more than 32-bit indices can name")));
        }
        let same = |name: &str, n: usize| match n == count {
            true => Ok(()),
            false => Err(attributes.need(name)?.problem(format!("{n} values of {name} for {count} vertices"))),
        };
        if attributes.get("NORMAL").is_some() {
            g.normals = self.accessor(&attributes, "NORMAL")?.floats()?;
            same("NORMAL", g.normals.len())?;
        }
        if attributes.get("TANGENT").is_some() {
            g.tangents = self.accessor(&attributes, "TANGENT")?.floats()?;
            same("TANGENT", g.tangents.len())?;
        }
        for set in 0..16 {
            let name = format!("TEXCOORD_{set}");
            if attributes.get(&name).is_some() {
                let uv = self.accessor(&attributes, &name)?.floats()?;
                same(&name, uv.len())?;
                g.uvs.resize(set + 1, Vec::new());
                g.uvs[set] = uv;
            }
        }
        if attributes.get("COLOR_0").is_some() {
            let accessor = self.accessor(&attributes, "COLOR_0")?;
            g.color_alpha = accessor.width == 4;
            g.colors = match accessor.width {
                4 => accessor.floats()?,
                _ => accessor.floats::<3>()?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect(),
            };
            same("COLOR_0", g.colors.len())?;
        }
        self.morph(p, pose, &mut g)?;
        self.skin(&attributes, pose, &mut g)?;
        match g.positions.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            Some(v) => Err(attributes.problem(format!("vertex {v} is moved beyond single precision"))),
            None => Ok(g),
        }
    }

    /// Adds morph targets by their weights.
    fn morph(&mut self, p: &Json<'d>, pose: &Pose, g: &mut Geometry) -> Result<()> {
        let targets = p.list("targets")?;
        for (target, &weight) in targets.iter().zip(&pose.weights) {
            if weight == 0.0 {
                continue;
            }
            let add = |key: &str, into: &mut dyn FnMut(usize, [f32; 3]), have: usize| -> Result<()> {
                if target.get(key).is_none() || have == 0 {
                    return Ok(());
                }
                let deltas = self.accessor(target, key)?.floats::<3>()?;
                if deltas.len() != have {
                    let message = format!("{} values of {key} for {have} vertices", deltas.len());
                    return Err(target.problem(message));
                }
                deltas.into_iter().enumerate().for_each(|(i, d)| into(i, d.map(|v| v * weight)));
                Ok(())
            };
            let n = g.positions.len();
            let sum = |to: &mut [f32; 3], d: [f32; 3]| (0..3).for_each(|k| to[k] += d[k]);
            add("POSITION", &mut |i, d| sum(&mut g.positions[i], d), n)?;
            let n = g.normals.len();
            add("NORMAL", &mut |i, d| sum(&mut g.normals[i], d), n)?;
            let n = g.tangents.len();
            add("TANGENT", &mut |i, d| (0..3).for_each(|k| g.tangents[i][k] += d[k]), n)?;
        }
        Ok(())
    }
}

/// Triangles from a list of vertices: apart, as a strip, or as a fan.
fn triangles(order: &[u32], mode: usize) -> Vec<[u32; 3]> {
    match mode {
        4 => order.as_chunks::<3>().0.to_vec(),
        5 => order.windows(3).enumerate().map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]]).collect(),
        _ => order.get(1..).unwrap_or(&[]).windows(2).map(|w| [w[0], w[1], order[0]]).collect(),
    }
}

/// The set of coordinates that normal maps lie in.
fn tangent_set(material: &Json) -> Result<usize> {
    let anisotropy = material.extension("KHR_materials_anisotropy").and_then(|e| e.get("anisotropyTexture"));
    let Some(info) = material.get("normalTexture").or(anisotropy) else { return Ok(0) };
    let own = info.count("texCoord")?.unwrap_or(0);
    match info.extension("KHR_texture_transform") {
        Some(t) => Ok(t.count("texCoord")?.unwrap_or(own)),
        None => Ok(own),
    }
}

impl<'d, 'b> Gltf<'d, 'b> {
    /// The accessor that a member names.
    pub(super) fn accessor(&self, at: &Json, key: &str) -> Result<super::accessor::Accessor<'d, 'b>> {
        let index = at.need(key)?.as_count()?;
        let json = self
            .accessors
            .get(index)
            .cloned()
            .ok_or_else(|| missing(at, key, "accessor", index, self.accessors.len()))?;
        super::accessor::Accessor::new(json, self.buffers.clone())
    }
}
