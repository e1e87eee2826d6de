//! The host's part of `kernels/place.wgsl`: the number of workgroups of a dispatch.

/// Number of workgroups in x and y for so many invocations. They fill x first, so the last row in y
/// may have more invocations than needed.
///
/// - `size`: invocations of a workgroup, not 0
/// - `most`: most workgroups in one dimension, not 0
pub fn workgroups(n_invocations: u32, size: u32, most: u32) -> (u32, u32) {
    let groups = n_invocations.div_ceil(size);
    let x = groups.min(most);
    (x, groups.div_ceil(x.max(1)))
}
