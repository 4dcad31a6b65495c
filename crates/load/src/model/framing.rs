//! A camera that shows the whole of a model: from the front right and a little above, as close as it fits.

use steradian_math::{Bounds3, Point3, Transform, Vec3, atan, radians, sin_cos, tan};
use steradian_scene::{Camera, Object, Projection, Scene, Shape};

/// Angles of the default view, in degrees.
const AZIMUTH: f32 = 32.0;
const ELEVATION: f32 = 16.0;
const FOV: f32 = 26.0;
/// The share of the picture that the model fills.
const FILL: f32 = 0.82;
/// Enough points to know an outline by.
const MOST_POINTS: usize = 200_000;

/// Points of everything in the scene, in world space: of meshes some vertices, of other things the corners of boxes.
pub(super) fn points(scene: &Scene) -> Vec<Point3> {
    let total: usize = scene.triangle_meshes.iter().map(|m| m.positions.len()).sum();
    let step = (total / MOST_POINTS).max(1);
    let mut out = Vec::new();
    for p in &scene.primitives {
        let t = p.world_from_object;
        if let Shape::Triangles(mesh) = &p.shape {
            let mesh = &scene.triangle_meshes[*mesh];
            out.extend(mesh.positions.iter().step_by(step).map(|&q| t.point(q)));
            // Whatever is left out, the box is not.
            out.extend(
                corners(&boxed(mesh.positions.iter().copied())).map(|q| t.point(q)).into_iter().filter(|_| step > 1),
            );
        }
    }
    let boxes: Vec<Bounds3> = scene.objects.iter().map(|o| of_object(scene, o)).collect();
    for i in &scene.instances {
        let b = &boxes[i.object.index()];
        if !b.is_empty() {
            for t in [i.world_from_object.start, i.world_from_object.end] {
                out.extend(corners(b).map(|q| t.point(q)));
            }
        }
    }
    out
}

fn of_object(scene: &Scene, o: &Object) -> Bounds3 {
    o.primitives.iter().fold(Bounds3::default(), |b, p| match &p.shape {
        Shape::Triangles(m) => {
            let mesh = &scene.triangle_meshes[*m];
            mesh.positions.iter().fold(b, |b, &q| b.union_point(p.world_from_object.point(q)))
        }
        _ => b,
    })
}

pub(super) fn boxed(points: impl Iterator<Item = Point3>) -> Bounds3 {
    points.fold(Bounds3::default(), Bounds3::union_point)
}

fn corners(b: &Bounds3) -> [Point3; 8] {
    std::array::from_fn(|i| b.corner(i))
}

/// The default camera around these points; `world_from_stage` has its y axis up and its z axis to the front.
pub(super) fn frame(points: &[Point3], world_from_stage: &Transform, turn: f32, aspect: f32) -> Option<Camera> {
    let (sin_a, cos_a) = sin_cos(radians(AZIMUTH + turn));
    let (sin_e, cos_e) = sin_cos(radians(ELEVATION));
    // Towards the camera.
    let back = world_from_stage.vector(Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)).normalize();
    let up = world_from_stage.vector(Vec3::new(0.0, 1.0, 0.0));
    let right = up.cross(back).normalize();
    let upright = back.cross(right);
    let half = tan(radians(FOV / 2.0));
    let (half_x, half_y) = (half * aspect.max(1.0) * FILL, half / aspect.min(1.0) * FILL);
    let b = boxed(points.iter().copied());
    let mut target = b.centroid();
    let size = b.diagonal().length().max(1e-6);
    let mut distance = size;
    for _ in 0..8 {
        // As far as needed for every point, then shifted so that the margins are equal.
        let local = |p: &Point3| {
            let d = *p - target;
            (d.dot(right), d.dot(upright), d.dot(back))
        };
        distance = points
            .iter()
            .map(|p| {
                let (x, y, z) = local(p);
                z + (x.abs() / half_x).max(y.abs() / half_y)
            })
            .fold(size * 1e-3, f32::max);
        let mut span = [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::NEG_INFINITY];
        for p in points {
            let (x, y, z) = local(p);
            let depth = (distance - z).max(size * 1e-4);
            let (x, y) = (x / depth, y / depth);
            span = [span[0].min(x), span[1].max(x), span[2].min(y), span[3].max(y)];
        }
        let depth = distance;
        target = target + right * (0.5 * (span[0] + span[1]) * depth) + upright * (0.5 * (span[2] + span[3]) * depth);
    }
    let eye = target + back * distance;
    let world_from_camera = crate::gltf::look(eye, -back, up)?;
    let fov = 2.0 * atan(half).to_degrees();
    Some(Camera {
        projection: Projection::Perspective { fov },
        world_from_camera: world_from_camera.into(),
        ..Camera::default()
    })
}
