//! idmesh moves an aircraft's tetrahedral CFD mesh when its wing profiles change.
//!
//! Every vertex and every tet is kept; only coordinates change. See `ARCHITECTURE.md` for the map of the code and
//! [`mover::Mover`] for the one door to it.

pub mod backend;
pub mod case;
#[doc(hidden)]
pub mod cli;
pub mod formats;
pub mod kernels;
pub mod mesh;
pub mod mover;
pub mod profile;
pub mod projection;
pub mod quality;
pub mod relaxation;
pub mod report;
pub mod smoothing;
pub mod springs;
pub mod stages;
