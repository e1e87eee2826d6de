//! Wing profiles: cut from the wing's surface, read and written, and their changes carried to every wing vertex.
//!
//! A [`Profile`] is the curve in which a plane cuts the wing. The inverse design hands over new profiles; idmesh holds
//! or cuts the old ones, matches each pair point by point ([`matching`]) and interpolates the displacement vectors over
//! the wing's surface ([`interpolation`]), as in section 3.1 of the paper.
//!
//! Where this differs from the paper, and why:
//!
//! - The paper adds and removes vertices of the old profile until both have the same count. Here both curves get a
//!   common parameter from one side of the trailing edge over the leading edge to the other, so the counts never meet
//!   and never matter.
//! - The paper interpolates with one least-squares polynomial of degree up to two in x, y, z. That polynomial does not
//!   pass through the new profiles, and with sweep its x² terms put a dihedral between the planes that nobody asked
//!   for. Here least squares takes only maps that are affine in each section and linear along the span; the remainder is
//!   interpolated along the profiles and across the planes, so the moved wing passes through the new profiles. See
//!   [`interpolation`].
//! - The paper cuts old profiles from the surface. Here they are what the vertices beside a plane say (`carry`), and a design
//!   that continues flat cuts is compared with flat cuts (`section`).
//! - The paper checks nothing. Here profiles are checked against the wing and each other (`checks`), and the wing's vertices
//!   against the new profiles (`accuracy`).
//!
//! Use: [`files::parse`], [`csv::parse`] or [`cut::cut_at_planes`] for the old profiles, [`ProfileInterpolation::new`] once per mesh,
//! [`ProfileInterpolation::displacements`] once per design, [`ProfileInterpolation::missed`] and [`distance::max_distance`] to check the result.

mod accuracy;
mod along;
mod carry;
mod checks;
pub mod csv;
mod curve;
pub mod cut;
pub mod distance;
mod edges;
mod error;
pub mod files;
pub mod interpolation;
mod least_squares;
mod locate;
pub mod matching;
mod plane;
mod section;
mod simple;
mod span;
pub mod stations;
mod trend;

use glam::DVec3;

pub use accuracy::Missed;
pub use checks::{Closeness, compare_sizes};
pub use error::ProfileError;
pub use interpolation::{ProfileDisplacement, ProfileInterpolation, WingSurface};
pub use plane::Plane;

/// One section of the wing.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The number that pairs an old profile with its new one.
    pub number: i64,
    /// Points in order, in the unit of the mesh: from one side of the trailing edge round the leading edge to the
    /// other. Open for a blunt trailing edge, the first point repeated at the end for a sharp one.
    pub points: Vec<DVec3>,
}

impl Profile {
    /// The points with consecutive duplicates dropped, checked to be numbers and at least three.
    ///
    /// # Errors
    /// [`ProfileError::NotFinite`] for NaN or infinite coordinates, [`ProfileError::TooFewPoints`] for fewer than three
    /// different points.
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

/// More points than this are no section: matching them takes the square of their number.
const MOST_POINTS: usize = 20_000;

/// Coordinates beyond this count as infinite: their squares would be.
const LARGEST: f64 = 1e100;

/// Diagonal of the points' bounding box.
fn extent(points: &[DVec3]) -> f64 {
    crate::geometry::diagonal(points.iter().copied())
}
