//! OpenFOAM cases: their folders, parts of divided meshes, zipped files, and dictionaries as they
//! are found.

use super::*;

/// A case with the tets of a small mesh.
fn case(folder: &Path) -> PathBuf {
    fs::create_dir_all(folder.join("constant")).unwrap();
    let mesh = folder.join("constant/polyMesh");
    let file = boxed("box.v22.ascii.msh");
    file.write(&mesh, &file.mesh.vertices, &Fields::default()).unwrap();
    mesh
}

fn replace(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{from:?} is not in {text}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_case_stands_for_its_mesh() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("base");
    let mesh = case(&folder);
    let expected = read(&mesh).unwrap();
    for path in [folder.clone(), folder.join("constant"), mesh.join("points"), folder.join("constant/.")] {
        let file = read(&path).unwrap();
        assert!(file.mesh == expected.mesh && file.warnings().is_empty(), "{}", path.display());
    }
    assert_eq!(formats::mesh_path(&folder), mesh);
    assert_eq!(formats::mesh_path(&mesh), mesh);
    // An output is a folder with the name polyMesh, as before.
    let error = expected.check_output(&out.path().join("moved")).unwrap_err();
    assert!(matches!(error, WriteError::UnknownFormat { .. }), "{error}");
    // A folder without a mesh.
    fs::rename(&mesh, folder.join("constant/mesh")).unwrap();
    assert!(matches!(read(&folder), Err(ReadError::UnknownFormat { .. })));
}

#[test]
fn parts_of_a_divided_mesh_are_warned_of() {
    let out = tempfile::tempdir().unwrap();
    for (name, is_part) in [("processor0", true), ("processor12", true), ("processors", false), ("processorX", false)] {
        let folder = out.path().join(name);
        let mesh = case(&folder);
        for path in [&folder, &mesh] {
            let warnings = read(path).unwrap().warnings().to_vec();
            assert_eq!(!warnings.is_empty(), is_part, "{name}: {warnings:?}");
            assert!(warnings.iter().all(|warning| warning.contains("one part of a divided mesh")), "{warnings:?}");
        }
    }
    // A patch between two parts, in a folder with another name.
    let mesh = case(&out.path().join("renamed"));
    replace(&mesh.join("boundary"), "type patch;", "type processor;");
    assert_eq!(read(&mesh).unwrap().warnings().len(), 1);
    replace(&mesh.join("owner"), "class labelList;", "class decomposedBlockData;");
    let error = read(&mesh).unwrap_err().to_string();
    assert!(
        error.contains("owner: a file with the parts of a divided mesh (class decomposedBlockData) is not re"),
        "{error}"
    );
}

/// Zipped members are read, and written back as they are; zipped points stay zipped.
#[test]
fn zipped_members_are_read_and_kept() {
    let out = tempfile::tempdir().unwrap();
    let mesh = case(&out.path().join("base"));
    let plain = read(&mesh).unwrap();
    let mut others = Vec::new();
    for name in ["faces", "owner", "neighbour", "boundary"] {
        let zipped = zipped(&fs::read(mesh.join(name)).unwrap());
        fs::remove_file(mesh.join(name)).unwrap();
        fs::write(mesh.join(format!("{name}.gz")), &zipped).unwrap();
        others.push((format!("{name}.gz"), zipped));
    }
    assert!(read(&mesh).unwrap().mesh == plain.mesh);
    let points = fs::read(mesh.join("points")).unwrap();
    fs::remove_file(mesh.join("points")).unwrap();
    fs::write(mesh.join("points.gz"), zipped(&points)).unwrap();
    for path in [mesh.clone(), mesh.join("points.gz"), out.path().join("base")] {
        let file = read(&path).unwrap();
        assert!(file.mesh == plain.mesh);
        let target = out.path().join("polyMesh");
        let mut vertices = file.mesh.vertices.clone();
        vertices[0].x += 0.25;
        file.write(&target, &vertices, &Fields::default()).unwrap();
        let moved = read(&target).unwrap().mesh;
        assert_eq!((moved.vertices, moved.triangles), (vertices, plain.mesh.triangles.clone()));
        for (name, bytes) in &others {
            assert!(fs::read(target.join(name)).unwrap() == *bytes, "{name}");
        }
    }
}

/// Sub-dictionaries, texts in quotes and comments in the header and in patches: the same mesh, and
/// the same bytes.
#[test]
fn dictionaries_are_read_as_they_are_found() {
    let out = tempfile::tempdir().unwrap();
    let mesh = case(&out.path().join("base"));
    let plain = read(&mesh).unwrap().mesh;
    let name = plain.families[1].clone();
    for file in ["points", "faces", "owner", "neighbour", "boundary"] {
        let meta = "meta { nPoints 7; inner { a \"}\"; /* } */ b { } } c (1 2 { 3 }); }";
        replace(&mesh.join(file), "format ascii;", &format!("{meta} \"format\" \"ascii\";"));
    }
    let boundary = mesh.join("boundary");
    replace(&boundary, "nFaces", "transform { type none; nFaces 7; } rule \"a;b\"; nFaces");
    replace(&boundary, &name, "\"left; {side}\"");
    let file = read(&mesh).unwrap();
    assert_eq!(file.mesh.families[1], "left; {side}");
    assert_eq!(file.mesh.triangle_family, plain.triangle_family);
    assert_eq!((&file.mesh.tets, &file.mesh.triangles), (&plain.tets, &plain.triangles));
    let target = out.path().join("polyMesh");
    file.write(&target, &file.mesh.vertices, &Fields::default()).unwrap();
    for name in ["points", "faces", "owner", "neighbour", "boundary"] {
        assert!(fs::read(target.join(name)).unwrap() == fs::read(mesh.join(name)).unwrap(), "{name}");
    }
    // A dictionary or a text that does not end.
    let whole = fs::read_to_string(&boundary).unwrap();
    for (from, to, expected) in [
        ("nFaces 7; } rule", "nFaces 7; { rule", "the file ends where the '}' that ends a dictionary should stand"),
        ("{side}\"", "{side}", "boundary:"),
    ] {
        replace(&boundary, from, to);
        let error = read(&mesh).unwrap_err().to_string();
        assert!(error.contains(expected), "{from}: {error}");
        fs::write(&boundary, &whole).unwrap();
    }
}

#[test]
fn directives_are_named() {
    let out = tempfile::tempdir().unwrap();
    let mesh = case(&out.path().join("base"));
    let directive = "the directive '#include', which idmesh does not follow";
    for (file, from, to, expected) in [
        ("boundary", "nFaces", "#include \"counts\"\nnFaces", "expected an entry of a patch, written out in the file"),
        ("boundary", "(\n", "(\n#include \"patches\"\n", "expected the name of a patch, written out in the file"),
        ("points", "format", "#include \"header\"\nformat", "expected an entry of the header, written out in the file"),
        ("owner", "(\n", "(\n#include \"cells\"\n", "expected an index, written out in the file"),
        ("points", "(\n", "(\n#include \"cells\"\n", "expected the contents of the mesh, written out in the file"),
    ] {
        let whole = fs::read_to_string(mesh.join(file)).unwrap();
        replace(&mesh.join(file), from, to);
        let error = read(&mesh).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains(directive), "{file}: {error}");
        fs::write(mesh.join(file), whole).unwrap();
    }
}
