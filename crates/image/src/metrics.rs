//! How far an image is from a reference, in one number each.

use crate::{Error, Image};

/// Error measures over all pixels and the channels R, G, B. Samples that are not finite in either image are counted and left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Mean squared error.
    pub mse: f64,
    /// Mean of `(test - reference)^2 / (reference^2 + 0.01)`.
    pub rel_mse: f64,
    /// Mean absolute error.
    pub mae: f64,
    /// Peak signal-to-noise ratio in decibels, for a peak of 1. Infinite for identical images.
    pub psnr: f64,
    /// Mean of `test - reference` over the mean of the reference, in R, G, B: 0 for an unbiased image with enough samples.
    pub bias: [f64; 3],
    /// Largest absolute difference.
    pub max_error: f64,
    /// Samples of the test image that are NaN or infinite.
    pub non_finite_test: usize,
    /// Samples of the reference that are NaN or infinite.
    pub non_finite_reference: usize,
}

/// Compares two images of the same size.
///
/// # Errors
/// `Error::Shape` if the sizes differ, there are no pixels or there is no colour.
pub fn metrics(test: &Image, reference: &Image) -> Result<Metrics, Error> {
    let (a, b) = same_colours(test, reference)?;
    let (mut squares, mut relative, mut absolute, mut largest) = (0.0, 0.0, 0.0, 0.0_f64);
    let mut m = Metrics {
        mse: 0.0,
        rel_mse: 0.0,
        mae: 0.0,
        psnr: 0.0,
        bias: [0.0; 3],
        max_error: 0.0,
        non_finite_test: 0,
        non_finite_reference: 0,
    };
    let mut n = 0_usize;
    for c in 0..3 {
        let (mut signed, mut sum) = (0.0, 0.0);
        for (&t, &r) in a[c].iter().zip(b[c]) {
            m.non_finite_test += usize::from(!t.is_finite());
            m.non_finite_reference += usize::from(!r.is_finite());
            if !t.is_finite() || !r.is_finite() {
                continue;
            }
            let (t, r) = (f64::from(t), f64::from(r));
            let d = t - r;
            squares += d * d;
            relative += d * d / (r * r + 0.01);
            absolute += d.abs();
            largest = largest.max(d.abs());
            signed += d;
            sum += r;
            n += 1;
        }
        m.bias[c] = if sum != 0.0 { signed / sum } else { signed };
    }
    let n = n.max(1) as f64;
    m.mse = squares / n;
    m.rel_mse = relative / n;
    m.mae = absolute / n;
    m.psnr = -10.0 * m.mse.log10();
    m.max_error = largest;
    Ok(m)
}

/// Planes R, G, B.
type Rgb<'a> = [&'a [f32]; 3];

/// The colour planes of two images of the same size.
pub(crate) fn same_colours<'a>(a: &'a Image, b: &'a Image) -> Result<(Rgb<'a>, Rgb<'a>), Error> {
    if (a.width(), a.height()) != (b.width(), b.height()) || a.width() * a.height() == 0 {
        let (w, h, v, g) = (a.width(), a.height(), b.width(), b.height());
        return Err(Error::shape(format!("images of {w} x {h} and {v} x {g} pixels cannot be compared")));
    }
    let planes = |i: &'a Image| i.colour_planes().ok_or_else(|| Error::shape("an image without R, G, B or Y"));
    Ok((planes(a)?, planes(b)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(v: &[f32]) -> Image {
        Image::from_rgb(v.len(), 1, &v.iter().map(|&v| [v; 3]).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn closed_forms() {
        let m = metrics(&image(&[1.5, 2.0]), &image(&[1.0, 3.0])).unwrap();
        assert_eq!(m.mse, (0.25 + 1.0) / 2.0);
        assert_eq!(m.mae, 0.75);
        assert!((m.rel_mse - (0.25 / 1.01 + 1.0 / 9.01) / 2.0).abs() < 1e-12);
        assert!((m.psnr - -10.0 * 0.625_f64.log10()).abs() < 1e-12);
        assert_eq!(m.bias, [-0.125; 3]);
        assert_eq!(m.max_error, 1.0);
    }

    #[test]
    fn identical_images_have_no_error_and_bad_samples_are_counted() {
        let m = metrics(&image(&[1.0, f32::NAN]), &image(&[1.0, 2.0])).unwrap();
        assert_eq!((m.mse, m.psnr), (0.0, f64::INFINITY));
        assert_eq!((m.non_finite_test, m.non_finite_reference), (3, 0));
        assert!(metrics(&image(&[1.0]), &image(&[1.0, 2.0])).is_err());
    }
}
