//! VTU files: their arrays are taken apart again here and compared with what went in.

use super::*;

/// The appended arrays by part and name, such as `Cells/types`, as raw bytes.
fn arrays(file: &[u8]) -> Vec<(String, Vec<u8>)> {
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let head = file.windows(marker.len()).position(|window| window == marker).unwrap();
    let appended = &file[head + marker.len()..];
    let head = std::str::from_utf8(&file[..head]).unwrap();
    let mut arrays = Vec::new();
    let mut part = "";
    let mut end = 0;
    for line in head.lines() {
        let attribute = |name: &str| {
            let start = line.find(&format!("{name}=\"")).unwrap() + name.len() + 2;
            line[start..].split('"').next().unwrap()
        };
        if line.starts_with("<DataArray") {
            let offset: usize = attribute("offset").parse().unwrap();
            assert_eq!(offset, end, "arrays follow one another");
            let length = u64::from_le_bytes(appended[offset..offset + 8].try_into().unwrap()) as usize;
            end = offset + 8 + length;
            arrays.push((format!("{part}/{}", attribute("Name")), appended[offset + 8..end].to_vec()));
        } else {
            part = line.trim_matches(['<', '>']);
        }
    }
    assert_eq!(&appended[end..], b"\n</AppendedData>\n</VTKFile>\n");
    arrays
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect()
}

fn ints(bytes: &[u8]) -> Vec<i32> {
    bytes.chunks_exact(4).map(|bytes| i32::from_le_bytes(bytes.try_into().unwrap())).collect()
}

fn longs(bytes: &[u8]) -> Vec<i64> {
    bytes.chunks_exact(8).map(|bytes| i64::from_le_bytes(bytes.try_into().unwrap())).collect()
}

/// Two tets on a common triangle; families `a--b` and `c`; vertex 4 touches only `c`, vertex 5 is
/// used by no triangle.
fn two_tets() -> TetMesh {
    TetMesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::splat(0.25)],
        tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
        triangles: vec![[1, 2, 4], [0, 2, 1], [2, 3, 4]],
        triangle_family: vec![FamilyId(1), FamilyId(0), FamilyId(1)],
        families: vec!["a--b".into(), "c".into()],
    }
}

#[test]
fn arrays_hold_the_mesh_and_the_fields() {
    let mesh = two_tets();
    let displacement: Vec<DVec3> = (0..6).map(|vertex| DVec3::new(vertex as f64, 0.5, -1.0 / 3.0)).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.vtu");
    let fields = Fields { displacement: Some(&displacement), beta: Some(&[0.1, -0.2]), ..Fields::default() };
    MeshFile::from_mesh(mesh.clone()).write(&path, &mesh.vertices, &fields).unwrap();
    let file = fs::read(&path).unwrap();
    let arrays = arrays(&file);
    let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
    let expected = ["Points/Points", "Cells/connectivity", "Cells/offsets", "Cells/types"];
    assert_eq!(names[..4], expected);
    assert_eq!(names[4..], ["PointData/family", "PointData/displacement", "CellData/family", "CellData/beta"]);
    let flat = |vectors: &[DVec3]| vectors.iter().flat_map(|vector| vector.to_array()).collect::<Vec<_>>();
    assert_eq!(doubles(&arrays[0].1), flat(&mesh.vertices));
    assert_eq!(longs(&arrays[1].1), [0, 1, 2, 3, 1, 2, 3, 4, 1, 2, 4, 0, 2, 1, 2, 3, 4]);
    assert_eq!(longs(&arrays[2].1), [4, 8, 11, 14, 17]);
    assert_eq!(arrays[3].1, [10, 10, 5, 5, 5]);
    assert_eq!(ints(&arrays[4].1), [1, 1, 1, 2, 2, 0]);
    assert_eq!(doubles(&arrays[5].1), flat(&displacement));
    assert_eq!(ints(&arrays[6].1), [0, 0, 2, 1, 2]);
    assert_eq!(doubles(&arrays[7].1), [0.1, -0.2, 0.0, 0.0, 0.0]);
    // "--" would end an XML comment.
    let comment = b"<!-- families: 1=a&#45;&#45;b, 2=c -->";
    assert!(file.windows(comment.len()).any(|window| window == comment));
}

/// Arrays longer than a write block (64 KiB), and no optional fields.
#[test]
fn large_arrays_are_complete() {
    let file = boxed("small.msh.gz");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.vtu");
    file.write(&path, &file.mesh.vertices, &Fields::default()).unwrap();
    let arrays = arrays(&fs::read(&path).unwrap());
    assert_eq!(arrays.len(), 6);
    let corners: Vec<u32> =
        file.mesh.tets.iter().flatten().chain(file.mesh.triangles.iter().flatten()).copied().collect();
    assert_eq!(longs(&arrays[1].1), corners.iter().map(|&vertex| i64::from(vertex)).collect::<Vec<_>>());
    assert_eq!(ints(&arrays[5].1).iter().filter(|&&family| family == 1).count(), 691);
}

#[test]
fn some_cells_can_be_written() {
    let mesh = two_tets();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.vtu");
    let cells = Cells { tets: &mesh.tets[1..], triangles: &[], triangle_family: &[], families: &[] };
    write_vtu(&path, &mesh.vertices, &cells, &Fields { beta: Some(&[0.3]), ..Fields::default() }).unwrap();
    let arrays = arrays(&fs::read(&path).unwrap());
    assert_eq!(longs(&arrays[1].1), [1, 2, 3, 4]);
    assert_eq!(doubles(&arrays[6].1), [0.3]);
}

/// An appended array of points that says it has some bytes more than its numbers.
#[test]
fn arrays_hold_whole_numbers() {
    let bytes = fs::read(data("mixed/vtk.raw.vtu")).unwrap();
    let size = 288u32.to_le_bytes();
    let marker = b"<AppendedData encoding=\"raw\">\n   _";
    let start = bytes.windows(marker.len()).position(|window| window == marker).unwrap() + marker.len();
    let at = start + 324;
    assert_eq!(bytes[at..at + 4], size, "the points stand at offset 324");
    let mut broken = bytes.clone();
    broken[at] += 3;
    let error = read_bytes("a.vtu", &broken).unwrap_err().to_string();
    assert!(error.contains("expected the array 'Points' of numbers of 8 bytes, found 291 bytes"), "{error}");
}

/// Every piece has points of its own; together they are the vertices of one mesh, and each copy
/// moves.
#[test]
fn pieces_are_one_mesh() {
    let whole = read_mixed(&data("mixed/vtk.raw.vtu")).unwrap();
    for (name, n_points) in [("vtk.pieces.ascii.vtu", 24), ("vtk.pieces.raw.vtu", 34), ("vtk.pieces.zlib.vtu", 24)] {
        let before = fs::read(data("mixed").join(name)).unwrap();
        let text = String::from_utf8_lossy(&before);
        let counts = text.split("NumberOfPoints=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
        assert_eq!(counts.map(|count| count.parse::<usize>().unwrap()).sum::<usize>(), n_points, "{name}");
        let file = read_bytes(name, &before).unwrap();
        assert_eq!(file.mesh.vertices.len(), whole.mesh.vertices.len(), "{name}");
        assert_eq!(file.mesh.tets.len() + file.others.n_cells(), 4, "{name}");
        let corner = file.mesh.vertices.iter().position(|&vertex| vertex == DVec3::ONE).unwrap();
        let mut vertices = file.mesh.vertices.clone();
        vertices[corner].y = 1.25;
        let after = written(&file, name, &vertices);
        let again = read_bytes(name, &after).unwrap();
        assert_eq!(
            (again.mesh.vertices, again.mesh.tets, again.others),
            (vertices, file.mesh.tets, file.others),
            "{name}"
        );
        if name.contains("raw") {
            assert_eq!(before.len(), after.len());
            let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
            // 1 and 1.25 in single precision differ in one byte, in each of the three pieces.
            assert_eq!(changed, 3, "{name}");
        }
    }
}

/// Pieces that are no parts of one mesh.
#[test]
fn pieces_that_repeat_cells_or_share_bytes_are_refused() {
    let text = fs::read_to_string(data("mixed/vtk.pieces.ascii.vtu")).unwrap();
    let ghosts =
        "<DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0 0 0 0 0 0 0 0 1</DataArray></CellData>";
    let error = |text: &[u8]| read_bytes("a.vtu", text).unwrap_err().to_string();
    let found = error(text.replacen("</CellData>", ghosts, 1).as_bytes());
    assert!(
        found.contains("a.vtu: a file of pieces with ghost cells is not read; save it without them, or merge"),
        "{found}"
    );
    let none = ghosts.replace(" 1<", " 0<");
    assert!(read_bytes("a.vtu", text.replacen("</CellData>", &none, 1).as_bytes()).is_ok());

    let mut bytes = fs::read(data("mixed/vtk.pieces.raw.vtu")).unwrap();
    let marker = b"Name=\"Points\"";
    let places: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(marker)).collect();
    let offset =
        |bytes: &[u8], at: usize| at + bytes[at..].windows(8).position(|part| part == b"offset=\"").unwrap() + 8;
    let [first, second] = [places[0], places[1]].map(|at| offset(&bytes, at));
    bytes.copy_within(first..first + 4, second);
    let found = error(&bytes);
    assert!(found.contains("a file of pieces that are encoded differently or overlap is not read; merge"), "{found}");
}

/// Arrays of a motion are copied as they are when the mesh is moved again, so a warning tells of
/// them. An array with one of their names alone may be somebody else's.
#[test]
fn arrays_of_an_earlier_motion_are_told() {
    let file = read_mixed(&data("mixed/vtk.ascii.vtu")).unwrap();
    let of_motion = |fields: &Fields| {
        let mut bytes = Vec::new();
        let mesh = MeshFile::from_cells(file.mesh.clone(), file.others.clone());
        mesh.write_to(&mut bytes, Path::new("a.vtu"), &file.mesh.vertices, fields).unwrap();
        read_bytes("a.vtu", &bytes).unwrap().warnings().join(", ")
    };
    let (displacement, beta) = (vec![DVec3::X; file.mesh.vertices.len()], vec![0.1; file.mesh.tets.len()]);
    let one = Fields { beta: Some(&beta), ..Fields::default() };
    assert_eq!(of_motion(&one), "");
    let told = of_motion(&Fields { displacement: Some(&displacement), ..one });
    assert!(told.contains("the arrays `beta`, `displacement` seem to tell of an earlier motion"), "{told}");
}
