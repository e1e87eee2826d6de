//! `idmesh run`: one design.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::console::Console;
use super::design::{Moved, Ready, Targets};
use super::failure::Failure;
use super::job::Job;
use super::outputs::{self, Folder};
use super::{BackendChoice, JsonTarget, json_target};
use crate::report::stage_table;

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
    /// Write the run report as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let start = Instant::now();
    let job = Job::read(&arguments.case, console)?;
    let targets = Targets::of(&job, arguments.out.as_deref());
    let _folder = check(&targets, &job, arguments)?;
    targets.tell_losses(&job, console)?;
    let mut ready = Ready::new(&job, arguments.backend, console)?;
    let Moved { mut report, written, verdict } =
        ready.move_to(&job.design, None, job.read_seconds, &targets, console)?;
    report.seconds.total = start.elapsed().as_secs_f64();

    if let Some(target) = &arguments.json {
        outputs::write_json(target, &report, console)?;
    }
    if arguments.json != Some(JsonTarget::StandardOutput) {
        console.data(&stage_table(&report.stages))?;
    }
    let times = &report.seconds;
    console.note(format_args!(
        "setup {:.3} s, update {:.3} s on {} ({})",
        times.setup, times.update, report.backend.kind, report.backend.adapter
    ));
    for path in &written {
        console.note(format_args!("wrote {}", path.display()));
    }
    verdict
}

/// Checks everything that will be written, and makes the folder for it, to be held until then.
fn check(targets: &Targets, job: &Job, arguments: &Arguments) -> Result<Folder, Failure> {
    let json = match &arguments.json {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    let all: Vec<&Path> = targets.paths().chain(json).collect();
    outputs::check_distinct(&job.inputs, &all)?;
    let folder = arguments.out.as_deref().map(Folder::make).transpose()?.unwrap_or_default();
    targets.check(job)?;
    outputs::check_json(arguments.json.as_ref())?;
    Ok(folder)
}
