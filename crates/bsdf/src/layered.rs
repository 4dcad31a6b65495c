//! A coating over a base, with a slab of scattering medium between: the position-free random walk of Guo, Hašan and Zhao
//! ("Position-free Monte Carlo simulation for arbitrary layered BSDFs", 2018), with pbrt-v4's model and estimators.
//!
//! The base is opaque and the stack is two-sided: seen from below it looks the same.

use crate::conductor::Conductor;
use crate::dielectric::Dielectric;
use crate::diffuse::Diffuse;
use crate::direction::{mirror, same_hemisphere};
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::phase::HenyeyGreenstein;
use steradian_math::{INV_2PI, Vec3, exp, lerp};
use steradian_sampling::Rng;
use steradian_sampling::mis::power_weight;
use steradian_sampling::rng::{hash_combine, hash_floats};
use steradian_sampling::warp::unit_to_exponential;
use steradian_spectrum::Lanes;

/// Paint: a dielectric over a diffuse base.
pub type CoatedDiffuse = Layered<Diffuse>;

/// Varnished metal: a dielectric over a conductor, whose index is relative to the coat's (divide `eta` and `k` by it).
pub type CoatedConductor = Layered<Conductor>;

/// What lies between coat and base, and how the walk is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coating {
    /// Optical thickness of the slab (its extinction is 1 per unit of length).
    pub thickness: f32,
    /// Single-scattering albedo of the medium in the slab; zero makes it absorb only.
    pub albedo: Lanes,
    /// Mean cosine of the medium's phase function.
    pub g: f32,
    /// Largest number of events in a walk.
    pub max_depth: u32,
    /// Number of walks per evaluation.
    pub walks: u32,
    /// Chooses the random numbers of the walks, together with the directions.
    pub seed: u64,
    /// Evaluate as pbrt-v4 does, for comparisons with it only, since that is biased in two ways. Both ways out of a rough
    /// coat are weighed with the density of leaving along `wi` where that of the reversed path is due, so that the weights
    /// do not sum to one: some percent, more at grazing angles. And between a smooth coat and a smooth metal, light that
    /// the medium scattered and the metal then mirrored is lost. A smooth coat over a diffuse base is not concerned.
    pub pbrt_values: bool,
}

impl Default for Coating {
    /// pbrt-v4's defaults.
    fn default() -> Self {
        Self { thickness: 0.01, albedo: Lanes::ZERO, g: 0.0, max_depth: 10, walks: 1, seed: 0, pbrt_values: false }
    }
}

/// A dielectric coat over `base`. `eval` and `pdf` are estimates; see [`Lobe`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered<Base> {
    coat: Dielectric,
    base: Base,
    coating: Coating,
}

/// A walk's place and the light it carries.
struct Walk {
    beta: Lanes,
    w: Vec3,
    z: f32,
}

/// Mirrored ways out: from the medium down to a Dirac base, up, and maybe back from the Dirac coat, any number of times.
struct MirroredExit {
    /// Reflectance of the base.
    base: Lanes,
    /// Sum over all the returns: `1 / (1 - base * coat * transmittance^2)`.
    returns: Lanes,
}

/// What happened to a walk in the slab.
enum Event {
    /// It arrived at the coat or at the base.
    Interface,
    /// It was scattered by the medium, arriving along the direction given, and goes on in a new one.
    Scattered { phase_pdf: f32 },
    /// It stands still.
    Stuck,
}

impl<Base: Lobe> Layered<Base> {
    /// `thickness` is made positive; at least one walk is done.
    #[inline]
    pub fn new(coat: Dielectric, base: Base, coating: Coating) -> Self {
        let thickness = coating.thickness.max(f32::MIN_POSITIVE);
        Self { coat, base, coating: Coating { thickness, walks: coating.walks.max(1), ..coating } }
    }

    /// The layer on top.
    #[inline]
    pub fn coat(&self) -> &Dielectric {
        &self.coat
    }

    /// The layer at the bottom.
    #[inline]
    pub fn base(&self) -> &Base {
        &self.base
    }

    /// What lies between them.
    #[inline]
    pub fn coating(&self) -> &Coating {
        &self.coating
    }

    #[inline]
    fn rng(&self, a: &[f32], b: &[f32]) -> Rng {
        Rng::new(hash_combine(self.coating.seed, hash_floats(a)), hash_floats(b))
    }

    /// Goes to the next event between the layers; `scatter` takes the light arriving at a medium event before it turns.
    #[inline]
    fn travel(&self, walk: &mut Walk, rng: &mut Rng, scatter: impl FnOnce(&Walk, &HenyeyGreenstein)) -> Event {
        let thickness = self.coating.thickness;
        if self.coating.albedo.is_black() {
            walk.z = if walk.z == thickness { 0.0 } else { thickness };
            walk.beta *= transmittance(thickness, walk.w);
            return Event::Interface;
        }
        let step = unit_to_exponential(rng.f32(), 1.0 / walk.w.z.abs());
        let z = if walk.w.z > 0.0 { walk.z + step } else { walk.z - step };
        if z == walk.z {
            return Event::Stuck;
        }
        if 0.0 < z && z < thickness {
            let phase = HenyeyGreenstein::new(self.coating.g);
            walk.z = z;
            walk.beta *= self.coating.albedo;
            scatter(walk, &phase);
            let sample = phase.sample(-walk.w, rng.f32_2d());
            if sample.pdf == 0.0 || sample.wi.z == 0.0 {
                return Event::Stuck;
            }
            walk.w = sample.wi;
            return Event::Scattered { phase_pdf: sample.pdf };
        }
        walk.z = z.clamp(0.0, thickness);
        Event::Interface
    }

    /// Density with which the direction `-w` inside is taken when light that leaves along `wi` is followed back.
    #[inline]
    fn exit_density(&self, w: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        if self.coating.pbrt_values {
            self.coat.pdf_part(-w, wi, mode, Part::Transmission)
        } else {
            self.coat.pdf_part(wi, -w, mode.flipped(), Part::Transmission)
        }
    }

    /// Where both interfaces are Dirac no sampled direction finds the way out after a mirroring, so those ways are summed here.
    ///
    /// `leave` points down, to where light that leaves comes from.
    fn mirrored_exit(&self, leave: Vec3, mode: TransportMode) -> Option<MirroredExit> {
        let both_dirac = !self.coat.flags().is_non_specular() && !self.base.flags().is_non_specular();
        if !both_dirac || self.coating.albedo.is_black() || self.coating.pbrt_values {
            return None;
        }
        let base = usable(self.base.sample_part(-leave, 0.0, [0.5; 2], mode, Part::Reflection))?.weight;
        let coat = usable(self.coat.sample_part(leave, 0.0, [0.5; 2], mode, Part::Reflection));
        let trip = transmittance(2.0 * self.coating.thickness, leave);
        let ratio = coat.map_or(Lanes::ZERO, |coat| base * coat.weight * trip);
        Some(MirroredExit { base, returns: ratio.map(|q| 1.0 / (1.0 - q.min(0.9999))) })
    }

    /// One estimate of `f` beyond the reflection off the coat, for directions above the surface.
    fn walk_value(&self, wo: Vec3, wi: Vec3, mode: TransportMode, rng: &mut Rng) -> Lanes {
        let (coat, base, thickness) = (&self.coat, &self.base, self.coating.thickness);
        // A direction into the slab, and one from which light that leaves along wi came.
        let (u_lobe, u) = (rng.f32(), rng.f32_2d());
        let Some(enter) = usable(coat.sample_part(wo, u_lobe, u, mode, Part::Transmission)) else {
            return Lanes::ZERO;
        };
        let (u_lobe, u) = (rng.f32(), rng.f32_2d());
        let Some(leave) = usable(coat.sample_part(wi, u_lobe, u, mode.flipped(), Part::Transmission)) else {
            return Lanes::ZERO;
        };
        let coat_is_dirac = coat.flags().is_specular();
        let base_is_dirac = base.flags().is_specular();
        // f / pdf of leaving
        let leave_value = leave.weight / leave.wi.z.abs();
        let mirrored = self.mirrored_exit(leave.wi, mode);
        let mut walk = Walk { beta: enter.weight, w: enter.wi, z: thickness };
        let mut sum = Lanes::ZERO;
        for depth in 0..self.coating.max_depth {
            if depth > 3 && !roulette(&mut walk.beta, rng) {
                break;
            }
            // The medium scatters towards the way out.
            let event = self.travel(&mut walk, rng, |walk, phase| {
                let value = phase.eval(-walk.w, -leave.wi);
                let weight = if coat_is_dirac { 1.0 } else { power_weight(leave.pdf, value) };
                let mut exit = Lanes::splat(value * weight * transmittance(walk.z - thickness, leave.wi));
                if let Some(m) = &mirrored {
                    let down = phase.eval(-walk.w, mirror(leave.wi)) * transmittance(walk.z + thickness, leave.wi);
                    exit = (exit + m.base * down) * m.returns;
                }
                sum += walk.beta * leave_value * exit;
            });
            match event {
                Event::Stuck => continue,
                Event::Scattered { phase_pdf } => {
                    // The new direction may find the way out by itself.
                    if walk.w.z > 0.0 && !coat_is_dirac {
                        let f = coat.eval(-walk.w, wi, mode);
                        if !f.is_black() {
                            let weight = power_weight(phase_pdf, self.exit_density(walk.w, wi, mode));
                            sum += walk.beta * f * (transmittance(walk.z - thickness, walk.w) * weight);
                        }
                    }
                    continue;
                }
                Event::Interface => {}
            }
            let at_coat = walk.z == thickness;
            if !at_coat && !base_is_dirac {
                // The base scatters towards the way out.
                let value = base.eval_cos(-walk.w, -leave.wi, mode);
                let weight =
                    if coat_is_dirac { 1.0 } else { power_weight(leave.pdf, base.pdf(-walk.w, -leave.wi, mode)) };
                sum += walk.beta * value * leave_value * (weight * transmittance(thickness, leave.wi));
            }
            let (u_lobe, u) = (rng.f32(), rng.f32_2d());
            let bounce = if at_coat {
                coat.sample_part(-walk.w, u_lobe, u, mode, Part::Reflection)
            } else {
                base.sample_part(-walk.w, u_lobe, u, mode, Part::Reflection)
            };
            let Some(bounce) = usable(bounce) else { break };
            walk.beta *= bounce.weight;
            walk.w = bounce.wi;
            if !at_coat && !coat_is_dirac {
                // The bounce off the base may find the way out by itself.
                let f = coat.eval(-walk.w, wi, mode);
                if !f.is_black() {
                    let weight =
                        if base_is_dirac { 1.0 } else { power_weight(bounce.pdf, self.exit_density(walk.w, wi, mode)) };
                    sum += walk.beta * f * (transmittance(thickness, walk.w) * weight);
                }
            }
        }
        sum
    }

    /// One estimate of the density of going in, off the base once, and out again.
    fn walk_density(&self, wo: Vec3, wi: Vec3, mode: TransportMode, rng: &mut Rng) -> f32 {
        let (coat, base) = (&self.coat, &self.base);
        let (u_lobe, u) = (rng.f32(), rng.f32_2d());
        let enter = usable(coat.sample_part(wo, u_lobe, u, mode, Part::Transmission));
        let (u_lobe, u) = (rng.f32(), rng.f32_2d());
        let leave = usable(coat.sample_part(wi, u_lobe, u, mode.flipped(), Part::Transmission));
        let (Some(enter), Some(leave)) = (enter, leave) else { return 0.0 };
        if !coat.flags().is_non_specular() {
            return base.pdf(-enter.wi, -leave.wi, mode);
        }
        let (u_lobe, u) = (rng.f32(), rng.f32_2d());
        let Some(bounce) = usable(base.sample(-enter.wi, u_lobe, u, mode)) else { return 0.0 };
        let coat_pdf = coat.pdf(-bounce.wi, wi, mode);
        if !base.flags().is_non_specular() {
            return coat_pdf;
        }
        let base_pdf = base.pdf(-enter.wi, -leave.wi, mode);
        power_weight(leave.pdf, base_pdf) * base_pdf + power_weight(bounce.pdf, coat_pdf) * coat_pdf
    }

    /// Walks from the entrance until the way out; directions are above the surface.
    fn walk_out(&self, enter: LobeSample, mode: TransportMode, rng: &mut Rng) -> Option<LobeSample> {
        let mut dirac = enter.flags.is_specular();
        let mut pdf = enter.pdf;
        let mut walk = Walk { beta: enter.weight, w: enter.wi, z: self.coating.thickness };
        for depth in 0..self.coating.max_depth {
            if depth > 3 {
                let survival = walk.beta.max_component().min(1.0);
                if !roulette(&mut walk.beta, rng) {
                    return None;
                }
                if survival < ROULETTE_BELOW {
                    pdf *= survival;
                }
            }
            match self.travel(&mut walk, rng, |_, _| {}) {
                Event::Stuck => return None,
                Event::Scattered { phase_pdf } => {
                    pdf *= phase_pdf;
                    dirac = false;
                    continue;
                }
                Event::Interface => {}
            }
            let (u_lobe, u) = (rng.f32(), rng.f32_2d());
            let bounce = usable(if walk.z == 0.0 {
                self.base.sample(-walk.w, u_lobe, u, mode)
            } else {
                self.coat.sample(-walk.w, u_lobe, u, mode)
            })?;
            walk.beta *= bounce.weight;
            pdf *= bounce.pdf;
            dirac &= bounce.flags.is_specular();
            walk.w = bounce.wi;
            if bounce.flags.is_transmissive() {
                return Some(LobeSample {
                    wi: walk.w,
                    weight: walk.beta,
                    pdf,
                    flags: Lobes::REFLECTION | if dirac { Lobes::SPECULAR } else { Lobes::GLOSSY },
                    eta: 1.0,
                    pdf_is_proportional: true,
                });
            }
        }
        None
    }
}

/// Below this throughput a walk is subject to Russian roulette.
const ROULETTE_BELOW: f32 = 0.25;

/// Russian roulette; false if the walk ends.
#[inline]
fn roulette(beta: &mut Lanes, rng: &mut Rng) -> bool {
    let survival = beta.max_component();
    if survival >= ROULETTE_BELOW {
        return true;
    }
    if rng.f32() >= survival {
        return false;
    }
    *beta /= survival;
    true
}

/// A sample that carries light somewhere.
#[inline(always)]
fn usable(sample: Option<LobeSample>) -> Option<LobeSample> {
    sample.filter(|s| s.pdf > 0.0 && s.wi.z != 0.0 && !s.weight.is_black())
}

/// Transmittance of a slab of `height` along `w`.
#[inline]
fn transmittance(height: f32, w: Vec3) -> f32 {
    if height.abs() <= f32::MIN_POSITIVE { 1.0 } else { exp(-(height / w.z).abs()) }
}

impl<Base: Lobe> Lobe for Layered<Base> {
    fn flags(&self) -> Lobes {
        let (coat, base) = (self.coat.flags(), self.base.flags());
        let mut flags = Lobes::REFLECTION;
        if coat.is_specular() {
            flags |= Lobes::SPECULAR;
        }
        if coat.is_diffuse() || base.is_diffuse() || !self.coating.albedo.is_black() {
            flags |= Lobes::DIFFUSE;
        } else if coat.is_glossy() || base.is_glossy() {
            flags |= Lobes::GLOSSY;
        }
        flags
    }

    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        if !same_hemisphere(wo, wi) {
            return Lanes::ZERO;
        }
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        let mut rng = self.rng(&wo.to_array(), &wi.to_array());
        let walks = self.coating.walks;
        let sum: Lanes = (0..walks).map(|_| self.walk_value(wo, wi, mode, &mut rng)).sum();
        self.coat.eval(wo, wi, mode) + sum / walks as f32
    }

    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        if part == Part::Transmission || !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        let mut rng = self.rng(&wi.to_array(), &wo.to_array());
        let walks = self.coating.walks;
        let sum: f32 = (0..walks).map(|_| self.walk_density(wo, wi, mode, &mut rng)).sum();
        let estimate = self.coat.pdf_part(wo, wi, mode, Part::Reflection) + sum / walks as f32;
        // A uniform part stands for all the longer walks.
        lerp(0.9, INV_2PI, estimate)
    }

    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission {
            return None;
        }
        let below = wo.z < 0.0;
        let wo = if below { -wo } else { wo };
        let first = usable(self.coat.sample(wo, u_lobe, u, mode))?;
        let mut sample = if first.flags.is_reflective() {
            LobeSample { pdf_is_proportional: true, ..first }
        } else {
            self.walk_out(first, mode, &mut self.rng(&wo.to_array(), &[u_lobe, u[0], u[1]]))?
        };
        if below {
            sample.wi = -sample.wi;
        }
        Some(sample)
    }

    fn regularize(&mut self) {
        self.coat.regularize();
        self.base.regularize();
    }
}
