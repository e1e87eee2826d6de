//! The other commands.

use std::collections::BTreeSet;
use std::process::Stdio;

use crate::fixture::*;
use crate::wing_box::*;

#[test]
fn quality_counts_and_measures() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let output = fixture.idmesh(&["quality", "box.msh", "--json", "-", "--histogram", "beta.svg"]);
    assert_good(&output);
    let figures: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(figures["mesh"]["vertices"], mesh.vertices.len());
    assert_eq!(figures["mesh"]["tets"], mesh.tets.len());
    assert_eq!(figures["mesh"]["families"]["wing"]["vertices"], mesh.family_vertices(0).len());
    assert_eq!(figures["inverted"], 0);
    // Every tet is a sixth of a cell, its longest edge the cell's diagonal.
    let cell = [0.25f64, 0.375, 0.25];
    let diagonal = cell.map(|length| length * length).iter().sum::<f64>().sqrt();
    let beta = cell.iter().product::<f64>() / 6.0 / diagonal.powi(3);
    for key in ["beta_min", "beta_max", "beta_mean"] {
        assert!((figures[key].as_f64().unwrap() - beta).abs() < 1e-12, "{key}");
    }
    assert!(fixture.read("beta.svg").starts_with("<svg"));
    assert!(stdout(&fixture.idmesh(&["quality", "box.msh"])).contains("beta mean"));

    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    let text = stdout(&fixture.idmesh(&["quality", "box.msh"]));
    assert!(text.lines().any(|line| line.split_whitespace().eq(["inverted", "1"])), "{text}");
    fixture.refuses_command(&["quality", "nothing.msh"], 3, &["nothing.msh"]);
}

/// `idmesh quality ... | head -0`: the reader is gone before the first word.
#[test]
fn a_closed_pipe_is_no_error() {
    let fixture = Fixture::new();
    let mut child = command(fixture.folder.path(), &["quality", "box.msh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_good(&output);
    assert_eq!(stderr(&output), "");
}

#[test]
fn cut_profiles_lie_on_their_planes() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--at", "y=0.3,y=1.2", "--out", "old.csv"]));
    let rows: Vec<Vec<f64>> = fixture
        .read("old.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    for (profile, y) in [(0.0, 0.3), (1.0, 1.2)] {
        let points: Vec<_> = rows.iter().filter(|row| row[0] == profile).collect();
        assert!(points.len() >= 7, "{} points", points.len());
        assert!(points.iter().all(|point| (point[2] - y).abs() < 1e-12));
        // From the lower to the upper side of the trailing edge.
        assert_eq!((points[0][1], points[0][3]), (1.75, -0.25));
        assert_eq!((points[points.len() - 1][1], points[points.len() - 1][3]), (1.75, 0.25));
    }
    assert_good(&fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--planes", "3", "--out", "three.csv"]));
    assert_eq!(fixture.read("three.csv").lines().last().unwrap().split(',').next(), Some("2"));

    // To standard output, and into no file of this name.
    let printed = fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--planes", "3", "--out", "-"]);
    assert_good(&printed);
    assert_eq!(stdout(&printed), fixture.read("three.csv"));
    assert!(!fixture.path("-").exists());
    let cut =
        |family: &'static str, at: &'static str| ["cut", "box.msh", "--family", family, "--at", at, "--out", "o.csv"];
    fixture.refuses_command(&cut("wings", "y=1"), 3, &["no family `wings`", "did you mean `wing`?"]);
    fixture.refuses_command(&cut("wing", "y=1.7"), 3, &["misses the wing"]);
}

#[test]
fn meshes_are_compared_vertex_by_vertex() {
    let fixture = Fixture::new();
    fixture.write("same.msh", &fixture.read("box.msh"));
    let compare = |name: &str| fixture.idmesh(&["compare", "box.msh", name]);
    assert_good(&compare("same.msh"));
    let mut other = WingBox::new();
    other.vertices[40][2] += 0.01;
    fixture.write("other.msh", &other.gmsh());
    let output = compare("other.msh");
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).lines().any(|line| line.starts_with("worst vertex") && line.contains(" 40 at ")));
    assert!(stderr(&output).contains("error: out of tolerance"));
    assert_good(&fixture.idmesh(&["compare", "box.msh", "other.msh", "--tolerance", "0.1"]));

    other.vertices.push([0.0; 3]);
    fixture.write("more.msh", &other.gmsh());
    let output = compare("more.msh");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("nothing to compare"), "{}", stderr(&output));
    fixture.refuses_command(&["compare", "box.msh", "nothing.msh"], 3, &["nothing.msh"]);
}

/// One face between two cells in a family on the boundary: a run refuses the mesh, and the commands
/// that take it say so.
#[test]
fn families_partly_inside_are_told_by_every_command() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| {
        // The first face of the first tet that is on no boundary.
        let is_inner = |face: &[usize; 3]| {
            let key = |face: &[usize; 3]| BTreeSet::from(*face);
            !mesh.triangles.iter().any(|(triangle, _)| key(triangle) == key(face))
        };
        let faces = mesh.tets.iter().flat_map(|&[a, b, c, d]| [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]);
        let inner = faces.into_iter().find(is_inner).unwrap();
        mesh.triangles.push((inner, 4));
    });
    let words = "faces of the family 'farfield' lie inside the volume, between two cells";
    fixture.refuses(3, &["box.msh: 1 of the ", words]);
    for arguments in [&["quality", "box.msh"][..], &["convert", "box.msh", "box.vtu"]] {
        let output = fixture.idmesh(arguments);
        assert_good(&output);
        let errors = stderr(&output);
        assert_eq!(errors.matches("warning: box.msh: 1 of the ").count(), 1, "{errors}");
        assert!(errors.contains(words) && errors.contains("; a run refuses this mesh"), "{errors}");
    }
    let whole = Fixture::new().idmesh(&["quality", "box.msh"]);
    assert!(!stderr(&whole).contains("inside the volume"));
}
