//! [`Meter`]: measures a mover's mesh in the words of flow solvers, where they are asked for.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::mesh::{HybridMesh, OtherCells, TetMesh};
use crate::solver_measures::{Connections, Limits, SolverMeasures};

/// Measures a mesh before and after motions. What they share is made once, when first asked for.
#[derive(Debug)]
pub(super) struct Meter {
    mesh: Arc<TetMesh>,
    others: Arc<OtherCells>,
    /// Values beyond these limits are counted.
    pub(super) limits: Limits,
    connections: OnceLock<Connections>,
    original: OnceLock<SolverMeasures>,
}

impl Meter {
    /// A meter of a mesh that has passed [`crate::mesh::validate`].
    pub(super) fn new(mesh: Arc<TetMesh>, others: Arc<OtherCells>, limits: Limits) -> Self {
        Self { mesh, others, limits, connections: OnceLock::new(), original: OnceLock::new() }
    }

    /// The measures of the original mesh.
    pub(super) fn original(&self) -> &SolverMeasures {
        self.original.get_or_init(|| self.of(&self.mesh.vertices))
    }

    /// The measures of the mesh with its vertices in other places.
    ///
    /// - `vertices` `[n_vertices]`: in the mesh's unit and order
    pub(super) fn of(&self, vertices: &[DVec3]) -> SolverMeasures {
        let mesh = HybridMesh { mesh: &self.mesh, others: &self.others };
        let connect = || Connections::new(mesh).expect("a valid mesh has connections");
        SolverMeasures::of(self.connections.get_or_init(connect), vertices, &self.limits)
    }
}
