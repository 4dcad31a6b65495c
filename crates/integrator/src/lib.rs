//! A ray and a sampler in, radiance out.
//!
//! An integrator cannot fail, cannot block, has no clock, and no random numbers but the sampler's.

mod debug;
mod path;
pub mod record;

pub use debug::{AmbientOcclusion, View};
pub use path::Path;
use record::Record;
use steradian_sampling::Sampler;
use steradian_scene::{CameraRay, IntegratorKind, IntegratorSettings, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// The algorithms that answer one camera ray.
#[derive(Clone, Copy, Debug)]
pub enum Integrator {
    /// Path tracing.
    Path(Path),
    /// A quantity of the first hit.
    View(View),
    /// Ambient occlusion.
    AmbientOcclusion(AmbientOcclusion),
}

impl Integrator {
    /// The integrator that the settings describe.
    pub fn new(settings: &IntegratorSettings) -> Self {
        match settings.kind {
            IntegratorKind::Path => Self::Path(Path { max_depth: settings.max_depth, regularize: settings.regularize }),
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
            Self::View(view) => view.radiance(world, ray, wavelengths, record),
            Self::AmbientOcclusion(ao) => ao.radiance(world, ray, wavelengths, sampler, record),
        }
    }
}
