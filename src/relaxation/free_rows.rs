//! The free part of a network: the vertices that move.
//!
//! The vertices keep the order of the network ([`crate::mesh::Order`] numbers neighbours closely).

use std::sync::Arc;

use super::Network;
use crate::mesh::csr::Csr;

/// The vertices of a network that may move and have springs, as a network of their own, which a
/// device sweeps.
///
/// The corrections of all other vertices are zero. Springs to them become anchors, so the
/// equilibrium does not change.
pub struct FreeRows {
    /// The network of these vertices.
    pub network: Network,
    /// Index in the whole network of each vertex.
    pub vertices: Vec<u32>,
}

impl FreeRows {
    /// The free part of `whole`.
    pub fn new(whole: &Network) -> Self {
        let vertices: Vec<u32> = (0..whole.len() as u32).filter(|&row| whole.moves(row as usize)).collect();
        let mut place = vec![u32::MAX; whole.len()];
        vertices.iter().zip(0..).for_each(|(&vertex, row)| place[vertex as usize] = row);
        let n_entries = vertices.iter().map(|&vertex| whole.graph.row(vertex as usize).len()).sum();
        let mut row_start = Vec::with_capacity(vertices.len() + 1);
        let (mut entries, mut stiffness) = (Vec::with_capacity(n_entries), Vec::with_capacity(n_entries));
        let mut anchor = Vec::with_capacity(vertices.len());
        row_start.push(0);
        for &vertex in &vertices {
            let vertex = vertex as usize;
            let mut tied = whole.anchor[vertex];
            for (&neighbour, &k) in whole.graph.row(vertex).iter().zip(&whole.stiffness[whole.graph.range(vertex)]) {
                match place[neighbour as usize] {
                    u32::MAX => tied += k,
                    row => {
                        entries.push(row);
                        stiffness.push(k);
                    }
                }
            }
            row_start.push(entries.len() as u32);
            anchor.push(tied);
        }
        let pick = |vertex: &u32| whole.constraint[*vertex as usize];
        let constraint = vertices.iter().map(pick).collect();
        let inverse_length = vertices.iter().map(|&vertex| whole.inverse_length[vertex as usize]).collect();
        let graph = Arc::new(Csr { row_start, entries });
        Self { network: Network::from_rows(graph, stiffness, anchor, constraint, inverse_length), vertices }
    }
}
