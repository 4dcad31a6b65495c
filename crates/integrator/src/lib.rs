//! A ray and a sampler in, radiance out.
//!
//! An integrator cannot fail, cannot block, has no clock, and no random numbers but the sampler's.

mod batch;
mod bidirectional;
mod debug;
mod distribution;
mod first_hit;
mod hero;
mod lobe_sampling;
mod mlt;
mod numbers;
mod path;
mod photon;
pub mod record;
mod simple_volpath;
mod splat;
mod subsurface;
mod switched;
mod transmitted;
mod volpath;
mod whitted;

pub use batch::Batch;
pub use bidirectional::{Bdpt, LightPath, Paths};
pub use debug::{AmbientOcclusion, View};
pub use distribution::Distribution;
pub use first_hit::{FirstHit, first_hit};
pub use mlt::{Chain, Coordinate, Mlt, PathLight, Place};
pub use numbers::{Domain, Numbers, StratifiedNumbers};
pub use path::Path;
pub use photon::{Photon, PhotonMap, Sppm};
use record::Record;
pub use simple_volpath::SimpleVolPath;
pub use splat::Splat;
use std::sync::Arc;
use steradian_math::Point2;
use steradian_scene::{CameraRay, CameraSample, IntegratorKind, Stratify, Techniques, TestFunction, World};
use steradian_spectrum::{Lanes, Wavelengths};
pub use switched::SwitchedPath;
pub use volpath::VolPath;
pub use whitted::Whitted;

/// What samples are made in: memory used over and over, and the light that has landed on other pixels.
#[derive(Clone, Debug, Default)]
pub struct Scratch<'w> {
    /// Vertices.
    paths: Paths<'w>,
    /// What has landed since whoever looks at it cleared it.
    pub splats: Vec<Splat>,
    /// The number of the sample in its pixel.
    pub sample: u32,
    /// Photons. Whoever has those of the sample lends them; if nobody does, they are sent out when they are needed.
    pub photons: Option<Arc<PhotonMap>>,
}

impl<'w> Scratch<'w> {
    /// The memory for vertices.
    pub fn paths(&mut self) -> &mut Paths<'w> {
        &mut self.paths
    }
}

/// Lens and time of a sample of the film, the time unless it is given.
#[inline]
pub(crate) fn camera_sample<N: Numbers>(
    world: &World,
    film: Point2,
    time: Option<f32>,
    numbers: &mut N,
) -> CameraSample {
    let lens = if world.camera().has_lens() { numbers.two(Domain::Lens) } else { [0.5, 0.5] };
    let moment = |numbers: &mut N| if world.has_motion() { numbers.one(Domain::Time) } else { 0.5 };
    CameraSample { film, lens, time: time.unwrap_or_else(|| moment(numbers)) }
}

/// The algorithms.
#[derive(Clone, Copy, Debug)]
pub enum Integrator {
    /// Path tracing.
    Path(Path),
    /// Path tracing through media.
    VolPath(VolPath),
    /// A random walk through media.
    SimpleVolPath(SimpleVolPath),
    /// Light tracing.
    LightPath(LightPath),
    /// Bidirectional path tracing.
    Bdpt(Bdpt),
    /// Stochastic progressive photon mapping.
    Sppm(Sppm),
    /// Metropolis light transport.
    Mlt(Mlt),
    /// Path tracing by choice of technique.
    SwitchedPath(SwitchedPath),
    /// Whitted's ray tracing.
    Whitted(Whitted),
    /// Brute-force distribution ray tracing.
    Distribution(Distribution),
    /// A function of the first two random numbers.
    Function(TestFunction),
    /// A quantity of the first hit.
    View(View),
    /// Ambient occlusion.
    AmbientOcclusion(AmbientOcclusion),
}

impl Integrator {
    /// The integrator that the world's settings describe. Building the world has checked them.
    pub fn new(world: &World) -> Self {
        let settings = &world.settings().integrator;
        let (max_depth, regularize, hide_lights) = (settings.max_depth, settings.regularize, settings.hide_lights);
        match settings.kind {
            IntegratorKind::VolPath if world.has_media() || settings.through_panes => {
                Self::VolPath(VolPath { max_depth, regularize, hide_lights, through_panes: settings.through_panes })
            }
            IntegratorKind::SimpleVolPath => Self::SimpleVolPath(SimpleVolPath { max_depth }),
            // Without media, path tracing through media is path tracing.
            IntegratorKind::Path | IntegratorKind::VolPath => {
                let techniques = settings.techniques;
                // Stratification is a matter of the numbers, and those both know by domain.
                if (Techniques { stratify: Stratify::default(), ..techniques }) == Techniques::default() {
                    Self::Path(Path { max_depth, regularize, hide_lights })
                } else {
                    Self::SwitchedPath(SwitchedPath { max_depth, regularize, techniques })
                }
            }
            IntegratorKind::Whitted(w) => Self::Whitted(Whitted { max_depth, ambient: w.ambient }),
            IntegratorKind::Distribution(parameters) => {
                let unsampled_lights = world.has_unsampled_lights();
                Self::Distribution(Distribution { max_depth, parameters, unsampled_lights })
            }
            IntegratorKind::LightPath => Self::LightPath(LightPath { max_depth }),
            IntegratorKind::Mlt(parameters) => Self::Mlt(Mlt { max_depth, regularize, parameters }),
            IntegratorKind::Sppm(photons) => Self::Sppm(Sppm::new(world, max_depth, &photons)),
            IntegratorKind::Bdpt(show) => Self::Bdpt(Bdpt { max_depth, regularize, show }),
            IntegratorKind::Function(f) => Self::Function(f),
            IntegratorKind::Normals => Self::View(View::Normals),
            IntegratorKind::Albedo => Self::View(View::Albedo),
            IntegratorKind::Depth => Self::View(View::Depth),
            IntegratorKind::Uv => Self::View(View::Uv),
            IntegratorKind::AmbientOcclusion { cosine, max_distance } => {
                Self::AmbientOcclusion(AmbientOcclusion { cosine, max_distance })
            }
        }
    }

    /// Whether contributions of light are told one by one, so that they can be sorted.
    pub fn tells_light(&self) -> bool {
        matches!(self, Self::Path(_) | Self::VolPath(_) | Self::SimpleVolPath(_) | Self::SwitchedPath(_))
    }

    /// Where in its pixel sample `index` lies, given a random point of it.
    #[inline]
    pub fn pixel_position(&self, index: u32, u: [f32; 2]) -> [f32; 2] {
        match self {
            Self::Distribution(d) => d.subpixel(index, u),
            _ => u,
        }
    }

    /// An estimate of the mean radiance over lens and shutter at a film position, weighted as the lens does, in the four lanes of `wavelengths`.
    ///
    /// One camera ray, or as many as the algorithm wants.
    /// Light that lands on other places of the film is added to the splats of `scratch`.
    #[inline]
    pub fn film_radiance<'w, N: Numbers, R: Record>(
        &self,
        world: &'w World,
        film: Point2,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
        scratch: &mut Scratch<'w>,
    ) -> Lanes {
        if let Self::Distribution(d) = self {
            return d.film_radiance(world, film, wavelengths, numbers, record);
        }
        let time = if let Self::Sppm(sppm) = self { Some(sppm.time(scratch.sample)) } else { None };
        let sample = camera_sample(world, film, time, numbers);
        if let Self::Sppm(sppm) = self {
            let index = scratch.sample;
            let map = match &scratch.photons {
                Some(map) if map.iteration() == index => map.clone(),
                _ => scratch.photons.insert(Arc::new(sppm.map(world, index, record))).clone(),
            };
            let ray = world.camera_ray(&sample);
            return sppm.radiance(world, &ray, wavelengths, &map, numbers, record) * ray.weight;
        }
        let Scratch { paths, splats, .. } = scratch;
        match self {
            Self::Bdpt(bdpt) => return bdpt.sample(world, &sample, wavelengths, numbers, record, (paths, splats)),
            Self::LightPath(light) => {
                return light.sample(world, &sample, wavelengths, numbers, record, (paths, splats));
            }
            _ => {}
        }
        let ray = world.camera_ray(&sample);
        if ray.weight == 0.0 {
            return Lanes::ZERO;
        }
        if R::LIGHT && ray.weight != 1.0 {
            record.weight(ray.weight);
        }
        self.radiance(world, &ray, wavelengths, numbers, record) * ray.weight
    }

    /// The wavelengths of a sample, where they are not its own.
    #[inline]
    pub fn wavelengths(&self, world: &World, sample: u32) -> Option<Wavelengths> {
        if let Self::Sppm(sppm) = self { Some(sppm.wavelengths(world, sample)) } else { None }
    }

    /// Whether samples bring light to other pixels than their own.
    pub fn splats(&self) -> bool {
        matches!(self, Self::Bdpt(_) | Self::LightPath(_) | Self::Mlt(_))
    }

    /// An estimate of the radiance that arrives along a camera ray, in the four lanes of `wavelengths`.
    ///
    /// Unbiased, unless a setting or the algorithm says otherwise; finite unless there is a bug or the scene holds
    /// infinities. Of algorithms that need more than a ray there is none.
    #[inline]
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        match self {
            Self::Path(path) => path.radiance(world, ray, wavelengths, numbers, record),
            Self::SwitchedPath(path) => path.radiance(world, ray, wavelengths, numbers, record),
            Self::VolPath(path) => path.radiance(world, ray, wavelengths, numbers, record),
            Self::SimpleVolPath(path) => path.radiance(world, ray, wavelengths, numbers, record),
            Self::Whitted(whitted) => whitted.radiance(world, ray, wavelengths, record),
            Self::Distribution(d) => d.radiance(world, ray, wavelengths, numbers, record),
            Self::View(view) => view.radiance(world, ray, wavelengths, record),
            Self::AmbientOcclusion(ao) => ao.radiance(world, ray, wavelengths, numbers, record),
            Self::Bdpt(_) | Self::LightPath(_) | Self::Sppm(_) | Self::Mlt(_) | Self::Function(_) => Lanes::ZERO,
        }
    }
}
