//! [`Layers`]: the edges that lead from one layer of thin cells to the next, and what a motion does
//! to them.
//!
//! Layers over a wall have a thickness that a flow solver needs as it is. Local optimisation would
//! change it gladly, because a thicker layer has cells of a better shape. So vertices of layers
//! move perpendicular to the edges between layers ([`across`]), and a motion that changes these
//! edges is told by [`Layers::largest_change`].

use std::cmp::Ordering;
use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use super::{Merit, neighbourhood::Topology};
use crate::constraint::Constraint;

/// Edges within this factor of a vertex's shortest edge, and along it by at least
/// [`ALONG`] (the cosine of their angle), lead between layers. A vertex is thin if no other edge is
/// as short.
const NEXT: f64 = 2.0;
const ALONG: f64 = 0.7;

/// The layers of a mesh with other cells than tets.
#[derive(Clone, Copy)]
pub(super) struct Layers<'a> {
    pub(super) topology: &'a Topology,
    pub(super) merit: &'a Merit,
    /// Vertices of the undeformed mesh `[n_vertices]`.
    pub(super) original: &'a [DVec3],
}

/// The edges between layers at a vertex.
pub(super) struct Between {
    /// Unit vector along the shortest edge.
    pub(super) normal: DVec3,
    /// Length of the shortest undeformed edge, in the mesh's unit.
    pub(super) size: f64,
    /// Other ends of the edges between layers, in ascending order.
    pub(super) next: Vec<u32>,
    /// Whether all other edges are longer by more than [`NEXT`].
    pub(super) is_thin: bool,
}

impl Layers<'_> {
    /// The tets and corner tets at a vertex.
    pub(super) fn simplices_at(&self, vertex: u32) -> impl Iterator<Item = usize> {
        self.topology.vertex_tets.row(vertex as usize).iter().map(|&entry| entry as usize / 4)
    }

    /// Other ends of the edges of cells at a vertex, in ascending order.
    fn neighbours(&self, vertex: u32) -> BTreeSet<u32> {
        let ends = |simplex: usize| {
            let tet = self.topology.tets[simplex];
            // Those edges of a corner tet that are edges of its cell begin at its first vertex.
            let is_whole = !self.merit.is_corner(simplex) || tet[0] == vertex;
            tet.into_iter().filter(move |&other| other != vertex && (is_whole || other == tet[0]))
        };
        self.simplices_at(vertex).flat_map(ends).collect()
    }

    /// The edges between layers at a vertex. `None` at a vertex without edges.
    ///
    /// - `at` `[n_vertices]`: positions that tell the directions, in the mesh's unit
    pub(super) fn at(&self, vertex: u32, at: &[DVec3]) -> Option<Between> {
        let neighbours = self.neighbours(vertex);
        let undeformed = |other: u32| self.original[other as usize] - self.original[vertex as usize];
        // Of edges of one length their directions decide, not the numbers of their vertices.
        let key = |&other: &u32| (undeformed(other).length(), undeformed(other).to_array());
        let shortest = neighbours.iter().min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal))?;
        let size = undeformed(*shortest).length();
        let way = |other: u32| (at[other as usize] - at[vertex as usize]).normalize_or_zero();
        let normal = way(*shortest);
        let is_short = |&other: &u32| undeformed(other).length() <= NEXT * size;
        let is_along = |&other: &u32| way(other).dot(normal).abs() >= ALONG;
        let next = neighbours.iter().copied().filter(|other| is_short(other) && is_along(other)).collect();
        let is_thin = neighbours.iter().all(|other| !is_short(other) || is_along(other));
        Some(Between { normal, size, next, is_thin })
    }

    /// The largest change of an edge between thin layers by a motion of some vertices, as a share
    /// of its length.
    ///
    /// - `from`, `to` `[n_vertices]`: positions, in the mesh's unit
    pub(super) fn largest_change(&self, vertices: &[u32], from: &[DVec3], to: &[DVec3]) -> f64 {
        let of_vertex = |&vertex: &u32| {
            let between = self.at(vertex, from).filter(|between| between.is_thin);
            let next = between.map_or(Vec::new(), |between| between.next);
            next.into_iter().map(|other| change(vertex, other, from, to)).fold(0.0, f64::max)
        };
        vertices.par_iter().map(of_vertex).reduce(|| 0.0, f64::max)
    }
}

/// Change of an edge by a motion, as a share of its length.
pub(super) fn change(vertex: u32, other: u32, from: &[DVec3], to: &[DVec3]) -> f64 {
    let length = |at: &[DVec3]| at[vertex as usize].distance(at[other as usize]);
    (length(to) - length(from)).abs() / length(from)
}

/// A constraint that keeps to a plane too.
pub(super) fn across(constraint: Constraint, normal: DVec3) -> Constraint {
    match constraint {
        Constraint::Free => Constraint::InPlane(normal),
        Constraint::InPlane(other) => {
            let line = other.cross(normal);
            // The two planes are alike, and their line is not known.
            if line.length() < 1e-3 { Constraint::Held } else { Constraint::OnLine(line.normalize()) }
        }
        Constraint::OnLine(_) | Constraint::Held => Constraint::Held,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vertex in a plane that keeps to another plane too has their line; on a line it has
    /// nothing. Two planes that are one have no line.
    #[test]
    fn planes_have_a_line() {
        assert_eq!(across(Constraint::Free, DVec3::Z), Constraint::InPlane(DVec3::Z));
        assert_eq!(across(Constraint::InPlane(DVec3::Y), DVec3::Z), Constraint::OnLine(DVec3::X));
        assert_eq!(across(Constraint::InPlane(DVec3::Z), DVec3::Z), Constraint::Held);
        assert_eq!(across(Constraint::OnLine(DVec3::X), DVec3::Z), Constraint::Held);
    }
}
