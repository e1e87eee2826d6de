//! Geometry that knows nothing of meshes: what several modules need of vectors and sets of points.

pub mod fitted_motion;
