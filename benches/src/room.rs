//! A room seen from its open side: five walls, a lamp, and either two boxes or twenty bumpy spheres of as many triangles as wanted.

use steradian_math::{PI, Point3, Vec3, cos, sin, sin_cos};
use steradian_sampling::Rng;

/// Three corners.
pub type Corners = [Point3; 3];

/// Where the rays start.
pub const EYE: Point3 = Point3::new(0.0, 0.2, -2.9);
/// Where shadow rays end.
pub const LAMP: Point3 = Point3::new(0.1, 0.98, 0.1);

fn quad(out: &mut Vec<Corners>, q: [Point3; 4]) {
    out.extend([[0, 1, 2], [0, 2, 3]].map(|k| k.map(|k| q[k])));
}

fn cuboid(out: &mut Vec<Corners>, center: Point3, half: Vec3, angle: f32, open: bool) {
    let (s, c) = sin_cos(angle);
    let corner = |i: usize| {
        let [x, y, z] = [1, 2, 4].map(|bit| if i & bit == 0 { -1.0 } else { 1.0 });
        let (x, y, z) = (x * half.x, y * half.y, z * half.z);
        center + Vec3::new(c * x + s * z, y, c * z - s * x)
    };
    let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [4, 5, 7, 6], [0, 1, 3, 2]];
    for f in &faces[..if open { 5 } else { 6 }] {
        quad(out, f.map(corner));
    }
}

fn walls() -> Vec<Corners> {
    let mut t = Vec::new();
    cuboid(&mut t, Point3::default(), Vec3::splat(1.0), 0.0, true);
    quad(&mut t, [[-0.2, 0.99, -0.2], [0.2, 0.99, -0.2], [0.2, 0.99, 0.2], [-0.2, 0.99, 0.2]].map(Point3::from));
    t
}

/// Two boxes in the room: 36 triangles.
pub fn boxes() -> Vec<Corners> {
    let mut t = walls();
    cuboid(&mut t, Point3::new(-0.35, -0.4, 0.3), Vec3::new(0.3, 0.6, 0.3), 0.3, false);
    cuboid(&mut t, Point3::new(0.35, -0.7, -0.2), Vec3::new(0.3, 0.3, 0.3), -0.3, false);
    t
}

/// Twenty bumpy spheres in the room: about `count` triangles.
pub fn blobs(count: usize) -> Vec<Corners> {
    let n = (count as f32 / 80.0).sqrt().round().max(2.0) as usize;
    let mut t = walls();
    t.reserve(80 * n * n);
    let mut rng = Rng::new(7, 0);
    for _ in 0..20 {
        let center = Vec3::new(1.6 * rng.f32() - 0.8, 1.2 * rng.f32() - 0.8, 1.6 * rng.f32() - 0.8);
        let radius = 0.15 + 0.2 * rng.f32();
        let at = |i: usize, j: usize| {
            let (theta, phi) = (i as f32 / n as f32 * PI, j as f32 / n as f32 * PI);
            let r = radius * (1.0 + 0.1 * sin(40.0 * theta) * cos(30.0 * phi));
            (center + Vec3::spherical(sin(theta), cos(theta), phi) * r).to_point()
        };
        for i in 0..n {
            for j in 0..2 * n {
                quad(&mut t, [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    t
}
