//! Looking at a built world again: through another camera, with other settings.

use super::{CameraModel, World};
use crate::{Camera, Error, RenderSettings};

impl World {
    /// Takes another camera and other settings, and keeps everything that was built: trees, tables, pictures. `Ok(false)`, and nothing is
    /// changed, if something that was built depends on what is new; then the world must be built anew.
    ///
    /// # Errors
    /// If the settings do not suit the scene; nothing is changed then either.
    pub fn look_again(&mut self, camera: Camera, settings: RenderSettings) -> Result<bool, Error> {
        let old = &self.scene.settings.integrator;
        let new = &settings.integrator;
        if old.kind.sees_media() != new.kind.sees_media() || old.light_selection != new.light_selection {
            return Ok(false);
        }
        new.check(&self.light_census())?;
        let newly_emits = new.kind.starts_at_lights() && !old.kind.starts_at_lights();
        self.camera = CameraModel::new(&camera, settings.film.resolution, !settings.disable_pixel_jitter);
        self.has_motion = self.camera.is_animated() || self.instances.iter().any(|i| i.world_from_object.is_animated());
        self.scene.camera = camera;
        self.scene.settings = settings;
        if newly_emits {
            self.prepare_emission();
        }
        Ok(true)
    }
}
