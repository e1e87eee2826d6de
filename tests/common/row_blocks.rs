//! How well the rows of a network suit a GPU: what a workgroup must fetch, and how many lanes wait.

use idmesh::mesh::csr::Csr;

/// Rows that a workgroup relaxes together.
const WORKGROUP: usize = 256;

/// Rows whose lanes go on together: they all take as long as the longest row.
const WARP: usize = 32;

/// Figures of the rows of a network that moves on a device.
#[derive(Clone, Copy, Debug)]
pub struct RowBlocks {
    /// Different columns in the rows of each [`WORKGROUP`], over the number of rows.
    pub columns_a_row: f64,
    /// The most of them in one workgroup.
    pub most_columns: usize,
    /// Entries that are no springs if the rows of each [`WARP`] were as long as its longest, as a
    /// share of the springs.
    pub padding: f64,
}

impl RowBlocks {
    /// - `rows`: the neighbours of each row, which are rows too
    pub fn new(rows: &Csr) -> Self {
        let n_rows = rows.n_rows();
        let mut seen_in = vec![usize::MAX; n_rows];
        let starts = (0..n_rows).step_by(WORKGROUP);
        let columns_of = |first: usize| {
            let of_block = &rows.entries[rows.range(first).start..rows.range(n_rows.min(first + WORKGROUP) - 1).end];
            of_block.iter().filter(|&&column| std::mem::replace(&mut seen_in[column as usize], first) != first).count()
        };
        let of_blocks: Vec<usize> = starts.map(columns_of).collect();
        let lengths: Vec<usize> = (0..n_rows).map(|row| rows.row(row).len()).collect();
        let in_warps: usize = lengths.chunks(WARP).map(|warp| WARP * warp.iter().max().unwrap_or(&0)).sum();
        Self {
            columns_a_row: of_blocks.iter().sum::<usize>() as f64 / n_rows as f64,
            most_columns: of_blocks.iter().copied().max().unwrap_or(0),
            padding: in_warps as f64 / rows.entries.len() as f64 - 1.0,
        }
    }
}
