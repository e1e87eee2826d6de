//! The report of a run: JSON, the table of the four stages, the distribution of beta, and a page
//! for browsers.
//!
//! The structs are plain data. The structs serialise to the JSON report, which other programs read,
//! so field names are part of idmesh's interface. [`SCHEMA`] is the JSON Schema of the report.
//! Numbers that are not finite become `null`.

mod checksums;
mod histogram;
mod outline;
mod page;
mod reasons;
mod run_report;
mod solver_quality;
#[doc(hidden)]
pub mod svg;
mod table;
mod worst_cells;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::backend::BackendInfo;
use crate::mesh::{CellKind, FamilyId, HybridMesh, KindQuality};

pub use checksums::{Checksums, Sums};
pub use histogram::{Measured, Series, histogram_svg};
pub use outline::Outline;
pub use page::{ComparisonPage, Page, batch_html, is_page, sections_svg};
pub use run_report::{Checks, Repaired, ReportError, RunReport, Seconds, Smoothing};

pub use solver_quality::{OpenFoam, SolverQualities, SolverQuality, Su2, limits_by_name, solver_table};
pub use worst_cells::WorstCell;

pub(crate) use table::{aligned, beta_text};
pub use table::{kind_table, stage_remark, stage_table};

/// The JSON Schema (draft 2020-12) of [`RunReport`], which is a report of `idmesh run --json` and a
/// line of `idmesh batch --json`.
pub const SCHEMA: &str = include_str!("../../docs/src/report.schema.json");

/// The device that computed. Empty if it is not known.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Backend {
    /// `"gpu"` or `"cpu"`.
    pub kind: String,
    /// Name of the adapter or processor.
    pub adapter: String,
    /// Driver name and version; empty for the CPU.
    pub driver: String,
    /// The number type in which the device corrects displacements: `"f64"` or `"f32"`.
    pub arithmetic: String,
}

impl Backend {
    /// The device of a backend.
    pub fn of(info: BackendInfo) -> Self {
        Self {
            kind: info.kind.to_owned(),
            adapter: info.adapter,
            driver: info.driver,
            arithmetic: info.arithmetic.name().to_owned(),
        }
    }
}

/// Size of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of tets.
    pub tets: usize,
    /// Number of pyramids. Left out if there are none, as prisms and hexahedra are.
    #[serde(skip_serializing_if = "is_zero")]
    pub pyramids: usize,
    /// Number of prisms.
    #[serde(skip_serializing_if = "is_zero")]
    pub prisms: usize,
    /// Number of hexahedra.
    #[serde(skip_serializing_if = "is_zero")]
    pub hexahedra: usize,
    /// Size of each family, by name.
    pub families: BTreeMap<String, FamilySize>,
}

/// Quality of the cells of one kind. The measures have no unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Kind {
    /// Number of cells.
    pub count: usize,
    /// Number of inverted cells: the volume of a corner or of the cell is not positive.
    pub inverted: usize,
    /// Smallest scaled Jacobian of a corner; see [`crate::quality::scaled_jacobian`].
    pub jacobian_min: f64,
    /// Mean over the cells of the smallest scaled Jacobian.
    pub jacobian_mean: f64,
    /// Smallest shape q of a corner against the undeformed mesh: 1 at rest. Left out of a mesh that
    /// was not moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape_min: Option<f64>,
}

/// The quality of each kind of cell that a mesh has, by the plural of its name.
pub fn by_kind(kinds: &[KindQuality]) -> BTreeMap<&'static str, Kind> {
    let of_kind = |quality: &KindQuality| {
        let &KindQuality { kind, count, inverted, jacobian_min, jacobian_mean, shape_min } = quality;
        (kind.plural(), Kind { count, inverted, jacobian_min, jacobian_mean, shape_min })
    };
    kinds.iter().map(of_kind).collect()
}

/// The end of a histogram's title that tells how many of a mesh's cells have a beta. Empty where
/// all have one, or none has.
pub(crate) fn share_of_tets(mesh: HybridMesh) -> String {
    let n_cells = mesh.n_cells();
    match mesh.count(CellKind::Tet) {
        0 => String::new(),
        tets if tets == n_cells => String::new(),
        tets => format!(": the tets, {:.1} % of the cells", 100.0 * tets as f64 / n_cells as f64),
    }
}

/// Size of a family.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FamilySize {
    /// Number of vertices of the family's faces.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of quadrilaterals. Left out if there are none.
    #[serde(skip_serializing_if = "is_zero")]
    pub quadrilaterals: usize,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Mesh {
    /// Number of cells, of all kinds.
    pub fn n_cells(&self) -> usize {
        self.tets + self.pyramids + self.prisms + self.hexahedra
    }

    /// Counts the entities of a mesh.
    pub fn of<'a>(mesh: impl Into<HybridMesh<'a>>) -> Self {
        let hybrid = mesh.into();
        let mesh = hybrid.mesh;
        // A vertex counts once per family. Families come one after another, and each vertex keeps
        // the last family that counted it.
        let mut sizes = vec![FamilySize::default(); mesh.families.len()];
        let mut counted_for = vec![usize::MAX; mesh.vertices.len()];
        let mut order: Vec<u32> = (0..hybrid.n_faces() as u32).collect();
        order.sort_by_key(|&face| hybrid.family_of(face));
        for face in order {
            let Some(family) = hybrid.family_of(face).map(FamilyId::index) else { continue };
            let vertices = hybrid.face_vertices(face);
            match vertices.len() {
                3 => sizes[family].triangles += 1,
                _ => sizes[family].quadrilaterals += 1,
            }
            for &vertex in vertices {
                if std::mem::replace(&mut counted_for[vertex as usize], family) != family {
                    sizes[family].vertices += 1;
                }
            }
        }
        let families = mesh.families.iter().cloned().zip(sizes).collect();
        let [tets, pyramids, prisms, hexahedra] = CellKind::ALL.map(|kind| hybrid.count(kind));
        Self { vertices: mesh.vertices.len(), tets, pyramids, prisms, hexahedra, families }
    }
}
