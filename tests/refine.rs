//! Refined meshes against closed forms and invariants.

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use common::aircraft::WING_BODY;
use common::assert_close;
use glam::DVec3;
use idmesh::mesh::{FamilyId, MeshError, TetMesh, refine, validate};
use idmesh::quality::{self, Statistics};

fn volumes(mesh: &TetMesh) -> Vec<f64> {
    mesh.tets.iter().map(|tet| quality::volume(tet.map(|vertex| mesh.vertices[vertex as usize]))).collect()
}

fn one_tet(vertices: [DVec3; 4]) -> TetMesh {
    TetMesh {
        vertices: vertices.to_vec(),
        tets: vec![[0, 1, 2, 3]],
        triangles: vec![[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]],
        triangle_family: [0, 1, 2, 3].map(FamilyId).to_vec(),
        families: ["a", "b", "c", "d"].map(str::to_owned).to_vec(),
    }
}

/// Whatever the shape, the eight pieces have an eighth of the volume each, and the shortest
/// diagonal is an edge.
#[test]
fn a_tet_becomes_eight_along_its_shortest_diagonal() {
    let base = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    // Stretched along x - y the middles of 03 and 12 are nearest, and so on.
    for (stretch, ends) in [
        (DVec3::new(-1.0, 1.0, 1.0), [[0, 1], [2, 3]]),
        (DVec3::new(1.0, -1.0, 1.0), [[0, 2], [1, 3]]),
        (DVec3::new(1.0, 1.0, -1.0), [[0, 3], [1, 2]]),
    ] {
        // Shrinks the diagonal from the middle of the one edge to that of the other, which is half
        // of `stretch`.
        let mesh = one_tet(base.map(|at| at - 0.2 * stretch * stretch.dot(at)));
        let fine = refine(&mesh).unwrap();
        assert_eq!((fine.vertices.len(), fine.tets.len(), fine.triangles.len()), (10, 8, 16));
        assert_eq!(fine.vertices[..4], mesh.vertices[..]);
        let whole = volumes(&mesh)[0];
        volumes(&fine).into_iter().for_each(|volume| assert_close(volume, whole / 8.0, 1e-15));
        let middle = |[a, b]: [usize; 2]| {
            let at = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
            fine.vertices.iter().position(|found| found.distance(at) < 1e-15).unwrap() as u32
        };
        let [from, to] = ends.map(middle);
        let along = fine.tets.iter().filter(|tet| tet.contains(&from) && tet.contains(&to)).count();
        assert_eq!(along, 4, "{ends:?}");
    }
}

/// Families keep their area and their normals; the mesh stays one, and its outer pieces keep their
/// tets' shapes.
#[test]
fn an_aircraft_stays_what_it_is() {
    let mesh = WING_BODY.mesh();
    let fine = refine(&mesh).unwrap();
    assert_eq!(fine.tets.len(), 8 * mesh.tets.len());
    assert_eq!(fine.vertices[..mesh.vertices.len()], mesh.vertices[..]);
    assert_eq!(fine.families, mesh.families);
    // Valid: no inverted tet, every boundary triangle a face of one tet, faces in pairs.
    validate(&fine).unwrap();
    let total: f64 = volumes(&mesh).iter().sum();
    assert_close(volumes(&fine).iter().sum(), total, 1e-12 * total);
    let area_vectors = |mesh: &TetMesh| {
        let mut sums = vec![DVec3::ZERO; mesh.families.len()];
        for (triangle, family) in mesh.triangles.iter().zip(&mesh.triangle_family) {
            let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
            sums[family.index()] += (b - a).cross(c - a);
        }
        sums
    };
    for (before, after) in area_vectors(&mesh).into_iter().zip(area_vectors(&fine)) {
        assert!(before.distance(after) <= 1e-9 * before.length().max(1.0), "{before} {after}");
    }
    let [before, after] = [&mesh, &fine].map(|mesh| quality::betas(&mesh.vertices, &mesh.tets));
    for (piece, &beta) in after.iter().enumerate().filter(|(piece, _)| piece % 8 < 4) {
        assert_close(beta, before[piece / 8], 1e-10);
    }
    assert!(Statistics::new(&after).min > 0.0);
}

#[test]
fn any_number_of_threads_gives_the_same_mesh() {
    let mesh = meshes::brick(6);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| refine(&mesh).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_mesh_that_is_none_is_refused() {
    let mut mesh = meshes::brick(2);
    mesh.tets[3].swap(0, 1);
    assert!(matches!(refine(&mesh), Err(MeshError::Inverted { count: 1, first: 3, .. })));
    assert!(matches!(refine(&TetMesh::default()), Err(MeshError::NoTets)));
}
