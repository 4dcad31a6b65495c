//! The end of a scene: names are resolved, materials built, and what cannot emit stops emitting.

use super::Loader;
use steradian_scene::{Primitive, Scattering};

impl Loader<'_> {
    pub(super) fn finish_world(&mut self) {
        self.diagnostics.append(&mut self.undefined_textures());
        self.build_materials();
        self.diagnostics.append(&mut self.materials.undefined("material"));
        self.diagnostics.append(&mut self.media.undefined("medium"));
        self.diagnostics.append(&mut self.objects.undefined("object"));
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
}
