use std::f64::consts::PI;

use super::*;

/// Half a circle of radius 1, through `n` points at equal distances.
fn half_circle(n: usize) -> Vec<DVec3> {
    let at = |i: usize| PI * i as f64 / (n - 1) as f64;
    (0..n).map(|i| DVec3::new(at(i).cos(), 0.0, at(i).sin())).collect()
}

/// How far a curve's steps, and the middles between them, lie off the unit circle.
fn off_circle(path: &[DVec3]) -> f64 {
    let middles = path.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0);
    path.iter().copied().chain(middles).map(|at| (at.length() - 1.0).abs()).fold(0.0, f64::max)
}

/// Between 33 points the spline is off by 3e-7, but for its ends, where it runs straight. A chord
/// over a step of `h` lies `h^2 / 8` inside the circle: 1e-6 with 1024 steps, 8e-5 with four a
/// piece.
///
/// Fails if `STEPS` is 64, and if `STEPS_PER_PIECE` is (1, 2).
#[test]
fn steps_follow_a_circle() {
    let path = ProfileCurve::new(&half_circle(33)).path;
    let n = path.len();
    assert!(off_circle(&path[n / 4..3 * n / 4]) < 1e-5);
}

/// Between two sides of length 100 a nose of radius 1 has 17 points. Each of its pieces gets four
/// steps: a chord over a quarter of a piece lies 3e-4 inside the circle, and over a whole piece
/// 5e-3.
///
/// Fails if `STEPS_PER_PIECE` begins with 1, and if `LEAST_STEPS_OF_ALL` is 0.
#[test]
fn steps_follow_a_short_nose() {
    let side = |z: f64| (1..=100).map(move |i| DVec3::new(0.0, 0.0, z) - DVec3::X * f64::from(i));
    let nose = (0..17).map(|i| PI * (f64::from(i) / 16.0 - 0.5)).map(|at| DVec3::new(at.cos(), 0.0, at.sin()));
    let points: Vec<DVec3> = side(-1.0).collect::<Vec<_>>().into_iter().rev().chain(nose).chain(side(1.0)).collect();
    let path = ProfileCurve::new(&points).path;
    let nose: Vec<DVec3> = path.into_iter().filter(|at| at.x > 0.3).collect();
    assert!(off_circle(&nose) < 2e-3, "{}", off_circle(&nose));
}

/// Where the points are closer together than the steps need be, each piece is one step.
///
/// Fails if `LEAST_STEPS_OF_ALL` is eight times `STEPS`.
#[test]
fn many_points_need_no_more_steps() {
    let path = ProfileCurve::new(&half_circle(5000)).path;
    assert_eq!(path.len(), 5000);
}

/// A plane that passes near a vertex cuts two points that are a hundredth of the spacing apart, one
/// of them off by half as much.
///
/// Fails if `CLOSE` is 0.001.
#[test]
fn a_point_close_to_another_one_bends_no_curve() {
    let mut points = half_circle(33);
    let spacing = PI / 32.0;
    let beside = DVec3::new((16.01 * spacing).cos(), 0.0, (16.01 * spacing).sin());
    points.insert(17, beside * (1.0 - 0.005 * spacing));
    let off = off_circle(&ProfileCurve::new(&points).path);
    assert!(off < 0.006 * spacing, "{off:e}");
}

/// The nose of a wedge turns by 120 degrees: it is a corner, and the sides stay straight.
///
/// Fails if `CORNER` is 170.
#[test]
fn a_corner_stays_a_corner() {
    let side = |i: i32| DVec3::new(f64::from(i.abs()), 0.0, f64::from(i) / 3f64.sqrt());
    let points: Vec<DVec3> = (-5..=5).map(side).collect();
    let path = ProfileCurve::new(&points).path;
    assert!(path.iter().all(|at| (at.z.abs() - at.x / 3f64.sqrt()).abs() < 1e-12));
}

/// Points that are sorted by a coordinate jump from side to side.
///
/// Fails if `BACK` is 175 or `TURNS_BACK` is 30, and if `TURNS_BACK` is 0.
#[test]
fn points_that_jump_back_and_forth_are_in_no_order() {
    // From side to side by 0.4 and on by 0.1: turns of 152 degrees.
    let zigzag: Vec<DVec3> = (0..8).map(|i| DVec3::new(0.1 * f64::from(i), 0.0, 0.4 * f64::from(i % 2))).collect();
    assert_eq!(disorder(&zigzag), Some(zigzag[1]));
    // Begun at the leading edge, a closed section turns back at its trailing edge.
    let wedge: Vec<DVec3> =
        [(0.0, 0.0), (0.5, -0.05), (1.0, 0.0), (0.5, 0.05), (0.0, 0.0)].map(|(x, z)| DVec3::new(x, 0.0, z)).to_vec();
    assert_eq!(disorder(&wedge), None);
}

/// The last point repeats the first to the digits of a file.
///
/// Fails if `CLOSED` is 0, and if it is 0.01: a trailing edge half a percent thick is blunt.
#[test]
fn a_section_is_closed_to_the_digits_of_a_file() {
    let plane = Plane { point: DVec3::ZERO, normal: DVec3::Y };
    let joined = |gap: f64| {
        let half =
            |i: i32| f64::from(i.signum()) * (0.1 * (1.0 - (f64::from(i.abs()) / 5.0 - 1.0).powi(2)) + gap / 2.0);
        let points = (-10..=10).map(|i: i32| DVec3::new(f64::from(i.abs()) / 10.0, 0.0, half(i))).collect();
        Outline::towards(&Profile { number: 0, points }, &plane, None).unwrap().joined
    };
    assert!(joined(1e-12));
    assert!(!joined(0.005));
}

/// The lower side of a blunt section ends `by` before the upper one; the base is 0.01 thick.
///
/// Fails if `BEHIND` is 2 or 0.001.
#[test]
fn an_open_curve_ends_at_the_trailing_edge_on_both_sides() {
    let section = |by: f64| {
        [(1.0 - by, -0.005), (0.5, -0.06), (0.1, -0.05), (0.0, 0.0), (0.1, 0.05), (0.5, 0.06), (1.0, 0.005)]
            .map(|(x, z)| DVec3::new(x, 0.0, z))
    };
    assert_eq!(short_end(&section(0.05)), None);
    assert_eq!(short_end(&section(0.2)), Some(section(0.2)[0]));
}

/// Curves of a few points of a lattice, with many equal and many short distances: the queue removes
/// the points that a look at all pairs removes, one after another.
#[test]
fn the_queue_removes_what_a_look_at_all_pairs_removes() {
    let mut state = 3_u64;
    let mut any = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) % below
    };
    let mut n_removed = 0;
    for n in (2..40).cycle().take(3000) {
        let mut at = DVec3::ZERO;
        let step = |at: &mut DVec3, length: f64, axis: u64| {
            *at += if axis == 0 { DVec3::X } else { DVec3::Z } * length;
            *at
        };
        let points: Vec<DVec3> =
            (0..n).map(|_| step(&mut at, [1.0, 1.0, 0.02, 0.01, 0.0][any(5) as usize], any(2))).collect();
        let gap = |a: usize, b: usize| points[a].distance(points[b]);
        let around = |i: usize| (i.saturating_sub(2)..(i + 2).min(n - 1)).map(|k| gap(k, k + 1)).fold(0.0, f64::max);
        let share = |a: usize, b: usize| if gap(a, b) > 0.0 { gap(a, b) / around(a).max(around(b)) } else { 0.0 };
        let mut left: Vec<usize> = (0..n).collect();
        while left.len() > 2 {
            let pairs = (1..left.len()).map(|k| (share(left[k - 1], left[k]), k));
            let (closest, k) = pairs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            if closest >= CLOSE {
                break;
            }
            let before = if k >= 2 { gap(left[k - 2], left[k - 1]) } else { f64::INFINITY };
            let after = if k + 1 < left.len() { gap(left[k], left[k + 1]) } else { f64::INFINITY };
            left.remove(if before < after { k - 1 } else { k });
            n_removed += 1;
        }
        assert_eq!(choose_knots(&points), left, "{points:?}");
    }
    assert!(n_removed > 1000, "{n_removed}");
}

/// A slab of length 1 whose front leans forward at the top by `lean`, through its corners alone.
fn slab(lean: f64, n: usize) -> Measured {
    let corners = [[1.0, -0.2], [0.0, -0.2], [-lean, 0.2], [1.0, 0.2]].map(|[x, z]| DVec3::new(x, 0.0, z));
    let steps = corners.windows(2).flat_map(|ends| (0..n).map(move |i| ends[0].lerp(ends[1], i as f64 / n as f64)));
    Measured::sides(steps.chain([corners[3]]).collect())
}

/// Both corners of a slab's front are farthest from its trailing edge. Its leading edge lies
/// between them, whatever rounding says, and goes on continuously to the corner that becomes the
/// farthest.
///
/// Fails if `AS_FAR` is 0.
#[test]
fn a_slab_has_its_leading_edge_between_its_corners() {
    let at = |lean: f64| slab(lean, 100).point(1.0);
    for lean in [0.0, 1e-15, -1e-15] {
        assert!(at(lean).distance(DVec3::ZERO) < 1e-9, "{}", at(lean));
    }
    let heights: Vec<f64> = (0..=100).map(|i| at(i as f64 * 1e-3).z).collect();
    assert!(heights.windows(2).all(|pair| pair[1] >= pair[0] - 1e-12 && pair[1] - pair[0] < 0.02), "{heights:?}");
    assert!(heights[100] > 0.19, "{}", heights[100]);
}
