//! A symmetric mesh with a symmetric motion moves symmetrically.

use super::*;

/// Cubes a side.
const N: u32 = 4;

/// A unit cube of cubes, with a family on each side.
fn cubes() -> (TetMesh, OtherCells) {
    let id = |[x, y, z]: [u32; 3]| (z * (N + 1) + y) * (N + 1) + x;
    let ends = 0..=N;
    let vertices = ends
        .clone()
        .flat_map(|z| ends.clone().flat_map(move |y| (0..=N).map(move |x| [x, y, z])))
        .map(|at| DVec3::from_array(at.map(|place| f64::from(place) / f64::from(N))))
        .collect();
    let mut others = OtherCells::default();
    let square = [[0, 0], [1, 0], [1, 1], [0, 1]];
    for (x, y, z) in (0..N).flat_map(|x| (0..N).flat_map(move |y| (0..N).map(move |z| (x, y, z)))) {
        let corner = |up: u32| square.map(|[right, back]| id([x + right, y + back, z + up]));
        let ([a, b, c, d], [e, f, g, h]) = (corner(0), corner(1));
        others.hexahedra.push([a, b, c, d, e, f, g, h]);
    }
    for (axis, end) in (0..3).flat_map(|axis| [0, N].map(|end| (axis, end))) {
        for (one, other) in (0..N).flat_map(|one| (0..N).map(move |other| (one, other))) {
            let corner = |[right, back]: [u32; 2]| {
                let mut at = [end; 3];
                (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (one + right, other + back);
                id(at)
            };
            others.quadrilaterals.push(square.map(corner));
            others.quadrilateral_family.push(FamilyId(2 * axis as u16 + u16::from(end > 0)));
        }
    }
    let families = ["wall", "x1", "y0", "y1", "z0", "z1"].map(str::to_owned).to_vec();
    (TetMesh { vertices, families, ..TetMesh::default() }, others)
}

/// A bump that is symmetric about y = 1/2 pushes a wall of squares in. The two diagonals of a
/// square are equally long, and the pushed squares are warped.
///
/// Fails if the normals of the wall come from the squares divided along one diagonal: then the two
/// halves differ by 5e-3 of the bump.
#[test]
fn a_symmetric_bump_moves_cubes_symmetrically() {
    let (mesh, others) = cubes();
    validate(HybridMesh { mesh: &mesh, others: &others }).unwrap();
    let mut mover = Mover::builder(mesh.clone()).other_cells(others).method(Method::Chebyshev);
    mover = mover.stopping(Stopping { tolerance: 1e-10, max_sweeps: 100_000 }).role("x1", Role::Fixed);
    for side in ["y0", "y1", "z0", "z1"] {
        mover = mover.role(side, Role::PLANE);
    }
    let mut mover = mover.role("wall", Role::Prescribed).build(cpu()).unwrap();
    let bump = |at: DVec3| {
        let across = (std::f64::consts::PI * at.y).sin();
        DVec3::X * 0.3 * across * (std::f64::consts::PI * at.z).sin().powi(2)
    };
    let vertices = mover.family_vertices("wall").unwrap();
    let by = vertices.iter().map(|&vertex| bump(mesh.vertices[vertex as usize])).collect();
    let outcome = mover.update(&Design::of_prescribed("wall", by)).unwrap();
    let moved = outcome.valid().unwrap().displacement();
    for (vertex, at) in mesh.vertices.iter().enumerate() {
        let mirrored = DVec3::new(at.x, 1.0 - at.y, at.z);
        let twin = mesh.vertices.iter().position(|other| other.distance(mirrored) < 1e-12).unwrap();
        let expected = DVec3::new(moved[twin].x, -moved[twin].y, moved[twin].z);
        assert!(moved[vertex].distance(expected) < 1e-8, "{at}: {} {expected}", moved[vertex]);
    }
}
