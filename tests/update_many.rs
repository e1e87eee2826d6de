//! Several designs in one solve: each has the bits that it has alone.

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use common::aircraft::{SMALL, cpu};
use common::brick::noise_vector as noise;
use common::parts;
use glam::DVec3;
use idmesh::backend::cpu::{CpuBackend, Precision};
use idmesh::constraint::Constraint;
use idmesh::families::{Junction, RigidMotion, Role, TipStart};
use idmesh::mesh::edges::{TetEdges, VertexGraph};
use idmesh::mover::{Derivative, Design, Method, MoveError, Mover, Outcome, QualityTarget, Start};
use idmesh::profile::Profile;
use idmesh::relaxation::{Convergence, Network, Relaxer, Stopping, Unrelaxed};

/// A brick of which one face is held, one is in its plane, one edge on its line, and others free.
fn network() -> (Vec<DVec3>, Network) {
    let mesh = meshes::brick(10);
    let TetEdges { edges, .. } = TetEdges::new(mesh.vertices.len(), &mesh.tets);
    let length = |[a, b]: &[u32; 2]| mesh.vertices[*a as usize].distance(mesh.vertices[*b as usize]);
    let lengths: Vec<f64> = edges.iter().map(length).collect();
    let stiffness: Vec<f64> = lengths.iter().map(|length| 1.0 / (length * length)).collect();
    let constraint = |at: &DVec3| match (at.x == 0.0 || at.x == 1.0, at.y == 0.0, at.z == 0.0) {
        (true, ..) => Constraint::Held,
        (_, true, true) => Constraint::OnLine(DVec3::X),
        (_, true, _) => Constraint::InPlane(DVec3::Y),
        _ => Constraint::Free,
    };
    let constraint = mesh.vertices.iter().map(constraint).collect();
    let graph = VertexGraph::new(mesh.vertices.len(), &edges);
    let anchor = vec![0.0; mesh.vertices.len()];
    (mesh.vertices, Network::new(&graph, &stiffness, &lengths, constraint, anchor))
}

/// Displacements of the held vertices: some that need different numbers of cycles, two whose
/// numbers leave the range of f32 or of f64, one that is none, one that is a NaN, and one that
/// nothing moves.
fn starts(vertices: &[DVec3], network: &Network) -> Vec<Vec<DVec3>> {
    let of = |place: &dyn Fn(usize, DVec3) -> DVec3| -> Vec<DVec3> {
        let held = |row: usize| network.constraint[row] == Constraint::Held;
        let of_row = |(row, &at)| if held(row) { place(row, at) } else { DVec3::ZERO };
        vertices.iter().enumerate().map(of_row).collect()
    };
    vec![
        of(&|_, at| 0.3 * DVec3::new(at.y * at.z, at.x.sin(), at.x - at.y)),
        of(&|_, _| DVec3::ZERO),
        of(&|row, _| 1e-3 * noise(row)),
        of(&|_, at| 1e-60 * at),
        of(&|_, at| if at.y == 1.0 { DVec3::NAN } else { at }),
        of(&|_, at| 1e306 * DVec3::new(at.z, at.y, at.x)),
        of(&|row, at| 40.0 * at + noise(row)),
    ]
}

fn told(displacement: &[DVec3], convergence: &Convergence) -> (Vec<[u64; 3]>, String) {
    (displacement.iter().map(|by| by.to_array().map(f64::to_bits)).collect(), format!("{convergence:?}"))
}

/// Groups of one to five designs in several orders, with a force on some of them, with few cycles
/// and with enough.
///
/// Fails if a design that has ended goes on, and if designs share the unit of their loads.
#[test]
fn designs_relax_together_as_alone() {
    let (vertices, network) = network();
    let starts = starts(&vertices, &network);
    let force: Vec<DVec3> = (0..vertices.len()).map(noise).collect();
    let load_of = |design: usize| (design % 3 == 2).then_some(&force[..]);
    for (precision, tolerance, max_sweeps) in [
        (Precision::F64, 1e-4, 100),
        (Precision::F64, 1e-12, 100),
        (Precision::F64, 1e-12, 4),
        (Precision::F32, 1e-9, 60),
    ] {
        let stopping = Stopping { tolerance, max_sweeps };
        let relaxer = || Relaxer::new(network.clone(), &CpuBackend::new(precision), Method::Multigrid).unwrap();
        let alone: Vec<_> = (0..starts.len())
            .map(|design| {
                let mut displacement = starts[design].clone();
                let convergence = relaxer().relax(&mut displacement, load_of(design), &stopping).unwrap();
                told(&displacement, &convergence)
            })
            .collect();
        if max_sweeps == 100 {
            let mut sweeps: Vec<_> =
                alone.iter().map(|(_, convergence)| convergence.split(", history").next()).collect();
            sweeps.dedup();
            assert!(sweeps.len() > 4, "the designs need different numbers of cycles: {sweeps:?}");
        }
        let mut relaxer = relaxer();
        for group in [&[0][..], &[2, 0], &[6, 1, 3], &[0, 4, 2, 5], &[5, 6, 0, 2], &[3, 2, 1, 0, 6], &[4, 4], &[0, 6]] {
            let mut displacements: Vec<_> = group.iter().map(|&design| starts[design].clone()).collect();
            let mut unrelaxed = Vec::new();
            for (displacement, &design) in displacements.iter_mut().zip(group) {
                unrelaxed.push(Unrelaxed { displacement, load: load_of(design) });
            }
            let results = relaxer.relax_together(unrelaxed, &stopping, &|_| ()).unwrap();
            for ((displacement, convergence), &design) in displacements.iter().zip(&results).zip(group) {
                assert!(told(displacement, convergence) == alone[design], "{design} of {group:?}, {stopping:?}");
            }
        }
    }
}

fn mover(quality: Option<QualityTarget>) -> Mover {
    let builder = SMALL.builder(SMALL.profiles("old_2")).method(Method::Multigrid).quality(quality);
    builder.build(cpu()).unwrap()
}

/// A design whose profiles go up by some of their span.
fn design(profiles: &str, up: f64) -> Design {
    let raised = |profile: Profile| {
        let points = profile.points.iter().map(|&p| p + DVec3::Z * up * p.y);
        Profile { number: profile.number, points: points.collect() }
    };
    Design::of_wing("wing", SMALL.profiles(profiles).into_iter().map(raised).collect())
}

/// All of an outcome but its times.
fn all_of(outcome: Result<Outcome, MoveError>) -> String {
    match outcome {
        Err(error) => format!("{error:?}"),
        Ok(mut outcome) => {
            outcome.stages.iter_mut().for_each(|stage| stage.seconds = 0.0);
            outcome.stage_seconds.iter_mut().for_each(|stage| stage.seconds = 0.0);
            format!("{outcome:?}")
        }
    }
}

/// A design that rests, one that is refused, one whose jump inverts tets, and others, in groups of
/// one to five.
///
/// Fails if the stages of the surfaces keep what they made of another design.
#[test]
fn movers_move_designs_together_as_alone() {
    let refused = Design::of_wing("wing", SMALL.profiles("big_2")[..1].to_vec());
    let unknown = Design::of_wing("wings", SMALL.profiles("big_2"));
    let designs = [
        design("small_2", 0.0),
        design("old_2", 0.0),
        refused,
        design("big_2", 0.9),
        design("small_2", 0.05),
        unknown,
        design("old_2", 1e-6),
    ];
    for quality in [None, Some(QualityTarget::Original)] {
        let mut alone_mover = mover(quality);
        let alone: Vec<String> = designs.iter().map(|design| all_of(alone_mover.update(design))).collect();
        let raised = alone_mover.update(&designs[3]).unwrap();
        assert!(raised.path.given_up > 0, "the jump of design 3 inverts tets");
        let mut mover = mover(quality);
        for group in [&[4][..], &[0, 4], &[1, 2, 0], &[3, 0, 1, 4], &[4, 3, 2, 6, 0], &[2, 5], &[6, 6, 3]] {
            let of_group: Vec<&Design> = group.iter().map(|&at| &designs[at]).collect();
            let outcomes = mover.update_many(&of_group);
            assert_eq!(outcomes.len(), group.len());
            for (outcome, &at) in outcomes.into_iter().zip(group) {
                assert!(all_of(outcome) == alone[at], "design {at} of {group:?}, {quality:?}");
            }
            assert!(all_of(mover.update(&designs[0])) == alone[0], "after {group:?}, {quality:?}");
        }
        assert!(mover.update_many(&[]).is_empty());
    }
}

/// Each design has its own time and its share of the time for its group, and no time counts twice.
///
/// Fails if a clock does not stop while the mover works on other designs, and if a design has no
/// share or the whole time of its group.
#[test]
fn designs_share_the_time_of_their_group() {
    let designs: Vec<Design> = (1..=4).map(|n| design("small_2", 0.01 * f64::from(n))).collect();
    let mut mover = mover(None);
    let start = std::time::Instant::now();
    let outcomes = mover.update_many(&designs.iter().collect::<Vec<_>>());
    let all = start.elapsed().as_secs_f64();
    let outcomes: Vec<Outcome> = outcomes.into_iter().map(|outcome| outcome.unwrap()).collect();
    let of_quality = |outcome: &Outcome| outcome.stages.iter().map(|stage| stage.seconds).sum::<f64>();
    let of_stages = |outcome: &Outcome| outcome.stage_seconds.iter().map(|stage| stage.seconds).sum::<f64>();
    let volumes = |outcome: &Outcome| outcome.stage_seconds.iter().find(|stage| stage.stage == "volume").cloned();
    let least = outcomes.iter().map(|outcome| volumes(outcome).unwrap().seconds).fold(f64::INFINITY, f64::min);
    for told in [outcomes.iter().map(of_quality).sum::<f64>(), outcomes.iter().map(of_stages).sum()] {
        assert!((0.6 * all..all).contains(&told), "{told} s of {all} s");
    }
    assert!(outcomes.iter().all(|outcome| of_stages(outcome) < 0.6 * all), "{all} s");
    assert!(least > 0.02 * all, "{least} s of {all} s");
}

/// A pylon that slides on the wing, with a nacelle that goes with it: reports of the motions, and
/// products with the derivative of each outcome.
///
/// Fails if bodies, junctions or wings keep what they made of another design.
#[test]
fn parts_move_together_as_alone() {
    let attached = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Slide };
    let roles = [("pylon", attached), ("nacelle", parts::rigid(RigidMotion::Root))];
    let mover = || {
        let builder = parts::builder(parts::mesh("nacelle"), parts::profiles("nacelle", "old"), &roles);
        builder.method(Method::Multigrid).quality(None).build(cpu()).unwrap()
    };
    let [mut alone, mut together] = [mover(), mover()];
    let designs = ["planform", "old", "twist"].map(|set| Design::of_wing("wing", parts::profiles("nacelle", set)));
    let seed: Vec<DVec3> = (0..alone.mesh().vertices.len()).map(noise).collect();
    let outcomes = together.update_many(&designs.each_ref());
    for (number, (design, outcome)) in designs.iter().zip(outcomes).enumerate() {
        let (expected, found) = (alone.update(design).unwrap(), outcome.unwrap());
        let [of_expected, of_found] = [(&mut alone, &expected), (&mut together, &found)]
            .map(|(mover, outcome)| format!("{:?}", mover.reverse(outcome, &seed, Derivative::Frozen)));
        assert!(of_expected.starts_with("Ok"), "{of_expected}");
        assert!(of_found == of_expected, "product of design {number}");
        assert!(all_of(Ok(found)) == all_of(Ok(expected)), "design {number}");
    }
}

/// From the last design's springs each design starts from the one before, as one after another.
///
/// Fails if such designs jump together.
#[test]
fn designs_that_start_from_the_last_follow_one_another() {
    let designs = [design("small_2", 0.0), design("small_2", 0.01), design("old_2", 0.02)];
    let [mut alone, mut together] = [mover(None), mover(None)];
    alone.start_from(Start::LastDesign);
    together.start_from(Start::LastDesign);
    let expected: Vec<String> = designs.iter().map(|design| all_of(alone.update(design))).collect();
    let outcomes = together.update_many(&designs.iter().collect::<Vec<_>>());
    assert!(outcomes.into_iter().map(all_of).eq(expected));
}
