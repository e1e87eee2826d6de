//! The finest level of an f64 hierarchy on the CPU.
//!
//! The stiffness is not copied: it is read from the network that the caller keeps, and scaled as it
//! is read. A mesh of millions of tets has two such networks, whose scaled stiffness would be a
//! tenth of its memory. Rows with held neighbours are copied. They are few, and their springs do
//! not stand together in the network.

use std::sync::Arc;

use rayon::prelude::*;

use crate::backend::packed::{change_of, pack_constraint, power_of_two};
use crate::backend::{NetworkData, WholeNetwork};
use crate::constraint::Constraint;
use crate::kernels::constraint::limited;
use crate::kernels::row::{DoubleRows, residual_of};
use crate::mesh::csr::Csr;

/// Least number of rows in a task.
const ROWS: usize = 4096;

/// The rows that move, in f64 and without loads. Their numbers are those that
/// [`Packed`](crate::backend::packed::Packed) would have, to the bit.
pub(super) struct Finest {
    /// The neighbours that move, of each row.
    graph: Arc<Csr>,
    whole: WholeNetwork,
    /// One over the total stiffness of each row `[n_rows]`, 0 for a row without stiffness.
    scale: Vec<f64>,
    /// Whether a row has no stiffness. Such a vertex does not move.
    loose: Vec<bool>,
    /// The rows with held neighbours or an anchor, ascending.
    copied: Vec<CopiedRow>,
    /// The springs of these rows, over the row's total stiffness.
    scaled: Vec<f64>,
    /// The rows that may not move freely, ascending, with their constraints. Most rows are free.
    limited: Vec<(u32, [f64; 4])>,
    inverse_length: Vec<f64>,
    /// Unit of `inverse_length`, in the caller's unit.
    inverse_length_unit: f64,
}

/// A row whose springs are copied.
struct CopiedRow {
    row: u32,
    /// Where its springs begin in [`Finest::scaled`].
    first: u32,
    /// Its anchor over its total stiffness.
    anchor: f64,
}

impl Finest {
    /// - `network`: the rows that move
    /// - `whole`: the network with these rows
    pub(super) fn new(network: &NetworkData, whole: &WholeNetwork) -> Self {
        let graph = Arc::clone(network.graph);
        let total = |row: usize| network.stiffness[graph.range(row)].iter().sum::<f64>() + network.anchor[row];
        let rows = (0..graph.n_rows()).into_par_iter().with_min_len(ROWS);
        let totals: Vec<f64> = rows.map(total).collect();
        // Equality, not `total > 0`: a NaN must reach the result, where the measure finds it.
        let loose: Vec<bool> = totals.iter().map(|&total| total == 0.0).collect();
        let scale = |(&total, &loose): (&f64, &bool)| if loose { 0.0 } else { total.recip() };
        let scale: Vec<f64> = totals.iter().zip(&loose).map(scale).collect();
        let (mut copied, mut scaled) = (Vec::new(), Vec::new());
        let is_copied = |&row: &usize| {
            let [moving, all] = [graph.range(row).len(), whole.range(row).len()];
            assert!(moving <= all, "the rows are rows of the network");
            moving < all || network.anchor[row] != 0.0
        };
        for row in (0..graph.n_rows()).filter(is_copied) {
            let anchor = network.anchor[row] * scale[row];
            copied.push(CopiedRow { row: row as u32, first: scaled.len() as u32, anchor });
            scaled.extend(network.stiffness[graph.range(row)].iter().map(|stiffness| stiffness * scale[row]));
        }
        // A growing list may hold twice the memory.
        copied.shrink_to_fit();
        scaled.shrink_to_fit();
        let inverse_length_unit = power_of_two(network.inverse_length.iter().copied().fold(0.0, f64::max));
        let mut finest = Self {
            inverse_length: network.inverse_length.iter().map(|&l| l / inverse_length_unit).collect(),
            whole: whole.clone(),
            copied,
            scaled,
            limited: Vec::new(),
            loose,
            inverse_length_unit,
            graph,
            scale,
        };
        finest.constrain(network.constraint);
        finest
    }

    pub(super) fn n_rows(&self) -> usize {
        self.scale.len()
    }

    /// Replaces the constraints `[n_rows]`.
    pub(super) fn constrain(&mut self, constraint: &[Constraint]) {
        assert_eq!(constraint.len(), self.n_rows(), "one constraint per row");
        let of_row = |(&constraint, &loose): (&Constraint, &bool)| if loose { Constraint::Held } else { constraint };
        let rows = (0..).zip(constraint.iter().zip(&self.loose).map(of_row));
        let limited = rows.filter(|(_, constraint)| *constraint != Constraint::Free);
        self.limited = limited.map(|(row, constraint)| (row, pack_constraint(&constraint))).collect();
    }

    pub(super) fn inverse_length(&self) -> &[f64] {
        &self.inverse_length
    }

    /// The rows from `first` on, with the loads of `N / 3` designs `[n_rows]`; see
    /// [`Rows`](crate::kernels::row::Rows). No load has an anchor.
    pub(super) fn rows_from<'a, const N: usize>(&'a self, first: usize, load: &'a [[f64; N]]) -> RowsFrom<'a, N> {
        fn from<T>(rows: &[T], number: impl Fn(&T) -> u32, first: usize) -> &[T] {
            &rows[rows.partition_point(|row| (number(row) as usize) < first)..]
        }
        let limited = from(&self.limited, |(row, _)| *row, first);
        RowsFrom { finest: self, load, limited, copied: from(&self.copied, |row| row.row, first) }
    }

    /// The largest change of a design in shortest edges; see [`change_of`].
    pub(super) fn change_of(&self, squared: f64, load_unit: f64) -> f64 {
        change_of(squared, load_unit, self.inverse_length_unit)
    }
}

/// Consecutive rows, with the loads of `N / 3` designs.
pub(super) struct RowsFrom<'a, const N: usize> {
    finest: &'a Finest,
    load: &'a [[f64; N]],
    /// Those of [`Finest::limited`] that are still to come.
    limited: &'a [(u32, [f64; 4])],
    /// Those of [`Finest::copied`] that are still to come.
    copied: &'a [CopiedRow],
}

impl<const N: usize> DoubleRows<N> for RowsFrom<'_, N> {
    #[inline(always)]
    fn load(&self, row: usize) -> [f64; N] {
        self.load[row]
    }

    #[inline(always)]
    fn residual(&mut self, e: &[[f64; N]], row: usize) -> [f64; N] {
        let Finest { graph, whole, scale, .. } = self.finest;
        let (columns, load) = (graph.row(row).iter(), self.load[row]);
        match self.copied {
            [next, left @ ..] if next.row as usize == row => {
                self.copied = left;
                let springs = columns.zip(&self.finest.scaled[next.first as usize..]);
                residual_of(springs.map(|(&column, &stiffness)| (column, stiffness)), load, next.anchor, e, row)
            }
            _ => {
                let (stiffness, scale) = (&whole.stiffness[whole.range(row)], scale[row]);
                let springs = columns.zip(stiffness).map(|(&column, &stiffness)| (column, stiffness * scale));
                residual_of(springs, load, 0.0, e, row)
            }
        }
    }

    #[inline(always)]
    fn project(&mut self, row: usize, v: [f64; N]) -> [f64; N] {
        match self.limited {
            [(next, constraint), left @ ..] if *next as usize == row => {
                self.limited = left;
                limited(constraint, v)
            }
            _ => v,
        }
    }
}
