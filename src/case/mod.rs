//! The case file: a TOML file that names the mesh, the profiles, the role of each family, the
//! settings and the outputs.
//!
//! | function | does |
//! |---|---|
//! | [`Case::load`] | reads the case file, the mesh, the profiles and the displacements |
//! | [`Case::read`] | reads the case file alone, checks every value, and resolves every path against the file's folder |
//! | [`Case::for_families`] | checks the families of a case against those of a mesh |
//! | [`LoadedCase::mover`] | makes a mover |
//!
//! Errors name the line and column of the case file, so that a user can correct the file without
//! this documentation.

mod document;
mod families;
mod load;
mod load_error;
mod named;
mod names;
mod parse;
mod paths;
mod same_triangles;

mod by_triangles;
#[doc(hidden)]
pub mod design_list;
mod displaced_surface;
#[doc(hidden)]
pub mod displacement;
mod displacement_error;
mod new_positions;
mod plausible;
mod profile_files;
mod rounding;
mod seed;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use thiserror::Error;

pub use displacement::DisplacementError;
pub(crate) use load::prescribed;
pub use load::{GivenWing, LoadedCase};
pub use load_error::LoadError;
pub use named::NamedFiles;
pub(crate) use parse::default_name;
pub(crate) use paths::has_extension;
pub(crate) use profile_files::profiles_of;
pub use profile_files::read_profiles;
pub use seed::{Seed, SeedError};

use crate::families::Role;
use crate::formats::read_named;
use crate::memory::check_memory;
use crate::mover::Settings;
use crate::profile::{Plane, ProfileMatch, files::Placement};
use crate::text::shown;

/// The JSON Schema (draft 7) of a case file, for editors. It knows keys, types and words. The
/// parser checks more.
pub const SCHEMA: &str = include_str!("../../docs/src/case.schema.json");

/// Bytes for each byte of a case file while it is read. Measured were 58 with 100 000 tables of
/// families, and 74 with a list of a million numbers.
const OF_BYTE: u64 = 80;

/// Least size of a case file for which the memory is checked. A smaller one must say which files
/// are its results, also under a limit that is too low for anything else.
const LONG: usize = 1 << 16;

/// The bytes of a case file, if the memory holds what becomes of them. So no case exhausts the
/// memory before its results are known.
fn read_case(path: &Path) -> std::io::Result<Vec<u8>> {
    let bytes = read_named(path)?;
    if bytes.len() >= LONG {
        check_memory(OF_BYTE * bytes.len() as u64).map_err(std::io::Error::other)?;
    }
    Ok(bytes)
}

/// A checked case file.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The case file itself.
    pub path: PathBuf,
    /// The mesh to move.
    pub mesh: PathBuf,
    /// The files with the profiles of each wing, by the wing's name. A wing is one or several
    /// families with the role [`Role::Wing`].
    pub profiles: BTreeMap<String, ProfileSource>,
    /// The settings of each family, by name. Before [`Case::for_families`] a name may be a pattern.
    pub families: BTreeMap<String, FamilySettings>,
    /// The settings of the mover, from the tables `[volume]`, `[quality]` and `[solver]`.
    pub settings: Settings,
    /// The files of the results.
    pub output: Output,
}

/// The files with a wing's profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileSource {
    /// The wing's families. Before [`Case::for_families`] a name may be a pattern.
    pub families: Vec<String>,
    /// A plane with the profiles on one side. The wing is symmetric about it.
    pub mirror: Option<Plane>,
    /// How new profiles are matched with the old ones. With `None` each design decides.
    pub matched: Option<ProfileMatch>,
    /// Where its table begins.
    pub position: Position,
    /// Files of the new profiles, at least one. The files of a pattern are sorted by name.
    pub new: Vec<PathBuf>,
    /// Files of the old profiles. With `None` the old profiles are cut from the mesh in the planes
    /// of the new ones.
    pub old: Option<Vec<PathBuf>>,
    /// The placements of the airfoil in each file without units, by path. Each makes a profile.
    pub placements: BTreeMap<PathBuf, Vec<Placement>>,
}

/// The settings of one family.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilySettings {
    /// The role of the family.
    pub role: Role,
    /// The CSV file with the displacements of a family with the role [`Role::Prescribed`]; see
    /// [`displacement`].
    pub displacement: Option<PathBuf>,
    /// Where its table begins.
    pub position: Position,
}

/// The `[output]` table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The files of the moved mesh. The extension of each selects its format.
    pub mesh: Vec<PathBuf>,
    /// The file of the distributions of beta in the original and the final mesh (SVG).
    pub histogram: Option<PathBuf>,
    /// The file of the report as a page for browsers (HTML).
    pub report: Option<PathBuf>,
    /// Files of the moved surfaces, to look at or to hand on; see [`crate::formats::SurfaceFile`].
    pub surface: Vec<PathBuf>,
    /// The file of the wings' sections, old, asked and got (SVG).
    pub sections: Option<PathBuf>,
}

/// A place in a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
}

/// An error of a case file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The case file cannot be read.
    #[error("{}: cannot read the case file: {source}", path.display())]
    Unreadable {
        /// The case file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A key or a value of the case file is wrong.
    #[error("{}:{}:{}: {message}", path.display(), position.line, position.column, message = shown(message))]
    Invalid {
        /// The case file.
        path: PathBuf,
        /// Place of the mistake.
        position: Position,
        /// The mistake and the expected value.
        message: String,
    },
    /// The families of the case and of the mesh are not the same.
    #[error("{}: the families of the case and of the mesh differ: {message}", path.display(), message = shown(message))]
    Families {
        /// The case file.
        path: PathBuf,
        /// The families that differ.
        message: String,
    },
}

impl CaseError {
    /// Adds words to the message of a mistake, if it has no such advice yet.
    fn with_advice(mut self, advice: &str) -> Self {
        if let Self::Invalid { message, .. } = &mut self
            && !message.contains("did you mean")
        {
            *message += advice;
        }
        self
    }
}

impl Case {
    /// Reads and checks a case file.
    ///
    /// # Errors
    /// - [`CaseError::Unreadable`]: the file cannot be read
    /// - [`CaseError::Invalid`]: the first mistake in the file, with its place
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let bytes = read_case(path).map_err(|source| CaseError::Unreadable { path: path.to_path_buf(), source })?;
        match String::from_utf8(bytes) {
            Ok(text) => Self::parse(&text, path),
            Err(error) => {
                let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()]
                    .iter()
                    .filter(|&&byte| byte == b'\n')
                    .count();
                Err(CaseError::Invalid {
                    path: path.to_path_buf(),
                    position: Position { line, column: 1 },
                    message: "not a text file, expected TOML in UTF-8".into(),
                })
            }
        }
    }

    /// Every file that the case names as an input, and the case file.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let profiles = self.profiles.values().flat_map(|source| source.new.iter().chain(source.old.iter().flatten()));
        let displacements = self.families.values().filter_map(|settings| settings.displacement.as_ref());
        let own = [&self.path, &self.mesh];
        own.into_iter().chain(profiles).chain(displacements).cloned().collect()
    }

    /// Reads and checks the text of a case file.
    ///
    /// - `path`: the file's path; paths in the text are relative to its folder
    ///
    /// # Errors
    /// [`CaseError::Invalid`]: the first mistake in the text, with its place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CaseError> {
        parse::case(text, path)
    }
}
