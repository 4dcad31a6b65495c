//! The camera as a receiver: where on the film a point is seen, and how densely camera rays pass there. What light that
//! starts at lamps needs (Veach 1997, 8.3 and 10.3; PBRT 3rd ed., 16.1.1).
//!
//! A pixel is the mean of radiance over its filter, lens and shutter, so a camera's importance is a plain density: of
//! rays per area perpendicular to them, over the area of a pixel. It needs no constants of its own.

use super::camera::{CameraModel, CameraSample};
use crate::Projection;
use steradian_math::{Point2, Point3, Ray, Vec3};

/// A point as a camera sees it through one point of its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reception {
    /// Raster position; it may lie outside the film.
    pub film: Point2,
    /// Unit direction from the point to the camera.
    pub wi: Vec3,
    /// Distance to the camera.
    pub distance: f32,
    /// The point of the lens, or of the film's plane where rays are parallel.
    pub end: Point3,
    /// What radiance from a unit area perpendicular to the ray adds to a pixel of unit filter weight.
    pub importance: f32,
}

impl CameraModel {
    /// Whether the camera can receive light that comes from lamps: pinhole, thin lens and parallel projection.
    pub fn is_receiver(&self) -> bool {
        matches!(self.projection, Projection::Perspective { .. } | Projection::Orthographic)
    }

    /// How the camera sees `p` through the lens point of `sample`, whose film position is not looked at. `None` from
    /// behind, and for cameras that [receive nothing](Self::is_receiver).
    pub fn receive(&self, p: Point3, sample: &CameraSample) -> Option<Reception> {
        let time = self.time_of(sample);
        let t = self.world_from_camera(time);
        let local = t.inverse().point(p);
        if local.z <= 0.0 {
            return None;
        }
        let (lx, ly) = self.lens_point(sample.lens).unwrap_or((0.0, 0.0));
        let (end, on_plane) = match self.projection {
            Projection::Perspective { .. } => {
                // Through the lens point to the plane in focus, and its picture on the plane z = 1.
                let f = if self.has_lens() { self.focal_distance } else { 1.0 };
                let to_focus = f / local.z;
                let x = lx + (local.x - lx) * to_focus;
                let y = ly + (local.y - ly) * to_focus;
                (Point3::new(lx, ly, 0.0), (x / f, y / f))
            }
            Projection::Orthographic => {
                // A lens tilts the parallel rays, all alike.
                let tilt = local.z / self.focal_distance;
                let (x, y) = (local.x + lx * tilt, local.y + ly * tilt);
                (Point3::new(x, y, 0.0), (x - lx, y - ly))
            }
            Projection::Spherical { .. } | Projection::Realistic { .. } => return None,
        };
        let end = t.point(end);
        let d = end - p;
        let distance = d.length();
        let wi = d.try_normalize()?;
        let ray = Ray::new(end, -wi, time);
        let importance = self.density(&ray, distance) * (self.resolution[0] * self.resolution[1]);
        (importance > 0.0 && importance.is_finite()).then(|| Reception {
            film: self.film_position(on_plane),
            wi,
            distance,
            end,
            importance,
        })
    }

    /// The density, per area perpendicular to the ray, of camera rays through one lens point at a distance along `ray`,
    /// if positions are uniform over the whole film. Zero for cameras that [receive nothing](Self::is_receiver).
    pub fn density(&self, ray: &Ray, distance: f32) -> f32 {
        let t = self.world_from_camera(ray.time);
        let [x0, x1, y0, y1] = self.window;
        let window = ((x1 - x0) * (y1 - y0)).abs();
        match self.projection {
            Projection::Perspective { .. } => {
                // 1 / (window cos^3) per solid angle in camera space, carried over by the transform.
                let inverse = t.inverse();
                let z = inverse.vector(ray.d).z;
                let per_solid_angle = inverse.determinant3().abs() / (window * z * z * z);
                if z > 0.0 { per_solid_angle / (distance * distance) } else { 0.0 }
            }
            Projection::Orthographic => {
                let across = t.vector(Vec3::new(1.0, 0.0, 0.0)).cross(t.vector(Vec3::new(0.0, 1.0, 0.0)));
                1.0 / (window * across.dot(ray.d).abs())
            }
            Projection::Spherical { .. } | Projection::Realistic { .. } => 0.0,
        }
    }

    fn film_position(&self, (x, y): (f32, f32)) -> Point2 {
        let [x0, x1, y0, y1] = self.window;
        Point2::new((x - x0) / (x1 - x0) * self.resolution[0], (y - y1) / (y0 - y1) * self.resolution[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Camera;
    use steradian_math::{AnimatedTransform, Transform};

    fn cameras() -> Vec<CameraModel> {
        let t = Transform::look_at(Point3::new(1.0, 2.0, -3.0), Point3::new(0.2, 0.0, 1.0), Vec3::new(0.0, 1.0, 0.2));
        let stretched = t.expect("a view").inverse().mul(&Transform::scale(-1.5, 0.7, 1.2).expect("invertible"));
        let mut out = Vec::new();
        for world_from_camera in [t.expect("a view").inverse(), stretched] {
            for projection in [Projection::Perspective { fov: 50.0 }, Projection::Orthographic] {
                for lens_radius in [0.0, 0.3] {
                    let camera = Camera {
                        projection: projection.clone(),
                        world_from_camera: AnimatedTransform::from(world_from_camera),
                        lens_radius,
                        focal_distance: 4.0,
                        ..Camera::default()
                    };
                    out.push(CameraModel::new(&camera, [60, 40], true));
                }
            }
        }
        out
    }

    #[test]
    fn what_a_ray_meets_is_seen_where_the_ray_came_from() {
        for camera in cameras() {
            for (x, y, lens) in [(3.0, 30.5, [0.2, 0.7]), (55.0, 1.0, [0.9, 0.1]), (30.0, 20.0, [0.5, 0.5])] {
                let sample = CameraSample { film: Point2::new(x, y), lens, time: 0.3 };
                let ray = camera.ray(&sample);
                for distance in [0.7, 5.0, 40.0] {
                    let seen = camera.receive(ray.at(distance), &sample).expect("it is in front");
                    assert!((seen.film.x - x).abs() < 2e-3 && (seen.film.y - y).abs() < 2e-3, "{seen:?}, not {x} {y}");
                    assert!((seen.wi + ray.d).length() < 1e-4 && (seen.distance / distance - 1.0).abs() < 1e-3);
                }
                assert!(camera.receive(ray.at(-1.0), &sample).is_none());
            }
        }
    }

    /// The importance of a small square that faces the ray is its share of the film, in pixels, over its area.
    #[test]
    fn importance_is_pixels_per_area() {
        for camera in cameras() {
            let sample = CameraSample { film: Point2::new(41.0, 13.0), lens: [0.8, 0.3], time: 0.0 };
            let ray = camera.ray(&sample);
            let p = ray.at(3.0);
            let frame = steradian_math::Frame::from_z(ray.d);
            const H: f32 = 0.01;
            let at = |v: Vec3| camera.receive(p + v * H, &sample).expect("in front").film;
            let (u, v) = (at(frame.x) - at(-frame.x), at(frame.y) - at(-frame.y));
            let area = (u.x * v.y - u.y * v.x).abs() / (4.0 * H * H);
            let seen = camera.receive(p, &sample).expect("in front");
            assert!((seen.importance / area - 1.0).abs() < 2e-3, "{} pixels, {}", area, seen.importance);
        }
    }
}
