//! The files of VTK and ParaView: XML unstructured grids (`.vtu`) and legacy ones (`.vtk`).

mod base64;
mod cells;
mod compression;
mod create;
pub(super) mod legacy;
mod names;
mod number;
mod payload;
mod polylines;
mod vtu;
mod xml;

pub(super) use create::create;
pub use create::write_vtu;
pub(super) use names::{list_names, parse_names};
pub use polylines::{Polylines, read_polylines};
pub(super) use vtu::read;

use super::assembly::{Kind, Shape};

/// The format's name in [`super::FORMATS`].
pub(super) const VTU: &str = "VTU";

/// Cell arrays that are taken for the families, the first that there is: idmesh's own and those of meshio and ParaView.
const FAMILY_ARRAYS: &[&str] = &["family", "gmsh:physical", "medit:ref", "ugrid:ref", "CellEntityIds"];

/// VTK's number for a type of cell. SU2 uses the same.
pub(super) fn vtk_number(shape: Shape) -> u8 {
    match shape {
        Shape::Triangle => 5,
        Shape::Quadrilateral => 9,
        Shape::Tet => 10,
        Shape::Hexahedron => 12,
        Shape::Prism => 13,
        Shape::Pyramid => 14,
    }
}

/// The cells that a number of VTK stands for, and how many vertices they have where that is fixed; nothing if there is
/// no such number.
pub(super) fn vtk_kind(number: u64) -> Option<(Kind, Option<usize>)> {
    let mesh = |shape: Shape| (Kind::Mesh(shape), Some(shape.n_vertices()));
    Some(match number {
        1 => (Kind::PassOver("points"), Some(1)),
        2 => (Kind::PassOver("points"), None),
        3 => (Kind::PassOver("lines"), Some(2)),
        4 => (Kind::PassOver("lines"), None),
        5 => mesh(Shape::Triangle),
        6 => (Kind::Refuse("triangle strips"), None),
        7 => (Kind::Refuse("polygons"), None),
        8 => (Kind::Refuse("pixels"), Some(4)),
        9 => mesh(Shape::Quadrilateral),
        10 => mesh(Shape::Tet),
        11 => (Kind::Refuse("voxels"), Some(8)),
        12 => mesh(Shape::Hexahedron),
        13 => mesh(Shape::Prism),
        14 => mesh(Shape::Pyramid),
        15 | 16 => (Kind::Refuse("pentagonal and hexagonal prisms"), None),
        42 => (Kind::Refuse("polyhedra"), None),
        21..=81 => (Kind::Refuse("cells of higher order"), None),
        _ => return None,
    })
}
