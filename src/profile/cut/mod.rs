//! Cuts profiles from the wing's surface.
//!
//! A cut through flat facets lies below the smooth surface of the vertices, by up to the facets'
//! sag. [`cut`] gives this flat cut. [`section`] gives the section defined by the vertices beside
//! the plane (see `carry`).
//!
//! A plane may pass through a part that stands on the wing, such as a pylon. [`cut_through_parts`]
//! and [`cut_at_planes_through_parts`] bridge the gap (see `bridge`).

mod bridge;
mod carry;
mod crossings;
mod flat;
mod junctions;

pub(super) use carry::carried;
pub(super) use flat::{FlatSection, check, flat_section_through};
pub use junctions::Junctions;

use flat::flat_section;

use glam::DVec3;

use super::{Plane, Profile, ProfileError};
use crate::text::{figures::length, shown};

/// The curve in which a plane cuts a wing's facets, in order: lower side of the trailing edge,
/// leading edge, upper side of the trailing edge. Open for a blunt trailing edge (its triangles are
/// another family). For a sharp one it is closed, and the first point is repeated.
///
/// - `vertices` `[n_vertices]`: positions of the whole mesh, in its unit
/// - `faces`: the wing's triangles `[u32; 3]`, or its triangles and quadrilaterals
///   ([`crate::mesh::corners::Face`]), with any orientation. A quadrilateral is cut at its four
///   edges
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

/// A section through parts that stand on the wing. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct ThroughParts {
    /// The points of the section, in the order of [`cut`], with those of the bridges.
    pub points: Vec<DVec3>,
    /// The points that are not of a bridge, in the same order.
    pub on_surface: Vec<DVec3>,
    /// The gaps that were bridged.
    pub gaps: Vec<Gap>,
}

/// A gap of a section that a cubic bridges. There the section is a guess.
#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    /// The family in the gap.
    pub family: String,
    /// Distance between the ends of the gap, in the mesh's unit.
    pub length: f64,
    /// The distance as a share of the section's length.
    pub share: f64,
}

impl std::fmt::Display for Gap {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { family, length: gap, share } = self;
        let gap = length(*gap, *gap / share.max(f64::MIN_POSITIVE));
        write!(f, "`{}`, a gap of {gap}, {:.0} % of the section's length", shown(family), 100.0 * share)
    }
}

impl FlatSection {
    pub(in crate::profile) fn gaps(&self) -> Vec<Gap> {
        let gap =
            |bridge: &bridge::Bridge| Gap { family: bridge.family.clone(), length: bridge.gap, share: bridge.share };
        self.bridges.iter().map(gap).collect()
    }
}

/// [`cut`] through parts that stand on the wing.
///
/// - `junctions`: where the wing's surface ends on other families
///
/// # Errors
/// As for [`cut`], and [`ProfileError::Gap`]: a gap is too large for a guess.
pub fn cut_through_parts(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
    junctions: &Junctions,
) -> Result<ThroughParts, ProfileError> {
    let flat = flat_section_through(vertices, faces, plane, Some(junctions))?;
    Ok(ThroughParts { points: flat.points(), on_surface: flat.points_on_surface(), gaps: flat.gaps() })
}

/// [`cut_at_planes`] through parts that stand on the wing. Each profile comes with the gaps that
/// were bridged.
///
/// - `junctions`: where the wing's surface ends on other families
///
/// # Errors
/// As for [`cut_through_parts`], for the first plane that fails.
pub fn cut_at_planes_through_parts(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    planes: &[(i64, Plane)],
    junctions: &Junctions,
) -> Result<Vec<(Profile, Vec<Gap>)>, ProfileError> {
    let profile = |&(number, ref plane): &(i64, Plane)| {
        let flat = flat_section_through(vertices, faces, plane, Some(junctions))?;
        Ok((Profile { number, points: carried(vertices, faces, plane, &flat) }, flat.gaps()))
    };
    planes.iter().map(profile).collect()
}
