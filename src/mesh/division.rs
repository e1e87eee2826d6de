//! The division of quadrilaterals into triangles, along their shorter diagonals.

use glam::DVec3;

use super::{FamilyId, HybridMesh, corners::Face, lowest_of};

/// Two diagonals have one length, and two directions one component, if they differ by less than
/// this share of the length. Rounding must not decide between the diagonals of a rectangle.
const SAME_LENGTH: f64 = 1e-9;

/// The triangles of a face, each with its lowest vertex first. A quadrilateral is divided along its
/// shorter diagonal. Of two diagonals of one length, as in a rectangle, their directions decide, so
/// that the numbers of the vertices do not.
pub(super) fn triangles_of_face(face: &[u32], vertices: &[DVec3]) -> impl Iterator<Item = [u32; 3]> + use<> {
    let halves = match *face {
        [a, b, c, d] => {
            let diagonal = |from: u32, to: u32| vertices[to as usize] - vertices[from as usize];
            if is_taken(diagonal(a, c), diagonal(b, d)).unwrap_or(a.min(c) < b.min(d)) {
                [Some([a, b, c]), Some([a, c, d])]
            } else {
                [Some([b, c, d]), Some([b, d, a])]
            }
        }
        [a, b, c] => [Some([a, b, c]), None],
        _ => [None, None],
    };
    halves.into_iter().flatten().map(|mut triangle| {
        let lowest = lowest_of(&triangle);
        triangle.rotate_left(lowest);
        triangle
    })
}

/// Whether a quadrilateral is divided along one diagonal and not along the other: the shorter one,
/// or of two of one length the one that rises more along the other axes where both point forward
/// along the first one. `None` if the two are one line.
fn is_taken(one: DVec3, other: DVec3) -> Option<bool> {
    let lengths = [one, other].map(DVec3::length);
    let same = SAME_LENGTH * lengths[0].max(lengths[1]);
    if (lengths[0] - lengths[1]).abs() > same {
        return Some(lengths[0] < lengths[1]);
    }
    let forward = |way: DVec3| {
        let first = way.to_array().into_iter().find(|component| component.abs() > same);
        way * first.map_or(1.0, f64::signum)
    };
    let [one, other] = [one, other].map(|way| forward(way).to_array());
    one.into_iter().zip(other).find(|(one, other)| (one - other).abs() > same).map(|(one, other)| one > other)
}

/// The two triangles of a quadrilateral. If it is degenerate, the second repeats the first.
///
/// - `vertices` `[n_vertices]`: of the undeformed mesh
pub fn halves(face: [u32; 4], vertices: &[DVec3]) -> [[u32; 3]; 2] {
    let face = Face::new(&face);
    let mut triangles = face.iter().flat_map(|face| triangles_of_face(face.vertices(), vertices));
    let first = triangles.next().unwrap_or_default();
    [first, triangles.next().unwrap_or(first)]
}

/// The triangles of some families: triangles as in the mesh, then quadrilaterals as two triangles
/// each, in the order of the mesh.
pub fn triangles_of_families(mesh: HybridMesh, families: &[FamilyId]) -> Vec<[u32; 3]> {
    let mut triangles = mesh.mesh.triangles_of(families);
    for (face, family) in mesh.others.quadrilaterals.iter().zip(&mesh.others.quadrilateral_family) {
        if families.contains(family)
            && let Some(face) = Face::new(face)
        {
            triangles.extend(triangles_of_face(face.vertices(), mesh.vertices()));
        }
    }
    triangles
}

/// The faces of some families, in the order of the mesh, triangles first.
pub fn faces_of_families(mesh: HybridMesh, families: &[FamilyId]) -> Vec<Face> {
    let triangles = mesh.mesh.triangles_of(families).into_iter().map(Face::of_triangle);
    let quadrilaterals = mesh.others.quadrilaterals.iter().zip(&mesh.others.quadrilateral_family);
    let of_families = quadrilaterals.filter(|(_, family)| families.contains(family));
    triangles.chain(of_families.filter_map(|(face, _)| Face::new(face))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The diagonals of a rectangle are equally long. Whatever the numbers of its vertices and the
    /// rounding of its coordinates are, it is divided along the same one.
    ///
    /// Fails if `SAME_LENGTH` is 0.
    #[test]
    fn numbers_and_rounding_do_not_divide_a_rectangle() {
        let corners = [[0.1, 0.2, 0.3], [1.3, 0.2, 0.8], [1.3, 0.9, 0.8], [0.1, 0.9, 0.3]].map(DVec3::from_array);
        for (rounding, turn) in (-3..=3).flat_map(|rounding| (0..4).map(move |turn| (rounding, turn))) {
            let mut vertices = corners;
            vertices[2].x += f64::from(rounding) * 1e-16;
            vertices.rotate_left(turn);
            for face in [[0, 1, 2, 3], [3, 2, 1, 0]] {
                let [first, second] = halves(face, &vertices);
                let mut shared: Vec<DVec3> = first
                    .iter()
                    .filter(|vertex| second.contains(vertex))
                    .map(|&vertex| vertices[vertex as usize])
                    .collect();
                shared.sort_by(|a, b| a.x.total_cmp(&b.x));
                // Both diagonals point forward along x; this one rises along y.
                assert!(shared[0].y < 0.5 && shared[1].y > 0.5, "{rounding} {turn} {shared:?}");
            }
        }
    }
}
