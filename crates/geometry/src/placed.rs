//! Quadrics put somewhere in space: one closed set, and the change of measure that a transform brings.

use steradian_math::{Bounds3, Normal3, Point3, Ray, Transform, Vec3};

use crate::{Cylinder, Disk, QuadricHit, Reference, ShapeSample, Sphere, SurfaceHit, area_to_solid_angle};

/// A shape that is described in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quadric {
    /// A sphere or part of it.
    Sphere(Sphere),
    /// A disk, ring or sector.
    Disk(Disk),
    /// An open cylinder.
    Cylinder(Cylinder),
}

/// The only `match` over the kinds of quadrics.
macro_rules! with_quadric {
    ($quadric:expr, $q:ident => $body:expr) => {
        match $quadric {
            Quadric::Sphere($q) => $body,
            Quadric::Disk($q) => $body,
            Quadric::Cylinder($q) => $body,
        }
    };
}

impl Quadric {
    fn bounds(&self) -> Bounds3 {
        with_quadric!(self, q => q.bounds())
    }

    fn area(&self) -> f32 {
        with_quadric!(self, q => q.area())
    }

    fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        with_quadric!(self, q => q.sample_area(u))
    }
}

/// A quadric, its place, and which side is out. Everything here is in the space that the transform leads to.
#[derive(Clone, Copy, Debug)]
pub struct PlacedQuadric {
    quadric: Quadric,
    to_world: Transform,
    flip: bool,
    /// Whether the transform keeps angles: then solid angles in both spaces are the same.
    keeps_angles: bool,
    area: f32,
}

impl PlacedQuadric {
    /// Puts a quadric in place. Its normal is flipped if `reverse_orientation` is set, or if the transform swaps
    /// handedness, but not if both.
    pub fn new(quadric: Quadric, to_world: Transform, reverse_orientation: bool) -> Self {
        let flip = reverse_orientation ^ to_world.swaps_handedness();
        let keeps_angles = to_world.keeps_angles();
        let mut placed = Self { quadric, to_world, flip, keeps_angles, area: 0.0 };
        // The mean stretch over uniform points; exact if it is the same everywhere.
        let n = if keeps_angles { 1 } else { 32 };
        let cell = |i: usize| (i as f32 + 0.5) / n as f32;
        let stretches = (0..n * n).filter_map(|i| quadric.sample_area([cell(i % n), cell(i / n)]));
        let total: f64 = stretches.map(|s| f64::from(placed.stretch(s.n))).sum();
        placed.area = (f64::from(quadric.area()) * total / (n * n) as f64) as f32;
        placed
    }

    /// By how much the transform stretches areas, where the unit normal in the quadric's space is `n`.
    fn stretch(&self, n: Normal3) -> f32 {
        self.to_world.determinant3().abs() * self.to_world.normal(n).length()
    }

    /// A box around it.
    pub fn bounds(&self) -> Bounds3 {
        self.to_world.bounds(&self.quadric.bounds())
    }

    /// The nearest hit with `0 < t <= ray.t_max`, in the quadric's space.
    pub fn intersect(&self, ray: &Ray) -> Option<QuadricHit> {
        let to_object = self.to_world.inverse();
        let (o, o_error) = to_object.point_with_error(ray.o, Vec3::default());
        let local = Ray { o, d: to_object.vector(ray.d), ..*ray };
        with_quadric!(&self.quadric, q => q.intersect(&local, o_error))
    }

    /// Everything about a point that [`PlacedQuadric::intersect`] found.
    pub fn interaction(&self, hit: &QuadricHit) -> SurfaceHit {
        let local = with_quadric!(&self.quadric, q => q.interaction(hit));
        let local = if self.flip { local.flipped() } else { local };
        local.transformed(&self.to_world)
    }

    /// The area. Exact if the transform keeps angles, else by quadrature.
    pub fn area(&self) -> f32 {
        self.area
    }

    fn place(&self, s: ShapeSample) -> ShapeSample {
        let (p, p_error) = self.to_world.point_with_error(s.p, s.p_error);
        let n = self.to_world.normal(s.n).normalize();
        ShapeSample { p, p_error, n: if self.flip { -n } else { n }, ..s }
    }

    /// A random point; uniform if the transform keeps angles. `pdf` is per area.
    pub fn sample_area(&self, u: [f32; 2]) -> Option<ShapeSample> {
        let s = self.quadric.sample_area(u)?;
        let pdf = s.pdf / self.stretch(s.n);
        (pdf.is_finite() && pdf > 0.0).then(|| ShapeSample { pdf, ..self.place(s) })
    }

    /// The density per area of [`PlacedQuadric::sample_area`] where the unit normal is `n`.
    pub fn pdf_area(&self, n: Normal3) -> f32 {
        // The inverse's inverse transpose undoes what the transform did to the quadric's normal.
        let back = self.to_world.inverse().normal(n).length();
        back / (self.quadric.area() * self.to_world.determinant3().abs())
    }

    /// A point seen from `from`. `pdf` is per solid angle.
    pub fn sample_solid_angle(&self, from: &Reference, u: [f32; 2]) -> Option<ShapeSample> {
        if !self.keeps_angles {
            return self.sample_area(u)?.seen_from(from.p);
        }
        let local = from.transformed(&self.to_world.inverse());
        let s = with_quadric!(&self.quadric, q => q.sample_solid_angle(&local, u))?;
        Some(self.place(s))
    }

    /// The density per solid angle with which [`PlacedQuadric::sample_solid_angle`] gives the direction to `p`, the
    /// nearest point in its direction, where the unit normal is `n`.
    pub fn pdf_solid_angle(&self, from: &Reference, p: Point3, n: Normal3) -> f32 {
        if !self.keeps_angles {
            return crate::hit::finite_or_zero(area_to_solid_angle(self.pdf_area(n), from.p, p, n));
        }
        let to_object = self.to_world.inverse();
        let local = from.transformed(&to_object);
        let (p, n) = (to_object.point(p), to_object.normal(n).normalize());
        with_quadric!(&self.quadric, q => q.pdf_solid_angle(&local, p, n))
    }
}
