//! What a camera ray sees first, apart from light: the features that denoisers and compositors ask for.

use steradian_math::{Normal3, Point3, Vec2};
use steradian_scene::{CameraRay, Handle, Material, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// The first visible surface on a camera ray.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// Where, in world space.
    pub p: Point3,
    /// Distance along the view axis.
    pub depth: f32,
    /// Normal of the surface in world space, towards the camera.
    pub geometric: Normal3,
    /// The normal that shading uses: interpolated, bumped.
    pub shading: Normal3,
    /// Surface coordinates.
    pub uv: Vec2,
    /// How far it moves over the picture while the shutter is open, in pixels; y down.
    pub motion: Vec2,
    /// The share of light that the surface reflects or lets through, towards the camera.
    pub albedo: Lanes,
    /// Which material; a mix's own, not that of the member which was picked.
    pub material: Handle<Material>,
    /// Which object: instance, where there is one, and primitive.
    pub object: (Option<u32>, u32),
}

/// So many surfaces without a material are passed through.
const MOST_INTERFACES: usize = 64;

/// What a camera ray sees first; `None` where there is nothing. Surfaces that do not scatter are passed through.
pub fn first_hit(world: &World, camera_ray: &CameraRay, wavelengths: &mut Wavelengths) -> Option<FirstHit> {
    let mut ray = camera_ray.ray;
    for _ in 0..MOST_INTERFACES {
        let hit = world.intersect(&ray)?;
        let mut surface = world.surface(&ray, &hit);
        let Some(shading) = world.shading(&mut surface, &ray, camera_ray.differential.as_ref(), wavelengths) else {
            if surface.is_emitter() {
                let n = surface.n.face_forward(-ray.d);
                return Some(found(world, camera_ray, &surface, n, Lanes::ZERO));
            }
            ray = surface.continue_ray(&ray);
            continue;
        };
        let albedo = shading.bsdf.albedo(shading.frame.to_local(-ray.d));
        return Some(found(world, camera_ray, &surface, shading.frame.normal(), albedo));
    }
    None
}

fn found(
    world: &World,
    ray: &CameraRay,
    surface: &steradian_scene::Surface,
    shading: Normal3,
    albedo: Lanes,
) -> FirstHit {
    let geometric = surface.n.face_forward(-ray.ray.d);
    FirstHit {
        p: surface.p,
        depth: (surface.p - ray.ray.o).dot(world.camera().view_direction()),
        geometric,
        shading: if shading.dot(-ray.ray.d) < 0.0 { -shading } else { shading },
        uv: Vec2::new(surface.uv.x, surface.uv.y),
        motion: world.raster_motion(surface),
        albedo,
        material: world.material(surface),
        object: (surface.instance, surface.primitive),
    }
}
