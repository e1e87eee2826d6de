//! Backends: the devices that compute the spring networks. The CPU computes in f64, the reference,
//! or in f32; a GPU in f64 too where it can. The inside of multigrid cycles is in f32 everywhere.
//!
//! A backend evaluates stiffness, sweeps a network and measures it. A backend knows no wings and no
//! tolerances; [`crate::relaxation`] decides on the number of sweeps.

#[doc(hidden)]
pub mod cpu;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub mod gpu;
mod packed;
mod resident;
mod select;
mod smoother;
mod vectors;

pub use cpu::CpuBackend;
pub use resident::{EndOfPass, Resident, Surroundings};
pub use select::{Selection, adapters, select};
pub use smoother::{Ball, DeviceSmoother, SmoothingObjective, SmoothingPatch};

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;
use thiserror::Error;

use crate::constraint::Constraint;
use crate::mesh::csr::Csr;

/// A spring network in the layout for a backend.
#[derive(Clone, Copy, Debug)]
pub struct NetworkData<'a> {
    /// Neighbours of each vertex: `n_vertices` rows, each edge in both of its rows.
    pub graph: &'a Arc<Csr>,
    /// Spring stiffness `[n_entries]`, one per entry of `graph`, `>= 0`; only ratios matter.
    pub stiffness: &'a [f64],
    /// Stiffness of each vertex's anchor `[n_vertices]`, `>= 0`: a spring to displacement zero.
    pub anchor: &'a [f64],
    /// One over the length of each vertex's shortest edge `[n_vertices]`: the unit of errors.
    pub inverse_length: &'a [f64],
    /// Constraint of each vertex `[n_vertices]`.
    pub constraint: &'a [Constraint],
}

/// A network that its owner keeps, and whose rows that move are on a device. A device in the CPU's
/// memory reads the springs here instead of a copy.
#[derive(Clone, Debug)]
pub struct WholeNetwork {
    /// Neighbours of each vertex: `n_vertices` rows.
    pub graph: Arc<Csr>,
    /// Spring stiffness `[n_entries]`, one per entry of `graph`.
    pub stiffness: Arc<Vec<f64>>,
    /// The vertex of each row that moves, ascending. The neighbours of a row that move stand in the
    /// order of `graph`. `None` if every vertex is a row.
    pub moving: Option<Arc<Vec<u32>>>,
}

impl WholeNetwork {
    /// The entries of a row that moves, those of held neighbours among them.
    pub(crate) fn range(&self, row: usize) -> Range<usize> {
        self.graph.range(self.moving.as_ref().map_or(row, |moving| moving[row] as usize))
    }
}

/// The coefficients of one sweep.
///
/// `e_new = e + P (relaxation * r + momentum * (e - e_previous))`, with `r_i = (sum_j k_ij (e_j -
/// e_i) - anchor_i e_i) / (sum_j k_ij + anchor_i) + load_i` and the projection `P` on the vertex's
/// constraint. With `momentum = 0` it is a (damped) Jacobi sweep; Chebyshev semi-iteration uses
/// both factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Factor of the residual, without unit.
    pub relaxation: f64,
    /// Factor of the last change, without unit.
    pub momentum: f64,
}

/// Weights that transfer corrections or residuals from the vertices of one network to the vertices
/// of another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Sources of each target: `n_targets` rows.
    pub sources: Csr,
    /// Weight of each entry of `sources` `[n_entries]`, without unit.
    pub weights: Vec<f64>,
}

/// A level of a hierarchy of networks in the layout for a backend.
#[derive(Clone, Copy, Debug)]
pub struct LevelData<'a> {
    /// The level's network.
    pub network: NetworkData<'a>,
    /// Sweeps before the coarser level's correction, and again after it. On the coarsest level all
    /// sweeps.
    pub sweeps: &'a [Sweep],
    /// Transfers of this level's residual to the load of the coarser level, and of its correction
    /// back. `None` on the coarsest level.
    pub transfers: Option<[&'a Transfer; 2]>,
}

/// The measure of a batch of sweeps, taken after its last sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Largest `|e - e at the last measure| * inverse_length` over the vertices, without unit.
    pub change: f64,
    /// Euclidean norm of `P r` over the vertices (see [`Sweep`]), in the unit of a displacement.
    /// NaN for a hierarchy, whose cycles do not compute it.
    pub residual: f64,
}

/// Input of the torsional stiffness: edges, and the tets around them.
#[derive(Clone, Copy, Debug)]
pub struct EdgeStiffness<'a> {
    /// Vector from each edge's first to its second vertex `[n_edges]`, in any unit.
    pub edge_vector: &'a [DVec3],
    /// Tets around each edge: `n_edges` rows, each entry is `tet * 6 + local edge`.
    pub edge_tets: &'a Csr,
    /// Edges 01 02 03 12 13 23 of each tet `[n_tets]`, each stored as `edge * 2 + reversed`;
    /// `reversed` is 1 if the local edge has the opposite direction.
    pub tet_edges: &'a [[u32; 6]],
}

/// Number type of the loads and corrections of a backend's multigrid cycles, and of all sweeps on
/// the CPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Double precision: the reference.
    #[default]
    F64,
    /// Single precision.
    F32,
}

impl Precision {
    /// `"f64"` or `"f32"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }

    /// Unit roundoff of the number type.
    pub fn epsilon(self) -> f64 {
        match self {
            Self::F64 => f64::EPSILON,
            Self::F32 => f64::from(f32::EPSILON),
        }
    }
}

/// The device of a backend, for reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// `"cpu"` or `"gpu"`.
    pub kind: &'static str,
    /// Name of the adapter or processor.
    pub adapter: String,
    /// Driver name and version; empty for the CPU.
    pub driver: String,
    /// The number type in which the device corrects displacements.
    pub arithmetic: Precision,
}

/// What passed between the CPU and a device, and what the device was told to do, since it was
/// opened. Sessions that share a device count together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DeviceWork {
    /// Bytes sent to the device.
    pub bytes_up: u64,
    /// Bytes received from the device.
    pub bytes_down: u64,
    /// Lists of commands submitted.
    pub submissions: u64,
    /// Waits for an answer.
    pub reads: u64,
    /// Kernels started.
    pub dispatches: u64,
    /// Copies within the device.
    pub copies: u64,
    /// Arrays set to zero.
    pub clears: u64,
}

impl DeviceWork {
    /// The work since an earlier moment.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            bytes_up: self.bytes_up - earlier.bytes_up,
            bytes_down: self.bytes_down - earlier.bytes_down,
            submissions: self.submissions - earlier.submissions,
            reads: self.reads - earlier.reads,
            dispatches: self.dispatches - earlier.dispatches,
            copies: self.copies - earlier.copies,
            clears: self.clears - earlier.clears,
        }
    }
}

/// Seconds of a device since it was opened. Sessions that share a device count together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceTimes {
    /// Seconds of waiting for the device's answers.
    pub waiting: f64,
    /// Seconds of the device's kernels, by its own clock. `None`: nobody asked for them, or the
    /// device has no clock.
    pub kernels: Option<f64>,
}

impl DeviceTimes {
    /// The seconds since an earlier moment.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            waiting: self.waiting - earlier.waiting,
            kernels: self.kernels.map(|kernels| kernels - earlier.kernels.unwrap_or(0.0)),
        }
    }
}

/// An adapter of the system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Name of the adapter.
    pub name: String,
    /// `"discrete GPU"`, `"integrated GPU"`, `"virtual GPU"`, `"software"` or `"other"`.
    pub kind: &'static str,
    /// Driver name and version.
    pub driver: String,
    /// The graphics interface: `"vulkan"`, `"metal"` or `"dx12"`.
    pub api: String,
    /// Most bytes of one array.
    pub max_array_bytes: u64,
    /// The number type in which the adapter corrects displacements.
    pub arithmetic: Precision,
    /// Whether [`Selection::Auto`] takes the adapter.
    pub auto: bool,
}

/// An error of a backend.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BackendError {
    /// There is no usable adapter.
    #[error("no usable GPU: {0}")]
    NoAdapter(String),
    /// An operation of the device failed.
    #[error("GPU {adapter}: {message}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// The device's message.
        message: String,
    },
    /// A variable of the environment has a value without a meaning.
    #[error("the variable {name} is `{value}`, expected {expected}")]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
    /// The network does not fit the device.
    #[error("the network needs {needed} bytes in one buffer, but GPU {adapter} holds at most {available}")]
    TooLarge {
        /// Name of the adapter.
        adapter: String,
        /// Bytes needed.
        needed: u64,
        /// Bytes available.
        available: u64,
    },
}

/// A device that relaxes networks.
pub trait Backend: Send + Sync {
    /// The device, for reports.
    fn info(&self) -> BackendInfo;

    /// The work of the device since it was opened. `None` for the CPU.
    fn work(&self) -> Option<DeviceWork> {
        None
    }

    /// The times of the device since it was opened. `None` for the CPU.
    fn times(&self) -> Option<DeviceTimes> {
        None
    }

    /// Bytes a second that the device reads and writes when it copies an array, for benchmarks.
    /// `None` for the CPU.
    ///
    /// # Errors
    /// The device failed.
    #[doc(hidden)]
    fn copying(&self) -> Result<Option<f64>, BackendError> {
        Ok(None)
    }

    /// Whether the device relaxes a network with so many moving vertices. All others are relaxed on
    /// the CPU in f64.
    fn takes(&self, n_moving: usize) -> bool {
        let _ = n_moving;
        true
    }

    /// Torsional stiffness of each edge `[n_edges]`, without unit: the sum over its tets of
    /// `1 / sin^2` of the dihedral angle that faces the edge. For a GPU it is computed on the CPU
    /// in f64.
    ///
    /// # Errors
    /// The device failed, or the mesh does not fit.
    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError>;

    /// Brings a network to the device, ready for [`DeviceNetwork::start`].
    ///
    /// # Errors
    /// The device failed, or the network does not fit.
    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError>;

    /// Brings a hierarchy of networks to the device, finest level first. A [`Sweep`] of a hierarchy
    /// is a multigrid cycle: `e_new = e + relaxation (V(e) - e) + momentum (e - e_previous)`. `V`
    /// stands for the sweeps of all levels on the way down to the coarsest level and up again.
    ///
    /// # Errors
    /// The device failed, or the networks do not fit.
    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError>;

    /// [`Self::upload_hierarchy`] of the rows that move of a network that the caller keeps.
    ///
    /// - `whole`: the network. By default it is not used
    ///
    /// # Errors
    /// As for [`Self::upload_hierarchy`].
    fn upload_hierarchy_of(
        &self,
        whole: &WholeNetwork,
        levels: &[LevelData],
    ) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        let _ = whole;
        self.upload_hierarchy(levels)
    }

    /// The device's local optimisation.
    fn smoother(&self) -> Box<dyn DeviceSmoother>;
}

/// A network on its device. It relaxes a *correction* `e` of the displacement. The correction is
/// zero at held vertices, and the load drives it.
pub trait DeviceNetwork: Send {
    /// Unit roundoff of the correction's number type: `f32::EPSILON` or `f64::EPSILON`.
    fn epsilon(&self) -> f64;

    /// Replaces the constraints `[n_vertices]`. For a hierarchy: the constraints of all levels, one
    /// level after another, finest first.
    ///
    /// # Errors
    /// The device failed.
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError>;

    /// Begins a pass with `e = 0`.
    ///
    /// - `load` `[n_vertices]`: residual over the row's stiffness, in the unit of a displacement
    ///
    /// # Errors
    /// The device failed.
    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError>;

    /// Runs the sweeps in order, then measures. No data are read back between sweeps.
    ///
    /// # Errors
    /// The device failed.
    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError>;

    /// Most batches that [`Self::sweep_batches`] wants to be given at once. Where an answer of the
    /// device costs more than a batch, it is more than one.
    fn most_batches(&self) -> usize {
        1
    }

    /// [`Self::sweep`] for each batch, with a measure after each.
    ///
    /// - `batches`: none is empty
    ///
    /// # Errors
    /// The device failed.
    fn sweep_batches(&mut self, batches: &[Vec<Sweep>]) -> Result<Vec<Measure>, BackendError> {
        batches.iter().map(|batch| self.sweep(batch)).collect()
    }

    /// Prepares relaxations whose values stay on the device. `false` if the device does not keep
    /// them.
    ///
    /// # Errors
    /// The device failed.
    fn reside(&mut self, around: &Surroundings) -> Result<bool, BackendError> {
        let _ = around;
        Ok(false)
    }

    /// The network as one whose values stay on the device, after [`Self::reside`].
    fn resident(&mut self) -> Option<&mut dyn Resident> {
        None
    }

    /// The present correction `e` `[n_vertices]`, in the unit of a displacement.
    ///
    /// # Errors
    /// The device failed.
    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError>;

    /// Makes room for the corrections of several designs, in place of the one of
    /// [`DeviceNetwork::start`]. `None` if the device takes one design after another, as for one
    /// design.
    ///
    /// - `designs`: at most [`MOST_TOGETHER`]
    fn together(&mut self, designs: usize) -> Option<&mut dyn Together> {
        let _ = designs;
        None
    }
}

/// Most designs whose corrections a device relaxes at once. Vectors of more designs fall out of the
/// CPU's cache.
pub const MOST_TOGETHER: usize = 4;

/// The corrections of several designs on one network, whose springs a cycle reads once for all of
/// them. Each correction has the bits that it has alone.
pub trait Together {
    /// [`DeviceNetwork::start`] for one of the designs.
    ///
    /// # Errors
    /// The device failed.
    fn start(&mut self, design: usize, load: &[DVec3]) -> Result<(), BackendError>;

    /// One cycle of each design. Returns the change of each; see [`Measure::change`].
    ///
    /// - `sweeps` `[designs]`: with factors 0 and 0 a correction stays
    ///
    /// # Errors
    /// The device failed.
    fn cycle(&mut self, sweeps: &[Sweep]) -> Result<Vec<f64>, BackendError>;

    /// [`DeviceNetwork::correction`] of one of the designs.
    ///
    /// # Errors
    /// The device failed.
    fn correction(&self, design: usize) -> Result<Vec<DVec3>, BackendError>;
}
