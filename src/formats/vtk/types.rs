//! VTK's numbers of cell types, and the names of arrays with families.

use crate::formats::mesh_builder::{CellKind, Kind};

/// Cell arrays with families, in order of preference: idmesh's own, and the arrays of meshio and
/// ParaView.
pub(super) const FAMILY_ARRAYS: &[&str] = &["family", "gmsh:physical", "medit:ref", "ugrid:ref", "CellEntityIds"];

/// VTK's number for a type of cell. SU2 uses the same numbers.
pub(in crate::formats) fn vtk_number(shape: CellKind) -> u8 {
    match shape {
        CellKind::Triangle => 5,
        CellKind::Quadrilateral => 9,
        CellKind::Tet => 10,
        CellKind::Hexahedron => 12,
        CellKind::Prism => 13,
        CellKind::Pyramid => 14,
    }
}

/// The kind of cell with this number in VTK, and its number of vertices if this is fixed. `None`
/// for an unknown number.
pub(in crate::formats) fn vtk_kind(number: u64) -> Option<(Kind, Option<usize>)> {
    let mesh = |shape: CellKind| (Kind::Mesh(shape), Some(shape.n_vertices()));
    Some(match number {
        1 => (Kind::PassOver("points"), Some(1)),
        2 => (Kind::PassOver("points"), None),
        3 => (Kind::PassOver("lines"), Some(2)),
        4 => (Kind::PassOver("lines"), None),
        5 => mesh(CellKind::Triangle),
        6 => (Kind::Refuse("triangle strips"), None),
        7 => (Kind::Refuse("polygons"), None),
        8 => (Kind::Refuse("pixels"), Some(4)),
        9 => mesh(CellKind::Quadrilateral),
        10 => mesh(CellKind::Tet),
        11 => (Kind::Refuse("voxels"), Some(8)),
        12 => mesh(CellKind::Hexahedron),
        13 => mesh(CellKind::Prism),
        14 => mesh(CellKind::Pyramid),
        15 | 16 => (Kind::Refuse("pentagonal and hexagonal prisms"), None),
        42 => (Kind::Refuse("polyhedra"), None),
        21..=81 => (Kind::Refuse("cells of higher order"), None),
        _ => return None,
    })
}
