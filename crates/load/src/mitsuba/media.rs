//! Media of Mitsuba scenes.

use super::Mitsuba;
use super::grids::Grid;
use super::tree::{Object, Value};
use steradian_math::{Bounds3, Transform};
use steradian_scene::{Coefficients, Handle, Medium, MediumInterface, Phase, RgbGrid, Volume, VoxelGrid};
use steradian_spectrum::{ColorSpace, Dense, Spectrum, SpectrumUse};
use steradian_syntax::Span;

/// What fills a medium's coefficient.
enum Filling {
    Even(Spectrum),
    /// Values, and where the grid's box lies.
    Grid(Grid, Transform),
}

/// Blends of phase functions inside of each other, at most.
const MOST_NESTED: usize = 8;

impl Mitsuba<'_> {
    /// The media on the two sides of a shape.
    pub(super) fn media_of(&mut self, o: &Object) -> Option<MediumInterface> {
        let (interior, exterior) = (self.named(o, "interior"), self.named(o, "exterior"));
        if interior.is_none() && exterior.is_none() {
            return None;
        }
        let inside = interior.and_then(|i| self.medium(i));
        let outside = exterior.and_then(|i| self.medium(i));
        Some(MediumInterface { inside, outside })
    }

    pub(super) fn medium(&mut self, index: usize) -> Option<Handle<Medium>> {
        if let Some(h) = self.media.get(&index) {
            return Some(*h);
        }
        let o = self.object(index);
        if !matches!(o.kind.as_str(), "homogeneous" | "heterogeneous") {
            self.not_built(&o);
            return None;
        }
        let (albedo, sigma_t) = (self.filling(&o, "albedo", 0.75)?, self.filling(&o, "sigma_t", 1.0)?);
        let scale = self.float(&o, "scale", 1.0);
        let phase = self.phase_of(&o, 0);
        for name in ["sample_emitters", "has_spectral_extinction"] {
            o.get(name);
        }
        self.finish(&o);
        let (volume, world_from_medium) = self.volume(albedo, sigma_t, o.span)?;
        let medium = Medium { name: String::new(), phase, scale, world_from_medium, volume };
        if let Err(e) = medium.validate() {
            self.error(e.to_string(), o.span);
            return None;
        }
        let handle = self.scene.media.push(medium);
        self.media.insert(index, handle);
        Some(handle)
    }

    /// A medium's phase function.
    fn phase_of(&mut self, o: &Object, depth: usize) -> Phase {
        const EVEN: Phase = Phase::HenyeyGreenstein { g: 0.0 };
        let inner = self.children(&o.children).into_iter().map(|c| c.1);
        let inner: Vec<usize> = inner.filter(|&i| self.tree().objects[i].class == "phase").collect();
        let Some(&first) = inner.first() else { return EVEN };
        if depth > 0 {
            let [a, b] = inner[..] else {
                self.error("a blend needs two phase functions inside", o.span);
                return EVEN;
            };
            let parts = Box::new([self.phase(a, depth), self.phase(b, depth)]);
            return Phase::Blend { parts, amount: self.float_input(o, "weight", 0.5) };
        }
        self.phase(first, depth)
    }

    fn phase(&mut self, index: usize, depth: usize) -> Phase {
        let phase = self.object(index);
        let built = match phase.kind.as_str() {
            "isotropic" => Phase::HenyeyGreenstein { g: 0.0 },
            "hg" => Phase::HenyeyGreenstein { g: self.float(&phase, "g", 0.8) },
            "rayleigh" => Phase::Rayleigh,
            "tabphase" => {
                let text = self.text(&phase, "values").unwrap_or_default();
                let words = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty());
                let values: Option<Vec<f32>> = words.map(|w| w.parse().ok()).collect();
                if values.is_none() {
                    self.error("`values` must be a list of numbers", phase.span);
                }
                Phase::Tabulated(values.unwrap_or_else(|| vec![1.0; 2]))
            }
            "blendphase" if depth < MOST_NESTED => self.phase_of(&phase, depth + 1),
            "blendphase" => {
                self.error("phase functions are nested too deep, or contain themselves", phase.span);
                return Phase::HenyeyGreenstein { g: 0.0 };
            }
            _ => {
                self.not_built(&phase);
                return Phase::HenyeyGreenstein { g: 0.0 };
            }
        };
        self.finish(&phase);
        built
    }

    fn filling(&mut self, o: &Object, name: &str, absent: f32) -> Option<Filling> {
        let usage = SpectrumUse::Unbounded;
        if let Some(v) = self.named(o, name).map(|i| self.object(i)) {
            let filling = match v.kind.as_str() {
                "constvolume" => {
                    let p = v.get("value").cloned();
                    let value = p.map_or(Value::Float(1.0), |p| p.value);
                    Filling::Even(self.spectrum_of(&value, usage, v.span)?)
                }
                "gridvolume" => {
                    let (grid, world) = self.grid(&v)?;
                    Filling::Grid(grid.padded(), world)
                }
                _ => {
                    self.not_built(&v);
                    return None;
                }
            };
            self.finish(&v);
            return Some(filling);
        }
        let p = o.get(name).cloned();
        let s = p.and_then(|p| self.spectrum_of(&p.value, usage, p.span));
        Some(Filling::Even(s.unwrap_or_else(|| Spectrum::constant(absent, usage))))
    }

    /// What albedo and extinction together fill space with, and where it lies.
    fn volume(&mut self, albedo: Filling, sigma_t: Filling, span: Span) -> Option<(Volume, Transform)> {
        Some(match (albedo, sigma_t) {
            (Filling::Even(a), Filling::Even(t)) => {
                let sigma_s = product(&a, &t, |a, t| a * t);
                let sigma_a = product(&a, &t, |a, t| (1.0 - a) * t);
                let coefficients = Coefficients { sigma_a, sigma_s };
                (Volume::Homogeneous { coefficients, emission: None }, Transform::IDENTITY)
            }
            (Filling::Even(a), Filling::Grid(t, world)) if t.channels == 1 => {
                let one = Spectrum::constant(1.0, SpectrumUse::Unbounded);
                let sigma_s = product(&a, &one, |a, _| a);
                let sigma_a = product(&a, &one, |a, _| 1.0 - a);
                let density = VoxelGrid { size: t.size, values: t.values };
                let coefficients = Coefficients { sigma_a, sigma_s };
                (Volume::Grid { coefficients, bounds: t.bounds, density, glow: None }, world)
            }
            (albedo, sigma_t) => {
                let (Some(size), bounds, world) = (match (&albedo, &sigma_t) {
                    (Filling::Grid(a, _), Filling::Grid(t, world)) => {
                        ((a.size == t.size).then_some(t.size), t.bounds, *world)
                    }
                    (Filling::Grid(g, world), _) | (_, Filling::Grid(g, world)) => (Some(g.size), g.bounds, *world),
                    _ => (None, Bounds3::default(), Transform::IDENTITY),
                }) else {
                    self.error("grids of albedo and extinction must be of one size", span);
                    return None;
                };
                let at = |f: &Filling, i: usize| match f {
                    Filling::Even(s) => s.rgb(),
                    Filling::Grid(g, _) => std::array::from_fn(|k| g.values[i * g.channels + k % g.channels]),
                };
                let count = size.iter().map(|&n| n as usize).product();
                let grid = |f: &dyn Fn(f32, f32) -> f32| {
                    let value = |i| {
                        let (a, t) = (at(&albedo, i), at(&sigma_t, i));
                        std::array::from_fn(|k| f(a[k], t[k]).max(0.0))
                    };
                    Some(VoxelGrid { size, values: (0..count).map(value).collect() })
                };
                let (sigma_a, sigma_s) = (grid(&|a, t| (1.0 - a) * t), grid(&|a, t| a * t));
                let rgb = RgbGrid { bounds, color_space: ColorSpace::Srgb, sigma_a, sigma_s, emission: None };
                (Volume::RgbGrid(rgb), world)
            }
        })
    }
}

/// A function of two spectra: wavelength by wavelength, and of their colours.
fn product(a: &Spectrum, b: &Spectrum, f: impl Fn(f32, f32) -> f32) -> Spectrum {
    let (x, y) = (a.rgb(), b.rgb());
    let rgb = std::array::from_fn(|i| f(x[i], y[i]).max(0.0));
    if a.is_constant() && b.is_constant() {
        return Spectrum::constant(f(a.eval_at(550.0), b.eval_at(550.0)).max(0.0), SpectrumUse::Unbounded);
    }
    let table = Dense::from_fn(|l| f(a.eval_at(l), b.eval_at(l)).max(0.0));
    Spectrum::dense(table, SpectrumUse::Unbounded).with_rgb(rgb)
}
