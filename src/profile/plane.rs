//! The plane a profile lies in.

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

use super::{Profile, ProfileError, extent};

/// A plane in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane.
    pub point: DVec3,
    /// Its unit normal.
    pub normal: DVec3,
}

/// A text file carries about 12 digits; anything beyond this share of the profile's size is no rounding.
const FLATNESS: f64 = 1e-6;

/// A coordinate that varies less than this share of the profile's size is constant: the plane is then exactly
/// perpendicular to that axis, free of the rounding of a fit.
const AXIS: f64 = 1e-9;

impl Plane {
    /// Signed distance of a point, positive on the normal's side.
    pub fn distance(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.normal)
    }

    /// The plane a profile lies in; the normal's sign is such that its largest component is positive.
    ///
    /// # Errors
    /// [`ProfileError::NotPlane`] when a point lies off by more than 1e-6 of the profile's size,
    /// [`ProfileError::OnOneLine`] when the points fix no plane, and those of fewer than three or infinite points.
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
        // Variances are squares of lengths; below this a profile is a line even to the digits of a text file.
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
            // A mean of equal numbers is not quite that number; a point of the profile is exact.
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

/// The direction or its opposite, such that its largest component is positive.
pub(super) fn main_direction(direction: DVec3) -> DVec3 {
    let largest = direction.to_array().into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 { -direction } else { direction }
}
