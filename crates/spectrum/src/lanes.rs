//! The carrier of light: four `f32` lanes, read as four wavelengths or as red, green, blue and an idle lane.
//!
//! Wilkie et al., "Hero Wavelength Spectral Sampling" (EGSR 2014) is the reason for four.

use std::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

use steradian_math as math;

/// Four values of radiance, throughput, reflectance, optical depth or the like.
///
/// In spectral mode lane `i` belongs to wavelength `i` of the path's [`Wavelengths`](crate::Wavelengths). In RGB mode lanes 0, 1 and 2 are
/// linear Rec.709 red, green and blue; lane 3 is idle. Everything that this crate evaluates puts a copy of green into the idle lane, so
/// that no arithmetic there can be less finite than in the others, and so that [`average`](Lanes::average) is a fair guess of luminance.
/// All operations work lane by lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Lanes(pub [f32; 4]);

impl Lanes {
    /// All lanes 0.
    pub const ZERO: Lanes = Lanes([0.0; 4]);
    /// All lanes 1.
    pub const ONE: Lanes = Lanes([1.0; 4]);
    /// The number of lanes.
    pub const COUNT: usize = 4;

    /// The same value in all lanes.
    #[inline]
    pub const fn splat(value: f32) -> Lanes {
        Lanes([value; 4])
    }

    /// The reading of a linear Rec.709 triple in RGB mode: red, green, blue, and green again in the idle lane.
    #[inline]
    pub const fn from_rgb(rgb: [f32; 3]) -> Lanes {
        Lanes([rgb[0], rgb[1], rgb[2], rgb[1]])
    }

    /// The first three lanes. Only meaningful in RGB mode.
    #[inline]
    pub const fn rgb(self) -> [f32; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// Applies `f` to each lane.
    #[inline(always)]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Lanes {
        let [a, b, c, d] = self.0;
        Lanes([f(a), f(b), f(c), f(d)])
    }

    /// Applies `f` to each pair of lanes.
    #[inline(always)]
    pub fn zip(self, other: Lanes, mut f: impl FnMut(f32, f32) -> f32) -> Lanes {
        let ([a, b, c, d], [p, q, r, s]) = (self.0, other.0);
        Lanes([f(a, p), f(b, q), f(c, r), f(d, s)])
    }

    /// The largest lane; NaN lanes are ignored unless all are NaN.
    #[inline]
    pub fn max_component(self) -> f32 {
        let [a, b, c, d] = self.0;
        a.max(b).max(c.max(d))
    }

    /// The smallest lane; NaN lanes are ignored unless all are NaN.
    #[inline]
    pub fn min_component(self) -> f32 {
        let [a, b, c, d] = self.0;
        a.min(b).min(c.min(d))
    }

    /// The sum of the lanes, in a fixed order.
    #[inline]
    pub fn sum(self) -> f32 {
        let [a, b, c, d] = self.0;
        (a + b) + (c + d)
    }

    /// The mean of the lanes. In spectral mode this is the estimator over the four wavelengths.
    #[inline]
    pub fn average(self) -> f32 {
        self.sum() * 0.25
    }

    /// Whether all lanes are exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == [0.0; 4]
    }

    /// Whether no lane is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|v| v.is_finite())
    }

    /// `e` to the power of each lane.
    #[inline]
    pub fn exp(self) -> Lanes {
        self.map(math::exp)
    }

    /// The square root of each lane; NaN for a negative lane.
    #[inline]
    pub fn sqrt(self) -> Lanes {
        self.map(f32::sqrt)
    }

    /// The square root of each lane, a negative lane counting as 0.
    #[inline]
    pub fn safe_sqrt(self) -> Lanes {
        self.map(|v| v.max(0.0).sqrt())
    }

    /// Each lane to the power of `exponent`.
    #[inline]
    pub fn powf(self, exponent: f32) -> Lanes {
        self.map(|v| math::powf(v, exponent))
    }

    /// The absolute value of each lane.
    #[inline]
    pub fn abs(self) -> Lanes {
        self.map(f32::abs)
    }

    /// Quotients, 0 where the divisor is 0.
    #[inline]
    pub fn safe_div(self, divisor: Lanes) -> Lanes {
        self.zip(divisor, |a, b| if b != 0.0 { a / b } else { 0.0 })
    }

    /// Negative lanes become 0 (and so do NaN lanes, as `f32::max` has it).
    #[inline]
    pub fn clamp_zero(self) -> Lanes {
        self.map(|v| v.max(0.0))
    }

    /// Each lane clamped to `[low, high]`; a NaN lane stays NaN.
    #[inline]
    pub fn clamp(self, low: f32, high: f32) -> Lanes {
        self.map(|v| v.clamp(low, high))
    }

    /// The larger of each pair of lanes.
    #[inline]
    pub fn max(self, other: Lanes) -> Lanes {
        self.zip(other, f32::max)
    }

    /// The smaller of each pair of lanes.
    #[inline]
    pub fn min(self, other: Lanes) -> Lanes {
        self.zip(other, f32::min)
    }

    /// `(1 - t) self + t other`.
    #[inline]
    pub fn lerp(self, other: Lanes, t: f32) -> Lanes {
        self * (1.0 - t) + other * t
    }
}

impl From<f32> for Lanes {
    #[inline]
    fn from(value: f32) -> Lanes {
        Lanes::splat(value)
    }
}

impl Index<usize> for Lanes {
    type Output = f32;
    #[inline]
    fn index(&self, lane: usize) -> &f32 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for Lanes {
    #[inline]
    fn index_mut(&mut self, lane: usize) -> &mut f32 {
        &mut self.0[lane]
    }
}

impl Neg for Lanes {
    type Output = Lanes;
    #[inline]
    fn neg(self) -> Lanes {
        self.map(|v| -v)
    }
}

impl std::iter::Sum for Lanes {
    fn sum<I: Iterator<Item = Lanes>>(lanes: I) -> Lanes {
        lanes.fold(Lanes::ZERO, |sum, l| sum + l)
    }
}

/// Spells one operator for lanes and lanes, lanes and a number, a number and lanes, and the two assignments.
macro_rules! lane_operator {
    ($trait:ident, $method:ident, $assign_trait:ident, $assign:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Lanes;
            #[inline]
            fn $method(self, other: Lanes) -> Lanes {
                self.zip(other, |a, b| a $op b)
            }
        }
        impl $trait<f32> for Lanes {
            type Output = Lanes;
            #[inline]
            fn $method(self, other: f32) -> Lanes {
                self.map(|a| a $op other)
            }
        }
        impl $trait<Lanes> for f32 {
            type Output = Lanes;
            #[inline]
            fn $method(self, other: Lanes) -> Lanes {
                other.map(|b| self $op b)
            }
        }
        impl $assign_trait for Lanes {
            #[inline]
            fn $assign(&mut self, other: Lanes) {
                *self = *self $op other;
            }
        }
        impl $assign_trait<f32> for Lanes {
            #[inline]
            fn $assign(&mut self, other: f32) {
                *self = *self $op other;
            }
        }
    };
}

lane_operator!(Add, add, AddAssign, add_assign, +);
lane_operator!(Sub, sub, SubAssign, sub_assign, -);
lane_operator!(Mul, mul, MulAssign, mul_assign, *);
lane_operator!(Div, div, DivAssign, div_assign, /);
