//! The wing between its profiles: what their change does to its vertices, on analytic wings.

#[path = "common/wing.rs"]
mod wing;

use glam::DVec3;
use idmesh::mover::MISSED;
use idmesh::profile::{Plane, Profile, ProfileError, ProfileInterpolation, WingSurface, cut, distance, matching};
use wing::{BLUNT, CHORD, SHARP, Surface, Wing, affine, mapped, resampled};

/// Greatest difference of the displacement from `map(X) - X` over all wing vertices.
fn worst(surface: &Surface, displacement: &[DVec3], map: impl Fn(DVec3) -> DVec3) -> f64 {
    assert_eq!(surface.vertices.len(), displacement.len());
    let errors = surface.vertices.iter().zip(displacement).map(|(&x, &d)| (map(x) - x).distance(d));
    errors.max_by(f64::total_cmp).unwrap()
}

/// Affine changes are exact to rounding at every vertex, beyond the outermost planes too. 1e-10 of
/// the chord leaves room for the division by the distance of planes that take a third of the span.
const EXACT: f64 = 1e-10 * CHORD;

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

/// A coarse wing with a base of 3 % of the chord gets a bump on its upper side, in closed form.
/// With its base in the family its vertices move as with the base apart, whichever points its
/// profiles start at. At every vertex the bump arrives to 6 % of its height, as near as sections of
/// 17 points can hold it. A section with its edges swapped would lose more than half.
///
/// Fails if the thinner end of a section is its trailing edge.
#[test]
fn a_base_within_the_family_changes_nothing() {
    let height = 0.05;
    let stations = [0.55, 1.4, 2.25, 3.1, 3.9];
    for around in [17, 21, 31] {
        let apart = Wing { te: 0.03, around, rows: 13, twist: [2.0, 0.0], base: false, ..BLUNT };
        // Above the chord line of a section, at a share of the chord from the leading edge.
        let bump = |at: DVec3| {
            let (leading, corners) = (apart.point(0.0, at.y), [-1.0, 1.0].map(|t| apart.point(t, at.y)));
            let chord = 0.5 * (corners[0] + corners[1]) - leading;
            let share = (at - leading).dot(chord) / chord.length_squared();
            let up = if (at - leading).cross(chord).y > 0.0 { -1.0 } else { 1.0 };
            let off = if up > 0.0 { height * (-((share - 0.4) / 0.25).powi(2)).exp() } else { 0.0 };
            at + DVec3::Z * off
        };
        let moved = |wing: Wing, start: usize| {
            let surface = wing.surface();
            let turned = |mut profile: Profile| {
                if wing.base {
                    profile.points.pop();
                    let n = profile.points.len();
                    profile.points.rotate_left(start % n);
                    profile.points.push(profile.points[0]);
                }
                profile
            };
            let old: Vec<Profile> = surface.cut(&stations).into_iter().map(turned).collect();
            let new = mapped(&old, bump);
            (surface.loft(&old).displacements(&new).unwrap().displacement, surface.vertices)
        };
        let (expected, vertices) = moved(apart, 0);
        for start in [0, 5, around / 2, around] {
            let (found, _) = moved(Wing { base: true, ..apart }, start);
            let off = found.iter().zip(&expected).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(off < 1e-3 * height, "{around} points, from point {start}: {off:e}");
        }
        let inside = vertices.iter().zip(&expected).filter(|(at, _)| (0.55..=3.9).contains(&at.y));
        let error = inside.map(|(&at, &d)| (bump(at) - at).distance(d)).fold(0.0, f64::max);
        assert!(error < 0.06 * height, "{around} points: {error:e}");
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

/// Fails if `OVERSHOOT` is 0.001.
#[test]
fn bending_quadratic_along_the_span_is_exact_between_three_planes_and_more() {
    let bend = |p: DVec3| p + DVec3::new(0.01 * p.y * p.y - 0.03 * p.y, 0.0, 0.02 * p.y * p.y + 0.1 * p.x);
    for wing in [BLUNT, SHARP] {
        let surface = wing.surface();
        for stations in [&[0.9, 2.0, 3.3][..], &[0.5, 1.23, 2.1, 2.9, 3.4]] {
            let old = surface.cut(stations);
            let motion = surface.loft(&old).displacements(&mapped(&old, bend)).unwrap();
            let between = stations[0]..=stations[stations.len() - 1];
            for (&at, &d) in surface.vertices.iter().zip(&motion.displacement).filter(|(at, _)| between.contains(&at.y))
            {
                let error = (bend(at) - at).distance(d);
                assert!(error < EXACT, "{error:e} at {at} with {} planes", stations.len());
            }
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
    assert!(motion.span_direction.iter().all(|g| g.distance(DVec3::Y) < 1e-12));
}

/// Fails if `IDENTICAL` is 0.
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

/// A millionth of the chord is a change, though 12 digits are none.
///
/// Fails if `IDENTICAL` is 1e-3.
#[test]
fn a_small_change_is_a_change() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.03, 2.71]);
    let raised = |at: DVec3| at + 1e-6 * CHORD * DVec3::Z;
    let motion = surface.loft(&old).displacements(&mapped(&old, raised)).unwrap();
    assert!(worst(&surface, &motion.displacement, raised) < EXACT);
}

/// A wing 0.5 % thick at its trailing edge is bowed between and beyond its two planes by several
/// times that, so that both sides of the straight loft lie above or below it. The sides move apart
/// at the trailing edge; no vertex there follows the other side.
///
/// Fails if `CLOSED` of `curve` is 1e-2.
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
    // Upper side by +g, lower by -g, g = x (x - c): c such that the lift has no part linear in z,
    // which would act on the bow as well (see the module's note on the trend).
    let [mut above, mut below] = [0.0; 2];
    let points = &old[0].points;
    for (i, (a, b)) in points.iter().zip(points.iter().rev()).enumerate() {
        let around = points[i.saturating_sub(1)].distance(points[(i + 1).min(points.len() - 1)]);
        let (x, half) = (chord_fraction(points, *a), around * (a.z - b.z).abs());
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

/// The moved wing, cut where the profiles are, must lie on them: a change of thickness, camber and
/// twist.
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

/// The span-wise direction of an untwisted wing moved by nothing is the straight line of equal
/// chord fraction.
#[test]
fn generators_follow_the_moved_loft() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.03, 2.71]);
    let motion = surface.loft(&old).displacements(&mapped(&old, affine)).unwrap();
    let columns = BLUNT.around;
    for v in 0..surface.vertices.len() - columns {
        let line = affine(surface.vertices[v + columns]) - affine(surface.vertices[v]);
        // Chord times twist is quadratic along the span, the loft of two planes linear: 0.006 times
        // 2 in slope.
        assert!(motion.span_direction[v].distance(line.normalize()) < 2.5e-2, "{v}");
        assert!((motion.span_direction[v].length() - 1.0).abs() < 1e-12);
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
    let doubled = ProfileInterpolation::new(&new, &WingSurface::default()).unwrap_err();
    assert_eq!(doubled, ProfileError::Doubled { profile: 0 });
    new[1] = Profile { number: 1, ..old[0].clone() };
    assert!(matches!(
        ProfileInterpolation::new(&new, &WingSurface::default()),
        Err(ProfileError::SamePlane { first: 0, second: 1, .. })
    ));
    assert!(matches!(ProfileInterpolation::new(&[], &WingSurface::default()), Err(ProfileError::NoProfiles)));
    assert!(matches!(
        ProfileInterpolation::new(&old, &WingSurface { positions: &[DVec3::ZERO], ..WingSurface::default() }),
        Err(ProfileError::Lengths { .. })
    ));
}

/// Rubbish in: an error or numbers out, never a panic.
///
/// Fails if `BACK` of `curve` is 30.
#[test]
fn degenerate_input_never_panics() {
    let mut state = 1u64;
    let mut random = move |n: u64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) % n
    };
    let (mut errors, mut results) = (0, 0);
    for _ in 0..2000 {
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
        let surface = WingSurface { positions: &positions, normals: &normals, faces: &[], ..WingSurface::default() };
        match ProfileInterpolation::new(&old, &surface).and_then(|loft| loft.displacements(&new)) {
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

/// Rows of vertices in the planes of the profiles are watched as those beside planes are.
#[test]
fn vertices_in_the_planes_are_judged_too() {
    let surface = BLUNT.surface();
    let old = surface.cut(&[1.0, 3.0]);
    let loft = surface.loft(&old);
    let new = mapped(&old, |at| at + 0.1 * DVec3::Z);
    let motion = loft.displacements(&new).unwrap();
    let mut moved: Vec<DVec3> = surface.vertices.iter().zip(&motion.displacement).map(|(v, d)| *v + *d).collect();
    assert!(loft.missed(&new, &motion, &moved).unwrap().iter().all(|missed| missed.share < 1e-9));
    let vertex = surface.vertices.iter().position(|at| at.y == 1.0 && at.z > 0.05).unwrap();
    moved[vertex].z += 0.01 * CHORD;
    let missed = loft.missed(&new, &motion, &moved).unwrap();
    assert!(missed.len() == 2 && missed[0].vertex == vertex && missed[0].share > 5e-3, "{missed:?}");
}

/// A plane passes a round tip, where the vertices beside it are far off the section. A wing that
/// becomes thicker by one factor all along is as asked.
///
/// Fails if the distances of the vertices do not grow with the section: then the wing is off by
/// more than `MISSED` allows.
#[test]
fn a_round_tip_grows_with_its_section() {
    let mut surface = SHARP.surface();
    let middle = |at: DVec3| 0.07 * at.y;
    let round = |at: DVec3| (1.0 - ((at.y - 3.0).max(0.0) / 1.05).powi(2)).sqrt();
    for at in &mut surface.vertices {
        at.z = middle(*at) + (at.z - middle(*at)) * round(*at);
    }
    let old = surface.cut(&[1.0, 2.5, 3.9]);
    let thicker = |at: DVec3| DVec3::new(at.x, at.y, middle(at) + 1.5 * (at.z - middle(at)));
    let loft = surface.loft(&old);
    let new = mapped(&old, thicker);
    let motion = loft.displacements(&new).unwrap();
    let moved: Vec<DVec3> = surface.vertices.iter().zip(&motion.displacement).map(|(v, d)| *v + *d).collect();
    assert!(moved.iter().zip(&surface.vertices).all(|(moved, at)| moved.distance(thicker(*at)) < 1e-6 * CHORD));
    let missed = loft.missed(&new, &motion, &moved).unwrap();
    assert!(missed.iter().all(|missed| missed.share < MISSED), "{missed:?}");
}

/// The wing's own sections, as its vertices say them, to seven digits, and a design made of one of
/// their two forms: that form is turned, and then bulges in the middle.
///
/// - `bulge`: in chords
fn is_compared_with_flat_cuts(flat: bool, bulge: f64) -> bool {
    let surface = BLUNT.surface();
    let stations = [1.1, 2.7];
    let rounded = |p: DVec3| DVec3::from_array(p.to_array().map(|x| format!("{x:.6e}").parse().unwrap()));
    let old = mapped(&surface.cut(&stations), rounded);
    let cuts = stations.map(|y| cut::cut(&surface.vertices, &surface.triangles, &wing::at_y(y)).unwrap());
    let design = |(old, cut): (&Profile, Vec<DVec3>)| {
        let points = if flat { cut } else { surface.cut(&[old.points[0].y]).remove(0).points };
        let le = points.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let chord = points[0].x - le;
        let bump = |p: &DVec3| (-(20.0 * ((p.x - le) / chord - 0.5)).powi(2)).exp();
        let points = points.iter().map(|p| *p + (0.05 * (p.x - le) + bulge * chord * bump(p)) * DVec3::Z).collect();
        Profile { number: old.number, points }
    };
    let new: Vec<Profile> = old.iter().zip(cuts).map(design).collect();
    surface.loft(&old).displacements(&new).unwrap().flat_cuts
}

/// What a bulge alternates by from point to point is the same in both forms; what tells them apart
/// is the facets' sag, 1e-4 chords.
///
/// Fails if `CLEARLY` is 5 or 0.05, and if `SAME_FORM` is 1e-9.
#[test]
fn a_design_is_compared_with_the_form_it_continues() {
    assert!(is_compared_with_flat_cuts(true, 0.0));
    assert!(is_compared_with_flat_cuts(true, 3e-3));
    assert!(!is_compared_with_flat_cuts(false, 0.0));
    assert!(!is_compared_with_flat_cuts(false, 1e-3));
}
