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

use super::kept::KeptSection;
use super::matching::{KnotDisplacements, OldSection, ProfileMatch};
use super::near::Near;
use super::trend::Trend;
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
    pub smooth: Vec<KeptSection>,
    /// The flat cuts, if the smooth form belongs to the mesh and differs from them.
    pub flat: Option<Vec<KeptSection>>,
    /// Whether the flat form was given.
    given_flat: bool,
    /// Whether new profiles are matched point by point with the sections as given.
    by_points: bool,
}

/// A section cut from the wing in both forms.
#[derive(Clone, Debug)]
pub(super) struct OwnSection {
    pub flat: OldSection,
    pub carried: OldSection,
}

/// The forms of the wing's own section that may be needed beside the given section.
#[derive(Debug)]
pub(super) struct OwnForms {
    /// Whether the two forms differ.
    differ: bool,
    /// The flat cut, if the given profile is the section of the vertices.
    flat: Option<KeptSection>,
    /// The section of the vertices, if the given profile lies on the facets.
    carried: Option<KeptSection>,
}

/// The changes of the sections by new profiles, in the form that the new profiles continue.
pub(super) struct Changes<'a> {
    /// The sections in this form.
    pub form: &'a [KeptSection],
    /// The change of each section.
    pub of_section: Vec<Change>,
    /// Whether the form is flat.
    pub flat: bool,
}

/// The change of one section by its new profile.
pub(super) struct Change {
    /// Displacement of the knots, in the mesh's unit.
    pub knots: Vec<DVec3>,
    /// Displacement by the affine map fitted to the knots, at the probes of the form's trend.
    pub at_probes: [DVec3; 4],
    /// The match that was made.
    pub by: ProfileMatch,
    /// Why the match has no derivative, if it has none.
    pub why_not: Option<&'static str>,
    /// Why its derivative is another one beside the design, if it is.
    pub kink: Option<&'static str>,
    /// [`OldSection::roughness`], where two forms are compared.
    roughness: f64,
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
        let flat = Near::new(&self.flat);
        given.profile().points.iter().all(|&p| flat.closed_lines(p) <= SAME_FORM * given.length())
    }

    /// Keeps what may be needed beside a given section.
    ///
    /// # Errors
    /// A form has no chord along the given section's.
    pub fn beside(self, given: &OldSection) -> Result<OwnForms, ProfileError> {
        let differ = self.differ();
        let (is_carried, is_flat) = (self.is_carried(given), self.is_flat(given));
        let kept =
            |section: OldSection, needed: bool| needed.then(|| section.along(given).map(KeptSection::of)).transpose();
        Ok(OwnForms { differ, flat: kept(self.flat, is_carried)?, carried: kept(self.carried, is_flat)? })
    }
}

impl OwnForms {
    /// Whether the given profile is the section itself, in one of its forms.
    pub fn is_given(&self) -> bool {
        self.flat.is_some() || self.carried.is_some()
    }
}

/// Whether all points of one profile lie on another.
fn within(points: &OldSection, on: &OldSection) -> bool {
    let near = Near::new(on);
    points.profile().points.iter().all(|&p| near.curve(p) <= SAME_FORM * on.length())
}

impl Forms {
    /// The forms of the given sections.
    ///
    /// - `own`: the wing's own sections, where the wing could be cut
    pub fn new(given: Vec<KeptSection>, own: Vec<Option<OwnForms>>) -> Self {
        let own: Option<Vec<OwnForms>> = own.into_iter().collect();
        let Some(own) = own.filter(|own| own.iter().any(|own| own.differ)) else {
            return Self { smooth: given, flat: None, given_flat: false, by_points: false };
        };
        if own.iter().all(|own| own.flat.is_some()) {
            let flat = own.into_iter().filter_map(|own| own.flat).collect();
            Self { smooth: given, flat: Some(flat), given_flat: false, by_points: false }
        } else if own.iter().all(|own| own.carried.is_some()) {
            let smooth = own.into_iter().filter_map(|own| own.carried).collect();
            Self { smooth, flat: Some(given), given_flat: true, by_points: false }
        } else {
            Self { smooth: given, flat: None, given_flat: false, by_points: false }
        }
    }

    /// The sections as given.
    pub fn given(&self) -> &[KeptSection] {
        match &self.flat {
            Some(flat) if self.given_flat => flat,
            _ => &self.smooth,
        }
    }

    /// Sets how new profiles are matched. Point by point they are compared with the sections as
    /// given, in no other form.
    pub fn match_by(&mut self, by: Option<ProfileMatch>) {
        self.smooth.iter_mut().chain(self.flat.iter_mut().flatten()).for_each(|section| section.match_by(by));
        self.by_points = by == Some(ProfileMatch::Points);
    }

    /// The changes by new profiles, in the form that they continue.
    ///
    /// - `new`: in the order of the sections
    /// - `trend`, `flat_trend`: the trends of the smooth and of the flat form
    ///
    /// # Errors
    /// A new profile is no plane curve.
    pub fn changes(
        &self,
        new: &[&Profile],
        trend: &Trend,
        flat_trend: Option<&Trend>,
    ) -> Result<Changes<'_>, ProfileError> {
        let (Some(flat), Some(flat_trend)) = (&self.flat, flat_trend) else {
            return Changes::new(&self.smooth, new, trend, false, false);
        };
        if self.given_flat {
            return Changes::new(flat, new, flat_trend, true, false);
        }
        if self.by_points {
            return Changes::new(&self.smooth, new, trend, false, false);
        }
        let unchanged = |form: &[KeptSection]| form.iter().zip(new).all(|(old, new)| old.is_same(new));
        let smooth = Changes::new(&self.smooth, new, trend, false, true)?;
        if unchanged(&self.smooth) {
            return Ok(smooth);
        }
        let flat = Changes::new(flat, new, flat_trend, true, true)?;
        Ok(if unchanged(flat.form) || flat.roughness() < CLEARLY * smooth.roughness() { flat } else { smooth })
    }
}

impl<'a> Changes<'a> {
    /// - `trend`: of the form
    /// - `compared`: whether the form's roughness is needed
    fn new(
        form: &'a [KeptSection],
        new: &[&Profile],
        trend: &Trend,
        flat: bool,
        compared: bool,
    ) -> Result<Self, ProfileError> {
        let change = |(place, (old, new)): (usize, (&KeptSection, &&Profile))| {
            let section = old.section();
            let KnotDisplacements { knots, by, why_not, kink } = section.displacements(new)?;
            let at_probes = trend.probes(place).map(section.affine_change(&knots));
            let roughness = if compared { section.roughness(&knots) } else { 0.0 };
            Ok(Change { knots, at_probes, by, why_not, kink, roughness })
        };
        let of_section = form.par_iter().zip(new).enumerate().map(change).collect::<Result<_, _>>()?;
        Ok(Self { form, of_section, flat })
    }

    fn roughness(&self) -> f64 {
        self.of_section.iter().map(|change| change.roughness.powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{extent, tests::LOOKED_AT};
    use super::*;

    /// An ellipse with a corner at its end.
    fn points(n: usize) -> Vec<DVec3> {
        let at = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            DVec3::new(angle.cos(), 0.0, 0.1 * angle.sin() * (1.0 - angle.cos()).sqrt())
        };
        (0..=n).map(at).collect()
    }

    /// A given profile is compared with the wing's own section point by point. Its extent is not
    /// measured again for each point, so the number of points at which the measures look grows with
    /// the number of points, not with its square.
    #[test]
    fn an_extent_is_measured_once() {
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::Y };
        let n = 2000;
        let own = OwnSection::new(0, points(100), points(100), &plane).unwrap();
        let given = OldSection::new(&Profile { number: 0, points: points(n) }, &plane).unwrap();
        let kept = KeptSection::of(given.clone());
        LOOKED_AT.set(0);
        assert!(given.length() == kept.length() && kept.length() == extent(&points(n)));
        // On the own section's facets lies the whole of the own section, which is compared to its
        // last point.
        let same = OldSection::new(&Profile { number: 0, points: points(100) }, &plane).unwrap();
        assert!(own.clone().beside(&same).unwrap().carried.is_some());
        own.beside(&given).unwrap();
        (0..n).for_each(|_| assert!(kept.length() > 0.0));
        assert!(LOOKED_AT.get() <= 2 * n, "{}", LOOKED_AT.get());
    }
}
