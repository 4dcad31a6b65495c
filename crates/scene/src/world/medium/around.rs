//! Which medium surrounds a point, for paths that do not start at the camera.

use crate::world::World;
use crate::{Handle, Medium};
use steradian_math::{Point3, Ray, Vec3};

/// Surfaces beyond this many are not looked through; no sane scene nests so deep.
const MOST_SURFACES: usize = 10_000;

impl World {
    /// The medium that a ray sets out in: that on the near side of the first boundary between media on its way, or the
    /// outermost one.
    pub(crate) fn medium_around(&self, ray: &Ray) -> Option<Handle<Medium>> {
        self.first_boundary(ray).unwrap_or_else(|| self.outer_medium())
    }

    /// The medium beyond all boundaries: what a ray from the camera ends in.
    pub(crate) fn outer_medium(&self) -> Option<Handle<Medium>> {
        if !self.has_media() {
            return None;
        }
        let time = self.scene.camera.shutter[0];
        let o = self.camera.world_from_camera(time).point(Point3::default());
        let (mut ray, mut medium) = (Ray::new(o, Vec3::new(0.36, 0.8, 0.48), time), self.camera_medium());
        for _ in 0..MOST_SURFACES {
            let Some(hit) = self.intersect(&ray) else { break };
            let surface = self.surface(&ray, &hit);
            medium = self.medium_beyond(&surface, ray.d, medium);
            ray = surface.continue_ray(&ray);
        }
        medium
    }

    /// The medium on the near side of the first boundary on a ray, if there is one.
    fn first_boundary(&self, ray: &Ray) -> Option<Option<Handle<Medium>>> {
        let mut ray = *ray;
        for _ in 0..MOST_SURFACES {
            let hit = self.intersect(&ray)?;
            let surface = self.surface(&ray, &hit);
            let record = &self.groups[surface.group as usize].primitives[surface.primitive as usize];
            if record.media.is_some() {
                return Some(self.medium_beyond(&surface, -ray.d, None));
            }
            ray = surface.continue_ray(&ray);
        }
        None
    }
}
