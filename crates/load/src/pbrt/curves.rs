//! Curves: pbrt's control points of either basis and degree to cubic Bezier pieces.

use super::params::Params;
use steradian_geometry::{Curve, CurveProfile};
use steradian_math::{Normal3, Point3};
use steradian_scene::Shape;

#[derive(Clone, Copy, PartialEq)]
enum Basis {
    Bezier,
    BSpline,
}

#[derive(Clone, Copy, PartialEq)]
enum Profile {
    Flat,
    Ribbon,
    Cylinder,
}

/// `Shape "curve"`: the segments as one shape.
pub(super) fn curves(p: &mut Params) -> Vec<Shape> {
    let width = p.float("width", 1.0);
    let (width0, width1) = (p.float("width0", width), p.float("width1", width));
    let degree = p.int_in("degree", 3, 2..=3) as usize;
    let basis = p.choice("basis", &[("bezier", Basis::Bezier), ("bspline", Basis::BSpline)]);
    let profile =
        p.choice("type", &[("flat", Profile::Flat), ("ribbon", Profile::Ribbon), ("cylinder", Profile::Cylinder)]);
    // How finely pbrt splits curves for its tree; ours is its own affair.
    p.int("splitdepth", 3);
    let normals = p.take_normals("N");
    let Some((points, span)) = p.take_points("P") else {
        p.error(format!("{} needs points `P`", p.what()), None);
        return Vec::new();
    };
    let n = points.len();
    let segments = match basis {
        Basis::Bezier if n > degree && (n - 1) % degree == 0 => (n - 1) / degree,
        Basis::BSpline if n > degree => n - degree,
        Basis::Bezier => {
            let message = format!(
                "a Bezier curve of degree {degree} needs {}, {}, {}, ... points, not {n}",
                degree + 1,
                2 * degree + 1,
                3 * degree + 1
            );
            p.error(message, span);
            return Vec::new();
        }
        Basis::BSpline => {
            p.error(format!("a B-spline of degree {degree} needs at least {} points, not {n}", degree + 1), span);
            return Vec::new();
        }
    };
    let normals = match (profile, normals) {
        (Profile::Ribbon, Some((normals, _))) if normals.len() == segments + 1 => Some(normals),
        (Profile::Ribbon, given) => {
            let found = given.map_or(0, |g| g.0.len());
            p.error(format!("a ribbon of {segments} segments needs {} normals `N`, not {found}", segments + 1), None);
            return Vec::new();
        }
        (_, Some((_, span))) => {
            p.warning("only ribbons have normals; `N` is ignored", span);
            None
        }
        _ => None,
    };
    let mut curves = Vec::with_capacity(segments);
    for s in 0..segments {
        let at = |i: usize| width0 + (width1 - width0) * (i as f32 / segments as f32);
        let first = if basis == Basis::Bezier { s * degree } else { s };
        let control = cubic(&points[first..=first + degree], basis);
        let profile = match (profile, &normals) {
            (Profile::Ribbon, Some(n)) => CurveProfile::Ribbon([unit(n[s]), unit(n[s + 1])]),
            (Profile::Cylinder, _) => CurveProfile::Cylinder,
            _ => CurveProfile::Flat,
        };
        match Curve::new(control, [at(s), at(s + 1)], profile) {
            Some(curve) => curves.push(curve),
            None => {
                p.error(format!("{} makes no sense: a width is negative or a normal is zero", p.what()), None);
                return Vec::new();
            }
        }
    }
    vec![Shape::Curves(curves)]
}

fn unit(n: Normal3) -> Normal3 {
    n.try_normalize().unwrap_or_default()
}

/// The Bezier form of a segment of a uniform cubic B-spline.
pub(crate) fn b_spline(p: [Point3; 4]) -> [Point3; 4] {
    cubic(&p, Basis::BSpline)
}

/// The cubic Bezier form of one segment, from 3 or 4 control points.
fn cubic(p: &[Point3], basis: Basis) -> [Point3; 4] {
    let lerp = |t: f32, a: Point3, b: Point3| a.lerp(b, t);
    let elevate = |a: Point3, b: Point3, c: Point3| [a, lerp(2.0 / 3.0, a, b), lerp(1.0 / 3.0, b, c), c];
    match (basis, p) {
        (Basis::Bezier, &[a, b, c, d]) => [a, b, c, d],
        (Basis::Bezier, _) => elevate(p[0], p[1], p[2]),
        (Basis::BSpline, &[a, b, c, d]) => {
            let (q, r) = (lerp(1.0 / 3.0, b, c), lerp(2.0 / 3.0, b, c));
            [lerp(0.5, lerp(2.0 / 3.0, a, b), q), q, r, lerp(0.5, r, lerp(1.0 / 3.0, c, d))]
        }
        (Basis::BSpline, _) => elevate(lerp(0.5, p[0], p[1]), p[1], lerp(0.5, p[1], p[2])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Bezier curve of degree 3 at `t`.
    fn bezier(p: &[Point3; 4], t: f32) -> f32 {
        let s = 1.0 - t;
        p[0].x * s * s * s + 3.0 * p[1].x * s * s * t + 3.0 * p[2].x * s * t * t + p[3].x * t * t * t
    }

    #[test]
    fn every_basis_and_degree_becomes_the_same_curve_as_a_cubic() {
        let x = [0.5f32, -2.0, 3.0, 7.0].map(|x| Point3::new(x, 0.0, 0.0));
        for i in 0..=8 {
            let t = i as f32 / 8.0;
            let s = 1.0 - t;
            let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{t}: {a} {b}");
            near(bezier(&cubic(&x, Basis::Bezier), t), bezier(&x, t));
            near(bezier(&cubic(&x[..3], Basis::Bezier), t), 0.5 * s * s - 4.0 * s * t + 3.0 * t * t);
            // Uniform B-splines by their blending polynomials.
            let b2 = [0.5 * s * s, 0.5 + t * s, 0.5 * t * t];
            near(bezier(&cubic(&x[..3], Basis::BSpline), t), (0..3).map(|i| b2[i] * x[i].x).sum());
            let b3 = [
                s * s * s / 6.0,
                (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
                (-3.0 * t * t * t + 3.0 * t * t + 3.0 * t + 1.0) / 6.0,
                t * t * t / 6.0,
            ];
            near(bezier(&cubic(&x, Basis::BSpline), t), (0..4).map(|i| b3[i] * x[i].x).sum());
        }
    }
}
