//! [`PlaneAffine`]: the affine map of a section's plane that fits best.

use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use super::super::least_squares::LeastSquares;
use super::super::{Plane, extent};

/// Weight of an end in [`PlaneAffine::fit_across`], as a share of the whole curve.
pub(super) const END: f64 = 0.1;

/// Least-squares fit of a displacement that is affine in a section's plane. The weight of a knot is
/// the arc length around it.
#[derive(Clone, Debug)]
pub(in crate::profile) struct PlaneAffine {
    /// Mean of the curve.
    pub centre: DVec3,
    /// Two perpendicular directions of the plane, divided by the section's size.
    axes: [DVec3; 2],
    pub knots: Vec<DVec3>,
    /// Square root of each knot's share of the arc length.
    pub weights: Vec<f64>,
    squares: LeastSquares,
}

impl PlaneAffine {
    /// Prepares the fit.
    ///
    /// - `arcs`: arc length at each knot, ascending
    pub fn new(plane: &Plane, knots: &[DVec3], arcs: &[f64]) -> Self {
        let n = knots.len();
        let total = (arcs[n - 1] - arcs[0]).max(f64::MIN_POSITIVE);
        let share = |j: usize| (arcs[(j + 1).min(n - 1)] - arcs[j.saturating_sub(1)]) / (2.0 * total);
        let shares: Vec<f64> = (0..n).map(share).collect();
        let centre =
            knots.iter().zip(&shares).map(|(&p, &share)| p * share).sum::<DVec3>() / shares.iter().sum::<f64>();
        let weights: Vec<f64> = shares.iter().map(|share| share.sqrt()).collect();
        let size = extent(knots);
        let (u, v) = plane.normal.any_orthonormal_pair();
        let axes = [u / size, v / size];
        let column = |axis: DVec3| -> Vec<f64> {
            knots.iter().zip(&weights).map(|(&p, weight)| (p - centre).dot(axis) * weight).collect()
        };
        let squares = LeastSquares::new(vec![weights.clone(), column(axes[0]), column(axes[1])]);
        Self { centre, axes, knots: knots.to_vec(), weights, squares }
    }

    /// Coefficients of the fit to the knots' displacements, and the root mean square of the
    /// remainder.
    pub fn fit(&self, displacement: &[DVec3]) -> (Vec<DVec3>, f64) {
        let weighted: Vec<DVec3> = displacement.iter().zip(&self.weights).map(|(&d, &weight)| d * weight).collect();
        let map = self.squares.solve(&weighted);
        let left = |((&p, &d), weight): ((&DVec3, &DVec3), f64)| {
            (d - self.evaluate(&map, p)).length_squared() * weight * weight
        };
        let sum: f64 = self.knots.iter().zip(displacement).zip(self.weights.iter().copied()).map(left).sum();
        (map, sum.sqrt())
    }

    /// Coefficients of the map that brings the knots closest to a curve, at any place along it. The
    /// end knots go to the ends of the curve.
    ///
    /// - `targets`: a point of the curve for each knot, and the unit tangent there
    pub fn fit_across(&self, plane: &Plane, targets: &[(DVec3, DVec3)]) -> Option<Vec<DVec3>> {
        let (u, v) = plane.normal.any_orthonormal_pair();
        let (mut matrix, mut right) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
        let last = targets.len() - 1;
        for (j, (&knot, &(target, tangent))) in self.knots.iter().zip(targets).enumerate() {
            let p = knot - self.centre;
            let row = [1.0, p.dot(self.axes[0]), p.dot(self.axes[1])];
            let mut add = |direction: DVec3, weight: f64| {
                let [a, b] = [direction.dot(u), direction.dot(v)];
                let row = Vector6::from_fn(|i, _| row[i % 3] * if i < 3 { a } else { b });
                matrix += row * row.transpose() * weight;
                right += row * ((target - knot).dot(direction) * weight);
            };
            if j == 0 || j == last {
                add(u, END);
                add(v, END);
            } else {
                add(plane.normal.cross(tangent), self.weights[j] * self.weights[j]);
            }
        }
        let solution = matrix.cholesky()?.solve(&right);
        let (a, b) = (|i: usize| solution[i], |i: usize| solution[i + 3]);
        // Across the plane every knot moves by the mean.
        let shift = plane.normal
            * (targets.iter().zip(&self.knots).map(|(t, &k)| (t.0 - k).dot(plane.normal)).sum::<f64>()
                / targets.len() as f64);
        let mut map: Vec<DVec3> = (0..3).map(|i| u * a(i) + v * b(i)).collect();
        map[0] += shift;
        Some(map)
    }

    pub fn evaluate(&self, map: &[DVec3], point: DVec3) -> DVec3 {
        map[0] + map[1] * (point - self.centre).dot(self.axes[0]) + map[2] * (point - self.centre).dot(self.axes[1])
    }

    /// The values at a point that the coefficients multiply.
    pub fn basis(&self, point: DVec3) -> [f64; 3] {
        [1.0, (point - self.centre).dot(self.axes[0]), (point - self.centre).dot(self.axes[1])]
    }

    /// The transpose of the coefficients of [`Self::fit`]: the derivative by the knots'
    /// displacements.
    pub fn fit_reverse(&self, by_map: &[DVec3]) -> Vec<DVec3> {
        self.squares.solve_reverse(by_map).into_iter().zip(&self.weights).map(|(by, &weight)| by * weight).collect()
    }
}
