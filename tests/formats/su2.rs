//! SU2 files.

use super::*;

/// One tet, with comments, an FFD box and trailing indices.
const TET: &str = "% made by hand
NDIME= 3
% Cells: type, vertices, index
NELEM= 1
10 0 1 2 3 0

NPOIN= 4 % ghosts: none
0 0 0 0
1.0000 0 0 1\r
0 1 0 2
0 0 1.50e0 3
NMARK= 2
MARKER_TAG= wing
MARKER_ELEMS= 3
5 0 2 1
5 0 1 3
5 1 2 3
MARKER_TAG= far field
MARKER_ELEMS= 1
5 0 3 2
FFD_NBOX= 1
FFD_CORNER_POINTS= 2
0 0 0
1 1 1
";

fn message(text: &str) -> String {
    let error = read_bytes("tet.su2", text.as_bytes()).expect_err("a broken file was read").to_string();
    error.rsplit('/').next().unwrap().to_string()
}

#[test]
fn everything_but_coordinates_is_kept() {
    let file = read_bytes("tet.su2", TET.as_bytes()).unwrap();
    assert_eq!(file.mesh.families, ["wing", "far field"]);
    assert_eq!(file.mesh.tets, [[0, 1, 2, 3]]);
    assert_eq!(file.mesh.triangles, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
    assert_eq!(file.mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, 1.5 * DVec3::Z]);
    assert!(written(&file, "same.su2", &file.mesh.vertices) == TET.as_bytes());
    let mut vertices = file.mesh.vertices.clone();
    vertices[1].y = 1.0 / 3.0;
    let expected = TET.replace("1.0000 0 0 1\r", "1.0000 0.3333333333333333 0 1\r");
    assert_eq!(String::from_utf8(written(&file, "moved.su2", &vertices)).unwrap(), expected);
    // A comment right behind a number.
    let close = TET.replace("1.50e0 3", "1.50e0% top");
    let file = read_bytes("close.su2", close.as_bytes()).unwrap();
    assert!(written(&file, "close.su2", &file.mesh.vertices) == close.as_bytes());
    assert_eq!(file.losses(Path::new("a.msh")).unwrap(), ["FFD boxes: not carried into the new file"]);
    assert!(file.losses(Path::new("a.su2")).unwrap().is_empty());
}

/// Exponents as Fortran writes them: the same mesh, and the same bytes where nothing moves.
#[test]
fn exponents_of_fortran_are_read_and_kept() {
    let text = TET.replace("1.0000 0 0 1", "1.000000000000000D+00 0.d0 1.5-101 1").replace("1.50e0 3", "+.15D1 3");
    let file = read_bytes("tet.su2", text.as_bytes()).unwrap();
    assert_eq!(file.mesh.vertices, [DVec3::ZERO, DVec3::new(1.0, 0.0, 1.5e-101), DVec3::Y, 1.5 * DVec3::Z]);
    assert!(written(&file, "same.su2", &file.mesh.vertices) == text.as_bytes());
    let mut vertices = file.mesh.vertices.clone();
    vertices[1].x = 1.25;
    let moved = String::from_utf8(written(&file, "moved.su2", &vertices)).unwrap();
    assert_eq!(moved, text.replace("1.000000000000000D+00", "1.25"));
    assert_eq!(message(&text.replace("0.d0", "0.d")), "tet.su2:9: expected a coordinate, found '0.d'");
}

#[test]
fn broken_files_are_refused_with_their_place() {
    let rows = [
        ("NDIME= 3", "NDIME= 2", "tet.su2: a mesh of 2 dimensions is not read"),
        ("NDIME= 3", "", "tet.su2:7: expected NDIME= 3 before NPOIN=, found none"),
        ("NELEM= 1", "NELEM= 2", "tet.su2:7: expected the type of an element, found 'NPOIN='"),
        ("NELEM= 1", "NELEM= 99999999999999999999", "tet.su2:4: expected the number of elements, found '9999999"),
        ("NELEM= 1", "NELEM= 9999999", "tet.su2:4: the number of elements is 9999999, but only"),
        ("NELEM= 1", "NELEM= 0", "tet.su2:5: expected a keyword such as NPOIN=, found '10 0 1 2 3 0'"),
        ("NPOIN= 4", "NPOIN= 3", "tet.su2:11: expected a keyword such as NPOIN=, found '0 0 1.50e0 3'"),
        ("NPOIN= 4", "NPOIN= 5", "tet.su2:12: expected a coordinate, found 'NMARK='"),
        ("NPOIN= 4", "NPOINT= 4", "tet.su2: the file has no NPOIN="),
        ("NMARK= 2", "NMARK= 3", "expected 3 MARKER_TAG=, as NMARK= declares, found 2 of them"),
        ("MARKER_TAG= wing\n", "", "tet.su2:13: expected MARKER_TAG= before MARKER_ELEMS=, found none"),
        ("MARKER_TAG= wing", "MARKER_TAG=", "tet.su2:13: expected the name of a marker, found the end of the line"),
        ("10 0 1 2 3 0", "10 0 1 2 4 0", "tet.su2:5: tet 0 names vertex 4, but the file defines 4 points"),
        ("10 0 1 2 3 0", "10 0 1 2 -3 0", "tet.su2:5: expected a vertex, found '-3'"),
        ("10 0 1 2 3 0", "10 0 1 2 3 0 7", "tet.su2:5: expected the end of the line, found '7'"),
        ("10 0 1 2 3 0", "10 0 1 2", "tet.su2:5: expected a vertex, found the end of the line"),
        (
            "10 0 1 2 3 0",
            "5 0 1 2 0",
            "tet.su2:5: expected a cell (10: tet, 12: hexahedron, 13: prism, 14: pyramid), fo",
        ),
        ("10 0 1 2 3 0", "42 0 1 2 3 0", "a mesh with 1 polyhedra is not read; split polyhedra"),
        ("10 0 1 2 3 0", "24 0 1 2 3 0", "a mesh with 1 cells of higher order is not read; save it with linear"),
        ("5 0 3 2", "5 0 3 18446744073709551615", "names vertex 18446744073709551615, but the file defines 4 points"),
        ("5 0 3 2", "10 0 3 2 1", "tet.su2:20: expected a boundary element"),
        ("0 1 0 2", "0 nan 0 2", "tet.su2:10: vertex 2 has coordinate NaN, not a finite number"),
        ("0 1 0 2", "0 1 2", "tet.su2: "),
        ("0 1 0 2", "0 1,0 0 2", "tet.su2:10: expected a coordinate, found '1,0'"),
        ("NMARK= 2", "NELEM= 1", "tet.su2:12: expected one NELEM=, found a second one"),
        ("NMARK= 2", "NZONE= 2", "tet.su2: a mesh of several zones is not read; give each zone a file"),
    ];
    let mut wrong = String::new();
    for (from, to, expected) in rows {
        assert_eq!(TET.matches(from).count(), 1, "{from:?} must name one spot");
        let text = TET.replace(from, to);
        let found = match read_bytes("tet.su2", text.as_bytes()) {
            Ok(_) if to == "0 1 2" => "tet.su2: ".to_string(),
            _ => message(&text),
        };
        if !found.contains(expected) {
            wrong += &format!("{from:?} -> {to:?}\n expected: {expected}\n found:    {found}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(message("NDIME= 3\n").contains("the file has no NPOIN="));
    assert!(
        message(&TET.replace("MARKER_TAG", "FFD_TAG").replace("MARKER_ELEMS", "FFD_X").replace("NMARK", "FFD_N"))
            .contains("the file has no boundary triangles")
    );
}

/// All up to the last marker's last face is needed.
#[test]
fn truncated_files_are_refused() {
    let needed = TET.find("FFD_NBOX").unwrap() - 1;
    assert!(read_bytes("tet.su2", &TET.as_bytes()[..needed]).is_ok());
    for length in 1..needed - 2 {
        // The last line of a marker is complete without its end.
        assert!(read_bytes("tet.su2", &TET.as_bytes()[..length]).is_err(), "cut to {length} of {needed} bytes");
    }
}

/// The same mesh as Gmsh wrote it in its own format and in SU2's.
#[test]
fn names_with_spaces_are_told_of() {
    let file = boxed("box.v41.ascii.msh");
    let losses = file.losses(Path::new("box.su2")).unwrap();
    assert!(losses.contains(&"the family 'far field' is called 'far_field'".to_string()), "{losses:?}");
    let again = read_bytes("box.su2", &written(&file, "box.su2", &file.mesh.vertices)).unwrap().mesh;
    assert_eq!(again.families, ["far_field", "wing_skin", "surface_7"]);
    assert_eq!((again.tets, again.vertices), (file.mesh.tets, file.mesh.vertices));
}

/// The vertices that another part of a divided mesh sends, and those that it receives.
const SHARED: &str = "MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 2
SEND_RECV= 2
1 0 0
1 3 0
MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 1
SEND_RECV= -2
1 2 0
";

/// Markers of shared vertices are no families, but are told of and kept, with the partner before or
/// after the number of vertices.
#[test]
fn shared_vertices_are_named_as_what_they_are() {
    let before = SHARED.replace("MARKER_ELEMS= 2\nSEND_RECV= 2", "SEND_RECV= 2\nMARKER_ELEMS= 2");
    // SU2 itself writes SEND_TO=, for both directions.
    let of_su2 = SHARED.replace("SEND_RECV", "SEND_TO");
    for shared in [SHARED, &before, &of_su2, &SHARED.replace("SEND_RECV= 2\n", "% no partner\n")] {
        let text = TET.replace("NMARK= 2", "NMARK= 4").replace("FFD_NBOX", &format!("{shared}FFD_NBOX"));
        let file = read_bytes("tet.su2", text.as_bytes()).unwrap();
        assert_eq!(file.mesh.families, ["wing", "far field"]);
        assert_eq!(file.mesh.triangles.len(), 4);
        let [warning] = file.warnings() else { panic!("{:?}", file.warnings()) };
        assert!(warning.starts_with("2 markers SEND_RECEIVE with 3 vertices are shared with other parts"), "{warning}");
        let losses = file.losses(Path::new("a.msh")).unwrap().join("; ");
        assert!(losses.contains("2 markers SEND_RECEIVE with 3 vertices: not carried"), "{losses}");
        let mut vertices = file.mesh.vertices.clone();
        assert!(written(&file, "same.su2", &vertices) == text.as_bytes());
        vertices[1].y = 0.25;
        let moved = text.replace("1.0000 0 0 1\r", "1.0000 0.25 0 1\r");
        assert_eq!(String::from_utf8(written(&file, "moved.su2", &vertices)).unwrap(), moved);
    }
    assert!(read_bytes("tet.su2", TET.as_bytes()).unwrap().warnings().is_empty());
    let text = TET.replace("NMARK= 2", "NMARK= 4").replace("FFD_NBOX", &format!("{SHARED}FFD_NBOX"));
    for (from, to, expected) in [
        ("1 3 0", "1 4 0", "tet.su2:25: element 1 names vertex 4, but the file defines 4 points"),
        ("1 3 0", "5 0 1 3", "tet.su2:25: expected a vertex (1), because SEND_RECEIVE is a marker of vertices"),
        ("1 3 0", "1 3 0 7", "tet.su2:25: expected the end of the line, found '7'"),
        ("SEND_RECV= 2", "SEND_RECV= 0", "tet.su2:23: expected the partner of a marker, from 1 or from -1, found '0'"),
        ("SEND_RECV= 2", "SEND_RECV= x", "tet.su2:23: expected the partner of a marker, from 1 or from -1, found 'x'"),
        (
            "MARKER_ELEMS= 3",
            "SEND_RECV= 2\nMARKER_ELEMS= 3",
            "tet.su2:14: expected SEND_RECV= in a marker SEND_RECEIVE",
        ),
        (
            "MARKER_ELEMS= 1\nSEND_RECV= -2",
            "MARKER_ELEMS= 2\nSEND_RECV= -2",
            "expected the type of an element, found 'FFD",
        ),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from:?} must name one spot");
        let found = message(&text.replace(from, to));
        assert!(found.contains(expected), "{from:?} -> {to:?}\n expected: {expected}\n found:    {found}");
    }
}

/// A marker without elements is no family. A new file of another format has no such marker.
#[test]
fn markers_without_elements_are_told_of() {
    let text = TET.replace("NMARK= 2", "NMARK= 3").replace("FFD_NBOX", "MARKER_TAG= slot\nMARKER_ELEMS= 0\nFFD_NBOX");
    let file = read_bytes("tet.su2", text.as_bytes()).unwrap();
    assert_eq!(file.mesh.families, ["wing", "far field"]);
    let losses = file.losses(Path::new("a.msh")).unwrap();
    assert!(
        losses.contains(&"the marker 'slot' without elements: not carried into the new file".to_owned()),
        "{losses:?}"
    );
    assert!(file.losses(Path::new("a.su2")).unwrap().is_empty());
    assert!(written(&file, "same.su2", &file.mesh.vertices) == text.as_bytes());
}
