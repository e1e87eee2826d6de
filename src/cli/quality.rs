//! `idmesh quality` prints counts, beta and families of a mesh. The mesh may have other cells than
//! tets.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::console::Console;
use super::failure::{Exit, Failure};
use super::json::{check_json, write_json};
use super::{JsonTarget, json_target, warn_of_file, warn_of_mesh};
use crate::formats;
use crate::mesh::{HybridMesh, OtherCells, by_kind, check_size, measures};
use crate::quality::{Statistics, betas};
use crate::report::{
    self, Measured, Series, SolverQuality, aligned, beta_text, histogram_svg, kind_table, limits_by_name, solver_table,
};
use crate::session::{check_distinct, check_writable, write_text};
use crate::solver_measures::{Connections, Exceeded, Limits, SolverMeasures};
use crate::text::shown;

/// Arguments of `idmesh quality`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
beta of a tet is V / l_max^3, signed: 0.118 for the regular tet, negative for an
inverted one. The scaled Jacobian of a corner is the determinant of its three
edges, divided by the product of their lengths; that of a cell is its worst
corner's: 1 for a box, 0.707 for the regular tet.

The last table has the words of flow solvers: what OpenFOAM's checkMesh prints of
cells and faces, and SU2 of the dual volumes. --limits openfoam takes what checkMesh
fails at; other names of limits are in the documentation of the case file.")]
pub(super) struct Arguments {
    /// The mesh file.
    mesh: PathBuf,
    /// Write the figures as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
    /// Write the distribution of beta as a picture; of the scaled Jacobian if no cell is a tet.
    #[arg(long, value_name = "FILE.svg")]
    histogram: Option<PathBuf>,
    /// Exit with 5 if a measure is beyond its limit: `openfoam`, or values such as
    /// `skewness=4,non_orthogonality=80`.
    #[arg(long, value_name = "LIMITS", value_parser = limits)]
    limits: Option<Limits>,
}

/// Reads the limits of the command line.
fn limits(text: &str) -> Result<Limits, String> {
    let mut limits = Limits::default();
    for part in text.split(',') {
        match part.split_once('=') {
            None if part.trim() == "openfoam" => limits = Limits::openfoam(),
            None => return Err(format!("`{part}` is no limit, expected `openfoam` or NAME=VALUE, joined by commas")),
            Some((name, value)) => {
                let number = value.trim().parse().map_err(|_| format!("`{value}` is no number"))?;
                limits.set(name.trim(), number).map_err(|error| error.to_string())?;
            }
        }
    }
    Ok(limits)
}

/// The measures of a mesh. Their names are those of a run report.
#[derive(Debug, Serialize)]
struct Figures {
    idmesh: String,
    file: String,
    mesh: report::Mesh,
    /// Number of cells of each other shape, and of quadrilaterals. The measures of beta are those
    /// of the tets.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    others: BTreeMap<&'static str, usize>,
    /// Shapes of cells that are all left-handed in the file. They are measured turned over.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    left_handed: Vec<&'static str>,
    beta_min: f64,
    beta_max: f64,
    beta_mean: f64,
    /// Number of inverted cells.
    inverted: usize,
    /// Quality of each kind of cell. Left out of a mesh of tets.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    cells: BTreeMap<&'static str, report::Kind>,
    /// The mesh in the words of flow solvers. `None` if its cells do not fit together.
    solver_quality: Option<SolverQuality>,
    /// Why there is no `solver_quality`.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_measured: Option<String>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    check_json(arguments.json.as_ref(), console)?;
    let mut written = Vec::new();
    if let Some(path) = &arguments.histogram {
        check_writable(path)?;
        written.push(path.as_path());
    }
    if let Some(JsonTarget::File(path)) = &arguments.json {
        written.push(path);
    }
    check_distinct(std::slice::from_ref(&arguments.mesh), &written)?;

    console.step(&format!("reading {}", arguments.mesh.display()));
    let file = formats::read_mixed(&arguments.mesh)?;
    warn_of_file(&arguments.mesh, &file, console);
    warn_of_mesh(&arguments.mesh, &file, console);
    let (mesh, others) = (&file.mesh, &file.others);
    console.step("measuring");
    let hybrid = file.cells();
    let corners = hybrid.cells().flatten().map(|&vertex| mesh.vertices[vertex as usize]);
    check_size(corners).map_err(|error| Failure::bad_input(error.to_string()).in_file(&arguments.mesh))?;
    let beta = betas(&mesh.vertices, &mesh.tets);
    let Statistics { min, max, mean, inverted } = Statistics::new(&beta);
    let measures = (others.n_cells() > 0).then(|| measures(hybrid, &mesh.vertices, None));
    let kinds = measures.as_ref().map(|measures| by_kind(hybrid, measures, false));
    let inverted = kinds.as_ref().map_or(inverted, |kinds| kinds.iter().map(|kind| kind.inverted).sum());
    let limits = arguments.limits.unwrap_or_default();
    let connections = Connections::new(hybrid);
    let solver = connections.map(|of| SolverMeasures::of(&of, &mesh.vertices, &limits));
    let figures = Figures {
        idmesh: env!("CARGO_PKG_VERSION").to_owned(),
        file: arguments.mesh.display().to_string(),
        mesh: report::Mesh::of(hybrid),
        others: others.counts().collect(),
        left_handed: file.left_handed.clone(),
        beta_min: min,
        beta_max: max,
        beta_mean: mean,
        inverted,
        cells: kinds.as_deref().map(report::by_kind).unwrap_or_default(),
        solver_quality: solver.as_ref().ok().map(SolverQuality::from),
        not_measured: solver.as_ref().err().map(ToString::to_string),
    };
    // Standard output first: where it is full, no file is written.
    if arguments.json != Some(JsonTarget::StandardOutput) {
        console.data(&text(&figures, &mesh.families, others, &limits))?;
    }
    if let Some(target) = &arguments.json {
        write_json(target, &figures, console)?;
    }
    if let Some(path) = &arguments.histogram {
        let name = arguments.mesh.file_name().unwrap_or_default().to_string_lossy();
        let title = format!("Quality of {name}{}", report::share_of_tets(hybrid));
        let jacobians: Vec<f64>;
        let (measured, values) = match mesh.tets.len() {
            0 => {
                jacobians = measures.iter().flatten().map(|cell| cell.jacobian).collect();
                (Measured::ScaledJacobian, &jacobians)
            }
            _ => (Measured::Beta, &beta),
        };
        let svg = histogram_svg(measured, &title, &[Series { name: "mesh", values }]);
        write_text(path, &svg)?;
    }
    match solver {
        _ if limits.is_empty() => Ok(()),
        Err(error) => Err(Failure::bad_input(error.to_string()).in_file(&arguments.mesh)),
        Ok(measures) => match &limits.exceeded(&measures)[..] {
            [] => Ok(()),
            exceeded => Err(beyond_limits(hybrid, exceeded).in_file(&arguments.mesh)),
        },
    }
}

/// The failure of a mesh with measures beyond their limits.
fn beyond_limits(mesh: HybridMesh, exceeded: &[Exceeded]) -> Failure {
    let mut lines: Vec<String> = exceeded.iter().map(|exceeded| exceeded.text(mesh, mesh.vertices())).collect();
    match lines.len() {
        1 => Failure::new(Exit::Inverted, lines.remove(0)),
        _ => Failure { lines, ..Failure::new(Exit::Inverted, "measures are beyond their limits:") },
    }
}

/// The measures as text, with the families in the order of the file.
fn text(figures: &Figures, families: &[String], others: &OtherCells, limits: &Limits) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![row("vertices", figures.mesh.vertices.to_string()), row("tets", figures.mesh.tets.to_string())];
    rows.extend(others.counts().map(|(name, count)| row(name, count.to_string())));
    if !figures.left_handed.is_empty() {
        rows.push(row("left-handed in the file", figures.left_handed.join(", ")));
    }
    rows.extend([
        row("inverted", figures.inverted.to_string()),
        row("beta min", beta_text(figures.beta_min, 6)),
        row("beta max", beta_text(figures.beta_max, 6)),
        row("beta mean", beta_text(figures.beta_mean, 7)),
    ]);
    let mut text = aligned(&rows);
    if !figures.cells.is_empty() {
        text.push('\n');
        text += &kind_table(&figures.cells, None);
    }
    let mut rows = vec![["family", "vertices", "triangles"].map(str::to_owned).to_vec()];
    if !others.quadrilaterals.is_empty() {
        rows[0].push("quadrilaterals".to_owned());
    }
    for (index, name) in families.iter().enumerate() {
        let size = figures.mesh.families.get(name).copied().unwrap_or_default();
        let mut row = vec![name.clone(), size.vertices.to_string(), size.triangles.to_string()];
        if !others.quadrilaterals.is_empty() {
            row.push(others.quadrilateral_family.iter().filter(|family| family.index() == index).count().to_string());
        }
        rows.push(row);
    }
    text.push('\n');
    text += &aligned(&rows);
    let solver = match (&figures.solver_quality, &figures.not_measured) {
        (Some(quality), _) => solver_table(&["value"], &[quality], &limits_by_name(limits), false),
        (None, why) => format!("not measured in the words of solvers: {}\n", shown(why.as_deref().unwrap_or_default())),
    };
    text + "\n" + &solver
}
