//! `idmesh batch` moves one mesh to many designs. The mover is set up once.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::check_json;
use super::lines::Lines;
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load_files, read_case};
use crate::case::{LoadedCase, NamedFiles};
use crate::formats::read_file;
use crate::report::Checksums;
use crate::session::{
    DesignFiles, EarlierResults, Finished, Folder, Job, Listed, Outputs, ReplacedInputs, ReportFile, Session,
    SessionError, Shard, check_distinct, list_designs, of_design, sums_of_case,
};

/// Arguments of `idmesh batch`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The case file (TOML), whole as for `run`; each design replaces its new profiles or its
    /// prescribed displacement.
    case: PathBuf,
    /// The designs: a folder of profile files (for a prescribed family: of tables or displaced
    /// surfaces), or a text file that names them, one a line. With
    /// several tables [profiles.TABLE] a design is a folder with a file TABLE.csv for each, or
    /// files NAME.TABLE.csv.
    #[arg(long, value_name = "DIR|LIST")]
    designs: PathBuf,
    /// Where to compute.
    #[arg(long, value_enum, default_value = "auto")]
    backend: BackendChoice,
    /// Put the outputs into this folder, made if missing, instead of where the case says.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Append the report of each design as a line of JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
    /// Leave out designs that have their line in the JSON file and their outputs, if neither these
    /// nor the inputs have changed since.
    #[arg(long, requires = "json")]
    resume: bool,
    /// Take every N-th design from the I-th on.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let case = read_case(&arguments.case, console).map_err(|failure| remove_earlier(arguments, failure))?;
    let named = NamedFiles::of(&case);
    let listed = list(arguments, &named);
    // From here on nothing of an earlier run may be taken for a result of this one, whatever ends
    // it.
    remove(arguments, Some(&named), listed.as_ref().ok());
    let case = load_files(case, console)?;
    let replaced = ReplacedInputs::of(&case)?;
    let Listed { designs: all, fault } = listed?;
    fault.map_or(Ok(()), Err)?;
    let pattern = Outputs::of(&case.case, arguments.out.as_deref());
    let _folder = check(&pattern, &all, &case, arguments, console)?;
    let designs = arguments.shard.map_or(all.clone(), |shard| shard.take(all.clone()));

    let lines = Lines::new(arguments.json.as_ref(), console);
    let checksums = lines.are_wanted().then(|| sums_of_case(&case));
    let earlier = match (&lines, &checksums) {
        _ if !arguments.resume => EarlierResults::default(),
        (Lines::File(file), Some(checksums)) => EarlierResults::find(file, &designs, checksums, &pattern)?,
        _ => return Err(Failure::bad_input("--resume needs the reports in a file: --json FILE")),
    };
    let left: Vec<_> = designs.iter().filter(|design| !earlier.is_done(design)).collect();
    if left.len() < designs.len() {
        console.note(format_args!("{} of {} designs are done already", designs.len() - left.len(), designs.len()));
    }
    let session = match left.is_empty() {
        true => None,
        false => {
            let backend = choose_backend(arguments.backend, console)?;
            Some(Session::new(&case, backend, console.progress())?)
        }
    };
    let _appending = match (&lines, &checksums) {
        (Lines::File(file), Some(checksums)) => {
            let appending = file.begin()?;
            let shares = arguments.resume || arguments.shard.is_some();
            if appending.is_shared() && !shares {
                return Err(SessionError::InUse { path: file.path().to_path_buf() }.into());
            }
            earlier.clear(file, &designs, &all, checksums, arguments.resume || appending.is_shared())?;
            Some(appending)
        }
        _ => None,
    };
    let mut failed = earlier.n_failed();
    if let Some(session) = session {
        let mut batch = Batch { replaced, case: &case, session, pattern, lines, checksums, console };
        console.count(left.len());
        for design in left {
            failed += usize::from(!batch.finish(design)?);
            console.advance();
        }
    }
    if failed > 0 {
        return Err(Failure::new(Exit::Failed, format!("{failed} of {} designs failed", designs.len())));
    }
    Ok(())
}

/// What all designs of a batch share.
struct Batch<'a> {
    replaced: ReplacedInputs,
    case: &'a LoadedCase,
    session: Session<'a>,
    /// The outputs of the case, to which a design gives its name.
    pattern: Outputs,
    lines: Lines<'a>,
    /// Checksums of the case's files, if there are lines to hold them.
    checksums: Option<Checksums>,
    console: &'a Console,
}

impl Batch<'_> {
    /// Moves the mesh to one design, writes its outputs and its line, and prints remarks. Returns
    /// whether the result may be used.
    ///
    /// # Errors
    /// Failures that would stop every other design too: the line cannot be written, or the backend
    /// failed.
    fn finish(&mut self, design: &DesignFiles) -> Result<bool, Failure> {
        let (name, console) = (design.name.as_str(), self.console);
        let checksums = self.checksums.as_ref().map(|case| of_design(case, design));
        let finished = match self.move_to(design, checksums.as_ref()) {
            Ok(finished) => finished,
            Err(error) if error.backend().is_some() => return Err(error.into()),
            Err(error) => {
                console.warn(format_args!("{name}: {error}"));
                self.lines.append(&self.session.failed(Some(name), &error, checksums.as_ref()))?;
                return Ok(false);
            }
        };
        if let Err(failure) = self.lines.append(&finished.report) {
            finished.withdraw();
            return Err(failure);
        }
        for warning in &finished.warnings {
            console.warn(format_args!("{name}: {warning}"));
        }
        match &finished.verdict {
            Ok(()) => {
                let seconds = finished.report.seconds.map_or(0.0, |seconds| seconds.total);
                console.note(format_args!("{name}: moved in {seconds:.3} s"));
            }
            Err(refused) => console.warn(format_args!("{name}: {refused}")),
        }
        Ok(finished.verdict.is_ok())
    }

    fn move_to(&mut self, files: &DesignFiles, checksums: Option<&Checksums>) -> Result<Finished, SessionError> {
        let started = Instant::now();
        let outputs = self.pattern.named(&files.name)?;
        // A design that cannot be read leaves no mesh of an earlier one either.
        outputs.remove_earlier(&self.case.inputs)?;
        let design = self.replaced.read(self.case, files)?;
        let read_seconds = started.elapsed().as_secs_f64();
        let name = Some(files.name.as_str());
        self.session.finish(Job {
            design: &design,
            name,
            started,
            read_seconds,
            outputs: &outputs,
            report: None,
            checksums,
        })
    }
}

/// Lists the designs for a case whose files are not read.
fn list(arguments: &Arguments, named: &NamedFiles) -> Result<Listed, SessionError> {
    let replaced = ReplacedInputs::of_case(named);
    let pattern = Outputs::in_folder(&named.output, arguments.out.as_deref());
    let extensions = replaced.extensions(&pattern, &arguments.designs);
    list_designs(&arguments.designs, &extensions, replaced.tables())
}

/// Removes what an earlier run left of designs that cannot be moved now, as far as the files name
/// it. Returns the failure, which tells whether results may have stayed.
pub(super) fn remove_earlier(arguments: &Arguments, failure: Failure) -> Failure {
    let named = NamedFiles::read(&arguments.case);
    let listed = named.as_ref().and_then(|named| list(arguments, named).ok());
    remove(arguments, named.as_ref(), listed.as_ref());
    // With `--resume` results stay on purpose.
    failure.with_results_left(&arguments.case, named.is_some() || arguments.resume)
}

/// Removes what an earlier run left of the designs of this job, as far as it can be removed. Files
/// that are read stay. With `--resume` the earlier results stay: the next run decides by their
/// checksums.
///
/// - `named`: the files of the case; `None` if the case file does not say
/// - `listed`: the designs; if they are not known, those that have a line in the file of reports
fn remove(arguments: &Arguments, named: Option<&NamedFiles>, listed: Option<&Listed>) {
    if arguments.resume {
        return;
    }
    let mut inputs = inputs(vec![arguments.case.clone()], listed.map_or(&[], |listed| &listed.designs), arguments);
    inputs.extend(named.into_iter().flat_map(|named| named.inputs.iter().cloned()));
    let reports = match &arguments.json {
        Some(JsonTarget::File(path)) if check_distinct(&inputs, &[path]).is_ok() && has_reports(path) => {
            Some(ReportFile::new(path))
        }
        _ => None,
    };
    let is_shared = reports.as_ref().is_some_and(|file| file.begin().is_ok_and(|begun| begun.is_shared()));
    if is_shared && arguments.shard.is_none() {
        // The results are those of a job that runs now.
        return;
    }
    let names: HashSet<String> = match (listed, arguments.shard, &reports) {
        (Some(listed), shard, _) => {
            let designs = listed.designs.clone();
            shard.map_or(designs.clone(), |shard| shard.take(designs)).into_iter().map(|design| design.name).collect()
        }
        (None, None, Some(file)) => {
            let is_name = |name: &String| Path::new(name).file_name().is_some_and(|file| file == name.as_str());
            let lines = file.lines().unwrap_or_default().into_iter().map(|line| line.design);
            lines.filter(is_name).collect()
        }
        // Nothing says which designs are those of this job.
        (None, ..) => return,
    };
    if let Some(named) = named {
        let pattern = Outputs::in_folder(&named.output, arguments.out.as_deref());
        for name in &names {
            let _ = pattern.named(name).map(|outputs| outputs.remove_all_but(&inputs));
        }
    }
    if let Some(file) = reports {
        let _ = file.keep(|line| !names.contains(&line.design));
    }
}

/// Whether a file begins like a file of reports. The user may have named another file by mistake.
fn has_reports(path: &Path) -> bool {
    path.is_file() && read_file(path).is_ok_and(|bytes| bytes.starts_with(b"{"))
}

/// All files that a batch reads.
fn inputs(mut inputs: Vec<PathBuf>, all: &[DesignFiles], arguments: &Arguments) -> Vec<PathBuf> {
    // Results may go into the folder of the designs.
    inputs.extend(arguments.designs.is_file().then(|| arguments.designs.clone()));
    inputs.extend(all.iter().flat_map(DesignFiles::paths).map(Path::to_path_buf));
    inputs
}

/// Checks that all outputs can be written, and makes their folder. The caller holds the folder
/// until the outputs are written.
fn check(
    pattern: &Outputs,
    all: &[DesignFiles],
    case: &LoadedCase,
    arguments: &Arguments,
    console: &Console,
) -> Result<Folder, Failure> {
    let inputs = inputs(case.inputs.clone(), all, arguments);
    let json = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    pattern.check_designs(all, &inputs, json)?;
    let folder = arguments.out.as_deref().map(Folder::make).transpose()?.unwrap_or_default();
    // All outputs go into the same folder, so the check of one design holds for all.
    if let Some(first) = all.first() {
        let outputs = pattern.named(&first.name)?;
        outputs.check(case)?;
        console.losses(outputs.losses(case)?);
    }
    check_json(arguments.json.as_ref())?;
    Ok(folder)
}
