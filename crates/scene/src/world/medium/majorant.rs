//! Bounds on the density along a ray: a coarse grid of maxima, walked cell by cell (Amanatides and Woo 1987; PBRT 4th ed.,
//! 11.4.4).

use rayon::prelude::*;
use steradian_math::{Bounds3, Point3, Ray};

/// Upper bounds on a field in the cells of a cube that fills a box.
#[derive(Clone, Debug)]
pub(super) struct MajorantGrid {
    bounds: Bounds3,
    /// Cells along each axis.
    n: usize,
    /// x fastest.
    cells: Vec<f32>,
}

/// A stretch of a ray with a bound on the density there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    pub t0: f32,
    pub t1: f32,
    pub majorant: f32,
}

/// The stretches of a ray in order.
#[derive(Clone, Debug)]
pub(super) enum Majorants<'w> {
    /// No more.
    Done,
    /// One.
    Whole(Segment),
    /// Those of a grid.
    Walk(Walk<'w>),
}

/// A walk through the cells of a grid.
#[derive(Clone, Debug)]
pub(super) struct Walk<'w> {
    grid: &'w MajorantGrid,
    t: f32,
    t_end: f32,
    /// Where the ray crosses the next plane of each axis, and how far apart those planes are.
    crossing: [f32; 3],
    spacing: [f32; 3],
    cell: [i32; 3],
    step: [i32; 3],
}

impl MajorantGrid {
    /// Asks `most` for a bound in each cell, given as a box in the unit cube.
    pub fn new(bounds: Bounds3, n: usize, most: impl Fn(&Bounds3) -> f32 + Sync) -> Self {
        let edge = |i: usize| i as f32 / n as f32;
        let cells = (0..n * n * n)
            .into_par_iter()
            .map(|i| {
                let (x, y, z) = (i % n, i / n % n, i / (n * n));
                most(&Bounds3 {
                    min: Point3::new(edge(x), edge(y), edge(z)),
                    max: Point3::new(edge(x + 1), edge(y + 1), edge(z + 1)),
                })
            })
            .collect();
        Self { bounds, n, cells }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.cells.as_slice())
    }

    /// The stretches of a ray, given in the space of the box, up to the parameter `t_max`.
    #[inline]
    pub fn along(&self, ray: &Ray, t_max: f32) -> Majorants<'_> {
        let Some((t0, t1)) = self.bounds.intersect(ray.o, ray.d, t_max) else { return Majorants::Done };
        let (o, d, n) = (self.bounds.offset(ray.o), self.bounds.diagonal(), self.n as f32);
        let mut walk = Walk {
            grid: self,
            t: t0,
            t_end: t1,
            crossing: [f32::INFINITY; 3],
            spacing: [f32::INFINITY; 3],
            cell: [0; 3],
            step: [0; 3],
        };
        for axis in 0..3 {
            // In cells per unit of the parameter.
            let speed = ray.d[axis] / d[axis] * n;
            let at = o[axis] * n + speed * t0;
            let cell = at.floor().clamp(0.0, n - 1.0);
            walk.cell[axis] = cell as i32;
            if speed != 0.0 {
                walk.spacing[axis] = 1.0 / speed.abs();
                walk.step[axis] = if speed > 0.0 { 1 } else { -1 };
                let plane = if speed > 0.0 { cell + 1.0 } else { cell };
                walk.crossing[axis] = t0 + (plane - at) / speed;
            }
        }
        Majorants::Walk(walk)
    }
}

impl Majorants<'_> {
    /// One stretch with a bound of one.
    #[inline]
    pub fn whole(t0: f32, t1: f32) -> Self {
        Self::Whole(Segment { t0, t1, majorant: 1.0 })
    }
}

impl Iterator for Majorants<'_> {
    type Item = Segment;

    #[inline]
    fn next(&mut self) -> Option<Segment> {
        match self {
            Self::Done => None,
            Self::Whole(segment) => {
                let segment = *segment;
                *self = Self::Done;
                Some(segment)
            }
            Self::Walk(walk) => walk.next(),
        }
    }
}

impl Walk<'_> {
    #[inline]
    fn next(&mut self) -> Option<Segment> {
        if self.t >= self.t_end {
            return None;
        }
        let c = self.crossing;
        let axis = if c[0] < c[1] && c[0] < c[2] {
            0
        } else if c[1] < c[2] {
            1
        } else {
            2
        };
        let n = self.grid.n;
        let [x, y, z] = self.cell.map(|v| v as usize);
        let majorant = self.grid.cells[x + n * (y + n * z)];
        // A crossing that rounding has put behind us makes an empty stretch, not one that goes back.
        let t1 = c[axis].clamp(self.t, self.t_end);
        let segment = Segment { t0: self.t, t1, majorant };
        self.cell[axis] += self.step[axis];
        self.crossing[axis] += self.spacing[axis];
        let left = !(0..n as i32).contains(&self.cell[axis]);
        self.t = if left || c[axis] >= self.t_end { self.t_end } else { t1 };
        Some(segment)
    }
}
