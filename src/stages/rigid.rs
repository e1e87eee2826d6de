//! Stage rigid: bodies such as nacelles move without a change of their shape.
//!
//! Each family with the role rigid goes with the best rigid motion of its assembly's root, with the
//! root's mean displacement, or with the motion that its user gives
//! ([`RigidMotion`](crate::families::RigidMotion)). Its vertices keep their distances to rounding.
//! Vertices of the root belong to the wing, whatever the motion, and common vertices of two bodies
//! to one of them: a body without a pylon gives way there, which [`Body::strain`] measures.
//!
//! The paper has no such stage.

use glam::DVec3;

use crate::families::{Assembly, Families, PlacedBy, Role, RootChange, TipStart};
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::half_edge::Surface;
use crate::mesh::{Displacement, FamilyId};
use crate::relaxation::{Convergence, Stopping};
use crate::stage::{Kept, NoProduct, Products, SetUp, Stage, StageError};

/// All rigid families of a mesh, and the motions of the assemblies in the last run.
#[derive(Default)]
pub struct Rigids {
    carried: Vec<Carried>,
    bodies: Vec<Body>,
}

/// The best rigid motion of an assembly's root.
#[derive(Clone, Copy)]
pub struct Carried {
    /// The motion.
    pub motion: FittedMotion,
    /// Largest distance of a root vertex from where the motion has it, in the mesh's unit.
    pub residual: f64,
}

/// The vertices of an assembly that belong to a rigid family, and their motion.
pub struct Body {
    /// The family.
    pub family: FamilyId,
    /// The vertices, ascending, in the mover's order.
    pub vertices: Vec<u32>,
    /// The motion.
    pub motion: FittedMotion,
    /// The vertex of the body that is farthest from where the motion has it, by its shortest
    /// edge. `None` if all are there.
    pub strain: Option<Strain>,
}

/// A vertex of a rigid family that an earlier stage, or another body, places elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strain {
    /// The vertex, in the mover's order.
    pub vertex: u32,
    /// Its distance from where the family's motion has it, in the mesh's unit.
    pub distance: f64,
    /// The vertex's shortest edge in the family, in the mesh's unit.
    pub edge: f64,
}

impl Rigids {
    /// The best rigid motions of the assemblies, in the order of
    /// [`Families::assemblies`](crate::families::Families::assemblies).
    pub fn carried(&self) -> &[Carried] {
        &self.carried
    }

    /// The bodies, in the order of their assemblies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }
}

impl Stage for Rigids {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        (self.carried, self.bodies) = Default::default();
        for assembly in &families.assemblies {
            let off = |motion: &FittedMotion, displacement: &[DVec3], vertex: u32| {
                motion.displacement(mesh.vertices[vertex as usize]).distance(displacement[vertex as usize])
            };
            let motion = assembly.carried(mesh, displacement, TipStart::Rigid);
            let residual = assembly.root.iter().map(|&(vertex, _)| off(&motion, displacement, vertex));
            self.carried.push(Carried { motion, residual: residual.fold(0.0, f64::max) });
            // The root's displacement is that of earlier stages, so no family changes the motion of
            // another.
            let first = self.bodies.len();
            for &family in &assembly.families {
                let Role::Rigid { motion, .. } = &families.roles[family.index()] else { continue };
                let motion = assembly.rigid_motion(mesh, displacement, motion);
                let own: Vec<u32> = assembly.vertices_of(surface, family).collect();
                for vertex in placed(families, surface, assembly, family) {
                    displacement[vertex as usize] = motion.displacement(mesh.vertices[vertex as usize]);
                }
                self.bodies.push(Body { family, vertices: own, motion, strain: None });
            }
            // Of two bodies that touch the last one places the common vertices.
            for Body { family, vertices, motion, strain } in &mut self.bodies[first..] {
                let off = |vertex: u32| off(motion, displacement, vertex);
                let elsewhere = vertices.iter().copied().filter(|&vertex| off(vertex) > 0.0);
                let elsewhere: Vec<u32> = elsewhere.collect();
                if elsewhere.is_empty() {
                    continue;
                }
                let edges = surface.shortest_edges(&mesh.vertices, *family);
                let of_vertex = |vertex: u32| Strain { vertex, distance: off(vertex), edge: edges[&vertex] };
                let ratio = |strain: &Strain| strain.distance / strain.edge;
                *strain = elsewhere.into_iter().map(of_vertex).max_by(|a, b| ratio(a).total_cmp(&ratio(b)));
            }
        }
        Ok(Convergence::nothing_to_do())
    }
}

/// The derivative of the motion of each body with its assembly, in the order of the assemblies.
fn changes<'a>(set_up: &SetUp<'a>, kept: &Kept) -> Result<Vec<(&'a Assembly, FamilyId, RootChange<'a>)>, NoProduct> {
    let SetUp { mesh, families, .. } = *set_up;
    let before = kept.before_slides();
    let mut changes = Vec::new();
    for assembly in &families.assemblies {
        for &family in &assembly.families {
            let Role::Rigid { motion, .. } = &families.roles[family.index()] else { continue };
            let change = assembly.rigid_change(mesh, &before, motion);
            changes.push((assembly, family, change.map_err(|vertex| NoProduct::Rotation { vertex })?));
        }
    }
    Ok(changes)
}

/// The vertices of a family in an assembly that the stage places.
fn placed<'a>(
    families: &'a Families,
    surface: &'a Surface,
    assembly: &'a Assembly,
    family: FamilyId,
) -> impl Iterator<Item = u32> + 'a {
    let own = assembly.vertices_of(surface, family);
    own.filter(|&vertex| families.placed_by[vertex as usize] == PlacedBy::Rigid)
}

impl Products for Rigids {
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        _: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        for (assembly, family, of_motion) in changes(set_up, kept)? {
            let motion = of_motion.forward(change);
            for vertex in placed(families, surface, assembly, family) {
                change[vertex as usize] =
                    motion.map_or(DVec3::ZERO, |motion| motion.of(mesh.vertices[vertex as usize]));
            }
        }
        Ok(Convergence::nothing_to_do())
    }

    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        _: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        // Of two families the last one places a common vertex.
        for (assembly, family, of_motion) in changes(set_up, kept)?.into_iter().rev() {
            let mut by_motion = of_motion.none();
            for vertex in placed(families, surface, assembly, family) {
                let by_vertex = std::mem::take(&mut gradient[vertex as usize]);
                if let Some(by_motion) = &mut by_motion {
                    by_motion.add(mesh.vertices[vertex as usize], by_vertex);
                }
            }
            of_motion.reverse(by_motion, gradient);
        }
        Ok(Convergence::nothing_to_do())
    }
}
