//! Builds the rows of a sparse matrix in parallel.

use rayon::prelude::*;

use crate::backend::Transfer;
use crate::mesh::{csr::Csr, joined};

/// Rows per parallel piece. The size is fixed, so no result depends on the number of threads.
const ROWS: usize = 1024;

/// Builds the rows of a sparse matrix in parallel.
///
/// - `scratch`: makes what `of_row` uses from row to row
/// - `of_row`: adds the columns and values of a row
pub(super) fn by_rows<S>(
    n_rows: usize,
    scratch: impl Fn() -> S + Sync + Send,
    of_row: impl Fn(usize, &mut S, &mut Vec<u32>, &mut Vec<f64>) + Sync + Send,
) -> Transfer {
    let pieces = (0..n_rows.div_ceil(ROWS)).into_par_iter().map_init(scratch, |scratch, piece| {
        let (mut lengths, mut columns, mut values) = (Vec::with_capacity(ROWS), Vec::new(), Vec::new());
        for row in piece * ROWS..n_rows.min((piece + 1) * ROWS) {
            let before = columns.len();
            of_row(row, scratch, &mut columns, &mut values);
            lengths.push((columns.len() - before) as u32);
        }
        (lengths, (columns, values))
    });
    let (lengths, entries): (Vec<_>, Vec<_>) = pieces.collect::<Vec<_>>().into_iter().unzip();
    let (columns, values): (Vec<_>, Vec<_>) = entries.into_iter().unzip();
    let mut row_start = Vec::with_capacity(n_rows + 1);
    let mut end = 0;
    row_start.push(end);
    for length in lengths.into_iter().flatten() {
        end += length;
        row_start.push(end);
    }
    let (entries, weights) = rayon::join(|| joined(&columns), || joined(&values));
    Transfer { sources: Csr { row_start, entries }, weights }
}
