//! Views that show what a ray sees instead of light: normals, albedo, depth, coordinates, openness.

use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use steradian_math::{Frame, INV_2PI, INV_PI, Vec3};
use steradian_sampling::warp::{square_to_cosine_hemisphere, square_to_uniform_hemisphere};
use steradian_scene::{CameraRay, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// A quantity shown as a colour. Quantities are colours in RGB mode only; renderers set that mode for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// `(n + 1) / 2` of the shading normal in world space.
    Normals,
    /// Directional albedo of the first surface.
    Albedo,
    /// Distance from the camera.
    Depth,
    /// Surface coordinates: u, v, 0.
    Uv,
}

impl View {
    /// The quantity at the first hit; black where there is none.
    pub fn radiance<R: Record>(
        self,
        world: &World,
        camera_ray: &CameraRay,
        w: &mut Wavelengths,
        record: &mut R,
    ) -> Lanes {
        record.ray(RayKind::Camera);
        let ray = &camera_ray.ray;
        let Some(hit) = record::intersect(world, ray, record) else { return Lanes::ZERO };
        let mut surface = world.surface(ray, &hit);
        let shading = world.shading(&mut surface, ray, camera_ray.differential.as_ref(), w);
        let rgb = |r: f32, g: f32, b: f32| Lanes([r, g, b, 0.0]);
        match self {
            View::Normals => {
                let n = shading.as_ref().map_or(surface.n.to_vec(), |s| s.frame.z);
                rgb(n.x * 0.5 + 0.5, n.y * 0.5 + 0.5, n.z * 0.5 + 0.5)
            }
            View::Albedo => shading.map_or(Lanes::ZERO, |s| s.bsdf.albedo(s.frame.to_local(-ray.d))),
            View::Depth => Lanes::splat(hit.t * ray.d.length()),
            View::Uv => rgb(surface.uv.x, surface.uv.y, 0.0),
        }
    }
}

/// Ambient occlusion: the fraction of the hemisphere over the visible side that is open up to a distance.
#[derive(Clone, Copy, Debug)]
pub struct AmbientOcclusion {
    /// Cosine-weighted directions rather than uniform ones.
    pub cosine: bool,
    /// How far an occluder counts.
    pub max_distance: f32,
}

impl AmbientOcclusion {
    /// `1 / pi` times the cosine-weighted visibility, times the light that fills the scene.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        w: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        record.ray(RayKind::Camera);
        let ray = &camera_ray.ray;
        let Some(hit) = record::intersect(world, ray, record) else { return Lanes::ZERO };
        let surface = world.surface(ray, &hit);
        let n = surface.n.face_forward(-ray.d);
        let u = numbers.two(Domain::Lobe);
        let (wi, pdf): (Vec3, f32) = if self.cosine {
            let wi = square_to_cosine_hemisphere(u);
            (wi, wi.z * INV_PI)
        } else {
            (square_to_uniform_hemisphere(u), INV_2PI)
        };
        if pdf == 0.0 {
            return Lanes::ZERO;
        }
        let mut shadow = surface.spawn_ray(Frame::from_z(n).from_local(wi));
        shadow.t_max = self.max_distance;
        record.ray(RayKind::Shadow);
        if record::occluded(world, &shadow, record) {
            Lanes::ZERO
        } else {
            world.white(w) * (wi.z / (pdf * std::f32::consts::PI))
        }
    }
}
