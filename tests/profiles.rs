//! Profiles: cutting, files, matching and interpolation, on analytic wings made here.

use std::path::Path;

use glam::{DMat3, DVec3};
use idmesh::profile::{Plane, Profile, ProfileError, WingLoft, csv, cut, distance, matching, stations};

/// A lofted NACA wing: swept, tapered, twisted, with dihedral.
#[derive(Clone, Copy)]
struct Wing {
    /// Thickness at the trailing edge, in chords; 0 is a sharp one.
    te: f64,
    /// Greatest thickness, in chords.
    thickness: f64,
    /// Points around a section.
    around: usize,
    /// Rows of vertices along the span.
    rows: usize,
    /// Twist at the root and its change to the tip, degrees. With taper it makes the wing leave its loft between planes.
    twist: [f64; 2],
    /// Whether the base of a blunt trailing edge belongs to the wing.
    base: bool,
}

const BLUNT: Wing = Wing { te: 0.015, thickness: 0.12, around: 81, rows: 21, twist: [2.0, -3.0], base: false };
const SHARP: Wing = Wing { te: 0.0, thickness: 0.12, around: 81, rows: 21, twist: [2.0, -3.0], base: false };
const SPAN: f64 = 4.0;
const CHORD: f64 = 2.0;

struct Surface {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<DVec3>,
}

impl Wing {
    /// Section point: `t` from -1 (lower trailing edge) over 0 (leading edge) to 1 (upper trailing edge), at span `y`.
    fn point(&self, t: f64, y: f64) -> DVec3 {
        let f = y / SPAN;
        let chord = CHORD + (0.8 - CHORD) * f;
        let x = t * t;
        let half = 5.0
            * self.thickness
            * (0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4))
            + 0.5 * self.te * x;
        // At t = -1 and 1 the polynomial is zero only to rounding, and a sharp edge is one vertex.
        let half = if self.te == 0.0 && t.abs() == 1.0 { 0.0 } else { half };
        let z = 0.06 * x * (1.0 - x) + half * t.signum();
        let (sin, cos) = (self.twist[0] + self.twist[1] * f).to_radians().sin_cos();
        let (dx, dz) = ((x - 0.25) * chord, z * chord);
        DVec3::new(0.45 * y + 0.25 * chord + dx * cos + dz * sin, y, 0.07 * y - dx * sin + dz * cos)
    }

    fn surface(&self) -> Surface {
        let (n, m) = (self.around, self.rows);
        let mut vertices = Vec::new();
        // The last point of a sharp section is its first.
        let closed = self.te == 0.0 || self.base;
        let columns = if self.te == 0.0 { n - 1 } else { n };
        for j in 0..m {
            let y = SPAN * j as f64 / (m - 1) as f64;
            for i in 0..columns {
                let t = 2.0 * i as f64 / (n - 1) as f64 - 1.0;
                vertices.push(self.point(t, y));
            }
        }
        let at = |i: usize, j: usize| (j * columns + i % columns) as u32;
        let mut triangles = Vec::new();
        for j in 0..m - 1 {
            for i in 0..if closed { columns } else { n - 1 } {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let [a, b, c, d] = corners;
                let halves = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(halves);
            }
        }
        let mut normals = vec![DVec3::ZERO; vertices.len()];
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            triangle.iter().for_each(|&v| normals[v as usize] += (c - a).cross(b - a));
        }
        let mut normals: Vec<DVec3> = normals.into_iter().map(|n| n.normalize_or_zero()).collect();
        if normals[3 * n / 4].z < 0.0 {
            normals.iter_mut().for_each(|n| *n = -*n);
        }
        Surface { vertices, triangles, normals }
    }
}

impl Surface {
    fn cut(&self, stations: &[f64]) -> Vec<Profile> {
        let planes: Vec<(i64, Plane)> = stations.iter().enumerate().map(|(i, &y)| (i as i64, at_y(y))).collect();
        cut::cut_at_planes(&self.vertices, &self.triangles, &planes).unwrap()
    }

    fn edges(&self) -> Vec<[u32; 2]> {
        idmesh::mesh::edges::triangle_edges(self.triangles.iter().copied())
    }

    fn loft(&self, old: &[Profile]) -> WingLoft {
        WingLoft::new(old, &self.vertices, &self.normals, &self.edges()).unwrap()
    }
}

fn at_y(y: f64) -> Plane {
    Plane { point: DVec3::Y * y, normal: DVec3::Y }
}

fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let map = |p: &Profile| Profile { number: p.number, points: p.points.iter().map(|&p| map(p)).collect() };
    profiles.iter().map(map).collect()
}

/// Greatest difference of the displacement from `map(X) - X` over all wing vertices.
fn worst(surface: &Surface, displacement: &[DVec3], map: impl Fn(DVec3) -> DVec3) -> f64 {
    assert_eq!(surface.vertices.len(), displacement.len());
    let errors = surface.vertices.iter().zip(displacement).map(|(&x, &d)| (map(x) - x).distance(d));
    errors.max_by(f64::total_cmp).unwrap()
}

/// A moderate affine map with shear, stretch, rotation and shift, no axis left alone.
fn affine(p: DVec3) -> DVec3 {
    let m = DMat3::from_cols(DVec3::new(1.07, 0.02, -0.03), DVec3::new(0.11, 0.98, 0.09), DVec3::new(0.04, -0.05, 1.4));
    m * p + DVec3::new(0.3, -0.1, 0.2)
}

/// Affine changes are exact to rounding at every vertex, beyond the outermost planes too. 1e-10 of the chord leaves room
/// for the division by the distance of planes that take a third of the span.
const EXACT: f64 = 1e-10 * CHORD;

#[test]
fn a_blunt_section_is_open_and_runs_lower_te_le_upper_te() {
    for y in [0.31, 1.0, 2.0, 3.77] {
        let curve = &BLUNT.surface().cut(&[y])[0].points;
        let (lower, upper) = (BLUNT.point(-1.0, y), BLUNT.point(1.0, y));
        // Between rows the twisted trailing edge is a chord: second derivative 0.006 times (row distance 0.2)^2 / 8.
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

/// Rows of vertices stand exactly at y = 1.0: each vertex of the row appears once, and nothing else but the row.
#[test]
fn a_plane_through_vertices_cuts_them_once() {
    for wing in [BLUNT, SHARP] {
        let curve = &wing.surface().cut(&[1.0])[0].points;
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
    assert!(matches!(cut::cut(&[], &[], &at_y(0.0)), Err(ProfileError::PlaneMisses { .. })));
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
    assert!(matches!(result, Err(ProfileError::Triangle { triangle: 0, vertex: u32::MAX, .. })), "{result:?}");
}

#[test]
fn planes_stand_evenly_or_where_named() {
    let surface = BLUNT.surface();
    let y = |n| -> Vec<f64> {
        let planes = stations::evenly(&surface.vertices, &surface.triangles, n).unwrap();
        assert!(planes.iter().all(|p| p.normal == DVec3::Y));
        planes.iter().map(|p| p.point.y).collect()
    };
    assert!(y(3).iter().zip([0.4, 2.0, 3.6]).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!((y(1)[0] - 2.0).abs() < 1e-12);
    assert_eq!(stations::evenly(&surface.vertices, &surface.triangles, 0), Err(ProfileError::NoProfiles));
    assert_eq!(stations::parse(" y = 1.5 "), Ok(at_y(1.5)));
    for text in ["", "y", "1.5", "w=1", "y=", "y=nan", "y=1,2"] {
        assert_eq!(stations::parse(text), Err(ProfileError::PlaneText { text: text.into() }));
    }
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
    let line = (0..5).map(|i| DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).collect();
    assert_eq!(with(line), ProfileError::OnOneLine { profile: 3 });
}

/// A section of `n` points of the analytic wing, crowded at its ends unlike a cut's.
fn resampled(wing: &Wing, y: f64, n: usize) -> Vec<DVec3> {
    let t = |i: usize| -(std::f64::consts::PI * i as f64 / (n - 1) as f64).cos();
    (0..n).map(|i| wing.point(t(i).clamp(-1.0, 1.0), y)).collect()
}

/// New points are another sampling of the section mapped by a strong affine change (40 % thicker, sheared, rotated): old
/// points must find their images. Fit and match leave 1e-3 of the chord along the curve; across it only the sampling
/// errs, by (1/160)^2 of the section at the nose.
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

/// Profiles of a coarse mesh (26 and 31 points) and new ones made from a spline through their moved points: 161 and 121
/// points, and the moved points themselves for comparison. Along the curve a match is a matter of judgement where the
/// change is not affine; the bounds hold what was measured (7e-4 and 5e-3 of the chord). Across it, the new curve is hit.
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
fn an_affine_change_is_exact_at_every_vertex() {
    for wing in [BLUNT, SHARP, Wing { base: true, te: 0.02, ..BLUNT }] {
        let surface = wing.surface();
        for stations in [&[1.03, 2.71][..], &[0.9, 2.0, 3.3], &[0.5, 1.23, 2.1, 2.9, 3.4]] {
            let old = surface.cut(stations);
            let loft = surface.loft(&old);
            let new = mapped(&old, affine);
            let mut other = new.clone();
            for profile in &mut other {
                profile.points.reverse();
                if wing.te == 0.0 || wing.base {
                    profile.points.pop();
                    profile.points.rotate_left(23);
                    profile.points.push(profile.points[0]);
                }
            }
            other.reverse();
            for new in [new, other] {
                let motion = loft.displacements(&new).unwrap();
                let error = worst(&surface, &motion.displacement, affine);
                assert!(error < EXACT, "{error:e} with {} planes", stations.len());
            }
        }
    }
}

/// The check above must be able to fail: one point of one profile is off.
#[test]
fn the_exactness_check_sees_one_wrong_point() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.03, 2.71]);
    let mut new = mapped(&old, affine);
    new[1].points[20].z += 1e-6;
    let plane = Plane::of_profile(&new[1]);
    assert!(plane.is_ok(), "{plane:?}");
    let motion = surface.loft(&old).displacements(&new).unwrap();
    assert!(worst(&surface, &motion.displacement, affine) > 100.0 * EXACT);
}

#[test]
fn bending_quadratic_along_the_span_is_exact_with_three_planes_and_more() {
    let bend = |p: DVec3| p + DVec3::new(0.01 * p.y * p.y - 0.03 * p.y, 0.0, 0.02 * p.y * p.y + 0.1 * p.x);
    for wing in [BLUNT, SHARP] {
        let surface = wing.surface();
        for stations in [&[0.9, 2.0, 3.3][..], &[0.5, 1.23, 2.1, 2.9, 3.4]] {
            let old = surface.cut(stations);
            let motion = surface.loft(&old).displacements(&mapped(&old, bend)).unwrap();
            let error = worst(&surface, &motion.displacement, bend);
            assert!(error < EXACT, "{error:e} with {} planes", stations.len());
        }
    }
}

/// One plane: the section's own affine change, the same all along the span.
#[test]
fn one_plane_moves_the_whole_span_alike() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[2.0]);
    let map = |p: DVec3| DVec3::new(1.1 * p.x + 0.2 * p.z, p.y, 1.3 * p.z - 0.1);
    let motion = surface.loft(&old).displacements(&mapped(&old, map)).unwrap();
    assert!(worst(&surface, &motion.displacement, map) < EXACT);
    assert!(motion.generator.iter().all(|g| g.distance(DVec3::Y) < 1e-12));
}

#[test]
fn unchanged_profiles_move_nothing_at_all() {
    for wing in [BLUNT, SHARP] {
        let surface = wing.surface();
        let old = surface.cut(&[1.03, 2.0, 2.71]);
        // 12 digits, as files carry them.
        let rounded = mapped(&old, |p| {
            let round = |x: f64| format!("{x:.11e}").parse::<f64>().unwrap();
            DVec3::new(round(p.x), round(p.y), round(p.z))
        });
        let mut reversed = old.clone();
        reversed.iter_mut().for_each(|p| p.points.reverse());
        for new in [old.clone(), rounded, reversed] {
            let motion = surface.loft(&old).displacements(&new).unwrap();
            assert!(motion.displacement.iter().all(|d| *d == DVec3::ZERO));
        }
    }
}

/// A wing 0.5 % thick at its trailing edge is bowed between and beyond its two planes by several times that, so that both
/// sides of the straight loft lie above or below it. The sides move apart at the trailing edge; no vertex there follows
/// the other side.
#[test]
fn the_sides_of_a_thin_wing_do_not_mix() {
    let wing = Wing { te: 0.005, thickness: 0.01, twist: [0.0; 2], ..BLUNT };
    let mut surface = wing.surface();
    surface.vertices.iter_mut().for_each(|v| v.z += 0.02 * (v.y - 1.03) * (v.y - 2.71));
    let old = surface.cut(&[1.03, 2.71]);
    let chord_fraction = |points: &[DVec3], p: DVec3| {
        let le = points.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        (p.x - le) / (points[0].x - le)
    };
    // Upper side by +g, lower by -g, g = x (x - c): c such that the lift has no part linear in z, which would act on the
    // bow as well (see the module's note on the trend).
    let [mut above, mut below] = [0.0; 2];
    let points = &old[0].points;
    for (a, b) in points.iter().zip(points.iter().rev()) {
        let (x, half) = (chord_fraction(points, *a), (a.z - b.z).abs());
        (above, below) = (above + half * x * x, below + half * x);
    }
    let c = above / below;
    let move_apart = |profile: &Profile| {
        let n = profile.points.len();
        let lift = |i: usize, p: DVec3| {
            let x = chord_fraction(&profile.points, p);
            let side = if 2 * i < n { -1.0 } else { 1.0 };
            side * 0.02 * x * (x - c)
        };
        let points = profile.points.iter().enumerate().map(|(i, &p)| p + DVec3::Z * lift(i, p)).collect();
        Profile { number: profile.number, points }
    };
    let new: Vec<Profile> = old.iter().map(move_apart).collect();
    let motion = surface.loft(&old).displacements(&new).unwrap();
    for (v, d) in motion.displacement.iter().enumerate() {
        let t = 2.0 * (v % wing.around) as f64 / (wing.around - 1) as f64 - 1.0;
        let expected = t.signum() * 0.02 * t * t * (t * t - c);
        if t.abs() > 0.9 {
            assert!((d.z - expected).abs() < 0.3 * expected.abs(), "vertex {v} at {t} moves {d}, not {expected}");
        }
    }
}

/// The moved wing, cut where the profiles are, must lie on them: a change of thickness, camber and twist.
#[test]
fn the_moved_wing_passes_through_its_new_profiles() {
    let surface = Wing { around: 161, rows: 41, ..BLUNT }.surface();
    let stations = [1.03, 2.71];
    let old = surface.cut(&stations);
    let thick = Wing { te: 0.02, thickness: 0.17, ..BLUNT };
    let lift = |p: DVec3| p + DVec3::Z * (0.05 * p.y - 0.03 * (p.x - 0.45 * p.y).powi(2));
    let profile = |(i, &y): (usize, &f64)| Profile {
        number: i as i64,
        points: resampled(&thick, y, 201).into_iter().map(lift).collect(),
    };
    let new: Vec<Profile> = stations.iter().enumerate().map(profile).collect();
    let motion = surface.loft(&old).displacements(&new).unwrap();
    let mut moved = surface;
    moved.vertices.iter_mut().zip(&motion.displacement).for_each(|(v, d)| *v += *d);
    for (section, new) in moved.cut(&stations).iter().zip(&new) {
        let off = distance::max_distance(&section.points, &new.points);
        assert!(off < 5e-4 * CHORD, "{off:e}");
    }
}

/// On a coarse wing the vertices alone do not bring the section onto a profile that bends between them.
#[test]
fn facets_of_a_coarse_wing_meet_the_new_profiles() {
    let surface = Wing { around: 41, rows: 6, ..BLUNT }.surface();
    let stations = [1.03, 2.71];
    let old = surface.cut(&stations);
    let thicker = |p: DVec3, middle: f64| DVec3::new(p.x, p.y, p.z + 0.8 * (p.z - middle));
    let bent = |p: DVec3| thicker(p, 0.0) + DVec3::Z * (0.3 * (p.x - 0.45 * p.y - 0.5 * CHORD).powi(2));
    let new = mapped(&old, bent);
    let missed = |edges: &[[u32; 2]]| {
        let loft = WingLoft::new(&old, &surface.vertices, &surface.normals, edges).unwrap();
        let motion = loft.displacements(&new).unwrap();
        let vertices: Vec<DVec3> = surface.vertices.iter().zip(&motion.displacement).map(|(v, d)| *v + *d).collect();
        let moved = Surface { vertices, triangles: surface.triangles.clone(), normals: Vec::new() };
        let off = |(section, new): (&Profile, &Profile)| distance::max_distance(&section.points, &new.points);
        moved.cut(&stations).iter().zip(&new).map(off).fold(0.0, f64::max)
    };
    let (vertices_only, with_facets) = (missed(&[]), missed(&surface.edges()));
    assert!(vertices_only > 1e-3 * CHORD, "{vertices_only:e}: the case is too easy to show anything");
    assert!(with_facets < 6e-4 * CHORD, "{with_facets:e}");
}

#[test]
fn a_profile_that_crosses_itself_is_refused() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.0, 2.0]);
    let mut new = old.clone();
    let n = new[1].points.len();
    // A point of the upper side, well before the trailing edge, drops below the lower one.
    new[1].points[n - n / 8].z -= 0.2 * CHORD;
    let refused = surface.loft(&old).displacements(&new);
    assert!(matches!(refused, Err(ProfileError::CrossesItself { profile: 1, .. })), "{refused:?}");
}

/// The generator of an untwisted wing moved by nothing is the straight line of equal chord fraction.
#[test]
fn generators_follow_the_moved_loft() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.03, 2.71]);
    let motion = surface.loft(&old).displacements(&mapped(&old, affine)).unwrap();
    let columns = BLUNT.around;
    for v in 0..surface.vertices.len() - columns {
        let line = affine(surface.vertices[v + columns]) - affine(surface.vertices[v]);
        // Chord times twist is quadratic along the span, the loft of two planes linear: 0.006 times 2 in slope.
        assert!(motion.generator[v].distance(line.normalize()) < 2.5e-2, "{v}");
        assert!((motion.generator[v].length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn numbers_must_agree() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.0, 2.0]);
    let loft = surface.loft(&old);
    let mut new = old.clone();
    new[1].number = 5;
    let expected = ProfileError::Numbers { old: vec![0, 1], new: vec![0, 5] };
    assert_eq!(loft.displacements(&new), Err(expected));
    assert_eq!(loft.displacements(&old[..1]), Err(ProfileError::Numbers { old: vec![0, 1], new: vec![0] }));
    new[1].number = 0;
    assert_eq!(loft.displacements(&new), Err(ProfileError::Doubled { profile: 0 }));
    let doubled = WingLoft::new(&new, &[], &[], &[]).unwrap_err();
    assert_eq!(doubled, ProfileError::Doubled { profile: 0 });
    new[1] = Profile { number: 1, ..old[0].clone() };
    assert!(matches!(WingLoft::new(&new, &[], &[], &[]), Err(ProfileError::SamePlane { first: 0, second: 1, .. })));
    assert!(matches!(WingLoft::new(&[], &[], &[], &[]), Err(ProfileError::NoProfiles)));
    assert!(matches!(WingLoft::new(&old, &[DVec3::ZERO], &[], &[]), Err(ProfileError::Lengths { .. })));
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

/// Rubbish in: an error or numbers out, never a panic.
#[test]
fn degenerate_input_never_panics() {
    let mut state = 1u64;
    let mut random = move |n: u64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) % n
    };
    let (mut errors, mut results) = (0, 0);
    for _ in 0..400 {
        // Few different values, so that points coincide, line up and lie in planes.
        let coordinate = |r: u64| [0.0, 1.0, -1.0, 2.0, 1e-12, 0.5, 1e8, 1e-300][r as usize];
        let mut profiles = |n_planes: u64| -> Vec<Profile> {
            // In order round the origin few curves cross themselves, in any order nearly all do.
            let (closed, tidy, kinds) = (random(2) == 0, random(4) > 0, 1 + random(8));
            (0..n_planes)
                .map(|k| {
                    let n = 3 + random(9);
                    let mut points: Vec<DVec3> = (0..n)
                        .map(|_| DVec3::new(coordinate(random(kinds)), k as f64, coordinate(random(kinds))))
                        .collect();
                    if tidy {
                        points.sort_by(|p, q| p.z.atan2(p.x).total_cmp(&q.z.atan2(q.x)));
                    }
                    if closed {
                        points.push(points[0]);
                    }
                    Profile { number: k as i64, points }
                })
                .collect()
        };
        let (old, new) = (profiles(3), profiles(3));
        let positions: Vec<DVec3> = old.iter().chain(&new).flat_map(|p| p.points.clone()).collect();
        let normals = vec![DVec3::Z; positions.len()];
        match WingLoft::new(&old, &positions, &normals, &[]).and_then(|loft| loft.displacements(&new)) {
            Ok(motion) => {
                results += 1;
                assert_eq!(motion.displacement.len(), positions.len());
                assert!(motion.displacement.iter().all(|d| d.is_finite()), "{old:?}\n{new:?}");
            }
            Err(_) => errors += 1,
        }
        let triangles: Vec<[u32; 3]> = (0..20).map(|_| [0; 3].map(|_: u32| random(12) as u32)).collect();
        let plane = Plane { point: DVec3::ZERO, normal: [DVec3::X, DVec3::Y, DVec3::Z][random(3) as usize] };
        let _ = cut::cut(&positions, &triangles, &plane);
        let _ = matching::match_points(&old[0], &new[0]);
    }
    assert!(errors > 20 && results > 20, "{errors} {results}");
}
