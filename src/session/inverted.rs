//! The file with the faulty cells of a moved mesh that is not valid.

use std::path::Path;

use glam::DVec3;

use super::SessionError;
use super::files::cannot_write;
use super::names::inverted_name;
use crate::formats::{Cells, Fields, FileSet, vtu_bytes};
use crate::mesh::{CellKind, CellMeasures, CellName, HybridMesh, OtherCells};
use crate::mover::Outcome;
use crate::quality::faults;

/// Adds the faulty cells to a set of files as `NAME.inverted.vtu`, in the folder of an output.
///
/// The file holds the inverted cells, the cells around them, and each tet's `beta`, which is not
/// positive in inverted tets. In a mesh with other cells the file also holds the `scaled_jacobian`
/// of each cell, which is not positive in inverted cells. Without inverted cells the file holds the
/// cells at self-intersecting faces, and the worst cells of measures beyond their limits.
///
/// # Errors
/// The file cannot be written.
pub(super) fn add_inverted(files: &mut FileSet, output: &Path, outcome: &Outcome) -> Result<(), SessionError> {
    let path = inverted_name(output);
    let moved = outcome.even_if_invalid();
    let mesh = HybridMesh { mesh: outcome.mesh(), others: outcome.other_cells() };
    let measures = outcome.cell_measures.as_ref();
    let mut near = vec![false; moved.vertices().len()];
    let mut mark = |vertices: &[u32]| vertices.iter().for_each(|&vertex| near[vertex as usize] = true);
    if outcome.inverted > 0 {
        let is_bad = |cell: usize| match measures {
            Some(measures) => measures[cell].inverted,
            None => faults::is_inverted(outcome.beta[cell]),
        };
        (0..mesh.n_cells()).filter(|&cell| is_bad(cell)).for_each(|cell| mark(mesh.cell(mesh.name(cell))));
    } else {
        outcome.self_intersecting.iter().for_each(|&face| mark(mesh.face_vertices(face)));
        for exceeded in outcome.exceeded() {
            match exceeded.place {
                Some(vertex) if exceeded.row.at_vertices => mark(&[vertex]),
                Some(cell) => mark(mesh.cell(mesh.name(cell as usize))),
                None => {}
            }
        }
    }
    let touches = |cell: &usize| mesh.cell(mesh.name(*cell)).iter().any(|&vertex| near[vertex as usize]);
    let shown: Vec<usize> = (0..mesh.n_cells()).filter(touches).collect();
    // The file holds only the vertices of these cells, with new numbers.
    let mut used: Vec<u32> = shown.iter().flat_map(|&cell| mesh.cell(mesh.name(cell))).copied().collect();
    used.sort_unstable();
    used.dedup();
    let number = |vertex: u32| used.partition_point(|&other| other < vertex) as u32;
    let pick = |of: &[DVec3]| used.iter().map(|&vertex| of[vertex as usize]).collect::<Vec<_>>();
    let mut tets = Vec::new();
    let mut others = OtherCells::none();
    for &cell in &shown {
        let CellName { kind, index } = mesh.name(cell);
        match kind {
            CellKind::Tet => tets.push(mesh.mesh.tets[index].map(number)),
            CellKind::Pyramid => others.pyramids.push(mesh.others.pyramids[index].map(number)),
            CellKind::Prism => others.prisms.push(mesh.others.prisms[index].map(number)),
            CellKind::Hexahedron => others.hexahedra.push(mesh.others.hexahedra[index].map(number)),
        }
    }
    let measures = measures.map(|of| shown.iter().map(|&cell| of[cell]).collect::<Vec<CellMeasures>>());
    let beta: Vec<f64> = shown.iter().filter_map(|&cell| outcome.beta.get(cell).copied()).collect();
    let displacement = pick(moved.displacement());
    let fields = Fields { displacement: Some(&displacement), beta: Some(&beta), measures: measures.as_deref() };
    let cells = Cells { tets: &tets, triangles: &[], triangle_family: &[], families: &[] };
    let bytes = vtu_bytes(&pick(moved.vertices()), &cells, &others, &fields)?;
    files.add(&path, move |out| out.write_all(&bytes)).map_err(|error| cannot_write(&path, error))
}
