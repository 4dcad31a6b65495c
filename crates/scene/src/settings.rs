//! What the user said about how to render: film, filter, sampler, integrator.

use crate::technique::{
    Bidirectional, Distribution, LightCensus, Metropolis, PhotonMapping, SettingsError, Techniques, Whitted,
};
use crate::test_function::TestFunction;
use steradian_image::Filter;
use steradian_math::{Point2, Vec2};
use steradian_sampling::SamplerSettings;
use steradian_spectrum::{ColorMode, ColorSpace, PixelSensor, Wavelengths};

/// What a film keeps besides red, green and blue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FilmKind {
    /// Nothing.
    #[default]
    Rgb,
    /// What is seen: places, normals, slopes, albedo, and how unequal samples are.
    GBuffer {
        /// Whether places and directions are those of the world, not of the camera.
        in_world: bool,
    },
    /// Radiance by wavelength.
    Spectral(Bands),
}

/// Equally wide bands of wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bands {
    /// How many.
    pub count: u32,
    /// The first and the last wavelength, in nanometres.
    pub range: [f32; 2],
}

/// So many bands a film may have.
pub const MOST_BANDS: u32 = 256;

impl Bands {
    /// The band that a wavelength falls into.
    pub fn of(&self, lambda: f32) -> u32 {
        let [low, high] = self.range;
        ((self.count as f32 * (lambda - low) / (high - low)) as u32).min(self.count - 1)
    }

    /// The wavelength in the middle of a band.
    pub fn centre(&self, band: u32) -> f32 {
        let [low, high] = self.range;
        low + (band as f32 + 0.5) / self.count as f32 * (high - low)
    }
}

/// The film: resolution, crop, sensor and the colour space of the result.
#[derive(Clone, Debug)]
pub struct FilmSettings {
    /// Name of the output file that the scene asks for.
    pub filename: String,
    /// Full resolution, width and height.
    pub resolution: [u32; 2],
    /// The pixels to render: x0, x1, y0, y1, the ends excluded.
    pub pixel_bounds: [u32; 4],
    /// From radiance to colour.
    pub sensor: PixelSensor,
    /// Primaries of the result.
    pub color_space: ColorSpace,
    /// Each sample's largest component is scaled down to this; biased where finite.
    pub max_component_value: f32,
    /// Whether the file is to hold half floats.
    pub half: bool,
    /// What else it keeps.
    pub kind: FilmKind,
    /// Diagonal of the film in millimetres; only lens systems care.
    pub diagonal: f32,
}

impl FilmSettings {
    /// A film of the given size with defaults for the rest.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            filename: "steradian.exr".into(),
            resolution: [width, height],
            pixel_bounds: [0, width, 0, height],
            sensor: PixelSensor::default(),
            color_space: ColorSpace::Srgb,
            max_component_value: f32::INFINITY,
            half: false,
            kind: FilmKind::Rgb,
            diagonal: 35.0,
        }
    }

    /// The pixels of a crop window in fractions of the image, x0 x1 y0 y1, rounded up at every edge as pbrt does.
    pub fn crop_window(&self, window: [f32; 4]) -> [u32; 4] {
        let edge = |f: f32, n: u32| ((f.clamp(0.0, 1.0) * n as f32).ceil() as u32).min(n);
        let [w, h] = self.resolution;
        [edge(window[0], w), edge(window[1], w), edge(window[2], h), edge(window[3], h)]
    }

    /// Width and height of the rendered part.
    pub fn size(&self) -> [u32; 2] {
        let [x0, x1, y0, y1] = self.pixel_bounds;
        [x1 - x0, y1 - y0]
    }
}

/// How one light is picked among many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightSelection {
    /// All alike.
    Uniform,
    /// In proportion to emitted power.
    Power,
    /// A tree over bounds of the emission (Conty Estevez and Kulla 2018).
    #[default]
    Tree,
    /// By the same bounds, those of each light looked at.
    Exhaustive,
}

/// The algorithms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation and multiple importance sampling.
    #[default]
    Path,
    /// Path tracing through participating media, with spectral multiple importance sampling.
    VolPath,
    /// A random walk through participating media that simulates what one photon at a time does.
    SimpleVolPath,
    /// Light tracing: paths that start at lights, with every vertex connected to the camera.
    LightPath,
    /// Bidirectional path tracing.
    Bdpt(Bidirectional),
    /// Metropolis light transport. What are samples elsewhere are mutations.
    Mlt(Metropolis),
    /// Stochastic progressive photon mapping.
    Sppm(PhotonMapping),
    /// Whitted's ray tracing: mirrors, refraction, and point lights.
    Whitted(Whitted),
    /// Brute-force distribution ray tracing.
    Distribution(Distribution),
    /// A function of the first two random numbers of each sample, instead of light: to measure samplers by.
    Function(TestFunction),
    /// Shading normals as colours.
    Normals,
    /// Directional albedo of the first hit.
    Albedo,
    /// Distance along the view axis.
    Depth,
    /// Surface coordinates as colours.
    Uv,
    /// Ambient occlusion.
    AmbientOcclusion {
        /// Cosine-weighted instead of uniform directions.
        cosine: bool,
        /// How far an occluder counts.
        max_distance: f32,
    },
}

impl IntegratorKind {
    /// Whether samples bring light to other pixels than their own.
    pub fn splats(self) -> bool {
        matches!(self, Self::LightPath | Self::Bdpt(_) | Self::Mlt(_))
    }

    /// Whether the algorithm sees participating media; to the others they are empty space.
    pub fn sees_media(self) -> bool {
        matches!(self, Self::VolPath | Self::SimpleVolPath | Self::LightPath | Self::Bdpt(_) | Self::Mlt(_))
    }

    /// Whether it shows something else than light.
    fn shows_no_light(self) -> bool {
        matches!(
            self,
            Self::Function(_) | Self::Normals | Self::Albedo | Self::Depth | Self::Uv | Self::AmbientOcclusion { .. }
        )
    }

    /// Whether paths start at lights as well, or only there.
    pub fn starts_at_lights(self) -> bool {
        matches!(self, Self::LightPath | Self::Bdpt(_) | Self::Sppm(_) | Self::Mlt(_))
    }
}

/// The algorithm and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegratorSettings {
    /// Which.
    pub kind: IntegratorKind,
    /// The greatest number of bounces; 0 sees emission only.
    pub max_depth: u32,
    /// How lights are picked.
    pub light_selection: LightSelection,
    /// Whether lobes are roughened after the first non-specular bounce; biased.
    pub regularize: bool,
    /// Whether the camera sees through lamps and past the sky, while everything else is lit by them. Path tracing alone knows.
    pub hide_lights: bool,
    /// Whether panes only dim what goes straight through them: lamps light through them, and passing one is no bounce. Path tracing through
    /// media alone knows.
    pub through_panes: bool,
    /// The switches of path tracing, also of that through media where a scene has none; no other algorithm reads more of
    /// them than the stratification.
    pub techniques: Techniques,
    /// The file that an algorithm which measures something writes that to.
    pub report: Option<String>,
}

impl IntegratorSettings {
    /// Whether the settings make sense, and suit the lights of the scene.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, lights: &LightCensus) -> Result<(), SettingsError> {
        if self.hide_lights && !(self.kind.shows_no_light() || self.follows_camera_paths(lights)) {
            return Err(SettingsError::HiddenLights);
        }
        match &self.kind {
            // Among media the switches are not read.
            IntegratorKind::VolPath if lights.media => Ok(()),
            IntegratorKind::Path | IntegratorKind::VolPath => self.techniques.check(lights),
            IntegratorKind::Whitted(w) => w.check(),
            IntegratorKind::Distribution(d) => d.check(),
            IntegratorKind::LightPath => lights.check_light_paths("lightpath", true),
            IntegratorKind::Sppm(photons) => photons.check(lights),
            IntegratorKind::Mlt(m) => m.check(lights, self.max_depth),
            IntegratorKind::Bdpt(_) => lights.check_light_paths("bdpt", false),
            _ => Ok(()),
        }
    }

    /// Whether it is path tracing without its switches.
    fn follows_camera_paths(&self, lights: &LightCensus) -> bool {
        match self.kind {
            IntegratorKind::VolPath => lights.media || self.techniques == Techniques::default(),
            IntegratorKind::Path => self.techniques == Techniques::default(),
            _ => false,
        }
    }

    /// For algorithms whose cost grows exponentially with depth: the rays that one sample may take. Times samples and
    /// pixels, to be compared with [`ABSURD_RAYS`](crate::ABSURD_RAYS) before starting.
    pub fn predicted_rays(&self, lights: &LightCensus) -> Option<f64> {
        match &self.kind {
            IntegratorKind::Whitted(w) => Some(w.predicted_rays(lights, self.max_depth)),
            IntegratorKind::Distribution(d) => Some(d.predicted_rays(lights, self.max_depth)),
            _ => None,
        }
    }
}

impl Default for IntegratorSettings {
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: 5,
            light_selection: LightSelection::Tree,
            regularize: false,
            hide_lights: false,
            through_panes: false,
            techniques: Techniques::default(),
            report: None,
        }
    }
}

/// Everything that is not geometry or light.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// Film.
    pub film: FilmSettings,
    /// Reconstruction filter.
    pub filter: Filter,
    /// Sampler, including seed and sample count.
    pub sampler: SamplerSettings,
    /// Integrator.
    pub integrator: IntegratorSettings,
    /// Reading of the four lanes.
    pub color: ColorMode,
    /// Sample pixel centres only.
    pub disable_pixel_jitter: bool,
    /// Always the same wavelengths.
    pub disable_wavelength_jitter: bool,
    /// Point-sample all textures.
    pub disable_texture_filtering: bool,
    /// Replace every lobe by a diffuse one of the same albedo.
    pub force_diffuse: bool,
    /// Evaluate coated materials as pbrt-v4 does, whose estimate of them is a few percent off energy conservation:
    /// scenes written for it look as their authors saw them.
    pub layered_as_pbrt: bool,
}

impl RenderSettings {
    /// Wavelengths from a uniform number: as the eye needs them, or where bands are kept, as those do.
    #[inline]
    pub fn wavelengths(&self, u: f32) -> Wavelengths {
        let u = if self.disable_wavelength_jitter { 0.5 } else { u };
        match (self.color, self.film.kind) {
            (ColorMode::Rgb, _) => Wavelengths::rgb(),
            (ColorMode::Spectral, FilmKind::Spectral(bands)) => {
                Wavelengths::sample_uniform(u, bands.range[0], bands.range[1])
            }
            (ColorMode::Spectral, _) => Wavelengths::sample_visible(u),
        }
    }

    /// Whether light at a raster position counts in any pixel that is rendered.
    pub fn reaches_film(&self, at: Point2) -> bool {
        let [x0, x1, y0, y1] = self.film.pixel_bounds.map(|v| v as f32);
        let reach = self.filter.radius() - Vec2::new(0.5, 0.5);
        let inside = |v: f32, a: f32, b: f32, reach: f32| v >= a - reach && v <= b + reach;
        inside(at.x, x0, x1, reach.x) && inside(at.y, y0, y1, reach.y)
    }
}
