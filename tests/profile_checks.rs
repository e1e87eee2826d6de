//! Profiles that are refused, and profiles that are just not: a straight wing of chord 1 and span
//! 4, NACA 0012 all along.

#[path = "common/straight_wing.rs"]
mod straight_wing;
#[path = "common/wing.rs"]
mod wing;

use glam::{DMat3, DVec3};
use idmesh::mesh::corners::Face;
use idmesh::profile::{Profile, ProfileError, ProfileInterpolation, WingSurface, compare_sizes};
use straight_wing::{same, wing};
use wing::{Surface, mapped};

fn profiles(te: f64, stations: &[f64]) -> Vec<Profile> {
    straight_wing::profiles(te, stations, same)
}

/// Profiles of which one is changed.
fn with(mut profiles: Vec<Profile>, changed: usize, map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    profiles[changed].points.iter_mut().for_each(|point| *point = map(*point));
    profiles
}

fn old(surface: &Surface, old: &[Profile]) -> Result<(), ProfileError> {
    surface.interpolation(old).map(drop)
}

fn new(old: &[Profile], new: &[Profile]) -> Result<(), ProfileError> {
    wing(0.0, same).loft(old).displacements(new).map(drop)
}

/// An old profile that is shifted by a share of the chord stands off the wing by that share.
///
/// Fails if `OFF_WING` of `checks` is 0.05 or 0.003.
#[test]
fn old_profiles_lie_on_the_wing() {
    let surface = wing(0.0, same);
    let shifted = |by: f64| with(profiles(0.0, &[1.05, 2.95]), 1, |at| at + by * DVec3::Z);
    assert_eq!(old(&surface, &shifted(0.008)), Ok(()));
    let refused = old(&surface, &shifted(0.013));
    assert!(
        matches!(refused, Err(ProfileError::OffWing { profile: 1, share, .. }) if (share - 0.013).abs() < 2e-4),
        "{refused:?}"
    );
}

/// A body cuts the section at the second profile short: it cannot be compared with the wing's own,
/// and the vertices beside the plane decide. Lines between the profiles carry them there, which
/// stand aslant by as much.
///
/// Fails if `OFF_WING` of `accuracy` is 0.3 or 0.003.
#[test]
fn old_profiles_lie_on_what_is_left_of_the_wing() {
    let mut surface = wing(0.0, same);
    let behind = |corner: &u32| surface.vertices[*corner as usize];
    surface.triangles.retain(|corners| {
        !corners.iter().all(|corner| behind(corner).y > 2.85 && behind(corner).x > 0.6 && behind(corner).z < 0.0)
    });
    let shifted = |by: f64| with(profiles(0.0, &[1.05, 2.95]), 1, |at| at + by * DVec3::Z);
    assert_eq!(old(&surface, &shifted(0.024)), Ok(()));
    let refused = old(&surface, &shifted(0.037));
    assert!(
        matches!(refused, Err(ProfileError::OffWing { profile: 1, share, .. }) if (share - 0.037).abs() < 2e-3),
        "{refused:?}"
    );
}

/// Beyond the mirror plane the wing stands 0.7 % of the chord beside its place, or 1.3 %.
///
/// Fails if `OFF_MIRROR` is 0.1 or 0.0001.
#[test]
fn the_mirror_image_lies_on_the_old_profiles() {
    let surface = wing(0.0, same);
    let n = surface.vertices.len() as u32;
    let faces = surface.faces();
    let mirrored: Vec<Face> = faces.iter().map(|face| face.renumbered(|corner| corner + n)).collect();
    let beside = |by: f64| {
        let other = surface.vertices.iter().map(|&at| at + by * DVec3::Z);
        let positions: Vec<DVec3> = surface.vertices.iter().copied().chain(other).collect();
        let normals = [&surface.normals[..], &surface.normals].concat();
        let both = WingSurface {
            positions: &positions,
            normals: &normals,
            faces: &faces,
            mirrored: &mirrored,
            ..WingSurface::default()
        };
        ProfileInterpolation::new(&profiles(0.0, &[1.05, 2.95]), &both).map(drop)
    };
    assert_eq!(beside(0.007), Ok(()));
    let refused = beside(0.013);
    assert!(
        matches!(refused, Err(ProfileError::OffMirror { distance, .. }) if (distance - 0.013).abs() < 2e-4),
        "{refused:?}"
    );
}

const OUTBOARD: [f64; 2] = [1.05, 4.2];

/// A profile outboard of the tip is refused where the loft to it leaves the wing's end by more than
/// a twentieth of the chord. Here it has a camber that the wing has not; the straight way to the
/// profile's plane has covered 0.94 of it at the tip. With a dihedral all the wing but its edges
/// looks along the span a little.
///
/// Fails if `OFF_END` is 0.1 or 0.03, and if `CAP` is 0.05.
#[test]
fn the_loft_to_a_profile_outboard_meets_the_end() {
    let dihedral = |at: DVec3| at + 0.15 * at.y * DVec3::Z;
    for shape in [same as fn(DVec3) -> DVec3, dihedral] {
        let surface = wing(0.0, shape);
        let cambered = |by: f64| {
            let camber = |at: DVec3| at + by * 4.0 * at.x * (1.0 - at.x) * DVec3::Z;
            with(mapped(&profiles(0.0, &OUTBOARD), shape), 1, camber)
        };
        assert_eq!(old(&surface, &cambered(0.045)), Ok(()));
        let refused = old(&surface, &cambered(0.065));
        assert!(matches!(refused, Err(ProfileError::OffWing { profile: 1, .. })), "{refused:?}");
    }
}

/// The end is more than the vertex that is nearest to the profile, and less than what comes half a
/// chord before it.
///
/// Fails if `AT_END` is 0.5 or 0.02.
#[test]
fn the_end_of_a_wing_is_a_tenth_of_a_chord() {
    // The trailing edge ends 0.07 before the leading edge, and the profile is turned about the
    // leading edge by 0.1.
    let slanted = |at: DVec3| if at.y > 3.95 { at - 0.07 * at.x * DVec3::Y } else { at };
    let turned = with(profiles(0.0, &OUTBOARD), 1, |at| at + 0.1 * at.x * DVec3::Z);
    let refused = old(&wing(0.0, slanted), &turned);
    assert!(matches!(refused, Err(ProfileError::OffWing { profile: 1, .. })), "{refused:?}");
    let bump = |at: DVec3| at + 0.1 * f64::max(0.0, 1.0 - 5.0 * (at.y - 3.6).abs()) * DVec3::Z;
    assert_eq!(old(&wing(0.0, bump), &profiles(0.0, &OUTBOARD)), Ok(()));
}

/// A rounded cap stands inside the section: half a section's thickness off it, which is more than a
/// twentieth of the chord.
///
/// Fails if `CAP` is 0.95.
#[test]
fn a_cap_is_not_the_end() {
    let mut surface = wing(0.0, same);
    let rim = surface.vertices.len() as u32 - 80;
    let middle = surface.vertices.len() as u32;
    surface.vertices.push(DVec3::new(0.3, 4.05, 0.0));
    surface.normals.push(DVec3::new(0.6, 0.8, 0.0));
    surface.triangles.extend((0..80).map(|i| [rim + i, rim + (i + 1) % 80, middle]));
    assert_eq!(old(&surface, &profiles(0.0, &OUTBOARD)), Ok(()));
}

/// Profiles that miss the wing and that no unit of length explains are told to miss it.
///
/// Fails if `WING_SIZE` is 300 or 5.
#[test]
fn tiny_profiles_beside_the_wing_are_of_another_unit() {
    let surface = wing(0.0, same);
    let scaled = |by: f64| {
        let small = |at: DVec3| DVec3::new(by * at.x, at.y, by * at.z);
        old(&surface, &mapped(&profiles(0.0, &[4.2, 4.4]), small)).unwrap_err()
    };
    assert!(matches!(scaled(1.0 / 25.0), ProfileError::PlaneMisses { .. }));
    assert!(matches!(scaled(1.0 / 36.0), ProfileError::Size { of: "the wing", .. }));
}

/// Fails if `SAME_PLANE` is 0 or 0.3.
#[test]
fn two_profiles_stand_in_two_planes() {
    let surface = wing(0.0, same);
    assert_eq!(old(&surface, &profiles(0.0, &[1.05, 1.05 + 1e-5])), Ok(()));
    let refused = old(&surface, &profiles(0.0, &[1.05, 1.05 + 1e-7]));
    assert!(matches!(refused, Err(ProfileError::SamePlane { first: 0, second: 1, .. })), "{refused:?}");
}

/// Fails if `SIZE` is 10 or 1.5.
#[test]
fn chords_grow_and_shrink_within_reason() {
    let before = profiles(0.0, &[1.05, 2.95]);
    for grows in [true, false] {
        let scaled = |by: f64| {
            let by = if grows { by } else { by.recip() };
            with(before.clone(), 1, |at| DVec3::new(by * at.x, at.y, by * at.z))
        };
        assert_eq!(new(&before, &scaled(2.2)), Ok(()));
        assert_eq!(compare_sizes(&before, &scaled(2.2)), Ok(()));
        for refused in [new(&before, &scaled(2.8)), compare_sizes(&before, &scaled(2.8))] {
            assert!(matches!(refused, Err(ProfileError::Size { profile: 1, .. })), "{refused:?}");
        }
    }
}

/// Both sections turn about the direction of the chord, by 70 and by 80 degrees.
///
/// Fails if `TURNED` is 0.9 or 0.05.
#[test]
fn planes_turn_by_less_than_75_degrees() {
    let before = profiles(0.0, &[1.05, 2.95]);
    let turned = |degrees: f64| {
        let turn = DMat3::from_rotation_x(degrees.to_radians());
        let about = |at: DVec3| at.y * DVec3::Y + turn * DVec3::new(at.x, 0.0, at.z);
        new(&before, &mapped(&before, about))
    };
    assert_eq!(turned(70.0), Ok(()));
    let refused = turned(80.0);
    assert!(matches!(refused, Err(ProfileError::Turned { profile: 0 })), "{refused:?}");
}

/// The longest way round a section that bulges everywhere goes round a square: four sides over the
/// diagonal are 2.83. A curve that goes round an airfoil twice is 4 chords long.
///
/// Fails if `ROUND` is 10 or 2.7.
#[test]
fn curves_go_round_once() {
    let square = |y: f64| {
        let side = |from: DVec3, to: DVec3| (0..20).map(move |i| from.lerp(to, f64::from(i) / 20.0));
        let corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, z]| DVec3::new(x, y, z));
        corners.windows(2).flat_map(|ends| side(ends[0], ends[1])).chain([corners[0]]).collect::<Vec<_>>()
    };
    let before = [1.05, 2.95].map(square);
    let number = |(i, points): (usize, &Vec<DVec3>)| Profile { number: i as i64, points: points.clone() };
    let before: Vec<Profile> = before.iter().enumerate().map(number).collect();
    let rows: Vec<Vec<DVec3>> = (0..=4).map(|y| square(f64::from(y))[..80].to_vec()).collect();
    let surface = Surface::through(&rows, true);
    let wider = mapped(&before, |at| DVec3::new(at.x, at.y, 1.01 * at.z));
    assert_eq!(surface.loft(&before).displacements(&wider).map(drop), Ok(()));

    let before = profiles(0.0, &[1.05, 2.95]);
    let mut twice = before.clone();
    twice[1].points.extend_from_within(1..);
    let refused = new(&before, &twice);
    assert!(matches!(refused, Err(ProfileError::NotInOrder { profile: 1, .. })), "{refused:?}");
}

/// Both profiles go the same way; the wing measures 4.1.
///
/// Fails if `FAR` of `checks` is 20 or 0.3.
#[test]
fn profiles_stay_near_the_wing() {
    let before = profiles(0.0, &[1.05, 2.95]);
    let shifted = |by: f64| new(&before, &mapped(&before, |at| at + by * DVec3::Z));
    assert_eq!(shifted(7.0), Ok(()));
    let refused = shifted(9.5);
    assert!(matches!(refused, Err(ProfileError::FarAway { profile: 0, .. })), "{refused:?}");
}

/// The inner profile passes the outer one, by 0.3 of the way that was between them, and by 0.7.
///
/// Fails if `PASSED` is 5 or 0.05.
#[test]
fn profiles_change_places_where_one_has_passed_the_other() {
    let before = profiles(0.0, &[1.0, 3.0]);
    let passing = |share: f64| new(&before, &with(before.clone(), 0, |at| at + (2.0 + 2.0 * share) * DVec3::Y));
    assert_eq!(passing(0.3), Ok(()));
    let refused = passing(0.7);
    assert!(matches!(refused, Err(ProfileError::Order { .. })), "{refused:?}");
}

/// A trailing edge 0.3 % thick may become a tenth as thick, not a fortieth; one 0.1 % thick may
/// close.
///
/// Fails if `CLOSED` of `checks` is 0.9 or 0.001, and if `BLUNT` is 0.02 or 1e-5.
#[test]
fn a_blunt_trailing_edge_stays_blunt() {
    let closing = |from: f64, to: f64| {
        let before = profiles(from, &[1.05, 2.95]);
        wing(from, same).loft(&before).displacements(&profiles(to, &[1.05, 2.95])).map(drop)
    };
    assert_eq!(closing(0.003, 0.0003), Ok(()));
    let refused = closing(0.003, 0.000_075);
    assert!(matches!(refused, Err(ProfileError::Sharp { profile: 0, .. })), "{refused:?}");
    assert_eq!(closing(0.001, 0.0), Ok(()));
}
