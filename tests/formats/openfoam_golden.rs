//! Meshes that OpenFOAM 1912 wrote, through `data/make_openfoam.sh`. The counts are those of its
//! `checkMesh`.

use super::*;

fn folder(case: &str) -> PathBuf {
    data("openfoam").join(case)
}

/// The files of a folder and their contents.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect();
    files.sort();
    files
}

/// A copy of a case's mesh in a folder `polyMesh`, so that its name tells the format.
fn case(name: &str) -> (tempfile::TempDir, PathBuf) {
    let here = tempfile::tempdir().unwrap();
    let path = here.path().join("polyMesh");
    fs::create_dir(&path).unwrap();
    for (file, bytes) in files(&folder(name)) {
        fs::write(path.join(file), bytes).unwrap();
    }
    (here, path)
}

/// A case, its vertices, tets, other cells and faces on the boundary (internal and all faces are
/// `checkMesh`'s), and its families.
type Golden = (&'static str, usize, usize, &'static [(&'static str, usize)], usize, &'static [&'static str]);

const CASES: &[Golden] = &[
    ("block", 24, 0, &[("hexahedra", 6)], 22, BLOCK),
    ("block.binary", 24, 0, &[("hexahedra", 6)], 22, BLOCK),
    ("block.gz", 24, 0, &[("hexahedra", 6)], 22, BLOCK),
    ("mixed", 12, 1, &[("pyramids", 1), ("prisms", 1), ("hexahedra", 1)], 14, &["patch0", "patch1"]),
    ("mirrored.gz", 44, 91, &[], 84, &["patch0", "patch1", "patch2"]),
    ("renumbered", 44, 91, &[], 84, &["patch0", "patch1", "patch2"]),
];

const BLOCK: &[&str] = &["inlet", "outlet", "wing", "top", "left", "right"];

#[test]
fn openfoam_s_own_meshes_are_read() {
    for &(name, n_vertices, n_tets, others, n_faces, families) in CASES {
        let (_here, path) = case(name);
        let file = read_mixed(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let MeshFile { mesh, others: found, left_handed, .. } = &file;
        assert_eq!((mesh.vertices.len(), mesh.tets.len()), (n_vertices, n_tets), "{name}");
        let counts: Vec<_> = found.counts().filter(|&(shape, _)| shape != "quadrilaterals").collect();
        assert_eq!(counts, others, "{name}");
        assert_eq!(mesh.triangles.len() + found.quadrilaterals.len(), n_faces, "{name}");
        assert_eq!(mesh.families, families, "{name}");
        assert_eq!(left_handed.len(), usize::from(name.starts_with("mirrored")), "{name}");
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let volumes: Vec<f64> = mesh.tets.iter().chain(&found.tets()).map(|tet| quality::volume(tet.map(at))).collect();
        assert!(volumes.iter().all(|&volume| volume > 0.0), "{name}");
        // Boxes of 0.2 x 0.1 x 0.1 and of 2 x 1 x 1, and the mixed cells.
        let expected = if name.starts_with("block") {
            0.002
        } else if name == "mixed" {
            1.8
        } else {
            2.0
        };
        let volume: f64 = volumes.iter().sum();
        assert!((volume - expected).abs() < 1e-9, "{name}: {volume}");
        let partners: &[[String; 2]] = &[["left", "right"], ["right", "left"]].map(|pair| pair.map(str::to_owned));
        assert_eq!(file.partners(), if name.starts_with("block") { partners } else { &[] }, "{name}");
        assert_eq!(file.warnings(), [] as [&str; 0], "{name}");
    }
}

/// Unmoved, every file is the same to the byte. Moved, only numbers in the points differ.
#[test]
fn openfoam_s_own_meshes_are_written_back() {
    for (name, ..) in CASES {
        let (here, path) = case(name);
        let file = read_mixed(&path).unwrap();
        let before = files(&path);
        let zipped = before.iter().any(|(name, _)| name == "points.gz");
        fs::create_dir(here.path().join("moved")).unwrap();
        let target = here.path().join("moved/polyMesh");
        file.write(&target, &file.mesh.vertices, &Fields::default()).unwrap();
        let points = |files: &[(String, Vec<u8>)]| {
            let (_, bytes) = files.iter().find(|(name, _)| name.starts_with("points")).unwrap();
            if bytes.starts_with(&[0x1f, 0x8b]) { unzipped(bytes) } else { bytes.clone() }
        };
        let other_files = |files: &[(String, Vec<u8>)]| {
            files.iter().filter(|(name, _)| !name.starts_with("points")).cloned().collect::<Vec<_>>()
        };
        let same = files(&target);
        assert!(zipped || same == before, "{name}");
        assert!(points(&same) == points(&before) && other_files(&same) == other_files(&before), "{name}");

        let moved: Vec<DVec3> = file.mesh.vertices.iter().map(|at| *at * 1.5 + DVec3::new(0.1, 0.0, -1e-7)).collect();
        file.write(&target, &moved, &Fields::default()).unwrap();
        let after = files(&target);
        assert!(other_files(&after) == other_files(&before), "{name}");
        let again = read_mixed(&target).unwrap();
        assert_eq!(again.mesh.vertices, moved, "{name}");
        assert!(again.others == file.others && again.mesh.tets == file.mesh.tets, "{name}");
        // The text without its lines of coordinates.
        if !["block.binary", "renumbered"].contains(name) {
            let rest = |bytes: Vec<u8>| -> Vec<String> {
                let text = String::from_utf8(bytes).unwrap();
                text.lines().filter(|line| !line.starts_with('(') || line.len() == 1).map(str::to_owned).collect()
            };
            assert_eq!(rest(points(&after)), rest(points(&before)), "{name}");
        } else {
            assert_eq!(points(&after).len(), points(&before).len(), "{name}");
        }
    }
}

/// Polyhedra are counted, a part of a divided mesh is warned of, and so many parts in one file are
/// refused.
#[test]
fn what_openfoam_divides_is_told() {
    let (_here, path) = case("polyhedra.gz");
    let error = read_mixed(&path).unwrap_err().to_string();
    assert!(error.contains("44 polyhedra") && error.contains("polygons on the boundary"), "{error}");

    let part = read(&folder("processor0")).unwrap();
    assert!(part.warnings()[0].contains("one part of a divided mesh"), "{:?}", part.warnings());
    assert_eq!(part.mesh.families.last().unwrap(), "procBoundary0to1");
    assert_eq!(count(&part.mesh, "procBoundary0to1"), 6);

    let error = read(&folder("collated").join("points")).unwrap_err().to_string();
    assert!(error.contains("class decomposedBlockData") && error.contains("reconstructParMesh"), "{error}");
}
