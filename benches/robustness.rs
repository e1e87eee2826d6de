//! How far one call of `Mover::update` carries a body through its mesh: pitch, heave and bending from small to absurd.
//!
//! `cargo bench --bench robustness -- [MESH FAMILY] [--svg FILE]`: the body is the family FAMILY of MESH, prescribed; every
//! other family is fixed. If not said, the wing of `tests/data/pitch-wing.msh.gz`. Each motion starts from the original mesh
//! and is made with the default springs, once for each target of local optimisation. The chart goes to FILE, or to
//! `target/robustness.svg`.

mod common;

use std::{
    collections::BTreeMap,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use common::{Failure, print_machine, print_table, row};
use glam::DVec3;
use idmesh::{
    backend::{self, Selection},
    formats,
    mesh::{FamilyId, TetMesh},
    mover::{Design, Mover, Settings},
    quality::{Statistics, betas},
    relaxation::{Accuracy, Method},
    smoothing::Target,
    springs::Springs,
    stages::{Role, interior::MAX_STEPS},
};

/// The targets of local optimisation, as a case calls them.
const TARGETS: [(&str, Option<Target>); 3] =
    [("off", None), ("original", Some(Target::Original)), ("improve", Some(Target::Improve))];

/// One kind of motion, from small to absurd.
struct Kind {
    name: &'static str,
    unit: &'static str,
    amounts: &'static [f64],
    /// Displacement of a point.
    moves: fn(&Body, DVec3, f64) -> DVec3,
}

const KINDS: [Kind; 3] = [
    Kind {
        name: "pitch",
        unit: "degrees",
        amounts: &[10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 180.0],
        moves: |body, at, degrees| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (x, z) = (at.x - body.pivot.x, at.z - body.pivot.z);
            let turned = DVec3::new(x * cos + z * sin - x, 0.0, -x * sin + z * cos - z);
            turned + body.bend(at, 0.2)
        },
    },
    Kind {
        name: "heave",
        unit: "chords",
        amounts: &[0.5, 1.0, 2.0, 3.0],
        moves: |body, _, chords| DVec3::Z * (chords * body.chord),
    },
    Kind {
        name: "bending",
        unit: "chords",
        amounts: &[0.25, 0.5, 1.0, 2.0],
        moves: |body, at, chords| body.bend(at, chords),
    },
];

/// The body that moves. Its chord is along x, its span along y.
struct Body {
    chord: f64,
    /// On the quarter chord, at mid-span and half the height.
    pivot: DVec3,
    half_span: f64,
}

impl Body {
    fn new(points: &[DVec3]) -> Result<Self, Failure> {
        let low = points.iter().copied().reduce(DVec3::min).ok_or("the body has no vertices")?;
        let high = points.iter().copied().reduce(DVec3::max).ok_or("the body has no vertices")?;
        let (size, middle) = (high - low, (low + high) / 2.0);
        if size.x <= 0.0 || size.y <= 0.0 {
            return Err("the body has no chord along x or no span along y".into());
        }
        Ok(Self { chord: size.x, pivot: middle.with_x(low.x + size.x / 4.0), half_span: size.y / 2.0 })
    }

    /// A parabola along the span that lifts the tips by so many chords.
    fn bend(&self, at: DVec3, chords: f64) -> DVec3 {
        DVec3::Z * (chords * self.chord * ((at.y - self.pivot.y) / self.half_span).powi(2))
    }
}

/// What one motion came to.
struct Run {
    kind: usize,
    amount: f64,
    target: usize,
    inverted: usize,
    worst: f64,
    mean: f64,
    seconds: f64,
}

struct Arguments {
    mesh: PathBuf,
    family: String,
    svg: PathBuf,
}

fn arguments() -> Result<Arguments, Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut svg = root.join("target/robustness.svg");
    let mut others = Vec::new();
    let mut given = std::env::args().skip(1).filter(|argument| argument != "--bench");
    while let Some(argument) = given.next() {
        match argument.as_str() {
            "--svg" => svg = given.next().ok_or("--svg needs a file")?.into(),
            option if option.starts_with('-') => return Err(format!("unknown option `{option}`").into()),
            _ => others.push(argument),
        }
    }
    let (mesh, family) = match &others[..] {
        [] => (root.join("tests/data/pitch-wing.msh.gz"), "wing".to_owned()),
        [mesh, family] => (mesh.into(), family.clone()),
        _ => return Err("expected a mesh and a family, or neither".into()),
    };
    Ok(Arguments { mesh, family, svg })
}

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let Arguments { mesh: path, family, svg } = arguments()?;
    let mesh = formats::read(&path)?.mesh;
    let moving = mesh.family(&family).ok_or_else(|| format!("{}: no family `{family}`", path.display()))?;
    let original = Statistics::new(&betas(&mesh.vertices, &mesh.tets));
    print_machine(&[backend::select(Selection::Cpu)?.info()]);
    println!(
        "{}: {} tets, worst beta {:.6}, mean beta {:.6}; body `{family}`; springs `{}`\n",
        path.file_name().unwrap_or_default().display(),
        mesh.tets.len(),
        original.min,
        original.mean,
        <&Springs>::default().name
    );

    let mut runs = Vec::new();
    for target in 0..TARGETS.len() {
        move_all(&mesh, moving, target, &mut runs)?;
    }
    // By motion, then by target: the sort keeps the amounts of a kind in order.
    runs.sort_by(|a, b| (a.kind, a.amount).partial_cmp(&(b.kind, b.amount)).expect("amounts are numbers"));

    let mut rows = vec![row(&["motion", "target", "inverted", "worst beta", "mean beta", "seconds"])];
    rows.extend(runs.iter().map(|run| {
        let Kind { name, unit, .. } = KINDS[run.kind];
        vec![
            format!("{name} {} {unit}", run.amount),
            TARGETS[run.target].0.to_owned(),
            run.inverted.to_string(),
            format!("{:.6}", run.worst),
            format!("{:.6}", run.mean),
            format!("{:.2}", run.seconds),
        ]
    }));
    print_table(&rows);
    if let Some(folder) = svg.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(&svg, chart(&runs, original.min)?)?;
    eprintln!("chart: {}", svg.display());
    Ok(())
}

/// Makes every motion with one target.
fn move_all(mesh: &TetMesh, moving: FamilyId, target: usize, runs: &mut Vec<Run>) -> Result<(), Failure> {
    let (name, quality) = TARGETS[target];
    let mut roles = vec![Role::Fixed; mesh.families.len()];
    roles[moving.index()] = Role::Prescribed;
    let settings = Settings {
        roles,
        old_profiles: BTreeMap::new(),
        springs: <&Springs>::default(),
        method: Method::Chebyshev,
        accuracy: Accuracy::default(),
        quality,
        max_steps: MAX_STEPS,
    };
    let begin = Instant::now();
    let mut mover = Mover::new(mesh.clone(), settings, backend::select(Selection::Cpu)?.into(), &|_| {})?;
    eprintln!("target {name}: set-up {:.2} s", begin.elapsed().as_secs_f64());
    let points: Vec<DVec3> =
        mover.family_vertices(moving).iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
    let body = Body::new(&points)?;
    for (kind, Kind { name: motion, unit, amounts, moves }) in KINDS.iter().enumerate() {
        for &amount in *amounts {
            let moved = points.iter().map(|&at| moves(&body, at, amount)).collect();
            let design = Design { prescribed: BTreeMap::from([(moving, moved)]), ..Design::default() };
            let begin = Instant::now();
            let outcome = mover.update(&design, &|_| {})?;
            let seconds = begin.elapsed().as_secs_f64();
            let Statistics { min: worst, mean, .. } = Statistics::new(&outcome.beta);
            eprintln!(
                "{motion} {amount} {unit}, {name}: {} inverted, worst {worst:.6}, {seconds:.2} s",
                outcome.inverted
            );
            if !outcome.converged {
                eprintln!("  not converged: {:?}", outcome.unconverged);
            }
            runs.push(Run { kind, amount, target, inverted: outcome.inverted, worst, mean, seconds });
        }
    }
    Ok(())
}

const PANEL: f64 = 300.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 76.0;
const GAP: f64 = 36.0;
const TOP: f64 = 64.0;
const BOTTOM: f64 = 60.0;
/// Colours that stay apart for colour-blind readers and in print (Okabe and Ito).
const COLOURS: [&str; TARGETS.len()] = ["#0072b2", "#d55e00", "#009e73"];

/// Worst beta against the motion, a panel for each kind. Inverted tets go far below zero: what is beyond the scale stands
/// at its lower end.
fn chart(runs: &[Run], original: f64) -> Result<String, std::fmt::Error> {
    let highest = runs.iter().map(|run| run.worst).fold(original, f64::max);
    let step = step(highest / 5.0);
    let top = (highest / step).ceil() * step;
    let bottom = -(0.4 * top / step).ceil() * step;
    let y = |beta: f64| TOP + (top - beta.max(bottom)) / (top - bottom) * (HEIGHT - TOP - BOTTOM);
    let width = LEFT + KINDS.len() as f64 * (PANEL + GAP);

    let mut svg = String::new();
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{HEIGHT}\" viewBox=\"0 0 {width} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">"
    )?;
    writeln!(
        svg,
        "<title>Worst beta against the motion</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>"
    )?;
    writeln!(
        svg,
        "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">worst beta (below {bottom:.3}: drawn \
         there)</text>",
        (TOP + HEIGHT - BOTTOM) / 2.0
    )?;
    let entries = TARGETS.iter().zip(COLOURS).map(|((name, _), colour)| (format!("target {name}"), colour, "none"));
    for (at, (text, colour, dashes)) in entries.chain([("original mesh".to_owned(), "#666", "6 4")]).enumerate() {
        let x = LEFT + 150.0 * at as f64;
        writeln!(
            svg,
            "<line x1=\"{x}\" y1=\"24\" x2=\"{}\" y2=\"24\" stroke=\"{colour}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dashes}\"/>\n<text x=\"{}\" y=\"28.5\">{text}</text>",
            x + 28.0,
            x + 35.0
        )?;
    }
    for (kind, Kind { name, unit, amounts, .. }) in KINDS.iter().enumerate() {
        let left = LEFT + kind as f64 * (PANEL + GAP);
        let (right, floor) = (left + PANEL, HEIGHT - BOTTOM);
        let x = |amount: f64| left + amount / amounts[amounts.len() - 1] * PANEL;
        for line in (bottom / step).round() as i64..=(top / step).round() as i64 {
            let (beta, stroke) = (line as f64 * step, if line == 0 { "#222" } else { "#ddd" });
            let y = y(beta);
            writeln!(svg, "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"{stroke}\"/>")?;
            if kind == 0 {
                writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{beta:.3}</text>", left - 8.0, y + 4.5)?;
            }
        }
        let mut labelled = left - 24.0;
        for &amount in *amounts {
            let x = x(amount);
            writeln!(svg, "<line x1=\"{x:.1}\" y1=\"{floor}\" x2=\"{x:.1}\" y2=\"{}\" stroke=\"#222\"/>", floor + 5.0)?;
            // Where amounts stand too close together only some have a label.
            if x >= labelled + 24.0 {
                labelled = x;
                writeln!(svg, "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{amount}</text>", floor + 20.0)?;
            }
        }
        let middle = (left + right) / 2.0;
        writeln!(svg, "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{name}, {unit}</text>", floor + 42.0)?;
        let y0 = y(original);
        writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{y0:.1}\" x2=\"{right}\" y2=\"{y0:.1}\" stroke=\"#666\" stroke-width=\"2\" \
             stroke-dasharray=\"6 4\"/>"
        )?;
        for (target, colour) in COLOURS.iter().enumerate() {
            let of_line = runs.iter().filter(|run| run.kind == kind && run.target == target);
            let points: Vec<(f64, f64)> = of_line.map(|run| (x(run.amount), y(run.worst))).collect();
            let line: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                line.join(" ")
            )?;
            for (x, y) in points {
                writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>")?;
            }
        }
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// The next 1, 2 or 5 times a power of ten.
fn step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|&step| step >= least).unwrap_or(power)
}
