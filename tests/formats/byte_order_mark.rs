//! Editors on Windows put a byte order mark before a text.

use super::*;

/// Text files of other programs are the same mesh with the mark, and are written back with it.
///
/// Fails if a reader takes the mark for a letter.
#[test]
fn a_byte_order_mark_before_a_text_is_passed_over() {
    for name in [
        "gmsh.su2",
        "gmsh.v22.ascii.msh",
        "gmsh.v41.ascii.msh",
        "gmsh.ascii.vtk",
        "vtk.42.ascii.vtk",
        "vtk.ascii.vtu",
        "meshio.mesh",
        "meshio.ugrid",
    ] {
        let plain = bytes(&format!("mixed/{name}"));
        let marked = ["\u{feff}".as_bytes(), &plain].concat();
        let output = format!("moved.{}", name.rsplit_once('.').unwrap().1);
        let [expected, file] = [&plain, &marked].map(|bytes| {
            let file = formats::read_bytes(Path::new(&output), bytes.clone());
            file.unwrap_or_else(|error| panic!("{name}: {error}"))
        });
        assert!(file.mesh.vertices == expected.mesh.vertices && file.mesh.tets == expected.mesh.tets, "{name}");
        assert!(file.mesh.triangles == expected.mesh.triangles && file.others == expected.others, "{name}");
        assert_eq!(file.mesh.families, expected.mesh.families, "{name}");
        assert!(written(&file, &output, &file.mesh.vertices) == marked, "{name}: written back differently");
        let vertices: Vec<DVec3> = file.mesh.vertices.iter().map(|at| *at + DVec3::new(0.25, 0.0, at.x)).collect();
        let after = written(&file, &output, &vertices);
        assert!(after.starts_with("\u{feff}".as_bytes()), "{name}");
        assert!(after[3..] == written(&expected, &output, &vertices), "{name}");
    }
}

/// The names beside a mesh, and a folder whose every file has the mark.
#[test]
fn files_beside_a_mesh_may_have_the_mark_too() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("a.ugrid");
    fs::copy(data("mixed/meshio.ugrid"), &mesh).unwrap();
    let names = |mark: &str| {
        fs::write(folder.path().join("a.mapbc"), format!("{mark}2\n1 4000 wing\n2 5000 far\n")).unwrap();
        read_mixed(&mesh).unwrap().mesh.families
    };
    assert_eq!(names("\u{feff}"), names(""));
    let foam = folder.path().join("polyMesh");
    fs::create_dir(&foam).unwrap();
    for entry in fs::read_dir(data("mixed/foam.ascii/constant/polyMesh")).unwrap() {
        let entry = entry.unwrap();
        let text = ["\u{feff}".as_bytes(), &fs::read(entry.path()).unwrap()].concat();
        fs::write(foam.join(entry.file_name()), text).unwrap();
    }
    let [plain, marked] =
        [data("mixed/foam.ascii/constant/polyMesh/points"), foam].map(|path| read_mixed(&path).unwrap().mesh);
    assert!(plain.vertices == marked.vertices && plain.tets == marked.tets && plain.families == marked.families);
}
