//! Stage trailing edge (paper 3.2): first the boundary curve of a trailing edge moves, then its
//! inside.
//!
//! A part of the boundary curve belongs to the wing and has moved already. The other parts relax as
//! chains of springs between their moved ends (the paper's one-dimensional dynamic mesh). Then the
//! inside relaxes as a surface that is held at the whole curve.
//!
//! # Arcs on a part
//!
//! A fairing may cross one side of a blunt trailing edge. The boundary curve then leaves this side,
//! runs over the fairing, and comes back. The springs of such an arc would know of this side alone:
//! where the base becomes thinner, the other side would come down on an arc that stays as high as
//! it was. So an arc starts from the best affine motion of four corners: its two ends, and the two
//! vertices of the other side next to them. The springs act on the rest. The paper has no such
//! parts.

use std::collections::HashSet;

use glam::{DMat3, DVec3};

use super::surface_network::SurfaceNetwork;
use crate::families::{Families, PlacedBy};
use crate::geometry::{fitted_motion::FittedMotion, motion_change::FittedChange};
use crate::mesh::Displacement;
use crate::stage::{Kept, NoProduct, Products, SetUp, Stage, StageError};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    relaxation::{Convergence, Stopping},
};

/// All trailing edges of a mesh.
pub struct TrailingEdges {
    edges: Vec<TrailingEdge>,
}

struct TrailingEdge {
    curve: SurfaceNetwork,
    /// The parts of the curve that leave one side of the trailing edge and come back to it.
    arcs: Vec<Arc>,
    surface: SurfaceNetwork,
}

/// A part of the boundary curve between two vertices of one side.
struct Arc {
    /// The two ends, and the vertex of the other side next to each.
    corners: [u32; 4],
    chain: SurfaceNetwork,
}

impl Arc {
    /// Relaxes the arc between its ends, from the best affine motion of its corners.
    ///
    /// - `vertices` `[n_vertices]`: in the mesh's unit
    fn relax(
        &mut self,
        vertices: &[DVec3],
        displacement: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let pairs = self.pairs(vertices, displacement);
        if self.corners.iter().all(|&vertex| displacement[vertex as usize] == DVec3::ZERO) {
            return Ok(Convergence::nothing_to_do());
        }
        let motion = FittedMotion::affine(&pairs);
        let carried = |vertex: u32| motion.displacement(vertices[vertex as usize]);
        let [one, other, ..] = self.corners;
        let given = [one, other].map(|end| (end, displacement[end as usize]));
        given.iter().for_each(|&(end, _)| displacement[end as usize] -= carried(end));
        let convergence = self.chain.relax(displacement, stopping)?;
        given.iter().for_each(|&(end, own)| displacement[end as usize] = own);
        for (vertex, _) in self.chain.moving() {
            displacement[vertex as usize] += carried(vertex);
        }
        Ok(convergence)
    }

    /// The corners before and after the motion, with their weights.
    fn pairs(&self, vertices: &[DVec3], displacement: &[DVec3]) -> [(DVec3, DVec3, f64); 4] {
        self.corners.map(|vertex| {
            let at = vertices[vertex as usize];
            (at, at + displacement[vertex as usize], 1.0)
        })
    }

    /// Change of [`Self::relax`].
    fn forward(
        &mut self,
        fit: &FittedChange,
        vertices: &[DVec3],
        change: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let motion = fit.forward(&self.corners.map(|vertex| change[vertex as usize]));
        let carried = |vertex: u32| motion.of(vertices[vertex as usize]);
        let [one, other, ..] = self.corners;
        let given = [one, other].map(|end| (end, change[end as usize]));
        given.iter().for_each(|&(end, _)| change[end as usize] -= carried(end));
        let convergence = self.chain.forward(change, stopping)?;
        given.iter().for_each(|&(end, own)| change[end as usize] = own);
        for (vertex, _) in self.chain.moving() {
            change[vertex as usize] += carried(vertex);
        }
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    fn reverse(
        &mut self,
        fit: &FittedChange,
        vertices: &[DVec3],
        gradient: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let mut by_motion = fit.none();
        for (vertex, _) in self.chain.moving() {
            by_motion.add(vertices[vertex as usize], gradient[vertex as usize]);
        }
        let [one, other, ..] = self.corners;
        let given = [one, other].map(|end| (end, std::mem::take(&mut gradient[end as usize])));
        let convergence = self.chain.reverse(gradient, stopping)?;
        for (end, own) in given {
            by_motion.add(vertices[end as usize], -gradient[end as usize]);
            gradient[end as usize] += own;
        }
        for (vertex, by_corner) in self.corners.iter().zip(fit.reverse(&by_motion)) {
            gradient[*vertex as usize] += by_corner;
        }
        Ok(convergence)
    }
}

impl TrailingEdge {
    /// Relaxes the boundary curve.
    fn relax_curve(
        &mut self,
        vertices: &[DVec3],
        displacement: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let mut convergence = self.curve.relax(displacement, stopping)?;
        for arc in &mut self.arcs {
            convergence = convergence.and(arc.relax(vertices, displacement, stopping)?);
        }
        Ok(convergence)
    }

    /// Brings the vertices of the boundary curve back onto the carenages and planes that they
    /// touch.
    fn settle(&self, vertices: &[DVec3], families: &Families, displacement: &mut [DVec3]) {
        for vertex in self.on_curve() {
            let displacement = &mut displacement[vertex as usize];
            if *displacement != DVec3::ZERO {
                let start = vertices[vertex as usize];
                *displacement = families.settle(vertex, start + *displacement) - start;
            }
        }
    }

    /// The vertices of the boundary curve that may move.
    fn on_curve(&self) -> impl Iterator<Item = u32> + '_ {
        let on_arcs = self.arcs.iter().flat_map(|arc| arc.chain.moving());
        self.curve.moving().chain(on_arcs).map(|(vertex, _)| vertex)
    }
}

/// The derivatives of a boundary curve at one displacement.
struct CurveChange {
    /// Of the motions of the arcs.
    arcs: Vec<FittedChange>,
    /// Of the places to which vertices settle.
    settled: Vec<(u32, DMat3)>,
}

impl TrailingEdges {
    /// The derivatives of the boundary curves. The curves relax again, because the places from
    /// which vertices settle tell how they do.
    fn curve_changes(&mut self, set_up: &SetUp, kept: &Kept) -> Result<Vec<CurveChange>, NoProduct> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut displacement = kept.surfaces.clone();
        clear(families, &mut displacement);
        let mut changes = Vec::with_capacity(self.edges.len());
        for edge in &mut self.edges {
            edge.relax_curve(&mesh.vertices, &mut displacement, stopping)?;
            let settle = |vertex: u32| {
                let at = mesh.vertices[vertex as usize] + displacement[vertex as usize];
                (vertex, families.settle_change(vertex, at))
            };
            let settled = edge.on_curve().map(settle).collect();
            edge.settle(&mesh.vertices, families, &mut displacement);
            let of_arc = |arc: &Arc| {
                let fit = FittedChange::affine(&arc.pairs(&mesh.vertices, &displacement));
                fit.ok_or(NoProduct::Rotation { vertex: arc.corners[0] })
            };
            let arcs = edge.arcs.iter().map(of_arc).collect::<Result<_, _>>()?;
            changes.push(CurveChange { arcs, settled });
        }
        Ok(changes)
    }

    /// Sets up two networks for each trailing edge: its boundary curve and its surface.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let edges = families.families_of(PlacedBy::TrailingEdge).map(|family| {
            let own = |vertex: u32| families.placed_by[vertex as usize] == PlacedBy::TrailingEdge;
            let in_order = |half_edges: Vec<u32>| half_edges.into_iter().map(|h| surface.origin(h)).collect();
            let loops: Vec<Vec<u32>> = surface.boundary_loops(family).into_iter().map(in_order).collect();
            let limit =
                |vertex: u32, free: bool| if free { families.plane_constraint(vertex) } else { Constraint::Held };
            let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
            let mut on_arcs: Vec<[u32; 2]> = Vec::new();
            let mut of_arcs = Vec::new();
            for (chain, [beside_one, beside_other]) in arcs(&mesh.vertices, &loops, own) {
                let edges: Vec<[u32; 2]> = chain.windows(2).map(|ends| sorted(ends[0], ends[1])).collect();
                let corners = [chain[0], chain[chain.len() - 1], beside_one, beside_other];
                let chain = SurfaceNetwork::new(&mesh.vertices, &edges, |v| limit(v, own(v)), backend, method)?;
                on_arcs.extend(edges);
                of_arcs.push(Arc { corners, chain });
            }
            let around = |of_loop: &Vec<u32>| {
                let next = of_loop.iter().cycle().skip(1);
                of_loop.iter().zip(next).map(|(&a, &b)| sorted(a, b)).collect::<Vec<_>>()
            };
            let mut boundary: Vec<[u32; 2]> = loops.iter().flat_map(around).collect();
            boundary.sort_unstable();
            boundary.dedup();
            let on_curve: HashSet<u32> = boundary.iter().flatten().copied().collect();
            boundary.retain(|edge| !on_arcs.contains(edge));
            let curve = SurfaceNetwork::new(&mesh.vertices, &boundary, |v| limit(v, own(v)), backend, method)?;
            let inner = surface.edges_of(surface.triangles_of(family));
            let inside = |v: u32| limit(v, own(v) && !on_curve.contains(&v));
            let surface = SurfaceNetwork::new(&mesh.vertices, &inner, inside, backend, method)?;
            Ok(TrailingEdge { curve, arcs: of_arcs, surface })
        });
        Ok(Self { edges: edges.collect::<Result<_, BackendError>>()? })
    }
}

impl Stage for TrailingEdges {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut convergence = Convergence::nothing_to_do();
        for edge in &mut self.edges {
            convergence = convergence.and(edge.relax_curve(&mesh.vertices, displacement, stopping)?);
            edge.settle(&mesh.vertices, families, displacement);
        }
        families.partners.even(families, displacement);
        for edge in &mut self.edges {
            convergence = convergence.and(edge.surface.relax(displacement, stopping)?);
        }
        Ok(convergence)
    }
}

impl Products for TrailingEdges {
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let SetUp { mesh, families, .. } = set_up;
        clear(families, change);
        let mut convergence = Convergence::nothing_to_do();
        for (of_curve, edge) in self.curve_changes(set_up, kept)?.iter().zip(&mut self.edges) {
            convergence = convergence.and(edge.curve.forward(change, stopping)?);
            for (fit, arc) in of_curve.arcs.iter().zip(&mut edge.arcs) {
                convergence = convergence.and(arc.forward(fit, &mesh.vertices, change, stopping)?);
            }
            for &(vertex, settled) in &of_curve.settled {
                change[vertex as usize] = settled * change[vertex as usize];
            }
        }
        families.partners.even(families, change);
        for edge in &mut self.edges {
            convergence = convergence.and(edge.surface.forward(change, stopping)?);
        }
        Ok(convergence)
    }

    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let SetUp { mesh, families, .. } = set_up;
        let mut convergence = Convergence::nothing_to_do();
        for edge in self.edges.iter_mut().rev() {
            convergence = convergence.and(edge.surface.reverse(gradient, stopping)?);
        }
        families.partners.even_reverse(families, gradient);
        for (of_curve, edge) in self.curve_changes(set_up, kept)?.iter().zip(&mut self.edges).rev() {
            for &(vertex, settled) in of_curve.settled.iter().rev() {
                gradient[vertex as usize] = settled.transpose() * gradient[vertex as usize];
            }
            for (fit, arc) in of_curve.arcs.iter().zip(&mut edge.arcs).rev() {
                convergence = convergence.and(arc.reverse(fit, &mesh.vertices, gradient, stopping)?);
            }
            convergence = convergence.and(edge.curve.reverse(gradient, stopping)?);
        }
        clear(families, gradient);
        Ok(convergence)
    }
}

/// Sets the vectors of the stage's own vertices to zero.
fn clear(families: &Families, vectors: &mut Displacement) {
    for (vector, placed_by) in vectors.iter_mut().zip(&families.placed_by) {
        if *placed_by == PlacedBy::TrailingEdge {
            *vector = DVec3::ZERO;
        }
    }
}

/// The parts of the boundary curve that leave one side of the trailing edge and come back to it:
/// their vertices in order with both ends, and the vertices of the other side next to the ends.
///
/// The other side is a run of vertices that earlier stages place and that holds neither end. It is
/// nearer to both ends than the arc is long. The root and the tip of a trailing edge run from side
/// to side, and are no arcs.
///
/// - `loops`: the boundary curves, each as its vertices in order
/// - `own`: whether the stage places a vertex
fn arcs(vertices: &[DVec3], loops: &[Vec<u32>], own: impl Fn(u32) -> bool) -> Vec<(Vec<u32>, [u32; 2])> {
    // Runs of vertices that earlier stages place, and the chains between the ends of two runs.
    let mut runs: Vec<Vec<u32>> = Vec::new();
    let mut chains: Vec<(Vec<u32>, [usize; 2])> = Vec::new();
    for of_loop in loops {
        let n = of_loop.len();
        let Some(start) = (0..n).find(|&i| own(of_loop[(i + n - 1) % n]) && !own(of_loop[i])) else { continue };
        let ring: Vec<u32> = (0..n).map(|i| of_loop[(start + i) % n]).collect();
        let (placed, free): (Vec<_>, Vec<_>) = ring.chunk_by(|&a, &b| own(a) == own(b)).partition(|run| !own(run[0]));
        let first = runs.len();
        runs.extend(placed.iter().map(|run| run.to_vec()));
        for (k, free) in free.iter().enumerate() {
            let sides = [first + k, first + (k + 1) % placed.len()];
            let ends = [runs[sides[0]][runs[sides[0]].len() - 1], runs[sides[1]][0]];
            chains.push(([&ends[..1], free, &ends[1..]].concat(), sides));
        }
    }
    let at = |vertex: u32| vertices[vertex as usize];
    let arc = |(chain, sides): (Vec<u32>, [usize; 2])| {
        let length: f64 = chain.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).sum();
        let beside = |end: u32| {
            let others = runs.iter().enumerate().filter(|(run, _)| !sides.contains(run));
            let all = others.flat_map(|(run, of_run)| of_run.iter().map(move |&vertex| (run, vertex)));
            let distance = |&(_, vertex): &(usize, u32)| at(vertex).distance(at(end));
            let nearest = all.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            (distance(&nearest) < length).then_some(nearest)
        };
        let (one, other) = (beside(chain[0])?, beside(chain[chain.len() - 1])?);
        (one.0 == other.0).then_some((chain, [one.1, other.1]))
    };
    chains.into_iter().filter_map(arc).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A base from x = 0 to 10 and 0.2 high, whose lower side a fairing leaves from x = 4 to 6. The
    /// vertices of the sides are placed, those of root, tip and fairing are not.
    ///
    /// Fails if the other side may be farther away than the arc is long: the root then has one.
    #[test]
    fn an_arc_leaves_one_side_and_comes_back() {
        let mut vertices = Vec::new();
        let mut placed = Vec::new();
        let mut add = |x: f64, z: f64, is_placed: bool| {
            vertices.push(DVec3::new(x, 0.0, z));
            placed.push(is_placed);
        };
        (0..=4).for_each(|x| add(x.into(), 0.0, true));
        [(4.5, 0.1), (5.0, 0.15), (5.5, 0.1)].into_iter().for_each(|(x, z)| add(x, z, false));
        (6..=10).for_each(|x| add(x.into(), 0.0, true));
        add(10.0, 0.1, false);
        (0..=10).rev().for_each(|x| add(x.into(), 0.2, true));
        add(0.0, 0.1, false);
        let n = vertices.len() as u32;
        for shift in 0..n {
            let of_loop: Vec<u32> = (0..n).map(|i| (i + shift) % n).collect();
            let found = arcs(&vertices, &[of_loop], |vertex| !placed[vertex as usize]);
            // Vertices 4 to 8 from x = 4 to 6, and those above its ends.
            assert_eq!(found, [(vec![4, 5, 6, 7, 8], [20, 18])], "{shift}");
        }
    }
}
