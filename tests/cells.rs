//! Corners and quality of pyramids, prisms and hexahedra, by closed forms.

use glam::DVec3;
use idmesh::mesh::corners::{corner_tets, faces_of, is_degenerate, n_corner_tets};
use idmesh::mesh::edges::{EDGE, TetEdges};
use idmesh::mesh::{
    CellKind, FamilyId, HybridMesh, MeshError, OtherCells, TetMesh, by_kind, cell_volume, measures, validate,
    worst_corner,
};
use idmesh::quality::{beta, scaled_jacobian, shape, volume};

const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

/// A prism with good corners and a negative volume.
const OF_BAD_VOLUME: [[f64; 3]; 6] =
    [[-1.9, 1.7, 1.4], [-1.4, -1.3, 1.4], [-1.3, -1.6, -0.3], [-0.6, -0.4, -1.3], [-1.5, 0.4, -1.7], [1.2, -1.0, -0.3]];

fn points(at: &[[f64; 3]]) -> Vec<DVec3> {
    at.iter().map(|&at| DVec3::from_array(at)).collect()
}

/// A right prism of height 1 over an equilateral triangle with edges 1.
fn prism() -> Vec<DVec3> {
    let half = 0.75f64.sqrt();
    points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, half, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.5, half, 1.0]])
}

/// A pyramid whose edges all have the length 1.
fn pyramid() -> Vec<DVec3> {
    let apex = [0.5, 0.5, 0.5f64.sqrt()];
    points(&[CUBE[0], CUBE[1], CUBE[2], CUBE[3], apex])
}

fn tet() -> Vec<DVec3> {
    let (middle, high) = ((1.0 / 12.0f64).sqrt(), (2.0 / 3.0f64).sqrt());
    points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0], [0.5, middle, high]])
}

fn cell_of(vertices: &[DVec3]) -> Vec<u32> {
    (0..vertices.len() as u32).collect()
}

fn corners_of(cell: &[u32]) -> Vec<[u32; 4]> {
    let mut tets = Vec::new();
    corner_tets(cell, &mut tets);
    assert_eq!(tets.len(), n_corner_tets(cell));
    tets
}

/// Determinant, scaled Jacobian and beta of each corner, and volume of the cell, in closed form.
#[test]
fn ideal_cells_have_their_measures() {
    let root = f64::sqrt;
    let cases = [
        (tet(), root(0.5), root(0.5), root(2.0) / 12.0, root(2.0) / 12.0),
        (pyramid(), root(0.5), root(0.5), 1.0 / 24.0, root(2.0) / 6.0),
        (prism(), root(0.75), root(0.75), root(0.75) / (6.0 * 8f64.sqrt()), root(3.0) / 4.0),
        (points(&CUBE), 1.0, 1.0, 1.0 / (6.0 * 8f64.sqrt()), 1.0),
    ];
    for (vertices, determinant, jacobian, of_beta, of_cell) in cases {
        let cell = cell_of(&vertices);
        let n = if vertices.len() == 5 { 4 } else { vertices.len() };
        let corners = if vertices.len() == 4 { vec![[0, 1, 2, 3]] } else { corners_of(&cell) };
        assert_eq!(corners.len(), if vertices.len() == 4 { 1 } else { n });
        for corner in corners {
            let at = corner.map(|vertex| vertices[vertex as usize]);
            assert!((6.0 * volume(at) - determinant).abs() < 1e-12, "{corner:?}");
            assert!((scaled_jacobian(at) - jacobian).abs() < 1e-12, "{corner:?}");
            assert!((beta(at) - of_beta).abs() < 1e-12, "{corner:?} {}", beta(at));
            assert!((shape(at, at) - 1.0).abs() < 1e-12);
        }
        assert!((cell_volume(&cell, &vertices) - of_cell).abs() < 1e-12);
    }
    // A flat hexahedron keeps its scaled Jacobian, and beta falls with its height.
    let flat: Vec<DVec3> = points(&CUBE).into_iter().map(|at| at * DVec3::new(1.0, 1.0, 1e-4)).collect();
    for corner in corners_of(&cell_of(&flat)) {
        let at = corner.map(|vertex| flat[vertex as usize]);
        assert!((6.0 * volume(at) - 1e-4).abs() < 1e-16 && (scaled_jacobian(at) - 1.0).abs() < 1e-12);
    }
}

/// A prism can have good corners and a negative volume.
#[test]
fn a_cell_with_good_corners_and_a_negative_volume_is_inverted() {
    let vertices = points(&OF_BAD_VOLUME);
    // The volume by the divergence theorem, computed with NumPy.
    assert!((cell_volume(&cell_of(&vertices), &vertices) + 0.402_666_666_666_67).abs() < 1e-12);
    for corner in corners_of(&cell_of(&vertices)) {
        assert!(volume(corner.map(|vertex| vertices[vertex as usize])) > 0.0);
    }
    let others = OtherCells { prisms: vec![[0, 1, 2, 3, 4, 5]], ..OtherCells::default() };
    let mesh = TetMesh { vertices, ..TetMesh::default() };
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let worst = worst_corner(&cell_of(&mesh.vertices), &mesh.vertices);
    assert!(worst.corner.is_none() && worst.volume < -0.4, "{worst:?}");
    assert!(measures(hybrid, &mesh.vertices, None)[0].inverted);
}

/// The message about a cell with good corners and a bad volume names the middle of the cell, here
/// the mean of six positions.
#[test]
fn a_bad_volume_has_a_place() {
    // Beside a second prism, because most prisms would be left-handed otherwise.
    let others = OtherCells { prisms: vec![[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11]], ..OtherCells::default() };
    let vertices = points(&OF_BAD_VOLUME).into_iter().chain(prism()).collect();
    let mesh = TetMesh { vertices, ..TetMesh::default() };
    let error = validate(HybridMesh { mesh: &mesh, others: &others }).unwrap_err();
    let middle = DVec3::new(-5.5, -2.2, -0.8) / 6.0;
    assert!(
        matches!(error, MeshError::InvertedCell { corner: None, at, .. } if at.distance(middle) < 1e-12),
        "{error}"
    );
    assert!(error.to_string().contains("the first is prism 0, whose volume as a whole is -4.02"), "{error}");
}

/// A cell of which nothing is left counts as inverted, whatever rounding makes of its volume, and
/// so does a cell two of whose faces lie in one place. The figures of the other cells stay finite.
#[test]
fn a_cell_of_which_nothing_is_left_is_inverted() {
    // Coordinates that are not exact: the volume by the divergence theorem is not 0 but rounding.
    let cube = points(&CUBE).into_iter().map(|at| at * DVec3::new(0.3, 0.7, 1.1) + 0.1);
    let vertices: Vec<DVec3> = cube.clone().chain(cube.take(4)).collect();
    for nothing in [[0, 1, 2, 3, 0, 1, 2, 3], [0; 8], [0, 1, 2, 3, 8, 9, 10, 11]] {
        let mesh = TetMesh { vertices: vertices.clone(), ..TetMesh::default() };
        let others = OtherCells { hexahedra: vec![[0, 1, 2, 3, 4, 5, 6, 7], nothing], ..OtherCells::default() };
        let hybrid = HybridMesh { mesh: &mesh, others: &others };
        let kinds = by_kind(hybrid, &measures(hybrid, &vertices, None), false);
        assert_eq!((kinds.len(), kinds[0].count, kinds[0].inverted), (1, 2, 1), "{nothing:?}");
        // A brick has the Jacobian 1, and nothing has 0.
        assert_eq!(kinds[0].jacobian_min, 0.0, "{nothing:?}");
        assert!((kinds[0].jacobian_mean - 0.5).abs() < 1e-12, "{nothing:?} {}", kinds[0].jacobian_mean);
        assert!(worst_corner(&nothing, &vertices).volume <= 0.0, "{nothing:?}");
    }
    assert_eq!(beta([vertices[0]; 4]), 0.0);
    let lost = DVec3::new(0.0, f64::NAN, 0.0);
    assert!(beta([lost; 4]).is_nan() && scaled_jacobian([lost; 4]).is_nan(), "a lost vertex is told");
}

/// The shape of a layer sheared by an angle is `3 / (3 + tan^2)`, and of a layer thickened by `t`
/// `3 t^(2/3) / (2 + t^2)`, whatever its thickness.
#[test]
fn shapes_of_layers_have_their_closed_forms() {
    for height in [1.0, 1e-3] {
        let thin = |at: &[f64; 3]| DVec3::new(at[0], at[1], height * at[2]);
        let before: Vec<DVec3> = CUBE.iter().map(thin).collect();
        for degrees in [0.0f64, 30.0, 45.0, 60.0] {
            let tan = degrees.to_radians().tan();
            let after: Vec<DVec3> = before.iter().map(|at| *at + DVec3::X * (tan * at.z)).collect();
            for corner in corners_of(&cell_of(&before)) {
                let [now, then] = [&after, &before].map(|of| corner.map(|vertex| of[vertex as usize]));
                assert!((shape(now, then) - 3.0 / (3.0 + tan * tan)).abs() < 1e-9, "{height} {degrees}");
                assert!((scaled_jacobian(now) - degrees.to_radians().cos()).abs() < 1e-9);
            }
        }
        for by in [0.5, 2.0, 2.86] {
            let after: Vec<DVec3> = before.iter().map(|at| *at * DVec3::new(1.0, 1.0, by)).collect();
            let corner = corners_of(&cell_of(&before))[6];
            let [now, then] = [&after, &before].map(|of| corner.map(|vertex| of[vertex as usize]));
            assert!((shape(now, then) - 3.0 * f64::powf(by, 2.0 / 3.0) / (2.0 + by * by)).abs() < 1e-9);
        }
    }
}

/// A tet that is turned over has the shape -1 to 0.
#[test]
fn a_mirrored_corner_has_a_negative_shape() {
    let [a, b, c, d] = [0, 1, 3, 4].map(|corner| DVec3::from_array(CUBE[corner]));
    assert!((shape([a, c, b, d], [a, b, c, d]) + 1.0).abs() < 1.0 && shape([a, c, b, d], [a, b, c, d]) < 0.0);
    assert!(scaled_jacobian([a, c, b, d]) == -1.0);
}

/// The sums of `1 / sin^2` over the corner tets at each edge of the ideal cells, in closed form:
/// the stiffness of torsional springs.
#[test]
fn sums_of_corner_tets_have_their_closed_forms() {
    let third = 1.0 / 3.0;
    // For each cell: the sum at an edge by its length, or at the edges of the pyramid's base.
    let sums = |vertices: &[DVec3], tets: &[[u32; 4]]| -> Vec<([u32; 2], f64)> {
        let edges = TetEdges::new(vertices.len(), tets);
        let sum = |edge: usize| {
            let around = edges.edge_tets.row(edge).iter();
            let of_tet = |&entry: &u32| {
                let tet = tets[entry as usize / 6];
                let [a, b] = EDGE[entry as usize % 6];
                let others: Vec<usize> = (0..4).filter(|local| ![a, b].contains(local)).collect();
                // The angle at the edge opposite, between the faces that hold it.
                let at = |local: usize| vertices[tet[local] as usize];
                let axis = (at(others[1]) - at(others[0])).normalize();
                let arm = |local: usize| (at(local) - at(others[0])).reject_from(axis).normalize();
                1.0 / arm(a).cross(arm(b)).length_squared()
            };
            around.map(of_tet).sum::<f64>()
        };
        edges.edges.iter().enumerate().map(|(edge, ends)| (*ends, sum(edge))).collect()
    };
    let length = |vertices: &[DVec3], [a, b]: [u32; 2]| vertices[a as usize].distance(vertices[b as usize]);
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} {expected}");

    let cube = points(&CUBE);
    for (edge, sum) in sums(&cube, &corners_of(&cell_of(&cube))) {
        near(sum, if length(&cube, edge) < 1.1 { 3.0 } else { 2.0 });
    }
    let prism = prism();
    for (edge, sum) in sums(&prism, &corners_of(&cell_of(&prism))) {
        let in_triangle = (edge[0] < 3) == (edge[1] < 3);
        let is_diagonal = length(&prism, edge) > 1.1;
        near(
            sum,
            if is_diagonal {
                2.0
            } else if in_triangle {
                11.0 * third
            } else {
                3.5
            },
        );
    }
    let pyramid = pyramid();
    for (edge, sum) in sums(&pyramid, &corners_of(&cell_of(&pyramid))) {
        let is_diagonal = length(&pyramid, edge) > 1.1;
        near(
            sum,
            if is_diagonal {
                2.25
            } else if edge[1] == 4 {
                4.0
            } else {
                3.0
            },
        );
    }
    let tet = tet();
    for (_, sum) in sums(&tet, &[[0, 1, 2, 3]]) {
        near(sum, 9.0 / 8.0);
    }
}

/// A hexahedron with an edge shrunk to a vertex has the corners that exist, and a hexahedron with
/// two opposite edges shrunk has those of the prism that it is.
#[test]
fn degenerate_cells_have_the_corners_that_exist() {
    let sorted = |tets: Vec<[u32; 4]>| {
        let mut tets: Vec<[u32; 4]> = tets;
        for tet in &mut tets {
            // The corner stays in front, the others turn.
            let lowest = (1..4).min_by_key(|&place| tet[place]).unwrap();
            tet[1..].rotate_left(lowest - 1);
        }
        tets.sort_unstable();
        tets
    };
    assert!(is_degenerate(&[0, 1, 2, 2, 3, 4, 5, 5]));
    assert_eq!(sorted(corners_of(&[0, 1, 2, 2, 3, 4, 5, 5])), sorted(corners_of(&[0, 1, 2, 3, 4, 5])), "the prism");
    assert_eq!(sorted(corners_of(&[0, 1, 2, 3, 4, 4, 4, 4])), sorted(corners_of(&[0, 1, 2, 3, 4])), "the pyramid");
    assert_eq!(
        sorted(corners_of(&[0, 1, 2, 2, 3, 3])).len(),
        2,
        "a tet with one edge for two: {:?}",
        corners_of(&[0, 1, 2, 2, 3, 3])
    );
    assert_eq!(corners_of(&[0, 1, 2, 3, 3, 3]).len(), 4, "the tet at each of its corners");
    // One edge of the cube's top shrinks: both its faces become triangles, and all edges at the
    // vertex are four.
    let shrunk = [0, 1, 2, 3, 4, 4, 6, 7];
    let corners = corners_of(&shrunk);
    assert_eq!(corners.iter().map(|corner| corner[0]).collect::<Vec<_>>(), [0, 1, 2, 3, 6, 7]);
    let mut vertices = points(&CUBE);
    vertices[4] = DVec3::new(0.5, 0.0, 1.0);
    assert!(corners.iter().all(|corner| volume(corner.map(|vertex| vertices[vertex as usize])) > 0.0));
    assert_eq!(faces_of(&shrunk).map(|face| face.vertices().len()).collect::<Vec<_>>(), [4, 3, 3, 4, 4, 4]);
    // Each of two sides leans in by up to 1 / 2 at one of its four vertices, 1 / 8 in the mean.
    assert!((cell_volume(&shrunk, &vertices) - 0.75).abs() < 1e-12, "{}", cell_volume(&shrunk, &vertices));
}

/// The corners of every kind do not depend on the vertex with which the cell begins: turned round
/// its axis, a cell has the same corners.
#[test]
fn corners_do_not_depend_on_the_first_vertex() {
    let key = |tets: Vec<[u32; 4]>| {
        let mut tets: Vec<[u32; 4]> = tets;
        tets.iter_mut().for_each(|tet| tet[1..].sort_unstable());
        tets.sort_unstable();
        tets
    };
    assert_eq!(key(corners_of(&[0, 1, 2, 3, 4])), key(corners_of(&[1, 2, 3, 0, 4])));
    assert_eq!(key(corners_of(&[0, 1, 2, 3, 4, 5])), key(corners_of(&[4, 3, 5, 1, 0, 2])));
    assert_eq!(key(corners_of(&[0, 1, 2, 3, 4, 5, 6, 7])), key(corners_of(&[1, 5, 6, 2, 0, 4, 7, 3])));
}

/// A brick of one hexahedron with a pyramid on top and a prism at its side.
fn mixed() -> (TetMesh, OtherCells) {
    let mut vertices = points(&CUBE);
    vertices.extend([DVec3::new(0.5, 0.5, 2.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(2.0, 1.0, 0.0)]);
    let mesh = TetMesh {
        vertices,
        triangles: vec![[4, 5, 8], [5, 6, 8], [6, 7, 8], [7, 4, 8], [1, 5, 9], [2, 10, 6]],
        triangle_family: vec![FamilyId(0); 6],
        families: vec!["wall".into()],
        ..TetMesh::default()
    };
    let others = OtherCells {
        pyramids: vec![[4, 5, 6, 7, 8]],
        prisms: vec![[1, 5, 9, 2, 6, 10]],
        hexahedra: vec![[0, 1, 2, 3, 4, 5, 6, 7]],
        quadrilaterals: vec![[0, 1, 2, 3], [0, 4, 5, 1], [3, 2, 6, 7], [0, 3, 7, 4], [1, 2, 10, 9], [5, 9, 10, 6]],
        quadrilateral_family: vec![FamilyId(0); 6],
    };
    (mesh, others)
}

/// The surface of a mesh with other cells closes, and its diagonals are no edges.
#[test]
fn quadrilaterals_are_two_triangles_without_a_spring_between() {
    let (mesh, others) = mixed();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let surface = validate(hybrid).unwrap().surface;
    assert_eq!(surface.triangles.len(), 6 + 2 * 6);
    let all: Vec<u32> = (0..surface.triangles.len() as u32).collect();
    assert_eq!(surface.in_mesh(&all), (0..12).collect::<Vec<u32>>());
    // Euler: vertices - edges + faces = 2 on a closed surface. All 11 vertices are on it.
    assert_eq!(surface.edges_of(&all).len(), 11 + 12 - 2);
    let diagonals = (0..surface.opposite.len() as u32).filter(|&half_edge| surface.is_diagonal(half_edge)).count();
    assert_eq!(diagonals, 2 * 6);
    // All normals point into the cells, whose middle is near this point.
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
        assert!((b - a).cross(c - a).dot(DVec3::new(0.7, 0.5, 0.6) - a) > 0.0);
    }
}

/// Each quadrilateral is divided along its shorter diagonal, whatever the numbers of its vertices.
#[test]
fn the_shorter_diagonal_divides() {
    for turn in 0..4 {
        let (mut mesh, mut others) = mixed();
        // The bottom of the hexahedron becomes a rhombus with the short diagonal 1 3.
        mesh.vertices[0] -= DVec3::new(0.3, 0.3, 0.0);
        others.quadrilaterals[0].rotate_left(turn);
        let hybrid = HybridMesh { mesh: &mesh, others: &others };
        let surface = validate(hybrid).unwrap().surface;
        let has = |triangle: [u32; 3]| {
            surface.triangles.iter().any(|found| {
                let mut found = *found;
                found.sort_unstable();
                found == triangle
            })
        };
        assert!(has([0, 1, 3]) && has([1, 2, 3]), "{turn}");
    }
}

/// Faults of other cells are told with the kind, the cell, the corner and the place.
#[test]
fn faults_of_other_cells_are_named() {
    let refusal = |change: &dyn Fn(&mut TetMesh, &mut OtherCells)| {
        let (mut mesh, mut others) = mixed();
        change(&mut mesh, &mut others);
        validate(HybridMesh { mesh: &mesh, others: &others }).unwrap_err()
    };
    let inverted = |change: &dyn Fn(&mut TetMesh, &mut OtherCells)| match refusal(change) {
        MeshError::InvertedCell { kind, count: 1, n_cells: 1, first: 0, corner, volume, .. } => (kind, corner, volume),
        error => panic!("{error}"),
    };
    // SU2's counter-example: the cube has a positive volume, and one corner has not.
    let (kind, corner, volume) = inverted(&|mesh, _| mesh.vertices[0].z = 1.5);
    assert!(kind == CellKind::Hexahedron && corner == Some(0) && (volume + 0.5 / 6.0).abs() < 1e-15);
    // The apex lies in the base.
    assert_eq!(inverted(&|mesh, _| mesh.vertices[8].z = 1.0).0, CellKind::Pyramid);
    let (kind, corner, _) = inverted(&|mesh, _| mesh.vertices[9].x = 0.9);
    assert!(kind == CellKind::Prism && corner.is_some());
    assert!(matches!(
        refusal(&|_, others| others.prisms[0].swap(1, 2)),
        MeshError::InvertedCell { kind: CellKind::Prism, .. } | MeshError::LeftHanded { kind: CellKind::Prism, .. }
    ));
    assert!(matches!(
        refusal(&|_, others| others.hexahedra[0][3] = 11),
        MeshError::VertexOutOfRange { what: "hexahedron", index: 0, vertex: 11, n_vertices: 11 }
    ));
    assert!(matches!(refusal(&|_, others| others.prisms[0] = [3; 6]), MeshError::Shrunk { what: "prism", .. }));
    assert!(matches!(
        refusal(&|_, others| others.hexahedra.push([1, 2, 3, 0, 5, 6, 7, 4])),
        MeshError::DuplicateCell { .. } | MeshError::FaceOfManyCells { .. }
    ));
    assert!(matches!(
        refusal(&|_, others| {
            others.quadrilaterals.pop();
            others.quadrilateral_family.pop();
        }),
        MeshError::BoundaryWithoutFamily { count: 1, .. }
    ));
    assert!(matches!(
        refusal(&|_, others| {
            others.quadrilaterals.push([2, 1, 5, 6]);
            others.quadrilateral_family.push(FamilyId(0));
        }),
        MeshError::PartlyInside { inside: 1, all: 13, .. }
    ));
}

/// A quadrilateral that joins the vertices of a cell's face crosswise is refused, and so are cells
/// on the same side of their common face.
#[test]
fn faces_and_cells_that_do_not_fit_are_refused() {
    let (mesh, mut others) = mixed();
    others.quadrilaterals[0].swap(1, 2);
    assert!(matches!(
        validate(HybridMesh { mesh: &mesh, others: &others }),
        Err(MeshError::CrossedFace { ref face, .. }) if face == "quadrilateral 0"
    ));
    // Crosswise between two cells.
    let (mut mesh, mut others) = mixed();
    mesh.families.push("disk".into());
    others.quadrilaterals.push([1, 6, 2, 5]);
    others.quadrilateral_family.push(FamilyId(1));
    assert!(matches!(validate(HybridMesh { mesh: &mesh, others: &others }), Err(MeshError::CrossedFace { .. })));
    *others.quadrilaterals.last_mut().unwrap() = [1, 2, 6, 5];
    validate(HybridMesh { mesh: &mesh, others: &others }).unwrap();
    // Two tets on one triangle, both above it.
    let at = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.2, 0.2, 0.5]];
    let folded = TetMesh {
        vertices: points(&at),
        tets: vec![[0, 1, 2, 3], [0, 1, 2, 4]],
        triangles: vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 4], [1, 2, 4], [2, 0, 4]],
        triangle_family: vec![FamilyId(0); 6],
        families: vec!["wall".into()],
    };
    let error = validate(&folded).unwrap_err();
    assert!(matches!(error, MeshError::SameSide { .. }), "{error}");
    assert!(error.to_string().starts_with("tet 0 and tet 1 lie on the same side of their common face"), "{error}");
}

/// A valid hexahedron whose faces are so warped that two of its eight pieces would be inverted.
#[test]
fn pieces_that_would_be_inverted_are_refused() {
    let at = [
        [-0.7112467804933641, 0.4127689918604781, 0.4638231583006024],
        [1.1690406275408092, 0.16847999431519575, 0.4910088309259646],
        [0.8687489505598188, 1.545304925404524, -0.14058731302941707],
        [-0.32058390313720514, 0.28115287383411747, -0.8775507688686391],
        [0.5281220619767704, 0.3653874626468514, 1.3056517011549003],
        [1.7925312704923233, 0.04441840044567436, 1.5828154804397374],
        [-0.04298920725492206, 1.6797467991423385, 0.7087465835254554],
        [-0.46504125177363587, 1.029364398409872, 0.792072705919759],
    ];
    let mesh = TetMesh { vertices: points(&at), families: vec!["wall".into()], ..TetMesh::default() };
    let others = OtherCells {
        hexahedra: vec![[0, 1, 2, 3, 4, 5, 6, 7]],
        quadrilaterals: vec![[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
        quadrilateral_family: vec![FamilyId(0); 6],
        ..OtherCells::default()
    };
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    validate(hybrid).unwrap();
    let error = idmesh::mesh::refine_hybrid(hybrid).unwrap_err();
    assert!(matches!(error, MeshError::Refined(_)), "{error}");
    assert!(
        error.to_string().contains("refined, the mesh would not be valid: 2 of 8 hexahedra are inverted"),
        "{error}"
    );
}

/// Each kind is counted and measured by itself.
#[test]
fn kinds_are_measured_apart() {
    let (mesh, others) = mixed();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let mut moved = mesh.vertices.clone();
    moved[8].z = 0.5;
    let kinds = by_kind(hybrid, &measures(hybrid, &moved, Some(&mesh.vertices)), true);
    let of = |kind: CellKind| *kinds.iter().find(|quality| quality.kind == kind).unwrap();
    assert_eq!(kinds.len(), 3);
    assert_eq!(
        kinds.iter().map(|quality| (quality.count, quality.inverted)).collect::<Vec<_>>(),
        [(1, 1), (1, 0), (1, 0)]
    );
    assert!((of(CellKind::Hexahedron).jacobian_min - 1.0).abs() < 1e-15);
    assert!((of(CellKind::Hexahedron).shape_min.unwrap() - 1.0).abs() < 1e-15);
    assert!((of(CellKind::Prism).jacobian_min - 0.5f64.sqrt()).abs() < 1e-12);
    assert!(of(CellKind::Pyramid).jacobian_min < 0.0 && of(CellKind::Pyramid).shape_min.unwrap() < 0.0);
}
