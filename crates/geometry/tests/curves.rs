//! Curves: width, position along and across, and independence of how they are split.

use steradian_geometry::{Curve, CurveProfile};
use steradian_math::{Normal3, Point3, Ray, Vec3};

fn straight(profile: CurveProfile) -> Curve {
    let p = [[-1.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [1.5, 0.0, 0.0]].map(Point3::from);
    Curve::new(p, [0.2, 0.4], profile).unwrap()
}

fn down(x: f32, y: f32) -> Ray {
    Ray::new(Point3::new(x, y, 5.0), Vec3::new(0.0, 0.0, -2.0), 0.0)
}

#[test]
fn a_straight_curve_is_a_strip() {
    for profile in [
        CurveProfile::Flat,
        CurveProfile::Cylinder,
        CurveProfile::Ribbon([Normal3::new(0.0, 0.0, 1.0), Normal3::new(0.0, 0.0, 1.0)]),
    ] {
        let curve = straight(profile);
        for i in -20..=20 {
            for j in -20..=20 {
                let (x, y) = (i as f32 * 0.0813, j as f32 * 0.0131);
                let u = (x + 1.5) / 3.0;
                let width = 0.2 + 0.2 * u;
                let hit = curve.intersect(&down(x, y));
                let inside = (-1.5..1.5).contains(&x) && y.abs() < 0.5 * width;
                assert_eq!(hit.is_some(), inside, "{x} {y}");
                if let Some(h) = hit {
                    assert!((h.t - 2.5).abs() < 1e-5 && (h.u - u).abs() < 1e-5 && (h.width - width).abs() < 1e-5);
                    assert!(((h.v - 0.5).abs() - y.abs() / width).abs() < 1e-5);
                    let s = curve.interaction(&down(x, y), &h);
                    assert!((s.p - Point3::new(x, y, 0.0)).length() < 1e-5);
                    assert!((s.dpdu.normalize() - Vec3::new(1.0, 0.0, 0.0)).length() < 1e-5);
                    if profile != CurveProfile::Cylinder {
                        assert!(s.n.z.abs() > 0.999);
                    }
                    assert!(curve.intersect(&Ray { t_max: 2.4, ..down(x, y) }).is_none());
                }
            }
        }
    }
}

#[test]
fn a_ribbon_seen_from_the_edge_is_thin() {
    let n = Normal3::new(0.0, 1.0, 0.0);
    let edge_on = straight(CurveProfile::Ribbon([n, n]));
    assert!(edge_on.intersect(&down(0.0, 0.01)).is_none());
    let tilted = Normal3::new(0.0, 0.8, 0.6);
    let ribbon = straight(CurveProfile::Ribbon([tilted, tilted]));
    let h = ribbon.intersect(&down(0.0, 0.0)).unwrap();
    assert!((h.width - 0.6 * 0.3).abs() < 1e-5);
    assert!(ribbon.intersect(&down(0.0, 0.085)).is_some() && ribbon.intersect(&down(0.0, 0.095)).is_none());
}

#[test]
fn the_normal_of_a_cylinder_turns_across() {
    let curve = straight(CurveProfile::Cylinder);
    for i in 1..20 {
        let y = 0.14 - 0.28 * i as f32 / 20.0 + 0.001;
        let ray = down(0.0, y);
        let hit = curve.intersect(&ray).unwrap();
        let s = curve.interaction(&ray, &hit);
        // From edge to edge the normal sweeps half a turn, evenly, around the axis of the curve.
        let sweep = steradian_math::PI * (hit.v - 0.5).abs();
        assert!(s.n.x.abs() < 1e-4 && (s.n.y.abs() - steradian_math::sin(sweep)).abs() < 1e-4);
        // It leans to the side on which the ray passes, and is otherwise along the ray, as in PBRT.
        assert!(s.n.y * y > 0.0 && s.n.dot(ray.d) > 0.0, "{y} {:?}", s.n);
    }
}

#[test]
fn pieces_make_the_whole() {
    let p = [[-1.0, 0.0, 0.2], [-0.4, 1.6, -0.3], [0.5, -1.4, 0.6], [1.0, 0.3, 0.0]].map(Point3::from);
    let curve = Curve::new(p, [0.05, 0.02], CurveProfile::Flat).unwrap();
    let pieces: Vec<Curve> = curve.split(3).collect();
    assert_eq!(pieces.len(), 8);
    let (mut hits, mut different) = (0, 0);
    for i in -60..60 {
        for j in -60..60 {
            let (x, y) = (i as f32 * 0.02 + 0.003, j as f32 * 0.015 + 0.001);
            let ray = Ray::new(Point3::new(x, y, 3.0), Vec3::new(0.01, -0.02, -1.0), 0.0);
            let whole = curve.intersect(&ray);
            let best = pieces.iter().filter_map(|c| c.intersect(&ray)).min_by(|a, b| a.t.total_cmp(&b.t));
            if let Some(h) = best {
                hits += 1;
                let b = pieces.iter().find(|c| c.u[0] <= h.u && h.u <= c.u[1]).unwrap().bounds();
                assert!(b.expand(1e-4).contains(ray.at(h.t)));
            }
            match (whole, best) {
                (Some(a), Some(b)) => assert!((a.u - b.u).abs() < 0.01 && (a.t - b.t).abs() < 0.01),
                (None, None) => {}
                _ => different += 1,
            }
        }
    }
    // Only rays at the very edge may depend on where the curve is cut.
    assert!(hits > 100 && different * 20 < hits, "{hits} {different}");
}

#[test]
fn degenerate_curves_are_harmless() {
    let point = Curve::new([Point3::default(); 4], [0.1, 0.1], CurveProfile::Flat).unwrap();
    assert!(point.intersect(&down(0.0, 0.0)).is_none());
    assert_eq!(point.area(), 0.0);
    let thin = Curve { width: [0.0, 0.0], ..straight(CurveProfile::Flat) };
    assert!(thin.intersect(&down(0.0, 0.0)).is_none());
    assert!(Curve::new([Point3::new(f32::NAN, 0.0, 0.0); 4], [0.1, 0.1], CurveProfile::Flat).is_none());
    assert!(Curve::new([Point3::default(); 4], [-0.1, 0.1], CurveProfile::Flat).is_none());
}
