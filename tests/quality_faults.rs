//! Folded surfaces and inverted tets are found where they are, and only there.

#[path = "common/carved.rs"]
mod carved;

use carved::{carve, on};
use glam::{DMat3, DQuat, DVec3};
use idmesh::mesh::half_edge::Surface;
use idmesh::mesh::{TetMesh, validate};
use idmesh::projection::crossing::Crossings;
use idmesh::quality::{Statistics, betas, faults};

/// A block of 5 x 5 x 3 cells; `top` is its upper side.
fn block() -> (TetMesh, Surface) {
    let family = |triangle| if on(triangle, 2, 3.0) { "top" } else { "sides" };
    let mesh = carve([5, 5, 3], &["top", "sides"], |_| false, family, |at| at);
    let surface = validate(&mesh).unwrap().surface;
    (mesh, surface)
}

/// A slender wedge whose blunt end is as thin as its edges are long to a tenth.
fn wedge() -> (TetMesh, Surface) {
    let place = |at: DVec3| DVec3::new(at.x, at.y, (at.z - 0.5) * 0.1 * (4.0 - at.x));
    let mesh = carve([3, 3, 1], &["all"], |_| false, |_| "all", place);
    let surface = validate(&mesh).unwrap().surface;
    (mesh, surface)
}

fn vertex_at(mesh: &TetMesh, at: DVec3) -> usize {
    mesh.vertices.iter().position(|&vertex| vertex == at).unwrap()
}

fn folded(mesh: &TetMesh, surface: &Surface, moved: &[DVec3]) -> Vec<u32> {
    faults::folded(&mesh.vertices, moved, &surface.triangles, &surface.opposite)
}

/// Triangles of the upper side, all of whose normals pointed the same way along z, that no longer
/// do.
fn turned_down(surface: &Surface, mesh: &TetMesh, moved: &[DVec3]) -> Vec<u32> {
    let z = |vertices: &[DVec3], triangle: u32| {
        let [a, b, c] = surface.triangles[triangle as usize].map(|vertex| vertices[vertex as usize]);
        (b - a).cross(c - a).z
    };
    let top = surface.triangles_of(mesh.family("top").unwrap());
    top.iter().copied().filter(|&triangle| z(&mesh.vertices, triangle) * z(moved, triangle) < 0.0).collect()
}

fn rotations() -> Vec<DQuat> {
    let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
    let mut rotations: Vec<_> = [0.3, 1.6, 3.0].into_iter().map(|angle| DQuat::from_axis_angle(axis, angle)).collect();
    rotations.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| DQuat::from_axis_angle(axis, std::f64::consts::PI)));
    rotations
}

/// Half a turn reverses every normal in space, and folds nothing; edges with normals at right
/// angles stay what they are.
#[test]
fn rigid_motions_fold_nothing() {
    for (mesh, surface) in [block(), wedge()] {
        for turn in rotations() {
            let moved: Vec<_> = mesh.vertices.iter().map(|&at| turn * at + DVec3::new(7.0, -3.0, 1e3)).collect();
            assert_eq!(folded(&mesh, &surface, &moved), [0u32; 0]);
        }
    }
}

/// In a plane the sign of the normal tells what is folded. However the body then stands in space,
/// it is the same.
#[test]
fn a_vertex_pushed_across_an_opposite_edge_folds_exactly_its_triangles() {
    let (mesh, surface) = block();
    let vertex = vertex_at(&mesh, DVec3::new(2.0, 2.0, 3.0));
    let mut seen = Vec::new();
    for (x, y) in [(1.2, 0.5), (0.5, 1.2), (-0.6, 0.6), (1.3, 1.1), (-1.4, -0.6), (0.4, 0.3), (-0.2, -0.9)] {
        let mut moved = mesh.vertices.clone();
        moved[vertex] += DVec3::new(x, y, 0.0);
        let expected = turned_down(&surface, &mesh, &moved);
        seen.push(expected.len());
        for turn in rotations() {
            let turned: Vec<_> = moved.iter().map(|&at| turn * at).collect();
            assert_eq!(folded(&mesh, &surface, &turned), expected, "({x}, {y})");
        }
    }
    // Some pushes stay within the triangles around the vertex, others go across one or two edges.
    assert!([0, 1, 2].iter().all(|count| seen.contains(count)), "{seen:?}");
}

/// A strip folded over and back again like a letter: only its middle lies the wrong way up.
#[test]
fn what_is_folded_twice_is_the_right_way_up() {
    let (mesh, surface) = block();
    let letter = [0.0, 1.0, 2.0, 1.5, 4.0, 5.0];
    let moved: Vec<_> = mesh.vertices.iter().map(|at| DVec3::new(letter[at.x as usize], at.y, at.z)).collect();
    let found = folded(&mesh, &surface, &moved);
    let between = |&triangle: &u32| {
        let x = surface.triangles[triangle as usize].map(|vertex| mesh.vertices[vertex as usize].x);
        x.iter().all(|x| (2.0..=3.0).contains(x)) && x.iter().any(|&other| other != x[0])
    };
    // All round the block: of its 4 long sides, the triangles between x = 2 and x = 3.
    let expected: Vec<u32> = (0..surface.triangles.len() as u32).filter(between).collect();
    assert_eq!(expected.len(), 2 * (5 + 5 + 3 + 3));
    assert_eq!(found, expected);
}

/// Bending, shearing and stretching are no folds; a bump as steep as a wall is none.
#[test]
fn smooth_motions_fold_nothing() {
    let (mesh, surface) = block();
    let vertex = vertex_at(&mesh, DVec3::new(2.0, 2.0, 3.0));
    let mut bump = mesh.vertices.clone();
    bump[vertex].z += 3.0;
    assert_eq!(folded(&mesh, &surface, &bump), [0u32; 0]);
    let sheared: Vec<_> = mesh.vertices.iter().map(|at| DVec3::new(at.x + 3.0 * at.z, at.y, 0.2 * at.z)).collect();
    assert_eq!(folded(&mesh, &surface, &sheared), [0u32; 0]);
}

#[test]
fn inverted_tets_are_gathered_and_placed() {
    let (mesh, surface) = block();
    assert!(faults::clusters(&mesh.vertices, &mesh.tets, &betas(&mesh.vertices, &mesh.tets)).is_empty());
    // Two vertices with no tet in common: one of the upper side goes down, less far one of the
    // opposite corner inwards.
    let mut moved = mesh.vertices.clone();
    let (top, corner) = (vertex_at(&mesh, DVec3::new(4.0, 4.0, 3.0)), vertex_at(&mesh, DVec3::ZERO));
    moved[top].z -= 1.9;
    moved[corner] += DVec3::splat(1.05);
    let beta = betas(&moved, &mesh.tets);
    let inverted = faults::inverted(&beta);
    assert_eq!(inverted.len(), Statistics::new(&beta).inverted);
    let clusters = faults::clusters(&moved, &mesh.tets, &beta);
    assert_eq!(clusters.len(), 2);
    let mut gathered: Vec<u32> = clusters.iter().flat_map(|cluster| cluster.tets.iter().copied()).collect();
    gathered.sort_unstable();
    assert_eq!(gathered, inverted);
    let lowest = (0..beta.len()).min_by(|&a, &b| beta[a].total_cmp(&beta[b])).unwrap();
    assert_eq!(clusters[0].worst as usize, lowest);
    for (cluster, vertex, family) in [(&clusters[0], top, "top"), (&clusters[1], corner, "sides")] {
        assert!(cluster.tets.iter().all(|&tet| mesh.tets[tet as usize].contains(&(vertex as u32))), "{cluster:?}");
        assert!(cluster.at.distance(moved[vertex]) < 2.0);
        let nearest = faults::nearest_triangle(&moved, &mesh.tets, &surface.triangles, cluster).unwrap();
        assert_eq!(surface.family[nearest as usize], mesh.family(family).unwrap());
    }
}

/// Inside the block no vertex of a tet is on the surface: the nearest triangle is searched for.
#[test]
fn the_nearest_triangle_is_found_from_within() {
    let mesh = carve([9, 9, 9], &["low", "rest"], |_| false, |t| if on(t, 2, 0.0) { "low" } else { "rest" }, |at| at);
    let surface = validate(&mesh).unwrap().surface;
    let mut moved = mesh.vertices.clone();
    moved[vertex_at(&mesh, DVec3::new(4.0, 4.0, 3.0))].z += 1.5;
    let clusters = faults::clusters(&moved, &mesh.tets, &betas(&moved, &mesh.tets));
    assert_eq!(clusters.len(), 1);
    let nearest = faults::nearest_triangle(&moved, &mesh.tets, &surface.triangles, &clusters[0]).unwrap();
    let brute = (0..surface.triangles.len()).min_by(|&a, &b| {
        let far = |of: usize| {
            let sum: DVec3 = surface.triangles[of].iter().map(|&vertex| moved[vertex as usize]).sum();
            (sum / 3.0).distance(clusters[0].at)
        };
        far(a).total_cmp(&far(b))
    });
    assert_eq!(Some(nearest as usize), brute);
}

#[test]
fn around_are_the_tets_that_share_a_vertex() {
    let (mesh, _) = block();
    let some = [7, 200];
    let shares = |tet: &[u32; 4]| some.iter().any(|&other| mesh.tets[other as usize].iter().any(|v| tet.contains(v)));
    let expected: Vec<u32> = (0..mesh.tets.len() as u32).filter(|&tet| shares(&mesh.tets[tet as usize])).collect();
    assert_eq!(faults::around(&mesh.tets, mesh.vertices.len(), &some), expected);
    assert!(expected.contains(&7) && expected.len() < mesh.tets.len());
    assert!(faults::is_inverted(f64::NAN) && faults::is_inverted(0.0) && !faults::is_inverted(1e-300));
}

/// Surfaces touch along edges, lie in one plane, stand at right angles; none of that is passing
/// through, at any place.
///
/// Fails if `BEYOND` is 0.
#[test]
fn whole_surfaces_pierce_nothing() {
    for (mesh, surface) in [block(), wedge()] {
        for turn in rotations() {
            let moved: Vec<_> = mesh.vertices.iter().map(|&at| turn * at + DVec3::new(7.0, -3.0, 1e3)).collect();
            assert_eq!(Crossings::new(&mesh.vertices, &surface.triangles).self_intersecting(&moved), [0u32; 0]);
        }
    }
}

/// A spike from the upper side, of height 4 in a block of height 3, comes out through the one
/// triangle below its tip and is met by no other edge: the tip stands over the inside of a
/// triangle, and the spike is narrow there.
#[test]
fn a_spike_pierces_the_triangle_it_comes_out_of() {
    let (mesh, surface) = block();
    let mut moved = mesh.vertices.clone();
    let tip = vertex_at(&mesh, DVec3::new(2.0, 2.0, 3.0));
    moved[tip] = DVec3::new(2.6, 2.3, -0.01);
    let below = |&triangle: &u32| {
        let [a, b, c] = surface.triangles[triangle as usize].map(|vertex| moved[vertex as usize]);
        let side = |p: DVec3, q: DVec3| (q - p).truncate().perp_dot(moved[tip].truncate() - p.truncate());
        let flat = [a, b, c].iter().all(|at| at.z == 0.0);
        flat && (side(a, b) > 0.0) == (side(b, c) > 0.0) && (side(b, c) > 0.0) == (side(c, a) > 0.0)
    };
    let expected: Vec<u32> = (0..surface.triangles.len() as u32).filter(below).collect();
    assert_eq!(expected.len(), 1);
    assert_eq!(Crossings::new(&mesh.vertices, &surface.triangles).self_intersecting(&moved), expected);
    moved[tip].z = 0.01;
    assert_eq!(Crossings::new(&mesh.vertices, &surface.triangles).self_intersecting(&moved), [0u32; 0]);
}

/// Vertices thrown about: every edge against every triangle, where it meets its plane by solving
/// for the place.
///
/// Fails if `BEYOND` is 0.1.
#[test]
fn all_pierced_triangles_are_found() {
    let (mesh, surface) = block();
    for amount in [0.1, 0.5, 2.0] {
        let thrown = |n: usize| DVec3::new(7.0 * n as f64, 3.0 * n as f64, 11.0 * n as f64).map(|x| (x * x).sin());
        let moved: Vec<_> = mesh.vertices.iter().enumerate().map(|(n, &at)| at + amount * thrown(n)).collect();
        let edges = surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let edges: Vec<[u32; 2]> = edges.filter(|[a, b]| a < b).collect();
        let is_pierced = |&triangle: &u32| {
            let corners = surface.triangles[triangle as usize];
            let [a, b, c] = corners.map(|vertex| moved[vertex as usize]);
            edges.iter().filter(|edge| !edge.iter().any(|end| corners.contains(end))).any(|edge| {
                let [from, to] = edge.map(|end| moved[end as usize]);
                // a + u (b - a) + v (c - a) = from + t (to - from)
                let place = DMat3::from_cols(b - a, c - a, from - to).inverse() * (from - a);
                place.min_element() > 0.0 && place.x + place.y < 1.0 && place.z < 1.0
            })
        };
        let expected: Vec<u32> = (0..surface.triangles.len() as u32).filter(is_pierced).collect();
        assert_eq!(Crossings::new(&mesh.vertices, &surface.triangles).self_intersecting(&moved), expected, "{amount}");
        assert_eq!(expected.is_empty(), amount < 0.2, "{amount}: {}", expected.len());
    }
}

/// A test after another one finds what a first test finds, wherever some vertices, all or none have
/// moved since.
#[test]
fn a_later_test_finds_what_a_first_one_finds() {
    let (mesh, surface) = block();
    let mut later = Crossings::new(&mesh.vertices, &surface.triangles);
    let mut moved = mesh.vertices.clone();
    let mut counts = Vec::new();
    for round in 0..12usize {
        // All vertices, then every fifth, then one, then none; at last all go back.
        for (n, (moved, &at)) in moved.iter_mut().zip(&mesh.vertices).enumerate() {
            let goes = [n % 5 == round % 5, n == 7 * round, false, true][round % 4];
            let x = (17 * n + 31 * round) as f64;
            let thrown = DVec3::new(7.0 * x, 3.0 * x, 11.0 * x).map(|x| (x * x).sin());
            if goes {
                *moved = at + if round == 11 { DVec3::ZERO } else { 0.6 * thrown };
            }
        }
        let first = Crossings::new(&mesh.vertices, &surface.triangles).self_intersecting(&moved);
        counts.push(first.len());
        assert_eq!(later.self_intersecting(&moved), first, "{round}");
    }
    assert!(counts[..11].iter().any(|&count| count > 10) && counts[11] == 0, "{counts:?}");
}

/// A relaxation that diverges leaves vertices nowhere: nothing is said of them, and nothing hangs.
#[test]
fn vertices_that_are_nowhere_pierce_nothing() {
    let (mesh, surface) = block();
    let mut moved = mesh.vertices.clone();
    let through = vertex_at(&mesh, DVec3::new(2.0, 2.0, 3.0));
    moved[through] += DVec3::new(0.3, 0.2, -5.0);
    let mut crossings = Crossings::new(&mesh.vertices, &surface.triangles);
    assert!(!crossings.newly_self_intersecting(&mesh.vertices, &moved).is_empty());
    assert!(crossings.newly_self_intersecting(&moved, &moved).is_empty());
    moved[through] = DVec3::NAN;
    assert!(crossings.newly_self_intersecting(&mesh.vertices, &moved).is_empty());
}

/// The top behind y = 2 is raised to a slope of 70 degrees. So the edges along y = 2 turn by 70
/// degrees, and those at the end of the block too; no other edge turns.
#[test]
fn edges_that_turn_are_found_with_their_angle() {
    let (mesh, surface) = block();
    let angles = faults::EdgeAngles::new(&mesh.vertices, &surface.triangles, &surface.opposite);
    let slope = 70.0_f64.to_radians().tan();
    let raised = |at: &DVec3| if at.z == 3.0 { *at + DVec3::Z * slope * (at.y - 2.0).max(0.0) } else { *at };
    for turn in rotations() {
        let moved: Vec<DVec3> = mesh.vertices.iter().map(|at| turn * raised(at)).collect();
        let changed = |degrees| angles.changed(degrees, &moved, &surface.triangles, &surface.opposite);
        let edges = changed(69.9);
        assert_eq!(edges.len(), 10, "{edges:?}");
        for (half_edge, degrees) in edges {
            let ends = [half_edge, surface.opposite[half_edge as usize]].map(|end| surface.origin(end));
            let ends = ends.map(|vertex| mesh.vertices[vertex as usize]);
            assert!(ends.iter().all(|at| at.z == 3.0 && (at.y == 2.0 || at.y == 5.0)) && ends[0].y == ends[1].y);
            assert!((degrees - 70.0).abs() < 1e-9, "{degrees}");
        }
        assert!(changed(70.1).is_empty());
    }
}
