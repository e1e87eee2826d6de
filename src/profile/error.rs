//! Errors of profiles.

use std::path::PathBuf;

use glam::DVec3;
use thiserror::Error;

use crate::text::figures::{length, near};
use crate::text::shown;

/// An error of reading, cutting, matching or interpolating profiles.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// A line of a profile file is wrong.
    #[error("{}:{line}: {what}; expected {expected}", path.display(), what = shown(what))]
    Line {
        /// Path of the file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// The text found.
        what: String,
        /// The text expected.
        expected: &'static str,
    },
    /// A profile file cannot be read.
    #[error("{what}", what = shown(what))]
    File {
        /// File, place and cause, in words.
        what: String,
    },
    /// The case does not say where an airfoil goes.
    #[error(
        "{}:1: the coordinates of an airfoil do not say where it is; expected a placement in the case: \
         [profiles.NAME.placement.\"FILE\"], with the chord and the leading edge that `idmesh cut` prints",
        path.display()
    )]
    NoPlacement {
        /// Path of the file.
        path: PathBuf,
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
    /// A profile has fewer than three different points.
    #[error("profile {profile} has {points} different points, expected at least 3")]
    TooFewPoints {
        /// Number of the profile.
        profile: i64,
        /// Number of different points.
        points: usize,
    },
    /// All points lie on one line, so they define no plane.
    #[error(
        "profile {profile}: all points lie on one line, expected a section with thickness; families that make up one wing share \
         one table with whole sections: families = [\"upper\", \"lower\"]"
    )]
    OnOneLine {
        /// Number of the profile.
        profile: i64,
    },
    /// The points do not lie in one plane.
    #[error("profile {profile} is not plane: point {point} lies {distance:e} off, allowed are {allowed:e}")]
    NotPlane {
        /// Number of the profile.
        profile: i64,
        /// Index of the farthest point, from 0; duplicates do not count.
        point: usize,
        /// Distance of the point from the fitted plane, in the mesh's unit.
        distance: f64,
        /// The allowed distance.
        allowed: f64,
    },
    /// The points of a profile jump back and forth.
    #[error(
        "profile {profile}: the points are not in order along the curve, they turn back at {} and elsewhere, expected \
         them from one side of the trailing edge round the leading edge to the other",
        near(*at)
    )]
    NotInOrder {
        /// Number of the profile.
        profile: i64,
        /// The first turn back.
        at: DVec3,
    },
    /// An open profile does not end at the trailing edge on both sides.
    #[error(
        "profile {profile} is open and ends at {}, short of the trailing edge: expected both sides of a section, from \
         one side of the trailing edge round the leading edge to the other",
        near(*at)
    )]
    ProfileCutShort {
        /// Number of the profile.
        profile: i64,
        /// The end before the trailing edge.
        at: DVec3,
    },
    /// An old profile does not lie on the wing.
    #[error(
        "profile {profile}: the old profile and the wing's surface are {} apart in its plane, {:.1} % of the \
         chord, expected the section of this wing: profiles of another place, another design, or in other axes?",
        length(*distance, distance / share),
        100.0 * share
    )]
    OffWing {
        /// Number of the profile.
        profile: i64,
        /// Largest distance, in the mesh's unit.
        distance: f64,
        /// The distance as a share of the profile's length.
        share: f64,
    },
    /// A profile is much larger or smaller than the curve it is compared with.
    #[error("profile {profile} is {}: another unit of length?", times_of(*times, of))]
    Size {
        /// Number of the profile.
        profile: i64,
        /// Length of the profile over the length of the other curve.
        times: f64,
        /// The other curve.
        of: &'static str,
    },
    /// Beyond the mirror plane the wing is no mirror image of its other half.
    #[error(
        "profile {profile}: beyond the mirror plane the wing lies {} off the profile's mirror image, or is not there: \
         another mirror plane, or a wing that is not symmetric?",
        length(*distance, *distance)
    )]
    OffMirror {
        /// Number of the profile.
        profile: i64,
        /// Largest distance, in the mesh's unit.
        distance: f64,
    },
    /// A new profile that is matched point by point has another number of points than the old one,
    /// or only one of the two is closed.
    #[error(
        "profile {profile} has {}, and the old one {}: expected as many, in the same order, because the match is by \
         points; `idmesh cut` prints the old profile's points, and match = \"measure\" takes any number",
        points_of(*new, closed[0]),
        points_of(*old, closed[1])
    )]
    PointCounts {
        /// Number of the profile.
        profile: i64,
        /// Points of the new profile. The first point of a closed one counts at the end again.
        new: usize,
        /// Points of the old profile.
        old: usize,
        /// Whether the new and the old profile are closed.
        closed: [bool; 2],
    },
    /// A new profile that is matched point by point has its points in another order.
    #[error(
        "profile {profile}: {what}, expected the order of the old profile, because the match is by points; \
         match = \"measure\" takes any order"
    )]
    PointOrder {
        /// Number of the profile.
        profile: i64,
        /// What is different, in words.
        what: &'static str,
    },
    /// The planes of a new and an old profile are nearly perpendicular.
    #[error(
        "profile {profile}: the new profile's plane stands across the old one's, expected about the same: other axes?"
    )]
    Turned {
        /// Number of the profile.
        profile: i64,
    },
    /// A profile has more points than any section needs.
    #[error("profile {profile} has {points} points, expected at most {most}")]
    TooManyPoints {
        /// Number of the profile.
        profile: i64,
        /// Number of points.
        points: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// A new profile is far from the wing.
    #[error(
        "profile {profile} lies {} away from the old one, the whole wing measures {}: profiles of another \
         wing, or in another unit of length or other axes?",
        length(*distance, *wing),
        length(*wing, *wing)
    )]
    FarAway {
        /// Number of the profile.
        profile: i64,
        /// Distance between the middles of the two profiles, in the mesh's unit.
        distance: f64,
        /// Extent of the wing, in the mesh's unit.
        wing: f64,
    },
    /// New profiles have another order along the span than the old ones.
    #[error(
        "the new profiles {first} and {second} stand the other way round along the span than the old ones: numbered from tip \
         to root on one side, and from root to tip on the other?"
    )]
    Order {
        /// Number of the first profile.
        first: i64,
        /// Number of the second profile.
        second: i64,
    },
    /// A new profile closes a blunt trailing edge.
    #[error(
        "profile {profile}: the new trailing edge is {new:.2e} thick, the old one {old:.2e}: a blunt trailing edge cannot \
         become sharp, its base would have no area; open the new profile to about the old thickness, by moving its \
         points apart in proportion to their distance from the leading edge"
    )]
    Sharp {
        /// Number of the profile.
        profile: i64,
        /// Thickness of the old trailing edge, in the mesh's unit.
        old: f64,
        /// Thickness of the new trailing edge, in the mesh's unit.
        new: f64,
    },
    /// A new profile points the other way, as no turn of the old one does.
    #[error(
        "profile {profile}: the new profile points the other way, its leading edge stands where the old trailing edge stood, and \
         no turn makes such a section: leading and trailing edge are swapped, as in a mirror, or an open profile begins at \
         its leading edge; expected the points from one side of the trailing edge round the leading edge to the other"
    )]
    Swapped {
        /// Number of the profile.
        profile: i64,
    },
    /// One side of a new profile ends far before the other.
    #[error(
        "profile {profile}: one side ends at {}, {:.1} % of the chord before the rear of the section{}: does the side lack \
         its last points at the trailing edge?",
        near(*at),
        100.0 * share,
        if *sharp { ", and the mesh's trailing edge is sharp, expected the first point repeated at the end" } else { "" }
    )]
    LacksPoints {
        /// Number of the profile.
        profile: i64,
        /// The end of the short side.
        at: DVec3,
        /// Distance of the end from the rear along the chord, as a share of the chord, beyond the
        /// old section's.
        share: f64,
        /// Whether the mesh's trailing edge is sharp.
        sharp: bool,
    },
    /// Two new profiles lie in one plane.
    #[error(
        "the new profiles {first} and {second} lie in one plane, and the old ones do not: the same file or the same placement \
         for both?"
    )]
    OnePlane {
        /// Number of the first profile.
        first: i64,
        /// Number of the second profile.
        second: i64,
    },
    /// The two sides of a section cross each other.
    #[error("profile {profile} crosses itself near {}, expected a curve round a wing section", near(*at))]
    CrossesItself {
        /// Number of the profile.
        profile: i64,
        /// A point near the crossing.
        at: DVec3,
    },
    /// Profiles stand on both sides of their mirror plane.
    #[error(
        "the profiles reach from {low} to {high} across the mirror plane, expected all on one side: the other half moves as \
         the mirror image"
    )]
    BothSides {
        /// Lowest signed distance from the plane, in the mesh's unit.
        low: f64,
        /// Highest signed distance from the plane, in the mesh's unit.
        high: f64,
    },
    /// There is no profile.
    #[error("no profiles given, expected at least one")]
    NoProfiles,
    /// Two profiles have the same number.
    #[error("profile {profile} is given more than once, expected one of each number")]
    Doubled {
        /// The number.
        profile: i64,
    },
    /// Old and new profiles have different numbers.
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
        /// Number of the first profile.
        first: i64,
        /// Number of the second profile.
        second: i64,
        /// Distance between the planes along the mean normal, in the mesh's unit.
        gap: f64,
    },
    /// The planes of old profiles turn too far along the span to be in one order.
    #[error(
        "the plane of profile {profile} intersects another profile or leans back over it, expected planes one after the other \
         that turn by at most 90 degrees along the span; a part of the wing may have a table of its own"
    )]
    LeansBack {
        /// Number of the profile.
        profile: i64,
    },
    /// A plane does not meet the surface.
    #[error(
        "the plane at {at} along normal {normal} misses the wing, which runs from {low} to {high}: another unit of length, or \
         other axes?"
    )]
    PlaneMisses {
        /// The plane's normal.
        normal: DVec3,
        /// Coordinate of the plane along its normal.
        at: f64,
        /// Lowest coordinate of the surface along the normal.
        low: f64,
        /// Highest coordinate of the surface along the normal.
        high: f64,
    },
    /// A plane cuts the surface into several curves.
    #[error(
        "the plane at {at} along normal {normal} cuts the wing into {pieces} curves, expected one{}",
        between(families)
    )]
    Pieces {
        /// The plane's normal.
        normal: DVec3,
        /// Coordinate of the plane along its normal.
        at: f64,
        /// Number of curves.
        pieces: usize,
        /// The families on which the curves end, where they are known.
        families: Box<[String]>,
    },
    /// An open section does not end at the trailing edge on both sides.
    #[error(
        "the plane at {at} along normal {normal} cuts a section that ends at {}, short of the trailing edge: \
         another body stands there, or the families hold one side of the wing only{}",
        near(end.position),
        between(&end.families)
    )]
    CutShort {
        /// The plane's normal.
        normal: DVec3,
        /// Coordinate of the plane along its normal.
        at: f64,
        /// The end before the trailing edge.
        end: Box<ShortEnd>,
    },
    /// A gap of a section is too large for a guess, or the family in it is no part on the wing.
    #[error("{0}")]
    Gap(Box<UnbridgedGap>),
    /// The cut branches, because three or more triangles share an edge.
    #[error("the plane at {at} along normal {normal} cuts no simple curve: it branches at {position}")]
    Branches {
        /// The plane's normal.
        normal: DVec3,
        /// Coordinate of the plane along its normal.
        at: f64,
        /// The point where it branches.
        position: DVec3,
    },
    /// A face names a vertex that does not exist, or whose coordinates are not finite.
    #[error("face {face} names vertex {vertex}, expected one of the {n_vertices} vertices with finite position")]
    Face {
        /// Index of the face.
        face: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
    /// A text names no plane.
    #[error("'{text}' names no plane, expected x=, y= or z= and a number, for example y=1.5")]
    PlaneText {
        /// The text.
        text: String,
    },
    /// Arrays per vertex have different lengths.
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
        /// The writer's message.
        what: String,
    },
}

/// The end of a section before its trailing edge.
#[derive(Clone, Debug, PartialEq)]
pub struct ShortEnd {
    /// The end, in the mesh's unit.
    pub position: DVec3,
    /// The families on which the section ends, where they are known.
    pub families: Vec<String>,
}

/// A gap of a section that is not bridged. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "the plane at {at} along normal {normal} cuts a section with a gap at `{}`, from {} to {}: {why}; a plane beside `{}` \
     gives a section of the wing",
    shown(family), near(ends[0]), near(ends[1]), shown(family)
)]
pub struct UnbridgedGap {
    /// The plane's normal.
    pub normal: DVec3,
    /// Coordinate of the plane along its normal.
    pub at: f64,
    /// The family in the gap.
    pub family: String,
    /// The ends of the gap.
    pub ends: [DVec3; 2],
    /// Why the gap is not bridged, in words.
    pub why: String,
}

impl ProfileError {
    /// Number of the profile at fault, if it is a single one.
    pub fn profile(&self) -> Option<i64> {
        match *self {
            Self::NotFinite { profile, .. }
            | Self::TooFewPoints { profile, .. }
            | Self::OnOneLine { profile }
            | Self::NotPlane { profile, .. }
            | Self::NotInOrder { profile, .. }
            | Self::ProfileCutShort { profile, .. }
            | Self::OffWing { profile, .. }
            | Self::Size { profile, .. }
            | Self::OffMirror { profile, .. }
            | Self::Turned { profile }
            | Self::TooManyPoints { profile, .. }
            | Self::FarAway { profile, .. }
            | Self::Sharp { profile, .. }
            | Self::Swapped { profile }
            | Self::LacksPoints { profile, .. }
            | Self::PointCounts { profile, .. }
            | Self::PointOrder { profile, .. }
            | Self::CrossesItself { profile, .. } => Some(profile),
            _ => None,
        }
    }
}

/// The families on which a section ends, in words.
fn between(families: &[String]) -> String {
    let names: Vec<String> = families.iter().map(|family| format!("`{}`", shown(family))).collect();
    if names.is_empty() { String::new() } else { format!("; its ends are on {}", names.join(" and ")) }
}

/// A number of points, in words.
fn points_of(n: usize, closed: bool) -> String {
    format!("{n} points{}", if closed { " with the first one again at the end" } else { "" })
}

/// Compares a profile of `times` the length of another curve with it, in words.
fn times_of(times: f64, of: &str) -> String {
    let figure = |times: f64| if times < 100.0 { format!("{times:.1}") } else { format!("{times:.0}") };
    match times {
        times if times < 1.0 => format!("{} times smaller than {of}", figure(1.0 / times)),
        times => format!("{} times larger than {of}", figure(times)),
    }
}
