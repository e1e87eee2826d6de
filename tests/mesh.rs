//! Topology of small meshes with known answers, and what validation refuses.

#[path = "common/meshes.rs"]
mod meshes;

use glam::DVec3;
use idmesh::mesh::{FamilyId, MeshError, TetMesh, edges, validate};
use idmesh::quality;
use meshes::{brick, two_tets};

#[test]
fn two_tets_share_one_face() {
    let topology = validate(&two_tets()).unwrap();
    // The slanted face lies opposite vertex 0 of the first tet and opposite vertex 4, first of the
    // second.
    assert_eq!(topology.faces.neighbour(0, 0), Some(1));
    assert_eq!(topology.faces.neighbour(1, 0), Some(0));
    assert_eq!(topology.faces.boundary().count(), 6);
    assert!((1..4).all(|face| topology.faces.neighbour(0, face).is_none()));
}

/// Euler: a ball cut into tets has V - E + F - T = 1, its surface V - E + F = 2.
#[test]
fn counts_of_a_brick_obey_euler() {
    let mesh = brick(3);
    let topology = validate(&mesh).unwrap();
    let edges = edges::TetEdges::new(mesh.vertices.len(), &mesh.tets);
    let boundary = topology.faces.boundary().count();
    assert_eq!(boundary, 6 * 9 * 2);
    let faces = (4 * mesh.tets.len() + boundary) / 2;
    assert_eq!(mesh.vertices.len() + faces - edges.edges.len() - mesh.tets.len(), 1);
    let surface_vertices: std::collections::HashSet<u32> =
        topology.surface.triangles.iter().flatten().copied().collect();
    let surface_edges = edges::triangle_edges(topology.surface.triangles.iter().copied()).len();
    assert_eq!(surface_vertices.len() + boundary - surface_edges, 2);
}

#[test]
fn every_edge_knows_its_tets_and_every_tet_its_edges() {
    let mesh = brick(2);
    let edges = edges::TetEdges::new(mesh.vertices.len(), &mesh.tets);
    for (tet, of_tet) in edges.tet_edges.iter().enumerate() {
        for (local, &coded) in of_tet.iter().enumerate() {
            let ends = edges::EDGE[local].map(|corner| mesh.tets[tet][corner]);
            let [low, high] = edges.edges[coded as usize / 2];
            assert_eq!(if coded % 2 == 1 { [high, low] } else { [low, high] }, ends);
            assert!(edges.edge_tets.row(coded as usize / 2).contains(&(tet as u32 * 6 + local as u32)));
        }
    }
    // The main diagonal of a cell belongs to all six of its tets.
    let diagonal = edges.edges.iter().position(|&[a, b]| {
        (mesh.vertices[b as usize] - mesh.vertices[a as usize] - DVec3::splat(0.5)).length() < 1e-15
    });
    assert_eq!(edges.edge_tets.row(diagonal.unwrap()).len(), 6);
}

/// Files come with triangles turned either way; the surface's normals all point into the tets.
#[test]
fn surface_is_oriented_from_the_tets() {
    let mut mesh = brick(2);
    for triangle in mesh.triangles.iter_mut().step_by(3) {
        triangle.swap(0, 1);
    }
    let surface = validate(&mesh).unwrap().surface;
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
        assert!((b - a).cross(c - a).dot(DVec3::splat(0.5) - a) > 0.0);
    }
    // Twins run along the same edge in opposite directions.
    for half_edge in 0..surface.opposite.len() as u32 {
        let twin = surface.opposite[half_edge as usize];
        assert_eq!(surface.opposite[twin as usize], half_edge);
        assert_eq!(surface.origin(twin), surface.origin(idmesh::mesh::half_edge::next(half_edge)));
    }
}

/// One mesh as two files may list it: other triangles first, begun and turned otherwise, and tets
/// begun at any vertex.
#[test]
fn order_of_the_file_does_not_matter() {
    let mut mesh = brick(3);
    let mut other = mesh.clone();
    let n = mesh.triangles.len();
    other.triangles = (0..n).map(|at| mesh.triangles[7 * at % n]).collect();
    other.triangle_family = (0..n).map(|at| mesh.triangle_family[7 * at % n]).collect();
    other.triangles.iter_mut().enumerate().for_each(|(at, triangle)| triangle.rotate_left(at % 3));
    other.triangles.iter_mut().step_by(2).for_each(|triangle| triangle.swap(0, 1));
    for (at, tet) in other.tets.iter_mut().enumerate() {
        let [a, b, c, d] = *tet;
        *tet = [[b, a, d, c], [c, d, a, b], [d, c, b, a], [a, c, d, b], [a, d, b, c]][at % 5];
    }
    let before = mesh.tets.clone();
    mesh.turn_tets();
    other.turn_tets();
    assert_eq!(mesh.tets, other.tets);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    for (tet, before) in mesh.tets.iter().zip(before) {
        assert!(tet[0] < tet[1] && tet[1] < tet[2].min(tet[3]) && before.iter().all(|vertex| tet.contains(vertex)));
        assert!(quality::volume(tet.map(at)) > 0.0);
    }
    let [surface, same] = [&mesh, &other].map(|mesh| validate(mesh).unwrap().surface);
    assert_eq!((&surface.triangles, &surface.family), (&same.triangles, &same.family));
    assert_eq!(surface.opposite, same.opposite);
    for (triangle, &family) in surface.triangles.iter().zip(&surface.family) {
        let of_file = other.triangles.iter().position(|other| triangle.iter().all(|vertex| other.contains(vertex)));
        assert_eq!(other.triangle_family[of_file.unwrap()], family);
    }
}

#[test]
fn families_have_their_triangles_vertices_and_curves() {
    let n = 4;
    let mesh = brick(n);
    let surface = validate(&mesh).unwrap().surface;
    let (x0, x1, y0) = (FamilyId(0), FamilyId(1), FamilyId(2));
    assert_eq!(surface.triangles_of(x0).len(), 2 * n * n);
    assert_eq!(surface.vertices_of(x0).len(), (n + 1) * (n + 1));
    assert!(surface.vertices_of(x0).iter().all(|&vertex| mesh.vertices[vertex as usize].x == 0.0));
    let loops = surface.boundary_loops(x0);
    assert_eq!(loops.len(), 1);
    assert_eq!(loops[0].len(), 4 * n);
    for (at, &half_edge) in loops[0].iter().enumerate() {
        let following = loops[0][(at + 1) % loops[0].len()];
        assert_eq!(surface.origin(idmesh::mesh::half_edge::next(half_edge)), surface.origin(following));
    }
    let curves = surface.shared_curves(x0, y0);
    assert_eq!(curves.len(), 1);
    assert!(!curves[0].closed);
    assert_eq!(curves[0].vertices.len(), n + 1);
    assert!(
        curves[0].vertices.iter().all(|&v| mesh.vertices[v as usize].x == 0.0 && mesh.vertices[v as usize].y == 0.0)
    );
    let heights: Vec<f64> = curves[0].vertices.iter().map(|&v| mesh.vertices[v as usize].z).collect();
    assert!(heights.is_sorted() || heights.is_sorted_by(|a, b| a > b), "the curve is in order: {heights:?}");
    assert!(surface.shared_curves(x0, x1).is_empty());
}

#[test]
fn a_curve_around_a_family_is_closed() {
    let mut mesh = brick(4);
    // The four inner cells of side z1 become a family of their own.
    mesh.families.push("inner".to_owned());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let inner = |v: &u32| {
            let at = mesh.vertices[*v as usize];
            at.z == 1.0 && (at.x - 0.5).abs() <= 0.25 && (at.y - 0.5).abs() <= 0.25
        };
        if triangle.iter().all(inner) {
            *family = FamilyId(6);
        }
    }
    let surface = validate(&mesh).unwrap().surface;
    let curves = surface.shared_curves(FamilyId(5), FamilyId(6));
    assert_eq!(curves.len(), 1);
    assert!(curves[0].closed);
    assert_eq!(curves[0].vertices.len(), 8);
    assert_eq!(surface.boundary_loops(FamilyId(5)).len(), 2);
}

fn refusal(change: impl FnOnce(&mut TetMesh)) -> MeshError {
    let mut mesh = brick(2);
    change(&mut mesh);
    validate(&mesh).expect_err("the mesh is broken")
}

#[test]
fn broken_meshes_are_refused_by_name() {
    assert!(matches!(refusal(|m| m.tets.clear()), MeshError::NoTets));
    assert!(matches!(refusal(|m| m.vertices[5].y = f64::NAN), MeshError::NotFinite { vertex: 5, .. }));
    assert!(matches!(
        refusal(|m| m.tets[7][2] = 27),
        MeshError::VertexOutOfRange { what: "tet", index: 7, vertex: 27, n_vertices: 27 }
    ));
    assert!(matches!(
        refusal(|m| m.triangles[3][0] = 99),
        MeshError::VertexOutOfRange { what: "triangle", index: 3, .. }
    ));
    assert!(matches!(
        refusal(|m| m.tets[4][1] = m.tets[4][0]),
        MeshError::RepeatedVertex { what: "tet", index: 4, .. }
    ));
    assert!(matches!(refusal(|m| m.tets[9].swap(0, 1)), MeshError::Inverted { count: 1, first: 9, n_tets: 48, .. }));
    assert!(matches!(
        refusal(|m| m.tets.push(m.tets[3])),
        MeshError::DuplicateCell { cells, .. } if cells.map(|cell| cell.index) == [3, 48]
    ));
    assert!(matches!(
        refusal(|m| {
            m.triangles.push(m.triangles[0]);
            m.triangle_family.push(FamilyId(0));
        }),
        MeshError::DuplicateFace { .. }
    ));
    assert!(matches!(
        refusal(|m| {
            m.triangles.remove(11);
            m.triangle_family.remove(11);
        }),
        MeshError::BoundaryWithoutFamily { count: 1, .. }
    ));
    assert!(matches!(
        refusal(|m| {
            let [a, b, c, _] = m.tets[0];
            let far = (0..27).find(|&vertex| m.vertices[vertex as usize].distance(m.vertices[a as usize]) > 1.5);
            assert!(![a, b, c].contains(&far.unwrap()));
            m.triangles.push([a, b, far.unwrap()]);
            m.triangle_family.push(FamilyId(0));
        }),
        MeshError::FacesOfNoCell { count: 1, .. }
    ));
}

/// Faults of tets and triangles are told with their families and their places.
///
/// Fails if doubled points are not told, or told of other faces.
#[test]
fn faults_are_named_by_family_and_place() {
    // The tets share the face 1 2 3.
    let mut mesh = two_tets();
    mesh.families = vec!["wing".into(), "fan\u{1b}".into()];
    let whole = mesh.clone();
    mesh.triangles.extend([[3, 2, 0], [1, 4, 0], [0, 4, 2]]);
    mesh.triangle_family.extend([FamilyId(0), FamilyId(1), FamilyId(0)]);
    // The first of the three stands in the mesh already.
    mesh.triangles.remove(whole.triangles.len());
    mesh.triangle_family.remove(whole.triangles.len());
    let n = whole.triangles.len();
    let at = |vertex: usize| format!("near {:.6}", whole.vertices[vertex]);
    assert_eq!(
        validate(&mesh).unwrap_err().to_string(),
        format!(
            "2 faces with a family are not faces of cells (1 of 'fan\\x1b', 1 of 'wing'); the first is triangle {n} of the \
             family 'fan\\x1b' with the vertices [1, 4, 0], {}; a family holds faces of the boundary, or faces between two cells",
            at(1)
        )
    );
    // Appended without merging: the surface with points of its own, and two volumes.
    let merge = "; other vertices are at the same places: if its points are doubled, merge equal points (\"Clean to Grid\" in \
                 ParaView)";
    let mut appended = whole.clone();
    let n_vertices = whole.vertices.len() as u32;
    appended.vertices.extend(whole.vertices.clone());
    appended.triangles.iter_mut().flatten().for_each(|vertex| *vertex += n_vertices);
    let error = validate(&appended).unwrap_err();
    assert!(matches!(error, MeshError::FacesOfNoCell { .. }) && error.to_string().ends_with(merge), "{error}");
    let mut apart = whole.clone();
    apart.vertices.extend(whole.vertices.clone());
    apart.tets[1].iter_mut().for_each(|vertex| *vertex += n_vertices);
    let of_second = |triangle: &[u32; 3]| triangle.iter().all(|vertex| whole.tets[1].contains(vertex));
    for triangle in apart.triangles.iter_mut().filter(|triangle| of_second(triangle)) {
        triangle.iter_mut().for_each(|vertex| *vertex += n_vertices);
    }
    let error = validate(&apart).unwrap_err();
    assert!(matches!(error, MeshError::BoundaryWithoutFamily { .. }) && error.to_string().ends_with(merge), "{error}");
    let mut mesh = whole.clone();
    mesh.triangles.push([3, 2, 1]);
    mesh.triangle_family.push(FamilyId(0));
    let all = mesh.triangle_family.iter().filter(|family| family.index() == 0).count();
    assert_eq!(
        validate(&mesh).unwrap_err().to_string(),
        format!(
            "1 of the {all} faces of the family 'wing' lie inside the volume, between two cells, the first of them {}, and the \
             others on its boundary; give the faces inside a family of their own",
            at(3)
        )
    );
    let mut mesh = whole.clone();
    let [a, b, c] = whole.triangles[1];
    mesh.triangles.push([c, b, a]);
    mesh.triangle_family.push(FamilyId(1));
    let (first, family) = (1, &whole.families[whole.triangle_family[1].index()]);
    assert_eq!(
        validate(&mesh).unwrap_err().to_string(),
        format!(
            "the face with the vertices [{c}, {b}, {a}], {}, stands in the file twice, as triangle {first} of the family \
             '{family}' and as triangle {n} of the family 'fan\\x1b'",
            at(c as usize)
        )
    );
    let mut mesh = whole.clone();
    mesh.tets.push(mesh.tets[1]);
    let place = at(whole.tets[1][0] as usize);
    let expected = format!("tet 1 and tet 2 have the same vertices, {place}");
    assert_eq!(validate(&mesh).unwrap_err().to_string(), expected);
    let mut mesh = whole.clone();
    mesh.vertices.push(10.0 * (whole.vertices[1] + whole.vertices[2] + whole.vertices[3]));
    let tet = [1, 2, 3, mesh.vertices.len() as u32 - 1];
    let corners = tet.map(|vertex| mesh.vertices[vertex as usize]);
    mesh.tets.push(if quality::volume(corners) > 0.0 { tet } else { [tet[1], tet[0], tet[2], tet[3]] });
    let error = validate(&mesh).unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("the face with the vertices [1, 2, 3], {}, belongs to 3 cells (tet ", at(1))),
        "{error}"
    );
}

/// A face between two tets may have a family. This family has no part in the surface.
#[test]
fn faces_inside_the_volume_may_have_a_family() {
    let mut mesh = two_tets();
    let surface = validate(&mesh).unwrap().surface;
    let disk = FamilyId(mesh.families.len() as u16);
    mesh.families.push("disk".into());
    mesh.triangles.insert(0, [3, 2, 1]);
    mesh.triangle_family.insert(0, disk);
    let inside = idmesh::mesh::families_inside(&mesh);
    assert_eq!(inside.iter().filter(|&&inside| inside).count(), 1);
    assert!(inside[disk.index()]);
    let with_disk = validate(&mesh).unwrap().surface;
    assert_eq!(with_disk.triangles, surface.triangles);
    assert!(with_disk.triangles_of(disk).is_empty() && with_disk.vertices_of(disk).is_empty());
    let all: Vec<u32> = (0..surface.triangles.len() as u32).collect();
    assert_eq!(with_disk.in_mesh(&all), surface.in_mesh(&all).iter().map(|face| face + 1).collect::<Vec<_>>());
}

/// Two tets that touch in an edge only: four boundary triangles meet there.
#[test]
fn a_surface_that_touches_itself_is_refused() {
    let mut mesh = two_tets();
    mesh.vertices.extend([DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 0.0, -1.0)]);
    mesh.tets = vec![[0, 1, 2, 3], [0, 1, 5, 6]];
    mesh.triangles = vec![[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1], [1, 5, 6], [0, 6, 5], [0, 1, 6], [0, 5, 1]];
    mesh.triangle_family = vec![FamilyId(0); 8];
    let error = validate(&mesh).expect_err("not a surface");
    assert!(matches!(error, MeshError::NonManifoldEdge { vertices: [0, 1], triangles: 4, .. }), "{error}");
}

#[test]
fn unused_vertices_are_named_and_allowed() {
    let mut mesh = brick(2);
    mesh.vertices.push(DVec3::splat(9.0));
    assert_eq!(validate(&mesh).unwrap().unused_vertices, [27]);
}

/// Corner tet: V = 1/6, l_max = sqrt 2, so beta = (1/6) / (2 sqrt 2); a swap of two vertices flips
/// its sign. Regular tet: 1 / (6 sqrt 2), the paper's 0.11785.
#[test]
fn beta_of_known_tets() {
    let corner = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let expected = 1.0 / (12.0 * 2f64.sqrt());
    assert!((quality::beta(corner) - expected).abs() < 4.0 * f64::EPSILON);
    assert!((quality::beta([corner[1], corner[0], corner[2], corner[3]]) + expected).abs() < 4.0 * f64::EPSILON);
    let regular = [DVec3::new(1.0, -1.0, -1.0), DVec3::ONE, DVec3::new(-1.0, 1.0, -1.0), DVec3::new(-1.0, -1.0, 1.0)];
    assert!((quality::beta(regular) - 1.0 / (6.0 * 2f64.sqrt())).abs() < 1e-15);
    assert!((quality::beta(regular.map(|p| 1e-5 * p)) - 0.117_851).abs() < 1e-6, "beta has no unit");
}

/// Beta after a motion of some vertices is what it is anew, and unmoved tets keep theirs, whatever
/// it is.
#[test]
fn beta_follows_the_vertices_that_move() {
    let mesh = brick(4);
    let before = quality::betas(&mesh.vertices, &mesh.tets);
    let mut moved = mesh.vertices.clone();
    for vertex in [3, 40, 41] {
        moved[vertex] += DVec3::new(0.2, -0.1, 0.05);
    }
    let after = quality::betas_after(before.clone(), &mesh.vertices, &moved, &mesh.tets);
    assert_eq!(after, quality::betas(&moved, &mesh.tets));
    assert_ne!(after, before);
    let marked = vec![7.0; before.len()];
    let still = quality::betas_after(marked.clone(), &mesh.vertices, &mesh.vertices, &mesh.tets);
    assert_eq!(still, marked);
    let of_some = quality::betas_after(marked, &mesh.vertices, &moved, &mesh.tets);
    for ((&beta, tet), anew) in of_some.iter().zip(&mesh.tets).zip(after) {
        let moves = tet.iter().any(|vertex| [3, 40, 41].contains(vertex));
        assert_eq!(beta, if moves { anew } else { 7.0 });
    }
}

#[test]
fn statistics_count_what_is_not_positive() {
    let s = quality::Statistics::new(&[0.1, -0.2, 0.0, 0.05]);
    assert_eq!((s.min, s.max, s.inverted), (-0.2, 0.1, 2));
    assert!((s.mean + 0.0125).abs() < 1e-17);
    let broken = quality::Statistics::new(&[0.1, f64::NAN, 0.2]);
    assert!(broken.min.is_nan() && broken.max.is_nan() && broken.inverted == 1);

    // -20, -19 ... 82 in another order: their sum is 103 * 31.
    let many: Vec<f64> = (0..103).map(|at| f64::from((at * 37) % 103 - 20)).collect();
    let s = quality::Statistics::new(&many);
    assert_eq!((s.min, s.max, s.mean, s.inverted), (-20.0, 82.0, 31.0, 21));
    for at in 0..many.len() {
        let mut broken = many.clone();
        broken[at] = f64::NAN;
        let s = quality::Statistics::new(&broken);
        assert!(s.min.is_nan() && s.max.is_nan() && s.mean.is_nan(), "{at}");
        assert_eq!(s.inverted, if many[at] > 0.0 { 22 } else { 21 }, "{at}");
    }
    assert!(quality::Statistics::new(&[]).mean.is_nan());
}
