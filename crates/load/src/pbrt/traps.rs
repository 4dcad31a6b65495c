//! What is allowed and often not what was meant. Told once for each kind, and only to who asks for it ([`crate::LoadOptions::traps`]).

use super::Loader;
use super::params::{Params, SPECTRUM};
use steradian_geometry::BilinearMesh;
use steradian_scene::Shape;
use steradian_syntax::{Diagnostic, ParamType, Span};

impl Loader<'_> {
    fn trap(&mut self, message: &str, hint: &str, span: Span) {
        if self.options.traps && self.said.insert(message.to_owned()) {
            self.diagnostics.push(Diagnostic::note(message, span).with_hint(hint));
        }
    }

    /// The order in which `mix` materials count.
    pub(super) fn trap_of_mix(&mut self, p: &mut Params) {
        if p.is_given("amount") {
            let message = "`amount` is the share of the second of the `materials`";
            self.trap(message, "pbrt-v3 gave it to the first", p.span_of("amount"));
        }
    }

    /// Displacement that displaces nothing.
    pub(super) fn trap_of_bumps(&mut self, p: &Params) {
        let message = "`displacement` of a material tilts its normals and moves nothing";
        self.trap(message, "that of a `plymesh` moves it", p.span_of("displacement"));
    }

    /// Wavelengths that go separate ways.
    pub(super) fn trap_of_dispersion(&mut self, p: &Params, name: &str) {
        let message =
            "an index of refraction that varies leaves a path one of its four wavelengths, and more noise of colour";
        self.trap(message, "a number instead of a spectrum keeps all four", p.span_of(name));
    }

    /// Spectra of lights count for their colour only.
    pub(super) fn trap_of_light_spectra(&mut self, p: &mut Params, name: &'static str) {
        let Some((param, _)) = p.raw(name, SPECTRUM) else { return };
        if param.ty != ParamType::Rgb {
            let message = "lights are scaled to luminance one: a spectrum or temperature gives the colour alone";
            self.trap(message, "`scale`, `power` or `illuminance` say how bright", param.values_span);
        }
    }

    /// What a depth counts, and what it is unless it is given.
    pub(super) fn trap_of_depth(&mut self, p: &Params, depth: u32) {
        if !p.is_given("maxdepth") {
            let hint = "rooms and glass may need `\"integer maxdepth\"` 10 or more";
            self.trap("light is scattered 5 times at most, since no `maxdepth` is given", hint, p.span);
        } else if depth == 1 {
            let hint = "other renderers count the lamp or the camera's ray, too: 2 there is 1 here";
            self.trap("`maxdepth` 1 is light that is scattered once", hint, p.span_of("maxdepth"));
        }
    }

    /// Numbers of samples at which digital nets are incomplete.
    pub(super) fn trap_of_samples(&mut self, p: &Params, sampler: &str, spp: u32) {
        if matches!(sampler, "zsobol" | "sobol" | "paddedsobol" | "pmj02bn") && !spp.is_power_of_two() {
            let message = format!("{spp} samples are no power of two, at which \"{sampler}\" is at its best");
            let (below, above) = (1 << spp.max(1).ilog2(), spp.checked_next_power_of_two().unwrap_or(1 << 31));
            self.trap(&message, &format!("{below} or {above} may be less noisy"), p.span_of("pixelsamples"));
        }
    }

    /// Powers of lamps that are many shapes, and patches whose corners are in the order of a loop.
    pub(super) fn traps_of_shapes(&mut self, shapes: &[Shape], has_power: bool, span: Span) {
        for shape in shapes {
            let faces = match shape {
                Shape::Triangles(h) => self.scene.triangle_meshes[*h].indices.len(),
                Shape::Bilinear(h) => {
                    if crosses_itself(&self.scene.bilinear_meshes[*h]) {
                        let hint = "the corners are at uv 00, 10, 01, 11, row by row and not around";
                        self.trap("a bilinear patch crosses itself", hint, span);
                    }
                    self.scene.bilinear_meshes[*h].indices.len()
                }
                _ => 1,
            };
            if has_power && faces > 1 {
                let message = "each face of this mesh emits the `power` of its area light";
                self.trap(message, &format!("all {faces} together emit {faces} times as much"), span);
            }
        }
    }
}

/// Whether normals at opposite corners of a patch face opposite sides.
fn crosses_itself(mesh: &BilinearMesh) -> bool {
    mesh.indices.iter().any(|corners| {
        let [p00, p10, p01, p11] = corners.map(|i| mesh.positions[i as usize]);
        let n = (p10 - p00).cross(p01 - p00);
        [(p10 - p00).cross(p11 - p10), (p11 - p01).cross(p01 - p00)].iter().any(|m| m.dot(n) < 0.0)
            && (p11 - p01).cross(p11 - p10).dot(n) < 0.0
    })
}
