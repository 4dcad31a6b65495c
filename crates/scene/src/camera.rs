//! Cameras as the user stated them. `World` holds the built form.

use crate::{Handle, LensSystem, Medium};
use steradian_math::AnimatedTransform;

/// How a spherical camera covers the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphericalMapping {
    /// Clarberg's equal-area octahedral square.
    EqualArea,
    /// Latitude and longitude.
    Equirectangular,
}

/// The projection.
#[derive(Clone, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole or thin lens.
    Perspective {
        /// Full angle along the shorter axis of the image, in degrees.
        fov: f32,
    },
    /// Parallel.
    Orthographic,
    /// All directions.
    Spherical {
        /// Layout of the image.
        mapping: SphericalMapping,
    },
    /// A film behind real lenses. No window, no lens radius and no focal distance apply.
    Realistic {
        /// The lenses, in focus.
        lens: LensSystem,
        /// Diagonal of the film in metres.
        diagonal: f32,
    },
}

/// A camera looking along +z of camera space, y up, x to the right.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The projection.
    pub projection: Projection,
    /// Camera to world space over time.
    pub world_from_camera: AnimatedTransform,
    /// When the shutter opens and closes.
    pub shutter: [f32; 2],
    /// Radius of the thin lens; zero is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus.
    pub focal_distance: f32,
    /// The window on the image plane, x0 x1 y0 y1; by default -1..1 along the shorter axis.
    pub screen_window: Option<[f32; 4]>,
    /// Width over height instead of the film's, where no window is given.
    pub frame_aspect_ratio: Option<f32>,
    /// The medium around the camera.
    pub medium: Option<Handle<Medium>>,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective { fov: 90.0 },
            world_from_camera: steradian_math::Transform::IDENTITY.into(),
            shutter: [0.0, 1.0],
            lens_radius: 0.0,
            focal_distance: 1e6,
            screen_window: None,
            frame_aspect_ratio: None,
            medium: None,
        }
    }
}
