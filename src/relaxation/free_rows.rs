//! The free part of a network: the vertices that move.
//!
//! The vertices keep the order of the network ([`crate::mesh::Order`] numbers neighbours closely).

use std::sync::Arc;

use super::Network;
use crate::mesh::csr::Csr;

/// The vertices of a network that may move and have springs, and the springs between them. Networks
/// along the same edges share them where the same vertices move.
#[derive(Clone, Debug)]
pub struct MovingGraph {
    /// The graph of the whole network.
    whole: Arc<Csr>,
    /// Neighbours that move, of each vertex that moves: indices in `vertices`.
    graph: Arc<Csr>,
    /// Index in the whole network of each vertex that moves, ascending.
    vertices: Arc<Vec<u32>>,
}

impl MovingGraph {
    /// The moving graph of a network.
    pub fn new(whole: &Network) -> Self {
        let vertices: Vec<u32> = moving(whole).collect();
        let mut place = vec![u32::MAX; whole.len()];
        vertices.iter().zip(0..).for_each(|(&vertex, row)| place[vertex as usize] = row);
        let places =
            |vertex: &u32| whole.graph.row(*vertex as usize).iter().map(|&neighbour| place[neighbour as usize]);
        let moves = |row: &u32| *row != u32::MAX;
        let n_entries = vertices.iter().map(|vertex| places(vertex).filter(moves).count()).sum();
        let mut row_start = Vec::with_capacity(vertices.len() + 1);
        let mut entries = Vec::with_capacity(n_entries);
        row_start.push(0);
        for vertex in &vertices {
            entries.extend(places(vertex).filter(moves));
            row_start.push(entries.len() as u32);
        }
        let graph = Arc::new(Csr { row_start, entries });
        Self { whole: Arc::clone(&whole.graph), graph, vertices: Arc::new(vertices) }
    }

    /// Whether this is the moving graph of a network.
    fn is_of(&self, whole: &Network) -> bool {
        Arc::ptr_eq(&self.whole, &whole.graph) && moving(whole).eq(self.vertices.iter().copied())
    }
}

/// The vertices of a network that move, ascending.
fn moving(whole: &Network) -> impl Iterator<Item = u32> {
    (0..whole.len() as u32).filter(|&row| whole.moves(row as usize))
}

/// The vertices of a network that may move and have springs, as a network of their own, which a
/// device sweeps.
///
/// The corrections of all other vertices are zero. Springs to them become anchors, so the
/// equilibrium does not change.
pub struct FreeRows {
    /// The network of these vertices.
    pub network: Network,
    /// Index in the whole network of each vertex, ascending.
    pub vertices: Arc<Vec<u32>>,
}

impl FreeRows {
    /// The free part of `whole`.
    pub fn new(whole: &Network) -> Self {
        Self::along(whole, &MovingGraph::new(whole))
    }

    /// The free part of `whole`, which shares the graph of another network if the same vertices
    /// move in both.
    pub(super) fn along(whole: &Network, graph: &MovingGraph) -> Self {
        if !graph.is_of(whole) {
            return Self::new(whole);
        }
        let MovingGraph { graph, vertices, .. } = graph;
        let mut stiffness = Vec::with_capacity(graph.entries.len());
        let mut anchor = Vec::with_capacity(vertices.len());
        for (row, &vertex) in vertices.iter().enumerate() {
            let vertex = vertex as usize;
            let mut tied = whole.anchor[vertex];
            let mut moving = graph.row(row).iter().map(|&column| vertices[column as usize]).peekable();
            for (neighbour, &k) in whole.graph.row(vertex).iter().zip(&whole.stiffness[whole.graph.range(vertex)]) {
                match moving.next_if_eq(neighbour) {
                    Some(_) => stiffness.push(k),
                    None => tied += k,
                }
            }
            anchor.push(tied);
        }
        let pick = |vertex: &u32| whole.constraint[*vertex as usize];
        let constraint = vertices.iter().map(pick).collect();
        let inverse_length = vertices.iter().map(|&vertex| whole.inverse_length[vertex as usize]).collect();
        let network = Network::from_rows(Arc::clone(graph), stiffness, anchor, constraint, inverse_length);
        Self { network, vertices: Arc::clone(vertices) }
    }
}
