//! The surface of a wing, over which profiles are interpolated.

use glam::DVec3;

use super::cut::Junctions;
use crate::mesh::corners::Face;

/// A wing's surface, over which profiles are interpolated.
#[derive(Clone, Copy, Debug, Default)]
pub struct WingSurface<'a> {
    /// Positions of the wing's vertices `[n]`, in the unit of the profiles.
    pub positions: &'a [DVec3],
    /// Unit outward normals at the vertices `[n]`. A zero normal matches either side.
    pub normals: &'a [DVec3],
    /// The wing's triangles and quadrilaterals as indices into `positions`, with any orientation.
    /// Old profiles are checked against them; without faces there is no check.
    pub faces: &'a [Face],
    /// Faces of a half that is the mirror image of the other half, mirrored onto it. No
    /// sections are cut from them, but they too must agree with the profiles, before and after the
    /// motion.
    pub mirrored: &'a [Face],
    /// Where the surface ends on other families. Old profiles that pass through a part on the wing
    /// are checked against the wing's sections on both sides of it; without junctions they are not.
    pub junctions: Option<&'a Junctions>,
}
