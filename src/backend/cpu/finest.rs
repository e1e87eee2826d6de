//! The finest level of an f64 hierarchy on the CPU.
//!
//! The stiffness is not copied: it is read from the network that the caller keeps, and scaled as it
//! is read. A mesh of millions of tets has two such networks, whose scaled stiffness would be a
//! tenth of its memory. Rows with held neighbours are copied. They are few, and their springs do
//! not stand together in the network.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::backend::packed::{pack_constraint, power_of_two};
use crate::backend::{NetworkData, WholeNetwork};
use crate::constraint::Constraint;
use crate::kernels::constraint::project;
use crate::kernels::row::{DoubleRows, residual_of};
use crate::mesh::csr::Csr;

/// Least number of rows in a task.
const ROWS: usize = 4096;

/// The rows that move, with load and correction in f64. Their numbers are those that
/// [`Packed`](crate::backend::packed::Packed) would have, to the bit.
pub(super) struct Finest {
    /// The neighbours that move, of each row.
    graph: Arc<Csr>,
    whole: WholeNetwork,
    /// One over the total stiffness of each row `[n_rows]`, 0 for a row without stiffness.
    scale: Vec<f64>,
    /// Whether a row has no stiffness. Such a vertex does not move.
    loose: Vec<bool>,
    /// The rows with held neighbours, ascending, and where each begins in `scaled`.
    beside_held: Vec<(u32, u32)>,
    /// The springs of these rows, over the row's total stiffness.
    scaled: Vec<f64>,
    /// The rows that may not move freely, ascending, with their constraints. Most rows are free.
    limited: Vec<(u32, [f64; 4])>,
    /// The load of each row, and its anchor over its total stiffness `[n_rows]`.
    load: Vec<[f64; 4]>,
    inverse_length: Vec<f64>,
    /// Unit of `inverse_length`, in the caller's unit.
    inverse_length_unit: f64,
    /// Unit of `load` and of the correction, in the caller's unit.
    load_unit: f64,
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
        let (mut beside_held, mut scaled) = (Vec::new(), Vec::new());
        let is_beside_held = |&row: &usize| {
            let [moving, all] = [graph.range(row).len(), whole.range(row).len()];
            assert!(moving <= all, "the rows are rows of the network");
            moving < all
        };
        for row in (0..graph.n_rows()).filter(is_beside_held) {
            beside_held.push((row as u32, scaled.len() as u32));
            scaled.extend(network.stiffness[graph.range(row)].iter().map(|stiffness| stiffness * scale[row]));
        }
        // A growing list may hold twice the memory.
        beside_held.shrink_to_fit();
        scaled.shrink_to_fit();
        let inverse_length_unit = power_of_two(network.inverse_length.iter().copied().fold(0.0, f64::max));
        let anchors = network.anchor.iter().zip(&scale);
        let mut finest = Self {
            load: anchors.map(|(anchor, scale)| [0.0, 0.0, 0.0, anchor * scale]).collect(),
            inverse_length: network.inverse_length.iter().map(|&l| l / inverse_length_unit).collect(),
            whole: whole.clone(),
            beside_held,
            scaled,
            limited: Vec::new(),
            loose,
            inverse_length_unit,
            load_unit: 1.0,
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

    /// Sets the load of a pass `[n_rows]`.
    pub(super) fn start(&mut self, load: &[DVec3]) {
        assert_eq!(load.len(), self.n_rows(), "one load per row");
        let greatest = |greatest: f64, v: &DVec3| greatest.max(v.abs().max_element());
        let rows = load.par_iter().with_min_len(ROWS);
        self.load_unit = power_of_two(rows.fold(|| 0.0, greatest).reduce(|| 0.0, f64::max));
        let scale = self.load_unit.recip();
        self.load.par_iter_mut().zip(load).with_min_len(ROWS).for_each(|(packed, v)| {
            let [x, y, z] = (*v * scale).to_array();
            *packed = [x, y, z, packed[3]];
        });
    }

    pub(super) fn inverse_length(&self) -> &[f64] {
        &self.inverse_length
    }

    /// The rows from `first` on.
    pub(super) fn rows_from(&self, first: usize) -> RowsFrom<'_> {
        fn from<T>(rows: &[(u32, T)], first: usize) -> &[(u32, T)] {
            &rows[rows.partition_point(|&(row, _)| (row as usize) < first)..]
        }
        RowsFrom { finest: self, limited: from(&self.limited, first), beside_held: from(&self.beside_held, first) }
    }

    /// The largest change in shortest edges, from its square in the units here.
    pub(super) fn change(&self, squared: f64) -> f64 {
        f64::sqrt(squared) * self.load_unit * self.inverse_length_unit
    }

    /// The correction in the caller's unit.
    pub(super) fn correction(&self, e: &[[f64; 4]]) -> Vec<DVec3> {
        let in_unit = |&[x, y, z, _]: &[f64; 4]| DVec3::new(x, y, z) * self.load_unit;
        e.par_iter().with_min_len(ROWS).map(in_unit).collect()
    }
}

/// Consecutive rows.
pub(super) struct RowsFrom<'a> {
    finest: &'a Finest,
    /// Those of [`Finest::limited`] that are still to come.
    limited: &'a [(u32, [f64; 4])],
    /// Those of [`Finest::beside_held`] that are still to come.
    beside_held: &'a [(u32, u32)],
}

impl DoubleRows for RowsFrom<'_> {
    #[inline(always)]
    fn load(&self, row: usize) -> [f64; 4] {
        self.finest.load[row]
    }

    #[inline(always)]
    fn residual(&mut self, e: &[[f64; 4]], row: usize) -> [f64; 4] {
        let Finest { graph, whole, scale, load, .. } = self.finest;
        let columns = graph.row(row).iter();
        match self.beside_held {
            [(next, first), left @ ..] if *next as usize == row => {
                self.beside_held = left;
                let stiffness = &self.finest.scaled[*first as usize..];
                residual_of(columns.zip(stiffness).map(|(&column, &stiffness)| (column, stiffness)), load[row], e, row)
            }
            _ => {
                let (stiffness, scale) = (&whole.stiffness[whole.range(row)], scale[row]);
                let springs = columns.zip(stiffness).map(|(&column, &stiffness)| (column, stiffness * scale));
                residual_of(springs, load[row], e, row)
            }
        }
    }

    #[inline(always)]
    fn project<const N: usize>(&mut self, row: usize, v: [f64; N]) -> [f64; N] {
        match self.limited {
            [(next, constraint), left @ ..] if *next as usize == row => {
                self.limited = left;
                project(constraint, v)
            }
            _ => v,
        }
    }
}
