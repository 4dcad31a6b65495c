//! The tree of nodes: where meshes, cameras and lights are, and how they move while the shutter is open.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::meshes::{Part, Pose};
use super::skins::{Rows, multiply, rows};
use std::collections::BTreeMap;
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3};
use steradian_scene::{Handle, Instance, Object};

/// More instances of one node than this are a mistake.
const MOST_INSTANCES: usize = 1 << 24;

/// Translation, rotation (x, y, z, w), scale, or a matrix instead.
#[derive(Clone, Debug)]
pub(super) struct Local {
    pub translation: [f32; 3],
    pub rotation: [f32; 4],
    pub scale: [f32; 3],
    pub matrix: Option<[f32; 16]>,
    pub weights: Option<Vec<f32>>,
}

impl Local {
    pub fn read(node: &Json) -> Result<Local> {
        let weights = match node.get("weights") {
            None => None,
            Some(w) => Some(w.items()?.iter().map(|v| v.as_number()).collect::<Result<_>>()?),
        };
        Ok(Local {
            translation: node.numbers("translation")?.unwrap_or([0.0; 3]),
            rotation: node.numbers("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            scale: node.numbers("scale")?.unwrap_or([1.0; 3]),
            matrix: match node.get("matrix") {
                None => None,
                Some(m) => affine(&m, node.numbers("matrix")?)?,
            },
            weights,
        })
    }

    /// None where everything is squeezed to nothing.
    pub fn transform(&self) -> Option<Transform> {
        let [x, y, z] = self.rows();
        Transform::from_matrix([x, y, z, [0.0, 0.0, 0.0, 1.0]])
    }

    fn rows(&self) -> Rows {
        match &self.matrix {
            Some(m) => std::array::from_fn(|r| std::array::from_fn(|c| m[4 * c + r])),
            None => compose(self.translation, self.rotation, self.scale),
        }
    }
}

/// A matrix that moves points and does not project them.
fn affine(at: &Json, matrix: Option<[f32; 16]>) -> Result<Option<[f32; 16]>> {
    let last = matrix.map(|m| [m[3], m[7], m[11], m[15] - 1.0]);
    match last {
        Some(last) if last.iter().any(|v| v.abs() > 1e-4) => {
            Err(at.problem("its last row, which is every fourth number, must be 0 0 0 1"))
        }
        _ => Ok(matrix),
    }
}

/// A matrix from its parts. What is flat in one direction is given a thickness that nobody sees: it has a surface all the same.
fn compose(t: [f32; 3], [x, y, z, w]: [f32; 4], s: [f32; 3]) -> Rows {
    let l = (x * x + y * y + z * z + w * w).sqrt();
    let [x, y, z, w] = if l > 0.0 { [x / l, y / l, z / l, w / l] } else { [0.0, 0.0, 0.0, 1.0] };
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let is_flat = s.iter().filter(|v| **v == 0.0).count() == 1;
    let thin = s.iter().fold(0.0f32, |a, v| a.max(v.abs())) * 1e-5;
    let s = s.map(|v| if is_flat && v == 0.0 { thin } else { v });
    std::array::from_fn(|i| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]])
}

/// A node in its place, at the opening and at the closing of the shutter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub node: usize,
    pub world: [Transform; 2],
}

impl Placed {
    fn animated(&self, inner: &Transform) -> AnimatedTransform {
        let [a, b] = self.world.map(|w| w.mul(inner));
        if self.moves() { AnimatedTransform::new(a, 0.0, b, 1.0) } else { a.into() }
    }

    fn moves(&self) -> bool {
        self.world[0] != self.world[1]
    }
}

/// A camera of the file.
#[derive(Clone, Debug)]
pub(super) struct FoundCamera<'d> {
    pub name: String,
    pub json: Json<'d>,
    pub placed: Placed,
}

impl<'d> Gltf<'d, '_> {
    /// Every node that the scene shows, in its place.
    pub(super) fn place(&mut self) -> Result<Vec<Placed>> {
        let roots = self.roots()?;
        let mut seen = vec![false; self.nodes.len()];
        let mut out = Vec::new();
        let mut stack: Vec<(usize, Option<[Transform; 2]>, Rows)> =
            roots.into_iter().rev().map(|n| (n, Some([Transform::IDENTITY; 2]), rows(&Transform::IDENTITY))).collect();
        while let Some((n, parent, above)) = stack.pop() {
            let json = self.nodes[n].clone();
            if std::mem::replace(&mut seen[n], true) {
                return Err(json.problem("the node is its own ancestor, or the child of two nodes"));
            }
            let visibility = json.extension("KHR_node_visibility").and_then(|e| e.get("visible"));
            if visibility.is_some_and(|v| v.is_false()) {
                continue;
            }
            let world = match (parent, [0, 1].map(|k| self.locals[k][n].transform())) {
                (Some(parent), [Some(a), Some(b)]) => Some([parent[0].mul(&a), parent[1].mul(&b)]),
                _ => None,
            };
            let place = world.map_or_else(|| multiply(&above, &self.locals[0][n].rows()), |w| rows(&w[0]));
            let reaches = world.is_none_or(|w| w.iter().all(finite));
            if !reaches || place.iter().flatten().any(|v| !v.is_finite()) {
                return Err(json.problem("its transform, with those above it, is beyond single precision"));
            }
            self.joint_places.insert(n, place);
            match world {
                Some(world) => out.push(Placed { node: n, world }),
                // Where a skin is, its joints say.
                None if json.get("skin").is_some() => out.push(Placed { node: n, world: [Transform::IDENTITY; 2] }),
                None => {
                    let shows = ["mesh", "camera"].iter().any(|key| json.get(key).is_some());
                    self.squeezed += usize::from(shows || json.extension("KHR_lights_punctual").is_some());
                }
            }
            for child in json.list("children")?.iter().rev() {
                let c = child.as_count()?;
                if c >= self.nodes.len() {
                    let message = format!("refers to node {c}, but there are only {}", self.nodes.len());
                    return Err(child.problem(message));
                }
                stack.push((c, world, place));
            }
        }
        Ok(out)
    }

    /// The nodes at the top of the scene that is shown.
    fn roots(&mut self) -> Result<Vec<usize>> {
        let scenes = self.root.list("scenes")?;
        if scenes.is_empty() {
            // Without scenes everything is shown that is nobody's child.
            let mut child = vec![false; self.nodes.len()];
            for node in &self.nodes {
                for c in node.list("children")? {
                    if let Some(c) = child.get_mut(c.as_count()?) {
                        *c = true;
                    }
                }
            }
            let roots: Vec<usize> = (0..self.nodes.len()).filter(|&n| !child[n]).collect();
            if roots.is_empty() && !self.nodes.is_empty() {
                return Err(self.root.need("nodes")?.problem("every node is the child of another, in circles"));
            }
            return Ok(roots);
        }
        let index = self.root.count("scene")?.unwrap_or(0);
        let scene = scenes.get(index).ok_or_else(|| missing(&self.root, "scene", "scene", index, scenes.len()))?;
        scene
            .list("nodes")?
            .iter()
            .map(|n| {
                let i = n.as_count()?;
                if i < self.nodes.len() { Ok(i) } else { Err(missing(n, "", "node", i, self.nodes.len())) }
            })
            .collect()
    }

    /// Puts meshes, lights and cameras into the scene.
    pub(super) fn populate(&mut self, placed: &[Placed]) -> Vec<FoundCamera<'d>> {
        let mut cameras = Vec::new();
        let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
        let mut repeated: Vec<Vec<Transform>> = Vec::new();
        for p in placed {
            let json = self.nodes[p.node].clone();
            let copies = self.instancing(&json, &p.world).unwrap_or_else(|e| {
                self.report(e);
                Vec::new()
            });
            if let Ok(Some(mesh)) = json.count("mesh") {
                *uses.entry(mesh).or_default() += copies.len();
            }
            repeated.push(copies);
        }
        let mut objects = BTreeMap::new();
        for (p, copies) in placed.iter().zip(&repeated) {
            let result = self.node(p, copies, &uses, &mut objects, &mut cameras);
            if let Err(e) = result {
                self.report(e);
            }
        }
        cameras
    }

    fn node(
        &mut self,
        p: &Placed,
        copies: &[Transform],
        uses: &BTreeMap<usize, usize>,
        objects: &mut BTreeMap<usize, Handle<Object>>,
        cameras: &mut Vec<FoundCamera<'d>>,
    ) -> Result<()> {
        let json = self.nodes[p.node].clone();
        if let Some(index) = json.count("camera")? {
            let all = self.root.list("cameras")?;
            let camera = all.get(index).cloned().ok_or_else(|| missing(&json, "camera", "camera", index, all.len()))?;
            let name = json.text("name")?.or(camera.text("name")?).unwrap_or("").to_string();
            cameras.push(FoundCamera { name, json: camera, placed: *p });
        }
        if let Some(e) = json.extension("KHR_lights_punctual") {
            self.punctual(&e, p)?;
        }
        let Some(mesh) = json.count("mesh")? else { return Ok(()) };
        let Some(mesh_json) = self.meshes.get(mesh).cloned() else {
            return Err(missing(&json, "mesh", "mesh", mesh, self.meshes.len()));
        };
        let weights = match &self.locals[0][p.node].weights {
            Some(w) => w.clone(),
            None => mesh_json.list("weights")?.iter().map(|w| w.as_number()).collect::<Result<_>>()?,
        };
        let joints = match json.count("skin")? {
            Some(skin) => self.joints(&json, skin)?,
            None => Vec::new(),
        };
        let (skinned, morphed) = (!joints.is_empty(), weights.iter().any(|&w| w != 0.0));
        let pose = Pose { weights, joints };
        if skinned {
            // Joints place a skin; its own node does not.
            let parts = self.parts(mesh, &pose);
            self.scene.primitives.extend(parts.iter().map(|part| part.primitive(Transform::IDENTITY)));
            return Ok(());
        }
        let alone = morphed || uses.get(&mesh) == Some(&1);
        if alone && copies.len() == 1 && !p.moves() {
            let world = p.world[0].mul(&copies[0]);
            let parts = self.parts(mesh, &pose);
            self.scene.primitives.extend(parts.iter().map(|part| part.primitive(world)));
            return Ok(());
        }
        let object = match objects.get(&mesh).filter(|_| !morphed) {
            Some(object) => *object,
            None => {
                let parts: Vec<Part> = self.parts(mesh, &pose);
                let primitives = parts.iter().map(|part| part.primitive(Transform::IDENTITY)).collect();
                let name = mesh_json.text("name")?.unwrap_or("").to_string();
                let object = self.scene.objects.push(Object { name, primitives, instances: Vec::new() });
                if !morphed {
                    objects.insert(mesh, object);
                }
                object
            }
        };
        let instance = |t: &Transform| Instance { object, world_from_object: p.animated(t) };
        self.scene.instances.extend(copies.iter().map(instance));
        Ok(())
    }

    /// `EXT_mesh_gpu_instancing`: where the copies of a node's mesh are; one without it.
    fn instancing(&mut self, node: &Json, world: &[Transform; 2]) -> Result<Vec<Transform>> {
        let Some(e) = node.extension("EXT_mesh_gpu_instancing") else { return Ok(vec![Transform::IDENTITY]) };
        let attributes = e.need("attributes")?;
        let mut count = None;
        let mut of = |key: &str| -> Result<Option<super::accessor::Accessor>> {
            if attributes.get(key).is_none() {
                return Ok(None);
            }
            let a = self.accessor(&attributes, key)?;
            let n = *count.get_or_insert(a.count);
            if n != a.count || n > MOST_INSTANCES {
                return Err(a.problem(format!("{} copies where others have {n}, or too many", a.count)));
            }
            Ok(Some(a))
        };
        let t = of("TRANSLATION")?.map(|a| a.floats::<3>()).transpose()?;
        let r = of("ROTATION")?.map(|a| a.floats::<4>()).transpose()?;
        let s = of("SCALE")?.map(|a| a.floats::<3>()).transpose()?;
        // Others than these three are counted too; what they say is the application's.
        if let Some(first) = attributes.keys().first() {
            of(first)?;
        }
        let count = count.ok_or_else(|| attributes.problem("no attribute says how many copies there are"))?;
        let mut copies = Vec::with_capacity(count);
        for i in 0..count {
            let local = Local {
                translation: t.as_ref().map_or([0.0; 3], |t| t[i]),
                rotation: r.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]),
                scale: s.as_ref().map_or([1.0; 3], |s| s[i]),
                matrix: None,
                weights: None,
            };
            match local.transform() {
                None => self.squeezed += 1,
                Some(copy) if world.iter().all(|w| finite(&w.mul(&copy))) => copies.push(copy),
                Some(_) => return Err(e.problem(format!("copy {i} is beyond single precision"))),
            }
        }
        Ok(copies)
    }
}

fn finite(t: &Transform) -> bool {
    let o = t.point(Point3::default());
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    o.is_finite() && axes.iter().all(|&a| t.vector(a).length_squared().is_finite())
}
