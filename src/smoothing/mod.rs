//! Local quality optimisation: untangles inverted tets and improves bad ones, vertex by vertex.
//!
//! Each vertex moves to lower `E = sum over its tets of (q w^size)^m` ([`crate::kernels::smooth_vertices`]), the vertices
//! of one colour at once, so the result does not depend on the order of threads. Only where a tet is below the goal
//! vertices move; elsewhere the mesh keeps its bits, and nothing is computed.
//!
//! A run goes in rounds of a few sweeps. After each, quality is measured in f64, and the active vertices, the
//! regularisation and the power `m` follow from it: 1 while a tet is inverted, then 2. That sum settles where good tets
//! balance bad ones, and its mean ratio is not beta. So when the worst tet stops improving below the goal, the vertices
//! of bad tets climb on beta itself ([`crate::kernels::raise_worst_beta`]), whatever the target, which costs far less.
//!
//! Vertices of surfaces are held at first. Where that does not reach the goal and a run has a [`SurfaceMotion`], they take part:
//! constrained to tangents in a round and brought back after it.
//!
//! Source: Escobar et al. 2003 (CMAME 192, 2775-2787) for the regularised measure; the sum over powers of the mean ratio
//! as in Freitag Diachin et al. 2006 (Eng. Comput. 22, 61-74).

mod colouring;
mod neighbourhood;
mod state;
mod surface_motion;
mod target;

use glam::DVec3;
use rayon::prelude::*;

pub use colouring::{NONE, colour};
pub use surface_motion::SurfaceMotion;
pub use target::{QualityTarget, inverse_targets};

use crate::backend::{Backend, BackendError, Constraint, DeviceSmoother, SmoothingObjective, SmoothingPatch};
use crate::geometry::corners;
use crate::quality;
use neighbourhood::{Neighbourhood, Topology};
use state::{State, Worst};

/// Sweeps between two looks at the mesh.
const ROUND: usize = 4;

/// Rounds without improvement after which a method ends.
const PATIENCE: usize = 3;

/// The same while a tet is inverted: the number of inverted tets falls in fits. With 3 a wing turned by 100 degrees in one
/// jump and then improved to 0.02 stays at 114 inverted tets of 30 000; with 10 none is left.
const PATIENCE_TANGLED: usize = 10;

/// The worst tet improves when its beta rises by this fraction.
const IMPROVES: f64 = 1e-3;

/// In a valid mesh the sum of powers is lowered no longer once a round raises the smallest beta by less than this
/// fraction: climbing takes it from there, at a hundredth of the cost. On a wing turned by 120 degrees the sum alone takes
/// 30 rounds from 0.0026 to 0.0053, and climbing six, of a tenth of the time each, from there to 0.0126.
const FADES: f64 = 0.05;

/// Above this share of the goal the sum goes on: its Newton steps settle what is nearly there better than a climb.
const NEAR: f64 = 0.9;

/// Power `m` of the objective while a tet is inverted.
const POWER_TANGLED: u32 = 1;

/// Power `m` in valid meshes. On a wing turned by 30 degrees 1 takes six times the sweeps to the same smallest beta, and
/// 4 ends at a lower one: the worst `q` is not the worst beta.
const POWER: u32 = 2;

/// Power of the part that measures size where the original tets are the target.
const SIZE: u32 = 1;

/// The regularisation acts in tets that have less than this fraction of their original volume.
const EPSILON: f64 = 1e-4;

/// Steps of a climb that lower its sum by less than this fraction are not worth taking.
const GAIN: f64 = 1e-5;

/// The goal of a climb lies higher by this fraction, or tets would come close to it and never reach it.
const MARGIN: f64 = 0.02;

/// Most vertices a device is given at once: with all the tets around them they fit its smallest bindings.
const MOST_AT_ONCE: usize = 1 << 17;

/// What a run is to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Tets with a lower beta are to be improved.
    pub beta: f64,
    /// Most sweeps over the active vertices.
    pub max_sweeps: usize,
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smoothed {
    /// Sweeps over the active vertices, those to states that were not kept among them.
    pub sweeps: usize,
    /// Tets without positive volume in the end.
    pub inverted: usize,
    /// Smallest beta in the end.
    pub beta_min: f64,
    /// Vertices that are not where they were.
    pub moved: usize,
}

/// The two ways a round goes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Method {
    /// Lower the sum of powers.
    Energy,
    /// Raise the low betas around the vertices of bad tets.
    Climb,
}

/// A mesh on its way.
#[derive(Clone)]
struct Moved {
    state: State,
    at: Vec<DVec3>,
}

/// What rounds share.
#[derive(Clone, Copy)]
struct Round<'a> {
    method: Method,
    /// The beta aimed at.
    goal: f64,
    slide: Option<&'a dyn SurfaceMotion>,
}

/// Smooths one mesh again and again. Set up once per mesh.
pub struct Smoother {
    topology: Topology,
    /// The undeformed mesh's vertices.
    original: Vec<DVec3>,
    target: QualityTarget,
    /// What each vertex may do; those that slide are held but for their rounds.
    constraint: Vec<Constraint>,
    /// Whether a vertex may slide `[n_vertices]`.
    slides: Vec<bool>,
    /// The beta up to which vertices climb: that of the worst original tet where its shape is the target, so that an
    /// unmoved mesh keeps its bits; else without bound.
    highest_climb: f64,
    device: Box<dyn DeviceSmoother>,
}

impl Smoother {
    /// Gets ready to smooth a mesh.
    ///
    /// - `tets` `[n_tets]`, `original` `[n_vertices]`: the undeformed mesh, whose tets have positive volume
    /// - `constraints` `[n_vertices]`: what each vertex may do
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
        let highest_climb = match target {
            QualityTarget::Original => Worst::of(&quality::betas(original, tets)).beta,
            QualityTarget::Improve => f64::INFINITY,
        };
        Self {
            topology: Topology::new(tets, original.len()),
            original: original.to_vec(),
            target,
            constraint: constraints.to_vec(),
            slides: slide,
            highest_climb,
            device: backend.smoother(),
        }
    }

    /// Moves vertices until no tet is below the goal, the smallest beta has stopped rising, or the sweeps are used up.
    ///
    /// - `positions` `[n_vertices]`: replaced by the best seen, that with the fewest inverted tets and then the greatest
    ///   smallest beta; so they never get worse, and where no tet is below the goal they keep their bits
    /// - `betas` `[n_tets]`: those of the positions, before and after
    /// - `slide`: where vertices slide that may, once the rest alone does not reach the goal; what they gain is kept if no
    ///   further triangle is folded. Without it they are held
    ///
    /// # Errors
    /// The device failed; `positions` and `betas` are as they were.
    pub fn run(
        &mut self,
        positions: &mut [DVec3],
        betas: &mut [f64],
        goal: &Goal,
        slide: Option<&dyn SurfaceMotion>,
    ) -> Result<Smoothed, BackendError> {
        let mut best = Moved { state: State::new(betas.to_vec()), at: positions.to_vec() };
        let mut sweeps = self.improve_both_ways(&mut best, goal, None)?;
        if let Some(slide) = slide
            && self.slides.contains(&true)
            && !best.state.worst.reaches(goal.beta)
        {
            let held = best.clone();
            let left = Goal { max_sweeps: goal.max_sweeps - sweeps, ..*goal };
            sweeps += self.improve_both_ways(&mut best, &left, Some(slide))?;
            if best.at != held.at && slide.folded(&best.at) > slide.folded(&held.at) {
                best = held;
            }
        }
        let changed = |(a, b): &(&DVec3, &DVec3)| a.to_array().map(f64::to_bits) != b.to_array().map(f64::to_bits);
        let moved = positions.iter().zip(&best.at).filter(changed).count();
        positions.copy_from_slice(&best.at);
        betas.copy_from_slice(&best.state.beta);
        let Worst { inverted, beta } = best.state.worst;
        Ok(Smoothed { sweeps, inverted, beta_min: beta, moved })
    }

    /// First lowers the sum of powers, then climbs. Returns the sweeps.
    fn improve_both_ways(
        &mut self,
        best: &mut Moved,
        goal: &Goal,
        slide: Option<&dyn SurfaceMotion>,
    ) -> Result<usize, BackendError> {
        let mut sweeps = 0;
        for (method, goal_of_method) in
            [(Method::Energy, goal.beta), (Method::Climb, goal.beta.min(self.highest_climb))]
        {
            let round = Round { method, goal: goal_of_method, slide };
            sweeps += self.improve(best, round, goal.max_sweeps - sweeps)?;
        }
        Ok(sweeps)
    }

    /// Rounds of one method until it no longer helps. Returns its sweeps.
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
                state.measure(&at, &self.topology.tets, &around.tets);
            }
            state.worst = Worst::of(&state.beta);
            sweeps += count;
            if state.worst.beats(&best.state.worst, 0.0) {
                best.state.copy(&state);
                best.at.copy_from_slice(&at);
            }
            let far = state.worst.inverted == 0 && state.worst.beta < NEAR * round.goal;
            if round.method == Method::Energy && far && !state.worst.beats(&record.0, FADES) {
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

    /// Sweeps over some vertices, on the device.
    ///
    /// - `smallest`: their tets' smallest volume over that of the original tet
    fn sweep(
        &mut self,
        around: &Neighbourhood,
        round: &Round,
        smallest: f64,
        count: usize,
        at: &mut [DVec3],
    ) -> Result<(), BackendError> {
        let moving = &around.vertices[..around.n_moving()];
        let slides = |vertex: u32| round.slide.filter(|_| self.slides[vertex as usize]);
        let may = |&vertex: &u32| match slides(vertex) {
            Some(slide) => slide.tangent(vertex, at[vertex as usize]),
            None => self.constraint[vertex as usize],
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
            Method::Energy => {
                let original = around.positions(&self.original);
                let objective = SmoothingObjective::Shape {
                    inverse_target: &inverse_targets(self.target, &around.corners, &original),
                    power: if smallest > 0.0 { POWER } else { POWER_TANGLED },
                    size: if self.target == QualityTarget::Original { SIZE } else { 0 },
                    delta_squared: regularisation(smallest),
                };
                self.device.sweep(&patch, &objective, count)?
            }
            Method::Climb => {
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

    /// The smallest volume of some tets over that of the original tet; NaN if one is.
    fn smallest_volume(&self, around: &Neighbourhood, at: &[DVec3]) -> f64 {
        let volume = |tet: &u32, at: &[DVec3]| quality::volume(corners(at, self.topology.tets[*tet as usize]));
        let ratio = |tet: &u32| volume(tet, at) / volume(tet, &self.original);
        let lesser = |a: f64, b: f64| if a.is_nan() || a <= b { a } else { b };
        around.tets.iter().map(ratio).fold(f64::INFINITY, lesser)
    }

    /// The vertices of tets below the goal, and where the sum of powers is lowered one ring of tets more; without those
    /// that may not move.
    fn active(&self, state: &State, round: &Round) -> Vec<u32> {
        let Topology { tets, vertex_tets, .. } = &self.topology;
        let mut active = vec![false; self.constraint.len()];
        let bad = tets
            .iter()
            .zip(&state.beta)
            .filter(|(_, beta)| quality::faults::is_inverted(**beta) || **beta < round.goal);
        bad.for_each(|(tet, _)| tet.iter().for_each(|&vertex| active[vertex as usize] = true));
        if round.method == Method::Energy {
            let inner: Vec<usize> = (0..active.len()).filter(|&vertex| active[vertex]).collect();
            for &entry in inner.iter().flat_map(|&vertex| vertex_tets.row(vertex)) {
                tets[entry as usize / 4].iter().for_each(|&vertex| active[vertex as usize] = true);
            }
        }
        let moves = |&vertex: &u32| {
            let vertex = vertex as usize;
            active[vertex]
                && (self.constraint[vertex] != Constraint::Held || (self.slides[vertex] && round.slide.is_some()))
        };
        (0..active.len() as u32).filter(moves).collect()
    }
}

/// `delta^2`, so that the tet with the smallest volume has `h` near [`EPSILON`]; zero where all tets have more.
fn regularisation(smallest: f64) -> f64 {
    if smallest < EPSILON { EPSILON * (EPSILON - smallest) } else { 0.0 }
}

/// A position moved by a displacement. A coordinate that does not move keeps its bits, also those of -0.
pub fn moved(at: DVec3, by: DVec3) -> DVec3 {
    let add = |x: f64, c: f64| if c == 0.0 { x } else { x + c };
    DVec3::new(add(at.x, by.x), add(at.y, by.y), add(at.z, by.z))
}

#[cfg(test)]
mod tests {
    use super::regularisation;

    /// The regularised volume `h = (v + sqrt(v^2 + 4 delta^2)) / 2` of the worst tet is 1e-4; where the worst tet has a
    /// hundredth of its volume nothing is regularised.
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
