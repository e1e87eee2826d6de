//! The displacement of a wing by new profiles.

use std::collections::BTreeMap;

use glam::DVec3;

use super::checks::Closeness;
use super::{Plane, Profile, ProfileMatch, Remark};

/// The displacement of the wing by new profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileDisplacement {
    /// Displacement of each wing vertex `[n_positions]`, in the mesh's unit.
    pub displacement: Vec<DVec3>,
    /// Unit span-wise direction of the moved wing at each vertex `[n_positions]`: at constant
    /// parameter of the sections, towards growing span coordinate.
    pub span_direction: Vec<DVec3>,
    /// If the new profiles are flat cuts through facets: the sections of the moved wing's vertices,
    /// in the order of the span. They are the old sections from vertices with the change of the
    /// cuts. Otherwise the new profiles are these sections.
    pub displaced: Option<Vec<Profile>>,
    /// For each section, the new positions of the vertices beside its plane, carried into the
    /// plane.
    pub(super) carried: Vec<Vec<DVec3>>,
    /// A new profile whose match has no derivative, by its number, and why.
    pub(crate) why_not: Option<(i64, &'static str)>,
    /// A new profile whose match has another derivative beside the design, by its number, and why.
    pub(crate) kink: Option<(i64, &'static str)>,
    /// How each new profile was matched, by its number.
    pub matches: BTreeMap<i64, ProfileMatch>,
    /// The planes of the new profiles.
    pub(super) planes: Vec<Plane>,
    /// The check that comes nearest to refusing the profiles.
    pub closeness: Closeness,
    /// What is odd about the new profiles.
    pub remarks: Vec<Remark>,
    /// Whether the new profiles were compared with flat cuts through the wing's facets.
    pub flat_cuts: bool,
}
