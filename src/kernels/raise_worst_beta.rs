//! One step that raises the worst beta around some vertices. Twin of
//! `kernels/raise_worst_beta.wgsl`.
//!
//! A vertex takes a gradient step that lowers `E = sum over its tets of max(0, 1 - beta / goal)^4`.
//! All other vertices stay fixed. Tets above the goal do not count, and a step that pushes them
//! below the goal raises `E`. The fourth power gives the worst tets the greatest share.
//!
//! Other objectives were tried. Raising the smallest beta around a vertex alone also reaches the
//! goal, but many good tets fall to the level of the smallest: on a wing turned by 180 degrees the
//! mean beta falls to 0.023, with the fourth power to 0.043. With the second power the smallest
//! beta stops at a fifth of the goal.
//!
//! The paper measures beta (equation 1) and has no local optimisation.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;
use super::star::{HALVINGS, Star};
use super::vector::{cross, difference, dot, scaled, sum};

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First vertex of the dispatch.
    pub first: u32,
    /// Number of the dispatch's vertices.
    pub n_vertices: u32,
    /// Six times the goal. The factor is applied on the host, because compilers may join constant
    /// factors and then round differently.
    pub six_goal: f32,
    /// A vertex stays if its step would lower `E` by less than this fraction.
    pub gain: f32,
}

/// Loop iterations of one invocation per tet around its vertex.
pub const PASSES: u32 = 1 + HALVINGS;

/// The objective `E`.
#[derive(Clone, Copy, Debug)]
pub struct WorstBetaObjective<T> {
    /// Six times the beta below which tets count.
    pub six_goal: T,
    /// A vertex stays if its step would lower `E` by less than this fraction.
    pub gain: T,
}

/// Moves some vertices that share no tet, each along the projected negative gradient of `E`.
///
/// The first step tried has a quarter of the length of the vertex's shortest edge. It is halved
/// until it lowers `E` enough, at most 8 times; otherwise the vertex stays. A longer first step is
/// of no use, as the tets that are not among the worst stop it.
///
/// - `first`: the first of the vertices, which follow one another; no two of them share a tet
/// - `star`: its `base` holds each tet's edge vectors from its first vertex
/// - `correction` `[n_vertices]`: displacements of all vertices since `base` was taken; the fourth
///   component is not used
/// - `moved` `[n]`: receives the new corrections of the vertices
pub fn run<T: Real>(
    first: usize,
    star: &Star<T>,
    objective: &WorstBetaObjective<T>,
    correction: &[[T; 4]],
    moved: &mut [[T; 4]],
) {
    let mut corners = Vec::new();
    for (place, moved) in moved.iter_mut().enumerate() {
        let vertex = first + place;
        let at = correction[vertex];
        corners.clear();
        corners.extend(star.around(vertex).iter().map(|&entry| Corner::new(star, correction, entry)));
        let new = step(vertex, star, &corners, objective, [at[0], at[1], at[2]]);
        *moved = [new[0], new[1], new[2], T::ZERO];
    }
}

fn step<T: Real>(
    vertex: usize,
    star: &Star<T>,
    corners: &[Corner<T>],
    objective: &WorstBetaObjective<T>,
    at: [T; 3],
) -> [T; 3] {
    let local = derivatives(corners, objective, at);
    let direction = project(&star.constraint[vertex], local.uphill);
    let length = dot(direction, direction).sqrt();
    // Also false for a NaN.
    let leads_somewhere = length > T::ZERO;
    if !leads_somewhere {
        return at;
    }
    let mut step = scaled(direction, T::from_f64(0.25) * local.shortest.sqrt() / length);
    let enough = local.energy - objective.gain * local.energy;
    for _ in 0..HALVINGS {
        let trial = star.within(vertex, sum(at, step));
        if is_below(corners, objective, trial, enough) {
            return trial;
        }
        step = scaled(step, T::from_f64(0.5));
    }
    at
}

/// `E` around a vertex, and its gradient.
#[derive(Clone, Copy, Debug)]
pub struct Local<T> {
    /// `E`, without unit.
    pub energy: T,
    /// Gradient of `E` with respect to the vertex, times `-6 goal / 4`: a direction of descent.
    pub uphill: [T; 3],
    /// Square of the vertex's shortest edge.
    pub shortest: T,
}

/// Whether `E` at `at` is below a bound. No term of `E` is negative, so the sum stops as soon as it
/// reaches the bound.
fn is_below<T: Real>(corners: &[Corner<T>], objective: &WorstBetaObjective<T>, at: [T; 3], bound: T) -> bool {
    let mut total = T::ZERO;
    for corner in corners {
        let short = corner.edges(at).shortfall(objective.six_goal);
        let squared = short * short;
        total = total + squared * squared;
        // Also false for a NaN.
        let below = total < bound;
        if !below {
            return false;
        }
    }
    true
}

/// `E` and its gradient for a vertex at `at`, from the tets around it.
pub fn derivatives<T: Real>(corners: &[Corner<T>], objective: &WorstBetaObjective<T>, at: [T; 3]) -> Local<T> {
    let mut local = Local { energy: T::ZERO, uphill: [T::ZERO; 3], shortest: T::ZERO };
    for (place, corner) in corners.iter().enumerate() {
        let edges = corner.edges(at);
        let short = edges.shortfall(objective.six_goal);
        let squared = short * short;
        local.energy = local.energy + squared * squared;
        local.uphill = sum(local.uphill, scaled(edges.slope(), squared * short));
        let own = edges.shortest();
        if place == 0 || own < local.shortest {
            local.shortest = own;
        }
    }
    local
}

/// A tet with one moving vertex.
#[derive(Clone, Copy, Debug)]
pub struct Corner<T> {
    /// Vectors from the moving vertex to the other three, before any of the four moved. Their order
    /// keeps the sign of the volume.
    base: [[T; 3]; 3],
    /// Corrections of the other three vertices.
    others: [[T; 3]; 3],
}

impl<T: Real> Corner<T> {
    /// The tet of an entry of [`Star::vertex_tets`].
    #[inline(always)]
    pub fn new(star: &Star<T>, correction: &[[T; 4]], entry: u32) -> Self {
        let base = &star.base[entry as usize / 4];
        let edge = |k: usize| [base[3 * k], base[3 * k + 1], base[3 * k + 2]];
        let (a1, a2, a3) = (edge(0), edge(1), edge(2));
        let negative = |v: [T; 3]| [-v[0], -v[1], -v[2]];
        let [a, b, c, d] = star.tets[entry as usize / 4];
        let (others, base) = match entry % 4 {
            0 => ([b, c, d], [a1, a2, a3]),
            1 => ([a, d, c], [negative(a1), difference(a3, a1), difference(a2, a1)]),
            2 => ([a, b, d], [negative(a2), difference(a1, a2), difference(a3, a2)]),
            _ => ([a, c, b], [negative(a3), difference(a2, a3), difference(a1, a3)]),
        };
        let point = |vertex: u32| {
            let c = &correction[vertex as usize];
            [c[0], c[1], c[2]]
        };
        Self { base, others: [point(others[0]), point(others[1]), point(others[2])] }
    }

    #[inline(always)]
    fn edges(&self, at: [T; 3]) -> Edges<T> {
        let to = |k: usize| sum(self.base[k], difference(self.others[k], at));
        let (u, v, w) = (to(0), to(1), to(2));
        let opposite = longer(longer(difference(v, u), difference(w, v)), difference(u, w));
        let longest = longer(longer(longer(u, v), w), opposite);
        Edges { u, v, w, longest: dot(longest, longest) }
    }
}

/// Edges of a tet at its moving vertex.
struct Edges<T> {
    /// Vectors to the other three vertices.
    u: [T; 3],
    v: [T; 3],
    w: [T; 3],
    /// Squared length of the longest of all six edges.
    longest: T,
}

impl<T: Real> Edges<T> {
    /// Six times beta: the signed volume over the cube of the longest edge. The edges are divided
    /// by the longest one first, so products stay in the range of f32.
    #[inline(always)]
    fn six_beta(&self) -> T {
        let shrink = T::ONE / self.longest.sqrt();
        let (u, v, w) = (scaled(self.u, shrink), scaled(self.v, shrink), scaled(self.w, shrink));
        dot(cross(u, v), w)
    }

    /// `max(0, 1 - beta / goal)`. A NaN stays a NaN.
    #[inline(always)]
    fn shortfall(&self, six_goal: T) -> T {
        let short = T::ONE - self.six_beta() / six_goal;
        if short < T::ZERO { T::ZERO } else { short }
    }

    /// Squared length of the shortest edge at the moving vertex.
    #[inline(always)]
    fn shortest(&self) -> T {
        let lesser = |a: T, b: T| if b < a { b } else { a };
        lesser(lesser(dot(self.u, self.u), dot(self.v, self.v)), dot(self.w, self.w))
    }

    /// Gradient of six times beta with respect to the moving vertex.
    #[inline(always)]
    fn slope(&self) -> [T; 3] {
        let shrink = T::ONE / self.longest.sqrt();
        let (along, across) = (difference(self.w, self.u), difference(self.v, self.u));
        let of_volume = scaled(cross(scaled(along, shrink), scaled(across, shrink)), shrink);
        let own = longer(longer(self.u, self.v), self.w);
        if dot(own, own) < self.longest {
            return of_volume;
        }
        sum(of_volume, scaled(scaled(own, shrink), T::from_f64(3.0) * self.six_beta() * shrink))
    }
}

/// The longer of two edges.
#[inline(always)]
fn longer<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    if dot(b, b) > dot(a, a) { b } else { a }
}
