//! Glass and water: reflection and refraction at a smooth or rough interface (Walter et al. 2007).

use crate::direction::{mirror, reflect, refract, same_hemisphere};
use crate::fresnel::fresnel_dielectric;
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use crate::microfacets::Microfacets;
use steradian_math::{Vec3, sqr};
use steradian_spectrum::Lanes;

/// An interface between two dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction below the normal over the one above; positive.
    pub eta: f32,
    /// The microfacets.
    pub distribution: Microfacets,
}

/// A pair of directions seen from the microfacet that joins them.
struct Facet {
    wm: Vec3,
    /// Fresnel reflectance.
    reflectance: f32,
    reflects: bool,
    /// Index on the side of `wi` relative to the side of `wo`.
    eta: f32,
}

impl Dielectric {
    /// A lobe with this relative index and roughness.
    #[inline]
    pub fn new(eta: f32, distribution: impl Into<Microfacets>) -> Self {
        Self { eta, distribution: distribution.into() }
    }

    /// Whether the lobe is Dirac. Without a change of index even a rough interface does not bend light.
    #[inline]
    pub fn is_specular(&self) -> bool {
        self.eta == 1.0 || self.distribution.is_smooth()
    }

    #[inline]
    fn facet(&self, wo: Vec3, wi: Vec3) -> Option<Facet> {
        if self.is_specular() || wo.z == 0.0 || wi.z == 0.0 {
            return None;
        }
        let reflects = same_hemisphere(wo, wi);
        let eta = if reflects {
            1.0
        } else if wo.z > 0.0 {
            self.eta
        } else {
            1.0 / self.eta
        };
        let mut wm = (wi * eta + wo).try_normalize()?;
        if wm.z < 0.0 {
            wm = -wm;
        }
        // A facet seen from behind does not count.
        if wm.dot(wi) * wi.z < 0.0 || wm.dot(wo) * wo.z < 0.0 {
            return None;
        }
        Some(Facet { wm, reflectance: fresnel_dielectric(wo.dot(wm), self.eta), reflects, eta })
    }

    /// Density of `wi` given that this facet is taken and this side chosen.
    #[inline]
    fn facet_pdf(&self, wo: Vec3, wi: Vec3, wm: Vec3, reflects: bool, eta: f32) -> f32 {
        let visible = self.distribution.visible_normals(wo, wm);
        if reflects {
            visible / (4.0 * wo.abs_dot(wm))
        } else {
            visible * wi.abs_dot(wm) / sqr(wi.dot(wm) + wo.dot(wm) / eta)
        }
    }

    fn sample_smooth(&self, wo: Vec3, u_lobe: f32, mode: TransportMode, part: Part) -> Option<LobeSample> {
        // Rounding would leave a trace of reflection where there is no interface.
        let r = if self.eta == 1.0 { 0.0 } else { fresnel_dielectric(wo.z, self.eta) };
        let (pr, pt) = part.mask(r, 1.0 - r);
        let sum = pr + pt;
        if sum == 0.0 || wo.z == 0.0 {
            return None;
        }
        // The weight is reflectance over probability: `sum`, and the factor of the refraction.
        if u_lobe < pr / sum {
            Some(LobeSample {
                wi: mirror(wo),
                weight: Lanes::splat(sum),
                pdf: pr / sum,
                flags: Lobes::REFLECTION | Lobes::SPECULAR,
                eta: 1.0,
                pdf_is_proportional: false,
            })
        } else {
            let (wi, eta) = refract(wo, Vec3::new(0.0, 0.0, 1.0), self.eta)?;
            (wi.z != 0.0).then(|| LobeSample {
                wi,
                weight: Lanes::splat(sum * radiance_factor(eta, mode)),
                pdf: pt / sum,
                flags: Lobes::TRANSMISSION | Lobes::SPECULAR,
                eta,
                pdf_is_proportional: false,
            })
        }
    }
}

/// Refraction squeezes radiance into a smaller solid angle; importance is defined so that it does not change.
#[inline(always)]
fn radiance_factor(eta: f32, mode: TransportMode) -> f32 {
    match mode {
        TransportMode::Radiance => 1.0 / (eta * eta),
        TransportMode::Importance => 1.0,
    }
}

impl Dielectric {
    /// The scattering function, for a facet that is known.
    #[inline]
    fn facet_value(&self, wo: Vec3, wi: Vec3, facet: &Facet, mode: TransportMode) -> f32 {
        let wm = facet.wm;
        let dg = self.distribution.normals(wm) * self.distribution.masking_shadowing(wo, wi);
        if facet.reflects {
            facet.reflectance * dg / (4.0 * wo.z * wi.z)
        } else {
            let (i, o) = (wi.dot(wm), wo.dot(wm));
            let jacobian = (i * o / (wi.z * wo.z * sqr(i + o / facet.eta))).abs();
            (1.0 - facet.reflectance) * dg * jacobian * radiance_factor(facet.eta, mode)
        }
    }
}

impl Lobe for Dielectric {
    #[inline]
    fn flags(&self) -> Lobes {
        let sides = if self.eta == 1.0 { Lobes::TRANSMISSION } else { Lobes::REFLECTION | Lobes::TRANSMISSION };
        sides | if self.is_specular() { Lobes::SPECULAR } else { Lobes::GLOSSY }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        match self.facet(wo, wi) {
            Some(facet) => Lanes::splat(self.facet_value(wo, wi, &facet, mode)),
            None => Lanes::ZERO,
        }
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Lanes, f32) {
        let Some(facet) = self.facet(wo, wi) else { return (Lanes::ZERO, 0.0) };
        let side = if facet.reflects { facet.reflectance } else { 1.0 - facet.reflectance };
        let pdf = side * self.facet_pdf(wo, wi, facet.wm, facet.reflects, facet.eta);
        (Lanes::splat(self.facet_value(wo, wi, &facet, mode) * wi.z.abs()), pdf)
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _mode: TransportMode, part: Part) -> f32 {
        let Some(facet) = self.facet(wo, wi) else { return 0.0 };
        let (pr, pt) = part.mask(facet.reflectance, 1.0 - facet.reflectance);
        let side = if facet.reflects { pr } else { pt };
        if side == 0.0 {
            return 0.0;
        }
        side / (pr + pt) * self.facet_pdf(wo, wi, facet.wm, facet.reflects, facet.eta)
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        if self.is_specular() {
            return self.sample_smooth(wo, u_lobe, mode, part);
        }
        if wo.z == 0.0 {
            return None;
        }
        let d = &self.distribution;
        let wm = d.sample_visible_normal(wo, u);
        let r = fresnel_dielectric(wo.dot(wm), self.eta);
        let (pr, pt) = part.mask(r, 1.0 - r);
        let sum = pr + pt;
        if sum == 0.0 {
            return None;
        }
        let reflects = u_lobe < pr / sum;
        let (wi, eta, probability, flag) = if reflects {
            (reflect(wo, wm), 1.0, pr / sum, Lobes::REFLECTION)
        } else {
            let (wi, eta) = refract(wo, wm, self.eta)?;
            (wi, eta, pt / sum, Lobes::TRANSMISSION)
        };
        if wi.z == 0.0 || same_hemisphere(wo, wi) != reflects {
            return None;
        }
        // f cos / pdf: distribution and Jacobian cancel, the shadowing and the choice of side are left.
        let mut weight = sum * d.masking_shadowing(wo, wi) / d.masking(wo);
        if !reflects {
            weight *= radiance_factor(eta, mode);
        }
        let pdf = probability * self.facet_pdf(wo, wi, wm, reflects, eta);
        (pdf > 0.0 && pdf.is_finite()).then(|| LobeSample {
            wi,
            weight: Lanes::splat(weight),
            pdf,
            flags: flag | Lobes::GLOSSY,
            eta,
            pdf_is_proportional: false,
        })
    }

    fn regularize(&mut self) {
        self.distribution.regularize();
    }
}
