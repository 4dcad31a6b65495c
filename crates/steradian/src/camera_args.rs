//! Options that replace the scene's camera: what the live page says when it is moved, typed out.

use std::fmt;
use std::str::FromStr;

use clap::Args;
use steradian_math::{Point3, Transform, Vec3, powf};
use steradian_scene::{Projection, Scene};

use crate::console::Console;

/// The options.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Camera (each replaces what the scene says)")]
pub(crate) struct CameraArgs {
    /// Stand at a point, look at another, with a direction up: nine numbers
    #[arg(long, value_name = "x,y,z,X,Y,Z,u,v,w", allow_hyphen_values = true)]
    pub look_at: Option<LookAt>,

    /// Angle of view along the shorter side of the picture
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    pub fov: Option<f32>,

    /// Radius of the thin lens; 0 is a pinhole
    #[arg(long, value_name = "RADIUS", value_parser = length)]
    pub lens_radius: Option<f32>,

    /// Distance of the plane in focus
    #[arg(long, value_name = "DISTANCE", value_parser = length)]
    pub focal_distance: Option<f32>,

    /// When the shutter opens and closes
    #[arg(long, value_name = "OPEN,CLOSE", allow_hyphen_values = true)]
    pub shutter_interval: Option<Interval>,
}

/// A number that is finite and not negative.
pub(crate) fn length(s: &str) -> Result<f32, String> {
    s.parse::<f32>().ok().filter(|v| *v >= 0.0 && v.is_finite()).ok_or_else(|| "write a number, zero or more".into())
}

fn angle(s: &str) -> Result<f32, String> {
    s.parse::<f32>().ok().filter(|v| *v > 0.0 && *v < 180.0).ok_or_else(|| "write an angle between 0 and 180".into())
}

/// `N` numbers with commas between them.
fn numbers<const N: usize>(s: &str) -> Option<[f32; N]> {
    let all: Vec<f32> = s.split(',').map(|p| p.trim().parse().ok()).collect::<Option<_>>()?;
    all.try_into().ok().filter(|n: &[f32; N]| n.iter().all(|v| v.is_finite()))
}

fn join(numbers: &[f32], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let all: Vec<String> = numbers.iter().map(f32::to_string).collect();
    f.write_str(&all.join(","))
}

/// Where the camera stands, what it looks at, and what is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LookAt(pub [f32; 9]);

impl LookAt {
    /// The camera's transform, if the numbers make one.
    fn transform(&self) -> Option<Transform> {
        let [x, y, z, tx, ty, tz, ux, uy, uz] = self.0;
        Transform::look_at(Point3::new(x, y, z), Point3::new(tx, ty, tz), Vec3::new(ux, uy, uz))
    }
}

impl FromStr for LookAt {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let hint = "write nine numbers: where the camera stands, what it looks at, and which way is up";
        let this = Self(numbers(s).ok_or(hint)?);
        let sound = this.transform().is_some_and(|t| t.determinant3().is_finite());
        if sound {
            Ok(this)
        } else {
            Err("no camera can look like this: its points coincide, or it looks straight up".into())
        }
    }
}

impl fmt::Display for LookAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        join(&self.0, f)
    }
}

/// A span of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval(pub [f32; 2]);

impl FromStr for Interval {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        match numbers::<2>(s) {
            Some([open, close]) if open <= close => Ok(Self([open, close])),
            _ => Err("write two moments, the earlier one first, as in 0,1".into()),
        }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        join(&self.0, f)
    }
}

impl CameraArgs {
    /// Changes the scene's camera.
    pub fn apply(&self, scene: &mut Scene, console: &Console) {
        let camera = &mut scene.camera;
        let thin = matches!(camera.projection, Projection::Perspective { .. } | Projection::Orthographic);
        if let Some(moved) = self.look_at.and_then(|l| l.transform()) {
            // Lengths in camera space, and which hand it has, stay the scene's own.
            let old = camera.world_from_camera.at(camera.shutter[0]);
            let size = powf(old.determinant3().abs(), 1.0 / 3.0);
            let size = if (size - 1.0).abs() < 1e-5 || !size.is_finite() || size <= 0.0 { 1.0 } else { size };
            let right = if old.swaps_handedness() { -size } else { size };
            let scale = Transform::scale(right, size, size).unwrap_or(Transform::IDENTITY);
            camera.world_from_camera = moved.inverse().mul(&scale).into();
        }
        match (self.fov, &mut camera.projection) {
            (Some(new), Projection::Perspective { fov }) => *fov = new,
            (Some(_), _) => console.warning("--fov changes nothing: the camera of the scene has no angle of view"),
            (None, _) => {}
        }
        if (self.lens_radius.is_some() || self.focal_distance.is_some()) && !thin {
            console
                .warning("--lens-radius and --focal-distance change nothing: the camera of the scene has no thin lens");
        }
        camera.lens_radius = self.lens_radius.unwrap_or(camera.lens_radius);
        camera.focal_distance = self.focal_distance.unwrap_or(camera.focal_distance);
        camera.shutter = self.shutter_interval.map_or(camera.shutter, |i| i.0);
    }

    /// The options as they would be typed.
    pub fn as_typed(&self, mut add: impl FnMut(&str, Option<String>)) {
        add("look-at", self.look_at.map(|v| v.to_string()));
        add("fov", self.fov.map(|v| v.to_string()));
        add("lens-radius", self.lens_radius.map(|v| v.to_string()));
        add("focal-distance", self.focal_distance.map(|v| v.to_string()));
        add("shutter-interval", self.shutter_interval.map(|v| v.to_string()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::{FilmSettings, RenderSettings};

    #[test]
    fn what_is_typed_is_what_was_meant() {
        let view: LookAt = "0.1,2.5,-9.2,0,1.12,0,0,1,0".parse().unwrap();
        assert_eq!(view.to_string().parse::<LookAt>().unwrap(), view, "to the last bit");
        for wrong in ["1,2,3", "0,0,0,0,0,0,0,1,0", "0,0,0,0,5,0,0,1,0", "0,0,0,0,0,1,0,nan,0", "a,0,0,0,0,1,0,1,0"] {
            assert!(wrong.parse::<LookAt>().is_err(), "{wrong}");
        }
        assert!("1,0".parse::<Interval>().is_err() && "0,.5".parse::<Interval>().is_ok());
        assert!(angle("180").is_err() && length("-1").is_err() && length("inf").is_err());
    }

    #[test]
    fn a_mirrored_camera_stays_mirrored_and_its_lengths_stay() {
        let settings = steradian_load_settings();
        let mut scene = Scene::new(settings);
        scene.camera.world_from_camera = Transform::scale(-2.0, 2.0, 2.0).unwrap().into();
        let args = CameraArgs { look_at: "0,0,-5,0,0,0,0,1,0".parse().ok(), ..CameraArgs::default() };
        args.apply(&mut scene, &Console::new());
        let t = scene.camera.world_from_camera.at(0.0);
        assert!(t.swaps_handedness() && (t.vector(Vec3::new(0.0, 0.0, 1.0)).length() - 2.0).abs() < 1e-4);
        assert!((t.point(Point3::default()).z + 5.0).abs() < 1e-5);
    }

    fn steradian_load_settings() -> RenderSettings {
        let scene =
            crate::load_text("t", "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\n");
        let mut settings = scene.unwrap().settings;
        settings.film = FilmSettings::new(8, 8);
        settings
    }
}
