//! Local optimisation in the volume stage: when it runs, up to which beta, and the mesh it works on.

use glam::DVec3;

use super::sliding::SurfaceFreedom;
use crate::{
    backend::BackendError,
    quality::{self, Statistics},
    smoothing::{Goal, Smoothed, Smoother},
    stage::SetUp,
};

/// With the original shapes as target, the share of the original mesh's smallest beta that is good enough. Springs alone
/// keep this on most designs; repairing less would move vertices for nothing.
pub(super) const ENOUGH: f64 = 0.75;

/// With improvement as target, the multiple of the original mesh's smallest beta aimed at. Where surfaces slide it is
/// reached on wing-bodies of 98 000 and of 921 000 tets; aiming at 2 takes several times as long, and ends at 1.57 to 1.95.
pub(super) const IMPROVED: f64 = 1.5;

/// Most sweeps of the optimisation: it ends by itself when it no longer helps, after some tens.
pub(super) const MOST_SWEEPS: usize = 400;

/// Where more than this share of the tets is inverted nothing is repaired: it would take long and help little. Less is a fault
/// in a few places, which vertices may slide out of.
pub(super) const LOCAL: f64 = 1e-3;

/// Most sweeps of a repair on the way.
const REPAIR_SWEEPS: usize = 100;

/// A mesh on the way.
pub(super) struct MovedMesh {
    pub(super) vertices: Vec<DVec3>,
    pub(super) beta: Vec<f64>,
    pub(super) worst: f64,
    pub(super) inverted: usize,
}

impl MovedMesh {
    pub(super) fn new(vertices: Vec<DVec3>, tets: &[[u32; 4]]) -> Self {
        let beta = quality::betas(&vertices, tets);
        Self::of(vertices, beta)
    }

    pub(super) fn of(vertices: Vec<DVec3>, beta: Vec<f64>) -> Self {
        let Statistics { inverted, min: worst, .. } = Statistics::new(&beta);
        Self { vertices, beta, worst, inverted }
    }

    /// Whether what is inverted, if anything, is a fault in a few places.
    pub(super) fn is_local(&self) -> bool {
        self.inverted as f64 <= LOCAL * self.beta.len() as f64
    }
}

/// Local optimisation of a mesh, set up once.
pub(super) struct Smoothing {
    pub(super) smoother: Smoother,
    pub(super) freedom_of_surfaces: SurfaceFreedom,
    /// The smallest beta to reach.
    pub(super) goal: f64,
    /// The smallest beta that is left alone.
    pub(super) enough: f64,
}

impl Smoothing {
    /// Optimises a mesh whose surfaces are in their places, on which vertices may slide.
    pub(super) fn run(&mut self, set_up: &SetUp, state: &MovedMesh) -> Result<(MovedMesh, Smoothed), BackendError> {
        let Self { smoother, freedom_of_surfaces, goal, .. } = self;
        let sliding = freedom_of_surfaces.on(set_up.mesh, set_up.surface, set_up.families, &state.vertices);
        let goal = Goal { beta: *goal, max_sweeps: MOST_SWEEPS };
        let (mut vertices, mut beta) = (state.vertices.clone(), state.beta.clone());
        let smoothed = smoother.run(&mut vertices, &mut beta, &goal, Some(&sliding))?;
        Ok((MovedMesh::of(vertices, beta), smoothed))
    }

    /// Repairs the inside of a mesh on the way, up to this beta.
    pub(super) fn repair(&mut self, state: MovedMesh, enough: f64) -> Result<MovedMesh, BackendError> {
        let MovedMesh { mut vertices, mut beta, .. } = state;
        let goal = Goal { beta: enough, max_sweeps: REPAIR_SWEEPS };
        self.smoother.run(&mut vertices, &mut beta, &goal, None)?;
        Ok(MovedMesh::of(vertices, beta))
    }
}
