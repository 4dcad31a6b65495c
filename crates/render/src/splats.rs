//! Sums of light that lands on any pixel, in any order: fixed-point numbers, whose addition is exactly associative.
//!
//! A contribution is rounded once, to a multiple of 2^-64 (5e-20); everything after that is exact, so that the sum has the
//! same bits for any number of threads, any interruption, and any way to cut the render into parts. Contributions of up
//! to 2^40 (1e12) are taken, on a scale on which a white wall is about one: what is brighter counts as a bad sample, is
//! located and reported, as one that is not finite. A pixel's sum holds 2^63, which is 2^23 of the greatest contributions.

use steradian_integrator::Splat;
use steradian_math::Point2;
use steradian_scene::RenderSettings;

/// A multiple of 2^-64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fixed(pub(crate) i128);

/// The greatest contribution that is taken.
pub const BRIGHTEST: f32 = (1u64 << 40) as f32;

impl Fixed {
    const ONE: f64 = 18_446_744_073_709_551_616.0;
    /// Squares are for the variance; the few that are too large count as this much.
    const LARGEST: f64 = (1u64 << 62) as f64;

    /// The nearest multiple, saturating at 2^62.
    #[inline]
    pub fn new(v: f64) -> Self {
        // Scaling by a power of two is exact, and so is the conversion.
        Self((v.clamp(-Self::LARGEST, Self::LARGEST) * Self::ONE).round_ties_even() as i128)
    }

    /// The nearest float.
    pub fn value(self) -> f64 {
        self.0 as f64 / Self::ONE
    }
}

impl std::ops::Add for Fixed {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        // Beyond all use it would wrap around, which is associative too.
        Self(self.0.wrapping_add(o.0))
    }
}

/// Contributions to one pixel and their squares, in the film's colour space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SplatSum {
    pub rgb: [Fixed; 3],
    pub squares: [Fixed; 3],
}

impl SplatSum {
    fn of(rgb: [f32; 3]) -> Self {
        let v = rgb.map(f64::from);
        Self { rgb: v.map(Fixed::new), squares: v.map(|v| Fixed::new(v * v)) }
    }

    fn add(&mut self, o: &Self) {
        for c in 0..3 {
            self.rgb[c] = self.rgb[c] + o.rgb[c];
            self.squares[c] = self.squares[c] + o.squares[c];
        }
    }
}

/// What one sample brings to one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landed {
    /// The number of the pixel in the film, row by row.
    pub pixel: u32,
    /// Colour in the film's space.
    pub rgb: [f32; 3],
}

/// The splats of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Splats {
    /// Pixels of the whole frame, over which light paths are spread; more than the film's if that is a crop.
    pub(crate) frame: u64,
    /// Row by row.
    pub(crate) sums: Vec<SplatSum>,
}

impl Splats {
    /// None yet.
    pub fn new(resolution: [u32; 2], bounds: [u32; 4]) -> Self {
        let [x0, x1, y0, y1] = bounds;
        let pixels = (x1 - x0) as usize * (y1 - y0) as usize;
        Self { frame: resolution.map(u64::from).iter().product(), sums: vec![SplatSum::default(); pixels] }
    }

    /// Adds what samples have brought.
    pub fn add(&mut self, landed: &[Landed]) {
        for l in landed {
            self.sums[l.pixel as usize].add(&SplatSum::of(l.rgb));
        }
    }

    /// Adds the splats of another part of the same render.
    pub(crate) fn merge(&mut self, o: &Self) {
        for (a, b) in self.sums.iter_mut().zip(&o.sums) {
            a.add(b);
        }
    }

    /// The share of the splats in the mean of pixel `i`, and its variance, after `samples` samples of all pixels together.
    pub fn estimate(&self, i: usize, samples: u64) -> [[f64; 3]; 2] {
        let sum = &self.sums[i];
        let n = samples.max(1) as f64;
        let scale = self.frame as f64 / n;
        let mean = sum.rgb.map(|v| v.value() * scale);
        let variance = std::array::from_fn(|c| {
            let s = sum.rgb[c].value();
            (sum.squares[c].value() - s * s / n).max(0.0) * scale * scale * n / (n - 1.0).max(1.0)
        });
        [mean, variance]
    }
}

/// Spreads a splat's colour, over one pixel of the frame, by the filter around its place. Contributions of a sample to the same pixel
/// are added to those from `first` on.
pub(crate) fn land(settings: &RenderSettings, splat: &Splat, rgb: [f32; 3], out: &mut Vec<Landed>, first: usize) {
    let [x0, x1, y0, y1] = settings.film.pixel_bounds;
    let radius = settings.filter.radius();
    let scale = 1.0 / settings.filter.integral();
    let span = |v: f32, r: f32, a: u32, b: u32| {
        // Open on one side: light on the border of two pixels belongs to one.
        let low = ((v - r - 0.5).floor() + 1.0).max(a as f32) as u32;
        let high = ((v + r - 0.5).floor() + 1.0).clamp(a as f32, b as f32) as u32;
        low..high
    };
    for y in span(splat.film.y, radius.y, y0, y1) {
        for x in span(splat.film.x, radius.x, x0, x1) {
            let offset = Point2::new(splat.film.x - (x as f32 + 0.5), splat.film.y - (y as f32 + 0.5));
            let weight = settings.filter.eval(offset) * scale;
            if weight == 0.0 {
                continue;
            }
            let pixel = (y - y0) * (x1 - x0) + (x - x0);
            let rgb = rgb.map(|v| v * weight);
            match out[first..].iter_mut().find(|l| l.pixel == pixel) {
                Some(l) => l.rgb = std::array::from_fn(|c| l.rgb[c] + rgb[c]),
                None => out.push(Landed { pixel, rgb }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use steradian_image::{Filter, FilterKind};
    use steradian_math::Vec2;

    fn settings() -> RenderSettings {
        RenderSettings {
            film: steradian_scene::FilmSettings::new(12, 10),
            filter: Filter::pixel_box(),
            sampler: steradian_sampling::SamplerSettings::default(),
            integrator: steradian_scene::IntegratorSettings::default(),
            color: steradian_spectrum::ColorMode::Rgb,
            disable_pixel_jitter: false,
            disable_wavelength_jitter: false,
            disable_texture_filtering: false,
            force_diffuse: false,
            layered_as_pbrt: false,
        }
    }

    #[test]
    fn small_and_large_are_kept() {
        for v in [0.0, 1.0, -0.3, 1e-7, 123_456.79, f64::from(BRIGHTEST), 5e-20] {
            assert!((Fixed::new(v).value() - v).abs() <= 2.8e-20 + v.abs() * 1e-16, "{v}");
        }
        assert_eq!(Fixed::new(2e-20).value(), 0.0, "less than half a step is nothing");
        assert_eq!(Fixed::new(1e30), Fixed::new(1e25), "saturates");
        // A tiny contribution is not lost beside a huge one.
        let sum = Fixed::new(1e12) + Fixed::new(1e-15) + Fixed::new(-1e12);
        assert!((sum.value() - 1e-15).abs() < 1e-19);
        // The greatest contributions, often.
        let huge = (0..1 << 20).fold(Fixed::default(), |s, _| s + Fixed::new(f64::from(BRIGHTEST)));
        assert_eq!(huge.value(), f64::from(BRIGHTEST) * f64::from(1 << 20));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_order_and_grouping_gives_the_same_bits(
            values in proptest::collection::vec((0u32..6, -1e9f32..1e9, -30i32..10), 1..200),
            cut in 0usize..200,
            seed in any::<u64>(),
        ) {
            let landed: Vec<Landed> = values
                .iter()
                .map(|&(pixel, v, e)| Landed { pixel, rgb: [v * steradian_math::exp2(e as f32), v, 1.0 / v] })
                .collect();
            let mut whole = Splats::new([3, 2], [0, 3, 0, 2]);
            whole.add(&landed);
            let mut shuffled = landed.clone();
            let mut rng = steradian_sampling::Rng::new(seed, 0);
            for i in (1..shuffled.len()).rev() {
                shuffled.swap(i, rng.below(i as u32 + 1) as usize);
            }
            let (a, b) = shuffled.split_at(cut.min(shuffled.len()));
            let (mut left, mut right) = (Splats::new([3, 2], [0, 3, 0, 2]), Splats::new([3, 2], [0, 3, 0, 2]));
            left.add(a);
            right.add(b);
            left.merge(&right);
            prop_assert_eq!(left, whole);
        }
    }

    /// A splat is worth its value over all pixels together, wherever it lands, if its whole filter lies on the film.
    #[test]
    fn filters_spread_and_keep() {
        let kinds = [
            (FilterKind::Box, 0.5),
            (FilterKind::Gaussian { sigma: 0.5 }, 1.5),
            (FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, 2.0),
            (FilterKind::Triangle, 2.0),
        ];
        let mut settings = settings();
        settings.film.pixel_bounds = [1, 12, 0, 9];
        for (kind, radius) in kinds {
            settings.filter = Filter::new(kind, Vec2::new(radius, radius)).unwrap();
            let mut mean = 0.0;
            const N: usize = 400;
            for i in 0..N {
                let film = Point2::new(4.0 + (i as f32 * 0.618).fract(), 5.0 + (i as f32 * 0.755).fract());
                let splat = Splat { film, value: steradian_spectrum::Lanes::ONE };
                let mut out = Vec::new();
                land(&settings, &splat, [1.0; 3], &mut out, 0);
                mean += out.iter().map(|l| l.rgb[1]).sum::<f32>() / N as f32;
                // Twice the same place adds up in the same entries.
                let entries = out.len();
                land(&settings, &splat, [1.0; 3], &mut out, 0);
                assert_eq!(out.len(), entries);
            }
            assert!((mean - 1.0).abs() < 5e-3, "{kind:?}: {mean}");
        }
    }
}
