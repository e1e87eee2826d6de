//! [`MoverBuilder`] makes a [`Mover`] from a mesh, the roles of its families and the old profiles
//! of its wings.
//!
//! Families and wings are given by name. [`MoverBuilder::build`] looks the names up in the mesh.
//! [`Mover::builder`] begins a builder.

use std::{collections::BTreeMap, sync::Arc};

use super::{MoveError, Mover, Settings};
use crate::{
    backend::Backend,
    families::{Role, SetupError},
    mesh::{FamilyId, TetMesh},
    profile::{Plane, Profile},
    relaxation::{Method, Stopping},
    smoothing::QualityTarget,
    springs::Springs,
    stages::WingProfiles,
};

/// A function that gets the name of each stage as the stage begins.
pub(super) type Progress = Box<dyn Fn(&str) + Send>;

/// The parts of a [`Mover`], collected before [`MoverBuilder::build`].
///
/// Every family of the mesh needs a role, and every wing needs old profiles. All settings have
/// defaults.
#[must_use = "a builder does nothing before `build`"]
pub struct MoverBuilder {
    mesh: TetMesh,
    roles: BTreeMap<String, Role>,
    wings: Vec<NamedWing>,
    settings: Settings,
    progress: Progress,
}

/// A wing whose families are still names.
struct NamedWing {
    name: String,
    families: Vec<String>,
    old: Vec<Profile>,
    mirror: Option<Plane>,
}

impl MoverBuilder {
    pub(super) fn new(mesh: TetMesh) -> Self {
        let (roles, wings) = (BTreeMap::new(), Vec::new());
        Self { mesh, roles, wings, settings: Settings::default(), progress: Box::new(|_| {}) }
    }

    /// Sets the role of a family. A second call for the same family replaces the first role.
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
    /// - `name`: the name in designs and reports
    /// - `families`: at least one, all with the role [`Role::Wing`]
    /// - `old`: in the mesh's unit
    /// - `mirror`: a plane with the old profiles on one side; the wing on the other side moves as
    ///   their mirror image
    pub fn wing(mut self, name: &str, families: &[&str], old: Vec<Profile>, mirror: Option<Plane>) -> Self {
        let families = families.iter().map(|&family| family.to_owned()).collect();
        self.wings.push(NamedWing { name: name.to_owned(), families, old, mirror });
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

    /// Sets [`Settings::max_steps`].
    pub fn max_steps(mut self, max_steps: usize) -> Self {
        self.settings.max_steps = max_steps;
        self
    }

    /// Sets a function that gets the name of each step of the set-up, and of each stage of every
    /// update, as the step or stage begins.
    pub fn progress(mut self, progress: impl Fn(&str) + Send + 'static) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Checks the mesh and sets every stage up on a backend.
    ///
    /// # Errors
    /// - [`MoveError::Setup`]: a family has no role, a name is no family of the mesh, a wing has no
    ///   families, or roles or old profiles do not fit the mesh
    /// - [`MoveError::Mesh`]: the mesh is not valid
    /// - [`MoveError::Memory`]: the mesh is too large for the memory
    /// - [`MoveError::Backend`]: the backend failed
    pub fn build(self, backend: impl Into<Arc<dyn Backend>>) -> Result<Mover, MoveError> {
        let Self { mesh, mut roles, wings, settings, progress } = self;
        let unknown = |name: &str| SetupError::UnknownFamily { name: name.to_owned(), known: mesh.families.clone() };
        let find = |name: &String| mesh.family(name).ok_or_else(|| unknown(name));
        let mut found = Vec::new();
        for NamedWing { name, families, old, mirror } in wings {
            let families = families.iter().map(find).collect::<Result<Vec<FamilyId>, _>>()?;
            if families.is_empty() {
                return Err(SetupError::NoFamilies { wing: name }.into());
            }
            found.push(WingProfiles { name, families, old, mirror });
        }
        let without: Vec<String> =
            mesh.families.iter().filter(|family| !roles.contains_key(*family)).cloned().collect();
        if !without.is_empty() {
            return Err(SetupError::NoRole { families: without }.into());
        }
        let in_order = mesh.families.iter().filter_map(|family| roles.remove(family)).collect();
        if let Some(name) = roles.keys().next() {
            return Err(unknown(name).into());
        }
        Mover::set_up(mesh, in_order, &found, settings, backend.into(), progress)
    }
}
