//! Rigid and affine motions fitted to the displacements of a set of points by least squares.
//!
//! The rotation of a rigid motion comes from Horn's quaternion method or from a polar
//! decomposition. An affine motion stretches only the directions in which the points extend far
//! enough. The paper has no such fit. The wingtip stage and the rotation of the volume's springs
//! use these motions.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Matrix4, SymmetricEigen, Vector3};

/// A linear map about a centre, followed by a translation.
///
/// `x -> to + linear (x - from)`
#[derive(Clone, Copy, Debug)]
pub struct FittedMotion {
    from: DVec3,
    to: DVec3,
    linear: Matrix3<f64>,
}

/// A direction counts as flat if the points extend in it less than a third as far as in the next
/// wider one: the fraction applies to squared lengths. In a flat direction the affine motion equals
/// the rigid one.
const FLAT: f64 = 0.1;

/// Least determinant, after scaling to the size of a rotation, for which Newton's iteration for the
/// nearest rotation is quick and safe.
const UPRIGHT: f64 = 1e-3;

impl FittedMotion {
    /// The motion that leaves every point in its place.
    pub fn identity() -> Self {
        Self { from: DVec3::ZERO, to: DVec3::ZERO, linear: Matrix3::identity() }
    }

    /// The mean displacement of the points, as a motion without a rotation.
    ///
    /// - `pairs`: as in [`Self::rigid`]
    pub fn translation(pairs: &[(DVec3, DVec3, f64)]) -> Self {
        let (from, to) = centres(pairs);
        Self { from, to, linear: Matrix3::identity() }
    }

    /// A rotation about an axis through a point, and then a shift.
    pub fn turn(rotation: DQuat, about: DVec3, shift: DVec3) -> Self {
        let columns = DMat3::from_quat(rotation).to_cols_array_2d();
        Self { from: about, to: about + shift, linear: Matrix3::from_columns(&columns.map(Vector3::from)) }
    }

    /// The rotation `R` that minimises `sum |R p - q|^2` over pairs `(p, q)` of vectors, from their
    /// sum `sum q p^T`.
    pub fn rotation_nearest(sum: DMat3) -> DQuat {
        match polar(sum) {
            Some(rotation) => DQuat::from_mat3(&rotation),
            None => horn(&Matrix3::from_iterator(sum.transpose().to_cols_array())),
        }
    }

    /// The weighted centre of the points before and after the motion, in their unit.
    pub fn centres(&self) -> (DVec3, DVec3) {
        (self.from, self.to)
    }

    /// The rotation of a rigid motion. Not meaningful for an affine motion.
    pub fn rotation(&self) -> DQuat {
        let l = self.linear;
        DQuat::from_mat3(&DMat3::from_cols_array_2d(&l.data.0))
    }

    /// The rigid motion that brings the first point of each pair closest to the second, by weighted
    /// least squares.
    ///
    /// - `pairs`: point before, point after (same unit), weight `>= 0`; at least one weight is
    ///   positive
    pub fn rigid(pairs: &[(DVec3, DVec3, f64)]) -> Self {
        let (from, to) = centres(pairs);
        let s: Matrix3<f64> =
            pairs.iter().map(|pair| column(pair.0 - from) * column(pair.1 - to).transpose() * pair.2).sum();
        let rotation = DMat3::from_quat(horn(&s)).to_cols_array_2d();
        Self { from, to, linear: Matrix3::from_columns(&rotation.map(Vector3::from)) }
    }

    /// The affine motion that brings the first point of each pair closest to the second, by
    /// weighted least squares.
    ///
    /// Directions in which the points hardly extend, such as the normal of a flat wingtip, follow
    /// the best rigid motion.
    ///
    /// - `pairs`: as in [`Self::rigid`]
    pub fn affine(pairs: &[(DVec3, DVec3, f64)]) -> Self {
        let rigid = Self::rigid(pairs);
        let back = rigid.linear.transpose();
        let mut spread = Matrix3::zeros();
        let mut mapped = Matrix3::zeros();
        for pair in pairs {
            let (p, q) = (column(pair.0 - rigid.from), back * column(pair.1 - rigid.to));
            spread += p * p.transpose() * pair.2;
            mapped += (q - p) * p.transpose() * pair.2;
        }
        let stretch = stretched(spread).into_iter().fold(Matrix3::identity(), |stretch, (direction, extent)| {
            stretch + mapped * direction * direction.transpose() / extent
        });
        Self { linear: rigid.linear * stretch, ..rigid }
    }

    /// The unit directions in which [`Self::affine`] stretches, at right angles, each with the
    /// weighted sum of the squares of the points' extents in it. In other directions it turns
    /// only.
    ///
    /// - `points`: relative to their weighted centre, with their weights
    pub fn stretched(points: &[(DVec3, f64)]) -> Vec<(DVec3, f64)> {
        let spread: Matrix3<f64> =
            points.iter().map(|&(point, weight)| column(point) * column(point).transpose() * weight).sum();
        let vector = |(direction, extent): (Vector3<f64>, f64)| (DVec3::from(direction.data.0[0]), extent);
        stretched(spread).into_iter().map(vector).collect()
    }

    /// The angle of the rotation of a rigid motion, in radians, from 0 to pi. Not meaningful for an
    /// affine motion.
    pub fn angle(&self) -> f64 {
        let rotation = self.rotation();
        2.0 * rotation.xyz().length().atan2(rotation.w.abs())
    }

    /// The preimage of a point under a rigid motion. Not meaningful for an affine motion.
    pub fn back(&self, at: DVec3) -> DVec3 {
        let turned = self.linear.transpose() * column(at - self.to);
        self.from + DVec3::new(turned.x, turned.y, turned.z)
    }

    /// Displacement of a point by the motion, in the unit of the points.
    pub fn displacement(&self, at: DVec3) -> DVec3 {
        let turned = self.linear * column(at - self.from);
        self.to + DVec3::new(turned.x, turned.y, turned.z) - at
    }
}

/// The unit directions in which an affine motion stretches, at right angles, each with the spread
/// of the points in it.
///
/// - `spread`: the weighted sum of `p p^T` over the points, relative to their centre
fn stretched(spread: Matrix3<f64>) -> Vec<(Vector3<f64>, f64)> {
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut directions = Vec::with_capacity(3);
    let mut wider = f64::INFINITY;
    for (rank, axis) in order.into_iter().enumerate() {
        let extent = eigen.eigenvalues[axis];
        // The two widest directions span the tip. They count unless the points lie on a line or in
        // one place.
        let least = if rank < 2 { 1e-6 * eigen.eigenvalues[order[0]] } else { FLAT * wider };
        if extent.is_nan() || extent <= least {
            break;
        }
        directions.push((eigen.eigenvectors.column(axis).into_owned(), extent));
        wider = extent;
    }
    directions
}

/// The rotation nearest to a matrix, by Newton's iteration with Higham's scaling (SIAM J. Sci.
/// Stat. Comput. 7, 1986).
///
/// The rotation maximises the same sum as [`horn`], and takes a handful of inversions. `None` for a
/// matrix that is close to singular, or whose determinant is not positive.
fn polar(s: DMat3) -> Option<DMat3> {
    let size = |m: DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>();
    let mut rotation = s * (3.0 / size(s)).sqrt();
    if rotation.determinant() < UPRIGHT {
        return None;
    }
    for _ in 0..20 {
        let inverse = rotation.inverse().transpose();
        let scale = (size(inverse) / size(rotation)).sqrt().sqrt();
        let next = (rotation * scale + inverse * (1.0 / scale)) * 0.5;
        let change = size(next - rotation);
        rotation = next;
        if change < 1e-20 {
            return Some(rotation);
        }
    }
    None
}

/// The rotation that best maps the first factors of `s = sum p q^T` to the second.
///
/// Its quaternion is the eigenvector of Horn's matrix for the largest eigenvalue (J. Opt. Soc. Am.
/// A 4(4), 1987). The result is never a reflection.
fn horn(s: &Matrix3<f64>) -> DQuat {
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        s[(0, 0)] + s[(1, 1)] + s[(2, 2)], s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)],
        s[(1, 2)] - s[(2, 1)], s[(0, 0)] - s[(1, 1)] - s[(2, 2)], s[(0, 1)] + s[(1, 0)], s[(2, 0)] + s[(0, 2)],
        s[(2, 0)] - s[(0, 2)], s[(0, 1)] + s[(1, 0)], s[(1, 1)] - s[(0, 0)] - s[(2, 2)], s[(1, 2)] + s[(2, 1)],
        s[(0, 1)] - s[(1, 0)], s[(2, 0)] + s[(0, 2)], s[(1, 2)] + s[(2, 1)], s[(2, 2)] - s[(0, 0)] - s[(1, 1)],
    );
    let eigen = SymmetricEigen::new(matrix);
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize()
}

fn centres(pairs: &[(DVec3, DVec3, f64)]) -> (DVec3, DVec3) {
    let total: f64 = pairs.iter().map(|pair| pair.2).sum();
    let total = if total > 0.0 { total } else { 1.0 };
    let centre =
        |of: fn(&(DVec3, DVec3, f64)) -> DVec3| pairs.iter().map(|pair| of(pair) * pair.2).sum::<DVec3>() / total;
    (centre(|pair| pair.0), centre(|pair| pair.1))
}

fn column(v: DVec3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation_vectors::outer;

    fn check(fit: fn(&[(DVec3, DVec3, f64)]) -> FittedMotion, points: &[DVec3], moved: impl Fn(DVec3) -> DVec3) {
        let displacement = fit(&points.iter().map(|&p| (p, moved(p), 1.0)).collect::<Vec<_>>());
        for &p in points {
            assert!((p + displacement.displacement(p) - moved(p)).length() < 1e-12, "{p}");
        }
    }

    fn cloud() -> Vec<DVec3> {
        (0..9).map(|i| DVec3::new((i % 3) as f64, (i / 3) as f64, (i * i % 5) as f64)).collect()
    }

    #[test]
    fn a_rigid_motion_is_found_again() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.5);
        let moved = |p: DVec3| turn * p + DVec3::new(3.0, -1.0, 0.25);
        check(FittedMotion::rigid, &cloud(), moved);
        check(FittedMotion::affine, &cloud(), moved);
    }

    /// Fails if `FLAT` is 0.9.
    #[test]
    fn an_affine_motion_is_found_again() {
        let moved = |p: DVec3| DVec3::new(1.1 * p.x + 0.2 * p.z, 0.9 * p.y, p.z - 0.3 * p.x + 7.0);
        check(FittedMotion::affine, &cloud(), moved);
    }

    /// Off its plane a flat set moves rigidly: a stretch in the plane does not change its
    /// thickness.
    #[test]
    fn a_flat_set_stretches_in_its_plane_only() {
        let flat: Vec<DVec3> = (0..12).map(|i| DVec3::new((i % 4) as f64, 2.0, (i / 4) as f64)).collect();
        let stretch = |p: DVec3| DVec3::new(1.5 * p.x, p.y, 0.8 * p.z);
        check(FittedMotion::affine, &flat, stretch);
        let displacement = FittedMotion::affine(&flat.iter().map(|&p| (p, stretch(p), 1.0)).collect::<Vec<_>>());
        let above = DVec3::new(1.0, 2.5, 1.0);
        assert!((above + displacement.displacement(above) - stretch(above)).length() < 1e-12);
    }

    /// Axes that are stretched symmetrically and turned give the turn, also where they are pressed
    /// flat and, less than they are stretched otherwise, turned over.
    #[test]
    fn stretched_arms_give_the_turn() {
        for angle in [0.0, 1e-9, 0.3, 1.6, 3.1] {
            let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle);
            for across in [1.1, 1e-2, 1e-6, 0.0, -0.2] {
                let stretch = DMat3::from_cols(DVec3::new(1.4, 0.1, 0.0), DVec3::new(0.1, 0.7, 0.0), DVec3::Z * across);
                let arms = DVec3::AXES.map(|axis| (axis, turn * (stretch * axis)));
                let sum = arms.into_iter().fold(DMat3::ZERO, |sum, (p, q)| sum + outer(q, p));
                let found = FittedMotion::rotation_nearest(sum);
                let error = (found * turn.inverse()).xyz().length();
                assert!(error < 1e-14, "{angle} {across}: {found} instead of {turn}, {error:e}");
            }
        }
    }

    /// A pair of weight 2 counts as the same pair twice, one of weight 0 not at all.
    #[test]
    fn a_weight_counts_as_so_many_pairs() {
        let moved = |p: DVec3| DVec3::new(p.x + 0.1 * p.y * p.y, p.y, p.z + 0.3 * p.x * p.x);
        let points = cloud();
        let pair = |p: DVec3, weight| (p, moved(p), weight);
        let (heavy, light) = points.split_at(4);
        let weighted: Vec<_> = heavy
            .iter()
            .map(|&p| pair(p, 2.0))
            .chain(light.iter().map(|&p| pair(p, 1.0)))
            .chain([pair(DVec3::ONE * 9.0, 0.0)])
            .collect();
        let repeated: Vec<_> = heavy.iter().chain(&points).map(|&p| pair(p, 1.0)).collect();
        for fit in [FittedMotion::rigid, FittedMotion::affine] {
            let (one, other) = (fit(&weighted), fit(&repeated));
            for &p in &points {
                assert!(one.displacement(p).distance(other.displacement(p)) < 1e-12, "{p}");
            }
        }
        let even: Vec<_> = points.iter().map(|&p| pair(p, 1.0)).collect();
        let off =
            FittedMotion::rigid(&even).displacement(DVec3::X) - FittedMotion::rigid(&weighted).displacement(DVec3::X);
        assert!(off.length() > 1e-3, "the weights make no difference");
    }

    #[test]
    fn one_point_is_translated() {
        check(FittedMotion::affine, &[DVec3::X], |p| p + DVec3::Z);
    }
}
