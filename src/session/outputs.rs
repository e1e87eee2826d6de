//! Where results go: [`Outputs`], their names, and the rule that a bad mesh never gets a good name.
//!
//! | result | names |
//! |---|---|
//! | valid | `NAME.EXT` |
//! | not valid | `NAME.invalid.EXT`, and the cells in question as `NAME.inverted.vtu` |
//! | without finite positions | none |

use std::path::{Path, PathBuf};

use super::SessionError;
use super::files::{check_distinct, check_writable, write_text};
use super::inverted::write_inverted;
use super::names::{invalid_name, named_after};
use crate::case::{Case, LoadedCase};
use crate::formats::Fields;
use crate::mover::{Outcome, Why};
use crate::report::{Series, histogram_svg};

/// Where one design's results go.
pub struct Outputs {
    /// The moved mesh, once for each format.
    pub meshes: Vec<PathBuf>,
    /// The distribution of beta (SVG).
    pub histogram: Option<PathBuf>,
}

impl Outputs {
    /// The case's outputs, in another folder if one is given.
    pub fn of(case: &Case, folder: Option<&Path>) -> Self {
        let place = |path: &PathBuf| match (folder, path.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.clone(),
        };
        let output = &case.output;
        Self { meshes: output.mesh.iter().map(place).collect(), histogram: output.histogram.as_ref().map(place) }
    }

    /// The same with a design's name before the extensions.
    ///
    /// # Errors
    /// An output has no extension.
    pub fn named(&self, design: &str) -> Result<Self, SessionError> {
        let place = |path: &PathBuf| named_after(path, design);
        let meshes = self.meshes.iter().map(place).collect::<Result<_, _>>()?;
        Ok(Self { meshes, histogram: self.histogram.as_ref().map(place).transpose()? })
    }

    /// All of them.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.meshes.iter().chain(&self.histogram).map(PathBuf::as_path)
    }

    /// Checks that all can be written, and that none overwrites what the case was read from.
    ///
    /// # Errors
    /// The first that cannot or does.
    pub fn check(&self, case: &LoadedCase) -> Result<(), SessionError> {
        check_distinct(&case.inputs, &self.paths().collect::<Vec<_>>())?;
        for path in &self.meshes {
            case.file.check_output(path)?;
        }
        case.file.check_beside(&self.meshes.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        // What is written where the result is not valid must not fail for a name either.
        let invalid: Vec<_> = self.meshes.iter().map(|path| invalid_name(path)).collect();
        case.file.check_beside(&invalid.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        self.histogram.iter().try_for_each(|path| check_writable(path))
    }

    /// What the meshes will not hold, with the path; of meshes to look at in ParaView it is only a
    /// detail.
    ///
    /// # Errors
    /// A path has the extension of no format.
    pub fn losses(&self, case: &LoadedCase) -> Result<Vec<Loss>, SessionError> {
        let mut losses = Vec::new();
        for path in &self.meshes {
            let name = path.to_string_lossy().to_lowercase();
            let is_detail = name.trim_end_matches(".gz").ends_with(".vtu");
            let told = case.file.losses(path)?.into_iter();
            losses.extend(told.map(|loss| Loss { text: format!("{}: {loss}", path.display()), is_detail }));
        }
        Ok(losses)
    }

    /// Writes the moved mesh under its names; if it is not valid, under their `invalid` twins, and
    /// the cells in question alone. Returns the files written.
    ///
    /// # Errors
    /// A vertex has no finite position, or a file cannot be written.
    pub fn write(&self, case: &LoadedCase, outcome: &Outcome) -> Result<Vec<PathBuf>, SessionError> {
        if let Err(refused) = outcome.check()
            && refused.why == Why::NotFinite
        {
            return Err(SessionError::Refused(refused));
        }
        let moved = outcome.even_if_invalid();
        let fields = Fields { displacement: Some(moved.displacement()), beta: Some(&outcome.beta) };
        let mut written = Vec::new();
        for path in &self.meshes {
            let path = if outcome.is_valid() { path.clone() } else { invalid_name(path) };
            case.file.write(&path, moved.vertices(), &fields)?;
            written.push(path);
        }
        if (outcome.inverted > 0 || !outcome.self_intersecting.is_empty())
            && let Some(first) = self.meshes.first()
        {
            written.push(write_inverted(first, outcome)?);
        }
        Ok(written)
    }

    /// Writes the distribution of beta, original and final, if it is asked for.
    ///
    /// - `title`: above the histogram
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_histogram(&self, title: &str, outcome: &Outcome) -> Result<(), SessionError> {
        let Some(path) = &self.histogram else { return Ok(()) };
        let original = Series { name: "original", beta: &outcome.original_beta };
        let last = Series { name: "final", beta: &outcome.beta };
        write_text(path, &histogram_svg(title, &[original, last]))
    }
}

/// Something that an output will not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loss {
    /// The file, and what it will not hold.
    pub text: String,
    /// Whether few care, because the file is to look at.
    pub is_detail: bool,
}

impl LoadedCase {
    /// Writes the moved mesh where the case says, by the rule for names of
    /// [`crate::session::Outputs`]. Returns the files written.
    ///
    /// ```no_run
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// use idmesh::{backend, case::Case};
    ///
    /// let case = Case::load("case.toml")?;
    /// let mut mover = case.mover(backend::select(backend::Selection::Auto)?)?;
    /// let outcome = mover.update(&case.design)?;
    /// case.write(&outcome)?;
    /// outcome.check()?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// An output would overwrite an input or cannot be written, or a vertex has no finite position.
    pub fn write(&self, outcome: &Outcome) -> Result<Vec<PathBuf>, SessionError> {
        let outputs = Outputs::of(&self.case, None);
        outputs.check(self)?;
        outputs.write(self, outcome)
    }
}
