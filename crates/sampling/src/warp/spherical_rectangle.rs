//! Uniform directions of a planar rectangle seen from a point (Ureña, Fajardo and King, "An area-preserving
//! parametrization for spherical rectangles", 2013).

use steradian_math::{Point3, Vec3, sin_cos};

/// A rectangle that is ready to be sampled uniformly by solid angle from one point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    origin: Point3,
    x: Vec3,
    y: Vec3,
    z: Vec3,
    bounds: Bounds,
    angles: Angles,
}

/// The rectangle in its own frame, seen from zero; `z < 0`.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    z: f32,
}

/// Cosines `b0`, `b1` of the lower and upper edge planes, `k` the constant of the paper's equation, and the solid angle.
#[derive(Clone, Copy, Debug)]
struct Angles {
    b0: f32,
    b1: f32,
    /// Sum of the two angles at `x0`, negated: the phase at which the left edge starts.
    start: f32,
    area: f32,
}

impl Bounds {
    fn angles(&self) -> Angles {
        let corner = |x: f32, y: f32| Vec3::new(x, y, self.z);
        let [v00, v01] = [corner(self.x0, self.y0), corner(self.x0, self.y1)];
        let [v10, v11] = [corner(self.x1, self.y0), corner(self.x1, self.y1)];
        let n0 = v00.cross(v10).normalize();
        let n1 = v10.cross(v11).normalize();
        let n2 = v11.cross(v01).normalize();
        let n3 = v01.cross(v00).normalize();
        // Deviations from a right angle: for a small rectangle they are small, so that their sum is exact.
        let deviation = |a: Vec3, b: Vec3| steradian_math::asin(a.dot(b).clamp(-1.0, 1.0));
        let (d0, d1, d2, d3) = (deviation(n0, n1), deviation(n1, n2), deviation(n2, n3), deviation(n3, n0));
        Angles { b0: n0.z, b1: n2.z, start: d2 + d3, area: d0 + d1 + d2 + d3 }
    }
}

impl SphericalRectangle {
    /// Prepares the rectangle `corner + s * ex + t * ey`, s and t in `[0, 1]`, seen from `origin`.
    ///
    /// The edges are orthogonal. `None` if the rectangle has no area or is seen edge-on.
    pub fn new(origin: Point3, corner: Point3, ex: Vec3, ey: Vec3) -> Option<Self> {
        let (x, y) = (ex.try_normalize()?, ey.try_normalize()?);
        let mut z = x.cross(y).try_normalize()?;
        let d = corner - origin;
        let mut distance = d.dot(z);
        if distance > 0.0 {
            z = -z;
            distance = -distance;
        }
        let (x0, y0) = (d.dot(x), d.dot(y));
        let bounds = Bounds { x0, x1: x0 + ex.length(), y0, y1: y0 + ey.length(), z: distance };
        if distance == 0.0 {
            return None;
        }
        let angles = bounds.angles();
        (angles.area > 0.0).then_some(Self { origin, x, y, z, bounds, angles })
    }

    /// Solid angle in steradians.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.angles.area
    }

    /// Density of the direction to [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self) -> f32 {
        1.0 / self.angles.area
    }

    /// A point of the rectangle whose direction from the origin is uniform by solid angle.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Point3 {
        let Bounds { x0, x1, y0, y1, z } = self.bounds;
        let Angles { b0, b1, start, area } = self.angles;
        // The phase is pi + (u area - start); cosine and sine of the sum have the sign flipped.
        let (sin, cos) = sin_cos(u[0] * area - start);
        let fu = (cos * b0 + b1) / sin;
        let inverse = fu * fu + b0 * b0;
        let cu = (1.0 / inverse.sqrt()).copysign(fu).clamp(-1.0, 1.0);
        let xu = if sin == 0.0 { 0.0 } else { -(cu * z) / (1.0 - cu * cu).max(1e-12).sqrt() }.clamp(x0, x1);
        let d2 = xu * xu + z * z;
        let h0 = y0 / (d2 + y0 * y0).sqrt();
        let h1 = y1 / (d2 + y1 * y1).sqrt();
        let h = h0 + u[1] * (h1 - h0);
        let one_minus = 1.0 - h * h;
        let yv = if one_minus > 1e-6 { h * d2.sqrt() / one_minus.sqrt() } else { y1 };
        self.origin + self.x * xu + self.y * yv.clamp(y0, y1) + self.z * z
    }

    /// The random numbers that make [`Self::sample`] return `p`, a point of the rectangle.
    pub fn invert(&self, p: Point3) -> [f32; 2] {
        let Bounds { x0, x1, y0, y1, z } = self.bounds;
        let d = p - self.origin;
        let (xu, yv) = (d.dot(self.x).clamp(x0, x1), d.dot(self.y).clamp(y0, y1));
        // The map preserves area, so u[0] is the share of the part to the left of the point.
        let left = if xu > x0 { Bounds { x1: xu, ..self.bounds }.angles().area } else { 0.0 };
        let d2 = xu * xu + z * z;
        let sine = |y: f32| y / (d2 + y * y).sqrt();
        let (h0, h1) = (sine(y0), sine(y1));
        let u1 = if h1 > h0 { (sine(yv) - h0) / (h1 - h0) } else { 0.0 };
        [(left / self.angles.area).clamp(0.0, 1.0), u1.clamp(0.0, 1.0)]
    }
}
