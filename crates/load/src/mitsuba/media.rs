//! Media of Mitsuba scenes.

use super::Mitsuba;
use super::tree::{Object, Value};
use steradian_math::{Bounds3, Point3, Transform};
use steradian_scene::{Coefficients, Field, Fields, Handle, Medium, MediumInterface, Phase, Texture, Volume};
use steradian_spectrum::{Dense, Spectrum, SpectrumUse};

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
        let ((albedo, _), (sigma_t, bounds)) = (self.field(&o, "albedo", 0.75)?, self.field(&o, "sigma_t", 1.0)?);
        let scale = self.float(&o, "scale", 1.0);
        let phase = self.phase_of(&o, 0);
        for name in ["sample_emitters", "has_spectral_extinction"] {
            o.get(name);
        }
        self.finish(&o);
        let volume = match (albedo, sigma_t) {
            // Only what is heterogeneous ends where its volume does.
            (Field::Even(a), Field::Even(t)) if o.kind == "homogeneous" => {
                let sigma_s = product(&a, &t, |a, t| a * t);
                let sigma_a = product(&a, &t, |a, t| (1.0 - a) * t);
                Volume::Homogeneous { coefficients: Coefficients { sigma_a, sigma_s }, emission: None }
            }
            _ if o.kind == "homogeneous" => {
                self.error("a homogeneous medium cannot vary", o.span);
                return None;
            }
            (albedo, sigma_t) => Volume::Fields(Fields { bounds, sigma_t, albedo }),
        };
        let world_from_medium = Transform::IDENTITY;
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

    /// What fills space with a coefficient, and where it ends.
    fn field(&mut self, o: &Object, name: &str, absent: f32) -> Option<(Field, Bounds3)> {
        let usage = SpectrumUse::Unbounded;
        if let Some(v) = self.named(o, name).map(|i| self.object(i)) {
            let (field, place) = match v.kind.as_str() {
                "constvolume" => (Field::Even(self.even(&v, usage)?), self.transform(&v, "to_world")),
                "gridvolume" => {
                    let (grid, place) = self.grid(&v)?;
                    (Field::Grid(grid), place)
                }
                _ => {
                    self.not_built(&v);
                    return None;
                }
            };
            self.finish(&v);
            return Some((field, place.bounds(&UNIT)));
        }
        let p = o.get(name).cloned();
        let s = p.and_then(|p| self.spectrum_of(&p.value, usage, p.span));
        Some((Field::Even(s.unwrap_or_else(|| Spectrum::constant(absent, usage))), UNIT))
    }

    /// The value of a volume that does not vary: a spectrum, or a texture that is one.
    fn even(&mut self, v: &Object, usage: SpectrumUse) -> Option<Spectrum> {
        if let Some(child) = self.named(v, "value") {
            let t = self.object(child);
            let texture = self.texture(&t, usage)?;
            return match &self.scene.spectrum_textures[texture].kind {
                Texture::Constant(s) => Some(s.clone()),
                _ => {
                    self.error("`value` of a `constvolume` cannot vary", t.span);
                    None
                }
            };
        }
        let value = v.get("value").cloned();
        self.spectrum_of(&value.map_or(Value::Float(1.0), |p| p.value), usage, v.span)
    }
}

/// The box that volumes fill before they are put in their places.
const UNIT: Bounds3 = Bounds3 { min: Point3::new(0.0, 0.0, 0.0), max: Point3::new(1.0, 1.0, 1.0) };

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
