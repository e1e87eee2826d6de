//! Roles that cannot be meant, by the shape of a family and its place in the mesh.
//!
//! A wrong role moves the wrong surface, or none, and the moved mesh may be valid all the same.
//! Each check looks at something that no family with the role can have in a mesh around an
//! aircraft, and none of them depends on a name.

use glam::DVec3;

use super::{RigidMotion, Role, shape};
use crate::geometry::bounds;
use crate::mesh::{FamilyId, TetMesh, half_edge::Surface};

/// A family with a role that cannot be meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misplaced {
    /// The family shall follow others, but shares no vertex with a family that the design moves:
    /// neither itself nor through other families that follow. So it stays.
    Untouched,
    /// The family shall follow a wing, but reaches so many of the six sides of the mesh's box.
    Far(usize),
    /// The family shall slide on its own surface, but all of it lies in one plane.
    Flat,
}

/// A family that reaches this many of the six sides of the mesh's box is a part of the far
/// boundary. A wing between two walls, cut in half by a symmetry plane, reaches three.
pub(super) const FAR: usize = 4;

/// A vertex within this fraction of the box's size is on the side.
const ON_SIDE: f64 = 1e-6;

/// Finds the families with roles that cannot be meant, ascending.
///
/// - `roles` `[n_families]`
pub(super) fn misplaced(mesh: &TetMesh, surface: &Surface, roles: &[Role]) -> Vec<(FamilyId, Misplaced)> {
    let touched = touched(surface, roles);
    let found = (0..roles.len()).filter_map(|index| {
        let (family, role) = (FamilyId(index as u16), &roles[index]);
        let follows = follows(role);
        if surface.vertices_of(family).is_empty() {
            return None;
        }
        let misplaced = match role {
            _ if follows && !touched[index] => Misplaced::Untouched,
            Role::Wingtip { .. } | Role::Attached { .. } | Role::Rigid { .. } | Role::TrailingEdge => {
                match sides(mesh, surface, family) {
                    sides if sides >= FAR => Misplaced::Far(sides),
                    _ => return None,
                }
            }
            Role::Carenage if shape::fit_plane(mesh, surface, family, None).is_ok() => Misplaced::Flat,
            _ => return None,
        };
        Some((family, misplaced))
    });
    found.collect()
}

/// Whether a family with this role moves only if families that it touches move.
fn follows(role: &Role) -> bool {
    match role {
        Role::TrailingEdge | Role::Wingtip { .. } | Role::Attached { .. } | Role::Carenage => true,
        Role::Rigid { motion, .. } => matches!(motion, RigidMotion::Root | RigidMotion::Translation),
        _ => false,
    }
}

/// Whether each family is moved by the design, or touches such a family, itself or through families
/// that follow `[n_families]`.
fn touched(surface: &Surface, roles: &[Role]) -> Vec<bool> {
    let moves = |role: &Role| match role {
        Role::Wing | Role::Prescribed => true,
        Role::Rigid { motion, .. } => matches!(motion, RigidMotion::Given { .. }),
        _ => false,
    };
    // A forest: each family points to a family that it is joined to, the root to itself.
    let mut chief: Vec<usize> = (0..roles.len()).collect();
    fn find(chief: &mut [usize], mut at: usize) -> usize {
        while chief[at] != at {
            chief[at] = chief[chief[at]];
            at = chief[at];
        }
        at
    }
    let n_vertices = surface.vertices().iter().max().map_or(0, |&last| last as usize + 1);
    let mut first_at = vec![usize::MAX; n_vertices];
    for (index, _) in roles.iter().enumerate().filter(|(_, role)| moves(role) || follows(role)) {
        for &vertex in surface.vertices_of(FamilyId(index as u16)) {
            match first_at[vertex as usize] {
                usize::MAX => first_at[vertex as usize] = index,
                first => {
                    let (a, b) = (find(&mut chief, first), find(&mut chief, index));
                    chief[b] = a;
                }
            }
        }
    }
    let mut is_moved = vec![false; roles.len()];
    for (index, _) in roles.iter().enumerate().filter(|(_, role)| moves(role)) {
        is_moved[find(&mut chief, index)] = true;
    }
    (0..roles.len()).map(|index| is_moved[find(&mut chief, index)]).collect()
}

/// Number of the sides of the mesh's box that a family reaches.
fn sides(mesh: &TetMesh, surface: &Surface, family: FamilyId) -> usize {
    let box_of = |vertices: &[u32]| bounds(vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]));
    let Some(([low, high], own)) = box_of(surface.vertices()).zip(box_of(surface.vertices_of(family))) else {
        return 0;
    };
    sides_of([low, high], own)
}

/// Number of the sides of a box that another box, inside it, reaches.
pub(super) fn sides_of([low, high]: [DVec3; 2], own: [DVec3; 2]) -> usize {
    let near = ON_SIDE * low.distance(high);
    let distances = [own[0] - low, high - own[1]].map(|distance| distance.to_array());
    distances.as_flattened().iter().filter(|&&distance| distance <= near).count()
}
