//! The lecture's systems and techniques as settings: Whitted's ray tracing (1980), Cook's distribution ray tracing
//! (1984), and the switches of path tracing (Kajiya 1986).

/// How the direction of the next ray is drawn at lobes that are not Dirac. Dirac parts are always followed exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LobeSampling {
    /// Uniformly over the hemisphere, or over the sphere where both sides scatter.
    Uniform,
    /// In proportion to the cosine.
    Cosine,
    /// In proportion to the lobe, as well as the lobe can.
    #[default]
    Lobe,
}

/// How light found by light sampling and light found by lobe sampling are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MisHeuristic {
    /// Not at all: emitters that light sampling could have found count nothing when a ray of a lobe that is not Dirac
    /// runs into them.
    None,
    /// Weights in proportion to the densities.
    Balance,
    /// Weights in proportion to the squared densities.
    #[default]
    Power,
}

/// Where the random numbers of one domain come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stratification {
    /// From the sampler of the scene.
    #[default]
    Sampler,
    /// Independent numbers.
    None,
    /// A jittered grid over the planned samples of a pixel.
    Jittered,
    /// Scrambled Sobol' points.
    LowDiscrepancy,
}

/// Stratification, domain by domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stratify {
    /// Position in the pixel.
    pub pixel: Stratification,
    /// Position on the lens.
    pub lens: Stratification,
    /// Time within the shutter interval.
    pub time: Stratification,
    /// Choice of the light and position on it.
    pub light: Stratification,
    /// Choice of the lobe and direction.
    pub lobe: Stratification,
}

impl Stratify {
    /// The same for all domains.
    pub const fn all(kind: Stratification) -> Self {
        Self { pixel: kind, lens: kind, time: kind, light: kind, lobe: kind }
    }
}

/// The switches of path tracing. The default is what a renderer wants; every other valid combination has the same
/// expectation and another variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Techniques {
    /// Whether a light is sampled at each hit (next-event estimation).
    pub light_sampling: bool,
    /// Importance sampling of the lobe.
    pub lobe_sampling: LobeSampling,
    /// Multiple importance sampling; without light sampling there is nothing to join.
    pub mis: MisHeuristic,
    /// Stratification.
    pub stratify: Stratify,
    /// Russian roulette from the second bounce on: a path whose throughput is below the threshold lives on with
    /// probability throughput over threshold. `None` is no roulette. At most one.
    pub roulette: Option<f32>,
    /// How many lobe samples are followed from the first hit, unless its lobe is Dirac.
    pub split: u32,
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            light_sampling: true,
            lobe_sampling: LobeSampling::Lobe,
            mis: MisHeuristic::Power,
            stratify: Stratify::default(),
            roulette: Some(Self::ROULETTE),
            split: 1,
        }
    }
}

/// Whitted's ray tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Whitted {
    /// Radiance that comes from everywhere to every surface that is not a mirror, in units of luminance: stands for
    /// the light between diffuse surfaces.
    pub ambient: f32,
}

/// Bidirectional path tracing: what of it is to be seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bidirectional {
    /// Only the paths of one strategy: how many vertices are made from the light, and how many from the camera.
    pub strategy: Option<[u32; 2]>,
    /// All that the strategy finds, without its weight among the others.
    pub unweighted: bool,
}

/// Stochastic progressive photon mapping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonMapping {
    /// How far photons count at first, in units of the scene; a two-hundredth of the scene's extent unless given.
    pub radius: Option<f32>,
    /// Photons that leave the lamps for each sample of the pixels; as many as there are pixels unless given.
    pub per_iteration: Option<u32>,
    /// Seed of the photons, if not that of the sampler.
    pub seed: Option<u64>,
}

/// Metropolis light transport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metropolis {
    /// Independent paths of each length that tell how much light there is, and where chains start.
    pub bootstrap_samples: u32,
    /// Markov chains. Each takes an equal share of the steps.
    pub chains: u32,
    /// Probability of a step to anywhere.
    pub large_step_probability: f32,
    /// Standard deviation of other steps, in each random number.
    pub sigma: f32,
}

impl Default for Metropolis {
    fn default() -> Self {
        Self { bootstrap_samples: 100_000, chains: 1000, large_step_probability: 0.3, sigma: 0.01 }
    }
}

/// So many paths of the bootstrap are remembered, at most, all lengths together.
pub const MOST_BOOTSTRAP_PATHS: u64 = 1 << 26;

impl Metropolis {
    /// Whether the parameters make sense, and suit the scene.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self, lights: &LightCensus, max_depth: u32) -> Result<(), SettingsError> {
        let out_of_range = |name, value, range| Err(SettingsError::Range { name, value, range });
        let paths = u64::from(self.bootstrap_samples) * (u64::from(max_depth) + 1);
        if !(1..=MOST_BOOTSTRAP_PATHS).contains(&paths) {
            let name = "the number of bootstrap samples times the number of path lengths";
            return out_of_range(name, paths as f64, "from 1 to 67108864");
        }
        if !(1..=1 << 20).contains(&self.chains) {
            return out_of_range("the number of chains", f64::from(self.chains), "from 1 to 1048576");
        }
        if !(0.0..=1.0).contains(&self.large_step_probability) {
            let value = f64::from(self.large_step_probability);
            return out_of_range("the probability of a large step", value, "from 0 to 1");
        }
        if !(self.sigma > 0.0 && self.sigma.is_finite()) {
            return out_of_range("sigma", f64::from(self.sigma), "finite and above 0");
        }
        if lights.glowing_media {
            return Err(SettingsError::GlowingMedia { integrator: "mlt" });
        }
        lights.check_light_paths("mlt", false)
    }
}

/// So many photons are held at once, at most.
pub const MOST_PHOTONS: u32 = 1 << 24;

impl PhotonMapping {
    /// Whether the parameters make sense, and suit the scene.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self, lights: &LightCensus) -> Result<(), SettingsError> {
        let out_of_range = |name, value, range| Err(SettingsError::Range { name, value, range });
        if let Some(r) = self.radius
            && !(r > 0.0 && r.is_finite())
        {
            return out_of_range("the radius of photons", f64::from(r), "finite and above 0");
        }
        if let Some(n) = self.per_iteration
            && !(1..=MOST_PHOTONS).contains(&n)
        {
            let range = "from 1 to 16777216; more samples per pixel do what more photons at once would";
            return out_of_range("the number of photons per iteration", f64::from(n), range);
        }
        if lights.subsurface {
            return Err(SettingsError::Subsurface { integrator: "sppm" });
        }
        if lights.unsampled {
            return Err(SettingsError::UnsampledLights { integrator: "sppm" });
        }
        Ok(())
    }
}

/// Brute-force distribution ray tracing: every domain has its own grid, and every hit a tree of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Distribution {
    /// `k`: a pixel has `k` times `k` subpixels. One sample of the film is one subpixel, so that the number of samples
    /// should be `k * k`; more go round again.
    pub subpixels: u32,
    /// `a`: a subpixel looks through `a` times `a` points of the lens, if there is one.
    pub aperture: u32,
    /// `s`: a hit sends `s` times `s` shadow rays to each light that has an extent. Each triangle of a mesh is a light.
    pub light: u32,
    /// `r`: a hit sends `r` times `r` rays over its lobe; a Dirac lobe is followed exactly, with as many rays as it has
    /// directions (with `r` of one: with one ray).
    pub lobe: u32,
    /// `t`: for each lens point, this many moments while the shutter is open, if anything moves.
    pub time: u32,
    /// Whether points are random within their cells. Centres make the image repeatable and biased.
    pub jitter: bool,
}

impl Default for Distribution {
    fn default() -> Self {
        Self { subpixels: 2, aperture: 2, light: 2, lobe: 2, time: 2, jitter: true }
    }
}

/// What the settings of an integrator must know of a scene to judge themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightCensus {
    /// Lights with an extent: areas (each triangle of a mesh) and environments.
    pub extended: usize,
    /// Points, spots and distant lights.
    pub delta: usize,
    /// Primitives that shine.
    pub lamps: usize,
    /// Whether the camera has a lens of some size.
    pub lens: bool,
    /// Whether anything moves.
    pub motion: bool,
    /// Whether the camera can receive light that comes from lamps.
    pub receiver: bool,
    /// Whether something shines that light sampling cannot find.
    pub unsampled: bool,
    /// Whether anything is translucent.
    pub subsurface: bool,
    /// Whether a medium shines.
    pub glowing_media: bool,
    /// Whether there are participating media.
    pub media: bool,
}

impl LightCensus {
    /// Whether paths that start at lights make sense. `alone` says that there are no others.
    pub(crate) fn check_light_paths(&self, integrator: &'static str, alone: bool) -> Result<(), SettingsError> {
        if !self.receiver {
            return Err(SettingsError::Receiver { integrator });
        }
        if self.subsurface {
            return Err(SettingsError::Subsurface { integrator });
        }
        if alone && self.unsampled {
            return Err(SettingsError::UnsampledLights { integrator });
        }
        Ok(())
    }
}

/// Settings that make no sense, or none for the scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A delta light and no light sampling.
    #[error(
        "light sampling is off, but {count} of the lights {} a point, a spot or a distant light: no ray meets such a \
         light by chance, so it would be missing from the image", if *count == 1 { "is" } else { "are each" }
    )]
    DeltaLight {
        /// How many there are.
        count: usize,
    },
    /// A camera that light from lamps cannot be connected to.
    #[error(
        "the `{integrator}` integrator connects light to the camera, and knows how for perspective and orthographic \
         cameras only"
    )]
    Receiver {
        /// The integrator.
        integrator: &'static str,
    },
    /// Lamps that the camera shall not see.
    #[error(
        "the scene hides its lights from the camera (`hide_emitters`), which `path` and `volpath` do, without switches \
         of their techniques"
    )]
    HiddenLights,
    /// Translucent objects.
    #[error(
        "the `{integrator}` integrator does not follow light below translucent (`subsurface`) surfaces; `path` and `volpath` do"
    )]
    Subsurface {
        /// The integrator.
        integrator: &'static str,
    },
    /// Media that shine.
    #[error("a medium shines, and the `{integrator}` integrator would miss its light; `volpath` and `bdpt` find it")]
    GlowingMedia {
        /// The integrator.
        integrator: &'static str,
    },
    /// Lamps that no path can start at.
    #[error(
        "a lamp moves or is made of curves, so that no path can start there, and the `{integrator}` integrator would miss \
         its light; `path`, `volpath` and `bdpt` find it"
    )]
    UnsampledLights {
        /// The integrator.
        integrator: &'static str,
    },
    /// A number outside its range.
    #[error("{name} is {value}, but must be {range}")]
    Range {
        /// The setting's name.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be, in words.
        range: &'static str,
    },
}

/// The largest number for any parameter of [`Distribution`], and for splitting.
pub const MOST_BRANCHES: u32 = 4096;

/// Renders that need more rays than this in all are absurd: a hundred hours at a million rays a second. To be refused
/// unless asked for twice.
pub const ABSURD_RAYS: f64 = 3.6e11;

impl Techniques {
    /// The threshold of roulette unless another is asked for. Measured on four scenes of `benches/peers` (notes beside its results): a quarter
    /// saves 1 to 10 % of the time to an equal error over a half, a half 3 to 15 % over a threshold of one, and a tenth is no better than
    /// a quarter.
    pub const ROULETTE: f32 = 0.25;

    /// Whether the switches make sense, and suit the lights.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, lights: &LightCensus) -> Result<(), SettingsError> {
        branches("splitting", self.split)?;
        if let Some(t) = self.roulette
            && !(t > 0.0 && t <= 1.0)
        {
            let value = f64::from(t);
            return Err(SettingsError::Range { name: "the roulette's threshold", value, range: "above 0, at most 1" });
        }
        if !self.light_sampling && lights.delta > 0 {
            return Err(SettingsError::DeltaLight { count: lights.delta });
        }
        Ok(())
    }
}

impl Whitted {
    /// Whether the parameters make sense.
    ///
    /// # Errors
    /// If they do not.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.ambient.is_finite() && self.ambient >= 0.0 {
            return Ok(());
        }
        Err(SettingsError::Range {
            name: "the ambient light",
            value: f64::from(self.ambient),
            range: "finite and not negative",
        })
    }

    /// The rays of one sample at most: a binary tree of mirrors, with one shadow ray for each light at each hit.
    pub fn predicted_rays(&self, lights: &LightCensus, max_depth: u32) -> f64 {
        1.0 + tree_rays((lights.lamps + lights.delta) as f64, 2.0, max_depth)
    }
}

impl Distribution {
    /// Whether the parameters make sense.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self) -> Result<(), SettingsError> {
        branches("k", self.subpixels)?;
        branches("a", self.aperture)?;
        branches("s", self.light)?;
        branches("r", self.lobe)?;
        branches("t", self.time)
    }

    /// The samples of the film that the grid of subpixels asks for.
    pub fn samples_per_pixel(&self) -> u32 {
        self.subpixels * self.subpixels
    }

    /// Camera rays of one subpixel.
    pub fn camera_rays(&self, lens: bool, motion: bool) -> u64 {
        let a = if lens { u64::from(self.aperture) } else { 1 };
        a * a * if motion { u64::from(self.time) } else { 1 }
    }

    /// The rays of one subpixel, which is one sample, if every ray hits a surface that is not Dirac and no lamp shows
    /// its back: `a^2 t (1 + R(d))` with `R(1) = l s^2` and `R(d) = l s^2 + r^2 (1 + R(d - 1))`.
    ///
    /// The last bounce needs light rays only. Rays that escape or meet a black surface make it fewer.
    pub fn predicted_rays(&self, lights: &LightCensus, max_depth: u32) -> f64 {
        let square = |n: u32| f64::from(n) * f64::from(n);
        let shadow = lights.extended as f64 * square(self.light) + lights.delta as f64;
        let r2 = square(self.lobe);
        let mut hit = 0.0;
        for depth in 1..=max_depth {
            let scattered = if depth > 1 { r2 * (1.0 + hit) } else { 0.0 };
            let next = shadow + scattered;
            // Beyond counting, or no more change: spare a loop of a million.
            if next == hit || next > 1e300 {
                hit = next;
                break;
            }
            hit = next;
        }
        self.camera_rays(lights.lens, lights.motion) as f64 * (1.0 + hit)
    }
}

/// Rays below a hit with `shadow` rays at each hit and `branch` rays on, to a depth.
fn tree_rays(shadow: f64, branch: f64, max_depth: u32) -> f64 {
    let mut hit = 0.0;
    for _ in 0..max_depth {
        hit = shadow + branch * (1.0 + hit);
        if hit > 1e300 {
            break;
        }
    }
    hit
}

fn branches(name: &'static str, n: u32) -> Result<(), SettingsError> {
    if (1..=MOST_BRANCHES).contains(&n) {
        return Ok(());
    }
    Err(SettingsError::Range { name, value: f64::from(n), range: "from 1 to 4096" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_is_the_formula_of_the_lecture() {
        let lights = LightCensus { extended: 4, lens: true, ..LightCensus::default() };
        let d = Distribution { subpixels: 8, aperture: 8, light: 8, lobe: 8, time: 8, jitter: true };
        assert_eq!(d.predicted_rays(&lights, 0), 64.0);
        assert_eq!(d.predicted_rays(&lights, 1), 64.0 * (1.0 + 4.0 * 64.0));
        let two = 64.0 * (1.0 + 256.0 + 64.0 * (1.0 + 256.0));
        assert_eq!(d.predicted_rays(&lights, 2), two);
        assert_eq!(d.predicted_rays(&LightCensus { motion: true, ..lights }, 2), 8.0 * two);
        assert!(d.predicted_rays(&lights, 8) > ABSURD_RAYS);
        // Where nothing branches it is two rays a bounce, however deep.
        let one = Distribution { subpixels: 1, aperture: 1, light: 1, lobe: 1, time: 1, jitter: true };
        let lamp = LightCensus { extended: 1, ..LightCensus::default() };
        assert_eq!(one.predicted_rays(&lamp, 1_000_000), 2_000_000.0);
        assert!(d.predicted_rays(&lights, u32::MAX) > 1e290);
    }

    #[test]
    fn settings_that_make_no_sense_are_named() {
        let none = LightCensus::default();
        let delta = LightCensus { delta: 2, ..none };
        assert_eq!(Techniques::default().check(&delta), Ok(()));
        let off = Techniques { light_sampling: false, ..Techniques::default() };
        assert_eq!(off.check(&none), Ok(()));
        assert_eq!(off.check(&delta), Err(SettingsError::DeltaLight { count: 2 }));
        for roulette in [0.0, -1.0, 1.5, f32::NAN] {
            assert!(Techniques { roulette: Some(roulette), ..Techniques::default() }.check(&none).is_err());
        }
        assert!(Techniques { split: 0, ..Techniques::default() }.check(&none).is_err());
        let words = Distribution { lobe: 0, ..Distribution::default() }.check().unwrap_err().to_string();
        assert_eq!(words, "r is 0, but must be from 1 to 4096");
        assert!(Whitted { ambient: f32::NAN }.check().is_err());
    }
}
