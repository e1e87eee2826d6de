//! Which shape each cell has, from its faces.

use super::file::Faces;
use crate::formats::assembly::{Assembly, Shape};

/// Adds every cell; those of no known shape are counted as polyhedra. The error is a cell that there cannot be.
///
/// - `owner` `[n_faces]`: the cell that each face's normal points out of
/// - `neighbour` `[n_internal_faces]`: the cell it points into
pub(super) fn assemble(faces: &Faces, owner: &[i64], neighbour: &[i64], assembly: &mut Assembly) -> Result<(), i64> {
    // Every cell has a face, so no number reaches theirs.
    let sides = || {
        owner.iter().enumerate().map(|side| (side, true)).chain(neighbour.iter().enumerate().map(|side| (side, false)))
    };
    let mut n_cells = 0;
    for ((_, &cell), _) in sides() {
        match usize::try_from(cell) {
            Ok(index) if index < faces.len() => n_cells = n_cells.max(index + 1),
            _ => return Err(cell),
        }
    }
    let mut starts = vec![0; n_cells + 1];
    sides().for_each(|((_, &cell), _)| starts[cell as usize + 1] += 1);
    for cell in 0..n_cells {
        starts[cell + 1] += starts[cell];
    }
    let mut next = starts.clone();
    let mut sorted = vec![(0, false); starts[n_cells]];
    for ((face, &cell), outward) in sides() {
        let place = &mut next[cell as usize];
        sorted[*place] = (face, outward);
        *place += 1;
    }
    for cell in 0..n_cells {
        match recognise(faces, &sorted[starts[cell]..starts[cell + 1]]) {
            Some((shape, corners)) => {
                let mut corners = corners.into_iter();
                assembly.push(shape, 0, || Ok::<u32, i64>(corners.next().unwrap_or_default()))?;
            }
            None => assembly.refuse("polyhedra", 1),
        }
    }
    Ok(())
}

/// The shape and the corners of a cell, from its faces and whether their normals point out of it.
fn recognise(faces: &Faces, of_cell: &[(usize, bool)]) -> Option<(Shape, [u32; 8])> {
    let mut corners = [&[][..]; 6];
    let corners = corners.get_mut(..of_cell.len())?;
    corners.iter_mut().zip(of_cell).for_each(|(corners, &(face, _))| *corners = faces.corners(face));
    let n_of = |count: usize| corners.iter().filter(|face| face.len() == count).count();
    let (shape, base) = match (of_cell.len(), n_of(3), n_of(4)) {
        (4, 4, 0) => (Shape::Tet, 3),
        (5, 4, 1) => (Shape::Pyramid, 4),
        (5, 2, 3) => (Shape::Prism, 3),
        (6, 0, 6) => (Shape::Hexahedron, 4),
        _ => return None,
    };
    let base_face = corners.iter().position(|face| face.len() == base)?;
    let bottom = corners[base_face];
    let mut cell = [0; 8];
    cell[..base].copy_from_slice(bottom);
    // The base's normal points into the cell.
    if of_cell[base_face].1 {
        cell[..base].reverse();
    }
    // The end of the edge that leads away from the base.
    let over = |vertex: u32| {
        let others = corners.iter().enumerate().filter(|&(place, _)| place != base_face).map(|(_, face)| face);
        others.into_iter().find_map(|face| {
            let at = face.iter().position(|&corner| corner == vertex)?;
            let beside = [face[(at + 1) % face.len()], face[(at + face.len() - 1) % face.len()]];
            beside.into_iter().find(|corner| !bottom.contains(corner))
        })
    };
    for place in base..shape.n_vertices() {
        cell[place] = over(cell[place - base])?;
    }
    let all = &cell[..shape.n_vertices()];
    let distinct = (1..all.len()).all(|place| !all[..place].contains(&all[place]));
    let closed = corners.iter().all(|face| face.iter().all(|vertex| all.contains(vertex)));
    (distinct && closed).then_some((shape, cell))
}
