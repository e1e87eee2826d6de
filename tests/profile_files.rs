//! Profile files of every format: the same section out of each, and broken ones refused with their
//! line.

use std::fs;
use std::path::Path;

use glam::DVec3;
use idmesh::profile::files::{Placement, Source, SpanAxis, parse};
use idmesh::profile::{Profile, ProfileError};

/// A diamond: chord 1, thickness 0.2, sharp trailing edge at (1, 0), upper side first.
const DIAMOND: [[f64; 2]; 5] = [[1.0, 0.0], [0.5, 0.1], [0.0, 0.0], [0.5, -0.1], [1.0, 0.0]];

fn read(name: &str, text: &str, placement: Option<&Placement>) -> Result<Vec<Profile>, ProfileError> {
    parse(&[Source {
        path: Path::new(name),
        bytes: text.as_bytes(),
        placements: placement.map_or(&[], std::slice::from_ref),
    }])
}

fn close(points: &[DVec3], expected: &[[f64; 3]]) -> bool {
    points.len() == expected.len()
        && points.iter().zip(expected).all(|(point, &expected)| point.abs_diff_eq(expected.into(), 1e-14))
}

const SELIG: &str = "DIAMOND airfoil 2012\n 1.0 0.0\n 0.5 0.1\n 0.0 0.0\n\n 0.5 -0.1\n 1.0 0.0\n";
const LEDNICER: &str = "DIAMOND\n  3.  3.\n\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n";

/// The sides of the diamond one after the other, from the leading edge to the trailing edge.
const BLOCKS: &str = "DIAMOND\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n";

/// The diamond with its leading edge elsewhere and with another chord.
fn moved(x: f64, y: f64, chord: f64) -> String {
    let row = |point: [f64; 2]| format!("{} {}\n", x + chord * point[0], y + chord * point[1]);
    format!("DIAMOND\n{}", DIAMOND.map(row).concat())
}

/// The diamond with a third column, of which the last number is another.
fn thick(column: &str, last: &str) -> String {
    let rows = SELIG.replace("\n\n", "\n").trim_end().replace('\n', &format!("{column}\n"));
    rows.replacen(column, "", 1) + last + "\n"
}

/// Each order of points, and each habit of other programs, gives the curve of the plain file.
///
/// Fails if `COUNTS` is 10, if `SAME` of `airfoil` is 0.1 or 0, and if `FAR` of `sides` is 5 or
/// 0.01.
#[test]
fn airfoils_are_read_as_others_write_them() {
    let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let read = |text: &[u8]| {
        let source = Source { path: Path::new("a.dat"), bytes: text, placements: &[placement] };
        parse(&[source]).unwrap_or_else(|error| panic!("{error}:\n{}", String::from_utf8_lossy(text))).remove(0).points
    };
    let expected = DIAMOND.map(|[x, y]| [x, 0.0, y]);
    let sides = ["0 0\n0.5 0.1\n1 0\n", "0 0\n0.5 -0.1\n1 0\n"];
    let turned = ["1 0\n0.5 0.1\n0 0\n", "1 0\n0.5 -0.1\n0 0\n"];
    let mut texts = vec![
        BLOCKS.to_string(),
        // Without the blank line, x starts again.
        BLOCKS.replace("\n\n", "\n"),
        format!("# by a tool\n! in 2012\n\n{}% end\n", SELIG.replace("0.5 0.1", "0.5 0.1 # the thickest")),
        SELIG.replace('\n', " ! more\n").replacen("! more", "12%", 1),
        thick(" 0.000", " 0.000"),
        thick(" 2.5", " 2.5"),
        thick(" 2.5", " 2.5000000001"),
        // x, y along the span, z.
        SELIG
            .replace(" 0.5 ", "0.5 0 ")
            .replace("1.0 ", "1.0 0 ")
            .replace("0.0 0", "0.0 0 0")
            .replace("1.0 0 0 0", "1.0 0 0"),
        SELIG.replace("0.5 0.1", "5.0D-01;1.d-1").replace("1.0 0.0", "1.0D+00 0.0d0"),
        SELIG.replace("2012\n", "2012\nx/c y/c\n"),
        SELIG.replace("\n 1.0", "\n\n1.0"),
    ];
    for upper in [sides[0], turned[0]] {
        for lower in [sides[1], turned[1]] {
            texts.push(format!("DIAMOND\n{upper}\n{lower}"));
            texts.push(format!("DIAMOND\n3 3\n{upper}{lower}"));
        }
    }
    for text in texts {
        assert!(close(&read(text.as_bytes()), &expected), "{text}{:?}", read(text.as_bytes()));
    }
    let latin = [b"Profil \xe9pais\n", SELIG.split_once('\n').unwrap().1.as_bytes(), b"# 12 \xb0\n"].concat();
    assert!(close(&read(&latin), &expected));
    // A flat lower side has no points between its ends: nothing starts again there.
    let flat = [[1.0, 0.0, 0.0], [0.5, 0.0, 0.1], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
    assert!(close(&read(b"1 0\n0.5 0.1\n0 0\n1 0\n"), &flat));
    assert!(close(&read(b"0 0\n0.5 0.1\n1 0\n\n0 0\n1 0\n"), &flat));
    assert!(close(&read(b"flat\n3 2\n0 0\n0.5 0.1\n1 0\n0 0\n1 0\n"), &flat));
    // A closed curve may begin anywhere.
    let round = read(b"0 0\n0.5 -0.1\n1 0\n0.5 0.05\n0.3 0.1\n0 0\n");
    assert_eq!((round[0], round[5], round.len()), (DVec3::X, DVec3::X, 6));
    assert_eq!(round[1], DVec3::new(0.5, 0.0, 0.05));
}

/// Within a hundredth an airfoil is where its file says: NACA 9418 at its own 0 and 1, whose nose
/// is a little off.
#[test]
fn airfoils_with_camber_keep_their_place() {
    let (camber, at, thickness) = (0.09, 0.4, 0.18);
    let side = |side: f64| {
        (0..=60).map(move |step| {
            let x = 0.5 * (1.0 - (std::f64::consts::PI * f64::from(step) / 60.0).cos());
            let half = 5.0
                * thickness
                * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1015 * x.powi(4));
            let (scale, from) =
                if x < at { (camber / (at * at), 0.0) } else { (camber / (1.0 - at).powi(2), 1.0 - 2.0 * at) };
            let (height, slope) = (scale * (from + 2.0 * at * x - x * x), scale * 2.0 * (at - x));
            let angle = slope.atan();
            [x - side * half * angle.sin(), height + side * half * angle.cos()]
        })
    };
    let curve: Vec<[f64; 2]> = side(1.0).collect::<Vec<_>>().into_iter().rev().chain(side(-1.0).skip(1)).collect();
    assert!(curve.iter().any(|point| point[0] < -0.002), "the nose is off 0");
    let text: String = curve.iter().map(|[x, y]| format!("{x} {y}\n")).collect();
    let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let expected: Vec<[f64; 3]> = curve.iter().map(|&[x, y]| [x, 0.0, y]).collect();
    assert!(close(&read("a.dat", &text, Some(&placement)).unwrap()[0].points, &expected));
}

/// Columns by their names, in any order and among others; comments; separators; Fortran's numbers.
#[test]
fn tables_of_profiles_are_read_as_others_write_them() {
    let plain = read("a.csv", "profile,x,y,z\n0,1,2,0\n0,0.5,2,0.1\n1,0,3,0.25\n", None).unwrap();
    assert_eq!((plain.len(), plain[1].points[0]), (2, DVec3::new(0.0, 3.0, 0.25)));
    for text in [
        "\"profile\",\"Points:0\",\"Points:1\",\"Points:2\"\n0,1,2,0\n0,0.5,2,0.1\n1,0,3,0.25\n",
        "profile,x [m],y [m],z [m]\n0,1,2,0\n0,0.5,2,0.1\n1,0,3,0.25\n",
        "profile x (m) y (m) z (m)\n0 1 2 0\n0 0.5 2 0.1\n1 0 3 0.25\n",
        "\"Cp, mean\",\"Points_2\",\"Points_0\",\"Points_1\",\"PROFILE\"\n9,0,1,2,0\n9,0.1,0.5,2,0\n,0.25,0,3,1\n",
        "X Y Z Profile\n1 2 0 0\n0.5\t2 0.1 0\n0 3 2.5D-01 1.d0\n",
        "# made by x\n# profile x y z\n0;1;2;0\n\n0;0.5;2;0.1 # nose\n1;0;3;0.25;\n% end\n",
        ",profile,x,y,z\n0,0,1,2,0\n1,0,0.5,2,0.1\n2,1,0,3,0.25\n",
    ] {
        assert_eq!(read("a.csv", text, None).unwrap(), plain, "{text}");
    }
    // A header that is no comment counts more than a comment that might be one.
    let both = "# z,y,x,profile\nprofile,x,y,z\n0,1,2,0\n0,0.5,2,0.1\n1,0,3,0.25\n";
    assert_eq!(read("a.csv", both, None).unwrap(), plain);
    let latin = b"# d\xe9j\xe0 vu\nprofile,x,y,z\n0,1,2,0\n0,0.5,2,0.1\n1,0,3,0.25\n";
    assert_eq!(parse(&[Source { path: Path::new("a.csv"), bytes: latin, placements: &[] }]).unwrap(), plain);
}

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
    let others =
        two.replace("9 0.5 2 0.1\n", "9, 5.0D-01 2 1.d-1 # thick\n# nose\n").replacen("TITLE", "# by a tool\nTITLE", 1);
    let title: Vec<u8> = others.replace("slices", "\u{e9}").chars().map(|letter| letter as u8).collect();
    assert_eq!(parse(&[Source { path: Path::new("a.dat"), bytes: &title, placements: &[] }]).unwrap(), profiles);
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

/// The names that tables understand are those of Tecplot's variables too.
///
/// Fails if Tecplot's variables have a list of names of their own.
#[test]
fn tecplot_variables_are_named_as_columns_are() {
    let rows = "1 2 0\n0.5 2 0.1\n0 2 0\n0.5 2 -0.1\n1 2 0\n";
    for names in [
        "\"x [m]\" \"y [m]\" \"z [m]\"",
        "\"x (m)\", \"y (m)\", \"z (m)\"",
        "X[m], Y[m], Z[m]",
        "x [m] y [m] z [m]",
        "\"Points:0\" \"Points:1\" \"Points:2\"",
        "\"X Coordinate\" \"Y Coordinate\" \"Z Coordinate\"",
        "CoordinateX CoordinateY CoordinateZ",
    ] {
        let profiles = read("a.dat", &format!("VARIABLES = {names}\nZONE I=5\n{rows}"), None).unwrap();
        assert!(close(&profiles[0].points, &DIAMOND.map(|[x, z]| [x, 2.0, z])), "{names}: {:?}", profiles[0].points);
    }
}

/// Zones without z are an airfoil: one curve, or its two sides.
///
/// Fails if such a file is refused, or if another variable is taken for the thickness.
#[test]
fn tecplot_zones_in_a_plane_are_an_airfoil() {
    let placement = Placement { chord: 2.0, twist: 0.0, position: DVec3::new(5.0, 6.0, 7.0), span: SpanAxis::Y };
    let expected = DIAMOND.map(|[x, y]| [5.0 + 2.0 * x, 6.0, 7.0 + 2.0 * y]);
    let sides = "ZONE T=\"upper\" I=3\n9 0 0\n9 0.5 0.1\n9 1 0\nZONE T=\"lower\" I=3\n8 0 0\n8 0.5 -0.1\n8 1 0\n";
    let segments = "ZONE N=4, E=4, ZONETYPE=FELINESEG\n9 1 0\n9 0 0\n9 0.5 0.1\n9 0.5 -0.1\n2 4\n3 1\n4 1\n3 2\n";
    for zones in ["ZONE T=\"u\" I=5\n9 1 0\n9 0.5 0.1\n9 0 0\n9 0.5 -0.1\n9 1 0\n", sides, segments] {
        let text = format!("TITLE=\"x\"\nVARIABLES=\"Cp\",\"X\",\"Y\"\n{zones}");
        let profiles = read("a.dat", &text, Some(&placement)).unwrap();
        assert_eq!(profiles.len(), 1);
        let mut points = profiles[0].points.clone();
        if points[1].z < 7.0 {
            points.reverse();
        }
        assert!(close(&points, &expected), "{zones}: {points:?}");
        let error = read("a.dat", &text, None).unwrap_err().to_string();
        assert!(
            error.contains("a.dat:1: the coordinates of an airfoil do not say where it is; expected a place"),
            "{error}"
        );
    }
    let three = format!("VARIABLES=Cp X Y\n{sides}{sides}");
    let error = read("a.dat", &three, Some(&placement)).unwrap_err().to_string();
    assert!(error.contains("a.dat:10: a third curve without z among its variables; expected one airfoil"), "{error}");
}

/// Slices as VTK 9.7.2 wrote them, in one data set and in two that were put together.
#[test]
fn polylines_of_vtk_are_curves() {
    for name in ["diamonds.vtp", "diamonds.vtk", "appended.ascii.vtk", "appended.binary.vtk"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/sections").join(name);
        let bytes = fs::read(&path).unwrap();
        let profiles = parse(&[Source { path: &path, bytes: &bytes, placements: &[] }]).unwrap();
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
            drop(parse(&[Source { path: &path, bytes: &bytes[..length], placements: &[] }]));
        }
    }
}

/// Numbers come from the file where it has them, else from the order.
#[test]
fn files_of_several_formats_go_together() {
    let json = r#"[{"profile": 0, "points": [[1, 0, 0], [0, 0, 0.1], [0, 0, 0], [1, 0, 0]]}]"#;
    let csv = "profile,x,y,z\n1,1,3,0\n1,0,3,0.1\n1,0,3,0\n";
    const PLACEMENT: &Placement = &Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let source = |name: &'static str, text: &'static str, placement: Option<&'static Placement>| Source {
        path: Path::new(name),
        bytes: text.as_bytes(),
        placements: placement.map_or(&[], std::slice::from_ref),
    };
    let sources = [source("a.json", json, None), source("b.csv", csv, None), source("c.DAT", SELIG, Some(PLACEMENT))];
    let profiles = parse(&sources).unwrap();
    assert_eq!(profiles.iter().map(|profile| profile.number).collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!(profiles[0].points[1], DVec3::new(0.0, 0.0, 0.1));
    let twice = parse(&[sources[0], sources[0]]).unwrap_err();
    assert_eq!(twice, ProfileError::Doubled { profile: 0 });
}

/// Fails if `COUNTS` is 10 or 0.5, if `SAME` of `airfoil` is 0.1, and if `FAR` is 5 or 0.01 or
/// `OFF` 0.3, both of `sides`.
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
        ("b.dat", SELIG.replace("0.5 0.1", "0,5 0,1"), "b.dat:3: 3 words; expected two numbers: x y"),
        ("b.dat", SELIG.replace("0.5 0.1", "0.5 0.1D"), "b.dat:3: found '0.1D'; expected a finite number"),
        (
            "b.dat",
            BLOCKS.replace("\n\n", "\n0 0.2\n0.5 0.2\n0.9 0\n\n"),
            "b.dat:9: the points begin a third time at an end",
        ),
        ("b.dat", "half\n1 0\n0.5 0.1\n0 0\n".into(), "b.dat:4: the points begin or end at x = 0"),
        ("b.dat", thick(" 0", " 1"), "b.dat:6: the second and the third column both change"),
        (
            "b.dat",
            moved(-0.3, 0.0, 1.0),
            "b.dat:2: the airfoil's leading edge is at x = -0.300000, y = 0.000000 and its chord is 1.0",
        ),
        (
            "b.dat",
            moved(0.0, 0.6, 1.0),
            "b.dat:2: the airfoil's leading edge is at x = 0.000000, y = 0.600000 and its chord is 1.0",
        ),
        (
            "b.dat",
            moved(0.0, 0.02, 1.0),
            "b.dat:2: the airfoil's leading edge is at x = 0.000000, y = 0.020000 and its chord is 1.0",
        ),
        (
            "b.dat",
            moved(0.0, 0.0, 1.02),
            "b.dat:2: the airfoil's leading edge is at x = 0.000000, y = 0.000000 and its chord is 1.020",
        ),
        (
            "b.dat",
            moved(0.0, 0.0, 1000.0),
            "b.dat:2: the airfoil's leading edge is at x = 0.000000, y = 0.000000 and its chord is 1000.0",
        ),
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
        (
            "a.tec",
            "VARIABLES = x z\nZONE I=1\n1 2\n".to_string(),
            "a.tec:1: no column y among 'x, z'; expected x, y and z",
        ),
        (
            "a.tec",
            tecplot("I=1", "9 1 2 0\n").replace("teX", "teX [mm]"),
            "a.tec:2: the columns 'CoordinateX' in [mm] and",
        ),
        ("a.json", "[\n{\"profile\": 0}]".to_string(), "a.json:2: missing field `points`"),
        ("a.json", "[{\"profile\": 0, \"points\": [[1, 2]]}]".to_string(), "a.json:1: invalid length 2"),
        ("a.vtp", "<VTKFile type=\"ImageData\">".to_string(), "a.vtp: a VTK file of type ImageData is not read"),
        (
            "a.vtk",
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\n".to_string(),
            "a.vtk: the file has no POINTS",
        ),
        ("a.csv", "profile,x,y,z\n0,1,2\n".to_string(), "a.csv:2: 3 fields"),
        ("a.csv", "profile,x,y,z,cp\n0,1,2,,3\n".to_string(), "a.csv:2: z = ''; expected a finite number"),
        (
            "a.csv",
            "Points:0,Points:1,Points:2\n1,2,3\n".to_string(),
            "a.csv:1: found 'Points:0,Points:1,Points:2', which has no",
        ),
        ("a.csv", "profile,x,y,z,Points:0\n".to_string(), "a.csv:1: the columns 'x' and 'Points:0' both are x"),
        ("a.csv", "profile,x [m],y [m],z [mm]\n".to_string(), "a.csv:1: the columns 'x' in [m] and 'z' in [mm]"),
        ("a.csv", "profile,x,y,z,profile\n".to_string(), "a.csv:1: two columns profile"),
        ("a.csv", "# profile,x,y\n0,1,2,3\n".to_string(), "a.csv:2: found '0,1,2,3'; expected the header"),
    ];
    for (name, text, expected) in rows {
        let given = (name == "b.dat").then_some(&placement);
        let error = read(name, &text, given).unwrap_err().to_string();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    }
    let error = read("a.json", "[]", Some(&placement)).unwrap_err().to_string();
    assert!(error.contains("a placement is given, but the file says itself"), "{error}");
    let error = parse(&[Source { path: Path::new("a.json"), bytes: b"[\n\xff]", placements: &[] }]).unwrap_err();
    assert!(error.to_string().contains("a.json:2: bytes that are no text"), "{error}");
}
