//! `idmesh run` moves a mesh to the design of a case.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::failure::Failure;
use super::json::{check_json, print_json};
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load_files, page_target, read_case};
use crate::case::{LoadedCase, NamedFiles, Output};
use crate::formats::read_file;
use crate::report::{RunReport, SolverQualities, is_page, kind_table, solver_table, stage_remark, stage_table};
use crate::session::{Folder, Job, Outputs, ReadFiles, Session, SessionError, check_distinct, sums_of_case};

/// Arguments of `idmesh run`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The case file (TOML).
    case: PathBuf,
    /// Where to compute.
    #[arg(long, value_enum, default_value = "auto")]
    backend: BackendChoice,
    /// Put the outputs into this folder, made if missing, instead of where the case says.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the report as a page for browsers, instead of where the case says.
    #[arg(long, value_name = "FILE.html", value_parser = page_target)]
    report: Option<PathBuf>,
    /// Write the run report as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
}

impl Arguments {
    /// `idmesh run CASE --backend BACKEND`.
    pub(super) fn of_case(case: &Path, backend: BackendChoice) -> Self {
        Self { case: case.to_path_buf(), backend, out: None, report: None, json: None }
    }

    /// The outputs of a case, as the command changes them.
    fn outputs(&self, output: &Output) -> Outputs {
        let mut outputs = Outputs::in_folder(output, self.out.as_deref());
        if let Some(page) = &self.report {
            outputs.page = Some(page.clone());
        }
        outputs
    }
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let start = Instant::now();
    console.estimate(1.0);
    let case = read_case(&arguments.case, console).map_err(|failure| remove_earlier(arguments, failure))?;
    // From here on nothing of an earlier run may be taken for a result of this one, whatever ends
    // it.
    remove(arguments, Some(&NamedFiles::of(&case)));
    let case = load_files(case, console)?;
    let read_seconds = start.elapsed().as_secs_f64();
    let outputs = arguments.outputs(&case.case.output);
    let _folder = check(&outputs, &case, arguments, console)?;
    console.losses(outputs.losses(&case)?);
    let file = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    outputs.remove_earlier(&case.inputs, file)?;
    let backend = choose_backend(arguments.backend, console)?;
    let mut session = Session::new(&case, backend, console.progress())?;
    let is_told = arguments.json.is_some() || outputs.page.is_some();
    let checksums = is_told.then(|| sums_of_case(&case));
    let job = Job {
        design: &case.design,
        name: None,
        started: start,
        read_seconds,
        outputs: &outputs,
        report: file,
        checksums: checksums.as_ref(),
        claim: None,
    };
    let finished = match session.finish(job) {
        Err(error @ SessionError::Refused(_)) => {
            // A mesh without finite positions has no file, but its report and its page are written.
            if arguments.json == Some(JsonTarget::StandardOutput) {
                print_json(&session.failed(None, &error, checksums.as_ref()), console)?;
            }
            return Err(error.into());
        }
        finished => finished?,
    };
    let report = &finished.report;
    for warning in &finished.warnings {
        console.warn(warning);
    }
    let told = match &arguments.json {
        Some(JsonTarget::StandardOutput) => print_json(report, console),
        _ => {
            let original = report.cells_original.as_ref();
            let kinds =
                report.cells.as_ref().map_or(String::new(), |kinds| format!("\n{}", kind_table(kinds, original)));
            let stages = stage_table(report.stages.as_deref().unwrap_or_default());
            console.data(&(stages + &stage_remark(&report.mesh) + &kinds + &limited(report)))
        }
    };
    if let Err(failure) = told {
        finished.withdraw();
        return Err(failure);
    }
    if let Some(times) = &report.seconds {
        console.note(format_args!(
            "setup {:.3} s, update {:.3} s on {} ({})",
            times.setup, times.update, report.backend.kind, report.backend.adapter
        ));
    }
    for path in &finished.written {
        console.note(format_args!("wrote {}", path.display()));
    }
    Ok(finished.verdict?)
}

/// The measures that have a limit, before and after. Empty without limits.
fn limited(report: &RunReport) -> String {
    let with_limits = report.solver_quality.as_ref().filter(|quality| !quality.limits.is_empty());
    with_limits.map_or(String::new(), |SolverQualities { limits, original, moved }| {
        format!("\n{}", solver_table(&["original", "final"], &[original, moved], limits, true))
    })
}

/// Removes what an earlier run left of a case that cannot be run, as far as the case file and the
/// command name it. Returns the failure, which tells whether results may have stayed.
pub(super) fn remove_earlier(arguments: &Arguments, failure: Failure) -> Failure {
    let named = NamedFiles::read(&arguments.case);
    remove(arguments, named.as_ref());
    failure.with_results_left(&arguments.case, named.as_ref())
}

/// Removes what an earlier run left, as far as it can be removed. Files that are read stay.
///
/// - `named`: the files of the case; `None` if the case file does not say
fn remove(arguments: &Arguments, named: Option<&NamedFiles>) {
    let mut inputs = vec![arguments.case.clone()];
    inputs.extend(named.into_iter().flat_map(|named| named.inputs.iter().cloned()));
    let report = match &arguments.json {
        Some(JsonTarget::File(path)) if check_distinct(&inputs, &[path]).is_ok() && is_report(path) => Some(&**path),
        _ => None,
    };
    let mut outputs = named.map_or_else(Outputs::default, |named| arguments.outputs(&named.output));
    // The user may have named another page by mistake.
    outputs.page = outputs.page.filter(|path| read_file(path).is_ok_and(|bytes| is_page(&bytes)));
    outputs.remove_all_but(&ReadFiles::new(&inputs), report);
}

/// Whether a file is a report of an earlier run. Where the case cannot be read, the file may also
/// be one that the user has named by mistake.
fn is_report(path: &Path) -> bool {
    let report = read_file(path).ok().and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    report.is_some_and(|report| report.get("idmesh").is_some())
}

/// Checks that all outputs can be written, and makes their folder. The caller holds the folder
/// until the outputs are written.
fn check(outputs: &Outputs, case: &LoadedCase, arguments: &Arguments, console: &Console) -> Result<Folder, Failure> {
    let json = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    let names = outputs.names();
    check_distinct(&case.inputs, &names.iter().map(PathBuf::as_path).chain(json).collect::<Vec<&Path>>())?;
    let folder = arguments.out.as_deref().map(Folder::make).transpose()?.unwrap_or_default();
    outputs.check(case)?;
    check_json(arguments.json.as_ref(), console)?;
    // Without `--json -` it gets the table.
    console.check_stdout()?;
    Ok(folder)
}
