//! Cells along the axes of a grid, as VTK makes them of images: pixels and voxels.

use super::*;

/// The corners of two cubes of length 1 beside each other, x first. A voxel and a pixel name their
/// corners in the order of the points, a hexahedron and a quadrilateral go around.
const CELLS: [(u8, &[u32]); 12] = [
    (11, &[0, 1, 3, 4, 6, 7, 9, 10]),
    (12, &[1, 2, 5, 4, 7, 8, 11, 10]),
    (8, &[0, 3, 6, 9]),
    (9, &[2, 5, 11, 8]),
    (8, &[0, 1, 3, 4]),
    (8, &[1, 2, 4, 5]),
    (8, &[6, 7, 9, 10]),
    (9, &[7, 8, 11, 10]),
    (8, &[0, 1, 6, 7]),
    (8, &[1, 2, 7, 8]),
    (8, &[3, 4, 9, 10]),
    (8, &[4, 5, 10, 11]),
];

fn list<T: ToString>(numbers: impl IntoIterator<Item = T>) -> String {
    numbers.into_iter().map(|number| number.to_string()).collect::<Vec<_>>().join(" ")
}

fn points() -> String {
    list((0..12).flat_map(|at| [at % 3, at / 3 % 2, at / 6]))
}

fn vtu() -> String {
    let array = |name: &str, of: &str, numbers: String| {
        format!("<DataArray type=\"{of}\" Name=\"{name}\" format=\"ascii\">{numbers}</DataArray>\n")
    };
    let ends = CELLS.iter().scan(0, |end, (_, corners)| {
        *end += corners.len();
        Some(*end)
    });
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"12\" NumberOfCells=\"12\">\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points>\n\
         <Cells>{}{}{}</Cells>\n<CellData>{}</CellData></Piece></UnstructuredGrid></VTKFile>\n",
        points(),
        array("connectivity", "Int64", list(CELLS.iter().flat_map(|(_, corners)| *corners))),
        array("offsets", "Int64", list(ends)),
        array("types", "UInt8", list(CELLS.map(|(number, _)| number))),
        array("family", "Int32", list([0, 0].into_iter().chain(1..11)))
    )
}

fn vtk() -> String {
    let rows = CELLS.iter().map(|(_, corners)| format!("{} {}\n", corners.len(), list(*corners)));
    let size: usize = CELLS.iter().map(|(_, corners)| corners.len() + 1).sum();
    format!(
        "# vtk DataFile Version 3.0\ncubes\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 12 double\n{}\nCELLS 12 {size}\n{}\
         CELL_TYPES 12\n{}\nCELL_DATA 12\nSCALARS family int 1\nLOOKUP_TABLE default\n{}\n",
        points(),
        rows.collect::<String>(),
        list(CELLS.map(|(number, _)| number)),
        list([0, 0].into_iter().chain(1..11))
    )
}

/// A voxel is a hexahedron and a pixel a quadrilateral, with corners that go around. The file that
/// is written back has its own types and its own order.
///
/// Fails if the corners keep the order of the file, above and below.
#[test]
fn voxels_and_pixels_are_read_and_written_back() {
    for (name, text) in [("grid.vtu", vtu()), ("grid.vtk", vtk())] {
        let file = read_bytes(name, text.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.others.hexahedra, [[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]], "{name}");
        assert_eq!(file.others.quadrilaterals[..3], [[0, 3, 9, 6], [2, 5, 11, 8], [0, 1, 4, 3]], "{name}");
        assert_eq!((file.others.n_cells(), file.others.quadrilaterals.len()), (2, 10), "{name}");
        assert!(file.left_handed.is_empty(), "{name}");
        // Every face of the two cubes is on the boundary, but the one between them.
        idmesh::mesh::validate(file.cells()).unwrap();
        assert!(idmesh::mesh::partly_inside(file.cells()).is_empty(), "{name}");
        let mut vertices = file.mesh.vertices.clone();
        assert_eq!(written(&file, name, &vertices), text.as_bytes(), "{name}");
        vertices[11].x = 3.0;
        let moved = String::from_utf8(written(&file, name, &vertices)).unwrap();
        assert_eq!(moved, text.replacen("0 1 1 1 1 1 2 1 1", "0 1 1 1 1 1 3 1 1", 1), "{name}");
        assert_ne!(moved, text, "{name}");
    }
}

/// A voxel of another number of corners.
#[test]
fn a_voxel_has_eight_corners() {
    let text = vtk().replacen("8 0 1 3 4 6 7 9 10", "7 0 1 3 4 6 7 9", 1).replacen("CELLS 12 68", "CELLS 12 67", 1);
    let error = read_bytes("grid.vtk", text.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("expected 8 vertices of cell 0, of type 11, found 7"), "{error}");
}
