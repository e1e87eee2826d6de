//! The sizes of meshes with which idmesh computes.

use std::ops::RangeInclusive;

/// The sizes of a mesh with which idmesh computes, in the mesh's unit. Products of up to four
/// lengths stay in the range of f64, also of edges of 1e-25 of the size.
pub const SIZES: RangeInclusive<f64> = 1e-50..=1e50;
