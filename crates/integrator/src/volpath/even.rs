//! How far a ray flies in a medium that is the same everywhere: where transmittance leaves light, and where a lamp beside the ray sends it
//! (Kulla and Fajardo 2012, "Importance sampling techniques for path tracing in participating media").
//!
//! Whether the ray gets to its end is decided by transmittance alone. Where it does not, one half of the collisions is spread exponentially, the
//! other half evenly by the angle from the lamp, if one is near; both are weighted with their joint density, for each lane as if it were the hero.

use steradian_math::{Point3, exp, ln};
use steradian_sampling::warp::{unit_to_equiangular, unit_to_equiangular_pdf};
use steradian_spectrum::Lanes;

/// The share of collisions that go by a near lamp.
const SHARE: f32 = 0.5;

/// A stretch of a ray in a medium with extinction `sigma`, in the lane of which there is some.
#[derive(Clone, Copy, Debug)]
pub(super) struct EvenFlight {
    sigma: Lanes,
    length: f32,
    lamp: Option<Lamp>,
}

/// A lamp beside the ray.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    /// Where on the ray it is nearest.
    middle: f32,
    /// How near it is there.
    distance: f32,
}

/// One less `exp(-x)`, precise where `x` is small.
#[inline]
fn one_minus_exp(x: f32) -> f32 {
    if x < 0.02 { x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0))) } else { 1.0 - exp(-x) }
}

impl EvenFlight {
    /// Over a `length` > 0, which may be infinite.
    #[inline]
    pub fn new(sigma: Lanes, length: f32) -> Self {
        Self { sigma, length, lamp: None }
    }

    /// The probability of a collision with the lane as the hero.
    #[inline]
    pub fn caught(&self, sigma: f32) -> f32 {
        // Nothing in an infinite stretch is still nothing.
        if sigma > 0.0 { one_minus_exp(sigma * self.length) } else { 0.0 }
    }

    /// What gets as far as `t`.
    #[inline]
    pub fn transmittance(&self, t: f32) -> Lanes {
        self.sigma.map(|s| if s > 0.0 { exp(-s * t) } else { 1.0 })
    }

    /// How far the densest lane lets light come, about: a mean free path at most. The same whichever lane is the hero.
    #[inline]
    pub fn reach(&self) -> f32 {
        (1.0 / self.sigma.max_component()).min(self.length)
    }

    /// Looks for a lamp at `lamp`, with the ray given by its point at each distance. What is farther off than the reach does not count: seen
    /// from there, what can be reached is all the same.
    #[inline]
    pub fn with_lamp(self, at: impl Fn(f32) -> Point3, lamp: Point3) -> Self {
        let reach = self.reach();
        let (o, d) = (at(0.0), at(1.0) - at(0.0));
        let middle = (lamp - o).dot(d);
        let distance = (lamp - o).cross(d).length();
        let nearest = at(middle.clamp(0.0, reach));
        let near = (lamp - nearest).length_squared() < reach * reach && distance > 1e-4 * reach;
        Self { lamp: near.then_some(Lamp { middle, distance }), ..self }
    }

    /// A distance for `u` in [0, 1), given a collision with lane `hero` in charge.
    #[inline]
    pub fn sample(&self, u: f32, hero: usize) -> f32 {
        let sigma = self.sigma[hero];
        let exponential = |u: f32| (-ln(1.0 - u * self.caught(sigma)) / sigma).min(self.length);
        match &self.lamp {
            None => exponential(u),
            Some(l) if u < SHARE => {
                let x = unit_to_equiangular(u / SHARE, -l.middle, self.length - l.middle, l.distance);
                (x + l.middle).clamp(0.0, self.length)
            }
            Some(_) => exponential((u - SHARE) / (1.0 - SHARE)),
        }
    }

    /// The density of collisions per unit length at the distance `t`, with each lane as the hero; over all distances it integrates to
    /// [`EvenFlight::caught`].
    #[inline]
    pub fn density(&self, t: f32) -> Lanes {
        let by_lamp = self
            .lamp
            .map_or(0.0, |l| unit_to_equiangular_pdf(t - l.middle, -l.middle, self.length - l.middle, l.distance));
        let share = if self.lamp.is_some() { SHARE } else { 0.0 };
        self.sigma * self.transmittance(t) * (1.0 - share) + self.sigma.map(|s| self.caught(s)) * (share * by_lamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_math::Vec3;

    fn flight(length: f32, lamp: [f32; 3]) -> EvenFlight {
        let (o, d) = (Point3::new(0.1, 0.2, 0.3), Vec3::new(0.6, 0.0, 0.8));
        EvenFlight::new(Lanes([0.3, 1.0, 2.0, 0.0]), length).with_lamp(|t| o + d * t, o + Vec3::from_array(lamp))
    }

    #[test]
    fn distances_have_the_density_that_is_stated() {
        for (length, lamp, near) in [
            (1.5, [0.4, 0.1, 0.3], true),
            (1.5, [0.0, 5.0, 0.0], false),
            (0.2, [0.06, 0.02, 0.09], true),
            (f32::INFINITY, [0.5, 0.2, 0.2], true),
        ] {
            let f = flight(length, lamp);
            assert_eq!(f.lamp.is_some(), near, "{length} {lamp:?}");
            for hero in 0..3 {
                // The mean of 1 / density over a stretch is how long it is.
                const N: u32 = 200_000;
                let cut = length.min(1.0);
                let mut sum = 0.0f64;
                for i in 0..N {
                    let t = f.sample((i as f32 + 0.5) / N as f32, hero);
                    assert!((0.0..=length).contains(&t));
                    if t < cut {
                        sum += f64::from(f.caught(f.sigma[hero]) / f.density(t)[hero]) / f64::from(N);
                    }
                }
                assert!((sum / f64::from(cut) - 1.0).abs() < 1e-3, "{length} {lamp:?} {hero}: {sum}");
            }
            assert_eq!(f.density(0.1)[3], 0.0);
        }
    }
}
