//! `idmesh init` makes a case of a mesh that runs as it is, moves nothing, and takes a changed
//! section.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;
use glam::DVec3;
use tempfile::TempDir;

use crate::fixture::*;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The role of each family in a case.
fn roles(case: &Path) -> BTreeMap<String, String> {
    let case: toml::Table = fs::read_to_string(case).unwrap().parse().unwrap();
    let roles = case["family"].as_table().unwrap().iter();
    roles.map(|(name, table)| (name.clone(), table["role"].as_str().unwrap().to_owned())).collect()
}

/// The section in a file, 5 % thicker about the line from its leading to its trailing edge. Its
/// plane may have any direction.
fn thicken(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|word| word.parse().unwrap()).collect()).collect();
    let points: Vec<DVec3> = rows.iter().map(|row| DVec3::new(row[1], row[2], row[3])).collect();
    let end = 0.5 * (points[0] + points[points.len() - 1]);
    let far = |at: &&DVec3| at.distance(end);
    let nose = *points.iter().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    let normal: DVec3 = points.windows(2).map(|pair| (pair[0] - end).cross(pair[1] - end)).sum();
    let across = normal.cross(end - nose).normalize();
    let mut new = "profile,x,y,z\n".to_owned();
    for (row, &at) in rows.iter().zip(&points) {
        let at = at + across * (0.05 * (at - nose).dot(across));
        new += &format!("{},{:?},{:?},{:?}\n", row[0] as i64, at.x, at.y, at.z);
    }
    fs::write(path, new).unwrap();
}

/// Makes a case of a mesh and runs it. Returns the case, whose folder is removed with the first
/// value.
fn starts_still(mesh: &Path) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join(mesh.file_name().unwrap());
    fs::copy(mesh, &place).unwrap();
    let made = runs(folder.path(), &["init", place.file_name().unwrap().to_str().unwrap(), "-o", "new"]);
    assert!(stdout(&made).contains("idmesh run new/case.toml"), "{}", stdout(&made));
    let case = folder.path().join("new/case.toml");
    runs(folder.path(), &["run", "new/case.toml", "--backend", "cpu"]);
    assert!(unpacked(&moved_mesh(&case)) == unpacked(&place), "{}: something moved", mesh.display());
    (folder, case)
}

fn runs(folder: &Path, arguments: &[&str]) -> std::process::Output {
    let output = command(folder, arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    output
}

/// The moved mesh of a case.
fn moved_mesh(case: &Path) -> PathBuf {
    let output = fs::read_to_string(case).unwrap().parse::<toml::Table>().unwrap();
    case.parent().unwrap().join(output["output"]["mesh"].as_str().unwrap())
}

/// [`starts_still`], then makes one section thicker, and the last one of a winglet, and runs the
/// case again.
fn starts_well(mesh: &Path) -> (TempDir, PathBuf) {
    let (folder, case) = starts_still(mesh);
    // The section in the middle of the first wing.
    let mut sections: Vec<_> =
        fs::read_dir(folder.path().join("new/new")).unwrap().map(|entry| entry.unwrap().path()).collect();
    sections.sort();
    thicken(&sections[2]);
    sections.get(7).into_iter().for_each(|section| thicken(section));
    runs(folder.path(), &["run", "new/case.toml", "--backend", "cpu"]);
    assert!(unpacked(&moved_mesh(&case)) != unpacked(mesh), "{}: nothing moved", mesh.display());
    (folder, case)
}

fn unpacked(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).unwrap();
    let mut unpacked = Vec::new();
    match std::io::Read::read_to_end(&mut MultiGzDecoder::new(&*bytes), &mut unpacked) {
        Ok(_) => unpacked,
        Err(_) => bytes,
    }
}

const AIRCRAFT: [(&str, &str); 6] = [
    ("wing", "wing"),
    ("trailing_edge", "trailing-edge"),
    ("wingtip", "wingtip"),
    ("carenage", "carenage"),
    ("symmetry", "plane"),
    ("farfield", "fixed"),
];

fn expected(roles: &[(&str, &str)]) -> BTreeMap<String, String> {
    roles.iter().map(|&(name, role)| (name.to_owned(), role.to_owned())).collect()
}

/// The roles are those that the meshes' makers meant: blunt and sharp wings, of one family and of
/// two, alone in a box or on a fuselage, of tets and of other cells.
///
/// Fails if the far boundary is told by its name alone, or if strips join no wing.
#[test]
fn cases_run_as_they_are_and_take_a_changed_section() {
    for (mesh, roles_of_mesh) in [
        ("small.su2.gz", &AIRCRAFT[..]),
        ("hybrid/small.msh.gz", &AIRCRAFT),
        (
            "shape/half4.su2.gz",
            &[("wing", "wing"), ("wingtip", "wingtip"), ("symmetry", "plane"), ("farfield", "fixed")],
        ),
        ("shape/full6.msh.gz", &[("wing", "wing"), ("wingtip", "wingtip"), ("farfield", "fixed")]),
        (
            "shape/split6.msh.gz",
            &[
                ("wing_upper", "wing"),
                ("wing_lower", "wing"),
                ("wingtip", "wingtip"),
                ("symmetry", "plane"),
                ("farfield", "fixed"),
            ],
        ),
        ("shape/blunt6.msh.gz", &[AIRCRAFT[0], AIRCRAFT[1], AIRCRAFT[2], AIRCRAFT[4], AIRCRAFT[5]]),
    ] {
        let (_folder, case) = starts_well(&data(mesh));
        assert_eq!(roles(&case), expected(roles_of_mesh), "{mesh}");
    }
}

/// A mesh of an aircraft with other names for some families, each as long as the old one.
fn renamed(mesh: &str, names: &[(&str, &str)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.msh");
    let mut bytes = unpacked(&data(mesh));
    for (old, new) in names {
        let [old, new] = [old, new].map(|name| format!("\"{name}\""));
        assert_eq!(old.len(), new.len());
        let at = bytes.windows(old.len()).position(|window| window == old.as_bytes()).unwrap();
        bytes[at..at + old.len()].copy_from_slice(new.as_bytes());
    }
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// What hangs from a wing goes with it. A winglet with sections of its own that goes on from the
/// wing's end is one loft with the wing; a fence that stands on the wing is not. Shapes are enough.
///
/// Fails if a fence counts as a wingtip, if a winglet's sections are left out, or if what hangs
/// from a pylon and is larger than the pylon is no body.
#[test]
fn parts_go_with_their_wing() {
    let blended = [("winglet", "wing"), ("winglet_te", "trailing-edge")];
    let fence = [("winglet", "attached"), ("winglet_te", "attached"), ("winglet_tip", "attached")];
    let nacelle = [("pylon", "attached"), ("nacelle", "rigid")];
    let fairings = [("fairing_1", "attached"), ("fairing_2", "attached")];
    for (mesh, parts, n_sections) in
        [("blended", &blended[..], 8), ("fence", &fence, 5), ("nacelle", &nacelle, 5), ("fairings", &fairings, 5)]
    {
        let mesh_file = data(&format!("aircraft/{mesh}.msh.gz"));
        // A changed section takes some time on meshes of this size.
        let (_folder, case) = if n_sections > 5 { starts_well(&mesh_file) } else { starts_still(&mesh_file) };
        let all: Vec<_> = AIRCRAFT.iter().chain(parts).copied().collect();
        assert_eq!(roles(&case), expected(&all), "{mesh}");
        let text = fs::read_to_string(&case).unwrap();
        assert_eq!(text.matches("leading edge [").count(), n_sections, "{text}");
        assert_eq!(text.contains("families = [\"wing\", \"winglet\"]"), mesh == "blended", "{text}");
        assert_eq!(text.matches("# across [0.0").count(), n_sections - 5, "{text}");
    }
    for (mesh, parts) in [
        ("nacelle", [("pylon", "part1", "attached"), ("nacelle", "part_22", "rigid")]),
        ("blended", [("winglet", "part_01", "wing"), ("winglet_te", "part_02_xx", "trailing-edge")]),
        ("fence", [("winglet", "part_01", "attached"), ("winglet_te", "part_02_xx", "attached")]),
    ] {
        let (_mesh, path) = renamed(&format!("aircraft/{mesh}.msh.gz"), &parts.map(|(old, new, _)| (old, new)));
        let fixture = Fixture::new();
        let output = fixture.idmesh(&["init", path.to_str().unwrap(), "-o", "new"]);
        assert_good(&output);
        let found = roles(&fixture.path("new/case.toml"));
        assert_eq!(parts.map(|(_, new, _)| found[new].as_str()), parts.map(|(_, _, role)| role), "{mesh}");
    }
}

/// The whole aircraft of a half one in SU2's format, joined in the plane y = 0. Wing, trailing edge
/// and tip of the other half are families of their own.
fn whole(half: &str) -> String {
    let rows = |key: &str| -> Vec<Vec<&str>> {
        let mut lines = half.lines().skip_while(|line| !line.starts_with(key));
        let count = lines.next().unwrap().split('=').nth(1).unwrap().split_whitespace().next().unwrap();
        lines.take(count.parse().unwrap()).map(|row| row.split_whitespace().collect()).collect()
    };
    let (cells, points) = (rows("NELEM"), rows("NPOIN"));
    let at: Vec<[f64; 3]> = points.iter().map(|row| [0, 1, 2].map(|k| row[k].parse().unwrap())).collect();
    let mut twin: Vec<usize> = (0..at.len()).collect();
    let mut all = at.clone();
    for (vertex, &[x, y, z]) in at.iter().enumerate().filter(|(_, at)| at[1].abs() > 1e-9) {
        twin[vertex] = all.len();
        all.push([x, -y, z]);
    }
    let mut text = format!("NDIME= 3\nNELEM= {}\n", 2 * cells.len());
    let other = |word: &str| twin[word.parse::<usize>().unwrap()];
    for row in &cells {
        text += &format!("{}\n", row[..5].join(" "));
        text += &format!("10 {} {} {} {}\n", other(row[1]), other(row[3]), other(row[2]), other(row[4]));
    }
    text += &format!("NPOIN= {}\n", all.len());
    all.iter().for_each(|[x, y, z]| text += &format!("{x:?} {y:?} {z:?}\n"));
    let mut families: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (name, _) in AIRCRAFT.iter().filter(|(name, _)| *name != "symmetry") {
        let tag = format!("MARKER_TAG= {name}\n");
        let own = half.split(&tag).nth(1).unwrap();
        let left = if ["carenage", "farfield"].contains(name) { (*name).to_owned() } else { format!("{name}_left") };
        for row in own.lines().skip(1).take_while(|line| !line.starts_with("MARKER_TAG") && !line.is_empty()) {
            let words: Vec<&str> = row.split_whitespace().collect();
            families.entry((*name).to_owned()).or_default().push(words[..4].join(" "));
            let image = format!("5 {} {} {}", other(words[1]), other(words[3]), other(words[2]));
            families.entry(left.clone()).or_default().push(image);
        }
    }
    text += &format!("NMARK= {}\n", families.len());
    for (name, faces) in families {
        text += &format!("MARKER_TAG= {name}\nMARKER_ELEMS= {}\n{}\n", faces.len(), faces.join("\n"));
    }
    text
}

/// Both halves of an aircraft have one table with the sections of one half. Where the halves are no
/// mirror images, or the user names a wing, each has its own.
///
/// Fails if a wing that the user names is joined with its image.
#[test]
fn the_other_half_is_the_mirror_image() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("whole.su2");
    let text = whole(&String::from_utf8(unpacked(&data("small.su2.gz"))).unwrap());
    fs::write(&mesh, &text).unwrap();
    let (_folder, case) = starts_well(&mesh);
    let made = fs::read_to_string(&case).unwrap();
    assert!(made.contains("families = [\"wing\", \"wing_left\"]") && made.contains("mirror = \"y\""), "{made}");
    assert_eq!(roles(&case)["wingtip_left"], "wingtip");
    let fixture = Fixture::new();
    fs::copy(&mesh, fixture.path("whole.su2")).unwrap();
    assert_good(&fixture.idmesh(&["init", "whole.su2", "-o", "asked", "--wing", "wing"]));
    // The left half's points stand 1 % of the chord lower outside the symmetry plane.
    let n = text.lines().position(|line| line.starts_with("NPOIN")).unwrap();
    let lowered: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(at, line)| {
            let words: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            match words[..] {
                [x, y, z] if at > n && y < -0.3 && x.abs() < 50.0 => {
                    format!("{x:?} {y:?} {:?}", z + 0.01 * y.max(-2.0))
                }
                _ => line.to_owned(),
            }
        })
        .collect();
    fixture.write("bent.su2", &lowered.join("\n"));
    assert_good(&fixture.idmesh(&["init", "bent.su2", "-o", "bent"]));
    for case in ["asked/case.toml", "bent/case.toml"] {
        let made = fixture.read(case);
        assert!(!made.contains("mirror =") && made.contains("[profiles.wing_left]"), "{made}");
        assert_good(&fixture.idmesh(&["run", case, "--backend", "cpu"]));
    }
}

/// Families whose names are numbers get the same roles by their shapes.
#[test]
fn shapes_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("numbers.su2");
    let mut text = String::from_utf8(unpacked(&data("small.su2.gz"))).unwrap();
    let mut numbered = Vec::new();
    for (number, (name, role)) in AIRCRAFT.iter().enumerate() {
        let tag = format!("MARKER_TAG= {name}\n");
        assert!(text.contains(&tag), "{tag}");
        text = text.replace(&tag, &format!("MARKER_TAG= {number}\n"));
        numbered.push((number.to_string(), (*role).to_owned()));
    }
    fs::write(&mesh, text).unwrap();
    let (_folder, case) = starts_well(&mesh);
    assert_eq!(roles(&case), numbered.into_iter().collect());
}

/// Two wings whose families have numbers for names are both found: the first one's neighbours are
/// parts of it, and the second one, which touches neither, is a wing of its own.
///
/// Fails if one wing is enough.
#[test]
fn a_second_wing_needs_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("two.su2");
    fs::write(&mesh, twice(&String::from_utf8(unpacked(&data("shape/half4.su2.gz"))).unwrap(), 100.0)).unwrap();
    let (_folder, case) = starts_well(&mesh);
    let roles_of_parts =
        [("0", "wing"), ("1", "wingtip"), ("2", "plane"), ("3", "fixed"), ("4", "wing"), ("5", "wingtip")];
    assert_eq!(roles(&case), expected(&roles_of_parts));
}

/// A mesh in SU2's format, and beside it the same mesh farther downstream. Families have numbers:
/// wing and wingtip of the second mesh have their own, plane and far boundary those of the first.
fn twice(mesh: &str, downstream: f64) -> String {
    let tags = ["wing", "wingtip", "symmetry", "farfield"];
    let (mut cells, mut points, mut faces) = (Vec::new(), Vec::new(), BTreeMap::<usize, Vec<String>>::new());
    let mut lines = mesh.lines().filter(|line| !line.is_empty());
    let mut tag = 0;
    while let Some(line) = lines.next() {
        let Some((key, value)) = line.split_once('=') else { continue };
        let value = value.trim();
        let mut rows = || -> Vec<Vec<&str>> {
            let count = value.split_whitespace().next().unwrap().parse().unwrap();
            lines.by_ref().take(count).map(|row| row.split_whitespace().collect()).collect()
        };
        match key.trim() {
            "NELEM" => cells = rows(),
            "NPOIN" => points = rows(),
            "MARKER_TAG" => tag = tags.iter().position(|known| *known == value).unwrap(),
            "MARKER_ELEMS" => {
                let own = rows().iter().map(|row| row[..4].join(" ")).collect();
                faces.insert(tag, own);
            }
            _ => {}
        }
    }
    let shifted = |row: &[&str]| -> String {
        let vertices = row[1..].iter().map(|vertex| (vertex.parse::<usize>().unwrap() + points.len()).to_string());
        [row[0].to_owned()].into_iter().chain(vertices).collect::<Vec<_>>().join(" ")
    };
    let mut text = format!("NDIME= 3\nNELEM= {}\n", 2 * cells.len());
    cells.iter().for_each(|row| text += &format!("{}\n", row[..5].join(" ")));
    cells.iter().for_each(|row| text += &format!("{}\n", shifted(&row[..5])));
    text += &format!("NPOIN= {}\n", 2 * points.len());
    points.iter().for_each(|row| text += &format!("{}\n", row[..3].join(" ")));
    for row in &points {
        text += &format!("{:?} {} {}\n", row[0].parse::<f64>().unwrap() + downstream, row[1], row[2]);
    }
    let mut markers = BTreeMap::<usize, Vec<String>>::new();
    for (&tag, own) in &faces {
        let of_second = own.iter().map(|row| shifted(&row.split(' ').collect::<Vec<_>>()));
        markers.entry(tag).or_default().extend(own.iter().cloned());
        markers.entry(if tag < 2 { tag + 4 } else { tag }).or_default().extend(of_second);
    }
    text += &format!("NMARK= {}\n", markers.len());
    for (tag, rows) in markers {
        text += &format!("MARKER_TAG= {tag}\nMARKER_ELEMS= {}\n{}\n", rows.len(), rows.join("\n"));
    }
    text
}

/// A mesh in SU2's format, with its faces in other families.
///
/// - `family`: the name of the family of a face, from the old name and the face's centre
fn regrouped(mesh: &str, family: impl Fn(&str, [f64; 3]) -> String) -> String {
    let lines: Vec<&str> = mesh.lines().collect();
    let after = |line: &str| line.split('=').nth(1).unwrap().split_whitespace().next().unwrap().to_owned();
    let at = lines.iter().position(|line| line.starts_with("NPOIN")).unwrap();
    let count: usize = after(lines[at]).parse().unwrap();
    let point = |line: &&str| -> Vec<f64> { line.split_whitespace().take(3).map(|x| x.parse().unwrap()).collect() };
    let points: Vec<Vec<f64>> = lines[at + 1..=at + count].iter().map(point).collect();
    let markers = lines.iter().position(|line| line.starts_with("NMARK")).unwrap();
    assert!(markers > at);
    let mut families: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut own = String::new();
    for line in lines[markers + 1..].iter().filter(|line| !line.starts_with("MARKER_ELEMS")) {
        if line.starts_with("MARKER_TAG") {
            own = after(line);
        } else {
            // Triangles.
            let corners: Vec<usize> = line.split_whitespace().skip(1).take(3).map(|v| v.parse().unwrap()).collect();
            let centre = [0, 1, 2].map(|k| corners.iter().map(|&corner| points[corner][k]).sum::<f64>() / 3.0);
            families.entry(family(&own, centre)).or_default().push(line);
        }
    }
    let mut text = lines[..markers].join("\n") + &format!("\nNMARK= {}\n", families.len());
    for (name, faces) in families {
        text += &format!("MARKER_TAG= {name}\nMARKER_ELEMS= {}\n{}\n", faces.len(), faces.join("\n"));
    }
    text
}

/// A wing that is divided along the span is one wing. Where families hold several parts of an
/// aircraft, the guess says so and is doubtful.
#[test]
fn families_of_other_divisions() {
    let text = String::from_utf8(unpacked(&data("small.su2.gz"))).unwrap();
    let doubtful = |mesh: &str, words: &[&str]| {
        let fixture = Fixture::new();
        fixture.write("mesh.su2", mesh);
        let output = fixture.idmesh(&["init", "mesh.su2", "-o", "new"]);
        assert_good(&output);
        let table = stdout(&output);
        let row = table.lines().find(|line| line.contains(" doubtful ")).unwrap_or_else(|| panic!("{table}"));
        assert!(words.iter().all(|word| row.contains(word)), "{row}");
        assert!(stderr(&output).contains("warning: look at the role of `"), "{}", stderr(&output));
        roles(&fixture.path("new/case.toml"))
    };
    let spanwise = regrouped(&text, |name, [_, y, _]| match name {
        "wing" => if y < 2.0 { "part_a" } else { "part_b" }.to_owned(),
        name => name.to_owned(),
    });
    let fixture = Fixture::new();
    fixture.write("mesh.su2", &spanwise);
    assert_good(&fixture.idmesh(&["init", "mesh.su2", "-o", "new"]));
    let of_parts = roles(&fixture.path("new/case.toml"));
    assert_eq!([&of_parts["part_a"], &of_parts["part_b"], &of_parts["wingtip"]], ["wing", "wing", "wingtip"]);
    let merged = |of: &'static [&str], new: &'static str| {
        regrouped(&text, move |name, _| if of.contains(&name) { new } else { name }.to_owned())
    };
    let walls = merged(&["wing", "trailing_edge", "wingtip", "carenage"], "wall");
    doubtful(&walls, &["wall", "the chord of section 0 is 7", "may hold a fuselage too"]);
    doubtful(&merged(&["carenage", "symmetry"], "symmetry"), &["symmetry", "turn away from the plane"]);
    let outer = doubtful(&merged(&["symmetry", "farfield"], "outer"), &["outer", "`carenage` ends in it"]);
    assert_eq!(outer["carenage"], "carenage");
}

/// A wing from y = 0 to 2 in SU2's format: the same section all along the span, in a ring of
/// hexahedra round it.
///
/// - `section`: points (x, z), counter-clockwise seen from +y
fn extruded(section: &[[f64; 2]]) -> String {
    let (around, out, along) = (section.len(), 6, 6);
    let vertex = |i: usize, j: usize, l: usize| (l * (out + 1) + j) * around + i % around;
    // A base between the last point and the first one faces the direction of the angle 0.
    let [first, last] = [section[0][0], section[around - 1][0]];
    let shift = if first == last { 0.5 } else { (0.5 - first).max(0.0) * around as f64 };
    let mut points = Vec::new();
    for l in 0..=along {
        for j in 0..=out {
            for (i, [x, z]) in section.iter().enumerate() {
                let angle = std::f64::consts::TAU * (i as f64 + shift) / around as f64;
                let far = [0.5 + 6.0 * angle.cos(), 6.0 * angle.sin()];
                let share = (j as f64 / out as f64).powi(2);
                let y = 2.0 * l as f64 / along as f64;
                points.push([x + (far[0] - x) * share, y, z + (far[1] - z) * share]);
            }
        }
    }
    let ring = |j: usize| {
        let face = move |i: usize, l: usize| {
            [vertex(i, j, l), vertex(i + 1, j, l), vertex(i + 1, j, l + 1), vertex(i, j, l + 1)]
        };
        (0..along).flat_map(move |l| (0..around).map(move |i| face(i, l))).collect::<Vec<_>>()
    };
    let end = |l: usize| {
        let face = move |i: usize, j: usize| {
            [vertex(i, j, l), vertex(i + 1, j, l), vertex(i + 1, j + 1, l), vertex(i, j + 1, l)]
        };
        (0..out).flat_map(move |j| (0..around).map(move |i| face(i, j))).collect::<Vec<_>>()
    };
    let cells = (0..along).flat_map(|l| end(l).into_iter().zip(end(l + 1)));
    let words = |numbers: &[usize]| numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
    let mut text = format!("NDIME= 3\nNELEM= {}\n", along * out * around);
    cells.for_each(|(one, other)| text += &format!("12 {}\n", words(&[one, other].concat())));
    text += &format!("NPOIN= {}\n", points.len());
    points.iter().for_each(|[x, y, z]| text += &format!("{x:?} {y:?} {z:?}\n"));
    let families = [("wing", ring(0)), ("farfield", ring(out)), ("left", end(0)), ("right", end(along))];
    text += "NMARK= 4\n";
    for (name, faces) in families {
        text += &format!("MARKER_TAG= {name}\nMARKER_ELEMS= {}\n", faces.len());
        faces.iter().for_each(|face| text += &format!("9 {}\n", words(face)));
    }
    text
}

/// The comments of a case place an airfoil where the section is, nose forward. A base behind a
/// sharp nose is a trailing edge. A diamond looks alike from both sides, which is said. Where the
/// flow comes along -x, it is said how an airfoil gets its upper side up.
///
/// Fails if a diamond's trailing edge is near the first point of the cut.
#[test]
fn comments_say_where_the_leading_edge_is() {
    // From the trailing edge round: `half` is the half thickness at shares of the chord.
    let shares: Vec<f64> = (0..=10).map(|k| 0.1 * f64::from(k)).collect();
    let section = |half: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
        let upper = shares.iter().rev().map(|&x| [x, half(x)]);
        let lower = shares.iter().filter(|&&x| half(x) > 0.0).map(|&x| [x, -half(x)]);
        upper.chain(lower).collect()
    };
    let mut diamond = section(&|x| 0.08 * x.min(1.0 - x));
    diamond.rotate_left(10);
    let based = section(&|x| if x < 0.35 { x / 12.0 } else { (0.025f64).min(0.0075 + (1.0 - x) * 0.0583) });
    let turned: Vec<[f64; 2]> = based.iter().map(|[x, z]| [1.0 - x, -z]).collect();
    let half_a_turn = turned.len() / 2;
    let turned = [&turned[half_a_turn..], &turned[..half_a_turn]].concat();
    let doubt = "tells the leading from the trailing edge";
    let upside = "upper side below";
    for (name, section, twist, nose, said) in [
        ("diamond", diamond, 0.0, 0.0, [true, false]),
        ("based", based, 0.0, 0.0, [false, false]),
        ("turned", turned, 180.0, 1.0, [false, true]),
    ] {
        let fixture = Fixture::new();
        fs::write(fixture.path("wing.su2"), extruded(&section)).unwrap();
        let output = fixture.idmesh(&["init", "wing.su2", "-o", "new"]);
        assert_good(&output);
        let case = fixture.read("new/case.toml");
        let value = |key: &str| {
            let line = case.lines().find_map(|line| line.strip_prefix(&format!("# {key} = "))).unwrap();
            line.trim_matches(['[', ']']).split(", ").map(|word| word.parse().unwrap()).collect::<Vec<f64>>()
        };
        let [found, position] = [value("twist"), value("position")];
        assert!((found[0].abs() - twist).abs() < 0.1, "{name}: twist {found:?}");
        assert!((position[0] - nose).abs() < 0.01, "{name}: leading edge {position:?}");
        let told = [doubt, upside].map(|words| stderr(&output).contains(words));
        assert_eq!(told, said, "{name}: {}", stderr(&output));
        let commented = ["tells its leading from its trailing edge", "Change the sign of each y"];
        assert_eq!(commented.map(|words| case.contains(words)), said, "{name}: {case}");
        // `cut` says the same.
        let output = fixture.idmesh(&["cut", "wing.su2", "--family", "wing", "--planes", "3", "--out", "old.csv"]);
        let told = ["does not tell the leading", upside].map(|words| stderr(&output).contains(words));
        assert_eq!(told, said, "{name}: {}", stderr(&output));
    }
}

/// What has no wing gets no case, and the message says what to do.
#[test]
fn no_wing_no_case() {
    let fixture = Fixture::new();
    fs::copy(data("box.v41.ascii.msh"), fixture.path("cube.msh")).unwrap();
    fixture.refuses_command(&["init", "cube.msh"], 3, &["cube.msh", "no family looks like a wing"]);
    let output = fixture.idmesh(&["init", "cube.msh"]);
    assert!(stderr(&output).contains("hint: ") && stderr(&output).contains("--wing"), "{}", stderr(&output));
    // The far boundary has no sections like a wing's, whatever the user calls it.
    let fixture = with_wing();
    fixture.refuses_command(&["init", "wing.su2", "--wing", "symmetry"], 3, &["symmetry", "cannot be cut"]);
    fixture.refuses_command(&["init", "wing.su2", "--wing", "wnig"], 3, &["`wnig`", "wing"]);
}

/// A folder with a wing in it, `wing.su2`, and a case.
fn with_wing() -> Fixture {
    let fixture = Fixture::new();
    fs::write(fixture.path("wing.su2"), unpacked(&data("shape/half4.su2.gz"))).unwrap();
    fixture
}

/// Files that are there stay, unless they may go.
#[test]
fn nothing_is_overwritten() {
    let fixture = with_wing();
    let kept = fixture.read("case.toml");
    fixture.refuses_command(&["init", "wing.su2", "--output", "case.toml"], 3, &["case.toml", "is there already"]);
    fixture.refuses_command(&["init", "wing.su2", "--output", "."], 3, &["case.toml", "is there already"]);
    assert_eq!(fixture.read("case.toml"), kept);
    fs::create_dir(fixture.path("mine")).unwrap();
    fs::create_dir(fixture.path("mine/new")).unwrap();
    fixture.write("mine/new/wing-0.csv", "mine");
    fixture.refuses_command(&["init", "wing.su2", "-o", "mine"], 3, &["wing-0.csv", "is there already"]);
    assert_eq!(fixture.read("mine/new/wing-0.csv"), "mine");
    assert!(!fixture.path("mine/case.toml").exists() && !fixture.path("mine/old").exists());
    assert_good(&fixture.idmesh(&["init", "wing.su2", "-o", "mine", "--force"]));
    assert!(fixture.read("mine/new/wing-0.csv").starts_with("profile,x,y,z"));
    assert_good(&fixture.idmesh(&["run", "mine/case.toml", "--backend", "cpu"]));
    // Sections that the new case does not have go, and files of others stay.
    fixture.write("mine/new/wing-best.csv", "mine");
    fixture.write("mine/new/tail-4.csv", "mine");
    assert_good(&fixture.idmesh(&["init", "wing.su2", "-o", "mine", "--force", "--planes", "2"]));
    assert_eq!(names(&fixture.path("mine/new")), ["tail-4.csv", "wing-0.csv", "wing-1.csv", "wing-best.csv"]);
}

/// The words that say what to do next work in a shell as they stand.
#[test]
#[cfg(unix)]
fn what_to_do_next_may_be_typed() {
    let fixture = with_wing();
    fs::copy(fixture.path("wing.su2"), fixture.path("-x.su2")).unwrap();
    for arguments in [&["wing.su2", "-o", "my case & it's $HOME"][..], &["--", "-x.su2"]] {
        let output = fixture.idmesh(&[&["init"], arguments].concat());
        assert_good(&output);
        let text = stdout(&output);
        let line = text.lines().find_map(|line| line.strip_prefix("  idmesh run ")).unwrap();
        let line = line.split("   nothing moves yet").next().unwrap();
        let script = format!("\"$IDMESH\" check {line}");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &script]).current_dir(&fixture.folder).env("IDMESH", env!("CARGO_BIN_EXE_idmesh"));
        let output = shell.output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{script}: {}", stderr(&output));
    }
}

/// Without `--output` the case stands in a folder named after the mesh. Names of families are
/// quoted where they must be.
#[test]
fn a_case_stands_beside_its_sections() {
    let fixture = Fixture::new();
    let mesh = String::from_utf8(unpacked(&data("small.v22.msh.gz"))).unwrap();
    assert!(mesh.contains("\"wingtip\""));
    fixture.write("my wing.v2.msh", &mesh.replace("\"wingtip\"", "\"tip 'of' # the wing\""));
    assert_good(&fixture.idmesh(&["init", "my wing.v2.msh", "--planes", "3"]));
    let mut files = names(&fixture.path("my_wing-case"));
    files.extend(names(&fixture.path("my_wing-case/new")));
    let written = ["case.schema.json", "case.toml", "new", "old", "wing-0.csv", "wing-1.csv", "wing-2.csv"];
    assert_eq!(files, written);
    // Editors find the schema by the first line.
    let case = fs::read_to_string(fixture.path("my_wing-case/case.toml")).unwrap();
    let named = case.lines().next().unwrap().strip_prefix("#:schema ./").unwrap();
    let schema = fs::read_to_string(fixture.path("my_wing-case").join(named)).unwrap();
    assert_eq!(schema, idmesh::case::SCHEMA);
    assert_good(&fixture.idmesh(&["check", "my_wing-case/case.toml"]));
    assert_eq!(roles(&fixture.path("my_wing-case/case.toml"))["tip 'of' # the wing"], "wingtip");
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
