//! The surface of a wing, over which profiles are interpolated.

use glam::DVec3;

/// A wing's surface, over which profiles are interpolated.
#[derive(Clone, Copy, Debug, Default)]
pub struct WingSurface<'a> {
    /// Positions of the wing's vertices `[n]`, in the unit of the profiles.
    pub positions: &'a [DVec3],
    /// Unit outward normals at the vertices `[n]`. A zero normal matches either side.
    pub normals: &'a [DVec3],
    /// The wing's triangles as indices into `positions`, with any orientation. Old profiles are
    /// checked against them; without triangles there is no check.
    pub triangles: &'a [[u32; 3]],
    /// Triangles of a half that is the mirror image of the other half, mirrored onto it. No
    /// sections are cut from them, but they too must agree with the profiles, before and after the
    /// motion.
    pub mirrored: &'a [[u32; 3]],
}
