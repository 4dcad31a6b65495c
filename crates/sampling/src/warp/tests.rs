//! Round trips of all warps, and chi-square of the maps against their densities.

use super::*;
use steradian_math::{PI, Point3, Vec3, sqr};
use steradian_testkit::{ChiSquareTest, TestRng, integrate_rectangle};

/// False-alarm rate of each chi-square test here.
const SIGNIFICANCE: f64 = 1e-8;

fn chi() -> ChiSquareTest {
    ChiSquareTest::default()
}

fn grid() -> impl Iterator<Item = [f32; 2]> {
    (0..40 * 40).map(|i| [((i % 40) as f32 + 0.5) / 40.0, ((i / 40) as f32 + 0.5) / 40.0])
}

/// The inverse brings every random number back.
fn round_trip<T: Copy + std::fmt::Debug>(
    name: &str,
    tolerance: f32,
    map: impl Fn([f32; 2]) -> T,
    inverse: impl Fn(T) -> [f32; 2],
) {
    for u in grid() {
        let x = map(u);
        let v = inverse(x);
        let error = (u[0] - v[0]).abs().max((u[1] - v[1]).abs());
        assert!(error < tolerance, "{name}: {u:?} goes to {x:?}, which comes from {v:?}");
    }
}

fn vec(w: [f32; 3]) -> Vec3 {
    Vec3::from_array(w)
}

#[test]
fn inverses_of_disk_and_sphere_warps() {
    round_trip("polar disk", 1e-5, square_to_uniform_disk_polar, uniform_disk_polar_to_square);
    round_trip("concentric disk", 1e-5, square_to_uniform_disk_concentric, uniform_disk_concentric_to_square);
    round_trip("sphere", 1e-5, square_to_uniform_sphere, uniform_sphere_to_square);
    round_trip("hemisphere", 1e-5, square_to_uniform_hemisphere, uniform_hemisphere_to_square);
    round_trip("cosine hemisphere", 1e-5, square_to_cosine_hemisphere, cosine_hemisphere_to_square);
    for c in [1e-6, 0.1, 1.7] {
        round_trip("cone", 2e-5, |u| square_to_uniform_cone(u, c), |w| uniform_cone_to_square(w, c));
    }
    round_trip("octahedral", 1e-5, square_to_octahedral, octahedral_to_square);
    round_trip("latitude-longitude", 1e-5, square_to_lat_long, lat_long_to_square);
    round_trip("triangle", 1e-6, square_to_uniform_triangle, uniform_triangle_to_square);
}

/// A one-dimensional warp against its inverse and its density: the density integrates to the difference of random numbers.
fn check_interval(
    name: &str,
    tolerance: f32,
    map: impl Fn(f32) -> f32,
    pdf: impl Fn(f32) -> f32,
    inverse: impl Fn(f32) -> f32,
) {
    let mut previous = map(0.002);
    for i in 1..=249 {
        let u = 0.002 + 0.004 * i as f32;
        let x = map(u);
        assert!((inverse(x) - u).abs() < tolerance, "{name}: {u} goes to {x} and back to {}", inverse(x));
        let mass = integrate_rectangle(
            &|x, _| f64::from(pdf(x as f32)),
            [f64::from(previous), f64::from(x)],
            [0.0, 1.0],
            1e-7,
            6,
        );
        assert!((mass - 0.004).abs() < f64::from(tolerance), "{name}: mass {mass} between {previous} and {x}");
        previous = x;
    }
}

#[test]
fn interval_warps_have_their_densities() {
    for (a, b) in [(1.0, 1.0), (0.0, 2.0), (3.0, 0.0), (0.1, 5.0)] {
        check_interval(
            "linear",
            2e-5,
            |u| unit_to_linear(u, a, b),
            |x| unit_to_linear_pdf(x, a, b),
            |x| linear_to_unit(x, a, b),
        );
    }
    check_interval("tent", 2e-5, |u| unit_to_tent(u, 1.5), |x| unit_to_tent_pdf(x, 1.5), |x| tent_to_unit(x, 1.5));
    check_interval(
        "exponential",
        2e-5,
        |u| unit_to_exponential(u, 2.5),
        |x| unit_to_exponential_pdf(x, 2.5),
        |x| exponential_to_unit(x, 2.5),
    );
    check_interval(
        "equiangular",
        2e-5,
        |u| unit_to_equiangular(u, -0.4, 3.0, 0.5),
        |x| unit_to_equiangular_pdf(x, -0.4, 3.0, 0.5),
        |x| equiangular_to_unit(x, -0.4, 3.0, 0.5),
    );
    check_interval(
        "normal",
        2e-5,
        |u| unit_to_normal(u, 0.3, 1.7),
        |x| unit_to_normal_pdf(x, 0.3, 1.7),
        |x| normal_to_unit(x, 0.3, 1.7),
    );
    check_interval(
        "smooth step",
        2e-5,
        |u| unit_to_smooth_step(u, -1.0, 2.0),
        |x| unit_to_smooth_step_pdf(x, -1.0, 2.0),
        |x| smooth_step_to_unit(x, -1.0, 2.0),
    );
    assert!(unit_to_exponential(0.999_999_94, 1.0).is_finite() && unit_to_normal(0.0, 0.0, 1.0).is_finite());
}

#[test]
fn bilinear_and_normal_pairs_have_their_densities() {
    for w in [[1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 2.0, 0.5], [5.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]] {
        round_trip("bilinear", 2e-4, |u| square_to_bilinear(u, w), |p| bilinear_to_square(p, w));
        let sample = |rng: &mut TestRng| Some(square_to_bilinear(rng.f32_2d(), w));
        chi().square("bilinear", sample, |p| square_to_bilinear_pdf(p, w)).assert(SIGNIFICANCE);
    }
    // Normal pairs, seen through the window [-4, 4]^2.
    let sample = |rng: &mut TestRng| {
        let p = square_to_normal_2d(rng.f32_2d()).map(|x| x / 8.0 + 0.5);
        p.iter().all(|x| (0.0..1.0).contains(x)).then_some(p)
    };
    chi()
        .square("normal pair", sample, |p| 64.0 * square_to_normal_2d_pdf(p.map(|x| 8.0 * (x - 0.5))))
        .assert(SIGNIFICANCE);
}

#[test]
fn disks_have_their_density() {
    for (name, map) in [
        ("polar disk", square_to_uniform_disk_polar as fn([f32; 2]) -> [f32; 2]),
        ("concentric disk", square_to_uniform_disk_concentric),
    ] {
        let sample = |rng: &mut TestRng| Some(map(rng.f32_2d()).map(|x| 0.5 * (x + 1.0)));
        let test = ChiSquareTest { depth: 8, ..chi() };
        test.square(name, sample, |p| 4.0 * square_to_uniform_disk_pdf(p.map(|x| 2.0 * x - 1.0))).assert(SIGNIFICANCE);
    }
}

#[test]
fn directions_have_their_densities() {
    type Case = (&'static str, fn([f32; 2]) -> Vec3, fn(Vec3) -> f32);
    let cases: [Case; 6] = [
        ("sphere", square_to_uniform_sphere, square_to_uniform_sphere_pdf),
        ("hemisphere", square_to_uniform_hemisphere, square_to_uniform_hemisphere_pdf),
        ("cosine hemisphere", square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf),
        ("cone", |u| square_to_uniform_cone(u, 0.25), |w| square_to_uniform_cone_pdf(w, 0.25)),
        ("octahedral", square_to_octahedral, square_to_octahedral_pdf),
        ("latitude-longitude", square_to_lat_long, |w| square_to_lat_long_pdf(w)),
    ];
    for (name, map, pdf) in cases {
        // The density of this one is infinite at the poles.
        let test = ChiSquareTest { depth: if name == "latitude-longitude" { 11 } else { 8 }, ..chi() };
        let result = test.sphere(name, |rng| Some(map(rng.f32_2d()).to_array()), |w| pdf(vec(w)));
        result.assert(SIGNIFICANCE);
        for u in grid() {
            assert!((map(u).length() - 1.0).abs() < 1e-5, "{name} is not of unit length at {u:?}");
        }
    }
}

#[test]
fn triangles_are_uniform() {
    // The mean of each barycentric coordinate's square is 1/6 over a uniform triangle.
    let mut sums = [0.0f64; 3];
    for u in grid() {
        let b = square_to_uniform_triangle(u);
        assert!(b.iter().all(|x| (-1e-6..=1.0).contains(x)));
        assert_eq!(square_to_uniform_triangle_pdf([0.2, 0.3, 0.5], 4.0), 0.25);
        for (sum, x) in sums.iter_mut().zip(b) {
            *sum += f64::from(x) * f64::from(x) / 1600.0;
        }
    }
    assert!(sums.iter().all(|s| (s - 1.0 / 6.0).abs() < 1e-3), "{sums:?}");
    let sample = |rng: &mut TestRng| {
        let b = square_to_uniform_triangle(rng.f32_2d());
        Some([b[0], b[1]])
    };
    let test = ChiSquareTest { depth: 8, ..chi() };
    test.square("triangle", sample, |p| if p[0] + p[1] < 1.0 { 2.0 } else { 0.0 }).assert(SIGNIFICANCE);
}

fn corners() -> Vec<[Vec3; 3]> {
    let octant = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    let wide =
        [Vec3::new(1.0, 0.1, -0.3), Vec3::new(-0.8, 0.7, -0.2), Vec3::new(-0.2, -0.9, -0.4)].map(Vec3::normalize);
    let narrow = [Vec3::new(0.1, 0.2, 1.0), Vec3::new(0.2, 0.2, 1.0), Vec3::new(0.2, 0.9, 1.0)].map(Vec3::normalize);
    vec![octant, wide, narrow]
}

#[test]
fn spherical_triangles_are_uniform_and_inverted() {
    assert!((spherical_triangle_area(corners()[0][0], corners()[0][1], corners()[0][2]) - PI / 2.0).abs() < 1e-6);
    for [a, b, c] in corners() {
        let t = SphericalTriangle::new(a, b, c).unwrap();
        let inside = |w: Vec3| {
            let side = a.dot(b.cross(c)).signum();
            [a.cross(b), b.cross(c), c.cross(a)].iter().all(|n| side * n.dot(w) >= 0.0)
        };
        let test = ChiSquareTest { depth: 7, columns: 48, rows: 24, ..chi() };
        let pdf = |w: [f32; 3]| if inside(vec(w)) { t.pdf() } else { 0.0 };
        test.sphere("spherical triangle", |rng| Some(t.sample(rng.f32_2d()).to_array()), pdf).assert(SIGNIFICANCE);
        round_trip("spherical triangle", 2e-3, |u| t.sample(u), |w| t.invert(w));
    }
    let a = Vec3::new(0.0, 0.0, 1.0);
    assert!(SphericalTriangle::new(a, a, Vec3::new(1.0, 0.0, 0.0)).is_none());
}

#[test]
fn tiny_spherical_triangles_keep_their_area() {
    // A right triangle with legs of 1e-3 at distance one.
    let corner = |x: f32, y: f32| Vec3::new(x, y, 1.0).normalize();
    let t = SphericalTriangle::new(corner(0.0, 0.0), corner(1e-3, 0.0), corner(0.0, 1e-3)).unwrap();
    assert!((t.solid_angle() / 5e-7 - 1.0).abs() < 1e-3, "{}", t.solid_angle());
}

#[test]
fn spherical_rectangles_are_uniform_and_inverted() {
    let origin = Point3::new(0.1, -0.2, 0.3);
    let cases = [
        (Point3::new(-1.0, -1.0, 1.3), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)),
        (Point3::new(0.5, 0.7, -0.5), Vec3::new(0.0, 0.0, 1.5), Vec3::new(0.6, 0.8, 0.0)),
        (Point3::new(-4.0, -0.3, 0.0), Vec3::new(8.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0)),
    ];
    for (corner, ex, ey) in cases {
        let r = SphericalRectangle::new(origin, corner, ex, ey).unwrap();
        let normal = ex.cross(ey).normalize();
        let pdf = |w: [f32; 3]| {
            let w = vec(w);
            let t = (corner - origin).dot(normal) / w.dot(normal);
            let p = origin + w * t - corner;
            let (s, q) = (p.dot(ex) / ex.length_squared(), p.dot(ey) / ey.length_squared());
            if t > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&q) { r.pdf() } else { 0.0 }
        };
        let test = ChiSquareTest { depth: 7, columns: 48, rows: 24, ..chi() };
        let sample = |rng: &mut TestRng| Some((r.sample(rng.f32_2d()) - origin).normalize().to_array());
        test.sphere("spherical rectangle", sample, pdf).assert(SIGNIFICANCE);
        round_trip("spherical rectangle", 2e-3, |u| r.sample(u), |p| r.invert(p));
    }
    // A unit cube's face seen from the centre is a sixth of the sphere.
    let face = SphericalRectangle::new(
        Point3::new(0.0, 0.0, 0.0),
        Point3::new(-0.5, -0.5, 0.5),
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
    );
    assert!((face.unwrap().solid_angle() / (4.0 * PI / 6.0) - 1.0).abs() < 1e-5);
    // Edge-on there is nothing to see.
    let plane = Point3::new(1.0, 1.0, 0.3);
    assert!(SphericalRectangle::new(origin, plane, Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)).is_none());
}

#[test]
fn small_rectangles_far_away_keep_their_solid_angle() {
    let (x, y) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0));
    for distance in [10.0f32, 30.0, 100.0] {
        let corner = Point3::new(-0.5, -0.5, distance);
        let r = SphericalRectangle::new(Point3::new(0.0, 0.0, 0.0), corner, x, y).unwrap();
        let expected = 1.0 / sqr(distance);
        assert!((r.solid_angle() / expected - 1.0).abs() < 0.02, "{} and {expected}", r.solid_angle());
    }
}
