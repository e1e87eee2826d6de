//! [`Tilt`]: the derivative of the normal of a profile's plane.

use glam::{DMat3, DVec3};

use super::Profile;
use crate::geometry::rotation_vectors::outer;

/// How the normal of a profile's plane follows its points: as that of the plane that fits best.
#[derive(Debug)]
pub(super) struct Tilt {
    /// Unit normal of the plane.
    pub normal: DVec3,
    /// Each point that counts, and the change of the normal by its motion along the normal.
    pub by_points: Vec<(usize, DVec3)>,
}

impl Tilt {
    /// - `normal`: of the profile's plane, on the side of the wing's span
    pub fn new(normal: DVec3, profile: &Profile) -> Self {
        let points = &profile.points;
        let distinct: Vec<usize> = (0..points.len()).filter(|&i| i == 0 || points[i] != points[i - 1]).collect();
        let centre = distinct.iter().map(|&i| points[i]).sum::<DVec3>() / distinct.len() as f64;
        let spread = distinct.iter().map(|&i| points[i] - centre).fold(DMat3::ZERO, |sum, q| sum + outer(q, q));
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let inverse = (spread + outer(normal, normal) * trace).inverse();
        // The end of a closed profile follows its start.
        let place = |i: usize| if points[i] == points[0] { 0 } else { i };
        let by_points = distinct.iter().map(|&i| (place(i), -(inverse * (points[i] - centre))));
        Self { normal, by_points: by_points.collect() }
    }

    /// Change of the normal.
    ///
    /// - `change` `[n_points]`: of the points
    pub fn forward(&self, change: &[DVec3]) -> DVec3 {
        let change: DVec3 = self.by_points.iter().map(|&(i, by)| by * self.normal.dot(change[i])).sum();
        change.reject_from_normalized(self.normal)
    }

    /// The transpose of [`Self::forward`], added to the derivative by the points.
    pub fn reverse(&self, by_normal: DVec3, by_points: &mut [DVec3]) {
        let by_normal = by_normal.reject_from_normalized(self.normal);
        self.by_points.iter().for_each(|&(i, by)| by_points[i] += self.normal * by.dot(by_normal));
    }
}
