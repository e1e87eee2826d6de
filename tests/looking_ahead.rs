//! A device that is given several batches at once has the result of one that is given them one by
//! one.

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::compare;
use glam::DVec3;
use idmesh::backend::{
    Backend, BackendError, BackendInfo, CpuBackend, DeviceNetwork, DeviceSmoother, EdgeStiffness, LevelData, Measure,
    NetworkData, Precision, Sweep,
};
use idmesh::constraint::Constraint;
use idmesh::mesh::edges::{TetEdges, VertexGraph};
use idmesh::relaxation::{Convergence, Method, Network, Relaxer, Stopping};

/// The CPU, which takes many batches at once, and counts cycles and answers.
struct Ahead {
    cpu: CpuBackend,
    cycles: Arc<AtomicUsize>,
    answers: Arc<AtomicUsize>,
}

struct AheadNetwork {
    of_cpu: Box<dyn DeviceNetwork>,
    cycles: Arc<AtomicUsize>,
    answers: Arc<AtomicUsize>,
}

impl Ahead {
    fn new(precision: Precision) -> Self {
        Self { cpu: CpuBackend::new(precision), cycles: Arc::default(), answers: Arc::default() }
    }

    fn counting(&self, of_cpu: Box<dyn DeviceNetwork>) -> Box<dyn DeviceNetwork> {
        Box::new(AheadNetwork { of_cpu, cycles: self.cycles.clone(), answers: self.answers.clone() })
    }
}

impl Backend for Ahead {
    fn info(&self) -> BackendInfo {
        self.cpu.info()
    }
    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError> {
        self.cpu.edge_stiffness(input)
    }
    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(self.counting(self.cpu.upload(network)?))
    }
    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(self.counting(self.cpu.upload_hierarchy(levels)?))
    }
    fn smoother(&self) -> Box<dyn DeviceSmoother> {
        self.cpu.smoother()
    }
}

impl DeviceNetwork for AheadNetwork {
    fn epsilon(&self) -> f64 {
        self.of_cpu.epsilon()
    }
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.of_cpu.constrain(constraint)
    }
    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.of_cpu.start(load)
    }
    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        self.answers.fetch_add(1, Ordering::Relaxed);
        self.cycles.fetch_add(sweeps.len(), Ordering::Relaxed);
        self.of_cpu.sweep(sweeps)
    }
    fn most_batches(&self) -> usize {
        16
    }
    fn sweep_batches(&mut self, batches: &[Vec<Sweep>]) -> Result<Vec<Measure>, BackendError> {
        self.answers.fetch_add(1, Ordering::Relaxed);
        self.cycles.fetch_add(batches.iter().map(Vec::len).sum(), Ordering::Relaxed);
        self.of_cpu.sweep_batches(batches)
    }
    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        self.of_cpu.correction()
    }
}

/// Springs of a brick whose stiffness grows by `contrast` along z. The sides at z = 0 and 1 are
/// held, one of them displaced.
fn network(n: usize, contrast: f64) -> (Vec<DVec3>, Network) {
    let mesh = meshes::brick(n);
    let TetEdges { edges, .. } = TetEdges::new(mesh.vertices.len(), &mesh.tets);
    let ends = |[a, b]: [u32; 2]| [mesh.vertices[a as usize], mesh.vertices[b as usize]];
    let length: Vec<f64> = edges.iter().map(|&edge| ends(edge)).map(|[a, b]| a.distance(b)).collect();
    let stiffness: Vec<f64> =
        edges.iter().map(|&edge| ends(edge)).map(|[a, b]| contrast.powf(0.5 * (a.z + b.z))).collect();
    let is_held = |at: &DVec3| at.z == 0.0 || at.z == 1.0;
    let constraint = mesh.vertices.iter().map(|at| if is_held(at) { Constraint::Held } else { Constraint::Free });
    let start = |at: &DVec3| if at.z == 1.0 { DVec3::new(at.y, at.x * at.y, 0.1) } else { DVec3::ZERO };
    let graph = VertexGraph::new(mesh.vertices.len(), &edges);
    let anchor = vec![0.0; mesh.vertices.len()];
    let network = Network::new(&graph, &stiffness, &length, constraint.collect(), anchor);
    (mesh.vertices.iter().map(start).collect(), network)
}

fn relax(
    backend: &dyn Backend,
    (start, network): &(Vec<DVec3>, Network),
    method: Method,
    stopping: &Stopping,
) -> (Vec<DVec3>, Convergence) {
    let mut displacement = start.clone();
    let mut relaxer = Relaxer::new(network.clone(), backend, method).unwrap();
    let convergence = relaxer.relax(&mut displacement, None, stopping).unwrap();
    (displacement, convergence)
}

/// In both arithmetics, at every tolerance down to roundoff, with springs that widen the spectrum,
/// and where the sweeps run out: the same bits and the same curve of changes.
#[test]
fn looking_ahead_changes_no_bit() {
    for contrast in [1.0, 1e6] {
        let network = network(9, contrast);
        for precision in [Precision::F64, Precision::F32] {
            for (tolerance, max_sweeps) in [(1e-1, 100), (1e-4, 100), (1e-9, 100), (1e-15, 60), (1e-4, 5)] {
                let stopping = Stopping { tolerance, max_sweeps };
                for method in [Method::Multigrid, Method::Chebyshev] {
                    let (expected, one_by_one) = relax(&CpuBackend::new(precision), &network, method, &stopping);
                    let (found, at_once) = relax(&Ahead::new(precision), &network, method, &stopping);
                    assert_eq!(one_by_one, at_once, "{contrast} {precision:?} {stopping:?} {method:?}");
                    compare(&expected, &found, 0.0).unwrap();
                }
            }
        }
    }
}

/// Where cycles keep what their bounds promise, no cycle is wasted, and a relaxation takes two or
/// three answers.
///
/// Fails if `MOST_AHEAD` is 1, or if batches are counted at the rate of the last one.
#[test]
fn no_cycle_is_wasted() {
    let network = network(12, 1.0);
    for tolerance in [1e-4, 1e-8, 1e-12] {
        let stopping = Stopping { tolerance, ..Stopping::default() };
        let ahead = Ahead::new(Precision::F64);
        let (_, convergence) = relax(&ahead, &network, Method::Multigrid, &stopping);
        assert!(convergence.converged && convergence.sweeps >= 5, "{convergence:?}");
        assert_eq!(ahead.cycles.load(Ordering::Relaxed), convergence.sweeps, "{tolerance}");
        assert!(ahead.answers.load(Ordering::Relaxed) <= 3, "{tolerance}: {:?}", ahead.answers);
    }
}
