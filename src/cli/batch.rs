//! `idmesh batch` moves one mesh to many designs. The mover is set up once.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::check_json;
use super::lines::Lines;
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load};
use crate::case::{Case, LoadedCase};
use crate::report::Checksums;
use crate::session::{
    DesignFiles, EarlierResults, Finished, Folder, Job, Outputs, ReplacedInputs, ReportFile, Session, SessionError,
    Shard, check_distinct, find_designs, of_design, sums_of_case,
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
    let case = load(&arguments.case, console).inspect_err(|_| remove_earlier(arguments))?;
    let replaced = ReplacedInputs::of(&case)?;
    let pattern = Outputs::of(&case.case, arguments.out.as_deref());
    let all = find_designs(&arguments.designs, &replaced.extensions(&pattern, &arguments.designs), replaced.tables())?;
    let _folder = check(&pattern, &all, &case, arguments, console).inspect_err(|_| remove_earlier(arguments))?;
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

/// Removes what an earlier run left of designs that cannot be moved now, as far as the files name
/// it. With `--resume` the earlier results stay: the next run decides by their checksums.
fn remove_earlier(arguments: &Arguments) {
    let Ok(case) = Case::read(&arguments.case) else { return };
    let replaced = ReplacedInputs::of_case(&case);
    let pattern = Outputs::of(&case, arguments.out.as_deref());
    let extensions = replaced.extensions(&pattern, &arguments.designs);
    let found = find_designs(&arguments.designs, &extensions, replaced.tables());
    let (Ok(all), false) = (found, arguments.resume) else { return };
    let inputs = inputs(case.inputs(), &all, arguments);
    let designs = arguments.shard.map_or(all.clone(), |shard| shard.take(all));
    for design in &designs {
        let _ = pattern.named(&design.name).map(|outputs| outputs.remove_all_but(&inputs));
    }
    if let Some(JsonTarget::File(path)) = &arguments.json
        && path.is_file()
        && check_distinct(&inputs, &[path]).is_ok()
    {
        let _ = ReportFile::new(path).keep(|line| designs.iter().all(|design| design.name != line.design));
    }
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
