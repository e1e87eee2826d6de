//! One design of a job, moved, written and judged: what `run` does once and `batch` for each of
//! many.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::BackendChoice;
use super::console::Console;
use super::failure::{Exit, Failure};
use super::inverted;
use super::job::Job;
use super::outputs;
use crate::backend::{self, Backend};
use crate::formats::Fields;
use crate::mover::{Design, Mover, Outcome};
use crate::report::{self, RunReport, Seconds, Series, histogram_svg};

/// A job with its mover, set up.
pub(super) struct Ready<'a> {
    job: &'a Job,
    mover: Mover,
    backend: report::Backend,
    mesh: report::Mesh,
    /// Time of the set-up, s.
    setup_seconds: f64,
}

/// A design that was moved and written.
pub(super) struct Moved {
    /// Its `total` seconds are those of its parts.
    pub(super) report: RunReport,
    /// The files written, but for a histogram.
    pub(super) written: Vec<PathBuf>,
    /// Whether the result is good enough for exit code 0.
    pub(super) verdict: Result<(), Failure>,
}

impl<'a> Ready<'a> {
    /// Starts the backend and sets the mover up.
    ///
    /// # Errors
    /// There is no such backend, or the mesh and the case do not go together.
    pub(super) fn new(job: &'a Job, choice: BackendChoice, console: &Console) -> Result<Self, Failure> {
        let backend: Arc<dyn Backend> = choose_backend(choice, console)?.into();
        let setup = Instant::now();
        let observer = |stage: &str| console.step(stage);
        let mover = Mover::new(job.file.mesh.clone(), job.settings.clone(), backend.clone(), &observer)
            .map_err(|error| on_mesh(error, job))?;
        let setup_seconds = setup.elapsed().as_secs_f64();
        let info = backend.info();
        let backend = report::Backend { kind: info.kind.to_owned(), adapter: info.adapter, driver: info.driver };
        Ok(Self { job, mover, backend, mesh: report::Mesh::of(&job.file.mesh), setup_seconds })
    }

    /// Moves the mesh to a design, which took some seconds to read, and writes what comes of it.
    /// The report gets the name.
    ///
    /// # Errors
    /// The design does not fit the mesh, the backend failed, a vertex has no finite position, or a
    /// file cannot be written.
    pub(super) fn move_to(
        &mut self,
        design: &Design,
        name: Option<&str>,
        read_seconds: f64,
        targets: &Targets,
        console: &Console,
    ) -> Result<Moved, Failure> {
        let job = self.job;
        let update = Instant::now();
        let outcome = self.mover.update(design, &|stage| console.step(stage)).map_err(|error| on_mesh(error, job))?;
        let update = update.elapsed().as_secs_f64();

        let write = Instant::now();
        console.step("writing");
        let written = targets.write_meshes(&self.mover, job, &outcome)?;
        let write = write.elapsed().as_secs_f64();
        if let Some(path) = &targets.histogram {
            let series = [
                Series { name: "original", beta: &outcome.original_beta },
                Series { name: "final", beta: &outcome.beta },
            ];
            outputs::write_text(path, &histogram_svg(&title(job, name), &series))?;
        }
        if let Some(warning) = inverted::fold_warning(&outcome.folded) {
            match name {
                Some(name) => console.warn(format_args!("{name}: {warning}")),
                None => console.warn(warning),
            }
        }
        for warning in &outcome.warnings {
            match name {
                Some(name) => console.warn(format_args!("{name}: {warning}")),
                None => console.warn(warning),
            }
        }
        let setup = self.setup_seconds;
        let report = RunReport {
            idmesh: env!("CARGO_PKG_VERSION").to_owned(),
            case: job.case.path.display().to_string(),
            design: name.map(str::to_owned),
            backend: self.backend.clone(),
            mesh: self.mesh.clone(),
            stages: outcome.stages.clone(),
            families: outcome.families.clone(),
            profiles: outcome.profiles.clone(),
            solver: outcome.solver.clone(),
            path: outcome.path,
            smoothing: outcome.smoothed.map(|done| report::Smoothing { sweeps: done.sweeps, moved: done.moved }),
            seconds: Seconds { read: read_seconds, setup, update, write, total: read_seconds + update + write },
        };
        Ok(Moved { report, verdict: verdict(&self.mover, job, &outcome, &written), written })
    }
}

/// The histogram's title: the mesh and the case by file name, and the design.
fn title(job: &Job, design: Option<&str>) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let design = design.map(|name| format!(", {name}")).unwrap_or_default();
    format!("Quality of {}, {}{design}", name(&job.case.mesh), name(&job.case.path))
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
        error @ (MoveError::Profiles { .. } | MoveError::Prescribed { .. } | MoveError::Disagree { .. }) => {
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

/// Where one design's results go.
pub(super) struct Targets {
    pub(super) meshes: Vec<PathBuf>,
    pub(super) histogram: Option<PathBuf>,
}

impl Targets {
    /// The case's outputs, in another folder if one is given.
    pub(super) fn of(job: &Job, folder: Option<&Path>) -> Self {
        let place = |path: &PathBuf| match (folder, path.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.clone(),
        };
        let output = &job.case.output;
        Self { meshes: output.mesh.iter().map(place).collect(), histogram: output.histogram.as_ref().map(place) }
    }

    /// The same with a design's name before the extensions.
    ///
    /// # Errors
    /// An output has no extension.
    pub(super) fn named(&self, design: &str) -> Result<Self, Failure> {
        let place = |path: &PathBuf| outputs::named_after(path, design);
        let meshes = self.meshes.iter().map(place).collect::<Result<_, _>>()?;
        Ok(Self { meshes, histogram: self.histogram.as_ref().map(place).transpose()? })
    }

    /// All of them.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.meshes.iter().chain(&self.histogram).map(PathBuf::as_path)
    }

    /// Checks that all can be written.
    ///
    /// # Errors
    /// The first that cannot.
    pub(super) fn check(&self, job: &Job) -> Result<(), Failure> {
        for path in &self.meshes {
            job.file.check_output(path)?;
        }
        job.file.check_beside(&self.meshes.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        // What is written where the result is not valid must not fail for a name either.
        let invalid: Vec<_> = self.meshes.iter().map(|path| outputs::invalid_name(path)).collect();
        job.file.check_beside(&invalid.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        self.histogram.iter().try_for_each(|path| outputs::check_writable(path))
    }

    /// Warns of what the meshes will not hold; of those to look at in ParaView only `-v` tells it.
    pub(super) fn tell_losses(&self, job: &Job, console: &Console) -> Result<(), Failure> {
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

    /// Writes the moved mesh under its names; if it is not valid, under their `invalid` twins, and
    /// what is wrong alone.
    fn write_meshes(&self, mover: &Mover, job: &Job, outcome: &Outcome) -> Result<Vec<PathBuf>, Failure> {
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
        if (outcome.inverted > 0 || !outcome.self_intersecting.is_empty())
            && let Some(first) = self.meshes.first()
        {
            written.push(inverted::write_inverted(first, mover, outcome)?);
        }
        Ok(written)
    }
}
