//! Participating media.

pub(super) mod presets;

use super::Loader;
use super::directives::placeholder_medium;
use super::names::defined_twice;
use steradian_scene::Medium;
use steradian_spectrum::{Spectrum, SpectrumUse};
use steradian_syntax::{Diagnostic, Directive};

impl Loader<'_> {
    pub(super) fn make_named_medium(&mut self, mut d: Directive) {
        let (name, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        let Some((kind, kind_span)) = Self::type_of(&mut params) else {
            self.error(format!("medium \"{name}\" has no `string type`"), span);
            return;
        };
        let placeholder = || placeholder_medium(&name);
        let handle = match self.media.defined(&name, span, &mut self.scene.media, placeholder) {
            Ok(handle) => handle,
            Err(first) => {
                self.diagnostics.push(defined_twice("medium", &name, span, first));
                return;
            }
        };
        params.rename(format!("medium \"{name}\" ({kind})"));
        params.span = kind_span;
        let p = &mut params;
        match kind.as_str() {
            "homogeneous" => {
                let one = || Spectrum::constant(1.0, SpectrumUse::Unbounded);
                let mut medium = placeholder_medium(&name);
                if let Some((preset, span)) = p.string("preset") {
                    p.warning(format!("the medium preset \"{preset}\" is not supported yet and is ignored"), span);
                }
                medium.sigma_a = self.spectrum(p, "sigma_a", SpectrumUse::Unbounded).unwrap_or_else(one);
                medium.sigma_s = self.spectrum(p, "sigma_s", SpectrumUse::Unbounded).unwrap_or_else(one);
                medium.scale = p.float("scale", 1.0);
                medium.g = p.float("g", 0.0);
                if !(medium.g > -1.0 && medium.g < 1.0) {
                    let (g, span) = (medium.g, p.span_of("g"));
                    p.error(format!("`g` of {} must be between -1 and 1, not {g}", p.what()), span);
                }
                let factor = p.float("Lescale", 1.0);
                medium.emission = self
                    .spectrum(p, "Le", SpectrumUse::Illuminant)
                    .filter(|le| !le.is_black() && factor != 0.0)
                    .map(|le| (factor / le.photometric(), le))
                    .map(|(scale, le)| (le, scale));
                self.scene.media[handle] = Medium { ..medium };
            }
            "uniformgrid" | "rgbgrid" | "cloud" | "nanovdb" => p.accept_all(),
            _ => {
                let known = ["homogeneous", "uniformgrid", "rgbgrid", "cloud", "nanovdb"];
                p.accept_all();
                self.unknown_type("medium", &kind, kind_span, &known);
            }
        }
        let message = format!("media are not supported yet: \"{name}\" is left out, as if it were a vacuum");
        self.diagnostics.push(Diagnostic::warning(message, span));
        self.diagnostics.append(&mut params.finish());
    }
}
