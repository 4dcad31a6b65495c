//! The camera of a world as the page sees it, and as a scene file says it.

use crate::stage::Options;
use serde_json::{Value, json};
use steradian_math::{Point3, Vec3, powf};
use steradian_scene::{Camera, Projection, World};

/// Units of the world in one of the camera's, along its axes.
pub(crate) fn scale(camera: &Camera) -> f32 {
    let size = powf(camera.world_from_camera.at(camera.shutter[0]).determinant3().abs(), 1.0 / 3.0);
    if (size - 1.0).abs() < 1e-5 || !size.is_finite() || size <= 0.0 { 1.0 } else { size }
}

fn name(projection: &Projection) -> &'static str {
    match projection {
        Projection::Perspective { .. } => "perspective",
        Projection::Orthographic => "orthographic",
        Projection::Spherical { .. } => "spherical",
        Projection::Realistic { .. } => "realistic",
    }
}

/// Where it stands and how it looks, at the opening of the shutter.
pub(crate) fn describe(world: &World) -> Value {
    let camera = &world.scene().camera;
    let t = camera.world_from_camera.at(camera.shutter[0]);
    let axis = |x: f32, y: f32, z: f32| t.vector(Vec3::new(x, y, z)).normalize();
    let three = |v: Vec3| [v.x, v.y, v.z];
    let bounds = world.bounds();
    let diagonal = (bounds.max - bounds.min).length();
    json!({
        "eye": three(t.point(Point3::default()) - Point3::default()),
        "forward": three(axis(0.0, 0.0, 1.0)), "up": three(axis(0.0, 1.0, 0.0)), "right": three(axis(1.0, 0.0, 0.0)),
        "projection": name(&camera.projection),
        "fov": match camera.projection { Projection::Perspective { fov } => Some(fov), _ => None },
        "lens_radius": camera.lens_radius, "focal_distance": camera.focal_distance, "shutter": camera.shutter,
        "scale": scale(camera), "animated": camera.world_from_camera.is_animated(), "moving": world.has_motion(),
        "size": if diagonal.is_finite() { diagonal } else { 1.0 },
    })
}

/// The camera in the words of a pbrt-v4 scene.
pub(crate) fn as_pbrt(world: &World, options: &Options) -> String {
    let camera = &world.scene().camera;
    let t = camera.world_from_camera.at(camera.shutter[0]);
    let (size, mirrored) = (scale(camera), t.swaps_handedness());
    let mut out = String::new();
    if size != 1.0 || mirrored {
        let x = if mirrored { -1.0 / size } else { 1.0 / size };
        out += &format!("Scale {x} {0} {0}\n", 1.0 / size);
    }
    let numbers = match options.get("look-at") {
        Some(typed) => typed.replace(',', " "),
        None => {
            let eye = t.point(Point3::default());
            let target = eye + t.vector(Vec3::new(0.0, 0.0, 1.0)).normalize();
            let up = t.vector(Vec3::new(0.0, 1.0, 0.0)).normalize();
            let all = [eye.x, eye.y, eye.z, target.x, target.y, target.z, up.x, up.y, up.z];
            all.map(|v| v.to_string()).join(" ")
        }
    };
    out += &format!("LookAt {numbers}\nCamera \"{}\"", name(&camera.projection));
    let mut add = |name: &str, value: &str| out += &format!(" \"float {name}\" {value}");
    if let Projection::Perspective { fov } = camera.projection {
        add("fov", &fov.to_string());
    }
    if camera.lens_radius > 0.0 {
        add("lensradius", &camera.lens_radius.to_string());
        add("focaldistance", &camera.focal_distance.to_string());
    }
    add("shutteropen", &camera.shutter[0].to_string());
    add("shutterclose", &camera.shutter[1].to_string());
    if let Some(window) = camera.screen_window {
        add("screenwindow", &format!("[{}]", window.map(|v| v.to_string()).join(" ")));
    }
    if let Some(aspect) = camera.frame_aspect_ratio {
        add("frameaspectratio", &aspect.to_string());
    }
    out.push('\n');
    out
}
