//! Surface vertices slide in local optimisation: on their surface, along their curve, and only where they may.

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use std::collections::HashMap;

use common::aircraft::*;
use common::faults::distance_to;
use glam::DVec3;
use idmesh::backend::{Ball, Constraint, CpuBackend, Precision};
use idmesh::families::{Families, Role};
use idmesh::mesh::{self, FamilyId, TetMesh, csr::Csr};
use idmesh::mover::{Outcome, Settings};
use idmesh::projection::TriangleTree;
use idmesh::projection::walk::{Curves, Parts};
use idmesh::quality;
use idmesh::smoothing::{Goal, QualityTarget, Smoothed, Smoother, SurfaceMotion};
use idmesh::volume::sliding::SurfaceFreedom;
use meshes::brick;

const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
const F32: CpuBackend = CpuBackend { precision: Precision::F32 };

fn worst(betas: &[f64]) -> f64 {
    betas.iter().copied().fold(f64::INFINITY, f64::min)
}

fn bits(at: DVec3) -> [u64; 3] {
    at.to_array().map(f64::to_bits)
}

// ---- walks ----

/// A square of `2 n^2` triangles rolled up by `turn` radians, and the triangles around each point.
fn rolled(n: usize, turn: f64) -> (Vec<DVec3>, Vec<[u32; 3]>, Csr) {
    let side = n + 1;
    let place = |k: usize| {
        let (across, angle) = ((k / side) as f64 / n as f64, (k % side) as f64 / n as f64 * turn);
        DVec3::new(angle.cos(), angle.sin(), across)
    };
    let points: Vec<DVec3> = (0..side * side).map(place).collect();
    let triangles: Vec<[u32; 3]> = (0..n * n)
        .flat_map(|cell| {
            let a = (cell / n * side + cell % n) as u32;
            let (b, c, d) = (a + 1, a + side as u32, a + side as u32 + 1);
            [[a, b, d], [a, d, c]]
        })
        .collect();
    let corners = triangles.iter().enumerate().flat_map(|(triangle, corners)| corners.map(|v| (v, triangle as u32)));
    let around = Csr::from_pairs(points.len(), corners);
    (points, triangles, around)
}

#[test]
fn a_walk_ends_where_a_search_does() {
    let (points, triangles, around) = rolled(12, 2.5);
    let tree = TriangleTree::new(&points, &triangles);
    let part = vec![7; triangles.len()];
    let parts = Parts { points: &points, triangles: &triangles, around: &around, part: &part };
    for start in [0, 100, 287] {
        for k in 0..60 {
            let angle = 0.04 * k as f64;
            let at = DVec3::new(angle.cos(), angle.sin(), 0.37 + 0.005 * k as f64) * (0.97 + 0.001 * k as f64);
            let (found, expected) = (parts.closest(start, at), tree.closest(at));
            assert!((found.distance_squared - expected.distance_squared).abs() < 1e-15, "{found:?} {expected:?}");
            // The facets' normals turn by 2.5 / 12 from one to the next: half of that from the cylinder's own.
            let outward = DVec3::new(at.x, at.y, 0.0).normalize();
            assert!(parts.normal(&found).dot(outward) > 0.2f64.cos(), "{found:?}");
        }
    }
}

#[test]
fn a_walk_stays_in_its_part() {
    let (points, triangles, around) = rolled(8, 1.0);
    // Two parts, above and below the middle.
    let part: Vec<u32> = (0..triangles.len() as u32).map(|triangle| triangle / 64).collect();
    let parts = Parts { points: &points, triangles: &triangles, around: &around, part: &part };
    let at = DVec3::new(1.0, 0.1, 0.9);
    let (below, above) = (parts.closest(0, at), parts.closest(127, at));
    assert!(below.triangle < 64 && (below.point.z - 0.5).abs() < 1e-15, "{below:?}");
    assert!(above.triangle >= 64 && (above.point.z - 0.9).abs() < 1e-15, "{above:?}");
}

#[test]
fn a_walk_along_a_curve_finds_its_nearest_point_and_ends_at_its_ends() {
    // A circle of 64 points of which one is a corner.
    let circle: Vec<DVec3> =
        (0..64).map(|k| (k as f64 / 64.0 * std::f64::consts::TAU).sin_cos()).map(to_point).collect();
    let beside = |at: u32| (at != 0).then(|| [(at + 63) % 64, (at + 1) % 64]);
    let curves = Curves { points: &circle, beside };
    for k in 0..200 {
        let angle = 0.3 + 5.6 * f64::from(k) / 200.0;
        let at = 1.1 * to_point(angle.sin_cos());
        let found = curves.closest(32, at);
        let [from, to] = found.segment.map(|end| circle[end as usize]);
        let nearest = (0..64).map(|k| to_segment(at, circle[k], circle[(k + 1) % 64])).fold(f64::INFINITY, f64::min);
        assert!((found.point.distance(at) - nearest).abs() < 1e-15, "{angle} {found:?}");
        assert!(to_segment(found.point, from, to) < 1e-15);
        let direction = curves.direction(&found);
        assert!(direction.dot(found.point).abs() < 0.06 && (direction.length() - 1.0).abs() < 1e-12);
    }
    // Beyond the corner, from either side: the walk ends there.
    assert_eq!(curves.closest(3, 1.1 * to_point((-0.3f64).sin_cos())).point, circle[0]);
    assert_eq!(curves.closest(61, 1.1 * to_point(0.3f64.sin_cos())).point, circle[0]);
}

/// Distance from a segment.
fn to_segment(at: DVec3, a: DVec3, b: DVec3) -> f64 {
    let fraction = (at - a).dot(b - a) / (b - a).length_squared();
    at.distance(a.lerp(b, fraction.clamp(0.0, 1.0)))
}

fn to_point((sin, cos): (f64, f64)) -> DVec3 {
    DVec3::new(cos, sin, 0.0)
}

// ---- what may slide ----

/// What the vertices of a brick may do that is one family with this role.
fn slides(mesh: &TetMesh, roles: Vec<Role>) -> Vec<u32> {
    let topology = mesh::validate(mesh).unwrap();
    let families = Families::new(mesh, &topology.surface, roles).unwrap();
    SurfaceFreedom::new(mesh, &topology.surface, &families, &[]).vertices()
}

/// Of a cube that is all one family the faces slide and the edges, for they are sharp; the corners stay.
#[test]
fn corners_stay() {
    let mut mesh = brick(4);
    mesh.families = vec!["body".to_owned()];
    mesh.triangle_family.fill(FamilyId(0));
    let found = slides(&mesh, vec![Role::TrailingEdge]);
    let on_sides = |at: DVec3| at.to_array().into_iter().filter(|&x| x == 0.0 || x == 1.0).count();
    let expected: Vec<u32> =
        (0..mesh.vertices.len() as u32).filter(|&v| [1, 2].contains(&on_sides(mesh.vertices[v as usize]))).collect();
    assert_eq!(found, expected);
    // Along its edges and in its faces, no other way.
    let topology = mesh::validate(&mesh).unwrap();
    let families = Families::new(&mesh, &topology.surface, vec![Role::TrailingEdge]).unwrap();
    let slides = SurfaceFreedom::new(&mesh, &topology.surface, &families, &[]);
    let sliding = slides.on(&mesh, &topology.surface, &families, &mesh.vertices);
    for vertex in expected {
        let at = mesh.vertices[vertex as usize];
        let pushed = sliding.back(vertex, at + DVec3::new(0.03, -0.02, 0.04));
        for axis in 0..3 {
            let fixed = at[axis] == 0.0 || at[axis] == 1.0;
            assert!((pushed[axis] == at[axis]) == fixed, "{at} {pushed}");
        }
        match sliding.tangent(vertex, at) {
            Constraint::InPlane(normal) => assert!(on_sides(at) == 1 && normal.abs().max_element() > 1.0 - 1e-12),
            Constraint::OnLine(line) => assert!(on_sides(at) == 2 && line.abs().max_element() > 1.0 - 1e-12),
            other => panic!("{other:?}"),
        }
    }
}

/// The lid of a brick is folded by 30 degrees along its middle, or by 10: an edge of 30 degrees shapes the surface, and its
/// vertices slide along it alone.
///
/// Fails if `SHARP` is 0.5 or 0.9999.
#[test]
fn sharp_edges_keep_their_vertices() {
    for (degrees, is_sharp) in [(30.0f64, true), (10.0, false)] {
        let mut mesh = brick(4);
        let slope = (degrees / 2.0).to_radians().tan();
        let ridge: Vec<u32> = (0..mesh.vertices.len() as u32)
            .filter(|&v| mesh.vertices[v as usize].with_y(0.0) == DVec3::new(0.5, 0.0, 1.0))
            .filter(|&v| ![0.0, 1.0].contains(&mesh.vertices[v as usize].y))
            .collect();
        assert_eq!(ridge.len(), 3);
        mesh.vertices.iter_mut().for_each(|at| at.z *= 1.0 - slope * (at.x - 0.5).abs());
        mesh.families = vec!["body".to_owned()];
        mesh.triangle_family.fill(FamilyId(0));
        let topology = mesh::validate(&mesh).unwrap();
        let families = Families::new(&mesh, &topology.surface, vec![Role::TrailingEdge]).unwrap();
        let slides = SurfaceFreedom::new(&mesh, &topology.surface, &families, &[]);
        let sliding = slides.on(&mesh, &topology.surface, &families, &mesh.vertices);
        for vertex in ridge {
            let tangent = sliding.tangent(vertex, mesh.vertices[vertex as usize]);
            let is_curve = matches!(tangent, Constraint::OnLine(line) if line.y.abs() > 1.0 - 1e-12);
            assert_eq!(is_curve, is_sharp, "{degrees}: {tangent:?}");
        }
    }
}

#[test]
fn fixed_prescribed_and_plane_families_do_not_slide() {
    let mesh = brick(3);
    let roles = [Role::Fixed, Role::Prescribed, Role::PLANE, Role::PLANE, Role::TrailingEdge, Role::TrailingEdge];
    // The sides z0 and z1 slide, with their edges to the planes y0 and y1, but not with those to x0 and x1.
    let of = |at: DVec3| (at.z == 0.0 || at.z == 1.0) && at.x > 0.0 && at.x < 1.0;
    let expected: Vec<u32> = (0..mesh.vertices.len() as u32).filter(|&v| of(mesh.vertices[v as usize])).collect();
    assert_eq!(slides(&mesh, roles.to_vec()), expected);
}

// ---- runs ----

/// The lid of a brick, bulged: vertices inside it slide on `z = height(x, y)`.
struct Lid {
    original: Vec<DVec3>,
    folds: bool,
}

impl Lid {
    fn height(x: f64, y: f64) -> f64 {
        1.0 + 0.3 * x * (1.0 - x) + 0.1 * y
    }

    /// A brick with this lid, and the vertices inside the lid.
    fn new() -> (TetMesh, Vec<u32>, Self) {
        let mut mesh = brick(4);
        let inside = |at: &DVec3| at.z == 1.0 && at.x > 0.0 && at.x < 1.0 && at.y > 0.0 && at.y < 1.0;
        let lid = (0..mesh.vertices.len() as u32).filter(|&v| inside(&mesh.vertices[v as usize])).collect();
        mesh.vertices.iter_mut().for_each(|at| at.z *= Self::height(at.x, at.y));
        let original = mesh.vertices.clone();
        (mesh, lid, Self { original, folds: false })
    }
}

impl SurfaceMotion for Lid {
    fn tangent(&self, _: u32, at: DVec3) -> Constraint {
        Constraint::InPlane(DVec3::new(-0.3 * (1.0 - 2.0 * at.x), -0.1, 1.0).normalize())
    }

    fn reach(&self, _: u32) -> Option<Ball> {
        None
    }

    fn back(&self, _: u32, at: DVec3) -> DVec3 {
        at.with_z(Self::height(at.x, at.y))
    }

    fn folded(&self, at: &[DVec3]) -> usize {
        usize::from(self.folds && self.original.iter().zip(at).any(|(a, b)| a.z > 0.9 && a.distance(*b) > 1e-3))
    }
}

/// Everything but the inside held; goal near the beta of the original's worst tet.
fn run(
    mesh: &TetMesh,
    lid: &[u32],
    slide: Option<&dyn SurfaceMotion>,
    backend: CpuBackend,
    at: &mut [DVec3],
) -> Smoothed {
    let inside = |v: usize| {
        let x = brick(4).vertices[v];
        x.min_element() > 0.0 && x.max_element() < 1.0
    };
    let constraint: Vec<Constraint> =
        (0..mesh.vertices.len()).map(|v| if inside(v) { Constraint::Free } else { Constraint::Held }).collect();
    let mut smoother = Smoother::new(&backend, &mesh.tets, &mesh.vertices, &constraint, lid, QualityTarget::Original);
    let goal = Goal { beta: 0.95 * worst(&quality::betas(&mesh.vertices, &mesh.tets)), max_sweeps: 200 };
    smoother.run(at, &mut quality::betas(at, &mesh.tets), &goal, slide).unwrap()
}

/// A vertex pushed within the lid nearly to an edge of the triangles around it: the tets on these are bad, wherever
/// their fourth vertices are.
fn pushed(mesh: &TetMesh, lid: &[u32]) -> Vec<DVec3> {
    let mut at = mesh.vertices.clone();
    let vertex = lid[4] as usize;
    let pushed = at[vertex] + DVec3::new(0.11, -0.11, 0.0);
    at[vertex] = pushed.with_z(Lid::height(pushed.x, pushed.y));
    at
}

/// What held surfaces cannot repair, sliding ones do; and they stay on their surface.
#[test]
fn sliding_repairs_what_held_surfaces_cannot() {
    let (mesh, lid, slide) = Lid::new();
    let goal = 0.95 * worst(&quality::betas(&mesh.vertices, &mesh.tets));
    for backend in [F64, F32] {
        let mut held = pushed(&mesh, &lid);
        let mut slid = held.clone();
        let of_held = run(&mesh, &lid, None, backend, &mut held);
        let of_slid = run(&mesh, &lid, Some(&slide), backend, &mut slid);
        assert!(of_held.beta_min < 0.8 * goal, "{of_held:?} {goal}");
        assert!(of_slid.inverted == 0 && of_slid.beta_min >= goal, "{of_slid:?} {goal}");
        for &vertex in &lid {
            let [x, y, z] = slid[vertex as usize].to_array();
            assert!((z - Lid::height(x, y)).abs() < 1e-15);
            assert_eq!(bits(held[vertex as usize]), bits(pushed(&mesh, &lid)[vertex as usize]));
        }
    }
}

/// A run that does not slide after one that did holds the surface again.
#[test]
fn a_run_without_surfaces_holds_them() {
    let (mesh, lid, slide) = Lid::new();
    let constraint = vec![Constraint::Held; mesh.vertices.len()];
    let mut smoother = Smoother::new(&F64, &mesh.tets, &mesh.vertices, &constraint, &lid, QualityTarget::Original);
    let goal = Goal { beta: 1.0, max_sweeps: 12 };
    let before = pushed(&mesh, &lid);
    let betas = quality::betas(&before, &mesh.tets);
    assert!(smoother.run(&mut before.clone(), &mut betas.clone(), &goal, Some(&slide)).unwrap().moved > 0);
    let mut at = before.clone();
    assert_eq!(smoother.run(&mut at, &mut betas.clone(), &goal, None).unwrap().moved, 0);
    assert_eq!(at, before);
}

/// Where sliding folds the surface, the mesh without it is kept.
#[test]
fn a_slide_that_folds_is_not_kept() {
    let (mesh, lid, mut slide) = Lid::new();
    let mut held = pushed(&mesh, &lid);
    slide.original = held.clone();
    slide.folds = true;
    let mut slid = held.clone();
    let of_held = run(&mesh, &lid, None, F64, &mut held);
    let of_slid = run(&mesh, &lid, Some(&slide), F64, &mut slid);
    assert_eq!(held, slid);
    assert_eq!((of_held.beta_min, of_held.moved), (of_slid.beta_min, of_slid.moved));
    assert!(of_slid.sweeps > of_held.sweeps);
}

#[test]
fn an_unmoved_mesh_keeps_its_bits() {
    let (mesh, lid, slide) = Lid::new();
    let constraint = vec![Constraint::Held; mesh.vertices.len()];
    let mut smoother = Smoother::new(&F64, &mesh.tets, &mesh.vertices, &constraint, &lid, QualityTarget::Original);
    let mut at = mesh.vertices.clone();
    let mut betas = quality::betas(&at, &mesh.tets);
    let smoothed = smoother.run(&mut at, &mut betas, &Goal { beta: 1.0, max_sweeps: 40 }, Some(&slide)).unwrap();
    assert!(smoothed.sweeps > 0);
    assert!(at.iter().zip(&mesh.vertices).all(|(a, b)| bits(*a) == bits(*b)));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let outcome = moved(SMALL, "planform_2", Some(QualityTarget::Improve));
            outcome.vertices.iter().copied().map(bits).collect::<Vec<_>>()
        })
    };
    assert_eq!(on(1), on(3));
}

// ---- whole aircraft ----

fn moved(aircraft: Aircraft, design: &str, quality: Option<QualityTarget>) -> Outcome {
    let mesh = aircraft.mesh();
    let settings = Settings { quality, ..settings(&mesh, aircraft.profiles("old_2")) };
    update(&mut mover(mesh, settings).unwrap(), aircraft.profiles(design))
}

/// The families at each vertex, found without the crate's topology.
fn families_at(mesh: &TetMesh) -> Vec<Vec<u16>> {
    let mut families = vec![Vec::new(); mesh.vertices.len()];
    for (triangle, family) in mesh.triangles.iter().zip(&mesh.triangle_family) {
        for &vertex in triangle {
            if !families[vertex as usize].contains(&family.0) {
                families[vertex as usize].push(family.0);
            }
        }
    }
    families
}

/// The edges between each two families.
fn curves(mesh: &TetMesh) -> HashMap<[u16; 2], Vec<[u32; 2]>> {
    let mut sides: HashMap<[u32; 2], Vec<u16>> = HashMap::new();
    for (&[a, b, c], family) in mesh.triangles.iter().zip(&mesh.triangle_family) {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            sides.entry([a.min(b), a.max(b)]).or_default().push(family.0);
        }
    }
    let mut curves: HashMap<[u16; 2], Vec<[u32; 2]>> = HashMap::new();
    for (edge, sides) in sides {
        if sides[0] != sides[1] {
            let between = [sides[0].min(sides[1]), sides[0].max(sides[1])];
            curves.entry(between).or_default().push(edge);
        }
    }
    curves
}

/// Held surfaces end at 0.87 of the original's worst beta here, limited by tets between the wing, the carenage and one
/// vertex off them.
///
/// Fails if `IMPROVED` is 1, and if `MOST_POINTS` of profiles is 200.
#[test]
fn surfaces_slide_within_themselves() {
    let (springs, slid) =
        (moved(WING_BODY, "planform_2", None), moved(WING_BODY, "planform_2", Some(QualityTarget::Improve)));
    let original = worst(&slid.original_beta);
    assert!(worst(&slid.beta) >= 1.3 * original, "{} of {original}", worst(&slid.beta));
    assert!(slid.is_valid() && slid.folded.is_empty());
    let off = |outcome: &Outcome| outcome.profiles["wing"].max_distance_to_new_profiles.unwrap();
    assert!(off(&slid) <= off(&springs) + 2e-4, "{} {}", off(&slid), off(&springs));
    assert!(slid.families["carenage"].max_distance_to_original_surface.unwrap() < 1e-9);

    let mesh = WING_BODY.mesh();
    let id = |name: &str| mesh.family(name).unwrap().0;
    let (carenage, symmetry) = (id("carenage"), id("symmetry"));
    let families = families_at(&mesh);
    let curves = curves(&mesh);
    let surface = |family: u16| triangles_of(&mesh, &mesh.families[family as usize]);
    let surfaces: Vec<Vec<[usize; 3]>> = (0..mesh.families.len() as u16).map(surface).collect();
    let mut slid_on = HashMap::new();
    for (vertex, families) in families.iter().enumerate() {
        let (is, was) = (slid.vertices[vertex], springs.vertices[vertex]);
        if families.contains(&symmetry) {
            assert_eq!(is.y.to_bits(), mesh.vertices[vertex].y.to_bits());
        }
        if is == was {
            continue;
        }
        let mut between = families.clone();
        between.sort_unstable();
        assert!(!between.contains(&id("farfield")) && between.len() < 3, "{between:?}");
        *slid_on.entry(between.clone()).or_insert(0) += 1;
        match between[..] {
            // Original surface: the report has it.
            [family] if family == carenage || family == symmetry => {}
            [family] => assert!(distance_to(is, &surfaces[family as usize], &springs.vertices) < 1e-12),
            [a, b] => {
                // The chord of two junction vertices lies off the carenage, and they end on it.
                let tolerance = if between.contains(&carenage) { 1e-3 } else { 1e-12 };
                let ends = curves[&[a, b]].iter().map(|edge| edge.map(|end| springs.vertices[end as usize]));
                let distance = ends.map(|[a, b]| to_segment(is, a, b)).fold(f64::INFINITY, f64::min);
                assert!(distance < tolerance, "{between:?} {distance:e}");
            }
            _ => {}
        }
    }
    let count = |between: &[u16]| slid_on.get(between).copied().unwrap_or(0);
    assert!(count(&[id("wing")]) > 10 && count(&[carenage]) > 0, "{slid_on:?}");
    assert!(slid_on.keys().any(|between| between.len() == 2), "{slid_on:?}");
}

/// The lid of a brick is part of a cylinder. Of a vertex that slides as far as it may, the surface comes off the place where it
/// was by the way times the angle between facets: no more than a quarter of a percent of the shortest edge, however finely or
/// coarsely the lid is cut.
/// Fails if `TRUE_TO_SHAPE` is 0.05, or 0.0001, by which hardly anything slides.
#[test]
fn a_slide_keeps_the_shape_of_a_curved_surface() {
    for (n, turn) in [(4, 1.2), (8, 1.2), (8, 0.4)] {
        let mut mesh = brick(n);
        let inside = |at: &DVec3| at.z == 1.0 && at.x > 0.0 && at.x < 1.0 && at.y > 0.0 && at.y < 1.0;
        let lid: Vec<usize> = (0..mesh.vertices.len()).filter(|&v| inside(&mesh.vertices[v])).collect();
        let radius = 1.0 / turn;
        mesh.vertices.iter_mut().for_each(|at| {
            let (sin, cos) = (turn * (at.x - 0.5)).sin_cos();
            *at = DVec3::new((radius + at.z) * sin, at.y, (radius + at.z) * cos);
        });
        mesh.families = vec!["body".to_owned()];
        mesh.triangle_family.fill(FamilyId(0));
        let topology = mesh::validate(&mesh).unwrap();
        let families = Families::new(&mesh, &topology.surface, vec![Role::TrailingEdge]).unwrap();
        let slides = SurfaceFreedom::new(&mesh, &topology.surface, &families, &[]);
        let sliding = slides.on(&mesh, &topology.surface, &families, &mesh.vertices);
        for vertex in lid {
            let was = mesh.vertices[vertex];
            let around: Vec<[usize; 3]> = mesh.triangles.iter().map(|t| t.map(|v| v as usize)).collect();
            let around: Vec<_> = around.into_iter().filter(|t| t.contains(&vertex)).collect();
            let ends = around.iter().flatten().filter(|&&end| end != vertex);
            let edge = ends.map(|&end| was.distance(mesh.vertices[end])).fold(f64::INFINITY, f64::min);
            let mut furthest: f64 = 0.0;
            for angle in 0..12 {
                let (along, across) = (f64::from(angle) * 30.0).to_radians().sin_cos();
                let round = DVec3::new(was.z, 0.0, -was.x).normalize();
                let mut moved = mesh.vertices.clone();
                moved[vertex] = sliding.back(vertex as u32, was + edge * (along * round + across * DVec3::Y));
                furthest = furthest.max(moved[vertex].distance(was));
                let off = distance_to(was, &around, &moved);
                assert!(off <= 0.0025 * edge, "{n} {turn}: {:e} of an edge", off / edge);
            }
            assert!(furthest > 0.005 * edge, "{n} {turn}: slides {:e} of an edge", furthest / edge);
        }
    }
}
