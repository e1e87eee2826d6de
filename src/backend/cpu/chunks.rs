//! Arrays cut into chunks of rows, which the CPU's threads share.
//!
//! A chunk's result does not depend on who computes it, so neither does the result on the number of threads.

use rayon::prelude::*;

use crate::kernels::convergence::BLOCK;

/// Rows in a task: a task of this size takes about 20 microseconds, ten times what handing it over does.
pub(super) const CHUNK: usize = 4 * BLOCK;

/// Arrays up to this size are worked through by the calling thread: waking the others would cost more than they save.
const SERIAL: usize = 2 * CHUNK;

/// Chunks of an array in parallel, each with the place of its first element; small arrays on the calling thread.
pub(super) fn in_chunks<T: Send>(array: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if array.len() <= SERIAL {
        work(0, array);
    } else {
        array.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, array)| work(chunk * CHUNK, array));
    }
}

/// [`in_chunks`] with what each block of [`BLOCK`] rows comes to.
///
/// - `of_blocks` `[blocks of the array]`
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
