//! Arithmetic on some numbers at once, in plain code that compilers turn into vectors, or by the vectors of an instruction set: the same bits.

use std::ops::{Add, Div, Mul, Sub};
use steradian_bvh::fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x8};

/// Numbers side by side.
pub(super) trait SideBySide:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The larger ones, and those of `o` where either is NaN; one instruction, unlike `f32::max`.
    fn larger(self, o: Self) -> Self;
    /// Square roots.
    fn root(self) -> Self;
    /// Absolute values.
    fn magnitude(self) -> Self;
    /// `yes` where this is greater than `limit`, else `no`.
    fn where_above(self, limit: Self, yes: Self, no: Self) -> Self;
}

impl<S: Simd> SideBySide for f32x8<S> {
    #[inline(always)]
    fn larger(self, o: Self) -> Self {
        // The x86 instruction returns its second operand if either is NaN.
        if cfg!(any(target_arch = "x86", target_arch = "x86_64")) { self.max(o) } else { self.where_above(o, self, o) }
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn where_above(self, limit: Self, yes: Self, no: Self) -> Self {
        self.simd_gt(limit).select(yes, no)
    }
}

/// Numbers side by side in an array.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub(super) struct Many<const N: usize>(pub [f32; N]);

impl<const N: usize> Many<N> {
    /// The same number everywhere.
    #[inline(always)]
    pub fn of(x: f32) -> Self {
        Self([x; N])
    }

    /// Some of eight, from `first` on.
    #[inline(always)]
    pub fn part(v: &[f32; 8], first: usize) -> Self {
        let mut out = Self([0.0; N]);
        out.0.copy_from_slice(&v[first..first + N]);
        out
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = self;
        for i in 0..N {
            out.0[i] = f(self.0[i]);
        }
        out
    }

    #[inline(always)]
    fn with(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        for i in 0..N {
            out.0[i] = f(self.0[i], o.0[i]);
        }
        out
    }
}

impl<const N: usize> SideBySide for Many<N> {
    #[inline(always)]
    fn larger(self, o: Self) -> Self {
        self.with(
            o,
            #[inline(always)]
            |a, b| if a > b { a } else { b },
        )
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.map(f32::sqrt)
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        self.map(f32::abs)
    }

    #[inline(always)]
    fn where_above(self, limit: Self, yes: Self, no: Self) -> Self {
        let mut out = no;
        for i in 0..N {
            out.0[i] = if self.0[i] > limit.0[i] { yes.0[i] } else { no.0[i] };
        }
        out
    }
}

macro_rules! lane_by_lane {
    ($($operator:ident $method:ident $symbol:tt),*) => {$(
        impl<const N: usize> $operator for Many<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.with(
                    o,
                    #[inline(always)]
                    |a, b| a $symbol b,
                )
            }
        }
    )*};
}
lane_by_lane!(Add add +, Sub sub -, Mul mul *, Div div /);
