//! The host's side of `kernels/place.wgsl`: how many workgroups give every row an invocation.

/// Number of workgroups in x and y that cover so many invocations. They fill x first; the last row in y may be longer than
/// needed.
///
/// - `size`: invocations of a workgroup, not 0
/// - `most`: most workgroups in one dimension, not 0
pub fn workgroups(n_invocations: u32, size: u32, most: u32) -> (u32, u32) {
    let groups = n_invocations.div_ceil(size);
    let x = groups.min(most);
    (x, groups.div_ceil(x.max(1)))
}
