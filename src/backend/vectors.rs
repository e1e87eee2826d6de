//! Arrays of vectors in the CPU's memory, aligned so that no vector lies across two cache lines.

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};

use crate::kernels::Real;

/// A cache line.
#[repr(C, align(64))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Line([u64; 8]);

/// Vectors of four components `[n]`, aligned to a cache line.
///
/// A sweep gathers vectors one by one and so loads one line for each. In a plain `Vec` every other
/// f64 vector lies across two lines. The alignment saves a fifth of a sweep's time on 819 000 tets.
pub(super) struct Vectors<T> {
    lines: Vec<Line>,
    n: usize,
    of: std::marker::PhantomData<T>,
}

impl<T: Real> Vectors<T> {
    /// `n` vectors of zeros.
    pub(super) fn zero(n: usize) -> Self {
        let n_lines = (n * size_of::<[T; 4]>()).div_ceil(size_of::<Line>());
        Self { lines: vec![Line::zeroed(); n_lines], n, of: std::marker::PhantomData }
    }
}

impl<T: Real> Deref for Vectors<T> {
    type Target = [[T; 4]];

    fn deref(&self) -> &Self::Target {
        &cast_slice(&self.lines)[..self.n]
    }
}

impl<T: Real> DerefMut for Vectors<T> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut cast_slice_mut(&mut self.lines)[..self.n]
    }
}
