//! The vertices that a round of local optimisation moves.

use super::neighbourhood::Topology;
use super::state::State;
use super::{Method, Round, Smoother};
use crate::constraint::Constraint;
use crate::quality::faults::is_inverted;

impl Smoother {
    /// Whether each vertex belongs to a bad tet `[n_vertices]`.
    ///
    /// - `is_bad`: of a tet's number and merit
    fn vertices_of(&self, state: &State, is_bad: impl Fn(usize, f64) -> bool) -> Vec<bool> {
        let mut found = vec![false; self.constraint.len()];
        let tets = self.topology.tets.iter().zip(&state.beta).enumerate();
        let bad = tets.filter(|&(tet, (_, &beta))| is_bad(tet, beta));
        bad.for_each(|(_, (tet, _))| tet.iter().for_each(|&vertex| found[vertex as usize] = true));
        found
    }

    /// Adds the vertices of one more ring of tets.
    fn add_ring(&self, found: &mut [bool]) {
        let Topology { tets, vertex_tets, .. } = &self.topology;
        let inner: Vec<usize> = (0..found.len()).filter(|&vertex| found[vertex]).collect();
        for &entry in inner.iter().flat_map(|&vertex| vertex_tets.row(vertex)) {
            tets[entry as usize / 4].iter().for_each(|&vertex| found[vertex as usize] = true);
        }
    }

    /// The vertices that a round moves: vertices of tets below the goal that may move. The first
    /// method takes the vertices of one more ring of tets.
    ///
    /// Vertices of other cells move only if a corner or a tet of theirs is inverted, or if a corner
    /// is below the goal, and no further ring of them. A tet that is merely bad must not deform a
    /// layer.
    pub(super) fn active(&self, state: &State, round: &Round) -> Vec<u32> {
        let is_bad = |beta: f64| is_inverted(beta) || beta < round.goal;
        let mut active = self.vertices_of(state, |_, beta| is_bad(beta));
        let mut others = Vec::new();
        if round.method == Method::MeanRatio {
            self.add_ring(&mut active);
            if !self.merit.is_of_tets() {
                let is_grave =
                    |simplex: usize, beta: f64| is_inverted(beta) || self.merit.is_corner(simplex) && is_bad(beta);
                others = self.vertices_of(state, is_grave);
            }
        }
        let moves = |&vertex: &u32| {
            let vertex = vertex as usize;
            active[vertex]
                && (!self.is_of_other_cells(vertex as u32) || others.get(vertex) == Some(&true))
                && (self.constraint[vertex] != Constraint::Held
                    || (self.slides[vertex] && round.freedom.slide.is_some()))
        };
        (0..active.len() as u32).filter(moves).collect()
    }
}
