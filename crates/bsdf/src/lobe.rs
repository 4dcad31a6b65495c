//! The contract that every lobe is written and tested against (after Veach 1997, chapters 3 and 5).

use std::ops::{BitAnd, BitOr, BitOrAssign};
use steradian_math::Vec3;
use steradian_spectrum::Lanes;

/// Which quantity the path carries: refraction scales radiance by the squared ratio of indices, importance it does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TransportMode {
    /// The path starts at the camera.
    #[default]
    Radiance,
    /// The path starts at a light.
    Importance,
}

impl TransportMode {
    /// The other one.
    #[inline]
    pub const fn flipped(self) -> Self {
        match self {
            Self::Radiance => Self::Importance,
            Self::Importance => Self::Radiance,
        }
    }
}

/// Which directions a sample may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Part {
    /// Both sides.
    #[default]
    All,
    /// The side of `wo`.
    Reflection,
    /// The other side.
    Transmission,
}

impl Part {
    /// The probabilities of the two sides, zero where the part excludes one.
    #[inline(always)]
    pub(crate) fn mask(self, reflection: f32, transmission: f32) -> (f32, f32) {
        match self {
            Self::All => (reflection, transmission),
            Self::Reflection => (reflection, 0.0),
            Self::Transmission => (0.0, transmission),
        }
    }
}

/// A set of properties of a lobe or of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Lobes(u8);

impl Lobes {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Scatters to the side of `wo`.
    pub const REFLECTION: Self = Self(1);
    /// Scatters to the other side.
    pub const TRANSMISSION: Self = Self(2);
    /// Spread over the whole hemisphere.
    pub const DIFFUSE: Self = Self(4);
    /// Spread around a direction.
    pub const GLOSSY: Self = Self(8);
    /// Dirac: one direction only.
    pub const SPECULAR: Self = Self(16);

    /// The bits, as listed above from the lowest.
    #[inline]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Union, also in constants.
    #[inline]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other` is in here.
    #[inline]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether any of `other` is in here.
    #[inline]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether something is scattered to the side of `wo`.
    #[inline]
    pub const fn is_reflective(self) -> bool {
        self.intersects(Self::REFLECTION)
    }

    /// Whether something is scattered to the other side.
    #[inline]
    pub const fn is_transmissive(self) -> bool {
        self.intersects(Self::TRANSMISSION)
    }

    /// Whether there is a Dirac part.
    #[inline]
    pub const fn is_specular(self) -> bool {
        self.intersects(Self::SPECULAR)
    }

    /// Whether there is a part that is not Dirac, so that connecting to lights can succeed.
    #[inline]
    pub const fn is_non_specular(self) -> bool {
        self.intersects(Self(Self::DIFFUSE.0 | Self::GLOSSY.0))
    }

    /// Whether there is a diffuse part.
    #[inline]
    pub const fn is_diffuse(self) -> bool {
        self.intersects(Self::DIFFUSE)
    }

    /// Whether there is a glossy part.
    #[inline]
    pub const fn is_glossy(self) -> bool {
        self.intersects(Self::GLOSSY)
    }

    /// Whether nothing is scattered.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl BitOr for Lobes {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl BitAnd for Lobes {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOrAssign for Lobes {
    #[inline]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct LobeSample {
    /// The direction, of unit length, with `wi.z` not zero.
    pub wi: Vec3,
    /// `f |cos wi| / pdf`; for a Dirac lobe its reflectance or transmittance over the probability of choosing it.
    pub weight: Lanes,
    /// Density per solid angle; for a Dirac lobe the discrete probability.
    pub pdf: f32,
    /// What this sample is: one of reflection and transmission, one of diffuse, glossy and specular.
    pub flags: Lobes,
    /// Index of refraction on the side of `wi` relative to the side of `wo`; 1 for a reflection.
    pub eta: f32,
    /// The pdf is only right up to a factor that `weight` already accounts for: where a density is to be compared with
    /// another technique's, take [`Lobe::pdf`] of this direction.
    pub pdf_is_proportional: bool,
}

impl LobeSample {
    /// A reflection of one `kind`, with its exact density.
    #[inline]
    pub fn reflected(wi: Vec3, weight: Lanes, pdf: f32, kind: Lobes) -> Self {
        Self { wi, weight, pdf, flags: Lobes::REFLECTION | kind, eta: 1.0, pdf_is_proportional: false }
    }
}

/// A scattering lobe.
///
/// Frame: `+z` is the shading normal, `wo` and `wi` are unit vectors away from the surface. Measure: densities are per
/// solid angle. `eval` and `pdf` are zero for Dirac parts. If `wo.z` is zero nothing is scattered.
/// A lobe that is `pdf_is_proportional` evaluates by its own random walk: `eval` is then an unbiased estimate that is a pure
/// function of the directions and of the lobe, and `pdf` an approximation to the density that is the same for every caller.
pub trait Lobe: Copy {
    /// What the lobe may do.
    fn flags(&self) -> Lobes;

    /// The scattering function `f(wo, wi)`, without any cosine. Refraction in `Radiance` mode carries the factor `1 / eta^2`.
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes;

    /// `f(wo, wi) |cos wi|`.
    #[inline]
    fn eval_cos(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        self.eval(wo, wi, mode) * wi.z.abs()
    }

    /// Density per solid angle with which [`Lobe::sample_part`] takes `wi`.
    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32;

    /// Density per solid angle with which [`Lobe::sample`] takes `wi`.
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.pdf_part(wo, wi, mode, Part::All)
    }

    /// [`Lobe::eval_cos`] and [`Lobe::pdf`] at once.
    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        (self.eval_cos(wo, wi, mode), self.pdf(wo, wi, mode))
    }

    /// Takes a direction of one part: `u_lobe` chooses between lobes, `u` the direction. `None` if nothing is scattered
    /// there, or this try failed (which is part of the estimate: count it as zero).
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample>;

    /// Takes a direction; see [`Lobe::sample_part`].
    #[inline]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<LobeSample> {
        self.sample_part(wo, u_lobe, u, mode, Part::All)
    }

    /// Makes near-Dirac parts rougher, so that paths that cannot be found otherwise can be (at the price of bias).
    fn regularize(&mut self) {}
}
