//! Medit files.

use super::*;

/// One tet with the sections that other programs add.
const TET: &str = "MeshVersionFormatted 2
# families: 1=wing, 2=far field
Dimension
3
Vertices
4
0 0 0 0
1 0 0 0
0 1 0 0
0 0 1.50 0
Corners
2
1
2
Edges
1
1 2 9
Triangles
4
1 3 2 1
1 2 4 1
2 3 4 1
1 4 3 2
Normals
1
0.5 -1e3 nan
NormalAtVertices
0
Tetrahedra
1
1 2 3 4 10
End
";

#[test]
fn everything_but_coordinates_is_kept() {
    let file = read_bytes("tet.mesh", TET.as_bytes()).unwrap();
    assert_eq!(file.mesh.families, ["wing", "far field"]);
    assert_eq!((file.mesh.tets.len(), file.mesh.triangles.len()), (1, 4));
    let mut vertices = file.mesh.vertices.clone();
    assert!(written(&file, "same.mesh", &vertices) == TET.as_bytes());
    vertices[2].y = 2.5;
    assert_eq!(written(&file, "moved.mesh", &vertices), TET.replace("0 1 0 0", "0 2.5 0 0").as_bytes());
    let losses = file.losses(Path::new("a.meshb")).unwrap().join("; ");
    for words in ["Corners", "Normals", "1 edges", "names of families: only their numbers"] {
        assert!(losses.contains(words), "{words} is not in {losses}");
    }
}

/// Names of a `.mapbc` file beside, which goes along; those that the file has in a comment are its
/// own.
#[test]
fn names_stand_in_the_mapbc_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("tet.mesh"), TET.replace("# families: 1=wing, 2=far field\n", "")).unwrap();
    assert_eq!(read(&path("tet.mesh")).unwrap().mesh.families, ["surface 1", "surface 2"]);
    let names = "2\n1 4000 upper\n2 5000 outer box\n";
    fs::write(path("tet.mapbc"), names).unwrap();
    let file = read(&path("tet.mesh")).unwrap();
    assert_eq!(file.mesh.families, ["upper", "outer box"]);
    file.write(&path("moved.mesh"), &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(fs::read_to_string(path("moved.mapbc")).unwrap(), names);
    assert_eq!(read(&path("moved.mesh")).unwrap().mesh.families, ["upper", "outer box"]);
    file.write(&path("tet.meshb"), &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(read(&path("tet.meshb")).unwrap().mesh.families, ["upper", "outer box"]);
    fs::write(path("tet.mapbc"), names.replace("outer box", "outer_box")).unwrap();
    file.write(&path("tet.meshb"), &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(read(&path("tet.meshb")).unwrap().mesh.families, ["upper", "outer_box"]);
    fs::write(path("tet.mesh"), TET.replace(", 2=far field", "")).unwrap();
    assert_eq!(read(&path("tet.mesh")).unwrap().mesh.families, ["wing", "outer_box"]);
    let losses = file.losses(Path::new("a.vtu")).unwrap().join("; ");
    assert!(losses.contains("boundary conditions of the .mapbc file"), "{losses}");
    // Where the file names all, what lies beside is not looked at.
    fs::write(path("tet.mesh"), TET).unwrap();
    fs::write(path("tet.mapbc"), "9\n").unwrap();
    assert_eq!(read(&path("tet.mesh")).unwrap().mesh.families, ["wing", "far field"]);
}

#[test]
fn broken_files_are_refused_with_their_place() {
    for (from, to, expected) in [
        ("MeshVersionFormatted 2", "MeshVersion 2", "tet.mesh:1: expected MeshVersionFormatted, found 'MeshVersion'"),
        (
            "MeshVersionFormatted 2",
            "MeshVersionFormatted 5",
            "tet.mesh:1: expected the version of the format, 1 to 4, fo",
        ),
        ("Dimension\n3", "Dimension\n2", "tet.mesh: a mesh of 2 dimensions is not read"),
        ("Dimension\n3", "", "tet.mesh:5: expected Dimension 3 before the vertices, found none"),
        ("Vertices\n4", "Vertices\n3", "tet.mesh:10: expected a keyword such as Vertices, found '0'"),
        ("Vertices\n4", "Vertices\n5", "tet.mesh:11: expected a coordinate, found 'Corners'"),
        ("Vertices\n4", "Vertices\n-5", "tet.mesh:6: expected the number of entries of a section, found -5"),
        ("Vertices\n4", "Vertices\n999999", "tet.mesh:6: the number of entries of a section is 999999, but only"),
        ("Vertices\n4", "Vertexes\n4", "expected the vertices before the elements, found none"),
        ("2 3 4 1\n1 4 3 2", "2 3 5 1\n1 4 3 2", "tet.mesh:22: triangle 3 names vertex 5, but the file defines 4 ver"),
        ("1.50", "inf", "tet.mesh:10: vertex 4 has coordinate inf"),
        ("Tetrahedra\n", "TetrahedraP2\n", "a mesh with 1 second-order tets is not read"),
        ("Tetrahedra\n", "Vertices\n", "expected one section of vertices, found a second one"),
    ] {
        assert_eq!(TET.matches(from).count(), 1, "{from:?} must name one spot");
        let error = read_bytes("tet.mesh", TET.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{from:?} -> {to:?}\n expected: {expected}\n found:    {error}");
    }
    let bytes = fs::read(data("mixed/meshio.meshb")).unwrap();
    for length in 1..bytes.len() - 8 {
        assert!(read_bytes("a.meshb", &bytes[..length]).is_err(), "cut to {length} bytes");
    }
    assert!(read_bytes("a.meshb", TET.as_bytes()).unwrap_err().to_string().contains("the number 1 of a binary Medit"));
    assert!(read_bytes("a.mesh", &bytes).is_err());
    // A section that says it is longer or shorter than its count.
    let at = 8 + bytes[8..].windows(4).position(|window| window == 4i32.to_le_bytes()).unwrap();
    for by in [-4i8, 4] {
        let mut broken = bytes.clone();
        broken[at + 4] = broken[at + 4].wrapping_add_signed(by);
        let error = read_bytes("a.meshb", &broken).unwrap_err().to_string();
        assert!(error.contains("expected a section up to byte"), "{error}");
    }
}

/// Keywords in capitals or in small letters, as other programs write them.
#[test]
fn keywords_are_read_in_any_case() {
    for change in [str::to_uppercase, str::to_lowercase] {
        let mut text = String::new();
        for line in TET.lines() {
            text += &if line.starts_with('#') { line.to_owned() } else { change(line) };
            text += "\n";
        }
        let (file, plain) = (read_bytes("tet.mesh", text.as_bytes()).unwrap(), read_bytes("tet.mesh", TET.as_bytes()));
        assert!(file.mesh == plain.unwrap().mesh);
        assert!(written(&file, "same.mesh", &file.mesh.vertices) == text.as_bytes());
        let second_order =
            read_bytes("tet.mesh", text.replace(&change("Tetrahedra"), &change("TetrahedraP2")).as_bytes());
        assert!(second_order.unwrap_err().to_string().contains("a mesh with 1 second-order tets is not read"));
    }
}

/// A `.mapbc` of another mesh does not stay beside a `.mesh`, because other programs would take its
/// names.
#[test]
fn no_mapbc_of_another_mesh_stays_beside() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let no_fields = Fields::default();
    let own = read_bytes("tet.mesh", TET.as_bytes()).unwrap();
    let other = boxed("box.v41.ascii.msh");
    for (file, names) in
        [(&own, "2\n1 3 wing\n2 5 far field\n"), (&other, "3\n1 5 far field\n2 3 wing skin\n3 0 surface 7\n")]
    {
        fs::write(path("out.mapbc"), names).unwrap();
        file.check_output(&path("out.mesh")).unwrap();
        file.write(&path("out.mesh"), &file.mesh.vertices, &no_fields).unwrap();
        assert_eq!(fs::read_to_string(path("out.mapbc")).unwrap(), names);
        fs::remove_file(path("out.mesh")).unwrap();
        for stale in [names.replace("wing", "tail"), names.replace("1 ", "9 "), "7\n".to_owned()] {
            fs::write(path("out.mapbc"), &stale).unwrap();
            for result in
                [file.check_output(&path("out.mesh")), file.write(&path("out.mesh"), &file.mesh.vertices, &no_fields)]
            {
                let error = result.unwrap_err().to_string();
                assert!(error.contains("out.mapbc is there already and is not this mesh's"), "{error}");
            }
            assert!(!path("out.mesh").exists());
            assert_eq!(fs::read_to_string(path("out.mapbc")).unwrap(), stale);
        }
    }
}

/// Comments after keywords and rows, and between them. The families may be named in any of them.
#[test]
fn comments_may_stand_before_every_row() {
    let plain = read_bytes("tet.mesh", TET.as_bytes()).unwrap();
    let unnamed = TET.replace("# families: 1=wing, 2=far field\n", "");
    let (head, rows) = unnamed.split_at(unnamed.find("Vertices").unwrap());
    let commented: String = rows.lines().map(|line| format!("{line} # a remark: 7 8\n#more\n")).collect();
    let text = format!("{head}{}", commented.replacen("a remark: 7 8", "families: 1=wing, 2=far field", 1));
    let file = read_bytes("tet.mesh", text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(file.mesh, plain.mesh);
    let mut vertices = file.mesh.vertices.clone();
    assert!(written(&file, "same.mesh", &vertices) == text.as_bytes());
    vertices[3].z = 1.25;
    let moved = text.replace("0 0 1.50 0", "0 0 1.25 0");
    assert_eq!(String::from_utf8(written(&file, "moved.mesh", &vertices)).unwrap(), moved);
}
