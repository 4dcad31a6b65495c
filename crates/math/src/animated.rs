//! Transforms that change over the shutter interval (Shoemake and Duff 1992; PBRT 3rd ed., 2.9).

use crate::{Bounds3, Normal3, Point3, Ray, Transform, Vec3, lerp};

/// A transform taken apart into translation, rotation and stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decomposed {
    /// Translation.
    pub t: Vec3,
    /// Rotation as a unit quaternion (x, y, z, w).
    pub r: [f32; 4],
    /// Scale and shear, 3 x 3.
    pub s: [[f32; 3]; 3],
}

type M3 = [[f64; 3]; 3];

fn mul3(a: &M3, b: &M3) -> M3 {
    let mut r = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            r[i][j] = (0..3).map(|k| a[i][k] * b[k][j]).sum();
        }
    }
    r
}

fn inverse_transpose3(m: &M3) -> M3 {
    let c = |a: usize, b: usize, c: usize, d: usize| m[a][b] * m[c][d] - m[a][d] * m[c][b];
    let cof = [
        [c(1, 1, 2, 2), -c(1, 0, 2, 2), c(1, 0, 2, 1)],
        [-c(0, 1, 2, 2), c(0, 0, 2, 2), -c(0, 0, 2, 1)],
        [c(0, 1, 1, 2), -c(0, 0, 1, 2), c(0, 0, 1, 1)],
    ];
    let det = m[0][0] * cof[0][0] + m[0][1] * cof[0][1] + m[0][2] * cof[0][2];
    cof.map(|row| row.map(|v| v / det))
}

fn quaternion(m: &M3) -> [f32; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let q = if trace > 0.0 {
        let s = (trace + 1.0).sqrt();
        let k = 0.5 / s;
        [(m[2][1] - m[1][2]) * k, (m[0][2] - m[2][0]) * k, (m[1][0] - m[0][1]) * k, 0.5 * s]
    } else {
        let i = (0..3).max_by(|&a, &b| m[a][a].total_cmp(&m[b][b])).unwrap_or(0);
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let s = (m[i][i] - m[j][j] - m[k][k] + 1.0).max(0.0).sqrt();
        let f = if s != 0.0 { 0.5 / s } else { 0.0 };
        let mut q = [0.0; 4];
        q[i] = 0.5 * s;
        q[3] = (m[k][j] - m[j][k]) * f;
        q[j] = (m[j][i] + m[i][j]) * f;
        q[k] = (m[k][i] + m[i][k]) * f;
        q
    };
    q.map(|v| v as f32)
}

fn rotation(q: &[f32; 4]) -> M3 {
    let [x, y, z, w] = q.map(f64::from);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

impl Decomposed {
    /// Takes the affine transform apart by polar decomposition.
    pub fn new(t: &Transform) -> Self {
        let m: M3 = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(t.m[i][j])));
        // The rotation nearest to m: average with the inverse transpose until it stands still.
        let mut r = m;
        for _ in 0..100 {
            let it = inverse_transpose3(&r);
            let next: M3 = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (r[i][j] + it[i][j])));
            let change: f64 =
                (0..3).map(|i| (0..3).map(|j| (next[i][j] - r[i][j]).abs()).sum::<f64>()).fold(0.0, f64::max);
            r = next;
            if change < 1e-10 {
                break;
            }
        }
        // A reflection is no rotation: keep its sign in the stretch.
        let det = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0])
            + r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
        if det < 0.0 {
            r = r.map(|row| row.map(|v| -v));
        }
        let rt: M3 = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
        let s = mul3(&rt, &m);
        Self { t: Vec3::new(t.m[0][3], t.m[1][3], t.m[2][3]), r: quaternion(&r), s: s.map(|row| row.map(|v| v as f32)) }
    }

    fn compose(t: Vec3, r: &[f32; 4], s: &[[f32; 3]; 3]) -> Transform {
        let m = mul3(&rotation(r), &s.map(|row| row.map(f64::from)));
        let mut out = Transform::IDENTITY.m;
        for i in 0..3 {
            for j in 0..3 {
                out[i][j] = m[i][j] as f32;
            }
            out[i][3] = t[i];
        }
        // Interpolated stretches can pass through a singular one; the object is then flat and the inverse irrelevant.
        Transform::from_matrix(out).unwrap_or(Transform { m: out, inv: Transform::IDENTITY.inv })
    }
}

fn slerp(t: f32, a: &[f32; 4], b: &[f32; 4]) -> [f32; 4] {
    let dot: f32 = (0..4).map(|i| a[i] * b[i]).sum();
    let theta = crate::safe_acos(dot);
    let sin = crate::sin(theta);
    if sin < 1e-4 {
        let q: [f32; 4] = std::array::from_fn(|i| lerp(t, a[i], b[i]));
        let l = q.iter().map(|v| v * v).sum::<f32>().sqrt();
        return q.map(|v| v / l);
    }
    let (wa, wb) = (crate::sin((1.0 - t) * theta) / sin, crate::sin(t * theta) / sin);
    std::array::from_fn(|i| a[i] * wa + b[i] * wb)
}

/// A transform at two times, interpolated in between; constant outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimatedTransform {
    /// The transform at `start_time`.
    pub start: Transform,
    /// The transform at `end_time`.
    pub end: Transform,
    /// Time of the first transform.
    pub start_time: f32,
    /// Time of the second transform.
    pub end_time: f32,
    parts: Option<[Decomposed; 2]>,
}

impl From<Transform> for AnimatedTransform {
    fn from(t: Transform) -> Self {
        Self { start: t, end: t, start_time: 0.0, end_time: 1.0, parts: None }
    }
}

impl AnimatedTransform {
    /// From two keyframes.
    pub fn new(start: Transform, start_time: f32, end: Transform, end_time: f32) -> Self {
        let parts = (start.m != end.m).then(|| {
            let (a, mut b) = (Decomposed::new(&start), Decomposed::new(&end));
            // Of the two quaternions of a rotation take the nearer one: the short way round.
            if (0..4).map(|i| a.r[i] * b.r[i]).sum::<f32>() < 0.0 {
                b.r = b.r.map(|v| -v);
            }
            [a, b]
        });
        Self { start, end, start_time, end_time, parts }
    }

    /// Whether the transform changes over time.
    #[inline]
    pub fn is_animated(&self) -> bool {
        self.parts.is_some()
    }

    /// The transform at `time`.
    #[inline]
    pub fn at(&self, time: f32) -> Transform {
        match &self.parts {
            None => self.start,
            Some(parts) => self.interpolate(parts, time),
        }
    }

    fn interpolate(&self, [a, b]: &[Decomposed; 2], time: f32) -> Transform {
        if time <= self.start_time {
            return self.start;
        }
        if time >= self.end_time {
            return self.end;
        }
        let t = (time - self.start_time) / (self.end_time - self.start_time);
        let s = std::array::from_fn(|i| std::array::from_fn(|j| lerp(t, a.s[i][j], b.s[i][j])));
        Decomposed::compose(a.t * (1.0 - t) + b.t * t, &slerp(t, &a.r, &b.r), &s)
    }

    /// `outer` applied after this one, at both times.
    pub fn then(&self, outer: &Transform) -> Self {
        Self::new(self.start.then(outer), self.start_time, self.end.then(outer), self.end_time)
    }

    /// Applies at the ray's time.
    pub fn ray(&self, r: &Ray) -> Ray {
        self.at(r.time).ray(r)
    }

    /// Applies to a point at `time`.
    pub fn point(&self, p: Point3, time: f32) -> Point3 {
        self.at(time).point(p)
    }

    /// Applies to a normal at `time`.
    pub fn normal(&self, n: Normal3, time: f32) -> Normal3 {
        self.at(time).normal(n)
    }

    /// A box around everything that `b` passes through.
    ///
    /// Without rotation each corner moves on a straight line and the boxes at the ends suffice. With rotation the path is
    /// cut into short arcs; between neighbouring samples a corner strays from its chord by less than an eighth of the
    /// second difference, which is added with a factor of two to spare.
    pub fn motion_bounds(&self, b: &Bounds3) -> Bounds3 {
        let Some(parts) = &self.parts else { return self.start.bounds(b) };
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        const STEPS: usize = 128;
        let time = |i: usize| lerp(i as f32 / STEPS as f32, self.start_time, self.end_time);
        let keys: Vec<Transform> = (0..=STEPS).map(|i| self.interpolate(parts, time(i))).collect();
        let mut bounds = Bounds3::EMPTY;
        for c in 0..8 {
            let path: Vec<Point3> = keys.iter().map(|k| k.point(b.corner(c))).collect();
            let stray = path.windows(3).map(|w| ((w[2] - w[1]) - (w[1] - w[0])).length() * 0.25).fold(0.0, f32::max);
            let along = path.iter().fold(Bounds3::EMPTY, |r, &p| r.union_point(p));
            bounds = bounds.union(along.expand(stray));
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(degrees: f32) -> Transform {
        Transform::translate(Vec3::new(degrees, 0.0, 0.0))
            .mul(&Transform::rotate(degrees, Vec3::new(0.0, 0.0, 1.0)).unwrap())
            .mul(&Transform::scale(2.0, 1.0, 1.0).unwrap())
    }

    #[test]
    fn halfway_is_half_the_angle() {
        let a = AnimatedTransform::new(turn(0.0), 1.0, turn(90.0), 3.0);
        assert!(a.is_animated());
        let p = Point3::new(1.0, 0.0, 0.0);
        assert!(a.point(p, 2.0).distance(turn(45.0).point(p)) < 1e-4);
        assert_eq!(a.at(0.0), turn(0.0));
        assert_eq!(a.at(9.0), turn(90.0));
        assert!(!AnimatedTransform::from(turn(3.0)).is_animated());
    }

    #[test]
    fn reflections_survive_decomposition() {
        let m = turn(30.0).mul(&Transform::scale(1.0, 1.0, -1.0).unwrap());
        let d = Decomposed::new(&m);
        let c = Decomposed::compose(d.t, &d.r, &d.s);
        for i in 0..4 {
            for j in 0..4 {
                assert!((c.m[i][j] - m.m[i][j]).abs() < 1e-5, "{:?} {:?}", c.m, m.m);
            }
        }
    }

    #[test]
    fn motion_bounds_contain_the_path() {
        let a = AnimatedTransform::new(turn(0.0), 0.0, turn(170.0), 1.0);
        let b = Bounds3::new(Point3::new(-1.0, -2.0, 0.0), Point3::new(3.0, 1.0, 1.0));
        let bounds = a.motion_bounds(&b);
        for i in 0..=1000 {
            let t = a.at(i as f32 / 1000.0);
            for c in 0..8 {
                assert!(bounds.contains(t.point(b.corner(c))));
            }
        }
    }
}
