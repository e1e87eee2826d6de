//! Fortran's exponents in every format of text: the same mesh, and the same bytes where nothing
//! moves.

use super::*;

const VTU: &str = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">
<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"5\">
<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">
0 0 0 1.D0 0 0 0 1 0 0 0 1.5D+00</DataArray></Points>
<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 1 2 3 0 3 2 0 1 2 3</DataArray>
<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3 6 9 12 16</DataArray>
<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5 5 5 5 10</DataArray></Cells>
<CellData><DataArray type=\"Int32\" Name=\"family\" format=\"ascii\">1 1 1 1 0</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>
";

const VTK: &str = "# vtk DataFile Version 2.0
a tet
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0
1.D0 0 0
0 1 0
0 0 1.5D+00
CELLS 5 21
3 0 2 1
3 0 1 3
3 1 2 3
3 0 3 2
4 0 1 2 3
CELL_TYPES 5
5 5 5 5 10
CELL_DATA 5
SCALARS family int 1
LOOKUP_TABLE default
1 1 1 1 0
";

const MEDIT: &str = "MeshVersionFormatted 2
Dimension 3
Vertices
4
0 0 0 0
1.D0 0 0 0
0 1 0 0
0 0 1.5D+00 0
Triangles
1
1 2 3 1
Tetrahedra
1
1 2 3 4 0
End
";

const AFLR3: &str = "4 1 0 1 0 0 0\n0 0 0\n1.D0 0 0\n0 1 0\n0 0 1.5D+00\n1 2 3\n1\n1 2 3 4\n";

const SU2: &str = "NDIME= 3
NELEM= 1
10 0 1 2 3
NPOIN= 4
0 0 0
1.D0 0 0
0 1 0
0 0 1.5D+00
NMARK= 1
MARKER_TAG= wing
MARKER_ELEMS= 1
5 0 2 1
";

/// A tet whose vertices are the origin, one on the x axis at 1, one on the y axis at 1, and one on
/// the z axis at 1.5.
#[test]
fn exponents_of_fortran_are_read_and_kept() {
    let replaced = |text: &str, pairs: &[[&str; 2]]| {
        pairs.iter().fold(text.to_owned(), |text, [from, to]| {
            assert_eq!(text.matches(from).count(), 1, "{from} in {text}");
            text.replace(from, to)
        })
    };
    let msh_41 = replaced(
        broken::TET_41,
        &[["1 1 1 1 5 0", "1 1 1.D0 1 5 0"], ["\n1 0 0\n0 1 0\n0 0 1\n", "\n1.D0 0 0\n0 1 0\n0 0 1.5D+00\n"]],
    );
    let msh_22 = replaced(broken::TET_22, &[["2 1 0 0\n", "2 1.D0 0 0\n"], ["4 0 0 1\n", "4 0 0 1.5D+00\n"]]);
    let files: [(&str, &str); 7] = [
        ("tet.vtu", VTU),
        ("tet.vtk", VTK),
        ("tet.msh", &msh_41),
        ("tet.msh", &msh_22),
        ("tet.mesh", MEDIT),
        ("tet.ugrid", AFLR3),
        ("tet.su2", SU2),
    ];
    for (name, text) in files {
        let file = read_bytes(name, text.as_bytes()).unwrap();
        let mut vertices = file.mesh.vertices.clone();
        assert_eq!(vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, 1.5 * DVec3::Z], "{name}");
        assert!(written(&file, name, &vertices) == text.as_bytes(), "{name}");
        vertices[3].z = 1.25;
        let moved = String::from_utf8(written(&file, name, &vertices)).unwrap();
        assert_eq!(moved, text.replace("1.5D+00", "1.25"), "{name}");
    }
}

#[test]
fn exponents_of_fortran_are_read_in_points_of_openfoam() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("polyMesh");
    let small = boxed("small.msh.gz");
    small.write(&folder, &small.mesh.vertices, &Fields::default()).unwrap();
    let text = fs::read_to_string(folder.join("points")).unwrap();
    let lines = text.lines().map(|line| match line.strip_prefix('(').and_then(|line| line.strip_suffix(')')) {
        Some(point) => {
            let fortran = |number: &str| match number.split_once('e') {
                Some((digits, exponent)) => format!("{digits}D{exponent}"),
                None => format!("{number}d0"),
            };
            format!("({})\n", point.split(' ').map(fortran).collect::<Vec<_>>().join(" "))
        }
        None => format!("{line}\n"),
    });
    let text: String = lines.collect();
    assert!(text.matches("d0)").count() > 100);
    fs::write(folder.join("points"), &text).unwrap();
    let file = read(&folder).unwrap();
    assert_eq!(file.mesh.vertices, small.mesh.vertices);
    file.write(&folder, &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(fs::read_to_string(folder.join("points")).unwrap(), text);
}
