//! Small meshes with known answers.

use glam::DVec3;
use idmesh::mesh::{FamilyId, TetMesh};

/// A brick of `n` cells a side over the unit cube, each cell six tets around its main diagonal
/// (Kuhn); its sides are the families `x0 x1 y0 y1 z0 z1`.
pub fn brick(n: usize) -> TetMesh {
    let index = |i: usize, j: usize, k: usize| (i * (n + 1) * (n + 1) + j * (n + 1) + k) as u32;
    let mut mesh = TetMesh::default();
    for i in 0..=n {
        for j in 0..=n {
            for k in 0..=n {
                mesh.vertices.push(DVec3::new(i as f64, j as f64, k as f64) / n as f64);
            }
        }
    }
    // The six orders in which a path along the cell's edges can take the axes; odd ones give
    // mirrored tets.
    const PATHS: [([usize; 3], bool); 6] = [
        ([0, 1, 2], false),
        ([1, 2, 0], false),
        ([2, 0, 1], false),
        ([0, 2, 1], true),
        ([2, 1, 0], true),
        ([1, 0, 2], true),
    ];
    for cell in 0..n * n * n {
        let corner = [cell / (n * n), cell / n % n, cell % n];
        for (path, mirrored) in PATHS {
            let mut at = corner;
            let mut tet = [index(at[0], at[1], at[2]); 4];
            for (step, axis) in path.into_iter().enumerate() {
                at[axis] += 1;
                tet[step + 1] = index(at[0], at[1], at[2]);
            }
            if mirrored {
                tet.swap(2, 3);
            }
            mesh.tets.push(tet);
        }
    }
    mesh.families = ["x0", "x1", "y0", "y1", "z0", "z1"].map(String::from).to_vec();
    name_sides(&mut mesh);
    mesh
}

fn name_sides(mesh: &mut TetMesh) {
    for tet in &mesh.tets {
        for face in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]] {
            let triangle = face.map(|local: usize| tet[local]);
            for side in 0..6 {
                let (axis, value) = (side / 2, (side % 2) as f64);
                if triangle.iter().all(|&vertex| mesh.vertices[vertex as usize][axis] == value) {
                    mesh.triangles.push(triangle);
                    mesh.triangle_family.push(FamilyId(side as u16));
                }
            }
        }
    }
}

/// The tet with the corners 0, x, y, z, and a second one mirrored behind its slanted face; one
/// family, `all`.
#[allow(dead_code, reason = "not every test uses every mesh")]
pub fn two_tets() -> TetMesh {
    TetMesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE],
        tets: vec![[0, 1, 2, 3], [4, 2, 1, 3]],
        triangles: vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [4, 1, 2], [4, 1, 3], [4, 2, 3]],
        triangle_family: vec![FamilyId(0); 6],
        families: vec!["all".to_owned()],
    }
}
