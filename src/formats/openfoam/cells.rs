//! Which shape each cell has, from its faces.

use std::convert::Infallible;

use super::file::Faces;
use crate::formats::assembly::{Assembly, Shape};
use crate::mesh::csr::Csr;

/// Adds every cell; those of no known shape are counted as polyhedra.
///
/// - `owner` `[n_faces]`: the cell that each face's normal points out of
/// - `neighbour` `[n_internal_faces]`: the cell it points into
pub(super) fn assemble(faces: &Faces, owner: &[u32], neighbour: &[u32], assembly: &mut Assembly) {
    let last = [owner, neighbour].into_iter().filter_map(|cells| cells.iter().copied().max()).max();
    let n_cells = last.map_or(0, |cell| cell as usize + 1);
    if let Some(tets) = tets(faces, owner, neighbour, n_cells) {
        assembly.tets = tets;
        return;
    }
    let sides = |cells| (0..).zip(cells).map(|(face, &cell): (u32, &u32)| (cell, face));
    let faces_of = Csr::from_pairs(n_cells, sides(owner).chain(sides(neighbour)));
    for cell in 0..n_cells {
        match recognise(faces, faces_of.row(cell), |face| owner[face as usize] as usize == cell) {
            Some((shape, corners)) => {
                let mut corners = corners.into_iter();
                let Ok(()) = assembly.push(shape, 0, || Ok::<u32, Infallible>(corners.next().unwrap_or_default()));
            }
            None => assembly.refuse("polyhedra", 1),
        }
    }
}

/// The cells if all of them are tets: the corners of the first face, normal inward, and the one that this has not.
///
/// Goes through the faces as they follow each other in memory: to gather those of each cell takes several times as long.
fn tets(faces: &Faces, owner: &[u32], neighbour: &[u32], n_cells: usize) -> Option<Vec<[u32; 4]>> {
    let triangles = faces.triangles()?;
    // Backwards, so that the first face comes last and stays. What is left over when each corner comes three times and
    // those of the first face once more, all joined by exclusive or, is the corner that this has not.
    let mut tets = vec![[0; 4]; n_cells];
    for (&cell, &[a, b, c]) in neighbour.iter().zip(triangles).rev() {
        let tet = &mut tets[cell as usize];
        *tet = [a, b, c, tet[3] ^ a ^ b ^ c];
    }
    for (&cell, &[a, b, c]) in owner.iter().zip(triangles).rev() {
        let tet = &mut tets[cell as usize];
        *tet = [c, b, a, tet[3] ^ a ^ b ^ c];
    }
    tets.iter_mut().for_each(|[a, b, c, apex]| *apex ^= *a ^ *b ^ *c);
    // A tet has one face opposite each corner, which holds the other three: the corners that have one, as bits. All is
    // counted without branches: the processor would guess them wrong, and wait for every cell.
    let closed_by = |cells: &[u32]| {
        let mut closed = vec![0u8; n_cells];
        let mut fits = true;
        for (&cell, &[a, b, c]) in cells.iter().zip(triangles) {
            let [p, q, r, s] = tets[cell as usize];
            let places = |corner| {
                u8::from(p == corner)
                    | u8::from(q == corner) << 1
                    | u8::from(r == corner) << 2
                    | u8::from(s == corner) << 3
            };
            let opposite = 0b1111 ^ (places(a) | places(b) | places(c));
            let closed = &mut closed[cell as usize];
            fits &= opposite.is_power_of_two() & (*closed & opposite == 0);
            *closed |= opposite;
        }
        fits.then_some(closed)
    };
    let (by_own, by_others) = rayon::join(|| closed_by(owner), || closed_by(neighbour));
    by_own?.iter().zip(by_others?).all(|(own, others)| own ^ others == 0b1111).then_some(tets)
}

/// The shape and the corners of a cell, from its faces and whether their normals point out of it.
fn recognise(faces: &Faces, of_cell: &[u32], outward: impl Fn(u32) -> bool) -> Option<(Shape, [u32; 8])> {
    let mut corners = [&[][..]; 6];
    let corners = corners.get_mut(..of_cell.len())?;
    corners.iter_mut().zip(of_cell).for_each(|(corners, &face)| *corners = faces.corners(face as usize));
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
    if outward(of_cell[base_face]) {
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
