//! Seconds of everything a run does on the example mesh, on the CPU and on a GPU.
//!
//! `cargo bench --bench stages -- [RUNS]`: medians of so many runs, 7 if not said. The GPU may be a
//! software adapter; it is named. Where there is none its column is left out.

mod common;

use std::{
    process::ExitCode,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use common::{Failure, example, median, numbers, print_machine, print_table, row};
use idmesh::{
    backend::{self, Backend, BackendError, Selection},
    formats::Fields,
};

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let [runs] = numbers(&[7])?[..] else { return Err("expected one number, of runs".into()) };
    let mut backends: Vec<Arc<dyn Backend>> = vec![backend::select(Selection::Cpu)?.into()];
    match backend::select(Selection::Gpu) {
        Ok(gpu) => backends.push(gpu.into()),
        Err(BackendError::NoAdapter(why)) => eprintln!("no column for a GPU: {why}"),
        Err(error) => return Err(error.into()),
    }
    let infos: Vec<_> = backends.iter().map(|backend| backend.info()).collect();
    print_machine(&infos);
    let measured = backends.iter().map(|backend| measure(backend, runs)).collect::<Result<Vec<_>, _>>()?;

    let mut header = row(&["seconds"]);
    header.extend(infos.iter().map(|info| info.kind.to_owned()));
    let mut rows = vec![header];
    for (at, (name, _)) in measured[0].iter().enumerate() {
        let mut line = row(&[name]);
        line.extend(measured.iter().map(|of_backend| format!("{:.4}", of_backend[at].1)));
        rows.push(line);
    }
    print_table(&rows);
    Ok(())
}

/// Medians of the parts of a run, in order. The first, cold run is not counted.
fn measure(backend: &Arc<dyn Backend>, runs: usize) -> Result<Vec<(String, f64)>, Failure> {
    let mut all: Vec<Vec<(String, f64)>> = Vec::new();
    for _ in 0..=runs {
        all.push(once(backend)?);
    }
    let names = all[0].iter().map(|(name, _)| name.clone());
    Ok(names.enumerate().map(|(at, name)| (name, median(all[1..].iter().map(|run| run[at].1).collect()))).collect())
}

/// Times of the parts of one run.
fn once(backend: &Arc<dyn Backend>) -> Result<Vec<(String, f64)>, Failure> {
    let mut parts = Vec::new();
    let mut part = |name: &str, time: Duration| parts.push((name.to_owned(), time.as_secs_f64()));

    let start = Instant::now();
    let case = example()?;
    part("read", start.elapsed());

    let watch = Watch::start();
    let hears = watch.clone();
    let builder = case.builder().progress(move |stage| hears.hear(stage));
    let mut mover = builder.build(Arc::clone(backend))?;
    let (total, of_stages) = watch.stop();
    part("set-up", total);
    of_stages.iter().for_each(|(stage, time)| part(&format!("  {stage}"), *time));

    // A mover's first update is slower: memory is touched for the first time. Designs after it cost
    // as the second one.
    mover.update(&case.design)?;
    let watch = Watch::start();
    let hears = watch.clone();
    mover.on_progress(move |stage| hears.hear(stage));
    let outcome = mover.update(&case.design)?;
    let (total, of_stages) = watch.stop();
    part("update", total);
    of_stages.iter().for_each(|(stage, time)| part(&format!("  {stage}"), *time));

    let folder = tempfile::tempdir()?;
    let moved = outcome.valid()?;
    let fields = Fields { displacement: Some(moved.displacement()), beta: Some(&outcome.beta), ..Fields::default() };
    for name in ["moved.msh", "moved.msh.gz", "moved.vtu"] {
        let start = Instant::now();
        case.file.write(&folder.path().join(name), moved.vertices(), &fields)?;
        part(&format!("write {name}"), start.elapsed());
    }
    Ok(parts)
}

/// Times the gaps between the names an observer hears; the last one ends where the watch is
/// stopped.
#[derive(Clone)]
struct Watch {
    start: Instant,
    heard: Arc<Mutex<Vec<(String, Instant)>>>,
}

impl Watch {
    fn start() -> Self {
        Self { start: Instant::now(), heard: Arc::default() }
    }

    fn hear(&self, stage: &str) {
        self.heard().push((stage.to_owned(), Instant::now()));
    }

    fn heard(&self) -> std::sync::MutexGuard<'_, Vec<(String, Instant)>> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The whole time, and each stage's.
    fn stop(self) -> (Duration, Vec<(String, Duration)>) {
        let end = Instant::now();
        let heard = std::mem::take(&mut *self.heard());
        let ends = heard.iter().skip(1).map(|(_, begin)| *begin).chain([end]);
        let stages = heard.iter().zip(ends).map(|((stage, begin), end)| (stage.clone(), end - *begin)).collect();
        (end - self.start, stages)
    }
}
