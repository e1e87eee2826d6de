//! Local optimisation of cells that are no tets, and of tets beside them.

use super::*;

const SIDE: u32 = 6;

/// The place of a vertex in a cube of `SIDE` x `SIDE` x `SIDE` hexahedra.
fn place(vertex: u32) -> [u32; 3] {
    [vertex % (SIDE + 1), vertex / (SIDE + 1) % (SIDE + 1), vertex / (SIDE + 1).pow(2)]
}

fn cube() -> (TetMesh, OtherCells) {
    let at = |i: u32, j: u32, k: u32| (SIDE + 1) * ((SIDE + 1) * k + j) + i;
    let n = (SIDE + 1).pow(3);
    let mesh = TetMesh {
        vertices: (0..n).map(|vertex| DVec3::from_array(place(vertex).map(f64::from))).collect(),
        ..TetMesh::default()
    };
    let mut others = OtherCells::default();
    for cell in 0..SIDE.pow(3) {
        let [i, j, k] = [cell % SIDE, cell / SIDE % SIDE, cell / SIDE.pow(2)];
        let base = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        let ([a, b, c, d], [e, f, g, h]) = (base(k), base(k + 1));
        others.hexahedra.push([a, b, c, d, e, f, g, h]);
    }
    (mesh, others)
}

/// The vertices inside the cube may move.
fn constraints_of_cube() -> Vec<Constraint> {
    let inside = |vertex: u32| place(vertex).iter().all(|&at| at > 0 && at < SIDE);
    (0..(SIDE + 1).pow(3)).map(|vertex| if inside(vertex) { Constraint::Free } else { Constraint::Held }).collect()
}

/// Local optimisation brings bad corners back, and leaves an unmoved mesh as it is.
#[test]
fn local_optimisation_mends_corners() {
    let (mesh, others) = cube();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let (simplices, cells) = CornerCells::new(hybrid);
    let constraint = constraints_of_cube();
    let merit = Merit::new(Arc::new(cells), &simplices.tets, &mesh.vertices, 0.75);
    let mut tangled = mesh.vertices.clone();
    for vertex in (0..tangled.len()).filter(|&vertex| constraint[vertex] == Constraint::Free) {
        tangled[vertex] += 0.8 * common::brick::noise_vector(vertex);
    }
    let n_bad = |at: &[DVec3]| measures(hybrid, at, None).iter().filter(|cell| cell.inverted).count();
    assert!(n_bad(&tangled) > 50, "{}", n_bad(&tangled));
    let backend = cpu();
    let mut smoother =
        Smoother::new(backend.as_ref(), &simplices.tets, &mesh.vertices, &constraint, &[], QualityTarget::Original)
            .with_merit(merit.clone());
    // An unmoved mesh is at its optimum.
    let goal = Goal { beta: 1.0, max_sweeps: 400 };
    let mut still = mesh.vertices.clone();
    let mut of_still = merit.of_all(&simplices.tets, &still);
    assert_eq!(smoother.run(&mut still, &mut of_still, &goal, None).unwrap().moved, 0);
    let mut of_tangled = merit.of_all(&simplices.tets, &tangled);
    let smoothed = smoother.run(&mut tangled, &mut of_tangled, &goal, None).unwrap();
    assert_eq!((smoothed.inverted, n_bad(&tangled)), (0, 0));
    let shape = measures(hybrid, &tangled, Some(&mesh.vertices)).iter().map(|cell| cell.shape()).fold(1.0, f64::min);
    assert!(shape > 0.3, "{shape}");
}

/// Where a corner is inverted, its vertices move, and no further ones: the layers around keep every
/// bit.
///
/// Fails if one more ring of vertices moves.
#[test]
fn only_the_vertices_of_bad_corners_move() {
    let (mesh, others) = cube();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let (simplices, cells) = CornerCells::new(hybrid);
    let merit = Merit::new(Arc::new(cells), &simplices.tets, &mesh.vertices, 0.75);
    let mut at = mesh.vertices.clone();
    let middle = DVec3::splat(f64::from(SIDE / 2));
    let displaced = at.iter().position(|&at| at == middle).unwrap();
    at[displaced] += DVec3::new(0.0, 0.0, 1.1);
    let mut of_corners = merit.of_all(&simplices.tets, &at);
    assert!(of_corners.iter().any(|&merit| merit < 0.0));
    let (backend, constraint) = (cpu(), constraints_of_cube());
    let mut smoother =
        Smoother::new(backend.as_ref(), &simplices.tets, &mesh.vertices, &constraint, &[], QualityTarget::Original)
            .with_merit(merit);
    let smoothed = smoother.run(&mut at, &mut of_corners, &Goal { beta: 0.75, max_sweeps: 400 }, None).unwrap();
    assert!(smoothed.inverted == 0 && smoothed.moved > 1, "{smoothed:?}");
    for (was, at) in mesh.vertices.iter().zip(&at) {
        assert!((*was - middle).abs().max_element() <= 1.0 || at == was, "{was}: {at}");
    }
}

/// A layer may become a tenth as thick, and not a fiftieth, which leaves its angles as they are.
///
/// Fails if `SHAPE` is 0 or 0.4.
#[test]
fn flattened_corners_are_bad() {
    let (mesh, others) = cube();
    let (simplices, cells) = CornerCells::new(HybridMesh { mesh: &mesh, others: &others });
    let merit = Merit::new(Arc::new(cells), &simplices.tets, &mesh.vertices, 0.75);
    for (thickness, is_good) in [(0.1, true), (0.02, false)] {
        let at: Vec<DVec3> = mesh.vertices.iter().map(|&at| at * DVec3::new(1.0, 1.0, thickness)).collect();
        let of_corners = merit.of_all(&simplices.tets, &at);
        assert!(of_corners.iter().all(|&merit| (merit >= 0.75) == is_good), "{thickness}: {}", of_corners[0]);
    }
}

/// Tets that are merely bad do not move the vertices of the layers beside them.
#[test]
fn bad_tets_do_not_move_layers() {
    let file = small();
    let hybrid = HybridMesh { mesh: &file.mesh, others: &file.others };
    let (simplices, cells) = CornerCells::new(hybrid);
    let (n_tets, undeformed) = (file.mesh.tets.len(), &file.mesh.vertices);
    let marked = |lists: &mut dyn Iterator<Item = &[u32]>| {
        let mut marked = vec![false; undeformed.len()];
        lists.flatten().for_each(|&vertex| marked[vertex as usize] = true);
        marked
    };
    let of_layers = marked(&mut simplices.tets[n_tets..].iter().map(|tet| &tet[..]));
    let faces = file.mesh.triangles.iter().map(|face| &face[..]);
    let on_surface = marked(&mut faces.chain(file.others.quadrilaterals.iter().map(|face| &face[..])));
    let constraint: Vec<Constraint> =
        on_surface.iter().map(|&held| if held { Constraint::Held } else { Constraint::Free }).collect();
    let lowest =
        file.mesh.tets.iter().map(|tet| beta(tet.map(|vertex| undeformed[vertex as usize]))).fold(1.0, f64::min);
    let merit = Merit::new(Arc::new(cells), &simplices.tets, undeformed, lowest);
    // Vertices of tets alone, each near a vertex of the layers that may move.
    let mut at = undeformed.clone();
    for tet in &file.mesh.tets {
        let inner = tet.iter().find(|&&vertex| !of_layers[vertex as usize] && !on_surface[vertex as usize]);
        let layer = tet.iter().find(|&&vertex| of_layers[vertex as usize] && !on_surface[vertex as usize]);
        if let (Some(&inner), Some(&layer)) = (inner, layer)
            && at[inner as usize] == undeformed[inner as usize]
        {
            at[inner as usize] = undeformed[inner as usize].lerp(undeformed[layer as usize], 0.9);
            let of_tets = merit.of_all(&simplices.tets, &at);
            if of_tets.iter().any(|&merit| merit <= 0.0) {
                at[inner as usize] = undeformed[inner as usize];
            }
        }
    }
    let mut of_tets = merit.of_all(&simplices.tets, &at);
    let bad = of_tets.iter().filter(|&&merit| merit < 0.9 * lowest).count();
    assert!(bad > 10, "{bad}");
    let goal = Goal { beta: lowest, max_sweeps: 400 };
    let backend = cpu();
    let mut smoother =
        Smoother::new(backend.as_ref(), &simplices.tets, undeformed, &constraint, &[], QualityTarget::Original)
            .with_merit(merit);
    let smoothed = smoother.run(&mut at, &mut of_tets, &goal, None).unwrap();
    assert!(smoothed.moved > 10 && of_tets.iter().fold(1.0, |a: f64, &b| a.min(b)) > 0.9 * lowest, "{smoothed:?}");
    let moved = |vertex: &usize| of_layers[*vertex] && at[*vertex] != undeformed[*vertex];
    assert_eq!((0..at.len()).filter(moved).count(), 0);
}

/// Thin layers in which the edges over one line of the wall lean, beyond the limit in the outermost
/// layer alone. The corners there are raised to the limit by a motion across these edges: every edge
/// between layers keeps its length to 0.5 %. Vertices of other cells keep their bits, and where more
/// corners are flat than may be, all do.
///
/// Fails if flat corners are not raised, or along the edges too.
#[test]
fn single_flat_corners_are_raised_and_keep_their_layers() {
    const THIN: f64 = 0.05;
    let (mut mesh, others) = cube();
    mesh.vertices.iter_mut().for_each(|at| at.z *= THIN);
    let (simplices, cells) = CornerCells::new(HybridMesh { mesh: &mesh, others: &others });
    let merit = Merit::new(Arc::new(cells), &simplices.tets, &mesh.vertices, 0.75);
    let is_wall = |vertex: u32| place(vertex)[2] == 0;
    let constraint: Vec<Constraint> = (0..mesh.vertices.len() as u32)
        .map(|vertex| if is_wall(vertex) { Constraint::Held } else { Constraint::Free })
        .collect();
    let (middle, top) = (SIDE / 2, SIDE);
    let of_line = |layer: u32, j: u32| ((SIDE + 1) * ((SIDE + 1) * layer + j) + middle) as usize;
    let line = |layer: u32| (0..=SIDE).map(move |j| of_line(layer, j));
    let mut leaning = mesh.vertices.clone();
    // cos(atan(1.3)) is 0.61, cos(atan(1.45)) is 0.57.
    let lean = |layer: u32| THIN * (1.3 * f64::from(layer) + if layer == top { 0.15 } else { 0.0 });
    (1..=top).for_each(|layer| line(layer).for_each(|vertex| leaning[vertex].x += lean(layer)));
    let worst = |at: &[DVec3]| jacobians(HybridMesh { mesh: &mesh, others: &others }, at)["hexahedron"];
    assert!((0.56..0.58).contains(&worst(&leaning)), "{}", worst(&leaning));
    let backend = cpu();
    let smoother =
        Smoother::new(backend.as_ref(), &simplices.tets, &mesh.vertices, &constraint, &[], QualityTarget::Original)
            .with_merit(merit.clone());
    let mut at = leaning.clone();
    let mut of_corners = merit.of_all(&simplices.tets, &at);
    assert_eq!(smoother.raise_flat_corners(&mut at, &mut of_corners, 1).moved, 0);
    assert_eq!(at, leaning);
    let raised = smoother.raise_flat_corners(&mut at, &mut of_corners, 100);
    assert!(raised.moved > 0 && worst(&at) >= 0.6, "{raised:?} {}", worst(&at));
    assert_eq!(of_corners, merit.of_all(&simplices.tets, &at));
    for layer in 0..top {
        for (below, above) in line(layer).zip(line(layer + 1)) {
            let length = |at: &[DVec3]| at[below].distance(at[above]);
            let kept = length(&at) / length(&leaning);
            assert!((kept - 1.0).abs() <= 0.005, "{layer}: {kept}");
        }
    }
    let far = |vertex: &usize| place(*vertex as u32)[2] < top - 1;
    assert!((0..at.len()).filter(far).all(|vertex| at[vertex] == leaning[vertex]));
}
