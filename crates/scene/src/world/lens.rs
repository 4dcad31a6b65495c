//! Camera rays through a system of lenses: where on the rear lens a film point finds light, and how much each ray counts
//! (Kolb, Mitchell and Hanrahan 1995; PBRT 4th ed., 5.4.5-5.4.6).
//!
//! Unlike pbrt-v4 the bounds of the exit pupil are those of the smallest disc around the stop's shape: only what is
//! symmetric about the axis may be found for one film point and then turned for all others.

use crate::{LensRay, LensSystem};
use rayon::prelude::*;
use steradian_math::{Point3, Vec3};

/// So many rings of the film have a pupil of their own.
const RINGS: usize = 64;
/// A pupil is looked for on a grid of this many points a side, and then again in its part where the pupil is.
const GRID: usize = 96;
/// Where that grid finds nothing, this finer one is asked before the film point is called dark.
const FINE_GRID: usize = 512;

/// The rectangle that holds all points of the rear plane that light comes through, for a film point on +x.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rectangle {
    min: [f64; 2],
    max: [f64; 2],
}

impl Rectangle {
    fn around(self, o: Self) -> Self {
        let pick = |f: fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]| [f(a[0], b[0]), f(a[1], b[1])];
        Self { min: pick(f64::min, self.min, o.min), max: pick(f64::max, self.max, o.max) }
    }

    fn grown(self, by: [f64; 2]) -> Self {
        Self { min: [self.min[0] - by[0], self.min[1] - by[1]], max: [self.max[0] + by[0], self.max[1] + by[1]] }
    }

    fn side(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }
}

/// A lens before a film.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    system: LensSystem,
    /// Width and height of the film in metres.
    extent: [f64; 2],
    diagonal: f64,
    pupils: Vec<Option<Rectangle>>,
}

impl Lens {
    /// Finds the exit pupils for a film with the given diagonal in metres.
    pub fn new(system: &LensSystem, diagonal: f64, resolution: [f32; 2]) -> Self {
        let aspect = f64::from(resolution[1]) / f64::from(resolution[0]);
        let width = (diagonal * diagonal / (1.0 + aspect * aspect)).sqrt();
        // The ends and the middle of every ring.
        let radii: Vec<f64> = (0..=2 * RINGS).map(|i| 0.5 * diagonal * i as f64 / (2 * RINGS) as f64).collect();
        let found: Vec<Option<Rectangle>> = radii.par_iter().map(|&r| pupil(system, r)).collect();
        let pupils =
            (0..RINGS).map(|i| found[2 * i..=2 * i + 2].iter().flatten().copied().reduce(Rectangle::around)).collect();
        Self { system: system.clone(), extent: [width, aspect * width], diagonal, pupils }
    }

    /// The ray in camera space through a film position given in fractions of the picture, and its weight. `None` where no
    /// light comes through.
    #[inline]
    pub fn ray(&self, at: [f32; 2], u: [f32; 2]) -> Option<(Point3, Vec3, f32)> {
        // The picture on the film is upside down: what is on the left of it comes from the right of the lens.
        let x = -(f64::from(at[0]) - 0.5) * self.extent[0];
        let y = (f64::from(at[1]) - 0.5) * self.extent[1];
        let r = (x * x + y * y).sqrt();
        let ring = ((r / (0.5 * self.diagonal) * RINGS as f64) as usize).min(RINGS - 1);
        let pupil = self.pupils[ring]?;
        let lens = [0, 1].map(|i| pupil.min[i] + f64::from(u[i]) * pupil.side(i));
        let area = pupil.side(0) * pupil.side(1);
        let (sin, cos) = if r > 0.0 { (y / r, x / r) } else { (0.0, 1.0) };
        let z = self.system.rear_z();
        let d = [cos * lens[0] - sin * lens[1] - x, sin * lens[0] + cos * lens[1] - y, z];
        let (out, transmittance) = self.system.trace_from_film(LensRay { o: [x, y, 0.0], d })?;
        let cos2 = z * z / (d[0] * d[0] + d[1] * d[1] + z * z);
        let weight = transmittance * cos2 * cos2 * area / (z * z);
        let [ox, oy, oz] = out.o.map(|v| v as f32);
        let [dx, dy, dz] = out.d.map(|v| v as f32);
        Some((Point3::new(ox, oy, oz), Vec3::new(dx, dy, dz).normalize(), weight as f32))
    }
}

/// The rectangle of the rear plane that light comes through to the film point at `(x, 0)`.
fn pupil(system: &LensSystem, x: f64) -> Option<Rectangle> {
    let half = 1.5 * system.rear_radius();
    let whole = Rectangle { min: [-half; 2], max: [half; 2] };
    let rough = search(system, x, whole, GRID).or_else(|| search(system, x, whole, FINE_GRID))?;
    // Again, closer. What was found was found by rays, so that there is always something.
    search(system, x, rough, GRID).or(Some(rough))
}

/// The part of a rectangle where rays come through, grown by more than the distance between the rays.
fn search(system: &LensSystem, x: f64, within: Rectangle, grid: usize) -> Option<Rectangle> {
    let (reach, z) = (system.stop_reach(), system.rear_z());
    let mut found: Option<Rectangle> = None;
    let at = |axis: usize, i: usize| within.min[axis] + within.side(axis) * (i as f64 + 0.5) / grid as f64;
    for j in 0..grid {
        for i in 0..grid {
            let (px, py) = (at(0, i), at(1, j));
            let ray = LensRay { o: [x, 0.0, 0.0], d: [px - x, py, z] };
            let point = Rectangle { min: [px, py], max: [px, py] };
            if system.passes_round_stop(ray, reach) {
                found = Some(found.map_or(point, |f| f.around(point)));
            }
        }
    }
    found.map(|f| f.grown([0, 1].map(|axis| 1.5 * within.side(axis) / grid as f64)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ApertureImage, LensInterface};
    use steradian_testkit::TestRng;

    fn system(aperture: Option<ApertureImage>) -> LensSystem {
        let s = |r: f64, t: f64, eta: f64, d: f64| LensInterface {
            curvature_radius: r * 1e-3,
            thickness: t * 1e-3,
            eta,
            aperture_radius: d * 0.5e-3,
        };
        let front = [s(51.7, 4.0, 1.5168, 22.0), s(-1900.0, 6.0, 1.0, 22.0), s(0.0, 6.0, 0.0, 12.0)];
        let rear = [s(1900.0, 4.0, 1.5168, 22.0), s(-51.7, 50.0, 1.0, 22.0)];
        LensSystem::new(front.into_iter().chain(rear).collect(), aperture, 6.0, 0.035).unwrap()
    }

    /// The mean weight through the pupil is the mean weight over the whole rear plane, with a round stop and with one
    /// that has no symmetry. Six standard errors, 2e-9 each.
    #[test]
    fn pupils_lose_no_light() {
        let corner: Vec<f32> = (0..64).map(|i| if i % 8 > 4 && i < 32 { 1.0 } else { 0.0 }).collect();
        for aperture in [None, ApertureImage::new(8, 8, &corner)] {
            let system = system(aperture);
            let lens = Lens::new(&system, 0.035, [64.0, 48.0]);
            let half = 1.5 * system.rear_radius();
            let mut rng = TestRng::new(4);
            for at in [[0.5, 0.5], [0.1, 0.8], [0.97, 0.03], [0.5, 0.95]] {
                let n = 40_000;
                let mut through = [0.0f64; 2];
                let mut all = [0.0f64; 2];
                let add = |sums: &mut [f64; 2], w: f64| {
                    sums[0] += w;
                    sums[1] += w * w;
                };
                for _ in 0..n {
                    add(&mut through, lens.ray(at, rng.f32_2d()).map_or(0.0, |r| f64::from(r.2)));
                    let x = -(f64::from(at[0]) - 0.5) * lens.extent[0];
                    let y = (f64::from(at[1]) - 0.5) * lens.extent[1];
                    let p = [(2.0 * rng.f64() - 1.0) * half, (2.0 * rng.f64() - 1.0) * half];
                    let (d, z) = ([p[0] - x, p[1] - y, system.rear_z()], system.rear_z());
                    let weight = system.trace_from_film(LensRay { o: [x, y, 0.0], d }).map_or(0.0, |(_, t)| {
                        let cos2 = z * z / (d[0] * d[0] + d[1] * d[1] + z * z);
                        t * cos2 * cos2 * 4.0 * half * half / (z * z)
                    });
                    add(&mut all, weight);
                }
                let n = f64::from(n);
                let variance = |s: &[f64; 2]| (s[1] / n - s[0] * s[0] / (n * n)) / n;
                let (difference, sd) = ((through[0] - all[0]) / n, (variance(&through) + variance(&all)).sqrt());
                assert!(through[0] > 0.0 && difference.abs() < 6.0 * sd, "{at:?}: {difference} with {sd}");
            }
        }
    }
}
