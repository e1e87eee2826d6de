//! Springs that are stiffer or softer towards moved walls, against distances in closed form.

mod common;

use common::aircraft::{Anyway, cpu};
use common::brick::{Brick, noise_vector};
use common::carved::{carve, on};
use glam::DVec3;
use idmesh::families::Role;
use idmesh::mover::{Design, Mover};
use idmesh::relaxation::{Method, Stopping};
use idmesh::springs::{SPRINGS, Stiffness, wall_proximity};

/// A triangle with sides 3, 4 and 5: h is 4. Points on it, 8 above and below its inside, and 5 from
/// its corner.
#[test]
fn nearness_of_a_triangle() {
    for unit in [1e-3, 1.0, 1e5] {
        let points =
            [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [1.0, 1.0, 8.0], [1.0, 1.0, -8.0], [-3.0, 0.0, 4.0]];
        let points = points.map(|at| DVec3::from_array(at) * unit);
        let edges = [[0, 1], [0, 3], [3, 4], [0, 5], [5, 4]];
        let found = wall_proximity(&points, &edges, &[[2, 0, 1]]);
        for (found, distance) in found.iter().zip([0.0, 4.0, 8.0, 2.5, 6.5]) {
            assert!((found - 4.0 / (distance + 4.0)).abs() < 1e-15, "{unit}: {found} at {distance}");
        }
        assert_eq!(wall_proximity(&points, &edges, &[]), [1.0; 5]);
    }
}

const CELLS: [usize; 3] = [5, 5, 6];
/// A block in the middle of the box: the wall that moves. Its edges are 1 and sqrt(2), their
/// median 1.
const BLOCK: [DVec3; 2] = [DVec3::new(2.0, 2.0, 2.0), DVec3::new(3.0, 3.0, 4.0)];

fn off_block(at: DVec3) -> f64 {
    at.distance(at.clamp(BLOCK[0], BLOCK[1]))
}

fn is_inside(at: DVec3) -> bool {
    off_block(at) > 0.0 && (0..3).all(|axis| at[axis] > 0.0 && at[axis] < CELLS[axis] as f64)
}

/// The block moves without turning. Every vertex around it is in equilibrium under springs that are
/// worked out here, from its distance in closed form and edges collected by other code.
#[test]
fn a_moved_block_leaves_springs_in_equilibrium() {
    let outer = |triangle| (0..3).any(|axis| on(triangle, axis, 0.0) || on(triangle, axis, CELLS[axis] as f64));
    let family = |triangle| if outer(triangle) { "box" } else { "block" };
    let place = |at: DVec3| {
        let number = (at.x + 10.0 * at.y + 100.0 * at.z) as usize;
        at + if is_inside(at) { 0.15 * noise_vector(number) } else { DVec3::ZERO }
    };
    for springs in SPRINGS {
        let mesh = carve(CELLS, &["block", "box"], |at| off_block(at) == 0.0, family, place);
        let builder = Mover::builder(mesh).role("block", Role::Prescribed).role("box", Role::Fixed);
        let stopping = Stopping { tolerance: 1e-12, ..Stopping::default() };
        let builder = builder.springs(springs).method(Method::Chebyshev).stopping(stopping).quality(None);
        let mut mover = builder.build(cpu()).unwrap();
        let moved = vec![DVec3::new(0.1, -0.2, 0.3); mover.family_vertices("block").unwrap().len()];
        let design = Design::of_prescribed("block", moved);
        let outcome = mover.update(&design).unwrap();
        assert!(outcome.converged, "{}", springs.name);

        let mesh = mover.mesh();
        let brick = Brick::from_tets(mesh.vertices.clone(), mesh.tets.clone(), vec![]);
        let Stiffness { length, torsion, wall } = springs.stiffness;
        let stiffness = brick.stiffness(&*cpu(), length, torsion);
        let (mut force, mut total) = (vec![DVec3::ZERO; mesh.vertices.len()], vec![0.0; mesh.vertices.len()]);
        for (edge, stiffness) in brick.edges.iter().zip(stiffness) {
            let [a, b] = edge.map(|end| end as usize);
            let distance = (off_block(mesh.vertices[a]) + off_block(mesh.vertices[b])) / 2.0;
            let stiffness = stiffness * (distance + 1.0).powf(-wall);
            let pull = (outcome.displacement()[b] - outcome.displacement()[a]) * stiffness;
            force[a] += pull;
            force[b] -= pull;
            total[a] += stiffness;
            total[b] += stiffness;
        }
        let mut n_inside = 0;
        for (vertex, &at) in mesh.vertices.iter().enumerate().filter(|(_, at)| is_inside(**at)) {
            let off = force[vertex].length() / total[vertex];
            assert!(off < 1e-11, "{} at {at}: {off:e}", springs.name);
            assert!(outcome.displacement()[vertex].z > 0.01, "{} at {at}", springs.name);
            n_inside += 1;
        }
        assert_eq!(n_inside, 4 * 4 * 5 - 2 * 2 * 3, "{}", springs.name);
    }
}
