//! The CPU backend: runs the twins over chunks of rows, in parallel.

use std::fs;
use std::mem;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

mod chunks;
mod edge_stiffness;
mod finest;
mod hierarchy;
mod levels;

pub use crate::backend::Precision;
use crate::backend::packed::{Packed, PackedEdges};
use crate::backend::smoother::CpuSmoother;
use crate::backend::vectors::Vectors;
use crate::backend::{
    Backend, BackendError, BackendInfo, DeviceNetwork, DeviceSmoother, EdgeStiffness, LevelData, Measure, NetworkData,
    Sweep, WholeNetwork,
};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{Real, convergence, relax_sweep};
use chunks::{CHUNK, in_chunks, in_chunks_with};
use edge_stiffness::Edges;
use hierarchy::{DoubleHierarchy, SingleHierarchy};

/// Tets evaluated at a time for the stiffness of edges: enough for many threads, with little
/// memory.
const TETS: usize = 32 * CHUNK;

/// The CPU backend. It uses rayon's current thread pool.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend {
    /// The number type of the arithmetic.
    pub precision: Precision,
}

impl CpuBackend {
    /// A CPU backend with this number type.
    pub fn new(precision: Precision) -> Self {
        Self { precision }
    }
}

impl Backend for CpuBackend {
    fn info(&self) -> BackendInfo {
        let threads = rayon::current_num_threads();
        let plural = if threads == 1 { "" } else { "s" };
        BackendInfo {
            kind: "cpu",
            adapter: format!("{} ({threads} thread{plural}, {})", processor(), self.precision.name()),
            driver: String::new(),
            arithmetic: self.precision,
        }
    }

    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError> {
        Ok(match self.precision {
            Precision::F64 => stiffness_of_edges::<f64>(input),
            Precision::F32 => stiffness_of_edges::<f32>(input),
        })
    }

    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(match self.precision {
            Precision::F64 => Box::new(CpuNetwork::<f64>::new(network)),
            Precision::F32 => Box::new(CpuNetwork::<f32>::new(network)),
        })
    }

    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(match self.precision {
            Precision::F64 => {
                let NetworkData { graph, stiffness, .. } = levels[0].network;
                let stiffness = Arc::new(stiffness.to_vec());
                let whole = WholeNetwork { graph: Arc::clone(graph), stiffness, moving: None };
                Box::new(DoubleHierarchy::new(levels, &whole))
            }
            Precision::F32 => Box::new(SingleHierarchy::new(levels)),
        })
    }

    fn upload_hierarchy_of(
        &self,
        whole: &WholeNetwork,
        levels: &[LevelData],
    ) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        match self.precision {
            Precision::F64 => Ok(Box::new(DoubleHierarchy::new(levels, whole))),
            Precision::F32 => self.upload_hierarchy(levels),
        }
    }

    fn smoother(&self) -> Box<dyn DeviceSmoother> {
        match self.precision {
            Precision::F64 => Box::new(CpuSmoother::<f64>::new(self.precision.epsilon())),
            Precision::F32 => Box::new(CpuSmoother::<f32>::new(self.precision.epsilon())),
        }
    }
}

fn stiffness_of_edges<T: Real>(input: &EdgeStiffness) -> Vec<f64> {
    let packed = PackedEdges::<T>::new(input);
    let edges = Edges { tet_edges: input.tet_edges, edge_vector: &packed.edge_vector };
    let mut stiffness = vec![T::ZERO; input.edge_vector.len()];
    // A tet is evaluated once for its six edges. Contributions are added in the order of the tets.
    let mut facing = vec![[T::ZERO; 6]; TETS.min(input.tet_edges.len())];
    for (block, of_block) in input.tet_edges.chunks(TETS).enumerate() {
        let facing = &mut facing[..of_block.len()];
        let tasks = facing.par_chunks_mut(CHUNK).enumerate();
        tasks.for_each(|(chunk, facing)| edge_stiffness::run(block * TETS + chunk * CHUNK, &edges, facing));
        for (of_tet, facing) in of_block.iter().zip(&*facing) {
            for (&edge, &value) in of_tet.iter().zip(facing) {
                let sum = &mut stiffness[edge as usize / 2];
                *sum = *sum + value;
            }
        }
    }
    stiffness.into_iter().map(Real::to_f64).collect()
}

/// A network in the CPU's memory.
struct CpuNetwork<T> {
    packed: Packed<T>,
    e: Vectors<T>,
    e_previous: Vectors<T>,
    /// `e` at the last measure.
    snapshot: Vectors<T>,
    partials: Vec<[T; 2]>,
}

impl<T: Real> CpuNetwork<T> {
    fn new(network: &NetworkData) -> Self {
        let packed = Packed::new(network);
        let zero = || Vectors::zero(packed.n_vertices());
        Self {
            partials: vec![[T::ZERO; 2]; packed.n_vertices().div_ceil(BLOCK)],
            e: zero(),
            e_previous: zero(),
            snapshot: zero(),
            packed,
        }
    }
}

impl<T: Real> DeviceNetwork for CpuNetwork<T> {
    fn epsilon(&self) -> f64 {
        T::EPSILON.to_f64()
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.packed.constrain(constraint);
        Ok(())
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.packed.start(load);
        for e in [&mut self.e, &mut self.e_previous, &mut self.snapshot] {
            e.fill([T::ZERO; 4]);
        }
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let rows = self.packed.rows();
        for sweep in sweeps {
            let (relaxation, momentum) = (T::from_f64(sweep.relaxation), T::from_f64(sweep.momentum));
            let e = &*self.e;
            in_chunks(&mut self.e_previous, |first, e_previous| {
                relax_sweep::run(first, &rows, relaxation, momentum, e, e_previous);
            });
            mem::swap(&mut self.e, &mut self.e_previous);
        }
        let (e, inverse_length) = (&*self.e, self.packed.inverse_length());
        in_chunks_with(&mut self.snapshot, &mut self.partials, |first, snapshot, partials| {
            convergence::run(first, &rows, e, snapshot, inverse_length, partials);
        });
        self.snapshot.copy_from_slice(&self.e);
        Ok(self.packed.measure(&self.partials))
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        Ok(self.packed.correction(&self.e))
    }
}

/// The processor's name, if the system gives it.
fn processor() -> String {
    let listed = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = listed.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}
