//! Many different designs through one mover, as in an optimisation: seconds of an update, and the
//! memory of the process.
//!
//! `cargo bench --bench designs -- [DESIGNS]`: 1000 designs of the example if not said, on the CPU.
//! `RAYON_NUM_THREADS` limits its threads. Memory is told by Linux alone.

mod common;

use std::{collections::BTreeMap, fs, process::ExitCode, time::Instant};

use common::{Failure, example, median, numbers, print_machine, print_table, row};
use glam::DVec3;
use idmesh::{
    backend::{self, Selection},
    mover::Design,
    profile::Profile,
    volume::Start,
};

/// Designs a line of the table is about.
const LINES: usize = 5;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let [designs] = numbers(&[1000])?[..] else { return Err("expected one number, of designs".into()) };
    let case = example()?;
    print_machine(&[backend::select(Selection::Cpu)?.info()]);
    let mut mover = case.mover(backend::select(Selection::Cpu)?)?;
    let mut rows = vec![row(&["designs", "start", "update ms", "volume's cycles", "memory MB"])];
    for (name, start) in [("undeformed mesh", Start::Undeformed), ("last design", Start::LastDesign)] {
        mover.start_from(start);
        let (mut seconds, mut cycles) = (Vec::new(), Vec::new());
        for at in 1..=designs {
            let design = varied(&case.design, at);
            let begin = Instant::now();
            let outcome = mover.update(&design)?;
            seconds.push(begin.elapsed().as_secs_f64());
            cycles.push(outcome.solver.sweeps as f64);
            if outcome.inverted > 0 || !outcome.converged {
                return Err(format!("design {at} did not come out well, so its times mean nothing").into());
            }
            drop(outcome);
            if at % designs.div_ceil(LINES) == 0 || at == designs {
                rows.push(vec![
                    at.to_string(),
                    name.to_owned(),
                    format!("{:.1}", 1e3 * median(std::mem::take(&mut seconds))),
                    median(std::mem::take(&mut cycles)).to_string(),
                    resident().map_or("?".to_owned(), |bytes| format!("{:.1}", bytes / 1e6)),
                ]);
            }
        }
    }
    print_table(&rows);
    Ok(())
}

/// The design, a little thicker and higher each time, the steps like those of an optimisation: a
/// hundredth of its own.
fn varied(design: &Design, at: usize) -> Design {
    let turn = 0.05 * at as f64;
    let vary = |profile: &Profile| {
        let points = profile.points.iter();
        let points = points.map(|p| *p + DVec3::Z * (2e-3 * p.y * turn.sin() + 1e-3 * p.x * (0.7 * turn).cos()));
        Profile { number: profile.number, points: points.collect() }
    };
    let profiles: BTreeMap<_, _> =
        design.profiles.iter().map(|(wing, profiles)| (wing.clone(), profiles.iter().map(vary).collect())).collect();
    Design { profiles, ..Design::default() }
}

/// Memory of this process that is in use, in bytes.
fn resident() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024.0 * line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()?)
}
