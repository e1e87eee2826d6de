//! [`ReplacedInputs`]: the part of a case that the designs of a batch replace.

use std::fs;
use std::path::Path;

use super::SessionError;
use super::designs::DesignFiles;
use super::outputs::Outputs;
use crate::case::{LoadError, LoadedCase, NamedFiles, displacement, prescribed, profiles_of};
use crate::formats::real_path;
use crate::mover::{Design, MoveError};
use crate::profile::{Plane, Profile, ProfileError, files};

/// A profile lies in a plane if its points do within this fraction of its size. The points of one
/// profile lie in its plane within the same fraction.
const PLANES: f64 = 1e-6;

/// The part of a case that a design replaces.
#[derive(Clone, Debug)]
pub enum ReplacedInputs {
    /// The new profiles of the wings with these names.
    Profiles(Vec<String>),
    /// The displacements of the prescribed family with this name.
    Displacement(String),
}

impl ReplacedInputs {
    /// Returns all wings of a case, or the one prescribed family of a case without wings.
    ///
    /// # Errors
    /// [`SessionError::NothingVaries`]: the case has no wing, and not exactly one prescribed
    /// family.
    pub fn of(case: &LoadedCase) -> Result<Self, SessionError> {
        let wings: Vec<String> = case.design.profiles.keys().cloned().collect();
        let prescribed: Vec<String> = case.design.prescribed.keys().cloned().collect();
        match prescribed.as_slice() {
            _ if !wings.is_empty() => Ok(Self::Profiles(wings)),
            [family] => Ok(Self::Displacement(family.clone())),
            prescribed => {
                Err(SessionError::NothingVaries { path: case.case.path.clone(), prescribed: prescribed.len() })
            }
        }
    }

    /// The same for a case whose files are not read: its tables of profiles, and without them any
    /// prescribed family.
    pub fn of_case(case: &NamedFiles) -> Self {
        let wings = case.tables.clone();
        if wings.is_empty() { Self::Displacement(String::new()) } else { Self::Profiles(wings) }
    }

    /// The extensions of the files of designs in a folder. If results go into the same folder, a
    /// file with a result's extension is no design but a result.
    ///
    /// - `designs`: the folder
    pub fn extensions(&self, results: &Outputs, designs: &Path) -> Vec<&'static str> {
        let extensions = match self {
            Self::Profiles(..) => files::EXTENSIONS,
            Self::Displacement(_) => displacement::EXTENSIONS,
        };
        let is_here = |path: &&Path| real_path(path).parent() == Some(&*real_path(designs));
        let here: Vec<String> =
            results.paths().filter(is_here).map(|path| path.to_string_lossy().to_lowercase()).collect();
        let is_result = |extension: &str| here.iter().any(|name| name.ends_with(&format!(".{extension}")));
        extensions.iter().copied().filter(|extension| !is_result(extension)).collect()
    }

    /// The tables of profiles that a design replaces. Empty for displacements.
    pub fn tables(&self) -> &[String] {
        match self {
            Self::Profiles(wings) => wings,
            Self::Displacement(_) => &[],
        }
    }

    /// Reads a design: the case's design, with the contents of the design's files in place of the
    /// replaced part.
    ///
    /// # Errors
    /// A file is missing, is a pipe or a folder, cannot be read or is wrong, or its profiles lie in
    /// other planes than the old profiles that were cut from the mesh.
    pub fn read(&self, case: &LoadedCase, design_files: &DesignFiles) -> Result<Design, SessionError> {
        // To read a pipe or a device may never end.
        for path in design_files.paths() {
            if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
                return Err(SessionError::NotAFile { path: path.to_path_buf() });
            }
        }
        let mut design = case.design.clone();
        match self {
            Self::Displacement(family) => {
                let rows = prescribed(case.file.cells(), family, design_files.only()?)?.rows;
                design.prescribed.insert(family.clone(), rows.into_iter().map(|row| row.displacement).collect());
            }
            Self::Profiles(wings) if wings.len() == 1 && design_files.is_single() => {
                design.profiles.insert(wings[0].clone(), profiles(case, &wings[0], design_files.only()?)?);
            }
            Self::Profiles(wings) => {
                if let (true, Some(path)) = (design_files.is_single(), design_files.paths().next())
                    && path.is_file()
                {
                    return Err(SessionError::NoTable { path: path.to_path_buf(), tables: wings.clone() });
                }
                for wing in wings {
                    design.profiles.insert(wing.clone(), profiles(case, wing, design_files.of_table(wing)?)?);
                }
            }
        }
        Ok(design)
    }

    /// Names the design's file in an error of the design's profiles.
    pub fn about(&self, design_files: &DesignFiles, error: SessionError) -> SessionError {
        let SessionError::Load(load) = &error else { return error };
        let (wing, fault) = match &**load {
            LoadError::Profiles { wing, error, .. } => (wing, error),
            LoadError::InFile { error: moved, .. } => match &**moved {
                MoveError::Profiles { family, error } => (family, error),
                _ => return error,
            },
            _ => return error,
        };
        let path = match design_files.is_single() {
            true => design_files.only(),
            false => design_files.of_table(wing),
        };
        match path {
            Ok(path) if self.tables().contains(wing) => SessionError::of_profiles(path, wing, fault.clone()),
            _ => error,
        }
    }
}

/// Reads the new profiles of a wing from a design's file.
fn profiles(case: &LoadedCase, wing: &str, path: &Path) -> Result<Vec<Profile>, SessionError> {
    let mut source = case.case.profiles[wing].clone();
    // An airfoil takes the placements of the case's airfoil.
    if let [only] = source.new.as_slice()
        && let Some(placements) = source.placements.get(only).cloned()
    {
        source.placements.insert(path.to_path_buf(), placements);
    }
    let paths = [path.to_path_buf()];
    let new = profiles_of(&paths, &source.placements).map_err(|error| match error {
        LoadError::ProfileFile(ProfileError::NoPlacement { path }) if source.new.len() > 1 => {
            SessionError::WhichPlacement { path, n_files: source.new.len(), wing: wing.to_owned() }
        }
        error => error.into(),
    })?;
    if source.old.is_none() {
        same_planes(&case.design.profiles[wing], &new, path, wing)?;
    }
    Ok(new)
}

/// Checks that new profiles lie in the planes in which the old ones were cut. A run of the design
/// alone would cut the old profiles in other planes, and would give other displacements.
fn same_planes(cut: &[Profile], new: &[Profile], path: &Path, wing: &str) -> Result<(), SessionError> {
    for Profile { number, points } in new {
        let Some(like) = cut.iter().find(|other| other.number == *number) else { continue };
        let plane = Plane::of_profile(like).map_err(|error| SessionError::of_profiles(path, wing, error))?;
        let size = points.iter().map(|point| point.distance(points[0])).fold(0.0, f64::max);
        let off = points.iter().map(|&point| plane.distance(point).abs()).fold(0.0, f64::max);
        if off > PLANES * size {
            let (path, wing) = (path.to_path_buf(), wing.to_owned());
            return Err(SessionError::OtherPlane { path, wing, profile: *number, off });
        }
    }
    Ok(())
}
