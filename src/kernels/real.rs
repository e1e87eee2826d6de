//! The two number types a twin is compiled for.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number: `f32` as on the GPU, `f64` as the reference.
pub trait Real:
    Copy
    + PartialOrd
    + Send
    + Sync
    + 'static
    + std::fmt::Debug
    + bytemuck::Pod
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// Nearest number of this type.
    fn from_f64(value: f64) -> Self;

    /// The same number in f64, exactly.
    fn to_f64(self) -> f64;

    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;

    /// The greater of two numbers; a NaN is dropped.
    fn max(self, other: Self) -> Self;

    /// The number of greater magnitude, without its sign; NaN counts as the greatest, so that it is never lost.
    fn max_magnitude(self, other: Self) -> Self;
}

macro_rules! real {
    ($real:ty, $magnitude:expr) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }

            #[inline(always)]
            fn max_magnitude(self, other: Self) -> Self {
                Self::from_bits((self.to_bits() & $magnitude).max(other.to_bits() & $magnitude))
            }
        }
    };
}

real!(f32, 0x7fff_ffff);
real!(f64, 0x7fff_ffff_ffff_ffff);
