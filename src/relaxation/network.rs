//! A spring network: a graph, the stiffness of its springs, and the constraints of its vertices.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    backend::NetworkData,
    constraint::Constraint,
    kernels::residual_double,
    mesh::{csr::Csr, edges::VertexGraph},
};

/// Rows per parallel piece. The piece is large enough to outweigh scheduling. Its size is fixed, so
/// sums do not depend on the number of threads.
const ROWS: usize = 2048;

/// Springs along the edges of a graph.
#[derive(Clone, Debug)]
pub struct Network {
    /// Neighbours of each vertex: `n_vertices` rows. Networks of one mesh may share them.
    pub graph: Arc<Csr>,
    /// Stiffness of the spring of each entry of `graph` `[n_entries]`, `>= 0`. A device in the
    /// CPU's memory shares it.
    pub stiffness: Arc<Vec<f64>>,
    /// Stiffness of each vertex's anchor `[n_vertices]`: a spring to displacement zero.
    pub anchor: Vec<f64>,
    /// Constraint of each vertex `[n_vertices]`.
    pub constraint: Vec<Constraint>,
    /// One over the length of each vertex's shortest edge `[n_vertices]`, 0 for a vertex without
    /// edges.
    pub inverse_length: Vec<f64>,
    /// One over the total stiffness of each row `[n_vertices]`, 0 for a row without stiffness.
    pub(super) inverse_total: Vec<f64>,
}

impl Network {
    /// A network with springs along the edges of `graph`.
    ///
    /// - `edge_stiffness` `[n_edges]`: `>= 0`, only ratios matter; `edge_length` `[n_edges]`: in
    ///   the mesh's unit
    /// - `constraint`, `anchor` `[n_vertices]`
    ///
    /// A vertex that no chain of springs ties to a held or anchored vertex has no equilibrium. Such
    /// vertices become held.
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

    /// A network with these rows. Every vertex must be tied to a held or anchored vertex.
    pub(super) fn from_rows(
        graph: Arc<Csr>,
        stiffness: Vec<f64>,
        anchor: Vec<f64>,
        constraint: Vec<Constraint>,
        inverse_length: Vec<f64>,
    ) -> Self {
        // The springs to held vertices are added as an anchor is, because they are the anchor of
        // the rows that move (see [`super::FreeRows`]). So both have the same totals, to the bit.
        let total = |(row, &anchor): (usize, &f64)| {
            let springs = graph.row(row).iter().zip(&stiffness[graph.range(row)]);
            let (moving, tied) = springs.fold((0.0, anchor), |(moving, tied), (&neighbour, &k)| {
                if constraint[neighbour as usize] == Constraint::Held { (moving, tied + k) } else { (moving + k, tied) }
            });
            moving + tied
        };
        let inverse = |total: f64| if total > 0.0 { 1.0 / total } else { 0.0 };
        let inverse_total = anchor.iter().enumerate().map(|row| inverse(total(row))).collect();
        Self { graph, stiffness: Arc::new(stiffness), anchor, constraint, inverse_length, inverse_total }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.constraint.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.constraint.is_empty()
    }

    /// The network in the layout for a backend.
    pub fn data(&self) -> NetworkData<'_> {
        NetworkData {
            graph: &self.graph,
            stiffness: &self.stiffness,
            anchor: &self.anchor,
            inverse_length: &self.inverse_length,
            constraint: &self.constraint,
        }
    }

    /// The springs of a row: neighbour, and stiffness over the row's total stiffness.
    pub fn springs(&self, row: usize) -> impl Iterator<Item = (u32, f64)> {
        let scale = self.inverse_total[row];
        let stiffness = self.stiffness[self.graph.range(row)].iter();
        self.graph.row(row).iter().zip(stiffness).map(move |(&neighbour, &stiffness)| (neighbour, stiffness * scale))
    }

    /// Residual of a displacement `[n_vertices]`, in the unit of the displacement. Each row is
    /// divided by its total stiffness and projected on the directions of its constraint: `P ((sum_j
    /// k_ij (u_j - u_i) - anchor_i u_i) / (sum_j k_ij + anchor_i) + load_i)`
    ///
    /// - `displacement` `[n_vertices]`: in the mesh's unit
    /// - `load` `[n_vertices]`: forces over the row's total stiffness, in the unit of the
    ///   displacement; see [`Self::loads`]
    pub fn residual(&self, displacement: &[DVec3], load: Option<&[DVec3]>) -> Vec<DVec3> {
        let mut residual = vec![DVec3::ZERO; self.len()];
        residual.par_chunks_mut(ROWS).enumerate().for_each(|(piece, rows)| {
            for (within, out) in rows.iter_mut().enumerate() {
                let row = piece * ROWS + within;
                if self.constraint[row] == Constraint::Held {
                    continue;
                }
                let anchor = self.anchor[row] * self.inverse_total[row];
                let load = load.map(|load| load[row]);
                let pull = residual_double::run(self.springs(row), anchor, load, displacement, row);
                *out = self.constraint[row].limit(pull);
            }
        });
        residual
    }

    /// The loads of forces `[n_vertices]`, times a factor.
    ///
    /// - `force` `[n_vertices]`: in the unit of stiffness times displacement
    pub(super) fn loads(&self, force: &[DVec3], factor: f64) -> Vec<DVec3> {
        let load = |(force, total): (&DVec3, &f64)| *force * factor * *total;
        force.iter().zip(&self.inverse_total).map(load).collect()
    }

    /// `y = D^-1/2 A D^-1/2 x` on the rows that may move; other rows are zero. For the spectrum
    /// only.
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

    /// `D^-1/2` `[n_vertices]`, zero in rows that do not move.
    pub(super) fn scale(&self) -> Vec<f64> {
        (0..self.len()).map(|row| if self.moves(row) { self.inverse_total[row].sqrt() } else { 0.0 }).collect()
    }

    /// Whether a vertex has springs and is not held.
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
