//! [`Strip`]: makes the networks that spread displacements of a line of vertices over the strip of
//! a wing beside the line. The line is a junction with the fuselage, or a curve that the wing
//! shares with another wing.
//!
//! A strip ends before the first section, so that the wing keeps its profiles.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::surface_network::SurfaceNetwork;
use crate::families::PlacedBy;
use crate::geometry::diagonal;
use crate::stage::SetUp;
use crate::{backend::BackendError, constraint::Constraint, mesh::FamilyId, profile::ProfileInterpolation};

/// Width of a strip, as a fraction of the chord.
const WIDTH: f64 = 0.25;

/// A wing on which strips are set up.
pub(super) struct Strip<'a> {
    pub set_up: &'a SetUp<'a>,
    pub families: &'a [FamilyId],
    /// The mesh's vertices `[n_vertices of the wing]`, ascending.
    pub vertices: &'a [u32],
    /// Positions `[n_vertices of the wing]`, in the mesh's unit, mirrored to the sections' side.
    pub positions: &'a [DVec3],
    pub interpolation: &'a ProfileInterpolation,
}

/// A connected piece of a line.
pub(super) struct Piece {
    /// Places of its vertices in [`Strip::vertices`].
    pub places: Vec<usize>,
    /// Places of the vertices that edges join to it.
    pub next: Vec<usize>,
}

impl Strip<'_> {
    /// Sets up the network that spreads the slides of a junction. `None` without a junction.
    ///
    /// - `junction`: places of its vertices
    /// - `is_held`: whether the vertex at a place never moves with a strip
    ///
    /// # Errors
    /// The backend failed.
    pub fn beside_junction(
        &self,
        junction: &[usize],
        is_held: impl Fn(usize) -> bool,
    ) -> Result<Option<SurfaceNetwork>, BackendError> {
        self.beside(junction, is_held, |piece| {
            (self.chord(piece), mean(piece.places.iter().map(|&place| self.positions[place])))
        })
    }

    /// The longest chord of the wing at a junction, in the mesh's unit. Of a junction of single
    /// vertices the diagonal of the wing's box, because such a junction has no length.
    ///
    /// - `junction`: places of its vertices
    pub fn longest_chord(&self, junction: &[usize]) -> f64 {
        if junction.is_empty() {
            return 0.0;
        }
        let pieces = self.pieces(junction, &self.edges());
        match pieces.iter().map(|piece| self.chord(piece)).fold(0.0, f64::max) {
            0.0 => diagonal((0..self.vertices.len()).map(|place| self.original(place))),
            chord => chord,
        }
    }

    /// About the chord at a piece of a junction, in the mesh's unit: its farthest vertices are the
    /// edges of the section.
    fn chord(&self, piece: &Piece) -> f64 {
        let points = || piece.places.iter().map(|&place| self.original(place));
        let centre = mean(points());
        2.0 * points().map(|point| point.distance(centre)).fold(0.0, f64::max)
    }

    /// Sets up the network that spreads displacements of the vertices of `line`. `None` if there
    /// are none.
    ///
    /// - `line`: places of its vertices
    /// - `is_held`: whether the vertex at a place never moves with a strip
    /// - `of_piece`: the chord at a piece of the line, in the mesh's unit, and a point from which
    ///   the strip reaches to the first section
    ///
    /// # Errors
    /// The backend failed.
    pub fn beside(
        &self,
        line: &[usize],
        is_held: impl Fn(usize) -> bool,
        of_piece: impl Fn(&Piece) -> (f64, DVec3),
    ) -> Result<Option<SurfaceNetwork>, BackendError> {
        let SetUp { mesh, families, backend, method, .. } = *self.set_up;
        if line.is_empty() {
            return Ok(None);
        }
        let edges = self.edges();
        let mut free = vec![false; self.vertices.len()];
        for piece in self.pieces(line, &edges) {
            let (chord, from) = of_piece(&piece);
            let width = WIDTH * chord;
            let points: Vec<DVec3> = piece.places.iter().map(|&place| self.original(place)).collect();
            let of_sections = self.interpolation.sections_and_beyond(from);
            // On a coarse wing the strip may be narrower than an edge. So at least the next row of
            // vertices belongs to the strip.
            let next: HashSet<usize> = piece.next.iter().copied().collect();
            for place in 0..self.vertices.len() {
                let at = self.original(place);
                let near = || points.iter().any(|point| point.distance_squared(at) < width * width);
                free[place] |= !of_sections[place] && (next.contains(&place) || near());
            }
        }
        line.iter().for_each(|&place| free[place] = false);
        let constraint = |vertex: u32| {
            let is_free = |place: usize| free[place] && !is_held(place);
            let free = families.placed_by[vertex as usize] == PlacedBy::Wing
                && self.vertices.binary_search(&vertex).is_ok_and(is_free);
            if free { Constraint::Free } else { Constraint::Held }
        };
        SurfaceNetwork::new(&mesh.vertices, &edges, constraint, backend, method).map(Some)
    }

    /// The edges of the wing.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let surface = self.set_up.surface;
        surface.edges_of(self.families.iter().flat_map(|&family| surface.triangles_of(family)))
    }

    /// Splits a line into pieces that edges of the wing connect.
    pub fn pieces(&self, line: &[usize], edges: &[[u32; 2]]) -> Vec<Piece> {
        let mut number: HashMap<u32, usize> = line.iter().map(|&place| (self.vertices[place], place)).collect();
        let on_line: HashSet<u32> = number.keys().copied().collect();
        let mut along: HashMap<u32, Vec<u32>> = HashMap::new();
        let mut beside: HashMap<u32, Vec<u32>> = HashMap::new();
        for &[a, b] in edges {
            for [a, b] in [[a, b], [b, a]] {
                match [a, b].map(|end| on_line.contains(&end)) {
                    [true, true] => along.entry(a).or_default().push(b),
                    [true, false] => beside.entry(a).or_default().push(b),
                    _ => {}
                }
            }
        }
        let mut pieces = Vec::new();
        for &start in line {
            let (mut places, mut next) = (Vec::new(), Vec::new());
            let mut open = vec![self.vertices[start]];
            while let Some(vertex) = open.pop() {
                if let Some(place) = number.remove(&vertex) {
                    places.push(place);
                    open.extend(along.get(&vertex).into_iter().flatten());
                    next.extend(beside.get(&vertex).into_iter().flatten().copied());
                }
            }
            if !places.is_empty() {
                next.sort_unstable();
                next.dedup();
                let place = |vertex: u32| self.vertices.binary_search(&vertex).ok();
                pieces.push(Piece { places, next: next.into_iter().filter_map(place).collect() });
            }
        }
        pieces
    }

    /// The position of a vertex in the mesh.
    fn original(&self, place: usize) -> DVec3 {
        self.set_up.mesh.vertices[self.vertices[place] as usize]
    }
}

/// A vertex of a part of a wing that no section's plane crosses, if the wing is several families
/// and falls into parts that share no vertex. Nothing says how such a part moves.
///
/// - `triangles`: of the wing, as places of vertices
pub(super) fn part_without_section(wing: &Strip, triangles: &[[u32; 3]]) -> Option<usize> {
    if wing.families.len() < 2 {
        return None;
    }
    let mut root: Vec<usize> = (0..wing.vertices.len()).collect();
    fn find(root: &mut [usize], mut at: usize) -> usize {
        while root[at] != at {
            root[at] = root[root[at]];
            at = root[at];
        }
        at
    }
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (one, other) = (find(&mut root, a as usize), find(&mut root, other as usize));
            root[one] = other;
        }
    }
    let crossed: HashSet<usize> =
        wing.interpolation.beside_sections().collect::<Vec<_>>().iter().map(|&place| find(&mut root, place)).collect();
    let parts: HashSet<usize> = (0..root.len()).map(|place| find(&mut root, place)).collect();
    if parts.len() < 2 {
        return None;
    }
    (0..root.len()).find(|&place| !crossed.contains(&find(&mut root, place)))
}

/// The mean of some points.
pub(super) fn mean(points: impl ExactSizeIterator<Item = DVec3>) -> DVec3 {
    let n = points.len().max(1) as f64;
    points.sum::<DVec3>() / n
}
