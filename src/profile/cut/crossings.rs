//! The points of a section with the edges that they lie on.

use std::ops::Range;

use glam::DVec3;

use crate::profile::Plane;

/// A crossing of the plane and the edges of the surface, or a point of a bridge.
#[derive(Clone, Debug)]
pub(in crate::profile) struct Crossing {
    pub at: DVec3,
    /// The edges that cross the plane there: the end below it and the end above it. None on a
    /// bridge.
    pub edges: Vec<[u32; 2]>,
}

/// The points of a curve.
pub(super) fn points_of(curve: &[Crossing]) -> Vec<DVec3> {
    curve.iter().map(|crossing| crossing.at).collect()
}

/// Whether a curve repeats its first point at the end.
pub(super) fn is_closed(curve: &[Crossing]) -> bool {
    curve.len() > 3 && curve[0].at == curve[curve.len() - 1].at
}

/// The runs of crossings that are bridges.
pub(super) fn bridge_runs(curve: &[Crossing]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut at = 0;
    for run in curve.chunk_by(|a, b| a.edges.is_empty() == b.edges.is_empty()) {
        if run[0].edges.is_empty() {
            runs.push(at..at + run.len());
        }
        at += run.len();
    }
    runs
}

/// The point at which an edge crosses the plane. It lies exactly in a plane perpendicular to an
/// axis.
pub(super) fn crossing(a: DVec3, b: DVec3, plane: &Plane) -> DVec3 {
    let (da, db) = (plane.distance(a), plane.distance(b));
    let p = a + (b - a) * (da / (da - db)).clamp(0.0, 1.0);
    p - plane.normal * plane.distance(p)
}
