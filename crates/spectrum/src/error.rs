//! What can be wrong with a spectrum that somebody describes.

/// Why a spectrum or a sensor could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Wavelengths and values come in pairs.
    #[error("{wavelengths} wavelengths but {values} values")]
    LengthMismatch {
        /// How many wavelengths were given.
        wavelengths: usize,
        /// How many values were given.
        values: usize,
    },
    /// No sample at all.
    #[error("a sampled spectrum needs at least one sample")]
    Empty,
    /// Wavelengths must increase.
    #[error("wavelengths must increase, but {next} nm follows {previous} nm (sample {index})")]
    NotIncreasing {
        /// The index of the sample that is out of order.
        index: usize,
        /// The wavelength before it.
        previous: f32,
        /// Its wavelength.
        next: f32,
    },
    /// NaN or infinite input.
    #[error("sample {index} is not a finite number")]
    NotFinite {
        /// The index of the sample.
        index: usize,
    },
    /// A temperature that no black body can have.
    #[error("a temperature of {kelvin} K is not positive and finite")]
    Temperature {
        /// The temperature.
        kelvin: f32,
    },
    /// No sensor has that name.
    #[error("unknown sensor \"{name}\"")]
    UnknownSensor {
        /// The name.
        name: String,
    },
}
