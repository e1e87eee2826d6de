//! What can be wrong with profiles.

use std::path::PathBuf;

use glam::DVec3;
use thiserror::Error;

/// Why profiles could not be read, cut, matched or interpolated.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// A line of a profile file is not what it must be.
    #[error("{}:{line}: {what}; expected {expected}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What stands there.
        what: String,
        /// What should.
        expected: &'static str,
    },
    /// A profile file cannot be read as what it is.
    #[error("{what}")]
    File {
        /// Which, where, and why.
        what: String,
    },
    /// A coordinate is NaN, infinite or beyond 1e100.
    #[error("profile {profile}: point {point} is {position}, expected finite coordinates")]
    NotFinite {
        /// Number of the profile.
        profile: i64,
        /// Index of the point, from 0.
        point: usize,
        /// Its coordinates.
        position: DVec3,
    },
    /// Fewer than three different points.
    #[error("profile {profile} has {points} different points, expected at least 3")]
    TooFewPoints {
        /// Number of the profile.
        profile: i64,
        /// How many different points it has.
        points: usize,
    },
    /// All points lie on one line, so they fix no plane.
    #[error("profile {profile}: all points lie on one line, expected a section with thickness")]
    OnOneLine {
        /// Number of the profile.
        profile: i64,
    },
    /// The points do not lie in one plane.
    #[error("profile {profile} is not plane: point {point} lies {distance:e} off, allowed are {allowed:e}")]
    NotPlane {
        /// Number of the profile.
        profile: i64,
        /// Index of the point farthest off, from 0, duplicates not counted.
        point: usize,
        /// Its distance from the fitted plane.
        distance: f64,
        /// The greatest distance accepted.
        allowed: f64,
    },
    /// The two sides of a section cross each other.
    #[error("profile {profile} crosses itself near {at:.6}, expected a curve round a wing section")]
    CrossesItself {
        /// Number of the profile.
        profile: i64,
        /// Where.
        at: DVec3,
    },
    /// There is no profile at all.
    #[error("no profiles given, expected at least one")]
    NoProfiles,
    /// Two profiles carry the same number.
    #[error("profile {profile} is given more than once, expected one of each number")]
    Doubled {
        /// The number.
        profile: i64,
    },
    /// Old and new profiles do not carry the same numbers.
    #[error("old and new profiles must have the same numbers: old {old:?}, new {new:?}")]
    Numbers {
        /// Numbers of the old profiles, ascending.
        old: Vec<i64>,
        /// Numbers of the new profiles, ascending.
        new: Vec<i64>,
    },
    /// Two old profiles lie in the same plane, or their planes are perpendicular.
    #[error("profiles {first} and {second} are {gap:e} apart along the span, expected planes one beside the other")]
    SamePlane {
        /// One profile.
        first: i64,
        /// The other.
        second: i64,
        /// Distance between them along the mean normal.
        gap: f64,
    },
    /// A plane does not meet the surface.
    #[error("the plane at {at} along normal {normal} misses the wing, which runs from {low} to {high}")]
    PlaneMisses {
        /// The plane's normal.
        normal: DVec3,
        /// Where the plane stands along its normal.
        at: f64,
        /// Where the surface begins along the normal.
        low: f64,
        /// Where it ends.
        high: f64,
    },
    /// A plane cuts the surface into several curves.
    #[error("the plane at {at} along normal {normal} cuts the wing into {pieces} curves, expected one")]
    Pieces {
        /// The plane's normal.
        normal: DVec3,
        /// Where the plane stands along its normal.
        at: f64,
        /// How many curves.
        pieces: usize,
    },
    /// The cut branches, because three or more triangles share an edge there.
    #[error("the plane at {at} along normal {normal} cuts no simple curve: it branches at {position}")]
    Branches {
        /// The plane's normal.
        normal: DVec3,
        /// Where the plane stands along its normal.
        at: f64,
        /// Where it branches.
        position: DVec3,
    },
    /// A triangle names a vertex that does not exist, or one with coordinates that are not numbers.
    #[error(
        "triangle {triangle} names vertex {vertex}, expected one of the {n_vertices} vertices with finite position"
    )]
    Triangle {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// A plane was asked for in words that say none.
    #[error("'{text}' names no plane, expected x=, y= or z= and a number, for example y=1.5")]
    PlaneText {
        /// What was given.
        text: String,
    },
    /// Per-vertex arrays of different length.
    #[error("{positions} positions but {normals} normals, expected one normal a position")]
    Lengths {
        /// Number of positions.
        positions: usize,
        /// Number of normals.
        normals: usize,
    },
    /// Profiles could not be written.
    #[error("profiles could not be written: {what}")]
    Write {
        /// What the writer said.
        what: String,
    },
}
