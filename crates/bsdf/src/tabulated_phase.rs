//! A phase function as a table over the cosine of the scattering angle.

use crate::PhaseSample;
use steradian_math::{Frame, INV_2PI, TAU, Vec3, safe_sqrt, sqr};

/// Values between which the phase function is linear in the cosine, made to integrate to one.
#[derive(Clone, Debug, PartialEq)]
pub struct TabulatedPhase {
    /// Density of the cosine at equal steps from -1 to 1.
    density: Vec<f32>,
    /// The share of all below each step.
    below: Vec<f32>,
}

impl TabulatedPhase {
    /// Of values at equal steps of the cosine from -1, straight back, to 1, straight on. `None` unless there are two or more, all
    /// finite, none negative, and not all zero.
    pub fn new(values: &[f32]) -> Option<Self> {
        if values.len() < 2 || !values.iter().all(|v| (0.0..f32::INFINITY).contains(v)) {
            return None;
        }
        let step = 2.0 / (values.len() - 1) as f64;
        let piece = |w: &[f32]| 0.5 * (f64::from(w[0]) + f64::from(w[1])) * step;
        let total: f64 = values.windows(2).map(piece).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut sum = 0.0f64;
        let mut below = vec![0.0];
        below.extend(values.windows(2).map(|w| {
            sum += piece(w);
            (sum / total).min(1.0) as f32
        }));
        let density = values.iter().map(|&v| (f64::from(v) / total) as f32).collect();
        Some(Self { density, below })
    }

    /// The mean cosine between the directions of travel before and after.
    pub fn mean_cosine(&self) -> f32 {
        let step = 2.0 / (self.density.len() - 1) as f64;
        let moments = self.density.windows(2).enumerate().map(|(i, w)| {
            let (low, a, b) = (-1.0 + step * i as f64, f64::from(w[0]), f64::from(w[1]));
            step * (0.5 * (a + b) * low + step * (a / 6.0 + b / 3.0))
        });
        moments.sum::<f64>() as f32
    }

    /// Value per steradian, which is also the density of [`Self::sample`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.of_cosine(-wo.dot(wi))
    }

    /// Density of [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(wo, wi)
    }

    /// Takes a direction by inverting the distribution of the cosine.
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> PhaseSample {
        let pieces = self.density.len() - 1;
        let i = (self.below.partition_point(|&b| b <= u[0]).max(1) - 1).min(pieces - 1);
        let step = 2.0 / pieces as f32;
        let (a, b) = (self.density[i], self.density[i + 1]);
        // The area to the left within the piece, in steps: a s + (b - a) s^2 / 2.
        let area = (u[0] - self.below[i]).max(0.0) / step;
        let root = a + safe_sqrt(sqr(a) + 2.0 * (b - a) * area);
        let s = if root > 0.0 { (2.0 * area / root).min(1.0) } else { 0.0 };
        let cos = (-1.0 + step * (i as f32 + s)).clamp(-1.0, 1.0);
        let local = Vec3::spherical(safe_sqrt(1.0 - sqr(cos)), -cos, TAU * u[1]);
        PhaseSample { wi: Frame::from_z(wo).from_local(local), pdf: self.of_cosine(cos) }
    }

    /// `cos` is that of the angle by which light is turned.
    #[inline]
    fn of_cosine(&self, cos: f32) -> f32 {
        let pieces = self.density.len() - 1;
        let x = ((cos + 1.0) * 0.5).clamp(0.0, 1.0) * pieces as f32;
        let i = (x as usize).min(pieces - 1);
        let t = x - i as f32;
        ((1.0 - t) * self.density[i] + t * self.density[i + 1]) * INV_2PI
    }
}
