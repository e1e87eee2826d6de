//! A case with everything it names read in: the part of a run that is the same for every command.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::failure::Failure;
use crate::case::{Case, ProfileSource, Role, displacement};
use crate::formats::{self, MeshFile};
use crate::mesh::{FamilyId, TetMesh};
use crate::mover::{Design, Settings};
use crate::profile::{self, Plane, Profile, files};
use crate::stages;

/// A prescribed displacement belongs to the vertex that is no further from its row than this fraction of the family's
/// shortest edge: text files with seven digits still match, neighbours are never mixed up.
const MATCH: f64 = 1e-3;

/// Profiles lie in the same plane within this fraction of their size, as the points of one do.
const PLANES: f64 = 1e-6;

/// A case, its mesh, what a mover needs and the design.
pub(super) struct Job {
    pub(super) case: Case,
    pub(super) file: MeshFile,
    pub(super) settings: Settings,
    pub(super) design: Design,
    /// Every file that was read.
    pub(super) inputs: Vec<PathBuf>,
    /// Time for reading, s.
    pub(super) read_seconds: f64,
}

impl Job {
    /// Reads a case and all its files.
    ///
    /// # Errors
    /// A file cannot be read or is wrong, or the files do not go together.
    pub(super) fn read(path: &Path, console: &Console) -> Result<Self, Failure> {
        let start = Instant::now();
        console.step("reading the case");
        let case = Case::read(path)?;
        console.step(&format!("reading {}", case.mesh.display()));
        let file = formats::read(&case.mesh)?;
        let mesh = &file.mesh;
        case.check_families(&mesh.families)?;

        let mut inputs = vec![path.to_path_buf(), case.mesh.clone()];
        let mut design = Design::default();
        let mut old_profiles = BTreeMap::new();
        let mut roles = Vec::new();
        let mut displacements = Vec::new();
        for (index, name) in mesh.families.iter().enumerate() {
            let family = FamilyId(index as u16);
            let role = case.families.get(name).map_or(&Role::Fixed, |settings| &settings.role);
            roles.push(role.on(mesh));
            if let Role::Prescribed { displacement } = role {
                let matched = prescribed(mesh, family, displacement)?;
                design.prescribed.insert(family, matched.rows.iter().map(|row| row.displacement).collect());
                displacements.push(matched);
                inputs.push(displacement.clone());
            }
        }
        join_cyclic(&file, &mut roles)?;
        displacement::check_shared(&displacements, &mesh.vertices)?;
        for (name, source) in &case.profiles {
            let Some(family) = mesh.family(name) else { continue };
            let new = read_profiles(&source.new, source)?;
            inputs.extend(source.new.iter().cloned());
            let old = match &source.old {
                Some(paths) => {
                    inputs.extend(paths.iter().cloned());
                    read_profiles(paths, source)?
                }
                None => {
                    console.step(&format!("cutting the old profiles of {name}"));
                    cut_like(mesh, family, &new).map_err(|failure| about_profiles(failure, name, &source.new))?
                }
            };
            console.detail(format_args!("{name}: {} new profiles, {} old ones", new.len(), old.len()));
            design.profiles.insert(family, new);
            old_profiles.insert(family, old);
        }
        let settings = Settings {
            roles,
            old_profiles,
            springs: case.springs,
            method: case.solver.method,
            accuracy: case.solver.accuracy,
            quality: case.quality,
            max_steps: case.max_steps,
        };
        Ok(Self { case, file, settings, design, inputs, read_seconds: start.elapsed().as_secs_f64() })
    }
}

/// Makes partners of planes that the mesh file calls so.
fn join_cyclic(file: &MeshFile, roles: &mut [stages::Role]) -> Result<(), Failure> {
    let mesh = &file.mesh;
    for [one, other] in file.partners() {
        let (Some(family), Some(neighbour)) = (mesh.family(one), mesh.family(other)) else { continue };
        let is_plane = |role: &stages::Role| matches!(role, stages::Role::Plane { .. });
        match (roles[family.index()], is_plane(&roles[neighbour.index()])) {
            (stages::Role::Plane { flat, partner: None }, true) => {
                roles[family.index()] = stages::Role::Plane { flat, partner: Some(neighbour) };
            }
            (role, plane) if is_plane(&role) != plane => {
                let message = format!(
                    "the mesh calls `{one}` and `{other}` cyclic, each the neighbour of the other, but one has the role \
                     plane and the other has not, expected it for both or none"
                );
                return Err(Failure::bad_input(message));
            }
            _ => {}
        }
    }
    Ok(())
}

/// What a design replaces in a case.
#[derive(Clone, Debug)]
pub(super) enum Varied {
    /// The new profiles of a wing.
    Profiles(String, FamilyId),
    /// The displacement of a prescribed family.
    Displacement(FamilyId),
}

impl Varied {
    /// The one set of profiles, or, where there is none, the one displacement.
    ///
    /// # Errors
    /// There is none or more than one.
    pub(super) fn of(job: &Job) -> Result<Self, Failure> {
        let profiles: Vec<FamilyId> = job.design.profiles.keys().copied().collect();
        let prescribed: Vec<FamilyId> = job.design.prescribed.keys().copied().collect();
        match (profiles.as_slice(), prescribed.as_slice()) {
            (&[family], _) => Ok(Self::Profiles(job.file.mesh.families[family.index()].clone(), family)),
            (&[], &[family]) => Ok(Self::Displacement(family)),
            (profiles, prescribed) => Err(Failure::bad_input(format!(
                "{}: {} tables [profiles.NAME] and {} prescribed families, expected exactly one table whose profiles \
                 the designs replace, or none and one prescribed family",
                job.case.path.display(),
                profiles.len(),
                prescribed.len()
            ))),
        }
    }

    /// The extensions that designs have in a folder.
    pub(super) fn extensions(&self) -> &'static [&'static str] {
        match self {
            Self::Profiles(..) => files::EXTENSIONS,
            Self::Displacement(_) => &["csv"],
        }
    }

    /// The job's design with what a file says in place of what it varies.
    ///
    /// # Errors
    /// The file cannot be read or is wrong, or its profiles lie in other planes than those cut from the mesh.
    pub(super) fn read(&self, job: &Job, path: &Path) -> Result<Design, Failure> {
        let mut design = job.design.clone();
        match self {
            Self::Displacement(family) => {
                let rows = prescribed(&job.file.mesh, *family, path)?.rows;
                design.prescribed.insert(*family, rows.into_iter().map(|row| row.displacement).collect());
            }
            Self::Profiles(name, family) => {
                let mut source = job.case.profiles[name].clone();
                // An airfoil takes the place of the case's.
                if let [only] = source.new.as_slice()
                    && let Some(placement) = source.placements.get(only).cloned()
                {
                    source.placements.insert(path.to_path_buf(), placement);
                }
                let paths = [path.to_path_buf()];
                let new = read_profiles(&paths, &source)?;
                if source.old.is_none() {
                    same_planes(&job.design.profiles[family], &new)
                        .map_err(|failure| about_profiles(failure, name, &paths))?;
                }
                design.profiles.insert(*family, new);
            }
        }
        Ok(design)
    }
}

/// Refuses profiles in other planes than those at which the old ones were cut: their motion would be another than in a
/// run of their own, where the old ones are cut at their planes.
fn same_planes(cut: &[Profile], new: &[Profile]) -> Result<(), Failure> {
    let bad = |error: profile::ProfileError| Failure::bad_input(error.to_string());
    for profile in new {
        let Some(like) = cut.iter().find(|other| other.number == profile.number) else { continue };
        let plane = Plane::of_profile(like).map_err(bad)?;
        let size = profile.points.iter().map(|point| point.distance(profile.points[0])).fold(0.0, f64::max);
        let off = profile.points.iter().map(|&point| plane.distance(point).abs()).fold(0.0, f64::max);
        if off > PLANES * size {
            let message = format!(
                "profile {} is up to {off:.1e} away from the plane at which the case's new profiles let the old one be cut",
                profile.number
            );
            return Err(Failure::bad_input(message).with_hint("name the old profiles in the case: old = \"FILE\""));
        }
    }
    Ok(())
}

/// The triangles of a family.
pub(super) fn family_triangles(mesh: &TetMesh, family: FamilyId) -> Vec<[u32; 3]> {
    let members = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &other)| other == family);
    members.map(|(&triangle, _)| triangle).collect()
}

fn prescribed(mesh: &TetMesh, family: FamilyId, path: &Path) -> Result<displacement::Matched, Failure> {
    let triangles = family_triangles(mesh, family);
    let vertices: Vec<u32> = triangles.iter().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let lengths = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).map(|(a, b)| {
        let (a, b) = (mesh.vertices[a as usize], mesh.vertices[b as usize]);
        a.distance(b)
    });
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let tolerance = if shortest.is_finite() { MATCH * shortest } else { 0.0 };
    let table = displacement::read(path)?;
    let rows = displacement::match_rows(&table, &mesh.vertices, &vertices, tolerance)?;
    Ok(displacement::Matched { path: path.to_path_buf(), vertices, rows })
}

/// Reads the profiles of some files.
fn read_profiles(paths: &[PathBuf], of: &ProfileSource) -> Result<Vec<Profile>, Failure> {
    let mut contents = Vec::new();
    for path in paths {
        let bytes = fs::read(path)
            .map_err(|error| Failure::bad_input(format!("{}: cannot read the profiles: {error}", path.display())))?;
        contents.push(bytes);
    }
    let source = |(path, bytes)| files::Source { path, bytes, placement: of.placements.get(path) };
    let sources: Vec<_> =
        paths.iter().map(PathBuf::as_path).zip(contents.iter().map(Vec::as_slice)).map(source).collect();
    files::parse(&sources).map_err(|error| match error {
        error @ (profile::ProfileError::Line { .. } | profile::ProfileError::File { .. }) => {
            Failure::bad_input(error.to_string())
        }
        error => Failure::bad_input(format!("{}: {error}", list(paths))),
    })
}

/// The old profiles, cut from the mesh at the new ones' planes.
fn cut_like(mesh: &TetMesh, family: FamilyId, new: &[Profile]) -> Result<Vec<Profile>, Failure> {
    let bad = |error: profile::ProfileError| Failure::bad_input(error.to_string());
    let planes = new
        .iter()
        .map(|profile| Ok((profile.number, Plane::of_profile(profile).map_err(bad)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    profile::cut::cut_at_planes(&mesh.vertices, &family_triangles(mesh, family), &planes).map_err(bad)
}

fn about_profiles(mut failure: Failure, family: &str, paths: &[PathBuf]) -> Failure {
    failure.message = format!("{}: profiles of family `{family}`: {}", list(paths), failure.message);
    failure
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
