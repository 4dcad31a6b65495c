//! The wavelengths that a path carries, and how they are chosen.
//!
//! Importance sampling of the visible range: Radziszewski, Boryczko and Alda, "An Improved Technique for Full Spectral Rendering"
//! (WSCG 2009), with the constants that pbrt-v4 section 4.5.4 gives. Rotations of one random number: Wilkie et al., "Hero Wavelength
//! Spectral Sampling" (EGSR 2014).

use steradian_math as math;

use crate::Lanes;

/// The shortest wavelength that the renderer knows, in nanometres.
pub const LAMBDA_MIN: f32 = 360.0;
/// The longest wavelength that the renderer knows, in nanometres.
pub const LAMBDA_MAX: f32 = 830.0;

/// What the four lanes of a path mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorMode {
    /// Lanes are linear Rec.709 red, green, blue and an idle lane.
    Rgb,
    /// Lanes are four wavelengths.
    #[default]
    Spectral,
}

/// Four sampled wavelengths and their densities, or the mark that says that the lanes are red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelengths {
    /// Nanometres; all 0 in RGB mode.
    lambda: [f32; 4],
    /// Density per nanometre; 0 for a lane that was given up.
    pdf: Lanes,
}

/// Where the primaries of Rec.709 roughly sit (dominant wavelengths), for whoever needs a wavelength in RGB mode.
const RGB_LAMBDA: [f32; 4] = [611.4, 549.1, 464.2, 549.1];

/// Centre (nm) and width (nm) of the visible-range density, and the two ends of its inverse distribution function.
const CENTER: f32 = 538.0;
const WIDTH: f32 = 138.888889;
const ATANH_START: f32 = 0.85691062;
const ATANH_SPAN: f32 = 1.82750197;

impl Wavelengths {
    /// The mark of RGB mode.
    #[inline]
    pub const fn rgb() -> Wavelengths {
        Wavelengths { lambda: [0.0; 4], pdf: Lanes::ONE }
    }

    /// The wavelengths of a path in the given mode, from one random number `u` in [0,1), which RGB mode ignores.
    #[inline]
    pub fn sample(mode: ColorMode, u: f32) -> Wavelengths {
        match mode {
            ColorMode::Rgb => Wavelengths::rgb(),
            ColorMode::Spectral => Wavelengths::sample_visible(u),
        }
    }

    /// Four wavelengths in 360..830 nm with density proportional to `sech^2(0.0072 (lambda - 538))`, which resembles the luminous response.
    ///
    /// `u` in [0,1) chooses the first lane; lane `i` uses `u + i/4`, wrapped around.
    #[inline]
    pub fn sample_visible(u: f32) -> Wavelengths {
        let mut lambda = [0.0; 4];
        let mut pdf = Lanes::ZERO;
        for i in 0..4 {
            let shifted = u + i as f32 * 0.25;
            let up = if shifted >= 1.0 { shifted - 1.0 } else { shifted };
            // The distribution is a hyperbolic tangent; its density is known from the same number, without a cosh.
            let t = ATANH_START - ATANH_SPAN * up;
            let atanh = 0.5 * math::ln((1.0 + t) / (1.0 - t));
            lambda[i] = (CENTER - WIDTH * atanh).clamp(LAMBDA_MIN, LAMBDA_MAX);
            pdf[i] = (1.0 - t * t) / (WIDTH * ATANH_SPAN);
        }
        Wavelengths { lambda, pdf }
    }

    /// The density per nanometre of [`Wavelengths::sample_visible`] at `lambda` (nm); 0 outside 360..830 nm.
    pub fn visible_pdf(lambda: f32) -> f32 {
        if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
            return 0.0;
        }
        let x = (lambda - CENTER) / WIDTH;
        let cosh = 0.5 * (math::exp(x) + math::exp(-x));
        1.0 / (WIDTH * ATANH_SPAN * cosh * cosh)
    }

    /// Four wavelengths equally far apart in `low..high` nm, rotated by `u` in [0,1), with uniform density.
    #[inline]
    pub fn sample_uniform(u: f32, low: f32, high: f32) -> Wavelengths {
        let span = high - low;
        let mut lambda = [0.0; 4];
        for i in 0..4 {
            let shifted = u + i as f32 * 0.25;
            let up = if shifted >= 1.0 { shifted - 1.0 } else { shifted };
            lambda[i] = low + up * span;
        }
        Wavelengths { lambda, pdf: Lanes::splat(1.0 / span) }
    }

    /// The same four wavelengths for every path: for tests and for pbrt's `disablewavelengthjitter`. Biased, of course.
    pub fn fixed() -> Wavelengths {
        Wavelengths::sample_visible(0.5)
    }

    /// Whether the lanes are red, green and blue.
    #[inline]
    pub fn is_rgb(&self) -> bool {
        self.lambda[0] == 0.0
    }

    /// What the lanes mean.
    #[inline]
    pub fn mode(&self) -> ColorMode {
        if self.is_rgb() { ColorMode::Rgb } else { ColorMode::Spectral }
    }

    /// The wavelengths in nanometres. In RGB mode: the dominant wavelengths of the Rec.709 primaries.
    #[inline]
    pub fn lambda(&self) -> [f32; 4] {
        if self.is_rgb() { RGB_LAMBDA } else { self.lambda }
    }

    /// The densities per nanometre; 0 for a lane that was given up. In RGB mode: all 1.
    #[inline]
    pub fn pdf(&self) -> Lanes {
        self.pdf
    }

    /// Which lane to follow where only one can be followed, as in dispersion: the hero wavelength, or green in RGB mode.
    #[inline]
    pub fn hero_lane(&self) -> usize {
        if self.is_rgb() { 1 } else { 0 }
    }

    /// Gives up all lanes but the hero's, and lowers its density to a quarter so that the average over four lanes stays an unbiased
    /// estimate. Does nothing in RGB mode or when it was done before.
    #[inline]
    pub fn terminate_secondary(&mut self) {
        if self.is_rgb() || self.secondary_terminated() {
            return;
        }
        self.pdf = Lanes([self.pdf[0] * 0.25, 0.0, 0.0, 0.0]);
    }

    /// Whether only the hero lane is left. Never so in RGB mode.
    #[inline]
    pub fn secondary_terminated(&self) -> bool {
        let [_, b, c, d] = self.pdf.0;
        b == 0.0 && c == 0.0 && d == 0.0
    }
}
