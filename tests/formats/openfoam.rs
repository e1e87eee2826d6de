//! OpenFOAM meshes.

use super::*;

fn folder(kind: &str) -> PathBuf {
    data("mixed").join(format!("foam.{kind}/constant/polyMesh"))
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&path).unwrap()))
        .collect();
    files.sort();
    files
}

/// The mesh of `make_mixed.py`, checked there with VTK's reader of OpenFOAM.
#[test]
fn cells_are_recognised_by_their_faces() {
    let reference = read_mixed(&data("mixed/gmsh.v41.ascii.msh")).unwrap();
    for kind in ["ascii", "binary"] {
        for path in [folder(kind), folder(kind).join("points")] {
            let file = read_mixed(&path).unwrap();
            assert_eq!(file.mesh.families, ["wing_skin", "far_field"]);
            assert_eq!(mixed::fingerprint(&file), mixed::fingerprint(&reference), "{kind}");
            let tets = file.mesh.tets.iter().copied().chain(file.others.tets());
            let at = |vertex: u32| file.mesh.vertices[vertex as usize];
            let volumes: Vec<f64> = tets.map(|tet| quality::volume(tet.map(at))).collect();
            assert!(volumes.iter().all(|&volume| volume > 0.01), "{kind}: {volumes:?}");
            assert!((volumes.iter().sum::<f64>() - 1.8).abs() < 1e-14);
            assert_eq!(file.others.quadrilateral_family.iter().filter(|family| family.0 == 0).count(), 1);
        }
    }
}

/// Patches of type `cyclic` name their neighbours; `cyclicAMI` ones do not match, and others have
/// none.
#[test]
fn cyclic_patches_are_partners() {
    let out = tempfile::tempdir().unwrap();
    for (name, bytes) in files(&folder("ascii")) {
        fs::write(out.path().join(name), bytes).unwrap();
    }
    let (boundary, points) = (out.path().join("boundary"), out.path().join("points"));
    let whole = fs::read_to_string(&boundary).unwrap();
    let partners = |wing: &str| {
        let at = whole.find("wing_skin").unwrap();
        let (before, patch) = whole.split_at(at);
        let end = patch.find(';').unwrap() + 1;
        let start = patch.find("type").unwrap();
        fs::write(&boundary, format!("{before}{}{wing}{}", &patch[..start], &patch[end..])).unwrap();
        read_mixed(&points).unwrap().partners().to_vec()
    };
    let expected = [["wing_skin".to_owned(), "far_field".to_owned()]];
    assert_eq!(partners("type cyclic; neighbourPatch far_field;"), expected);
    assert_eq!(partners("type cyclicAMI; neighbourPatch far_field;"), expected[..0]);
    assert_eq!(partners("type wall;"), expected[..0]);
    assert_eq!(partners("type cyclic;"), expected[..0]);
}

#[test]
fn only_points_change() {
    for kind in ["ascii", "binary"] {
        let out = tempfile::tempdir().unwrap();
        let file = read_mixed(&folder(kind)).unwrap();
        let same = out.path().join("polyMesh");
        file.check_output(&same).unwrap();
        // Twice: the second replaces the files of the first.
        for _ in 0..2 {
            file.write(&same, &file.mesh.vertices, &Fields::default()).unwrap();
            assert!(files(&same) == files(&folder(kind)), "{kind}");
        }
        let mut vertices = file.mesh.vertices.clone();
        vertices[3].y = 1.0 / 3.0;
        file.write(&same, &vertices, &Fields::default()).unwrap();
        let (before, after) = (files(&folder(kind)), files(&same));
        let changed: Vec<&String> =
            before.iter().zip(&after).filter(|(a, b)| a != b).map(|((name, _), _)| name).collect();
        assert_eq!(changed, ["points"]);
        assert_eq!(read_mixed(&same).unwrap().mesh.vertices, vertices);
        // Into a time folder go the points alone.
        fs::create_dir(out.path().join("1")).unwrap();
        file.write(&out.path().join("1/points"), &vertices, &Fields::default()).unwrap();
        assert_eq!(files(&out.path().join("1")), [("points".to_string(), fs::read(same.join("points")).unwrap())]);
        assert!(file.losses(&same).unwrap().is_empty());
        let losses = file.losses(Path::new("a.vtu")).unwrap();
        assert_eq!(losses, ["types of patches (wall): not carried into the new file"]);
    }
}

#[test]
fn new_folders_hold_the_mesh() {
    let out = tempfile::tempdir().unwrap();
    let target = out.path().join("polyMesh");
    for name in ["mixed/gmsh.v41.binary.msh", "small.msh.gz", "box.v22.ascii.msh"] {
        let file = read_mixed(&data(name)).unwrap();
        file.write(&target, &file.mesh.vertices, &Fields::default()).unwrap();
        let again = read_mixed(&target).unwrap();
        assert_eq!(again.mesh.vertices, file.mesh.vertices, "{name}");
        assert!(mixed::fingerprint(&again) == mixed::fingerprint(&file), "{name}");
        assert_eq!(again.mesh.families.len(), file.mesh.families.len());
        // What OpenFOAM demands of the order: a face's owner is below its neighbour, and owners
        // rise.
        let labels = |name: &str| -> Vec<usize> {
            let text = fs::read_to_string(target.join(name)).unwrap();
            text.lines().skip(3).take_while(|line| *line != ")").map(|line| line.parse().unwrap()).collect()
        };
        let (owner, neighbour) = (labels("owner"), labels("neighbour"));
        let inside: Vec<_> = owner.into_iter().zip(neighbour).collect();
        assert!(inside.windows(2).all(|pair| pair[0] < pair[1]) && inside.iter().all(|(a, b)| a < b), "{name}");
    }
    let box_file = boxed("box.v22.ascii.msh");
    let error = box_file.check_output(&out.path().join("points")).unwrap_err().to_string();
    assert!(error.contains("a new OpenFOAM mesh is a folder with the name polyMesh"), "{error}");
    let mut open = box_file.mesh.clone();
    open.triangles.pop();
    open.triangle_family.pop();
    let error = MeshFile::from_mesh(open).write(&target, &box_file.mesh.vertices, &Fields::default()).unwrap_err();
    assert!(error.to_string().contains("1 faces on the boundary of the cells belong to no family"), "{error}");
    let mut doubled = box_file.mesh.clone();
    doubled.triangles.push(doubled.triangles[0]);
    doubled.triangle_family.push(doubled.triangle_family[0]);
    let name = doubled.families[doubled.triangle_family[0].index()].clone();
    let error = MeshFile::from_mesh(doubled).write(&target, &box_file.mesh.vertices, &Fields::default()).unwrap_err();
    let expected = format!("a face of the family '{name}' is no face on the boundary of the cells");
    assert!(error.to_string().contains(&expected), "{error}");
    let mut overlapping = box_file.mesh.clone();
    overlapping.tets.extend_from_within(..);
    let error =
        MeshFile::from_mesh(overlapping).write(&target, &box_file.mesh.vertices, &Fields::default()).unwrap_err();
    assert!(error.to_string().contains("shares a face with two others"), "{error}");
}

/// A file of a folder of tets as machines of either byte order write it in binary, with either size
/// of an index.
fn in_binary(name: &str, text: &str, big: bool, long: bool) -> Vec<u8> {
    let (header, list) = text.split_once('}').unwrap();
    let arch = format!("\"{};label={};scalar=64\"", if big { "MSB" } else { "LSB" }, if long { 64 } else { 32 });
    let header = header.replace("format ascii;", &format!("format binary; arch {arch};"));
    let numbers = list.split(|letter: char| !letter.is_ascii_digit()).filter(|word| !word.is_empty());
    let numbers: Vec<i64> = numbers.skip(1).map(|word| word.parse().unwrap()).collect();
    let lists = match name {
        "faces" => {
            let faces = numbers.chunks(4);
            vec![
                (0..=faces.len() as i64).map(|face| 3 * face).collect(),
                faces.flat_map(|face| &face[1..]).copied().collect(),
            ]
        }
        _ => vec![numbers],
    };
    let mut bytes = format!("{header}}}\n").into_bytes();
    for list in lists {
        bytes.extend(format!("{}\n(", list.len()).bytes());
        for number in list {
            match (long, big) {
                (false, false) => bytes.extend((number as i32).to_le_bytes()),
                (false, true) => bytes.extend((number as i32).to_be_bytes()),
                (true, false) => bytes.extend(number.to_le_bytes()),
                (true, true) => bytes.extend(number.to_be_bytes()),
            }
        }
        bytes.extend(b")\n");
    }
    bytes
}

/// Folders of tets alone go another way than mixed ones.
#[test]
fn tets_are_read_and_refused_in_every_encoding() {
    let out = tempfile::tempdir().unwrap();
    let [text, binary] = ["text", "binary"].map(|name| out.path().join(name).join("polyMesh"));
    for folder in [&text, &binary] {
        fs::create_dir_all(folder.parent().unwrap()).unwrap();
        let file = read(&data("small.msh.gz")).unwrap();
        file.write(folder, &file.mesh.vertices, &Fields::default()).unwrap();
    }
    let mesh = read(&text).unwrap().mesh;
    let lists = ["faces", "owner", "neighbour"].map(|name| (name, fs::read_to_string(text.join(name)).unwrap()));
    for (big, long) in [(false, false), (false, true), (true, false), (true, true)] {
        for (name, text) in &lists {
            fs::write(binary.join(name), in_binary(name, text, big, long)).unwrap();
        }
        assert!(read(&binary).unwrap().mesh == mesh, "big {big}, long {long}");
        // The last index of a file, one too large, and one below zero.
        for (name, text) in &lists {
            let good = in_binary(name, text, big, long);
            let size = if long { 8 } else { 4 };
            let at = good.len() - 2 - size;
            for number in [1 << 30, -2i64] {
                let mut bad = good.clone();
                let bytes = if big { &number.to_be_bytes()[8 - size..] } else { &number.to_le_bytes()[..size] };
                bad[at..at + size].copy_from_slice(bytes);
                fs::write(binary.join(name), bad).unwrap();
                let error = read(&binary).unwrap_err().to_string();
                assert!(error.contains(&format!("{name}: byte {at}: expected ")), "{error}");
                assert!(error.contains(&number.to_string()), "{error}");
            }
            fs::write(binary.join(name), good).unwrap();
        }
    }
    // Faces that do not close: a corner, a neighbour, the side of a face are others.
    let [faces, owner, neighbour] =
        lists.map(|(name, text)| (name, text.lines().map(str::to_string).collect::<Vec<_>>()));
    let n_internal = neighbour.1.len() - 4;
    for (name, lines, a, b) in
        [("faces", &faces.1, 3, 40), ("neighbour", &neighbour.1, 3, n_internal), ("owner", &owner.1, 3, 40)]
    {
        let mut changed = lines.clone();
        changed.swap(a, b);
        fs::write(text.join(name), changed.join("\n")).unwrap();
        let error = read(&text).unwrap_err().to_string();
        assert!(error.contains("polyhedra is not read; split polyhedra"), "{name}: {error}");
        fs::write(text.join(name), lines.join("\n")).unwrap();
    }
    assert!(read(&text).unwrap().mesh == mesh);
}

/// Wherever a face inside has another corner, or lies beside another cell, that leaves cells that
/// are no tets.
#[test]
fn every_face_of_a_tet_is_checked() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("polyMesh");
    let file = read(&data("small.msh.gz")).unwrap();
    file.write(&folder, &file.mesh.vertices, &Fields::default()).unwrap();
    let lists = ["faces", "owner", "neighbour"].map(|name| (name, fs::read_to_string(folder.join(name)).unwrap()));
    let n_internal = lists[2].1.lines().count() - 4;
    let limits = [file.mesh.vertices.len(), file.mesh.tets.len(), file.mesh.tets.len()];
    let mut random = damage::Random(11);
    for round in 0..300 {
        let ((name, text), limit) = (&lists[round % 3], limits[round % 3]);
        let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
        let line = &mut lines[3 + random.below(n_internal)];
        // In a face, the number before the parenthesis counts its corners.
        let place = if *name == "faces" { 1 + random.below(3) } else { 0 };
        let number = line.split(['(', ' ', ')']).nth(place).unwrap().parse::<usize>().unwrap();
        let other = (number + 1 + random.below(limit - 1)) % limit;
        let before = line.clone();
        *line = match place {
            0 => other.to_string(),
            1 => line.replacen(&format!("({number} "), &format!("({other} "), 1),
            2 => line.replacen(&format!(" {number} "), &format!(" {other} "), 1),
            _ => line.replacen(&format!(" {number})"), &format!(" {other})"), 1),
        };
        assert_ne!(*line, before);
        let after = line.clone();
        fs::write(folder.join(name), lines.join("\n")).unwrap();
        let error = read(&folder).expect_err(&format!("{name}: {before} -> {after}")).to_string();
        assert!(error.contains("polyhedra is not read; split polyhedra"), "{name}: {before} -> {after}: {error}");
        fs::write(folder.join(name), text).unwrap();
    }
    read(&folder).unwrap();
}

/// Reads a copy of the golden folder with one file changed.
fn changed(kind: &str, name: &str, change: impl Fn(Vec<u8>) -> Vec<u8>) -> Result<MeshFile, ReadError> {
    let copy = tempfile::tempdir().unwrap();
    for (file, bytes) in files(&folder(kind)) {
        fs::write(copy.path().join(&file), if file == name { change(bytes) } else { bytes }).unwrap();
    }
    read_mixed(&copy.path().join("points"))
}

/// The golden folder with other texts: the changes of `edits` to every file, each at least once in
/// one of them.
fn edited(edits: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    let out = tempfile::tempdir().unwrap();
    let copy = out.path().join("polyMesh");
    fs::create_dir(&copy).unwrap();
    let mut used = vec![false; edits.len()];
    for (name, bytes) in files(&folder("ascii")) {
        let mut text = String::from_utf8(bytes).unwrap();
        for ((from, to), used) in edits.iter().zip(&mut used) {
            *used |= text.contains(from);
            text = text.replace(from, to);
        }
        fs::write(copy.join(name), text).unwrap();
    }
    assert!(used.iter().all(|&used| used), "{used:?} of {edits:?}");
    (out, copy)
}

/// Lists without their counts, and comments wherever white space may be: the same mesh, and the
/// same bytes.
#[test]
fn lists_without_counts_and_comments_are_read_and_kept() {
    let plain = read_mixed(&folder("ascii")).unwrap();
    let no_counts = [
        ("\n12\n(", "\n("),
        ("\n17\n(", "\n("),
        ("\n3\n(", "\n("),
        ("\n2\n(", "\n("),
        ("\n4(", "\n("),
        ("\n3(", "\n("),
        (")\n\n// ** //\n", ")"),
    ];
    let comments = [
        ("\n12\n(", "\n12 // points\n/* ) */("),
        ("(2 0 0.3333333333333333)", "/* ( */(2/* x */ 0 // y ) 7\n 0.3333333333333333/**/)/*"),
        ("(2 1 0.3333333333333333)", "*/( // (\n//2\n2 /*7*/1 0.3333333333333333)"),
        ("4(4 5 6 7)", "4/*3*/(4/*5*/5 // 6\n6 7)"),
        ("nFaces          13;", "nFaces /* ; */ 13 // of 14;\n;"),
        ("inGroups        1(free);", "inGroups /* } */ 1(free); // }"),
        ("format      ascii;", "format /*binary;*/ ascii;"),
    ];
    for edits in [&no_counts[..], &comments, &[&comments, &no_counts[1..]].concat()] {
        let (out, copy) = edited(edits);
        let file = read_mixed(&copy).unwrap();
        assert_eq!(file.mesh.families, plain.mesh.families);
        assert_eq!(mixed::fingerprint(&file), mixed::fingerprint(&plain));
        let target = out.path().join("moved");
        fs::create_dir(&target).unwrap();
        let target = target.join("polyMesh");
        file.write(&target, &file.mesh.vertices, &Fields::default()).unwrap();
        assert!(files(&target) == files(&copy), "{edits:?}");
        // A coordinate between comments is found again.
        let mut vertices = file.mesh.vertices.clone();
        (vertices[9].z, vertices[10].y) = (0.25, 1.5);
        file.write(&target, &vertices, &Fields::default()).unwrap();
        let points = fs::read_to_string(copy.join("points")).unwrap();
        let (first, second) = points.split_once("(2 1 0.").or_else(|| points.split_once("7*/1 0.")).unwrap();
        let middle = &points[first.len()..points.len() - second.len()];
        let expected = first.replace("0.3333333333333333", "0.25") + &middle.replace("1 0.", "1.5 0.") + second;
        assert_eq!(fs::read_to_string(target.join("points")).unwrap(), expected);
        assert_eq!(read_mixed(&target).unwrap().mesh.vertices, vertices);
    }
    let broken = [
        ("points", vec![("\n12\n(", "\n("), ("(2 0 0.3333333333333333)", "(2 0 0.3) 7")], "expected '(', found '7'"),
        ("points", vec![("\n12\n(", "\n("), ("1.36)\n)", "1.36)\n")], "the file ends where"),
        ("faces", vec![("\n17\n(", "\n("), ("4(4 5 6 7)", "(4 5 x 7)")], "expected an index, found 'x'"),
        ("owner", vec![("\n17\n(", "\n("), ("\n3\n)", "\n)")], "an owner for every face, and no more neighbours"),
        (
            "boundary",
            vec![("\n2\n(", "\n("), ("nFaces          13", "nFaces /*13*/")],
            "expected a whole number, found ''",
        ),
    ];
    for (name, edits, expected) in broken {
        let change = |bytes: Vec<u8>| {
            let text = String::from_utf8(bytes).unwrap();
            edits
                .iter()
                .fold(text, |text, (from, to)| {
                    assert!(text.contains(from), "{name}: {from:?}");
                    text.replacen(from, to, 1)
                })
                .into_bytes()
        };
        let error = changed("ascii", name, change).expect_err(name).to_string();
        assert!(error.contains(expected), "{name}: {error}");
    }
    // In a binary file only a count tells where a list ends.
    let binary = changed("binary", "owner", |bytes| {
        let at = bytes.windows(5).position(|window| window == b"\n\n17\n").unwrap();
        [&bytes[..at + 1], &bytes[at + 5..]].concat()
    });
    assert!(binary.unwrap_err().to_string().contains("expected the number of indices, found '('"));
}

#[test]
fn broken_folders_are_refused() {
    let mut wrong = String::new();
    for (file, from, to, expected) in [
        ("points", "FoamFile", "FoamFiles", "points:2: expected FoamFile, found 'FoamFiles'"),
        ("points", "ascii;", "ascii", "points"),
        ("points", "ascii;", "utf8;", "points:5: expected the format ascii or binary, found 'utf8'"),
        ("points", "12\n(", "13\n(", "points:28: expected '('"),
        ("points", "12\n(", "11\n(", "points:27: expected ')'"),
        ("points", "12\n(", "99999999999\n(", "points:14: the number of points is 99999999999, but only"),
        ("points", "12\n(", "-12\n(", "points:14: expected the number of points, found '-12'"),
        ("points", "(0.5 -0.7 1.36)", "(0.5 nan 1.36)", "vertex 11 has coordinate NaN"),
        ("points", "(0.5 -0.7 1.36)", "(0.5 -0.7)", "points:27: expected a coordinate, found ')'"),
        ("faces", "4(3 0 4 7)", "4(3 0 4 12)", "faces:19: expected a vertex below 12, found 12"),
        ("faces", "4(3 0 4 7)", "5(3 0 4 7)", "faces:19: expected an index, found ')'"),
        ("owner", "\n0\n0\n0\n", "\n0\n0\n-5\n", "expected cells numbered from 0, below 17, found cell -5 for face"),
        ("owner", "\n3\n)", "\n99\n)", "owner:32: expected cells numbered from 0, below 17, found cell 99 for face 16"),
        ("owner", "17\n(", "16\n(", "owner:32: expected ')'"),
        (
            "boundary",
            "nFaces          13",
            "nFaces          12",
            "expected patches that hold the faces 3 to 17, found an end",
        ),
        (
            "boundary",
            "nFaces          13",
            "nFaces          14",
            "and at most 17 faces in all, found startFace 4, nFaces 14",
        ),
        ("boundary", "startFace       4", "startFace       5", "found startFace 5, nFaces 13"),
        ("boundary", "nFaces          1;", "", "found no startFace or nFaces"),
        // A face less of the hexahedron makes it no hexahedron, but a polyhedron.
        ("owner", "\n0\n0\n0\n", "\n0\n3\n0\n", "polyhedra is not read; split polyhedra into tets"),
    ] {
        let change = |bytes: Vec<u8>| {
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.contains(from), "{file}: {from:?}");
            text.replacen(from, to, 1).into_bytes()
        };
        let error = changed("ascii", file, change).expect_err(&format!("{file}: {from} -> {to}")).to_string();
        if !error.contains(expected) {
            wrong += &format!("{file}: {from:?} -> {to:?}\n expected: {expected}\n found:    {error}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    for kind in ["ascii", "binary"] {
        for (name, bytes) in files(&folder(kind)) {
            let needed = bytes.windows(4).rposition(|window| window == b")\n\n/").unwrap();
            for length in (0..needed).step_by(3) {
                let cut = changed(kind, &name, |bytes| bytes[..length].to_vec());
                assert!(cut.is_err(), "{kind} {name} cut to {length} of {needed} bytes");
            }
        }
    }
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(read(&empty.path().join("polyMesh")), Err(ReadError::Io { .. })));
}

/// Random damage to any of the files gives an error or a mesh.
#[test]
fn damaged_folders_are_survived() {
    let mut random = damage::Random(7);
    let mut n_read = 0;
    let counts = ["\n12\n(", "\n17\n(", "\n3\n(", "\n2\n(", "\n4(", "\n3("];
    for round in 0..900 {
        let kind = ["ascii", "binary", "ascii"][round % 3];
        let name = ["points", "faces", "owner", "neighbour", "boundary"][round % 5];
        let mut seed = fs::read(folder(kind).join(name)).unwrap();
        if round % 3 == 2 {
            let text = String::from_utf8(seed).unwrap();
            seed = counts.iter().fold(text, |text, count| text.replace(count, "\n(")).into_bytes();
        }
        let broken = damage::damage(&seed, &mut random);
        n_read += usize::from(changed(kind, name, |_| broken.clone()).is_ok());
    }
    assert!((30..800).contains(&n_read), "{n_read} of 900");
}

/// The names of the files of a folder.
fn names(folder: &Path) -> Vec<String> {
    files(folder).into_iter().map(|(name, _)| name).collect()
}

/// OpenFOAM reads `faces` where `faces.gz` is too. So a file of an earlier mesh must not stay under
/// the other name.
#[test]
fn no_file_of_an_earlier_mesh_hides_one() {
    let here = tempfile::tempdir().unwrap();
    let (packed, out) = (here.path().join("a/polyMesh"), here.path().join("b/polyMesh"));
    [&packed, &out].into_iter().for_each(|folder| fs::create_dir_all(folder).unwrap());
    let gzipped = |bytes: &[u8]| {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(bytes).unwrap();
        gzip.finish().unwrap()
    };
    for (name, bytes) in files(&folder("ascii")) {
        fs::write(packed.join(format!("{name}.gz")), gzipped(&bytes)).unwrap();
    }
    let (packed, plain) = (read_mixed(&packed).unwrap(), read_mixed(&folder("ascii")).unwrap());
    let other = boxed("box.v41.ascii.msh").mesh;
    // An earlier mesh under plain names, and then one under the other names, with a file of the
    // user's.
    MeshFile::from_mesh(other.clone()).write(&out, &other.vertices, &Fields::default()).unwrap();
    fs::write(out.join("points.gz"), gzipped(b"earlier")).unwrap();
    fs::write(out.join("notes.gz"), b"mine").unwrap();
    for (file, expected) in [
        (&packed, ["boundary.gz", "faces.gz", "neighbour.gz", "notes.gz", "owner.gz", "points"]),
        (&plain, ["boundary", "faces", "neighbour", "notes.gz", "owner", "points"]),
        (&packed, ["boundary.gz", "faces.gz", "neighbour.gz", "notes.gz", "owner.gz", "points"]),
    ] {
        file.write(&out, &file.mesh.vertices, &Fields::default()).unwrap();
        assert_eq!(names(&out), expected);
        let again = read_mixed(&out).unwrap();
        assert_eq!(
            (&again.mesh, again.others.counts().collect::<Vec<_>>()),
            (&file.mesh, file.others.counts().collect())
        );
    }
    // Points alone, as in the folder of a time.
    let time = here.path().join("0.1");
    fs::create_dir(&time).unwrap();
    for (output, hidden) in [("points", "points.gz"), ("points.gz", "points")] {
        fs::write(time.join(hidden), b"earlier").unwrap();
        plain.write(&time.join(output), &plain.mesh.vertices, &Fields::default()).unwrap();
        assert_eq!(names(&time), [output]);
    }
}
