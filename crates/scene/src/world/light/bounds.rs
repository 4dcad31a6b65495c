//! Bounds on where, in which directions and how much a group of lights emits (Conty Estevez and Kulla 2018; PBRT 4th
//! ed., 12.6.3).

use steradian_math::{Bounds3, PI, Point3, Vec3, safe_acos, safe_sqrt, sin_cos};

/// A cone of directions around a unit axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    axis: Vec3,
    cos: f32,
}

impl Cone {
    const SPHERE: Cone = Cone { axis: Vec3::new(0.0, 0.0, 1.0), cos: -1.0 };

    /// A cone around both.
    fn union(self, o: Cone) -> Cone {
        let (ta, tb) = (safe_acos(self.cos), safe_acos(o.cos));
        let between = self.axis.angle_between(o.axis);
        if (between + tb).min(PI) <= ta {
            return self;
        }
        if (between + ta).min(PI) <= tb {
            return o;
        }
        let half = (ta + between + tb) * 0.5;
        if half >= PI {
            return Cone::SPHERE;
        }
        let Some(pole) = self.axis.cross(o.axis).try_normalize() else { return Cone::SPHERE };
        // Turn the first axis towards the second until its own edge is the edge of the union.
        let (s, c) = sin_cos(half - ta);
        let axis = self.axis * c + pole.cross(self.axis) * s;
        Cone { axis: axis.normalize(), cos: sin_cos(half).1 }
    }
}

/// Bounds on emission: position, normals within a cone, emission within a further angle of the normals, and power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Where the light is.
    pub bounds: Bounds3,
    cone: Cone,
    cos_emission: f32,
    /// Emitted power, in any common unit.
    pub power: f32,
    two_sided: bool,
}

/// A rounded zero would be bias: lights reach a little beyond the edge of their emission.
const EDGE: f32 = 1e-4;

/// [`LightBounds`] as the tree's nodes keep them; see [`super::tree`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prepared {
    /// Of the sphere around the bounds.
    pub centre: [f32; 3],
    /// Of the same sphere, squared.
    pub radius2: f32,
    /// Of the cone of normals.
    pub axis: [f32; 3],
    /// Cosine and sine of the cone's half angle.
    pub cos: f32,
    /// See there.
    pub sin: f32,
    /// The least cosine to a normal at which light is emitted, less a margin.
    pub least: f32,
    /// -1 where both sides emit, else 1.
    pub mirror: f32,
    /// Emitted power.
    pub power: f32,
}

impl LightBounds {
    /// Bounds of one light: `axis` with all normals within `cos_normals` of it, emission up to `cos_emission` from a
    /// normal.
    pub fn new(bounds: Bounds3, axis: Vec3, cos_normals: f32, cos_emission: f32, power: f32, two_sided: bool) -> Self {
        Self { bounds, cone: Cone { axis, cos: cos_normals }, cos_emission, power, two_sided }
    }

    /// Bounds of an isotropic point of light.
    pub fn point(p: Point3, power: f32) -> Self {
        Self::new(Bounds3::new(p, p), Vec3::new(0.0, 0.0, 1.0), -1.0, 0.0, power, false)
    }

    /// Bounds of two groups together.
    pub fn union(self, o: Self) -> Self {
        if self.power <= 0.0 {
            return o;
        }
        if o.power <= 0.0 {
            return self;
        }
        Self {
            bounds: self.bounds.union(o.bounds),
            cone: self.cone.union(o.cone),
            cos_emission: self.cos_emission.min(o.cos_emission),
            power: self.power + o.power,
            two_sided: self.two_sided || o.two_sided,
        }
    }

    /// What the tree works with.
    pub fn prepared(&self) -> Prepared {
        let cos = self.cone.cos;
        Prepared {
            centre: self.bounds.centroid().to_array(),
            radius2: self.bounds.diagonal().length_squared() * 0.25,
            axis: self.cone.axis.to_array(),
            cos,
            sin: safe_sqrt(1.0 - cos * cos),
            least: self.cos_emission - EDGE,
            mirror: if self.two_sided { -1.0 } else { 1.0 },
            power: self.power,
        }
    }

    /// The cost of making this a node, for the surface area orientation heuristic; `extent` is the parent's diagonal and
    /// `axis` the one split.
    pub fn cost(&self, extent: Vec3, axis: usize) -> f32 {
        let theta_o = safe_acos(self.cone.cos);
        let theta_w = (theta_o + safe_acos(self.cos_emission)).min(PI);
        let (sin_o, cos_o) = sin_cos(theta_o);
        let m = 2.0 * PI * (1.0 - cos_o)
            + PI / 2.0 * (2.0 * theta_w * sin_o - sin_cos(theta_o - 2.0 * theta_w).1 - 2.0 * theta_o * sin_o + cos_o);
        let regular = extent.max_component() / extent[axis];
        // A group of points has no area; the least of one keeps power in play.
        self.power * m * regular * (self.bounds.surface_area() + 1e-12)
    }
}
