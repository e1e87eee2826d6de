//! Stage wingtip (paper 3.3): longitudinal springs along the edges and a conservative spring on
//! every inner vertex.
//!
//! The paper gives a stiffness coefficient `c` in `[0, 1]`, "the greater, the more deformable", and
//! no formula. Literally (`u_i = c` times the neighbours' mean) the boundary's motion would die
//! away over so many *rings of triangles*: on a fine mesh with `c = 0.5` the first ring takes most
//! of it and folds. Here it dies away over a length, `w sqrt(c / (1 - c))` with `w` the tip's mean
//! width (twice its area over its perimeter): at 1 the conservative springs are gone, at 0 the
//! inside does not leave its start, and the mesh does not matter.
//!
//! The paper's start is where the vertex was: a wing that is bent up would be pulled back down at
//! its tip. Here the start is carried along by the best affine (or rigid) motion of the tip's
//! boundary, and all springs, the longitudinal ones too, act on what the boundary does beyond that
//! motion: a tip that is only turned or stretched keeps its triangles' shapes at every coefficient.
//! The paper's own form can be chosen ([`TipStart`]).
//!
//! A tip may be several families. Those that touch are one tip: one network without a seam, and one
//! best motion, so that a family that borders on no wing follows its neighbours. Each keeps its own
//! length; on a curve they share the shorter counts.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::surface_network::SurfaceNetwork;
use crate::families::Families;
use crate::families::PlacedBy;
use crate::families::Role;
use crate::families::SetupError;
use crate::families::TipStart;
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::Displacement;
use crate::stage::{SetUp, Stage, StageError};
use crate::{
    constraint::Constraint,
    geometry::triangle_normal,
    mesh::{
        FamilyId, TetMesh,
        edges::triangle_edges,
        half_edge::{Surface, next},
    },
    relaxation::Convergence,
};

/// All wingtips of a mesh.
pub struct Wingtips {
    tips: Vec<Wingtip>,
}

/// Wingtip families that hang together.
struct Wingtip {
    families: Vec<FamilyId>,
    start: TipStart,
    /// Vertices earlier stages have placed, each with half the length of the boundary's edges
    /// there: where the boundary is finer it counts no more.
    placed: Vec<(u32, f64)>,
    inside: Vec<u32>,
    network: SurfaceNetwork,
}

impl Wingtips {
    /// Sets the networks up.
    ///
    /// # Errors
    /// Families that touch differ in their start, or the backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, SetupError> {
        let tips = joined(set_up.surface, set_up.families).into_iter().map(|tip| Wingtip::new(set_up, &tip));
        Ok(Self { tips: tips.collect::<Result<_, SetupError>>()? })
    }

    /// The sets of families that touch nothing an earlier stage places.
    pub fn loose(&self) -> impl Iterator<Item = &[FamilyId]> {
        self.tips.iter().filter(|tip| tip.placed.is_empty()).map(|tip| &tip.families[..])
    }
}

impl Stage for Wingtips {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut convergence = Convergence::nothing_to_do();
        for tip in &mut self.tips {
            // A tip that nothing holds stays where it is.
            if tip.placed.iter().all(|&(vertex, _)| displacement[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            let pair = |&(vertex, weight): &(u32, f64)| {
                let from = mesh.vertices[vertex as usize];
                (from, from + displacement[vertex as usize], weight)
            };
            let pairs: Vec<(DVec3, DVec3, f64)> = tip.placed.iter().map(pair).collect();
            let start = match tip.start {
                TipStart::Affine => FittedMotion::affine(&pairs),
                TipStart::Rigid => FittedMotion::rigid(&pairs),
                TipStart::Original => FittedMotion::identity(),
            };
            // Relative to that start the conservative springs pull to zero.
            let carried = |vertex: u32| start.displacement(mesh.vertices[vertex as usize]);
            for &(vertex, _) in &tip.placed {
                displacement[vertex as usize] -= carried(vertex);
            }
            convergence = convergence.and(tip.network.relax(displacement, stopping)?);
            for (&(from, to, _), &(vertex, _)) in pairs.iter().zip(&tip.placed) {
                displacement[vertex as usize] = to - from;
            }
            for &vertex in &tip.inside {
                let at = mesh.vertices[vertex as usize];
                let moved = at + displacement[vertex as usize] + carried(vertex);
                displacement[vertex as usize] = families.settle(vertex, moved) - at;
            }
        }
        Ok(convergence)
    }
}

impl Wingtip {
    fn new(set_up: &SetUp, tip: &[FamilyId]) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let of = |family: FamilyId| match families.roles[family.index()] {
            Role::Wingtip { coefficient, start } => (coefficient, start),
            _ => unreachable!("only wingtips are placed by the wingtip stage"),
        };
        let start = of(tip[0]).1;
        if let Some(&other) = tip.iter().find(|&&family| of(family).1 != start) {
            let name = |family: FamilyId| mesh.families[family.index()].clone();
            return Err(SetupError::TipStarts { family: name(tip[0]), other: name(other) });
        }
        // A coefficient of 0 would take infinitely stiff springs: such a vertex is held at its
        // start instead.
        let mut reach: BTreeMap<u32, f64> = BTreeMap::new();
        for &family in tip {
            let coefficient = of(family).0;
            let own = if coefficient > 0.0 {
                mean_width(mesh, surface, family) * (coefficient / (1.0 - coefficient)).sqrt()
            } else {
                0.0
            };
            for &vertex in surface.vertices_of(family) {
                reach.entry(vertex).and_modify(|reach| *reach = reach.min(own)).or_insert(own);
            }
        }
        let is_inside = |vertex: u32| families.placed_by[vertex as usize] == PlacedBy::Wingtip;
        let (inside, placed): (Vec<u32>, Vec<u32>) = reach.keys().partition(|&&vertex| is_inside(vertex));
        let constraint = |vertex: u32| {
            let free = is_inside(vertex) && reach[&vertex] > 0.0;
            if free { families.plane_constraint(vertex) } else { Constraint::Held }
        };
        let edges = triangle_edges(tip.iter().flat_map(|&family| surface.corners_of(family)));
        let network =
            SurfaceNetwork::anchored(&mesh.vertices, &edges, constraint, |vertex| reach[&vertex], backend, method)?;
        let weights = boundary_lengths(mesh, surface, tip);
        // Where triangles touch in a vertex alone, no edge at it bounds them.
        let even = placed.iter().all(|vertex| !weights.contains_key(vertex));
        let weight = |vertex: u32| if even { 1.0 } else { weights.get(&vertex).copied().unwrap_or(0.0) };
        Ok(Self {
            families: tip.to_vec(),
            start,
            placed: placed.iter().map(|&vertex| (vertex, weight(vertex))).collect(),
            inside,
            network,
        })
    }
}

/// The wingtip families in sets that hang together, each ascending.
fn joined(surface: &Surface, families: &Families) -> Vec<Vec<FamilyId>> {
    let mut tips: Vec<(Vec<FamilyId>, BTreeSet<u32>)> = Vec::new();
    for family in families.families_of(PlacedBy::Wingtip) {
        let mut tip = (vec![family], surface.vertices_of(family).iter().copied().collect::<BTreeSet<u32>>());
        tips.retain_mut(|(others, vertices)| {
            let apart = vertices.is_disjoint(&tip.1);
            if !apart {
                tip.0.append(others);
                tip.1.append(vertices);
            }
            apart
        });
        tip.0.sort_unstable();
        tips.push(tip);
    }
    tips.into_iter().map(|(tip, _)| tip).collect()
}

/// Half the length of the edges that bound some families together, at each of their ends.
fn boundary_lengths(mesh: &TetMesh, surface: &Surface, tip: &[FamilyId]) -> BTreeMap<u32, f64> {
    let mut lengths = BTreeMap::new();
    let loops = tip.iter().flat_map(|&family| surface.boundary_loops(family)).flatten();
    for half_edge in loops.filter(|&half_edge| !tip.contains(&surface.family_behind(half_edge))) {
        let ends = [surface.origin(half_edge), surface.origin(next(half_edge))];
        let [a, b] = ends.map(|vertex| mesh.vertices[vertex as usize]);
        ends.iter().for_each(|&end| *lengths.entry(end).or_default() += 0.5 * a.distance(b));
    }
    lengths
}

/// Twice a family's area over the length of its boundary: the width of a strip.
fn mean_width(mesh: &TetMesh, surface: &Surface, family: FamilyId) -> f64 {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let area: f64 = surface.corners_of(family).map(|corners| 0.5 * triangle_normal(corners.map(at)).length()).sum();
    let perimeter: f64 = surface
        .boundary_loops(family)
        .iter()
        .flatten()
        .map(|&half_edge| at(surface.origin(half_edge)).distance(at(surface.origin(next(half_edge)))))
        .sum();
    2.0 * area / perimeter
}
