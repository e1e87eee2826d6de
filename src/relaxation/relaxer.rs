//! Runs sweeps or cycles on a device until the displacement is close enough to equilibrium.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    FreeRows, History, Method, MovingGraph, Network, Relaxation, Spectrum, Stopping,
    multigrid::{AggregateMaps, Hierarchy},
    pass::{Ended, Pass, Verdict},
    schedule::Schedule,
};
use crate::backend::{
    Backend, BackendError, CpuBackend, DeviceNetwork, MOST_TOGETHER, Precision, Surroundings, Sweep, Together,
    WholeNetwork,
};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::figures::finite_or_nan;
use crate::kernels::{add_correction, figures, squares};

/// A network on a device. Set up once, relaxed many times.
pub struct Relaxer {
    network: Network,
    /// The vertices that move, in the order of the device.
    moving: Arc<Vec<u32>>,
    /// Only with multigrid.
    aggregate_maps: Option<AggregateMaps>,
    spectrum: Option<Spectrum>,
    method: Method,
    device: Box<dyn DeviceNetwork>,
}

/// The result of a relaxation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Whether the estimated error fell below the tolerance.
    pub converged: bool,
    /// Number of sweeps, or of cycles with multigrid.
    pub sweeps: usize,
    /// Norm of the f64 residual at the end over the norm at the start. 0 if there was nothing to
    /// do.
    pub relative_residual: f64,
    /// Largest estimated error of a vertex, as a fraction of its shortest edge.
    pub error: f64,
    /// The method of a relaxation that did not converge. `None` if all did.
    pub failed: Option<Method>,
    /// How the relaxations went.
    pub history: History,
}

impl Convergence {
    /// The results of two relaxations as one: the sum of the sweeps, and the worse of the other
    /// values.
    pub fn and(self, other: Self) -> Self {
        Self {
            converged: self.converged && other.converged,
            sweeps: self.sweeps + other.sweeps,
            relative_residual: self.relative_residual.max(other.relative_residual),
            error: self.error.max(other.error),
            failed: self.failed.or(other.failed),
            history: self.history.and(other.history),
        }
    }

    /// The result if no vertex has to move.
    pub fn nothing_to_do() -> Self {
        Self { converged: true, ..Self::default() }
    }
}

/// Most passes of a relaxation. A pass in f32 gains about five digits. After more than a handful of
/// passes nothing more is gained.
const PASSES: usize = 8;

/// A design to be relaxed.
pub struct Unrelaxed<'a> {
    /// `[n_vertices]`: on entry the start, on exit the result, in the mesh's unit.
    pub displacement: &'a mut [DVec3],
    /// Forces on the vertices over the total stiffness of their rows `[n_vertices]`, in the mesh's
    /// unit.
    pub load: Option<&'a [DVec3]>,
}

/// A design in work.
struct Run<'a> {
    design: Unrelaxed<'a>,
    /// Residual of the displacement `[n_vertices]`. Empty during a pass.
    residual: Vec<DVec3>,
    /// Norm of the residual at the start.
    first_norm: f64,
    result: Convergence,
    relaxation: Relaxation,
    is_over: bool,
}

impl Relaxer {
    /// Brings a network to the backend, or to the CPU if the backend leaves it there (see
    /// [`Backend::takes`]), and bounds its spectrum.
    ///
    /// # Errors
    /// The device failed, or the network does not fit the device.
    pub fn new(network: Network, backend: &dyn Backend, method: Method) -> Result<Self, BackendError> {
        let graph = MovingGraph::new(&network);
        Self::along(network, &graph, backend, method)
    }

    /// [`Self::new`], which shares the graph of another network if the same vertices move in both.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn along(
        network: Network,
        graph: &MovingGraph,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        // The data on the device is not kept here as well: for a large mesh it is most of the
        // memory.
        let FreeRows { network: of_moving, vertices: moving } = FreeRows::along(&network, graph);
        let reference = CpuBackend::new(Precision::F64);
        let backend = if backend.takes(moving.len()) { backend } else { &reference };
        // The bounds cost a fraction of the sweeps that they save.
        let bounds = if method.depends_on_bounds(moving.len()) { Spectrum::new(&of_moving) } else { None };
        let mut method = method.for_network(moving.len(), bounds);
        let hierarchy = (method == Method::Multigrid).then(|| Hierarchy::new(&of_moving));
        let (aggregate_maps, device, spectrum) = match hierarchy.filter(|hierarchy| hierarchy.depth() > 1) {
            Some(hierarchy) => {
                let (graph, stiffness) = (Arc::clone(&network.graph), Arc::clone(&network.stiffness));
                let whole = WholeNetwork { graph, stiffness, moving: Some(Arc::clone(&moving)) };
                let device = backend.upload_hierarchy_of(&whole, &hierarchy.data(&of_moving))?;
                (Some(hierarchy.aggregate_maps()), device, Some(Spectrum::OF_CYCLES))
            }
            None => {
                // A cycle on one level is no more than sweeps, and the bounds for cycles do not
                // hold for it.
                method = if method == Method::Multigrid { Method::Chebyshev } else { method };
                (None, backend.upload(&of_moving.data())?, bounds.or_else(|| Spectrum::new(&of_moving)))
            }
        };
        Ok(Self { network, moving, aggregate_maps, spectrum, method, device })
    }

    /// The network, in f64.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The method in use; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.method
    }

    /// Replaces the constraints `[n_vertices]`. Held vertices must stay held, and no other vertex
    /// may become held.
    ///
    /// The rows that move and the bounds of their spectrum are kept. A constraint restricts
    /// directions only, and the spectrum stays in the bounds.
    ///
    /// # Errors
    /// The device failed.
    pub fn constrain(&mut self, constraint: Vec<Constraint>) -> Result<(), BackendError> {
        let of_moving = self.gather(&constraint);
        self.network.constraint = constraint;
        let of_levels = self.aggregate_maps.as_ref().map(|aggregate_maps| aggregate_maps.constraints(&of_moving));
        self.device.constrain(&of_levels.unwrap_or(of_moving))
    }

    /// Moves the free vertices of `displacement` `[n_vertices]` to equilibrium with the held ones.
    ///
    /// - `displacement` `[n_vertices]`: on entry the start, on exit the result, in the mesh's unit
    /// - `load` `[n_vertices]`: forces on the vertices over the total stiffness of their rows, in
    ///   the mesh's unit
    ///
    /// # Errors
    /// The device failed. A relaxation that does not converge is no error: see [`Convergence`].
    pub fn relax(
        &mut self,
        displacement: &mut [DVec3],
        load: Option<&[DVec3]>,
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        self.relax_and_tell(displacement, load, stopping, &|_| ())
    }

    /// As [`Self::relax`].
    ///
    /// - `tell`: gets the share of the work that is done, now and then, in a relaxation of many
    ///   sweeps. The share is that of the digits of the error that are gained
    ///
    /// # Errors
    /// As for [`Self::relax`].
    pub fn relax_and_tell(
        &mut self,
        displacement: &mut [DVec3],
        load: Option<&[DVec3]>,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Convergence, BackendError> {
        let results = self.relax_together(vec![Unrelaxed { displacement, load }], stopping, tell)?;
        Ok(results.into_iter().next().unwrap_or_default())
    }

    /// [`Self::relax_and_tell`] for several designs. Each has the result that it has alone, to the
    /// bit: every design keeps its own schedule and stopping rule. Multigrid cycles on the CPU in
    /// f64 read the springs once for up to [`MOST_TOGETHER`] designs; elsewhere one design follows
    /// the other.
    ///
    /// # Errors
    /// As for [`Self::relax`].
    pub fn relax_together(
        &mut self,
        designs: Vec<Unrelaxed>,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Vec<Convergence>, BackendError> {
        let mut runs: Vec<Run> = designs.into_iter().map(|design| self.begin(design)).collect();
        for _ in 0..PASSES {
            let mut left: Vec<&mut Run> = runs.iter_mut().filter(|run| !run.is_over).collect();
            if left.is_empty() {
                break;
            }
            for group in left.chunks_mut(MOST_TOGETHER) {
                self.pass(group, stopping, tell)?;
            }
        }
        Ok(runs.into_iter().map(|run| self.end(run)).collect())
    }

    fn begin<'a>(&self, design: Unrelaxed<'a>) -> Run<'a> {
        let residual = self.network.residual(design.displacement, design.load);
        let first_norm = self.norm(&residual);
        let is_over = self.spectrum.is_none() || first_norm == 0.0;
        let (result, relaxation) = self.begun();
        Run { design, residual, first_norm, result, relaxation, is_over }
    }

    /// The result of a design.
    fn end(&self, Run { result, relaxation, first_norm, .. }: Run) -> Convergence {
        if self.spectrum.is_none() || first_norm == 0.0 {
            return Convergence::nothing_to_do();
        }
        self.ended(result, relaxation)
    }

    /// Prepares [`Self::relax_on_device`]. `false` if the device does not keep the values, or the
    /// network has anchors of its own.
    ///
    /// - `further`: vertices that do not move, whose values another network needs
    ///
    /// # Errors
    /// The device failed.
    pub fn reside(&mut self, further: Vec<u32>) -> Result<bool, BackendError> {
        if self.network.anchor.iter().any(|&anchor| anchor != 0.0) {
            return Ok(false);
        }
        let around = self.surroundings(further);
        self.device.reside(&around)
    }

    /// The vertices whose values are on the device, those that move first.
    pub fn places(&mut self) -> Vec<u32> {
        self.device.resident().map_or_else(Vec::new, |resident| resident.places().to_vec())
    }

    /// Gives the springs rest edges that turn with the rotation vectors of another network on the
    /// same device; both were prepared by [`Self::reside`].
    ///
    /// - `positions` `[n_vertices]`: undeformed, in the mesh's unit
    ///
    /// # Errors
    /// The device failed.
    pub fn turn_with(&mut self, rotations: &mut Self, positions: &[DVec3]) -> Result<(), BackendError> {
        match (self.device.resident(), rotations.device.resident()) {
            (Some(own), Some(rotations)) => own.turn_with(rotations, positions),
            _ => Ok(()),
        }
    }

    /// The unit in which the device has the values; see [`Self::relax_on_device`].
    pub fn unit_on_device(&mut self) -> Option<f64> {
        self.device.resident().map(|resident| resident.unit())
    }

    /// [`Self::relax_and_tell`] from zero, with values that stay on the device. The result is the
    /// same, to the bit, where the device computes as the CPU does.
    ///
    /// - `values` `[n_vertices]`: on entry of the vertices that are held, on exit of all if they
    ///   are asked for
    /// - `turns`: the unit of the rotations by which the rest edges turn, if they do
    /// - `fetch`: whether the values are asked for
    ///
    /// # Errors
    /// As for [`Self::relax`].
    pub fn relax_on_device(
        &mut self,
        values: &mut [DVec3],
        turns: Option<f64>,
        fetch: bool,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Convergence, BackendError> {
        let (Some(spectrum), Some(resident)) = (self.spectrum, self.device.resident()) else {
            return Ok(Convergence::nothing_to_do());
        };
        resident.begin(values, turns)?;
        let (mut result, mut relaxation) = self.begun();
        for _ in 0..PASSES {
            let pass =
                Pass::new(Schedule::new(self.method, spectrum), &mut relaxation, stopping, self.device.epsilon());
            let pass = pass.run(self.device.as_mut(), None, tell)?;
            let Some(resident) = self.device.resident() else { break };
            let end = resident.end_pass(fetch)?;
            if end.first_norm == 0.0 {
                return Ok(Convergence::nothing_to_do());
            }
            for (&row, value) in self.moving.iter().zip(&end.values) {
                values[row as usize] = *value;
            }
            let left = [end.norm, end.first_norm];
            if self.is_over(pass, end.furthest, left, stopping, &mut result, &mut relaxation) {
                break;
            }
        }
        Ok(self.ended(result, relaxation))
    }

    fn surroundings(&self, further: Vec<u32>) -> Surroundings {
        let mut around = Surroundings {
            moving: Arc::clone(&self.moving),
            rows: Vec::new(),
            row_start: vec![0],
            neighbours: Vec::new(),
            stiffness: Vec::new(),
            further,
        };
        let is_held = |neighbour: u32| self.network.constraint[neighbour as usize] == Constraint::Held;
        for (&vertex, row) in self.moving.iter().zip(0..) {
            let springs = || self.network.springs(vertex as usize);
            if springs().any(|(neighbour, stiffness)| stiffness != 0.0 && is_held(neighbour)) {
                around.rows.push(row);
                for (neighbour, stiffness) in springs() {
                    around.neighbours.push(neighbour);
                    around.stiffness.push(stiffness);
                }
                around.row_start.push(around.neighbours.len() as u32);
            }
        }
        around
    }

    /// A result and its history before the first pass.
    fn begun(&self) -> (Convergence, Relaxation) {
        let (of, method) = ("displacement", self.method.name());
        let relaxation = Relaxation { of, method, residuals: vec![(0, 1.0)], ..Relaxation::default() };
        (Convergence { relative_residual: 1.0, error: f64::INFINITY, ..Convergence::default() }, relaxation)
    }

    /// Adds a pass to a result. Returns whether no other pass has to follow.
    ///
    /// - `furthest`: largest correction by the pass, in shortest edges
    /// - `norms`: of the residual now and at the start
    fn is_over(
        &self,
        pass: Ended,
        furthest: f64,
        [norm, first_norm]: [f64; 2],
        stopping: &Stopping,
        result: &mut Convergence,
        relaxation: &mut Relaxation,
    ) -> bool {
        // Bound of the rounding error that a pass may leave: a few roundoffs on meshes of 20 000 to
        // 100 000 tets.
        let rounding = 8.0 * self.device.epsilon() * furthest;
        result.sweeps += pass.sweeps;
        result.relative_residual = norm / first_norm;
        relaxation.residuals.push((result.sweeps, result.relative_residual));
        result.error = if furthest.is_nan() { f64::NAN } else { pass.error.max(rounding) };
        result.converged = result.error <= stopping.tolerance;
        !pass.settled || result.converged || norm == 0.0
    }

    /// A result after its last pass.
    fn ended(&self, mut result: Convergence, mut relaxation: Relaxation) -> Convergence {
        result.failed = (!result.converged).then_some(self.method);
        relaxation.converged = result.converged;
        result.history = History::of(relaxation);
        result
    }

    /// The values of the vertices that move, from the values of all vertices of the network.
    fn gather<T: Copy>(&self, of_whole: &[T]) -> Vec<T> {
        gather(&self.moving, of_whole)
    }

    /// Norm of a residual `[n_vertices]`.
    fn norm(&self, residual: &[DVec3]) -> f64 {
        let of_block = |rows: &[u32]| squares::run(rows.iter().map(|&row| residual[row as usize]));
        let blocks: Vec<f64> = self.moving.par_chunks(BLOCK).map(of_block).collect();
        finite_or_nan(figures::run(&blocks)[1]).sqrt()
    }

    /// The largest correction in shortest edges, of the corrections of the vertices that move.
    fn furthest(&self, correction: &[DVec3]) -> f64 {
        let inverse_length = &self.network.inverse_length;
        let of_block = |(rows, correction): (&[u32], &[DVec3])| {
            let lengths = rows.iter().map(|&row| inverse_length[row as usize]);
            add_correction::run(correction.iter().copied().zip(lengths))
        };
        let blocks: Vec<f64> = self.moving.par_chunks(BLOCK).zip(correction.par_chunks(BLOCK)).map(of_block).collect();
        finite_or_nan(figures::run(&blocks)[0]).sqrt()
    }

    /// One pass of each design.
    ///
    /// - `runs`: at most [`MOST_TOGETHER`]
    fn pass(&mut self, runs: &mut [&mut Run], stopping: &Stopping, tell: &dyn Fn(f64)) -> Result<(), BackendError> {
        let Some(spectrum) = self.spectrum else { return Ok(()) };
        let Self { moving, method, device, .. } = self;
        let epsilon = device.epsilon();
        let (loads, passes): (Vec<_>, Vec<_>) = runs
            .iter_mut()
            .map(|run| {
                let load = gather(moving, &std::mem::take(&mut run.residual));
                (load, Pass::new(Schedule::new(*method, spectrum), &mut run.relaxation, stopping, epsilon))
            })
            .unzip();
        // Only a hierarchy takes designs together. Its batches are single cycles.
        let ended = match device.together(passes.len()) {
            Some(device) => passes_together(device, passes, loads, tell)?,
            None => {
                let alone = passes.into_iter().zip(loads).map(|(pass, load)| {
                    let ended = pass.run(device.as_mut(), Some(&load), tell)?;
                    Ok((ended, device.correction()?))
                });
                alone.collect::<Result<Vec<_>, BackendError>>()?
            }
        };
        for (run, (ended, correction)) in runs.iter_mut().zip(ended) {
            self.end_pass(run, ended, correction, stopping);
        }
        Ok(())
    }

    /// Adds the correction of a pass to the displacement, and measures what is left.
    fn end_pass(&self, run: &mut Run, pass: Ended, correction: Vec<DVec3>, stopping: &Stopping) {
        let Run { design: Unrelaxed { displacement, load }, result, relaxation, .. } = run;
        for (&row, e) in self.moving.iter().zip(&correction) {
            let row = row as usize;
            // Rounding on the device must not lift a vertex off its plane.
            displacement[row] += self.network.constraint[row].limit(*e);
        }
        let furthest = self.furthest(&correction);
        drop(correction);
        run.residual = self.network.residual(displacement, *load);
        let norms = [self.norm(&run.residual), run.first_norm];
        run.is_over = self.is_over(pass, furthest, norms, stopping, result, relaxation);
    }
}

/// One pass of several designs at once. Returns the end and the correction of each.
///
/// - `loads`: of each design `[n_vertices of the device]`
fn passes_together(
    device: &mut dyn Together,
    mut passes: Vec<Pass>,
    loads: Vec<Vec<DVec3>>,
    tell: &dyn Fn(f64),
) -> Result<Vec<(Ended, Vec<DVec3>)>, BackendError> {
    for (design, load) in loads.into_iter().enumerate() {
        device.start(design, &load)?;
    }
    let mut ended: Vec<Option<(Ended, Vec<DVec3>)>> = passes.iter().map(|_| None).collect();
    loop {
        // A design that has ended rests until the last one ends.
        let mut sweeps = vec![Sweep { relaxation: 0.0, momentum: 0.0 }; passes.len()];
        for (design, pass) in passes.iter().enumerate() {
            if ended[design].is_some() {
                continue;
            }
            match pass.next_batch().as_deref() {
                Some([sweep, ..]) => sweeps[design] = *sweep,
                _ => ended[design] = Some((pass.out_of_sweeps(), device.correction(design)?)),
            }
        }
        if ended.iter().all(Option::is_some) {
            return Ok(ended.into_iter().flatten().collect());
        }
        let changes = device.cycle(&sweeps)?;
        for (design, (pass, change)) in passes.iter_mut().zip(changes).enumerate() {
            if ended[design].is_none()
                && let Verdict::Ends(end) = pass.judge(change, tell)
            {
                ended[design] = Some((end, device.correction(design)?));
            }
        }
    }
}

fn gather<T: Copy>(moving: &[u32], of_whole: &[T]) -> Vec<T> {
    moving.iter().map(|&vertex| of_whole[vertex as usize]).collect()
}
