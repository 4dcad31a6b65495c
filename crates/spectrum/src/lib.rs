//! Wavelengths, spectra, colour spaces, RGB to spectrum, measured tables.
//!
//! * [`Lanes`]: four `f32`, the carrier of all light, and [`Wavelengths`]: what they mean.
//! * [`Spectrum`]: a function of wavelength as plain data, with a reading for RGB mode.
//! * [`ColorSpace`]: primaries, white, matrices, and RGB triples uplifted to smooth spectra ([`RgbAlbedo`], [`RgbUnbounded`], [`RgbIlluminant`]).
//! * [`cie`], [`named`], [`planck`]: observer, illuminants, metals, glasses, black bodies, daylight.
//! * [`PixelSensor`]: from lanes to the film's colour.
//!
//! One convention of scale runs through all of it, and is pbrt-v4's: an emission spectrum `S` counts by its plain integral `sum S(lambda) y(lambda)` over
//! 1 nm steps, see [`Spectrum::photometric`]. A light divided by that number has luminance 1, and the film shows it as 1 in either mode.

mod lanes;
mod wavelengths;

pub use lanes::Lanes;
pub use wavelengths::{ColorMode, LAMBDA_MAX, LAMBDA_MIN, Wavelengths};
