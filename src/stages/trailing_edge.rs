//! Stage trailing edge (paper 3.2): first the boundary curve of a trailing edge moves, then its
//! inside.
//!
//! A part of the boundary curve belongs to the wing and has moved already. The other parts relax as
//! chains of springs between their moved ends (the paper's one-dimensional dynamic mesh). Then the
//! inside relaxes as a surface that is held at the whole curve.

use glam::DVec3;

use super::surface_network::SurfaceNetwork;
use crate::families::PlacedBy;
use crate::mesh::Displacement;
use crate::stage::{SetUp, Stage, StageError};
use crate::{backend::BackendError, constraint::Constraint, relaxation::Convergence};

/// All trailing edges of a mesh.
pub struct TrailingEdges {
    edges: Vec<TrailingEdge>,
}

struct TrailingEdge {
    curve: SurfaceNetwork,
    surface: SurfaceNetwork,
}

impl TrailingEdges {
    /// Sets up two networks for each trailing edge: its boundary curve and its surface.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let edges = families.families_of(PlacedBy::TrailingEdge).map(|family| {
            let own = |vertex: u32| families.placed_by[vertex as usize] == PlacedBy::TrailingEdge;
            let mut boundary: Vec<[u32; 2]> = surface
                .boundary_loops(family)
                .into_iter()
                .flatten()
                .map(|h| [surface.origin(h), surface.origin(crate::mesh::half_edge::next(h))])
                .map(|[a, b]| [a.min(b), a.max(b)])
                .collect();
            boundary.sort_unstable();
            boundary.dedup();
            let on_curve: std::collections::HashSet<u32> = boundary.iter().flatten().copied().collect();
            let limit =
                |vertex: u32, free: bool| if free { families.plane_constraint(vertex) } else { Constraint::Held };
            let curve = SurfaceNetwork::new(&mesh.vertices, &boundary, |v| limit(v, own(v)), backend, method)?;
            let inner = surface.edges_of(surface.triangles_of(family));
            let inside = |v: u32| limit(v, own(v) && !on_curve.contains(&v));
            let surface = SurfaceNetwork::new(&mesh.vertices, &inner, inside, backend, method)?;
            Ok(TrailingEdge { curve, surface })
        });
        Ok(Self { edges: edges.collect::<Result<_, BackendError>>()? })
    }
}

impl Stage for TrailingEdges {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut convergence = Convergence::nothing_to_do();
        for edge in &mut self.edges {
            convergence = convergence.and(edge.curve.relax(displacement, stopping)?);
            for (vertex, _) in edge.curve.moving() {
                let displacement = &mut displacement[vertex as usize];
                if *displacement != DVec3::ZERO {
                    let start = mesh.vertices[vertex as usize];
                    *displacement = families.settle(vertex, start + *displacement) - start;
                }
            }
        }
        families.partners.even(families, displacement);
        for edge in &mut self.edges {
            convergence = convergence.and(edge.surface.relax(displacement, stopping)?);
        }
        Ok(convergence)
    }
}
