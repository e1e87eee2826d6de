//! A spring network: a graph, its stiffness, and what each vertex may do.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    backend::NetworkData,
    constraint::Constraint,
    mesh::{csr::Csr, edges::VertexGraph},
};

/// Rows per parallel piece: large enough to outweigh scheduling, and fixed, so that sums do not depend on threads.
const ROWS: usize = 2048;

/// Springs along the edges of a graph.
#[derive(Clone, Debug)]
pub struct Network {
    /// Neighbours of each vertex; networks of one mesh may share it.
    pub graph: Arc<Csr>,
    /// Stiffness of each entry of `graph` `[n_entries]`, `>= 0`.
    pub stiffness: Vec<f64>,
    /// Stiffness of the spring that ties each vertex to displacement zero `[n_vertices]`.
    pub anchor: Vec<f64>,
    /// What each vertex may do `[n_vertices]`.
    pub constraint: Vec<Constraint>,
    /// One over each vertex's shortest edge `[n_vertices]`, 0 where it has none.
    pub inverse_length: Vec<f64>,
    /// One over each row's total stiffness `[n_vertices]`, 0 where there is none.
    pub(super) inverse_total: Vec<f64>,
}

impl Network {
    /// Springs along these edges.
    ///
    /// - `edges`, `edge_stiffness`, `edge_length` `[n_edges]`
    /// - `constraint`, `anchor` `[n_vertices]`
    ///
    /// Vertices that no spring connects to a held or anchored one would float; they become held.
    pub fn new(
        graph: &VertexGraph,
        edge_stiffness: &[f64],
        edge_length: &[f64],
        mut constraint: Vec<Constraint>,
        anchor: Vec<f64>,
    ) -> Self {
        let stiffness: Vec<f64> = graph.entry_edge.iter().map(|&edge| edge_stiffness[edge as usize]).collect();
        let of_row = |row: usize| &graph.entry_edge[graph.neighbours.range(row)];
        let inverse_length = (0..constraint.len())
            .map(|row| 1.0 / of_row(row).iter().map(|&edge| edge_length[edge as usize]).fold(f64::INFINITY, f64::min))
            .collect();
        hold_floating(&graph.neighbours, &anchor, &mut constraint);
        Self::from_rows(Arc::clone(&graph.neighbours), stiffness, anchor, constraint, inverse_length)
    }

    /// A network of these rows, in which nothing floats.
    pub(super) fn from_rows(
        graph: Arc<Csr>,
        stiffness: Vec<f64>,
        anchor: Vec<f64>,
        constraint: Vec<Constraint>,
        inverse_length: Vec<f64>,
    ) -> Self {
        let inverse_total = anchor
            .iter()
            .enumerate()
            .map(|(row, anchor)| {
                let total = stiffness[graph.range(row)].iter().sum::<f64>() + anchor;
                if total > 0.0 { 1.0 / total } else { 0.0 }
            })
            .collect();
        Self { graph, stiffness, anchor, constraint, inverse_length, inverse_total }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.constraint.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.constraint.is_empty()
    }

    /// The network as a backend sees it.
    pub fn data(&self) -> NetworkData<'_> {
        NetworkData {
            graph: &self.graph,
            stiffness: &self.stiffness,
            anchor: &self.anchor,
            inverse_length: &self.inverse_length,
            constraint: &self.constraint,
        }
    }

    /// Residual of a displacement `[n_vertices]`, each row divided by its total stiffness and limited to what the vertex
    /// may do: `P ((sum_j k_ij (u_j - u_i) - anchor_i u_i + force_i) / (sum_j k_ij + anchor_i))`, in the unit of `u`.
    pub fn residual(&self, displacement: &[DVec3], force: Option<&[DVec3]>) -> Vec<DVec3> {
        let mut residual = vec![DVec3::ZERO; self.len()];
        residual.par_chunks_mut(ROWS).enumerate().for_each(|(piece, rows)| {
            for (within, out) in rows.iter_mut().enumerate() {
                let row = piece * ROWS + within;
                if self.constraint[row] == Constraint::Held {
                    continue;
                }
                let here = displacement[row];
                let pull: DVec3 = self.graph.row(row).iter().zip(&self.stiffness[self.graph.range(row)]).fold(
                    force.map_or(DVec3::ZERO, |force| force[row]) - self.anchor[row] * here,
                    |sum, (&neighbour, &stiffness)| sum + stiffness * (displacement[neighbour as usize] - here),
                );
                *out = self.constraint[row].limit(pull * self.inverse_total[row]);
            }
        });
        residual
    }

    /// `y = D^-1/2 A D^-1/2 x` on the rows that may move; the others count as zero. Used for the spectrum only.
    ///
    /// - `scale` `[n_vertices]`: see [`Self::scale`]
    pub(super) fn scaled_product(&self, scale: &[f64], x: &[f64], y: &mut [f64]) {
        y.par_chunks_mut(ROWS).enumerate().for_each(|(piece, rows)| {
            for (within, out) in rows.iter_mut().enumerate() {
                let row = piece * ROWS + within;
                let springs = self.graph.row(row).iter().zip(&self.stiffness[self.graph.range(row)]);
                let pull = springs.fold(0.0, |sum, (&neighbour, &stiffness)| {
                    sum + stiffness * (x[neighbour as usize] * scale[neighbour as usize])
                });
                *out = if scale[row] > 0.0 { x[row] - scale[row] * pull } else { 0.0 };
            }
        });
    }

    /// `D^-1/2`, zero in the rows that do not move `[n_vertices]`.
    pub(super) fn scale(&self) -> Vec<f64> {
        (0..self.len()).map(|row| if self.moves(row) { self.inverse_total[row].sqrt() } else { 0.0 }).collect()
    }

    /// Whether a vertex has springs and may move along them.
    pub(super) fn moves(&self, row: usize) -> bool {
        self.constraint[row] != Constraint::Held && self.inverse_total[row] > 0.0
    }
}

fn hold_floating(graph: &Csr, anchor: &[f64], constraint: &mut [Constraint]) {
    let mut tied: Vec<bool> =
        (0..anchor.len()).map(|row| constraint[row] == Constraint::Held || anchor[row] > 0.0).collect();
    let mut open: Vec<u32> = (0..anchor.len() as u32).filter(|&row| tied[row as usize]).collect();
    while let Some(row) = open.pop() {
        for &neighbour in graph.row(row as usize) {
            if !std::mem::replace(&mut tied[neighbour as usize], true) {
                open.push(neighbour);
            }
        }
    }
    constraint
        .iter_mut()
        .zip(tied)
        .filter(|(_, tied)| !tied)
        .for_each(|(constraint, _)| *constraint = Constraint::Held);
}
