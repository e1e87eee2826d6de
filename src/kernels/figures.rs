//! The largest number and the sum of each list of numbers. Twin of `kernels/figures.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::block::{LARGEST, bounded, joined};
use super::convergence::BLOCK;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of lists.
    pub n_lists: u32,
    /// Numbers of a list.
    pub length: u32,
    /// Place of the first list's result.
    pub first: u32,
    /// Not used.
    pub padding: u32,
}

/// The largest number and the sum of a list; [`LARGEST`] where a sum is not finite.
///
/// - `list`: numbers that are not negative, at most [`LARGEST`]
pub fn run(list: &[f64]) -> [f64; 2] {
    let of_lanes = |join: fn(f64, f64) -> f64| {
        let of_lane = move |lane: usize| list.iter().skip(lane).step_by(BLOCK).copied().fold(0.0, join);
        joined((0..BLOCK).map(of_lane), join)
    };
    [of_lanes(f64::max), bounded(of_lanes(|a, b| a + b))]
}

/// A figure as it is used: NaN if a number was not finite.
pub fn finite_or_nan(figure: f64) -> f64 {
    if figure >= LARGEST { f64::NAN } else { figure }
}
