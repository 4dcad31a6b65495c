//! A ray and a sampler in, radiance out.
//!
//! An integrator cannot fail, cannot block, has no clock, and no random numbers but the sampler's.

mod debug;
mod hero;
mod path;
pub mod record;
mod simple_volpath;
mod volpath;

pub use debug::{AmbientOcclusion, View};
pub use path::Path;
use record::Record;
pub use simple_volpath::SimpleVolPath;
use steradian_sampling::Sampler;
use steradian_scene::{CameraRay, IntegratorKind, IntegratorSettings, World};
use steradian_spectrum::{Lanes, Wavelengths};
pub use volpath::VolPath;

/// The algorithms that answer one camera ray.
#[derive(Clone, Copy, Debug)]
pub enum Integrator {
    /// Path tracing.
    Path(Path),
    /// Path tracing through media.
    VolPath(VolPath),
    /// A random walk through media.
    SimpleVolPath(SimpleVolPath),
    /// A quantity of the first hit.
    View(View),
    /// Ambient occlusion.
    AmbientOcclusion(AmbientOcclusion),
}

impl Integrator {
    /// The integrator that a world's settings describe. Without media, path tracing through media is path tracing.
    pub fn new(world: &World) -> Self {
        let &IntegratorSettings { kind, max_depth, regularize, .. } = &world.settings().integrator;
        match kind {
            IntegratorKind::VolPath if world.has_media() => Self::VolPath(VolPath { max_depth, regularize }),
            IntegratorKind::Path | IntegratorKind::VolPath => Self::Path(Path { max_depth, regularize }),
            IntegratorKind::SimpleVolPath => Self::SimpleVolPath(SimpleVolPath { max_depth }),
            IntegratorKind::Normals => Self::View(View::Normals),
            IntegratorKind::Albedo => Self::View(View::Albedo),
            IntegratorKind::Depth => Self::View(View::Depth),
            IntegratorKind::Uv => Self::View(View::Uv),
            IntegratorKind::AmbientOcclusion { cosine, max_distance } => {
                Self::AmbientOcclusion(AmbientOcclusion { cosine, max_distance })
            }
        }
    }

    /// An estimate of the radiance that arrives along a camera ray, in the four lanes of `wavelengths`.
    ///
    /// Unbiased, unless a setting says otherwise; finite unless there is a bug or the scene holds infinities.
    #[inline]
    pub fn radiance<R: Record>(
        &self,
        world: &World,
        ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        sampler: &mut Sampler,
        record: &mut R,
    ) -> Lanes {
        match self {
            Self::Path(path) => path.radiance(world, ray, wavelengths, sampler, record),
            Self::VolPath(path) => path.radiance(world, ray, wavelengths, sampler, record),
            Self::SimpleVolPath(path) => path.radiance(world, ray, wavelengths, sampler, record),
            Self::View(view) => view.radiance(world, ray, wavelengths, record),
            Self::AmbientOcclusion(ao) => ao.radiance(world, ray, wavelengths, sampler, record),
        }
    }
}
