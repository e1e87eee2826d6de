//! New profiles that may not be what was meant: those that are refused, those that get a remark,
//! and those that are just not odd. The wing is straight, of chord 1 and span 4, with NACA 0012 all
//! along.

#[path = "common/straight_wing.rs"]
mod straight_wing;
#[path = "common/wing.rs"]
mod wing;

use glam::{DMat3, DVec3};
use idmesh::profile::{Profile, ProfileError, Remark};
use straight_wing::{profiles, same, wing};
use wing::{Surface, mapped};

const TWO: [f64; 2] = [1.05, 2.95];
const SHARP: f64 = 0.0;
const BLUNT: f64 = 0.01;

/// What is said of new profiles, which a map makes of the old ones.
fn said(te: f64, stations: &[f64], shape: fn(DVec3) -> DVec3, map: impl Fn(DVec3) -> DVec3) -> Said {
    let old = profiles(te, stations, shape);
    of(&wing(te, shape), &old, &mapped(&old, map))
}

type Said = Result<Vec<Remark>, ProfileError>;

fn of(surface: &Surface, old: &[Profile], new: &[Profile]) -> Said {
    surface.loft(old).displacements(new).map(|displacement| displacement.remarks)
}

/// A turn about the quarter chord, nose up, in degrees.
fn turned(degrees: f64) -> impl Fn(DVec3) -> DVec3 {
    let quarter = DVec3::new(0.25, 0.0, 0.0);
    let turn = DMat3::from_rotation_y(degrees.to_radians());
    move |at| quarter + turn * (at - quarter)
}

/// Leading and trailing edge change places.
fn swapped(at: DVec3) -> DVec3 {
    DVec3::new(1.0 - at.x, at.y, at.z)
}

/// A camber line of 2 % of the chord.
fn cambered(at: DVec3) -> DVec3 {
    at + 0.08 * at.x * (1.0 - at.x) * DVec3::Z
}

/// A turn is legal as far as it goes, and beyond 120 degrees it is told. A symmetric section whose
/// edges are swapped is the section turned by 180 degrees, point for point.
///
/// Fails if `REVERSED` is 100 or 150.
#[test]
fn a_section_that_points_the_other_way_is_told() {
    for te in [SHARP, BLUNT] {
        for degrees in [-115.0, 20.0, 115.0] {
            assert_eq!(said(te, &TWO, same, turned(degrees)), Ok(vec![]), "{degrees}");
        }
        let told = |said: Said, expected: f64| {
            let remarks = said.unwrap();
            assert_eq!(remarks.len(), 2, "{remarks:?}");
            for (number, remark) in (0..).zip(remarks) {
                let Remark::Reversed { profile, degrees } = remark else { panic!("{remark:?}") };
                assert!(profile == number && (degrees - expected).abs() < 1e-6, "{remark:?}");
                let text = remark.to_string();
                assert!(text.contains("turned over") && text.contains("swapped"), "{text}");
            }
        };
        told(said(te, &TWO, same, turned(125.0)), 125.0);
        told(said(te, &TWO, same, turned(-170.0)), 170.0);
        told(said(te, &TWO, same, swapped), 180.0);
    }
}

/// A cambered section in a mirror has its camber line on the other side of its chord, as seen from
/// its own leading edge. A turned section has not.
///
/// Fails if `OPPOSITE` is -1 or 0.1, or `CAMBERED` is 0.02 or 0.
#[test]
fn a_cambered_section_in_a_mirror_is_refused() {
    for te in [SHARP, BLUNT] {
        let refused = said(te, &TWO, cambered, swapped);
        assert_eq!(refused, Err(ProfileError::Swapped { profile: 0 }));
        // Thicker and less cambered too.
        let changed = |at: DVec3| swapped(DVec3::new(at.x, at.y, 1.3 * at.z) - 0.25 * (cambered(at) - at));
        assert_eq!(said(te, &TWO, cambered, changed), Err(ProfileError::Swapped { profile: 0 }));
        assert_eq!(said(te, &TWO, cambered, turned(180.0)).unwrap().len(), 2);
        // The camber line of a symmetric section is noise.
        let noise = |at: DVec3| at + 1e-3 * at.x * (1.0 - at.x) * DVec3::Z;
        assert_eq!(said(te, &TWO, noise, swapped).unwrap().len(), 2);
        // A turned section may get another camber line: here an S.
        let reflexed = |at: DVec3| at + 0.3 * at.x * (1.0 - at.x) * (0.5 - at.x) * DVec3::Z;
        let turned_and_reflexed = |at: DVec3| turned(180.0)(reflexed(at - (cambered(at) - at)));
        assert_eq!(said(te, &TWO, cambered, turned_and_reflexed).unwrap().len(), 2);
    }
    // An open section that begins at its leading edge, on a blunt wing, from one point there and
    // from two.
    let from_nose = |profile: Profile, repeats: usize| {
        let (lower, upper) = profile.points.split_at(40);
        let nose = upper[..repeats].iter().map(|&at| at - 1e-7 * DVec3::Z);
        Profile { points: upper.iter().chain(lower).copied().chain(nose).collect(), ..profile }
    };
    for shape in [same as fn(DVec3) -> DVec3, cambered] {
        let old = profiles(BLUNT, &TWO, shape);
        for repeats in [0, 1] {
            let new: Vec<Profile> = old.iter().cloned().map(|profile| from_nose(profile, repeats)).collect();
            assert_eq!(of(&wing(BLUNT, shape), &old, &new), Err(ProfileError::Swapped { profile: 0 }), "{repeats}");
        }
    }
    // The camber may change its sign, as long as the section does not turn over.
    assert_eq!(said(SHARP, &TWO, cambered, |at| at - 2.0 * (cambered(at) - at)), Ok(vec![]));
}

/// Two new profiles in one plane, straight or aslant, side by side or with another between them.
///
/// Fails if `SAME_PLANE` of `checks` is 1e-3 or 0.
#[test]
fn new_profiles_lie_in_planes_of_their_own() {
    let surface = wing(SHARP, same);
    let aslant = |at: DVec3| DMat3::from_rotation_z(0.3) * at;
    for map in [same as fn(DVec3) -> DVec3, aslant] {
        let new = |stations: &[f64]| profiles(SHARP, stations, |at| at + 1e-2 * at.y * DVec3::X);
        let placed = |stations: &[f64]| mapped(&new(stations), map);
        let refused = of(&surface, &profiles(SHARP, &TWO, same), &placed(&[1.05, 1.05]));
        assert_eq!(refused, Err(ProfileError::OnePlane { first: 0, second: 1 }));
        let three = profiles(SHARP, &[0.55, 1.55, 3.05], same);
        let refused = of(&surface, &three, &placed(&[1.5, 2.0, 1.5]));
        assert_eq!(refused, Err(ProfileError::OnePlane { first: 0, second: 2 }));
        assert!(of(&surface, &profiles(SHARP, &TWO, same), &placed(&[1.05, 1.0501])).is_ok());
    }
}

/// A section may move along the span by a tenth of the span that the sections cover, and of the
/// wing's span if it is the only one.
///
/// Fails if `ALONG` is 0.05 or 0.2.
#[test]
fn a_changed_span_is_told() {
    let surface = wing(SHARP, same);
    let shifted = |stations: &[f64], changed: usize, by: f64| {
        let old = profiles(SHARP, stations, same);
        let mut new = old.clone();
        new[changed].points.iter_mut().for_each(|at| at.y += by);
        of(&surface, &old, &new)
    };
    let told = |said: Said, profile: i64, expected: [f64; 2]| {
        let remarks = said.unwrap();
        let [Remark::AlongSpan { profile: of, places, wing }] = remarks[..] else { panic!("{remarks:?}") };
        assert!(
            of == profile
                && (DVec3::from((places[0], places[1], 0.0)) - DVec3::from((expected[0], expected[1], 0.0))).length()
                    < 1e-9
        );
        assert!(wing[0].abs() < 1e-9 && (wing[1] - 4.0).abs() < 1e-9, "{wing:?}");
    };
    assert_eq!(shifted(&TWO, 1, 0.18), Ok(vec![]));
    assert_eq!(shifted(&TWO, 1, -0.18), Ok(vec![]));
    told(shifted(&TWO, 1, 0.2), 1, [2.95, 3.15]);
    told(shifted(&TWO, 1, 1.3), 1, [2.95, 4.25]);
    told(shifted(&TWO, 0, 0.2), 0, [1.05, 1.25]);
    assert_eq!(shifted(&[2.05], 0, 0.38), Ok(vec![]));
    told(shifted(&[2.05], 0, -0.42), 0, [2.05, 1.63]);
    // The whole wing: no section is nearer to another one.
    let both = said(SHARP, &TWO, same, |at| at + 0.2 * DVec3::Y);
    assert!(matches!(both.as_deref(), Ok([Remark::AlongSpan { .. }])), "{both:?}");
    // A wing that bends, turns and is swept keeps its span.
    let bent = |at: DVec3| turned(40.0)(at) + 0.05 * at.y * at.y * DVec3::Z + 0.5 * at.y * DVec3::X;
    assert_eq!(said(SHARP, &TWO, same, bent), Ok(vec![]));
}

/// Of sections side by side one may move by half their distance more than the other.
///
/// Fails if `STRETCHED` is 0.4 or 0.6.
#[test]
fn a_section_near_its_neighbour_is_told() {
    let stations = [0.55, 1.05, 1.55, 2.05, 2.55, 3.05, 3.55];
    let surface = wing(SHARP, same);
    let old = profiles(SHARP, &stations, same);
    let shifted = |by: f64| {
        let mut new = old.clone();
        new[3].points.iter_mut().for_each(|at| at.y += by);
        of(&surface, &old, &new)
    };
    assert_eq!(shifted(0.24), Ok(vec![]));
    let near = shifted(0.26);
    assert!(matches!(near.as_deref(), Ok([Remark::AlongSpan { profile: 3, .. }])), "{near:?}");
}

/// The new profiles with another thickness at the trailing edge.
fn with_edge(old: f64, new: f64) -> Said {
    of(&wing(old, same), &profiles(old, &TWO, same), &profiles(new, &TWO, same))
}

/// Fails if `THIN` is 0.3 or 0.4, or `OPEN` is 2e-3 or 1e-4.
#[test]
fn trailing_edges_of_another_thickness_are_told() {
    assert_eq!(with_edge(BLUNT, 0.0036), Ok(vec![]));
    assert_eq!(with_edge(BLUNT, 0.03), Ok(vec![]));
    let thin = with_edge(BLUNT, 0.0031).unwrap();
    let [Remark::Thin { profile: 0, old, new }, Remark::Thin { profile: 1, .. }] = thin[..] else { panic!("{thin:?}") };
    assert!((old - 0.01).abs() < 1e-9 && (new - 0.0031).abs() < 1e-9, "{thin:?}");
    let closed = with_edge(BLUNT, SHARP).unwrap_err();
    assert!(closed.to_string().contains("open the new profile to about the old thickness"), "{closed}");

    assert_eq!(with_edge(SHARP, 0.0005), Ok(vec![]));
    let open = with_edge(SHARP, 0.0015).unwrap();
    let [Remark::Open { profile: 0, gap }, Remark::Open { profile: 1, .. }] = open[..] else { panic!("{open:?}") };
    assert!((gap - 0.0015).abs() < 1e-9, "{open:?}");
}

/// One side of the section lacks its last points, or its base stands aslant.
///
/// Fails if `LACKS` is 0.01 or 0.03, or `LACKS_AT_SHARP` is 0.003 or 0.007.
#[test]
fn a_side_without_its_last_points_is_refused() {
    let lacking = |te: f64, new_te: f64, n: usize| {
        let mut new = profiles(new_te, &TWO, same);
        let points = new[1].points.len();
        new[1].points.truncate(points - n);
        of(&wing(te, same), &profiles(te, &TWO, same), &new)
    };
    for (te, new_te) in [(BLUNT, BLUNT), (BLUNT, 0.02), (SHARP, SHARP), (SHARP, 0.002)] {
        for n in [1, 2] {
            let refused = lacking(te, new_te, n);
            // The points of the airfoil stand at the squares of n/40.
            let x = ((40.0 - n as f64) / 40.0).powi(2);
            let Err(ProfileError::LacksPoints { profile: 1, at, share, sharp }) = refused else {
                panic!("{refused:?}")
            };
            assert!(at.x == x && (share - (1.0 - x)).abs() < 0.01 && sharp == (te == SHARP), "{at} {share}");
        }
    }
    let aslant = |te: f64, new_te: f64, by: f64| {
        let corner = |at: DVec3| if at.x == 1.0 && at.z > 0.0 { at - by * DVec3::X } else { at };
        of(&wing(te, same), &profiles(te, &TWO, same), &profiles(new_te, &TWO, corner))
    };
    assert_eq!(aslant(BLUNT, BLUNT, 0.027), Ok(vec![]));
    assert!(matches!(aslant(BLUNT, BLUNT, 0.033), Err(ProfileError::LacksPoints { profile: 0, .. })));
    assert!(aslant(SHARP, 0.002, 0.006).is_ok());
    assert!(matches!(aslant(SHARP, 0.002, 0.008), Err(ProfileError::LacksPoints { profile: 0, .. })));
}

/// One profile moves the span of a straight wing as it should, and shifts any wing. A swept wing
/// gets another sweep where the only profile grows.
///
/// Fails if `SAME_ALONG` is 1 or 1e-4, `NEAR_PLANE` is 0 or 1, or `SHIFT` is 0.
#[test]
fn one_profile_alone_is_told() {
    let grown = |at: DVec3| DVec3::new(1.2 * at.x, at.y, 1.2 * at.z);
    let swept = |at: DVec3| at + 0.5 * at.y * DVec3::X;
    assert_eq!(said(SHARP, &[2.05], same, grown), Ok(vec![]));
    assert_eq!(said(SHARP, &[2.05], |at| at + 0.005 * at.y * DVec3::X, grown), Ok(vec![]));
    assert_eq!(said(SHARP, &[2.05], swept, |at| at + DVec3::new(0.3, 0.1, 0.2)), Ok(vec![]));
    assert_eq!(said(SHARP, &TWO, swept, grown), Ok(vec![]));
    for shape in [
        swept as fn(DVec3) -> DVec3,
        |at| at + 0.1 * at.y * DVec3::Z,
        |at| DVec3::new((1.2 - 0.2 * at.y) * at.x, at.y, (1.2 - 0.2 * at.y) * at.z),
    ] {
        for change in [grown as fn(DVec3) -> DVec3, |at| DVec3::new(at.x, at.y, 1.1 * at.z)] {
            let alone = said(SHARP, &[2.05], shape, change).unwrap();
            let [Remark::Alone { profile: 0, reach, .. }] = alone[..] else { panic!("{alone:?}") };
            assert!((reach - 2.05).abs() < 1e-9, "{reach}");
        }
    }
    // The wing ends 0.8 of the profile's length beyond its plane, and 0.4.
    for (span, n) in [(0.4, 1), (0.2, 0)] {
        let narrow = |at: DVec3| DVec3::new(at.x, span * at.y, at.z);
        let shape = |at: DVec3| narrow(at) + 0.5 * at.y * DVec3::X;
        let old = profiles(SHARP, &[2.0], shape);
        let told = of(&wing(SHARP, shape), &old, &mapped(&old, grown)).unwrap();
        assert_eq!(told.len(), n, "{told:?}");
    }
}
