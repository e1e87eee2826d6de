//! Displacements that a design prescribes for whole families.
//!
//! The wing's stage begins with them. If two families prescribe different displacements for one
//! vertex, nothing is moved.

use glam::DVec3;

use super::{Design, MoveError};
use crate::{
    families::{Families, PlacedBy},
    mesh::Displacement,
    mesh::{FamilyId, Order, TetMesh},
    stage::Wanted,
};

/// Two displacements of one vertex agree if they differ by at most this fraction of the larger one.
/// Text files with seven digits agree.
const AGREE: f64 = 1e-6;

/// Whether two displacements of the vertex at `position` differ by more than rounding. All are in
/// the mesh's unit.
pub fn differ(one: DVec3, other: DVec3, position: DVec3) -> bool {
    // Displacements are often differences of two positions, with the rounding of positions.
    let rounding = 4.0 * f64::EPSILON * position.abs().max_element();
    let apart = one.distance(other);
    apart.is_nan() || apart > AGREE * one.length().max(other.length()) + rounding
}

/// Writes the design's displacements of prescribed families into `displacement`, which is in
/// `order`. Displacements of vertices that other families place go into `wanted` instead.
///
/// - `mesh`: in `order`
/// - `family_vertices` `[n_families]`: vertices of each family, in the order of the mesh that was
///   given
///
/// # Errors
/// - [`MoveError::Prescribed`]: a family has a wrong number of displacements
/// - [`MoveError::Disagree`]: two families move a vertex that both have to different places
pub(super) fn prescribe(
    mesh: &TetMesh,
    order: &Order,
    family_vertices: &[Vec<u32>],
    families: &Families,
    design: &Design,
    displacement: &mut Displacement,
    wanted: &mut Vec<Wanted>,
) -> Result<(), MoveError> {
    let mut given_by: Vec<Option<(FamilyId, DVec3)>> = vec![None; mesh.vertices.len()];
    for family in families.families_of(PlacedBy::Prescribed) {
        let name = |family: FamilyId| mesh.families[family.index()].clone();
        let vertices = &family_vertices[family.index()];
        let given = design.prescribed.get(&mesh.families[family.index()]).map_or(&[][..], Vec::as_slice);
        if given.len() != vertices.len() {
            return Err(MoveError::Prescribed { family: name(family), expected: vertices.len(), found: given.len() });
        }
        for (&vertex, &by) in vertices.iter().zip(given) {
            let place = order.place(vertex) as usize;
            let position = mesh.vertices[place];
            if let Some((first, before)) = given_by[place].replace((family, by))
                && differ(before, by, position)
            {
                let (family, other) = (name(first), name(family));
                let difference = before.distance(by);
                return Err(MoveError::Disagree { family, other, vertex, position, difference });
            }
            if families.placed_by[place] == PlacedBy::Prescribed {
                displacement[place] = by;
            } else {
                wanted.push(Wanted { family, vertex: place as u32, displacement: by });
            }
        }
    }
    Ok(())
}
