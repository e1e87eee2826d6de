//! A surface, and vectors, for the unit tests of this folder.

use glam::DVec3;

/// A curved lattice with a hole of 4 x 3 cells, whose rim runs clockwise. The point 22 is the
/// third of the third row.
pub(super) fn lattice(height: fn(f64, f64) -> f64) -> (Vec<DVec3>, Vec<[u32; 3]>, Vec<u32>) {
    let (n, h) = (9u32, 0.1);
    let number = |[i, j]: [u32; 2]| j * (n + 1) + i;
    let at = |i: u32, j: u32| {
        let [x, y] = [f64::from(i) * h, f64::from(j) * h + 0.01 * f64::from(i * i % 5)];
        DVec3::new(x - 0.3 * y, y + 0.1 * x, height(x, y))
    };
    let points = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let in_hole = |i: u32, j: u32| (3..7).contains(&i) && (3..6).contains(&j);
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|&(i, j)| !in_hole(i, j));
    let of_cell = |(i, j)| {
        let [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(number);
        [[a, b, c], [a, c, d]]
    };
    let (left, right) = ((3..6).map(|j| [3, j]), (4..7).rev().map(|j| [7, j]));
    let (top, bottom) = ((3..7).map(|i| [i, 6]), (4..8).rev().map(|i| [i, 3]));
    let rim = left.chain(top).chain(right).chain(bottom).map(number).collect();
    (points, cells.flat_map(of_cell).collect(), rim)
}

/// A vector without pattern, of numbers from -1 to 1.
pub(super) fn noise(k: usize) -> DVec3 {
    let t = k as f64;
    DVec3::new((1.3 * t + 0.2).sin(), (2.9 * t).cos(), (0.7 * t * t + 1.1).sin())
}

/// The scalar product of two lists of vectors.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
