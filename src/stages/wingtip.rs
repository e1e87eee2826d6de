//! Stage wingtip (paper 3.3): longitudinal springs along the edges and a conservative spring on every inner vertex.
//!
//! The paper gives a stiffness coefficient `c` in `[0, 1]`, "the greater, the more deformable", and no formula. Literally
//! (`u_i = c` times the neighbours' mean) the boundary's motion would die away over so many *rings of triangles*: on a fine
//! mesh with `c = 0.5` the first ring takes most of it and folds. Here it dies away over a length,
//! `w sqrt(c / (1 - c))` with `w` the tip's mean width (twice its area over its perimeter): at 1 the conservative springs
//! are gone, at 0 the inside does not leave its start, and the mesh does not matter.
//!
//! The paper's start is where the vertex was: a wing that is bent up would be pulled back down at its tip. Here the start is
//! carried along by the best affine (or rigid) motion of the tip's boundary, and all springs, the longitudinal ones too,
//! act on what the boundary does beyond that motion: a tip that is only turned or stretched keeps its triangles' shapes at
//! every coefficient. The paper's own form can be chosen ([`TipStart`]).

use glam::DVec3;

use super::{Families, Motion, Owner, Role, SetUp, TipStart, best_motion::BestMotion, patch::Patch};
use crate::{
    backend::{BackendError, Constraint},
    mesh::{
        FamilyId, TetMesh,
        edges::triangle_edges,
        half_edge::{Surface, next},
    },
    relaxation::{Accuracy, Convergence},
};

/// All wingtips of a mesh.
pub struct Wingtips {
    tips: Vec<Wingtip>,
}

struct Wingtip {
    start: TipStart,
    /// Vertices earlier stages have placed.
    placed: Vec<u32>,
    inside: Vec<u32>,
    network: Patch,
}

impl Wingtips {
    /// Sets the networks up.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let tips = families.placed_by(Owner::Wingtip).map(|family| {
            let Role::Wingtip { coefficient, start } = families.roles[family.index()] else {
                unreachable!("only wingtips are placed by the wingtip stage")
            };
            let (inside, placed): (Vec<u32>, Vec<u32>) = surface
                .vertices_of(family)
                .iter()
                .partition(|&&vertex| families.owner[vertex as usize] == Owner::Wingtip);
            let constraint = |vertex: u32| {
                // A coefficient of 0 would take infinitely stiff springs: the vertex is held at its start instead.
                let free = families.owner[vertex as usize] == Owner::Wingtip && coefficient > 0.0;
                if free { families.plane_constraint(vertex) } else { Constraint::Held }
            };
            let edges = triangle_edges(surface.corners_of(family));
            let reach = mean_width(mesh, surface, family) * (coefficient / (1.0 - coefficient)).sqrt();
            let network = Patch::new(&mesh.vertices, &edges, constraint, reach, backend, method)?;
            Ok(Wingtip { start, placed, inside, network })
        });
        Ok(Self { tips: tips.collect::<Result<_, BackendError>>()? })
    }

    /// Moves the insides of the wingtips after their boundaries.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(
        &mut self,
        mesh: &TetMesh,
        families: &Families,
        motion: &mut Motion,
        accuracy: &Accuracy,
    ) -> Result<Convergence, BackendError> {
        let mut convergence = Convergence::nothing_to_do();
        for tip in &mut self.tips {
            if tip.placed.iter().all(|&vertex| motion[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            let pairs: Vec<(DVec3, DVec3)> = tip
                .placed
                .iter()
                .map(|&vertex| {
                    (mesh.vertices[vertex as usize], mesh.vertices[vertex as usize] + motion[vertex as usize])
                })
                .collect();
            let start = match tip.start {
                TipStart::Affine => BestMotion::affine(&pairs),
                TipStart::Rigid => BestMotion::rigid(&pairs),
                TipStart::Original => BestMotion::identity(),
            };
            // Relative to that start the conservative springs pull to zero.
            let carried = |vertex: u32| start.displacement(mesh.vertices[vertex as usize]);
            for &vertex in &tip.placed {
                motion[vertex as usize] -= carried(vertex);
            }
            convergence = convergence.and(tip.network.relax(motion, accuracy)?);
            for (&(from, to), &vertex) in pairs.iter().zip(&tip.placed) {
                motion[vertex as usize] = to - from;
            }
            for &vertex in &tip.inside {
                let at = mesh.vertices[vertex as usize];
                let moved = at + motion[vertex as usize] + carried(vertex);
                motion[vertex as usize] = families.settle(vertex, moved) - at;
            }
        }
        Ok(convergence)
    }
}

/// Twice a family's area over the length of its boundary: the width of a strip.
fn mean_width(mesh: &TetMesh, surface: &Surface, family: FamilyId) -> f64 {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let area: f64 = surface
        .corners_of(family)
        .map(|corners| {
            let [a, b, c] = corners.map(at);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    let perimeter: f64 = surface
        .boundary_loops(family)
        .iter()
        .flatten()
        .map(|&half_edge| at(surface.origin(half_edge)).distance(at(surface.origin(next(half_edge)))))
        .sum();
    2.0 * area / perimeter
}
