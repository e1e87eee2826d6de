//! The coarse levels of a multigrid cycle, in one list of steps. Twin of
//! `kernels/coarse_cycle.wgsl`.
//!
//! The arrays of all levels are joined, finest level first. A row and a column are places in the
//! joined arrays.

use bytemuck::{Pod, Zeroable};

use super::row::Rows;
use super::transfer::Weights;
use super::{Real, defect, first_sweep, relax_sweep, transfer};

/// Invocations of the kernel's only workgroup. An invocation takes every 256th row of a step.
pub const LANES: usize = 256;

/// Kinds of steps.
pub mod kind {
    /// [`first_sweep`](super::first_sweep) from the step's half of the corrections to the other.
    pub const FIRST_SWEEP: u32 = 0;
    /// [`relax_sweep`](super::relax_sweep) from the step's half of the corrections to the other.
    pub const RELAX_SWEEP: u32 = 1;
    /// [`defect`](super::defect) of the step's half, written to the other.
    pub const DEFECT: u32 = 2;
    /// [`transfer`](super::transfer) of the defect of the level above these levels to a load.
    pub const RECEIVE: u32 = 3;
    /// [`transfer`](super::transfer) of the defect in the step's half to the load of the next
    /// coarser level, whose rows these are.
    pub const RESTRICT: u32 = 4;
    /// [`transfer`](super::transfer) of the next coarser level's correction, in the first half, to
    /// the correction in the step's half.
    pub const PROLONG: u32 = 5;
}

/// Parameters of the dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of steps.
    pub n_steps: u32,
    /// Rows of all levels together.
    pub n_rows: u32,
}

/// A step: one pass over the rows of a level.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Step {
    /// A [`kind`].
    pub kind: u32,
    /// First row of the level.
    pub first_row: u32,
    /// Number of the level's rows.
    pub n_rows: u32,
    /// Which half of the corrections the step begins with: 0 or 1.
    pub half: u32,
    /// Factor of the residual in a sweep, without unit.
    pub relaxation: f32,
    /// Factor of the last change in a sweep, without unit.
    pub momentum: f32,
}

/// The networks of the levels, and the transfers to them.
#[derive(Clone, Copy, Debug)]
pub struct Joined<'a, T> {
    /// The springs of all levels `[n_rows]`. The load is not read: `run` has one.
    pub springs: Rows<'a, T>,
    /// Weights of the defects of the next finer level in each load `[n_rows]`.
    pub to_load: Weights<'a, T>,
    /// Weights of the corrections of the next coarser level in each correction `[n_rows]`. Rows of
    /// the coarsest level are empty.
    pub to_correction: Weights<'a, T>,
}

/// Runs the steps, each with the twin of the kernel that does the same on a single level.
///
/// - `finer`: defect of the level above these levels, in the unit of a displacement
/// - `load` `[n_rows]`: the fourth component, the anchor over the row's total, does not change
/// - `e` `[2][n_rows]`: the halves of the corrections, in the unit of a displacement; the fourth
///   component is 0
pub fn run<T: Real>(steps: &[Step], joined: &Joined<T>, finer: &[[T; 4]], load: &mut [[T; 4]], e: [&mut [[T; 4]]; 2]) {
    let Joined { springs, to_load, to_correction } = joined;
    let [first_half, second_half] = e;
    for step in steps {
        let first = step.first_row as usize;
        let rows = first..first + step.n_rows as usize;
        let [relaxation, momentum] = [step.relaxation, step.momentum].map(|factor| T::from_f64(f64::from(factor)));
        let correction = if step.kind == kind::PROLONG { first_half.to_vec() } else { Vec::new() };
        let (now, other): (&mut [_], &mut [_]) = match step.half {
            0 => (&mut *first_half, &mut *second_half),
            _ => (&mut *second_half, &mut *first_half),
        };
        match step.kind {
            kind::FIRST_SWEEP => {
                now[rows.clone()].fill([T::ZERO; 4]);
                first_sweep::run(first, &Rows { load, ..*springs }, relaxation, &mut other[rows]);
            }
            kind::RELAX_SWEEP => {
                relax_sweep::run(first, &Rows { load, ..*springs }, relaxation, momentum, now, &mut other[rows]);
            }
            kind::DEFECT => defect::run(first, &Rows { load, ..*springs }, now, &mut other[rows]),
            kind::RECEIVE => transfer::run(first, to_load, springs.constraint, T::ZERO, finer, &mut load[rows]),
            kind::RESTRICT => transfer::run(first, to_load, springs.constraint, T::ZERO, now, &mut load[rows]),
            _ => transfer::run(first, to_correction, springs.constraint, T::ONE, &correction, &mut now[rows]),
        }
    }
}
