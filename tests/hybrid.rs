//! Meshes of tets, pyramids, prisms and hexahedra move: wing-bodies with layers, and an O-grid that
//! is built here.

mod common;

use std::collections::HashMap;
use std::sync::Arc;

#[cfg(feature = "gpu")]
use common::adapter::gpu;
use common::aircraft::{Anyway, cpu, file, role};
use common::brick::noise;
use glam::DVec3;
#[cfg(feature = "gpu")]
use idmesh::backend::Backend;
use idmesh::constraint::Constraint;
use idmesh::families::{Role, SetupError};
use idmesh::formats::{self, MeshFile};
use idmesh::mesh::corners::corner_tets;
use idmesh::mesh::{
    CellKind, CornerCells, FamilyId, HybridMesh, OtherCells, TetMesh, families_inside, measures, refine_hybrid,
    validate,
};
use idmesh::mover::{Design, MoveError, Mover, MoverBuilder, Outcome};
use idmesh::profile::{Profile, csv, cut};
use idmesh::quality::{beta, scaled_jacobian, volume};
use idmesh::relaxation::{Method, Stopping};
use idmesh::smoothing::{Goal, Merit, QualityTarget, Smoother};

/// A wing-body with four layers: 3 869 tets, 204 pyramids, 800 prisms, 816 hexahedra.
fn small() -> MeshFile {
    formats::read_mixed(&file("tests/data/hybrid/small.msh.gz")).unwrap()
}

fn profiles(name: &str) -> Vec<Profile> {
    let path = file("tests/data/hybrid").join(format!("{name}.csv"));
    csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap()
}

fn builder(mesh: &TetMesh, others: &OtherCells) -> MoverBuilder {
    let mut builder = Mover::builder(mesh.clone()).other_cells(others.clone());
    for name in &mesh.families {
        if let Some(role) = role(name) {
            builder = builder.role(name, role);
        }
    }
    builder.old_profiles("wing", profiles("old_2"))
}

/// Smallest scaled Jacobian of a corner of each kind, by the determinants of its edges.
fn jacobians(mesh: HybridMesh, at: &[DVec3]) -> HashMap<&'static str, f64> {
    let mut all = HashMap::new();
    for kind in CellKind::ALL {
        let mut tets = Vec::new();
        mesh.cells_of(kind).for_each(|cell| match *cell {
            [a, b, c, d] => tets.extend([[a, b, c, d], [b, a, d, c], [c, d, a, b], [d, c, b, a]]),
            _ => corner_tets(cell, &mut tets),
        });
        let least = tets.iter().map(|tet| scaled_jacobian(tet.map(|vertex| at[vertex as usize])));
        if let Some(least) = least.reduce(f64::min) {
            all.insert(kind.name(), least);
        }
    }
    all
}

/// Thickness of the first layer at each corner of a wall's faces after a motion, over the thickness
/// before: the length of the edge that leaves the wall in a prism or hexahedron.
fn layers(mesh: HybridMesh, families: &[&str], moved: &[DVec3]) -> Vec<f64> {
    let walls: Vec<FamilyId> = families.iter().map(|name| mesh.mesh.family(name).unwrap()).collect();
    let mut leaving: HashMap<Vec<u32>, Vec<[u32; 2]>> = HashMap::new();
    let key = |face: &[u32]| {
        let mut key = face.to_vec();
        key.sort_unstable();
        key
    };
    let mut add = |one: &[u32], other: &[u32]| {
        leaving.insert(key(one), one.iter().zip(other).map(|(&a, &b)| [a, b]).collect());
        leaving.insert(key(other), other.iter().zip(one).map(|(&a, &b)| [a, b]).collect());
    };
    for &[a, b, c, d, e, f] in &mesh.others.prisms {
        add(&[a, b, c], &[d, e, f]);
    }
    for &[a, b, c, d, e, f, g, h] in &mesh.others.hexahedra {
        add(&[a, b, c, d], &[e, f, g, h]);
        add(&[a, b, f, e], &[d, c, g, h]);
        add(&[b, c, g, f], &[a, d, h, e]);
    }
    let is_wall = |&face: &u32| walls.contains(&mesh.family_of(face).unwrap());
    let edges =
        (0..mesh.n_faces() as u32).filter(is_wall).filter_map(|face| leaving.get(&key(mesh.face_vertices(face))));
    let length = |[a, b]: [u32; 2], at: &[DVec3]| at[a as usize].distance(at[b as usize]);
    edges.flatten().map(|&edge| length(edge, moved) / length(edge, mesh.vertices())).collect()
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, 0.0), |(low, high), &value| (low.min(value), high.max(value)))
}

/// Designs from 1 % of the chord to thicker, twisted and longer wings: no corner is bad, the cells
/// keep their shapes, and the layers keep their thickness.
#[test]
fn a_wing_body_with_layers_moves_and_keeps_its_layers() {
    let MeshFile { mesh, others, .. } = small();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let mut mover = builder(&mesh, &others).build(cpu()).unwrap();
    let before = jacobians(hybrid, &mesh.vertices);
    assert_eq!(before.len(), 4);
    for set in ["small_2", "big_2", "planform_2"] {
        let outcome = mover.update(&Design::of_wing("wing", profiles(set))).unwrap();
        let moved = outcome.valid().unwrap().vertices();
        let after = jacobians(hybrid, moved);
        for (kind, least) in &before {
            let kept = if *kind == "prism" { 0.6 } else { 0.84 };
            assert!(after[kind] >= kept * least, "{set}: {kind} {} of {least}", after[kind]);
        }
        let ratios = layers(hybrid, &["wing", "carenage", "wingtip"], moved);
        assert!(ratios.len() > 300);
        let (low, high) = range(&ratios);
        assert!(low > 0.96 && high < 1.04, "{set}: {low} {high}");
        let kinds = outcome.kinds.as_ref().unwrap();
        assert_eq!(kinds.iter().map(|kind| kind.count).collect::<Vec<_>>(), [3869, 204, 800, 816]);
        for kind in kinds {
            assert_eq!(kind.jacobian_min, after[kind.kind.name()], "{set}: the report");
            assert!(kind.inverted == 0 && kind.shape_min.unwrap() >= 0.64, "{set}: {kind:?}");
        }
        // The wing alone, moved without the volume, makes bad cells: the test would see them.
        let deformed = outcome.stages[1].inverted;
        assert!(deformed > 50, "{set}: {deformed}");
    }
}

#[test]
fn unchanged_profiles_keep_every_bit() {
    let MeshFile { mesh, others, .. } = small();
    let mut mover = builder(&mesh, &others).build(cpu()).unwrap();
    let outcome = mover.update(&Design::of_wing("wing", profiles("old_2"))).unwrap();
    assert!(
        outcome
            .vertices()
            .iter()
            .zip(&mesh.vertices)
            .all(|(a, b)| a.to_array().map(f64::to_bits) == b.to_array().map(f64::to_bits))
    );
}

/// The numbers of the vertices, the order of the cells and the vertex with which each begins do not
/// matter.
#[test]
fn numbers_do_not_matter() {
    let MeshFile { mesh, others, .. } = small();
    let n = mesh.vertices.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| noise(a).total_cmp(&noise(b)));
    let mut place = vec![0u32; n];
    order.iter().zip(0..).for_each(|(&vertex, at)| place[vertex] = at);
    let new = |vertex: u32| place[vertex as usize];
    let mut renumbered = mesh.clone();
    renumbered.vertices = order.iter().map(|&vertex| mesh.vertices[vertex]).collect();
    renumbered.tets = mesh.tets.iter().rev().map(|tet| tet.map(new)).collect();
    renumbered.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(new));
    let turned = OtherCells {
        pyramids: others.pyramids.iter().rev().map(|&[a, b, c, d, e]| [c, d, a, b, e].map(new)).collect(),
        prisms: others.prisms.iter().map(|&[a, b, c, d, e, f]| [e, d, f, b, a, c].map(new)).collect(),
        hexahedra: others
            .hexahedra
            .iter()
            .rev()
            .map(|&[a, b, c, d, e, f, g, h]| [b, f, g, c, a, e, h, d].map(new))
            .collect(),
        quadrilaterals: others.quadrilaterals.iter().map(|&[a, b, c, d]| [b, c, d, a].map(new)).collect(),
        quadrilateral_family: others.quadrilateral_family.clone(),
    };
    let run = |mesh: &TetMesh, others: &OtherCells| {
        let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
        let mut mover = builder(mesh, others).stopping(stopping).quality(None).build(cpu()).unwrap();
        mover.update(&Design::of_wing("wing", profiles("big_2"))).unwrap().displacement().to_vec()
    };
    let (one, other) = (run(&mesh, &others), run(&renumbered, &turned));
    let largest = one.iter().map(|by| by.length()).fold(0.0, f64::max);
    let differs = (0..n).map(|vertex| one[vertex].distance(other[place[vertex] as usize])).fold(0.0, f64::max);
    assert!(differs <= 1e-6 * largest, "{differs:e} of {largest}");
}

/// Springs run along the edges of the cells alone.
#[test]
fn no_spring_runs_along_a_diagonal() {
    let mesh = TetMesh {
        vertices: (0..27).map(|i| DVec3::new((i % 3) as f64, (i / 3 % 3) as f64, (i / 9) as f64)).collect(),
        families: vec!["wall".into()],
        ..TetMesh::default()
    };
    let at = |i: u32, j: u32, k: u32| 9 * k + 3 * j + i;
    let mut others = OtherCells::default();
    for cell in 0..8 {
        let [i, j, k] = [cell % 2, cell / 2 % 2, cell / 4];
        let base = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        let ([a, b, c, d], [e, f, g, h]) = (base(k), base(k + 1));
        others.hexahedra.push([a, b, c, d, e, f, g, h]);
    }
    let (simplices, cells) = CornerCells::new(HybridMesh { mesh: &mesh, others: &others });
    assert_eq!((simplices.tets.len(), cells.n_cells()), (64, 8));
    let edges = idmesh::mesh::edges::TetEdges::new(27, &simplices.tets);
    let real = cells.real_edges(&edges);
    let length = |[a, b]: [u32; 2]| mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    assert!(edges.edges.iter().zip(&real).all(|(&edge, &real)| real == (length(edge) < 1.1)));
    assert_eq!(real.iter().filter(|&&real| real).count(), 3 * 2 * 9);
}

/// An O-grid of hexahedra alone around an elliptic wing between two planes: 40 cells around, 24
/// layers from 1e-5 to some ten chords, 4 along the span.
fn o_grid() -> (TetMesh, OtherCells) {
    const AROUND: u32 = 40;
    const LAYERS: u32 = 24;
    const ALONG: u32 = 4;
    let growth: f64 = 1.75;
    let mut vertices = Vec::new();
    for along in 0..=ALONG {
        for layer in 0..=LAYERS {
            let height = 1e-5 * (growth.powi(layer as i32) - 1.0) / (growth - 1.0);
            for around in 0..AROUND {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(around) / f64::from(AROUND)).sin_cos();
                // Points on the ellipse, and away from it along its normal.
                let normal = DVec3::new(cos / 0.5, 0.0, sin / 0.1).normalize();
                let at = DVec3::new(0.5 * cos, f64::from(along) / f64::from(ALONG), 0.1 * sin);
                vertices.push(at + height * normal);
            }
        }
    }
    let id = |along: u32, layer: u32, around: u32| (along * (LAYERS + 1) + layer) * AROUND + around % AROUND;
    let mut others = OtherCells::default();
    let mut add = |face: [u32; 4], family: u16| {
        others.quadrilaterals.push(face);
        others.quadrilateral_family.push(FamilyId(family));
    };
    let mut hexahedra = Vec::new();
    for around in 0..AROUND {
        for along in 0..ALONG {
            let side = |layer: u32| {
                [
                    id(along, layer, around),
                    id(along, layer, around + 1),
                    id(along + 1, layer, around + 1),
                    id(along + 1, layer, around),
                ]
            };
            for layer in 0..LAYERS {
                let ([a, b, c, d], [e, f, g, h]) = (side(layer), side(layer + 1));
                hexahedra.push([a, d, c, b, e, h, g, f]);
            }
            add(side(0), 0);
            add(side(LAYERS), 1);
        }
        for layer in 0..LAYERS {
            for (along, family) in [(0, 2), (ALONG, 3)] {
                let at = |layer: u32, around: u32| id(along, layer, around);
                add(
                    [at(layer, around), at(layer, around + 1), at(layer + 1, around + 1), at(layer + 1, around)],
                    family,
                );
            }
        }
    }
    others.hexahedra = hexahedra;
    let families = ["wing", "farfield", "symmetry", "tip_plane"].map(str::to_owned).to_vec();
    (TetMesh { vertices, families, ..TetMesh::default() }, others)
}

fn o_grid_builder(mesh: &TetMesh, others: &OtherCells) -> MoverBuilder {
    Mover::builder(mesh.clone())
        .other_cells(others.clone())
        .role("wing", Role::Prescribed)
        .role("farfield", Role::Fixed)
        .role("symmetry", Role::PLANE)
        .role("tip_plane", Role::PLANE)
        .method(Method::Chebyshev)
}

/// Pitched wings: the layers turn with the wing as a body, and the planes stay flat.
fn pitch(mover: &mut Mover, degrees: f64) -> Outcome {
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    let turn = |at: DVec3| DVec3::new(at.x * cos + at.z * sin, at.y, at.z * cos - at.x * sin);
    let vertices = mover.family_vertices("wing").unwrap();
    let by = vertices.iter().map(|&vertex| mover.mesh().vertices[vertex as usize]).map(|at| turn(at) - at).collect();
    mover.update(&Design::of_prescribed("wing", by)).unwrap()
}

#[test]
fn the_layers_of_an_o_grid_turn_with_the_wing() {
    let (mesh, others) = o_grid();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    validate(hybrid).unwrap();
    let mut mover = o_grid_builder(&mesh, &others).build(cpu()).unwrap();
    let before = jacobians(hybrid, &mesh.vertices)["hexahedron"];
    for degrees in [20.0, 60.0] {
        let outcome = pitch(&mut mover, degrees);
        let moved = outcome.valid().unwrap().vertices();
        let (low, high) = range(&layers(hybrid, &["wing"], moved));
        assert!(low > 0.999 && high < 1.001, "{degrees}: {low} {high}");
        assert!(jacobians(hybrid, moved)["hexahedron"] > 0.5 * before, "{degrees}");
        // The first vertices over the wing are where the turned wing carries them.
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        for around in 0..40 {
            for first in [1040, 2040 + 1000] {
                let vertex: usize = first + around;
                let at = mesh.vertices[vertex];
                let expected = DVec3::new(at.x * cos + at.z * sin, at.y, at.z * cos - at.x * sin);
                assert!(moved[vertex].distance(expected) < 1e-7, "{degrees}: {vertex}");
            }
        }
        for (vertex, at) in moved.iter().enumerate() {
            let plane = mesh.vertices[vertex].y;
            assert!((plane != 0.0 && plane != 1.0) || at.y == plane, "{vertex} left its plane");
        }
    }
    assert!(outcome_of_a_mesh_without_tets_has_no_beta(&mut mover));
}

/// Far from the wing the cells of an O-grid are shorter across the planes than within them, so the
/// strong springs of the planes' vertices lead off the planes. Cycles correct these vertices too.
#[test]
fn multigrid_takes_few_cycles_on_an_o_grid() {
    let (mesh, others) = o_grid();
    let mover = |method| {
        let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
        o_grid_builder(&mesh, &others).method(method).stopping(stopping).build(cpu()).unwrap()
    };
    let [cycles, sweeps] = [Method::Multigrid, Method::Chebyshev].map(|method| pitch(&mut mover(method), 20.0));
    assert!(cycles.solver.sweeps <= 45, "{} cycles", cycles.solver.sweeps);
    let apart = cycles.vertices().iter().zip(sweeps.vertices()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(apart < 1e-8, "{apart}");
}

fn outcome_of_a_mesh_without_tets_has_no_beta(mover: &mut Mover) -> bool {
    let outcome = pitch(mover, 5.0);
    outcome.beta.is_empty() && outcome.stages.iter().all(|stage| stage.beta_min.is_nan()) && outcome.is_valid()
}

/// A surface that no volume fits: the result says so, with the kind, the cell, the corner and the
/// place.
#[test]
fn bad_corners_are_told() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).quality(None).max_steps(1).build(cpu()).unwrap();
    let vertices = mover.family_vertices("wing").unwrap();
    // The wing is turned inside out.
    let by = vertices.iter().map(|&vertex| -1.9 * mesh.vertices[vertex as usize] * DVec3::new(1.0, 0.0, 0.0)).collect();
    let outcome = mover.update(&Design::of_prescribed("wing", by)).unwrap();
    assert!(!outcome.is_valid() && outcome.inverted > 0);
    let message = outcome.check().unwrap_err().to_string();
    assert!(message.contains(&format!("{} of 3840 cells are inverted", outcome.inverted)), "{message}");
    assert!(message.contains("the first is hexahedron ") && message.contains("whose corner at vertex "), "{message}");
    let shown = outcome.cell_measures.as_ref().unwrap().iter().filter(|cell| cell.jacobian <= 0.0).count();
    assert!(shown > 0 && shown <= outcome.inverted);
}

/// Local optimisation brings bad corners back, and leaves an unmoved mesh as it is.
#[test]
fn local_optimisation_mends_corners() {
    const SIDE: u32 = 6;
    let at = |i: u32, j: u32, k: u32| (SIDE + 1) * ((SIDE + 1) * k + j) + i;
    let n = (SIDE + 1).pow(3);
    let place = |vertex: u32| [vertex % (SIDE + 1), vertex / (SIDE + 1) % (SIDE + 1), vertex / (SIDE + 1).pow(2)];
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
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let (simplices, cells) = CornerCells::new(hybrid);
    let inside = |vertex: u32| place(vertex).iter().all(|&at| at > 0 && at < SIDE);
    let constraint: Vec<Constraint> =
        (0..n).map(|vertex| if inside(vertex) { Constraint::Free } else { Constraint::Held }).collect();
    let merit = Merit::new(Arc::new(cells), &simplices.tets, &mesh.vertices, 0.75);
    let mut tangled = mesh.vertices.clone();
    for vertex in (0..n).filter(|&vertex| inside(vertex)) {
        tangled[vertex as usize] += 0.8 * common::brick::noise_vector(vertex as usize);
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

/// Where springs keep the shapes, local optimisation spares the layers.
#[test]
fn local_optimisation_spares_layers() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).build(cpu()).unwrap();
    let outcome = pitch(&mut mover, 20.0);
    assert!(outcome.smoothed.is_none(), "{:?}", outcome.smoothed);
    let (low, high) = range(&layers(HybridMesh { mesh: &mesh, others: &others }, &["wing"], outcome.vertices()));
    assert!(low > 0.999 && high < 1.001);
}

/// A hexahedron with an edge that has shrunk to a vertex moves by the corners that it has.
#[test]
fn degenerate_cells_move() {
    let MeshFile { mesh, mut others, .. } = small();
    // Prisms as hexahedra with two shrunk edges, and pyramids with a shrunk face.
    others.hexahedra.extend(others.prisms.drain(..).map(|[a, b, c, d, e, f]| [a, b, c, c, d, e, f, f]));
    others.hexahedra.extend(others.pyramids.drain(..).map(|[a, b, c, d, e]| [a, b, c, d, e, e, e, e]));
    let whole = small();
    let run = |others: &OtherCells| {
        let mut mover = builder(&mesh, others).quality(None).build(cpu()).unwrap();
        mover.update(&Design::of_wing("wing", profiles("big_2"))).unwrap()
    };
    let (degenerate, expected) = (run(&others), run(&whole.others));
    degenerate.valid().unwrap();
    let largest = expected.displacement().iter().map(|by| by.length()).fold(0.0, f64::max);
    for (a, b) in degenerate.displacement().iter().zip(expected.displacement()) {
        assert!(a.distance(*b) < 1e-3 * largest, "{a} {b}");
    }
}

/// The GPU follows the CPU.
#[cfg(feature = "gpu")]
#[test]
fn the_gpu_follows_the_cpu() {
    let Some(backend) = gpu(idmesh::backend::gpu::Bounds::default()) else { return };
    let MeshFile { mesh, others, .. } = small();
    let run = |backend: Arc<dyn Backend>| {
        let mut mover = builder(&mesh, &others).method(Method::Chebyshev).build(backend).unwrap();
        mover.update(&Design::of_wing("wing", profiles("big_2"))).unwrap()
    };
    let (on_cpu, on_gpu) = (run(cpu()), run(Arc::new(backend)));
    on_gpu.valid().unwrap();
    let largest = on_cpu.displacement().iter().map(|by| by.length()).fold(0.0, f64::max);
    common::compare(on_cpu.displacement(), on_gpu.displacement(), 1e-5 * largest).unwrap();
    assert!(common::compare(on_cpu.displacement(), on_gpu.displacement(), 0.0).is_err());
}

/// Families inside the volume need no role, move with the volume, and may have no role of a
/// surface.
#[test]
fn families_inside_the_volume_move_with_it() {
    let (mut mesh, mut others) = o_grid();
    let plain = pitch(&mut o_grid_builder(&mesh, &others).build(cpu()).unwrap(), 10.0);
    let wake = FamilyId(mesh.families.len() as u16);
    mesh.families.push("wake".into());
    // Faces between the cells behind the wing.
    let faces: Vec<[u32; 4]> = others.hexahedra.iter().take(5).map(|&[a, d, _, _, e, h, _, _]| [a, d, h, e]).collect();
    others.quadrilaterals.splice(3..3, faces.clone());
    others.quadrilateral_family.splice(3..3, vec![wake; faces.len()]);
    let inside = families_inside(HybridMesh { mesh: &mesh, others: &others });
    assert_eq!(inside, [false, false, false, false, true]);
    let outcome = pitch(&mut o_grid_builder(&mesh, &others).build(cpu()).unwrap(), 10.0);
    assert_eq!(outcome.valid().unwrap().vertices(), plain.vertices());
    assert_eq!(outcome.other_cells().quadrilaterals[3], faces[0]);
    let with = |family: &str, role: Role| match o_grid_builder(&mesh, &others).role(family, role).build(cpu()) {
        Ok(_) => None,
        Err(MoveError::Setup(error)) => Some(error),
        Err(error) => panic!("{error}"),
    };
    assert!(with("wake", Role::Interior).is_none());
    assert!(matches!(with("wake", Role::Fixed), Some(SetupError::Inside { role: "fixed", .. })));
    assert!(matches!(with("farfield", Role::Interior), Some(SetupError::NotInside { .. })));
}

/// Refined: pieces of each kind fill their cell, every corner is good, and the surface closes with
/// the same areas.
#[test]
fn refined_cells_fill_the_cells() {
    let MeshFile { mesh, others, .. } = small();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let (fine, fine_others) = refine_hybrid(hybrid).unwrap();
    let fine_hybrid = HybridMesh { mesh: &fine, others: &fine_others };
    validate(fine_hybrid).unwrap();
    let count = |mesh: HybridMesh| CellKind::ALL.map(|kind| mesh.count(kind));
    let [tets, pyramids, prisms, hexahedra] = count(hybrid);
    assert_eq!(count(fine_hybrid), [8 * tets + 4 * pyramids, 6 * pyramids, 8 * prisms, 8 * hexahedra]);
    let total =
        |mesh: HybridMesh| mesh.cells().map(|cell| idmesh::mesh::cell_volume(cell, mesh.vertices())).sum::<f64>();
    assert!((total(fine_hybrid) / total(hybrid) - 1.0).abs() < 1e-12, "{}", total(fine_hybrid) / total(hybrid) - 1.0);
    for name in &mesh.families {
        let area = |hybrid: HybridMesh| {
            let families = [hybrid.mesh.family(name).unwrap()];
            let triangles = idmesh::mesh::triangles_of_families(hybrid, &families);
            let corner = |vertex: u32| hybrid.vertices()[vertex as usize];
            let area = |[a, b, c]: [u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length() / 2.0;
            (triangles.len(), triangles.into_iter().map(area).sum::<f64>())
        };
        let ((n, before), (m, after)) = (area(hybrid), area(fine_hybrid));
        assert!(m == 4 * n && (after / before - 1.0).abs() < 1e-3, "{name}: {}", after / before - 1.0);
    }
    assert_eq!(fine.vertices[..mesh.vertices.len()], mesh.vertices[..]);
}

/// The pieces of a pyramid with a flat base: six pyramids of an eighth and four tets of a sixteenth
/// of its volume.
#[test]
fn the_pieces_of_a_pyramid_have_their_volumes() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.4, 0.6, 1.3]];
    let mesh = TetMesh {
        vertices: vertices.map(DVec3::from_array).to_vec(),
        triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        triangle_family: vec![FamilyId(0); 4],
        families: vec!["wall".into()],
        ..TetMesh::default()
    };
    let others = OtherCells {
        pyramids: vec![[0, 1, 2, 3, 4]],
        quadrilaterals: vec![[0, 1, 2, 3]],
        quadrilateral_family: vec![FamilyId(0)],
        ..OtherCells::default()
    };
    let (fine, fine_others) = refine_hybrid(HybridMesh { mesh: &mesh, others: &others }).unwrap();
    let whole = 1.3 / 3.0;
    for tet in &fine.tets {
        assert!((volume(tet.map(|vertex| fine.vertices[vertex as usize])) - whole / 16.0).abs() < 1e-15);
    }
    for pyramid in &fine_others.pyramids {
        assert!((idmesh::mesh::cell_volume(pyramid, &fine.vertices) - whole / 8.0).abs() < 1e-15);
    }
    assert_eq!((fine.tets.len(), fine_others.pyramids.len()), (4, 6));
}

/// Sections of a wing of quadrilaterals: within their warp (4e-4) of sections that another program
/// cut from two triangles for each.
#[test]
fn sections_are_cut_from_quadrilaterals() {
    let file = small();
    let wing = file.mesh.family("wing").unwrap();
    let triangles = idmesh::mesh::triangles_of_families(file.cells(), &[wing]);
    for old in profiles("old_2") {
        let plane = idmesh::profile::Plane::of_profile(&old).unwrap();
        let section = cut::cut(&file.mesh.vertices, &triangles, &plane).unwrap();
        for point in &old.points {
            let nearest = section.windows(2).map(|ends| {
                let along = ends[1] - ends[0];
                let t = ((*point - ends[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                point.distance(ends[0] + t * along)
            });
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest < 4e-4, "{point} {nearest}");
        }
    }
}
