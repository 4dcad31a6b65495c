//! `KHR_lights_punctual`: lights without a surface, where their nodes are.

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::nodes::Placed;
use steradian_math::{AnimatedTransform, Frame, Point3, Transform, Vec3, cos};
use steradian_scene::Light;
use steradian_spectrum::{ColorSpace, Spectrum};

impl Gltf<'_, '_> {
    /// Puts the light of a node into the scene. It shines along -z of the node, whose scale means nothing to it.
    pub(super) fn punctual(&mut self, e: &Json, placed: &Placed) -> Result<()> {
        let lights = match self.root.extension("KHR_lights_punctual") {
            Some(e) => e.list("lights")?,
            None => Vec::new(),
        };
        let index = e.need("light")?.as_count()?;
        let json = lights.get(index).ok_or_else(|| missing(e, "light", "light", index, lights.len()))?;
        if json.get("range").is_some() {
            self.approximate("KHR_lights_punctual: lights reach beyond their `range`, as light does");
        }
        let [start, end] = placed.world;
        let light = if start == end {
            let Some(world_from_light) = along(&start) else { return Ok(()) };
            light(json, &world_from_light)?
        } else {
            let [Some(start), Some(end)] = [start, end].map(|w| turned(&w)) else { return Ok(()) };
            let light = Box::new(light(json, &Transform::IDENTITY)?);
            Light::Moving { light, world_from_light: AnimatedTransform::new(start, 0.0, end, 1.0) }
        };
        self.lights += 1;
        self.scene.lights.push(light);
        Ok(())
    }
}

/// The place of a node, and the direction of its -z axis as z.
fn along(node: &Transform) -> Option<Transform> {
    placed(node, &Frame::from_z(axis(node)?))
}

/// The same, turned about z as the node is, so that what lies between two of them does not roll.
fn turned(node: &Transform) -> Option<Transform> {
    let z = axis(node)?;
    let x = node.vector(Vec3::new(0.0, 1.0, 0.0)).cross(z).try_normalize()?;
    placed(node, &Frame { x, y: z.cross(x), z })
}

fn axis(node: &Transform) -> Option<Vec3> {
    node.vector(Vec3::new(0.0, 0.0, -1.0)).try_normalize()
}

fn placed(node: &Transform, frame: &Frame) -> Option<Transform> {
    let o = node.point(Point3::default());
    let row = |i: usize| [frame.x[i], frame.y[i], frame.z[i], o[i]];
    Transform::from_matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}

/// The light that shines along z of a space.
fn light(json: &Json, world_from_light: &Transform) -> Result<Light> {
    let rgb: [f32; 3] = json.numbers("color")?.unwrap_or([1.0; 3]);
    if rgb.iter().any(|&v| v < 0.0) {
        return Err(json.need("color")?.problem("must not be negative"));
    }
    let spectrum = Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb);
    let scale = json.amount("intensity", 1.0)? / ColorSpace::Srgb.photometric();
    let kind = json.need("type")?;
    Ok(match kind.as_str()? {
        "point" => Light::Point { position: world_from_light.point(Point3::default()), intensity: spectrum, scale },
        "directional" => {
            let to_light = -world_from_light.vector(Vec3::new(0.0, 0.0, 1.0));
            Light::Distant { to_light, radiance: spectrum, scale }
        }
        "spot" => {
            let spot = json.get("spot");
            let angle = |key: &str, absent: f32| spot.as_ref().map_or(Ok(absent), |s| s.amount(key, absent));
            let inner = angle("innerConeAngle", 0.0)?;
            let outer = angle("outerConeAngle", std::f32::consts::FRAC_PI_4)?;
            if !(inner <= outer && outer <= std::f32::consts::PI) {
                return Err(json.problem(format!("a cone from {inner} to {outer} is none")));
            }
            Light::Spot {
                world_from_light: *world_from_light,
                intensity: spectrum,
                scale,
                cos_end: cos(outer),
                cos_start: cos(inner.min(outer - 1e-4).max(0.0)),
            }
        }
        other => return Err(kind.problem(format!("`{other}` is none of point, spot and directional"))),
    })
}
