//! [`RunReport`]: the report of one design. Every key is there in every report. What a report
//! cannot hold is `null`, and [`RunReport::reasons`] says why.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Backend, Checksums, Kind, Mesh, Outline, SolverQualities, WorstCell, by_kind, limits_by_name};
use crate::backend::DeviceWork;
use crate::mover::{
    FamilyReport, Fault, MovedSection, Outcome, Place, ProfileReport, Refused, Solver, StageName, StageQuality,
    StageRelaxation, StageSeconds,
};
use crate::profile::Profile;
use crate::volume::Path;

/// The report of one design. A design that could not be moved has no measures: their fields are
/// `None`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunReport {
    /// Version of idmesh.
    pub idmesh: String,
    /// The case file, as the user named it.
    pub case: String,
    /// Name of the design. `None` for the design of the case itself.
    pub design: Option<String>,
    /// The device that computed.
    pub backend: Backend,
    /// Size of the mesh.
    pub mesh: Mesh,
    /// Whether the moved mesh is the one that was asked for; see
    /// [`crate::mover::Outcome::is_valid`].
    pub valid: bool,
    /// Whether every relaxation reached its tolerance.
    pub converged: Option<bool>,
    /// The exit code that `idmesh run` has for this result.
    pub exit: u8,
    /// The reason why the result may not be used. `None` for a good result.
    pub error: Option<ReportError>,
    /// The measures that decide whether the mesh is valid.
    pub checks: Option<Checks>,
    /// What the volume's motion repaired.
    pub repaired: Option<Repaired>,
    /// Quality and time of each stage, in order.
    pub stages: Option<Vec<StageQuality>>,
    /// Quality of each kind of cell of the moved mesh, by the plural of its name. `None` for a mesh
    /// of tets.
    pub cells: Option<BTreeMap<&'static str, Kind>>,
    /// The same of the original mesh. The moved mesh is judged by comparison with these values.
    pub cells_original: Option<BTreeMap<&'static str, Kind>>,
    /// The original and the moved mesh in the words of flow solvers. `None` if nothing asked for
    /// it.
    pub solver_quality: Option<SolverQualities>,
    /// The cells with the lowest quality in the moved mesh, the worst first.
    pub worst_cells: Option<Vec<WorstCell>>,
    /// Deviations of each family from its shape, by name. Families with nothing to report are left
    /// out.
    pub families: Option<BTreeMap<String, FamilyReport>>,
    /// Deviations of each wing from its new profiles, by the name of the wing and of each of its
    /// families.
    pub profiles: Option<BTreeMap<String, ProfileReport>>,
    /// Distances of the moved wings' sections from the new profiles, by the wing's name.
    pub sections: Option<BTreeMap<String, Vec<MovedSection>>>,
    /// Curves of the sections that change most, to draw, by the wing's name.
    pub outlines: Option<BTreeMap<String, Vec<Outline>>>,
    /// The relaxation of the volume's network.
    pub solver: Option<Solver>,
    /// How the relaxations went, in the order of the stages.
    pub relaxations: Option<Vec<StageRelaxation>>,
    /// What the update asked of the device. `None` for the CPU.
    pub device_work: Option<DeviceWork>,
    /// Seconds of each stage of the update, in order, and of the measures of the result.
    pub stage_seconds: Option<Vec<StageSeconds>>,
    /// The steps of the volume stage.
    pub path: Option<Path>,
    /// Local optimisation, if it ran.
    pub smoothing: Option<Smoothing>,
    /// Remarks on the result that do not make it invalid.
    pub warnings: Vec<String>,
    /// Checksums of the files that were read and written.
    pub checksums: Option<Checksums>,
    /// Seconds of each part of the run.
    pub seconds: Option<Seconds>,
    /// For each key that is `null`, the reason. Keys are JSON Pointers (RFC 6901), such as
    /// `/checks/max_miss_of_vertices`.
    pub reasons: BTreeMap<String, String>,
}

/// The reason why a result may not be used.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReportError {
    /// The kind of the gravest fault; see [`crate::mover::FaultKind`]. `"input"`: a file or the
    /// case is wrong, or an output cannot be written.
    pub kind: String,
    /// The number of entities at fault.
    pub count: Option<usize>,
    /// The place of the worst entity.
    pub place: Option<Place>,
    /// All faults in words.
    pub message: String,
    /// What may help.
    pub hint: Option<String>,
    /// All faults, the gravest first. Empty if nothing was moved.
    pub faults: Vec<Fault>,
}

/// The measures that decide whether a moved mesh is valid. Distances are in the mesh's unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Checks {
    /// Number of inverted cells, of all kinds.
    pub inverted_tets: usize,
    /// Number of surface triangles that self-intersect and did not before.
    pub self_intersecting_triangles: usize,
    /// Number of surface triangles that are turned over against the triangles around them.
    pub folded_triangles: usize,
    /// Number of vertices that left their carenage or plane.
    pub vertices_off_surface: usize,
    /// Largest distance of a vertex from its carenage or plane.
    pub max_distance_off_surface: Option<f64>,
    /// Number of pairs of vertices in periodic planes that parted.
    pub parted_partners: usize,
    /// Number of vertices that the design moves and a family holds.
    pub held_back_vertices: usize,
    /// Largest distance between new profiles and the moved wings' facets.
    pub max_distance_to_new_profiles: Option<f64>,
    /// Largest miss of a wing's vertices, as a share of the profile's length.
    pub max_miss_of_vertices: Option<f64>,
}

impl Checks {
    /// The measures of an outcome.
    pub fn of(outcome: &Outcome) -> Self {
        let greatest = |values: &mut dyn Iterator<Item = Option<f64>>| values.flatten().reduce(f64::max);
        let families = outcome.families.values();
        let distances = families.map(|family| family.max_distance_to_original_surface.or(family.max_distance_to_plane));
        Self {
            inverted_tets: outcome.inverted,
            self_intersecting_triangles: outcome.self_intersecting.len(),
            folded_triangles: outcome.folded.values().sum(),
            vertices_off_surface: outcome.off_surface.values().map(|off| off.vertices).sum(),
            max_distance_off_surface: greatest(&mut distances.into_iter()),
            // Both planes of a pair have its deviation.
            parted_partners: outcome.parted.values().map(|parted| parted.vertices).sum::<usize>() / 2,
            held_back_vertices: outcome.held_back.iter().map(|held| held.vertices).sum(),
            max_distance_to_new_profiles: greatest(
                &mut outcome.profiles.values().map(|profiles| profiles.max_distance_to_new_profiles),
            ),
            max_miss_of_vertices: greatest(
                &mut outcome.profiles.values().map(|profiles| profiles.max_miss_of_vertices),
            ),
        }
    }
}

/// What the volume's motion repaired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Repaired {
    /// Number of cells that the moved surface inverted and that are valid in the end.
    pub inverted_tets: usize,
    /// Number of vertices that local optimisation moved.
    pub optimised_vertices: usize,
}

impl Repaired {
    /// The repairs of an outcome.
    pub fn of(outcome: &Outcome) -> Self {
        let corrected = outcome.stages.iter().find(|stage| stage.name == StageName::Corrected);
        let inverted = corrected.map_or(0, |stage| stage.inverted);
        Self {
            inverted_tets: inverted.saturating_sub(outcome.inverted),
            optimised_vertices: outcome.smoothed.map_or(0, |done| done.moved),
        }
    }
}

/// The result of local optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Smoothing {
    /// Number of sweeps over the vertices at bad tets.
    pub sweeps: usize,
    /// Number of vertices that local optimisation moved.
    pub moved: usize,
}

/// Seconds of each part of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading of the mesh and the profiles.
    pub read: f64,
    /// Set-up, once per mesh.
    pub setup: f64,
    /// Update, once per design: all stages, no files.
    pub update: f64,
    /// Writing of the moved mesh.
    pub write: f64,
    /// The whole run.
    pub total: f64,
}

impl RunReport {
    /// The report of a design that was not moved.
    ///
    /// - `exit`: the exit code of `idmesh run` for this error
    pub fn failed(case: String, design: Option<String>, backend: Backend, mesh: Mesh, exit: u8) -> Self {
        Self {
            idmesh: env!("CARGO_PKG_VERSION").to_owned(),
            case,
            design,
            backend,
            mesh,
            valid: false,
            converged: None,
            exit,
            error: None,
            checks: None,
            repaired: None,
            stages: None,
            cells: None,
            cells_original: None,
            solver_quality: None,
            worst_cells: None,
            families: None,
            profiles: None,
            sections: None,
            outlines: None,
            solver: None,
            relaxations: None,
            device_work: None,
            stage_seconds: None,
            path: None,
            smoothing: None,
            warnings: Vec::new(),
            checksums: None,
            seconds: None,
            reasons: BTreeMap::new(),
        }
    }

    /// Fills the fields that come from an outcome.
    ///
    /// - `refused`: why the outcome may not be used
    pub fn of_outcome(mut self, outcome: &Outcome, refused: Option<&Refused>) -> Self {
        self.valid = outcome.is_valid();
        self.converged = Some(outcome.converged);
        self.error = refused.map(ReportError::of_refused);
        self.checks = Some(Checks::of(outcome));
        self.repaired = Some(Repaired::of(outcome));
        self.stages = Some(outcome.stages.clone());
        self.cells = outcome.kinds.as_deref().map(by_kind);
        self.cells_original = outcome.original_kinds.as_deref().map(by_kind);
        self.worst_cells = Some(WorstCell::list(outcome));
        self.families = Some(outcome.families.clone());
        self.profiles = Some(outcome.profiles.clone());
        self.sections = Some(outcome.sections.clone());
        self.solver = Some(outcome.solver.clone());
        self.relaxations = Some(outcome.relaxations.clone());
        self.device_work = outcome.device_work;
        self.stage_seconds = Some(outcome.stage_seconds.clone());
        self.path = Some(outcome.path.clone());
        self.smoothing = outcome.smoothed.map(|done| Smoothing { sweeps: done.sweeps, moved: done.moved });
        self.warnings = outcome.warnings.iter().map(ToString::to_string).collect();
        self
    }

    /// Fills [`RunReport::solver_quality`]. This measures the moved mesh, and the original once.
    pub fn with_solver_quality(mut self, outcome: &Outcome) -> Self {
        self.solver_quality = Some(SolverQualities {
            limits: limits_by_name(outcome.limits()),
            original: outcome.original_solver_measures().into(),
            moved: outcome.solver_measures().into(),
        });
        self
    }
}

impl RunReport {
    /// Adds the curves of the sections that change most.
    ///
    /// - `old`: the old profiles of each wing, with the wing's name
    pub fn with_outlines<'a>(mut self, outcome: &Outcome, old: impl Iterator<Item = (&'a str, &'a [Profile])>) -> Self {
        self.outlines = Some(Outline::of_outcome(outcome, old));
        self
    }
}

impl ReportError {
    /// The error of a result that may not be used.
    pub fn of_refused(refused: &Refused) -> Self {
        let gravest = refused.faults.first();
        Self {
            kind: gravest.map_or_else(String::new, |fault| fault.kind.name().to_owned()),
            count: gravest.map(|fault| fault.count),
            place: gravest.and_then(|fault| fault.place.clone()),
            message: refused.message.clone(),
            hint: refused.hint.clone(),
            faults: refused.faults.clone(),
        }
    }

    /// The error of a design that was not moved.
    ///
    /// - `kind`: `"input"` or another kind of [`ReportError::kind`]
    pub fn of_message(kind: &str, message: String, hint: Option<String>) -> Self {
        Self { kind: kind.to_owned(), count: None, place: None, message, hint, faults: Vec::new() }
    }
}
