//! The layered surface of glTF 2.0 and its extensions: metal, dielectric over a diffuse or transmitting base, with coat,
//! sheen and film.
//!
//! The appearance follows the specification (Khronos: glTF 2.0, appendix B, and the `KHR_materials_*` extensions); the layers
//! exchange energy by their tabulated albedos, in the form that is symmetric in both directions (Kelemen and Szirmay-Kalos
//! 2001), so that the lobe is reciprocal, never reflects more than it receives, and a white one reflects all of it. Where the
//! specification's blend of a coat counts its shadow once, it is counted on the way in and on the way out here.

mod energy;
mod film;
mod sheen;

pub use film::Film;

use crate::dielectric::Dielectric;
use crate::direction::{reflect, same_hemisphere};
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::microfacet::TrowbridgeReitz;
use film::fifth;
use steradian_math::{INV_PI, Vec3, sqr};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// The least alpha: smoother surfaces would need Dirac parts beside the others.
const LEAST_ALPHA: f32 = 2e-3;
/// Sheen of less roughness is a needle at the horizon.
const LEAST_SHEEN: f32 = 0.05;
/// The index of a coat is 1.5.
const COAT_F0: f32 = 0.04;

/// What the surface is made of. Factors are in `[0, 1]`; colours are evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughnessParams {
    /// Albedo of the diffuse base, reflectance of the metal, tint of what is transmitted.
    pub base: Lanes,
    /// Share of metal.
    pub metallic: f32,
    /// Alpha along both tangents.
    pub alpha: [f32; 2],
    /// Reflectance of the dielectric at normal incidence.
    pub f0: Lanes,
    /// Reflectance of the dielectric at grazing incidence.
    pub f90: f32,
    /// Index of refraction.
    pub eta: f32,
    /// Share of the diffuse base that is replaced by transmission.
    pub transmission: f32,
    /// Whether what is transmitted is not bent: a sheet, not the boundary of a volume.
    pub thin: bool,
    /// Share of the diffuse base that scatters to the other side.
    pub diffuse_transmission: f32,
    /// Its colour.
    pub diffuse_transmission_color: Lanes,
    /// Share that is coated, and the alpha of the coat.
    pub coat: [f32; 2],
    /// Colour of the sheen.
    pub sheen: Lanes,
    /// Alpha of the sheen.
    pub sheen_alpha: f32,
    /// A film below the coat.
    pub film: Option<Film>,
}

impl Default for MetallicRoughnessParams {
    fn default() -> Self {
        Self {
            base: Lanes::ONE,
            metallic: 0.0,
            alpha: [1.0; 2],
            f0: Lanes::splat(0.04),
            f90: 1.0,
            eta: 1.5,
            transmission: 0.0,
            thin: true,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: Lanes::ONE,
            coat: [0.0; 2],
            sheen: Lanes::ZERO,
            sheen_alpha: 0.5,
            film: None,
        }
    }
}

/// The lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    p: MetallicRoughnessParams,
    /// Reflectances at normal incidence that bound those of dielectric and metal: what their albedos are taken from.
    f0_bound: [Lanes; 2],
}

/// Probabilities of the ways to scatter, summing to one.
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    coat: f32,
    specular: f32,
    diffuse: f32,
    back: f32,
    sheet: f32,
    glass: f32,
}

/// Directional albedo of a reflection with the light that bounces between facets more than once, and what is needed of it.
struct Albedo {
    here: Lanes,
    average: Lanes,
    /// Colour of the light that bounced more than once.
    multiple: Lanes,
}

impl MetallicRoughness {
    /// A surface; everything is brought into its range.
    pub fn new(mut p: MetallicRoughnessParams) -> Self {
        let unit = |v: f32| v.clamp(0.0, 1.0);
        let color = |l: Lanes| l.clamp(0.0, 1.0);
        p.base = color(p.base);
        p.f0 = color(p.f0);
        p.f90 = unit(p.f90).max(p.f0.max_component());
        p.alpha = p.alpha.map(|a| a.clamp(LEAST_ALPHA, 1.0));
        p.metallic = unit(p.metallic);
        p.transmission = unit(p.transmission);
        p.diffuse_transmission = unit(p.diffuse_transmission);
        p.diffuse_transmission_color = color(p.diffuse_transmission_color);
        p.coat = [unit(p.coat[0]), p.coat[1].clamp(LEAST_ALPHA, 1.0)];
        p.sheen = color(p.sheen);
        p.sheen_alpha = p.sheen_alpha.clamp(LEAST_SHEEN, 1.0);
        // An interface that bends nothing has no facets to sample.
        p.thin |= (p.eta - 1.0).abs() < 0.01;
        p.film = p.film.filter(|f| f.factor > 0.0 && f.thickness > 0.0);
        let bound = |f0: Lanes, f90: f32| p.film.map_or(f0, |f| f.bound(f0, f90));
        Self { f0_bound: [bound(p.f0, p.f90), bound(p.base, 1.0)], p }
    }

    #[inline]
    fn distribution(&self) -> TrowbridgeReitz {
        TrowbridgeReitz::new(self.p.alpha[0], self.p.alpha[1])
    }

    #[inline]
    fn coat(&self) -> TrowbridgeReitz {
        TrowbridgeReitz::new(self.p.coat[1], self.p.coat[1])
    }

    #[inline]
    fn glass(&self) -> Dielectric {
        Dielectric::new(self.p.eta, self.distribution())
    }

    /// The alpha whose albedo bounds that of an anisotropic distribution.
    #[inline]
    fn table_alpha(&self) -> f32 {
        self.p.alpha[0].min(self.p.alpha[1])
    }

    /// Grazing reflectance that goes with the bound: a film may reflect everything.
    #[inline]
    fn f90(&self) -> f32 {
        if self.p.film.is_some() { 1.0 } else { self.p.f90 }
    }

    /// Share of the diffuse base among what is not metal.
    #[inline]
    fn opaque(&self) -> f32 {
        (1.0 - self.p.metallic) * (1.0 - self.p.transmission)
    }

    #[inline]
    fn transparent(&self) -> f32 {
        (1.0 - self.p.metallic) * self.p.transmission
    }

    /// Fresnel reflectance at a facet.
    #[inline]
    fn fresnel(&self, f0: Lanes, f90: f32, cos: f32) -> Lanes {
        let rise = fifth(1.0 - cos);
        let schlick = f0 * (1.0 - rise) + Lanes::splat(f90 * rise);
        match &self.p.film {
            None => schlick,
            Some(film) => schlick.lerp(film.reflectance(cos, f0), film.factor),
        }
    }

    fn albedo(&self, f0: Lanes, f90: f32, cos: f32) -> Albedo {
        let alpha = self.table_alpha();
        let [a, b] = energy::reflected(cos, alpha);
        let [a_mean, b_mean] = energy::reflected_on_average(alpha);
        let white = a_mean + b_mean;
        // Mean of Schlick's curve over the hemisphere.
        let mean = f0 * (20.0 / 21.0) + Lanes::splat(f90 / 21.0);
        let multiple = mean.map(|f| f * f * white / (1.0 - f * (1.0 - white)));
        Albedo {
            here: f0 * a + Lanes::splat(f90 * b) + multiple * (1.0 - a - b).max(0.0),
            average: f0 * a_mean + Lanes::splat(f90 * b_mean) + multiple * (1.0 - white).max(0.0),
            multiple,
        }
    }

    /// What gets through coat and sheen along one direction: scalar shares.
    #[inline]
    fn below(&self, cos: f32) -> (f32, f32) {
        let coat = if self.p.coat[0] > 0.0 {
            let [a, b] = energy::reflected(cos, self.p.coat[1]);
            1.0 - self.p.coat[0] * (COAT_F0 * a + b)
        } else {
            1.0
        };
        let sheen = if self.p.sheen.is_black() {
            1.0
        } else {
            1.0 - self.p.sheen.max_component() * energy::sheen(cos, self.p.sheen_alpha).min(1.0)
        };
        (coat, sheen)
    }

    /// The share of light between `wo` and `wi` that is left for what lies below coat and sheen.
    #[inline]
    fn attenuation(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let ((co, so), (ci, si)) = (self.below(wo.z), self.below(wi.z));
        (co * ci, so.min(si))
    }

    fn choice(&self, wo: Vec3, part: Part) -> Choice {
        let p = &self.p;
        let (coat, sheen) = self.below(wo.z);
        let rest = coat * sheen;
        let (opaque, transparent) = (self.opaque(), self.transparent());
        let dielectric = self.albedo(self.f0_bound[0], self.f90(), wo.z);
        let metal = self.albedo(self.f0_bound[1], 1.0, wo.z);
        let (d, m) = (dielectric.here.average(), metal.here.average());
        let alpha = self.table_alpha();
        let [a, b] = energy::reflected(wo.z, alpha);
        let lost = (1.0 - a - b).max(0.0);
        let multiple = p.metallic * metal.multiple.average() + opaque * dielectric.multiple.average();
        let glass = if p.thin { 0.0 } else { transparent };
        let sheet = if p.thin { transparent } else { 0.0 };
        let through = opaque * (1.0 - d);
        let mut c = Choice {
            coat: 1.0 - coat,
            specular: rest * (p.metallic * m + (opaque + sheet) * d),
            diffuse: rest * (through * (1.0 - p.diffuse_transmission) * p.base.average() + lost * multiple)
                + (1.0 - sheen),
            back: rest * through * p.diffuse_transmission * p.diffuse_transmission_color.average(),
            sheet: rest * sheet * (1.0 - d) * p.base.average(),
            glass: rest * glass,
        };
        let (reflect, transmit) = part.mask(1.0, 1.0);
        (c.coat, c.specular, c.diffuse) = (c.coat * reflect, c.specular * reflect, c.diffuse * reflect);
        (c.back, c.sheet) = (c.back * transmit, c.sheet * transmit);
        let sum = c.coat + c.specular + c.diffuse + c.back + c.sheet + c.glass;
        if sum > 0.0 {
            for v in [&mut c.coat, &mut c.specular, &mut c.diffuse, &mut c.back, &mut c.sheet, &mut c.glass] {
                *v /= sum;
            }
        }
        c
    }

    /// The density of a mirror direction off visible normals; both directions above.
    #[inline]
    fn mirror_pdf(d: &TrowbridgeReitz, wo: Vec3, wm: Vec3) -> f32 {
        d.masking(wo) * d.normals(wm) / (4.0 * wo.z)
    }

    /// What scatters to the side of `wo`, without glass; both directions above.
    fn reflected(&self, wo: Vec3, wi: Vec3) -> Lanes {
        let p = &self.p;
        let Some(wm) = (wo + wi).try_normalize() else { return Lanes::ZERO };
        let (coat, sheen) = self.attenuation(wo, wi);
        let (opaque, cos) = (self.opaque(), wo.dot(wm));
        let d = self.distribution();
        let facets = d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z * wi.z);
        let sheet = if p.thin { self.transparent() } else { 0.0 };
        let mut specular = Lanes::ZERO;
        let mut matte = Lanes::ZERO;
        let alpha = self.table_alpha();
        let lost = |w: Vec3| {
            let [a, b] = energy::reflected(w.z, alpha);
            (1.0 - a - b).max(0.0)
        };
        let [a, b] = energy::reflected_on_average(alpha);
        // Light that bounces between facets comes out spread.
        let bounced = lost(wo) * lost(wi) / (1.0 - a - b).max(1e-4);
        if p.metallic > 0.0 {
            specular += self.fresnel(p.base, 1.0, cos) * p.metallic;
            matte += self.albedo(self.f0_bound[1], 1.0, wo.z).multiple * (p.metallic * bounced);
        }
        if opaque + sheet > 0.0 {
            specular += self.fresnel(p.f0, p.f90, cos) * (opaque + sheet);
        }
        if opaque > 0.0 {
            let (out, inward) = self.dielectric_albedos(wo, wi);
            matte += out.multiple * (opaque * bounced);
            matte += coupled(&out, &inward) * p.base * (opaque * (1.0 - p.diffuse_transmission));
        }
        let mut value = (specular * facets + matte * INV_PI) * (coat * sheen);
        if p.coat[0] > 0.0 {
            let d = self.coat();
            let facets = d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z * wi.z);
            let f = COAT_F0 + (1.0 - COAT_F0) * fifth(1.0 - cos);
            value += Lanes::splat(p.coat[0] * f * facets);
        }
        if !p.sheen.is_black() {
            // At the horizon the model reflects more than there is.
            let of = |w: Vec3| energy::sheen(w.z, p.sheen_alpha).max(1.0);
            value += p.sheen * (sheen::value(wo, wi, p.sheen_alpha) / of(wo).max(of(wi)) * coat);
        }
        value
    }

    fn dielectric_albedos(&self, wo: Vec3, wi: Vec3) -> (Albedo, Albedo) {
        let of = |w: Vec3| self.albedo(self.f0_bound[0], self.f90(), w.z);
        (of(wo), of(wi))
    }

    /// What scatters to the other side, without glass; `wo` above, `wi` mirrored to lie above as well.
    fn transmitted(&self, wo: Vec3, wi: Vec3) -> Lanes {
        let p = &self.p;
        let (coat, sheen) = self.attenuation(wo, wi);
        let mut value = Lanes::ZERO;
        let back = self.opaque() * p.diffuse_transmission;
        if back > 0.0 {
            let (out, inward) = self.dielectric_albedos(wo, wi);
            value += coupled(&out, &inward) * p.diffuse_transmission_color * (back * INV_PI);
        }
        let sheet = self.transparent();
        if p.thin
            && sheet > 0.0
            && let Some(wm) = (wo + wi).try_normalize()
        {
            let d = self.distribution();
            let facets = d.normals(wm) * d.masking_shadowing(wo, wi) / (4.0 * wo.z * wi.z);
            let through = Lanes::ONE - self.fresnel(p.f0, p.f90, wo.dot(wm));
            value += through * p.base * (sheet * facets);
        }
        value * (coat * sheen)
    }

    /// The glass part, tinted on the way through.
    fn refracted(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        let share = if self.p.thin { 0.0 } else { self.transparent() };
        if share == 0.0 {
            return Lanes::ZERO;
        }
        let (coat, sheen) = self.attenuation(wo, wi);
        let value = self.glass().eval(wo, wi, mode) * (share * coat * sheen);
        if same_hemisphere(wo, wi) { value } else { value * self.p.base }
    }

    fn density(&self, c: &Choice, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        let glass = if c.glass > 0.0 { c.glass * self.glass().pdf_part(wo, wi, mode, part) } else { 0.0 };
        let reflects = same_hemisphere(wo, wi);
        let (wo, wi) = (upward(wo), upward(wi));
        let Some(wm) = (wo + wi).try_normalize() else { return glass };
        let cosine = wi.z * INV_PI;
        let base = || Self::mirror_pdf(&self.distribution(), wo, wm);
        if reflects {
            let specular = if c.specular > 0.0 { c.specular * base() } else { 0.0 };
            let coat = if c.coat > 0.0 { c.coat * Self::mirror_pdf(&self.coat(), wo, wm) } else { 0.0 };
            glass + specular + coat + c.diffuse * cosine
        } else {
            let sheet = if c.sheet > 0.0 { c.sheet * base() } else { 0.0 };
            glass + sheet + c.back * cosine
        }
    }
}

/// The same direction, or its mirror image in the surface if that is above.
#[inline]
fn upward(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, w.z.abs())
}

/// Symmetric exchange between a reflecting interface and a diffuse base of albedo one, times pi.
fn coupled(out: &Albedo, inward: &Albedo) -> Lanes {
    let left = |l: Lanes| (Lanes::ONE - l).clamp_zero();
    (left(out.here) * left(inward.here)).safe_div(left(out.average))
}

impl Lobe for MetallicRoughness {
    fn flags(&self) -> Lobes {
        let p = &self.p;
        let mut flags = Lobes::REFLECTION | Lobes::GLOSSY;
        if self.opaque() > 0.0 || !p.sheen.is_black() || self.table_alpha() > 0.1 {
            flags |= Lobes::DIFFUSE;
        }
        let back = self.opaque() * p.diffuse_transmission * p.diffuse_transmission_color.max_component();
        let through = self.transparent() * p.base.max_component();
        if back > 0.0 || through > 0.0 {
            flags |= Lobes::TRANSMISSION;
        }
        flags
    }

    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        if wo.z == 0.0 || wi.z == 0.0 {
            return Lanes::ZERO;
        }
        let rest = if same_hemisphere(wo, wi) {
            self.reflected(upward(wo), upward(wi))
        } else {
            self.transmitted(upward(wo), upward(wi))
        };
        rest + self.refracted(wo, wi, mode)
    }

    fn pdf_part(&self, wo: Vec3, wi: Vec3, mode: TransportMode, part: Part) -> f32 {
        let wanted = match part {
            Part::All => true,
            Part::Reflection => same_hemisphere(wo, wi),
            Part::Transmission => !same_hemisphere(wo, wi),
        };
        if wo.z == 0.0 || wi.z == 0.0 || !wanted {
            return 0.0;
        }
        self.density(&self.choice(wo, part), wo, wi, mode, part)
    }

    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        if wo.z == 0.0 {
            return None;
        }
        let c = self.choice(wo, part);
        let up = upward(wo);
        let mirrored = |d: &TrowbridgeReitz| {
            let wi = reflect(up, d.sample_visible_normal(up, u));
            (wi.z > 0.0).then_some(wi)
        };
        let mut left = u_lobe;
        let mut take = |probability: f32| {
            let taken = left < probability;
            if !taken {
                left -= probability;
            }
            taken && probability > 0.0
        };
        let (side, below) = (1.0f32.copysign(wo.z), -1.0f32.copysign(wo.z));
        let put = |w: Vec3, side: f32| Vec3::new(w.x, w.y, w.z.copysign(side));
        let mut eta = 1.0;
        let (wi, kind) = if take(c.coat) {
            (put(mirrored(&self.coat())?, side), Lobes::GLOSSY)
        } else if take(c.specular) {
            (put(mirrored(&self.distribution())?, side), Lobes::GLOSSY)
        } else if take(c.diffuse) {
            (put(square_to_cosine_hemisphere(u), side), Lobes::DIFFUSE)
        } else if take(c.back) {
            (put(square_to_cosine_hemisphere(u), below), Lobes::DIFFUSE)
        } else if take(c.sheet) {
            (put(mirrored(&self.distribution())?, below), Lobes::GLOSSY)
        } else if c.glass > 0.0 {
            let u_side = (left / c.glass).clamp(0.0, 1.0 - f32::EPSILON);
            let s = self.glass().sample_part(wo, u_side, u, mode, part)?;
            eta = s.eta;
            (s.wi, Lobes::GLOSSY)
        } else {
            return None;
        };
        if wi.z == 0.0 {
            return None;
        }
        let pdf = self.density(&c, wo, wi, mode, part);
        let weight = self.eval_cos(wo, wi, mode) * (1.0 / pdf);
        let flag = if same_hemisphere(wo, wi) { Lobes::REFLECTION } else { Lobes::TRANSMISSION };
        (pdf > 0.0 && pdf.is_finite() && weight.is_finite()).then_some(LobeSample {
            wi,
            weight,
            pdf,
            flags: flag | kind,
            eta,
            pdf_is_proportional: false,
        })
    }

    fn regularize(&mut self) {
        let mut d = self.distribution();
        d.regularize();
        self.p.alpha = d.alpha();
        let mut d = self.coat();
        d.regularize();
        self.p.coat[1] = d.alpha()[0];
    }
}

/// Reflectance at normal incidence of a dielectric in air.
pub fn normal_reflectance(eta: f32) -> f32 {
    sqr((eta - 1.0) / (eta + 1.0))
}
