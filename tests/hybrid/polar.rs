//! Hexahedra around an axis, where their edges have shrunk to vertices.

use super::*;

const RINGS: u32 = 2;
const AROUND: u32 = 6;
const UP: u32 = 2;

/// A disc of hexahedra. Those at the axis have the vertices of prisms.
///
/// - `with_axis`: whether a family has the faces on the axis, which have shrunk to lines
fn disc(with_axis: bool) -> (TetMesh, OtherCells) {
    let id = |ring: u32, around: u32, up: u32| match ring {
        0 => up,
        _ => (UP + 1) * (1 + (ring - 1) * AROUND + around % AROUND) + up,
    };
    let mut vertices = vec![DVec3::ZERO; ((UP + 1) * (1 + RINGS * AROUND)) as usize];
    let mut others = OtherCells::default();
    for (ring, around, up) in
        (0..=RINGS).flat_map(|ring| (0..AROUND).flat_map(move |a| (0..=UP).map(move |up| (ring, a, up))))
    {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(around) / f64::from(AROUND)).sin_cos();
        let radius = f64::from(ring) / f64::from(RINGS);
        vertices[id(ring, around, up) as usize] = DVec3::new(radius * cos, radius * sin, f64::from(up) / f64::from(UP));
    }
    for (ring, around, up) in
        (0..RINGS).flat_map(|ring| (0..AROUND).flat_map(move |a| (0..UP).map(move |up| (ring, a, up))))
    {
        let square = |up: u32| {
            [id(ring, around, up), id(ring + 1, around, up), id(ring + 1, around + 1, up), id(ring, around + 1, up)]
        };
        let ([a, b, c, d], [e, f, g, h]) = (square(up), square(up + 1));
        others.hexahedra.push([a, b, c, d, e, f, g, h]);
        let mut add = |face: [u32; 4], family: u16| {
            others.quadrilaterals.push(face);
            others.quadrilateral_family.push(FamilyId(family));
        };
        if up == 0 {
            add([a, d, c, b], 0);
        }
        if up + 1 == UP {
            add([e, f, g, h], 1);
        }
        if ring + 1 == RINGS {
            add([b, c, g, f], 2);
        }
        if ring == 0 && with_axis {
            add([a, e, h, d], 3);
        }
    }
    let families =
        ["bottom", "top", "rim", "axis"][..if with_axis { 4 } else { 3 }].iter().map(|name| (*name).to_owned());
    (TetMesh { vertices, families: families.collect(), ..TetMesh::default() }, others)
}

/// A family whose faces have shrunk to lines has no part in the surface, and lies inside. The mesh
/// moves as it does without the family.
///
/// Fails if such faces are refused, or count as faces of the boundary.
#[test]
fn faces_that_are_lines_bound_nothing() {
    let moved = |with_axis: bool| {
        let (mesh, others) = disc(with_axis);
        let hybrid = HybridMesh { mesh: &mesh, others: &others };
        validate(hybrid).unwrap();
        let inside: Vec<bool> = families_inside(hybrid);
        assert_eq!(inside, [false, false, false, true][..inside.len()]);
        let mut builder = Mover::builder(mesh.clone()).other_cells(others).role("top", Role::Prescribed);
        builder = builder.role("bottom", Role::Fixed).role("rim", Role::Fixed);
        if with_axis {
            builder = builder.role("axis", Role::Interior);
        }
        let mut mover = builder.build(cpu()).unwrap();
        let up = |at: DVec3| DVec3::Z * 0.2 * (1.0 - at.x * at.x - at.y * at.y).max(0.0);
        let by =
            mover.family_vertices("top").unwrap().iter().map(|&vertex| up(mesh.vertices[vertex as usize])).collect();
        let outcome = mover.update(&Design::of_prescribed("top", by)).unwrap();
        outcome.valid().unwrap().displacement().to_vec()
    };
    let (with_axis, without) = (moved(true), moved(false));
    assert!(without.iter().any(|by| by.z > 0.05));
    assert!(with_axis.iter().zip(&without).all(|(a, b)| a.distance(*b) < 1e-12));
}
