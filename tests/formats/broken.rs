//! Broken Gmsh files: each is refused with a message that leads to the spot, and nothing makes the
//! reader panic.

use super::*;

/// One tet with its four triangles, version 4.1. Line 1 is `$MeshFormat`.
pub const TET_41: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 5 \"wing skin\"
3 9 \"fluid\"
$EndPhysicalNames
$Entities
0 0 1 1
1 0 0 0 1 1 1 1 5 0
1 0 0 0 1 1 1 1 9 1 1
$EndEntities
$Nodes
1 4 1 4
3 1 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
0 0 1
$EndNodes
$Elements
2 5 1 5
2 1 2 4
1 1 3 2
2 1 2 4
3 2 3 4
4 1 4 3
3 1 4 1
5 1 2 3 4
$EndElements
";

/// The same in version 2.2.
pub const TET_22: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
2 5 \"wing skin\"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
$EndNodes
$Elements
5
1 2 2 5 1 1 3 2
2 2 2 5 1 1 2 4
3 2 2 5 1 2 3 4
4 2 2 5 1 1 4 3
5 4 2 9 1 1 2 3 4
$EndElements
";

/// A message without the folder of the file.
fn message(bytes: &[u8]) -> String {
    let error = read_bytes("tet.msh", bytes).expect_err("a broken file was read").to_string();
    error.rsplit('/').next().unwrap().to_string()
}

#[test]
fn the_unbroken_tets_are_read() {
    for text in [TET_41, TET_22] {
        let mesh = read_bytes("tet.msh", text.as_bytes()).unwrap().mesh;
        assert_eq!(mesh.tets, [[0, 1, 2, 3]]);
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
        assert_eq!(mesh.families, ["wing skin"]);
        assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    }
}

/// Each row: what is replaced by what, and the message.
#[test]
fn broken_files_are_refused_with_their_place() {
    let of_41 = [
        ("4.1 0 8", "4.0 0 8", "tet.msh: Gmsh version 4.0 is not read; save it as version 4.1: gmsh old.msh -save"),
        ("4.1 0 8", "abc 0 8", "tet.msh:2: expected the version of the format, such as 4.1, found 'abc'"),
        ("4.1 0 8", "4.1 2 8", "tet.msh:2: expected 0 (ascii) or 1 (binary), found 2"),
        ("4.1 0 8", "4.1 1 8", "tet.msh: byte 20: expected the number 1 in binary (the header says binary), found"),
        ("4.1 0 8", "4.1 1 4", "tet.msh: binary with numbers of 4 bytes is not read; save it with a 64-bit Gmsh"),
        ("$MeshFormat", "$NOD", "tet.msh: Gmsh version 1 is not read; save it as version 4.1"),
        ("$EndMeshFormat", "$EndFormat", "tet.msh:3: expected $EndMeshFormat, found '$EndFormat'"),
        ("2\n2 5 \"wing", "x\n2 5 \"wing", "tet.msh:5: expected the number of physical names, found 'x'"),
        ("2 5 \"wing skin\"", "2 \"wing skin\"", "tet.msh:6: expected the tag of a physical group, found '\"wing'"),
        ("0 0 1 1\n", "0 0 9999 1\n", "tet.msh:10: the number of entities is 9999, but only"),
        ("1 4 1 4\n3", "1 99999999999 1 4\n3", "tet.msh:15: the number of nodes is 99999999999, but only"),
        ("1 4 1 4\n3", "1 99999999999999999999 1 4\n3", "tet.msh:15: expected the number of nodes, found '99999"),
        ("1 4 1 4\n3", "1 5 1 4\n3", "tet.msh:24: expected 5 nodes, as the section declares, found 4"),
        ("3 1 0 4", "3 1 0 3", "tet.msh:23: expected 4 nodes, as the section declares, found 3"),
        ("3 1 0 4", "4 1 0 4", "tet.msh:16: expected the dimension of a node block, 0 to 3, found 4"),
        ("3 1 0 4", "3 1 2 4", "tet.msh:16: expected whether a node block is parametric, 0 or 1, found 2"),
        ("3 1 0 4", "3 1 1 4", "tet.msh:25: expected a coordinate, found '$EndNodes'"),
        ("3\n4\n0", "3\n-4\n0", "tet.msh:20: expected a node tag, found '-4'"),
        ("3\n4\n0", "3\n3\n0", "tet.msh:24: the vertex with these coordinates has tag 3, which an earlier vertex has"),
        ("0 1 0\n0 0 1", "0 nan 0\n0 0 1", "tet.msh:23: vertex 3 has coordinate NaN, not a finite number"),
        ("0 1 0\n0 0 1", "0 1 -inf\n0 0 1", "tet.msh:23: vertex 3 has coordinate -inf, not a finite number"),
        ("0 1 0\n0 0 1", "0 1e999 0\n0 0 1", "tet.msh:23: vertex 3 has coordinate inf, not a finite number"),
        ("0 1 0\n0 0 1", "0 1,5 0\n0 0 1", "tet.msh:23: expected a coordinate, found '1,5'"),
        ("$EndNodes", "$EndNode", "tet.msh:25: expected $EndNodes, found '$EndNode'"),
        ("5 1 2 3 4", "5 1 2 3 7", "tet.msh:34: tet 5 names vertex 7, but the file defines 4 vertices with tags 1..=4"),
        ("3 2 3 4", "3 2 0 4", "tet.msh:31: triangle 3 names vertex 0, but the file defines 4 vertices"),
        ("2 5 1 5", "2 6 1 6", "tet.msh:34: expected 6 elements, as the section declares, found 5"),
        ("3 1 4 1\n5 1 2 3 4", "3 1 16 1\n5 1 2 3 4 1 2 3 4", "a mesh with 1 second-order quadrilaterals is not"),
        ("3 1 4 1\n", "3 1 11 1\n", "tet.msh:35: expected a node tag, found '$EndElements'"),
        (
            "3 1 4 1\n",
            "3 1 29 1\n",
            "tet.msh:33: expected an element type that idmesh reads (2: triangle, 4: tet), found",
        ),
        ("1 1 1 1 5 0", "1 1 1 0 0", "tet.msh: 4 of 4 triangles belong to no physical group (the first on surface 1)"),
        ("1 1 1 1 5 0", "1 1 1 2 5 6 0", "surface 1 is in two physical groups, 'wing skin' and 'surface 6'"),
        ("$Nodes\n", "$Elements\n", "tet.msh:14: expected $Nodes before $Elements, found '$Elements'"),
        ("$Elements\n2 5 1 5", "$Nodes\n2 5 1 5", "tet.msh:26: expected one $Nodes section, found a second one"),
        ("$Elements\n", "$Elemente\n", "the file ends where $EndElemente should stand"),
        ("$Elements\n", "$\n", "tet.msh:26: expected the name of a section, found '$'"),
    ];
    let of_22 = [
        ("4\n1 0 0 0", "5\n1 0 0 0", "tet.msh:14: expected a node tag, found '$EndNodes'"),
        ("4\n1 0 0 0", "3\n1 0 0 0", "tet.msh:13: expected $EndNodes, found '4'"),
        ("4\n1 0 0 0", "-4\n1 0 0 0", "tet.msh:9: expected the number of nodes, found '-4'"),
        ("5\n1 2 2 5", "6\n1 2 2 5", "tet.msh:22: expected an element tag, found '$EndElements'"),
        ("5\n1 2 2 5", "4\n1 2 2 5", "tet.msh:21: expected $EndElements, found '5'"),
        ("2 2 2 5 1 1 2 4", "2 2 2 0 1 1 2 4", "1 of 4 triangles belong to no physical group (the first at [0, 0, 0])"),
        ("2 2 2 5 1 1 2 4", "2 2 0 1 2 4", "tet.msh: 1 of 4 triangles belong to no physical group"),
        ("2 2 2 5 1 1 2 4", "2 2 999 5 1 1 2 4", "tet.msh:18: the number of tags is 999, but only"),
        (
            "2 2 2 5 1 1 2 4",
            "2 2 2 6 1 1 2 3",
            "triangle at [0, 0, 0] is in two physical groups, 'wing skin' and 'surf",
        ),
        ("5 4 2 9 1 1 2 3 4", "5 15 2 9 1 1", "tet.msh: the file has no tets; mesh the volume"),
        ("5 4 2 9 1 1 2 3 4", "5 3 2 0 1 1 2 3 4", "tet.msh: the file has no tets; mesh the volume"),
    ];
    let rows = of_41.iter().map(|row| (TET_41, row)).chain(of_22.iter().map(|row| (TET_22, row)));
    let mut wrong = String::new();
    for (text, (from, to, expected)) in rows {
        assert_eq!(text.matches(from).count(), 1, "{from:?} must name one spot");
        let found = message(text.replace(from, to).as_bytes());
        if !found.contains(expected) {
            wrong += &format!("{from:?} -> {to:?}\n expected: {expected}\n found:    {found}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    let no_triangles = TET_22.replace(" 2 2 5 1", " 1 2 5 1").replace("5\n1 1 2 5 1 1 3 2", "5\n1 1 2 5 1 1 3");
    let no_triangles =
        no_triangles.replace("1 2 4\n3", "1 2\n3").replace("2 3 4\n4", "2 3\n4").replace("1 4 3\n", "1 4\n");
    assert!(message(no_triangles.as_bytes()).contains("the file has no boundary triangles"));
}

#[test]
fn files_that_are_no_mesh_are_refused() {
    assert_eq!(message(b""), "tet.msh: the file is empty");
    assert!(message(b"solid wing\nendsolid\n").contains("the file has no $MeshFormat section"));
    assert!(message(&[0xff; 1000]).contains("the file has no $MeshFormat section"));
    assert!(message(b"$Nodes\n1\n").contains("tet.msh:1: expected $MeshFormat, found '$Nodes'"));
    assert!(message(b"\x1f\x8b\x08\x00broken").contains("tet.msh: "));
    let error = |name| read(&data(name)).unwrap_err();
    assert!(matches!(error("missing.msh"), ReadError::Io { .. }));
    assert!(matches!(error("."), ReadError::UnknownFormat { .. }));
    let unknown = error("wing.stl.gz").to_string();
    assert!(unknown.contains("unknown mesh format; known are .msh (Gmsh), .su2 (SU2)"), "{unknown}");
    let listed = read_bytes("wing.pvtu", &[0; 9]).unwrap_err().to_string();
    assert!(listed.contains("wing.pvtu: a list of files (.pvtu) is not read; merge them (in ParaView:"), "{listed}");
    if cfg!(not(feature = "cgns")) {
        let left_out = read_bytes("wing.CGNS.gz", &[0; 9]).unwrap_err().to_string();
        assert!(left_out.contains("CGNS is not read; install an idmesh with it"), "{left_out}");
    }
}

/// A header that says binary over text, and the other way round.
#[test]
fn text_and_binary_are_not_confused() {
    for (name, from, to) in [
        ("box.v41.ascii.msh", "4.1 0 8\n", "4.1 1 8\n"),
        ("box.v22.ascii.msh", "2.2 0 8\n", "2.2 1 8\n"),
        ("box.v41.binary.msh", "4.1 1 8\n", "4.1 0 8\n"),
        ("box.v22.binary.msh", "2.2 1 8\n", "2.2 0 8\n"),
    ] {
        let mut bytes = bytes(name);
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        message(&bytes);
    }
}

/// The largest counts that fit the type must neither be allocated nor overflow.
#[test]
fn absurd_binary_counts_are_refused() {
    let plain = bytes("box.v41.binary.msh");
    let at = plain.windows(7).position(|window| window == b"$Nodes\n").unwrap() + 7;
    for count in [u64::MAX, 1 << 63, u64::MAX / 32 + 1, 1 << 40] {
        let mut bytes = plain.clone();
        bytes[at + 8..at + 16].copy_from_slice(&count.to_le_bytes());
        assert!(message(&bytes).contains(&format!("byte {}: the number of nodes is {count}, but only", at + 8)));
    }
}

/// All up to the end of `$EndElements` is needed; what follows (`$Periodic`) is not read.
#[test]
fn truncated_files_are_refused() {
    for name in BOXES {
        let bytes = bytes(name);
        let marker = b"$EndElements";
        let needed = bytes.windows(marker.len()).position(|window| window == marker).unwrap() + marker.len();
        assert!(read_bytes("tet.msh", &bytes[..needed]).is_ok());
        for length in (0..needed).step_by(37).chain(needed - 40..needed) {
            assert!(read_bytes("tet.msh", &bytes[..length]).is_err(), "{name} cut to {length} of {needed} bytes");
        }
    }
    let zipped = zipped(TET_41.as_bytes());
    for length in 2..zipped.len() {
        let found = message(&zipped[..length]);
        let expected = "tet.msh: cannot be unzipped, the file is damaged or cut short: ";
        assert!(found.starts_with(expected), "gzip cut to {length} bytes: {found}");
    }
}

/// Random damage gives an error or another mesh, never a panic; and what is read can be written.
#[test]
fn damaged_files_do_not_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % below
    };
    let mut n_read = 0;
    for round in 0..4000 {
        let mut bytes = bytes(BOXES[round % BOXES.len()]);
        for _ in 0..1 + random(4) {
            let at = random(bytes.len().max(1));
            if at >= bytes.len() {
                break;
            }
            match random(4) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes[at] = *b"0-$\n \xff"[..].get(random(6)).unwrap(),
                2 => bytes.truncate(at),
                _ => drop(bytes.drain(at..(at + random(9)).min(bytes.len()))),
            }
        }
        if let Ok(file) = read_bytes("tet.msh", &bytes) {
            n_read += 1;
            assert!(written(&file, "tet.msh", &file.mesh.vertices) == bytes, "round {round}: written back differently");
        }
    }
    assert!((100..3900).contains(&n_read), "{n_read} of 4000 damaged files were read: the damage is not worth testing");
}
