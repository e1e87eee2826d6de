//! A case with everything it names read in: the part of a run that is the same for every command.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::failure::Failure;
use crate::case::{Case, ProfileSource, displacement};
use crate::families::Role;
use crate::formats::{self, MeshFile};
use crate::mesh::{FamilyId, TetMesh};
use crate::mover::{Design, Settings};
use crate::profile::{self, Plane, Profile, files};
use crate::stages::WingProfiles;

/// A prescribed displacement belongs to the vertex that is no further from its row than this
/// fraction of the family's shortest edge: text files with seven digits still match, neighbours are
/// never mixed up.
const MATCH: f64 = 1e-3;

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
        let case = case.for_families(&mesh.families)?;

        let mut inputs = vec![path.to_path_buf(), case.mesh.clone()];
        let mut design = Design::default();
        let mut wings = Vec::new();
        let mut roles = Vec::new();
        let mut displacements = Vec::new();
        for (index, name) in mesh.families.iter().enumerate() {
            let family = FamilyId(index as u16);
            let settings = case.families.get(name);
            roles.push(settings.map_or(Role::Fixed, |settings| settings.role.clone()));
            if let Some(displacement) = settings.and_then(|settings| settings.displacement.as_ref()) {
                let matched = prescribed(mesh, family, displacement)?;
                design.prescribed.insert(family, matched.rows.iter().map(|row| row.displacement).collect());
                displacements.push(matched);
                inputs.push(displacement.clone());
            }
        }
        join_cyclic(&file, &mut roles)?;
        displacement::check_shared(&displacements, &mesh.vertices)?;
        for (name, source) in &case.profiles {
            let families: Vec<FamilyId> = source.families.iter().filter_map(|family| mesh.family(family)).collect();
            let new = read_profiles(&source.new, source)?;
            inputs.extend(source.new.iter().cloned());
            let old = match &source.old {
                Some(paths) => {
                    inputs.extend(paths.iter().cloned());
                    read_profiles(paths, source)?
                }
                None => {
                    console.step(&format!("cutting the old profiles of {name}"));
                    cut_like(mesh, &families, &new).map_err(|failure| about_profiles(failure, name, &source.new))?
                }
            };
            profile::compare_sizes(&old, &new)
                .map_err(|error| about_profiles(Failure::bad_input(error.to_string()), name, &source.new))?;
            console.detail(format_args!("{name}: {} new profiles, {} old ones", new.len(), old.len()));
            design.profiles.insert(name.clone(), new);
            wings.push(WingProfiles { name: name.clone(), families, old, mirror: source.mirror });
        }
        let settings = Settings {
            roles,
            wings,
            springs: case.springs,
            method: case.solver.method,
            stopping: case.solver.stopping,
            quality: case.quality,
            max_steps: case.max_steps,
        };
        Ok(Self { case, file, settings, design, inputs, read_seconds: start.elapsed().as_secs_f64() })
    }
}

/// Makes partners of planes that the mesh file calls so.
fn join_cyclic(file: &MeshFile, roles: &mut [Role]) -> Result<(), Failure> {
    let mesh = &file.mesh;
    for [one, other] in file.partners() {
        let (Some(family), Some(neighbour)) = (mesh.family(one), mesh.family(other)) else { continue };
        if roles[family.index()].is_plane() != roles[neighbour.index()].is_plane() {
            let message = format!(
                "the mesh calls `{one}` and `{other}` cyclic, each the neighbour of the other, but one has the role \
                 plane and the other has not, expected it for both or none"
            );
            return Err(Failure::bad_input(message));
        }
        if let Role::Plane { partner: partner @ None, .. } = &mut roles[family.index()] {
            *partner = Some(other.clone());
        }
    }
    Ok(())
}

/// The triangles of some families.
pub(super) fn family_triangles(mesh: &TetMesh, families: &[FamilyId]) -> Vec<[u32; 3]> {
    let members = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, other)| families.contains(other));
    members.map(|(&triangle, _)| triangle).collect()
}

pub(super) fn prescribed(mesh: &TetMesh, family: FamilyId, path: &Path) -> Result<displacement::Matched, Failure> {
    let triangles = family_triangles(mesh, &[family]);
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
pub(super) fn read_profiles(paths: &[PathBuf], of: &ProfileSource) -> Result<Vec<Profile>, Failure> {
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
fn cut_like(mesh: &TetMesh, families: &[FamilyId], new: &[Profile]) -> Result<Vec<Profile>, Failure> {
    let bad = |error: profile::ProfileError| Failure::bad_input(error.to_string());
    let planes = new
        .iter()
        .map(|profile| Ok((profile.number, Plane::of_profile(profile).map_err(bad)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    profile::cut::cut_at_planes(&mesh.vertices, &family_triangles(mesh, families), &planes).map_err(bad)
}

pub(super) fn about_profiles(mut failure: Failure, family: &str, paths: &[PathBuf]) -> Failure {
    failure.message = format!("{}: profiles of `{family}`: {}", list(paths), failure.message);
    failure
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
