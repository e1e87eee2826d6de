//! Wing profiles: cut from the wing's surface, read and written; their changes are interpolated to
//! every wing vertex.
//!
//! A [`Profile`] is the curve in which a plane cuts the wing. The inverse design gives new
//! profiles. The old ones are given too, or idmesh cuts them from the mesh. Each pair is matched
//! point by point ([`matching`]). The displacement vectors are interpolated over the wing's surface
//! ([`interpolation`]), as in section 3.1 of the paper.
//!
//! Differences from the paper:
//!
//! - The paper adds and removes vertices of the old profile until both have the same number. Here
//!   both curves get a common parameter, from one side of the trailing edge over the leading edge
//!   to the other, so the numbers do not matter.
//! - The paper interpolates with one least-squares polynomial of degree up to two in x, y, z. The
//!   polynomial does not pass through the new profiles, and with sweep its x² terms give a false
//!   dihedral between the planes. Here least squares determines only maps that are affine in each
//!   section and linear along the span. The remainder is interpolated along the profiles and across
//!   the planes, so the moved wing passes through the new profiles. See [`interpolation`].
//! - The paper cuts old profiles from the surface. Here the vertices beside a plane define them
//!   (`cut::carry`). A design that continues flat cuts is compared with flat cuts (`section`).
//! - The paper has no checks. Here profiles are checked against the wing and each other (`checks`,
//!   `chord`), and the wing's vertices against the new profiles (`accuracy`). What is odd about
//!   new profiles gets a [`Remark`].
//!
//! Use: [`files::parse`], [`csv::parse`] or [`cut::cut_at_planes`] for the old profiles;
//! [`ProfileInterpolation::new`] once per mesh; [`ProfileInterpolation::displacements`] once per
//! design; [`ProfileInterpolation::missed`] and [`distance::max_distance`] to check the result.

mod accuracy;
mod agreed;
mod along;
mod checks;
mod chord;
pub mod csv;
mod curve;
pub mod cut;
mod displacement;
#[doc(hidden)]
pub mod distance;
mod edges;
mod error;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod interpolation;
mod kept;
mod least_squares;
mod locate;
mod loft_change;
#[doc(hidden)]
pub mod matching;
mod near;
mod overshoot;
mod path_boxes;
mod places;
mod plane;
mod pose;
mod remarks;
mod section;
mod simple;
mod span;
mod spanwise;
#[doc(hidden)]
pub mod stations;
mod tilt;
mod trend;
mod wing_surface;

use glam::DVec3;

pub use accuracy::Missed;
pub(crate) use agreed::align;
pub use checks::{Closeness, compare_sizes};
pub use displacement::ProfileDisplacement;
pub use error::{ProfileError, ShortEnd, UnbridgedGap};
pub use files::Placement;
pub use interpolation::ProfileInterpolation;
pub(crate) use loft_change::{LoftChange, WhyNot};
pub use matching::{PROFILE_MATCHES, ProfileMatch};
pub(crate) use places::SECTIONS_AT_ONCE;
pub use plane::Plane;
pub use pose::Pose;
pub use remarks::Remark;
pub use wing_surface::WingSurface;

/// One section of the wing.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The number that pairs an old profile with its new one.
    pub number: i64,
    /// Points in order, in the mesh's unit: from one side of the trailing edge round the leading
    /// edge to the other. The curve is open for a blunt trailing edge. For a sharp one the first
    /// point is repeated at the end.
    pub points: Vec<DVec3>,
}

impl Profile {
    /// The points without consecutive duplicates.
    ///
    /// # Errors
    /// - [`ProfileError::NotFinite`]: NaN or infinite coordinates
    /// - [`ProfileError::TooManyPoints`]
    /// - [`ProfileError::TooFewPoints`]: fewer than three different points
    pub(crate) fn distinct_points(&self) -> Result<Vec<DVec3>, ProfileError> {
        if let Some(point) = self.points.iter().position(|p| !p.is_finite() || p.abs().max_element() > LARGEST) {
            return Err(ProfileError::NotFinite { profile: self.number, point, position: self.points[point] });
        }
        if self.points.len() > MOST_POINTS {
            let points = self.points.len();
            return Err(ProfileError::TooManyPoints { profile: self.number, points, most: MOST_POINTS });
        }
        let mut points = self.points.clone();
        points.dedup();
        let closing = usize::from(points.len() > 1 && points.first() == points.last());
        if points.len() - closing < 3 {
            return Err(ProfileError::TooFewPoints { profile: self.number, points: points.len() - closing });
        }
        Ok(points)
    }
}

/// Most points of a section. The smooth curve through them takes up to half a kilobyte for each, so
/// this many take up to half a gigabyte. A file with more holds no sections, but a surface.
const MOST_POINTS: usize = 1_000_000;

/// Larger coordinates count as infinite, because their powers would be.
const LARGEST: f64 = 1e100;

/// Diagonal of the points' bounding box, in their unit.
fn extent(points: &[DVec3]) -> f64 {
    #[cfg(test)]
    tests::LOOKED_AT.set(tests::LOOKED_AT.get() + points.len());
    crate::geometry::diagonal(points.iter().copied())
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    thread_local! {
        /// The number of points at which [`super::extent`] has looked.
        pub(super) static LOOKED_AT: Cell<usize> = const { Cell::new(0) };
    }
}
