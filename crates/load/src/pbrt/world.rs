//! The end of a scene: names are resolved, materials built, and what cannot emit stops emitting.

use super::Loader;
use steradian_scene::{IntegratorKind, Primitive, Scattering};
use steradian_syntax::Diagnostic;

impl Loader<'_> {
    pub(super) fn finish_world(&mut self) {
        self.diagnostics.append(&mut self.undefined_textures());
        self.build_materials();
        self.diagnostics.append(&mut self.materials.undefined("material"));
        self.diagnostics.append(&mut self.media.undefined("medium"));
        self.diagnostics.append(&mut self.objects.undefined("object"));
        self.warn_of_unseen_media();
        for (object, index, span) in std::mem::take(&mut self.emitters) {
            let primitive: &mut Primitive = match object {
                Some(handle) => &mut self.scene.objects[handle].primitives[index],
                None => &mut self.scene.primitives[index],
            };
            if matches!(self.scene.materials[primitive.material].scattering, Scattering::Interface) {
                primitive.area_light = None;
                self.warning("a shape with an `interface` material cannot emit; its area light is ignored", span);
            }
        }
    }

    /// Media that nobody looks at are a mistake that makes no noise.
    fn warn_of_unseen_media(&mut self) {
        let kind = self.scene.settings.integrator.kind;
        let views = matches!(
            kind,
            IntegratorKind::AmbientOcclusion { .. } | IntegratorKind::Normals | IntegratorKind::Function(_)
        );
        if let Some(span) = self.media_span.filter(|_| !kind.sees_media() && !views) {
            let message = "this integrator takes media for empty space";
            let d = Diagnostic::warning(message, span);
            self.diagnostics.push(d.with_hint("`volpath` sees them, and so do `bdpt` and `mlt`"));
        }
    }
}
