//! The report of a run: JSON, the table of the four stages, and the distribution of beta.
//!
//! The structs are plain data. The structs serialise to the JSON report, which other programs read,
//! so field names are part of idmesh's interface. [`SCHEMA`] is the JSON Schema of the report.
//! Numbers that are not finite become `null`.

mod checksums;
mod histogram;
mod reasons;
mod run_report;
#[doc(hidden)]
pub mod svg;
mod table;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::mesh::TetMesh;

pub use checksums::{Checksums, Sums};
pub use histogram::{Series, histogram_svg};
pub use run_report::{Checks, Repaired, ReportError, RunReport, Seconds, Smoothing};
pub use table::stage_table;
pub(crate) use table::{aligned, beta_text};

/// The JSON Schema (draft 2020-12) of [`RunReport`], which is a report of `idmesh run --json` and a
/// line of `idmesh batch --json`.
pub const SCHEMA: &str = include_str!("../../docs/src/report.schema.json");

/// The device that computed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Backend {
    /// `"gpu"` or `"cpu"`.
    pub kind: String,
    /// Name of the adapter or processor.
    pub adapter: String,
    /// Driver name and version; empty for the CPU.
    pub driver: String,
}

/// Size of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of tets.
    pub tets: usize,
    /// Size of each family, by name.
    pub families: BTreeMap<String, FamilySize>,
}

/// Size of a family.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FamilySize {
    /// Number of vertices of the family's triangles.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
}

impl Mesh {
    /// Counts the entities of a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        // A vertex counts once per family. Families come one after another, and each vertex keeps
        // the last family that counted it.
        let mut sizes = vec![FamilySize::default(); mesh.families.len()];
        let mut counted_for = vec![usize::MAX; mesh.vertices.len()];
        let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
        order.sort_by_key(|&triangle| mesh.triangle_family[triangle]);
        for triangle in order {
            let family = mesh.triangle_family[triangle].index();
            sizes[family].triangles += 1;
            for vertex in mesh.triangles[triangle] {
                if std::mem::replace(&mut counted_for[vertex as usize], family) != family {
                    sizes[family].vertices += 1;
                }
            }
        }
        let families = mesh.families.iter().cloned().zip(sizes).collect();
        Self { vertices: mesh.vertices.len(), tets: mesh.tets.len(), families }
    }
}
