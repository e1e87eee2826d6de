//! What is kept of an old section.
//!
//! The smooth curves through a section take fifty times the memory of its points. A wing may have
//! tens of thousands of sections. So the points are kept, and the curves are made where a step
//! needs them, for a few sections at a time.

use glam::DVec3;

use super::chord::Chord;
use super::matching::{OldSection, ProfileMatch, identical};
use super::{Plane, Profile, ProfileError};

/// An old section without its smooth curves.
#[derive(Clone, Debug)]
pub(super) struct KeptSection {
    profile: Profile,
    plane: Plane,
    towards: Option<DVec3>,
    by: Option<ProfileMatch>,
    length: f64,
    middle: DVec3,
    gap: f64,
    has_base: bool,
    is_edge_clear: bool,
    chord: Chord,
}

impl KeptSection {
    /// Checks a profile and keeps what does not need its curves.
    ///
    /// - `towards`: as for [`OldSection::towards`]
    ///
    /// # Errors
    /// As [`OldSection::new`].
    pub fn new(profile: &Profile, plane: &Plane, towards: Option<DVec3>) -> Result<Self, ProfileError> {
        OldSection::towards(profile, plane, towards).map(Self::of)
    }

    /// Drops the curves of a section.
    pub fn of(section: OldSection) -> Self {
        let (length, middle, gap) = (section.length(), section.middle(), section.gap());
        let has_base = section.measured_base.is_some();
        let is_edge_clear = section.outline().edge.is_none_or(|edge| edge.is_clear);
        let chord = Chord::new(section.outline(), section.plane().normal);
        let (mut profile, plane, towards) = section.into_profile();
        profile.points.shrink_to_fit();
        let by = None;
        Self { profile, plane, towards, by, length, middle, gap, has_base, is_edge_clear, chord }
    }

    /// Sets how new profiles are matched; see [`OldSection::matched_by`].
    pub fn match_by(&mut self, by: Option<ProfileMatch>) {
        self.by = by;
    }

    /// The section with its curves. The same points give the same bits each time.
    pub fn section(&self) -> OldSection {
        let section = OldSection::towards(&self.profile, &self.plane, self.towards);
        section.expect("the profile was made a section before").matched_by(self.by)
    }

    /// Whether a profile has the section's points, in the same or the opposite order.
    pub fn is_same(&self, new: &Profile) -> bool {
        identical(&self.profile.points, &new.points)
    }

    /// Unit normal of the new profile's plane, on the side of the old one's normal.
    pub fn new_normal(&self, new: &Profile) -> Result<DVec3, ProfileError> {
        let normal = Plane::of_profile(new)?.normal;
        Ok(if normal.dot(self.plane.normal) < 0.0 { -normal } else { normal })
    }

    /// The profile as given.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The plane of the section.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Extent of the section, in the mesh's unit: about its chord.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Centre of the section: the mean of its curve.
    pub fn middle(&self) -> DVec3 {
        self.middle
    }

    /// Distance between the ends of the two sides: the thickness of a blunt trailing edge.
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// The chord of the section.
    pub fn chord(&self) -> &Chord {
        &self.chord
    }

    /// Whether the section's turns leave no doubt about its trailing edge.
    pub fn is_edge_clear(&self) -> bool {
        self.is_edge_clear
    }

    /// Whether the base of a blunt trailing edge is part of the curve.
    pub fn has_base(&self) -> bool {
        self.has_base
    }
}
