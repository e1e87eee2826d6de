//! How far one call of `Mover::update` carries a body through its mesh, from small motions to
//! absurd ones.
//!
//! `cargo bench --bench robustness -- [MESH FAMILY | CASE] [--svg FOLDER]`: the body is the family
//! FAMILY of MESH, every vertex of it prescribed and every other family fixed; or the wing of CASE,
//! moved by its profiles. If none is said, first the wing of `tests/data/pitch-wing.msh.gz`, then
//! that of `examples/wing-body/case.toml`, then those of `cases`, with a nacelle and with fairings.
//! Each motion starts from the original mesh and is made once for each target of local
//! optimisation. The charts go to FOLDER, or to `target`.

mod bodies;
mod chart;
#[path = "../common/mod.rs"]
mod common;
mod prescribed;
mod runs;
mod sections;

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use bodies::{Body, Kind};
use common::{Failure, print_machine, print_table, row};
use idmesh::{
    backend::{self, Selection},
    mesh::{CellKind, CellMeasures, HybridMesh, measures},
    quality::{Statistics, betas},
};
use runs::{Run, TARGETS};

struct Arguments {
    /// A file each, with the family that moves, or a case.
    bodies: Vec<(PathBuf, Option<String>)>,
    charts: PathBuf,
}

fn arguments() -> Result<Arguments, Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut charts = root.join("target");
    let mut others = Vec::new();
    let mut given = std::env::args().skip(1).filter(|argument| argument != "--bench");
    while let Some(argument) = given.next() {
        match argument.as_str() {
            "--svg" => charts = given.next().ok_or("--svg needs a folder")?.into(),
            option if option.starts_with('-') => return Err(format!("unknown option `{option}`").into()),
            _ => others.push(argument),
        }
    }
    let bodies = match &others[..] {
        [] => vec![
            (root.join("tests/data/pitch-wing.msh.gz"), Some("wing".to_owned())),
            (root.join("examples/wing-body/case.toml"), None),
            (root.join("benches/robustness/cases/nacelle.toml"), None),
            (root.join("benches/robustness/cases/fairings.toml"), None),
        ],
        [case] => vec![(case.into(), None)],
        [mesh, family] => vec![(mesh.into(), Some(family.clone()))],
        _ => return Err("expected a mesh and a family, a case, or nothing".into()),
    };
    Ok(Arguments { bodies, charts })
}

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let Arguments { bodies, charts } = arguments()?;
    print_machine(&[backend::select(Selection::Cpu)?.info()]);
    for (path, family) in bodies {
        let body = body(&path, family.as_deref())?;
        let name = name(&path)?;
        let mesh = body.mesh();
        let measure = if mesh.others.n_cells() > 0 { JACOBIAN } else { BETA };
        let original = Statistics::new(&if measure == BETA {
            betas(&mesh.mesh.vertices, &mesh.mesh.tets)
        } else {
            jacobians(&measures(mesh, &mesh.mesh.vertices, None))
        });
        println!(
            "{name}: {}, worst {measure} {:.6}, mean {measure} {:.6}; {}; springs `{}`\n",
            cells(mesh),
            original.min,
            original.mean,
            body.title(),
            body.springs().name
        );
        let mut runs = Vec::new();
        for target in 0..TARGETS.len() {
            move_all(body.as_ref(), target, &mut runs)?;
        }
        // By motion, then by target: the sort keeps the amounts of a kind in order.
        runs.sort_by(|a, b| (a.kind, a.amount).partial_cmp(&(b.kind, b.amount)).expect("amounts are numbers"));
        print_runs(body.kinds(), measure, &runs);
        fs::create_dir_all(&charts)?;
        let svg = charts.join(format!("robustness-{name}.svg"));
        fs::write(&svg, chart::chart(body.kinds(), measure, &runs, original.min))?;
        eprintln!("chart: {}", svg.display());
    }
    Ok(())
}

/// The measure of meshes of tets.
const BETA: &str = "beta";

/// The measure of meshes with other cells: the scaled Jacobian of the worst corner of a cell.
const JACOBIAN: &str = "jacobian";

fn jacobians(of_cells: &[CellMeasures]) -> Vec<f64> {
    of_cells.iter().map(|cell| cell.jacobian).collect()
}

/// The number of cells of each kind.
fn cells(mesh: HybridMesh) -> String {
    let counts = CellKind::ALL.map(|kind| (mesh.count(kind), kind.plural()));
    let some: Vec<String> =
        counts.into_iter().filter(|&(count, _)| count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
    some.join(", ")
}

/// The body that the file names: a case, or a mesh of which the family of that name moves.
fn body(path: &Path, family: Option<&str>) -> Result<Box<dyn Body>, Failure> {
    Ok(match family {
        Some(family) => Box::new(prescribed::Prescribed::read(path, family)?),
        None => Box::new(sections::Sections::read(path)?),
    })
}

/// What to call a body: its mesh or case without extensions, or the folder of a `case.toml`.
fn name(path: &Path) -> Result<String, Failure> {
    let path = path.canonicalize()?;
    let is_example = path.ends_with("case.toml");
    let of = if is_example { path.parent() } else { Some(&*path) };
    let file = of.and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    Ok(file.split('.').next().unwrap_or_default().to_owned())
}

/// Makes every motion with one target.
fn move_all(body: &dyn Body, target: usize, runs: &mut Vec<Run>) -> Result<(), Failure> {
    let (name, quality) = TARGETS[target];
    let begin = Instant::now();
    let backend = backend::select(Selection::Cpu)?;
    let mut mover = body.builder().quality(quality).build(backend)?;
    eprintln!("target {name}: set-up {:.2} s", begin.elapsed().as_secs_f64());
    for (kind, Kind { name: motion, unit, amounts }) in body.kinds().iter().enumerate() {
        for &amount in *amounts {
            let design = body.design(&mover, kind, amount);
            let begin = Instant::now();
            let outcome = mover.update(&design)?;
            let seconds = begin.elapsed().as_secs_f64();
            let of_cells = outcome.cell_measures.as_deref().map(jacobians);
            let Statistics { min: worst, mean, .. } = Statistics::new(of_cells.as_ref().unwrap_or(&outcome.beta));
            eprintln!(
                "{motion} {amount} {unit}, {name}: {} inverted, worst {worst:.6}, {seconds:.2} s",
                outcome.inverted
            );
            if !outcome.converged {
                eprintln!("  not converged: {:?}", outcome.unconverged);
            }
            let (folded, self_intersecting) = (outcome.folded.values().sum(), outcome.self_intersecting.len());
            let inverted = outcome.inverted;
            runs.push(Run { kind, amount, target, inverted, folded, self_intersecting, worst, mean, seconds });
        }
    }
    Ok(())
}

fn print_runs(kinds: &[Kind], measure: &str, runs: &[Run]) {
    let (worst, mean) = (format!("worst {measure}"), format!("mean {measure}"));
    let head = ["motion", "target", "inverted", "folded", "self_intersecting", &worst, &mean, "seconds"];
    let mut rows = vec![row(&head)];
    rows.extend(runs.iter().map(|run| {
        let Kind { name, unit, .. } = kinds[run.kind];
        vec![
            format!("{name} {} {unit}", run.amount),
            TARGETS[run.target].0.to_owned(),
            run.inverted.to_string(),
            run.folded.to_string(),
            run.self_intersecting.to_string(),
            format!("{:.6}", run.worst),
            format!("{:.6}", run.mean),
            format!("{:.2}", run.seconds),
        ]
    }));
    print_table(&rows);
    println!();
}
