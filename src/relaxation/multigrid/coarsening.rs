//! Coarsening of a network: smoothed prolongation and the Galerkin product.

use std::sync::Arc;

use rayon::prelude::*;

use super::super::Network;
use super::aggregation::{Aggregates, NONE};
use super::rows::by_rows;
use crate::backend::Transfer;
use crate::constraint::Constraint;
use crate::mesh::csr::Csr;

/// The prolongation, which carries a coarse displacement to the fine network. Each vertex takes its
/// aggregate's displacement, smoothed by one Jacobi sweep with relaxation `4 / (3 highest)`. A
/// vertex without strong springs takes its aggregate's displacement as it is.
///
/// - `strong`: the springs of the smoothing sweep
/// - `highest`: largest eigenvalue of the whole network's scaled matrix
///
/// Source: Vanek, Mandel and Brezina (Computing 56, 1996), section 4.
pub(super) fn prolongation(strong: &Network, aggregates: &Aggregates, highest: f64) -> Transfer {
    let relaxation = 4.0 / (3.0 * highest);
    sums_by_rows(strong.len(), aggregates.count, |row, out| {
        let of = |vertex: usize| Some(aggregates.of_vertex[vertex]).filter(|&aggregate| aggregate != NONE);
        let Some(own) = of(row) else { return };
        if strong.graph.row(row).is_empty() {
            return out.add(own, 1.0);
        }
        out.add(own, 1.0 - relaxation);
        for (&neighbour, &k) in strong.graph.row(row).iter().zip(&strong.stiffness[strong.graph.range(row)]) {
            if let Some(aggregate) = of(neighbour as usize) {
                out.add(aggregate, relaxation * k * strong.inverse_total[row]);
            }
        }
    })
}

/// The transpose of a prolongation.
pub(super) fn transpose(transfer: &Transfer, n_columns: usize) -> Transfer {
    let Transfer { sources: Csr { entries, .. }, weights: of_entries } = transfer;
    let mut row_start = vec![0; n_columns + 1];
    entries.iter().for_each(|&column| row_start[column as usize + 1] += 1);
    (0..n_columns).for_each(|column| row_start[column + 1] += row_start[column]);
    let mut next = row_start.clone();
    let (mut sources, mut weights) = (vec![0; entries.len()], vec![0.0; entries.len()]);
    for row in 0..transfer.sources.n_rows() {
        for entry in transfer.sources.range(row) {
            let place = &mut next[entries[entry] as usize];
            sources[*place as usize] = row as u32;
            weights[*place as usize] = of_entries[entry];
            *place += 1;
        }
    }
    Transfer { sources: Csr { row_start, entries: sources }, weights }
}

/// The coarse network `P^T A P`, without constraints.
pub(super) fn galerkin(network: &Network, prolongation: &Transfer, restriction: &Transfer) -> Network {
    let n_coarse = restriction.sources.n_rows();
    let image = sums_by_rows(network.len(), n_coarse, |row, out| {
        out.add_row(prolongation, row, 1.0 / network.inverse_total[row]);
        for (&neighbour, &k) in network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]) {
            out.add_row(prolongation, neighbour as usize, -k);
        }
    });
    let matrix = sums_by_rows(n_coarse, n_coarse, |row, out| {
        let range = restriction.sources.range(row);
        for (&fine, &weight) in restriction.sources.row(row).iter().zip(&restriction.weights[range]) {
            out.add_row(&image, fine as usize, weight);
        }
    });
    as_springs(&matrix)
}

/// A matrix as springs and anchors. The stiffness of a spring is minus the off-diagonal entry, an
/// anchor is the sum of a row.
fn as_springs(matrix: &Transfer) -> Network {
    let n = matrix.sources.n_rows();
    let row_of = |row: usize| matrix.sources.row(row).iter().zip(&matrix.weights[matrix.sources.range(row)]);
    let anchor = (0..n).into_par_iter().map(|row| row_of(row).map(|(_, value)| value).sum()).collect();
    let springs = by_rows(
        n,
        || (),
        |row, (), entries, stiffness| {
            for (&column, &value) in row_of(row).filter(|&(&column, _)| column as usize != row) {
                entries.push(column);
                stiffness.push(-value);
            }
        },
    );
    let constraint = vec![Constraint::Free; n];
    Network::from_rows(Arc::new(springs.sources), springs.weights, anchor, constraint, vec![0.0; n])
}

/// A sparse row under construction.
struct Row {
    columns: Vec<u32>,
    values: Vec<f64>,
    /// Possible index of each column in `columns` `[n_columns]`; valid only if `columns` holds the
    /// column there.
    place: Vec<u32>,
}

impl Row {
    fn add(&mut self, column: u32, value: f64) {
        let place = self.place[column as usize] as usize;
        if self.columns.get(place) == Some(&column) {
            self.values[place] += value;
        } else {
            self.place[column as usize] = self.columns.len() as u32;
            self.columns.push(column);
            self.values.push(value);
        }
    }

    /// Adds a multiple of a matrix row.
    fn add_row(&mut self, matrix: &Transfer, row: usize, factor: f64) {
        for (&column, &weight) in matrix.sources.row(row).iter().zip(&matrix.weights[matrix.sources.range(row)]) {
            self.add(column, factor * weight);
        }
    }
}

/// Builds the rows of a sparse matrix in parallel, each a sum.
fn sums_by_rows(n_rows: usize, n_columns: usize, of_row: impl Fn(usize, &mut Row) + Sync) -> Transfer {
    let empty = || Row { columns: Vec::new(), values: Vec::new(), place: vec![0; n_columns] };
    by_rows(n_rows, empty, |at, row, columns, values| {
        row.columns.clear();
        row.values.clear();
        of_row(at, row);
        columns.extend_from_slice(&row.columns);
        values.extend_from_slice(&row.values);
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::aggregation::strong;
    use super::*;

    /// Four vertices in a row, the last one in a plane, with springs of 1. The weak spring to the
    /// plane joins no vertices. The same displacement everywhere comes from the same coarse
    /// displacement everywhere, so the coarse network has no anchors.
    #[test]
    fn a_vertex_without_strong_springs_follows_its_aggregate() {
        let graph = Arc::new(Csr { row_start: vec![0, 1, 3, 5, 6], entries: vec![1, 0, 2, 1, 3, 2] });
        let mut constraint = vec![Constraint::Free; 4];
        constraint[3] = Constraint::InPlane(DVec3::Y);
        let network = Network::from_rows(graph, vec![1.0; 6], vec![0.0; 4], constraint, vec![1.0; 4]);
        let strong = strong(&network);
        let aggregates = Aggregates::new(&network, &strong);
        assert_eq!(aggregates.of_vertex, [0, 0, 0, 1]);
        let prolongation = prolongation(&strong, &aggregates, 2.0);
        for row in 0..4 {
            let sum: f64 = prolongation.weights[prolongation.sources.range(row)].iter().sum();
            assert!((sum - 1.0).abs() < 1e-15, "row {row}: {sum}");
        }
        let coarse = galerkin(&network, &prolongation, &transpose(&prolongation, 2));
        assert!(coarse.anchor.iter().all(|anchor| anchor.abs() < 1e-15), "{:?}", coarse.anchor);
    }
}
