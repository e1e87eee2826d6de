//! The roles of families, one row each in [`ROLES`].
//!
//! A new role is a variant of [`Role`] and a row. The case file, the stages and local optimisation read the rows.

use std::mem::discriminant;

/// The start that the conservative springs of a wingtip pull back to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TipStart {
    /// The start, carried along by the best affine motion of the tip's boundary: a wing that is bent up and gets a
    /// longer tip chord takes its tip with it.
    #[default]
    Affine,
    /// The start, carried along by the best rigid motion of the tip's boundary.
    Rigid,
    /// The start where it was: the paper's words.
    Original,
}

/// What a family does when the wing changes.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// Moved by its profiles.
    Wing,
    /// The strip behind a blunt wing: follows the wing, as a curve and then as a surface.
    TrailingEdge,
    /// The cap of a wing: follows it, held back by conservative springs.
    Wingtip {
        /// Conservative springs' coefficient, `0` (rigid) to `1` (freely deformable).
        coefficient: f64,
        /// The place the conservative springs pull back to.
        start: TipStart,
    },
    /// Elastic shape: slides on its original surface.
    Carenage,
    /// Slides in its plane.
    Plane {
        /// How far its vertices may lie off the plane fitted to them, as a fraction of the family's size (the largest
        /// distance of a vertex from their centre): each keeps its own distance from it. Without it the family must be flat
        /// to 1e-6.
        flat: Option<f64>,
        /// Name of the plane family that is this one, shifted: matching vertices move alike. One of the two may name the
        /// other, or both.
        partner: Option<String>,
    },
    /// Does not move.
    Fixed,
    /// Moved as its user says.
    Prescribed,
}

/// Which stage places a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are those of the roles")]
pub enum PlacedBy {
    Fixed,
    Prescribed,
    Wing,
    TrailingEdge,
    Wingtip,
    Carenage,
    Plane,
    Volume,
}

impl PlacedBy {
    /// The name of the role whose vertices the stage places.
    pub fn name(self) -> &'static str {
        ROLES.iter().find(|row| row.placed_by == self).map_or("volume", |row| row.name)
    }

    /// Whether vertices of such families slide on their surface in local optimisation.
    pub fn slides(self) -> bool {
        matches!(self, Self::Wing | Self::TrailingEdge | Self::Wingtip | Self::Carenage)
    }

    /// Whether such families are moved by the design or follow what is; planes only slide along.
    pub fn moves(self) -> bool {
        !matches!(self, Self::Fixed | Self::Plane | Self::Volume)
    }
}

/// Everything that the table of a family may say beside its role.
#[derive(Clone, Debug, Default)]
pub struct RoleOptions {
    /// See [`Role::Wingtip`]; 0.5 if nothing is said.
    pub coefficient: Option<f64>,
    /// See [`Role::Wingtip`].
    pub start: TipStart,
    /// See [`Role::Plane`].
    pub flat: Option<f64>,
    /// See [`Role::Plane`].
    pub partner: Option<String>,
}

/// A row of [`ROLES`].
#[derive(Debug)]
pub struct RoleRow {
    /// Its name in case files.
    pub name: &'static str,
    /// Other names by which case files may call it.
    pub aliases: &'static [&'static str],
    /// The keys that belong to it alone.
    pub keys: &'static [&'static str],
    /// The stage that places its vertices.
    pub placed_by: PlacedBy,
    /// The role with these options.
    pub make: fn(RoleOptions) -> Role,
}

/// Every role.
pub const ROLES: &[RoleRow] = &[
    RoleRow { name: "wing", aliases: &[], keys: &[], placed_by: PlacedBy::Wing, make: |_| Role::Wing },
    RoleRow {
        name: "trailing-edge",
        aliases: &[],
        keys: &[],
        placed_by: PlacedBy::TrailingEdge,
        make: |_| Role::TrailingEdge,
    },
    RoleRow {
        name: "wingtip",
        aliases: &[],
        keys: &["coefficient", "start"],
        placed_by: PlacedBy::Wingtip,
        make: |options| Role::Wingtip { coefficient: options.coefficient.unwrap_or(0.5), start: options.start },
    },
    RoleRow {
        name: "carenage",
        aliases: &["fuselage", "fairing"],
        keys: &[],
        placed_by: PlacedBy::Carenage,
        make: |_| Role::Carenage,
    },
    RoleRow {
        name: "plane",
        aliases: &[],
        keys: &["flat", "partner"],
        placed_by: PlacedBy::Plane,
        make: |options| Role::Plane { flat: options.flat, partner: options.partner },
    },
    RoleRow { name: "fixed", aliases: &[], keys: &[], placed_by: PlacedBy::Fixed, make: |_| Role::Fixed },
    RoleRow {
        name: "prescribed",
        aliases: &[],
        keys: &["displacement"],
        placed_by: PlacedBy::Prescribed,
        make: |_| Role::Prescribed,
    },
];

impl Role {
    /// A flat plane family that slides by itself.
    pub const PLANE: Self = Self::Plane { flat: None, partner: None };

    /// The role of this name or alias, with these options.
    pub fn named(name: &str, options: RoleOptions) -> Option<Self> {
        RoleRow::named(name).map(|row| (row.make)(options))
    }

    /// Its row in the table.
    pub fn row(&self) -> &'static RoleRow {
        let is = |row: &&RoleRow| discriminant(&(row.make)(RoleOptions::default())) == discriminant(self);
        ROLES.iter().find(is).expect("every role has a row; a test looks")
    }

    /// Its name in case files.
    pub fn name(&self) -> &'static str {
        self.row().name
    }

    /// The stage that places vertices of a family with this role.
    pub fn placed_by(&self) -> PlacedBy {
        self.row().placed_by
    }

    /// Whether it slides in a plane.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }
}

impl RoleRow {
    /// The row with this name or alias.
    pub fn named(name: &str) -> Option<&'static Self> {
        ROLES.iter().find(|row| row.name == name || row.aliases.contains(&name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_has_one_row() {
        let all = [
            Role::Wing,
            Role::TrailingEdge,
            Role::Wingtip { coefficient: 0.1, start: TipStart::Rigid },
            Role::Carenage,
            Role::PLANE,
            Role::Fixed,
            Role::Prescribed,
        ];
        assert_eq!(all.len(), ROLES.len());
        for (role, row) in all.iter().zip(ROLES) {
            assert_eq!((role.name(), role.placed_by()), (row.name, row.placed_by));
            assert_eq!(Role::named(row.name, RoleOptions::default()).map(|role| role.name()), Some(row.name));
        }
        assert_eq!(Role::named("fuselage", RoleOptions::default()), Some(Role::Carenage));
        assert_eq!(Role::named("winglet", RoleOptions::default()), None);
    }
}
