//! `idmesh run` on bad input: exit code, message, and no file left.

use std::fs;

use crate::fixture::*;
use crate::wing_box::*;

#[test]
fn meshes_that_cannot_be_read() {
    let fixture = Fixture::new();
    let whole = fixture.read("box.msh");
    fixture.write("box.msh", &whole[..whole.len() / 2]);
    fixture.refuses(3, &["box.msh:"]);
    fixture.write("box.msh", "");
    fixture.refuses(3, &["box.msh", "empty"]);
    fs::remove_file(fixture.path("box.msh")).unwrap();
    fixture.refuses(3, &["box.msh"]);
}

#[test]
fn coordinates_that_are_no_numbers() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.vertices[40][1] = f64::NAN);
    fixture.refuses(3, &["box.msh:", "vertex 41", "finite"]);
}

#[test]
fn tets_that_name_no_vertex() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7][2] = mesh.vertices.len() + 10);
    fixture.refuses(3, &["box.msh:", "tet", "names vertex"]);
}

#[test]
fn inverted_tets_in_the_input() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    fixture.refuses(3, &["box.msh: 1 of", "inverted", "tet 7"]);
}

#[test]
fn doubled_tets() {
    let fixture = Fixture::new();
    let n = WingBox::new().tets.len();
    fixture.mesh(|mesh| mesh.tets.push(mesh.tets[7]));
    fixture.refuses(3, &["box.msh", &format!("tet 7 and tet {n} have the same vertices")]);
}

/// A vertex of the symmetry plane lies 1e-5 off it. The message says what the case must say, and
/// that is enough.
///
/// Fails if `NEARLY` is 1 or 100.
#[test]
fn planes_that_are_not_flat_name_the_remedy() {
    let fixture = Fixture::new();
    let box_mesh = WingBox::new();
    let corner = |vertex: &&usize| box_mesh.vertices[**vertex] == [0.25, 0.0, -1.0];
    let off = *box_mesh.family_vertices(3).iter().find(corner).unwrap();
    // Far off, nothing is advised that would make it a plane.
    fixture.mesh(|mesh| mesh.vertices[off][1] = 1e-3);
    fixture.refuses(3, &["lie up to 9.9", "is `plane` its role? If it is a plane with noise, a key `flat`"]);
    assert!(!stderr(&fixture.run()).contains("flat = "));
    fixture.mesh(|mesh| mesh.vertices[off][1] = 1e-5);
    fixture.refuses(3, &["box.msh: family `symmetry` has the role plane", "lie up to 9.9", "with `flat = "]);
    let message = stderr(&fixture.run());
    let flat: f64 = message.split("with `flat = ").nth(1).unwrap().split('`').next().unwrap().parse().unwrap();
    // A plane with noise lies off by up to ten times what is allowed.
    let allowed: f64 = message.split("(allowed: ").nth(1).unwrap().split(')').next().unwrap().parse().unwrap();
    for (times, is_advised) in [(9.0, true), (12.0, false)] {
        fixture.mesh(|mesh| mesh.vertices[off][1] = times * allowed);
        assert_eq!(stderr(&fixture.run()).contains("with `flat = "), is_advised, "{times}");
    }
    fixture.mesh(|mesh| mesh.vertices[off][1] = 1e-5);
    let keyed = |flat: f64| fixture.case("role = \"plane\"", &format!("role = \"plane\"\nflat = {flat:e}"));
    keyed(0.9 * flat);
    fixture.refuses(3, &["(allowed: ", &format!("with `flat = {flat:e}`")]);
    keyed(flat);
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    assert_good(&output);
    let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
    assert!(report["families"]["symmetry"]["max_distance_to_plane"].as_f64().unwrap() < 1e-12);
    let moved = fixture.read("moved.msh");
    let nodes: Vec<&str> = moved.lines().skip_while(|line| *line != "$Nodes").skip(2).collect();
    assert_eq!(nodes[off].split_whitespace().nth(2), Some("0.00001"));
    // A plane bent by a third of its size is none.
    fixture.mesh(|mesh| mesh.vertices[off][1] = -0.9);
    fixture.refuses(3, &["it is no plane, expected another role"]);
}

/// Planes that OpenFOAM calls cyclic are partners without a word in the case: these do not match,
/// as the wing ends in one.
#[test]
fn cyclic_patches_are_partners() {
    let fixture = Fixture::new();
    // The far side across y is called wingtip, and the wing's end belongs to the wing.
    fixture.mesh(|mesh| {
        let far = |mesh: &WingBox, face: [usize; 3]| face.iter().all(|&vertex| mesh.vertices[vertex][1] == 3.0);
        let families = mesh.triangles.iter().map(|&(face, family)| match family {
            2 => 0,
            _ if far(mesh, face) => 2,
            family => family,
        });
        let families: Vec<usize> = families.collect();
        mesh.triangles.iter_mut().zip(families).for_each(|((_, family), new)| *family = new);
    });
    fs::create_dir(fixture.path("polyMesh")).unwrap();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "polyMesh"]));
    let boundary = fixture.read("polyMesh/boundary");
    let cyclic = boundary.replacen("symmetry { type patch;", "symmetry { type cyclic; neighbourPatch wingtip;", 1);
    assert_ne!(cyclic, boundary);
    fixture.write("polyMesh/boundary", &cyclic);
    let case = CASE.replace("box.msh", "polyMesh").replace("moved.msh", "moved.vtu");
    let case = |role: &str| case.replace("role = \"wingtip\"\ncoefficient = 0.5", &format!("role = \"{role}\""));
    fixture.write("case.toml", &case("fixed"));
    fixture.refuses(3, &["calls `symmetry` and `wingtip` cyclic", "one has the role plane and the other has not"]);
    fixture.write("case.toml", &case("plane"));
    fixture.refuses(3, &["shall be partners: 2 of their", "vertices have no partner, the first at"]);
    fixture.write("case.toml", &case("fixed").replace("role = \"plane\"", "role = \"fixed\""));
    // No vertex of the held root stands beside the first profile's plane.
    fixture.write("new.csv", &profiles(&[(0, 0.45, 0.0), (1, 1.4, 0.0)]));
    assert_good(&fixture.run());
}

#[test]
fn unknown_keys_name_the_nearest() {
    let fixture = Fixture::new();
    fixture.case("tolerance", "tolerence");
    fixture.refuses(3, &["case.toml:19:1: unknown key `tolerence` in [solver]; did you mean `tolerance`?"]);
}

#[test]
fn families_and_tables_must_agree() {
    let fixture = Fixture::new();
    fixture.case("[family.symmetry]\nrole = \"plane\"\n", "");
    fixture.refuses(3, &["case.toml", "no [family] table for `symmetry`"]);
    fixture.case("[family.symmetry]", "[family.pylon]\nrole = \"fixed\"\n[family.symmetry]");
    fixture.refuses(3, &["no family in the mesh for the table of `pylon`", "the mesh has `wing`, `trailing_edge`"]);
}

#[test]
fn coefficients_outside_their_range() {
    let fixture = Fixture::new();
    for text in ["1.5", "-0.1", "nan"] {
        fixture.case("0.5", text);
        fixture.refuses(3, &["case.toml:12:15: `coefficient` is", "expected 0 (rigid) to 1"]);
    }
}

#[test]
fn profiles_that_cannot_be_used() {
    let fixture = Fixture::new();
    fixture.write("new.csv", "profile,x,y,z\n0,1,0.3,0\n0,1.75,0.3,0\n");
    fixture.refuses(3, &["new.csv", "expected at least 3"]);
    let one_off = section(0, 0.3, 0.0, 0.0).replacen("0,1,0.3,0\n", "0,1,0.4,0\n", 1);
    fixture.write("new.csv", &format!("profile,x,y,z\n{one_off}"));
    fixture.refuses(3, &["new.csv", "profile 0 is not plane"]);
    fixture.write("new.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.7, 0.0)]));
    fixture.refuses(3, &["new.csv", "misses the wing"]);
    fixture.write("new.csv", "profile,x,y,z\n0,1,0.3,zero\n");
    fixture.refuses(3, &["new.csv:2:"]);
    fs::remove_file(fixture.path("new.csv")).unwrap();
    fixture.refuses(3, &["new.csv"]);
}

#[test]
fn old_and_new_profiles_must_pair() {
    let fixture = Fixture::new();
    fixture.case("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
    fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (2, 1.2, 0.0)]));
    fixture.refuses(3, &["same numbers", "[0, 2]", "[0, 1]"]);
}

/// The wing and its tip share the tip's rim. Where both files say the same there, to seven digits,
/// they are taken.
#[test]
fn prescribed_families_must_agree_where_they_touch() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let rows = |family: usize, displacement: &str| -> String {
        let vertices = mesh.family_vertices(family).into_iter().map(|vertex| mesh.vertices[vertex]);
        vertices.map(|[x, y, z]| format!("{x},{y},{z},{displacement}\n")).collect()
    };
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    let tip = "role = \"wingtip\"\ncoefficient = 0.5\n";
    fixture.write("case.toml", &case.replace(tip, "role = \"prescribed\"\ndisplacement = \"tip.csv\"\n"));
    fixture.write("wing.csv", &rows(0, "0.01,0,0.02"));
    fixture.write("tip.csv", &format!("x,y,z,dx,dy,dz\n{}", rows(2, "0.01000001,0,0.02")));
    assert_good(&fixture.run());
    fs::remove_file(fixture.path("moved.msh")).unwrap();
    fixture.write("tip.csv", &format!("x,y,z,dx,dy,dz\n{}", rows(2, "0.0100001,0,0.02")));
    let first = mesh.family_vertices(2).into_iter().find(|vertex| mesh.family_vertices(0).contains(vertex)).unwrap();
    let line = |family, header| {
        let row = mesh.family_vertices(family).iter().position(|&vertex| vertex == first).unwrap();
        row + 1 + header
    };
    let [x, y, z] = mesh.vertices[first];
    let place = format!("wing.csv:{} and tip.csv:{}: the vertex at ({x}, {y}, {z})", line(0, 0), line(2, 1));
    fixture.refuses(3, &[&place, "1.000e-7", "expected the same in both"]);
}

/// The prescribed wing moves along the span, off the symmetry plane: its vertices there are not
/// slid back, as those of a wing with profiles would be.
#[test]
fn prescribed_junctions_that_leave_their_plane_are_told() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let rows = |vertices: Vec<usize>| -> String {
        let at = vertices.into_iter().map(|vertex| mesh.vertices[vertex]);
        at.map(|[x, y, z]| format!("{x},{y},{z},0,0.015625,0\n")).collect()
    };
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    fixture.write("case.toml", &case);
    fixture.write("wing.csv", &rows(mesh.family_vertices(0)));
    let shared = mesh.family_vertices(0).into_iter().filter(|vertex| mesh.family_vertices(3).contains(vertex)).count();
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    let expected = format!("(symmetry by 0.015625, {shared} vertices, the worst at (");
    let hint = "hint: the junction of a prescribed family";
    for words in [&*expected, ", 0.015625, ", "; `wing` prescribes where they are", hint] {
        assert!(stderr(&output).contains(words), "{words}: {}", stderr(&output));
    }
}

#[test]
fn outputs_are_checked_before_anything_is_computed() {
    let fixture = Fixture::new();
    fixture.write("file", "");
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "file"], 3, &["cannot write file"]);
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "file/a"], 3, &["cannot write file"]);
    fixture.refuses_command(
        &["run", "case.toml", "--json", "no/report.json"],
        3,
        &["no/report.json: there is no folder no: make it first"],
    );
    fixture.case("\"moved.msh\"", "\"file/moved.msh\"");
    fixture.refuses(3, &["cannot write file/moved.msh: there is no folder file"]);
    fixture.case("\"moved.msh\"", "\"no/polyMesh\"");
    fixture.refuses(3, &["cannot write no/polyMesh: there is no folder no"]);
    fixture.case("\"moved.msh\"", "\"moved.stl\"");
    fixture.refuses(3, &["moved.stl", "unknown mesh format"]);
    fixture.case("\"moved.msh\"", "\"new.csv\"");
    fixture.refuses(3, &["new.csv would overwrite the input"]);
}

/// Bad input is found after the folder is made; then the folder goes away again.
#[test]
fn a_refused_run_leaves_no_folder() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "a/b"], 3, &["inverted"]);
}

#[test]
fn wrong_usage() {
    let fixture = Fixture::new();
    for arguments in [
        &[][..],
        &["run"],
        &["run", "case.toml", "--backend", "cuda"],
        &["run", "case.toml", "-q", "-v"],
        &["compare", "a", "b", "c"],
        &["compare", "a", "b", "--tolerance", "nan"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv", "--planes", "2", "--at", "y=1"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv", "--at", "1.0"],
    ] {
        let output = fixture.idmesh(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    }
}
