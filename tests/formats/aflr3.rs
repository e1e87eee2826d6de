//! AFLR3 files and the names beside them.

use super::*;

/// One tet: counts, vertices, triangles, references, the tet.
const TET: &str = "4 4 0 1 0 0 0
0 0 0
1 0 0
0 1 0
0 0 1.50
1 3 2
1 2 4
2 3 4
1 4 3
7
7
7
12
1 2 3 4
";
const NAMES: &str = "2\n7 4000 wing skin\n12   5000 farfield\n";

fn in_folder(mapbc: Option<&str>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tet.ugrid");
    fs::write(&path, TET).unwrap();
    if let Some(text) = mapbc {
        fs::write(folder.path().join("tet.mapbc"), text).unwrap();
    }
    (folder, path)
}

#[test]
fn names_stand_in_the_mapbc_file() {
    let (folder, path) = in_folder(Some(NAMES));
    let file = read(&path).unwrap();
    assert_eq!(file.mesh.families, ["wing skin", "farfield"]);
    assert_eq!(file.mesh.triangle_family.iter().map(|family| family.0).collect::<Vec<_>>(), [0, 0, 0, 1]);
    assert_eq!(file.mesh.tets, [[0, 1, 2, 3]]);
    // Written back, both keep their bytes; a .mapbc that is there already stays.
    for (name, mapbc) in [("moved.ugrid", "moved.mapbc"), ("other.ugrid.gz", "other.mapbc")] {
        file.write(&folder.path().join(name), &file.mesh.vertices, &Fields::default()).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join(mapbc)).unwrap(), NAMES);
    }
    assert_eq!(fs::read_to_string(folder.path().join("moved.ugrid")).unwrap(), TET);
    let new = folder.path().join("new.b8.ugrid");
    file.write(&new, &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(fs::read_to_string(folder.path().join("new.mapbc")).unwrap(), "2\n1 0 wing_skin\n2 0 farfield\n");
    fs::write(folder.path().join("new.mapbc"), "1\n1 4000 mine\n").unwrap();
    assert!(file.losses(&new).unwrap().iter().any(|loss| loss.contains("new.mapbc is there already")));
    let losses = file.losses(Path::new("a.vtu")).unwrap();
    assert_eq!(losses, ["boundary conditions of the .mapbc file: not carried into the new file"]);
    file.write(&new, &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(read(&new).unwrap().mesh.families, ["mine", "surface 2"]);

    let (_folder, path) = in_folder(None);
    assert_eq!(read(&path).unwrap().mesh.families, ["surface 7", "surface 12"]);
    for (text, expected) in [
        ("", "tet.mapbc:1: the file ends where the number of boundaries should stand"),
        ("x\n", "tet.mapbc:1: expected the number of boundaries, found 'x'"),
        ("3\n7 4000 wing\n8 5000\n", "tet.mapbc:4: the file ends where a reference, its boundary condition and"),
        ("999999\n7 4000 wing\n", "tet.mapbc:1: the number of boundaries is 999999, but only"),
        ("1\nwing 4000 7\n", "tet.mapbc:2: expected the reference of a boundary, found 'wing'"),
        ("1\n7 wing\n", "tet.mapbc:2: expected the number of a boundary condition, found 'wing'"),
    ] {
        let (_folder, path) = in_folder(Some(text));
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?}: {error}");
    }
}

#[test]
fn broken_files_are_refused_with_their_place() {
    for (from, to, expected) in [
        ("4 4 0 1 0", "-4 4 0 1 0", "tet.ugrid:1: expected the number of vertices, found -4"),
        ("4 4 0 1 0", "4 4 0 1 x", "tet.ugrid:1: expected the number of pyramids, found 'x'"),
        ("4 4 0 1 0", "4 4 0 999 0", "tet.ugrid:1: the number of tets is 999, but only"),
        ("4 4 0 1 0", "5 4 0 1 0", "tet.ugrid:10: triangle 4 names vertex 7, but the file defines 5 vertices"),
        ("4 4 0 1 0", "4 5 0 1 0", "tet.ugrid:10: triangle 5 names vertex 7, but the file defines 4 vertices"),
        ("4 4 0 1 0", "4 4 0 0 0", "tet.ugrid: the file has no tets"),
        ("2 3 4\n1 4 3", "2 3 0\n1 4 3", "tet.ugrid:8: triangle 3 names vertex 0"),
        ("1 2 3 4\n", "1 2 3 -1\n", "tet.ugrid:14: tet 1 names vertex -1, but the file defines 4 vertices, numbered"),
        ("1 2 3 4\n", "1 2 3 5\n", "tet.ugrid:14: tet 1 names vertex 5, but the file defines 4 vertices, numbered"),
        ("1 2 3 4\n", "1 2 3\n", "tet.ugrid:15: the file ends where a vertex of an element should stand"),
        ("1.50", "nan", "tet.ugrid:5: vertex 4 has coordinate NaN"),
        ("12\n", "99999999999\n", "tet.ugrid:13: expected the reference of a face, found '99999999999'"),
    ] {
        assert_eq!(TET.matches(from).count(), 1, "{from:?} must name one spot");
        let error = read_bytes("tet.ugrid", TET.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{from:?} -> {to:?}\n expected: {expected}\n found:    {error}");
    }
    for name in ["meshio.lb8.ugrid", "meshio.b8l.ugrid", "meshio.b4.ugrid", "records.lr8.ugrid"] {
        let bytes = fs::read(data("mixed").join(name)).unwrap();
        for length in 1..bytes.len() {
            assert!(read_bytes(name, &bytes[..length]).is_err(), "{name} cut to {length} bytes");
        }
        // The wrong byte order or width makes absurd counts.
        for other in ["a.b8.ugrid", "a.lb8.ugrid", "a.b8l.ugrid", "a.lb8l.ugrid", "a.lr8.ugrid", "a.ugrid"] {
            if !name.ends_with(&other[1..]) {
                assert!(read_bytes(other, &bytes).is_err(), "{name} as {other}");
            }
        }
    }
}
