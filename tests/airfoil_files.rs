//! Airfoil files as panel codes and databases write them: titles, counts, labels, percent of the
//! chord, and curves that start anywhere.

use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};
use idmesh::profile::files::{Placement, Source, SpanAxis, parse};

/// A blunt airfoil from its upper to its lower trailing edge, with 4 points on each side.
const BLUNT: [[f64; 2]; 9] = [
    [1.0, 0.004],
    [0.75, 0.04],
    [0.4, 0.075],
    [0.1, 0.05],
    [0.0, 0.0],
    [0.1, -0.04],
    [0.4, -0.055],
    [0.75, -0.02],
    [1.0, -0.004],
];

fn read(text: &str) -> Result<Vec<DVec3>, String> {
    let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
    let source = Source { path: Path::new("a.dat"), bytes: text.as_bytes(), placements: &[placement] };
    parse(&[source]).map(|mut profiles| profiles.remove(0).points).map_err(|error| error.to_string())
}

fn rows(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x} {y}\n")).collect()
}

fn is(text: &str, expected: &[[f64; 2]]) {
    let found = read(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let alike = |(a, b): (&DVec3, &[f64; 2])| a.abs_diff_eq(DVec3::new(b[0], 0.0, b[1]), 1e-14);
    assert!(found.len() == expected.len() && found.iter().zip(expected).all(alike), "{text}{found:?}");
}

/// The leading edge to the trailing edge: upper side and lower side.
fn sides() -> [String; 2] {
    let (mut upper, lower) = (BLUNT[..5].to_vec(), &BLUNT[4..]);
    upper.reverse();
    [rows(&upper), rows(lower)]
}

/// Titles of any number and kind before the points.
#[test]
fn titles_are_no_points() {
    let curve = rows(&BLUNT);
    for title in [
        "NACA 4412\nafter a book\nof 1949\n",
        "0012 64\n",
        "0012\n",
        "23012\n",
        "63 2 0215\n",
        "63 2 15\n",
        "1 2 3 4 5\n",
        "2 0 1 5 12 30\n",
        "Re 1.0e6\nMach 0.3\n x y\n",
        "12% thick\n",
        "64 12% thick\n",
        "NACA 4412\nx/c y/c\n\n",
        "BLADE 7\nupper surface first\n",
        // The limits of the domain of ISES.
        "NACA 4412\n-2.0 3.0 -2.5 3.5\n",
        "\n",
        "9 points\n",
        "title\n9\n",
        "9\n",
        "5 4\n",
    ] {
        is(&format!("{title}{curve}"), &BLUNT);
    }
    // A separator after the last element of MSES.
    is(&format!("title\n{curve}999.0 999.0\n"), &BLUNT);
}

/// Remarks after the points, as collections of airfoils have them.
#[test]
fn remarks_may_follow_the_points() {
    let curve = rows(&BLUNT);
    for remark in [
        "Drawn in 1937\n",
        "\n20 nov 2005\nwith a camber of 4 %\n",
        "Thickness: 12.3\n1938\n1 2 3 4\n",
        "cm0:\t-0.091\n",
        "http://example.org/a.dat",
        "p= 14 alfa= -1.2 Cm= -0.05\nlower surface redrawn\n",
    ] {
        is(&format!("title\n{curve}{remark}"), &BLUNT);
    }
    // Points after a remark are another element's, and a garbled point is no remark.
    for (after, words) in [
        (format!("Drawn in 1937\n{curve}"), "a.dat:11: 'Drawn in 1937' after the points"),
        ("\n20 nov 2005\n1.0 -0.004\n".to_owned(), "a.dat:12: '20 nov 2005' after the points"),
        ("0,5 0,1\n".to_owned(), "a.dat:11: 3 words; expected two numbers: x y"),
        ("l.0 -0.004\n".to_owned(), "a.dat:11: found 'l.0'; expected a finite number"),
        ("1.0 -O.004\n".to_owned(), "a.dat:11: found '-O.004'; expected a finite number"),
    ] {
        let error = read(&format!("title\n{curve}{after}")).unwrap_err();
        assert!(error.contains(words), "expected: {words}\nfound:    {error}");
    }
    // A title that begins like a header of Tecplot.
    is(&format!("Zone 21 for thick wings\n{curve}"), &BLUNT);
}

/// Two sides, with counts or labels before each, in any order and direction.
#[test]
fn sides_have_counts_or_labels() {
    let [upper, lower] = sides();
    let reversed: Vec<[f64; 2]> = BLUNT.iter().rev().copied().collect();
    for [first, second] in [
        ["5\n", "5\n"],
        ["upper\n", "lower\n"],
        ["Upper surface: 5 points\n", "Lower surface: 5 points\n"],
        ["upper\n5\n", "lower\n5\n"],
        ["# upper\n", "\nx y\n"],
        ["5. 5.\n", ""],
        ["5 5\n\n", "\n"],
        ["title\n\"Suction side\"\n", "\"Pressure side\"\n"],
    ] {
        is(&format!("title\n{first}{upper}{second}{lower}"), &BLUNT);
        is(&format!("title\n{first}{lower}{second}{upper}"), &reversed);
    }
}

/// A curve that comes back to its start may start at every point, with its first point repeated or
/// not.
#[test]
fn a_curve_may_start_anywhere() {
    for sharp in [false, true] {
        // Without the trailing edge's base a ring has one point there.
        let mut ring = BLUNT.to_vec();
        if sharp {
            ring.truncate(8);
            ring[0] = [1.0, 0.0];
        }
        for start in 0..ring.len() {
            let mut turned = ring.clone();
            turned.rotate_left(start);
            let mut expected = ring.clone();
            if sharp {
                expected.push(ring[0]);
            }
            // Between both ends of a base nothing shows that the curve comes back.
            if !sharp || start > 0 {
                is(&rows(&turned), &expected);
            }
            turned.push(turned[0]);
            if start > 0 && start < ring.len() - 1 || sharp {
                is(&rows(&turned), &expected);
            }
        }
    }
}

/// Three whole numbers on the first line are a point if the other rows have three numbers too.
#[test]
fn a_first_point_of_whole_numbers_is_no_title() {
    let rows: String = BLUNT.iter().map(|[x, y]| format!("{x} {y} 3\n")).collect();
    is(&rows.replacen("1 0.004 3", "1 0 3", 1), &[&[[1.0, 0.0]], &BLUNT[1..]].concat());
    let [upper, lower] = sides();
    is(&format!("63 2 15\n5 5\n\n{upper}\n{lower}"), &BLUNT);
}

/// A thick airfoil with a base of 0.0084 of the chord, its points evenly in angle (NACA report 460,
/// the thickness doubled at the trailing edge). From the upper corner of the base to the lower one.
fn fine() -> Vec<[f64; 2]> {
    let half =
        |x: f64| 0.6 * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x.powi(2) + 0.2843 * x.powi(3) - 0.0965 * x.powi(4));
    let x = |step: i32| 0.5 - 0.5 * (f64::from(step) * std::f64::consts::PI / 66.0).cos();
    (-66..=66).map(|step| [x(step), -f64::from(step.signum()) * half(x(step))]).collect()
}

/// A curve of close points may start anywhere too, and at any place of its base: near the trailing
/// edge a wrong start would shift the airfoil by little.
#[test]
fn a_fine_curve_may_start_anywhere() {
    let selig = fine();
    let n = selig.len();
    let back: Vec<[f64; 2]> = selig.iter().rev().copied().collect();
    for curve in [&selig, &back] {
        for start in 0..n {
            let mut turned = curve.clone();
            turned.rotate_left(start);
            is(&rows(&turned), curve);
            turned.push(turned[0]);
            is(&rows(&turned), curve);
        }
        // A point of the base, and several: they stay, and the curve is closed.
        for shares in [&[0.5][..], &[0.25], &[0.9], &[0.2, 0.4, 0.8]] {
            let [[_, first], [_, last]] = [curve[0], curve[n - 1]];
            let base: Vec<[f64; 2]> = shares.iter().map(|share| [1.0, last + share * (first - last)]).collect();
            let ring = [&curve[..], &base].concat();
            let expected = [&ring[..], &ring[..1]].concat();
            for start in 0..ring.len() {
                let mut turned = ring.clone();
                turned.rotate_left(start);
                is(&rows(&turned), &expected);
                turned.push(turned[0]);
                is(&rows(&turned), &expected);
            }
        }
    }
    // A sharp trailing edge that the file does not repeat.
    let mut sharp = selig.clone();
    sharp.iter_mut().for_each(|[x, y]| *y -= 0.0042 * y.signum() * *x);
    let expected = [&sharp[..n - 1], &sharp[..1]].concat();
    for start in 0..n - 1 {
        let mut turned = sharp[..n - 1].to_vec();
        turned.rotate_left(start);
        is(&rows(&turned), &expected);
        turned.push(turned[0]);
        is(&rows(&turned), &expected);
    }
}

/// Files in Selig's order stay as they are: an oblique base, and a tab below the trailing edge.
#[test]
fn the_ends_of_seligs_order_are_the_trailing_edge() {
    let mut oblique = fine();
    let n = oblique.len();
    oblique[n - 1] = [0.998, oblique[n - 1][1]];
    is(&rows(&oblique), &oblique);
    let mut tab = fine();
    tab[n - 1] = [0.99, -0.005];
    tab.extend([[0.99, -0.02], [1.0, -0.02]]);
    is(&rows(&tab), &tab);
}

#[test]
fn percent_of_the_chord_is_a_unit() {
    let percent: Vec<[f64; 2]> = BLUNT.iter().map(|[x, y]| [100.0 * x, 100.0 * y]).collect();
    is(&format!("title\n{}", rows(&percent)), &BLUNT);
    is(&rows(&percent), &BLUNT);
    // A thick base: the first row could be two numbers of points.
    let mut thick = percent.clone();
    thick[0][1] = 2.0;
    let mut expected = BLUNT;
    expected[0][1] = 0.02;
    is(&rows(&thick), &expected);
    is(&format!("title\n{}", rows(&thick)), &expected);
    let [upper, lower] = [&percent[..5], &percent[4..]].map(rows);
    is(&format!("title\n5 5\n{upper}{lower}"), &BLUNT);
}

#[test]
fn several_elements_are_refused() {
    let main = rows(&BLUNT);
    let flap = rows(&BLUNT.map(|[x, y]| [1.0 + 0.3 * x, 0.3 * y - 0.02 - 0.1 * x]));
    let ring = rows(&[&BLUNT[..1], &BLUNT[1..8], &BLUNT[..1]].concat());
    let fine_main = rows(&fine());
    for (between, first) in [
        ("", &main),
        ("", &fine_main),
        ("999.0 999.0\n", &main),
        ("999. 999.\n", &main),
        ("\n", &main),
        ("FLAP\n", &main),
        ("", &ring),
    ] {
        let error = read(&format!("title\n{first}{between}{flap}")).unwrap_err();
        assert!(error.contains("give each element a file of its own"), "{between}: {error}");
    }
}

/// What can be read in two ways is refused with both.
#[test]
fn doubtful_rows_are_refused() {
    let curve = rows(&BLUNT);
    let [upper, lower] = sides();
    for (text, expected) in [
        (
            format!("30 31\n{curve}"),
            "a.dat:1: 9 points after the numbers 30 and 31; expected that many points of the upper",
        ),
        (format!("title\n0012 64\n{curve}"), "a.dat:2: 9 points after the numbers 12 and 64"),
        (format!("title\n5 6\n{upper}{lower}"), "a.dat:2: 10 points after the numbers 5 and 6"),
        (
            format!("61\n{curve}"),
            "a.dat:1: 9 points after the number 61; expected that many points; or, if the line is a title",
        ),
        (format!("title\n5\n{upper}6\n{lower}"), "a.dat:8: 5 points after the number 6"),
        (format!("title\n5\n{upper}{lower}"), "a.dat:2: 10 points after the number 5"),
        (format!("upper\n{upper}lower\n{lower}top\n{upper}"), "a.dat:14: a third side begins"),
        (format!("title\n4 6\n{upper}{lower}"), "a.dat:8: the second side begins here, after 5 points, not after 4"),
        (format!("title\n1.0 0.0x\n{curve}"), "a.dat:2: found '0.0x'; expected a finite number"),
        (format!("title\n{curve}1 2 3 4\n"), "a.dat:11: 4 words; expected two numbers: x y"),
        // The lower side ends at half the chord.
        (rows(&BLUNT[..6]), "a.dat:6: the points begin or end at x = 0.1, which is not the trailing edge"),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    }
}

fn golden(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/airfoils").join(name)).unwrap()
}

/// Points of NACA 4415, evenly in angle, from the upper to the lower trailing edge: camber line and
/// thickness of NACA report 460, with the thickness along y, as XFOIL adds it.
fn naca_4415() -> Vec<[f64; 2]> {
    let (camber, at, thickness) = (0.04, 0.4, 0.15);
    let side = |x: f64, side: f64| {
        let half = 5.0
            * thickness
            * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x.powi(2) + 0.2843 * x.powi(3) - 0.1015 * x.powi(4));
        let (scale, before) =
            if x < at { (camber / (at * at), 0.0) } else { (camber / (1.0 - at).powi(2), 1.0 - 2.0 * at) };
        let line = scale * (before + 2.0 * at * x - x * x);
        [x, line + side * half]
    };
    let n = 4000;
    let x = |step: i32| (f64::from(step) / f64::from(n) * std::f64::consts::FRAC_PI_2).sin().powi(2);
    let steps = (-n..=n).map(|step| if step < 0 { side(x(-step), 1.0) } else { side(x(step), -1.0) });
    steps.collect()
}

/// Files of XFOIL 6.99 through `data/make_airfoils.sh`, and one in Lednicer's format after its
/// description: all points are those of the airfoil in closed form, in the order of the file.
#[test]
fn files_of_xfoil_are_the_airfoil() {
    let exact = naca_4415();
    for (name, n_points, digits) in [
        ("xfoil.labeled.dat", 62, 7),
        ("xfoil.plain.dat", 62, 7),
        ("xfoil.ises.dat", 62, 7),
        ("xfoil.comma.dat", 62, 6),
        ("xfoil.tab.dat", 62, 6),
        ("xfoil.clockwise.dat", 62, 7),
        ("lednicer.dat", 63, 7),
    ] {
        let points = read(&golden(name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(points.len(), n_points, "{name}");
        for point in &points {
            let at = DVec2::new(point.x, point.z);
            let off = |pair: &[[f64; 2]]| {
                let [a, b] = [DVec2::from(pair[0]), DVec2::from(pair[1])];
                let along = ((at - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                at.distance(a.lerp(b, along))
            };
            let off = exact.windows(2).map(off).fold(f64::INFINITY, f64::min);
            assert!(off < 2.0 * 10f64.powi(-digits), "{name}: {point} is off by {off:e}");
        }
        let [first, last] = [points[0], points[points.len() - 1]];
        assert!(first.x == 1.0 && last.x == 1.0 && (first.z > last.z) == (name != "xfoil.clockwise.dat"), "{name}");
    }
    let error = read(&golden("xfoil.mses.dat")).unwrap_err();
    assert!(error.contains("a.dat:65: 999 999, after which another element begins"), "{error}");
}
