//! Samplers: where an integrator's random numbers come from.
//!
//! A sample is a pure function of (seed, pixel, sample index, dimension). [`Sampler::start`] says which pixel, sample
//! and first dimension; after that `next_1d` takes one dimension and `next_2d` two. Nothing else is remembered, so an
//! image does not depend on threads, tiles or order, and any single path can be traced again.

mod halton;
mod independent;
mod padded_sobol;
mod pmj02bn;
mod rows;
mod sobol;
mod stratified;
mod zsobol;

pub use halton::HaltonSampler;
pub use independent::IndependentSampler;
pub use padded_sobol::PaddedSobolSampler;
pub use pmj02bn::Pmj02bnSampler;
pub use rows::SamplePlace;
pub use sobol::SobolSampler;
pub use stratified::StratifiedSampler;
pub use zsobol::ZSobolSampler;

use crate::rng::hash_combine;
use crate::sequence::{nested_uniform_scramble, owen_scramble};

/// Which [`Sampler`] to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SamplerKind {
    /// Independent uniform numbers.
    Independent,
    /// A jittered grid per pixel and dimension pair.
    Stratified,
    /// The Halton sequence over the whole image.
    Halton,
    /// The Sobol' sequence over the whole image.
    Sobol,
    /// Independently shuffled and scrambled copies of the first two Sobol' dimensions.
    #[default]
    PaddedSobol,
    /// Padded Sobol' with indices along a randomised Z curve, which makes the error blue noise (Ahmed and Wonka 2020).
    ZSobol,
    /// Progressive multi-jittered (0,2)-points that complement each other between pixels, for any number of samples.
    Pmj02bn,
}

impl SamplerKind {
    /// Its name on the command line and in scenes of pbrt-v4.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Stratified => "stratified",
            Self::Halton => "halton",
            Self::Sobol => "sobol",
            Self::PaddedSobol => "paddedsobol",
            Self::ZSobol => "zsobol",
            Self::Pmj02bn => "pmj02bn",
        }
    }
}

/// How a low-discrepancy sequence is made random. Every choice but `None` gives unbiased estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Randomization {
    /// Not at all: deterministic points, equal for all seeds.
    None,
    /// One random permutation per digit place (a XOR in base 2).
    PermuteDigits,
    /// Owen scrambling by one hash over all digits; in bases other than two the same as `Owen`.
    #[default]
    FastOwen,
    /// Owen scrambling, one hash per digit.
    Owen,
}

/// All that determines a sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplerSettings {
    /// The kind of points.
    pub kind: SamplerKind,
    /// Chooses one of 2^64 randomisations.
    pub seed: u64,
    /// Planned number of samples per pixel; read by `ZSobol`, and by `Stratified` when `strata` is zero.
    pub spp: u32,
    /// Randomisation of the low-discrepancy kinds.
    pub randomization: Randomization,
    /// Size of the image in pixels; read by the kinds that spread one sequence over the image.
    pub resolution: [u32; 2],
    /// Grid of `Stratified` in x and y; zero means the squarest grid of `spp` cells.
    pub strata: [u32; 2],
    /// Whether `Stratified` takes a random point of its cell, not the centre.
    pub jitter: bool,
}

impl Default for SamplerSettings {
    fn default() -> Self {
        Self {
            kind: SamplerKind::default(),
            seed: 0,
            spp: 16,
            randomization: Randomization::default(),
            resolution: [1, 1],
            strata: [0, 0],
            jitter: true,
        }
    }
}

/// The contract that every sampler is written and tested against.
///
/// All numbers lie in `[0, 1)` and depend on settings, pixel, sample index and dimension only.
trait SampleSource {
    /// Goes to a sample of a pixel; numbers are handed out from `dimension` on. Any index and any dimension is fine.
    fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32);
    /// The next dimension.
    fn dimension(&self) -> u32;
    /// The number of the next dimension.
    fn next_1d(&mut self) -> f32;
    /// The point of the next two dimensions, well distributed as a pair.
    fn next_2d(&mut self) -> [f32; 2];
    /// The position inside the pixel. Called first, with dimension 0; takes two dimensions.
    fn pixel_2d(&mut self) -> [f32; 2];
}

/// A source of sample points; cheap to make and to clone. See the module's documentation.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "each variant is documented at its type")]
pub enum Sampler {
    Independent(IndependentSampler),
    Stratified(StratifiedSampler),
    Halton(HaltonSampler),
    Sobol(SobolSampler),
    PaddedSobol(PaddedSobolSampler),
    ZSobol(ZSobolSampler),
    Pmj02bn(Pmj02bnSampler),
}

/// The only `match` over the kinds of samplers.
macro_rules! with_sampler {
    ($sampler:expr, $s:ident => $body:expr) => {
        match $sampler {
            Sampler::Independent($s) => $body,
            Sampler::Stratified($s) => $body,
            Sampler::Halton($s) => $body,
            Sampler::Sobol($s) => $body,
            Sampler::PaddedSobol($s) => $body,
            Sampler::ZSobol($s) => $body,
            Sampler::Pmj02bn($s) => $body,
        }
    };
}

impl Sampler {
    /// The sampler for `settings`, standing at pixel (0, 0), sample 0, dimension 0. Sizes and counts of zero act as one.
    pub fn new(settings: &SamplerSettings) -> Self {
        let mut sampler = match settings.kind {
            SamplerKind::Independent => Self::Independent(IndependentSampler::new(settings)),
            SamplerKind::Stratified => Self::Stratified(StratifiedSampler::new(settings)),
            SamplerKind::Halton => Self::Halton(HaltonSampler::new(settings)),
            SamplerKind::Sobol => Self::Sobol(SobolSampler::new(settings)),
            SamplerKind::PaddedSobol => Self::PaddedSobol(PaddedSobolSampler::new(settings)),
            SamplerKind::ZSobol => Self::ZSobol(ZSobolSampler::new(settings)),
            SamplerKind::Pmj02bn => Self::Pmj02bn(Pmj02bnSampler::new(settings)),
        };
        sampler.start([0, 0], 0, 0);
        sampler
    }

    /// Goes to sample `sample_index` of `pixel`; numbers are handed out from `dimension` on.
    #[inline]
    pub fn start(&mut self, pixel: [u32; 2], sample_index: u32, dimension: u32) {
        with_sampler!(self, s => s.start(pixel, sample_index, dimension));
    }

    /// The number of the next dimension, in `[0, 1)`.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        with_sampler!(self, s => s.next_1d())
    }

    /// The point of the next two dimensions, in `[0, 1)` squared and well distributed as a pair.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        with_sampler!(self, s => s.next_2d())
    }

    /// The position inside the pixel, in `[0, 1)` squared. Call it first after `start(.., .., 0)`; it takes two dimensions.
    #[inline]
    pub fn pixel_2d(&mut self) -> [f32; 2] {
        with_sampler!(self, s => s.pixel_2d())
    }

    /// The next dimension.
    #[inline]
    pub fn dimension(&self) -> u32 {
        with_sampler!(self, s => s.dimension())
    }

    /// Whether the first n samples are the same whatever number of samples was planned.
    ///
    /// Only then can a rendering go on beyond its plan, or stop early, and be the one that a new plan would have given.
    pub fn prefix_independent_of_spp(&self) -> bool {
        match self {
            Self::Independent(_) | Self::Halton(_) | Self::Sobol(_) | Self::PaddedSobol(_) | Self::Pmj02bn(_) => true,
            Self::Stratified(s) => s.has_explicit_strata(),
            Self::ZSobol(_) => false,
        }
    }
}

/// One hash for a pixel under a seed.
#[inline(always)]
fn pixel_hash(pixel: [u32; 2], seed: u64) -> u64 {
    hash_combine(seed, u64::from(pixel[0]) | u64::from(pixel[1]) << 32)
}

/// Randomises a base-2 fraction.
#[inline(always)]
fn randomize_bits(v: u32, randomization: Randomization, hash: u32) -> u32 {
    match randomization {
        Randomization::None => v,
        Randomization::PermuteDigits => v ^ hash,
        Randomization::FastOwen => nested_uniform_scramble(v, hash),
        Randomization::Owen => owen_scramble(v, hash),
    }
}

#[cfg(test)]
mod tests;
