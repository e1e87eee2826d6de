//! Displacements that the user gives for whole families.

use glam::DVec3;

use super::{Design, MoveError};
use crate::{
    families::{Families, PlacedBy},
    mesh::Displacement,
    mesh::{FamilyId, Order, TetMesh},
    stage::Wanted,
};

/// Two displacements of one vertex agree to this fraction of the larger one: text files with seven
/// digits do.
const AGREE: f64 = 1e-6;

/// Whether two displacements of the vertex at `position` are more than rounding apart.
pub fn differ(one: DVec3, other: DVec3, position: DVec3) -> bool {
    // Displacements are often differences of two positions.
    let rounding = 4.0 * f64::EPSILON * position.abs().max_element();
    let apart = one.distance(other);
    apart.is_nan() || apart > AGREE * one.length().max(other.length()) + rounding
}

/// Writes the design's displacements of the prescribed families into `displacement`, which is in
/// `order`, and for vertices that others place into `wanted`.
///
/// - `mesh`: in `order`
/// - `family_vertices` `[n_families]`: those of the mesh that was given
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
