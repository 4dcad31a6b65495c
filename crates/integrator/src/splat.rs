//! Light that lands on a pixel of its own choice.

use steradian_math::Point2;
use steradian_spectrum::Lanes;

/// What a path from a light brings to a place of the film.
///
/// A pixel is the mean, over all samples of all pixels, of `value` times its own normalised filter at the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Raster position.
    pub film: Point2,
    /// Contribution, in the wavelengths of the sample.
    pub value: Lanes,
}
