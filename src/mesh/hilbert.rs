//! Hilbert's curve through the cells of a cube: cells that are close on the curve are close in
//! space.

/// Bits of a cell's number along an axis. Three axes fill an integer of 64 bits, and a cell is a
/// two-millionth of the cube: the vertices of thin layers on a wing fall into different cells.
pub(super) const BITS: u32 = 21;

/// Place of a cell of the cube on the curve, below `2^(3 bits)`.
///
/// - `cell`: number of the cell along each axis, below `2^bits`
/// - `bits`: at least 1, at most [`BITS`]
///
/// Source: Skilling (AIP Conf. Proc. 707, 2004, 381-387).
pub(super) fn place(mut cell: [u32; 3], bits: u32) -> u64 {
    // Undoes the turns of the smaller cubes, from the largest cube to the smallest. Masks, because
    // a processor cannot predict the bits.
    for bit in (1..bits).rev() {
        let lower = (1 << bit) - 1;
        for axis in 0..3 {
            let is_set = (cell[axis] >> bit & 1).wrapping_neg();
            let different = (cell[0] ^ cell[axis]) & lower & !is_set;
            cell[0] ^= different | lower & is_set;
            cell[axis] ^= different;
        }
    }
    // Gray code.
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    let turned = [1, 2, 4, 8, 16].into_iter().fold(cell[2] >> 1, |turned, by| turned ^ turned >> by);
    let [x, y, z] = cell.map(|along| spread(along ^ turned));
    x << 2 | y << 1 | z
}

/// A number with two zeros before each of its [`BITS`] bits.
fn spread(number: u32) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.into_iter().fold(u64::from(number), |spread, (by, mask)| (spread | spread << by) & mask)
}

#[cfg(test)]
mod tests {
    use super::place;

    /// What makes a curve Hilbert's: it visits every cell once, each step leads to a cell beside,
    /// and every eighth of the cube is passed through as a whole.
    #[test]
    fn the_curve_goes_from_cell_to_cell_through_all() {
        for bits in 1..=4 {
            let n = 1u32 << bits;
            let mut cells: Vec<[u32; 3]> = (0..n * n * n).map(|cell| [cell % n, cell / n % n, cell / n / n]).collect();
            cells.sort_by_key(|&cell| place(cell, bits));
            for (at, &cell) in cells.iter().enumerate() {
                assert_eq!(place(cell, bits), at as u64, "{cell:?} of {bits} bits");
            }
            for pair in cells.windows(2) {
                let steps: u32 = (0..3).map(|axis| pair[0][axis].abs_diff(pair[1][axis])).sum();
                assert_eq!(steps, 1, "{pair:?} of {bits} bits");
            }
            for eighth in cells.chunks(cells.len() / 8) {
                let half = |cell: [u32; 3]| cell.map(|along| along >> (bits - 1));
                assert!(eighth.iter().all(|&cell| half(cell) == half(eighth[0])), "{bits} bits");
            }
        }
    }
}
