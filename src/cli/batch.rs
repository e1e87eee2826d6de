//! `idmesh batch` moves one mesh to many designs. The mover is set up once.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::check_json;
use super::lines::Lines;
use super::{BackendChoice, JsonTarget, choose_backend, json_target, load};
use crate::case::LoadedCase;
use crate::session::{
    DesignFiles, EarlierReports, Finished, Folder, Outputs, ReplacedInputs, Session, Shard, check_distinct,
    find_designs,
};

/// Arguments of `idmesh batch`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The case file (TOML), whole as for `run`; each design replaces its new profiles or its
    /// prescribed displacement.
    case: PathBuf,
    /// The designs: a folder of profile files, or a text file that names them, one a line. With
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
    /// Leave out designs that have their line in the JSON file and their outputs.
    #[arg(long, requires = "json")]
    resume: bool,
    /// Take every N-th design from the I-th on.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

/// The line of a design without a report: why it has none.
#[derive(Serialize)]
struct Failed<'a> {
    design: &'a str,
    valid: bool,
    /// The exit code that `run` would have had.
    exit: u8,
    error: &'a str,
    hint: Option<&'a str>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let case = load(&arguments.case, console)?;
    let replaced = ReplacedInputs::of(&case)?;
    let all = find_designs(&arguments.designs, replaced.extensions(), replaced.tables())?;
    let pattern = Outputs::of(&case.case, arguments.out.as_deref());
    let _folder = check(&pattern, &all, &case, arguments, console)?;
    let designs = arguments.shard.map_or(all.clone(), |shard| shard.take(all));

    let kept = kept(&designs, &pattern, arguments)?;
    let is_done = |design: &&DesignFiles| kept.failed.contains_key(&design.name);
    let (done, left): (Vec<_>, Vec<_>) = designs.iter().partition(is_done);
    if !done.is_empty() {
        console.note(format_args!("{} of {} designs are done already", done.len(), designs.len()));
    }
    let mut failed = done.iter().filter(|design| kept.failed[&design.name]).count();
    let session = match left.is_empty() {
        true => None,
        false => {
            let backend = choose_backend(arguments.backend, console)?;
            Some(Session::new(&case, backend, console.progress())?)
        }
    };
    let mut lines = Lines::open(arguments.json.as_ref(), &kept, console)?;
    if let Some(mut session) = session {
        console.count(left.len());
        for design in left {
            failed += usize::from(!finish(design, &replaced, &case, &mut session, &pattern, &mut lines, console)?);
            console.advance();
        }
    }
    if failed > 0 {
        return Err(Failure::new(Exit::Failed, format!("{failed} of {} designs failed", designs.len())));
    }
    Ok(())
}

/// Moves the mesh to one design, writes its outputs and its line, and prints remarks. Returns
/// whether the result may be used.
///
/// # Errors
/// Failures that would stop every other design too: the line cannot be written, or the backend
/// failed.
fn finish(
    design: &DesignFiles,
    replaced: &ReplacedInputs,
    case: &LoadedCase,
    session: &mut Session,
    pattern: &Outputs,
    lines: &mut Lines,
    console: &Console,
) -> Result<bool, Failure> {
    let name = design.name.as_str();
    let start = Instant::now();
    let finished = pattern.named(name).and_then(|outputs| {
        // A design that cannot be read leaves no mesh of an earlier one either.
        outputs.remove_earlier(&case.inputs)?;
        let design = replaced.read(case, design)?;
        session.finish(&design, Some(name), start.elapsed().as_secs_f64(), &outputs)
    });
    let (report, failure) = match finished {
        Ok(Finished { report, verdict, warnings, .. }) => {
            for warning in warnings {
                console.warn(format_args!("{name}: {warning}"));
            }
            (Some(report), verdict.err().map(Failure::from))
        }
        Err(error) if error.backend().is_some() => return Err(error.into()),
        Err(error) => (None, Some(error.into())),
    };
    match (&report, &failure) {
        (report, Some(failure)) => {
            console.warn(format_args!("{name}: {}", failure.message));
            let (error, exit, hint) = (failure.message.as_str(), failure.exit as u8, failure.hint.as_deref());
            match report {
                Some(report) => lines.append(report)?,
                None => lines.append(&Failed { design: name, valid: false, exit, error, hint })?,
            }
        }
        (Some(report), None) => {
            lines.append(report)?;
            console.note(format_args!("{name}: moved in {:.3} s", report.seconds.total));
        }
        (None, None) => {}
    }
    Ok(failure.is_none())
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
    let mut inputs = case.inputs.clone();
    inputs.push(arguments.designs.clone());
    inputs.retain(|path| !path.is_dir() || *path == case.case.mesh);
    let json = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    for design in all {
        let outputs = pattern.named(&design.name)?;
        let known = inputs.len();
        inputs.extend(design.paths().map(Path::to_path_buf));
        check_distinct(&inputs, &outputs.paths().chain(json).collect::<Vec<_>>())?;
        inputs.truncate(known);
    }
    if let Some(json) = json {
        inputs.extend(all.iter().flat_map(DesignFiles::paths).map(Path::to_path_buf));
        check_distinct(&inputs, &[json])?;
    }
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

/// The lines of an earlier run that stay: lines of designs whose outputs exist, and lines of
/// designs outside this run.
fn kept(designs: &[DesignFiles], pattern: &Outputs, arguments: &Arguments) -> Result<EarlierReports, Failure> {
    match &arguments.json {
        _ if !arguments.resume => Ok(EarlierReports::default()),
        Some(JsonTarget::File(path)) => Ok(EarlierReports::read(path, |name| {
            let there = |outputs: Outputs| outputs.paths().all(Path::exists);
            designs.iter().any(|design| design.name == name) && !pattern.named(name).is_ok_and(there)
        })?),
        _ => Err(Failure::bad_input("--resume needs the reports in a file: --json FILE")),
    }
}
