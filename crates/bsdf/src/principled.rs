//! The surfaces that Mitsuba calls `principled` and `principledthin`: Disney's model (Burley 2012 and 2015), with the choices of Mitsuba's
//! plugins where the papers leave any.

use crate::direction::{reflect, refract, same_hemisphere};
use crate::fresnel::fresnel_dielectric;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::microfacet::TrowbridgeReitz;
use crate::microfacets::Microfacets;
use steradian_math::{INV_PI, PI, TAU, Vec3, lerp, ln, powf, safe_sqrt, sin_cos, sqr};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// What a principled surface is made of. Shares lie in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledParams {
    /// Colour of the base.
    pub base: Lanes,
    /// Its luminance.
    pub luminance: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// How far highlights are stretched.
    pub anisotropic: f32,
    /// Share of metal; none in thin surfaces.
    pub metallic: f32,
    /// Share of glass.
    pub transmission: f32,
    /// Index of refraction over that of the outside.
    pub eta: f32,
    /// How far the dielectric's reflection has the base's tint.
    pub specular_tint: f32,
    /// Strength of the coat; thin surfaces have none.
    pub coat: f32,
    /// From 0, satin, to 1, gloss.
    pub coat_gloss: f32,
    /// Strength of the sheen.
    pub sheen: f32,
    /// How far it has the base's tint.
    pub sheen_tint: f32,
    /// From Disney's diffuse reflection to an approximation of subsurface scattering.
    pub flatness: f32,
    /// Of a thin surface: share of the diffuse light that goes to the other side. `None`: the surface is that of a solid.
    pub thin: Option<f32>,
}

/// A principled surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    p: PrincipledParams,
    glossy: Microfacets,
    /// Of the transmission of thin surfaces.
    through: Microfacets,
}

/// Which part a direction is taken from, with probabilities: diffuse, coat, mirrored, refracted, diffuse to the other side.
struct Choices([f32; 5]);

/// The roughness that a coat's gloss stands for.
fn coat_alpha(gloss: f32) -> f32 {
    lerp(gloss, 0.1, 0.001)
}

/// Density of the coat's microfacet normals: Burley's second lobe of gamma one.
fn coat_normals(wm: Vec3, alpha: f32) -> f32 {
    let a2 = sqr(alpha);
    (a2 - 1.0) / (PI * ln(a2) * (1.0 + (a2 - 1.0) * sqr(wm.z)))
}

fn sample_coat_normal(u: [f32; 2], alpha: f32) -> Vec3 {
    let a2 = sqr(alpha);
    let cos2 = ((1.0 - powf(a2, 1.0 - u[1])) / (1.0 - a2)).clamp(0.0, 1.0);
    let (sin, cos) = sin_cos(TAU * u[0]);
    let sin_theta = safe_sqrt(1.0 - cos2);
    Vec3::new(cos * sin_theta, sin * sin_theta, cos2.sqrt())
}

/// Schlick's fifth power.
#[inline]
fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    sqr(sqr(m)) * m
}

/// Schlick's weight at the angle on the rarer side; `cos` is negative from inside.
fn schlick_through(cos: f32, eta: f32) -> f32 {
    let relative = if cos >= 0.0 { eta } else { 1.0 / eta };
    if relative > 1.0 {
        return schlick(cos.abs());
    }
    schlick(safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(relative)))
}

fn stretched(anisotropic: f32, roughness: f32) -> Microfacets {
    let aspect = safe_sqrt(1.0 - 0.9 * anisotropic);
    let alpha = |a: f32| (sqr(roughness) * a).max(0.001);
    Microfacets::SeparableTrowbridgeReitz(TrowbridgeReitz::new(alpha(1.0 / aspect), alpha(aspect)))
}

impl Principled {
    /// The lobe of these parameters.
    pub fn new(p: PrincipledParams) -> Self {
        let scaled = (0.65 * p.eta - 0.35) * p.roughness;
        Self { p, glossy: stretched(p.anisotropic, p.roughness), through: stretched(p.anisotropic, scaled) }
    }

    /// The base's colour at luminance one.
    fn tint(&self) -> Lanes {
        if self.p.luminance > 0.0 { self.p.base / self.p.luminance } else { Lanes::ONE }
    }

    fn choices(&self, wo: Vec3, part: Part) -> Choices {
        let p = &self.p;
        let f = fresnel_dielectric(if p.thin.is_some() { wo.z.abs() } else { wo.z }, p.eta);
        let (glass, rest) = ((1.0 - p.metallic) * p.transmission, (1.0 - p.metallic) * (1.0 - p.transmission));
        // In proportion to what the parts reflect, as far as that is known; nothing that reflects is left out.
        let base = p.base.average();
        let diffuse = rest * (base + p.sheen).clamp(0.05, 1.0);
        let mirrored = p.metallic * base.max(0.05) + (1.0 - p.metallic) * f.max(0.04);
        let mut all = match p.thin {
            Some(back) => [diffuse * (1.0 - back), 0.0, glass * f, glass * (1.0 - f), diffuse * back],
            None if wo.z > 0.0 => [diffuse, 0.02 * p.coat, mirrored, glass * (1.0 - f), 0.0],
            // Where the surface itself reflects all light, its facets need not.
            None if glass > 0.0 => {
                let f = f.clamp(0.1, 0.9);
                [0.0, 0.0, f, 1.0 - f, 0.0]
            }
            None => [0.0; 5],
        };
        match part {
            Part::All => {}
            Part::Reflection => (all[3], all[4]) = (0.0, 0.0),
            Part::Transmission => (all[0], all[1], all[2]) = (0.0, 0.0, 0.0),
        }
        let sum: f32 = all.iter().sum();
        if sum > 0.0 {
            all.iter_mut().for_each(|v| *v /= sum);
        }
        Choices(all)
    }

    /// Diffuse, retroreflected and flattened light, and sheen; with the cosine.
    fn diffuse(&self, wo: Vec3, wi: Vec3, wm: Vec3) -> Lanes {
        let p = &self.p;
        if p.transmission >= 1.0 {
            return Lanes::ZERO;
        }
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let (fo, fi) = (schlick(cos_o), schlick(cos_i));
        let cos_d = wm.dot(wi);
        let rr = 2.0 * p.roughness * sqr(cos_d);
        let burley = (1.0 - 0.5 * fi) * (1.0 - 0.5 * fo) + rr * (fo + fi + fo * fi * (rr - 1.0));
        let fss = lerp(fo, 1.0, 0.5 * rr) * lerp(fi, 1.0, 0.5 * rr);
        let flat = 1.25 * (fss * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
        let base = p.base * ((1.0 - p.transmission) * INV_PI * lerp(p.flatness, burley, flat));
        let tint = Lanes::ONE * (1.0 - p.sheen_tint) + self.tint() * p.sheen_tint;
        // Solids keep their sheen whatever share of them is glass.
        let sheen = p.sheen * schlick(cos_d.abs()) * if p.thin.is_some() { 1.0 - p.transmission } else { 1.0 };
        (base + tint * sheen) * (cos_i * (1.0 - p.metallic) * (1.0 - p.thin.unwrap_or(0.0)))
    }

    /// Reflectance of the glossy part.
    fn fresnel(&self, f: f32, cos: f32, front: bool) -> Lanes {
        let p = &self.p;
        let dielectric = 1.0 - p.metallic;
        if !front {
            return Lanes::splat(dielectric * p.transmission * f);
        }
        let weight = schlick_through(cos, p.eta);
        let toward_white = |r0: Lanes| r0 * (1.0 - weight) + Lanes::splat(weight);
        let r0 = self.tint() * sqr((p.eta - 1.0) / (p.eta + 1.0));
        toward_white(p.base) * p.metallic
            + Lanes::splat(dielectric * (1.0 - p.specular_tint) * f)
            + toward_white(r0) * (dielectric * p.specular_tint)
    }

    /// `f |cos wi|` and the density.
    fn solid(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> (Lanes, f32) {
        let p = &self.p;
        let (front, reflects) = (wo.z > 0.0, same_hemisphere(wo, wi));
        let eta = if reflects {
            1.0
        } else if front {
            p.eta
        } else {
            1.0 / p.eta
        };
        let Some(wm) = (wo + wi * eta).try_normalize() else { return (Lanes::ZERO, 0.0) };
        let wm = if wm.z < 0.0 { -wm } else { wm };
        let Choices([p_diffuse, p_coat, p_mirror, p_refract, _]) = self.choices(wo, part);
        let (dot_o, dot_i) = (wo.dot(wm), wi.dot(wm));
        // A facet seen from behind does not count.
        let seen = dot_o * wo.z > 0.0 && dot_i * wi.z > 0.0;
        let f = fresnel_dielectric(dot_o, p.eta);
        let d = &self.glossy;
        let (mut value, mut pdf) = (Lanes::ZERO, 0.0);
        if !reflects {
            let glass = (1.0 - p.metallic) * p.transmission;
            if seen && glass > 0.0 {
                let jacobian = dot_i.abs() / sqr(dot_i + dot_o / eta);
                let dg = d.normals(wm) * d.masking_shadowing(wo, wi);
                let squeezed = if mode == TransportMode::Radiance { 1.0 / sqr(eta) } else { 1.0 };
                let scale = glass * (1.0 - f) * dg * jacobian * dot_o.abs() / wo.z.abs() * squeezed;
                value = p.base.safe_sqrt() * scale;
                pdf = p_refract * d.visible_normals(wo, wm) * jacobian;
            }
            return (value, pdf);
        }
        if seen {
            let dg = d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z.abs());
            value = self.fresnel(f, dot_o, front) * dg;
            pdf = p_mirror * d.visible_normals(wo, wm) / (4.0 * dot_o.abs());
        }
        if front {
            if p.coat > 0.0 && seen {
                let alpha = coat_alpha(p.coat_gloss);
                let normals = coat_normals(wm, alpha);
                let masking = TrowbridgeReitz::new(0.25, 0.25);
                let weight = schlick_through(dot_o, p.eta);
                let fresnel = 0.04 + 0.96 * weight;
                let g = masking.masking(wo) * masking.masking(wi);
                value += Lanes::splat(0.25 * p.coat * fresnel * normals * g * wi.z);
                pdf += p_coat * normals * wm.z / (4.0 * dot_i.abs());
            }
            value += self.diffuse(wo, wi, wm);
            pdf += p_diffuse * wi.z.abs() * INV_PI;
        }
        (value, pdf)
    }

    /// As [`Self::solid`], for a thin surface, which is the same from both sides.
    fn thin(&self, wo: Vec3, wi: Vec3, part: Part) -> (Lanes, f32) {
        let p = &self.p;
        let reflects = same_hemisphere(wo, wi);
        let side = if wo.z < 0.0 { -1.0 } else { 1.0 };
        let (wo, wi) = (wo * side, wi * side);
        let mirrored = Vec3::new(wi.x, wi.y, wi.z.abs());
        let Some(wm) = (wo + mirrored).try_normalize() else { return (Lanes::ZERO, 0.0) };
        let Choices([p_diffuse, _, p_mirror, p_through, p_back]) = self.choices(wo, part);
        let dot = wo.dot(wm);
        let f = fresnel_dielectric(dot, p.eta);
        let cosine = wi.z.abs() * INV_PI;
        if !reflects {
            let d = &self.through;
            let dg = d.normals(wm) * d.masking_shadowing(wo, mirrored) / (4.0 * wo.z);
            let straight = p.base * (p.transmission * (1.0 - f) * dg);
            let back = p.base * ((1.0 - p.transmission) * p.thin.unwrap_or(0.0) * cosine);
            return (straight + back, p_through * d.visible_normals(wo, wm) / (4.0 * dot) + p_back * cosine);
        }
        let d = &self.glossy;
        let dg = d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z);
        let weight = schlick_through(dot, p.eta);
        let r0 = self.tint() * sqr((p.eta - 1.0) / (p.eta + 1.0));
        let tinted = r0 * (1.0 - weight) + Lanes::splat(weight);
        let fresnel = Lanes::splat(f * (1.0 - p.specular_tint)) + tinted * p.specular_tint;
        let value = fresnel * (p.transmission * dg) + self.diffuse(wo, wi, wm);
        (value, p_mirror * d.visible_normals(wo, wm) / (4.0 * dot) + p_diffuse * cosine)
    }

    fn both(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> (Lanes, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Lanes::ZERO, 0.0);
        }
        if self.p.thin.is_some() { self.thin(wo, wi, part) } else { self.solid(wo, wi, mode, part) }
    }
}

impl Lobe for Principled {
    fn flags(&self) -> Lobes {
        let transmits = self.p.thin.is_some() || (1.0 - self.p.metallic) * self.p.transmission > 0.0;
        let sides = if transmits { Lobes::REFLECTION | Lobes::TRANSMISSION } else { Lobes::REFLECTION };
        sides | Lobes::DIFFUSE | Lobes::GLOSSY
    }

    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        if wi.z == 0.0 { Lanes::ZERO } else { self.both(wo, wi, mode, Part::All).0 / wi.z.abs() }
    }

    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        self.both(wo, wi, mode, part).1
    }

    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        self.both(wo, wi, mode, Part::All)
    }

    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        let Choices(all) = self.choices(wo, part);
        if wo.z == 0.0 || all.iter().all(|&p| p == 0.0) {
            return None;
        }
        let mut left = u_lobe;
        let last = all.iter().rposition(|&p| p > 0.0)?;
        let choice = all.iter().position(|&p| {
            left -= p;
            left < 0.0
        });
        let choice = choice.unwrap_or(last).min(last);
        let side = if wo.z < 0.0 { -1.0 } else { 1.0 };
        let cosine = || square_to_cosine_hemisphere(u);
        let flip = |w: Vec3| Vec3::new(w.x, w.y, -w.z);
        let mut eta = 1.0;
        let wi = match choice {
            0 => cosine() * side,
            1 => reflect(wo, sample_coat_normal(u, coat_alpha(self.p.coat_gloss))),
            2 => reflect(wo, self.glossy.sample_visible_normal(wo, u)),
            3 if self.p.thin.is_some() => flip(reflect(wo, self.through.sample_visible_normal(wo, u))),
            3 => {
                let (wi, relative) = refract(wo, self.glossy.sample_visible_normal(wo, u), self.p.eta)?;
                eta = relative;
                wi
            }
            _ => -(cosine() * side),
        };
        let reflects = choice < 3;
        if wi.z == 0.0 || same_hemisphere(wo, wi) != reflects {
            return None;
        }
        let (value, pdf) = self.both(wo, wi, mode, part);
        let side = if reflects { Lobes::REFLECTION } else { Lobes::TRANSMISSION };
        let kind = if matches!(choice, 0 | 4) { Lobes::DIFFUSE } else { Lobes::GLOSSY };
        (pdf > 0.0 && pdf.is_finite()).then(|| LobeSample {
            wi,
            weight: value / pdf,
            pdf,
            flags: side | kind,
            eta,
            pdf_is_proportional: false,
        })
    }

    fn regularize(&mut self) {
        self.glossy.regularize();
        self.through.regularize();
    }
}
