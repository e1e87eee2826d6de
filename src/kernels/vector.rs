//! Vectors of three components. Twin of `kernels/vector.wgsl`.
//!
//! The vectors are arrays of any [`Real`], because `glam` has no vector type for both kinds of
//! numbers.

use super::Real;

#[inline(always)]
pub(crate) fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn scaled<T: Real>(v: [T; 3], factor: T) -> [T; 3] {
    [v[0] * factor, v[1] * factor, v[2] * factor]
}

#[inline(always)]
pub(crate) fn sum<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn difference<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// One value per axis. Unlike `map` of an array, this function is inlined in every build.
#[inline(always)]
pub(crate) fn each<R>(of_axis: impl Fn(usize) -> R) -> [R; 3] {
    [of_axis(0), of_axis(1), of_axis(2)]
}
