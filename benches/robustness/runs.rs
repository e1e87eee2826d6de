//! What the motions came to.

use idmesh::smoothing::QualityTarget;

/// The targets of local optimisation, as a case calls them.
pub const TARGETS: [(&str, Option<QualityTarget>); 3] =
    [("off", None), ("original", Some(QualityTarget::Original)), ("improve", Some(QualityTarget::Improve))];

/// What one motion came to.
pub struct Run {
    pub kind: usize,
    pub amount: f64,
    pub target: usize,
    pub inverted: usize,
    pub folded: usize,
    pub self_intersecting: usize,
    pub worst: f64,
    pub mean: f64,
    pub seconds: f64,
}
