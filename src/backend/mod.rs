//! Where the arithmetic of the spring networks runs: the CPU (f64, the reference, or f32) or a GPU (f32).
//!
//! A backend knows nothing of wings or tolerances: it evaluates stiffness, sweeps a network and measures it.
//! [`crate::relaxation`] decides how often.

pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
mod packed;
mod select;
mod smoother;
mod vectors;

pub use cpu::{CpuBackend, Precision};
pub use select::{AdapterSummary, Selection, adapters, select};
pub use smoother::{Ball, DeviceSmoother, SmoothingObjective, SmoothingPatch};

use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use crate::constraint::Constraint;
use crate::mesh::csr::Csr;

/// A spring network as a backend sees it.
#[derive(Clone, Copy, Debug)]
pub struct NetworkData<'a> {
    /// Neighbours of each vertex `[n_vertices]` rows, each edge in both of its rows.
    pub graph: &'a Arc<Csr>,
    /// Spring stiffness `[n_entries]`, one per entry of `graph`, `>= 0`; only ratios matter.
    pub stiffness: &'a [f64],
    /// Stiffness of the spring that ties each vertex to displacement zero `[n_vertices]`, `>= 0`.
    pub anchor: &'a [f64],
    /// One over the length of each vertex's shortest edge `[n_vertices]`: the unit errors are measured in.
    pub inverse_length: &'a [f64],
    /// What each vertex may do `[n_vertices]`.
    pub constraint: &'a [Constraint],
}

/// One sweep: `e_new = e + P (relaxation * r + momentum * (e - e_previous))`,
/// `r_i = (sum_j k_ij (e_j - e_i) - anchor_i e_i) / (sum_j k_ij + anchor_i) + load_i`, `P` the vertex's constraint.
///
/// `momentum = 0` is a (damped) Jacobi sweep; Chebyshev semi-iteration uses both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Factor of the residual, dimensionless.
    pub relaxation: f64,
    /// Factor of the last change, dimensionless.
    pub momentum: f64,
}

/// Weights that carry corrections or residuals from the vertices of one network to those of another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// For each target the sources it gathers from `[n_targets]` rows.
    pub sources: Csr,
    /// Weight of each entry of `sources` `[n_entries]`.
    pub weights: Vec<f64>,
}

/// A level of a hierarchy of networks as a backend sees it.
#[derive(Clone, Copy, Debug)]
pub struct LevelData<'a> {
    /// The level's network.
    pub network: NetworkData<'a>,
    /// Sweeps before and again after the coarser level's correction; on the coarsest level all there are.
    pub sweeps: &'a [Sweep],
    /// From residuals of this level to the load of the coarser one, and from its correction back; none on the coarsest.
    pub transfers: Option<[&'a Transfer; 2]>,
}

/// What a batch of sweeps did, taken after its last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Largest `|e - e at the last measure| * inverse_length` over the vertices, dimensionless.
    pub change: f64,
    /// Euclidean norm of `P r` over the vertices (see [`Sweep`]), in the unit of a displacement; NaN for a hierarchy, whose
    /// cycles do not come to know it.
    pub residual: f64,
}

/// Input of the torsional stiffness: edges and the tets around them.
#[derive(Clone, Copy, Debug)]
pub struct EdgeStiffness<'a> {
    /// Vector from each edge's first to its second vertex `[n_edges]`.
    pub edge_vector: &'a [DVec3],
    /// For each edge `[n_edges]` the tets around it, each entry `tet * 6 + local edge`.
    pub edge_tets: &'a Csr,
    /// For each tet the edges 01 02 03 12 13 23 `[n_tets]`, each `edge * 2 + (1 if the tet runs it backwards)`.
    pub tet_edges: &'a [[u32; 6]],
}

/// Which device a backend computes on, for reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// `"cpu"` or `"gpu"`.
    pub kind: &'static str,
    /// Name of the adapter or processor.
    pub adapter: String,
    /// Driver name and version; empty for the CPU.
    pub driver: String,
}

/// Why a backend could not do its work.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BackendError {
    /// There is no adapter the backend can use.
    #[error("no usable GPU: {0}")]
    NoAdapter(String),
    /// The device refused or failed an operation.
    #[error("GPU {adapter}: {message}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        message: String,
    },
    /// The network does not fit on the device.
    #[error("the network needs {needed} bytes in one buffer, but GPU {adapter} holds at most {available}")]
    TooLarge {
        /// Name of the adapter.
        adapter: String,
        /// Bytes asked for.
        needed: u64,
        /// Bytes to be had.
        available: u64,
    },
}

/// A place where networks are relaxed.
pub trait Backend: Send + Sync {
    /// The device, for reports.
    fn info(&self) -> BackendInfo;

    /// Unit roundoff of the arithmetic networks are relaxed in: `f32::EPSILON` or `f64::EPSILON`.
    fn epsilon(&self) -> f64;

    /// Torsional stiffness of each edge `[n_edges]`, dimensionless: the sum over its tets of `1 / sin^2` of the dihedral angle
    /// that faces it.
    ///
    /// # Errors
    /// The device failed or the mesh does not fit.
    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError>;

    /// Takes a network to the device, ready for [`DeviceNetwork::start`].
    ///
    /// # Errors
    /// The device failed or the network does not fit.
    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError>;

    /// Takes a hierarchy of networks to the device, finest first. A [`Sweep`] of it is a multigrid cycle:
    /// `e_new = e + relaxation (V(e) - e) + momentum (e - e_previous)`, `V` the sweeps of all levels on the way down to
    /// the coarsest one and up again.
    ///
    /// # Errors
    /// The device failed or the networks do not fit.
    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError>;

    /// What smooths patches of a mesh on the device.
    fn smoother(&self) -> Box<dyn DeviceSmoother>;
}

/// A network on its device. It relaxes a *correction* `e` to the displacement: zero at held vertices, driven by a load.
pub trait DeviceNetwork: Send {
    /// Replaces the constraints `[n_vertices]`; those of a hierarchy's levels stand one after another, finest first.
    ///
    /// # Errors
    /// The device failed.
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError>;

    /// Begins a pass: `e = 0`, with this load `[n_vertices]` (the residual divided by the row's stiffness, in the unit
    /// of a displacement).
    ///
    /// # Errors
    /// The device failed.
    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError>;

    /// Runs the sweeps in order, then measures. Nothing is read back between them.
    ///
    /// # Errors
    /// The device failed.
    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError>;

    /// The correction `e` `[n_vertices]` as it stands.
    ///
    /// # Errors
    /// The device failed.
    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError>;
}
