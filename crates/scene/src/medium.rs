//! Participating media as the user stated them.

use steradian_spectrum::Spectrum;

/// A medium that absorbs, scatters and emits.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Name, for messages.
    pub name: String,
    /// Mean cosine of the Henyey-Greenstein phase function.
    pub g: f32,
    /// Absorption coefficient per unit length.
    pub sigma_a: Spectrum,
    /// Scattering coefficient per unit length.
    pub sigma_s: Spectrum,
    /// Factor of both coefficients.
    pub scale: f32,
    /// Emitted radiance per absorption, with its factor.
    pub emission: Option<(Spectrum, f32)>,
}
