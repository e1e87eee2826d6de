//! The roles of families. Each role is a variant of [`Role`] and a row in [`ROLES`].
//!
//! The case file, the stages and local optimisation read the rows.

use std::mem::discriminant;

use glam::DVec3;

/// The start to which the conservative springs of a wingtip or of an attached family pull back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TipStart {
    /// The undeformed place, moved by the best affine motion of the assembly's root. So a tip
    /// follows a wing that is bent up and gets a longer tip chord.
    #[default]
    Affine,
    /// The undeformed place, moved by the best rigid motion of the assembly's root.
    Rigid,
    /// The undeformed place itself, as in the paper.
    Original,
}

/// What the curve does in which an attached family meets a wing or a rigid body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Junction {
    /// The curve goes with the wing or the body. Where the wing stretches, or the body moves
    /// against the wing, the attached family gives way.
    #[default]
    Glued,
    /// The curve slides on the wing or the body, so that the attached family keeps its shape.
    Slide,
}

/// The motion of a rigid family. The root is the root of its assembly; see
/// [`Assembly`](super::Assembly).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RigidMotion {
    /// The best rigid motion of the root.
    #[default]
    Root,
    /// The mean displacement of the root: the family keeps its attitude.
    Translation,
    /// None: the family stays.
    None,
    /// A motion that its user gives, whatever the root does: a turn about an axis through a point,
    /// and then a shift.
    Given {
        /// The axis of the turn, as long as the angle in degrees.
        turn: DVec3,
        /// A point of the axis, in the mesh's unit.
        about: DVec3,
        /// The shift, in the mesh's unit.
        shift: DVec3,
    },
}

impl RigidMotion {
    /// A given motion from the vectors that a user gave; see [`RigidMotion::Given`].
    ///
    /// # Errors
    /// The reason why they are no motion.
    pub fn given(turn: Option<DVec3>, about: Option<DVec3>, shift: Option<DVec3>) -> Result<Self, &'static str> {
        match (turn, about, shift) {
            (None, _, None) => Err("has neither `turn` nor `shift`, expected at least one of them"),
            (Some(_), None, _) => Err("has a `turn`, expected also `about`, a point of its axis"),
            (None, Some(_), _) => Err("has `about` but no `turn`, expected both or neither"),
            _ => {
                let [turn, about, shift] = [turn, about, shift].map(Option::unwrap_or_default);
                Ok(Self::Given { turn, about, shift })
            }
        }
    }
}

/// The motion of a family when the wing changes.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// The family is moved by its profiles.
    Wing,
    /// The strip behind a blunt wing. It follows the wing, first as a curve and then as a surface.
    TrailingEdge,
    /// The cap of a wing. It follows the wing, and conservative springs hold it back.
    Wingtip {
        /// Coefficient of the conservative springs, from 0 (rigid) to 1 (freely deformable),
        /// without unit.
        coefficient: f64,
        /// The start to which the conservative springs pull back.
        start: TipStart,
    },
    /// A part that hangs from a wing, such as a pylon, a flap track fairing or a winglet without
    /// profiles. It goes with its root, and gives way near it.
    Attached {
        /// As for [`Role::Wingtip`].
        coefficient: f64,
        /// The start to which the conservative springs pull back.
        start: TipStart,
        /// Whether its curve on a wing slides. If it does, and the family ends on a rigid body with
        /// a motion of its own, its coefficient is 1: the body's motion spreads over all of it.
        junction: Junction,
    },
    /// One rigid body, such as a nacelle.
    Rigid {
        /// Its motion.
        motion: RigidMotion,
        /// Whether the curves of attached families on it slide.
        junction: Junction,
    },
    /// Elastic shape: the family slides on its original surface.
    Carenage,
    /// The family slides in its plane.
    Plane {
        /// Largest distance of a vertex from the plane fitted to the family, as a fraction of the
        /// family's size (the largest distance of a vertex from their centre). Each vertex keeps
        /// its own distance from the plane. With `None` the family must be flat to 1e-6.
        flat: Option<f64>,
        /// Name of the plane family that is a shifted copy of this one: matching vertices move
        /// alike. One of the two families names the other, or both do.
        partner: Option<String>,
    },
    /// The family does not move.
    Fixed,
    /// The family takes the displacement that its user gives.
    Prescribed,
    /// The family lies inside the volume, such as the disk of a fan or a wake, and moves with it.
    Interior,
}

/// The stage that places a vertex. If a vertex lies on several families, the first stage in this
/// order places it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are those of the roles")]
pub enum PlacedBy {
    Fixed,
    Prescribed,
    Wing,
    TrailingEdge,
    Rigid,
    /// Wingtips too.
    Attached,
    Carenage,
    Plane,
    Volume,
}

impl PlacedBy {
    /// The name of the role whose vertices this stage places.
    pub fn name(self) -> &'static str {
        let row = ROLES.iter().find(|row| row.placed_by == self && self != Self::Volume);
        row.map_or("volume", |row| row.name)
    }

    /// Whether local optimisation may slide the vertices on their surface.
    pub fn slides(self) -> bool {
        matches!(self, Self::Wing | Self::TrailingEdge | Self::Attached | Self::Carenage)
    }

    /// Whether the families move: by the design, or because they follow families that do. Planes do
    /// not count, as they only slide.
    pub fn moves(self) -> bool {
        !matches!(self, Self::Fixed | Self::Plane | Self::Volume)
    }
}

/// The options in a family's table beside its role.
#[derive(Clone, Debug, Default)]
pub struct RoleOptions {
    /// See [`Role::Wingtip`]; 0.5 if `None`.
    pub coefficient: Option<f64>,
    /// See [`Role::Wingtip`]; if `None`, affine for a wingtip and rigid for an attached family.
    pub start: Option<TipStart>,
    /// See [`Role::Attached`] and [`Role::Rigid`].
    pub junction: Junction,
    /// See [`Role::Rigid`].
    pub motion: RigidMotion,
    /// See [`Role::Plane`].
    pub flat: Option<f64>,
    /// See [`Role::Plane`].
    pub partner: Option<String>,
}

/// A row of [`ROLES`].
#[derive(Debug)]
pub struct RoleRow {
    /// The name in case files.
    pub name: &'static str,
    /// Other names in case files.
    pub aliases: &'static [&'static str],
    /// Words by which other programs call what may have this role, in small letters alone. No case
    /// file may use them, but an error that meets one tells of the role.
    pub called: &'static [&'static str],
    /// The keys that only this role has.
    pub keys: &'static [&'static str],
    /// The stage that places the vertices.
    pub placed_by: PlacedBy,
    /// Makes the role from its options.
    pub make: fn(RoleOptions) -> Role,
}

/// All roles.
pub const ROLES: &[RoleRow] = &[
    RoleRow {
        name: "wing",
        aliases: &[],
        called: &["mainwing", "airfoil", "blade", "lifting", "tail", "canard", "profile", "profiles", "wall"],
        keys: &[],
        placed_by: PlacedBy::Wing,
        make: |_| Role::Wing,
    },
    RoleRow {
        name: "trailing-edge",
        aliases: &[],
        called: &["te", "trailing", "edge", "base", "blunt"],
        keys: &[],
        placed_by: PlacedBy::TrailingEdge,
        make: |_| Role::TrailingEdge,
    },
    RoleRow {
        name: "wingtip",
        aliases: &[],
        called: &["tip", "cap", "tipcap"],
        keys: &["coefficient", "start"],
        placed_by: PlacedBy::Attached,
        make: |options| Role::Wingtip {
            coefficient: options.coefficient.unwrap_or(0.5),
            start: options.start.unwrap_or(TipStart::Affine),
        },
    },
    RoleRow {
        name: "attached",
        aliases: &[],
        called: &[
            "pylon",
            "winglet",
            "strut",
            "flaptrack",
            "flaptrackfairing",
            "ftf",
            "fence",
            "hanging",
            "attachment",
        ],
        keys: &["coefficient", "start", "junction"],
        placed_by: PlacedBy::Attached,
        make: |options| Role::Attached {
            coefficient: options.coefficient.unwrap_or(0.5),
            start: options.start.unwrap_or(TipStart::Rigid),
            junction: options.junction,
        },
    },
    RoleRow {
        name: "rigid",
        aliases: &[],
        called: &["nacelle", "engine", "pod", "store", "tank", "solid", "rigidbody"],
        keys: &["motion", "junction"],
        placed_by: PlacedBy::Rigid,
        make: |options| Role::Rigid { motion: options.motion, junction: options.junction },
    },
    RoleRow {
        name: "carenage",
        aliases: &["fuselage", "fairing"],
        called: &["body", "hull", "slip", "slide", "sliding", "surface", "wall"],
        keys: &[],
        placed_by: PlacedBy::Carenage,
        make: |_| Role::Carenage,
    },
    RoleRow {
        name: "plane",
        aliases: &[],
        called: &[
            "symmetry",
            "symmetryplane",
            "sym",
            "periodic",
            "cyclic",
            "mirror",
            "flat",
            "slip",
            "slide",
            "sliding",
        ],
        keys: &["flat", "partner"],
        placed_by: PlacedBy::Plane,
        make: |options| Role::Plane { flat: options.flat, partner: options.partner },
    },
    RoleRow {
        name: "fixed",
        aliases: &[],
        called: &[
            "farfield",
            "far",
            "freestream",
            "inlet",
            "inflow",
            "outlet",
            "outflow",
            "static",
            "still",
            "held",
            "none",
            "opening",
            "external",
            "boundary",
            "wall",
            "slip",
        ],
        keys: &[],
        placed_by: PlacedBy::Fixed,
        make: |_| Role::Fixed,
    },
    RoleRow {
        name: "prescribed",
        aliases: &[],
        called: &["moving", "moved", "displaced", "displacement", "motion", "deforming", "deformed", "given"],
        keys: &["displacement"],
        placed_by: PlacedBy::Prescribed,
        make: |_| Role::Prescribed,
    },
    RoleRow {
        name: "interior",
        aliases: &[],
        called: &["internal", "inside", "inner", "volume", "fluid", "interface", "wake", "fan", "disk", "actuator"],
        keys: &[],
        placed_by: PlacedBy::Volume,
        make: |_| Role::Interior,
    },
];

impl Role {
    /// A flat plane family without a partner.
    pub const PLANE: Self = Self::Plane { flat: None, partner: None };

    /// The role with this name or alias, made from its options.
    pub fn named(name: &str, options: RoleOptions) -> Option<Self> {
        RoleRow::named(name).map(|row| (row.make)(options))
    }

    /// The row of the role.
    pub fn row(&self) -> &'static RoleRow {
        let is = |row: &&RoleRow| discriminant(&(row.make)(RoleOptions::default())) == discriminant(self);
        ROLES.iter().find(is).expect("every role has a row; a test looks")
    }

    /// The name in case files.
    pub fn name(&self) -> &'static str {
        self.row().name
    }

    /// The stage that places the vertices of a family with this role.
    pub fn placed_by(&self) -> PlacedBy {
        self.row().placed_by
    }

    /// Whether sections of a wing are bridged through the family where it stands on the wing: not
    /// through another wing, a trailing edge or a plane.
    pub fn is_bridged(&self) -> bool {
        !matches!(self.placed_by(), PlacedBy::Wing | PlacedBy::TrailingEdge | PlacedBy::Plane)
    }

    /// Whether the family slides in a plane.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }
}

impl RoleRow {
    /// The names of the roles that a word of another program may mean.
    pub fn called(word: &str) -> Vec<&'static str> {
        let letters: String = word.chars().filter(|letter| letter.is_alphanumeric()).collect();
        let letters = letters.to_lowercase();
        ROLES.iter().filter(|row| row.called.contains(&letters.as_str())).map(|row| row.name).collect()
    }

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
            Role::Attached { coefficient: 0.1, start: TipStart::Rigid, junction: Junction::Slide },
            Role::Rigid { motion: RigidMotion::None, junction: Junction::Glued },
            Role::Carenage,
            Role::PLANE,
            Role::Fixed,
            Role::Prescribed,
            Role::Interior,
        ];
        assert_eq!(all.len(), ROLES.len());
        for (role, row) in all.iter().zip(ROLES) {
            assert_eq!((role.name(), role.placed_by()), (row.name, row.placed_by));
            assert_eq!(Role::named(row.name, RoleOptions::default()).map(|role| role.name()), Some(row.name));
        }
        assert_eq!(Role::named("fuselage", RoleOptions::default()), Some(Role::Carenage));
        assert_eq!(Role::named("winglet", RoleOptions::default()), None);
    }

    /// A word that is a name itself would never be asked for.
    #[test]
    fn words_of_others_are_no_names() {
        for word in ROLES.iter().flat_map(|row| row.called) {
            assert_eq!(Role::named(word, RoleOptions::default()), None, "{word}");
            assert!(word.chars().all(|letter| letter.is_ascii_lowercase()), "{word}");
        }
        assert_eq!(RoleRow::called("Far-Field"), ["fixed"]);
        assert_eq!(RoleRow::called("wall"), ["wing", "carenage", "fixed"]);
        assert_eq!(RoleRow::called("?"), [""; 0]);
    }
}
