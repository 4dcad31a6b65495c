//! Signed distances at the points of a grid: the surface is where their trilinear interpolation is zero.
//!
//! Hansson-Söderlund, Evans and Akenine-Möller 2022, "Ray tracing of signed distance function grids"; the boxes are those of
//! Hansson-Söderlund and Akenine-Möller 2023, "Tight bounding boxes for voxels and bricks in a signed distance field ray tracer".

use std::cmp::Ordering;
use std::fmt;

use steradian_math::{Bounds3, Frame, Point2, Point3, Ray, Transform, Vec3, gamma};

use crate::hit::{Shading, SurfaceHit};

/// Cells reach this much beyond their walls, in cells, so that no ray slips between two of them.
const OVERLAP: f64 = 1e-9;
/// Halvings of an interval, at most: enough for all bits.
const MOST_STEPS: u32 = 80;

/// Distances at the points of a regular grid that spans the unit cube, x fastest; positive outside.
///
/// Normals point to where distances grow. There are no texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceGrid {
    size: [u32; 3],
    values: Vec<f32>,
    smooth: bool,
}

/// Why distances are no [`DistanceGrid`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DistanceGridError {
    /// A cell needs two points along each axis, and all points a value.
    Size {
        /// Points along x, y, z.
        size: [u32; 3],
        /// Values.
        found: usize,
    },
    /// A value that is infinite or undefined.
    Value {
        /// Which.
        index: usize,
    },
    /// All distances have one sign.
    NoSurface,
}

impl fmt::Display for DistanceGridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { size: [x, y, z], found } => {
                write!(f, "{found} distances are no grid of {x} x {y} x {z} points, two or more each way")
            }
            Self::Value { index } => write!(f, "distance {index} is not finite"),
            Self::NoSurface => write!(f, "all distances have one sign: there is no surface"),
        }
    }
}

impl std::error::Error for DistanceGridError {}

/// A polynomial of degree three, from the constant term on.
type Cubic = [f64; 4];

impl DistanceGrid {
    /// Distances at `size` points. Shading normals are interpolated between cells if `smooth`, else those of the surface.
    ///
    /// # Errors
    /// If the values are not those of a grid with a surface in it.
    pub fn new(size: [u32; 3], values: Vec<f32>, smooth: bool) -> Result<Self, DistanceGridError> {
        let count = size.iter().try_fold(1u32, |n, &s| n.checked_mul(s));
        if size.iter().any(|&n| n < 2) || count.is_none_or(|n| n as usize != values.len()) {
            return Err(DistanceGridError::Size { size, found: values.len() });
        }
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(DistanceGridError::Value { index });
        }
        let grid = Self { size, values, smooth };
        if grid.cells().next().is_none() {
            return Err(DistanceGridError::NoSurface);
        }
        Ok(grid)
    }

    /// Number of points along x, y, z.
    pub fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Bytes of the distances.
    pub fn byte_size(&self) -> usize {
        size_of_val(self.values.as_slice())
    }

    /// The cells with a piece of the surface, in order.
    pub fn cells(&self) -> impl Iterator<Item = u32> {
        let count = self.size.iter().map(|n| n - 1).product();
        (0..count).filter(|&cell| {
            let c = self.corners(cell);
            let (above, below) = (c.iter().any(|&v| v > 0.0), c.iter().any(|&v| v < 0.0));
            // Where all is zero there is no side to be on.
            (above && below) || (c.contains(&0.0) && (above || below))
        })
    }

    fn place(&self, cell: u32) -> [u32; 3] {
        let [x, y, _] = self.size.map(|n| n - 1);
        [cell % x, cell / x % y, cell / (x * y)]
    }

    /// The values at a cell's corners: bit 0 of the index is x, bit 1 y, bit 2 z.
    fn corners(&self, cell: u32) -> [f64; 8] {
        let [x, y, z] = self.place(cell);
        let [nx, ny, _] = self.size.map(|n| n as usize);
        std::array::from_fn(|i| {
            let (x, y, z) = (x as usize + (i & 1), y as usize + (i >> 1 & 1), z as usize + (i >> 2));
            f64::from(self.values[(z * ny + y) * nx + x])
        })
    }

    /// A box around what a cell has of the surface: around where it meets the cell's edges, since it bulges nowhere else.
    pub fn bounds(&self, cell: u32) -> Bounds3 {
        let (f, place) = (self.corners(cell), self.place(cell));
        let (mut low, mut high) = ([1.0f64; 3], [0.0f64; 3]);
        let mut meet = |at: [f64; 3]| {
            for k in 0..3 {
                (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
            }
        };
        let corner = |i: usize| std::array::from_fn(|k| (i >> k & 1) as f64);
        for i in 0..8usize {
            if f[i] == 0.0 {
                meet(corner(i));
            }
            for k in (0..3).filter(|k| i >> k & 1 == 0) {
                let other = i | 1 << k;
                if f[i] * f[other] < 0.0 {
                    let mut at: [f64; 3] = corner(i);
                    at[k] = f[i] / (f[i] - f[other]);
                    meet(at);
                }
            }
        }
        // Wider by more than what rounding takes away.
        let world = |k: usize, v: f64| (f64::from(place[k]) + v) / f64::from(self.size[k] - 1);
        let margin = 4.0 * f64::from(f32::EPSILON);
        let min: [f32; 3] = std::array::from_fn(|k| (world(k, low[k]) - margin) as f32);
        let max: [f32; 3] = std::array::from_fn(|k| (world(k, high[k]) + margin) as f32);
        Bounds3 { min: Point3::new(min[0], min[1], min[2]), max: Point3::new(max[0], max[1], max[2]) }
    }

    /// A point of the unit cube in the coordinates of a cell.
    fn in_cell(&self, cell: u32, p: [f64; 3]) -> [f64; 3] {
        let place = self.place(cell);
        std::array::from_fn(|k| p[k] * f64::from(self.size[k] - 1) - f64::from(place[k]))
    }

    /// The nearest `t` in `(0, ray.t_max]` at which the ray meets what a cell has of the surface. The ray is in the space that
    /// `to_world` leads to.
    pub fn intersect(&self, cell: u32, ray: &Ray, to_world: &Transform) -> Option<f32> {
        let (o, d, error) = local(ray, to_world);
        let scale = self.size.map(|n| f64::from(n - 1));
        let (from, along) = (self.in_cell(cell, o), std::array::from_fn::<_, 3, _>(|k| d[k] * scale[k]));
        let (mut near, mut far) = (0.0f64, f64::from(ray.t_max));
        for k in 0..3 {
            if along[k] == 0.0 {
                if !(-OVERLAP..=1.0 + OVERLAP).contains(&from[k]) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((-OVERLAP - from[k]) / along[k], (1.0 + OVERLAP - from[k]) / along[k]);
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
        if near.partial_cmp(&far) != Some(Ordering::Less) {
            return None;
        }
        let corners = self.corners(cell);
        let start: [f64; 3] = std::array::from_fn(|k| from[k] + near * along[k]);
        let f = along_line(&corners, start, along);
        // A ray that starts on the surface, as far as can be told, leaves it to the side that it goes to.
        let speed = d.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let on_surface = near * speed <= 2.0 * error && {
            let slope = gradient(&corners, start);
            let reach: f64 = (0..3).map(|k| (slope[k] * scale[k]).abs()).sum::<f64>() * error;
            f[0].abs() <= 2.0 * reach
        };
        let t = near + first_root(&f, far - near, on_surface)?;
        let t = t as f32;
        (t > 0.0 && t <= ray.t_max).then_some(t)
    }

    /// Everything about the point where `ray` met a cell's surface at `t`, both in the space that `to_world` leads to. The
    /// normals are turned over if `flip`.
    pub fn interaction(&self, cell: u32, ray: &Ray, t: f32, to_world: &Transform, flip: bool) -> SurfaceHit {
        let (o, d, _) = local(ray, to_world);
        let corners = self.corners(cell);
        let scale = self.size.map(|n| f64::from(n - 1));
        let mut p: [f64; 3] = std::array::from_fn(|k| o[k] + f64::from(t) * d[k]);
        // What rounding of t has left of the distance to the surface.
        for _ in 0..2 {
            let at = self.in_cell(cell, p);
            let slope: [f64; 3] = gradient(&corners, at);
            let slope: [f64; 3] = std::array::from_fn(|k| slope[k] * scale[k]);
            let length2: f64 = slope.iter().map(|v| v * v).sum();
            if length2 > 0.0 {
                let step = value(&corners, at) / length2;
                // A root that is double is left as it is.
                if step.abs() * length2.sqrt() < 1e-3 {
                    p = std::array::from_fn(|k| p[k] - step * slope[k]);
                }
            }
        }
        let slope = gradient(&corners, self.in_cell(cell, p));
        let n = unit(std::array::from_fn(|k| slope[k] * scale[k]))
            .or_else(|| unit(d.map(|v| -v)))
            .unwrap_or(Vec3::new(0.0, 0.0, 1.0));
        let ns = if self.smooth { self.smooth_normal(p).unwrap_or(n) } else { n };
        let frame = Frame::from_z(ns);
        let [x, y, z] = p.map(|v| v as f32);
        let p = Point3::new(x, y, z);
        let p_error = p.abs().to_vec() * gamma(2);
        let (n, ns) = (n.to_normal(), ns.to_normal());
        let shading = Shading { n: ns, dpdu: frame.x, dpdv: frame.y, ..Shading::default() };
        let hit = SurfaceHit {
            p,
            p_error,
            n: n.face_forward(ns),
            uv: Point2::default(),
            dpdu: frame.x,
            dpdv: frame.y,
            shading,
        };
        let hit = if flip { hit.flipped() } else { hit };
        hit.transformed(to_world)
    }

    /// The interpolated distance at a point of the unit cube; beyond it, that of its face.
    fn value_at(&self, p: [f64; 3]) -> f64 {
        let mut cell = [0u32; 3];
        let mut at = [0.0f64; 3];
        for k in 0..3 {
            let last = self.size[k] - 1;
            let x = (p[k] * f64::from(last)).clamp(0.0, f64::from(last));
            cell[k] = (x as u32).min(last - 1);
            at[k] = x - f64::from(cell[k]);
        }
        let [nx, ny, _] = self.size.map(|n| n - 1);
        value(&self.corners((cell[2] * ny + cell[1]) * nx + cell[0]), at)
    }

    /// The normals of the eight cells around a point, blended as between the cells' centres, so that they do not jump.
    fn smooth_normal(&self, p: [f64; 3]) -> Option<Vec3> {
        // Along each axis: the slope across the cell before and the one behind the nearest wall, and how much of the latter.
        let mut slopes = [[0.0f64; 2]; 3];
        let mut weights = [0.0f64; 3];
        for k in 0..3 {
            let cells = f64::from(self.size[k] - 1);
            let x = p[k] * cells;
            let wall = (x + 0.5).floor().clamp(0.0, cells);
            weights[k] = match wall {
                w if w <= 0.0 => 1.0,
                w if w >= cells => 0.0,
                w => (x - w + 0.5).clamp(0.0, 1.0),
            };
            let at = |wall: f64| {
                let mut q = p;
                q[k] = wall / cells;
                self.value_at(q)
            };
            let middle = at(wall);
            slopes[k] = [(middle - at((wall - 1.0).max(0.0))) * cells, (at((wall + 1.0).min(cells)) - middle) * cells];
        }
        let mut sum = Vec3::default();
        for i in 0..8usize {
            let side = |k: usize| i >> k & 1;
            let weight: f64 = (0..3).map(|k| if side(k) == 1 { weights[k] } else { 1.0 - weights[k] }).product();
            if weight > 0.0
                && let Some(n) = unit(std::array::from_fn(|k| slopes[k][side(k)]))
            {
                sum += n * weight as f32;
            }
        }
        sum.try_normalize()
    }
}

/// Origin and direction of a ray in the space of the grid, and a bound on the error of the origin.
fn local(ray: &Ray, to_world: &Transform) -> ([f64; 3], [f64; 3], f64) {
    let back = to_world.inverse();
    let (o, error) = back.point_with_error(ray.o, Vec3::default());
    let error = f64::from(error.x.max(error.y).max(error.z));
    (o.to_array().map(f64::from), back.vector(ray.d).to_array().map(f64::from), error)
}

fn unit(v: [f64; 3]) -> Option<Vec3> {
    // Distances may be of any scale.
    let most = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let [x, y, z] = v.map(|x| (x / most) as f32);
    Vec3::new(x, y, z).try_normalize()
}

/// Trilinear interpolation between corners.
fn value(c: &[f64; 8], [x, y, z]: [f64; 3]) -> f64 {
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |i: usize| mix(c[i], c[i + 1], x);
    mix(mix(row(0), row(2), y), mix(row(4), row(6), y), z)
}

/// Its gradient, per cell.
fn gradient(c: &[f64; 8], p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (mut low, mut high) = (p, p);
        (low[k], high[k]) = (0.0, 1.0);
        value(c, high) - value(c, low)
    })
}

/// The interpolation along `o + s d`.
fn along_line(c: &[f64; 8], o: [f64; 3], d: [f64; 3]) -> Cubic {
    // Interpolating along one axis multiplies by a line: degree by degree.
    let mix = |a: Cubic, b: Cubic, k: usize| -> Cubic {
        let delta: Cubic = std::array::from_fn(|i| b[i] - a[i]);
        std::array::from_fn(|i| a[i] + delta[i] * o[k] + if i > 0 { delta[i - 1] * d[k] } else { 0.0 })
    };
    let corner = |i: usize| [c[i], 0.0, 0.0, 0.0];
    let row = |i: usize| mix(corner(i), corner(i + 1), 0);
    mix(mix(row(0), row(2), 1), mix(row(4), row(6), 1), 2)
}

fn evaluate(f: &Cubic, s: f64) -> f64 {
    f[0] + s * (f[1] + s * (f[2] + s * f[3]))
}

/// The least root in `[0, end]`. If `on_surface`, zero is one already, and whatever is left of it is not counted.
fn first_root(f: &Cubic, end: f64, on_surface: bool) -> Option<f64> {
    // Between its extremes, the cubic only rises or only falls.
    let mut stops = [0.0, end, end, end];
    let mut count = 1;
    for s in extremes(f) {
        if s > stops[count - 1] && s < end {
            stops[count] = s;
            count += 1;
        }
    }
    for i in 0..count {
        let (a, b) = (stops[i], if i + 1 < count { stops[i + 1] } else { end });
        let (fa, fb) = (evaluate(f, a), evaluate(f, b));
        if i == 0 && on_surface {
            continue;
        }
        if fa == 0.0 {
            return Some(a);
        }
        if fa * fb <= 0.0 {
            return Some(bracketed_root(f, a, b, fa));
        }
    }
    None
}

/// Where the derivative is zero, in order.
fn extremes(f: &Cubic) -> impl Iterator<Item = f64> {
    let (a, b, c) = (3.0 * f[3], 2.0 * f[2], f[1]);
    let discriminant = b * b - 4.0 * a * c;
    let mut roots = [f64::NAN; 2];
    if discriminant >= 0.0 {
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        roots = [q / a, c / q];
        roots.sort_by(f64::total_cmp);
    }
    roots.into_iter().filter(|r| r.is_finite())
}

/// The root between `a`, where the value is `fa`, and `b`, where it has the other sign: Newton's steps, halved where they lead out.
fn bracketed_root(f: &Cubic, mut a: f64, mut b: f64, fa: f64) -> f64 {
    let mut s = 0.5 * (a + b);
    for _ in 0..MOST_STEPS {
        let v = evaluate(f, s);
        if v == 0.0 {
            return s;
        }
        if (v < 0.0) == (fa < 0.0) {
            a = s;
        } else {
            b = s;
        }
        let slope = f[1] + s * (2.0 * f[2] + s * 3.0 * f[3]);
        let next = s - v / slope;
        let next = if next > a && next < b { next } else { 0.5 * (a + b) };
        if (next - s).abs() <= 1e-15 * b.abs() {
            return next;
        }
        s = next;
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sampling::rng::Rng;

    /// A sphere of radius 0.35 in the middle, sampled on `n` points each way.
    fn ball(n: u32, smooth: bool) -> DistanceGrid {
        let at = |i: u32| i as f32 / (n - 1) as f32 - 0.5;
        let points = (0..n * n * n).map(|i| [at(i % n), at(i / n % n), at(i / n / n)]);
        let values = points.map(|[x, y, z]| (x * x + y * y + z * z).sqrt() - 0.35).collect();
        DistanceGrid::new([n; 3], values, smooth).unwrap()
    }

    fn nearest(g: &DistanceGrid, ray: &Ray, t: &Transform) -> Option<(u32, f32)> {
        let hits = g.cells().filter_map(|c| g.intersect(c, ray, t).map(|t| (c, t)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    #[test]
    fn rays_meet_a_sphere_where_it_is_and_never_slip_through() {
        let (g, place) = (ball(17, false), Transform::IDENTITY);
        let mut rng = Rng::new(1, 2);
        let mut uniform = |low: f32, high: f32| low + (high - low) * rng.f32();
        for _ in 0..400 {
            let target = Point3::new(uniform(0.35, 0.65), uniform(0.35, 0.65), uniform(0.35, 0.65));
            let o = Point3::new(uniform(-3.0, 4.0), uniform(-3.0, 4.0), -2.0);
            let ray = Ray::new(o, target - o, 0.0);
            // Through a point well inside, so it must be met, at the distance of the sphere up to the grid's coarseness.
            let (cell, t) = nearest(&g, &ray, &place).expect("a ray slipped through");
            let hit = g.interaction(cell, &ray, t, &place, false);
            let radius = hit.p - Point3::new(0.5, 0.5, 0.5);
            assert!((radius.length() - 0.35).abs() < 4e-3, "{}", radius.length());
            assert!(hit.n.dot(radius) > 0.98 * radius.length() && hit.n.dot(ray.d) < 0.0);
            assert!(g.bounds(cell).contains(hit.p));
            // From there, straight on leads to the other side, and away from it to nothing.
            let through = Ray::new(hit.spawn(ray.d, 0.0).o, ray.d, 0.0);
            assert!(nearest(&g, &through, &place).is_some_and(|(_, t)| t > 1e-3));
            let off = hit.spawn(hit.n.to_vec(), 0.0);
            assert!(nearest(&g, &off, &place).is_none());
        }
    }

    #[test]
    fn what_is_drawn_out_far_away_is_met_in_its_own_space() {
        let g = ball(9, true);
        let place =
            Transform::translate(Vec3::new(900.0, -300.0, 50.0)).mul(&Transform::scale(40.0, 10.0, 20.0).unwrap());
        let mut rng = Rng::new(3, 4);
        for _ in 0..500 {
            let o = Point3::new(920.0 + 60.0 * (rng.f32() - 0.5), -295.0 + 10.0 * (rng.f32() - 0.5), -1000.0);
            let end = Point3::new(920.0 + 8.0 * (rng.f32() - 0.5), -295.0 + 2.0 * (rng.f32() - 0.5), 60.0);
            let ray = Ray::new(o, end - o, 0.0);
            let (cell, t) = nearest(&g, &ray, &place).expect("the middle is met");
            let hit = g.interaction(cell, &ray, t, &place, false);
            assert!((hit.p - ray.at(t)).length() < 2e-3);
            for w in [hit.n.to_vec(), (hit.n.to_vec() + hit.shading.dpdu.normalize() * 3.0).normalize()] {
                let off = hit.spawn(w, 0.0);
                assert!(nearest(&g, &off, &place).is_none_or(|(_, t)| t > 0.3), "its own surface is in the way");
            }
        }
    }

    #[test]
    fn smooth_normals_do_not_jump_between_cells() {
        let jump = |smooth: bool| {
            let g = ball(9, smooth);
            let mut most = 0.0f32;
            let mut last: Option<Vec3> = None;
            for i in 0..800 {
                let x = 0.3 + 0.4 * i as f32 / 800.0;
                let ray = Ray::new(Point3::new(x, 0.43, -1.0), Vec3::new(0.0, 0.0, 1.0), 0.0);
                let (cell, t) = nearest(&g, &ray, &Transform::IDENTITY).unwrap();
                let n = g.interaction(cell, &ray, t, &Transform::IDENTITY, false).shading.n.to_vec();
                most = most.max(last.map_or(0.0, |l| (n - l).length()));
                last = Some(n);
            }
            most
        };
        assert!(jump(true) < 1e-2, "{}", jump(true));
        assert!(jump(false) > 3e-2, "{}", jump(false));
    }

    #[test]
    fn the_first_of_three_roots_is_found() {
        // (s - 0.1) (s - 0.4) (s - 0.9)
        let f = [-0.036, 0.49, -1.4, 1.0];
        assert!((first_root(&f, 1.0, false).unwrap() - 0.1).abs() < 1e-12);
        assert!((first_root(&[0.0, 0.36, -1.3, 1.0], 1.0, true).unwrap() - 0.4).abs() < 1e-12);
        assert!(first_root(&f, 0.05, false).is_none());
        assert!(first_root(&[1.0, 0.0, 0.0, 0.0], 1.0, false).is_none());
        assert!((first_root(&[-0.5, 1.0, 0.0, 0.0], 1.0, false).unwrap() - 0.5).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        assert!(matches!(DistanceGrid::new([2, 2, 1], vec![1.0; 4], true), Err(DistanceGridError::Size { .. })));
        assert!(matches!(DistanceGrid::new([2; 3], vec![1.0; 7], true), Err(DistanceGridError::Size { .. })));
        assert!(matches!(DistanceGrid::new([2; 3], vec![1.0; 8], true), Err(DistanceGridError::NoSurface)));
        assert!(matches!(DistanceGrid::new([2; 3], vec![0.0; 8], true), Err(DistanceGridError::NoSurface)));
        let mut values = vec![1.0; 8];
        values[3] = f32::NAN;
        assert_eq!(DistanceGrid::new([2; 3], values, true), Err(DistanceGridError::Value { index: 3 }));
        assert!(DistanceGrid::new([u32::MAX; 3], vec![1.0], true).is_err());
    }
}
