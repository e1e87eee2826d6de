//! [`SolverQuality`]: the measures of a mesh in the words of flow solvers, in reports and tables.

use std::collections::BTreeMap;

use serde::Serialize;

use super::table::{aligned, beta_text};
use crate::solver_measures::{self, Limits, SEVERE, SolverMeasures};
use crate::text::figures::Shortest;

/// The measures of a mesh, of its cells as OpenFOAM's `checkMesh` has them, and of its dual volumes
/// as SU2 has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolverQuality {
    /// As `checkMesh` has them.
    pub openfoam: OpenFoam,
    /// As SU2 has them.
    pub su2: Su2,
}

/// The measures of [`solver_measures::OpenFoam`]. Volumes are in the cube of the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OpenFoam {
    /// Largest non-orthogonality of a face between two cells, in degrees.
    pub non_orthogonality_max: f64,
    /// Mean non-orthogonality, in degrees.
    pub non_orthogonality_mean: f64,
    /// Number of faces beyond 70 degrees.
    pub severely_non_orthogonal_faces: usize,
    /// Largest skewness of a face.
    pub skewness_max: f64,
    /// Largest aspect ratio of a cell.
    pub aspect_ratio_max: f64,
    /// Number of face pyramids with a negative volume.
    pub wrong_face_pyramids: usize,
    /// Smallest volume of a cell.
    pub volume_min: f64,
    /// Largest volume of a cell.
    pub volume_max: f64,
}

/// The measures of [`solver_measures::Su2`]. Volumes are in the cube of the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Su2 {
    /// Smallest orthogonality of a dual volume, in degrees.
    pub orthogonality_min: f64,
    /// Largest orthogonality.
    pub orthogonality_max: f64,
    /// Smallest aspect ratio of a dual volume's areas.
    pub aspect_ratio_min: f64,
    /// Largest aspect ratio.
    pub aspect_ratio_max: f64,
    /// Smallest ratio of the parts of a dual volume.
    pub volume_ratio_min: f64,
    /// Largest ratio.
    pub volume_ratio_max: f64,
    /// Smallest dual volume.
    pub dual_volume_min: f64,
    /// Largest dual volume.
    pub dual_volume_max: f64,
}

impl From<&SolverMeasures> for SolverQuality {
    fn from(measures: &SolverMeasures) -> Self {
        let SolverMeasures { openfoam: of_cells, su2: of_duals } = measures;
        let solver_measures::OpenFoam { non_orthogonality_mean, volume: [volume_min, volume_max], .. } = *of_cells;
        let openfoam = OpenFoam {
            non_orthogonality_max: of_cells.non_orthogonality.value(),
            non_orthogonality_mean,
            severely_non_orthogonal_faces: of_cells.severely_non_orthogonal,
            skewness_max: of_cells.skewness.value(),
            aspect_ratio_max: of_cells.aspect_ratio.value(),
            wrong_face_pyramids: of_cells.pyramids.beyond,
            volume_min,
            volume_max,
        };
        let solver_measures::Su2 { orthogonality_max, aspect_ratio_min, volume_ratio_min, .. } = *of_duals;
        let [dual_volume_min, dual_volume_max] = of_duals.volume;
        let su2 = Su2 {
            orthogonality_min: of_duals.orthogonality.value(),
            orthogonality_max,
            aspect_ratio_min,
            aspect_ratio_max: of_duals.aspect_ratio.value(),
            volume_ratio_min,
            volume_ratio_max: of_duals.volume_ratio.value(),
            dual_volume_min,
            dual_volume_max,
        };
        Self { openfoam, su2 }
    }
}

/// The measures of a moved mesh and of the original.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolverQualities {
    /// The limits of the case, by name. Beyond them a result is not valid.
    pub limits: BTreeMap<&'static str, f64>,
    /// The original mesh.
    pub original: SolverQuality,
    /// The moved mesh.
    pub moved: SolverQuality,
}

/// Limits by name, as reports have them.
pub fn limits_by_name(limits: &Limits) -> BTreeMap<&'static str, f64> {
    limits.all().map(|(row, limit)| (row.name, limit)).collect()
}

/// A row of the table of measures.
pub(crate) struct Row {
    /// The measure in words.
    pub(crate) name: String,
    /// The name of its limit. Empty if it has none.
    pub(crate) limit: &'static str,
    /// The figure of each mesh.
    pub(crate) values: Vec<String>,
}

/// The measures of some meshes as rows, a solver's rows together.
pub(crate) fn rows(meshes: &[&SolverQuality]) -> Vec<Row> {
    let row = |name: &str, limit, value: &dyn Fn(&SolverQuality) -> String| Row {
        name: name.to_owned(),
        limit,
        values: meshes.iter().map(|mesh| value(mesh)).collect(),
    };
    let decimals = |value: f64| if value.abs() < 1e6 { beta_text(value, 3) } else { format!("{value:.3e}") };
    let severe = format!("OpenFOAM: faces above {SEVERE} degrees");
    vec![
        row("OpenFOAM: non-orthogonality max", "non_orthogonality", &|of| decimals(of.openfoam.non_orthogonality_max)),
        row("OpenFOAM: non-orthogonality mean", "", &|of| decimals(of.openfoam.non_orthogonality_mean)),
        row(&severe, "", &|of| of.openfoam.severely_non_orthogonal_faces.to_string()),
        row("OpenFOAM: skewness max", "skewness", &|of| decimals(of.openfoam.skewness_max)),
        row("OpenFOAM: aspect ratio max", "aspect_ratio", &|of| decimals(of.openfoam.aspect_ratio_max)),
        row("OpenFOAM: wrong face pyramids", "face_pyramids", &|of| of.openfoam.wrong_face_pyramids.to_string()),
        row("OpenFOAM: cell volume min", "", &|of| format!("{:.3e}", of.openfoam.volume_min)),
        row("SU2: orthogonality min", "dual_orthogonality", &|of| decimals(of.su2.orthogonality_min)),
        row("SU2: face area aspect ratio max", "dual_aspect_ratio", &|of| decimals(of.su2.aspect_ratio_max)),
        row("SU2: sub-volume ratio max", "dual_volume_ratio", &|of| decimals(of.su2.volume_ratio_max)),
        row("SU2: dual volume min", "", &|of| format!("{:.3e}", of.su2.dual_volume_min)),
    ]
}

/// The measures of some meshes as aligned columns: a header line, then one line per measure.
///
/// - `names`: of the meshes; one name for each
/// - `limits`: by name; the column is left out if there are none
/// - `is_short`: only measures with a limit
pub fn solver_table(
    names: &[&str],
    meshes: &[&SolverQuality],
    limits: &BTreeMap<&'static str, f64>,
    is_short: bool,
) -> String {
    let mut header = vec!["measure".to_owned()];
    header.extend(names.iter().map(|&name| name.to_owned()));
    header.extend((!limits.is_empty()).then(|| "limit".to_owned()));
    let mut lines = vec![header];
    for row in rows(meshes) {
        let limit = limits.get(row.limit);
        if is_short && limit.is_none() {
            continue;
        }
        let mut line = vec![row.name];
        line.extend(row.values);
        line.extend(limit.map(|&limit| Shortest(limit).to_string()));
        lines.push(line);
    }
    aligned(&lines)
}
