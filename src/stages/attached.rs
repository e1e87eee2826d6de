//! Stage attached (paper 3.3): the inside of wingtips and of attached families moves by
//! longitudinal springs along the edges and a conservative spring at every inner vertex.
//!
//! The paper moves wingtips so. Pylons, fairings and winglets without profiles are moved alike, but
//! their start is rigid, so that they keep their shape.
//!
//! # The coefficient
//!
//! The paper gives a stiffness coefficient `c` in `[0, 1]`, "the greater, the more deformable", and
//! no formula. Read literally, a displacement is `c` times the mean of the neighbours'
//! displacements. The motion of the boundary would then die away over a number of *rings of
//! triangles*. On a fine mesh with `c = 0.5` the first ring would take most of the motion and fold.
//! Here the motion dies away over a length that does not depend on the mesh:
//!
//! `reach = w sqrt(c / (1 - c))`, with `w` the family's mean width, twice its area over its
//! perimeter
//!
//! With `c = 1` there are no conservative springs. With `c = 0` the inside keeps its start.
//!
//! # The start
//!
//! The paper's conservative springs pull a vertex to its original position. Such springs would pull
//! the tip of a wing that is bent up back down. Here the best affine (or rigid) motion of the root
//! of the [`Assembly`] is subtracted first. All springs, the longitudinal ones too, act on the
//! remaining displacement, and the subtracted motion is added in the end. So a tip that is only
//! turned or stretched keeps the shapes of its triangles with every coefficient. [`TipStart`]
//! selects the motion, or the paper's own form.
//!
//! # Several families
//!
//! The wingtips and attached families of an assembly have one network and one start. So a family
//! that borders on no wing follows its neighbours. The network holds the root and the vertices of
//! rigid families. Each wingtip has its own width. The attached families of an assembly have the
//! width of them all, so that the narrow trailing edge of a winglet gives way as the winglet does.
//! Vertices on several families have the smallest reach.
//!
//! # Between two bodies
//!
//! A part whose junction slides (file `junction.rs`) and that ends on a body with a motion of its
//! own has no conservative springs. They would let each end give way within the reach. A nacelle
//! that is moved up would then close the acute corner at the pylon's rear edge, because the pylon
//! behind the corner stays. Without them the motion of the body spreads over the whole part, and
//! the corner goes with the body.
//!
//! If the part slides on the body, its end there goes along its own surface, which may shorten it
//! by a third. So it follows in steps ([`SurfaceNetwork::follow`]), without conservative springs.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::junction::{Junctions, MadeByJunctions};
use super::surface_network::SurfaceNetwork;
use crate::families::{Assembly, Families, Junction, PlacedBy, RigidMotion, Role, RootChange, SetupError, TipStart};
use crate::mesh::Displacement;
use crate::stage::{Kept, NoProduct, Products, SetUp, Stage, StageError};
use crate::volume::route::OnBody;
use crate::{
    backend::BackendError,
    constraint::Constraint,
    geometry::{fitted_motion::FittedMotion, triangle_normal},
    mesh::{
        FamilyId, TetMesh,
        half_edge::{Surface, next},
    },
    relaxation::{Convergence, Stopping},
};

/// The wingtips and attached families of a mesh.
pub struct AttachedFamilies {
    sets: Vec<Attached>,
    junctions: Junctions,
}

/// The wingtips and attached families of one assembly.
struct Attached {
    /// The number of the assembly.
    assembly: usize,
    families: Vec<FamilyId>,
    start: TipStart,
    /// Vertices of these families that earlier stages place.
    placed: Vec<u32>,
    inside: Vec<u32>,
    network: SurfaceNetwork,
    /// The edges, if the families slide on a body with a motion of its own.
    in_steps: Option<Vec<[u32; 2]>>,
}

impl AttachedFamilies {
    /// Sets up one network for each assembly.
    ///
    /// - `shaped`: vertices of wings that stay, because the sections of wings are checked at them
    ///
    /// # Errors
    /// - [`SetupError::TipStarts`]: families of one assembly have different starts
    /// - [`SetupError::Junction`]: a junction cannot slide
    /// - [`SetupError::Backend`]: the backend failed
    pub fn new(set_up: &SetUp, shaped: &[u32]) -> Result<Self, SetupError> {
        let sets = set_up.families.assemblies.iter().enumerate().filter_map(|(index, assembly)| {
            let is_attached =
                |family: &FamilyId| set_up.families.roles[family.index()].placed_by() == PlacedBy::Attached;
            let own: Vec<FamilyId> = assembly.families.iter().copied().filter(is_attached).collect();
            (!own.is_empty()).then(|| Attached::new(set_up, index, own))
        });
        Ok(Self { sets: sets.collect::<Result<_, SetupError>>()?, junctions: Junctions::new(set_up, shaped)? })
    }

    /// The largest distance by which the junction of each family slid in the last run, in the
    /// mesh's unit. Only families whose junctions slide are there.
    pub fn slides(&self) -> &BTreeMap<FamilyId, f64> {
        self.junctions.slides()
    }

    /// Exchanges what the junctions keep of their last design with what they kept of another one.
    pub fn exchange(&mut self, made: &mut MadeByJunctions) {
        self.junctions.exchange(made);
    }

    /// The vertices that may slide on rigid bodies. Empty if they were taken.
    pub fn take_on_bodies(&mut self) -> Vec<OnBody> {
        self.junctions.take_on_bodies()
    }

    /// Triangles that continue the attached families of an assembly beyond the curves that slide,
    /// in the mesh's unit; see [`Junctions::continuation`].
    pub fn continuation(&self, assembly: usize, mesh: &TetMesh, back: impl Fn(u32) -> DVec3) -> Vec<[DVec3; 3]> {
        self.junctions.continuation(assembly, mesh, back)
    }

    /// The families of each assembly that no vertex of an earlier stage moves.
    pub fn loose(&self) -> impl Iterator<Item = &[FamilyId]> {
        self.sets.iter().filter(|set| set.placed.is_empty()).map(|set| &set.families[..])
    }
}

impl Stage for AttachedFamilies {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        // The motions are those of the roots as the wings have them, before junctions slide.
        let rigid = |assembly: &Assembly| assembly.carried(mesh, displacement, TipStart::Rigid);
        let motions: Vec<FittedMotion> = families.assemblies.iter().map(rigid).collect();
        let starts: Vec<FittedMotion> = self
            .sets
            .iter()
            .map(|set| families.assemblies[set.assembly].carried(mesh, displacement, set.start))
            .collect();
        let mut convergence = self.junctions.slide(set_up, &motions, displacement)?;
        for (set, start) in self.sets.iter_mut().zip(starts) {
            // The families stay where they are if nothing that holds them moves, or if nothing
            // holds them.
            if set.placed.iter().all(|&vertex| displacement[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            convergence = convergence.and(match &set.in_steps {
                Some(edges) => set.follow(set_up, edges, &start, displacement)?,
                None => set.relax(&mesh.vertices, &start, displacement, stopping)?,
            });
            for &vertex in &set.inside {
                let at = mesh.vertices[vertex as usize];
                let moved = at + displacement[vertex as usize] + start.displacement(at);
                displacement[vertex as usize] = families.settle(vertex, moved) - at;
            }
        }
        Ok(convergence)
    }
}

impl Attached {
    fn new(set_up: &SetUp, assembly: usize, own: Vec<FamilyId>) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let of = |family: FamilyId| match families.roles[family.index()] {
            Role::Wingtip { coefficient, start } | Role::Attached { coefficient, start, .. } => (coefficient, start),
            _ => unreachable!("only wingtips and attached families are placed by this stage"),
        };
        let start = of(own[0]).1;
        if let Some(&other) = own.iter().find(|&&family| of(family).1 != start) {
            let name = |family: FamilyId| mesh.families[family.index()].clone();
            return Err(SetupError::TipStarts { family: name(own[0]), other: name(other) });
        }
        let bridges = bridges(families, &families.assemblies[assembly]);
        // A coefficient of 0 would need infinitely stiff springs. Such vertices are held at their
        // start instead.
        let mut reach: BTreeMap<u32, f64> = BTreeMap::new();
        let is_tip = |family: &FamilyId| matches!(families.roles[family.index()], Role::Wingtip { .. });
        let attached: Vec<FamilyId> = own.iter().copied().filter(|family| !is_tip(family)).collect();
        for family in &own {
            let coefficient = if bridges { 1.0 } else { of(*family).0 };
            let width = if coefficient > 0.0 {
                let of_width = if is_tip(family) { std::slice::from_ref(family) } else { &attached };
                mean_width(mesh, surface, of_width) * (coefficient / (1.0 - coefficient)).sqrt()
            } else {
                0.0
            };
            let family = *family;
            for vertex in families.assemblies[assembly].vertices_of(surface, family) {
                reach.entry(vertex).and_modify(|reach| *reach = reach.min(width)).or_insert(width);
            }
        }
        let is_inside = |vertex: u32| families.placed_by[vertex as usize] == PlacedBy::Attached;
        let (inside, placed): (Vec<u32>, Vec<u32>) = reach.keys().partition(|&&vertex| is_inside(vertex));
        let constraint = |vertex: u32| {
            let free = is_inside(vertex) && reach[&vertex] > 0.0;
            if free { families.plane_constraint(vertex) } else { Constraint::Held }
        };
        let mut edges = surface.edges_of(own.iter().flat_map(|&family| surface.triangles_of(family)));
        edges.retain(|&[end, _]| families.assemblies[assembly].has(end));
        let network =
            SurfaceNetwork::anchored(&mesh.vertices, &edges, constraint, |vertex| reach[&vertex], backend, method)?;
        let in_steps = slides_on_body(families, &families.assemblies[assembly]).then_some(edges);
        Ok(Self { assembly, families: own, start, placed, inside, network, in_steps })
    }

    /// As [`Self::relax`], for placed vertices that slide a long way.
    fn follow(
        &self,
        set_up: &SetUp,
        edges: &[[u32; 2]],
        start: &FittedMotion,
        displacement: &mut Displacement,
    ) -> Result<Convergence, BackendError> {
        let SetUp { mesh, families, .. } = *set_up;
        let carried = |vertex: u32| {
            let at = mesh.vertices[vertex as usize];
            at + start.displacement(at)
        };
        let placed = |vertex: u32| mesh.vertices[vertex as usize] + displacement[vertex as usize];
        let is_inside = |vertex: u32| families.placed_by[vertex as usize] == PlacedBy::Attached;
        let constraint =
            |vertex: u32| if is_inside(vertex) { families.plane_constraint(vertex) } else { Constraint::Held };
        let place = |vertex: u32, progress: f64| match is_inside(vertex) {
            true => carried(vertex),
            false if progress >= 1.0 => placed(vertex),
            false => carried(vertex).lerp(placed(vertex), progress),
        };
        let stiff = |_: &[DVec3], [a, b]: [DVec3; 2]| 1.0 / a.distance_squared(b);
        let mut positions: Vec<DVec3> = (0..mesh.vertices.len() as u32).map(carried).collect();
        let convergence = SurfaceNetwork::follow(set_up, &mut positions, edges, constraint, stiff, place, |_, at| at)?;
        for &vertex in &self.inside {
            displacement[vertex as usize] = positions[vertex as usize] - carried(vertex);
        }
        Ok(convergence)
    }

    /// Relaxes the inside, relative to the start. The conservative springs pull to displacement
    /// zero, so the start is subtracted where vertices are placed.
    ///
    /// - `displacement` `[n_vertices]`: on exit the inside's is relative to the start
    fn relax(
        &mut self,
        vertices: &[DVec3],
        start: &FittedMotion,
        displacement: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let given: Vec<DVec3> = self.placed.iter().map(|&vertex| displacement[vertex as usize]).collect();
        for &vertex in &self.placed {
            displacement[vertex as usize] -= start.displacement(vertices[vertex as usize]);
        }
        let convergence = self.network.relax(displacement, stopping)?;
        for (&vertex, given) in self.placed.iter().zip(given) {
            displacement[vertex as usize] = given;
        }
        Ok(convergence)
    }
}

impl Products for AttachedFamilies {
    fn keep(&mut self, kept: &mut Kept) {
        kept.slid = self.junctions.before().to_vec();
    }

    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let vertices = &set_up.mesh.vertices;
        let changes = self.changes(set_up, kept)?;
        // The motions are those of the roots before junctions slide.
        let motions: Vec<_> = changes.iter().map(|of_set| of_set.start.forward(change)).collect();
        let slides = self.junctions.change(set_up, &kept.before_slides())?;
        let mut convergence = self.junctions.forward(slides.as_ref(), change, stopping)?;
        for ((set, SetChange { settled, .. }), motion) in self.sets.iter_mut().zip(&changes).zip(motions) {
            let carried = |vertex: u32| motion.map_or(DVec3::ZERO, |motion| motion.of(vertices[vertex as usize]));
            set.inside.iter().for_each(|&vertex| change[vertex as usize] = DVec3::ZERO);
            if set.placed.is_empty() {
                continue;
            }
            let given: Vec<DVec3> = set.placed.iter().map(|&vertex| change[vertex as usize]).collect();
            set.placed.iter().for_each(|&vertex| change[vertex as usize] -= carried(vertex));
            convergence = convergence.and(set.network.forward(change, stopping)?);
            set.placed.iter().zip(given).for_each(|(&vertex, given)| change[vertex as usize] = given);
            set.inside.iter().for_each(|&vertex| change[vertex as usize] += carried(vertex));
            for &(vertex, settled) in settled {
                change[vertex as usize] = settled * change[vertex as usize];
            }
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
        let vertices = &set_up.mesh.vertices;
        let mut convergence = Convergence::nothing_to_do();
        let changes = self.changes(set_up, kept)?;
        let mut by_motions = Vec::with_capacity(changes.len());
        for (set, SetChange { start, settled }) in self.sets.iter_mut().zip(&changes).rev() {
            for &(vertex, settled) in settled {
                gradient[vertex as usize] = settled.transpose() * gradient[vertex as usize];
            }
            if !set.placed.is_empty() {
                let mut by_motion = start.none();
                let mut add = |vertex: u32, by_vertex: DVec3| {
                    if let Some(by_motion) = &mut by_motion {
                        by_motion.add(vertices[vertex as usize], by_vertex);
                    }
                };
                set.inside.iter().for_each(|&vertex| add(vertex, gradient[vertex as usize]));
                let take = |&vertex: &u32| std::mem::take(&mut gradient[vertex as usize]);
                let given: Vec<DVec3> = set.placed.iter().map(take).collect();
                convergence = convergence.and(set.network.reverse(gradient, stopping)?);
                for (&vertex, given) in set.placed.iter().zip(given) {
                    add(vertex, -gradient[vertex as usize]);
                    gradient[vertex as usize] += given;
                }
                by_motions.push((start, by_motion));
            }
            set.inside.iter().for_each(|&vertex| gradient[vertex as usize] = DVec3::ZERO);
        }
        let slides = self.junctions.change(set_up, &kept.before_slides())?;
        convergence = convergence.and(self.junctions.reverse(slides.as_ref(), gradient, stopping)?);
        by_motions.into_iter().for_each(|(start, by_motion)| start.reverse(by_motion, gradient));
        Ok(convergence)
    }
}

/// The derivatives of a set of families at one displacement.
struct SetChange<'a> {
    /// Of the start.
    start: RootChange<'a>,
    /// Of the places to which vertices settle. Vertices that stay on no carenage and no plane are
    /// left out.
    settled: Vec<(u32, DMat3)>,
}

impl AttachedFamilies {
    /// The derivatives of all sets. Where vertices settle on a carenage, the springs relax again,
    /// because the places from which vertices settle tell how they do.
    fn changes<'a>(&mut self, set_up: &SetUp<'a>, kept: &Kept) -> Result<Vec<SetChange<'a>>, NoProduct> {
        let SetUp { mesh, families, stopping, .. } = *set_up;
        let before = kept.before_slides();
        let mut changes = Vec::with_capacity(self.sets.len());
        for set in &mut self.sets {
            let assembly = &families.assemblies[set.assembly];
            let change = assembly.carried_change(mesh, &before, set.start);
            let change = change.map_err(|vertex| NoProduct::Rotation { vertex })?;
            let mut settled = Vec::new();
            if set.inside.iter().any(|&vertex| families.shapes_at(vertex).next().is_some()) {
                let start = assembly.carried(mesh, &before, set.start);
                let mut displacement = kept.surfaces.clone();
                set.inside.iter().for_each(|&vertex| displacement[vertex as usize] = DVec3::ZERO);
                if set.inside.iter().any(|&vertex| families.touches_surface(vertex)) {
                    set.relax(&mesh.vertices, &start, &mut displacement, &stopping)?;
                }
                let shaped = set.inside.iter().filter(|&&vertex| families.shapes_at(vertex).next().is_some());
                settled.extend(shaped.map(|&vertex| {
                    let at = mesh.vertices[vertex as usize];
                    let moved = at + displacement[vertex as usize] + start.displacement(at);
                    (vertex, families.settle_change(vertex, moved))
                }));
            }
            changes.push(SetChange { start: change, settled });
        }
        Ok(changes)
    }
}

/// Whether an assembly has a part that slides and a body with a motion of its own.
fn bridges(families: &Families, assembly: &Assembly) -> bool {
    let has = |is: &dyn Fn(&Role) -> bool| assembly.families.iter().any(|family| is(&families.roles[family.index()]));
    has(&|role| matches!(role, Role::Attached { junction: Junction::Slide, .. }))
        && has(&|role| matches!(role, Role::Rigid { motion, .. } if *motion != RigidMotion::Root))
}

/// Whether an assembly has a body with a motion of its own on which its attached families slide.
fn slides_on_body(families: &Families, assembly: &Assembly) -> bool {
    assembly.families.iter().any(|family| {
        let role = &families.roles[family.index()];
        matches!(role, Role::Rigid { motion, junction: Junction::Slide } if *motion != RigidMotion::Root)
    })
}

/// Mean width of a set of families in the mesh's unit: twice their area over the length of their
/// common boundary. For a long strip this is the strip's width.
fn mean_width(mesh: &TetMesh, surface: &Surface, families: &[FamilyId]) -> f64 {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let corners = families.iter().flat_map(|&family| surface.corners_of(family));
    let area: f64 = corners.map(|corners| 0.5 * triangle_normal(corners.map(at)).length()).sum();
    let loops = families.iter().flat_map(|&family| surface.boundary_loops(family)).flatten();
    let perimeter: f64 = loops
        .filter(|&half_edge| families.len() == 1 || !families.contains(&surface.family_behind(half_edge)))
        .map(|half_edge| at(surface.origin(half_edge)).distance(at(surface.origin(next(half_edge)))))
        .sum();
    2.0 * area / perimeter
}
