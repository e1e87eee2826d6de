//! Flat corners: raises single corners of the cells of hybrid meshes that springs have sheared, and
//! keeps the thickness of layers.
//!
//! Where a wing moves along a fuselage, springs shear the outermost prisms over the junction. Few
//! corners are concerned, and they are far from inverted. To optimise their cells as a whole would
//! change the thickness of layers ([`super::merit`]). So each flat corner asks for the least motion
//! of its four vertices that raises its scaled Jacobian to the limit, to first order. Motions count
//! as shares of a vertex's shortest edge, so outer vertices move more than inner ones. A vertex
//! takes the mean of what its corners ask for, perpendicular to its shortest edge, which in a layer
//! is the edge to the next layer. An outermost vertex turns about the vertex below it. This is
//! repeated until no corner is flat. The result depends neither on the numbers of the vertices nor
//! on the device.
//!
//! First the corners of pyramids, prisms and hexahedra are raised, then the tets between them. Each
//! of the four corners of a tet counts, because the order of its vertices is arbitrary.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use super::layers::{Between, across, change};
use super::merit::{Merit, flattest_corner};
use super::{Smoother, moved};
use crate::constraint::Constraint;
use crate::geometry::corners;
use crate::quality::{beta, determinant, edges_of_corner, faults::is_inverted, scaled_jacobian};

/// A corner of a pyramid, prism or hexahedron is flat if its scaled Jacobian is below the first
/// share of the worst of its kind in the undeformed mesh. It is raised to the second.
const OF_CORNERS: [f64; 2] = [0.6, 0.61];

/// A tet is flat if its scaled Jacobian is below the first share of the tet's own in the undeformed
/// mesh. It is raised to the second.
const OF_TETS: [f64; 2] = [0.9, 0.91];

/// Tets are flat only near the worst of the undeformed mesh: more than this multiple of the worst
/// scaled Jacobian is not asked for.
const NEAR_WORST: f64 = 1.25;

/// Most repetitions. A prism over a junction takes 2.
const MOST_SWEEPS: usize = 30;

/// Farthest motion of a vertex, as a share of its shortest undeformed edge. Farther the vertices
/// beside it have to give way too.
const FARTHEST: f64 = 0.5;

/// Most change of an edge between layers, as a share of its length.
const THICKNESS: f64 = 0.005;

/// A tet, and a corner that is no better than its kind's worst, keeps this share of its measure
/// beside a raised corner.
const BESIDE: f64 = 0.9;

/// What [`Smoother::raise_flat_corners`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Raised {
    /// Repetitions; none if no vertex moved.
    pub sweeps: usize,
    /// Number of vertices that moved.
    pub moved: usize,
    /// As [`super::Smoothed::layers_changed`].
    pub layers_changed: f64,
}

/// The cells which are raised.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cells {
    Others,
    Tets,
}

impl Cells {
    /// The share below which a corner is flat, and the share to which it is raised.
    fn shares(self) -> [f64; 2] {
        match self {
            Self::Others => OF_CORNERS,
            Self::Tets => OF_TETS,
        }
    }
}

/// Tells flat tets and flat corners of one mesh.
#[derive(Clone, Copy)]
struct Flatness<'a> {
    cells: Cells,
    merit: &'a Merit,
    tets: &'a [[u32; 4]],
    /// Vertices of the undeformed mesh `[n_vertices]`.
    original: &'a [DVec3],
}

impl Flatness<'_> {
    /// The tets or corner tets that are flat, in ascending order.
    fn all(self, at: &[DVec3], betas: &[f64]) -> Vec<usize> {
        let may_be = |simplex: usize| match self.cells {
            Cells::Others => self.merit.may_be_below(betas[simplex], OF_CORNERS[0]),
            Cells::Tets => true,
        };
        let is_flat = |&simplex: &usize| may_be(simplex) && self.is(simplex, at);
        (0..betas.len()).into_par_iter().filter(is_flat).collect()
    }

    /// Whether one tet or corner tet is flat. None is if it belongs to the other cells.
    fn is(self, simplex: usize, at: &[DVec3]) -> bool {
        let is_concerned = self.merit.is_corner(simplex) == (self.cells == Cells::Others);
        is_concerned && self.share(simplex, at) < self.cells.shares()[0]
    }

    /// The scaled Jacobian by which a tet or a corner tet is judged in the undeformed mesh.
    fn reference(self, simplex: usize) -> f64 {
        let worst = self.merit.worst_jacobian(simplex);
        if self.merit.is_corner(simplex) {
            return worst;
        }
        let (own, _) = flattest_corner(corners(self.original, self.tets[simplex]));
        own.min(NEAR_WORST * worst)
    }

    /// Scaled Jacobian of a tet or a corner tet over its [`Self::reference`].
    fn share(self, simplex: usize, at: &[DVec3]) -> f64 {
        let tet = corners(at, self.tets[simplex]);
        let jacobian = if self.merit.is_corner(simplex) { scaled_jacobian(tet) } else { flattest_corner(tet).0 };
        jacobian / self.reference(simplex)
    }
}

/// How a vertex moves.
struct Freedom {
    constraint: Constraint,
    /// Length of the vertex's shortest undeformed edge, in the mesh's unit.
    size: f64,
    /// Other ends of the edges between layers.
    next: Vec<u32>,
}

/// The vertices that move, in ascending order.
type Moving = BTreeMap<u32, Freedom>;

impl Smoother {
    /// Raises flat corners of pyramids, prisms and hexahedra, if no cell is inverted and at most
    /// `most` corners are flat, then flat tets likewise. Vertices of surfaces do not slide.
    ///
    /// A vertex returns to its place if a tet or a corner beside it became bad, or if an edge
    /// between layers changed by more than 0.5 %. So some corners may stay flat. If the motion
    /// helps no corner, and in a mesh of tets, all positions keep their bits.
    ///
    /// - `positions` `[n_vertices]`: in the mesh's unit
    /// - `betas` `[n_tets]`: betas of the positions, or their merit (see [`super::Merit`]), updated
    pub fn raise_flat_corners(&self, positions: &mut [DVec3], betas: &mut [f64], most: usize) -> Raised {
        if self.merit.is_of_tets() {
            return Raised::default();
        }
        let of_others = self.raise_flat(Cells::Others, positions, betas, most);
        let of_tets = self.raise_flat(Cells::Tets, positions, betas, most);
        Raised {
            sweeps: of_others.sweeps + of_tets.sweeps,
            moved: of_others.moved + of_tets.moved,
            layers_changed: of_others.layers_changed.max(of_tets.layers_changed),
        }
    }

    fn raise_flat(&self, cells: Cells, positions: &mut [DVec3], betas: &mut [f64], most: usize) -> Raised {
        let flatness = Flatness { cells, merit: &self.merit, tets: &self.topology.tets, original: &self.original };
        let flat = flatness.all(positions, betas);
        if flat.is_empty() || flat.len() > most || betas.iter().any(|&beta| is_inverted(beta)) {
            return Raised::default();
        }
        let vertices = flat.iter().flat_map(|&corner| self.topology.tets[corner]);
        let mut moving: Moving =
            vertices.filter_map(|vertex| Some((vertex, self.freedom(vertex, positions)?))).collect();
        let layers = self.layers();
        let around: BTreeSet<usize> = moving.keys().flat_map(|&vertex| layers.simplices_at(vertex)).collect();
        let mut at = positions.to_vec();
        let mut sweeps = 0;
        loop {
            while sweeps < MOST_SWEEPS && self.raise(flatness, &moving, &around, positions, &mut at) {
                sweeps += 1;
            }
            let harmful = self.harmful(flatness, &moving, &around, positions, &at);
            if harmful.is_empty() {
                break;
            }
            // The others may raise the corner without them.
            for vertex in harmful {
                at[vertex as usize] = positions[vertex as usize];
                moving.remove(&vertex);
            }
        }
        let moved: Vec<u32> =
            moving.keys().copied().filter(|&vertex| at[vertex as usize] != positions[vertex as usize]).collect();
        // Of the corners that stay flat none is flatter than before: see `harmful`.
        let concerned = around.iter().chain(flat.iter().filter(|simplex| !around.contains(simplex)));
        let n_flat = concerned.filter(|&&simplex| flatness.is(simplex, &at)).count();
        let worst =
            |at: &[DVec3]| flat.iter().map(|&simplex| flatness.share(simplex, at)).fold(f64::INFINITY, f64::min);
        if n_flat >= flat.len() && worst(&at) <= worst(positions) {
            return Raised::default();
        }
        let layers_changed = layers.largest_change(&moved, positions, &at);
        positions.copy_from_slice(&at);
        for simplex in around {
            betas[simplex] = self.merit.of(simplex, self.topology.tets[simplex], positions);
        }
        Raised { sweeps, moved: moved.len(), layers_changed }
    }

    /// How a vertex may move. `None` if it may not.
    fn freedom(&self, vertex: u32, at: &[DVec3]) -> Option<Freedom> {
        let Between { normal, size, next, .. } = self.layers().at(vertex, at)?;
        let constraint = across(self.constraint[vertex as usize], normal);
        (constraint != Constraint::Held).then_some(Freedom { constraint, size, next })
    }

    /// Moves the vertices once. Returns whether a corner was flat and can be raised.
    fn raise(
        &self,
        flatness: Flatness,
        moving: &Moving,
        around: &BTreeSet<usize>,
        from: &[DVec3],
        at: &mut [DVec3],
    ) -> bool {
        let mut wanted: BTreeMap<u32, (DVec3, f64)> = BTreeMap::new();
        for &simplex in around {
            if !flatness.is(simplex, at) {
                continue;
            }
            let mut tet = self.topology.tets[simplex];
            if flatness.cells == Cells::Tets {
                tet = flattest_corner(corners(at, tet)).1.map(|vertex| tet[vertex]);
            }
            let limited = |(vertex, gradient)| Some((vertex, moving.get(&vertex)?.constraint.limit(gradient)));
            let gradients: Vec<(u32, DVec3)> =
                tet.into_iter().zip(jacobian_gradient(corners(at, tet))).filter_map(limited).collect();
            let size = |vertex: u32| moving[&vertex].size.powi(2);
            let squares: f64 = gradients.iter().map(|(vertex, by)| size(*vertex) * by.length_squared()).sum();
            let step =
                (flatness.cells.shares()[1] - flatness.share(simplex, at)) * flatness.reference(simplex) / squares;
            for (vertex, gradient) in gradients.into_iter().filter(|_| step.is_finite()) {
                let (sum, count) = wanted.entry(vertex).or_default();
                *sum += step * size(vertex) * gradient;
                *count += 1.0;
            }
        }
        let place = |(&vertex, (sum, count)): (&u32, &(DVec3, f64))| {
            let (start, freedom) = (from[vertex as usize], &moving[&vertex]);
            let by = at[vertex as usize] - start + *sum / *count;
            let mut place = moved(start, by.clamp_length_max(FARTHEST * freedom.size));
            // Outermost vertices turn about the vertices below them, which keeps the edge's length.
            if let [below] = *freedom.next {
                let (now, length) = (place - at[below as usize], start.distance(from[below as usize]));
                let back = (length / now.length() - 1.0) * now;
                place = moved(place, self.constraint[vertex as usize].limit(back));
            }
            (vertex, place)
        };
        let places: Vec<(u32, DVec3)> = wanted.iter().map(place).collect();
        places.into_iter().for_each(|(vertex, place)| at[vertex as usize] = place);
        !wanted.is_empty()
    }

    /// The moving vertices whose motion does harm.
    fn harmful(
        &self,
        flatness: Flatness,
        moving: &Moving,
        around: &BTreeSet<usize>,
        from: &[DVec3],
        at: &[DVec3],
    ) -> BTreeSet<u32> {
        let is_harmed = |&&simplex: &&usize| {
            let tet = self.topology.tets[simplex];
            let (before, after) = (flatness.share(simplex, from), flatness.share(simplex, at));
            let is_good = if self.merit.is_corner(simplex) {
                after >= (BESIDE * before.min(1.0)).max(before.min(OF_CORNERS[0]))
            } else {
                after >= before.min(OF_TETS[0]) && beta(corners(at, tet)) >= BESIDE * beta(corners(from, tet))
            };
            !is_good
        };
        let harmed = around.iter().filter(is_harmed);
        let mut harmful: BTreeSet<u32> = harmed.flat_map(|&simplex| self.topology.tets[simplex]).collect();
        for (&vertex, freedom) in moving {
            for &other in &freedom.next {
                if change(vertex, other, from, at) > THICKNESS {
                    harmful.extend([vertex, other]);
                }
            }
        }
        harmful.retain(|vertex| moving.contains_key(vertex));
        harmful
    }
}

/// Derivative of the scaled Jacobian of a corner tet with respect to its vertices, in one over the
/// mesh's unit. With edges u, v, w it is `D = u x v . w` over their lengths, so its derivative
/// with respect to u is `v x w` over the lengths less `J u / |u|^2`.
fn jacobian_gradient(tet: [DVec3; 4]) -> [DVec3; 4] {
    let [u, v, w] = edges_of_corner(tet);
    let lengths = u.length() * v.length() * w.length();
    let jacobian = determinant([u, v, w]) / lengths;
    let of = |edge: DVec3, area: DVec3| area / lengths - jacobian * edge / edge.length_squared();
    let [u, v, w] = [of(u, v.cross(w)), of(v, w.cross(u)), of(w, u.cross(v))];
    [-(u + v + w), u, v, w]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative agrees with differences over a short way, for each vertex and axis.
    #[test]
    fn the_gradient_is_that_of_the_scaled_jacobian() {
        let tet = [[0.1, 0.2, 0.0], [1.3, 0.1, 0.2], [0.4, 0.9, -0.1], [0.3, 0.3, 0.05]].map(DVec3::from_array);
        let gradient = jacobian_gradient(tet);
        for vertex in 0..4 {
            for axis in DVec3::AXES {
                let at = |by: f64| {
                    let mut tet = tet;
                    tet[vertex] += by * axis;
                    scaled_jacobian(tet)
                };
                let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                let exact = gradient[vertex].dot(axis);
                assert!((difference - exact).abs() < 1e-7, "{vertex} {axis}: {difference} {exact}");
            }
        }
    }
}
