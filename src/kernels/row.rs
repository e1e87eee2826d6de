//! Rows of a spring network and their residual, shared by several kernels. Twin of
//! `kernels/row.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;

/// One spring of a row in the layout of the GPU.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Entry {
    /// The neighbour at the spring's other end.
    pub column: u32,
    /// Stiffness of the spring over the row's total stiffness.
    pub stiffness: f32,
}

/// A spring network in the layout of the twins, with the loads of one or several designs.
///
/// A row's vectors are `N` numbers: with `N = 4` three of one design and one more, else three of
/// each of `N / 3` designs, one design after another. A kernel's rows have `N = 4`.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a, T, const N: usize = 4> {
    /// Start of each row in `columns` and `stiffness` `[n_vertices + 1]`.
    pub row_start: &'a [u32],
    /// Neighbour of each entry `[n_entries]`.
    pub columns: &'a [u32],
    /// Stiffness of each entry's spring over its row's total, which includes the anchor
    /// `[n_entries]`.
    pub stiffness: &'a [T],
    /// Constraint of each vertex `[n_vertices]`: unit normal or direction, and a
    /// [`kind`](super::constraint::kind).
    pub constraint: &'a [[T; 4]],
    /// Load of each vertex `[n_vertices]`, in the unit of a displacement. With `N = 4` the fourth
    /// component is the anchor over the row's total.
    pub load: &'a [[T; N]],
    /// Anchor of each vertex over its row's total `[n_vertices]`. Not read with `N = 4`.
    pub anchor: &'a [T],
}

impl<T: Real, const N: usize> Rows<'_, T, N> {
    /// The load of a row; with `N = 4` the fourth component is 0.
    #[inline(always)]
    pub fn load(&self, row: usize) -> [T; N] {
        let mut load = self.load[row];
        if N == 4 {
            load[3] = T::ZERO;
        }
        load
    }

    /// The anchor of a row over the row's total.
    #[inline(always)]
    fn anchor(&self, row: usize) -> T {
        if N == 4 { self.load[row][3] } else { self.anchor[row] }
    }
}

/// Residual of a row: `sum_j k_ij (e_j - e_i) - anchor_i e_i + load_i`. Here `k` and `anchor` are
/// divided by the row's total.
///
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
///
/// With `N = 4` the fourth components of `e` and of the residual are 0. With them a compiler fills
/// whole vector registers.
///
/// Entries are added in CSR order. Differences are summed instead of a weighted mean: where `e` is
/// smooth, the mean of the neighbours would cancel against `e_i` in f32.
///
/// Source: Jacobi's method for the equilibrium of linear springs (Batina 1990), in residual form.
#[inline(always)]
pub fn residual<T: Real, const N: usize>(rows: &Rows<T, N>, e: &[[T; N]], row: usize) -> [T; N] {
    let range = rows.row_start[row] as usize..rows.row_start[row + 1] as usize;
    let springs = rows.columns[range.clone()].iter().zip(&rows.stiffness[range]);
    let springs = springs.map(|(&column, &stiffness)| (column, stiffness));
    residual_of(springs, rows.load(row), rows.anchor(row), e, row)
}

/// [`residual`] of a row however its springs are stored.
///
/// - `springs`: neighbour and stiffness over the row's total, in CSR order
/// - `load`: as [`Rows::load`]
/// - `anchor`: over the row's total
#[inline(always)]
pub fn residual_of<T: Real, const N: usize>(
    springs: impl Iterator<Item = (u32, T)>,
    load: [T; N],
    anchor: T,
    e: &[[T; N]],
    row: usize,
) -> [T; N] {
    let own = e[row];
    let mut sum = [T::ZERO; N];
    for (column, stiffness) in springs {
        let other = &e[column as usize];
        for axis in 0..N {
            sum[axis] = sum[axis] + stiffness * (other[axis] - own[axis]);
        }
    }
    for axis in 0..N {
        sum[axis] = sum[axis] - anchor * own[axis] + load[axis];
    }
    sum
}

/// Rows in f64, one after another. The CPU stores the rows of its hierarchies otherwise than the
/// GPU; with this trait both have the same twins.
///
/// Rows are asked for in ascending order, none left out: each for its residual and its projection,
/// or each for its projection alone.
pub trait DoubleRows<const N: usize> {
    /// As [`Rows::load`].
    fn load(&self, row: usize) -> [f64; N];

    /// As [`residual`].
    fn residual(&mut self, e: &[[f64; N]], row: usize) -> [f64; N];

    /// [`project`] with the row's constraint.
    fn project(&mut self, row: usize, v: [f64; N]) -> [f64; N];
}

impl<const N: usize> DoubleRows<N> for Rows<'_, f64, N> {
    #[inline(always)]
    fn load(&self, row: usize) -> [f64; N] {
        Rows::load(self, row)
    }

    #[inline(always)]
    fn residual(&mut self, e: &[[f64; N]], row: usize) -> [f64; N] {
        residual(self, e, row)
    }

    #[inline(always)]
    fn project(&mut self, row: usize, v: [f64; N]) -> [f64; N] {
        project(&self.constraint[row], v)
    }
}
