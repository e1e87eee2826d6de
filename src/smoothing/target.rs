//! The target shape of each tet.

use glam::{DMat3, DVec3};

use crate::quality;

/// The shape towards which local optimisation moves tets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityTarget {
    /// Each tet's own shape in the undeformed mesh. An unmoved mesh is at the optimum.
    Original,
    /// The regular tet. The smallest beta may rise above the smallest beta of the undeformed mesh.
    Improve,
}

/// The inverse of each tet's target matrix `W` `[n_tets]`, in one over the mesh's unit. The columns
/// of `W` are the target's edges from its first vertex, and `det W` is six times the volume of the
/// original tet.
///
/// - `tets` `[n_tets]`, `original` `[n_vertices]`: the undeformed mesh, whose tets have positive
///   volume
pub fn inverse_targets(target: QualityTarget, tets: &[[u32; 4]], original: &[DVec3]) -> Vec<DMat3> {
    // Edges of the regular tet with edge length 1. Their determinant is 1 / sqrt 2.
    let regular = DMat3::from_cols(
        DVec3::X,
        DVec3::new(0.5, 0.75f64.sqrt(), 0.0),
        DVec3::new(0.5, (1.0 / 12.0f64).sqrt(), (2.0 / 3.0f64).sqrt()),
    );
    let inverse_regular = regular.inverse();
    let of_tet = |tet: &[u32; 4]| {
        let corners = tet.map(|vertex| original[vertex as usize]);
        let [a, b, c, d] = corners;
        match target {
            QualityTarget::Original => DMat3::from_cols(b - a, c - a, d - a).inverse(),
            QualityTarget::Improve => inverse_regular * (6.0 * 2f64.sqrt() * quality::volume(corners)).cbrt().recip(),
        }
    };
    tets.iter().map(of_tet).collect()
}
