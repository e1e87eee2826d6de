//! `idmesh batch` moves one mesh to many designs. The mover is set up once.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicUsize;
use std::time::Duration;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::check_json;
use super::lines::Lines;
use super::queue::Queue;
use super::workers::Batch;
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load_files, read_case};
use crate::backend::{Backend, MOST_TOGETHER};
use crate::case::{LoadedCase, NamedFiles};
use crate::formats::read_file;
use crate::report::Checksums;
use crate::session::{
    Appending, ArrayJob, Claiming, Claims, DesignFiles, EarlierResults, Folder, Listed, Outputs, ReadFiles,
    ReplacedInputs, ReportFile, Session, SessionError, Shard, check_distinct, list_designs, sums_of_case,
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
    /// Take every N-th design from the I-th on; `auto` asks the scheduler or the MPI launcher for I
    /// and N.
    #[arg(long, value_name = "I/N|auto", value_parser = share)]
    shard: Option<Share>,
    /// Share the designs with other processes, which may run on other computers: each design is
    /// claimed by a file in this folder, made if missing.
    #[arg(long, value_name = "DIR")]
    claim: Option<PathBuf>,
    /// Another process takes a claimed design over if this process did not renew its claim for so
    /// many seconds.
    #[arg(long, value_name = "SECONDS", requires = "claim", default_value_t = 120, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    claim_expires: u64,
    /// End when no design is free, without waiting for the designs of other processes.
    #[arg(long, requires = "claim")]
    no_wait: bool,
    /// Move the mesh to so many designs at once.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=512))]
    jobs: u32,
    /// Move the mesh to so many designs in one solve, at most four: on the CPU their springs are
    /// read together, which takes less time. The results are those of each design alone, to the
    /// bit. With --jobs each job takes so many.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=MOST_TOGETHER as i64))]
    together: u32,
}

/// The share of a job in the designs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Share {
    Given(Shard),
    /// By variables of the environment.
    Auto,
}

fn share(text: &str) -> Result<Share, String> {
    match text {
        "auto" => Ok(Share::Auto),
        text => text.parse().map(Share::Given).map_err(|error: String| format!("{error}, or auto")),
    }
}

/// The share of this job, with the variables that say so.
fn resolved(share: Option<Share>) -> Result<(Option<Shard>, Vec<String>), Failure> {
    match share {
        Some(Share::Auto) => {
            let get = |name: &str| std::env::var_os(name).map(|value| value.to_string_lossy().into_owned());
            let job = ArrayJob::of_variables(get).map_err(|error| {
                let mut failure = Failure::bad_input(error.to_string());
                failure.hint = Some(error.hint().to_owned());
                failure
            })?;
            Ok((Some(job.shard), job.from))
        }
        Some(Share::Given(shard)) => Ok((Some(shard), Vec::new())),
        None => Ok((None, Vec::new())),
    }
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let (shard, from) = resolved(arguments.shard)?;
    if let (Some(shard), false) = (shard, from.is_empty()) {
        console.note(format_args!("shard {shard} by {}", from.join(", ")));
    }
    // The results of a job that runs now stay: a job that is refused removes nothing.
    let begun = begin(arguments, shard)?;
    let case = read_case(&arguments.case, console).map_err(|failure| remove_unread(arguments, shard, failure))?;
    let named = NamedFiles::of(&case);
    let listed = list(arguments, &named);
    // From here on nothing of an earlier run may be taken for a result of this one, whatever ends
    // it.
    remove(arguments, shard, Some(&named), listed.as_ref().ok());
    let case = load_files(case, console)?;
    let replaced = ReplacedInputs::of(&case)?;
    let Listed { designs: all, fault } = listed?;
    fault.map_or(Ok(()), Err)?;
    let pattern = Outputs::of(&case.case, arguments.out.as_deref());
    let _folder = check(&pattern, &all, &case, arguments, console)?;
    let designs = shard.map_or(all.clone(), |shard| shard.take(all.clone()));

    let lines = Lines::new(arguments.json.as_ref(), console);
    let checksums = (lines.are_wanted() || arguments.claim.is_some()).then(|| sums_of_case(&case));
    let earlier = match (&lines, &checksums) {
        _ if !arguments.resume => EarlierResults::default(),
        (Lines::File(file), Some(checksums)) => EarlierResults::find(file, &designs, checksums, &pattern)?,
        _ => return Err(Failure::bad_input("--resume needs the reports in a file: --json FILE")),
    };
    let queue = queue(arguments, &designs, &earlier, checksums.as_ref(), &pattern)?;
    let n_done = match &queue {
        Queue::Own { left, .. } => designs.len() - left.len(),
        Queue::Shared { claims, .. } => claims.n_done_and_failed().0,
    };
    if n_done > 0 {
        console.note(format_args!("{n_done} of {} designs are done already", designs.len()));
    }
    let left = designs.len() - n_done;
    let backend = if left > 0 { Some(choose_backend(arguments.backend, console)?) } else { None };
    let together = (arguments.together as usize).min(left.max(1));
    check_together(together, backend.as_deref())?;
    let jobs = (arguments.jobs as usize).min(left.div_ceil(together));
    let new_session = |backend| {
        // A design more in a solve takes less than a quarter of a mover's memory.
        let room = jobs + (jobs * (together - 1)).div_ceil(4);
        Session::with_room(&case, backend, console.progress(), room).map_err(|error| {
            let is_of_memory = error.is_of_memory();
            let mut failure = Failure::from(error);
            if jobs * together > 1 && is_of_memory {
                let options = if together > 1 { "--jobs, --together" } else { "--jobs" };
                failure.hint = Some(format!("take fewer than {} designs at once ({options})", jobs * together));
            }
            failure
        })
    };
    // The designs of this process alone are begun when it is sure that they can be moved.
    let session = match (&queue, backend) {
        (Queue::Own { .. }, Some(backend)) => Start::Ready(Box::new(new_session(backend)?)),
        (_, Some(backend)) => Start::Later(backend),
        (_, None) => Start::Nothing,
    };
    if let (Lines::File(file), Some(checksums)) = (&lines, &checksums) {
        // The lines of claimed designs are those of all jobs.
        let own = if arguments.claim.is_some() { &[] } else { designs.as_slice() };
        let is_shared = begun.appending.as_ref().is_some_and(Appending::is_shared);
        let keeps_others = arguments.resume || arguments.claim.is_some() || is_shared;
        earlier.clear(file, own, &all, checksums, keeps_others)?;
    }
    let batch = Batch {
        case: &case,
        designs: &designs,
        replaced,
        pattern,
        earlier,
        queue,
        together,
        lines: Mutex::new(lines),
        checksums,
        console,
    };
    console.count(left);
    let failed = match session {
        Start::Ready(session) => batch.run(jobs, || Ok(*session))?,
        Start::Later(backend) => batch.run(jobs, || new_session(backend))?,
        Start::Nothing => 0,
    };
    batch.queue.tell_rest(console);
    let failed = match &batch.queue {
        Queue::Own { .. } => failed + batch.earlier.n_failed(),
        Queue::Shared { claims, .. } => claims.n_done_and_failed().1,
    };
    if failed > 0 {
        return Err(Failure::new(Exit::Failed, format!("{failed} of {} designs failed", designs.len())));
    }
    Ok(())
}

/// Refuses designs in one solve where the device takes them one after another: the user would take
/// the time for that of a solve together.
fn check_together(together: usize, backend: Option<&dyn Backend>) -> Result<(), Failure> {
    match backend.map(Backend::info) {
        Some(info) if together > 1 && info.kind != "cpu" => {
            let mut failure = Failure::bad_input(format!(
                "--together {together}: several designs in one solve need the CPU, but the backend is {} {}",
                info.kind, info.adapter
            ));
            failure.hint = Some("add --backend cpu, or leave --together out".to_owned());
            Err(failure)
        }
        _ => Ok(()),
    }
}

/// When the first session is set up.
enum Start<'a> {
    Ready(Box<Session<'a>>),
    /// When the first design is claimed.
    Later(Box<dyn Backend>),
    Nothing,
}

/// The designs that are left, or the claims on them.
fn queue<'d>(
    arguments: &Arguments,
    designs: &'d [DesignFiles],
    earlier: &EarlierResults,
    checksums: Option<&Checksums>,
    pattern: &Outputs,
) -> Result<Queue<'d>, Failure> {
    let (Some(folder), Some(checksums)) = (&arguments.claim, checksums) else {
        let left = (0..designs.len()).filter(|&index| earlier.line(&designs[index]).is_none()).collect();
        return Ok(Queue::Own { left, next: AtomicUsize::new(0) });
    };
    let claiming = Claiming { expires: Duration::from_secs(arguments.claim_expires), resumes: arguments.resume };
    let claims = Claims::open(folder, designs, checksums, pattern, claiming)?;
    Ok(Queue::Shared { claims: Box::new(claims), waits: !arguments.no_wait })
}

/// Lists the designs for a case whose files are not read.
fn list(arguments: &Arguments, named: &NamedFiles) -> Result<Listed, SessionError> {
    let replaced = ReplacedInputs::of_case(named);
    let pattern = Outputs::in_folder(&named.output, arguments.out.as_deref());
    let extensions = replaced.extensions(&pattern, &arguments.designs);
    list_designs(&arguments.designs, &extensions, replaced.tables())
}

/// The sign of this job that it appends to the file of reports. Dropping it ends the work.
#[derive(Default)]
struct Begun {
    /// `None` if there is no such file, or if it cannot be written, which is told later.
    appending: Option<Appending>,
    /// The folder for the outputs, in which the file may be.
    _folder: Option<Folder>,
}

/// Begins to append to the file of reports.
///
/// # Errors
/// Another job appends to the file, and this job does not share it.
fn begin(arguments: &Arguments, shard: Option<Shard>) -> Result<Begun, Failure> {
    let Some(JsonTarget::File(path)) = &arguments.json else { return Ok(Begun::default()) };
    // What cannot be made or written is told when the outputs are checked.
    let folder = arguments.out.as_deref().and_then(|out| Folder::make(out).ok());
    let file = ReportFile::new(path);
    let shares = arguments.resume || shard.is_some() || arguments.claim.is_some();
    let appending = match if shares { file.begin() } else { file.begin_alone() } {
        Ok(appending) => Some(appending),
        Err(error @ SessionError::InUse { .. }) => return Err(error.into()),
        Err(_) => None,
    };
    Ok(Begun { appending, _folder: folder })
}

/// Removes what an earlier run left of designs that cannot be moved now, because the command cannot
/// begin.
pub(super) fn remove_earlier(arguments: &Arguments, failure: Failure) -> Failure {
    // Without a share nothing says which designs are those of this job.
    let Ok((shard, _)) = resolved(arguments.shard) else { return failure };
    match begin(arguments, shard) {
        Ok(_begun) => remove_unread(arguments, shard, failure),
        Err(_) => failure,
    }
}

/// Removes what an earlier run left of the designs of a case that cannot be read, as far as the
/// files name it. Returns the failure, which tells whether results may have stayed.
fn remove_unread(arguments: &Arguments, shard: Option<Shard>, failure: Failure) -> Failure {
    let named = NamedFiles::read(&arguments.case);
    let listed = named.as_ref().and_then(|named| list(arguments, named).ok());
    remove(arguments, shard, named.as_ref(), listed.as_ref());
    // With `--resume` and `--claim` results stay on purpose.
    match arguments.resume || arguments.claim.is_some() {
        true => failure,
        false => failure.with_results_left(&arguments.case, named.as_ref()),
    }
}

/// Removes what an earlier run left of the designs of this job, as far as it can be removed. Files
/// that are read stay. With `--resume` and `--claim` the earlier results stay: the next run decides
/// by their checksums, or other jobs have just made them.
///
/// - `shard`: the share of this job
/// - `named`: the files of the case; `None` if the case file does not say
/// - `listed`: the designs; if they are not known, those that have a line in the file of reports
fn remove(arguments: &Arguments, shard: Option<Shard>, named: Option<&NamedFiles>, listed: Option<&Listed>) {
    if arguments.resume || arguments.claim.is_some() {
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
    let names: HashSet<String> = match (listed, shard, &reports) {
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
        let read = ReadFiles::new(&inputs);
        for name in &names {
            let _ = pattern.named(name).map(|outputs| outputs.remove_all_but(&read, None));
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
    // A folder or a pipe in the place of a design's file is never read: the design fails alone.
    let is_read = |path: &&Path| std::fs::metadata(path).map_or(true, |metadata| metadata.is_file());
    inputs.extend(all.iter().flat_map(DesignFiles::paths).filter(is_read).map(Path::to_path_buf));
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
    check_json(arguments.json.as_ref(), console)?;
    Ok(folder)
}
