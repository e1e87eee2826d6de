//! Arrays in chunks of rows for the CPU's threads.
//!
//! The result of a chunk does not depend on the thread that computes it, so no result depends on
//! the number of threads.

use rayon::prelude::*;

use crate::kernels::convergence::BLOCK;

/// Rows in a task. A task of this size takes about 20 microseconds, ten times its scheduling.
pub(super) const CHUNK: usize = 4 * BLOCK;

/// Arrays up to this size are computed by the calling thread: waking other threads would cost more
/// than it saves.
const SERIAL: usize = 2 * CHUNK;

/// Applies `work` to the chunks of an array in parallel, each with the index of its first element.
/// Small arrays are one chunk, computed by the calling thread.
pub(super) fn in_chunks<T: Send>(array: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if array.len() <= SERIAL {
        work(0, array);
    } else {
        array.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, array)| work(chunk * CHUNK, array));
    }
}

/// [`in_chunks`] with one result per block of [`BLOCK`] rows.
///
/// - `of_blocks` `[blocks of the array]`: receives the results
pub(super) fn in_chunks_with<T: Send, U: Send>(
    array: &mut [T],
    of_blocks: &mut [U],
    work: impl Fn(usize, &mut [T], &mut [U]) + Sync,
) {
    if array.len() <= SERIAL {
        work(0, array, of_blocks);
    } else {
        let chunks = array.par_chunks_mut(CHUNK).zip(of_blocks.par_chunks_mut(CHUNK / BLOCK)).enumerate();
        chunks.for_each(|(chunk, (array, of_blocks))| work(chunk * CHUNK, array, of_blocks));
    }
}
