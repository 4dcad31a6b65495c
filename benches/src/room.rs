//! A room seen from its open side: five walls, a lamp, and either two boxes or twenty bumpy spheres of as many triangles as wanted.

use steradian_geometry::{Accel, InputTriangle};
use steradian_math::{Frame, PI, Point3, Ray, Vec3, cos, sin, sin_cos};
use steradian_sampling::Rng;
use steradian_sampling::warp::square_to_cosine_hemisphere;

/// Three corners.
pub type Corners = [Point3; 3];

/// Rays along one side of the picture.
const SIDE: usize = 512;
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

/// The triangles as a tree takes them.
pub fn input(triangles: &[Corners]) -> Vec<InputTriangle> {
    triangles.iter().zip(0..).map(|(&p, id)| InputTriangle { p, id, filtered: false }).collect()
}

/// Rays from the eye, one diffuse bounce from where they hit, and from there towards the lamp.
pub fn rays(accel: &Accel, triangles: &[Corners]) -> [Vec<Ray>; 3] {
    let mut rng = Rng::new(1, 0);
    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|i| {
            let (x, y) = ((i % SIDE) as f32 + rng.f32(), (i / SIDE) as f32 + rng.f32());
            let d = Vec3::new(x / SIDE as f32 * 2.0 - 1.0, 1.0 - y / SIDE as f32 * 2.0, 2.0).normalize();
            Ray::new(EYE, d, 0.0)
        })
        .collect();
    let (mut diffuse, mut shadow) = (Vec::new(), Vec::new());
    for ray in &primary {
        if let Some(h) = accel.closest(ray, |_, _| None, |_, _, _, _| true) {
            let p = triangles[h.id as usize];
            let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize().face_forward(-ray.d);
            let o = ray.at(h.t) + n * 1e-4;
            let local = square_to_cosine_hemisphere(rng.f32_2d());
            diffuse.push(Ray::new(o, Frame::from_z(n).from_local(local), 0.0));
            shadow.push(Ray { t_max: 0.999, ..Ray::new(o, LAMP - o, 0.0) });
        }
    }
    [primary, diffuse, shadow]
}
