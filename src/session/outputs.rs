//! [`Outputs`]: the files of a result, and the rule for their names. A mesh that is not valid never
//! gets the name of a valid one.
//!
//! | result | names |
//! |---|---|
//! | valid | `NAME.EXT` |
//! | not valid | `NAME.invalid.EXT`, and the faulty tets as `NAME.inverted.vtu` |
//! | without finite positions | the page alone |

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::files::{ReadFiles, cannot_write, check_distinct, check_writable, remove_file};
use super::inverted::add_inverted;
use super::names::{invalid_name, inverted_name, mapbc_beside, named_after};
use super::{DesignFiles, Exit, SessionError, add_report};
use crate::case::{Case, LoadedCase, Output};
use crate::families::Role;
use crate::formats::{Fields, FileSet, NamesLock, Placed, SurfaceFile, has_format, is_special, real_path, twin};
use crate::mesh::{self, CellMeasures};
use crate::mover::{Outcome, Why};
use crate::report::{
    Backend, Measured, Mesh, Page, ReportError, RunReport, Series, histogram_svg, sections_svg, share_of_tets,
};

/// The files of one design's results, and the rule for their names:
///
/// | result | names |
/// |---|---|
/// | valid | `NAME.EXT` |
/// | not valid | `NAME.invalid.EXT`, and the faulty tets as `NAME.inverted.vtu` |
/// | without finite positions | the page alone |
#[derive(Default)]
pub struct Outputs {
    /// The files of the moved mesh, one for each format.
    pub meshes: Vec<PathBuf>,
    /// The file of the distribution of beta (SVG).
    pub histogram: Option<PathBuf>,
    /// The file of the report as a page for browsers (HTML). It is there for every result that has
    /// files, valid or not, and says which.
    pub page: Option<PathBuf>,
    /// The files of the moved surfaces, named like the meshes.
    pub surfaces: Vec<PathBuf>,
    /// The file of the wings' sections (SVG).
    pub sections: Option<PathBuf>,
}

impl Outputs {
    /// The outputs of a case. With a folder, the outputs keep their file names and go into this
    /// folder.
    pub fn of(case: &Case, folder: Option<&Path>) -> Self {
        Self::in_folder(&case.output, folder)
    }

    /// [`Self::of`] from the table `[output]` of a case.
    pub fn in_folder(output: &Output, folder: Option<&Path>) -> Self {
        let place = |path: &PathBuf| match (folder, path.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.clone(),
        };
        Self {
            meshes: output.mesh.iter().map(place).collect(),
            histogram: output.histogram.as_ref().map(place),
            page: output.report.as_ref().map(place),
            surfaces: output.surface.iter().map(place).collect(),
            sections: output.sections.as_ref().map(place),
        }
    }

    /// These outputs with the name of a design before the extensions, and `DESIGN.sections.svg` for
    /// the sections.
    ///
    /// # Errors
    /// [`SessionError::NoExtension`]: an output has no extension.
    pub fn named(&self, design: &str) -> Result<Self, SessionError> {
        let place = |path: &PathBuf| named_after(path, design);
        let [meshes, surfaces] =
            [&self.meshes, &self.surfaces].map(|paths| paths.iter().map(place).collect::<Result<Vec<_>, _>>());
        let [histogram, page] = [&self.histogram, &self.page].map(|path| path.as_ref().map(place).transpose());
        let sections = self.sections.as_ref().map(|path| path.with_file_name(format!("{design}.sections.svg")));
        Ok(Self { meshes: meshes?, histogram: histogram?, page: page?, surfaces: surfaces?, sections })
    }

    /// All files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let others = self.histogram.iter().chain(&self.page).chain(&self.sections);
        self.meshes.iter().chain(&self.surfaces).chain(others).map(PathBuf::as_path)
    }

    /// Every name that a result may have, valid or not.
    pub fn names(&self) -> Vec<PathBuf> {
        let meshes = self.meshes.iter().flat_map(|path| [Some(path.clone()), Some(invalid_name(path)), twin(path)]);
        let meshes = meshes.flatten();
        let inverted = self.meshes.first().map(|path| inverted_name(path));
        let surfaces = self.surfaces.iter().flat_map(|path| [path.clone(), invalid_name(path)]);
        meshes.chain(inverted).chain(surfaces).chain(self.pictures()).collect()
    }

    /// The names of the files of a result of which it is known whether it is valid. Without
    /// `NAME.inverted.vtu`, which not every invalid result has.
    pub(super) fn names_of(&self, is_valid: bool) -> Vec<PathBuf> {
        let mesh = |path: &PathBuf| if is_valid { path.clone() } else { invalid_name(path) };
        self.meshes.iter().chain(&self.surfaces).map(mesh).chain(self.pictures()).collect()
    }

    /// The files that have one name for every result: they say themselves whether it is valid.
    pub(super) fn pictures(&self) -> impl Iterator<Item = PathBuf> {
        self.histogram.clone().into_iter().chain(self.page.clone()).chain(self.sections.clone())
    }

    /// Refuses outputs that would overwrite an input or each other, if the result is not valid too:
    /// a mesh that is read may be the invalid one of an earlier run.
    fn check_names(&self, inputs: &[PathBuf]) -> Result<(), SessionError> {
        check_distinct(inputs, &self.names().iter().map(PathBuf::as_path).collect::<Vec<_>>())
    }

    /// Checks the names of a batch's results, valid or not: none is that of an input, of another
    /// design's result, or of the file of reports.
    ///
    /// - `inputs`: files that are read, with the designs' own
    /// - `reports`: the file of reports
    ///
    /// # Errors
    /// - [`SessionError::NoExtension`]: an output has no extension
    /// - [`SessionError::Overwrites`], [`SessionError::TwoOutputs`]: a name is taken
    /// - [`SessionError::SameName`]: two designs have results of one name
    pub fn check_designs(
        &self,
        designs: &[DesignFiles],
        inputs: &[PathBuf],
        reports: Option<&Path>,
    ) -> Result<(), SessionError> {
        let read = ReadFiles::new(inputs);
        let reports = reports.filter(|path| !is_special(path));
        if let Some(path) = reports {
            check_distinct(inputs, &[path])?;
        }
        let reports = reports.map(|path| (real_path(path), path));
        let mut taken: HashMap<PathBuf, &DesignFiles> = HashMap::new();
        for design in designs {
            for path in self.named(&design.name)?.names() {
                let place = real_path(&path);
                if let Some(input) = read.lost_to(&path) {
                    return Err(SessionError::Overwrites { output: path, input: input.clone() });
                }
                if reports.as_ref().is_some_and(|(reports, _)| *reports == place) {
                    return Err(SessionError::TwoOutputs { path });
                }
                if let Some(other) = taken.insert(place, design) {
                    if other.name == design.name {
                        return Err(SessionError::TwoOutputs { path });
                    }
                    let of = |design: &DesignFiles| design.paths().next().map(Path::to_path_buf).unwrap_or_default();
                    return Err(SessionError::SameName {
                        name: path.display().to_string(),
                        one: of(other),
                        other: of(design),
                    });
                }
            }
        }
        Ok(())
    }

    /// Checks that all files can be written, and that no file overwrites an input of the case.
    ///
    /// # Errors
    /// The first file that cannot be written, or that overwrites an input.
    pub fn check(&self, case: &LoadedCase) -> Result<(), SessionError> {
        self.check_names(&case.inputs)?;
        for path in &self.meshes {
            case.file.check_output(path)?;
        }
        case.file.check_beside(&self.meshes.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        // The files of an invalid result are checked too, so that writing them cannot fail for
        // their names.
        let invalid: Vec<_> = self.meshes.iter().map(|path| invalid_name(path)).collect();
        case.file.check_beside(&invalid.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        let surfaces = self.surfaces.iter().flat_map(|path| [path.clone(), invalid_name(path)]);
        surfaces.chain(self.pictures()).try_for_each(|path| check_writable(&path))
    }

    /// The parts of the input mesh that the written meshes will not hold. The loss of a `.vtu` file
    /// is a detail, because such a file is to look at.
    ///
    /// # Errors
    /// The extension of a path belongs to no format.
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

    /// Removes the files of an earlier result: those under the names of these outputs, and those
    /// that a result that is not valid had. No file of another design is left for a reader to take.
    /// Of an OpenFOAM folder the points are removed, without which the folder is no mesh. Another
    /// process that puts a result there meanwhile has all its files there, or none.
    ///
    /// - `inputs`: files that are read; nothing is removed if one of them has the name of an output
    /// - `report`: the file of the result's report, which is removed too
    ///
    /// # Errors
    /// - [`SessionError::Overwrites`], [`SessionError::TwoOutputs`]: an output has the name of an
    ///   input or of another output
    /// - [`SessionError::CannotWrite`]: a file cannot be removed
    pub fn remove_earlier(&self, inputs: &[PathBuf], report: Option<&Path>) -> Result<(), SessionError> {
        let _lock = self.lock(report)?;
        // A run that is killed meanwhile leaves no report of files that are gone.
        self.check_names(inputs)?;
        report.map_or(Ok(()), remove_file)?;
        self.remove_locked(inputs)
    }

    /// Removes the files of an earlier result of a case that cannot be run, as far as they can be
    /// removed. A file that is read stays, and so does a file whose name no mesh can have.
    ///
    /// - `read`: files that are read
    /// - `report`: the file of the result's report, which is removed too
    pub fn remove_all_but(&self, read: &ReadFiles, report: Option<&Path>) {
        let _lock = self.lock(report);
        let _ = report.map(remove_file);
        let others: Vec<PathBuf> = self.pictures().chain(self.surfaces.iter().cloned()).collect();
        let invalid: Vec<PathBuf> = self.surfaces.iter().map(|path| invalid_name(path)).collect();
        let is_other = |path: &PathBuf| others.contains(path) || invalid.contains(path);
        let can_be_written = |path: &PathBuf| is_other(path) || has_format(path);
        for path in self.names().into_iter().filter(can_be_written) {
            if read.lost_to(&path).is_none() {
                let _ = remove_result(&path);
            }
        }
    }

    /// Gives the files of a result their names, in place of the files of an earlier result. Of
    /// several processes that do so at once, all files are those of the last one.
    ///
    /// - `inputs`: files that are read
    /// - `report`: the file of the result's report, if it is in the set
    /// - `check`: is called before anything is removed; after its error nothing has changed
    ///
    /// # Errors
    /// The error of `check`, or a file cannot be removed or cannot get its name.
    pub fn place(
        &self,
        files: FileSet,
        inputs: &[PathBuf],
        report: Option<&Path>,
        check: impl FnOnce() -> Result<(), SessionError>,
    ) -> Result<Placed, SessionError> {
        files.place_after(|| {
            let lock = self.lock(report)?;
            check()?;
            self.remove_locked(inputs)?;
            Ok(lock)
        })
    }

    /// [`Outputs::remove_earlier`] in a process that has the lock.
    fn remove_locked(&self, inputs: &[PathBuf]) -> Result<(), SessionError> {
        self.check_names(inputs)?;
        self.names().iter().try_for_each(|path| remove_result(path))
    }

    /// Locks the folders of all files that a result may have.
    fn lock(&self, report: Option<&Path>) -> Result<NamesLock, SessionError> {
        let names = self.names();
        let paths = || names.iter().map(PathBuf::as_path).chain(report);
        NamesLock::of(paths()).map_err(|error| cannot_write(paths().next().unwrap_or(Path::new("")), error))
    }

    /// Adds the files of a result to a set, by the rule of this module: the moved mesh, the faulty
    /// cells if cells are inverted or the surface self-intersects, and the histogram. The page is
    /// added with its report.
    ///
    /// - `design`: the design's name, for the histogram's title
    ///
    /// # Errors
    /// A vertex has no finite position, an output would overwrite an input, or a file cannot be
    /// written.
    pub fn add_to<'a>(
        &self,
        files: &mut FileSet<'a>,
        case: &'a LoadedCase,
        design: Option<&str>,
        outcome: &'a Outcome,
    ) -> Result<(), SessionError> {
        if let Err(refused) = outcome.check()
            && refused.why == Why::NotFinite
        {
            return Err(SessionError::Refused(refused));
        }
        self.check_names(&case.inputs)?;
        let moved = outcome.even_if_invalid();
        let fields = Fields {
            displacement: Some(moved.displacement()),
            beta: Some(&outcome.beta),
            measures: outcome.cell_measures.as_deref(),
        };
        for path in &self.meshes {
            let written = if outcome.is_valid() { path.clone() } else { invalid_name(path) };
            case.file.add_to(files, &written, moved.vertices(), &fields)?;
            if !outcome.is_valid() {
                case.file.remove_names_beside(files, path)?;
            }
        }
        if (outcome.inverted > 0 || !outcome.self_intersecting.is_empty())
            && let Some(first) = self.meshes.first()
        {
            add_inverted(files, first, outcome)?;
        }
        let surface = SurfaceFile {
            mesh: case.file.cells(),
            vertices: moved.vertices(),
            displacement: Some(moved.displacement()),
        };
        for path in &self.surfaces {
            let written = if outcome.is_valid() { path.clone() } else { invalid_name(path) };
            surface.add_to(files, &written).map_err(|error| cannot_write(&written, error))?;
        }
        if let Some(path) = &self.sections {
            let svg = sections_svg(outcome, &case.old_profiles().collect::<Vec<_>>());
            files.add(path, move |out| out.write_all(svg.as_bytes())).map_err(|error| cannot_write(path, error))?;
        }
        let Some(path) = &self.histogram else { return Ok(()) };
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let design = design.map(|name| format!(", {name}")).unwrap_or_default();
        let hybrid = case.file.cells();
        let share = share_of_tets(hybrid);
        let title = format!("Quality of {}, {}{design}{share}", name(&case.case.mesh), name(&case.case.path));
        let chart = |measured, original: &[f64], last: &[f64]| {
            let series = [("original", original), ("final", last)].map(|(name, values)| Series { name, values });
            histogram_svg(measured, &title, &series)
        };
        let svg = match &outcome.cell_measures {
            Some(last) if outcome.beta.is_empty() => {
                let original = mesh::measures(hybrid, &outcome.mesh().vertices, None);
                let jacobians =
                    |cells: &[CellMeasures]| -> Vec<f64> { cells.iter().map(|cell| cell.jacobian).collect() };
                chart(Measured::ScaledJacobian, &jacobians(&original), &jacobians(last))
            }
            _ => chart(Measured::Beta, &outcome.original_beta, &outcome.beta),
        };
        files.add(path, move |out| out.write_all(svg.as_bytes())).map_err(|error| cannot_write(path, error))
    }
}

impl Outputs {
    /// Adds the report as a page to a set of files, if the outputs have one.
    ///
    /// - `report`: the report of the outcome
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add_page(
        &self,
        files: &mut FileSet,
        case: &LoadedCase,
        report: &RunReport,
        outcome: &Outcome,
    ) -> Result<(), SessionError> {
        let Some(path) = &self.page else { return Ok(()) };
        let names = case.file.mesh.families.iter().map(String::as_str);
        let page = Page {
            report,
            outcome,
            old: case.old_profiles().collect(),
            settings: &case.case.settings,
            roles: names.zip(case.roles().iter().map(Role::name)).collect(),
        };
        let written = page.html().and_then(|html| files.add(path, move |out| out.write_all(html.as_bytes())));
        written.map_err(|error| cannot_write(path, error))
    }

    /// Writes the report and the page of an outcome without finite positions, in place of the files
    /// of an earlier result.
    ///
    /// - `report`: the report, and its file if it gets one
    /// - `check`: as for [`Outputs::place`]
    ///
    /// # Errors
    /// As for [`Outputs::place`], or a file cannot be written.
    pub(super) fn place_refused(
        &self,
        case: &LoadedCase,
        (report, path): (&RunReport, Option<&Path>),
        outcome: &Outcome,
        check: impl FnOnce() -> Result<(), SessionError>,
    ) -> Result<(), SessionError> {
        let mut files = FileSet::default();
        self.add_page(&mut files, case, report, outcome)?;
        path.map_or(Ok(()), |path| add_report(&mut files, path, report))?;
        self.place(files, &case.inputs, path, check).map(drop)
    }
}

/// Removes a file of an earlier result, or the files of a mesh that is a folder. The name of an
/// invalid mesh is idmesh's own, so such a folder goes with all its files: those of the mesh that
/// was read, such as its zones, are there too.
fn remove_result(path: &Path) -> Result<(), SessionError> {
    let is_invalid = path.file_name().is_some_and(|name| name.to_string_lossy().contains(".invalid"));
    if path.is_dir() {
        let points = ["points", "points.gz"].map(|name| path.join(name));
        // A folder without points is none of idmesh's.
        if is_invalid && points.iter().any(|points| points.is_file()) {
            let entries = fs::read_dir(path).map_err(|error| cannot_write(path, error))?;
            // Links may lead to files of others, and hidden files are of jobs that are under way.
            let is_own = |entry: &fs::DirEntry| {
                entry.file_type().is_ok_and(|kind| kind.is_file())
                    && !entry.file_name().as_encoded_bytes().starts_with(b".")
            };
            entries.flatten().filter(is_own).try_for_each(|entry| remove_file(&entry.path()))?;
            let _ = fs::remove_dir(path);
        }
        return points.iter().try_for_each(|points| remove_file(points));
    }
    if is_invalid && path.is_file() {
        // The names of the families beside it.
        remove_file(&mapbc_beside(path))?;
    }
    remove_file(path)
}

/// A part of the input mesh that an output will not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loss {
    /// The file and the part.
    pub text: String,
    /// Whether the loss matters to few users, because the file is to look at.
    pub is_detail: bool,
}

impl LoadedCase {
    /// Writes the moved mesh to the outputs of the case, by the rule of
    /// [`crate::session::Outputs`], and returns the files written. All files appear, or none. The
    /// page of the report has no times, device and checksums:
    /// [`crate::session::Session::finish`] makes whole reports.
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
    /// In the last case the page of the report is written.
    pub fn write(&self, outcome: &Outcome) -> Result<Vec<PathBuf>, SessionError> {
        let outputs = Outputs::of(&self.case, None);
        outputs.check(self)?;
        outputs.remove_earlier(&self.inputs, None)?;
        let mut files = FileSet::default();
        let verdict = outcome.check();
        let refused = verdict.as_ref().err();
        let exit = refused.map_or(0, |refused| Exit::from(refused) as u8);
        let (path, mesh) = (self.case.path.display().to_string(), Mesh::of(self.file.cells()));
        let report = RunReport::failed(path, None, Backend::default(), mesh, exit);
        if let Some(refused) = refused.filter(|refused| refused.why == Why::NotFinite) {
            let report = RunReport { error: Some(ReportError::of_refused(refused)), ..report };
            outputs.place_refused(self, (&report, None), outcome, || Ok(()))?;
            return Err(SessionError::Refused(refused.clone()));
        }
        outputs.add_to(&mut files, self, None, outcome)?;
        if outputs.page.is_some() {
            outputs.add_page(&mut files, self, &report.of_outcome(outcome, refused), outcome)?;
        }
        let written = files.files().map(|(path, _)| path.to_path_buf()).collect();
        outputs.place(files, &self.inputs, None, || Ok(()))?;
        Ok(written)
    }
}
