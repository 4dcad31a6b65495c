//! Wavelengths, spectra, colour spaces, RGB to spectrum, measured tables.
//!
//! * [`Lanes`]: four `f32`, the carrier of all light, and [`Wavelengths`]: what they mean.
//! * [`Spectrum`]: a function of wavelength as plain data, with a reading for RGB mode.
//! * [`ColorSpace`]: primaries, white, matrices, and RGB triples uplifted to smooth spectra ([`ColorSpace::albedo_lanes`] and its siblings).
//! * [`cie`], [`named`], [`planck`]: observer, illuminants, metals, glasses, black bodies, daylight.
//! * [`PixelSensor`]: from lanes to the film's colour.
//!
//! One convention of scale runs through all of it, and is pbrt-v4's: an emission spectrum `S` counts by its plain integral `sum S(lambda) y(lambda)` over
//! 1 nm steps, see [`Spectrum::photometric`]. A light divided by that number has luminance 1, and the film shows it as 1 in either mode.

pub mod cie;
pub mod color;
mod color_space;
mod csv;
mod dense;
mod error;
mod lanes;
pub mod named;
pub mod planck;
mod rows;
mod sensor;
mod spectrum;
mod uplift;
mod wavelengths;

pub use color::{Matrix3, white_balance};
pub use color_space::ColorSpace;
/// The integral of the eye's response y-bar over wavelength in nanometres: an even radiance of one has this luminance.
pub const CIE_Y: f32 = 106.857;

pub use dense::{DENSE_LEN, Dense};
pub use error::SpectrumError;
pub use lanes::Lanes;
pub use rows::LaneRows;
pub use sensor::PixelSensor;
pub use spectrum::{Spectrum, SpectrumUse};
pub use uplift::Sigmoid;
pub use wavelengths::{ColorMode, LAMBDA_MAX, LAMBDA_MIN, Wavelengths};
