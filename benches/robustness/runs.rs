//! What the motions came to.

use idmesh::smoothing::Target;

/// The targets of local optimisation, as a case calls them.
pub const TARGETS: [(&str, Option<Target>); 3] =
    [("off", None), ("original", Some(Target::Original)), ("improve", Some(Target::Improve))];

/// What one motion came to.
pub struct Run {
    pub kind: usize,
    pub amount: f64,
    pub target: usize,
    pub inverted: usize,
    pub folded: usize,
    pub pierced: usize,
    pub worst: f64,
    pub mean: f64,
    pub seconds: f64,
}
