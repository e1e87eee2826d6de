//! Boxes of tets with bodies carved out of them: small aircraft with whatever families a test
//! wants.

use std::collections::HashMap;

use glam::DVec3;
use idmesh::mesh::{FamilyId, TetMesh};

/// The six ways from a cell's lowest corner to its highest, one axis after the other; odd ones give
/// mirrored tets.
const PATHS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], false),
    ([1, 2, 0], false),
    ([2, 0, 1], false),
    ([0, 2, 1], true),
    ([2, 1, 0], true),
    ([1, 0, 2], true),
];

/// A box of `cells` unit cubes from the origin on, six tets each (Kuhn), without the tets in a
/// body.
///
/// - `is_body`: whether a tet belongs to a body, from its centre. Bodies follow cell faces or the
///   diagonal planes `x = y`, `y = z`, `x = z` of cells
/// - `family`: the family of a boundary triangle, from its corners
/// - `place`: from these coordinates to where the vertex shall be; must not mirror
pub fn carve(
    cells: [usize; 3],
    families: &[&str],
    is_body: impl Fn(DVec3) -> bool,
    family: impl Fn([DVec3; 3]) -> &'static str,
    place: impl Fn(DVec3) -> DVec3,
) -> TetMesh {
    let mut mesh = TetMesh { families: families.iter().map(|name| name.to_string()).collect(), ..TetMesh::default() };
    let mut number = HashMap::new();
    let mut grid: Vec<DVec3> = Vec::new();
    for cell in 0..cells.iter().product() {
        let corner = [cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]];
        for (path, mirrored) in PATHS {
            let mut at = corner;
            let mut corners = [at; 4];
            for (step, axis) in path.into_iter().enumerate() {
                at[axis] += 1;
                corners[step + 1] = at;
            }
            if mirrored {
                corners.swap(2, 3);
            }
            let points = corners.map(|corner| DVec3::from_array(corner.map(|i| i as f64)));
            if is_body(points.iter().sum::<DVec3>() / 4.0) {
                continue;
            }
            mesh.tets.push(corners.map(|corner| {
                *number.entry(corner).or_insert_with(|| {
                    grid.push(DVec3::from_array(corner.map(|i| i as f64)));
                    grid.len() as u32 - 1
                })
            }));
        }
    }
    let mut faces: HashMap<[u32; 3], usize> = HashMap::new();
    let face = |tet: &[u32; 4], skip: usize| {
        let mut face = [0, 1, 2, 3].map(|local| tet[local]).to_vec();
        face.remove(skip);
        [face[0], face[1], face[2]]
    };
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let all = || mesh.tets.iter().flat_map(|tet| (0..4).map(move |skip| face(tet, skip)));
    all().for_each(|face| *faces.entry(sorted(face)).or_default() += 1);
    let boundary: Vec<[u32; 3]> = all().filter(|&face| faces[&sorted(face)] == 1).collect();
    for triangle in boundary {
        let name = family(triangle.map(|vertex| grid[vertex as usize]));
        mesh.triangles.push(triangle);
        mesh.triangle_family.push(mesh.family(name).unwrap_or_else(|| panic!("no family `{name}`")));
    }
    assert!((0..families.len()).all(|index| mesh.triangle_family.contains(&FamilyId(index as u16))), "empty family");
    mesh.vertices = grid.into_iter().map(place).collect();
    mesh
}

/// Whether all corners of a triangle have this coordinate.
pub fn on(triangle: [DVec3; 3], axis: usize, value: f64) -> bool {
    triangle.iter().all(|corner| corner[axis] == value)
}
