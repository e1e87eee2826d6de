//! [`MoverBuilder`] makes a [`Mover`] from a mesh, the roles of its families and the old profiles
//! of its wings.
//!
//! Families and wings are given by name. [`MoverBuilder::build`] looks the names up in the mesh.
//! [`Mover::builder`] begins a builder.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use super::{MoveError, Mover, Settings};
use crate::{
    backend::Backend,
    families::{MOST_FLAT, RigidMotion, Role, SetupError},
    mesh::{FamilyId, HybridMesh, OtherCells, TetMesh, families_inside},
    profile::{Plane, Profile, ProfileMatch},
    relaxation::{Method, Stopping},
    smoothing::QualityTarget,
    solver_measures::Limits,
    springs::Springs,
    stages::WingProfiles,
};

/// A function that gets the name of each stage as the stage begins.
pub(super) type Progress = Box<dyn Fn(&str) + Send>;

/// The parts of a [`Mover`], collected before [`MoverBuilder::build`].
///
/// Every family on the boundary needs a role, and every wing needs old profiles. All settings have
/// defaults.
#[must_use = "a builder does nothing before `build`"]
pub struct MoverBuilder {
    mesh: Arc<TetMesh>,
    others: Arc<OtherCells>,
    roles: BTreeMap<String, Role>,
    wings: Vec<NamedWing>,
    settings: Settings,
    movers: usize,
    progress: Progress,
}

/// A wing whose families are still names.
struct NamedWing {
    name: String,
    families: Vec<String>,
    old: Vec<Profile>,
    mirror: Option<Plane>,
    matched: Option<ProfileMatch>,
}

impl MoverBuilder {
    pub(super) fn new(mesh: Arc<TetMesh>) -> Self {
        let (roles, wings) = (BTreeMap::new(), Vec::new());
        let others = Arc::new(OtherCells::none());
        Self { mesh, others, roles, wings, settings: Settings::default(), movers: 1, progress: Box::new(|_| {}) }
    }

    /// Adds the pyramids, prisms, hexahedra and boundary quadrilaterals of a mesh that has some.
    /// They use the vertices and families of the mesh.
    pub fn other_cells(mut self, others: impl Into<Arc<OtherCells>>) -> Self {
        self.others = others.into();
        self
    }

    /// Sets the role of a family. A family inside the volume needs none. A second call for the same
    /// family replaces the first role.
    pub fn role(mut self, family: &str, role: Role) -> Self {
        self.roles.insert(family.to_owned(), role);
        self
    }

    /// Adds a wing that is one family, with its old profiles in the mesh's unit. Designs and
    /// reports name the wing after the family.
    pub fn old_profiles(self, family: &str, old: Vec<Profile>) -> Self {
        self.wing(family, &[family], old, None)
    }

    /// Adds a wing that may be several families, with its old profiles.
    ///
    /// If two wings share a curve, the wing that is added first places its vertices. The other one
    /// gives way over a strip beside the curve; see [`SharedCurve`](super::SharedCurve).
    ///
    /// - `name`: the name in designs and reports
    /// - `families`: at least one, all with the role [`Role::Wing`]
    /// - `old`: in the mesh's unit
    /// - `mirror`: a plane with the old profiles on one side; the wing on the other side moves as
    ///   their mirror image
    pub fn wing(mut self, name: &str, families: &[&str], old: Vec<Profile>, mirror: Option<Plane>) -> Self {
        let families = families.iter().map(|&family| family.to_owned()).collect();
        self.wings.push(NamedWing { name: name.to_owned(), families, old, mirror, matched: None });
        self
    }

    /// Sets how the new profiles of the wing that was added last are matched with its old ones.
    /// Without a wing it does nothing.
    ///
    /// - `by`: `None` if each design decides. A loop decides once, or its function may jump
    pub fn matched_by(mut self, by: impl Into<Option<ProfileMatch>>) -> Self {
        if let Some(wing) = self.wings.last_mut() {
            wing.matched = by.into();
        }
        self
    }

    /// Replaces all settings.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Sets [`Settings::springs`].
    pub fn springs(mut self, springs: &'static Springs) -> Self {
        self.settings.springs = springs;
        self
    }

    /// Sets [`Settings::method`].
    pub fn method(mut self, method: Method) -> Self {
        self.settings.method = method;
        self
    }

    /// Sets [`Settings::stopping`].
    pub fn stopping(mut self, stopping: Stopping) -> Self {
        self.settings.stopping = stopping;
        self
    }

    /// Sets [`Settings::quality`].
    pub fn quality(mut self, quality: Option<QualityTarget>) -> Self {
        self.settings.quality = quality;
        self
    }

    /// Sets [`Settings::limits`].
    pub fn limits(mut self, limits: Limits) -> Self {
        self.settings.limits = limits;
        self
    }

    /// Sets [`Settings::max_steps`].
    pub fn max_steps(mut self, max_steps: usize) -> Self {
        self.settings.max_steps = max_steps;
        self
    }

    /// Sets the number of movers of this mesh that the program will have at once. The memory must
    /// suffice for all.
    pub fn movers(mut self, movers: usize) -> Self {
        self.movers = movers;
        self
    }

    /// Sets a function that gets the name of each step of the set-up, and of each stage of every
    /// update, as the step or stage begins.
    ///
    /// | when | names |
    /// |---|---|
    /// | set-up | `topology`, `families`, `profiles`, `springs` |
    /// | update | `wing`, `trailing edge`, `wingtip`, `carenage`, `planes`, `volume` |
    /// | where called for | `step to N %`, `smoothing` (local optimisation) |
    pub fn progress(mut self, progress: impl Fn(&str) + Send + 'static) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Checks the mesh and sets every stage up on a backend.
    ///
    /// # Errors
    /// - [`MoveError::Setup`]: a family has no role, a name is no family of the mesh, a wing has no
    ///   families, a number of a role or a setting is out of its range, or roles or old profiles do
    ///   not fit the mesh
    /// - [`MoveError::Mesh`]: the mesh is not valid
    /// - [`MoveError::Memory`]: the mesh is too large for the memory
    /// - [`MoveError::Backend`]: the backend failed
    pub fn build(self, backend: impl Into<Arc<dyn Backend>>) -> Result<Mover, MoveError> {
        let Self { mesh, others, mut roles, wings, settings, movers, progress } = self;
        let unknown = |name: &str| SetupError::UnknownFamily { name: name.to_owned(), known: mesh.families.clone() };
        let by_name = mesh.families_by_name();
        let find = |name: &String| by_name.get(name.as_str()).copied().ok_or_else(|| unknown(name));
        check_names(&wings)?;
        let mut found = Vec::new();
        for NamedWing { name, families, old, mirror, matched } in wings {
            let families = families.iter().map(find).collect::<Result<Vec<FamilyId>, _>>()?;
            if families.is_empty() {
                return Err(SetupError::NoFamilies { wing: name }.into());
            }
            found.push(WingProfiles { name, families, old, mirror, matched });
        }
        // A name that is none of the mesh's is told before the family that has no role for it.
        if let Some(name) = roles.keys().find(|name| !by_name.contains_key(name.as_str())) {
            return Err(unknown(name).into());
        }
        let mut without: Vec<String> =
            mesh.families.iter().filter(|family| !roles.contains_key(*family)).cloned().collect();
        if !without.is_empty() {
            let inside = families_inside(HybridMesh { mesh: &mesh, others: &others });
            without.retain(|family| !by_name.get(family.as_str()).is_some_and(|family| inside[family.index()]));
            let of_families = mesh.families.iter().zip(inside).filter(|&(_, inside)| inside);
            of_families.for_each(|(family, _)| {
                roles.entry(family.clone()).or_insert(Role::Interior);
            });
        }
        if !without.is_empty() {
            return Err(SetupError::NoRole { families: without }.into());
        }
        roles.iter().try_for_each(|(family, role)| check_role(family, role))?;
        check_settings(&settings)?;
        let in_order = mesh.families.iter().filter_map(|family| roles.remove(family)).collect();
        Mover::set_up(mesh, others, in_order, &found, (settings, movers), backend.into(), progress)
    }
}

/// Refuses wings that designs and reports could not tell apart, and families that a wing has twice.
fn check_names(wings: &[NamedWing]) -> Result<(), SetupError> {
    let mut names = BTreeSet::new();
    let of_families: BTreeSet<&String> = wings.iter().flat_map(|wing| &wing.families).collect();
    for NamedWing { name, families, .. } in wings {
        if !names.insert(name) || of_families.contains(name) && !families.contains(name) {
            return Err(SetupError::WingNames { wing: name.clone() });
        }
        let mut seen = BTreeSet::new();
        if let Some(family) = families.iter().find(|&family| !seen.insert(family)) {
            return Err(SetupError::FamilyTwice { wing: name.clone(), family: family.clone() });
        }
    }
    Ok(())
}

/// Refuses numbers of a role that mean nothing.
fn check_role(family: &str, role: &Role) -> Result<(), SetupError> {
    let (name, value, is_good, expected) = match *role {
        Role::Wingtip { coefficient, .. } | Role::Attached { coefficient, .. } => {
            let is_good = (0.0..=1.0).contains(&coefficient);
            ("coefficient", coefficient, is_good, "0 (rigid) to 1 (freely deformable)")
        }
        Role::Rigid { motion: RigidMotion::Given { turn, about, shift }, .. } => {
            let worst = [turn, about, shift].iter().flat_map(|v| v.to_array()).find(|x| !x.is_finite());
            ("motion", worst.unwrap_or_default(), worst.is_none(), "finite numbers")
        }
        Role::Plane { flat: Some(flat), .. } => {
            let expected = "a fraction of the family's size, above 0 and up to 0.1";
            ("flat", flat, flat > 0.0 && flat <= MOST_FLAT, expected)
        }
        _ => return Ok(()),
    };
    let what = format!("`{name}` of family `{family}`");
    if is_good { Ok(()) } else { Err(SetupError::OutOfRange { what, value, expected }) }
}

/// Refuses settings that mean nothing.
fn check_settings(settings: &Settings) -> Result<(), SetupError> {
    let Stopping { tolerance, max_sweeps } = settings.stopping;
    let refused =
        |name: &str, value, expected| Err(SetupError::OutOfRange { what: format!("`{name}`"), value, expected });
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return refused("tolerance", tolerance, "a number above 0, such as 1e-4");
    }
    if max_sweeps == 0 {
        return refused("max_sweeps", 0.0, "a number of sweeps from 1 on");
    }
    if settings.max_steps == 0 {
        return refused("max_steps", 0.0, "a number of steps from 1 on");
    }
    Ok(())
}
