//! Stage wingtip (paper 3.3): the tip's inside moves by longitudinal springs along the edges and a
//! conservative spring at every inner vertex.
//!
//! # The coefficient
//!
//! The paper gives a stiffness coefficient `c` in `[0, 1]`, "the greater, the more deformable", and
//! no formula. Read literally, a displacement is `c` times the mean of the neighbours'
//! displacements. The motion of the boundary would then die away over a number of *rings of
//! triangles*. On a fine mesh with `c = 0.5` the first ring would take most of the motion and fold.
//! Here the motion dies away over a length that does not depend on the mesh:
//!
//! `reach = w sqrt(c / (1 - c))`, with `w` the tip's mean width, twice its area over its perimeter
//!
//! With `c = 1` there are no conservative springs. With `c = 0` the inside keeps its start.
//!
//! # The start
//!
//! The paper's conservative springs pull a vertex to its original position. Such springs would pull
//! the tip of a wing that is bent up back down. Here the best affine (or rigid) motion of the tip's
//! boundary is subtracted first. All springs, the longitudinal ones too, act on the remaining
//! displacement, and the subtracted motion is added in the end. So a tip that is only turned or
//! stretched keeps the shapes of its triangles with every coefficient. [`TipStart`] selects the
//! motion, or the paper's own form.
//!
//! # Several families
//!
//! Wingtip families that touch are one tip, with one network and one best motion. So a family that
//! borders on no wing follows its neighbours. Each family keeps its own reach. Vertices on several
//! families have the smallest reach.

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
        half_edge::{Surface, next},
    },
    relaxation::Convergence,
};

/// All wingtips of a mesh.
pub struct Wingtips {
    tips: Vec<Wingtip>,
}

/// Wingtip families that touch.
struct Wingtip {
    families: Vec<FamilyId>,
    start: TipStart,
    /// Vertices that earlier stages place. The weight of each in the best motion is half the length
    /// of the boundary's edges at the vertex, so that a finer part of the boundary does not count
    /// more.
    placed: Vec<(u32, f64)>,
    inside: Vec<u32>,
    network: SurfaceNetwork,
}

impl Wingtips {
    /// Sets up one network for each tip.
    ///
    /// # Errors
    /// - [`SetupError::TipStarts`]: families of one tip have different starts
    /// - [`SetupError::Backend`]: the backend failed
    pub fn new(set_up: &SetUp) -> Result<Self, SetupError> {
        let tips = joined(set_up.surface, set_up.families).into_iter().map(|tip| Wingtip::new(set_up, &tip));
        Ok(Self { tips: tips.collect::<Result<_, SetupError>>()? })
    }

    /// The families of each tip that has no vertex of an earlier stage.
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
            // A tip stays where it is if its boundary does not move, or if it has no vertex of an
            // earlier stage.
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
            // The conservative springs pull to displacement zero, so the best motion is subtracted.
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
        // A coefficient of 0 would need infinitely stiff springs. Such vertices are held at their
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
        let edges = surface.edges_of(tip.iter().flat_map(|&family| surface.triangles_of(family)));
        let network =
            SurfaceNetwork::anchored(&mesh.vertices, &edges, constraint, |vertex| reach[&vertex], backend, method)?;
        let weights = boundary_lengths(mesh, surface, tip);
        // If a tip touches the wing only in single vertices, no boundary edge gives these vertices
        // a weight.
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

/// The wingtip families in sets of families that touch, each set ascending.
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

/// For each vertex of the boundary of a tip, half the length of the boundary edges at the vertex,
/// in the mesh's unit.
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

/// Mean width of a family in the mesh's unit: twice its area over the length of its boundary. For a
/// long strip this is the strip's width.
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
