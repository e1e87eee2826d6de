//! The two number types of a twin.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number: `f32` for the GPU's precision, `f64` for the reference.
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
    /// Unit roundoff, as in [`f64::EPSILON`].
    const EPSILON: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;

    /// The same number in f64. The conversion is exact.
    fn to_f64(self) -> f64;

    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;

    /// The greater of two numbers. If one is a NaN, the other is returned.
    fn max(self, other: Self) -> Self;

    /// The greater of two magnitudes. A NaN counts as the greatest, so it is never lost.
    fn max_magnitude(self, other: Self) -> Self;
}

macro_rules! real {
    ($real:ty, $magnitude:expr) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = <$real>::EPSILON;

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
