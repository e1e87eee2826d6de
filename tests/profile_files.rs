//! Profile files of every format: the same section out of each, and broken ones refused with their line.

use std::fs;
use std::path::Path;

use glam::DVec3;
use idmesh::profile::files::{Placement, Source, SpanAxis, parse};
use idmesh::profile::{Profile, ProfileError};

/// A diamond: chord 1, thickness 0.2, sharp trailing edge at (1, 0), upper side first.
const DIAMOND: [[f64; 2]; 5] = [[1.0, 0.0], [0.5, 0.1], [0.0, 0.0], [0.5, -0.1], [1.0, 0.0]];

fn read(name: &str, text: &str, placement: Option<&Placement>) -> Result<Vec<Profile>, ProfileError> {
    parse(&[Source { path: Path::new(name), bytes: text.as_bytes(), placement }])
}

fn close(points: &[DVec3], expected: &[[f64; 3]]) -> bool {
    points.len() == expected.len()
        && points.iter().zip(expected).all(|(point, &expected)| point.abs_diff_eq(expected.into(), 1e-14))
}

const SELIG: &str = "DIAMOND airfoil 2012\n 1.0 0.0\n 0.5 0.1\n 0.0 0.0\n\n 0.5 -0.1\n 1.0 0.0\n";
const LEDNICER: &str = "DIAMOND\n  3.  3.\n\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n";

/// Selig and Lednicer order give the same curve, put where the placement says.
#[test]
fn airfoils_are_placed() {
    let mut placement = Placement { chord: 2.0, twist: 0.0, position: DVec3::new(5.0, 6.0, 7.0), span: SpanAxis::Y };
    let flat = DIAMOND.map(|[x, y]| [5.0 + 2.0 * x, 6.0, 7.0 + 2.0 * y]);
    for text in [SELIG, LEDNICER, &SELIG[SELIG.find('\n').unwrap() + 1..], &SELIG.replace('\n', "\r\n")] {
        let profiles = read("a.dat", text, Some(&placement)).unwrap();
        assert_eq!((profiles.len(), profiles[0].number), (1, 0));
        assert!(close(&profiles[0].points, &flat), "{:?}", profiles[0].points);
    }
    // Nose up: the trailing edge goes down, by the sine of 30 degrees times the chord.
    placement.twist = 30.0;
    placement.span = SpanAxis::Z;
    let turned = read("a.dat", SELIG, Some(&placement)).unwrap().remove(0).points;
    let (cos, sin) = (0.75f64.sqrt(), 0.5);
    assert!(turned[0].abs_diff_eq(DVec3::new(5.0 + 2.0 * cos, 6.0 - 2.0 * sin, 7.0), 1e-14), "{turned:?}");
    assert!(turned[2].abs_diff_eq(placement.position, 1e-14));
    assert!(turned[1].abs_diff_eq(DVec3::new(5.0 + cos + 0.2 * sin, 6.0 - sin + 0.2 * cos, 7.0), 1e-14));
}

fn tecplot(points: &str, rest: &str) -> String {
    format!(
        "TITLE = \"slices, ZONE by ZONE\"\nVARIABLES = \"cp\", \"CoordinateX\" \"CoordinateY\"\n\"CoordinateZ\"\n\
         ZONE T=\"Slice, I=7\", {points}\n{rest}"
    )
}

#[test]
fn tecplot_zones_are_curves() {
    let expected = DIAMOND.map(|[x, z]| [x, 2.0, z]);
    let point = "9 1 2 0\n9 0.5 2 0.1\n9 0 2 0\n9 0.5 2\n-0.1\n9 1 2 0\n";
    let two = tecplot("I=5, F=POINT", point)
        + "ZONE I=5 DATAPACKING=BLOCK\n1 1 1 1 1\n1 0.5 0 0.5 1\n2 2 2 2 2\n0 0.1 0 -0.1 0\n";
    let profiles = read("a.dat", &two, None).unwrap();
    assert_eq!(profiles.iter().map(|profile| profile.number).collect::<Vec<_>>(), [0, 1]);
    assert!(profiles.iter().all(|profile| close(&profile.points, &expected)), "{profiles:?}");
    // The same points as segments in any order, of a closed curve and of an open one.
    let nodes = "9 1 2 0\n9 0 2 0\n9 0.5 2 0.1\n9 0.5 2 -0.1\n";
    let header = "Nodes=4, Elements=4, ZONETYPE=FELineSeg\nDATAPACKING=POINT\nDT=(SINGLE SINGLE SINGLE SINGLE)";
    let closed = read("a.tec", &tecplot(header, &format!("{nodes}2 4\n3 1\n4 1\n3 2\n")), None).unwrap();
    let points = &closed[0].points;
    assert_eq!((closed.len(), points.len(), points[0]), (1, 5, points[4]));
    assert!(points.iter().all(|point| expected.contains(&point.to_array())));
    assert_eq!(points[0].distance(points[2]), 1.0, "the edges of the trailing edge and of the leading edge alternate");
    let open = tecplot(&header.replace("Elements=4", "Elements=3"), &format!("{nodes}3 2\n4 2\n1 4\n"));
    let open = read("a.plt", &open, None).unwrap();
    assert_eq!(open[0].points.iter().map(|point| point.z).collect::<Vec<_>>(), [0.0, -0.1, 0.0, 0.1]);
}

/// Slices as VTK 9.7.2 wrote them.
#[test]
fn polylines_of_vtk_are_curves() {
    for name in ["diamonds.vtp", "diamonds.vtk"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/sections").join(name);
        let bytes = fs::read(&path).unwrap();
        let profiles = parse(&[Source { path: &path, bytes: &bytes, placement: None }]).unwrap();
        assert_eq!(profiles.len(), 2, "{name}");
        for (profile, (scale, y)) in profiles.iter().zip([(1.0, 0.0), (2.0, 3.0)]) {
            assert_eq!((profile.points.len(), profile.points[0]), (5, profile.points[4]), "{name}");
            for pair in profile.points.windows(2) {
                assert!((pair[0].distance(pair[1]) - scale * 0.26f64.sqrt()).abs() < 1e-14, "{name}");
                assert_eq!(pair[0].y, y, "{name}");
            }
        }
        for length in (0..bytes.len() - 40).step_by(7) {
            // Whatever is missing: no panic.
            drop(parse(&[Source { path: &path, bytes: &bytes[..length], placement: None }]));
        }
    }
}

/// Numbers come from the file where it has them, else from the order.
#[test]
fn files_of_several_formats_go_together() {
    let json = r#"[{"profile": 0, "points": [[1, 0, 0], [0, 0, 0.1], [0, 0, 0], [1, 0, 0]]}]"#;
    let csv = "profile,x,y,z\n1,1,3,0\n1,0,3,0.1\n1,0,3,0\n";
    let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let source = |name: &'static str, text: &'static str, placement| Source {
        path: Path::new(name),
        bytes: text.as_bytes(),
        placement,
    };
    let sources = [source("a.json", json, None), source("b.csv", csv, None), source("c.DAT", SELIG, Some(&placement))];
    let profiles = parse(&sources).unwrap();
    assert_eq!(profiles.iter().map(|profile| profile.number).collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!(profiles[0].points[1], DVec3::new(0.0, 0.0, 0.1));
    let twice = parse(&[sources[0], sources[0]]).unwrap_err();
    assert_eq!(twice, ProfileError::Doubled { profile: 0 });
}

#[test]
fn broken_files_are_refused_with_their_line() {
    let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let nodes = "9 1 2 0\n9 0 2 0\n9 0.5 2 0.1\n9 0.5 2 -0.1\n";
    let segments =
        |count: usize, list: &str| tecplot(&format!("N=4, E={count}, ZONETYPE=FELINESEG"), &format!("{nodes}{list}"));
    let rows = [
        ("a.dat", SELIG.to_string(), "a.dat:1: the coordinates of an airfoil do not say where it is; expected a place"),
        ("b.dat", SELIG.replace("0.5 0.1", "0.5 nan"), "b.dat:3: found 'nan'; expected a finite number"),
        ("b.dat", SELIG.replace("0.5 0.1", "0.5 0.1 2"), "b.dat:3: 3 words; expected two numbers: x y"),
        ("b.dat", LEDNICER.replace("3.  3.", "3.  4."), "b.dat:2: 6 points after the numbers 3 and 4"),
        ("b.dat", LEDNICER.replace("3.  3.", "3.  1e300"), "b.dat:2: 6 points after the numbers 3 and"),
        ("b.dat", "title\n".to_string(), "b.dat:1: no point"),
        ("a.tec", tecplot("I=5", "9 1 2 0\n"), "a.tec:5: 4 of 20 values of the zone in line 4"),
        ("a.tec", tecplot("I=99999999999", "9 1 2 0\n"), "a.tec:4: a zone of 399999999996 values"),
        ("a.tec", tecplot("T=1", "9 1 2 0\n"), "a.tec:4: a zone without I= or N="),
        ("a.tec", tecplot("I=1, J=2", "9 1 2 0\n"), "a.tec:4: J=2; expected a zone that is a curve"),
        ("a.tec", tecplot("I=1", "9 1 inf 0\n"), "a.tec:5: found 'inf'; expected a finite number"),
        ("a.tec", tecplot("I=1, ZONETYPE=FETRIANGLE", "9 1 2 0\n"), "a.tec:4: ZONETYPE=FETRIANGLE; expected ORDERED"),
        ("a.tec", segments(1, "1 5\n"), "a.tec:9: found '5' among 4 points; expected the number of a point, from 1"),
        ("a.tec", segments(3, "1 2\n1 3\n1 4\n"), "a.tec:4: more than two segments meet at point 1"),
        ("a.tec", "VARIABLES = x y\nZONE I=1\n1 2\n".to_string(), "a.tec:1: variables x, y; expected x, y and z"),
        ("a.json", "[\n{\"profile\": 0}]".to_string(), "a.json:2: missing field `points`"),
        ("a.json", "[{\"profile\": 0, \"points\": [[1, 2]]}]".to_string(), "a.json:1: invalid length 2"),
        ("a.vtp", "<VTKFile type=\"ImageData\">".to_string(), "a.vtp: a VTK file of type ImageData is not read"),
        (
            "a.vtk",
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\n".to_string(),
            "a.vtk: the file has no POINTS",
        ),
        ("a.csv", "profile,x,y,z\n0,1,2\n".to_string(), "a.csv:2: 3 fields"),
    ];
    for (name, text, expected) in rows {
        let given = (name == "b.dat").then_some(&placement);
        let error = read(name, &text, given).unwrap_err().to_string();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    }
    let error = read("a.json", "[]", Some(&placement)).unwrap_err().to_string();
    assert!(error.contains("a placement is given, but the file says itself"), "{error}");
    let error = parse(&[Source { path: Path::new("a.dat"), bytes: b"x\n1 \xff\n", placement: None }]).unwrap_err();
    assert!(error.to_string().contains("a.dat:2: bytes that are no text"), "{error}");
}
