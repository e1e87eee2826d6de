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
    // Written back, both keep their bytes.
    for (name, mapbc) in [("moved.ugrid", "moved.mapbc"), ("other.ugrid.gz", "other.mapbc")] {
        file.write(&folder.path().join(name), &file.mesh.vertices, &Fields::default()).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join(mapbc)).unwrap(), NAMES);
    }
    assert_eq!(fs::read_to_string(folder.path().join("moved.ugrid")).unwrap(), TET);
    let new = folder.path().join("new.b8.ugrid");
    file.write(&new, &file.mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(fs::read_to_string(folder.path().join("new.mapbc")).unwrap(), "2\n1 0 wing_skin\n2 0 farfield\n");
    let losses = file.losses(Path::new("a.vtu")).unwrap();
    assert_eq!(losses, ["boundary conditions of the .mapbc file: not carried into the new file"]);

    let (_folder, path) = in_folder(None);
    assert_eq!(read(&path).unwrap().mesh.families, ["surface 7", "surface 12"]);
    for (text, expected) in [
        ("", "tet.mapbc:1: the file ends where the number of boundaries, or a reference and"),
        ("x\n", "tet.mapbc:2: the file ends where the number of boundaries, or a reference and"),
        ("a\nb\nc\nd\ne\n7 4000\n", "tet.mapbc:5: expected the number of boundaries, found 'e'"),
        ("1\n7 4000 wing\n12 5000 far\n", "tet.mapbc:3: expected the end of the file after 1 boundaries"),
        (
            "2\n7 4000 wing\n7 5000 far\n",
            "tet.mapbc:3: expected one line for each reference, found a second line for 7",
        ),
        ("7 4000 wing\n2\n12 5000 far\n", "tet.mapbc:2: expected the number of a boundary condition, found ''"),
        ("7 wing\n", "tet.mapbc:1: expected the number of a boundary condition, found 'wing'"),
        ("7 4000 wing\nfar 12\n", "tet.mapbc:2: expected the reference of a boundary, found 'far'"),
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

/// FUN3D's form and VGRID's, with and without comments and names; no line of a patch is taken for a
/// header.
///
/// Fails if a reference without a name and a family of another reference that is called like its
/// number are one family.
#[test]
fn both_forms_of_mapbc_are_read() {
    let header = "#Thu Nov 26 10:00:00 2026\n#tet.mapbc\nPatch #  BC  Family  #surf  surfIDs  Family\n#-----------\n";
    let patches = "7  4  1  1  3  wing skin\n12  5  2  0  0  farfield\n";
    for (text, expected) in [
        (format!("{header}{patches}"), ["wing skin", "farfield"]),
        (patches.to_string(), ["wing skin", "farfield"]),
        (header.replace('#', "") + patches, ["wing skin", "farfield"]),
        (patches.replace("1  1  3", "1  2  3  9"), ["wing skin", "farfield"]),
        (patches.replace("wing skin", "7"), ["7", "farfield"]),
        (patches.replace("wing skin", ""), ["surface 7", "farfield"]),
        // Without a name, and beside a family that is really called like the number.
        (patches.replace("wing skin", "surface 12").replace("farfield", ""), ["surface 12", "surface 12_2"]),
        (patches.replace("wing skin", "").replace("farfield", "surface 7"), ["surface 7_2", "surface 7"]),
        ("12 5000 surface 7\n".into(), ["surface 7_2", "surface 7"]),
        // Without the columns of VGRID; a name may begin with a number.
        ("7 4000 747 wing\n12 5000 far\n".into(), ["747 wing", "far"]),
        ("12 5000 far\n".into(), ["surface 7", "far"]),
        ("7 4000\n12 5000\n".into(), ["surface 7", "surface 12"]),
        ("# FUN3D\n! two\n\n3 ! of them\n7 -1 wing # skin\n\n12 5000 far\n13 4000 none\n".into(), ["wing", "far"]),
        ("1\n12 5000 far field".into(), ["surface 7", "far field"]),
        ("2\n7 4000 3 1 1 wing\n12 5000 far\n".into(), ["3 1 1 wing", "far"]),
    ] {
        let (_folder, path) = in_folder(Some(&text));
        assert_eq!(read(&path).unwrap_or_else(|error| panic!("{error}: {text}")).mesh.families, expected, "{text}");
    }
    let (folder, path) = in_folder(None);
    fs::write(folder.path().join("tet.mapbc"), b"2\n7 4 c\xf4t\xe9\n12 4 c\xf4t\xe8\n").unwrap();
    assert_eq!(read(&path).unwrap().mesh.families, ["c\u{f4}t\u{e9}", "c\u{f4}t\u{e8}"]);
}

/// The `.mapbc` of another mesh is neither left beside an output, where it would name its families,
/// nor overwritten.
#[test]
fn another_meshs_mapbc_is_refused() {
    let (folder, path) = in_folder(Some(NAMES));
    let file = read(&path).unwrap();
    let unnamed = read_bytes("elsewhere.ugrid", TET.as_bytes()).unwrap();
    let beside = folder.path().join("moved.mapbc");
    let refused = |file: &MeshFile, name: &str, expected: &str| {
        let there = fs::read(&beside).unwrap();
        let path = folder.path().join(name);
        for error in [
            file.check_output(&path).expect_err(name),
            file.write(&path, &file.mesh.vertices, &Fields::default()).expect_err(name),
        ] {
            let message = error.to_string();
            assert!(
                message.contains("moved.mapbc is there already and is not this mesh's") && message.contains(expected),
                "{message}"
            );
        }
        assert!(!path.exists() && fs::read(&beside).unwrap() == there, "{name}");
    };
    let taken = |file: &MeshFile, name: &str| {
        let there = fs::read(&beside).unwrap();
        file.check_output(&folder.path().join(name)).unwrap();
        file.write(&folder.path().join(name), &file.mesh.vertices, &Fields::default()).unwrap();
        assert!(fs::read(&beside).unwrap() == there, "{name}");
        fs::remove_file(folder.path().join(name)).unwrap();
    };
    fs::write(&beside, "2\n1 4000 mine\n2 0 farfield\n").unwrap();
    refused(&file, "moved.b8.ugrid", "it calls family 1 'mine', the mesh 'wing_skin'");
    refused(&file, "moved.ugrid", "it calls family 1 'mine', and the mesh has no such family");
    refused(&file, "moved.meshb.gz", "it calls family 1 'mine', the mesh 'wing_skin'");
    refused(&unnamed, "moved.ugrid.gz", "it calls family 1 'mine'");
    // A text file of Medit says the names itself, but other programs read the file beside.
    refused(&file, "moved.mesh", "it calls family 1 'mine', the mesh 'wing skin'");
    // Families that the mesh has not are another mesh's, and so are other conditions than its own.
    fs::write(&beside, NAMES.replace("4000", "3000")).unwrap();
    refused(&file, "moved.ugrid", "it gives family 7 the boundary condition 3000, the mesh 4000");
    fs::write(&beside, "7 4000 wing_skin\n12 5000 farfield # as before\n").unwrap();
    taken(&file, "moved.ugrid");
    fs::write(&beside, NAMES.replace("5000", "0")).unwrap();
    refused(&file, "moved.ugrid", "it gives family 12 the boundary condition 0, the mesh 5000");
    refused(&unnamed, "moved.ugrid", "it calls family 7 'wing skin', the mesh 'surface 7'");
    fs::write(&beside, "3\n1 3000 wing_skin\n2 5000 farfield\n3 0 tip\n").unwrap();
    refused(&file, "moved.lb8.ugrid", "it calls family 3 'tip', and the mesh has no such family");
    fs::write(&beside, "1 3000 wing_skin\n2 5000 farfield\n").unwrap();
    taken(&file, "moved.lb8.ugrid");
    taken(&file, "moved.meshb");
    taken(&file, "moved.mesh");
    fs::write(&beside, "3\n1 0 wing_skin\n").unwrap();
    refused(&file, "moved.lb8.ugrid", "it cannot be read: ");
    // A mesh without conditions takes those that are there.
    for names in ["2\n7 0 wing skin\n12 0 farfield\n", "2\n7 3 wing skin\n12 0 farfield\n"] {
        let (folder, path) = in_folder(Some("2\n7 0 wing skin\n12 0 farfield\n"));
        fs::write(folder.path().join("moved.mapbc"), names).unwrap();
        let file = read(&path).unwrap();
        file.write(&folder.path().join("moved.ugrid"), &file.mesh.vertices, &Fields::default()).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("moved.mapbc")).unwrap(), names);
    }
    // Two outputs of one name before their extensions have one such file.
    let together = |names: [&str; 2]| {
        let paths = names.map(|name| folder.path().join(name));
        file.check_beside(&[&paths[0], &paths[1]])
    };
    together(["new.ugrid", "new.ugrid.gz"]).unwrap();
    together(["new.lb8.ugrid", "new.meshb"]).unwrap();
    together(["new.ugrid", "newer.lb8.ugrid"]).unwrap();
    for names in ["new.lb8.ugrid", "new.meshb", "new.mesh"].map(|other| ["new.ugrid", other]) {
        let error = together(names).unwrap_err().to_string();
        assert!(error.contains("would both find their names in") && error.contains("new.mapbc"), "{error}");
    }
    // The same references, and the new file has no conditions.
    let (folder, path) = in_folder(Some("2\n1 4000 wing\n2 5000 farfield\n"));
    fs::write(&path, TET.replace("\n7", "\n1").replace("\n12", "\n2")).unwrap();
    let file = read(&path).unwrap();
    assert_eq!(file.mesh.families, ["wing", "farfield"]);
    let paths = ["new.lb8.ugrid", "new.ugrid"].map(|name| folder.path().join(name));
    let error = file.check_beside(&[&paths[0], &paths[1]]).unwrap_err().to_string();
    assert!(error.contains("have other numbers or boundary conditions"), "{error}");
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

/// Where a `.mapbc` with conditions is there and stays, no warning says that it has none.
#[test]
fn conditions_that_stay_are_not_said_to_be_lost() {
    let mesh = boxed("box.v41.ascii.msh").mesh;
    let file = MeshFile::from_mesh(mesh.clone());
    let here = tempfile::tempdir().unwrap();
    let (path, beside) = (here.path().join("x.lb8.ugrid"), here.path().join("x.mapbc"));
    let lost = "boundary conditions: the .mapbc file beside it gives every family the number 0";
    let is_told = || file.losses(&path).unwrap().iter().any(|loss| loss == lost);
    assert!(is_told());
    file.write(&path, &mesh.vertices, &Fields::default()).unwrap();
    assert!(is_told());
    let with_conditions = fs::read_to_string(&beside).unwrap().replace(" 0 ", " 3000 ");
    fs::write(&beside, &with_conditions).unwrap();
    assert!(!is_told());
    file.write(&path, &mesh.vertices, &Fields::default()).unwrap();
    assert_eq!(fs::read_to_string(&beside).unwrap(), with_conditions);
}

/// A tet 1e-4 high at a distance of 1e4: single precision has steps of 1e-3 there, and its fourth
/// vertex falls into the plane of the others. Such a mesh is not written into a file of single
/// precision, and nothing is left of the attempt. A format of double precision holds it.
#[test]
fn cells_that_single_precision_inverts_are_not_written() {
    let (folder, path) = in_folder(None);
    let file = read(&path).unwrap();
    let low = |at: &DVec3| DVec3::new(at.x + 1e4, at.y, 1e4 + at.z * 1e-4 / 1.5);
    let vertices: Vec<DVec3> = file.mesh.vertices.iter().map(low).collect();
    let single = folder.path().join("single.lb4.ugrid");
    let error = file.write(&single, &vertices, &Fields::default()).unwrap_err();
    assert!(matches!(error, WriteError::Rounded { count: 1, .. }), "{error}");
    assert!(error.to_string().contains("would invert 1 of the cells, the first at (10000.25, "), "{error}");
    assert!(!single.exists() && !folder.path().join("single.mapbc").exists());
    file.write(&folder.path().join("double.lb8.ugrid"), &vertices, &Fields::default()).unwrap();
    // Where the rounding does no harm, the file is written.
    file.write(&single, &file.mesh.vertices, &Fields::default()).unwrap();
}
