//! The orders of vertices and cells: ways there and back, that keep neighbours together.

#[path = "common/meshes.rs"]
mod meshes;
#[path = "common/row_blocks.rs"]
mod row_blocks;

use std::path::Path;

use glam::{DQuat, DVec3};
use idmesh::constraint::Constraint;
use idmesh::formats;
use idmesh::mesh::csr::Csr;
use idmesh::mesh::edges::{TetEdges, VertexGraph};
use idmesh::mesh::{HybridMesh, Order, OtherCells, TetMesh, refine};
use idmesh::quality;
use idmesh::relaxation::{FreeRows, Network};
use meshes::brick;
use row_blocks::RowBlocks;

/// A brick with another number for each vertex, one without tets among them; and the tets
/// backwards.
fn shuffled() -> TetMesh {
    let mut mesh = brick(24);
    mesh.vertices.push(DVec3::splat(2.0));
    let n = mesh.vertices.len() as u32;
    let renumbered = |vertex: u32| (vertex * 701 + 5) % n;
    let mut vertices = mesh.vertices.clone();
    (0..n).for_each(|vertex| vertices[renumbered(vertex) as usize] = mesh.vertices[vertex as usize]);
    mesh.vertices = vertices;
    mesh.tets.reverse();
    mesh.tets.iter_mut().for_each(|tet| *tet = tet.map(renumbered));
    mesh.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(renumbered));
    mesh
}

fn on_surface(mesh: &TetMesh) -> Vec<bool> {
    let mut is_on_surface = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| is_on_surface[vertex as usize] = true);
    is_on_surface
}

#[track_caller]
fn assert_way_there_and_back(mesh: &TetMesh, order: &Order) -> TetMesh {
    let n = mesh.vertices.len() as u32;
    let ordered = order.of(mesh);
    assert!((0..n).all(|vertex| order.vertex(order.place(vertex)) == vertex));
    assert_eq!(order.of_vertices(&ordered.vertices), mesh.vertices);
    assert_eq!(order.to_vertices(&mesh.vertices), ordered.vertices);
    let at = |mesh: &TetMesh, corners: [u32; 3]| corners.map(|vertex| mesh.vertices[vertex as usize]);
    assert!((0..mesh.triangles.len()).all(|i| at(mesh, mesh.triangles[i]) == at(&ordered, ordered.triangles[i])));
    let sizes =
        |mesh: &TetMesh| quality::betas(&mesh.vertices.iter().map(|at| *at * *at).collect::<Vec<_>>(), &mesh.tets);
    assert_eq!(order.of_tets(&sizes(&ordered)), sizes(mesh));
    ordered
}

#[test]
fn breadth_first_is_a_way_there_and_back() {
    let mesh = shuffled();
    let ordered = assert_way_there_and_back(&mesh, &Order::breadth_first(&mesh));
    let mut around = vec![0; mesh.vertices.len()];
    ordered.tets.iter().flatten().for_each(|&vertex| around[vertex as usize] += 1);
    assert!(around.chunks(1024).all(|block| block.is_sorted()), "vertices with as many tets stand together");

    let gap = |mesh: &TetMesh| mesh.tets.iter().map(|tet| tet.iter().max().unwrap() - tet.iter().min().unwrap()).max();
    // Two shells of the lattice around any vertex have less than half of the vertices of three
    // sides each; and then vertices are sorted within a thousand.
    assert!(gap(&ordered).unwrap() <= 2 * 3 * 25 * 25 + 1024, "{:?}", gap(&ordered));
    assert!(gap(&mesh).unwrap() > 15_000, "{:?}", gap(&mesh));
}

#[test]
fn along_a_curve_is_a_way_there_and_back() {
    let mesh = shuffled();
    let ordered = assert_way_there_and_back(&mesh, &Order::new(&mesh, &on_surface(&mesh)));
    let first: Vec<u32> = ordered.tets.iter().map(|tet| *tet.iter().min().unwrap()).collect();
    assert!(first.is_sorted(), "each tet stands with its first vertex");
}

/// Every cell of every kind has a place, the cells that name a vertex twice too.
#[test]
fn every_cell_keeps_a_place() {
    let mut mesh = TetMesh {
        vertices: (0..12).map(|at| DVec3::new(f64::from(at * at % 7), f64::from(at), 0.1)).collect(),
        ..TetMesh::default()
    };
    mesh.tets = vec![[0, 1, 2, 3], [4, 1, 2, 3]];
    let others = OtherCells {
        pyramids: vec![[0, 1, 2, 3, 9], [5, 6, 6, 7, 8]],
        prisms: vec![[6, 7, 8, 9, 10, 11]],
        hexahedra: vec![[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 8, 10, 11]],
        ..OtherCells::default()
    };
    let order = Order::new(HybridMesh { mesh: &mesh, others: &others }, &[false; 12]);
    let (of_tets, of_others) = (order.of(&mesh), order.of_others(&others));
    let ordered = HybridMesh { mesh: &of_tets, others: &of_others };
    let given = HybridMesh { mesh: &mesh, others: &others };
    let mut seen: Vec<u32> = (0..given.n_cells() as u32).map(|place| order.cell(place)).collect();
    for (place, cell) in (0..).zip(ordered.cells()) {
        let back: Vec<u32> = cell.iter().map(|&vertex| order.vertex(vertex)).collect();
        assert_eq!(back, given.cell(given.name(order.cell(place) as usize)), "cell {place}");
    }
    seen.sort_unstable();
    assert!(seen.into_iter().eq(0..given.n_cells() as u32));
}

/// The order of a brick, whose vertices lie on the planes of a lattice, and of a wing.
#[test]
fn neither_the_unit_nor_a_turn_nor_a_mirror_changes_the_order() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -1.0, 0.7).normalize(), 0.7);
    for mesh in [shuffled(), wing()] {
        let is_held = on_surface(&mesh);
        let order_of = |vertices: Vec<DVec3>| {
            let order = Order::new(&TetMesh { vertices, ..mesh.clone() }, &is_held);
            (0..mesh.vertices.len() as u32).map(|place| order.vertex(place)).collect::<Vec<_>>()
        };
        let expected = order_of(mesh.vertices.clone());
        for factor in [1e-3, 0.3048, 1.0 / 7.0, 1e3] {
            let vertices = mesh.vertices.iter().map(|&at| factor * at);
            assert!(order_of(vertices.collect()) == expected, "in units of {factor}");
        }
        let vertices = mesh.vertices.iter().map(|&at| turn * at * 1000.0 + DVec3::new(300.0, -70.0, 11.0));
        assert!(order_of(vertices.collect()) == expected, "turned and moved away");
        let vertices = mesh.vertices.iter().map(|&at| DVec3::new(at.x, -at.y, at.z));
        assert!(order_of(vertices.collect()) == expected, "mirrored");
    }
}

/// A mesh that is a point, and no mesh, have an order too.
#[test]
fn vertices_in_one_place_have_an_order() {
    let mesh = TetMesh { vertices: vec![DVec3::ONE; 3], ..TetMesh::default() };
    let order = Order::new(&mesh, &[false; 3]);
    assert_eq!((0..3).map(|place| order.vertex(place)).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(Order::new(&TetMesh::default(), &[]).of(&TetMesh::default()).vertices.is_empty());
}

fn wing() -> TetMesh {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pitch-wing.msh.gz");
    formats::read(&file).unwrap().mesh
}

/// The rows of the vertices inside, as a device has them.
fn rows(mesh: &TetMesh, order: &Order) -> Csr {
    let mesh = order.of(mesh);
    let edges = TetEdges::new(mesh.vertices.len(), &mesh.tets).edges;
    let graph = VertexGraph::new(mesh.vertices.len(), &edges);
    let may = |is_held: bool| if is_held { Constraint::Held } else { Constraint::Free };
    let constraint = on_surface(&mesh).into_iter().map(may).collect();
    let ones = vec![1.0; edges.len()];
    let network = Network::new(&graph, &ones, &ones, constraint, vec![0.0; mesh.vertices.len()]);
    Csr::clone(&FreeRows::new(&network).network.graph)
}

/// What a workgroup of a GPU must fetch and how long its lanes wait, on the pitching wing with
/// 819 000 tets. Breadth first a row has 7.8 columns, and a block up to 2689.
#[test]
fn a_workgroup_needs_few_vertices() {
    let mesh = refine(&wing()).unwrap();
    let blocks = RowBlocks::new(&rows(&mesh, &Order::new(&mesh, &on_surface(&mesh))));
    assert!(blocks.columns_a_row <= 3.2 && blocks.most_columns <= 1200 && blocks.padding <= 0.06, "{blocks:?}");
    // The figures tell a bad order from a good one.
    let blocks = RowBlocks::new(&rows(&mesh, &Order::breadth_first(&mesh)));
    assert!(blocks.columns_a_row > 6.0 && blocks.most_columns > 2000, "{blocks:?}");
}
