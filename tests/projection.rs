//! Closest points against brute force, and the continuation of surfaces across holes.

use glam::{DMat3, DVec3};
use idmesh::projection::{TargetSurface, TriangleTree, continuation};

/// A part of the cylinder of radius 1 around x, `y > 0`, of `n` by `n` quads, without those whose centre `hole` takes.
fn cylinder(n: usize, hole: impl Fn(f64, f64) -> bool) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let at = |i: usize, j: usize| (2.0 * i as f64 / n as f64 - 1.0, 1.2 * (2.0 * j as f64 / n as f64 - 1.0));
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            let (x, angle) = at(i, j);
            points.push(DVec3::new(x, angle.cos(), angle.sin()));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let ((x0, a0), (x1, a1)) = (at(i, j), at(i + 1, j + 1));
            if !hole(0.5 * (x0 + x1), 0.5 * (a0 + a1)) {
                let corner = |i: usize, j: usize| (i * (n + 1) + j) as u32;
                let (a, b, c, d) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
                triangles.extend([[a, c, b], [a, d, c]]);
            }
        }
    }
    (points, triangles)
}

/// The rim of a rectangular hole, in order.
fn rim(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let directed: std::collections::HashSet<(u32, u32)> =
        triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    let outer = |v: u32| points[v as usize].x.abs() > 0.999 || points[v as usize].y < 1.2f64.cos() + 1e-9;
    let on_outer_rim = |&(a, b): &(u32, u32)| outer(a) && outer(b);
    let open: std::collections::HashMap<u32, u32> = directed
        .iter()
        .copied()
        .filter(|&(a, b)| !directed.contains(&(b, a)))
        .filter(|edge| !on_outer_rim(edge))
        .collect();
    let start = *open.keys().min().unwrap();
    let mut walk = vec![start];
    while open[walk.last().unwrap()] != start {
        walk.push(open[walk.last().unwrap()]);
    }
    walk
}

fn brute_force(points: &[DVec3], triangles: &[[u32; 3]], at: DVec3) -> f64 {
    let single = |t: &[u32; 3]| TriangleTree::new(points, std::slice::from_ref(t)).closest(at).distance_squared;
    triangles.iter().map(single).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_tree_finds_what_a_search_of_all_triangles_finds() {
    let (points, triangles) = cylinder(12, |_, _| false);
    let tree = TriangleTree::new(&points, &triangles);
    for k in 0..500 {
        let t = k as f64;
        let at = 1.5 * DVec3::new((1.3 * t).sin(), (0.7 * t).cos(), (2.1 * t).sin());
        assert_eq!(tree.closest(at).distance_squared, brute_force(&points, &triangles, at));
    }
}

/// Regions of a triangle with closed forms: above the inside, beyond an edge, beyond a corner.
#[test]
fn closest_points_of_one_triangle() {
    let tree = TriangleTree::new(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]);
    for (at, expected) in [
        (DVec3::new(0.25, 0.25, 3.0), DVec3::new(0.25, 0.25, 0.0)),
        (DVec3::new(0.5, -2.0, 1.0), DVec3::new(0.5, 0.0, 0.0)),
        (DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.5, 0.5, 0.0)),
        (DVec3::new(5.0, -1.0, 2.0), DVec3::X),
        (DVec3::new(-1.0, -1.0, 0.0), DVec3::ZERO),
    ] {
        assert!((tree.closest(at).point - expected).length() < 1e-15, "{at}");
    }
}

/// Fails if `LEAST_COSINE` is 0.99 or -1.
#[test]
fn a_line_meets_the_surface_where_it_should() {
    let (points, triangles) = cylinder(64, |_, _| false);
    let target = TargetSurface::new(&points, triangles);
    let from = DVec3::new(0.2, 1.05, 0.1);
    let direction = DVec3::new(0.3, 1.0, 0.2).normalize();
    let met = target.along(from, direction);
    let travel = (met - from).dot(direction);
    assert!((from + travel * direction - met).length() < 1e-12, "on the line");
    assert!(target.closest(met).distance_squared.sqrt() < 1e-14, "on the surface");
    assert!(travel < 0.0 && (met.y.hypot(met.z) - 1.0).abs() < 1e-3, "the near crossing: {met}");
    // A line along the surface meets it nowhere near: the closest point serves.
    let along = target.along(from, DVec3::X);
    assert_eq!(along, target.closest(from).point);
}

/// Fails if `MOST_SAMPLES` is 12.
#[test]
fn a_hole_in_a_cylinder_is_continued_round() {
    let (points, triangles) = cylinder(40, |x, angle| x.abs() < 0.6 && angle.abs() < 0.25);
    let rim = rim(&points, &triangles);
    let patch = continuation::close(&points, &triangles, &rim).unwrap();
    assert!(patch.points.len() > 100);
    // A flat lid would sink by the sagitta, 1 - cos(0.25) = 0.031; the continuation stays within 2 % of that.
    let worst = patch.points.iter().map(|p| (p.y.hypot(p.z) - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 6e-4, "{worst}");
    // Every rim edge has a triangle of the patch on its inner side, turned like the surface around.
    let all: Vec<DVec3> = points.iter().chain(&patch.points).copied().collect();
    for t in &patch.triangles {
        let [a, b, c] = t.map(|v| all[v as usize]);
        assert!((b - a).cross(c - a).dot(DVec3::new(0.0, a.y, a.z)) > 0.0);
    }
    let mut directed = std::collections::HashSet::new();
    for t in triangles.iter().chain(&patch.triangles) {
        for edge in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            assert!(directed.insert(edge), "no edge is used twice in one direction");
        }
    }
    for at in 0..rim.len() {
        let (a, b) = (rim[at], rim[(at + 1) % rim.len()]);
        assert!(directed.contains(&(a, b)) && directed.contains(&(b, a)), "the seam is closed");
    }
}

#[test]
fn the_continuation_turns_and_scales_with_the_surface() {
    let (points, triangles) = cylinder(24, |x, angle| x.abs() < 0.5 && (angle - 0.1).abs() < 0.3);
    let rim = rim(&points, &triangles);
    let straight = continuation::close(&points, &triangles, &rim).unwrap();
    let turn = DMat3::from_axis_angle(DVec3::new(0.2, 1.0, -0.4).normalize(), 0.7316);
    let turned_points: Vec<DVec3> = points.iter().map(|&p| 1000.0 * (turn * p) + DVec3::splat(77.0)).collect();
    let turned = continuation::close(&turned_points, &triangles, &rim).unwrap();
    assert_eq!(straight.points.len(), turned.points.len());
    for (a, b) in straight.points.iter().zip(&turned.points) {
        assert!((1000.0 * (turn * *a) + DVec3::splat(77.0) - *b).length() < 1e-6);
    }
}

#[test]
fn a_hole_in_a_plate_stays_flat() {
    let (points, triangles) = cylinder(20, |x, angle| x.abs() < 0.4 && angle.abs() < 0.5);
    let flat: Vec<DVec3> = points.iter().map(|p| DVec3::new(p.x, 0.5 * p.x + 0.25 * p.z.asin(), p.z.asin())).collect();
    let rim = rim(&points, &triangles);
    let patch = continuation::close(&flat, &triangles, &rim).unwrap();
    assert!(patch.points.iter().all(|p| (p.y - 0.5 * p.x - 0.25 * p.z).abs() < 1e-9));
}

/// A rim that crosses itself when seen along its axis has no continuation over its plane.
#[test]
fn a_rim_that_folds_is_refused() {
    let (mut points, triangles) = cylinder(20, |x, angle| x.abs() < 0.5 && angle.abs() < 0.4);
    let rim = rim(&points, &triangles);
    points.swap(rim[3] as usize, rim[rim.len() / 2] as usize);
    let error = continuation::close(&points, &triangles, &rim).unwrap_err();
    assert!(matches!(error, continuation::ContinuationError::RimFolds { .. }), "{error}");
}
