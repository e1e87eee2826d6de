//! How a mesh is moved: springs, relaxation, local optimisation.

use crate::{
    relaxation::{Method, Stopping},
    smoothing::QualityTarget,
    springs::Springs,
    volume::MAX_STEPS,
};

/// How a mesh is moved. The defaults are those of a case file that says nothing.
///
/// Later versions may add fields: begin with [`Settings::default`] and change what differs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The volume's springs.
    pub springs: &'static Springs,
    /// How networks are relaxed.
    pub method: Method,
    /// How far networks are relaxed.
    pub stopping: Stopping,
    /// What local optimisation aims at; `None` is none.
    pub quality: Option<QualityTarget>,
    /// Most steps of an update. The jump that is tried first and the steps given up count; 1 is the
    /// jump alone.
    pub max_steps: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            springs: Default::default(),
            method: Method::default(),
            stopping: Stopping::default(),
            quality: Some(QualityTarget::Original),
            max_steps: MAX_STEPS,
        }
    }
}
