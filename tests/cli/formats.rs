//! Meshes in other formats: converted, measured, moved.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::formats;
use idmesh::mesh::TetMesh;

use crate::fixture::*;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

const ROLES: [(&str, &str); 6] = [
    ("wing", "wing"),
    ("trailing_edge", "trailing-edge"),
    ("wingtip", "wingtip"),
    ("carenage", "carenage"),
    ("symmetry", "plane"),
    ("farfield", "fixed"),
];

/// What a family is called, from its number and its name in `small.msh.gz`.
type FamilyName = fn(usize, &str) -> String;

/// What `small.vtu` is converted to, and what its families are called there.
const CONVERTED: &[(&str, FamilyName)] = &[
    ("a.msh", numbered),
    ("a.su2", joined),
    ("a.vtu.gz", numbered),
    ("a.vtk", numbered),
    ("a.lb8.ugrid", joined),
    ("a.b8l.ugrid", joined),
    ("a.ugrid.gz", joined),
    ("a.mesh", numbered),
    // Another stem: it would find its names in the .mapbc file of a.ugrid.
    ("b.meshb", numbered),
    ("polyMesh", joined),
    #[cfg(feature = "cgns")]
    ("a.cgns", numbered),
];

/// A case for a half aircraft in some format, with the moved mesh in the same format.
///
/// - `profiles`: the keys `new` and `old` with their files
fn case(profiles: &[(&str, PathBuf); 2], mesh: &Path, output: &str, family: FamilyName) -> String {
    let mut text = format!("mesh = {mesh:?}\n[profiles.\"{}\"]\n", family(0, "wing"));
    for (key, path) in profiles {
        text += &format!("{key} = {path:?}\n");
    }
    for (index, (name, role)) in ROLES.iter().enumerate() {
        text += &format!("[family.\"{}\"]\nrole = \"{role}\"\n", family(index, name));
    }
    text + &format!("[output]\nmesh = \"{output}\"\n")
}

/// New and old profiles of the mesh `small`.
fn small_profiles() -> [(&'static str, PathBuf); 2] {
    [("new", data("profiles/planform_2.csv")), ("old", data("profiles/old_2.csv"))]
}

/// Moves the mesh `small` of a file, and gives its vertices before and after.
fn moved(fixture: &Fixture, mesh: &Path, output: &str, family: FamilyName) -> [Vec<DVec3>; 2] {
    moved_to(fixture, &small_profiles(), mesh, output, family)
}

/// Moves the mesh of a file to new profiles, and gives its vertices before and after.
fn moved_to(
    fixture: &Fixture,
    profiles: &[(&str, PathBuf); 2],
    mesh: &Path,
    output: &str,
    family: FamilyName,
) -> [Vec<DVec3>; 2] {
    fixture.write("case.toml", &case(profiles, mesh, output, family));
    assert_good(&fixture.run());
    let before = formats::read(mesh).unwrap().mesh;
    let after = formats::read(&fixture.path(output)).unwrap().mesh;
    assert_eq!((&after.tets, &after.triangles, &after.families), (&before.tets, &before.triangles, &before.families));
    assert!(after.vertices.iter().zip(&before.vertices).filter(|(a, b)| a != b).count() > 500, "{output}");
    [before.vertices, after.vertices]
}

fn named(_: usize, name: &str) -> String {
    name.to_owned()
}

/// In formats whose names have no spaces.
fn joined(index: usize, _: &str) -> String {
    format!("surface_{}", index + 1)
}

fn numbered(index: usize, _: &str) -> String {
    format!("surface {}", index + 1)
}

/// The same mesh as gmsh and meshio wrote it, with the same vertices and tets and the triangles in
/// another order, gives the same motion to the last bit of what the files hold: 16 digits in Gmsh's
/// text.
#[test]
fn one_motion_comes_out_of_every_program_s_files() {
    let fixture = Fixture::new();
    let reference = moved(&fixture, &data("small.msh.gz"), "moved.msh", named);
    assert!(moved(&fixture, &data("small.su2.gz"), "moved.su2", named) == reference, "SU2");
    assert!(moved(&fixture, &data("small.vtu"), "moved.vtu", numbered) == reference, "VTU");
    let digits = moved(&fixture, &data("small.v22.msh.gz"), "moved.v22.msh", named);
    for ((a, b), tolerance) in digits.iter().zip(&reference).zip([1e-14, 1e-11]) {
        assert!(a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(*b, tolerance)));
    }
}

/// Converted, the mesh also keeps its motion to the bit, in files that list triangles family by
/// family and in those that keep the faces of tets only.
#[test]
fn one_motion_comes_out_of_every_format() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("moved")).unwrap();
    let reference = moved(&fixture, &data("small.vtu"), "moved.vtu", numbered);
    for &(name, family) in CONVERTED {
        assert_good(&fixture.idmesh(&["convert", data("small.vtu").to_str().unwrap(), name]));
        assert!(moved(&fixture, &fixture.path(name), &format!("moved/{name}"), family) == reference, "{name}");
    }
}

/// The example, whose triangles gmsh lists by surface, not by vertex.
#[test]
fn the_example_moves_alike_from_every_kind_of_file() {
    let fixture = Fixture::new();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body");
    fs::create_dir(fixture.path("moved")).unwrap();
    let profiles = ["new", "old"].map(|key| (key, example.join(format!("{key}.csv"))));
    let mesh = example.join("wing-body.msh.gz");
    let reference = moved_to(&fixture, &profiles, &mesh, "moved/a.msh", named);
    let files: &[(&str, FamilyName)] = &[
        ("a.su2", named),
        ("a.vtu", named),
        ("a.lb8.ugrid", named),
        ("b.meshb", numbered),
        ("polyMesh", named),
        #[cfg(feature = "cgns")]
        ("a.cgns", named),
    ];
    for &(name, family) in files {
        assert_good(&fixture.idmesh(&["convert", mesh.to_str().unwrap(), name]));
        let moved = moved_to(&fixture, &profiles, &fixture.path(name), &format!("moved/{name}"), family);
        assert!(moved == reference, "{name}");
    }
}

/// The triangles with their families, in an order of their own: files hold them family by family.
fn faces(mesh: &TetMesh) -> Vec<(u16, [u32; 3])> {
    let mut faces: Vec<_> = mesh.triangle_family.iter().map(|family| family.0).zip(mesh.triangles.clone()).collect();
    faces.sort_unstable();
    faces
}

#[test]
fn convert_keeps_the_mesh_and_warns_of_losses() {
    let fixture = Fixture::new();
    let original = formats::read(&data("small.msh.gz")).unwrap().mesh;
    let chain = ["a.su2.gz", "b.vtu", "c.msh", "d.vtu.gz", "e.su2"];
    let mut input = data("small.msh.gz");
    for name in chain {
        let output = fixture.idmesh(&["convert", input.to_str().unwrap(), name]);
        assert_good(&output);
        assert!(stderr(&output).contains(&format!("wrote {name}")));
        input = fixture.path(name);
        let mesh = formats::read(&input).unwrap().mesh;
        assert_eq!((&mesh.vertices, &mesh.tets), (&original.vertices, &original.tets), "{name}");
        assert_eq!(mesh.families, original.families, "{name}");
        assert_eq!(faces(&mesh), faces(&original), "{name}");
    }
    let mixed = data("mixed/gmsh.v41.ascii.msh");
    let output = fixture.idmesh(&["convert", mixed.to_str().unwrap(), "mixed.su2"]);
    assert_good(&output);
    assert!(stderr(&output).contains("warning: mixed.su2: the family 'wing skin' is called 'wing_skin'"));
    assert!(fixture.read("mixed.su2").contains("MARKER_TAG= wing_skin\nMARKER_ELEMS= 1\n"));

    fixture.refuses_command(&["convert", "a.su2.gz", "a.obj"], 3, &["a.obj", "unknown mesh format", ".su2 (SU2)"]);
    fixture.refuses_command(&["convert", "a.su2.gz", "./a.su2.gz"], 3, &["would overwrite the input"]);
    fixture.refuses_command(&["convert", "a.su2.gz", "missing/a.su2"], 3, &["missing/a.su2"]);
    fixture.refuses_command(&["convert", "nothing.su2", "x.su2"], 3, &["nothing.su2"]);
}

/// The new section as coordinates without units, placed by the case, moves the wing as the CSV file
/// does.
#[test]
fn airfoils_move_the_wing_like_csv() {
    let fixture = Fixture::new();
    // The wing of the fixture in units of its chord, 0.75: its leading edge is where x is 1.
    let corners = [(1.0, -1.0), (0.5, -1.0), (0.0, -1.0), (0.0, 0.0), (0.0, 1.0), (0.5, 1.0), (1.0, 1.0)];
    let airfoil: String = corners.iter().rev().map(|(x, side)| format!("{x} {}\n", side / 3.0)).collect();
    for (name, y, dz) in [("root", 0.3, 0.02), ("tip", 1.2, 0.05)] {
        fixture.write(&format!("{name}.dat"), &format!("Block, {name}\n{airfoil}"));
        let csv = profiles(&[(if name == "root" { 0 } else { 1 }, y, dz)]);
        fixture.write(&format!("{name}.csv"), &csv);
    }
    assert_good(&fixture.run());
    let expected = formats::read(&fixture.path("moved.msh")).unwrap().mesh.vertices;
    let placement = |name: &str, y: f64, z: f64| {
        format!("[profiles.wing.placement.\"{name}.dat\"]\nchord = 0.75\nposition = [1.0, {y}, {z}]\n")
    };
    let placed =
        format!("new = [\"root.dat\", \"tip.dat\"]\n{}{}", placement("root", 0.3, 0.02), placement("tip", 1.2, 0.05));
    fixture.case("new = \"new.csv\"\n", &placed);
    assert_good(&fixture.run());
    let moved = formats::read(&fixture.path("moved.msh")).unwrap().mesh.vertices;
    assert!(moved.iter().zip(&expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-9)));
    fixture.case("new = \"new.csv\"\n", "new = [\"root.dat\", \"tip.csv\"]\n");
    fixture.refuses(3, &["root.dat:1", "do not say where it is", "placement"]);
}

/// Names that another mesh's file would give an output are found before anything is computed, also
/// for an invalid result.
#[test]
fn another_meshs_names_are_found_first() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"", "mesh = \"moved.lb8.ugrid\"");
    for beside in ["moved.mapbc", "moved.invalid.mapbc"] {
        fixture.write(beside, "1\n1 4000 other\n");
        fixture.refuses(3, &[beside, "is there already and is not this mesh's", "it calls family 1 'other'"]);
        fs::remove_file(fixture.path(beside)).unwrap();
    }
    assert_good(&fixture.run());
    assert_good(&fixture.run());
}

/// The conditions of an earlier mesh beside an output are found before anything is computed.
#[test]
fn another_meshs_conditions_are_found_first() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "box.ugrid"]));
    let conditions = |number: &str| fixture.read("box.mapbc").replacen("1 0 wing", &format!("1 {number} wing"), 1);
    let (slip, wall) = (conditions("3000"), conditions("4000"));
    fixture.write("box.mapbc", &slip);
    let case = "mesh = \"box.ugrid\"\n";
    fixture.write("case.toml", &CASE.replace("mesh = \"box.msh\"\n", case).replace("moved.msh", "moved.ugrid"));
    assert_good(&fixture.run());
    assert_eq!(fixture.read("moved.mapbc"), slip);
    assert_good(&fixture.run());
    fixture.write("box.mapbc", &wall);
    fixture.refuses(3, &["moved.mapbc is there already", "gives family 1 the boundary condition 3000, the mesh 4000"]);
    fs::remove_file(fixture.path("moved.mapbc")).unwrap();
    assert_good(&fixture.run());
    assert_eq!(fixture.read("moved.mapbc"), wall);
}

/// An output in another format tells of what it cannot hold.
#[test]
fn run_warns_of_losses() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"moved.vtu\", \"moved.lb8.ugrid\", \"moved.msh\"]");
    let output = fixture.run();
    assert_good(&output);
    let warnings: Vec<_> =
        stderr(&output).lines().filter(|line| line.starts_with("warning")).map(str::to_owned).collect();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("moved.lb8.ugrid: boundary conditions: the .mapbc file"), "{warnings:?}");
    let moved = formats::read(&fixture.path("moved.msh")).unwrap().mesh;
    let other = formats::read(&fixture.path("moved.lb8.ugrid")).unwrap().mesh;
    assert_eq!((&moved.vertices, &moved.families), (&other.vertices, &other.families));
}

/// A folder in, a folder out; the source is never written to.
#[test]
fn openfoam_folders_are_moved() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", data("small.msh.gz").to_str().unwrap(), "polyMesh"]));
    fs::create_dir(fixture.path("moved")).unwrap();
    let mesh = fixture.path("polyMesh");
    fixture.write("case.toml", &case(&small_profiles(), &mesh, "moved/polyMesh", named));
    assert_good(&fixture.run());
    let before = formats::read(&mesh).unwrap().mesh;
    let after = formats::read(&fixture.path("moved/polyMesh")).unwrap().mesh;
    assert_eq!((&after.tets, &after.triangles, &after.families), (&before.tets, &before.triangles, &before.families));
    assert!(after.vertices.iter().zip(&before.vertices).filter(|(a, b)| a != b).count() > 500);
    fixture.write("case.toml", &case(&small_profiles(), &mesh, "polyMesh/points", named));
    fixture.refuses(3, &["would overwrite the input"]);
    assert_eq!(formats::read(&mesh).unwrap().mesh.vertices, before.vertices);
}

/// Without tets there is no beta: the histogram shows the scaled Jacobian, of `quality` and of
/// `run`. Of a mesh with one tet in four cells it says so.
#[test]
fn histograms_show_what_is_there() {
    let fixture = Fixture::new();
    let cube = "NDIME= 3\nNELEM= 1\n12 0 1 2 3 4 5 6 7 0\nNPOIN= 8\n0 0 0 0\n1 0 0 1\n1 1 0 2\n0 1 0 3\n0 0 1 4\n1 0 1 5\n\
                1 1 1 6\n0 1 1 7\nNMARK= 1\nMARKER_TAG= wall\nMARKER_ELEMS= 6\n9 0 3 2 1\n9 4 5 6 7\n9 0 1 5 4\n\
                9 3 7 6 2\n9 0 4 7 3\n9 1 2 6 5\n";
    fixture.write("cube.su2", cube);
    assert_good(&fixture.idmesh(&["quality", "cube.su2", "--histogram", "beta.svg"]));
    let svg = fixture.read("beta.svg");
    assert!(svg.contains("mesh (1 cells, mean 1.00000)") && !svg.contains("NaN"), "{svg}");
    let case = "mesh = \"cube.su2\"\n[family.wall]\nrole = \"fixed\"\n[output]\nhistogram = \"moved.svg\"\n";
    fixture.write("case.toml", case);
    let output = fixture.run();
    assert_good(&output);
    let svg = fixture.read("moved.svg");
    assert!(svg.contains("original (1 cells, mean 1.0") && svg.contains("final (1 cells, mean 1.0"), "{svg}");
    assert!(!svg.contains("NaN"));
    let text = stdout(&output);
    assert!(text.contains("no cell is a tet, so there is no beta; inverted counts all 1 cells"), "{text}");
    assert!(text.contains("hexahedra, original") && text.contains("hexahedra, final"), "{text}");

    let mesh = data("mixed/gmsh.v41.ascii.msh");
    assert_good(&fixture.idmesh(&["quality", mesh.to_str().unwrap(), "--histogram", "mixed.svg"]));
    assert!(fixture.read("mixed.svg").contains(": the tets, 25.0 % of the cells"));
}

/// `mixed` holds a cell of each kind, a unit cube among them.
#[test]
fn mixed_meshes_are_measured() {
    let fixture = Fixture::new();
    let mesh = data("mixed/gmsh.v41.ascii.msh");
    let mesh = mesh.to_str().unwrap();
    let output = fixture.idmesh(&["quality", mesh, "--json", "-"]);
    assert_good(&output);
    let figures: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(figures["others"]["pyramids"], 1);
    assert_eq!(figures["others"]["quadrilaterals"], 6);
    assert_eq!(figures["mesh"]["tets"], 1);
    assert_eq!(figures["inverted"], 0);
    // The cube has scaled Jacobians of 1.
    assert_eq!(figures["cells"]["hexahedra"]["jacobian_min"], 1.0);
    assert_eq!(figures["cells"]["hexahedra"]["inverted"], 0);
    let text = stdout(&fixture.idmesh(&["quality", mesh]));
    assert!(text.contains("hexahedra"), "{text}");
    assert!(text.lines().any(|line| line.split_whitespace().eq(["wing", "skin", "4", "0", "1"])), "{text}");

    fixture.case("mesh = \"box.msh\"", &format!("mesh = {mesh:?}"));
    // Its cells do not touch, and most of their faces have no family.
    fixture.refuses(3, &["no [family] table for `wing skin`"]);
}

/// A wing-body with layers, in every format that has such cells and the names of families: the
/// moved mesh reads back with the same cells, and a new VTU file has the measures of each cell.
#[test]
fn hybrid_meshes_move_in_every_format() {
    let fixture = Fixture::new();
    let source = data("hybrid/small.msh.gz");
    fs::create_dir(fixture.path("moved")).unwrap();
    let read = |path: &Path| formats::read_mixed(path).unwrap();
    let (before, old, new) = (read(&source), data("hybrid/old_2.csv"), data("hybrid/big_2.csv"));
    let mut formats = vec!["msh", "su2", "vtu", "b8.ugrid", "foam"];
    formats.extend(cfg!(feature = "cgns").then_some("cgns"));
    for extension in formats {
        let (mesh, moved) = match extension {
            "foam" => ("polyMesh".to_owned(), "moved/polyMesh".to_owned()),
            _ => (format!("mesh.{extension}"), format!("moved.{extension}")),
        };
        assert_good(&fixture.idmesh(&["convert", source.to_str().unwrap(), &mesh]));
        let families = ["wing", "trailing-edge", "wingtip", "carenage", "plane", "fixed"];
        let names = ["wing", "trailing_edge", "wingtip", "carenage", "symmetry", "farfield"];
        let tables = names.iter().zip(families).map(|(name, role)| format!("[family.{name}]\nrole = \"{role}\"\n"));
        let case = format!(
            "mesh = {mesh:?}\n[profiles.wing]\nnew = {new:?}\nold = {old:?}\n{}[output]\nmesh = [{moved:?}, \"shown.vtu\"]\n",
            tables.collect::<String>()
        );
        fixture.write("case.toml", &case);
        let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
        assert_good(&output);
        assert!(stdout(&output).contains("hexahedra"), "{extension}");
        let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
        assert_eq!(report["cells"]["prisms"]["count"], 800, "{extension}");
        assert_eq!(report["mesh"]["hexahedra"], 816, "{extension}");
        let (given, after) = (read(&fixture.path(&mesh)), read(&fixture.path(&moved)));
        assert_eq!((&after.mesh.tets, &after.others), (&given.mesh.tets, &given.others), "{extension}");
        assert_eq!(given.others.n_cells(), before.others.n_cells());
        let changed = after.mesh.vertices.iter().zip(&given.mesh.vertices).filter(|(a, b)| a != b).count();
        assert!(changed > 1000, "{extension}: {changed}");
        // A VTU file that is written back keeps its own arrays.
        if extension == "vtu" {
            continue;
        }
        let shown = fs::read(fixture.path("shown.vtu")).unwrap();
        let has = |name: &[u8]| shown.windows(name.len()).any(|found| found == name);
        assert!(has(b"Name=\"scaled_jacobian\"") && has(b"Name=\"shape\"") && has(b"Name=\"beta\""), "{extension}");
    }
}

/// A warning of a reader is shown by every command that reads.
#[test]
fn warnings_of_a_reader_are_shown() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "box.su2"]));
    let markers = |text: &str| text.lines().filter(|line| line.starts_with("MARKER_TAG")).count();
    let text = fixture.read("box.su2");
    let (before, count) = (format!("NMARK= {}\n", markers(&text)), format!("NMARK= {}\n", markers(&text) + 1));
    assert!(text.contains(&before));
    let shared = "MARKER_TAG= SEND_RECEIVE\nMARKER_ELEMS= 1\nSEND_RECV= 2\n1 5\n";
    fixture.write("part.su2", &(text.replace(&before, &count) + shared));
    fixture.case("mesh = \"box.msh\"", "mesh = \"part.su2\"");
    fs::create_dir(fixture.path("designs")).unwrap();
    fs::copy(fixture.path("new.csv"), fixture.path("designs/a.csv")).unwrap();
    for (arguments, n_told) in [
        (&["convert", "part.su2", "a.vtu"][..], 1),
        (&["quality", "part.su2"], 1),
        (&["refine", "part.su2", "b.vtu"], 1),
        (&["cut", "part.su2", "--family", "wing", "--at", "y=1", "--out", "o.csv"], 1),
        (&["compare", "part.su2", "part.su2"], 2),
        (&["compare", "box.su2", "part.su2"], 1),
        (&["run", "case.toml", "--backend", "cpu"], 1),
        (&["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "out"], 1),
    ] {
        let output = fixture.idmesh(arguments);
        assert_good(&output);
        let expected = "warning: part.su2: 1 markers SEND_RECEIVE with 1 vertices are shared with other parts";
        assert_eq!(stderr(&output).matches(expected).count(), n_told, "{arguments:?}: {}", stderr(&output));
    }
}

/// A displaced surface of a family with quadrilaterals needs the original positions: quadrilaterals
/// can be divided in two ways.
#[test]
fn a_surface_of_quadrilaterals_needs_its_original_positions() {
    let fixture = Fixture::new();
    let source = data("hybrid/small.msh.gz");
    let file = formats::read_mixed(&source).unwrap();
    let wing = file.mesh.family("wing").unwrap();
    let triangles = idmesh::mesh::triangles_of_families(file.cells(), &[wing]);
    let mut text = "solid wing\n".to_owned();
    for corners in triangles {
        let at = corners.map(|vertex| file.mesh.vertices[vertex as usize] + DVec3::new(0.0, 0.0, 1e-3));
        text += "facet normal 0 0 1\nouter loop\n";
        at.iter().for_each(|at| text += &format!("vertex {:?} {:?} {:?}\n", at.x, at.y, at.z));
        text += "endloop\nendfacet\n";
    }
    fixture.write("wing.stl", &(text + "endsolid wing\n"));
    let names = ["trailing_edge", "wingtip", "carenage", "symmetry", "farfield"];
    let tables = names.map(|name| format!("[family.{name}]\nrole = \"fixed\"\n")).concat();
    let prescribed = "[family.wing]\nrole = \"prescribed\"\ndisplacement = \"wing.stl\"\n";
    fixture.write("case.toml", &format!("mesh = {source:?}\n{prescribed}{tables}[output]\nmesh = \"moved.msh\"\n"));
    fixture.refuses(3, &["wing.stl", "the family has quadrilaterals", "original positions"]);
}
