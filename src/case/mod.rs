//! The case file: which mesh, which new profiles, what each family does, how to solve and where to
//! write.
//!
//! [`Case::load`] reads the case file, the mesh and the profiles, and makes a mover of them.
//! [`Case::read`] turns the TOML file alone into a [`Case`] in which every value is checked and
//! every path is resolved against the file's folder. Its errors name the line and column, so that
//! the file can be corrected without this documentation. What only the mesh can tell (its families)
//! is checked by [`Case::for_families`].

mod document;
mod families;
mod load;
mod parse;
mod paths;

#[doc(hidden)]
pub mod design_list;
#[doc(hidden)]
pub mod displacement;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use thiserror::Error;

pub use load::{LoadError, LoadedCase, read_profiles};
pub(crate) use load::{prescribed, profiles_of};

use crate::families::Role;
use crate::mover::Settings;
use crate::profile::{Plane, files::Placement};

/// A checked case file.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The case file itself.
    pub path: PathBuf,
    /// The mesh to move.
    pub mesh: PathBuf,
    /// New (and perhaps old) profiles of each wing: of one family or several whose role is
    /// [`Role::Wing`].
    pub profiles: BTreeMap<String, ProfileSource>,
    /// What each family does, by name; before [`Case::for_families`] a name may be a pattern.
    pub families: BTreeMap<String, FamilySettings>,
    /// How the mesh is moved: the tables `[volume]`, `[quality]` and `[solver]`.
    pub settings: Settings,
    /// Where the results go.
    pub output: Output,
}

/// The files that hold a wing's profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileSource {
    /// The wing's families; before [`Case::for_families`] a name may be a pattern.
    pub families: Vec<String>,
    /// The plane beyond which the wing is its own mirror image.
    pub mirror: Option<Plane>,
    /// Where its table begins.
    pub position: Position,
    /// Profiles the wing shall have; at least one file, patterns expanded in sorted order.
    pub new: Vec<PathBuf>,
    /// Profiles the wing has; `None` to cut them from the mesh at the new profiles' planes.
    pub old: Option<Vec<PathBuf>>,
    /// Where the airfoils of files without units go.
    pub placements: BTreeMap<PathBuf, Placement>,
}

/// What one family does, and where the case file says so.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilySettings {
    /// What the family does.
    pub role: Role,
    /// The CSV file with rows `x,y,z,dx,dy,dz` by which a family with the role [`Role::Prescribed`]
    /// moves, see [`displacement`].
    pub displacement: Option<PathBuf>,
    /// Where its table begins.
    pub position: Position,
}

/// The `[output]` table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// The moved mesh, once per entry; the extension says the format.
    pub mesh: Vec<PathBuf>,
    /// Distribution of beta, original and final (SVG).
    pub histogram: Option<PathBuf>,
}

/// A place in a text file, both counted from 1; columns are characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

/// Why a case cannot be run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The case file cannot be read.
    #[error("{}: cannot read the case file: {source}", path.display())]
    Unreadable {
        /// The case file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something in the case file is wrong.
    #[error("{}:{}:{}: {message}", path.display(), position.line, position.column)]
    Invalid {
        /// The case file.
        path: PathBuf,
        /// Where it is wrong.
        position: Position,
        /// What is wrong and what was expected.
        message: String,
    },
    /// The families of the case and of the mesh are not the same.
    #[error("{}: the families of the case and of the mesh differ: {message}", path.display())]
    Families {
        /// The case file.
        path: PathBuf,
        /// The names on both sides.
        message: String,
    },
}

impl Case {
    /// Reads and checks a case file.
    ///
    /// # Errors
    /// [`CaseError::Unreadable`] if the file cannot be read, [`CaseError::Invalid`] with the place
    /// of the first mistake.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let bytes = std::fs::read(path).map_err(|source| CaseError::Unreadable { path: path.to_path_buf(), source })?;
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

    /// Checks the text of a case file; `path` names it in errors, and paths in it are relative to
    /// its folder.
    ///
    /// # Errors
    /// [`CaseError::Invalid`] with the place of the first mistake.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CaseError> {
        parse::case(text, path)
    }
}
