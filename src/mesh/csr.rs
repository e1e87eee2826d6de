//! Compressed sparse rows: the one storage of idmesh for a list of indices per vertex, edge, face
//! or family.

/// Rows of indices, stored back to back.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Csr {
    /// Start of each row in `entries` `[n_rows + 1]`.
    pub row_start: Vec<u32>,
    /// Entries of all rows, one row after another `[row_start[n_rows]]`.
    pub entries: Vec<u32>,
}

impl Csr {
    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.row_start.len().saturating_sub(1)
    }

    /// The entries of one row.
    pub fn row(&self, row: usize) -> &[u32] {
        &self.entries[self.range(row)]
    }

    /// Range of one row's entries in `entries`.
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.row_start[row] as usize..self.row_start[row + 1] as usize
    }

    /// Collects `(row, entry)` pairs into rows. Within a row, entries keep the order of the pairs.
    pub fn from_pairs(n_rows: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut row_start = vec![0u32; n_rows + 1];
        for (row, _) in pairs.clone() {
            row_start[row as usize + 1] += 1;
        }
        for row in 0..n_rows {
            row_start[row + 1] += row_start[row];
        }
        let mut next = row_start.clone();
        let mut entries = vec![0u32; row_start[n_rows] as usize];
        for (row, entry) in pairs {
            let place = &mut next[row as usize];
            entries[*place as usize] = entry;
            *place += 1;
        }
        Self { row_start, entries }
    }

    /// The inverse of `rows`: row `r` holds all `i` with `rows[i] = r`, ascending.
    pub fn of_rows(n_rows: usize, rows: &[u32]) -> Self {
        Self::from_pairs(n_rows, rows.iter().copied().zip(0..))
    }

    /// The vertices of a graph in breadth-first order, so that neighbours get close numbers
    /// (Cuthill and McKee, 1969).
    ///
    /// Row `i` holds the neighbours of vertex `i`. Each connected part begins with its lowest
    /// vertex.
    ///
    /// - `counts`: whether a row is a vertex of the graph; other rows are left out
    pub fn breadth_first(&self, counts: impl Fn(usize) -> bool) -> Vec<u32> {
        let mut seen = vec![false; self.n_rows()];
        let mut order = Vec::with_capacity(self.n_rows());
        for first in 0..self.n_rows() as u32 {
            let mut next = order.len();
            let mut visit = |row: u32, order: &mut Vec<u32>| {
                if !seen[row as usize] && counts(row as usize) {
                    seen[row as usize] = true;
                    order.push(row);
                }
            };
            visit(first, &mut order);
            while let Some(&row) = order.get(next) {
                self.row(row as usize).iter().for_each(|&neighbour| visit(neighbour, &mut order));
                next += 1;
            }
        }
        order
    }
}
