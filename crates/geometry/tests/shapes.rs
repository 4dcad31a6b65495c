//! Every shape against the same list of promises: hits lie on the surface, derivatives are derivatives, samples follow
//! their densities, and rays that leave a surface do not meet it again.
//!
//! Statistical checks use fixed seeds and reject at six standard deviations: a false alarm rate of 2e-9 for each.

use steradian_geometry::{
    BilinearMesh, BilinearPatch, Cylinder, Disk, PlacedQuadric, Quadric, Reference, ShapeSample, Sphere, SurfaceHit,
    TriangleMesh, area_to_solid_angle,
};
use steradian_math::{Normal3, PI, Point3, Ray, Transform, Vec3};
use steradian_sampling::warp::square_to_uniform_sphere;

struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }
    fn direction(&mut self) -> Vec3 {
        square_to_uniform_sphere(self.pair())
    }
}

/// A hit with what is needed to ask for its density.
struct Met {
    t: f32,
    hit: SurfaceHit,
    /// Density per solid angle of the shape's sampling, from a reference.
    pdf: Box<dyn Fn(&Reference) -> f32>,
}

type Intersect = Box<dyn Fn(&Ray) -> Option<Met>>;
type SampleFrom = Box<dyn Fn(&Reference, [f32; 2]) -> Option<ShapeSample>>;
type SampleArea = Box<dyn Fn([f32; 2]) -> Option<ShapeSample>>;

struct Case {
    name: &'static str,
    intersect: Intersect,
    sample: SampleFrom,
    sample_area: SampleArea,
    area: f32,
    bounds: steradian_math::Bounds3,
    /// A ray that leaves on the outside never comes back.
    convex: bool,
    /// Samples by area are uniform.
    uniform: bool,
}

fn placed(name: &'static str, quadric: Quadric, to_world: Transform, convex: bool, uniform: bool) -> Case {
    let shape = PlacedQuadric::new(quadric, to_world, false);
    Case {
        name,
        intersect: Box::new(move |ray| {
            let q = shape.intersect(ray)?;
            let hit = shape.interaction(&q);
            Some(Met { t: q.t, hit, pdf: Box::new(move |from| shape.pdf_solid_angle(from, hit.p, hit.n)) })
        }),
        sample: Box::new(move |from, u| shape.sample_solid_angle(from, u)),
        sample_area: Box::new(move |u| shape.sample_area(u)),
        area: shape.area(),
        bounds: shape.bounds(),
        convex,
        uniform,
    }
}

fn triangle(name: &'static str, p: [[f32; 3]; 3]) -> Case {
    let mesh = TriangleMesh {
        positions: p.map(Point3::from).to_vec(),
        uvs: [[0.1, 0.2], [0.9, 0.1], [0.3, 0.8]].map(|p| p.into()).to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    mesh.validate().unwrap();
    let (m, m2) = (mesh.clone(), mesh.clone());
    let t = mesh.triangle(0);
    Case {
        name,
        intersect: Box::new(move |ray| {
            let h = t.intersect(ray, ray.t_max)?;
            let hit = mesh.interaction(0, h.b1, h.b2);
            Some(Met { t: h.t, hit, pdf: Box::new(move |from| t.pdf_solid_angle(from, hit.p)) })
        }),
        sample: Box::new(move |from, u| m.sample_solid_angle(0, from, u)),
        sample_area: Box::new(move |u| m2.sample_area(0, u)),
        area: t.area(),
        bounds: t.bounds(),
        convex: true,
        uniform: true,
    }
}

fn patch(name: &'static str, p: [[f32; 3]; 4], flat: bool) -> Case {
    let mesh = BilinearMesh {
        positions: p.map(Point3::from).to_vec(),
        indices: vec![[0, 1, 2, 3]],
        ..BilinearMesh::default()
    };
    mesh.validate().unwrap();
    let patch: BilinearPatch = mesh.patch(0);
    let (m, m2) = (mesh.clone(), mesh.clone());
    Case {
        name,
        intersect: Box::new(move |ray| {
            let h = patch.intersect(ray)?;
            let hit = mesh.interaction(0, h.u, h.v);
            Some(Met { t: h.t, hit, pdf: Box::new(move |from| patch.pdf_solid_angle(from, h.u, h.v)) })
        }),
        sample: Box::new(move |from, u| m.sample_solid_angle(0, from, u)),
        sample_area: Box::new(move |u| m2.sample_area(0, u)),
        area: patch.area(),
        bounds: patch.bounds(),
        convex: flat,
        uniform: patch.is_rectangle(),
    }
}

fn cases() -> Vec<Case> {
    let similar = Transform::translate(Vec3::new(0.3, -0.2, 0.1))
        .mul(&Transform::rotate(40.0, Vec3::new(1.0, 2.0, 0.5)).unwrap())
        .mul(&Transform::scale(1.3, 1.3, 1.3).unwrap());
    let skewed = Transform::rotate(25.0, Vec3::new(0.2, 1.0, -0.5))
        .unwrap()
        .mul(&Transform::scale(1.5, 0.7, -0.9).unwrap())
        .mul(&Transform::rotate(30.0, Vec3::new(1.0, 0.3, 0.2)).unwrap());
    let sphere = Quadric::Sphere(Sphere::full(0.8).unwrap());
    let bowl = Quadric::Sphere(Sphere::new(0.9, -0.5, 0.6, 250.0).unwrap());
    let tube = Quadric::Cylinder(Cylinder::new(0.6, -0.7, 0.5, 360.0).unwrap());
    let gutter = Quadric::Cylinder(Cylinder::new(0.8, -0.4, 0.5, 130.0).unwrap());
    let disk = Quadric::Disk(Disk::new(0.2, 0.9, 0.0, 360.0).unwrap());
    let sector = Quadric::Disk(Disk::new(-0.1, 1.0, 0.3, 200.0).unwrap());
    vec![
        placed("sphere", sphere, similar, true, true),
        placed("ellipsoid", sphere, skewed, true, false),
        placed("part of a sphere", bowl, similar, false, true),
        placed("cylinder", tube, similar, true, true),
        placed("skewed cylinder", tube, skewed, true, false),
        placed("gutter", gutter, Transform::IDENTITY, true, true),
        placed("disk", disk, similar, true, true),
        placed("sector", sector, skewed, true, true),
        triangle("triangle", [[-0.5, -0.6, 0.1], [0.9, -0.2, -0.3], [0.1, 0.8, 0.2]]),
        triangle("sliver", [[-0.9, 0.0, 0.0], [0.9, 0.02, 0.1], [0.1, 0.06, 0.0]]),
        patch("rectangle", [[-0.6, -0.4, 0.1], [0.7, -0.4, 0.1], [-0.6, 0.5, 0.3], [0.7, 0.5, 0.3]], true),
        patch("trapezoid", [[-0.6, -0.4, 0.1], [0.7, -0.4, 0.1], [-0.2, 0.5, 0.1], [0.3, 0.5, 0.1]], true),
        patch("saddle", [[-0.6, -0.4, -0.3], [0.7, -0.4, 0.4], [-0.6, 0.5, 0.5], [0.5, 0.5, -0.3]], false),
    ]
}

fn references() -> [Reference; 4] {
    let facing = |p: [f32; 3]| {
        let n = (-Vec3::from(p)).normalize().to_normal();
        Reference { p: p.into(), p_error: Vec3::splat(1e-6), n, ns: n }
    };
    [
        Reference::point(Point3::new(1.5, 2.0, -1.0)),
        Reference::point(Point3::new(0.25, -0.15, 0.3)),
        facing([-2.5, 1.0, 0.5]),
        facing([0.3, -9.0, 6.0]),
    ]
}

#[test]
fn hits_lie_on_the_ray_and_in_the_box() {
    for case in cases() {
        let mut n = Numbers(11);
        let mut found = 0;
        for _ in 0..3000 {
            let target = case.bounds.centroid() + n.direction() * (1.5 * n.next());
            let o = Point3::default() + n.direction() * 3.0;
            let d = (target - o) * (0.2 + n.next());
            let ray = Ray::new(o, d, 0.0);
            let Some(met) = (case.intersect)(&ray) else { continue };
            found += 1;
            let off = ray.at(met.t) - met.hit.p;
            assert!(off.length() < 1e-5, "{} {off:?}", case.name);
            assert!(case.bounds.expand(1e-5).contains(met.hit.p), "{}", case.name);
            assert!((met.hit.n.length() - 1.0).abs() < 1e-5);
            let along = met.hit.dpdu.normalize().abs_dot(met.hit.n) + met.hit.dpdv.normalize().abs_dot(met.hit.n);
            assert!(along < 1e-3, "{} {:?}", case.name, met.hit);
            // A limit just short of the hit hides it, or shows another one before it; the hit itself is within.
            let short = Ray { t_max: met.t.next_down(), ..ray };
            assert!((case.intersect)(&short).is_none(), "{}", case.name);
            assert!((case.intersect)(&Ray { t_max: met.t, ..ray }).is_some_and(|m| m.t == met.t), "{}", case.name);
        }
        assert!(found > 100, "{} was hit {found} times", case.name);
    }
}

#[test]
fn derivatives_predict_neighbours() {
    for case in cases() {
        let mut n = Numbers(5);
        let mut compared = 0;
        for _ in 0..2000 {
            let o = Point3::default() + n.direction() * 3.0;
            let d = case.bounds.centroid() + n.direction() * n.next() - o;
            let h = 1e-3;
            let (ray, near) = (Ray::new(o, d, 0.0), Ray::new(o, d + n.direction() * h, 0.0));
            let (Some(a), Some(b)) = ((case.intersect)(&ray), (case.intersect)(&near)) else { continue };
            let (a, b) = (a.hit, b.hit);
            let (du, dv) = (b.uv.x - a.uv.x, b.uv.y - a.uv.y);
            let step = (b.p - a.p).length();
            // Skip the seam of the azimuth, hits on different sheets, grazing hits and the poles.
            if du.abs() > 0.2 || step > 10.0 * h || a.dpdu.length() < 0.9 {
                continue;
            }
            compared += 1;
            let p = a.p + a.dpdu * du + a.dpdv * dv;
            assert!((p - b.p).length() < 0.03 * step + 1e-5, "{}: {a:?} {b:?}", case.name);
            let (s, dn) = (a.shading, b.shading.n - a.shading.n);
            let predicted = s.dndu * du + s.dndv * dv;
            assert!((predicted - dn).length() < 0.05 * step + 3e-4, "{}: {predicted:?} {dn:?}", case.name);
        }
        assert!(compared > 50, "{}: {compared}", case.name);
    }
}

/// Mean and variance of the mean.
fn estimate(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for v in values {
        n += 1.0;
        sum += v;
        squares += v * v;
    }
    let mean = sum / n;
    (mean, (squares / n - mean * mean).max(0.0) / n)
}

fn weight(w: Vec3) -> f64 {
    f64::from(1.0 + 0.5 * w.x - 0.3 * w.y * w.z)
}

#[test]
fn samples_integrate_what_is_seen() {
    const N: usize = 60_000;
    for case in cases() {
        for (i, from) in references().iter().enumerate() {
            let mut n = Numbers(100 + i as u64);
            // Directions uniform in a cone around the shape's box, so that few miss.
            let center = case.bounds.centroid() - from.p;
            let radius = 0.5 * case.bounds.diagonal().length();
            let sin2 = (radius * radius / center.length_squared()).min(1.0);
            let omc = if center.length() <= radius { 2.0 } else { sin2 / (1.0 + (1.0 - sin2).sqrt()) };
            let frame = steradian_math::Frame::from_z(center.normalize());
            let expected = estimate((0..N).map(|_| {
                let w = frame.from_local(steradian_sampling::warp::square_to_uniform_cone(n.pair(), omc));
                let seen = (case.intersect)(&Ray::new(from.p, w, 0.0)).is_some();
                if seen { weight(w) * f64::from(2.0 * PI * omc) } else { 0.0 }
            }));
            let found = estimate((0..N).map(|_| {
                let Some(s) = (case.sample)(from, n.pair()) else { return 0.0 };
                assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{}", case.name);
                let d = s.p - from.p;
                // Only the nearest of the points in one direction is seen.
                let seen = (case.intersect)(&Ray { t_max: 0.9999, ..Ray::new(from.p, d, 0.0) }).is_none();
                if seen { weight(d.normalize()) / f64::from(s.pdf) } else { 0.0 }
            }));
            let sigma = (expected.1 + found.1).sqrt();
            assert!(
                (expected.0 - found.0).abs() < 6.0 * sigma + 1e-3 * expected.0,
                "{} from {i}: {expected:?} {found:?}",
                case.name
            );
        }
    }
}

#[test]
fn densities_agree_with_samples() {
    for case in cases() {
        let mut compared = 0;
        for from in &references() {
            let mut n = Numbers(3);
            for _ in 0..2000 {
                let Some(s) = (case.sample)(from, n.pair()) else { continue };
                let d = s.p - from.p;
                let Some(met) = (case.intersect)(&Ray::new(from.p, d, 0.0)) else { continue };
                if (met.t - 1.0).abs() > 1e-3 {
                    continue;
                }
                assert!(met.hit.n.dot(s.n) > 0.99, "{}: {:?} {:?}", case.name, met.hit.n, s.n);
                // Where the surface is seen at a low angle, a rounded point has another density.
                if met.hit.n.abs_dot(d.normalize()) < 0.05 {
                    continue;
                }
                let duv = met.hit.uv - s.uv;
                // The azimuth jumps at its seam, and means nothing at a pole.
                let seam = duv.x.abs() > 0.99 || met.hit.dpdu.length() < 0.3;
                assert!(duv.length() < 5e-3 || seam, "{}: {duv:?}", case.name);
                compared += 1;
                let pdf = (met.pdf)(from);
                assert!((pdf / s.pdf - 1.0).abs() < 0.02, "{}: {pdf} {} {from:?}", case.name, s.pdf);
            }
        }
        assert!(compared > 2000, "{}: {compared}", case.name);
    }
}

#[test]
fn areas_are_areas() {
    for case in cases() {
        let mut n = Numbers(9);
        let (mean, variance) =
            estimate((0..40_000).map(|_| 1.0 / f64::from((case.sample_area)(n.pair()).unwrap().pdf)));
        let tolerance = 6.0 * variance.sqrt() + 3e-3 * f64::from(case.area);
        assert!((mean - f64::from(case.area)).abs() < tolerance, "{}: {mean} {}", case.name, case.area);
        if case.uniform {
            assert!(variance < 1e-9 * mean * mean || case.name == "sector", "{}", case.name);
        }
    }
    let sphere = PlacedQuadric::new(Quadric::Sphere(Sphere::full(2.0).unwrap()), Transform::IDENTITY, false);
    assert!((sphere.area() - 16.0 * PI).abs() < 1e-4);
}

#[test]
fn rays_that_leave_do_not_come_back() {
    let far = Transform::translate(Vec3::new(1000.0, -300.0, 50.0));
    let mut all = cases();
    all.push(placed("far sphere", Quadric::Sphere(Sphere::full(3.0).unwrap()), far, true, true));
    all.push(placed("far cylinder", Quadric::Cylinder(Cylinder::new(3.0, -1.0, 1.0, 360.0).unwrap()), far, true, true));
    for case in all.iter().filter(|c| c.convex) {
        let mut n = Numbers(21);
        for _ in 0..3000 {
            let o = case.bounds.centroid() + n.direction() * 5.0;
            let target = case.bounds.centroid() + n.direction() * n.next();
            let Some(met) = (case.intersect)(&Ray::new(o, target - o, 0.0)) else { continue };
            // The side away from the inside: the side the ray came from, at the first hit from outside, is the one
            // for closed shapes; for open ones both sides are tried where the surface is flat.
            let curved = ["cylinder", "gutter"].iter().any(|s| case.name.contains(s));
            let out = met.hit.n.to_vec();
            let inward = case.bounds.centroid() - met.hit.p;
            let out = if curved && out.dot(inward) > 0.0 { -out } else { out };
            let out = if curved { out } else { out.face_forward(o - met.hit.p) };
            for _ in 0..4 {
                let w = n.direction().face_forward(out);
                let again = (case.intersect)(&met.hit.spawn(w, 0.0));
                let flat = !curved;
                let back = flat.then(|| (case.intersect)(&met.hit.spawn(-out, 0.0))).flatten();
                assert!(again.is_none(), "{}: {:?} {w:?}", case.name, met.hit);
                let sphere = case.name.contains("sphere") || case.name.contains("ellipsoid");
                assert!(sphere || back.is_none(), "{}: {:?}", case.name, met.hit);
            }
        }
    }
}

#[test]
fn bad_parameters_are_refused() {
    let nan = f32::NAN;
    assert!(Sphere::full(0.0).is_none() && Sphere::full(-1.0).is_none() && Sphere::full(nan).is_none());
    assert!(Sphere::new(1.0, nan, 1.0, 360.0).is_none() && Sphere::new(1.0, -1.0, 1.0, f32::INFINITY).is_none());
    assert!(Disk::new(0.0, 1.0, 1.0, 360.0).is_none() && Disk::new(0.0, 1.0, nan, 360.0).is_none());
    assert!(Cylinder::new(1.0, 2.0, 2.0, 360.0).is_none() && Cylinder::new(0.0, 0.0, 1.0, 360.0).is_none());
    let mut mesh =
        TriangleMesh { positions: vec![Point3::default(); 3], indices: vec![[0, 1, 3]], ..Default::default() };
    assert!(mesh.validate().is_err());
    mesh.indices[0][2] = 2;
    assert!(mesh.validate().is_ok());
    mesh.normals.push(Normal3::new(0.0, 0.0, 1.0));
    assert!(mesh.validate().is_err());
    mesh.normals.clear();
    mesh.positions[1].x = nan;
    assert!(mesh.validate().is_err());
}

#[test]
fn normals_face_as_asked() {
    let sphere = Quadric::Sphere(Sphere::full(1.0).unwrap());
    let mirror = Transform::scale(-1.0, 1.0, 1.0).unwrap();
    let ray = Ray::new(Point3::new(0.0, 0.2, -5.0), Vec3::new(0.0, 0.0, 1.0), 0.0);
    for (transform, reverse, outwards) in [
        (Transform::IDENTITY, false, true),
        (Transform::IDENTITY, true, false),
        (mirror, false, false),
        (mirror, true, true),
    ] {
        let shape = PlacedQuadric::new(sphere, transform, reverse);
        let hit = shape.interaction(&shape.intersect(&ray).unwrap());
        assert_eq!(hit.n.dot(hit.p) > 0.0, outwards);
        assert_eq!(hit.shading.n.dot(hit.p) > 0.0, outwards);
        let s = shape.sample_area([0.3, 0.4]).unwrap();
        assert_eq!(s.n.dot(s.p) > 0.0, outwards);
    }
    let mesh = TriangleMesh {
        positions: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from).to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    let up = |m: &TriangleMesh| m.interaction(0, 0.2, 0.3).n.z > 0.0 && m.sample_area(0, [0.5, 0.5]).unwrap().n.z > 0.0;
    assert!(up(&mesh) && !up(&mesh.transformed(&Transform::IDENTITY, true)) && !up(&mesh.transformed(&mirror, true)));
    // The mirror turns the vertices over and the flag back: the normal of a flat mesh keeps its side...
    assert!(up(&mesh.transformed(&mirror, false)));
    // ... and vertex normals overrule all of this.
    let bent = TriangleMesh { normals: vec![Normal3::new(0.1, 0.0, -2.0); 3], ..mesh };
    assert!(!up(&bent) && !up(&bent.transformed(&mirror, false)) && up(&bent.transformed(&mirror, true)));
    let hit = bent.interaction(0, 0.2, 0.3);
    assert!(hit.shading.n.z < -0.9 && hit.shading.n.x > 0.0 && hit.shading.dpdu.dot(hit.shading.n).abs() < 1e-6);
    assert_eq!(hit.uv, bent.uv(0, 0.2, 0.3));
}

#[test]
fn solid_angle_of_a_small_patch_is_its_area_over_distance_squared() {
    let pdf = area_to_solid_angle(4.0, Point3::default(), Point3::new(0.0, 0.0, 2.0), Normal3::new(0.0, 0.6, 0.8));
    assert!((pdf - 4.0 * 4.0 / 0.8).abs() < 1e-5);
}
