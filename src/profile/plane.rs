//! The plane of a profile.

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

use super::{Profile, ProfileError, extent};

/// A plane in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane, in the mesh's unit.
    pub point: DVec3,
    /// Unit normal of the plane.
    pub normal: DVec3,
}

/// Largest distance of a point from its plane, as a share of the profile's size. Text files hold
/// about 12 digits, so a larger distance is no rounding.
const FLATNESS: f64 = 1e-6;

/// A coordinate that varies by less than this share of the profile's size is constant. Then the
/// plane is exactly perpendicular to the axis, without the rounding of a fit.
const AXIS: f64 = 1e-9;

impl Plane {
    /// Signed distance of a point, positive on the normal's side, in the mesh's unit.
    pub fn distance(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.normal)
    }

    /// The plane of a profile. The largest component of its normal is positive.
    ///
    /// # Errors
    /// - [`ProfileError::NotPlane`]: a point lies off by more than 1e-6 of the profile's size
    /// - [`ProfileError::OnOneLine`]: the points define no plane
    /// - [`ProfileError::NotFinite`], [`ProfileError::TooFewPoints`],
    ///   [`ProfileError::TooManyPoints`]
    pub fn of_profile(profile: &Profile) -> Result<Self, ProfileError> {
        let points = profile.distinct_points()?;
        let size = extent(&points);
        let mut centre = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut covariance = Matrix3::<f64>::zeros();
        for &p in &points {
            let q = ((p - centre) / size).to_array();
            for i in 0..3 {
                for j in 0..3 {
                    covariance[(i, j)] += q[i] * q[j];
                }
            }
        }
        let eigen = SymmetricEigen::<f64, nalgebra::U3>::new(covariance);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        // Variances are squares of lengths. With a smaller one the points form a line, up to the
        // digits of a text file.
        if eigen.eigenvalues[order[1]] <= FLATNESS * FLATNESS * eigen.eigenvalues[order[2]] {
            return Err(ProfileError::OnOneLine { profile: profile.number });
        }
        let fitted = eigen.eigenvectors.column(order[0]);
        let mut normal = DVec3::new(fitted[0], fitted[1], fitted[2]).normalize_or_zero();
        for axis in [DVec3::Y, DVec3::Z, DVec3::X] {
            if points.iter().all(|p| (*p - centre).dot(axis).abs() <= AXIS * size) {
                normal = axis;
            }
        }
        if normal.abs().max_element() == 1.0 {
            // A mean of equal numbers is not exactly that number, but a point of the profile is.
            centre = DVec3::select(normal.abs().cmpeq(DVec3::ONE), points[0], centre);
        }
        let plane = Self { point: centre, normal: main_direction(normal) };
        let worst = points.iter().map(|&p| plane.distance(p).abs()).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((point, distance)) if distance > FLATNESS * size || normal == DVec3::ZERO => {
                Err(ProfileError::NotPlane { profile: profile.number, point, distance, allowed: FLATNESS * size })
            }
            _ => Ok(plane),
        }
    }
}

/// The direction, or its opposite, with a positive largest component.
pub(super) fn main_direction(direction: DVec3) -> DVec3 {
    let largest = direction.to_array().into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 { -direction } else { direction }
}
