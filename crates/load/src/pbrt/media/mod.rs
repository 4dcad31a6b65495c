//! Participating media.

pub(super) mod presets;

use super::Loader;
use super::lights::positive_photometric;
use super::names::defined_twice;
use super::params::Params;
use crate::files::read_all;
use crate::nanovdb;
use steradian_math::{Bounds3, Point3};
use steradian_scene::{Cloud, Coefficients, Glow, Medium, MediumError, Phase, RgbGrid, Volume, VoxelGrid};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Directive, did_you_mean};

/// What stands for a medium until its definition is read: nothing.
pub(super) fn placeholder(name: &str) -> Medium {
    let zero = Spectrum::constant(0.0, SpectrumUse::Unbounded);
    let coefficients = Coefficients { sigma_a: zero.clone(), sigma_s: zero };
    Medium {
        name: name.to_string(),
        phase: Phase::HenyeyGreenstein { g: 0.0 },
        scale: 1.0,
        world_from_medium: steradian_math::Transform::IDENTITY,
        volume: Volume::Homogeneous { coefficients, emission: None },
    }
}

impl Loader<'_> {
    pub(super) fn make_named_medium(&mut self, mut d: Directive) {
        let (name, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        let Some((kind, kind_span)) = Self::type_of(&mut params) else {
            self.error(format!("medium \"{name}\" has no `string type`"), span);
            return;
        };
        let handle = match self.media.defined(&name, span, &mut self.scene.media, || placeholder(&name)) {
            Ok(handle) => handle,
            Err(first) => {
                self.diagnostics.push(defined_twice("medium", &name, span, first));
                return;
            }
        };
        params.rename(format!("medium \"{name}\" ({kind})"));
        params.span = kind_span;
        if self.state.is_animated() {
            params.warning("a medium cannot move; it stays where it is at the start", None);
        }
        let p = &mut params;
        let volume = match kind.as_str() {
            "homogeneous" => Some(self.homogeneous(p)),
            "uniformgrid" => self.uniform_grid(p),
            "rgbgrid" => Self::rgb_grid(p),
            "cloud" => Some(self.cloud(p)),
            "nanovdb" => self.nanovdb(p),
            _ => {
                let known = ["homogeneous", "uniformgrid", "rgbgrid", "cloud", "nanovdb"];
                p.accept_all();
                self.unknown_type("medium", &kind, kind_span, &known);
                None
            }
        };
        let p = &mut params;
        if let Some(volume) = volume {
            // A cloud has no factor of its own in pbrt.
            let scale = if kind == "cloud" { 1.0 } else { p.float("scale", 1.0) };
            let medium = Medium {
                name,
                phase: Phase::HenyeyGreenstein { g: p.float("g", 0.0) },
                scale,
                world_from_medium: self.state.ctm[0],
                volume,
            };
            match medium.validate() {
                Ok(()) => self.scene.media[handle] = medium,
                Err(e) => report(p, &e),
            }
        }
        self.diagnostics.append(&mut params.finish());
    }

    fn coefficients(&mut self, p: &mut Params) -> Coefficients {
        let one = || Spectrum::constant(1.0, SpectrumUse::Unbounded);
        Coefficients {
            sigma_a: self.spectrum(p, "sigma_a", SpectrumUse::Unbounded).unwrap_or_else(one),
            sigma_s: self.spectrum(p, "sigma_s", SpectrumUse::Unbounded).unwrap_or_else(one),
        }
    }

    /// The spectrum of emission, with the factor that gives it luminance one.
    fn glow(&mut self, p: &mut Params) -> Option<(Spectrum, f32)> {
        let le = self.spectrum(p, "Le", SpectrumUse::Illuminant).filter(|le| !le.is_black())?;
        let factor = 1.0 / positive_photometric(p, "Le", &le)?;
        Some((le, factor))
    }

    fn homogeneous(&mut self, p: &mut Params) -> Volume {
        let mut preset = None;
        if let Some((name, span)) = p.string("preset") {
            preset = presets::find(&name);
            if preset.is_none() {
                let d = Diagnostic::warning(format!("unknown medium preset \"{name}\""), span);
                p.diagnostics.push(d.with_suggestion(did_you_mean(&name, presets::names())));
            }
        }
        let coefficients = match preset {
            Some(preset) => Coefficients {
                sigma_a: Spectrum::rgb_unbounded(ColorSpace::Srgb, preset.sigma_a),
                sigma_s: Spectrum::rgb_unbounded(ColorSpace::Srgb, preset.sigma_s),
            },
            None => self.coefficients(p),
        };
        let factor = p.float("Lescale", 1.0);
        let emission = self.glow(p).map(|(le, scale)| (le, scale * factor));
        Volume::Homogeneous { coefficients, emission }
    }

    fn uniform_grid(&mut self, p: &mut Params) -> Option<Volume> {
        let size = grid_size(p);
        let floats = |p: &mut Params, name| p.floats(name).map(|(values, _)| VoxelGrid { size, values });
        let density = floats(p, "density");
        let temperature = floats(p, "temperature");
        // pbrt fills in a grid of one cell, which like any other is one at its middle and falls off to all sides.
        let one_cell = || VoxelGrid { size: [1; 3], values: vec![1.0] };
        let field = Some(floats(p, "Lescale").unwrap_or_else(one_cell));
        let (offset, temperature_scale) = temperature_map(p);
        let le = self.glow(p);
        if le.is_some() && temperature.is_some() {
            p.error("a medium glows by `Le` or by `temperature`, not by both", p.span_of("temperature"));
        }
        let coefficients = self.coefficients(p);
        let glow = match (temperature, le) {
            (Some(temperature), _) => {
                Some(Glow::Blackbody { temperature, offset, temperature_scale, scale: 1.0, field })
            }
            (None, Some((radiance, scale))) => Some(Glow::Spectrum { radiance, scale, field }),
            (None, None) => None,
        };
        let bounds = bounds(p);
        let Some(density) = density else {
            p.error(format!("{} has no `density`", p.what()), None);
            return None;
        };
        Some(Volume::Grid { coefficients, bounds, density, glow })
    }

    fn rgb_grid(p: &mut Params) -> Option<Volume> {
        let size = grid_size(p);
        let colors = |p: &mut Params, name| p.take_rgbs(name).map(|(values, _)| VoxelGrid { size, values });
        let color_space = p.color_space();
        let (sigma_a, sigma_s) = (colors(p, "sigma_a"), colors(p, "sigma_s"));
        let scale = p.float("Lescale", 1.0);
        let emission = colors(p, "Le").map(|le| (le, scale));
        let bounds = bounds(p);
        if emission.is_some() && sigma_a.is_none() {
            p.error("`Le` needs `sigma_a`: what does not absorb does not emit", p.span_of("Le"));
        }
        if sigma_a.is_none() && sigma_s.is_none() {
            p.error(format!("{} has neither `sigma_a` nor `sigma_s`", p.what()), None);
            return None;
        }
        Some(Volume::RgbGrid(RgbGrid { bounds, color_space, sigma_a, sigma_s, emission }))
    }

    fn cloud(&mut self, p: &mut Params) -> Volume {
        Volume::Cloud(Cloud {
            coefficients: self.coefficients(p),
            bounds: bounds(p),
            density: p.float("density", 1.0),
            wispiness: p.float("wispiness", 1.0),
            frequency: p.float("frequency", 5.0),
        })
    }

    fn nanovdb(&mut self, p: &mut Params) -> Option<Volume> {
        let file = p.string("filename");
        let word = |p: &mut Params, name, default: &str| p.string(name).map_or(default.to_string(), |s| s.0);
        let names = [word(p, "gridname", "density"), word(p, "temperaturename", "temperature")];
        let (offset, temperature_scale) = temperature_map(p);
        let scale = p.float("Lescale", 1.0);
        let coefficients = self.coefficients(p);
        let Some((file, span)) = file else {
            p.error(format!("{} has no `filename`", p.what()), None);
            return None;
        };
        let path = self.resolve(&file);
        let bytes = read_all(self.files, &path).map_err(|message| p.error(message, span)).ok()?;
        let mut grid = |name: &str| match nanovdb::read_grid(&bytes, name) {
            Ok(grid) => grid,
            Err(e) => {
                p.error(format!("{}: {e}", path.display()), span);
                None
            }
        };
        let (density, temperature) = (grid(&names[0]), grid(&names[1]));
        let Some(density) = density else {
            if p.diagnostics.iter().all(|d| d.span != Some(span)) {
                p.error(format!("{} has no grid \"{}\"", path.display(), names[0]), span);
            }
            return None;
        };
        let glow = temperature.map(|temperature| Glow::Blackbody {
            temperature,
            offset,
            temperature_scale,
            scale,
            field: None,
        });
        Some(Volume::Sparse { coefficients, density, glow })
    }
}

fn grid_size(p: &mut Params) -> [u32; 3] {
    ["nx", "ny", "nz"].map(|n| p.int_in(n, 1, 1..=i32::MAX) as u32)
}

fn bounds(p: &mut Params) -> Bounds3 {
    let corner = [p.point("p0", Point3::splat(0.0)), p.point("p1", Point3::splat(1.0))];
    Bounds3::new(corner[0], corner[1])
}

/// Offset and factor of temperatures; the offset has an older name.
fn temperature_map(p: &mut Params) -> (f32, f32) {
    let old = p.float("temperaturecutoff", 0.0);
    (p.float("temperatureoffset", old), p.float("temperaturescale", 1.0))
}

/// Reports what is wrong with a medium where its parameter stands.
fn report(p: &mut Params, e: &MediumError) {
    let span = match e {
        MediumError::GridSize { grid, .. } | MediumError::GridValue { grid, .. } => p.span_of(grid),
        MediumError::Number { name, .. } => p.span_of(name),
        MediumError::Anisotropy { .. } | MediumError::PhaseTable | MediumError::ManyPhases { .. } => p.span_of("g"),
        MediumError::Bounds => p.span_of("p1"),
    };
    p.error(format!("{}: {e}", p.what()), span);
}
