//! `idmesh gradient`: against differences of `idmesh run`, and what it refuses.

use glam::DVec3;
use idmesh::formats::{self, Cells, Fields};

use crate::fixture::*;

const GRADIENT: [&str; 8] = ["gradient", "case.toml", "--backend", "cpu", "--seed", "seed.csv", "--out", "g.csv"];

/// The usual case with old profiles, without local optimisation, and converged to rounding.
fn fixture() -> Fixture {
    let fixture = Fixture::new();
    fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.2, 0.0)]));
    let case = CASE.replace("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
    fixture.write("case.toml", &case.replace("tolerance = 1e-4", "tolerance = 1e-12\n[quality]\ntarget = \"off\""));
    fixture
}

fn moved(fixture: &Fixture) -> Vec<DVec3> {
    assert_good(&fixture.run());
    formats::read_mixed(&fixture.path("moved.msh")).unwrap().mesh.vertices
}

/// Numbers between -1 and 1 without a pattern that the mesh has.
fn weights(n: usize) -> Vec<DVec3> {
    (0..3 * n)
        .map(|k| (12.9898 * (k + 1) as f64).sin())
        .collect::<Vec<_>>()
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&of| DVec3::from_array(of))
        .collect()
}

fn seed(by_vertices: &[DVec3]) -> String {
    let rows = by_vertices.iter().zip(0..).map(|(by, vertex)| format!("{vertex},{:e},{:e},{:e}\n", by.x, by.y, by.z));
    std::iter::once("vertex,jx,jy,jz\n".to_owned()).chain(rows).collect()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split(',').map(|field| field.parse().unwrap()).collect()
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// The gradient by the points of both profiles is the slope of differences of runs, to the rounding
/// of these, and has the points as they came in.
#[test]
fn the_gradient_is_the_slope_of_runs() {
    let fixture = fixture();
    let new = fixture.read("new.csv");
    let n = moved(&fixture).len();
    let weights = weights(n);
    fixture.write("seed.csv", &seed(&weights));
    let output = fixture.idmesh(&GRADIENT);
    assert_good(&output);
    assert!(stdout(&output).starts_with("table"), "{}", stdout(&output));
    let gradient = fixture.read("g.csv");
    assert_eq!(gradient.lines().next(), Some("profile,x,y,z,gx,gy,gz"));
    let rows: Vec<Vec<f64>> = gradient.lines().skip(1).map(numbers).collect();
    let points: Vec<Vec<f64>> = new.lines().skip(1).map(numbers).collect();
    assert!(rows.iter().map(|row| &row[..4]).eq(points.iter().map(Vec::as_slice)));
    for number in [0.0, 1.0] {
        // Along the chord and across it, more and more towards the leading edge.
        let direction = |point: &[f64]| match point[0] == number {
            true => [0.0, 0.1 * (3.0 * point[1]).sin(), 0.0, (2.0 * point[1] + point[3]).cos()],
            false => [0.0; 4],
        };
        let step = 1e-5;
        let along = |by: f64| {
            let row = |point: &Vec<f64>| {
                let moved: Vec<String> =
                    point.iter().zip(direction(point)).map(|(x, along)| format!("{:?}", x + by * along)).collect();
                format!("{},{}\n", point[0], moved[1..].join(","))
            };
            fixture.write("new.csv", &format!("profile,x,y,z\n{}", points.iter().map(row).collect::<String>()));
            moved(&fixture)
        };
        let (plus, minus) = (along(step), along(-step));
        let slopes: Vec<DVec3> = plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        let slope = dot(&weights, &slopes);
        let of_row =
            |row: &Vec<f64>| row[4..].iter().zip(&direction(row)[1..]).map(|(g, along)| g * along).sum::<f64>();
        let product: f64 = rows.iter().map(of_row).sum();
        let norms = dot(&weights, &weights).sqrt() * dot(&slopes, &slopes).sqrt();
        assert!((product - slope).abs() < 1e-7 * norms, "{number}: {product} {slope} {norms}");
        // The seed sees the profile.
        assert!(slope.abs() > 1e-4 * norms, "{number}: {slope} {norms}");
    }
}

/// SU2's adjoint solution, a grid, and rows in another order are the same seed.
#[test]
fn seeds_have_several_formats() {
    let fixture = fixture();
    let vertices = moved(&fixture);
    let weights = weights(vertices.len());
    let table = seed(&weights);
    fixture.write("seed.csv", &table);
    assert_good(&fixture.idmesh(&GRADIENT));
    let expected = fixture.read("g.csv");
    let gradient = |fixture: &Fixture, name: &str| {
        let output = fixture.idmesh(&["gradient", "case.toml", "--backend", "cpu", "--seed", name, "--out", "-"]);
        assert_good(&output);
        stdout(&output)
    };
    let mut rows: Vec<&str> = table.lines().skip(1).collect();
    rows.reverse();
    fixture.write("reversed.csv", &format!("vertex,jx,jy,jz\n{}\n", rows.join("\n")));
    assert_eq!(gradient(&fixture, "reversed.csv"), expected);
    // As SU2 8 writes restart_adj.csv: names in quotes, and settings after the rows.
    let row = |(vertex, (at, by)): (usize, (&DVec3, &DVec3))| {
        let numbers = [at.x, at.y, at.z, 0.5, by.x, by.y, by.z].map(|x| format!("{x:.16e}")).join(", ");
        format!("{vertex}, {numbers}\n")
    };
    let names = ["PointID", "x", "y", "z", "Adjoint_Density", "Sensitivity_x", "Sensitivity_y", "Sensitivity_z"];
    let rows: String = vertices.iter().zip(&weights).enumerate().map(row).collect();
    let header = names.map(|name| format!("\"{name}\"")).join(",");
    fixture.write("su2.csv", &format!("{header}\n{rows}AOA= 2.5\nSIDESLIP_ANGLE= 0\n"));
    assert_eq!(gradient(&fixture, "su2.csv"), expected);
    let mesh = formats::read_mixed(&fixture.path("moved.msh")).unwrap().mesh;
    let cells = Cells::of(&mesh);
    let fields = Fields { displacement: Some(&weights), ..Fields::default() };
    formats::write_vtu(&fixture.path("seed.vtu"), &vertices, &cells, &fields).unwrap();
    let refused = fixture.idmesh(&[&GRADIENT[..5], &["seed.vtu", "--out", "g.csv"]].concat());
    assert!(stderr(&refused).contains("0 arrays of three components"), "{}", stderr(&refused));
    let bytes = std::fs::read(fixture.path("seed.vtu")).unwrap();
    let name = b"\"displacement\"";
    let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
    let named = [&bytes[..at], b"\"seed\"", &bytes[at + name.len()..]].concat();
    std::fs::write(fixture.path("seed.vtu"), named).unwrap();
    assert_eq!(gradient(&fixture, "seed.vtu"), expected);
}

/// A seed that is broken, or of another mesh, is refused, and an earlier gradient goes.
#[test]
fn wrong_seeds_are_refused() {
    let fixture = fixture();
    let vertices = moved(&fixture);
    let n = vertices.len();
    let at = |at: &DVec3| format!("{:?},{:?},{:?}", at.x, at.y, at.z);
    let undeformed = formats::read_mixed(&fixture.path("box.msh")).unwrap().mesh.vertices;
    let with_positions = |positions: &[DVec3]| {
        let rows = positions.iter().zip(0..).map(|(position, vertex)| format!("{vertex},{},1,0,0\n", at(position)));
        format!("vertex,x,y,z,jx,jy,jz\n{}", rows.collect::<String>())
    };
    fixture.write("seed.csv", &with_positions(&vertices));
    assert_good(&fixture.idmesh(&GRADIENT));
    let earlier = fixture.read("g.csv");
    // Vertices may be written as doubles.
    let doubles = with_positions(&vertices).replacen("\n0,", "\n0.0,", 1).replacen("\n12,", "\n1.2e1,", 1);
    fixture.write("seed.csv", &doubles);
    assert_good(&fixture.idmesh(&GRADIENT));
    assert_eq!(fixture.read("g.csv"), earlier);
    std::fs::remove_file(fixture.path("g.csv")).unwrap();
    let mut turned = vertices.clone();
    turned.swap(3, 4);
    for (text, words) in [
        (String::new(), "an empty file"),
        ("vertex,jx,jy,jz\n".to_owned(), "no rows"),
        ("0,1,0,0\n".to_owned(), "without a header"),
        ("vertex,jx,jy\n0,1,0\n".to_owned(), "no column jz"),
        ("jx,jy,jz\n1,0,0\n".to_owned(), "no column of vertices"),
        ("vertex,jx,jy,jz\n0,1,0\n".to_owned(), "seed.csv:2: 3 columns under a header of 4"),
        (format!("vertex,jx,jy,jz\n{n},1,0,0\n"), "counted from 0"),
        ("vertex,jx,jy,jz\n-1,1,0,0\n".to_owned(), "is no vertex"),
        ("vertex,jx,jy,jz\n0.5,1,0,0\n".to_owned(), "\"0.5\" is no vertex"),
        ("vertex,jx,jy,jz\n-1.0,1,0,0\n".to_owned(), "is no vertex"),
        ("vertex,jx,jy,jz\n1e300,1,0,0\n".to_owned(), "is no vertex"),
        (format!("vertex,jx,jy,jz\n{n}.0,1,0,0\n"), "counted from 0"),
        ("vertex,jx,jy,jz\n1,1,0,0\n1,1,0,0\n".to_owned(), "a second row of vertex 1, the first is on line 2"),
        ("vertex,jx,jy,jz\n1,nan,0,0\n".to_owned(), "not a finite number"),
        (with_positions(&undeformed), "those of the undeformed mesh"),
        (with_positions(&turned), "another design or another mesh"),
    ] {
        fixture.write("seed.csv", &text);
        fixture.refuses_command(&GRADIENT, 3, &[words]);
        fixture.write("g.csv", &earlier);
        assert_eq!(fixture.idmesh(&GRADIENT).status.code(), Some(3));
        assert!(!fixture.path("g.csv").exists(), "{words}: an earlier gradient stayed");
    }
    std::fs::write(fixture.path("seed.csv"), [0xEC, 0x2B, 8, 0, 1, 0, 0, 0]).unwrap();
    fixture.refuses_command(&GRADIENT, 3, &["RESTART_ASCII"]);
    // Files that the command reads stay.
    fixture.write("seed.csv", &with_positions(&vertices));
    for input in ["new.csv", "seed.csv", "box.msh", "case.toml"] {
        let arguments = [&GRADIENT[..7], &[input]].concat();
        let before = fixture.read(input);
        assert_eq!(fixture.idmesh(&arguments).status.code(), Some(3));
        assert_eq!(fixture.read(input), before);
    }
}

/// A result with optimised vertices, or of several steps, has no derivative, exit code 7, but a
/// frozen one.
#[test]
fn a_result_without_a_derivative_has_its_exit_code() {
    let fixture = fixture();
    let case = fixture.read("case.toml");
    fixture.write("seed.csv", "vertex,jx,jy,jz\n0,1,0,0\n");
    for (height, target, words) in [(0.2, "original", "local optimisation moved"), (0.4, "off", "in 2 steps")] {
        fixture.write("case.toml", &case.replace("\"off\"", &format!("\"{target}\"")));
        fixture.write("new.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, height)]));
        fixture.refuses_command(&GRADIENT, 7, &[words]);
        fixture.write("g.csv", "profile,x,y,z,gx,gy,gz\n0,0,0,0,0,0,0\n");
        assert_eq!(fixture.idmesh(&GRADIENT).status.code(), Some(7));
        assert!(!fixture.path("g.csv").exists(), "an earlier gradient stayed");
        assert_good(&fixture.idmesh(&[&GRADIENT[..], &["--frozen"]].concat()));
        std::fs::remove_file(fixture.path("g.csv")).unwrap();
    }
}

/// A seed of zeros has a gradient of zeros, and a warning.
#[test]
fn a_seed_of_zeros_is_told() {
    let fixture = fixture();
    fixture.write("seed.csv", "vertex,jx,jy,jz\n0,0,0,0\n");
    let output = fixture.idmesh(&GRADIENT);
    assert_good(&output);
    assert!(stderr(&output).contains("all derivatives are zero"), "{}", stderr(&output));
    let gradient = fixture.read("g.csv");
    assert!(gradient.lines().skip(1).all(|line| numbers(line)[4..].iter().all(|&g| g == 0.0)));
}
