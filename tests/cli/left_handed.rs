//! Meshes of left-handed tets, such as mirrored ones: turned over inside, moved like the original,
//! written back in their own order.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::formats::{self, Fields};
use idmesh::quality;
use serde_json::Value;

use crate::fixture::*;
use crate::wing_box::WingBox;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn mirrored(at: DVec3) -> DVec3 {
    DVec3::new(at.x, -at.y, at.z)
}

/// The text of an SU2 file, or of profiles, with y negated in the rows that hold coordinates.
fn mirrored_text(text: &str, is_row: impl Fn(usize) -> bool, separator: char, y: usize) -> String {
    let line = |(number, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(separator).map(str::to_owned).collect();
        if is_row(number) {
            fields[y] = (-fields[y].parse::<f64>().unwrap()).to_string();
        }
        fields.join(&separator.to_string()) + "\n"
    };
    text.lines().enumerate().map(line).collect()
}

/// Line numbers of the coordinates of an SU2 file.
fn coordinates(text: &str) -> std::ops::Range<usize> {
    let (start, count) =
        text.lines().enumerate().find_map(|(number, line)| Some((number + 1, line.strip_prefix("NPOIN=")?))).unwrap();
    start..start + count.trim().split(' ').next().unwrap().parse::<usize>().unwrap()
}

fn positions(text: &str) -> Vec<DVec3> {
    let number = |field: &str| field.parse::<f64>().unwrap();
    let at = |line: &str| DVec3::from_slice(&line.split_whitespace().take(3).map(number).collect::<Vec<_>>());
    let rows = coordinates(text);
    text.lines().skip(rows.start).take(rows.len()).map(at).collect()
}

fn without_coordinates(text: &str) -> Vec<&str> {
    let rows = coordinates(text);
    text.lines().enumerate().filter(|(number, _)| !rows.contains(number)).map(|(_, line)| line).collect()
}

const ROLES: &str = "[family.wing]\nrole = \"wing\"\n[family.trailing_edge]\nrole = \"trailing-edge\"\n[family.wingtip]\nrole = \
                     \"wingtip\"\n[family.carenage]\nrole = \"carenage\"\n[family.symmetry]\nrole = \"plane\"\n[family.farfield]\nrole \
                     = \"fixed\"\n";

/// The mirror image of a mesh, moved to mirrored profiles, is the mirror image of the moved mesh.
/// Its tets stand in the file as before.
#[test]
fn a_mirrored_mesh_moves_like_the_original() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", data("small.msh.gz").to_str().unwrap(), "right.su2"]));
    let right = fixture.read("right.su2");
    let rows = coordinates(&right);
    fixture.write("left.su2", &mirrored_text(&right, |number| rows.contains(&number), ' ', 1));
    for set in ["planform_2", "big_2"] {
        let mut moved = Vec::new();
        for (name, sign) in [("right", 1), ("left", -1)] {
            for profiles in ["old_2", set] {
                let text = fs::read_to_string(data(&format!("profiles/{profiles}.csv"))).unwrap();
                let text = if sign < 0 { mirrored_text(&text, |number| number > 0, ',', 2) } else { text };
                fixture.write(&format!("{profiles}.csv"), &text);
            }
            let files = format!("[profiles.wing]\nold = \"old_2.csv\"\nnew = \"{set}.csv\"\n");
            let outputs = "[output]\nmesh = [\"moved.su2\", \"moved.vtu\"]\n";
            fixture.write("case.toml", &format!("mesh = \"{name}.su2\"\n{files}{ROLES}{outputs}"));
            let output = fixture.run();
            assert_good(&output);
            let told = stderr(&output).lines().filter(|line| line.contains("all tets are left-handed")).count();
            assert_eq!(told, usize::from(sign < 0), "{}", stderr(&output));
            let text = fixture.read("moved.su2");
            assert_eq!(without_coordinates(&text), without_coordinates(&fixture.read(&format!("{name}.su2"))));
            moved.push(positions(&text));
            // A new file has right-handed tets.
            let vtu = formats::read(&fixture.path("moved.vtu")).unwrap();
            assert!(vtu.left_handed.is_empty());
            assert!(quality::betas(&vtu.mesh.vertices, &vtu.mesh.tets).iter().all(|&beta| beta > 0.0));
        }
        let largest = moved[0].iter().zip(positions(&right)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        let apart = moved[0].iter().zip(&moved[1]).map(|(a, b)| mirrored(*a).distance(*b)).fold(0.0, f64::max);
        assert!(largest > 0.1 && apart < 1e-12 * largest, "{set}: {apart:e} of {largest}");
    }
}

/// In each format: the mirrored file is read like the original with each tet turned over, and
/// mirrored once more it is the original again, so the tets kept their order in the file.
#[test]
fn files_keep_the_order_of_left_handed_tets() {
    let fixture = Fixture::new();
    let small = data("small.msh.gz");
    for folder in ["right", "left", "back"] {
        fs::create_dir(fixture.path(folder)).unwrap();
    }
    for name in NAMES {
        let [right_path, left_path, back_path] =
            ["right", "left", "back"].map(|folder| fixture.path(&format!("{folder}/{name}")));
        assert_good(&fixture.idmesh(&["convert", small.to_str().unwrap(), right_path.to_str().unwrap()]));
        let right = formats::read(&right_path).unwrap();
        assert!(right.left_handed.is_empty(), "{name}");
        let mirror: Vec<DVec3> = right.mesh.vertices.iter().map(|&at| mirrored(at)).collect();
        right.write(&left_path, &mirror, &Fields::default()).unwrap();
        let left = formats::read(&left_path).unwrap();
        assert_eq!(left.left_handed, ["tets"], "{name}");
        let turned = right.mesh.tets.iter().map(|&[a, b, c, d]| [a, c, b, d]);
        assert!(left.mesh.tets.iter().copied().eq(turned), "{name}");
        assert_eq!(left.mesh.triangles, right.mesh.triangles, "{name}");
        let again: Vec<DVec3> = left.mesh.vertices.iter().map(|&at| mirrored(at)).collect();
        left.write(&back_path, &again, &Fields::default()).unwrap();
        // Binary files hold -0 where y was 0, and the value is the same.
        let twice = formats::read(&back_path).unwrap();
        assert!(twice.left_handed.is_empty() && twice.mesh == right.mesh, "{name}");
    }
}

/// Files of every format, with different stems where a format has its names in a file beside.
const NAMES: &[&str] = &[
    "a.msh",
    "a.su2",
    "a.vtu",
    "a.vtk",
    "a.ugrid",
    "b.lb8.ugrid",
    "a.mesh",
    "b.meshb",
    "polyMesh",
    #[cfg(feature = "cgns")]
    "a.cgns",
];

/// The same order of vertices in every tet, but the other one: the box moves as ever.
#[test]
fn tets_in_another_order_are_turned_over() {
    let fixture = Fixture::new();
    assert_good(&fixture.run());
    let usual = formats::read(&fixture.path("moved.msh")).unwrap().mesh.vertices;
    let measured = stdout(&fixture.idmesh(&["quality", "box.msh"]));
    fixture.mesh(|mesh| mesh.tets.iter_mut().for_each(|tet| tet.swap(0, 3)));
    assert_good(&fixture.run());
    let file = formats::read(&fixture.path("moved.msh")).unwrap();
    assert_eq!(file.left_handed, ["tets"]);
    let apart = usual.iter().zip(&file.mesh.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(apart < 1e-12 * 0.05, "{apart:e}");

    let output = fixture.idmesh(&["quality", "box.msh"]);
    assert_good(&output);
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let told = words("left-handed in the file tets").join(" ");
    assert!(words(&stdout(&output)).join(" ").contains(&told), "{}", stdout(&output));
    assert_eq!(words(&stdout(&output)).join(" ").replacen(&format!("{told} "), "", 1), words(&measured).join(" "));
    let figures: Value =
        serde_json::from_str(&stdout(&fixture.idmesh(&["quality", "box.msh", "--json", "-"]))).unwrap();
    assert_eq!((&figures["left_handed"][0], &figures["inverted"]), (&Value::from("tets"), &Value::from(0)));
}

/// Where the tets disagree, nobody but the mesh's owner knows which of them are right.
#[test]
fn most_tets_left_handed_are_refused() {
    let fixture = Fixture::new();
    let n = WingBox::new().tets.len();
    fixture
        .mesh(|mesh| mesh.tets.iter_mut().enumerate().filter(|(tet, _)| *tet != 7).for_each(|(_, tet)| tet.swap(0, 3)));
    let count = format!("box.msh: {} of {n} tets are left-handed", n - 1);
    fixture.refuses(3, &[&count, "tet 7 is not", "swap two vertices"]);
    let figures: Value =
        serde_json::from_str(&stdout(&fixture.idmesh(&["quality", "box.msh", "--json", "-"]))).unwrap();
    assert_eq!((figures["left_handed"].as_array(), &figures["inverted"]), (None, &Value::from(n - 1)));
    // Half of the tets are no more left-handed than right-handed.
    fixture.mesh(|mesh| mesh.tets.iter_mut().take(n / 2).for_each(|tet| tet.swap(0, 3)));
    fixture.refuses(3, &[&format!("{} of {n} tets are inverted or flat", n / 2)]);
}

/// A mirrored mesh of all shapes of cells measures like the original.
#[test]
fn mirrored_cells_of_all_shapes_are_measured() {
    let fixture = Fixture::new();
    let right = data("mixed/gmsh.v41.ascii.msh");
    let file = formats::read_mixed(&right).unwrap();
    assert!(file.left_handed.is_empty());
    let mirror: Vec<DVec3> = file.mesh.vertices.iter().map(|&at| mirrored(at)).collect();
    file.write(&fixture.path("left.msh"), &mirror, &Fields::default()).unwrap();
    let measure = |mesh: &Path| -> Value {
        let output = fixture.idmesh(&["quality", mesh.to_str().unwrap(), "--json", "-"]);
        assert_good(&output);
        serde_json::from_str(&stdout(&output)).unwrap()
    };
    let (right, left) = (measure(&right), measure(&fixture.path("left.msh")));
    assert_eq!(left["left_handed"], serde_json::json!(["tets", "pyramids", "prisms", "hexahedra"]));
    for measure in ["beta_min", "beta_max", "beta_mean"] {
        let [right, left] = [&right, &left].map(|figures| figures[measure].as_f64().unwrap());
        assert!((right - left).abs() < 1e-14, "{measure}: {right} {left}");
    }
    assert_eq!((&right["inverted"], &left["inverted"]), (&Value::from(0), &Value::from(0)));
    // A new file has right-handed cells.
    assert_good(&fixture.idmesh(&["convert", "left.msh", "new.vtu"]));
    let new = formats::read_mixed(&fixture.path("new.vtu")).unwrap();
    assert!(new.left_handed.is_empty() && new.others.counts().count() == 4);
    assert!(quality::betas(&new.mesh.vertices, &new.others.tets()).iter().all(|&beta| beta > 0.0));
}

/// A shape in another order than the others is turned over, and told. A shape that its vertices
/// turn inside out is inverted.
#[test]
fn one_shape_in_another_order_is_told() {
    let fixture = Fixture::new();
    let mixed = data("mixed/gmsh.v41.ascii.msh");
    assert_good(&fixture.idmesh(&["convert", mixed.to_str().unwrap(), "mixed.ugrid"]));
    let text = fixture.read("mixed.ugrid");
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let quality = |mesh: &str| {
        let figures = stdout(&fixture.idmesh(&["quality", mesh, "--json", "-"]));
        serde_json::from_str::<Value>(&figures).unwrap()
    };
    let measured = quality("mixed.ugrid");
    // The last four lines are a tet, a pyramid, a prism and a hexahedron. In this format the base
    // of a pyramid is 2, 1, 4, 5.
    let n = lines.len();
    for (line, turns, shape) in [
        (n - 4, &[[0, 1]][..], "tets"),
        (n - 3, &[[0, 4]], "pyramids"),
        (n - 2, &[[0, 1], [3, 4]], "prisms"),
        (n - 1, &[[1, 3], [5, 7]], "hexahedra"),
    ] {
        let mut turned = lines.clone();
        let mut corners: Vec<&str> = lines[line].split_whitespace().collect();
        turns.iter().for_each(|&[a, b]| corners.swap(a, b));
        turned[line] = corners.join(" ");
        let mesh = format!("{shape}.ugrid");
        fixture.write(&mesh, &(turned.join("\n") + "\n"));
        fs::copy(fixture.path("mixed.mapbc"), fixture.path(&format!("{shape}.mapbc"))).unwrap();
        let figures = quality(&mesh);
        assert_eq!(figures["left_handed"], serde_json::json!([shape]), "{figures}");
        for key in ["inverted", "beta_min", "beta_max", "beta_mean"] {
            assert_eq!(figures[key], measured[key], "{shape}: {key}");
        }
        let output = fixture.idmesh(&["convert", &mesh, &format!("{shape}.b8.ugrid")]);
        assert_good(&output);
        assert!(stderr(&output).contains(&format!("{mesh}: all {shape} are left-handed")), "{}", stderr(&output));
    }
    // Vertex 9, the apex of the pyramid, far below its base, so that the tet on it is inverted too.
    // In the text the vertices follow a line with the counts.
    let mut inverted = lines.clone();
    assert_eq!(inverted[9].split_whitespace().last(), Some("1.6"), "{}", inverted[9]);
    inverted[9] = inverted[9].replace("1.6", "0.6");
    fixture.write("inverted.ugrid", &(inverted.join("\n") + "\n"));
    fs::copy(fixture.path("mixed.mapbc"), fixture.path("inverted.mapbc")).unwrap();
    let figures = quality("inverted.ugrid");
    assert_eq!((&figures["inverted"], figures.get("left_handed")), (&Value::from(2), None), "{figures}");
}
