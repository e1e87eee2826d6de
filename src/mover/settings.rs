//! [`Settings`]: the springs, the relaxation and the local optimisation of a mover.

use crate::{
    relaxation::{Method, Stopping},
    smoothing::QualityTarget,
    solver_measures::Limits,
    springs::Springs,
    volume::MAX_STEPS,
};

/// The settings of a mover. The defaults are those of a case file without the tables `[volume]`,
/// `[quality]` and `[solver]`.
///
/// Later versions may add fields. Begin with [`Settings::default`] and change fields.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The volume's springs.
    pub springs: &'static Springs,
    /// The method by which networks are relaxed.
    pub method: Method,
    /// The tolerance of relaxations and their largest number of sweeps.
    pub stopping: Stopping,
    /// The target of local optimisation. `None` turns local optimisation off.
    pub quality: Option<QualityTarget>,
    /// Limits on the measures of solvers. Beyond them a result is not valid.
    pub limits: Limits,
    /// Largest number of steps of an update. The first jump counts as a step, and so does each step
    /// that is given up. With 1 an update is the jump alone.
    pub max_steps: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            springs: Default::default(),
            method: Method::default(),
            stopping: Stopping::default(),
            quality: Some(QualityTarget::Original),
            limits: Limits::default(),
            max_steps: MAX_STEPS,
        }
    }
}
