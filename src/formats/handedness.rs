//! Turns left-handed cells over: shapes of which every cell has a negative volume.
//!
//! A program with another order of vertices, or a mirrored mesh, makes all cells of a shape
//! left-handed. Some programs have another order for one shape alone, so each shape is judged
//! alone.
//!
//! Cells that their vertices turn inside out have negative volumes too, but they still fit their
//! neighbours: two neighbours run through the vertices of their common face in opposite directions.
//! Beside cells in another order both directions are the same. So the faces that a shape shares
//! with right-handed shapes tell the two cases apart.

use crate::mesh::{OtherCells, TetMesh, cell_faces};

/// Name of the tets among the shapes of cells.
const TETS: &str = "tets";

/// Turns over every shape whose cells are all left-handed because of their order of vertices.
/// Returns the names of these shapes.
pub(super) fn turn_over(mesh: &mut TetMesh, others: &mut OtherCells) -> Vec<&'static str> {
    let mut shapes = Vec::new();
    if !mesh.tets.is_empty() {
        shapes.push((TETS, mesh.is_left_handed()));
    }
    shapes.extend(others.handedness(&mesh.vertices));
    let names = |left| shapes.iter().filter(move |shape| shape.1 == left).map(|shape| shape.0);
    let mut open: Vec<_> = names(true).collect();
    // Faces of shapes whose right order is known.
    let mut known: Vec<Face> = match open.is_empty() {
        true => Vec::new(),
        false => names(false).flat_map(|shape| faces(mesh, others, shape)).collect(),
    };
    let mut inverted = Vec::new();
    let decide = |shape, known: &[Face]| is_in_other_order(faces(mesh, others, shape).collect(), known);
    while let Some((at, turns)) = open.iter().enumerate().find_map(|(at, shape)| Some((at, decide(shape, &known)?))) {
        let shape = open.remove(at);
        known.extend(faces(mesh, others, shape).map(|(vertices, direction)| (vertices, direction ^ turns)));
        inverted.extend((!turns).then_some(shape));
    }
    // Shapes that share no face with a known one are in another order too: there is no sign that
    // the vertices turned them inside out.
    let turned: Vec<_> = names(true).filter(|shape| !inverted.contains(shape)).collect();
    if turned.contains(&TETS) {
        mesh.turn_over();
    }
    others.turn_over(&turned);
    turned
}

/// A face of a cell: its vertices, ascending, and whether the cell runs from the lowest vertex to
/// the lower one of its two neighbours in the face. A triangle has [`u32::MAX`] as fourth vertex.
type Face = ([u32; 4], bool);

/// Whether cells are in another order of vertices than their neighbours: they run through their
/// common faces in the same direction. `None` if there are no common faces.
///
/// - `known`: faces of cells in their right order
fn is_in_other_order(mut faces: Vec<Face>, known: &[Face]) -> Option<bool> {
    faces.sort_unstable();
    let has = |face| faces.binary_search(&face).is_ok();
    if known.iter().any(|&(vertices, direction)| has((vertices, !direction))) {
        return Some(false);
    }
    known.iter().any(|&face| has(face)).then_some(true)
}

/// The faces of all cells of a shape.
fn faces<'a>(mesh: &'a TetMesh, others: &'a OtherCells, shape: &str) -> impl Iterator<Item = Face> + use<'a> {
    let (n_vertices, vertices) = match shape {
        TETS => (4, mesh.tets.as_flattened()),
        "pyramids" => (5, others.pyramids.as_flattened()),
        "prisms" => (6, others.prisms.as_flattened()),
        _ => (8, others.hexahedra.as_flattened()),
    };
    let cells = vertices.chunks_exact(n_vertices);
    cells.flat_map(move |cell| cell_faces(n_vertices).iter().map(move |places| face(cell, places)))
}

/// A face of a cell, given by places in the cell.
fn face(cell: &[u32], places: &[usize]) -> Face {
    let corner = |at: usize| cell[places[at % places.len()]];
    let lowest = (0..places.len()).min_by_key(|&at| corner(at)).unwrap_or(0);
    let direction = corner(lowest + 1) < corner(lowest + places.len() - 1);
    let mut vertices = [u32::MAX; 4];
    vertices.iter_mut().zip(0..places.len()).for_each(|(vertex, at)| *vertex = corner(at));
    vertices.sort_unstable();
    (vertices, direction)
}
