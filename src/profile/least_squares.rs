//! Linear least squares that reduces its own rank where the data do not determine a direction.
//!
//! Singular values come from one-sided Jacobi rotations of the columns. These singular values are
//! accurate also for small values. `nalgebra::svd` gives wrong results for nearly dependent
//! columns, which are the rule here (profiles of one plane, thin profiles). Directions below
//! [`RANK`] get no coefficient, so the solution has the least norm.

use glam::DVec3;

/// Singular values below this share of the largest count as zero. Rounding of profile files with 12
/// digits gives 1e-12. A profile thinner than 1e-9 of the wing does not occur.
const RANK: f64 = 1e-10;

/// A factored matrix, for many right-hand sides.
#[derive(Clone, Debug)]
pub(super) struct LeastSquares {
    /// Orthogonal columns `U S` of the kept directions, each `[n_rows]`.
    columns: Vec<Vec<f64>>,
    /// Squared singular value of each kept direction.
    squares: Vec<f64>,
    /// Each kept direction in the space of the unknowns `[n_unknowns]`.
    directions: Vec<Vec<f64>>,
    n_unknowns: usize,
}

impl LeastSquares {
    /// Factors the matrix with these columns, all of one length.
    pub fn new(mut columns: Vec<Vec<f64>>) -> Self {
        let n = columns.len();
        let mut directions: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        // Convergence is quadratic: five unknowns need 5 to 8 rounds.
        for _ in 0..40 {
            let mut rotated = false;
            for p in 0..n {
                for q in p + 1..n {
                    let (a, b) = (dot(&columns[p], &columns[p]), dot(&columns[q], &columns[q]));
                    let c = dot(&columns[p], &columns[q]);
                    if c == 0.0 || c.abs() <= f64::EPSILON * (a * b).sqrt() {
                        continue;
                    }
                    rotated = true;
                    let zeta = (b - a) / (2.0 * c);
                    let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                    let cos = 1.0 / t.hypot(1.0);
                    rotate(&mut columns, p, q, cos, cos * t);
                    rotate(&mut directions, p, q, cos, cos * t);
                }
            }
            if !rotated {
                break;
            }
        }
        let squares: Vec<f64> = columns.iter().map(|c| dot(c, c)).collect();
        let smallest = RANK * RANK * squares.iter().copied().fold(0.0, f64::max);
        let keep = |index: &usize| squares[*index] > smallest && squares[*index].is_finite();
        let kept: Vec<usize> = (0..n).filter(keep).collect();
        Self {
            columns: kept.iter().map(|&i| columns[i].clone()).collect(),
            squares: kept.iter().map(|&i| squares[i]).collect(),
            directions: kept.iter().map(|&i| directions[i].clone()).collect(),
            n_unknowns: n,
        }
    }

    /// Coefficients `[n_unknowns]` that fit `values` `[n_rows]` best. Among these, the ones with
    /// the least norm.
    pub fn solve(&self, values: &[DVec3]) -> Vec<DVec3> {
        let mut solution = vec![DVec3::ZERO; self.n_unknowns];
        for ((column, square), direction) in self.columns.iter().zip(&self.squares).zip(&self.directions) {
            let share = column.iter().zip(values).map(|(&c, &v)| v * c).sum::<DVec3>() / *square;
            for (unknown, &d) in solution.iter_mut().zip(direction) {
                *unknown += share * d;
            }
        }
        solution
    }

    /// The transpose of [`Self::solve`]: the derivative by the values `[n_rows]`, from the one by
    /// the coefficients `[n_unknowns]`.
    pub fn solve_reverse(&self, by_solution: &[DVec3]) -> Vec<DVec3> {
        let mut by_values = vec![DVec3::ZERO; self.columns.first().map_or(0, Vec::len)];
        for ((column, square), direction) in self.columns.iter().zip(&self.squares).zip(&self.directions) {
            let share = by_solution.iter().zip(direction).map(|(&by, &d)| by * d).sum::<DVec3>() / *square;
            for (by_value, &c) in by_values.iter_mut().zip(column) {
                *by_value += share * c;
            }
        }
        by_values
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn rotate(columns: &mut [Vec<f64>], p: usize, q: usize, cos: f64, sin: f64) {
    let (left, right) = columns.split_at_mut(q);
    for (x, y) in left[p].iter_mut().zip(&mut right[0]) {
        (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns that differ by `apart` in one row of three.
    fn solve(apart: f64) -> Vec<DVec3> {
        let columns = vec![vec![1.0, 1.0, 1.0], vec![1.0, 1.0, 1.0 + apart]];
        // What 3 times the first and minus 1 times the second make.
        let values: Vec<DVec3> = columns[0].iter().zip(&columns[1]).map(|(a, b)| DVec3::splat(3.0 * a - b)).collect();
        LeastSquares::new(columns).solve(&values)
    }

    /// A direction that the data see is solved for; one that differs by rounding alone gets the
    /// least norm, which is an equal share.
    ///
    /// Fails if `RANK` is 1e-2 or 0.
    #[test]
    fn what_rounding_alone_tells_apart_gets_equal_shares() {
        for (unknown, expected) in solve(1e-3).into_iter().zip([3.0, -1.0]) {
            assert!((unknown.x - expected).abs() < 1e-9, "{unknown}");
        }
        for unknown in solve(1e-13) {
            assert!((unknown.x - 1.0).abs() < 1e-9, "{unknown}");
        }
    }
}
