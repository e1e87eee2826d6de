//! The quality of a mesh in the words of flow solvers, and limits on it.
//!
//! | file | holds |
//! |---|---|
//! | `openfoam` | what OpenFOAM's `checkMesh` prints of faces and cells |
//! | `su2` | what SU2 prints of the dual volumes |
//! | `connections` | what both need of the cells, made once per mesh, in an order that is fast |
//! | `limits` | limits on the measures, and what lies beyond them |
//! | `tally` | the worst value of a measure, and the number beyond its limit |
//!
//! [`SolverMeasures::of`] measures a mesh, or a mesh whose vertices have moved. The formulas are
//! those of the programs, so a figure here is the figure that the solver prints. All sums are taken
//! piece by piece in a fixed order: no figure depends on the number of threads.

mod connections;
mod limits;
mod openfoam;
mod su2;
mod tally;

use glam::DVec3;
use rayon::join;

pub use connections::Connections;
pub use limits::{Exceeded, LIMITS, LimitError, LimitRow, Limits};
pub use openfoam::{OpenFoam, SEVERE};
pub use su2::Su2;
pub use tally::{Bad, Tally};

/// The measures of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverMeasures {
    /// As OpenFOAM's `checkMesh` has them.
    pub openfoam: OpenFoam,
    /// As SU2 has them.
    pub su2: Su2,
}

impl SolverMeasures {
    /// Measures a mesh.
    ///
    /// - `connections`: of the mesh
    /// - `vertices` `[n_vertices]`: positions, in the mesh's unit and order
    /// - `limits`: values beyond them are counted
    pub fn of(connections: &Connections, vertices: &[DVec3], limits: &Limits) -> Self {
        let order = connections.order();
        let vertices = &order.to_vertices(vertices);
        let (mut openfoam, mut su2) =
            join(|| OpenFoam::of(connections, vertices, limits), || Su2::of(connections, vertices, limits));
        openfoam.rename(|cell| order.cell(cell));
        su2.rename(|vertex| order.vertex(vertex));
        Self { openfoam, su2 }
    }
}
