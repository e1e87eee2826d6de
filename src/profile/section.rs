//! A section of the wing in one or two forms: a flat cut and the smooth section of its vertices.
//!
//! Flat facets cut the section below the smooth surface of the vertices. A new profile is either a
//! changed flat cut (of idmesh 0.1 or another program) or a smooth curve. If it were compared with
//! the other form, the facets' sag would count as a change. This change alternates from crossing to
//! crossing, and would dent the wing.
//!
//! If the old profiles are the sections of the vertices, as when they are cut from the mesh, a
//! design is compared with the flat cuts if its difference from these is smoother. Old profiles
//! that are flat cuts themselves are compared as given.

use glam::DVec3;
use rayon::prelude::*;

use super::matching::OldSection;
use super::{Plane, Profile, ProfileError};

/// The flat form is taken if its change alternates by less than this share of the smooth form's
/// change.
const CLEARLY: f64 = 0.5;

/// A profile is a form of the mesh's section if its distance from the form is less than this share
/// of its length. Files hold 6 digits and more.
const SAME_FORM: f64 = 1e-5;

/// The sections in their forms, in the order of the span.
#[derive(Debug)]
pub(super) struct Forms {
    /// The form of the vertices, or the sections as given.
    pub smooth: Vec<OldSection>,
    /// The flat cuts, if the smooth form belongs to the mesh and differs from them.
    pub flat: Option<Vec<OldSection>>,
    /// Whether the flat form was given.
    given_flat: bool,
}

/// A section cut from the wing in both forms.
#[derive(Clone, Debug)]
pub(super) struct OwnSection {
    pub flat: OldSection,
    pub carried: OldSection,
}

/// The changes of the sections by new profiles, in the form that the new profiles continue.
pub(super) struct Changes<'a> {
    /// The sections in this form.
    pub form: &'a [OldSection],
    /// Displacement of each section's knots, in the mesh's unit.
    pub knots: Vec<Vec<DVec3>>,
    /// Whether the form is flat.
    pub flat: bool,
}

impl OwnSection {
    /// Makes both forms from the points of [`super::cut::cut`] and [`super::cut::section`].
    pub fn new(number: i64, flat: Vec<DVec3>, carried: Vec<DVec3>, plane: &Plane) -> Result<Self, ProfileError> {
        let section = |points| OldSection::new(&Profile { number, points }, plane);
        Ok(Self { flat: section(flat)?, carried: section(carried)? })
    }

    /// Whether the two forms differ.
    fn differ(&self) -> bool {
        !within(&self.carried, &self.flat)
    }

    /// Whether a profile is the section of the vertices.
    fn is_carried(&self, given: &OldSection) -> bool {
        within(given, &self.carried) && within(&self.carried, given)
    }

    /// Whether all points of a profile lie on the facets.
    fn is_flat(&self, given: &OldSection) -> bool {
        given.profile().points.iter().all(|&p| self.flat.distance_to_closed_lines(p) <= SAME_FORM * given.length())
    }
}

/// Whether all points of one profile lie on another.
fn within(points: &OldSection, on: &OldSection) -> bool {
    points.profile().points.iter().all(|&p| on.distance(p) <= SAME_FORM * on.length())
}

impl Forms {
    /// The forms of the given sections.
    ///
    /// - `own`: the wing's own sections, where the wing could be cut
    pub fn new(given: Vec<OldSection>, own: Vec<Option<OwnSection>>) -> Self {
        let own: Option<Vec<OwnSection>> = own.into_iter().collect();
        let Some(own) = own.filter(|own| own.iter().any(OwnSection::differ)) else {
            return Self { smooth: given, flat: None, given_flat: false };
        };
        let pairs = || given.iter().zip(&own);
        if pairs().all(|(given, own)| own.is_carried(given)) {
            let flat = own.into_iter().map(|own| own.flat).collect();
            Self { smooth: given, flat: Some(flat), given_flat: false }
        } else if pairs().all(|(given, own)| own.is_flat(given)) {
            let smooth = own.into_iter().map(|own| own.carried).collect();
            Self { smooth, flat: Some(given), given_flat: true }
        } else {
            Self { smooth: given, flat: None, given_flat: false }
        }
    }

    /// The sections as given.
    pub fn given(&self) -> &[OldSection] {
        match &self.flat {
            Some(flat) if self.given_flat => flat,
            _ => &self.smooth,
        }
    }

    /// The changes by new profiles, in the form that they continue.
    ///
    /// - `new`: in the order of the sections
    ///
    /// # Errors
    /// A new profile is no plane curve.
    pub fn changes(&self, new: &[&Profile]) -> Result<Changes<'_>, ProfileError> {
        let changes = |form: &'_ [OldSection]| -> Result<Vec<Vec<DVec3>>, ProfileError> {
            form.par_iter().zip(new).map(|(old, new)| old.displacements(new)).collect()
        };
        let of = |form, flat| Ok(Changes { form, knots: changes(form)?, flat });
        let Some(flat) = &self.flat else { return of(&self.smooth, false) };
        if self.given_flat {
            return of(flat, true);
        }
        let smooth = of(&self.smooth, false)?;
        let unchanged = |form: &[OldSection]| form.iter().zip(new).all(|(old, new)| old.is_same(new));
        if unchanged(&self.smooth) {
            return Ok(smooth);
        }
        let flat = of(flat, true)?;
        Ok(if unchanged(flat.form) || flat.roughness() < CLEARLY * smooth.roughness() { flat } else { smooth })
    }
}

impl Changes<'_> {
    fn roughness(&self) -> f64 {
        let of_section = |(old, change): (&OldSection, &Vec<DVec3>)| old.roughness(change).powi(2);
        self.form.iter().zip(&self.knots).map(of_section).sum::<f64>().sqrt()
    }
}
