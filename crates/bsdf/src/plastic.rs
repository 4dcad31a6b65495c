//! A diffuse base under a dielectric interface, smooth or rough, as Mitsuba states it: one specular and one diffuse part that is
//! dimmed by what the interface lets through (after Ashikhmin, Premoze and Shirley 2000; Jakob's plugins `plastic` and `roughplastic`).

use crate::direction::{mirror, reflect, refract, same_hemisphere};
use crate::fresnel::fresnel_dielectric;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::microfacets::Microfacets;
use steradian_math::{INV_PI, Vec3, safe_sqrt, sqr};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// Points of the table over the cosine.
const POINTS: usize = 64;

/// What a rough interface lets through, tabulated over the cosine of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct PlasticTable {
    transmittance: [f32; POINTS],
    internal: f32,
}

impl PlasticTable {
    /// The table of an interface of relative index `eta`.
    pub fn new(distribution: &Microfacets, eta: f32) -> Self {
        let cosine = |i: usize| (i as f32 / (POINTS - 1) as f32).max(1e-6);
        let transmittance = std::array::from_fn(|i| through(distribution, cosine(i), eta, true, 32));
        // The sum that Mitsuba takes: of all points alike, those at the ends too.
        let reflected = |i: usize| through(distribution, cosine(i), 1.0 / eta, false, 64) * cosine(i);
        let internal = 2.0 * (0..POINTS).map(reflected).sum::<f32>() / POINTS as f32;
        Self { transmittance, internal }
    }

    #[inline]
    fn at(&self, cos: f32) -> f32 {
        let x = cos * (POINTS - 1) as f32;
        let i = (x as usize).min(POINTS - 2);
        let t = x - i as f32;
        self.transmittance[i] * (1.0 - t) + self.transmittance[i + 1] * t
    }
}

/// The share of light at a cosine of incidence that one scattering transmits, or reflects.
fn through(d: &Microfacets, cos: f32, eta: f32, transmits: bool, steps: u32) -> f32 {
    let wo = Vec3::new(safe_sqrt(1.0 - sqr(cos)), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..sqr(steps as f32) as u32 {
        let u = [i % steps, i / steps].map(|k| (k as f32 + 0.5) / steps as f32);
        let wm = d.sample_visible_normal(wo, u);
        let r = fresnel_dielectric(wo.dot(wm), eta);
        if transmits {
            if let Some((wi, _)) = refract(wo, wm, eta).filter(|(wi, _)| wi.z < 0.0) {
                sum += (1.0 - r) * d.masking(wi);
            }
        } else {
            let wi = reflect(wo, wm);
            if wi.z > 0.0 {
                sum += r * d.masking(wi);
            }
        }
    }
    sum / sqr(steps as f32)
}

/// Share of diffuse light inside of an index `eta > 1` that a smooth interface sends back: the fit of Egan and Hilgeman (1973), within
/// one percent.
pub fn diffuse_fresnel_reflectance(eta: f32) -> f32 {
    let below = 1.0 / eta;
    -1.4399 * sqr(below) + 0.7099 * below + 0.6681 + 0.0636 * eta
}

/// The interface of plastic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlasticInterface<'w> {
    /// A mirror; the share of diffuse light from below that it sends back.
    Smooth {
        /// That share.
        internal: f32,
    },
    /// Microfacets with what they let through.
    Rough(Microfacets, &'w PlasticTable),
}

/// Plastic: light is mirrored by the interface, or enters, is scattered by the base, and leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic<'w> {
    /// Index of refraction over that of the outside.
    pub eta: f32,
    /// The interface.
    pub interface: PlasticInterface<'w>,
    /// Factor of the mirrored light.
    pub specular: Lanes,
    /// Radiance of the base under light that has entered: its albedo, and light that the interface sent back to it.
    base: Lanes,
    /// Probability of the specular part where the interface reflects half of the light.
    specular_share: f32,
}

impl<'w> Plastic<'w> {
    /// Plastic over a base of this albedo. `nonlinear`: light that comes back to the base is coloured again each time.
    pub fn new(interface: PlasticInterface<'w>, eta: f32, albedo: Lanes, specular: Lanes, nonlinear: bool) -> Self {
        let internal = match interface {
            PlasticInterface::Smooth { internal } => internal,
            PlasticInterface::Rough(_, table) => table.internal,
        };
        let back = if nonlinear { albedo * internal } else { Lanes::splat(internal) };
        let base = albedo / (Lanes::ONE - back) * (1.0 / sqr(eta));
        let (s, d) = (specular.average(), albedo.average());
        let specular_share = if s + d > 0.0 { s / (s + d) } else { 1.0 };
        Self { eta, interface, specular, base, specular_share }
    }

    /// What the interface lets through, seen at this cosine.
    #[inline]
    fn transmittance(&self, cos: f32) -> f32 {
        match self.interface {
            PlasticInterface::Smooth { .. } => 1.0 - fresnel_dielectric(cos, self.eta),
            PlasticInterface::Rough(_, table) => table.at(cos),
        }
    }

    /// Probability of the specular part.
    #[inline]
    fn specular_probability(&self, t: f32) -> f32 {
        let (s, d) = ((1.0 - t) * self.specular_share, t * (1.0 - self.specular_share));
        if s + d > 0.0 { s / (s + d) } else { 0.0 }
    }

    /// Both parts but for the Dirac one, and the density.
    fn both(&self, wo: Vec3, wi: Vec3) -> (Lanes, f32) {
        if !same_hemisphere(wo, wi) {
            return (Lanes::ZERO, 0.0);
        }
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let t = self.transmittance(cos_o);
        let p = self.specular_probability(t);
        let mut f = self.base * (INV_PI * t * self.transmittance(cos_i));
        let mut pdf = (1.0 - p) * cos_i * INV_PI;
        if let PlasticInterface::Rough(d, _) = &self.interface
            && let Some(wm) = (wo + wi).try_normalize()
        {
            let wm = if wm.z < 0.0 { -wm } else { wm };
            let normals = d.normals(wm) / (4.0 * cos_o);
            let fresnel = fresnel_dielectric(wo.abs_dot(wm), self.eta);
            f += self.specular * (fresnel * normals * d.masking_shadowing(wo, wi) / cos_i);
            pdf += p * normals * d.masking(wo);
        }
        (f, pdf)
    }
}

impl Lobe for Plastic<'_> {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION
            | Lobes::DIFFUSE
            | match self.interface {
                PlasticInterface::Smooth { .. } => Lobes::SPECULAR,
                PlasticInterface::Rough(..) => Lobes::GLOSSY,
            }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: TransportMode) -> Lanes {
        self.both(wo, wi).0
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _: TransportMode, part: Part) -> f32 {
        if part == Part::Transmission { 0.0 } else { self.both(wo, wi).1 }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, _: TransportMode) -> (Lanes, f32) {
        let (f, pdf) = self.both(wo, wi);
        (f * wi.z.abs(), pdf)
    }

    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], _: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission || wo.z == 0.0 {
            return None;
        }
        let t = self.transmittance(wo.z.abs());
        let p = self.specular_probability(t);
        let (wi, flag) = if u_lobe < p {
            match &self.interface {
                PlasticInterface::Smooth { .. } => {
                    return Some(LobeSample::reflected(
                        mirror(wo),
                        self.specular * ((1.0 - t) / p),
                        p,
                        Lobes::SPECULAR,
                    ));
                }
                PlasticInterface::Rough(d, _) => (reflect(wo, d.sample_visible_normal(wo, u)), Lobes::GLOSSY),
            }
        } else {
            let mut wi = square_to_cosine_hemisphere(u);
            wi.z = wi.z.copysign(wo.z);
            (wi, Lobes::DIFFUSE)
        };
        let (f, pdf) = self.both(wo, wi);
        (pdf > 0.0).then(|| LobeSample::reflected(wi, f * (wi.z.abs() / pdf), pdf, flag))
    }

    fn regularize(&mut self) {
        if let PlasticInterface::Rough(d, _) = &mut self.interface {
            d.regularize();
        }
    }
}
