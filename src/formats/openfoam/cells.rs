//! Recognises the shape of each cell by its faces.

use std::convert::Infallible;

use rayon::prelude::*;

use super::lists::{Faces, Label};
use crate::formats::mesh_builder::{CellKind, MeshBuilder};
use crate::mesh::csr::Csr;

/// Adds every cell. Cells of an unknown shape are counted as polyhedra.
///
/// - `owner` `[n_faces]`: the cell that each face's normal points out of
/// - `neighbour` `[n_internal_faces]`: the cell that the normal points into
pub(super) fn assemble(faces: &Faces, owner: &[Label], neighbour: &[Label], mesh_builder: &mut MeshBuilder) {
    if let Some(tets) = tets(faces, owner, neighbour) {
        mesh_builder.tets = tets;
        return;
    }
    let last = owner.iter().chain(neighbour).map(|cell| cell.value()).max();
    let n_cells = last.map_or(0, |cell| cell as usize + 1);
    let sides = |cells| (0..).zip(cells).map(|(face, cell): (u32, &Label)| (cell.value(), face));
    let faces_of = Csr::from_pairs(n_cells, sides(owner).chain(sides(neighbour)));
    for cell in 0..n_cells {
        match recognise(faces, faces_of.row(cell), |face| owner[face as usize].value() as usize == cell) {
            Some((shape, corners)) => {
                let mut corners = corners.into_iter();
                let Ok(()) = mesh_builder.push(shape, 0, || Ok::<u32, Infallible>(corners.next().unwrap_or_default()));
            }
            None => mesh_builder.refuse("polyhedra", 1),
        }
    }
}

/// Marks a face number: the face's normal points out of the cell.
const OUTWARD: u32 = 1 << 31;

/// Stands for no face. The number is too large for a face.
const NONE: u32 = u32::MAX;

/// Cells whose faces are gathered at a time.
const BLOCK: usize = 64;

/// Cells in a task.
const TASK: usize = 256 * BLOCK;

/// Corners of the four faces of some cells. Equal corners of different cells are adjacent, so
/// several cells are compared at a time.
type Corners = [[[u32; BLOCK]; 3]; 4];

/// The cells, if all of them are tets: the corners of the first face, with its normal inward, and
/// the fourth vertex.
///
/// The faces of a cell lie anywhere in memory, and loading them takes most of the time. So the
/// faces of many cells are gathered without a branch in between, and the processor loads several at
/// once.
fn tets(faces: &Faces, owner: &[Label], neighbour: &[Label]) -> Option<Vec<[u32; 4]>> {
    let triangles = faces.triangles()?;
    let n_sides = owner.len() + neighbour.len();
    if !n_sides.is_multiple_of(4) {
        return None;
    }
    // The array first holds the faces of each cell, in the place of its corners. Faces are added
    // backwards, so that the first one comes first in the end. If every cell has a fourth face, no
    // cell has a fifth. The array is not filled with zeros, because the system provides zero pages
    // at their first use, which costs time twice.
    let mut tets = vec![[NONE; 4]; n_sides / 4];
    let mut push = |cell: &Label, face: u32| {
        let faces = tets.get_mut(cell.value() as usize)?;
        *faces = [face, faces[0], faces[1], faces[2]];
        Some(())
    };
    neighbour.iter().enumerate().rev().try_for_each(|(face, cell)| push(cell, face as u32))?;
    owner.iter().enumerate().rev().try_for_each(|(face, cell)| push(cell, face as u32 | OUTWARD))?;
    let formed = tets.par_chunks_mut(TASK).map(|cells| {
        let mut corners = [[[0; BLOCK]; 3]; 4];
        cells.chunks_mut(BLOCK).try_for_each(|cells| {
            gather(cells, triangles, &mut corners)?;
            form(&corners, cells)
        })
    });
    formed.collect::<Option<()>>()?;
    Some(tets)
}

/// Fetches the corners of the faces of each cell. `None` if a cell has no fourth face.
fn gather(cells: &[[u32; 4]], triangles: &[[Label; 3]], corners: &mut Corners) -> Option<()> {
    for (cell, faces) in cells.iter().enumerate() {
        for (face, corners) in faces.iter().zip(&mut *corners) {
            let triangle = triangles.get((face & !OUTWARD) as usize)?;
            corners.iter_mut().zip(triangle).for_each(|(corners, corner)| corners[cell] = corner.value());
        }
    }
    Some(())
}

/// Replaces the faces of each cell by its corners. `None` if the faces of a cell do not form a tet.
fn form(corners: &Corners, cells: &mut [[u32; 4]]) -> Option<()> {
    let mut apexes = [0; BLOCK];
    let mut fits = true;
    // No branches and no `map` over arrays: with them the compiler does not use vector
    // instructions.
    for cell in 0..cells.len().min(BLOCK) {
        let face = |face: usize| [corners[face][0][cell], corners[face][1][cell], corners[face][2][cell]];
        let [p, q, r] = face(0);
        // The corners of the first face occur twice in the other faces. An exclusive or of all
        // corners leaves the apex.
        let joined = |[a, b, c]: [u32; 3]| a ^ b ^ c;
        let apex = joined(face(1)) ^ joined(face(2)) ^ joined(face(3));
        // The corners of the cell that a face does not have, as bits.
        let lacking = |[a, b, c]: [u32; 3]| {
            let lacks = |corner| u32::from((corner != a) & (corner != b) & (corner != c));
            lacks(p) | lacks(q) << 1 | lacks(r) << 2 | lacks(apex) << 3
        };
        // Each of the other faces lacks another corner of the first face. 1, 2 and 4 are the only
        // three nonzero numbers whose bitwise or and whose sum are both 7. Then all corners differ.
        let (x, y, z) = (lacking(face(1)), lacking(face(2)), lacking(face(3)));
        fits &= (x | y | z == 7) & (x + y + z == 7) & (x != 0) & (y != 0) & (z != 0);
        apexes[cell] = apex;
    }
    for (cell, tet) in cells.iter_mut().enumerate() {
        let [p, q, r] = [0, 1, 2].map(|place: usize| corners[0][place][cell]);
        *tet = if tet[0] & OUTWARD == 0 { [p, q, r, apexes[cell]] } else { [r, q, p, apexes[cell]] };
    }
    fits.then_some(())
}

/// The shape and the corners of a cell, from its faces and the directions of their normals.
fn recognise(faces: &Faces, of_cell: &[u32], outward: impl Fn(u32) -> bool) -> Option<(CellKind, [u32; 8])> {
    let mut corners = [&[][..]; 6];
    let corners = corners.get_mut(..of_cell.len())?;
    corners.iter_mut().zip(of_cell).for_each(|(corners, &face)| *corners = faces.corners(face as usize));
    let n_of = |count: usize| corners.iter().filter(|face| face.len() == count).count();
    let (shape, base) = match (of_cell.len(), n_of(3), n_of(4)) {
        (4, 4, 0) => (CellKind::Tet, 3),
        (5, 4, 1) => (CellKind::Pyramid, 4),
        (5, 2, 3) => (CellKind::Prism, 3),
        (6, 0, 6) => (CellKind::Hexahedron, 4),
        _ => return None,
    };
    let base_face = corners.iter().position(|face| face.len() == base)?;
    let bottom = corners[base_face];
    let mut cell = [Label::NONE; 8];
    cell[..base].copy_from_slice(bottom);
    // The base's normal points into the cell.
    if outward(of_cell[base_face]) {
        cell[..base].reverse();
    }
    // The other end of the edge that leads from a vertex of the base away from the base.
    let over = |vertex: Label| {
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
    (distinct && closed).then_some((shape, cell.map(Label::value)))
}
