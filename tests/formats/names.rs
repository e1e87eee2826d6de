//! Names of families that a format cannot hold: they are changed, but stay apart, and the change
//! is told.

use super::*;

/// Names with control characters, white space at their ends, letters that mean something to a
/// format, and names that are equal without them. Of two long names one has a blank wherever a
/// format cuts them.
const ODD: [&[&str]; 8] = [
    &["wing\u{1}skin", "wing\u{2}skin", "wing\nskin"],
    &["wing", "wing ", " wing"],
    &["", "far field", "_"],
    &["a, 2=b", "c", "d, 4=e"],
    &["a&#45;b", "a--b", "a\"b%c#d!e"],
    &[
        "a b c d e f g h i j k l m n o p q r s t u v w x y z a b c d e f g h i j k l m n o p",
        "aa b c d e f g h i j k l m n o p q r s t u v w x y z a b c d e f g h i j k l m n o p",
        "a",
    ],
    &["\u{feff}wing", "wing\u{2003}", "wing\0"],
    &["30P30N slat", "_747", "747"],
];

const TARGETS: &[&str] = &[
    "a.msh",
    "a.su2",
    "a.vtu",
    "a.vtk",
    "a.mesh",
    "a.meshb",
    "a.ugrid",
    "a.lb8.ugrid",
    "polyMesh",
    #[cfg(feature = "cgns")]
    "a.cgns",
];

#[test]
fn odd_names_stay_apart_and_changes_are_told() {
    let mesh = boxed("box.v41.ascii.msh").mesh;
    for names in ODD {
        let file = MeshFile::from_mesh(TetMesh {
            families: names.iter().map(|&name| name.to_owned()).collect(),
            ..mesh.clone()
        });
        for target in TARGETS {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(target);
            file.write(&path, &mesh.vertices, &Fields::default()).unwrap();
            let again = read(&path).unwrap_or_else(|error| panic!("{names:?} to {target}: {error}")).mesh;
            let losses = file.losses(&path).unwrap();
            assert_eq!(again.families.len(), 3, "{names:?} to {target}: {:?}", again.families);
            for family in 0..3 {
                let is_told = losses.iter().any(|loss| {
                    loss.contains("names of families") || loss.contains(&format!("'{}' is called", names[family]))
                });
                let name = &again.families[family];
                assert!(name == names[family] || is_told, "{names:?} to {target}: {name:?}, {losses:?}");
                let n_faces = |mesh: &TetMesh| mesh.triangle_family.iter().filter(|of| of.index() == family).count();
                assert_eq!(n_faces(&again), n_faces(&mesh), "{names:?} to {target}");
            }
        }
    }
}

/// OpenFOAM's reader of words takes a digit, `-` or `.` for the begin of a number
/// (`ISstream::read`), and checkMesh then finds no patches.
///
/// Fails if such a name is written bare.
#[test]
fn no_patch_begins_like_a_number() {
    let mesh = boxed("box.v41.ascii.msh").mesh;
    for (names, expected) in [
        (["30P30N_slat", "-wing", ".wing"], ["_30P30N_slat", "_-wing", "_.wing"]),
        (["747", "_747", "1e5"], ["_747", "_747_2", "_1e5"]),
        (["wing-1", "x.2", "e5"], ["wing-1", "x.2", "e5"]),
    ] {
        let file = MeshFile::from_mesh(TetMesh { families: names.map(str::to_owned).to_vec(), ..mesh.clone() });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("polyMesh");
        file.write(&path, &mesh.vertices, &Fields::default()).unwrap();
        let boundary = fs::read_to_string(path.join("boundary")).unwrap();
        let found: Vec<&str> =
            boundary.lines().filter_map(|line| line.split_once(" { type patch;")).map(|of| of.0).collect();
        assert_eq!(found, expected);
        let losses = file.losses(&path).unwrap();
        for (name, new) in names.iter().zip(expected) {
            assert_eq!(losses.contains(&format!("the family '{name}' is called '{new}'")), *name != new, "{losses:?}");
        }
    }
}
