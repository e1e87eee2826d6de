//! The edges of the tets, the tets around each edge, and the graph of vertices joined by edges.

use std::{ops::Range, sync::Arc};

use rayon::prelude::*;

use super::{csr::Csr, in_pieces};

/// Local vertices of a tet's six local edges.
pub const EDGE: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The edges of a tet mesh.
#[derive(Clone, Debug)]
pub struct TetEdges {
    /// The two vertices of each edge `[n_edges]`, the lower one first, in lexicographic order.
    pub edges: Vec<[u32; 2]>,
    /// Tets around each edge: `n_edges` rows, each entry is `tet * 6 + local edge`.
    pub edge_tets: Csr,
    /// Edges of each tet `[n_tets]`, each stored as `edge * 2 + r`. `r` is 1 if the local edge
    /// begins at the edge's higher vertex, and 0 otherwise.
    pub tet_edges: Vec<[u32; 6]>,
}

impl TetEdges {
    /// Collects the edges of the tets `[n_tets]`.
    pub fn new(n_vertices: usize, tets: &[[u32; 4]]) -> Self {
        let ends = |slot: u32| {
            let tet = tets[slot as usize / 6];
            let [a, b] = EDGE[slot as usize % 6].map(|local| tet[local]);
            (a.min(b), a.max(b), a > b)
        };
        let lowest_of_edges = |tet: &[u32; 4]| EDGE.map(|[a, b]| tet[a].min(tet[b]));
        let lowest: Vec<[u32; 6]> = tets.par_iter().map(lowest_of_edges).collect();
        let by_lowest = Csr::of_rows(n_vertices, lowest.as_flattened());
        drop(lowest);
        // For a range of lowest vertices: the edges, the number of slots of each edge, and the
        // slots (`tet * 6 + local edge`).
        let edges_of = |vertices: Range<usize>| {
            let n_entries = by_lowest.row_start[vertices.end] - by_lowest.row_start[vertices.start];
            let (mut edges, mut lengths) = (Vec::new(), Vec::new());
            let mut entries = Vec::with_capacity(n_entries as usize);
            // The edge's other end in the upper bits, the slot in the lower bits: numbers are
            // sorted faster than pairs.
            let mut row: Vec<u64> = Vec::new();
            for vertex in vertices {
                row.clear();
                row.extend(by_lowest.row(vertex).iter().map(|&slot| u64::from(ends(slot).1) << 32 | u64::from(slot)));
                row.sort_unstable();
                for same in row.chunk_by(|a, b| a >> 32 == b >> 32) {
                    edges.push([vertex as u32, (same[0] >> 32) as u32]);
                    lengths.push(same.len() as u32);
                    entries.extend(same.iter().map(|&pair| pair as u32));
                }
            }
            (edges, lengths, entries)
        };
        let pieces = in_pieces(n_vertices, edges_of);
        let n_edges = pieces.iter().map(|piece| piece.0.len()).sum();
        let mut edges = Vec::with_capacity(n_edges);
        let mut row_start = Vec::with_capacity(n_edges + 1);
        let mut entries = Vec::with_capacity(tets.len() * 6);
        let mut tet_edges = vec![[0; 6]; tets.len()];
        row_start.push(0);
        for (of_piece, lengths, slots) in pieces {
            let mut begin = 0;
            for (edge, length) in (edges.len() as u32..).zip(lengths) {
                let end = begin + length as usize;
                for &slot in &slots[begin..end] {
                    tet_edges[slot as usize / 6][slot as usize % 6] = edge * 2 + ends(slot).2 as u32;
                }
                begin = end;
                row_start.push(row_start[row_start.len() - 1] + length);
            }
            edges.extend(of_piece);
            entries.extend(slots);
        }
        Self { edges, edge_tets: Csr { row_start, entries }, tet_edges }
    }
}

/// A graph of vertices joined by edges. Each entry of its rows knows the edge behind it.
#[derive(Clone, Debug, Default)]
pub struct VertexGraph {
    /// Neighbours of each vertex: `n_vertices` rows. Networks along the same edges share them.
    pub neighbours: Arc<Csr>,
    /// The edge behind each entry of `neighbours` `[n_entries]`.
    pub entry_edge: Vec<u32>,
}

impl VertexGraph {
    /// The graph with these edges `[n_edges]`.
    pub fn new(n_vertices: usize, edges: &[[u32; 2]]) -> Self {
        Self::of_some(n_vertices, edges, |_| true)
    }

    /// The graph with those of the edges `[n_edges]` that count. `entry_edge` holds indices among
    /// all edges.
    pub fn of_some(n_vertices: usize, edges: &[[u32; 2]], counts: impl Fn(usize) -> bool + Clone) -> Self {
        let some = edges.iter().enumerate().filter(move |&(edge, _)| counts(edge));
        let both = some.flat_map(|(edge, &[a, b])| [(a, edge as u32), (b, edge as u32)]);
        let Csr { row_start, entries: entry_edge } = Csr::from_pairs(n_vertices, both);
        // A collected iterator of unknown length would take twice the memory.
        let mut entries = Vec::with_capacity(entry_edge.len());
        for (row, ends) in row_start.windows(2).enumerate() {
            entries.extend(entry_edge[ends[0] as usize..ends[1] as usize].iter().map(|&edge| {
                let [a, b] = edges[edge as usize];
                if a as usize == row { b } else { a }
            }));
        }
        Self { neighbours: Arc::new(Csr { row_start, entries }), entry_edge }
    }
}

/// The edges of these triangles, each once, the lower vertex first, in lexicographic order.
pub fn triangle_edges(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> =
        triangles.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}
