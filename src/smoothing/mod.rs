//! Local optimisation: moves single vertices until no tet is inverted and the worst tets have a
//! better shape.
//!
//! The paper ends with the mesh that the springs give, and has no local optimisation. The volume
//! stage runs it when the worst beta calls for it.
//!
//! **Two methods.** The first lowers the objective `E = sum over a vertex's tets of (q w^size)^m`
//! ([`crate::kernels::smooth_vertices`]), a sum of powers of mean ratios. `E` also falls where tets
//! are inverted. The minimum of `E` balances good and bad tets, and a mean ratio is not
//! beta. So when the worst tet stops improving below the goal, the second method raises the worst
//! betas directly ([`crate::kernels::raise_worst_beta`]), for a fraction of the cost.
//!
//! **Rounds.** A run consists of rounds of a few sweeps. In a sweep the vertices of one colour move
//! at once, so the result does not depend on the number of threads. Vertices move only near tets
//! below the goal; elsewhere the mesh keeps its bits, and nothing is computed. After each round
//! quality is measured in f64. The active vertices, the regularisation and the power `m` follow
//! from the measure: `m` is 1 while a tet is inverted, then 2.
//!
//! **Surfaces.** Vertices of surfaces are held at first. If the goal is not reached and a run has a
//! [`SurfaceMotion`], they take part: each round constrains them to tangent planes or lines, and in
//! the end puts them back on their surface.
//!
//! Source: Escobar et al. 2003 (CMAME 192, 2775-2787) for the regularised measure; Freitag Diachin
//! et al. 2006 (Eng. Comput. 22, 61-74) for the sum of powers of the mean ratio.

mod active;
mod colouring;
mod flat_corners;
mod layers;
mod merit;
mod neighbourhood;
mod state;
mod surface_motion;
mod target;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

pub use colouring::{NONE, colour};
pub use flat_corners::Raised;
pub use merit::Merit;
pub use surface_motion::SurfaceMotion;
pub use target::{QualityTarget, inverse_targets};

use crate::backend::{Backend, BackendError, DeviceSmoother, SmoothingObjective, SmoothingPatch};
use crate::constraint::Constraint;
use crate::geometry::corners;
use crate::quality::{self, lesser};
use layers::{Layers, across};
use neighbourhood::{Neighbourhood, Topology};
use state::{State, Worst};

/// Sweeps of a round.
const ROUND: usize = 4;

/// Rounds without improvement after which a method ends.
const PATIENCE: usize = 3;

/// Rounds without improvement after which a method ends while a tet is inverted. The number of
/// inverted tets does not fall in every round. With 3, a wing turned by 100 degrees in one jump and
/// optimised to 0.02 keeps 114 inverted tets of 30 000; with 10 none is left.
const PATIENCE_TANGLED: usize = 10;

/// The worst tet counts as improved when its beta rises by this fraction.
const IMPROVES: f64 = 1e-3;

/// In a valid mesh the first method ends once a round raises the smallest beta by less than this
/// fraction. The second method then continues at a hundredth of the cost. On a wing turned by 120
/// degrees the first method takes 30 rounds from 0.0026 to 0.0053. The second takes six rounds, of
/// a tenth of the time each, from there to 0.0126.
const FADES: f64 = 0.05;

/// Above this share of the goal the first method continues: near the goal its Newton steps are
/// better than gradient steps.
const NEAR: f64 = 0.9;

/// Power `m` of the objective while a tet is inverted.
const POWER_TANGLED: u32 = 1;

/// Power `m` in valid meshes. On a wing turned by 30 degrees 1 takes six times the sweeps to the
/// same smallest beta. 4 ends at a lower smallest beta, because the worst `q` is not the worst
/// beta.
const POWER: u32 = 2;

/// Power of the size measure `w` where the original tets are the target.
const SIZE: u32 = 1;

/// The regularisation acts in tets with less than this fraction of their original volume.
const EPSILON: f64 = 1e-4;

/// A gradient step is not taken if it would lower its objective by less than this fraction.
const GAIN: f64 = 1e-5;

/// The second method aims above the goal by this fraction. Otherwise tets would approach the goal
/// and never reach it.
const MARGIN: f64 = 0.02;

/// Most change of an edge between layers, as a share of its length, where no cell was inverted.
const THICKNESS: f64 = 0.02;

/// Below this share of the goal a cell is nearly inverted, and layers change to save it.
const GRAVE: f64 = 0.1;

/// Most vertices given to a device at once. With all their tets they fit the smallest bindings of a
/// device.
const MOST_AT_ONCE: usize = 1 << 17;

/// The goal of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Tets with a lower beta are optimised.
    pub beta: f64,
    /// Most sweeps over the active vertices.
    pub max_sweeps: usize,
}

/// The result of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smoothed {
    /// Sweeps over the active vertices, including sweeps to states that were not kept.
    pub sweeps: usize,
    /// Tets without positive volume at the end.
    pub inverted: usize,
    /// Smallest beta at the end.
    pub beta_min: f64,
    /// Number of vertices whose position changed.
    pub moved: usize,
    /// Largest change of an edge between thin layers of other cells than tets, as a share of its
    /// length. 0 in a mesh of tets.
    pub layers_changed: f64,
}

/// The two methods of local optimisation.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Method {
    /// Lower the sum of powers of mean ratios.
    MeanRatio,
    /// Raise the low betas around the vertices of bad tets.
    WorstBeta,
}

/// A mesh during a run.
#[derive(Clone)]
struct Moved {
    state: State,
    at: Vec<DVec3>,
}

/// What the vertices of thin layers may do.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LayerFreedom {
    /// Move across the edges between layers.
    Across,
    /// Nothing.
    Held,
    /// Move as all other vertices.
    Free,
}

/// What the vertices may do in a part of a run.
#[derive(Clone, Copy)]
struct Freedom<'a> {
    slide: Option<&'a dyn SurfaceMotion>,
    layers: LayerFreedom,
}

/// The settings of a round.
#[derive(Clone, Copy)]
struct Round<'a> {
    method: Method,
    /// The beta to reach.
    goal: f64,
    freedom: Freedom<'a>,
}

/// Local optimisation of one mesh. Set up once per mesh, run many times.
pub struct Smoother {
    topology: Topology,
    /// Vertices of the undeformed mesh `[n_vertices]`.
    original: Vec<DVec3>,
    target: QualityTarget,
    /// Constraint of each vertex `[n_vertices]`. Vertices that may slide are held here.
    constraint: Vec<Constraint>,
    /// Whether a vertex may slide `[n_vertices]`.
    slides: Vec<bool>,
    /// Largest goal of the second method. If the original tets are the target, the worst beta of
    /// the undeformed mesh, so an unmoved mesh keeps its bits. Otherwise infinite.
    highest_goal: f64,
    merit: Merit,
    /// Whether a vertex belongs to a cell that is no tet `[n_vertices]`. Empty if all cells are
    /// tets. The second method holds such vertices, and their tets keep their original shapes as
    /// target.
    of_other_cells: Vec<bool>,
    device: Box<dyn DeviceSmoother>,
}

impl Smoother {
    /// Prepares local optimisation of a mesh.
    ///
    /// - `tets` `[n_tets]`, `original` `[n_vertices]`: the undeformed mesh, whose tets have
    ///   positive volume; in its unit
    /// - `constraints` `[n_vertices]`: constraint of each vertex
    /// - `slides`: held vertices that may slide in runs with a [`SurfaceMotion`]
    ///
    /// # Panics
    /// The arrays do not belong to one mesh.
    pub fn new(
        backend: &dyn Backend,
        tets: &[[u32; 4]],
        original: &[DVec3],
        constraints: &[Constraint],
        slides: &[u32],
        target: QualityTarget,
    ) -> Self {
        assert_eq!(constraints.len(), original.len(), "one constraint per vertex");
        let held = |vertex: usize| constraints[vertex] == Constraint::Held;
        let mut slide = vec![false; original.len()];
        slides.iter().for_each(|&vertex| slide[vertex as usize] = held(vertex as usize));
        let highest_goal = match target {
            QualityTarget::Original => Worst::of(&quality::betas(original, tets)).beta,
            QualityTarget::Improve => f64::INFINITY,
        };
        Self {
            topology: Topology::new(tets, original.len()),
            original: original.to_vec(),
            target,
            constraint: constraints.to_vec(),
            slides: slide,
            highest_goal,
            merit: Merit::of_tets(),
            of_other_cells: Vec::new(),
            device: backend.smoother(),
        }
    }

    /// Sets the merit of a mesh with other cells than tets. The default is beta.
    #[must_use]
    pub fn with_merit(mut self, merit: Merit) -> Self {
        if !merit.is_of_tets() {
            self.of_other_cells = vec![false; self.original.len()];
            let corners = self.topology.tets.iter().enumerate().filter(|&(simplex, _)| merit.is_corner(simplex));
            for &vertex in corners.flat_map(|(_, tet)| tet) {
                self.of_other_cells[vertex as usize] = true;
            }
            if self.target == QualityTarget::Original {
                self.highest_goal = Worst::of(&merit.of_all(&self.topology.tets, &self.original)).beta;
            }
        }
        self.merit = merit;
        self
    }

    /// Whether a vertex belongs to a cell that is no tet.
    fn is_of_other_cells(&self, vertex: u32) -> bool {
        self.of_other_cells.get(vertex as usize) == Some(&true)
    }

    /// Moves vertices until no tet is below the goal, the smallest beta stops rising, or the sweeps
    /// are used up.
    ///
    /// - `positions` `[n_vertices]`: replaced by the best positions of the run: the fewest inverted
    ///   tets, then the greatest smallest beta. A run never makes a mesh worse. If no tet is below
    ///   the goal, all positions keep their bits
    /// - `betas` `[n_tets]`: betas of the positions, or their merit (see [`Merit`]), updated
    /// - `slide`: surfaces for the vertices that may slide. They slide only if the goal is not
    ///   reached with surfaces held, and the result is kept only if it folds no further triangle.
    ///   With `None` they stay held
    ///
    /// # Errors
    /// The device failed. `positions` and `betas` are then unchanged.
    pub fn run(
        &mut self,
        positions: &mut [DVec3],
        betas: &mut [f64],
        goal: &Goal,
        slide: Option<&dyn SurfaceMotion>,
    ) -> Result<Smoothed, BackendError> {
        let mut best = Moved { state: State::new(betas.to_vec()), at: positions.to_vec() };
        let slide = slide.filter(|_| self.slides.contains(&true));
        let mut sweeps = 0;
        let (has_layers, mut spoils) = (!self.merit.is_of_tets(), false);
        for layers in [LayerFreedom::Across, LayerFreedom::Held, LayerFreedom::Free] {
            let is_due = match layers {
                LayerFreedom::Across => has_layers,
                LayerFreedom::Held => spoils,
                // Layers change only where a mesh has inverted or nearly inverted cells otherwise.
                LayerFreedom::Free => !has_layers || !best.state.worst.reaches(GRAVE * goal.beta),
            };
            for slide in [None, slide].into_iter().take(if slide.is_some() { 2 } else { 1 }) {
                if !is_due || best.state.worst.reaches(goal.beta) {
                    break;
                }
                let is_checked = slide.is_some() || layers == LayerFreedom::Across;
                let before = is_checked.then(|| best.clone());
                let left = Goal { max_sweeps: goal.max_sweeps - sweeps, ..*goal };
                sweeps += self.improve_both_ways(&mut best, &left, Freedom { slide, layers })?;
                let Some(before) = before.filter(|before| before.at != best.at) else { continue };
                let folds = |slide: &dyn SurfaceMotion| slide.folded(&best.at) > slide.folded(&before.at);
                let spoilt = layers == LayerFreedom::Across && self.layers_changed(&before.at, &best.at) > THICKNESS;
                spoils |= spoilt;
                if spoilt || slide.is_some_and(folds) {
                    best = before;
                }
            }
        }
        let changed = |(a, b): &(&DVec3, &DVec3)| a.to_array().map(f64::to_bits) != b.to_array().map(f64::to_bits);
        let moved = positions.iter().zip(&best.at).filter(changed).count();
        let layers_changed = self.layers_changed(positions, &best.at);
        positions.copy_from_slice(&best.at);
        betas.copy_from_slice(&best.state.beta);
        let Worst { inverted, beta } = best.state.worst;
        Ok(Smoothed { sweeps, inverted, beta_min: beta, moved, layers_changed })
    }

    /// The largest change of an edge between thin layers by a motion, as a share of its length.
    fn layers_changed(&self, from: &[DVec3], to: &[DVec3]) -> f64 {
        let is_moved = |vertex: u32| from[vertex as usize] != to[vertex as usize];
        let moved: Vec<u32> =
            (0..from.len() as u32).filter(|&vertex| self.is_of_other_cells(vertex) && is_moved(vertex)).collect();
        self.layers().largest_change(&moved, from, to)
    }

    fn layers(&self) -> Layers<'_> {
        Layers { topology: &self.topology, merit: &self.merit, original: &self.original }
    }

    /// Runs the first method, then the second. Returns the number of sweeps.
    fn improve_both_ways(&mut self, best: &mut Moved, goal: &Goal, freedom: Freedom) -> Result<usize, BackendError> {
        let mut sweeps = 0;
        for (method, goal_of_method) in
            [(Method::MeanRatio, goal.beta), (Method::WorstBeta, goal.beta.min(self.highest_goal))]
        {
            let round = Round { method, goal: goal_of_method, freedom };
            sweeps += self.improve(best, round, goal.max_sweeps - sweeps)?;
        }
        Ok(sweeps)
    }

    /// Runs rounds of one method until it no longer helps. Returns the number of sweeps.
    fn improve(&mut self, best: &mut Moved, round: Round, max_sweeps: usize) -> Result<usize, BackendError> {
        if best.state.worst.reaches(round.goal) {
            return Ok(0);
        }
        let Moved { mut state, mut at } = best.clone();
        let mut record = (state.worst, f64::NEG_INFINITY);
        let (mut sweeps, mut waited) = (0, 0);
        while !state.worst.reaches(round.goal) && sweeps < max_sweeps {
            if waited >= if state.worst.inverted > 0 { PATIENCE_TANGLED } else { PATIENCE } {
                break;
            }
            let active = self.active(&state, &round);
            if active.is_empty() {
                break;
            }
            let count = ROUND.min(max_sweeps - sweeps);
            let mut smallest = f64::INFINITY;
            for moving in active.chunks(MOST_AT_ONCE) {
                let around = self.topology.around(moving);
                let of_these = self.smallest_volume(&around, &at);
                smallest = smallest.min(of_these);
                self.sweep(&around, &round, of_these, count, &mut at)?;
                state.measure(&self.merit, &at, &self.topology.tets, &around.tets);
            }
            state.worst = Worst::of(&state.beta);
            sweeps += count;
            if state.worst.beats(&best.state.worst, 0.0) {
                best.state.copy(&state);
                best.at.copy_from_slice(&at);
            }
            let far = state.worst.inverted == 0 && state.worst.beta < NEAR * round.goal;
            if round.method == Method::MeanRatio && far && !state.worst.beats(&record.0, FADES) {
                break;
            }
            let untangles = state.worst.inverted > 0 && state.worst.inverted == record.0.inverted;
            if state.worst.beats(&record.0, IMPROVES) || (untangles && smallest > record.1) {
                record = (state.worst, smallest);
                waited = 0;
            } else {
                waited += 1;
            }
        }
        Ok(sweeps)
    }

    /// Sweeps over some vertices on the device.
    ///
    /// - `smallest`: smallest volume of the vertices' tets over the original volume
    fn sweep(
        &mut self,
        around: &Neighbourhood,
        round: &Round,
        smallest: f64,
        count: usize,
        at: &mut [DVec3],
    ) -> Result<(), BackendError> {
        let moving = &around.vertices[..around.n_moving()];
        let (slide, may_slide) = (round.freedom.slide, &self.slides);
        let slides = |vertex: u32| slide.filter(|_| may_slide[vertex as usize]);
        let (layers, fixed) = (self.layers(), &self.constraint);
        let of_other_cells = &self.of_other_cells;
        let keeps = |vertex: u32| round.freedom.layers != LayerFreedom::Free && of_other_cells[vertex as usize];
        let may = |&vertex: &u32| {
            let constraint = match slides(vertex) {
                Some(slide) => slide.tangent(vertex, at[vertex as usize]),
                None => fixed[vertex as usize],
            };
            let between = if keeps(vertex) { layers.at(vertex, at) } else { None };
            match between.filter(|between| between.is_thin) {
                Some(_) if round.freedom.layers == LayerFreedom::Held => Constraint::Held,
                Some(between) => across(constraint, between.normal),
                None => constraint,
            }
        };
        let constraint: Vec<Constraint> = moving.par_iter().map(may).collect();
        let patch = SmoothingPatch {
            positions: &around.positions(at),
            tets: &around.corners,
            vertex_tets: &around.vertex_tets,
            constraint: &constraint,
            reach: &moving.iter().map(|&vertex| slides(vertex)?.reach(vertex)).collect::<Vec<_>>(),
            colours: &around.colours,
        };
        let correction = match round.method {
            Method::MeanRatio => {
                let original = around.positions(&self.original);
                let objective = SmoothingObjective::Shape {
                    inverse_target: &self.inverse_targets(around, &original),
                    power: if smallest > 0.0 { POWER } else { POWER_TANGLED },
                    size: if self.target == QualityTarget::Original { SIZE } else { 0 },
                    delta_squared: regularisation(smallest),
                };
                self.device.sweep(&patch, &objective, count)?
            }
            Method::WorstBeta => {
                let objective = SmoothingObjective::Beta { goal: (1.0 + MARGIN) * round.goal, gain: GAIN };
                self.device.sweep(&patch, &objective, count)?
            }
        };
        let place = |((&vertex, constraint), correction): ((&u32, &Constraint), &DVec3)| {
            let was = at[vertex as usize];
            let moved = moved(was, constraint.limit(*correction));
            slides(vertex).filter(|_| moved != was).map_or(moved, |slide| slide.back(vertex, moved))
        };
        let placed: Vec<DVec3> =
            moving.par_iter().zip(&constraint).zip(&correction[..moving.len()]).map(place).collect();
        moving.iter().zip(placed).for_each(|(&vertex, placed)| at[vertex as usize] = placed);
        Ok(())
    }

    /// The inverse targets of a neighbourhood's tets; see [`inverse_targets`]. Tets at vertices of
    /// other cells keep their original shapes, whatever the target.
    fn inverse_targets(&self, around: &Neighbourhood, original: &[DVec3]) -> Vec<DMat3> {
        let mut targets = inverse_targets(self.target, &around.corners, original);
        if self.target == QualityTarget::Improve && !self.merit.is_of_tets() {
            let kept = inverse_targets(QualityTarget::Original, &around.corners, original);
            for ((target, kept), &tet) in targets.iter_mut().zip(kept).zip(&around.tets) {
                if self.topology.tets[tet as usize].iter().any(|&vertex| self.is_of_other_cells(vertex)) {
                    *target = kept;
                }
            }
        }
        targets
    }

    /// The smallest quotient of volume and original volume of some tets; NaN if one is NaN.
    fn smallest_volume(&self, around: &Neighbourhood, at: &[DVec3]) -> f64 {
        let volume = |tet: &u32, at: &[DVec3]| quality::volume(corners(at, self.topology.tets[*tet as usize]));
        let ratio = |tet: &u32| volume(tet, at) / volume(tet, &self.original);
        around.tets.iter().map(ratio).fold(f64::INFINITY, lesser)
    }
}

/// `delta^2` for which the tet with the smallest volume has `h` near [`EPSILON`]. Zero if all tets
/// have more volume.
fn regularisation(smallest: f64) -> f64 {
    if smallest < EPSILON { EPSILON * (EPSILON - smallest) } else { 0.0 }
}

/// A position plus a displacement. A coordinate whose displacement is 0 keeps its bits, also the
/// sign of -0.
pub fn moved(at: DVec3, by: DVec3) -> DVec3 {
    let add = |x: f64, c: f64| if c == 0.0 { x } else { x + c };
    DVec3::new(add(at.x, by.x), add(at.y, by.y), add(at.z, by.z))
}

#[cfg(test)]
mod tests {
    use super::regularisation;

    /// The regularised volume `h = (v + sqrt(v^2 + 4 delta^2)) / 2` of the worst tet is 1e-4; where
    /// the worst tet has a hundredth of its volume nothing is regularised.
    ///
    /// Fails if `EPSILON` is 0.1 or 1e-9.
    #[test]
    fn inverted_tets_alone_are_regularised() {
        assert_eq!(regularisation(0.01), 0.0);
        for volume in [-0.3f64, 0.0, 5e-5] {
            let regularised = 0.5 * (volume + (volume * volume + 4.0 * regularisation(volume)).sqrt());
            assert!((0.5e-4..2e-4).contains(&regularised), "{volume}: {regularised:e}");
        }
    }
}
