//! What lies below translucent surfaces.

use super::{Surface, World};
use crate::material::{Scattering, Translucency};
use crate::{Handle, Material, Scene};
use steradian_bsdf::{DiffusionTable, Subsurface};
use steradian_spectrum::Wavelengths;

/// The diffusion tables of all translucent materials, one for each phase function and index.
#[derive(Clone, Debug, Default)]
pub(super) struct DiffusionTables {
    tables: Vec<DiffusionTable>,
    /// The table of each material; empty if there are none.
    of_material: Vec<Option<u32>>,
}

impl DiffusionTables {
    pub fn build(scene: &Scene) -> Self {
        let mut kinds: Vec<[f32; 2]> = Vec::new();
        let of_material = scene
            .materials
            .iter()
            .map(|m| {
                let Scattering::Subsurface { g, eta, .. } = m.scattering else { return None };
                let kind = [g.clamp(-0.99, 0.99), eta];
                let known = kinds.iter().position(|k| *k == kind);
                Some(known.unwrap_or_else(|| {
                    kinds.push(kind);
                    kinds.len() - 1
                }) as u32)
            })
            .collect();
        use rayon::prelude::*;
        let tables: Vec<_> = kinds.par_iter().map(|&[g, eta]| DiffusionTable::new(g, eta)).collect();
        if tables.is_empty() { Self::default() } else { Self { tables, of_material } }
    }
}

impl World {
    /// Whether any material is translucent; if not, [`World::subsurface`] need not be asked.
    #[inline]
    pub fn has_subsurface(&self) -> bool {
        !self.diffusion.tables.is_empty()
    }

    /// The material of a surface as the scene says; it may be a mix.
    #[inline]
    pub fn material(&self, surface: &Surface) -> Handle<Material> {
        self.groups[surface.group as usize].primitives[surface.primitive as usize].material
    }

    /// What is below a surface point whose shading was worked out; `None` if its material is not translucent.
    pub fn subsurface(&self, surface: &Surface, w: &Wavelengths) -> Option<Subsurface<'_>> {
        let context = self.texture_context(surface);
        let handle = self.unmixed(self.material(surface), surface, &context);
        let table = &self.diffusion.tables[self.diffusion.of_material.get(handle.index()).copied()?? as usize];
        let Scattering::Subsurface { inside, scale, eta, .. } = &self.scene.materials[handle].scattering else {
            return None;
        };
        let of = |t| (self.spectrum_texture(t, &context, w) * *scale).clamp_zero();
        Some(match *inside {
            Translucency::Coefficients { sigma_a, sigma_s } => Subsurface::new(table, of(sigma_a), of(sigma_s), *eta),
            Translucency::Reflectance { reflectance, mean_free_path } => {
                let color = self.spectrum_texture(reflectance, &context, w).clamp(0.0, 1.0);
                Subsurface::of_reflectance(table, color, of(mean_free_path), *eta)
            }
        })
    }
}
