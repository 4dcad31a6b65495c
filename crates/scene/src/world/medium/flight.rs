//! Free flight: where the next collision, real or null, happens along a ray.
//!
//! The distance to a collision is exponential in the optical depth of the majorant, taken in one lane, the hero's. What
//! the other lanes would have done is returned as a ratio of densities (Miller et al. 2019, "A null-scattering path
//! integral formulation of light transport").

use super::majorant::Majorants;
use super::{BuiltShape, MediumPoint, MediumRay};
use steradian_math::{Point3, ln};
use steradian_spectrum::Lanes;

/// A flight through a medium, from collision to collision.
#[derive(Clone, Debug)]
pub struct FreeFlight<'w> {
    medium: MediumRay<'w>,
    majorants: Majorants<'w>,
    scale: Lanes,
    hero: usize,
    /// The stretch ahead and the majorant in it.
    t: f32,
    t_end: f32,
    majorant: Lanes,
    /// Optical depth of the majorant since the last collision.
    depth: Lanes,
}

/// A collision with the medium or with the matter that fills it up to the majorant.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// Distance along the ray.
    pub t: f32,
    /// Where it happens.
    pub p: Point3,
    /// The transmittance of the majorant since the last collision, over its value in the hero's lane.
    pub transmittance: Lanes,
    /// The majorant: the density per unit length of collisions is majorant times transmittance.
    pub majorant: Lanes,
    /// The medium at the place.
    pub point: MediumPoint,
}

impl Collision {
    /// The coefficient of null collisions.
    #[inline]
    pub fn sigma_n(&self) -> Lanes {
        (self.majorant - self.point.sigma_a - self.point.sigma_s).clamp_zero()
    }
}

impl<'w> MediumRay<'w> {
    /// The medium, if it is the same everywhere.
    #[inline]
    pub fn everywhere(&self) -> Option<MediumPoint> {
        matches!(self.built.shape, BuiltShape::Everywhere).then(|| self.at(0.0))
    }

    /// Whether a path is to lose what is absorbed by weight and not by chance: where the albedo varies by itself and has a colour, chances of
    /// one lane are bad ones for the others.
    #[inline]
    pub fn absorbs_by_weight(&self) -> bool {
        matches!(self.built.shape, BuiltShape::Fields(_))
    }

    /// The transmittance up to the distance `t_max`, where it is known without tracking: in media that are the same everywhere.
    #[inline]
    pub fn transmittance(&self, t_max: f32) -> Option<Lanes> {
        self.everywhere().map(|m| (0.0 - depth_of(m.sigma_a + m.sigma_s, t_max)).exp())
    }

    /// A flight up to the distance `t_max`, whose collisions are sampled for the lane `hero`.
    #[inline]
    pub fn fly(self, t_max: f32, hero: usize) -> FreeFlight<'w> {
        FreeFlight {
            majorants: self.majorants(t_max),
            scale: self.majorant_scale(),
            medium: self,
            hero,
            t: 0.0,
            t_end: 0.0,
            majorant: Lanes::ZERO,
            depth: Lanes::ZERO,
        }
    }
}

/// Optical depth of a stretch, which may be infinitely long where there is nothing.
#[inline]
fn depth_of(majorant: Lanes, length: f32) -> Lanes {
    majorant.map(|m| if m > 0.0 { m * length } else { 0.0 })
}

impl FreeFlight<'_> {
    /// The next collision, from a number in [0, 1); `None` when the ray gets through to its end.
    #[inline]
    pub fn next(&mut self, u: f32) -> Option<Collision> {
        let mut left = -ln(1.0 - u);
        loop {
            let sigma = self.majorant[self.hero];
            let length = self.t_end - self.t;
            if sigma > 0.0 && left < sigma * length {
                let step = left / sigma;
                self.t = (self.t + step).min(self.t_end);
                self.depth += depth_of(self.majorant, step);
                let transmittance = self.passed();
                self.depth = Lanes::ZERO;
                return Some(Collision {
                    t: self.t,
                    p: self.medium.position(self.t),
                    transmittance,
                    majorant: self.majorant,
                    point: self.medium.at(self.t),
                });
            }
            if length > 0.0 {
                let depth = depth_of(self.majorant, length);
                left -= depth[self.hero];
                self.depth += depth;
            }
            let segment = self.majorants.next()?;
            (self.t, self.t_end) = (segment.t0, segment.t1);
            self.majorant = self.scale * segment.majorant;
        }
    }

    /// The transmittance of the majorant since the last collision, over its value in the hero's lane; the lanes of the
    /// ratio are what a path that gets through is to be multiplied with.
    #[inline]
    pub fn passed(&self) -> Lanes {
        let hero = self.depth[self.hero];
        // The lanes of a grey medium are all the same.
        if self.depth == Lanes::splat(hero) { Lanes::ONE } else { (hero - self.depth).exp() }
    }
}
