//! Cameras of a glTF asset.

use super::Gltf;
use super::json::{Problem, Result};
use super::nodes::FoundCamera;
use crate::model::ModelOptions;
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3, atan, tan};
use steradian_scene::{Camera, FilmSettings, Projection};

/// About as many pixels as a picture has if a camera states its proportions only.
const PIXELS: f32 = 1024.0 * 768.0;

impl Gltf<'_, '_> {
    /// Takes the first camera, or the one that was asked for; whether there is one.
    pub(super) fn choose_camera(&mut self, cameras: &[FoundCamera], options: &ModelOptions) -> Result<bool> {
        let chosen = match &options.camera {
            None => cameras.first(),
            Some(wanted) => {
                let by_number = wanted.parse::<usize>().ok().and_then(|i| cameras.get(i));
                let found = cameras.iter().find(|c| c.name == *wanted).or(by_number);
                if found.is_none() {
                    let names: Vec<String> =
                        cameras.iter().enumerate().map(|(i, c)| format!("{i} {}", c.name)).collect();
                    let hint = if names.is_empty() {
                        "there are none".into()
                    } else {
                        format!("there are {}", names.join(", "))
                    };
                    return Err(Problem { hint: Some(hint), ..self.root.problem(format!("no camera `{wanted}`")) });
                }
                found
            }
        };
        let Some(found) = chosen else { return Ok(false) };
        let json = &found.json;
        let kind = json.need("type")?;
        let world = found.placed.world.map(|t| upright(&t));
        let [Some(start), Some(end)] = world else {
            return Err(json.problem("the camera's node has no direction"));
        };
        let mut camera =
            Camera { world_from_camera: AnimatedTransform::new(start, 0.0, end, 1.0), ..Camera::default() };
        let aspect;
        // Width over height, if the picture's size is known.
        let wanted = options.size.map(|[w, h]| w as f32 / h as f32);
        match kind.as_str()? {
            "perspective" => {
                let p = json.need("perspective")?;
                let y = p.need("yfov")?;
                let yfov = y.as_number()?;
                if !(yfov > 0.0 && yfov < std::f32::consts::PI) {
                    return Err(y.problem("must be between 0 and pi"));
                }
                let stated = p.get("aspectRatio").map(|a| a.as_number()).transpose()?.filter(|a| *a > 0.0);
                aspect = wanted.or(stated);
                // The scene's angle is along the shorter side.
                let narrow = aspect.unwrap_or(4.0 / 3.0).min(1.0);
                let fov = 2.0 * atan(tan(yfov / 2.0) * narrow);
                camera.projection = Projection::Perspective { fov: fov.to_degrees() };
            }
            "orthographic" => {
                let p = json.need("orthographic")?;
                let (x, y) = (p.need("xmag")?.as_number()?.abs(), p.need("ymag")?.as_number()?.abs());
                if x == 0.0 || y == 0.0 {
                    return Err(p.problem("`xmag` and `ymag` must not be zero"));
                }
                let x = wanted.map_or(x, |a| y * a);
                aspect = Some(x / y);
                camera.projection = Projection::Orthographic;
                camera.screen_window = Some([-x, x, -y, y]);
            }
            other => return Err(kind.problem(format!("`{other}` is neither perspective nor orthographic"))),
        }
        let aspect = aspect.unwrap_or(4.0 / 3.0).clamp(0.1, 10.0);
        let side = |v: f32| (v.round() as u32).max(1);
        let filename = std::mem::take(&mut self.scene.settings.film.filename);
        let film = FilmSettings::new(side((PIXELS * aspect).sqrt()), side((PIXELS / aspect).sqrt()));
        self.scene.settings.film = FilmSettings { filename, ..film };
        self.scene.settings.sampler.resolution = self.scene.settings.film.resolution;
        self.scene.camera = camera;
        Ok(true)
    }
}

/// A camera looks along -z of its node, whose scale means nothing to it.
fn upright(node: &Transform) -> Option<Transform> {
    let eye = node.point(Point3::default());
    let forward = node.vector(Vec3::new(0.0, 0.0, -1.0)).try_normalize()?;
    let up = node.vector(Vec3::new(0.0, 1.0, 0.0));
    look(eye, forward, up)
}

/// The transform of a camera at `eye` that looks along `forward`.
pub(crate) fn look(eye: Point3, forward: Vec3, up: Vec3) -> Option<Transform> {
    let right = forward.cross(up).try_normalize()?;
    let up = right.cross(forward);
    let row = |i: usize| [right[i], up[i], forward[i], eye[i]];
    Transform::from_matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}
