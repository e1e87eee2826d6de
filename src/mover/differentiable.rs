//! [`Differentiable`]: what an outcome keeps for its products, or why it has none.

use std::sync::Arc;

use super::NotDifferentiable;
use crate::stage::Kept;

/// The map of which a product takes the derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Derivative {
    /// The whole update. An outcome of several steps, or one with vertices that local optimisation
    /// moved, has none.
    #[default]
    Exact,
    /// The springs' jump from the undeformed mesh. What steps and local optimisation added counts
    /// as constant. Where they moved vertices the derivative is off by an unknown amount. At a kink
    /// of the profiles it is the derivative of one side.
    Frozen,
}

/// What an outcome keeps for its products.
#[derive(Clone, Debug)]
pub(super) struct Differentiable {
    kept: Result<Arc<Kept>, NotDifferentiable>,
    /// Why only the frozen derivative is there.
    frozen: Option<NotDifferentiable>,
}

impl Differentiable {
    /// - `kept`: of the volume stage, or why there is no derivative
    /// - `steps`: of the path
    /// - `optimised`: number of vertices that local optimisation moved
    /// - `kink`: why the derivative is that of one side alone, if it is
    pub(super) fn new(
        kept: Result<Kept, NotDifferentiable>,
        steps: usize,
        optimised: usize,
        kink: Option<NotDifferentiable>,
    ) -> Self {
        let frozen = match (steps, optimised) {
            (0 | 1, 0) => kink,
            (0 | 1, vertices) => Some(NotDifferentiable::Optimised { vertices }),
            (steps, _) => Some(NotDifferentiable::Steps { steps }),
        };
        Self { kept: kept.map(Arc::new), frozen }
    }

    /// What a product of this kind needs.
    pub(super) fn kept(&self, derivative: Derivative) -> Result<&Arc<Kept>, NotDifferentiable> {
        let kept = self.kept.as_ref().map_err(Clone::clone)?;
        match &self.frozen {
            Some(why) if derivative == Derivative::Exact => Err(why.clone()),
            _ => Ok(kept),
        }
    }
}
