//! Local quality optimisation: untangles inverted tets and improves bad ones, vertex by vertex.
//!
//! Each vertex moves to lower `E = sum over its tets of q^m` ([`crate::kernels::smooth_vertices`]), the vertices of one
//! colour at once, so the result does not depend on the order of threads. Only where a tet is below the goal vertices
//! move; elsewhere the mesh keeps its bits.
//!
//! A run goes in rounds of a few sweeps. After each, quality is measured in f64, and the active vertices, the
//! regularisation and the power `m` follow from it: 1 while a tet is inverted, then 2. When the worst tet stops
//! improving below the goal, the vertices of bad tets climb on beta itself, whatever the target, which costs far less.
//!
//! Vertices of surfaces are held at first. Where that does not reach the goal and a run has a [`Slide`], they take part:
//! constrained to tangents in a round and brought back after it, and after every step of a climb.
//!
//! Source: Escobar et al. 2003 (CMAME 192, 2775-2787) for the regularised measure; the sum over powers of the mean ratio
//! as in Freitag Diachin et al. 2006 (Eng. Comput. 22, 61-74).

mod climb;
mod colouring;
mod slide;
mod state;
mod target;

use glam::DVec3;
use rayon::prelude::*;

pub use colouring::{NONE, colour};
pub use slide::Slide;
pub use target::{Target, inverse_targets};

use crate::backend::{Backend, BackendError, Constraint, DeviceSmoother, SmoothingData, SmoothingSweeps};
use crate::mesh::csr::Csr;
use crate::quality;
use state::State;

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

/// The regularisation acts in tets that have less than this fraction of their original volume.
const EPSILON: f64 = 1e-4;

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
    /// Lower the sum of powers, on the device.
    Energy,
    /// Raise the low betas around the vertices of bad tets, see [`climb`].
    Climb,
}

/// The best mesh seen.
#[derive(Clone)]
struct Best {
    state: State,
    at: Vec<DVec3>,
}

/// Smooths one mesh again and again. Set up once per mesh.
pub struct Smoother {
    tets: Vec<[u32; 4]>,
    vertex_tets: Csr,
    /// What each vertex may do; those that slide are held but for their sweeps.
    constraint: Vec<Constraint>,
    /// Whether a vertex may slide `[n_vertices]`.
    slides: Vec<bool>,
    /// Colour of each vertex, [`NONE`] for held ones.
    colour: Vec<u32>,
    /// Volume of each original tet.
    volume: Vec<f64>,
    /// The beta up to which vertices climb: that of the worst original tet where its shape is the target, so that an
    /// unmoved mesh keeps its bits; else without bound.
    highest_climb: f64,
    device: Box<dyn DeviceSmoother>,
}

impl Smoother {
    /// Takes a mesh to the backend.
    ///
    /// - `tets` `[n_tets]`, `original` `[n_vertices]`: the undeformed mesh, whose tets have positive volume
    /// - `constraints` `[n_vertices]`: what each vertex may do
    /// - `slides`: held vertices that may slide in runs with a [`Slide`]
    ///
    /// # Errors
    /// The device failed or the mesh does not fit.
    ///
    /// # Panics
    /// The arrays do not belong to one mesh.
    pub fn new(
        backend: &dyn Backend,
        tets: &[[u32; 4]],
        original: &[DVec3],
        constraints: &[Constraint],
        slides: &[u32],
        target: Target,
    ) -> Result<Self, BackendError> {
        let corners = tets.iter().enumerate().flat_map(|(tet, corners)| {
            corners.iter().enumerate().map(move |(local, &vertex)| (vertex, (4 * tet + local) as u32))
        });
        let vertex_tets = Csr::from_pairs(original.len(), corners);
        let held = |vertex: usize| constraints[vertex] == Constraint::Held;
        let mut slide = vec![false; original.len()];
        slides.iter().for_each(|&vertex| slide[vertex as usize] = held(vertex as usize));
        let moves: Vec<bool> = (0..original.len()).map(|vertex| !held(vertex) || slide[vertex]).collect();
        let inverse_target = inverse_targets(target, tets, original);
        let data =
            SmoothingData { tets, vertex_tets: &vertex_tets, inverse_target: &inverse_target, constraint: constraints };
        let volume: Vec<f64> =
            tets.iter().map(|tet| quality::volume(tet.map(|vertex| original[vertex as usize]))).collect();
        let highest_climb = match target {
            Target::Original => State::new(original, tets, &volume).beta_min,
            Target::Improve => f64::INFINITY,
        };
        Ok(Self {
            device: backend.smoother(&data)?,
            colour: colour(tets, &vertex_tets, &moves),
            volume,
            highest_climb,
            tets: tets.to_vec(),
            constraint: constraints.to_vec(),
            slides: slide,
            vertex_tets,
        })
    }

    /// Moves vertices until no tet is below the goal, the smallest beta has stopped rising, or the sweeps are used up.
    ///
    /// - `positions` `[n_vertices]`: replaced by the best seen, that with the fewest inverted tets and then the greatest
    ///   smallest beta; so they never get worse, and where no tet is below the goal they keep their bits
    /// - `slide`: where vertices slide that may, once the rest alone does not reach the goal; what they gain is kept if no
    ///   further triangle is folded. Without it they are held
    ///
    /// # Errors
    /// The device failed; `positions` are as they were.
    pub fn run(
        &mut self,
        positions: &mut [DVec3],
        goal: &Goal,
        slide: Option<&dyn Slide>,
    ) -> Result<Smoothed, BackendError> {
        let state = State::new(positions, &self.tets, &self.volume);
        let mut best = Best { state, at: positions.to_vec() };
        let mut sweeps = self.improve_both_ways(&mut best, goal, None)?;
        if let Some(slide) = slide
            && self.slides.contains(&true)
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
        Ok(Smoothed { sweeps, inverted: best.state.inverted, beta_min: best.state.beta_min, moved })
    }

    /// First lowers the sum of powers, then climbs. Returns the sweeps.
    fn improve_both_ways(
        &mut self,
        best: &mut Best,
        goal: &Goal,
        slide: Option<&dyn Slide>,
    ) -> Result<usize, BackendError> {
        let mut sweeps = 0;
        for (method, beta) in [(Method::Energy, goal.beta), (Method::Climb, goal.beta.min(self.highest_climb))] {
            sweeps += self.improve(best, method, &Goal { beta, max_sweeps: goal.max_sweeps - sweeps }, slide)?;
        }
        Ok(sweeps)
    }

    /// Rounds of one method until it no longer helps. Returns its sweeps.
    fn improve(
        &mut self,
        best: &mut Best,
        method: Method,
        goal: &Goal,
        slide: Option<&dyn Slide>,
    ) -> Result<usize, BackendError> {
        let Best { mut state, mut at } = best.clone();
        let mut record = state.clone();
        let (mut sweeps, mut waited) = (0, 0);
        while !state.reaches(goal.beta) && sweeps < goal.max_sweeps {
            if waited >= if state.inverted > 0 { PATIENCE_TANGLED } else { PATIENCE } {
                break;
            }
            let rings = if method == Method::Energy { 1 } else { 0 };
            let colours = self.active(&state, goal.beta, rings, slide.is_some());
            if colours.is_empty() {
                break;
            }
            let count = ROUND.min(goal.max_sweeps - sweeps);
            match method {
                Method::Energy => self.minimise(&state, &colours, count, slide, &mut at)?,
                Method::Climb => {
                    let Self { tets, vertex_tets, constraint, slides, .. } = &*self;
                    let mesh = climb::Mesh { tets, vertex_tets, constraint, slides, slide };
                    (0..count).for_each(|_| climb::sweep(&mesh, goal.beta, &colours, &mut at));
                }
            }
            sweeps += count;
            state = State::new(&at, &self.tets, &self.volume);
            if state.beats(&best.state, 0.0) {
                *best = Best { state: state.clone(), at: at.clone() };
            }
            let far = state.inverted == 0 && state.beta_min < NEAR * goal.beta;
            if method == Method::Energy && far && !state.beats(&record, FADES) {
                break;
            }
            let untangles = state.inverted > 0 && state.inverted == record.inverted;
            if state.beats(&record, IMPROVES) || (untangles && state.sigma_min > record.sigma_min) {
                record = state.clone();
                waited = 0;
            } else {
                waited += 1;
            }
        }
        Ok(sweeps)
    }

    /// Sweeps that lower the objective at these vertices, on the device.
    fn minimise(
        &mut self,
        state: &State,
        colours: &[Vec<u32>],
        count: usize,
        slide: Option<&dyn Slide>,
        at: &mut [DVec3],
    ) -> Result<(), BackendError> {
        let sliding: Vec<u32> = colours.iter().flatten().copied().filter(|&v| self.slides[v as usize]).collect();
        if let Some(slide) = slide
            && !sliding.is_empty()
        {
            let tangent = |&vertex: &u32| slide.tangent(vertex, at[vertex as usize]);
            let tangents: Vec<Constraint> = sliding.par_iter().map(tangent).collect();
            sliding.iter().zip(tangents).for_each(|(&vertex, tangent)| self.constraint[vertex as usize] = tangent);
            self.device.constrain(&self.constraint)?;
        }
        let power = if state.inverted > 0 { POWER_TANGLED } else { POWER };
        let delta_squared = regularisation(state);
        self.device.start(at)?;
        self.device.sweep(&SmoothingSweeps { colours, power, delta_squared, count })?;
        let correction = self.device.correction()?;
        let by = |vertex: u32| self.constraint[vertex as usize].limit(correction[vertex as usize]);
        let place = |&vertex: &u32| {
            let moved = moved(at[vertex as usize], by(vertex));
            match slide {
                Some(slide) if self.slides[vertex as usize] && moved != at[vertex as usize] => {
                    slide.back(vertex, moved)
                }
                _ => moved,
            }
        };
        let active: Vec<u32> = colours.concat();
        let placed: Vec<DVec3> = active.par_iter().map(place).collect();
        active.iter().zip(placed).for_each(|(&vertex, placed)| at[vertex as usize] = placed);
        sliding.iter().for_each(|&vertex| self.constraint[vertex as usize] = Constraint::Held);
        Ok(())
    }

    /// The vertices of tets below the goal, and of this many rings of tets around those, by colour; empty if none of them
    /// may move.
    fn active(&self, state: &State, goal: f64, rings: usize, slide: bool) -> Vec<Vec<u32>> {
        let bad = |beta: f64| beta.is_nan() || beta <= 0.0 || beta < goal;
        let mut active = vec![false; self.colour.len()];
        for (tet, &beta) in self.tets.iter().zip(&state.beta) {
            if bad(beta) {
                tet.iter().for_each(|&vertex| active[vertex as usize] = true);
            }
        }
        for _ in 0..rings {
            let inner: Vec<usize> = (0..active.len()).filter(|&vertex| active[vertex]).collect();
            for &entry in inner.iter().flat_map(|&vertex| self.vertex_tets.row(vertex)) {
                self.tets[entry as usize / 4].iter().for_each(|&vertex| active[vertex as usize] = true);
            }
        }
        let mut colours: Vec<Vec<u32>> = Vec::new();
        for (vertex, &colour) in self.colour.iter().enumerate().filter(|&(vertex, _)| active[vertex]) {
            if colour != NONE && (slide || !self.slides[vertex]) {
                if colours.len() <= colour as usize {
                    colours.resize(colour as usize + 1, Vec::new());
                }
                colours[colour as usize].push(vertex as u32);
            }
        }
        colours
    }
}

/// `delta^2`, so that the tet with the smallest volume has `h` near [`EPSILON`]; zero where all tets have more.
fn regularisation(state: &State) -> f64 {
    if state.sigma_min < EPSILON { EPSILON * (EPSILON - state.sigma_min) } else { 0.0 }
}

/// A position moved by a displacement. A coordinate that does not move keeps its bits, also those of -0.
pub fn moved(at: DVec3, by: DVec3) -> DVec3 {
    let add = |x: f64, c: f64| if c == 0.0 { x } else { x + c };
    DVec3::new(add(at.x, by.x), add(at.y, by.y), add(at.z, by.z))
}
