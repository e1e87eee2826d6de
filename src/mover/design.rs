//! [`Design`]: what changes from one update of a [`Mover`](super::Mover) to the next.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::profile::Profile;

/// One design: new profiles of wings and displacements of prescribed families.
#[derive(Clone, Debug, Default)]
pub struct Design {
    /// New profiles of each wing, by the wing's name, in the mesh's unit. Every wing of the mover
    /// needs as many new profiles as it has old ones, with the same numbers.
    pub profiles: BTreeMap<String, Vec<Profile>>,
    /// Displacements of each prescribed family `[n_vertices of the family]`, by the family's name,
    /// in the mesh's unit and in the order of
    /// [`Mover::family_vertices`](super::Mover::family_vertices).
    pub prescribed: BTreeMap<String, Vec<DVec3>>,
}

impl Design {
    /// A design that gives one wing new profiles, in the mesh's unit.
    pub fn of_wing(wing: &str, new: Vec<Profile>) -> Self {
        Self::default().with_profiles(wing, new)
    }

    /// A design that displaces one prescribed family.
    ///
    /// - `displacement` `[n_vertices of the family]`: in the mesh's unit
    pub fn of_prescribed(family: &str, displacement: Vec<DVec3>) -> Self {
        Self::default().with_prescribed(family, displacement)
    }

    /// Adds new profiles for a wing, in the mesh's unit.
    #[must_use]
    pub fn with_profiles(mut self, wing: &str, new: Vec<Profile>) -> Self {
        self.profiles.insert(wing.to_owned(), new);
        self
    }

    /// Adds the displacements of a prescribed family.
    ///
    /// - `displacement` `[n_vertices of the family]`: in the mesh's unit
    #[must_use]
    pub fn with_prescribed(mut self, family: &str, displacement: Vec<DVec3>) -> Self {
        self.prescribed.insert(family.to_owned(), displacement);
        self
    }
}
