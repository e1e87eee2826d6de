//! The cells of a VTK file, in any encoding.

use std::ops::Range;
use std::path::Path;

use super::types::vtk_kind;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::{CellKind, Kind, MOST_VERTICES, MeshBuilder};
use crate::formats::number::Integers;

/// A cell along the axes of a grid: VTK's number for its type, the shape that it is, and the place
/// of each of this shape's vertices among its own. A pixel or a voxel has its vertices row by row,
/// not around its faces.
const GRID_CELLS: [(i64, CellKind, &[usize]); 2] =
    [(8, CellKind::Quadrilateral, &[0, 1, 3, 2]), (11, CellKind::Hexahedron, &[0, 1, 3, 2, 4, 5, 7, 6])];

/// Types and vertices of the cells.
pub(super) struct Table<'a> {
    /// VTK's number for the type of each cell `[n_cells]`.
    pub types: Integers<'a>,
    pub corners: Corners<'a>,
}

/// The vertices of cells or lines.
pub(super) enum Corners<'a> {
    /// Number of cells, and runs of numbers: a count, then the vertices of a cell.
    Runs(usize, Integers<'a>),
    /// End of each cell in the vertices, and the vertices.
    Ends(Integers<'a>, Integers<'a>),
    /// Start of the first cell and end of each cell in the vertices, and the vertices.
    Bounds(Integers<'a>, Integers<'a>),
}

impl Corners<'_> {
    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        match self {
            Corners::Runs(n_cells, _) => *n_cells,
            Corners::Ends(ends, _) => ends.len(),
            Corners::Bounds(bounds, _) => bounds.len().saturating_sub(1),
        }
    }

    /// Range of a cell's vertices. `start` is the end of the cell before.
    ///
    /// # Errors
    /// A wrong end.
    #[inline]
    pub fn of(&mut self, cell: usize, start: usize) -> Result<Range<usize>, i64> {
        let (range, end, len) = match self {
            Corners::Runs(_, numbers) => {
                let count = numbers.get(start).unwrap_or(-1);
                let end = (start as i64 + 1).saturating_add(count);
                (start + 1..end as usize, end, numbers.len())
            }
            Corners::Ends(ends, vertices) => {
                let end = ends.get(cell).unwrap_or(-1);
                (start..end as usize, end, vertices.len())
            }
            Corners::Bounds(bounds, vertices) => {
                let end = bounds.get(cell + 1).unwrap_or(-1);
                (start..end as usize, end, vertices.len())
            }
        };
        if end < range.start as i64 || end as u64 > len as u64 { Err(end) } else { Ok(range) }
    }

    /// The vertex at an index.
    #[inline]
    pub fn vertex(&mut self, place: usize) -> Option<i64> {
        match self {
            Corners::Runs(_, vertices) | Corners::Ends(_, vertices) | Corners::Bounds(_, vertices) => {
                vertices.get(place)
            }
        }
    }

    /// Number of numbers, including counts.
    pub fn len(&self) -> usize {
        match self {
            Corners::Runs(_, vertices) | Corners::Ends(_, vertices) | Corners::Bounds(_, vertices) => vertices.len(),
        }
    }
}

/// Adds the cells to `mesh_builder`, by their types.
///
/// - `families` `[n_cells]`: number of each cell's family
/// - `numbered`: the mesh's number for a vertex below `n_vertices`
/// - `malformed`: makes the error from the expected and the found contents
pub(super) fn assemble(
    path: &Path,
    table: Table,
    mut families: Option<Integers>,
    n_vertices: usize,
    numbered: impl Fn(usize) -> u32,
    malformed: impl Fn(String, String) -> ReadError,
    mesh_builder: &mut MeshBuilder,
) -> Result<(), ReadError> {
    if n_vertices >= MOST_VERTICES {
        return Err(ReadError::TooMany {
            path: path.into(),
            what: "vertices",
            count: n_vertices,
            limit: MOST_VERTICES,
        });
    }
    let Table { mut types, mut corners } = table;
    let n_cells = types.len();
    if corners.n_cells() != n_cells {
        return Err(malformed(format!("the vertices of {n_cells} cells"), format!("those of {}", corners.n_cells())));
    }
    if let Some(found) = families.as_ref().map(Integers::len).filter(|&len| len != n_cells) {
        return Err(malformed(format!("{n_cells} families of cells"), found.to_string()));
    }
    let n_faces = |mesh_builder: &MeshBuilder| mesh_builder.triangles.len() + mesh_builder.others.quadrilaterals.len();
    let n_faces_before = n_faces(mesh_builder);
    let mut start = 0;
    for cell in 0..n_cells {
        let of_cell = corners.of(cell, start).map_err(|end| {
            let expected = format!("the end of cell {cell} between {start} and {}", corners.len());
            malformed(expected, end.to_string())
        })?;
        start = of_cell.end;
        let number = types.get(cell).unwrap_or(-1);
        let grid_cell = GRID_CELLS.iter().find(|(of_type, ..)| *of_type == number);
        let kind = match grid_cell {
            Some(&(_, shape, order)) => Some((Kind::Mesh(shape), Some(order.len()))),
            None => u64::try_from(number).ok().and_then(vtk_kind),
        };
        let (kind, n_corners) =
            kind.ok_or_else(|| malformed(format!("the type of cell {cell}"), number.to_string()))?;
        if let Some(expected) = n_corners.filter(|&expected| expected != of_cell.len()) {
            let expected = format!("{expected} vertices of cell {cell}, of type {number}");
            return Err(malformed(expected, of_cell.len().to_string()));
        }
        let shape = match kind {
            Kind::Mesh(shape) => shape,
            Kind::PassOver(name) => {
                mesh_builder.pass_over(name, 1);
                continue;
            }
            Kind::Refuse(name) => {
                mesh_builder.refuse(name, 1);
                continue;
            }
        };
        let family = families.as_mut().map_or(Some(0), |families| families.get(cell)).unwrap_or(-1);
        let tag =
            i32::try_from(family).map_err(|_| malformed(format!("the family of cell {cell}"), family.to_string()))?;
        let mut places = of_cell.clone();
        let mut order = grid_cell.map_or(&[][..], |(.., order)| order).iter();
        mesh_builder.push(shape, tag, || {
            let place = order.next().map_or_else(|| places.next(), |&place| Some(of_cell.start + place));
            let vertex = place.and_then(|place| corners.vertex(place)).unwrap_or(-1);
            match usize::try_from(vertex) {
                Ok(vertex) if vertex < n_vertices => Ok(numbered(vertex)),
                _ => Err(malformed(format!("a vertex of cell {cell} below {n_vertices}"), vertex.to_string())),
            }
        })?;
    }
    if let Corners::Runs(..) = corners
        && start != corners.len()
    {
        return Err(malformed(format!("{} numbers of {n_cells} cells", corners.len()), start.to_string()));
    }
    if families.is_none() && n_faces(mesh_builder) > n_faces_before {
        return Err(ReadError::Missing {
            path: path.into(),
            what: "cell array 'family'",
            hint: "give the boundary faces their families as whole numbers in a cell array of that name",
        });
    }
    Ok(())
}
