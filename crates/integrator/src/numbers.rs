//! Random numbers by what they are for, so that each domain can be stratified in its own way.

use steradian_sampling::rng::hash_combine;
use steradian_sampling::sampler::{Randomization, Sampler, SamplerKind, SamplerSettings};
use steradian_scene::{Stratification, Stratify};

/// What a random number is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Position in the pixel.
    Pixel,
    /// Position on the lens.
    Lens,
    /// Time within the shutter interval.
    Time,
    /// Choice of the light and position on it.
    Light,
    /// Choice of the lobe and direction.
    Lobe,
    /// Wavelengths, Russian roulette, and anything else.
    Other,
}

/// A source of uniform numbers in `[0, 1)`, asked by domain.
pub trait Numbers {
    /// One number.
    fn one(&mut self, domain: Domain) -> f32;
    /// A pair that is well distributed as such.
    fn two(&mut self, domain: Domain) -> [f32; 2];
}

/// A sampler serves all domains alike.
impl Numbers for Sampler {
    #[inline(always)]
    fn one(&mut self, _domain: Domain) -> f32 {
        Self::next_1d(self)
    }

    #[inline(always)]
    fn two(&mut self, domain: Domain) -> [f32; 2] {
        if domain == Domain::Pixel { self.pixel_2d() } else { Self::next_2d(self) }
    }
}

/// The samplers that [`Stratify`] can name, under seeds of their own.
#[derive(Clone, Debug)]
pub struct StratifiedNumbers {
    stratify: Stratify,
    scene: Sampler,
    independent: Sampler,
    jittered: Sampler,
    low_discrepancy: Sampler,
}

impl StratifiedNumbers {
    /// The samplers for the scene's settings: same seed, resolution and planned number of samples. `None` if all domains
    /// go to the scene's sampler, which then does alone.
    pub fn new(stratify: Stratify, settings: &SamplerSettings) -> Option<Self> {
        let of = |kind: SamplerKind| {
            Sampler::new(&SamplerSettings {
                kind,
                seed: hash_combine(settings.seed, kind as u64 + 1),
                randomization: Randomization::FastOwen,
                strata: [0, 0],
                jitter: true,
                ..*settings
            })
        };
        (stratify != Stratify::default()).then(|| Self {
            stratify,
            scene: Sampler::new(settings),
            independent: of(SamplerKind::Independent),
            jittered: of(SamplerKind::Stratified),
            low_discrepancy: of(SamplerKind::PaddedSobol),
        })
    }

    /// Goes to a sample of a pixel.
    pub fn start(&mut self, pixel: [u32; 2], sample_index: u32) {
        for s in [&mut self.scene, &mut self.independent, &mut self.jittered, &mut self.low_discrepancy] {
            s.start(pixel, sample_index, 0);
        }
    }

    #[inline]
    fn source(&mut self, domain: Domain) -> &mut Sampler {
        let kind = match domain {
            Domain::Pixel => self.stratify.pixel,
            Domain::Lens => self.stratify.lens,
            Domain::Time => self.stratify.time,
            Domain::Light => self.stratify.light,
            Domain::Lobe => self.stratify.lobe,
            Domain::Other => Stratification::Sampler,
        };
        match kind {
            Stratification::Sampler => &mut self.scene,
            Stratification::None => &mut self.independent,
            Stratification::Jittered => &mut self.jittered,
            Stratification::LowDiscrepancy => &mut self.low_discrepancy,
        }
    }
}

impl Numbers for StratifiedNumbers {
    #[inline]
    fn one(&mut self, domain: Domain) -> f32 {
        self.source(domain).next_1d()
    }

    #[inline]
    fn two(&mut self, domain: Domain) -> [f32; 2] {
        let source = self.source(domain);
        if domain == Domain::Pixel { source.pixel_2d() } else { source.next_2d() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_domain_gets_its_own_kind_of_points() {
        let settings = SamplerSettings { kind: SamplerKind::Independent, spp: 16, seed: 3, ..Default::default() };
        assert!(StratifiedNumbers::new(Stratify::default(), &settings).is_none());
        let stratify = Stratify {
            lens: Stratification::Jittered,
            light: Stratification::LowDiscrepancy,
            lobe: Stratification::None,
            ..Stratify::default()
        };
        let mut n = StratifiedNumbers::new(stratify, &settings).expect("not the default");
        let mut cells = |domain: Domain| {
            let mut seen = [false; 16];
            for i in 0..16 {
                n.start([5, 9], i);
                let [x, y] = n.two(domain);
                seen[(y * 4.0) as usize * 4 + (x * 4.0) as usize] = true;
            }
            seen.iter().filter(|&&s| s).count()
        };
        // One point in each cell, or not: sixteen independent points fill the grid once in a million.
        assert_eq!(cells(Domain::Lens), 16);
        assert_eq!(cells(Domain::Light), 16);
        assert!(cells(Domain::Lobe) < 16);
        assert!(cells(Domain::Pixel) < 16);
        // Sources of different kinds are not each other's copies.
        n.start([0, 0], 0);
        assert_ne!(n.one(Domain::Lobe), n.one(Domain::Pixel));
    }
}
