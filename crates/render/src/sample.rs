//! One sample of one pixel: film position, wavelengths, lens, time, radiance, colour.

use crate::splats::{BRIGHTEST, Landed, land};
use steradian_integrator::{Batch, Domain, Integrator, Numbers, Scratch, StratifiedNumbers, record::Record};
use steradian_math::{Point2, Vec2};
use steradian_sampling::Sampler;
use steradian_scene::World;
use steradian_spectrum::{ColorMode, Lanes, Matrix3, Wavelengths};

/// What is the same for all samples of a render.
#[derive(Clone, Debug)]
pub struct PixelSampler<'w> {
    /// The scene.
    pub world: &'w World,
    /// The algorithm.
    pub integrator: Integrator,
    /// Samplers by domain, where the settings ask for them.
    stratified: Option<StratifiedNumbers>,
    output_from_sensor: Matrix3,
    color: ColorMode,
    /// Views show numbers, which no sensor may change.
    raw: bool,
}

/// The result of one sample.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// Colour in the film's space, filter weight included.
    pub rgb: [f32; 3],
    /// Radiance in the four lanes.
    pub radiance: Lanes,
    /// The meaning of the lanes.
    pub wavelengths: Wavelengths,
    /// Raster position.
    pub film: Point2,
    /// Filter weight.
    pub weight: f32,
    /// The share of the light that the limit on the brightness of samples has left; 1 for all.
    pub kept: f32,
}

impl<'w> PixelSampler<'w> {
    /// Prepares the sampling of a world's film by its own settings.
    pub fn new(world: &'w World) -> Self {
        let settings = world.settings();
        let integrator = Integrator::new(world);
        let raw = matches!(integrator, Integrator::View(_) | Integrator::Function(_));
        let color = if raw { ColorMode::Rgb } else { settings.color };
        let stratified = StratifiedNumbers::new(settings.integrator.techniques.stratify, &settings.sampler);
        let output_from_sensor = settings.film.sensor.output_rgb_from_sensor(color);
        Self { world, integrator, stratified, output_from_sensor, color, raw }
    }

    /// Sample `index` of `pixel`: a pure function of its arguments and the settings. What it brings to other pixels is left
    /// in the splats of `scratch`.
    #[inline]
    pub fn sample<R: Record>(
        &self,
        sampler: &mut Sampler,
        pixel: [u32; 2],
        index: u32,
        record: &mut R,
        scratch: &mut Scratch<'w>,
    ) -> Sampled {
        scratch.splats.clear();
        scratch.sample = index;
        if let Some(stratified) = &self.stratified {
            let mut numbers = stratified.clone();
            numbers.start(pixel, index);
            return self.sample_with(&mut numbers, pixel, index, record, scratch);
        }
        sampler.start(pixel, index, 0);
        self.sample_with(sampler, pixel, index, record, scratch)
    }

    #[inline]
    fn sample_with<N: Numbers, R: Record>(
        &self,
        numbers: &mut N,
        pixel: [u32; 2],
        index: u32,
        record: &mut R,
        scratch: &mut Scratch<'w>,
    ) -> Sampled {
        let position = self.integrator.pixel_position(index, numbers.two(Domain::Pixel));
        if let Integrator::Function(f) = self.integrator {
            let value = f.value(position);
            let film = Point2::new(pixel[0] as f32 + position[0], pixel[1] as f32 + position[1]);
            let (radiance, wavelengths) = (Lanes::splat(value), Wavelengths::rgb());
            return Sampled { rgb: [value; 3], radiance, wavelengths, film, weight: 1.0, kept: 1.0 };
        }
        let (film, weight, mut wavelengths) = self.open(numbers, pixel, index, position);
        let radiance = self.integrator.film_radiance(self.world, film, &mut wavelengths, numbers, record, scratch);
        self.close((film, weight), radiance, wavelengths)
    }

    /// Film position, filter weight and wavelengths of a sample at a position in its pixel.
    #[inline]
    fn open<N: Numbers>(
        &self,
        numbers: &mut N,
        pixel: [u32; 2],
        index: u32,
        position: [f32; 2],
    ) -> (Point2, f32, Wavelengths) {
        let settings = self.world.settings();
        let (offset, weight) = if settings.disable_pixel_jitter {
            (Vec2::default(), 1.0)
        } else {
            let s = settings.filter.sample(Point2::from(position));
            (s.offset, s.weight)
        };
        let film = Point2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + offset;
        let wavelengths = match (self.color, self.integrator.wavelengths(self.world, index)) {
            (_, Some(shared)) => shared,
            (ColorMode::Rgb, _) => Wavelengths::rgb(),
            (ColorMode::Spectral, _) if settings.disable_wavelength_jitter => settings.wavelengths(0.5),
            (ColorMode::Spectral, _) => settings.wavelengths(numbers.one(Domain::Other)),
        };
        (film, weight, wavelengths)
    }

    /// The colour of a sample whose radiance is known.
    #[inline]
    fn close(&self, (film, weight): (Point2, f32), radiance: Lanes, wavelengths: Wavelengths) -> Sampled {
        let settings = self.world.settings();
        let (rgb, kept) = if self.raw {
            ([radiance.0[0], radiance.0[1], radiance.0[2]], 1.0)
        } else {
            let sensor = settings.film.sensor.to_sensor_rgb(radiance, &wavelengths);
            let kept = share_within(sensor, settings.film.max_component_value);
            let sensor = if kept < 1.0 { sensor.map(|v| v * kept) } else { sensor };
            (self.output_from_sensor.apply(sensor), kept)
        };
        Sampled { rgb: rgb.map(|v| v * weight), radiance, wavelengths, film, weight, kept }
    }

    /// What many samples at once are made in, where the algorithm and the sampler allow that.
    pub fn batch(&self, sampler: &Sampler) -> Option<Batch> {
        match self.integrator {
            Integrator::Path(path) if self.stratified.is_none() => Batch::new(path, self.world, sampler),
            _ => None,
        }
    }

    /// The colours of samples `range` of each of `pixels`, pixel by pixel: those of [`PixelSampler::sample`].
    pub fn sample_many<R: Record>(
        &self,
        batch: &mut Batch,
        sampler: &mut Sampler,
        pixels: &[[u32; 2]],
        range: std::ops::Range<u32>,
        record: &mut R,
        out: &mut Vec<[f32; 3]>,
    ) {
        batch.clear();
        let mut opened = Vec::with_capacity(pixels.len() * range.len());
        for &pixel in pixels {
            for index in range.clone() {
                sampler.start(pixel, index, 0);
                let position = self.integrator.pixel_position(index, sampler.two(Domain::Pixel));
                let (film, weight, wavelengths) = self.open(sampler, pixel, index, position);
                batch.push(self.world, film, wavelengths, (pixel, index, sampler));
                opened.push((film, weight));
            }
        }
        batch.run(self.world, sampler, record);
        for (i, opened) in opened.into_iter().enumerate() {
            let (radiance, wavelengths) = batch.radiance(i);
            out.push(self.close(opened, radiance, *wavelengths).rgb);
        }
    }

    /// The colour of a part of a sample's radiance, filter weight and limit included as in the whole.
    pub fn color(&self, part: Lanes, of: &Sampled) -> [f32; 3] {
        if self.raw {
            return std::array::from_fn(|c| part.0[c] * of.weight);
        }
        let sensor = self.world.settings().film.sensor.to_sensor_rgb(part, &of.wavelengths);
        self.output_from_sensor.apply(sensor.map(|v| v * of.kept)).map(|v| v * of.weight)
    }

    /// The colour of light for one pixel of the frame.
    fn splat_color(&self, value: Lanes, wavelengths: &Wavelengths) -> [f32; 3] {
        let film = &self.world.settings().film;
        let sensor = film.sensor.to_sensor_rgb(value, wavelengths);
        let kept = share_within(sensor, film.max_component_value);
        self.output_from_sensor.apply(sensor.map(|v| v * kept))
    }

    /// Whether samples bring light to other pixels.
    pub fn splats(&self) -> bool {
        self.integrator.splats()
    }

    /// Turns the splats of a sample into colours of pixels. False if one of them is not finite or too bright; then none is
    /// added.
    pub fn land(&self, scratch: &Scratch, wavelengths: &Wavelengths, out: &mut Vec<Landed>) -> bool {
        let settings = self.world.settings();
        let [width, height] = settings.film.resolution.map(|n| n as f32);
        let first = out.len();
        for splat in &scratch.splats {
            let rgb = self.splat_color(splat.value * (1.0 / (width * height)), wavelengths);
            land(settings, splat, rgb, out, first);
        }
        let sound = out[first..].iter().all(|l| l.rgb.iter().all(|v| v.abs() <= BRIGHTEST));
        if !sound {
            out.truncate(first);
        }
        sound
    }
}

/// The factor that makes the largest component at most `most`.
#[inline]
fn share_within(rgb: [f32; 3], most: f32) -> f32 {
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    if largest > most { most / largest } else { 1.0 }
}
