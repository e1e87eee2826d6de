//! What the kernels that walk the rows of a spring network share; twin of `kernels/row.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;

/// One spring of a row as the GPU stores it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Entry {
    /// The neighbour.
    pub column: u32,
    /// Stiffness of the spring to it, `>= 0`.
    pub stiffness: f32,
}

/// What the fourth component of a constraint says of the other three.
pub mod kind {
    /// Nothing: the vertex moves freely.
    pub const FREE: f64 = 0.0;
    /// Nothing: the vertex does not move.
    pub const HELD: f64 = 1.0;
    /// They are the unit normal of the plane the vertex moves in.
    pub const IN_PLANE: f64 = 2.0;
    /// They are the unit direction the vertex moves along.
    pub const ON_LINE: f64 = 3.0;
}

/// A spring network as the twins read it.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a, T> {
    /// Where each row starts in `columns` and `stiffness` `[n_vertices + 1]`.
    pub row_start: &'a [u32],
    /// Neighbours `[n_entries]`.
    pub columns: &'a [u32],
    /// Stiffness of the spring to each neighbour `[n_entries]`, `>= 0`; only ratios within a row matter.
    pub stiffness: &'a [T],
    /// Unit normal or direction, and a [`kind`] `[n_vertices]`.
    pub constraint: &'a [[T; 4]],
    /// Load, a displacement, and in the fourth component the anchor, a stiffness `[n_vertices]`.
    pub load: &'a [[T; 4]],
}

/// Residual of a row: `(sum_j k_ij (e_j - e_i) - anchor_i e_i) / (sum_j k_ij + anchor_i) + load_i`.
///
/// - `e` `[n_vertices]`: correction to the displacement; the fourth component is not used
///
/// Zero in a row without stiffness. Entries are added in CSR order. Differences rather than a weighted mean: where `e`
/// is smooth the mean of the neighbours would cancel against `e_i` in f32.
///
/// Source: Jacobi's method for the equilibrium of linear springs (Batina 1990), in residual form.
#[inline(always)]
pub fn residual<T: Real>(rows: &Rows<T>, e: &[[T; 4]], row: usize) -> [T; 3] {
    let own = e[row];
    let range = rows.row_start[row] as usize..rows.row_start[row + 1] as usize;
    // Four components, of which one is idle: they fill whole vector registers.
    let mut sum = [T::ZERO; 4];
    let mut total = T::ZERO;
    for (&column, &stiffness) in rows.columns[range.clone()].iter().zip(&rows.stiffness[range]) {
        let other = &e[column as usize];
        for axis in 0..4 {
            sum[axis] = sum[axis] + stiffness * (other[axis] - own[axis]);
        }
        total = total + stiffness;
    }
    let [x, y, z, anchor] = rows.load[row];
    total = total + anchor;
    // Equality, not `total > 0`: a NaN must go on into the result, where the measure finds it.
    if total == T::ZERO {
        return [T::ZERO; 3];
    }
    [
        (sum[0] - anchor * own[0]) / total + x,
        (sum[1] - anchor * own[1]) / total + y,
        (sum[2] - anchor * own[2]) / total + z,
    ]
}

/// The part of a vector its vertex may follow: all of it, none, without its component along the normal, or only its
/// component along the direction.
#[inline(always)]
pub fn project<T: Real>(constraint: &[T; 4], v: [T; 3]) -> [T; 3] {
    let [x, y, z, of_kind] = *constraint;
    let along = x * v[0] + y * v[1] + z * v[2];
    if of_kind == T::from_f64(kind::FREE) {
        return v;
    }
    if of_kind == T::from_f64(kind::IN_PLANE) {
        return [v[0] - along * x, v[1] - along * y, v[2] - along * z];
    }
    if of_kind == T::from_f64(kind::ON_LINE) {
        return [along * x, along * y, along * z];
    }
    [T::ZERO; 3]
}
