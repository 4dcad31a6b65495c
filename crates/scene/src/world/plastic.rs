//! Mitsuba's plastic and principled surfaces at a point; what the rough interfaces of plastic let through is tabulated once.

use super::World;
use super::shading::with_slopes;
use super::texture::TextureContext;
use crate::Scene;
use crate::material::{PlasticInputs, PrincipledInputs, Scattering, Slopes};
use steradian_bsdf::{
    Bsdf, Microfacets, Plastic, PlasticInterface, PlasticTable, Principled, PrincipledParams, TrowbridgeReitz,
    diffuse_fresnel_reflectance,
};
use steradian_spectrum::{Lanes, Wavelengths};

/// The tables of all rough plastics, one for each roughness and index.
#[derive(Clone, Debug, Default)]
pub(super) struct PlasticTables {
    tables: Vec<(Kind, PlasticTable)>,
}

/// Statistics, alpha, index.
type Kind = (Slopes, f32, f32);

fn microfacets(slopes: Slopes, alpha: f32) -> Microfacets {
    with_slopes(TrowbridgeReitz::new(alpha, alpha).into(), slopes)
}

impl PlasticTables {
    pub fn build(scene: &Scene) -> Self {
        let mut kinds: Vec<Kind> = Vec::new();
        for m in scene.materials.iter() {
            if let Scattering::Plastic(p) = &m.scattering
                && let Some((slopes, alpha)) = p.roughness
                && !kinds.contains(&(slopes, alpha, p.eta))
            {
                kinds.push((slopes, alpha, p.eta));
            }
        }
        use rayon::prelude::*;
        let table = |k: &Kind| (*k, PlasticTable::new(&microfacets(k.0, k.1), k.2));
        Self { tables: kinds.par_iter().map(table).collect() }
    }
}

impl World {
    pub(super) fn principled(&self, p: &PrincipledInputs, c: &TextureContext, w: &Wavelengths) -> Bsdf<'_> {
        let share = |t| self.float_texture(t, c).clamp(0.0, 1.0);
        let base = self.spectrum_texture(p.base, c, w).clamp(0.0, 1.0);
        let luminance = if w.is_rgb() {
            let [r, g, b] = base.rgb();
            0.212_671 * r + 0.715_16 * g + 0.072_169 * b
        } else {
            base.average()
        };
        Principled::new(PrincipledParams {
            base,
            luminance,
            roughness: share(p.roughness),
            anisotropic: share(p.anisotropic),
            metallic: share(p.metallic),
            transmission: share(p.transmission),
            eta: p.eta,
            specular_tint: share(p.specular_tint),
            coat: share(p.coat[0]),
            coat_gloss: share(p.coat[1]),
            sheen: share(p.sheen[0]),
            sheen_tint: share(p.sheen[1]),
            flatness: share(p.flatness),
            thin: p.thin.map(|t| (0.5 * self.float_texture(t, c)).clamp(0.0, 1.0)),
        })
        .into()
    }

    pub(super) fn plastic(&self, p: &PlasticInputs, c: &TextureContext, w: &Wavelengths) -> Bsdf<'_> {
        let rough = p.roughness.map(|(slopes, alpha)| (microfacets(slopes, alpha), (slopes, alpha, p.eta)));
        let interface = match rough {
            Some((d, kind)) if !d.is_smooth() => {
                let known = self.plastics.tables.iter().find(|t| t.0 == kind);
                known.map(|t| PlasticInterface::Rough(d, &t.1))
            }
            _ => None,
        };
        let smooth = || PlasticInterface::Smooth { internal: diffuse_fresnel_reflectance(p.eta) };
        let albedo = self.spectrum_texture(p.reflectance, c, w).clamp(0.0, 1.0);
        let specular = p.specular.map_or(Lanes::ONE, |t| self.spectrum_texture(t, c, w).clamp_zero());
        Plastic::new(interface.unwrap_or_else(smooth), p.eta, albedo, specular, p.nonlinear).into()
    }
}
