//! Blocks of 256 numbers in f64, of which a workgroup finds one. Twin of `kernels/block.wgsl`.

use super::convergence::BLOCK;

/// Numbers that one invocation takes.
const SHARE: usize = 16;

/// Stands for numbers that are not finite.
pub const LARGEST: f64 = 1.7e308;

/// A number that is not negative, or [`LARGEST`] if it is not finite.
#[inline(always)]
pub fn bounded(number: f64) -> f64 {
    if number <= LARGEST { number } else { LARGEST }
}

/// Joins the numbers of a block in the order of the kernels: each of 16 invocations takes every
/// 16th number, then the first one takes what the others found.
///
/// - `numbers`: at most [`BLOCK`]; those that are missing are zero
pub fn joined(numbers: impl Iterator<Item = f64>, join: impl Fn(f64, f64) -> f64) -> f64 {
    const LANES: usize = BLOCK / SHARE;
    let mut lanes = [0.0; LANES];
    // The first round joins with zero, which changes no number that is not negative.
    numbers.enumerate().for_each(|(at, number)| lanes[at % LANES] = join(lanes[at % LANES], number));
    lanes[1..].iter().fold(lanes[0], |so_far, &other| join(so_far, other))
}
