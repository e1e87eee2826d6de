//! What the kernels that walk the rows of a spring network share; twin of `kernels/row.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;

/// One spring of a row as the GPU stores it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Entry {
    /// The neighbour.
    pub column: u32,
    /// Stiffness of the spring to it over its row's total.
    pub stiffness: f32,
}

/// A spring network as the twins read it.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a, T> {
    /// Where each row starts in `columns` and `stiffness` `[n_vertices + 1]`.
    pub row_start: &'a [u32],
    /// Neighbours `[n_entries]`.
    pub columns: &'a [u32],
    /// Stiffness of the spring to each neighbour over its row's total, anchor included `[n_entries]`.
    pub stiffness: &'a [T],
    /// Unit normal or direction, and a [`kind`](super::constraint::kind) `[n_vertices]`.
    pub constraint: &'a [[T; 4]],
    /// Load, a displacement, and in the fourth component the anchor over its row's total `[n_vertices]`.
    pub load: &'a [[T; 4]],
}

/// Residual of a row: `sum_j k_ij (e_j - e_i) - anchor_i e_i + load_i`, `k` and `anchor` over the row's total.
///
/// - `e` `[n_vertices]`: correction to the displacement; its fourth component is 0, and so is the residual's: with it a
///   compiler fills whole vector registers
///
/// Entries are added in CSR order. Differences rather than a weighted mean: where `e`
/// is smooth the mean of the neighbours would cancel against `e_i` in f32.
///
/// Source: Jacobi's method for the equilibrium of linear springs (Batina 1990), in residual form.
#[inline(always)]
pub fn residual<T: Real>(rows: &Rows<T>, e: &[[T; 4]], row: usize) -> [T; 4] {
    let own = e[row];
    let range = rows.row_start[row] as usize..rows.row_start[row + 1] as usize;
    let mut sum = [T::ZERO; 4];
    for (&column, &stiffness) in rows.columns[range.clone()].iter().zip(&rows.stiffness[range]) {
        let other = &e[column as usize];
        for axis in 0..4 {
            sum[axis] = sum[axis] + stiffness * (other[axis] - own[axis]);
        }
    }
    let [x, y, z, anchor] = rows.load[row];
    let load = [x, y, z, T::ZERO];
    for axis in 0..4 {
        sum[axis] = sum[axis] - anchor * own[axis] + load[axis];
    }
    sum
}
