//! The table of the stages, as in the paper's Table 1.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Kind, Mesh};
use crate::mover::{StageName, StageQuality};
use crate::text::cell;

/// The stages as aligned columns: a header line, then one line per stage.
pub fn stage_table(stages: &[StageQuality]) -> String {
    let mut rows =
        vec![["stage", "beta min", "beta max", "beta mean", "inverted", "seconds"].map(str::to_owned).to_vec()];
    for stage in stages {
        let name = match stage.name {
            StageName::Original => "Original",
            StageName::Deformed => "Deformed",
            StageName::Corrected => "Corrected",
            StageName::Final => "Final",
        };
        rows.push(vec![
            name.to_owned(),
            beta_text(stage.beta_min, 6),
            beta_text(stage.beta_max, 6),
            beta_text(stage.beta_mean, 7),
            stage.inverted.to_string(),
            format!("{:.3}", stage.seconds),
        ]);
    }
    aligned(&rows)
}

/// What the columns of [`stage_table`] count in a mesh with other cells than tets. Empty for a mesh
/// of tets.
pub fn stage_remark(mesh: &Mesh) -> String {
    let n_cells = mesh.n_cells();
    match mesh.tets {
        tets if tets == n_cells => String::new(),
        0 => format!("no cell is a tet, so there is no beta; inverted counts all {n_cells} cells\n"),
        tets => format!("beta is that of the {tets} tets; inverted counts all {n_cells} cells\n"),
    }
}

/// The kinds of cells as aligned columns: a header line, then one line per kind.
///
/// - `original`: the kinds of the original mesh, if the mesh was moved. Then each kind has two
///   lines.
pub fn kind_table(kinds: &BTreeMap<&'static str, Kind>, original: Option<&BTreeMap<&'static str, Kind>>) -> String {
    let has_shape = kinds.values().any(|kind| kind.shape_min.is_some());
    let mut header = ["cells", "count", "inverted", "jacobian min", "jacobian mean"].map(str::to_owned).to_vec();
    header.extend(has_shape.then(|| "shape min".to_owned()));
    let mut rows = vec![header];
    let row = |name: String, kind: &Kind| {
        let mut row = vec![
            name,
            kind.count.to_string(),
            kind.inverted.to_string(),
            beta_text(kind.jacobian_min, 4),
            beta_text(kind.jacobian_mean, 4),
        ];
        row.extend(kind.shape_min.map(|shape| beta_text(shape, 4)));
        row
    };
    for (name, kind) in kinds {
        match original.and_then(|original| original.get(name)) {
            None => rows.push(row((*name).to_owned(), kind)),
            Some(before) => {
                rows.push(row(format!("{name}, original"), before));
                rows.push(row(format!("{name}, final"), kind));
            }
        }
    }
    aligned(&rows)
}

/// Beta, or another measure, with the paper's number of decimals, or in powers of ten where the
/// decimals would leave few digits (boundary layers).
pub(crate) fn beta_text(beta: f64, decimals: usize) -> String {
    if beta.is_nan() {
        return "-".to_owned();
    }
    if beta != 0.0 && beta.abs() < 1e-3 { format!("{beta:.3e}") } else { format!("{beta:.decimals$}") }
}

/// Rows as aligned lines: the first column to the left, the others to the right, two spaces between
/// columns. Long cells are cut; see [`cell`].
pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|text| cell(text)).collect()).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width: Vec<usize> = (0..columns)
        .map(|column| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in &rows {
        let mut line = String::new();
        for (column, (cell, width)) in row.iter().zip(&width).enumerate() {
            // Writing to a string cannot fail.
            let _ = match column {
                0 => write!(line, "{cell:<width$}"),
                _ => write!(line, "  {cell:>width$}"),
            };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
