//! Makes a first case of a mesh: guesses the role of each family, cuts the sections of the wings,
//! and writes a case file that runs as it is and moves nothing, with a file for each new section
//! and the schema of cases, by which editors check the case.
//!
//! [`propose`] guesses and checks, [`Proposal::write`] writes. The guess is checked as a run checks
//! it: the mover of the case is set up. `text` makes the text of the case. `demo` makes a case with
//! the mesh in the program and changed sections.

mod demo;
mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use super::SessionError;
use super::files::{Folder, cannot_write, check_distinct};
use crate::backend::{self, Selection};
use crate::case::{LoadError, SCHEMA, default_name, has_extension};
use crate::families::guess::{Certainty, Guess, GuessedWing, Known, Sections, guess};
use crate::families::{Role, SetupError};
use crate::formats::{FileSet, MeshFile, PlaceError, mesh_path, real_path};
use crate::mesh::{FamilyId, families_inside, validate};
use crate::mover::{Design, MoveError, Mover};
use crate::profile::{Profile, csv};
pub use demo::{check_demo_is_free, propose_demo};
use text::slug;

/// What shall be made.
#[derive(Clone, Debug)]
pub struct Wanted<'a> {
    /// The mesh file.
    pub mesh: &'a Path,
    /// The case file, which ends in `.toml`, or its folder. `None` for the folder `MESH-case` in
    /// the working folder.
    pub target: Option<&'a Path>,
    /// The families of the wing, if the user names them.
    pub wing: &'a [String],
    /// Number of sections of each wing.
    pub planes: usize,
    /// Whether files that are there may be replaced.
    pub replaces: bool,
}

/// A case with its files, not yet written.
#[derive(Debug)]
pub struct Proposal {
    /// The case file.
    pub case: PathBuf,
    /// The families of the mesh with their guesses `[n_families]`.
    pub families: Vec<(String, Guess)>,
    /// The wings, each with the name of its table.
    pub wings: Vec<(String, GuessedWing)>,
    /// The files of the case, the case file last.
    files: Vec<(PathBuf, Vec<u8>)>,
    /// The folders of the files.
    folders: Vec<PathBuf>,
}

/// The case file that is wanted.
fn case_path(wanted: &Wanted) -> PathBuf {
    match wanted.target {
        Some(path) if has_extension(path, "toml") => path.to_path_buf(),
        Some(folder) => folder.join("case.toml"),
        None => {
            let name = wanted.mesh.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let stem = name.split('.').find(|part| !part.is_empty()).unwrap_or("mesh");
            Path::new(&format!("{}-case", slug(stem))).join("case.toml")
        }
    }
}

/// Checks that the case can be made where it is wanted, before the mesh is read.
///
/// # Errors
/// [`SessionError::Exists`]: there is a case already.
pub fn check_free(wanted: &Wanted) -> Result<(), SessionError> {
    free(wanted, [case_path(wanted)].iter())
}

fn free<'p>(wanted: &Wanted, mut paths: impl Iterator<Item = &'p PathBuf>) -> Result<(), SessionError> {
    match paths.find(|path| path.symlink_metadata().is_ok()) {
        Some(path) if !wanted.replaces => Err(SessionError::Exists { path: path.clone() }),
        _ => Ok(()),
    }
}

/// Guesses the roles of a mesh's families, cuts the sections of its wings, and checks that a case
/// of these can be set up.
///
/// - `file`: the mesh of [`Wanted::mesh`]
/// - `progress`: gets the name of each step as the step begins
///
/// # Errors
/// The mesh is not valid, nothing in it looks like a wing, the case cannot be set up, or a file of
/// the case is there already.
pub fn propose(
    file: &MeshFile,
    wanted: &Wanted,
    progress: impl Fn(&str) + Clone + Send + 'static,
) -> Result<Proposal, SessionError> {
    let about = "As it stands the new sections are the old ones, so nothing moves. Change a file in `new`, and run";
    make(file, wanted, about, &|sections| sections.profiles.clone(), progress)
}

/// [`propose`] with the second line of the case, and a function that makes the new sections.
fn make(
    file: &MeshFile,
    wanted: &Wanted,
    about: &str,
    design: &dyn Fn(&Sections) -> Vec<Profile>,
    progress: impl Fn(&str) + Clone + Send + 'static,
) -> Result<Proposal, SessionError> {
    let path = mesh_path(wanted.mesh);
    let in_file = |error: MoveError| LoadError::InFile { path: path.clone(), error: Box::new(error) };
    let hybrid = file.cells();
    let names = &file.mesh.families;
    let by_name = file.mesh.families_by_name();
    let find = |name: &String| {
        by_name.get(name.as_str()).copied().ok_or_else(|| {
            let known = names.clone();
            SessionError::from(in_file(SetupError::UnknownFamily { name: name.clone(), known }.into()))
        })
    };
    let wing = wanted.wing.iter().map(find).collect::<Result<BTreeSet<FamilyId>, _>>()?;
    progress("topology");
    let topology = validate(hybrid).map_err(|error| in_file(error.into()))?;
    progress("guessing roles");
    let planes_of_file: Vec<FamilyId> = file
        .symmetries()
        .iter()
        .chain(file.partners().iter().flatten())
        .filter_map(|name| by_name.get(name.as_str()).copied())
        .collect();
    let wing: Vec<FamilyId> = wing.into_iter().collect();
    let inside = families_inside(hybrid);
    let mut known =
        Known { wing: &wing, planes: wanted.planes, inside: &inside, planes_of_file: &planes_of_file, joins: true };
    let (families, wings) = loop {
        let guesses = guess(hybrid, &topology.surface, &known)
            .map_err(|error| SessionError::NoWing { path: path.clone(), error: Box::new(error) })?;
        let mut families = guesses.families;
        join_cyclic(file, &by_name, &mut families);
        let wings: Vec<(String, GuessedWing)> = name_wings(names, guesses.wings);
        match check_set_up(file, &mut families, &wings, progress.clone()) {
            // A winglet that cannot be set up as a wing is carried by one.
            Err(_) if known.joins => known.joins = false,
            Err(error) => return Err(in_file(*error).into()),
            Ok(()) => break (families, wings),
        }
    };
    drop(topology);

    let case = case_path(wanted);
    let folder = case.parent().unwrap_or(Path::new("")).to_path_buf();
    let mesh = mesh_from(&folder, &path)?;
    let families: Vec<(String, Guess)> = names.iter().cloned().zip(families).collect();
    let mut files = Vec::new();
    let mut slugs = BTreeSet::new();
    let mut named = Vec::new();
    for (name, wing) in &wings {
        let mut file = slug(name);
        while !slugs.insert(file.clone()) {
            file.push('_');
        }
        let old = format!("old/{file}.csv");
        files.push((folder.join(&old), csv_of(&wing.sections.profiles)));
        let designed = design(&wing.sections);
        let new: Vec<String> = designed.iter().map(|of| format!("new/{file}-{}.csv", of.number)).collect();
        for (path, profile) in new.iter().zip(&designed) {
            files.push((folder.join(path), csv_of(std::slice::from_ref(profile))));
        }
        named.push((old, new));
    }
    let folders = vec![folder.clone(), folder.join("old"), folder.join("new")];
    let output = output_name(&path, &mesh);
    let schema = format!("{}.schema.json", slug(&case.file_stem().unwrap_or_default().to_string_lossy()));
    files.push((folder.join(&schema), SCHEMA.as_bytes().to_vec()));
    let text = text::Case {
        about,
        schema: &schema,
        mesh: &mesh,
        families: &families,
        wings: &wings,
        files: &named,
        output: &output,
        case: &case,
    };
    files.push((case.clone(), text.to_string().into_bytes()));
    let paths: Vec<&Path> = files.iter().map(|(path, _)| path.as_path()).collect();
    check_distinct(std::slice::from_ref(&path), &paths)?;
    free(wanted, files.iter().map(|(path, _)| path))?;
    Ok(Proposal { case, families, wings, files, folders })
}

impl Proposal {
    /// The files that [`Self::write`] writes, the case file last.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(path, _)| path.as_path())
    }

    /// Writes all files, or none. Sections of an earlier case in the same place that this case does
    /// not have are removed.
    ///
    /// - `prepare`: is called when all contents are on the disk, before the first file has its
    ///   name. If it fails, no file is written.
    ///
    /// # Errors
    /// [`SessionError::CannotWrite`]: a folder cannot be made or a file cannot be written; and the
    /// error of `prepare`.
    pub fn write<E: From<SessionError> + From<PlaceError>>(
        &self,
        prepare: impl FnOnce() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut folders = Vec::new();
        let made = self.folders.iter().try_for_each(|path| {
            folders.push(Folder::make(path)?);
            Ok::<(), SessionError>(())
        });
        let written = made.map_err(E::from).and_then(|()| self.write_files(prepare));
        // The inner folders first: an outer one is removed only if it is empty.
        while folders.pop().is_some() {}
        written
    }

    fn write_files<E: From<SessionError> + From<PlaceError>>(
        &self,
        prepare: impl FnOnce() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut set = FileSet::default();
        for (path, text) in &self.files {
            set.add(path, |out| out.write_all(text)).map_err(|error| cannot_write(path, error))?;
        }
        self.earlier_sections().into_iter().for_each(|path| set.remove_stale(path));
        set.place_after(prepare)?;
        Ok(())
    }

    /// Files with the names of further sections of these wings, as of a case of more planes.
    fn earlier_sections(&self) -> Vec<PathBuf> {
        let numbered = |path: &Path| {
            let (name, number) = path.file_name()?.to_str()?.strip_suffix(".csv")?.rsplit_once('-')?;
            let is_number = !number.is_empty() && number.bytes().all(|digit| digit.is_ascii_digit());
            is_number.then(|| (path.parent().map(Path::to_path_buf), name.to_owned()))
        };
        let own: BTreeSet<_> = self.paths().filter_map(numbered).collect();
        let new = self.folders.iter().filter(|folder| folder.ends_with("new"));
        let there =
            new.filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten().map(|entry| entry.path());
        there
            .filter(|path| numbered(path).is_some_and(|of| own.contains(&of)))
            .filter(|path| path.is_file() && !self.paths().any(|written| written == path))
            .collect()
    }
}

/// The name of the moved mesh: as by default, unless the mesh has this name. A folder of OpenFOAM
/// gets its own name.
///
/// - `from_case`: the path of the mesh from the case
fn output_name(mesh: &Path, from_case: &str) -> String {
    let is_mesh = |name: &str| mesh.file_name().is_some_and(|own| own == name);
    match default_name(mesh) {
        _ if is_mesh("polyMesh") => if from_case == "polyMesh" { "moved.vtu" } else { "polyMesh" }.to_owned(),
        name if is_mesh(&name) => format!("new-{name}"),
        name => name,
    }
}

/// The text of a file with these profiles.
fn csv_of(profiles: &[Profile]) -> Vec<u8> {
    let mut text = Vec::new();
    // Writing to memory cannot fail.
    let _ = csv::write(profiles, &mut text);
    text
}

/// Patches that the mesh file calls cyclic are both planes, or none is.
fn join_cyclic(file: &MeshFile, by_name: &std::collections::HashMap<&str, FamilyId>, families: &mut [Guess]) {
    for [one, other] in file.partners() {
        let of = |name: &String| by_name.get(name.as_str()).map(|family| family.index());
        let (Some(one), Some(other)) = (of(one), of(other)) else { continue };
        let planes = [one, other].map(|family| families[family].role.is_plane());
        for (family, is_plane) in [one, other].into_iter().zip([planes[1], planes[0]]) {
            if is_plane && !families[family].role.is_plane() {
                let reason = "the mesh file calls it cyclic, and its partner is a plane".to_owned();
                families[family] = Guess { role: Role::PLANE, certainty: Certainty::Likely, reason };
            }
        }
    }
}

/// Gives each wing the name of its table: that of its one family, or the common beginning of the
/// names of its families.
fn name_wings(names: &[String], wings: Vec<GuessedWing>) -> Vec<(String, GuessedWing)> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let named = wings.into_iter().map(|wing| {
        let own: Vec<&String> = wing.families.iter().map(|family| &names[family.index()]).collect();
        let name = match own[..] {
            [only] => only.clone(),
            _ => {
                let mut common: &str = own[0];
                for name in &own {
                    let length = common.char_indices().zip(name.chars()).take_while(|&((_, a), b)| a == b).count();
                    common = common.char_indices().nth(length).map_or(common, |(at, _)| &common[..at]);
                }
                let common = common.trim_end_matches(|letter: char| !letter.is_alphanumeric());
                if common.len() > 2 { common.to_owned() } else { "wing".to_owned() }
            }
        };
        let mut unique = name.clone();
        while !taken.insert(unique.clone()) {
            unique.push_str("_2");
        }
        (unique, wing)
    });
    named.collect()
}

/// Sets a mover up as a run would. A fuselage that cannot be continued under the wing is fixed.
fn check_set_up(
    file: &MeshFile,
    families: &mut [Guess],
    wings: &[(String, GuessedWing)],
    progress: impl Fn(&str) + Clone + Send + 'static,
) -> Result<(), Box<MoveError>> {
    let names = &file.mesh.families;
    let boxed = |error: MoveError| Box::new(error);
    let partner_of: BTreeMap<&String, &String> = file.partners().iter().map(|[one, other]| (one, other)).collect();
    loop {
        let mut builder = Mover::builder(file.mesh.clone()).other_cells(file.others.clone()).progress(progress.clone());
        for (name, guess) in names.iter().zip(&*families) {
            let role = match (&guess.role, partner_of.get(name)) {
                (Role::Plane { flat, .. }, Some(partner)) => {
                    Role::Plane { flat: *flat, partner: Some((*partner).clone()) }
                }
                (role, _) => role.clone(),
            };
            builder = builder.role(name, role);
        }
        let mut design = Design::default();
        for (name, wing) in wings {
            let of_wing: Vec<&str> = wing.families.iter().map(|family| names[family.index()].as_str()).collect();
            builder = builder.wing(name, &of_wing, wing.sections.profiles.clone(), wing.mirror);
            design.profiles.insert(name.clone(), wing.sections.profiles.clone());
        }
        let backend = backend::select(Selection::Cpu).map_err(|error| boxed(error.into()))?;
        match builder.build(backend) {
            Ok(mut mover) => return mover.check(&design).map_err(boxed),
            Err(MoveError::Setup(SetupError::Continuation { family, error })) => {
                let at =
                    names.iter().position(|name| *name == family).filter(|&at| families[at].role == Role::Carenage);
                let Some(at) = at else { return Err(boxed(SetupError::Continuation { family, error }.into())) };
                let reason = format!("it touches a wing, but it cannot slide on its surface: {error}");
                families[at] = Guess { role: Role::Fixed, certainty: Certainty::Doubtful, reason };
            }
            Err(error) => return Err(boxed(error)),
        }
    }
}

/// The path of the mesh from the folder of the case, with `/` between its parts. A mesh that is far
/// away has its absolute path.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the path is no text.
fn mesh_from(folder: &Path, mesh: &Path) -> Result<String, SessionError> {
    // A link keeps its name, which has the extension.
    let place = match (mesh.parent(), mesh.file_name()) {
        (Some(parent), Some(name)) => real_path(parent_or_here(parent)).join(name),
        _ => real_path(mesh),
    };
    let folder = real_path(parent_or_here(folder));
    let common = folder.components().zip(place.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().count() - common;
    let relative: PathBuf =
        std::iter::repeat_n(Path::new("..").as_os_str(), up).chain(place.iter().skip(common)).collect();
    // Up to the root, the relative path says less than the absolute one.
    let path = if common <= 1 || up > 3 { place } else { relative };
    match path.to_str() {
        Some(text) => Ok(text.replace(std::path::MAIN_SEPARATOR, "/")),
        None => {
            let kind = io::ErrorKind::InvalidInput;
            let error = io::Error::new(kind, "the path of the mesh is no text in UTF-8, which a case file needs");
            Err(cannot_write(&path, error))
        }
    }
}

fn parent_or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}
