//! Inputs that may not be what was meant: what is told of them, and the file that is named.

use super::fixture::{CASE, Fixture, assert_good, profiles, stderr};
use super::wing_box::WingBox;

const OLD: &str = "new = \"new.csv\"\nold = \"old.csv\"";

fn old() -> String {
    profiles(&[(0, 0.3, 0.0), (1, 1.2, 0.0)])
}

/// The text of profiles in which a point of profile 1 stands off its plane.
fn with_a_point_off(text: &str) -> String {
    let place = text.rfind("1,").unwrap();
    let line = text[place..].lines().next().unwrap();
    let fields: Vec<&str> = line.split(',').collect();
    text.replacen(line, &format!("1,{},1.23,{}", fields[1], fields[3]), 1)
}

/// With old profiles in a file, a fault in one of the files is told of this file: of the new ones,
/// of the old ones, of one file of several, and of a design of a batch.
#[test]
fn a_profile_at_fault_is_named_with_its_own_file() {
    let fixture = Fixture::new();
    fixture.case("new = \"new.csv\"", OLD);
    fixture.write("old.csv", &old());
    let new = fixture.read("new.csv");
    fixture.write("new.csv", &with_a_point_off(&new));
    fixture.refuses(3, &["error: new.csv: profiles of `wing`: profile 1 is not plane"]);
    fixture.write("new.csv", &new);
    fixture.write("old.csv", &with_a_point_off(&old()));
    fixture.refuses(3, &["error: old.csv: profiles of `wing`: profile 1 is not plane"]);
    fixture.write("old.csv", &old());
    assert_good(&fixture.run());

    fixture.case("new = \"new.csv\"", "new = [\"a.csv\", \"b.csv\", \"c.csv\"]\nold = \"old.csv\"");
    fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (1, 0.7, 0.0), (2, 1.2, 0.0)]));
    for (name, number, y) in [("a.csv", 0, 0.3), ("b.csv", 1, 0.7), ("c.csv", 2, 1.2)] {
        fixture.write(name, &profiles(&[(number, y, 0.02)]));
    }
    assert_good(&fixture.run());
    fixture.write("b.csv", &with_a_point_off(&fixture.read("b.csv")));
    fixture.refuses(3, &["error: b.csv: profiles of `wing`: profile 1 is not plane"]);

    let fixture = Fixture::with_raised_designs(&[("a", 0.03), ("b", 0.05)]);
    let design = fixture.read("designs/b.csv");
    fixture.write("designs/b.csv", &with_a_point_off(&design));
    let output =
        fixture.idmesh(&["batch", "case.toml", "--designs", "designs", "--backend", "cpu", "--json", "all.jsonl"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("b: designs/b.csv: profiles of `wing`: profile 1 is not plane"),
        "{}",
        stderr(&output)
    );
}

/// A remark on profiles stands on the console and in the report, and the result is good.
#[test]
fn odd_profiles_are_told() {
    let fixture = Fixture::new();
    fixture.case("new = \"new.csv\"", OLD);
    fixture.write("old.csv", &old());
    let run = || {
        let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
        let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
        let warnings = report["warnings"].as_array().unwrap();
        let warnings: Vec<String> = warnings.iter().map(|text| text.as_str().unwrap().to_owned()).collect();
        (output, warnings)
    };
    let (output, warnings) = run();
    assert_good(&output);
    assert!(warnings.is_empty(), "{warnings:?}");
    fixture.write("new.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.32, 0.0)]));
    let (output, warnings) = run();
    assert_good(&output);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let words = "profiles of `wing`: profile 1 moves along the span, from 1.2000 to 1.3200, where the wing reaches from 0.0000 to \
                 1.5000";
    assert!(warning.starts_with(words), "{warning}");
    assert!(stderr(&output).contains(words), "{}", stderr(&output));
}

/// An invalid mesh is laid to a profile only where the profile is odd, or half way to a refusal.
///
/// Fails if `SUSPECT` is 0 or 1.
#[test]
fn only_a_suspect_profile_is_named_as_one() {
    let fixture = Fixture::new();
    fixture.case("new = \"new.csv\"", OLD);
    fixture.write("old.csv", &old());
    let hint = |tip: f64| {
        fixture.write("new.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.2, tip)]));
        let output = fixture.run();
        assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
        stderr(&output).lines().find(|line| line.starts_with("hint: ")).unwrap().to_owned()
    };
    // The far boundary is at 1.25, and a way of 3.4 is refused.
    let innocent = hint(1.3);
    assert!(!innocent.contains("suspect"), "{innocent}");
    let far = hint(2.5);
    assert!(far.contains("suspect") && far.contains("profile 1 lies 2.50"), "{far}");
}

/// A section in a plane along the span is cut, with a warning.
///
/// Fails if `ACROSS` is 2 or 0.
#[test]
fn a_cut_along_the_span_is_told() {
    let fixture = Fixture::new();
    let cut = |at: &str| fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--at", at, "--out", "cut.csv"]);
    let across = cut("y=0.7");
    assert_good(&across);
    assert!(!stderr(&across).contains("warning"), "{}", stderr(&across));
    for at in ["x=1.1", "z=0.1"] {
        let along = stderr(&cut(at));
        let words = format!("warning: box.msh: a plane {} = const runs along the span, which is along y", &at[..1]);
        assert!(along.contains(&words), "{along}");
    }
}

/// A table with this header and these rows for each vertex of the wing.
fn table(fixture: &Fixture, header: &str, row: impl Fn(usize, [f64; 3]) -> String) {
    let mesh = WingBox::new();
    let rows: String =
        mesh.family_vertices(0).into_iter().map(|vertex| row(vertex, mesh.vertices[vertex]) + "\n").collect();
    fixture.write("wing.csv", &(header.to_owned() + &rows));
}

fn prescribed() -> Fixture {
    let fixture = Fixture::new();
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    fixture
        .write("case.toml", &case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n"));
    fixture
}

/// New positions in the place of displacements, and displacements in the place of new positions,
/// by the lengths on the surface: a wing that turns keeps them. A header decides.
///
/// Fails if `STRAINED` is 2, or `BETTER` is 0 or 2.
#[test]
fn positions_are_no_displacements() {
    let fixture = prescribed();
    let six = |[x, y, z]: [f64; 3], [a, b, c]: [f64; 3]| format!("{x},{y},{z},{a},{b},{c}");
    let turned = |[x, y, z]: [f64; 3], degrees: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        [1.2 + cos * (x - 1.2) + sin * z, y, cos * z - sin * (x - 1.2)]
    };
    let by = |at: [f64; 3], degrees: f64| {
        let to = turned(at, degrees);
        [to[0] - at[0], to[1] - at[1], to[2] - at[2]]
    };
    for degrees in [0.0, 1.0, 40.0, 120.0, 180.0] {
        table(&fixture, "", |_, at| six(at, turned(at, degrees)));
        fixture.refuses(3, &["wing.csv: the last three columns have no names; as displacements", "x,y,z,dx,dy,dz"]);
        table(&fixture, "", |vertex, at| {
            let [dx, dy, dz] = by(at, degrees);
            format!("{vertex} {dx} {dy} {dz}")
        });
        fixture.refuses(3, &["wing.csv"]);
        // The same as what they are. Whether the mesh stays valid is another matter.
        table(&fixture, "", |_, at| six(at, by(at, degrees)));
        assert_ne!(fixture.run().status.code(), Some(3), "{degrees}");
        table(&fixture, "", |vertex, at| {
            let [x, y, z] = turned(at, degrees);
            format!("{vertex} {x} {y} {z}")
        });
        assert_ne!(fixture.run().status.code(), Some(3), "{degrees}");
    }
    // Half as large again: displacements of half the size are no positions.
    table(&fixture, "", |_, at| six(at, [0.5 * (at[0] - 1.2), 0.5 * at[1], 0.5 * at[2]]));
    assert_ne!(fixture.run().status.code(), Some(3));
    // A wing that grows to twice its size has such displacements too. The header says so.
    let grown = |_: usize, at: [f64; 3]| six(at, [at[0] - 1.2, at[1], at[2]]);
    table(&fixture, "", grown);
    fixture.refuses(3, &["as new positions"]);
    for header in ["x,y,z,dx,dy,dz\n", "# x,y,z,dx,dy,dz\n"] {
        table(&fixture, header, grown);
        assert_ne!(fixture.run().status.code(), Some(3), "{header}");
    }
}

/// A flat family that turns in its plane by 60 degrees has displacements that are as long as its
/// edges. It keeps its own lengths to 2 %, and there is nothing to doubt.
///
/// Fails if `STRAINED` is 0.01.
#[test]
fn a_flat_family_may_turn_in_its_plane() {
    let fixture = Fixture::new();
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "").replace("\"wing\"", "\"fixed\"");
    let role = "role = \"trailing-edge\"";
    assert!(case.contains(role));
    fixture.write("case.toml", &case.replace(role, "role = \"prescribed\"\ndisplacement = \"te.csv\""));
    let mesh = WingBox::new();
    // By this angle a body that grows by the factor moves as far as its own size.
    let growth: f64 = 1.02;
    let (sin, cos) = (growth / 2.0).acos().sin_cos();
    let row = |[x, y, z]: [f64; 3]| {
        let to = [growth * (cos * y - sin * z), growth * (sin * y + cos * z)];
        format!("{x},{y},{z},0,{},{}\n", to[0] - y, to[1] - z)
    };
    let rows: String = mesh.family_vertices(1).into_iter().map(|vertex| row(mesh.vertices[vertex])).collect();
    fixture.write("te.csv", &rows);
    let output = fixture.run();
    assert_ne!(output.status.code(), Some(3), "{}", stderr(&output));
}

/// A displaced family keeps its size, from 0.4 to 2.5 times, as a displaced surface does.
///
/// Fails if `SIZE` of `plausible` is 2 or 3.
#[test]
fn displacements_in_another_unit_are_told() {
    let fixture = prescribed();
    let header = "x,y,z,dx,dy,dz\n";
    let times = |factor: f64| {
        move |_: usize, [x, y, z]: [f64; 3]| {
            let [dx, dy, dz] = [x - 1.2, y, z].map(|way| (factor - 1.0) * way);
            format!("{x},{y},{z},{dx},{dy},{dz}")
        }
    };
    for (factor, is_refused) in [(0.38, true), (0.45, false), (2.4, false), (2.6, true), (1000.0, true)] {
        table(&fixture, header, times(factor));
        if is_refused {
            let words = format!("the displaced family `wing` is {factor:.3e} times as large");
            fixture.refuses(3, &["wing.csv", &words]);
        } else {
            assert_ne!(fixture.run().status.code(), Some(3), "{factor}");
        }
    }
}
