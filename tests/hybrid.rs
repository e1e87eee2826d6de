//! Meshes of tets, pyramids, prisms and hexahedra move: wing-bodies with layers, and an O-grid that
//! is built here.

mod common;
#[path = "hybrid/o_grid.rs"]
mod o_grid;
#[path = "hybrid/optimisation.rs"]
mod optimisation;
#[path = "hybrid/parts.rs"]
mod parts;
#[path = "hybrid/polar.rs"]
mod polar;
#[path = "hybrid/symmetric.rs"]
mod symmetric;

use std::collections::{BTreeSet, HashMap};
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
use idmesh::mesh::corners::{Face, corner_tets};
use idmesh::mesh::{
    CellKind, CornerCells, FamilyId, HybridMesh, MeshError, OtherCells, TetMesh, families_inside, measures,
    refine_hybrid, validate,
};
use idmesh::mover::{Design, FaultKind, MoveError, Mover, MoverBuilder, Outcome, Warning};
use idmesh::profile::{Plane, Profile, ProfileInterpolation, WingSurface, csv, cut, distance};
use idmesh::quality::{beta, scaled_jacobian, volume};
use idmesh::relaxation::{Method, Stopping};
use idmesh::smoothing::{Goal, Merit, QualityTarget, Smoother};
use o_grid::{o_grid, o_grid_builder, pitch};

/// A wing-body with four layers: 3 869 tets, 204 pyramids, 800 prisms, 816 hexahedra.
fn small() -> MeshFile {
    formats::read_mixed(&file("tests/data/hybrid/small.msh.gz")).unwrap()
}

fn profiles(name: &str) -> Vec<Profile> {
    let path = file("tests/data/hybrid").join(format!("{name}.csv"));
    csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap()
}

fn builder(mesh: &TetMesh, others: &OtherCells) -> MoverBuilder {
    builder_with(mesh, others, profiles("old_2"))
}

fn builder_with(mesh: &TetMesh, others: &OtherCells, old: Vec<Profile>) -> MoverBuilder {
    let mut builder = Mover::builder(mesh.clone()).other_cells(others.clone());
    for name in &mesh.families {
        if let Some(role) = role(name) {
            builder = builder.role(name, role);
        }
    }
    builder.old_profiles("wing", old)
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
///
/// Fails if flat tets are not raised, with a tet of 0.898 in `planform_2`.
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
            let kept = match *kind {
                "prism" => 0.6,
                "tet" => 0.9,
                _ => 0.84,
            };
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
        for kind in outcome.original_kinds.as_ref().unwrap() {
            assert_eq!(kind.jacobian_min, before[kind.kind.name()], "{set}: the report of the original");
            assert!(kind.inverted == 0 && kind.shape_min.is_none(), "{set}: {kind:?}");
        }
        // The wing alone, moved without the volume, makes bad cells: the test would see them.
        let deformed = outcome.stages[1].inverted;
        assert!(deformed > 50, "{set}: {deformed}");
    }
}

/// A wing half as thick makes tets and prisms worse than any in the undeformed mesh. The layers
/// keep their thickness to 2 % still.
///
/// Fails if the least scaled Jacobian of local optimisation is half of the worst of its kind, with
/// thicknesses from 0.92 to 1.24.
#[test]
fn a_wing_half_as_thick_keeps_its_layers() {
    let MeshFile { mesh, others, .. } = small();
    let mut mover = builder(&mesh, &others).build(cpu()).unwrap();
    let mut thin = profiles("old_2");
    for profile in &mut thin {
        let middle = profile.points.iter().map(|point| point.z).sum::<f64>() / profile.points.len() as f64;
        profile.points.iter_mut().for_each(|point| point.z = middle + 0.5 * (point.z - middle));
    }
    let outcome = mover.update(&Design::of_wing("wing", thin)).unwrap();
    let moved = outcome.valid().unwrap().vertices();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let (low, high) = range(&layers(hybrid, &["wing", "trailing_edge", "wingtip", "carenage"], moved));
    assert!(low > 0.98 && high < 1.02, "{low} {high}");
}

/// A wing that moves downstream along its fuselage shears single prisms over the junction: springs
/// alone leave half of the worst scaled Jacobian. These corners are raised, and no edge between
/// layers changes by more than 0.1 % of its length.
///
/// Fails if flat corners are not raised.
#[test]
fn single_prisms_over_a_junction_are_raised() {
    let MeshFile { mesh, others, .. } = small();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let before = jacobians(hybrid, &mesh.vertices);
    let [springs, raised] = [None, Some(QualityTarget::Original)].map(|quality| {
        let mut mover = builder(&mesh, &others).quality(quality).build(cpu()).unwrap();
        let outcome = mover.update(&Design::of_wing("wing", downstream())).unwrap();
        assert_eq!(outcome.smoothed.is_some_and(|done| (1..20).contains(&done.moved)), quality.is_some());
        outcome.valid().unwrap().vertices().to_vec()
    });
    let prism = |at: &[DVec3]| jacobians(hybrid, at)["prism"] / before["prism"];
    assert!(prism(&springs) < 0.52 && prism(&raised) >= 0.6, "{} {}", prism(&springs), prism(&raised));
    let layers = |at: &[DVec3]| layers(hybrid, &["wing", "trailing_edge", "wingtip", "carenage"], at);
    for (springs, raised) in layers(&springs).into_iter().zip(layers(&raised)) {
        assert!((raised / springs - 1.0).abs() < 1e-3, "{springs} {raised}");
    }
    for (kind, least) in jacobians(hybrid, &springs) {
        assert!(jacobians(hybrid, &raised)[kind] >= 0.98 * least, "{kind}");
    }
}

/// Profiles 0.24 farther downstream, about a tenth of the chord.
fn downstream() -> Vec<Profile> {
    let mut profiles = profiles("old_2");
    profiles.iter_mut().flat_map(|profile| &mut profile.points).for_each(|point| point.x += 0.24);
    profiles
}

/// A longer chord shears the outermost prisms over the junction, and the springs keep the layers.
/// With 18 % local optimisation makes these prisms better, and no edge between layers changes by
/// more than 2 % of its length. With 21 % a prism is flat to half a per cent. It is saved, layers
/// change, and a warning says so.
///
/// Fails if vertices of layers are free in both, with layers from 0.82 to 1.20 with 18 %.
#[test]
fn layers_are_kept_where_no_cell_is_nearly_inverted() {
    let MeshFile { mesh, others, .. } = small();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let prism = |at: &[DVec3]| jacobians(hybrid, at)["prism"];
    for (longer, keeps) in [(0.18, true), (0.21, false)] {
        let [springs, optimised] = [None, Some(QualityTarget::Original)].map(|quality| {
            let mut mover = builder(&mesh, &others).quality(quality).build(cpu()).unwrap();
            let outcome = mover.update(&Design::of_wing("wing", longer_chord(longer))).unwrap();
            let warns = outcome.warnings.iter().any(|warning| matches!(warning, Warning::LayersChanged { .. }));
            assert_eq!(warns, !keeps && quality.is_some(), "{longer}: {:?}", outcome.warnings);
            outcome.valid().unwrap().vertices().to_vec()
        });
        assert!(prism(&optimised) > 2.0 * prism(&springs), "{longer}");
        let layers = |at: &[DVec3]| layers(hybrid, &["wing", "trailing_edge", "wingtip", "carenage"], at);
        for (springs, optimised) in layers(&springs).into_iter().zip(layers(&optimised)) {
            assert!(!keeps || (optimised / springs - 1.0).abs() < 0.02, "{longer}: {springs} {optimised}");
        }
    }
}

/// A wing 0.15 lower meets its fuselage, a cylinder of radius 0.5, under a flat angle. Each vertex
/// of the junction is where its line along the span meets the cylinder, but for the fuselage's
/// facets. A wing twisted by 15 degrees has lines that miss the cylinder. The result is then
/// refused.
///
/// Fails if a line that grazes the surface leads to the nearest point, 0.15 away.
#[test]
fn a_junction_is_where_the_span_meets_the_fuselage_or_is_refused() {
    let MeshFile { mesh, others, .. } = small();
    let of = |name: &str| {
        let hybrid = HybridMesh { mesh: &mesh, others: &others };
        let is_of = |&face: &u32| mesh.families[hybrid.family_of(face).unwrap().index()] == name;
        (0..hybrid.n_faces() as u32).filter(is_of).map(|face| hybrid.face(face).unwrap()).collect::<Vec<_>>()
    };
    let on_fuselage: BTreeSet<u32> = of("carenage").iter().flat_map(|face| face.vertices().to_vec()).collect();
    let mut mover = builder(&mesh, &others).build(cpu()).unwrap();
    let mut lower = profiles("old_2");
    lower.iter_mut().flat_map(|profile| &mut profile.points).for_each(|point| point.z -= 0.15);
    let outcome = mover.update(&Design::of_wing("wing", lower)).unwrap();
    let moved = outcome.valid().unwrap().vertices();
    let mut seen = 0;
    for face in of("wing") {
        let corners = face.vertices();
        let edges = (0..corners.len()).map(|place| [corners[place], corners[(place + 1) % corners.len()]]);
        for [a, b] in edges.flat_map(|[a, b]| [[a, b], [b, a]]) {
            if !on_fuselage.contains(&a) || on_fuselage.contains(&b) {
                continue;
            }
            let start = mesh.vertices[a as usize];
            let span = (mesh.vertices[b as usize] - start).normalize();
            let from = start - 0.15 * DVec3::Z;
            // y^2 + z^2 = 0.25 along the line, the farther place of two.
            let (square, half) = (span.y * span.y + span.z * span.z, from.y * span.y + from.z * span.z);
            let root = (half * half - square * (from.y * from.y + from.z * from.z - 0.25)).sqrt();
            let met = from + (root - half) / square * span;
            assert!(moved[a as usize].distance(met) < 0.08, "{a}: {} {met}", moved[a as usize]);
            seen += 1;
        }
    }
    assert!(seen >= 17, "{seen}");
    let mut twisted = profiles("old_2");
    for profile in &mut twisted {
        let points = profile.points.iter();
        let [low, high] =
            points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| [low.min(point.x), high.max(point.x)]);
        let nose = profile.points.iter().find(|point| point.x == low).copied().unwrap();
        let about = nose + 0.25 * (high - low) * DVec3::X;
        let (sin, cos) = 15f64.to_radians().sin_cos();
        for point in &mut profile.points {
            let [x, z] = [point.x - about.x, point.z - about.z];
            (point.x, point.z) = (about.x + x * cos + z * sin, about.z - x * sin + z * cos);
        }
    }
    let outcome = mover.update(&Design::of_wing("wing", twisted)).unwrap();
    let missed = outcome.missed_surfaces["wing"];
    assert!(missed.of_chord > 0.05 && missed.vertices > 0, "{missed:?}");
    assert!(outcome.check().unwrap_err().faults.iter().any(|fault| fault.kind == FaultKind::MissedSurface));
}

/// The report's distance of a section from its new profile is that of the facets, also between the
/// edges that the plane cuts: to 5 % it is the largest of fifty places a facet.
///
/// Fails if the points on the edges alone count, with less than a tenth.
#[test]
fn the_sag_of_quadrilaterals_counts() {
    let MeshFile { mesh, others, .. } = small();
    let mut mover = builder(&mesh, &others).build(cpu()).unwrap();
    let new = profiles("small_2");
    let outcome = mover.update(&Design::of_wing("wing", new.clone())).unwrap();
    for (section, new) in outcome.sections["wing"].iter().zip(&new) {
        let places = |ends: &[DVec3]| (0..=50).map(|k| ends[0].lerp(ends[1], f64::from(k) / 50.0)).collect::<Vec<_>>();
        let facets: Vec<DVec3> = section.points.windows(2).flat_map(places).collect();
        let sag = distance::max_distance(&facets, &new.points);
        let told = section.max_distance_to_new_profile;
        assert!((told / sag - 1.0).abs() < 0.05, "{}: {told} of {sag}", new.number);
    }
}

/// Profiles with a longer chord, about the point at a quarter of it.
fn longer_chord(by: f64) -> Vec<Profile> {
    let mut profiles = profiles("old_2");
    for profile in &mut profiles {
        let x = profile.points.iter().map(|point| point.x);
        let [low, high] = x.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let quarter = low + 0.25 * (high - low);
        profile.points.iter_mut().for_each(|point| point.x = quarter + (1.0 + by) * (point.x - quarter));
    }
    profiles
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
    let run = |mesh: &TetMesh, others: &OtherCells, quality, new: Vec<Profile>| {
        let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
        let mut mover = builder(mesh, others).stopping(stopping).quality(quality).build(cpu()).unwrap();
        mover.update(&Design::of_wing("wing", new)).unwrap()
    };
    // In the second design flat corners are raised.
    for (quality, new) in [(None, profiles("big_2")), (Some(QualityTarget::Original), downstream())] {
        let [one, other] = [(&mesh, &others), (&renumbered, &turned)].map(|(m, o)| run(m, o, quality, new.clone()));
        assert_eq!((one.smoothed.is_some(), other.smoothed.is_some()), (quality.is_some(), quality.is_some()));
        let (one, other) = (one.displacement(), other.displacement());
        let largest = one.iter().map(|by| by.length()).fold(0.0, f64::max);
        let differs = (0..n).map(|vertex| one[vertex].distance(other[place[vertex] as usize])).fold(0.0, f64::max);
        assert!(differs <= 1e-6 * largest, "{differs:e} of {largest}");
    }
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

/// A hexahedron with an edge that has shrunk to a vertex moves by the corners that it has.
///
/// Fails if a tet as a hexahedron has four corner tets: then it is four times as stiff.
#[test]
fn degenerate_cells_move() {
    let MeshFile { mut mesh, mut others, .. } = small();
    // Half of the tets as hexahedra, prisms or pyramids; prisms as hexahedra with two shrunk edges,
    // and pyramids with a shrunk face.
    let shrunk = mesh.tets.split_off(mesh.tets.len() / 2);
    for (number, [a, b, c, d]) in shrunk.into_iter().enumerate() {
        match number % 3 {
            0 => others.hexahedra.push([a, b, c, c, d, d, d, d]),
            1 => others.prisms.push([a, b, c, d, d, d]),
            _ => others.pyramids.push([a, b, c, c, d]),
        }
    }
    let whole = small();
    let (prisms, pyramids) = (whole.others.prisms.len(), whole.others.pyramids.len());
    others.hexahedra.extend(others.prisms.drain(..prisms).map(|[a, b, c, d, e, f]| [a, b, c, c, d, e, f, f]));
    others.hexahedra.extend(others.pyramids.drain(..pyramids).map(|[a, b, c, d, e]| [a, b, c, d, e, e, e, e]));
    let run = |mesh: &TetMesh, others: &OtherCells| {
        let mut mover = builder(mesh, others).quality(None).build(cpu()).unwrap();
        mover.update(&Design::of_wing("wing", profiles("big_2"))).unwrap()
    };
    let (degenerate, expected) = (run(&mesh, &others), run(&whole.mesh, &whole.others));
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
    let every_network = idmesh::backend::gpu::Bounds { least_vertices: Some(0), ..Default::default() };
    let Some(backend) = gpu(every_network) else { return };
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

/// A quadrilateral that names a vertex twice is a triangle: refined, the mesh is the same as with
/// the triangle in its place.
#[test]
fn a_quadrilateral_that_names_a_vertex_twice_is_refined_as_a_triangle() {
    let at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let tet = (
        TetMesh {
            vertices: at[..4].iter().map(|&at| DVec3::from_array(at)).collect(),
            tets: vec![[0, 1, 2, 3]],
            triangles: vec![[0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 2, 1]],
            triangle_family: vec![FamilyId(0), FamilyId(0), FamilyId(0), FamilyId(1)],
            families: vec!["wall".into(), "base".into()],
        },
        OtherCells::none(),
    );
    let prism = (
        TetMesh {
            vertices: at.map(DVec3::from_array).to_vec(),
            tets: Vec::new(),
            triangles: vec![[3, 4, 5], [0, 2, 1]],
            triangle_family: vec![FamilyId(0), FamilyId(1)],
            families: vec!["wall".into(), "base".into()],
        },
        OtherCells {
            prisms: vec![[0, 1, 2, 3, 4, 5]],
            quadrilaterals: vec![[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
            quadrilateral_family: vec![FamilyId(0); 3],
            ..OtherCells::default()
        },
    );
    for (mesh, others) in [tet, prism] {
        let (expected, of_others) = refine_hybrid(HybridMesh { mesh: &mesh, others: &others }).unwrap();
        for twice in [[0, 2, 1, 1], [0, 0, 2, 1], [0, 2, 2, 1]] {
            let (mut mesh, mut others) = (mesh.clone(), others.clone());
            mesh.triangles.pop();
            others.quadrilaterals.push(twice);
            others.quadrilateral_family.extend(mesh.triangle_family.pop());
            let (fine, fine_others) = refine_hybrid(HybridMesh { mesh: &mesh, others: &others }).unwrap();
            validate(HybridMesh { mesh: &fine, others: &fine_others }).unwrap();
            assert!(fine == expected && fine_others == of_others, "{twice:?}: {fine:?} {fine_others:?}");
        }
        // Nothing is left of a quadrilateral whose opposite corners are one.
        let (mesh, mut others) = (mesh.clone(), others.clone());
        others.quadrilaterals.push([0, 1, 0, 2]);
        others.quadrilateral_family.push(FamilyId(0));
        let error = refine_hybrid(HybridMesh { mesh: &mesh, others: &others }).unwrap_err();
        assert!(matches!(error, MeshError::Shrunk { what: "quadrilateral", .. }), "{error}");
    }
}

/// A cell whose corners stay good and whose volume does not is told with its middle, here the mean
/// of the six positions to which its vertices are moved.
#[test]
fn a_bad_volume_after_a_motion_has_a_place() {
    let before = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let after = [
        [-1.9, 1.7, 1.4],
        [-1.4, -1.3, 1.4],
        [-1.3, -1.6, -0.3],
        [-0.6, -0.4, -1.3],
        [-1.5, 0.4, -1.7],
        [1.2, -1.0, -0.3],
    ];
    let mesh = TetMesh {
        vertices: before.map(DVec3::from_array).to_vec(),
        triangles: vec![[3, 4, 5], [0, 2, 1]],
        triangle_family: vec![FamilyId(0); 2],
        families: vec!["wall".into()],
        ..TetMesh::default()
    };
    let others = OtherCells {
        prisms: vec![[0, 1, 2, 3, 4, 5]],
        quadrilaterals: vec![[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
        quadrilateral_family: vec![FamilyId(0); 3],
        ..OtherCells::default()
    };
    let builder = Mover::builder(mesh.clone()).other_cells(others).role("wall", Role::Prescribed);
    let mut mover = builder.build(cpu()).unwrap();
    let by = (0..6).map(|vertex| DVec3::from_array(after[vertex]) - mesh.vertices[vertex]).collect();
    let outcome = mover.update(&Design::of_prescribed("wall", by)).unwrap();
    let refused = outcome.check().unwrap_err();
    let told = "the first is prism 0, whose volume as a whole is -4.027e-1, at (-0.916667, -0.366667, -0.133333)";
    assert!(refused.message.contains(told), "{refused}");
    let place = refused.faults[0].place.clone().unwrap();
    assert!(DVec3::from_array(place.at).distance(DVec3::new(-5.5, -2.2, -0.8) / 6.0) < 1e-12, "{place:?}");
}

/// Sections of a wing of quadrilaterals: within their warp (4e-4) of sections that another program
/// cut from two triangles for each. Their points are where edges of the mesh cross the plane, each
/// once, and no others.
///
/// Fails if quadrilaterals are cut as two triangles: a section then has a third more points.
#[test]
fn sections_are_cut_from_quadrilaterals() {
    let file = small();
    let wing = file.mesh.family("wing").unwrap();
    let faces = idmesh::mesh::faces_of_families(file.cells(), &[wing]);
    assert!(faces.iter().all(|face| face.vertices().len() == 4), "the wing has quadrilaterals alone");
    for old in profiles("old_2") {
        let plane = Plane::of_profile(&old).unwrap();
        let section = cut::cut(&file.mesh.vertices, &faces, &plane).unwrap();
        let edges = |face: &Face| {
            let corners = face.vertices().to_vec();
            (0..4).map(move |k| [corners[k].min(corners[(k + 1) % 4]), corners[k].max(corners[(k + 1) % 4])])
        };
        let height = |vertex: u32| plane.distance(file.mesh.vertices[vertex as usize]);
        let crosses = |[a, b]: &[u32; 2]| height(*a) * height(*b) < 0.0;
        let crossed: BTreeSet<[u32; 2]> = faces.iter().flat_map(edges).filter(crosses).collect();
        assert_eq!(section.len(), crossed.len());
        for point in &section {
            let on_an_edge = |[a, b]: &[u32; 2]| {
                let [from, to] = [a, b].map(|end| file.mesh.vertices[*end as usize]);
                (from.distance(*point) + point.distance(to) - from.distance(to)).abs() < 1e-12
            };
            assert!(crossed.iter().any(on_an_edge), "{point}");
        }
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

/// Sections cut from a wing of quadrilaterals hold for it: unchanged they move nothing, and an
/// affine map of theirs moves every vertex of the wing alike.
#[test]
fn sections_of_quadrilaterals_carry_affine_maps() {
    let MeshFile { mesh, others, .. } = small();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    let wing = mesh.family("wing").unwrap();
    let planes = profiles("old_2").iter().map(|old| (old.number, Plane::of_profile(old).unwrap())).collect::<Vec<_>>();
    let faces = idmesh::mesh::faces_of_families(hybrid, &[wing]);
    let old = cut::cut_at_planes(&mesh.vertices, &faces, &planes).unwrap();
    let mut mover = builder_with(&mesh, &others, old.clone()).build(cpu()).unwrap();
    let same = mover.update(&Design::of_wing("wing", old.clone())).unwrap();
    assert_eq!(same.vertices(), &mesh.vertices[..]);
    let vertices: BTreeSet<u32> = faces.iter().flat_map(|face| face.vertices().to_vec()).collect();
    let vertices: Vec<u32> = vertices.into_iter().collect();
    let place = |vertex: u32| vertices.binary_search(&vertex).unwrap() as u32;
    let positions: Vec<DVec3> = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
    let faces: Vec<Face> = faces.iter().map(|face| face.renumbered(place)).collect();
    let normals = vec![DVec3::ZERO; positions.len()];
    let surface = WingSurface { positions: &positions, normals: &normals, faces: &faces, ..WingSurface::default() };
    let map = |at: DVec3| {
        DVec3::new(0.03 + 1.02 * at.x + 0.05 * at.z, at.y + 0.1, 0.02 - 0.03 * at.x + 1.1 * at.z + 0.04 * at.y)
    };
    let new = old.iter().map(|old| Profile { points: old.points.iter().copied().map(map).collect(), ..old.clone() });
    let motion = ProfileInterpolation::new(&old, &surface)
        .unwrap()
        .displacements(&new.collect::<Vec<_>>())
        .unwrap()
        .displacement;
    let off = positions.iter().zip(motion).map(|(&at, by)| (at + by).distance(map(at))).fold(0.0, f64::max);
    assert!(positions.len() > 200 && off < 1e-12, "{} {off:e}", positions.len());
}
