//! Cuts profiles from the wing's surface.
//!
//! A cut through flat facets lies below the smooth surface of the vertices, by up to the facets'
//! sag. [`cut`] gives this flat cut. [`section`] gives the section defined by the vertices beside
//! the plane (see `carry`).

mod carry;
mod flat;

pub(super) use carry::carried;
pub(super) use flat::{check, flat_section};

use glam::DVec3;

use super::{Plane, Profile, ProfileError};

/// The curve in which a plane cuts a wing's facets, in order: lower side of the trailing edge,
/// leading edge, upper side of the trailing edge. Open for a blunt trailing edge (its triangles are
/// another family). For a sharp one it is closed, and the first point is repeated.
///
/// - `vertices` `[n_vertices]`: positions of the whole mesh, in its unit
/// - `faces`: the wing's triangles `[u32; 3]`, or its triangles and quadrilaterals
///   ([`crate::mesh::corners::Face`]), with any orientation. A quadrilateral is cut at its edges
///
/// "Lower" is the direction -z, or -y for a plane with the normal z.
///
/// # Errors
/// - [`ProfileError::PlaneMisses`] with the wing's extent along the normal
/// - [`ProfileError::Pieces`] with the number of curves
/// - [`ProfileError::CutShort`]: an open curve does not end at the trailing edge on both sides
/// - [`ProfileError::Branches`]: the surface is no simple sheet
/// - [`ProfileError::Face`]: a face names a vertex that does not exist or is not finite
pub fn cut(vertices: &[DVec3], faces: &[impl AsRef<[u32]>], plane: &Plane) -> Result<Vec<DVec3>, ProfileError> {
    Ok(flat_section(vertices, faces, plane)?.points())
}

/// The section defined by a wing's vertices beside a plane, in the order of [`cut`]. Each vertex is
/// carried into the plane along the wing's span-wise direction. Points are in the mesh's unit.
///
/// - `vertices` `[n_vertices]`: of the mesh
/// - `faces` `[n_faces]`: of the wing, as for [`cut`]
///
/// # Errors
/// As for [`cut`].
pub fn section(vertices: &[DVec3], faces: &[impl AsRef<[u32]>], plane: &Plane) -> Result<Vec<DVec3>, ProfileError> {
    let flat = flat_section(vertices, faces, plane)?;
    Ok(carried(vertices, faces, plane, &flat))
}

/// [`section`] at each of several planes. Each plane comes with the number of its profile.
///
/// - `vertices` `[n_vertices]`: of the mesh, in its unit
/// - `faces` `[n_faces]`: of the wing, as for [`cut`]
/// - `planes` `[n_profiles]`
///
/// # Errors
/// As for [`cut`], for the first plane that fails.
pub fn cut_at_planes(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    planes: &[(i64, Plane)],
) -> Result<Vec<Profile>, ProfileError> {
    let profile = |&(number, ref plane)| Ok(Profile { number, points: section(vertices, faces, plane)? });
    planes.iter().map(profile).collect()
}
