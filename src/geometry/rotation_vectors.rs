//! Rotation vectors: the axis of a rotation times its angle in radians. Their derivatives, and the
//! derivative of a fitted rotation.
//!
//! The derivative of a rotation is written as an increment: `dR = [a] R`, with `[a]` the matrix of
//! the cross product.

use glam::{DMat3, DQuat, DVec3};

/// Below this sine of half the angle the arc equals its sine to the last bit.
const SMALL: f64 = 1e-8;

/// Below this angle the Taylor series are exact to the last bit.
const SERIES: f64 = 1e-4;

/// Largest norm of `(tr H - H)^-1`, times `tr H`. Beyond it rounding decides which rotation fits
/// best.
const UNIQUE: f64 = 1e10;

/// Rotation vector of a rotation, of length `0..=pi`.
///
/// Small rotations keep their digits, so difference quotients near the identity are right.
pub fn rotation_vector(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let axis = rotation.xyz();
    let sine = axis.length();
    if sine < SMALL { axis * (2.0 / rotation.w) } else { axis * (2.0 * sine.atan2(rotation.w) / sine) }
}

/// The matrix `[k]` of the cross product: `[k] v = k x v`.
pub fn cross_matrix(k: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, k.z, -k.y), DVec3::new(-k.z, 0.0, k.x), DVec3::new(k.y, -k.x, 0.0))
}

/// The transpose of [`cross_matrix`] as a linear map: the sum of the products of the entries of
/// `[k]` and `m` is `k . axial(m)`.
pub fn axial(m: DMat3) -> DVec3 {
    DVec3::new(m.y_axis.z - m.z_axis.y, m.z_axis.x - m.x_axis.z, m.x_axis.y - m.y_axis.x)
}

/// The matrix `a b^T`.
pub fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The increment of a rotation per change of its rotation vector.
pub fn jacobian(vector: DVec3) -> DMat3 {
    let angle = vector.length();
    let square = angle * angle;
    let (first, second) = if angle < SERIES {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        (2.0 * (0.5 * angle).sin().powi(2) / square, (angle - angle.sin()) / (square * angle))
    };
    let cross = cross_matrix(vector);
    DMat3::IDENTITY + cross * first + cross * cross * second
}

/// The change of a rotation vector per increment of its rotation. Not finite at a whole turn.
pub fn inverse_jacobian(vector: DVec3) -> DMat3 {
    let angle = vector.length();
    let half = 0.5 * angle;
    let second =
        if angle < SERIES { 1.0 / 12.0 + angle * angle / 720.0 } else { (1.0 - half / half.tan()) / (angle * angle) };
    let cross = cross_matrix(vector);
    DMat3::IDENTITY - cross * 0.5 + cross * cross * second
}

/// The derivative of the rotation `R` that fits a sum `S = sum q p^T` best.
#[derive(Clone, Copy, Debug)]
pub struct FittedRotation {
    /// The rotation.
    pub rotation: DMat3,
    /// `(tr H - H)^-1`, with `H = R^T S`, which is symmetric.
    gain: DMat3,
}

impl FittedRotation {
    /// The derivative at a sum and its best rotation. `None` if other rotations fit as well: then
    /// the rotation has no derivative.
    pub fn new(rotation: DMat3, sum: DMat3) -> Option<Self> {
        let h = rotation.transpose() * sum;
        let h = (h + h.transpose()) * 0.5;
        let trace = h.x_axis.x + h.y_axis.y + h.z_axis.z;
        let gain = (DMat3::from_diagonal(DVec3::splat(trace)) - h).inverse();
        let norm = gain.to_cols_array().iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        (norm * trace.abs() < UNIQUE).then_some(Self { rotation, gain })
    }

    /// The increment of the rotation for a change of the sum.
    pub fn forward(&self, change: DMat3) -> DVec3 {
        self.rotation * (self.gain * axial(self.rotation.transpose() * change))
    }

    /// The transpose of [`Self::forward`].
    pub fn reverse(&self, increment: DVec3) -> DMat3 {
        self.rotation * cross_matrix(self.gain * (self.rotation.transpose() * increment))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fitted_motion::FittedMotion;

    const AXIS: DVec3 = DVec3::new(2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0);

    fn greatest(m: DMat3) -> f64 {
        m.to_cols_array().iter().fold(0.0, |greatest, entry| f64::max(greatest, entry.abs()))
    }

    /// Angles over fifteen decades keep thirteen digits.
    ///
    /// Fails if `SMALL` is 1e-3.
    #[test]
    fn rotation_vectors_keep_their_digits() {
        for exponent in -15..=0 {
            let angle = 3.0 * 10f64.powi(exponent);
            let (sine, cosine) = (0.5 * angle).sin_cos();
            let axis = AXIS * sine;
            for sign in [1.0, -1.0] {
                let found = rotation_vector(DQuat::from_xyzw(axis.x, axis.y, axis.z, cosine) * sign);
                assert!(found.distance(AXIS * angle) < 1e-13 * angle, "{angle}: {found}");
            }
        }
        assert_eq!(rotation_vector(DQuat::IDENTITY), DVec3::ZERO);
    }

    #[test]
    fn axial_is_the_transpose_of_the_cross_matrix() {
        let m = DMat3::from_cols(DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.5, 4.0, -1.0), DVec3::new(7.0, 0.25, 2.0));
        let k = DVec3::new(3.0, -5.0, 11.0);
        assert_eq!(cross_matrix(k) * AXIS, k.cross(AXIS));
        let sum: f64 = cross_matrix(k).to_cols_array().iter().zip(m.to_cols_array()).map(|(a, b)| a * b).sum();
        assert_eq!(sum, k.dot(axial(m)));
        assert_eq!(outer(k, AXIS) * DVec3::Y, k * AXIS.y);
    }

    /// The rotation of `w + h v` is that of `w` after a small turn by `h J v`. The quaternion of
    /// the small turn gives the increment.
    ///
    /// Fails if `SERIES` is 1, or 0 in one of the two.
    #[test]
    fn the_jacobian_is_the_limit_of_turns() {
        let direction = DVec3::new(0.3, 0.9, -0.2);
        for angle in [0.0, 1e-6, 0.9e-4, 1.1e-4, 0.1, 0.9, 2.5, 4.0, 6.0] {
            let (at, step) = (AXIS * angle, 1e-5);
            let turn = |vector| DQuat::from_scaled_axis(vector);
            let between = turn(at + direction * step) * turn(at - direction * step).inverse();
            let limit = rotation_vector(between) / (2.0 * step);
            let found = jacobian(at) * direction;
            assert!(found.distance(limit) < 1e-9, "{angle}: {found} instead of {limit}");
            let one = jacobian(at) * inverse_jacobian(at);
            assert!(one.is_finite() && greatest(one - DMat3::IDENTITY) < 1e-11, "{angle}: {one}");
        }
    }

    /// Against differences of the fit itself, on a sum that stretches, shears and turns, and on one
    /// that is turned over.
    #[test]
    fn the_derivative_of_a_fit_is_the_limit_of_fits() {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.1)));
        let change =
            DMat3::from_cols(DVec3::new(0.2, -1.0, 0.4), DVec3::new(0.6, 0.3, -0.8), DVec3::new(-0.5, 0.9, 0.1));
        for last in [1.3, 0.4, -0.3] {
            let stretch =
                DMat3::from_cols(DVec3::new(2.0, 0.2, 0.1), DVec3::new(0.2, 1.1, 0.0), DVec3::new(0.1, 0.0, last));
            let sum = turn * stretch;
            let fit = |sum: DMat3| FittedMotion::rotation_nearest(sum);
            let step = 1e-5;
            let between = fit(sum + change * step) * fit(sum - change * step).inverse();
            let limit = rotation_vector(between) / (2.0 * step);
            let derivative = FittedRotation::new(DMat3::from_quat(fit(sum)), sum).unwrap();
            let found = derivative.forward(change);
            assert!(found.distance(limit) < 1e-8, "{last}: {found} instead of {limit}");
            let increment = DVec3::new(-0.4, 0.8, 0.3);
            let back: f64 = derivative
                .reverse(increment)
                .to_cols_array()
                .iter()
                .zip(change.to_cols_array())
                .map(|(a, b)| a * b)
                .sum();
            assert!((back - found.dot(increment)).abs() < 1e-13, "{last}: {back}");
        }
    }

    /// About a line every rotation fits as well as any other.
    ///
    /// Fails if `UNIQUE` is 1e30 or 1.
    #[test]
    fn a_fit_that_is_not_unique_has_no_derivative() {
        let line = outer(DVec3::X, DVec3::X);
        assert!(FittedRotation::new(DMat3::IDENTITY, line).is_none());
        assert!(FittedRotation::new(DMat3::IDENTITY, DMat3::ZERO).is_none());
        assert!(FittedRotation::new(DMat3::IDENTITY, line + DMat3::IDENTITY * 1e-12).is_none());
        assert!(FittedRotation::new(DMat3::IDENTITY, line + DMat3::IDENTITY * 1e-3).is_some());
    }
}
