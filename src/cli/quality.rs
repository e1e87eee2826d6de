//! `idmesh quality` prints counts, beta and families of a mesh. The mesh may have other cells than
//! tets.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::console::Console;
use super::failure::Failure;
use super::json::{check_json, write_json};
use super::{JsonTarget, json_target, warn_of_families, warn_of_file};
use crate::formats;
use crate::mesh::{OtherCells, by_kind, check_size, measures};
use crate::quality::{Statistics, betas};
use crate::report::{self, Series, aligned, beta_text, histogram_svg, kind_table};
use crate::session::{check_distinct, check_writable, write_text};

/// Arguments of `idmesh quality`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The mesh file.
    mesh: PathBuf,
    /// Write the figures as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
    /// Write the distribution of beta as a picture.
    #[arg(long, value_name = "FILE.svg")]
    histogram: Option<PathBuf>,
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
    warn_of_families(&arguments.mesh, &file, console);
    let (mesh, others) = (&file.mesh, &file.others);
    console.step("measuring");
    let hybrid = file.cells();
    let corners = hybrid.cells().flatten().map(|&vertex| mesh.vertices[vertex as usize]);
    check_size(corners).map_err(|error| Failure::bad_input(error.to_string()).in_file(&arguments.mesh))?;
    let beta = betas(&mesh.vertices, &mesh.tets);
    let Statistics { min, max, mean, inverted } = Statistics::new(&beta);
    let kinds = (others.n_cells() > 0).then(|| by_kind(hybrid, &measures(hybrid, &mesh.vertices, None), false));
    let inverted = kinds.as_ref().map_or(inverted, |kinds| kinds.iter().map(|kind| kind.inverted).sum());
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
    };
    if let Some(path) = &arguments.histogram {
        let name = arguments.mesh.file_name().unwrap_or_default().to_string_lossy();
        let svg = histogram_svg(&format!("Quality of {name}"), &[Series { name: "mesh", beta: &beta }]);
        write_text(path, &svg)?;
    }
    if let Some(target) = &arguments.json {
        write_json(target, &figures, console)?;
    }
    if arguments.json != Some(JsonTarget::StandardOutput) {
        console.data(&text(&figures, &mesh.families, others))?;
    }
    Ok(())
}

/// The measures as text, with the families in the order of the file.
fn text(figures: &Figures, families: &[String], others: &OtherCells) -> String {
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
        text += &kind_table(&figures.cells);
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
    text + &aligned(&rows)
}
