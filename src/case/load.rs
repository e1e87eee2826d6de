//! [`Case::load`] reads a case and every file that it names. [`LoadedCase::mover`] makes a mover
//! from them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::displaced_surface::{self, Family};
use super::displacement::{self, DisplacementError};
use super::load_error::LoadError;
use super::plausible::Displaced;
use super::profile_files::{at_fault, profiles_of};
use super::{Case, Output, Position, ProfileSource};
use crate::backend::Backend;
use crate::families::{Role, SetupError};
use crate::formats::{self, MeshFile, mesh_path};
use crate::mesh::{self, FamilyId, HybridMesh, OtherCells, TetMesh};
use crate::mover::{Design, MoveError, Mover, MoverBuilder, Settings};
use crate::profile::cut::{Junctions, cut_at_planes_through_parts};
use crate::profile::{self, Plane, Profile, ProfileError, ProfileMatch};

/// A row of prescribed displacements belongs to a vertex within this fraction of the family's
/// shortest edge. Text files with seven digits match, and a row never matches a neighbour of its
/// vertex.
const MATCH: f64 = 1e-3;

/// Planes that enclose an angle with a smaller cosine turn along the span, as at a winglet. The
/// angle is 20 degrees: a design turns the planes of a wing by less.
const TURN: f64 = 0.94;

/// A case with its mesh, its old and new profiles and its prescribed displacements. Lengths are in
/// the mesh's unit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LoadedCase {
    /// The case, in which every family of the mesh has its settings by its own name. A change of
    /// [`Case::settings`] holds for movers made later.
    pub case: Case,
    /// The mesh and the contents of its file.
    pub file: MeshFile,
    /// The design of the case: the new profiles and the prescribed displacements.
    pub design: Design,
    /// Every file that was read.
    pub inputs: Vec<PathBuf>,
    /// What the user must know of the profiles.
    warnings: Vec<String>,
    roles: Vec<Role>,
    /// The old profiles of each wing `[n_wings]`, in the order of [`Case::profiles`].
    old: Vec<Vec<Profile>>,
}

/// A wing and its old profiles, for [`LoadedCase::of_mesh`].
#[derive(Clone, Debug, PartialEq)]
pub struct GivenWing {
    /// The name in designs and reports.
    pub name: String,
    /// The names of its families, at least one.
    pub families: Vec<String>,
    /// Its old profiles, in the mesh's unit.
    pub old: Vec<Profile>,
    /// How new profiles are matched with the old ones. With `None` each design decides.
    pub matched: Option<ProfileMatch>,
}

impl Case {
    /// Reads a case file, and the mesh, the profiles and the displacements that the case names.
    ///
    /// # Errors
    /// A file cannot be read or is wrong, or the files do not fit together. The message names the
    /// file, and the line where there is one.
    pub fn load(path: impl AsRef<Path>) -> Result<LoadedCase, LoadError> {
        Self::load_telling(path.as_ref(), &|_| {})
    }

    /// [`Case::load`] with a function that gets the name of each step as the step begins.
    ///
    /// # Errors
    /// As [`Case::load`].
    pub fn load_telling(path: &Path, progress: &dyn Fn(&str)) -> Result<LoadedCase, LoadError> {
        progress("reading the case");
        Self::read(path)?.with_files(progress)
    }

    /// Reads the files that a case names; see [`Case::load_telling`].
    pub(crate) fn with_files(self, progress: &dyn Fn(&str)) -> Result<LoadedCase, LoadError> {
        let case = self;
        progress(&format!("reading {}", case.mesh.display()));
        let file = formats::read_mixed(&case.mesh)?;
        let mesh = &file.mesh;
        let hybrid = file.cells();
        // Profiles are compared with the mesh before a mover checks it.
        let vertices = hybrid.cells().flatten().filter_map(|&vertex| mesh.vertices.get(vertex as usize));
        mesh::check_size(vertices.copied())
            .map_err(|error| LoadError::InFile { path: case.mesh.clone(), error: Box::new(error.into()) })?;
        let inside: Vec<&String> = match case.names_all(&mesh.families) {
            true => Vec::new(),
            false => {
                let of_families = mesh.families.iter().zip(mesh::families_inside(hybrid));
                of_families.filter(|&(_, inside)| inside).map(|(family, _)| family).collect()
            }
        };
        let case = case.for_families_beside(&mesh.families, &inside)?;

        let mut inputs = vec![case.path.clone(), case.mesh.clone()];
        let mut design = Design::default();
        let mut roles = Vec::new();
        let mut displacements = Vec::new();
        for name in &mesh.families {
            let settings = case.families.get(name);
            roles.push(settings.map_or(Role::Fixed, |settings| settings.role.clone()));
            if let Some(displacement) = settings.and_then(|settings| settings.displacement.as_ref()) {
                displacements.push((name.clone(), prescribed(hybrid, name, displacement)?));
                inputs.push(displacement.clone());
            }
        }
        join_cyclic(&file, &mut roles)?;
        let (names, mut displacements): (Vec<String>, Vec<_>) = displacements.into_iter().unzip();
        displacement::settle_shared(&mut displacements);
        displacement::check_shared(&displacements, &mesh.vertices)?;
        for (name, matched) in names.into_iter().zip(displacements) {
            design.prescribed.insert(name, matched.rows.into_iter().map(|row| row.displacement).collect());
        }
        let mut all_old = Vec::new();
        let mut warnings = Vec::new();
        let by_name = mesh.families_by_name();
        for (name, source) in &case.profiles {
            let new = profiles_of(&source.new, &source.placements)?;
            inputs.extend(source.new.iter().cloned());
            let about = |error| at_fault(&source.new, &source.placements, name.clone(), error);
            let old = match &source.old {
                Some(paths) => {
                    inputs.extend(paths.iter().cloned());
                    profiles_of(paths, &source.placements)?
                }
                None => {
                    progress(&format!("cutting the old profiles of {name}"));
                    let named = source.families.iter().filter_map(|family| by_name.get(family.as_str()).copied());
                    let families: Vec<FamilyId> = named.collect();
                    if turns(&new).map_err(about)? {
                        warnings.push(format!(
                            "the old profiles of `{name}` are cut from the mesh in the planes of the new ones, which are not \
                             parallel: a section that moves across its plane, as where a winglet is raised, is taken for the \
                             section that was there before; `old` in [profiles.{name}] says where each section was"
                        ));
                    }
                    let is_bridged = |family: FamilyId| roles[family.index()].is_bridged();
                    cut_like(hybrid, &families, is_bridged, &new).map_err(about)?
                }
            };
            profile::compare_sizes(&old, &new).map_err(about)?;
            design.profiles.insert(name.clone(), new);
            all_old.push(old);
        }
        Ok(LoadedCase { case, file, design, inputs, warnings, roles, old: all_old })
    }
}

impl LoadedCase {
    /// What a case would hold, from a mesh file and from what a program gives for it. The design
    /// has the old profiles as new ones, and no prescribed displacements. The mesh's path stands
    /// for that of the case file.
    ///
    /// - `roles`: of each family on the boundary, by its name
    /// - `wings`: the wings with their families, which have the role [`Role::Wing`], and their old
    ///   profiles, in the mesh's unit; of two wings that share a curve the first places it
    ///
    /// # Errors
    /// The mesh cannot be read, a role or a wing is for no family of the mesh, or only one of two
    /// cyclic families has the role plane. [`LoadedCase::mover`] has the errors of the set-up.
    pub fn of_mesh(
        mesh: impl AsRef<Path>,
        mut roles: BTreeMap<String, Role>,
        wings: Vec<GivenWing>,
        settings: Settings,
    ) -> Result<Self, LoadError> {
        let path = mesh_path(mesh.as_ref());
        let file = formats::read_mixed(&path)?;
        let families = &file.mesh.families;
        let wrong = |error: SetupError| LoadError::InFile { path: path.clone(), error: Box::new(error.into()) };
        if let Some(name) =
            roles.keys().chain(wings.iter().flat_map(|wing| &wing.families)).find(|name| !families.contains(name))
        {
            return Err(wrong(SetupError::UnknownFamily { name: name.clone(), known: families.clone() }));
        }
        let inside = mesh::families_inside(file.cells());
        let without = families.iter().zip(&inside).filter(|&(name, inside)| !inside && !roles.contains_key(name));
        let without: Vec<String> = without.map(|(name, _)| name.clone()).collect();
        if !without.is_empty() {
            return Err(wrong(SetupError::NoRole { families: without }));
        }
        let mut in_order: Vec<Role> =
            families.iter().map(|name| roles.remove(name).unwrap_or(Role::Interior)).collect();
        join_cyclic(&file, &mut in_order)?;
        let (mut sources, mut old) = (BTreeMap::new(), BTreeMap::new());
        for (index, GivenWing { name, families, old: of_wing, matched }) in wings.into_iter().enumerate() {
            let source = ProfileSource {
                families,
                mirror: None,
                matched,
                position: Position { line: index + 1, column: 1 },
                new: Vec::new(),
                old: None,
                placements: BTreeMap::new(),
            };
            sources.insert(name.clone(), source);
            old.insert(name, of_wing);
        }
        let case = Case {
            path: path.clone(),
            mesh: path.clone(),
            profiles: sources,
            families: BTreeMap::new(),
            settings,
            output: Output::default(),
        };
        let design = Design { profiles: old.clone(), ..Design::default() };
        let (inputs, warnings) = (vec![path], Vec::new());
        Ok(Self { case, file, design, inputs, warnings, roles: in_order, old: old.into_values().collect() })
    }

    /// What the user must know of the case's profiles, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The role of each family of the mesh `[n_families]`.
    pub fn roles(&self) -> &[Role] {
        &self.roles
    }

    /// The old profiles of each wing with the wing's name, in the mesh's unit.
    pub fn old_profiles(&self) -> impl Iterator<Item = (&str, &[Profile])> {
        self.case.profiles.keys().map(String::as_str).zip(self.old.iter().map(Vec::as_slice))
    }

    /// A builder with the mesh, the roles, the old profiles and the settings of this case.
    pub fn builder(&self) -> MoverBuilder {
        self.builder_of(self.file.mesh.clone(), self.file.others.clone())
    }

    /// [`LoadedCase::builder`] with the mesh of another mover of this case, which both share.
    pub(crate) fn builder_of(&self, mesh: impl Into<Arc<TetMesh>>, others: impl Into<Arc<OtherCells>>) -> MoverBuilder {
        let mut builder = Mover::builder(mesh).other_cells(others).settings(self.case.settings);
        for (family, role) in self.file.mesh.families.iter().zip(&self.roles) {
            builder = builder.role(family, role.clone());
        }
        // Of two wings that share a curve the first in the case places it.
        let mut wings: Vec<_> = self.case.profiles.iter().zip(&self.old).collect();
        wings.sort_by_key(|((_, source), _)| (source.position.line, source.position.column));
        for ((name, source), old) in wings {
            let families: Vec<&str> = source.families.iter().map(String::as_str).collect();
            builder = builder.wing(name, &families, old.clone(), source.mirror).matched_by(source.matched);
        }
        builder
    }

    /// Makes a mover of this case's mesh.
    ///
    /// # Errors
    /// The roles or the old profiles do not fit the mesh, or the backend failed. The message names
    /// the file at fault.
    pub fn mover(&self, backend: impl Into<Arc<dyn Backend>>) -> Result<Mover, LoadError> {
        self.builder().build(backend).map_err(|error| self.about(error))
    }

    /// [`LoadedCase::about`] for an error of a design. If the design's profiles are the case's, the
    /// file at fault is the file of the new profile.
    ///
    /// - `design`: the design that the mover was given
    pub fn about_design(&self, error: MoveError, design: &Design) -> LoadError {
        match error {
            MoveError::Profiles { family, error }
                if design.profiles.get(&family) == self.design.profiles.get(&family) =>
            {
                match self.case.profiles.get(&family).filter(|source| !source.new.is_empty()) {
                    Some(source) => at_fault(&source.new, &source.placements, family, error),
                    None => self.about(MoveError::Profiles { family, error }),
                }
            }
            error => self.about(error),
        }
    }

    /// Adds the name of the file at fault to a mover's error.
    pub fn about(&self, error: MoveError) -> LoadError {
        if let MoveError::Setup(SetupError::Profiles { family, error }) = &error
            && let Some(source) = self.case.profiles.get(family)
            && let Some(old) = &source.old
        {
            return at_fault(old, &source.placements, family.clone(), error.clone());
        }
        let path = match &error {
            MoveError::Mesh(_) | MoveError::Setup(_) => &self.case.mesh,
            MoveError::Profiles { .. }
            | MoveError::Unknown { .. }
            | MoveError::Prescribed { .. }
            | MoveError::Disagree { .. } => &self.case.path,
            _ => return LoadError::Move(Box::new(error)),
        };
        LoadError::InFile { path: path.clone(), error: Box::new(error) }
    }
}

/// Makes partners of the planes that the mesh file calls cyclic.
fn join_cyclic(file: &MeshFile, roles: &mut [Role]) -> Result<(), LoadError> {
    let mesh = &file.mesh;
    for [one, other] in file.partners() {
        let (Some(family), Some(neighbour)) = (mesh.family(one), mesh.family(other)) else { continue };
        if roles[family.index()].is_plane() != roles[neighbour.index()].is_plane() {
            return Err(LoadError::Cyclic { family: one.clone(), neighbour: other.clone() });
        }
        if let Role::Plane { partner: partner @ None, .. } = &mut roles[family.index()] {
            *partner = Some(other.clone());
        }
    }
    Ok(())
}

/// Reads a table of displacements or a displaced surface, and matches its rows or points to the
/// vertices of a family.
///
/// # Errors
/// The file cannot be read, or its rows or points do not match the family's vertices.
pub(crate) fn prescribed(
    hybrid: HybridMesh,
    family: &str,
    path: &Path,
) -> Result<displacement::Matched, DisplacementError> {
    let mesh = hybrid.mesh;
    let families: Vec<FamilyId> = mesh.family(family).into_iter().collect();
    let triangles = mesh::triangles_of_families(hybrid, &families);
    let vertices: Vec<u32> = triangles.iter().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let lengths = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).map(|(a, b)| {
        let (a, b) = (mesh.vertices[a as usize], mesh.vertices[b as usize]);
        a.distance(b)
    });
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let tolerance = if shortest.is_finite() { MATCH * shortest } else { 0.0 };
    let (rows, rounding) = if formats::is_surface(path) {
        let has_quadrilaterals = hybrid.others.quadrilateral_family.iter().any(|of| families.contains(of));
        let family = Family { name: family, vertices: &vertices, has_quadrilaterals, triangles: &triangles, tolerance };
        let surface = formats::read_surface(path)?;
        let rows = displaced_surface::match_points(&surface, path, mesh, &family)?;
        (rows, displaced_surface::rounding(&surface))
    } else {
        let table = displacement::read(path)?;
        let rows = displacement::match_rows(&table, &mesh.vertices, &vertices, tolerance)?;
        let original: Vec<_> = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
        let displacement: Vec<_> = rows.iter().map(|row| row.displacement).collect();
        let displaced = Displaced {
            name: family,
            vertices: &vertices,
            original: &original,
            displacement: &displacement,
            triangles: &triangles,
        };
        if !table.is_named {
            displaced.check_reading(path, !table.new_positions.is_empty())?;
        }
        displaced.check_size(path)?;
        (rows, 0.0)
    };
    Ok(displacement::Matched { path: path.to_path_buf(), vertices, rows, rounding })
}

/// Whether the planes of profiles turn along the span by more than an angle with the cosine
/// [`TURN`].
fn turns(profiles: &[Profile]) -> Result<bool, ProfileError> {
    let normals = profiles.iter().map(|profile| Ok(Plane::of_profile(profile)?.normal));
    let normals: Vec<_> = normals.collect::<Result<_, ProfileError>>()?;
    Ok(normals.iter().any(|normal| normal.dot(normals[0]).abs() < TURN))
}

/// The old profiles, cut from the mesh at the new ones' planes.
///
/// - `families`: of the wing
/// - `is_bridged`: whether sections are bridged through a family that stands on the wing
fn cut_like(
    mesh: HybridMesh,
    families: &[FamilyId],
    is_bridged: impl Fn(FamilyId) -> bool,
    new: &[Profile],
) -> Result<Vec<Profile>, ProfileError> {
    let planes = new.iter().map(|profile| Ok((profile.number, Plane::of_profile(profile)?)));
    let planes = planes.collect::<Result<Vec<_>, ProfileError>>()?;
    let junctions = Junctions::of_mesh(mesh, families, is_bridged);
    let faces = mesh::faces_of_families(mesh, families);
    let cut = cut_at_planes_through_parts(mesh.vertices(), &faces, &planes, &junctions)?;
    Ok(cut.into_iter().map(|(profile, _)| profile).collect())
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;

    /// Planes at 19 degrees are those of a wing that a design bends, planes at 21 degrees those of
    /// a winglet.
    ///
    /// Fails if `TURN` is 0.094 or 9.4.
    #[test]
    fn planes_of_a_winglet_turn() {
        let profile = |number: i64, degrees: f64| {
            let up = DQuat::from_rotation_x(degrees.to_radians()) * DVec3::Z;
            let corners = [(0.0, 0.1), (0.0, -0.1), (1.0, 0.0)];
            let points = corners.map(|(x, z)| DVec3::X * x + up * z + DVec3::Y * number as f64).to_vec();
            Profile { number, points }
        };
        for (degrees, expected) in [(0.0, false), (19.0, false), (21.0, true), (90.0, true)] {
            assert_eq!(turns(&[profile(0, 0.0), profile(1, degrees)]).unwrap(), expected, "{degrees}");
        }
    }
}
