//! Measures in the words of flow solvers: against closed forms, and against OpenFOAM's `checkMesh`.
//!
//! SU2 has no package for Debian, so its measures are compared with closed forms alone.

#[path = "solver_measures/check_mesh.rs"]
mod check_mesh;
mod common;
#[path = "common/meshes.rs"]
mod meshes;

use common::assert_close;
use glam::DVec3;
use idmesh::mesh::{FamilyId, HybridMesh, Order, OtherCells, TetMesh, refine_hybrid};
use idmesh::solver_measures::{Connections, Limits, SolverMeasures};

/// Measures a mesh without limits.
fn measured(mesh: &TetMesh, others: &OtherCells) -> SolverMeasures {
    measured_with(mesh, others, &Limits::default())
}

fn measured_with(mesh: &TetMesh, others: &OtherCells, limits: &Limits) -> SolverMeasures {
    let hybrid = HybridMesh { mesh, others };
    SolverMeasures::of(&Connections::new(hybrid).unwrap(), &mesh.vertices, limits)
}

/// A grid of hexahedra of side 1, each vertex placed by a function. Its sides are six families.
fn grid([nx, ny, nz]: [usize; 3], place: impl Fn(DVec3) -> DVec3) -> (TetMesh, OtherCells) {
    let index = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
    let (mut mesh, mut others) = (TetMesh::default(), OtherCells::none());
    for k in 0..=nz {
        for j in 0..=ny {
            mesh.vertices.extend((0..=nx).map(|i| place(DVec3::new(i as f64, j as f64, k as f64))));
        }
    }
    mesh.families = ["x0", "x1", "y0", "y1", "z0", "z1"].map(str::to_owned).to_vec();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let layer = |k: usize| [index(i, j, k), index(i + 1, j, k), index(i + 1, j + 1, k), index(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (layer(k), layer(k + 1));
                others.hexahedra.push([a, b, c, d, e, f, g, h]);
                let sides = [
                    (i == 0, [a, e, h, d]),
                    (i + 1 == nx, [b, c, g, f]),
                    (j == 0, [a, b, f, e]),
                    (j + 1 == ny, [d, h, g, c]),
                    (k == 0, [a, d, c, b]),
                    (k + 1 == nz, [e, f, g, h]),
                ];
                for (side, &(is_side, face)) in sides.iter().enumerate() {
                    if is_side {
                        others.quadrilaterals.push(face);
                        others.quadrilateral_family.push(FamilyId(side as u16));
                    }
                }
            }
        }
    }
    (mesh, others)
}

/// A grid of cubes: all faces are orthogonal, and each dual volume is a part of a cube.
#[test]
fn cubes_are_best() {
    let (mesh, others) = grid([3, 2, 2], |at| at);
    let SolverMeasures { openfoam, su2 } = measured(&mesh, &others);
    assert_close(openfoam.non_orthogonality.value(), 0.0, 1e-6);
    assert_close(openfoam.non_orthogonality_mean, 0.0, 1e-6);
    assert_close(openfoam.skewness.value(), 0.0, 1e-12);
    assert_close(openfoam.aspect_ratio.value(), 1.0, 1e-12);
    assert_eq!((openfoam.pyramids.beyond, openfoam.severely_non_orthogonal), (0, 0));
    openfoam.volume.into_iter().for_each(|volume| assert_close(volume, 1.0, 1e-12));
    assert_close(su2.orthogonality.value(), 90.0, 1e-6);
    assert_close(su2.orthogonality_max, 90.0, 1e-6);
    // At a vertex of a side the edge inward has the whole area, the others have the half.
    assert_close(su2.aspect_ratio.value(), 2.0, 1e-12);
    // At a corner, and inside, all areas are equal.
    assert_close(su2.aspect_ratio_min, 1.0, 1e-12);
    assert_close(su2.volume_ratio.value(), 1.0, 1e-12);
    assert_close(su2.volume_ratio_min, 1.0, 1e-12);
    // A corner has an eighth of its cube. A vertex inside has an eighth of eight cubes.
    assert_close(su2.volume[0], 0.125, 1e-12);
    assert_close(su2.volume[1], 1.0, 1e-12);
}

/// Boxes of 1 x 2 x 4: the components of the areas are as 8 to 4 to 2. The wall has no part.
#[test]
fn boxes_have_the_aspect_ratio_of_their_areas() {
    let (mesh, others) = grid([2, 2, 2], |at| at * DVec3::new(1.0, 2.0, 4.0));
    let SolverMeasures { openfoam, su2 } = measured(&mesh, &others);
    assert_close(openfoam.aspect_ratio.value(), 4.0, 1e-12);
    // Inside, the areas across the edges are 8, 4 and 2. At the middle of a side across z the
    // smallest is the area 2 of the edge inward, and of those along the side 8 / 2 and 4 / 2.
    assert_close(su2.aspect_ratio.value(), 8.0, 1e-12);
    assert_close(su2.volume[1], 8.0, 1e-12);
}

/// Cubes sheared by `s`: angles of `atan(s)` at the faces across x and z, none at those across y.
#[test]
fn sheared_cubes_have_the_angle_of_the_shear() {
    let s = 0.75_f64;
    let n = [3, 4, 5];
    let (mesh, others) = grid(n, |at| DVec3::new(at.x + s * at.z, at.y, at.z));
    let SolverMeasures { openfoam, su2 } = measured(&mesh, &others);
    let angle = s.atan().to_degrees();
    assert_close(openfoam.non_orthogonality.value(), angle, 1e-9);
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let others = (0..3).filter(|&other| other != axis);
        ((n[axis] - 1) * others.map(|other| n[other]).product::<usize>()) as f64
    });
    let cosine = ((x + z) * s.atan().cos() + y) / (x + y + z);
    assert_close(openfoam.non_orthogonality_mean, cosine.acos().to_degrees(), 1e-9);
    // On a side across z the normal through the cell's centre meets the side `s / 2` beside the
    // face's centre, whose edge is 1 / 2 away.
    assert_close(openfoam.skewness.value(), s, 1e-12);
    // Of each vertex's areas those across x, y and z are as r : 1 : 1.
    let r = s.hypot(1.0);
    let orthogonality = 90.0 - angle * (r + 1.0) / (r + 2.0);
    assert_close(su2.orthogonality.value(), orthogonality, 1e-9);
    assert_close(su2.orthogonality_max, orthogonality, 1e-9);
}

/// A regular tet with a family on each side.
#[test]
fn a_regular_tet_has_its_closed_forms() {
    let vertices = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]].map(DVec3::from);
    let mesh = TetMesh {
        vertices: vertices.to_vec(),
        tets: vec![[0, 1, 2, 3]],
        triangles: vec![[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]],
        triangle_family: (0..4).map(FamilyId).collect(),
        families: ["a", "b", "c", "d"].map(str::to_owned).to_vec(),
    };
    let SolverMeasures { openfoam, su2 } = measured(&mesh, &OtherCells::none());
    // No face lies between two cells.
    assert!(openfoam.non_orthogonality.value().is_nan() && openfoam.non_orthogonality_mean.is_nan());
    assert_close(openfoam.skewness.value(), 0.0, 1e-12);
    let volume = 8.0_f64 / 3.0;
    openfoam.volume.into_iter().for_each(|found| assert_close(found, volume, 1e-12));
    // Each side has the area vector (1, 1, 1) * 2, up to signs.
    assert_close(openfoam.aspect_ratio.value(), 24.0 / 6.0 / volume.powf(2.0 / 3.0), 1e-12);
    assert_close(su2.orthogonality.value(), 90.0, 1e-6);
    assert_close(su2.volume_ratio.value(), 1.0, 1e-12);
    assert_close(su2.aspect_ratio.value(), 6.0_f64.sqrt(), 1e-12);
    assert_close(su2.aspect_ratio_min, 6.0_f64.sqrt(), 1e-12);
    su2.volume.into_iter().for_each(|found| assert_close(found, volume / 4.0, 1e-12));
}

/// The pyramids of a tet are quarters of it, so four are wrong in each inverted tet.
#[test]
fn inverted_tets_have_four_wrong_pyramids() {
    let mut mesh = meshes::brick(3);
    let inside = mesh.vertices.iter().position(|at| at.min_element() > 0.0 && at.max_element() < 1.0).unwrap();
    mesh.vertices[inside].x += 0.5;
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let volume = |tet: &[u32; 4]| idmesh::quality::volume(tet.map(at));
    let inverted = mesh.tets.iter().filter(|tet| volume(tet) < 0.0).count();
    assert!(inverted > 3, "{inverted}");
    let measures = measured(&mesh, &OtherCells::none());
    assert_eq!(measures.openfoam.pyramids.beyond, 4 * inverted);
    let place = measures.openfoam.pyramids.place.unwrap();
    let worst = mesh.tets.iter().map(volume).fold(f64::INFINITY, f64::min);
    assert_eq!(volume(&mesh.tets[place as usize]), worst);
}

/// The dual volume of a vertex is a quarter of its tets. So the largest is that of the vertex with
/// the largest tets, whatever their shape.
#[test]
fn dual_volumes_are_quarters_of_tets() {
    let mut mesh = meshes::brick(4);
    mesh.vertices.iter_mut().enumerate().for_each(|(n, at)| *at += 0.04 * common::brick::noise_vector(n));
    let mut expected = vec![0.0; mesh.vertices.len()];
    for tet in &mesh.tets {
        let volume = idmesh::quality::volume(tet.map(|vertex| mesh.vertices[vertex as usize]));
        assert!(volume > 0.0);
        tet.iter().for_each(|&vertex| expected[vertex as usize] += volume / 4.0);
    }
    let measures = measured(&mesh, &OtherCells::none());
    assert_close(measures.su2.volume[0], expected.iter().copied().fold(f64::INFINITY, f64::min), 1e-15);
    assert_close(measures.su2.volume[1], expected.iter().copied().fold(0.0, f64::max), 1e-15);
}

/// A cell of each kind, of `make_mixed.py`.
fn mixed() -> (TetMesh, OtherCells) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mixed/gmsh.v22.ascii.msh");
    let file = idmesh::formats::read_mixed(&path).unwrap();
    (file.mesh, file.others)
}

/// No measure depends on the number of threads, and only volumes depend on the unit.
#[test]
fn neither_threads_nor_the_unit_matter() {
    let mut mesh = meshes::brick(16);
    mesh.vertices.iter_mut().enumerate().for_each(|(n, at)| *at += 0.01 * common::brick::noise_vector(n));
    let none = OtherCells::none();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| measured(&mesh, &none))
    };
    let one = on(1);
    assert_eq!(one, on(4));
    let mut small = mesh.clone();
    // A power of two changes no digit.
    small.vertices.iter_mut().for_each(|at| *at *= 0.5_f64.powi(20));
    let small = measured(&small, &none);
    assert_eq!(small.openfoam.non_orthogonality, one.openfoam.non_orthogonality);
    assert_eq!(small.openfoam.skewness, one.openfoam.skewness);
    assert_close(small.openfoam.aspect_ratio.value(), one.openfoam.aspect_ratio.value(), 1e-12);
    assert_eq!(small.su2.orthogonality, one.su2.orthogonality);
    assert_eq!(small.su2.aspect_ratio, one.su2.aspect_ratio);
    assert_eq!(small.su2.volume_ratio, one.su2.volume_ratio);
}

/// Measures are taken in an order of their own, and name cells and vertices of the mesh.
#[test]
fn cells_in_order_have_the_names_of_the_mesh() {
    let (mesh, others) = mixed();
    let (mesh, others) = refine_hybrid(HybridMesh { mesh: &mesh, others: &others }).unwrap();
    let given = HybridMesh { mesh: &mesh, others: &others };
    let order = Order::breadth_first(given);
    let (tets, ordered_others) = (order.of(&mesh), order.of_others(&others));
    let ordered = HybridMesh { mesh: &tets, others: &ordered_others };
    let mut names: Vec<u32> = (0..given.n_cells() as u32).map(|place| order.cell(place)).collect();
    for (place, &name) in names.iter().enumerate() {
        let corners: Vec<u32> = ordered.cell(ordered.name(place)).iter().map(|&corner| order.vertex(corner)).collect();
        assert_eq!(corners, given.cell(given.name(name as usize)), "{place}");
    }
    assert!(names.iter().zip(0..).any(|(&name, place)| name != place), "the order is another one");
    names.sort_unstable();
    assert!(names.into_iter().eq(0..given.n_cells() as u32));
}

/// Values beyond a limit are counted, and the worst place is named. The limit itself is allowed.
#[test]
fn values_beyond_a_limit_are_counted() {
    let (mesh, others) = grid([2, 2, 3], |at| DVec3::new(at.x, at.y, if at.z > 2.0 { 7.0 } else { at.z }));
    let mut limits = Limits::default();
    limits.set("aspect_ratio", 4.0).unwrap();
    limits.set("skewness", 1e-9).unwrap();
    let exceeded = limits.exceeded(&measured_with(&mesh, &others, &limits));
    // The top cells are 5 high: areas of 5 and of 1.
    assert_eq!(exceeded.len(), 1, "{exceeded:?}");
    assert_eq!((exceeded[0].row.name, exceeded[0].count, exceeded[0].place), ("aspect_ratio", 4, Some(8)));
    assert_close(exceeded[0].value, 5.0, 1e-12);
    limits.set("aspect_ratio", exceeded[0].value).unwrap();
    assert_eq!(limits.exceeded(&measured_with(&mesh, &others, &limits)), []);
}

/// Limits that mean nothing are refused.
#[test]
fn limits_that_mean_nothing_are_refused() {
    let mut limits = Limits::default();
    for (name, value) in [
        ("non_orthogonality", 181.0),
        ("non_orthogonality", f64::NAN),
        ("skewness", -1.0),
        ("skewness", f64::INFINITY),
        ("aspect_ratio", 0.5),
        ("face_pyramids", -1.0),
        ("dual_orthogonality", 91.0),
        ("dual_aspect_ratio", 0.0),
        ("dual_volume_ratio", f64::NEG_INFINITY),
    ] {
        let error = limits.set(name, value).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("expected"), "{error}");
    }
    let error = limits.set("non_orthogonalty", 70.0).unwrap_err().to_string();
    assert!(error.contains("did you mean") && error.contains("non_orthogonality"), "{error}");
    assert!(limits.is_empty());
}
