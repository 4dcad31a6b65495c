//! Media along rays: coefficients at a point, bounds on them ahead, and which medium lies behind a surface.
//!
//! PBRT 4th ed., chapter 11; null-collision methods after Novak et al. 2018, "Monte Carlo methods for volumetric light
//! transport simulation".

mod around;
mod cloud;
mod fields;
mod flight;
mod grid;
mod majorant;
mod rgb_grid;
#[cfg(test)]
mod tests;

pub use flight::{Collision, FreeFlight};

use super::surface::HitShape;
use super::{Hit, Shading, Surface, TextureContext, World};
use crate::medium::{Cloud, Glow, Medium, Phase, Volume};
use crate::{Error, Handle, Ior, Material, Primitive, Scattering, Scene};
use fields::BuiltFields;
use majorant::{MajorantGrid, Majorants};
use rgb_grid::BuiltRgbGrid;
use steradian_bsdf::{HenyeyGreenstein, PhaseFunction, PhaseMix, Rayleigh, Straight, TabulatedPhase};
use steradian_math::{Bounds3, Point3, Ray, Transform, Vec3};
use steradian_spectrum::{Lanes, Spectrum, SpectrumUse, Wavelengths, planck};

/// Cells of the majorant grid along each axis, for regular and for sparse grids.
const GRID_CELLS: usize = 16;
const SPARSE_CELLS: usize = 64;

/// What is derived from a [`Medium`]; the grids themselves stay in the scene.
#[derive(Clone, Debug)]
pub(crate) struct BuiltMedium {
    phases: Vec<PhaseFunction>,
    medium_from_world: Transform,
    /// Coefficients at density one, scale included.
    sigma_a: Spectrum,
    sigma_s: Spectrum,
    /// Emission where its field is one, scale included.
    emission: Option<Spectrum>,
    shape: BuiltShape,
}

#[derive(Clone, Debug)]
enum BuiltShape {
    /// The same everywhere.
    Everywhere,
    /// A cloud.
    Cloud(Cloud),
    /// A density on a grid of either kind, with bounds on it.
    Density(MajorantGrid),
    /// Coefficients on a grid.
    Rgb(BuiltRgbGrid),
    /// Extinction and albedo, each by itself.
    Fields(BuiltFields),
}

/// A medium at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumPoint {
    /// Absorption per unit length; negative where [fields](crate::Fields) scatter more than they take.
    pub sigma_a: Lanes,
    /// Scattering per unit length.
    pub sigma_s: Lanes,
    /// Emitted radiance per absorption: the source term is `sigma_a emission`.
    pub emission: Lanes,
}

/// A medium along a ray, its spectra evaluated.
#[derive(Clone, Copy, Debug)]
pub struct MediumRay<'w> {
    medium: &'w Medium,
    built: &'w BuiltMedium,
    /// The ray in world space, of unit direction, and in the medium's space with the same parameter.
    ray: Ray,
    local: Ray,
    sigma_a: Lanes,
    sigma_s: Lanes,
    emission: Lanes,
    wavelengths: Wavelengths,
}

/// Builds the media that are used; the others become empty.
pub(super) fn build_media<'a>(
    scene: &Scene,
    primitives: impl Iterator<Item = &'a Primitive>,
) -> Result<Vec<BuiltMedium>, Error> {
    if !scene.settings.integrator.kind.sees_media() {
        return Ok(Vec::new());
    }
    let interfaces = primitives.filter_map(|p| p.media).flat_map(|m| [m.inside, m.outside]);
    let mut used = vec![false; scene.media.len()];
    interfaces.chain([scene.camera.medium]).flatten().for_each(|h| used[h.index()] = true);
    if !used.contains(&true) {
        return Ok(Vec::new());
    }
    scene
        .media
        .iter()
        .zip(used)
        .map(|(m, used)| {
            m.validate().map_err(|source| Error::Medium { name: m.name.clone(), source })?;
            Ok(BuiltMedium::new(m, used))
        })
        .collect()
}

/// Whether some medium is coloured and some surface disperses. Wavelengths that share the densities of a path through a
/// coloured medium must share its whole fate, so that here each path is one wavelength's from the start.
pub(super) fn needs_one_wavelength(scene: &Scene, media: &[BuiltMedium]) -> bool {
    let disperses = scene.materials.iter().any(|m| match &m.scattering {
        Scattering::Dielectric { eta, .. } | Scattering::ThinDielectric { eta } => varies(eta),
        Scattering::MetallicRoughness(m) => varies(&m.eta),
        Scattering::CoatedDiffuse { coat, .. } | Scattering::CoatedConductor { coat, .. } => varies(&coat.eta),
        _ => false,
    });
    disperses && media.iter().any(BuiltMedium::is_coloured)
}

fn varies(eta: &Ior) -> bool {
    matches!(eta, Ior::Spectrum(s) if !s.is_constant())
}

impl BuiltMedium {
    fn is_coloured(&self) -> bool {
        match &self.shape {
            BuiltShape::Rgb(_) => true,
            BuiltShape::Fields(fields) => fields.coloured,
            _ => !self.sigma_a.is_constant() || !self.sigma_s.is_constant(),
        }
    }

    fn new(medium: &Medium, used: bool) -> Self {
        let constant = |v: f32| Spectrum::constant(v, SpectrumUse::Unbounded);
        let scaled = |s: &Spectrum| s.clone().scaled(medium.scale).tabulated();
        let (sigma_a, sigma_s) = match &medium.volume {
            Volume::Homogeneous { coefficients, .. }
            | Volume::Grid { coefficients, .. }
            | Volume::Sparse { coefficients, .. } => (scaled(&coefficients.sigma_a), scaled(&coefficients.sigma_s)),
            Volume::Cloud(c) => (scaled(&c.coefficients.sigma_a), scaled(&c.coefficients.sigma_s)),
            Volume::RgbGrid(_) => (constant(medium.scale), constant(medium.scale)),
            // They stand for extinction and albedo.
            Volume::Fields(f) => (scaled(&f.sigma_t.factor()), f.albedo.factor().tabulated()),
        };
        let (emission, shape) = match &medium.volume {
            _ if !used => (None, BuiltShape::Everywhere),
            Volume::Homogeneous { emission, .. } => {
                let emission = emission.as_ref().map(|(le, scale)| le.clone().scaled(*scale).tabulated());
                (emission, BuiltShape::Everywhere)
            }
            Volume::Grid { density, bounds, glow, .. } => {
                let majorants = MajorantGrid::new(*bounds, GRID_CELLS, |b| density.max_in(b));
                (emitted(glow), BuiltShape::Density(majorants))
            }
            Volume::Sparse { density, glow, .. } => {
                // What glows may reach further than what is dense.
                let mut bounds = density.bounds();
                if let Some(Glow::Blackbody { temperature, .. }) = glow {
                    bounds = bounds.union(temperature.bounds());
                }
                let cell = |b: &Bounds3| {
                    let d = bounds.diagonal();
                    let at = |p: Point3| bounds.min + Vec3::new(p.x * d.x, p.y * d.y, p.z * d.z);
                    density.max_in(&Bounds3::new(at(b.min), at(b.max)))
                };
                (emitted(glow), BuiltShape::Density(MajorantGrid::new(bounds, SPARSE_CELLS, cell)))
            }
            Volume::Cloud(cloud) => (None, BuiltShape::Cloud(cloud.clone())),
            Volume::RgbGrid(grid) => (None, BuiltShape::Rgb(BuiltRgbGrid::new(grid))),
            Volume::Fields(fields) => (None, BuiltShape::Fields(BuiltFields::new(fields))),
        };
        Self {
            phases: medium.phase.leaves().into_iter().filter_map(built_phase).collect(),
            medium_from_world: medium.world_from_medium.inverse(),
            sigma_a,
            sigma_s,
            emission,
            shape,
        }
    }
}

/// `None` for blends, and for what [`Medium::validate`] refuses.
fn built_phase(phase: &Phase) -> Option<PhaseFunction> {
    match phase {
        Phase::HenyeyGreenstein { g } => Some(PhaseFunction::HenyeyGreenstein(HenyeyGreenstein::new(*g))),
        Phase::Rayleigh => Some(PhaseFunction::Rayleigh(Rayleigh)),
        Phase::Tabulated(values) => TabulatedPhase::new(values).map(PhaseFunction::Tabulated),
        Phase::Blend { .. } => None,
    }
}

/// The spectrum that a field of emission is a factor of; constant for black bodies, which have theirs from the field.
fn emitted<F>(glow: &Option<Glow<F>>) -> Option<Spectrum> {
    match glow.as_ref()? {
        Glow::Spectrum { radiance, scale, .. } => Some(radiance.clone().scaled(*scale).tabulated()),
        Glow::Blackbody { scale, .. } => Some(Spectrum::constant(*scale, SpectrumUse::Unbounded)),
    }
}

impl<F> Glow<F> {
    /// The factor of the emission at a point, given how to look a field up there.
    #[inline]
    fn factor(&self, look_up: impl Fn(&F) -> f32, w: &Wavelengths) -> Lanes {
        let amount = |field: &Option<F>| field.as_ref().map_or(1.0, &look_up);
        match self {
            Self::Spectrum { field, .. } => Lanes::splat(amount(field)),
            Self::Blackbody { temperature, offset, temperature_scale, field, .. } => {
                let kelvin = (look_up(temperature) - offset) * temperature_scale;
                if kelvin > 0.0 { planck::blackbody_lanes(kelvin, w) * amount(field) } else { Lanes::ZERO }
            }
        }
    }
}

impl<'w> MediumRay<'w> {
    /// The point at distance `t`.
    #[inline]
    pub fn position(&self, t: f32) -> Point3 {
        self.ray.at(t)
    }

    /// The medium at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> MediumPoint {
        let p = self.local.at(t);
        let (density, factor) = match (&self.built.shape, &self.medium.volume) {
            (BuiltShape::Rgb(grid), _) => return grid.at(p, self.sigma_a, self.sigma_s, &self.wavelengths),
            (BuiltShape::Fields(built), Volume::Fields(fields)) => {
                return built.at(fields, p, [self.sigma_a, self.sigma_s], &self.wavelengths);
            }
            (BuiltShape::Cloud(cloud), _) => (cloud.density_at(p), Lanes::ZERO),
            (BuiltShape::Density(_), Volume::Grid { density, bounds, glow, .. }) => {
                let q = bounds.offset(p);
                let factor = glow.as_ref().map(|g| g.factor(|f| f.sample(q), &self.wavelengths));
                (density.sample(q), factor.unwrap_or_default())
            }
            (BuiltShape::Density(_), Volume::Sparse { density, glow, .. }) => {
                let factor = glow.as_ref().map(|g| g.factor(|f| f.sample(p), &self.wavelengths));
                (density.sample(p), factor.unwrap_or_default())
            }
            _ => (1.0, Lanes::ONE),
        };
        MediumPoint {
            sigma_a: self.sigma_a * density,
            sigma_s: self.sigma_s * density,
            emission: self.emission * factor,
        }
    }

    /// Segments of the ray up to distance `t_max`, with bounds on the density in each.
    #[inline]
    fn majorants(&self, t_max: f32) -> Majorants<'w> {
        let clip = |b: &Bounds3| b.intersect(self.local.o, self.local.d, t_max);
        match &self.built.shape {
            BuiltShape::Everywhere => Majorants::whole(0.0, t_max),
            BuiltShape::Cloud(cloud) => clip(&cloud.bounds).map_or(Majorants::Done, |(a, b)| Majorants::whole(a, b)),
            BuiltShape::Density(grid) => grid.along(&self.local, t_max),
            BuiltShape::Rgb(grid) => grid.majorants.along(&self.local, t_max),
            BuiltShape::Fields(fields) => fields.majorants.along(&self.local, t_max),
        }
    }

    /// The factor of the bounds that [`MediumRay::majorants`] gives.
    #[inline]
    fn majorant_scale(&self) -> Lanes {
        match self.built.shape {
            // Absorption and scattering are bounded together; both have the same factor.
            BuiltShape::Rgb(_) => self.sigma_a,
            // The extinction is what is bounded.
            BuiltShape::Fields(_) => self.sigma_a,
            _ => self.sigma_a + self.sigma_s,
        }
    }
}

impl World {
    /// Whether there is any medium that the integrator sees.
    #[inline]
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// Whether paths must follow one wavelength each, because a medium is coloured and a surface disperses.
    #[inline]
    pub fn needs_one_wavelength(&self) -> bool {
        self.needs_one_wavelength
    }

    /// The medium around the camera.
    #[inline]
    pub fn camera_medium(&self) -> Option<Handle<Medium>> {
        self.scene.camera.medium.filter(|_| self.has_media())
    }

    /// The medium that a ray in direction `w` enters when it leaves a surface, having come through `current`.
    #[inline]
    pub fn medium_beyond(&self, surface: &Surface, w: Vec3, current: Option<Handle<Medium>>) -> Option<Handle<Medium>> {
        match self.groups[surface.group as usize].primitives[surface.primitive as usize].media {
            None => current,
            Some(m) if surface.n.dot(w) > 0.0 => m.outside,
            Some(m) => m.inside,
        }
    }

    /// Whether a surface only separates media, so that light goes straight through.
    #[inline]
    pub fn is_interface(&self, hit: &Hit) -> bool {
        let group = &self.groups[hit.group as usize];
        let primitive = match hit.shape {
            HitShape::Triangle { id, .. } => group.primitive_of_triangle[id as usize],
            HitShape::Patch { primitive, .. }
            | HitShape::Quadric { primitive, .. }
            | HitShape::Curve { primitive, .. }
            | HitShape::Cell { primitive, .. } => primitive,
        };
        let record = &group.primitives[primitive as usize];
        matches!(self.scene.materials[record.material].scattering, Scattering::Interface)
    }

    /// What gets through a surface that a ray has hit without being turned; `None` where that is no pane.
    pub fn straight(&self, ray: &Ray, hit: &Hit, w: &Wavelengths) -> Option<Straight> {
        let mut surface = self.surface(ray, hit);
        let scattering = |m: Handle<Material>| &self.scene.materials[m].scattering;
        match scattering(self.material(&surface)) {
            Scattering::ThinDielectric { .. } => {}
            Scattering::Altered { interface, .. }
                if matches!(scattering(*interface), Scattering::ThinDielectric { .. }) => {}
            _ => return None,
        }
        let Shading { frame, bsdf } = self.shading(&mut surface, ray, None, &mut w.clone())?;
        bsdf.straight(frame.to_local(surface.wo))
    }

    /// The phase function of a medium at a point.
    #[inline]
    pub fn phase(&self, medium: Handle<Medium>, p: Point3) -> PhaseMix<'_> {
        let mut weights = [1.0, 0.0, 0.0, 0.0];
        if let stated @ Phase::Blend { .. } = &self.scene.media[medium].phase {
            self.phase_weights(stated, p, 1.0, &mut weights.iter_mut());
        }
        PhaseMix::new(&self.media[medium.index()].phases, weights)
    }

    fn phase_weights<'a>(&self, phase: &Phase, p: Point3, share: f32, weights: &mut impl Iterator<Item = &'a mut f32>) {
        match phase {
            Phase::Blend { parts, amount } => {
                let context = TextureContext { p, ..TextureContext::default() };
                let w = self.float_texture(*amount, &context).clamp(0.0, 1.0);
                self.phase_weights(&parts[0], p, share * (1.0 - w), weights);
                self.phase_weights(&parts[1], p, share * w, weights);
            }
            _ => {
                if let Some(weight) = weights.next() {
                    *weight = share;
                }
            }
        }
    }

    /// The name of a medium.
    pub fn medium_name(&self, medium: Handle<Medium>) -> &str {
        &self.scene.media[medium].name
    }

    /// A medium along a ray from `o` in the unit direction `d`.
    ///
    /// # Panics
    /// If the world [has no media](World::has_media) that the integrator sees.
    #[inline]
    pub fn medium_ray(&self, medium: Handle<Medium>, o: Point3, d: Vec3, w: &Wavelengths) -> MediumRay<'_> {
        let built = &self.media[medium.index()];
        let ray = Ray::new(o, d, 0.0);
        let local = match built.shape {
            BuiltShape::Everywhere => ray,
            _ => built.medium_from_world.ray(&ray),
        };
        MediumRay {
            medium: &self.scene.media[medium],
            built,
            ray,
            local,
            sigma_a: built.sigma_a.eval(w),
            sigma_s: built.sigma_s.eval(w),
            emission: built.emission.as_ref().map_or(Lanes::ZERO, |e| e.eval(w)),
            wavelengths: *w,
        }
    }

    /// Bytes of all grids.
    pub(super) fn medium_bytes(&self) -> usize {
        let built = |m: &BuiltMedium| match &m.shape {
            BuiltShape::Density(grid) => grid.bytes(),
            BuiltShape::Rgb(grid) => grid.bytes(),
            BuiltShape::Fields(fields) => fields.bytes(),
            BuiltShape::Everywhere | BuiltShape::Cloud(_) => 0,
        };
        let stated = |m: &Medium| match &m.volume {
            Volume::Homogeneous { .. } | Volume::Cloud(_) => 0,
            Volume::Grid { density, .. } => size_of_val(density.values.as_slice()),
            Volume::RgbGrid(g) => {
                let all = g.sigma_a.iter().chain(&g.sigma_s).chain(g.emission.iter().map(|e| &e.0));
                all.map(|v| size_of_val(v.values.as_slice())).sum()
            }
            Volume::Fields(fields) => fields.bytes(),
            Volume::Sparse { density, .. } => density.bytes(),
        };
        self.media.iter().map(built).sum::<usize>() + self.scene.media.iter().map(stated).sum::<usize>()
    }
}
