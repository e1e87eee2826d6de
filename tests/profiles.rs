//! Profiles: cutting, files, planes and matching, on analytic wings.

#[path = "common/wing.rs"]
mod wing;

use std::path::Path;

use glam::{DMat3, DVec3};
use idmesh::profile::{Plane, Profile, ProfileError, csv, cut, distance, matching, stations};
use wing::{BLUNT, CHORD, SHARP, SPAN, Surface, Wing, affine, at_y, mapped, resampled};

#[test]
fn a_blunt_section_is_open_and_runs_lower_te_le_upper_te() {
    for y in [0.31, 1.0, 2.0, 3.77] {
        let curve = &BLUNT.surface().cut(&[y])[0].points;
        let (lower, upper) = (BLUNT.point(-1.0, y), BLUNT.point(1.0, y));
        // Between rows the twisted trailing edge is a chord: second derivative 0.006 times (row
        // distance 0.2)^2 / 8.
        assert!(curve[0].distance(lower) < 1e-4 && curve[curve.len() - 1].distance(upper) < 1e-4);
        assert!(curve.iter().all(|p| p.y == y), "points lie exactly in the plane");
        let le = (0..curve.len()).min_by(|&a, &b| curve[a].x.total_cmp(&curve[b].x)).unwrap();
        assert!(curve[..le].windows(2).all(|p| p[1].x < p[0].x) && curve[le..].windows(2).all(|p| p[1].x > p[0].x));
        assert!(curve[le / 2].z < curve[le + le / 2].z);
    }
}

#[test]
fn a_sharp_section_is_closed_at_its_trailing_edge() {
    for y in [0.31, 1.0, 2.0, 3.77] {
        let curve = &SHARP.surface().cut(&[y])[0].points;
        assert_eq!(curve.first(), curve.last());
        assert!(curve[0].distance(SHARP.point(1.0, y)) < 1e-4);
        assert!(curve[curve.len() / 4].z < curve[3 * curve.len() / 4].z, "lower side first");
    }
}

/// The base belongs to the wing: the two sides come first, then the base leads back.
///
/// Fails if `SAME` of `cut` is 1e-2, and if, of `edges`, `PROBE` is 0.001, `SHARP` 175 or 80, or
/// `CORNER` 89.
#[test]
fn a_section_with_its_base_is_closed_and_ends_with_the_base() {
    let wing = Wing { base: true, te: 0.02, ..BLUNT };
    for y in [0.31, 1.0, 3.77] {
        let curve = &wing.surface().cut(&[y])[0].points;
        let n = curve.len();
        assert_eq!(curve.first(), curve.last());
        assert!(curve[0].distance(wing.point(-1.0, y)) < 1e-4);
        let upper = curve.iter().position(|p| p.distance(wing.point(1.0, y)) < 1e-4).unwrap();
        assert!(upper < n - 1 && upper > n - 4, "{upper} of {n}");
    }
}

/// Rows of vertices stand exactly at y = 1.0: each vertex of the row appears once, and nothing else
/// but the row.
///
/// Fails if `SAME` of `cut` is 0.
#[test]
fn a_plane_through_vertices_cuts_them_once() {
    for (wing, y) in [(BLUNT, 1.0), (SHARP, 1.0), (BLUNT, 1.0 + 1e-14), (SHARP, 1.0 + 1e-14)] {
        let curve = &wing.surface().cut(&[y])[0].points;
        assert_eq!(curve.len(), wing.around);
        for (i, p) in curve.iter().enumerate() {
            assert!(p.distance(wing.point(2.0 * i as f64 / (wing.around - 1) as f64 - 1.0, 1.0)) < 1e-12, "{i}");
        }
    }
}

#[test]
fn the_wings_own_ends_can_be_cut() {
    let surface = BLUNT.surface();
    for y in [0.0, SPAN] {
        assert_eq!(surface.cut(&[y])[0].points.len(), BLUNT.around);
    }
}

#[test]
fn a_plane_beside_the_wing_is_told_its_extent() {
    let surface = BLUNT.surface();
    match cut::cut(&surface.vertices, &surface.triangles, &at_y(5.0)) {
        Err(ProfileError::PlaneMisses { at, low, high, .. }) => assert_eq!((at, low, high), (5.0, 0.0, SPAN)),
        other => panic!("{other:?}"),
    }
    assert!(matches!(cut::cut(&[], &[[0; 3]; 0], &at_y(0.0)), Err(ProfileError::PlaneMisses { .. })));
}

#[test]
fn several_pieces_and_branches_are_errors() {
    let mut surface = BLUNT.surface();
    let n = surface.vertices.len() as u32;
    let copy: Vec<DVec3> = surface.vertices.iter().map(|&v| v + DVec3::Z * 3.0).collect();
    surface.vertices.extend(copy);
    let mut two = surface.triangles.clone();
    two.extend(surface.triangles.iter().map(|t| t.map(|v| v + n)));
    let result = cut::cut(&surface.vertices, &two, &at_y(1.03));
    assert!(matches!(result, Err(ProfileError::Pieces { pieces: 2, .. })), "{result:?}");

    // A fin on an edge that the plane crosses.
    let crossed = surface.triangles.iter().find(|t| {
        let y = t.map(|v| surface.vertices[v as usize].y);
        y[0] < 1.03 && y[1] > 1.03
    });
    let [a, b, _] = *crossed.unwrap();
    let mut fin = surface.triangles.clone();
    fin.push([a, b, n]);
    let result = cut::cut(&surface.vertices, &fin, &at_y(1.03));
    assert!(matches!(result, Err(ProfileError::Branches { .. })), "{result:?}");

    let result = cut::cut(&surface.vertices, &[[0, 1, u32::MAX]], &at_y(1.0));
    assert!(matches!(result, Err(ProfileError::Face { face: 0, vertex: u32::MAX, .. })), "{result:?}");
}

/// Fails if all `MARGINS` are 0.1 or 0.0001, and if `FULL` is 1.5.
#[test]
fn planes_stand_evenly_or_where_named() {
    let surface = BLUNT.surface();
    let y = |n| -> Vec<f64> {
        let planes = stations::evenly(&surface.vertices, &surface.triangles, n).unwrap();
        assert!(planes.iter().all(|p| p.normal == DVec3::Y));
        planes.iter().map(|p| p.point.y).collect()
    };
    assert!(y(3).iter().zip([0.02, 2.0, 3.98]).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!((y(1)[0] - 2.0).abs() < 1e-12);
    assert_eq!(stations::evenly(&surface.vertices, &surface.triangles, 0), Err(ProfileError::NoProfiles));
    assert_eq!(stations::parse(" y = 1.5 "), Ok(at_y(1.5)));
    for text in ["", "y", "1.5", "w=1", "y=", "y=nan", "y=1,2"] {
        assert_eq!(stations::parse(text), Err(ProfileError::PlaneText { text: text.into() }));
    }
}

/// The tip is an ellipse over the last 0.2 of the span: a section there has 0.97 of the chord up to
/// 0.151 before the end.
///
/// Fails if `FULL` is 0.3 or 1.5.
#[test]
fn planes_stand_where_sections_are_full() {
    let row = |i: i32| {
        let y = if i < 100 { 0.038 * f64::from(i) } else { 3.8 + 0.2 * f64::from(i - 100) / 100.0 };
        let scale = (1.0 - ((y - 3.8f64).max(0.0) / 0.2).powi(2)).sqrt().max(1e-3);
        let points = (0..80).map(|k| SHARP.point(f64::from(k) / 40.0 - 1.0, 0.0));
        points.map(|at| DVec3::new(1.0, y, 0.0) + DVec3::new(scale * (at.x - 1.0), 0.0, scale * at.z)).collect()
    };
    let surface = Surface::through(&(0..=200).map(row).collect::<Vec<_>>(), true);
    let planes = stations::evenly(&surface.vertices, &surface.triangles, 3).unwrap();
    let found: Vec<f64> = planes.iter().map(|plane| plane.point.y).collect();
    assert!(found.iter().zip([0.02, 1.93, 3.84]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
}

#[test]
fn csv_keeps_every_bit() {
    let mut profiles = BLUNT.surface().cut(&[1.1, 2.3]);
    profiles[0].number = -7;
    profiles[1].points[3] = DVec3::new(-0.0, f64::MIN_POSITIVE, 1.0 / 3.0);
    let mut text = Vec::new();
    csv::write(&profiles, &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    assert!(text.starts_with("profile,x,y,z\n-7,"));
    assert_eq!(csv::parse(&[(Path::new("a.csv"), &text)]).unwrap(), profiles);
}

#[test]
fn csv_accepts_what_other_tools_write_and_several_files() {
    let a = "\u{feff}Profile, X, Y, Z\r\n0,1,2,3\r\n\r\n 0 , 4e0,5,6\r\n";
    let b = "profile,x,y,z\n1.0,7,8,9\n";
    let read = csv::parse(&[(Path::new("a"), a), (Path::new("b"), b)]).unwrap();
    let points = [vec![DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)], vec![DVec3::new(7.0, 8.0, 9.0)]];
    let expected: Vec<Profile> =
        points.into_iter().enumerate().map(|(i, points)| Profile { number: i as i64, points }).collect();
    assert_eq!(read, expected);
}

#[test]
fn csv_errors_name_path_line_and_what_is_expected() {
    for (text, expected) in [
        ("", "p.csv:1: the file is empty; expected the header profile,x,y,z"),
        ("0,1,2,3\n", "p.csv:1: found '0,1,2,3'; expected the header profile,x,y,z"),
        ("profile,x,y,z\n0,1,2\n", "p.csv:2: 3 fields; expected four: profile,x,y,z"),
        ("profile,x,y,z\n0,1,2,3\n\n0.5,1,2,3\n", "p.csv:4: profile number '0.5'; expected an integer"),
        ("profile,x,y,z\n0,1,nan,3\n", "p.csv:2: y = 'nan'; expected a finite number"),
        ("profile,x,y,z\n0,1,2,1e999\n", "p.csv:2: z = '1e999'; expected a finite number"),
        (
            "profile,x,y,z\n0,1,2,3\n1,1,2,3\n0,1,2,3\n",
            "p.csv:4: profile 0 begins a second time; expected the points of a profile in consecutive rows of one file",
        ),
    ] {
        let error = csv::parse(&[(Path::new("p.csv"), text)]).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    assert_eq!(csv::parse(&[(Path::new("p"), "profile,x,y,z\n")]), Err(ProfileError::NoProfiles));
    let one = "profile,x,y,z\n0,1,2,3\n";
    let error = csv::parse(&[(Path::new("a"), one), (Path::new("b"), one)]).unwrap_err();
    assert!(error.to_string().starts_with("b:2: profile 0 begins"), "{error}");
}

/// Fails if `FLATNESS` is 1e-1 or 1e-12, `AXIS` 1e-1 or 0, `LARGEST` of profiles 1e308 or 10, and
/// `MOST_POINTS` 1000000000 or 200.
#[test]
fn planes_are_fitted_and_bad_profiles_refused() {
    let section = BLUNT.surface().cut(&[1.3]).remove(0);
    let plane = Plane::of_profile(&section).unwrap();
    assert_eq!((plane.normal, plane.point.y), (DVec3::Y, 1.3));
    // A tilted one: rotated by 20 degrees about x, the normal turns with it.
    let turn = DMat3::from_rotation_x(0.35);
    let tilted = mapped(std::slice::from_ref(&section), |p| turn * p).remove(0);
    assert!(Plane::of_profile(&tilted).unwrap().normal.distance(turn * DVec3::Y) < 1e-12);

    let mut bent = section.clone();
    bent.points[17].y += 1e-4;
    match Plane::of_profile(&bent) {
        Err(ProfileError::NotPlane { profile: 0, point: 17, distance, .. }) => assert!((distance - 1e-4).abs() < 1e-5),
        other => panic!("{other:?}"),
    }
    let with = |points: Vec<DVec3>| Plane::of_profile(&Profile { number: 3, points }).unwrap_err();
    let p = section.points.clone();
    assert_eq!(with(vec![p[0], p[0], p[1], p[1]]), ProfileError::TooFewPoints { profile: 3, points: 2 });
    assert_eq!(with(vec![p[0], p[9], p[0]]), ProfileError::TooFewPoints { profile: 3, points: 2 });
    assert_eq!(with(vec![]), ProfileError::TooFewPoints { profile: 3, points: 0 });
    assert!(matches!(with(vec![p[0], DVec3::NAN, p[1]]), ProfileError::NotFinite { profile: 3, point: 1, .. }));
    assert!(matches!(with(vec![p[0], p[1], DVec3::INFINITY]), ProfileError::NotFinite { point: 2, .. }));
    assert!(matches!(with(vec![p[0], 1e120 * DVec3::X, p[1]]), ProfileError::NotFinite { point: 1, .. }));
    let many =
        |n: usize| (0..n).map(|i| DVec3::new(f64::from(i as u32).cos(), 0.0, f64::from(i as u32).sin())).collect();
    assert_eq!(with(many(1_000_001)), ProfileError::TooManyPoints { profile: 3, points: 1_000_001, most: 1_000_000 });
    assert!(Plane::of_profile(&Profile { number: 3, points: many(10_000) }).is_ok());
    let line = (0..5).map(|i| DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).collect();
    assert_eq!(with(line), ProfileError::OnOneLine { profile: 3 });
}

/// New points are another sampling of the section mapped by a strong affine change (40 % thicker,
/// sheared, rotated): old points must find their images. Fit and match leave 1e-3 of the chord
/// along the curve; across it only the sampling errs, by (1/160)^2 of the section at the nose.
///
/// Fails if `TURNS` of `matching` is 1, and if, of `edges`, `PROBE` is 0.4 or `ALIKE` 10.
#[test]
fn matching_survives_other_counts_directions_and_starts() {
    for wing in [BLUNT, SHARP] {
        let y = 1.4;
        let old = Profile { number: 0, points: resampled(&wing, y, 131) };
        let image: Vec<DVec3> = old.points.iter().map(|&p| affine(p)).collect();
        let same: Vec<DVec3> = resampled(&wing, y, 161).into_iter().map(affine).collect();
        let reversed: Vec<DVec3> = same.iter().rev().copied().collect();
        let mut variants = vec![same.clone(), reversed];
        if wing.te == 0.0 {
            let mut rotated = same.clone();
            rotated.pop();
            rotated.rotate_left(61);
            rotated.push(rotated[0]);
            variants.push(rotated.clone());
            rotated.reverse();
            variants.push(rotated);
        }
        for points in variants {
            let found = matching::match_points(&old, &Profile { number: 0, points }).unwrap();
            let error = found.iter().zip(&image).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            let across = distance::max_distance(&found, &same);
            assert!(across < 2e-4 * CHORD, "{across:e} across the profile with trailing edge {}", wing.te);
            assert!(error < 1.5e-3 * CHORD, "{error:e} of a profile with trailing edge {}", wing.te);
        }
    }
}

/// A section with a round trailing edge of few points, from its rear end. The end turns by about
/// 40 degrees at a point, as much as the corner of a blunt edge.
///
/// - `turns`: angles of the upper points of the end, in degrees, beside the rear one
/// - `stations`: the stations of the other points of a side
fn round_edge(turns: &[f64], stations: &[f64]) -> Vec<DVec3> {
    const RADIUS: f64 = 0.006;
    let end = turns.iter().map(|degrees| degrees.to_radians().sin_cos());
    let end = end.map(|(sin, cos)| [1.0 - RADIUS * (1.0 - cos), RADIUS * sin]);
    let side = stations.iter().map(|x| [*x, 0.1 * x.sqrt() * (1.0 - 0.9 * x)]);
    let upper: Vec<[f64; 2]> = end.chain(side).collect();
    let lower = upper.iter().rev().map(|&[x, z]| [x, -z]);
    let all =
        [[1.0, 0.0]].into_iter().chain(upper.iter().copied()).chain([[0.0, 0.0]]).chain(lower).chain([[1.0, 0.0]]);
    all.map(|[x, z]| DVec3::new(x, 1.4, z)).collect()
}

/// Whatever the turns at the points of a round trailing edge say, affine maps carry the edge along:
/// point by point where the new profile has the old points, and to a tenth of the edge's thickness
/// where it has another number of them.
///
/// Fails if the new profile's own edge always counts, or, of `carried_edge`, `ON_CURVE` is 0: then
/// points of the end are off by as much as it is thick.
#[test]
fn a_round_trailing_edge_goes_along() {
    let stations = |n: usize| (1..n).rev().map(|i| 0.97 * (i as f64 / n as f64).powi(2)).collect::<Vec<f64>>();
    for turns in [&[42.0, 80.0][..], &[38.0, 76.0], &[45.0], &[30.0, 60.0, 85.0]] {
        let old = Profile { number: 0, points: round_edge(turns, &stations(40)) };
        for (height, shear, degrees) in
            [(1.1, 0.0, 0.0), (1.3, 0.0, 5.0), (1.5, 0.0, 0.0), (0.8, 0.0, -10.0), (1.0, 0.3, 0.0)]
        {
            let turn = DMat3::from_rotation_y(f64::to_radians(degrees));
            let map = |at: &DVec3| turn * DVec3::new(at.x + shear * at.z, at.y, height * at.z);
            let image: Vec<DVec3> = old.points.iter().map(map).collect();
            let found = matching::match_points(&old, &Profile { number: 0, points: image.clone() }).unwrap();
            let error = found.iter().zip(&image).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(error < 1e-12, "{turns:?} {height} {shear} {degrees}: {error:e} point by point");
            // Another sampling of the sides, from a point of the upper side on.
            let mut other: Vec<DVec3> = round_edge(turns, &stations(47)).iter().map(map).collect();
            other.pop();
            other.rotate_left(8);
            other.push(other[0]);
            let found = matching::match_points(&old, &Profile { number: 0, points: other }).unwrap();
            let at_end = old.points.iter().zip(found.iter().zip(&image)).filter(|(old, _)| old.x > 0.98);
            let error = at_end.map(|(_, (a, b))| a.distance(*b)).fold(0.0, f64::max);
            assert!(error < 1.2e-3, "{turns:?} {height} {shear} {degrees}: {error:e}");
        }
    }
}

/// Other points of the same round end: the edge is carried to a place between them.
///
/// Fails if, of `carried_edge`, `AT_POINT` is 0.6: then the place is a point of the profile.
#[test]
fn a_round_trailing_edge_goes_between_points() {
    let stations: Vec<f64> = (1..40).rev().map(|i| 0.97 * (f64::from(i) / 40.0).powi(2)).collect();
    let old = Profile { number: 0, points: round_edge(&[34.0], &stations) };
    for turns in [&[25.0, 50.0, 75.0][..], &[30.0, 60.0, 85.0], &[20.0, 45.0, 70.0]] {
        let new = Profile { number: 0, points: round_edge(turns, &stations) };
        let found = matching::match_points(&old, &new).unwrap();
        let at_end = old.points.iter().zip(&found).filter(|(old, _)| old.x > 0.98);
        let error = at_end.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(error < 6e-4, "{turns:?}: {error:e}");
    }
}

/// A new profile with a sharp trailing edge keeps it, whatever the old one's is: the old corners
/// would lie beside the new curve.
///
/// Fails if corners that lie off the new curve are carried too.
#[test]
fn a_sharp_trailing_edge_is_taken() {
    let stations: Vec<f64> = (1..40).rev().map(|i| 0.97 * (f64::from(i) / 40.0).powi(2)).collect();
    let old = Profile { number: 0, points: round_edge(&[34.0], &stations) };
    let upper = stations.iter().map(|&x| DVec3::new(x, 1.4, 0.1 * x.sqrt() * (1.0 - x)));
    let upper: Vec<DVec3> = [DVec3::new(1.0, 1.4, 0.0)].into_iter().chain(upper).collect();
    let lower = upper.iter().rev().map(|at| DVec3::new(at.x, at.y, -at.z));
    let points = upper.iter().copied().chain([DVec3::new(0.0, 1.4, 0.0)]).chain(lower).collect();
    let found = matching::match_points(&old, &Profile { number: 0, points }).unwrap();
    for (old, found) in old.points.iter().zip(&found).filter(|(old, _)| old.x > 0.99) {
        assert!(found.distance(DVec3::new(1.0, 1.4, 0.0)) < 1e-9, "{old} {found}");
    }
}

/// Profiles of a coarse mesh (26 and 31 points) and new ones made from a spline through their moved
/// points: 161 and 121 points, and the moved points themselves for comparison. Along the curve a
/// match is a matter of judgement where the change is not affine; the bounds hold what was measured
/// (7e-4 and 5e-3 of the chord). Across it, the new curve is hit.
///
/// Fails if `CLOSE` is 0.3, `TURNS_BACK` 0, or, of `matching`, `POINT_BY_POINT` 0.01, `STRAIGHT`
/// 0.1, `NOTHING` 0, or `END` 1e-6.
#[test]
fn matching_finds_the_moved_points_of_a_real_section() {
    let read = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/profiles").join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        csv::parse(&[(path.as_path(), &text)]).unwrap()
    };
    let old = read("old_2.csv");
    for (set, along) in [("small_2", 1e-3), ("planform_2", 7.5e-3)] {
        let (new, moved) = (read(&format!("{set}.csv")), read(&format!("{set}_matched.csv")));
        for ((old, new), moved) in old.iter().zip(&new).zip(&moved) {
            let chord = old.points.iter().map(|p| p.distance(old.points[0])).fold(0.0, f64::max);
            let found = matching::match_points(old, new).unwrap();
            let error = found.iter().zip(&moved.points).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / chord;
            assert!(error < along, "{set} {}: {error:e}", old.number);
            assert!(distance::max_distance(&found, &new.points) < 5e-4 * chord);
            // Given point by point, they are taken point by point.
            assert_eq!(matching::match_points(old, moved).unwrap(), moved.points);
        }
    }
}

#[test]
fn distance_is_to_the_segments() {
    let curve = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
    assert_eq!(distance::max_distance(&[DVec3::new(0.5, 0.0, 0.25), DVec3::X], &curve), 0.25);
    assert_eq!(distance::max_distance(&[DVec3::new(3.0, 1.0, 0.0)], &curve), 2.0);
    assert_eq!(distance::max_distance(&[], &curve), 0.0);
    assert!(distance::max_distance(&[DVec3::ZERO], &[]).is_nan());
    assert!(!distance::max_distance(&[DVec3::NAN, DVec3::ZERO], &curve).is_finite());
}
