//! `idmesh run`: one design.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::inverted;
use super::job::Job;
use super::outputs::{self, Folder};
use super::{BackendChoice, JsonTarget, json_target};
use crate::backend::{self, Backend};
use crate::formats::Fields;
use crate::mover::{Mover, Outcome};
use crate::report::{self, RunReport, Seconds, Series, histogram_svg, stage_table};

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
    let targets = Targets::check(&job, arguments)?;
    targets.tell_losses(&job, console)?;
    let backend: Arc<dyn Backend> = choose_backend(arguments.backend, console)?.into();

    let setup = Instant::now();
    let observer = |stage: &str| console.step(stage);
    let mesh = job.file.mesh.clone();
    let mut mover =
        Mover::new(mesh, job.settings.clone(), backend.clone(), &observer).map_err(|error| on_mesh(error, &job))?;
    let setup = setup.elapsed().as_secs_f64();

    let update = Instant::now();
    let outcome = mover.update(&job.design, &observer).map_err(|error| on_mesh(error, &job))?;
    let update = update.elapsed().as_secs_f64();

    let write = Instant::now();
    console.step("writing");
    let written = targets.write_meshes(&job, &outcome)?;
    let write = write.elapsed().as_secs_f64();

    let info = backend.info();
    let report = RunReport {
        idmesh: env!("CARGO_PKG_VERSION").to_owned(),
        case: arguments.case.display().to_string(),
        design: None,
        backend: report::Backend { kind: info.kind.to_owned(), adapter: info.adapter, driver: info.driver },
        mesh: report::Mesh::of(&job.file.mesh),
        stages: outcome.stages.clone(),
        families: outcome.families.clone(),
        profiles: outcome.profiles.clone(),
        solver: outcome.solver.clone(),
        path: outcome.path,
        smoothing: outcome.smoothed.map(|done| report::Smoothing { sweeps: done.sweeps, moved: done.moved }),
        seconds: Seconds { read: job.read_seconds, setup, update, write, total: start.elapsed().as_secs_f64() },
    };
    if let Some(path) = &targets.histogram {
        let series =
            [Series { name: "original", beta: &outcome.original_beta }, Series { name: "final", beta: &outcome.beta }];
        outputs::write_text(path, &histogram_svg(&title(&job), &series))?;
    }
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
    if let Some(warning) = inverted::fold_warning(&outcome.folded) {
        console.warn(warning);
    }
    verdict(&mover, &job, &outcome, &written)
}

/// The histogram's title: the case and its mesh, by file name.
fn title(job: &Job) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    format!("Quality of {}, {}", name(&job.case.mesh), name(&job.case.path))
}

/// The backend for a choice; falling back to the CPU is said.
pub(super) fn choose_backend(choice: BackendChoice, console: &Console) -> Result<Box<dyn Backend>, Failure> {
    console.step("starting the backend");
    let backend = backend::select(choice.into())?;
    if choice == BackendChoice::Auto && backend.info().kind == "cpu" {
        console.note("no hardware GPU found: computing on the CPU");
    }
    Ok(backend)
}

/// A mover's error as the command's; those that are about the mesh get its name.
pub(super) fn on_mesh(error: crate::mover::MoveError, job: &Job) -> Failure {
    use crate::mover::MoveError;
    match error {
        error @ (MoveError::Mesh(_) | MoveError::Setup(_)) => Failure::from(error).in_file(&job.case.mesh),
        error @ (MoveError::Profiles { .. } | MoveError::Prescribed { .. }) => {
            Failure::from(error).in_file(&job.case.path)
        }
        error => error.into(),
    }
}

/// Whether the result is good enough for exit code 0.
fn verdict(mover: &Mover, job: &Job, outcome: &Outcome, written: &[PathBuf]) -> Result<(), Failure> {
    if !outcome.is_valid() {
        return Err(inverted::failure(mover, job, outcome, written));
    }
    if !outcome.converged {
        let stages: Vec<_> = outcome
            .unconverged
            .iter()
            .map(|(stage, error)| format!("{stage} (about {error:.1e} of an edge left)"))
            .collect();
        return Err(Failure::new(Exit::NotConverged, format!("not converged: {}", stages.join(", ")))
            .with_hint("raise max_sweeps or tolerance in [solver]"));
    }
    Ok(())
}

/// Where a run writes, checked.
struct Targets {
    meshes: Vec<PathBuf>,
    histogram: Option<PathBuf>,
    /// Held until everything is written.
    _folder: Folder,
}

impl Targets {
    fn check(job: &Job, arguments: &Arguments) -> Result<Self, Failure> {
        let place = |path: &PathBuf| match (&arguments.out, path.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.clone(),
        };
        let meshes: Vec<_> = job.case.output.mesh.iter().map(place).collect();
        let histogram = job.case.output.histogram.as_ref().map(place);
        let json = match &arguments.json {
            Some(JsonTarget::File(path)) => Some(path),
            _ => None,
        };
        let all: Vec<&Path> = meshes.iter().chain(&histogram).chain(json).map(PathBuf::as_path).collect();
        outputs::check_distinct(&job.inputs, &all)?;
        let folder = arguments.out.as_deref().map(Folder::make).transpose()?.unwrap_or_default();
        for path in &meshes {
            job.file.check_output(path)?;
        }
        for path in histogram.iter().chain(json) {
            outputs::check_writable(path)?;
        }
        Ok(Self { meshes, histogram, _folder: folder })
    }

    /// Warns of what the meshes will not hold; of those to look at in ParaView only `-v` tells it.
    fn tell_losses(&self, job: &Job, console: &Console) -> Result<(), Failure> {
        for path in &self.meshes {
            let name = path.to_string_lossy().to_lowercase();
            let to_look_at = name.trim_end_matches(".gz").ends_with(".vtu");
            for loss in job.file.losses(path)? {
                let loss = format!("{}: {loss}", path.display());
                if to_look_at { console.detail(loss) } else { console.warn(loss) }
            }
        }
        Ok(())
    }

    /// Writes the moved mesh under its names; if it is not valid, under their `invalid` twins, and what is wrong alone.
    fn write_meshes(&self, job: &Job, outcome: &Outcome) -> Result<Vec<PathBuf>, Failure> {
        let lost = outcome.vertices.iter().filter(|vertex| !vertex.is_finite()).count();
        if lost > 0 {
            let message = format!("not converged: {lost} vertices have no finite position; no mesh was written");
            return Err(Failure::new(Exit::NotConverged, message));
        }
        let fields = Fields { displacement: Some(&outcome.displacement), beta: Some(&outcome.beta) };
        let mut written = Vec::new();
        for path in &self.meshes {
            let path = if outcome.is_valid() { path.clone() } else { outputs::invalid_name(path) };
            job.file.write(&path, &outcome.vertices, &fields)?;
            written.push(path);
        }
        if (outcome.inverted > 0 || !outcome.pierced.is_empty())
            && let Some(first) = self.meshes.first()
        {
            written.push(inverted::write_inverted(first, job, outcome)?);
        }
        Ok(written)
    }
}
