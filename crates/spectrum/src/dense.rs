//! A function of wavelength as a table with one value per nanometre, 360 to 830.

use crate::Lanes;

/// Values per table: one for each whole nanometre of 360..=830.
pub const DENSE_LEN: usize = 471;

/// A spectrum given at each whole nanometre of 360..=830; 0 outside. Look-ups take the nearest nanometre, as pbrt-v4 does, so that sums
/// over the table are exactly the integrals that estimators converge to.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense(pub [f32; DENSE_LEN]);

impl Dense {
    /// Tabulates `f`, a function of the wavelength in nanometres.
    pub fn from_fn(mut f: impl FnMut(f32) -> f32) -> Dense {
        Dense(std::array::from_fn(|i| f((360 + i) as f32)))
    }

    /// Reads the `part`-th table out of little-endian bytes, at compile time.
    pub(crate) const fn from_bytes(bytes: &[u8], part: usize) -> Dense {
        let mut values = [0.0; DENSE_LEN];
        let mut i = 0;
        while i < DENSE_LEN {
            let k = 4 * (part * DENSE_LEN + i);
            values[i] = f32::from_le_bytes([bytes[k], bytes[k + 1], bytes[k + 2], bytes[k + 3]]);
            i += 1;
        }
        Dense(values)
    }

    /// The value at `lambda` nanometres.
    #[inline]
    pub fn eval_at(&self, lambda: f32) -> f32 {
        // A cast saturates, so that NaN and negative wavelengths end up outside as well.
        let index = (lambda + 0.5) as usize;
        self.0.get(index.wrapping_sub(360)).copied().unwrap_or(0.0)
    }

    /// The values at four wavelengths in nanometres.
    #[inline]
    pub fn eval(&self, lambda: [f32; 4]) -> Lanes {
        Lanes(lambda.map(|l| self.eval_at(l)))
    }

    /// The largest value.
    pub fn max_value(&self) -> f32 {
        self.0.iter().copied().fold(f32::NEG_INFINITY, f32::max)
    }

    /// The sum over whole nanometres of this times `f(lambda)`, an integral over 360..830 nm in double precision.
    pub fn integrate(&self, mut f: impl FnMut(f32) -> f32) -> f64 {
        self.0.iter().enumerate().map(|(i, &v)| f64::from(v) * f64::from(f((360 + i) as f32))).sum()
    }

    /// The integral of the product of two tables.
    pub(crate) const fn dot(&self, other: &Dense) -> f64 {
        let mut sum = 0.0;
        let mut i = 0;
        while i < DENSE_LEN {
            sum += self.0[i] as f64 * other.0[i] as f64;
            i += 1;
        }
        sum
    }
}
