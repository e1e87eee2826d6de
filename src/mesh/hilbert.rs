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
    // Undoes the turns of the smaller cubes, from the largest cube to the smallest.
    for bit in (1..bits).rev() {
        let lower = (1 << bit) - 1;
        for axis in 0..3 {
            if cell[axis] >> bit & 1 == 1 {
                cell[0] ^= lower;
            } else {
                let different = (cell[0] ^ cell[axis]) & lower;
                cell[0] ^= different;
                cell[axis] ^= different;
            }
        }
    }
    // Gray code.
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    let turned = (1..bits).filter(|bit| cell[2] >> bit & 1 == 1).fold(0, |turned, bit| turned ^ ((1 << bit) - 1));
    let bits_of = |bit: u32| cell.map(|along| u64::from((along ^ turned) >> bit & 1));
    (0..bits).rev().flat_map(bits_of).fold(0, |place, bit| place << 1 | bit)
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
