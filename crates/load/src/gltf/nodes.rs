//! The tree of nodes: where meshes, cameras and lights are, and how they move while the shutter is open.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::meshes::{Part, Pose};
use std::collections::BTreeMap;
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3, cos};
use steradian_scene::{Handle, Instance, Light, Object};
use steradian_spectrum::{ColorSpace, Spectrum};

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
            matrix: node.numbers("matrix")?,
            weights,
        })
    }

    /// None where everything is squeezed to nothing.
    pub fn transform(&self) -> Option<Transform> {
        match &self.matrix {
            Some(m) => Transform::from_column_major(m),
            None => compose(self.translation, self.rotation, self.scale),
        }
    }
}

/// A transform from its parts; none where it cannot be inverted.
pub(super) fn compose(t: [f32; 3], [x, y, z, w]: [f32; 4], s: [f32; 3]) -> Option<Transform> {
    let l = (x * x + y * y + z * z + w * w).sqrt();
    let [x, y, z, w] = if l > 0.0 { [x / l, y / l, z / l, w / l] } else { [0.0, 0.0, 0.0, 1.0] };
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let row = |i: usize| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]];
    Transform::from_matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
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
        let mut stack: Vec<(usize, [Transform; 2])> =
            roots.into_iter().rev().map(|n| (n, [Transform::IDENTITY; 2])).collect();
        while let Some((n, parent)) = stack.pop() {
            let json = self.nodes[n].clone();
            if std::mem::replace(&mut seen[n], true) {
                return Err(json.problem("the node is its own ancestor, or the child of two nodes"));
            }
            let visibility = json.extension("KHR_node_visibility").and_then(|e| e.get("visible"));
            if visibility.is_some_and(|v| v.is_false()) {
                continue;
            }
            let locals = [0, 1].map(|k| self.locals[k][n].transform());
            let [Some(a), Some(b)] = locals else {
                self.squeezed += 1;
                continue;
            };
            let world = [parent[0].mul(&a), parent[1].mul(&b)];
            if !world.iter().all(finite) {
                return Err(json.problem("its transform, with those above it, is beyond single precision"));
            }
            out.push(Placed { node: n, world });
            for child in json.list("children")?.iter().rev() {
                let c = child.as_count()?;
                if c >= self.nodes.len() {
                    let message = format!("refers to node {c}, but there are only {}", self.nodes.len());
                    return Err(child.problem(message));
                }
                stack.push((c, world));
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
                return Err(self.root.problem("every node is the child of another, in circles"));
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
        let world_of: BTreeMap<usize, Placed> = placed.iter().map(|p| (p.node, *p)).collect();
        let mut cameras = Vec::new();
        let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
        let mut repeated: Vec<Vec<Transform>> = Vec::new();
        for p in placed {
            let json = self.nodes[p.node].clone();
            let copies = self.instancing(&json).unwrap_or_else(|e| {
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
            let result = self.node(p, copies, &world_of, &uses, &mut objects, &mut cameras);
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
        world_of: &BTreeMap<usize, Placed>,
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
            self.punctual(&e, &p.world[0])?;
            if p.moves() {
                self.warn_once("lights move", "lights do not move; where they are when the shutter opens is taken");
            }
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
            Some(skin) => self.joints(&json, skin, world_of)?,
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
    fn instancing(&mut self, node: &Json) -> Result<Vec<Transform>> {
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
        let at = |i: usize| {
            compose(
                t.as_ref().map_or([0.0; 3], |t| t[i]),
                r.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]),
                s.as_ref().map_or([1.0; 3], |s| s[i]),
            )
        };
        Ok((0..count.unwrap_or(0)).filter_map(at).collect())
    }

    /// World transforms of the joints of a skin, from the mesh as it was bound.
    fn joints(&mut self, at: &Json, skin: usize, world_of: &BTreeMap<usize, Placed>) -> Result<Vec<Transform>> {
        let skins = self.root.list("skins")?;
        let skin = skins.get(skin).ok_or_else(|| missing(at, "skin", "skin", skin, skins.len()))?;
        let joints = skin.need("joints")?.items()?;
        let bind = match skin.get("inverseBindMatrices") {
            Some(_) => {
                let a = self.accessor(skin, "inverseBindMatrices")?;
                let m = a.floats::<16>()?;
                if m.len() < joints.len() {
                    return Err(a.problem(format!("{} matrices for {} joints", m.len(), joints.len())));
                }
                m
            }
            None => Vec::new(),
        };
        joints
            .iter()
            .enumerate()
            .map(|(i, j)| {
                let node = j.as_count()?;
                let Some(placed) = world_of.get(&node) else {
                    return Err(j.problem(format!("joint {node} is no node of the scene")));
                };
                let world = placed.world[0];
                Ok(match bind.get(i) {
                    Some(m) => Transform::from_column_major(m).map_or(world, |m| world.mul(&m)),
                    None => world,
                })
            })
            .collect()
    }

    /// A light of `KHR_lights_punctual`.
    fn punctual(&mut self, e: &Json, world: &Transform) -> Result<()> {
        let lights = match self.root.extension("KHR_lights_punctual") {
            Some(e) => e.list("lights")?,
            None => Vec::new(),
        };
        let index = e.need("light")?.as_count()?;
        let light = lights.get(index).ok_or_else(|| missing(e, "light", "light", index, lights.len()))?;
        let rgb: [f32; 3] = light.numbers("color")?.unwrap_or([1.0; 3]);
        let spectrum = Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb.map(|v| v.max(0.0)));
        let scale = light.amount("intensity", 1.0)? / ColorSpace::Srgb.photometric();
        if light.get("range").is_some() {
            self.approximate("KHR_lights_punctual: lights reach beyond their `range`, as light does");
        }
        let axis = world.vector(Vec3::new(0.0, 0.0, -1.0)).try_normalize();
        let Some(axis) = axis else { return Ok(()) };
        let kind = light.need("type")?;
        self.lights += 1;
        self.scene.lights.push(match kind.as_str()? {
            "point" => Light::Point { position: world.point(Point3::default()), intensity: spectrum, scale },
            "directional" => Light::Distant { to_light: -axis, radiance: spectrum, scale },
            "spot" => {
                let spot = light.get("spot");
                let angle = |key: &str, absent: f32| spot.as_ref().map_or(Ok(absent), |s| s.amount(key, absent));
                let inner = angle("innerConeAngle", 0.0)?;
                let outer = angle("outerConeAngle", std::f32::consts::FRAC_PI_4)?;
                if !(inner <= outer && outer <= std::f32::consts::PI) {
                    return Err(light.problem(format!("a cone from {inner} to {outer} is none")));
                }
                let frame = steradian_math::Frame::from_z(axis);
                let o = world.point(Point3::default());
                let row = |i: usize| [frame.x[i], frame.y[i], frame.z[i], o[i]];
                let m = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
                let Some(world_from_light) = Transform::from_matrix(m) else { return Ok(()) };
                Light::Spot {
                    world_from_light,
                    intensity: spectrum,
                    scale,
                    cos_end: cos(outer),
                    cos_start: cos(inner.min(outer - 1e-4).max(0.0)),
                }
            }
            other => return Err(kind.problem(format!("`{other}` is none of point, spot and directional"))),
        });
        Ok(())
    }
}

fn finite(t: &Transform) -> bool {
    let o = t.point(Point3::default());
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    o.is_finite() && axes.iter().all(|&a| t.vector(a).length_squared().is_finite())
}
