//! Local optimisation in the layout for a backend, its conversion to a number type, and its CPU
//! implementation.

use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::BackendError;
use super::packed::{pack_constraint, power_of_two};
use crate::constraint::Constraint;
use crate::kernels::star::{FAR, Star};
use crate::kernels::{Real, raise_worst_beta, smooth_vertices};
use crate::mesh::csr::Csr;

/// Some vertices of a mesh and the tets around them. The moving vertices come first.
#[derive(Clone, Copy, Debug)]
pub struct SmoothingPatch<'a> {
    /// Positions of the vertices `[n_vertices]`, in the mesh's unit.
    pub positions: &'a [DVec3],
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// Tets around each moving vertex: `n_moving` rows, each entry is `tet * 4 + local vertex`.
    pub vertex_tets: &'a Csr,
    /// Constraint of each moving vertex `[n_moving]`.
    pub constraint: &'a [Constraint],
    /// A ball that each moving vertex does not leave `[n_moving]`; `None` without limit.
    pub reach: &'a [Option<Ball>],
    /// Ranges of the moving vertices with one colour, one colour after another. Two vertices of one
    /// colour share no tet.
    pub colours: &'a [Range<u32>],
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre of the ball, in the mesh's unit.
    pub centre: DVec3,
    /// Radius of the ball, in the mesh's unit.
    pub radius: f64,
}

/// The objective that sweeps over a patch minimise.
#[derive(Clone, Copy, Debug)]
pub enum SmoothingObjective<'a> {
    /// The sum over tets of a power of the shape and size measures, see [`smooth_vertices`].
    Shape {
        /// Inverse of each tet's target matrix `[n_tets]`, in one over the mesh's unit. The columns
        /// of the matrix are the target's edges from its first vertex.
        inverse_target: &'a [DMat3],
        /// Power of the measure, 1 to 15.
        power: u32,
        /// Power of its size part, 0 to 15.
        size: u32,
        /// Square of the regularisation, without unit. 0 if all tets are valid.
        delta_squared: f64,
    },
    /// The sum over tets of the fourth power of `max(0, 1 - beta / goal)`, see
    /// [`raise_worst_beta`].
    Beta {
        /// The beta above which tets do not count.
        goal: f64,
        /// A vertex stays if its step would lower the sum by less than this fraction.
        gain: f64,
    },
}

/// A device that optimises one patch after another.
pub trait DeviceSmoother: Send {
    /// Sweeps over a patch `count` times. Each sweep visits all colours in order and moves the
    /// vertices of one colour at once. Returns the displacement of each vertex `[n_vertices]`, in
    /// the mesh's unit.
    ///
    /// # Errors
    /// The device failed, or the patch does not fit.
    ///
    /// # Panics
    /// The patch's arrays do not belong to one mesh.
    fn sweep(
        &mut self,
        patch: &SmoothingPatch,
        objective: &SmoothingObjective,
        count: usize,
    ) -> Result<Vec<DVec3>, BackendError>;
}

/// A patch in a device's number type.
pub(super) struct PackedPatch<T> {
    constraint: Vec<[T; 4]>,
    reach: Vec<[T; 4]>,
    base: Vec<[T; 9]>,
    /// Empty if the objective is beta.
    inverse_target: Vec<[T; 9]>,
    /// Unit of the correction, in the mesh's unit: a power of two near the shortest edge.
    unit: f64,
}

impl<T: Real> PackedPatch<T> {
    pub(super) fn new(patch: &SmoothingPatch, objective: &SmoothingObjective) -> Self {
        let (n_vertices, n_moving, n_tets) = (patch.positions.len(), patch.constraint.len(), patch.tets.len());
        assert!(n_moving <= n_vertices, "the moving vertices are vertices");
        assert_eq!(patch.vertex_tets.n_rows(), n_moving, "one row of tets per moving vertex");
        assert_eq!(patch.reach.len(), n_moving, "one reach per moving vertex");
        // A GPU returns zero outside an array, without an error.
        assert!(patch.tets.iter().flatten().all(|&vertex| (vertex as usize) < n_vertices), "every corner is a vertex");
        let entries = &patch.vertex_tets.entries;
        assert!(entries.iter().all(|&entry| (entry as usize) < 4 * n_tets), "every entry is in a tet");
        assert!(
            patch.colours.iter().all(|colour| colour.end as usize <= n_moving),
            "every colour is of moving vertices"
        );
        let edges = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|vertex| patch.positions[vertex as usize]);
            DMat3::from_cols(b - a, c - a, d - a)
        };
        let pack = |matrix: DMat3| matrix.to_cols_array().map(T::from_f64);
        let constraint = patch.constraint.iter().map(pack_constraint).collect();
        let reach = |unit: f64| {
            let of_vertex = |(ball, at): (&Option<Ball>, &DVec3)| {
                let (centre, radius) = ball.map_or((*at, f64::INFINITY), |ball| (ball.centre, ball.radius));
                ((centre - *at) / unit).extend((radius / unit).min(FAR)).to_array().map(T::from_f64)
            };
            patch.reach.iter().zip(patch.positions).map(of_vertex).collect()
        };
        match *objective {
            SmoothingObjective::Shape { inverse_target, .. } => {
                assert_eq!(inverse_target.len(), n_tets, "one target per tet");
                let greatest = inverse_target.iter().flat_map(DMat3::to_cols_array).map(f64::abs).fold(0.0, f64::max);
                let unit = power_of_two(greatest).recip();
                let of_tets = patch.tets.par_iter().zip(inverse_target);
                // The product is computed in f64: where a tet is near its target, S is near 1, and
                // small edges must not lose their digits.
                let base = of_tets.map(|(tet, inverse)| pack(edges(tet) * *inverse)).collect();
                let inverse_target =
                    inverse_target.par_iter().map(|inverse| pack(inverse.transpose() * unit)).collect();
                Self { constraint, reach: reach(unit), base, inverse_target, unit }
            }
            SmoothingObjective::Beta { .. } => {
                let shortest = |tet: &[u32; 4]| {
                    let edges = edges(tet);
                    [edges.x_axis, edges.y_axis, edges.z_axis]
                        .map(DVec3::length_squared)
                        .into_iter()
                        .fold(f64::INFINITY, f64::min)
                };
                let shortest = patch.tets.par_iter().map(shortest).reduce(|| f64::INFINITY, f64::min);
                let unit = power_of_two(shortest.sqrt());
                let base = patch.tets.par_iter().map(|tet| pack(edges(tet) * unit.recip())).collect();
                Self { constraint, reach: reach(unit), base, inverse_target: Vec::new(), unit }
            }
        }
    }

    pub(super) fn star<'a>(&'a self, patch: &SmoothingPatch<'a>) -> Star<'a, T> {
        Star {
            row_start: &patch.vertex_tets.row_start,
            vertex_tets: &patch.vertex_tets.entries,
            tets: patch.tets,
            base: &self.base,
            constraint: &self.constraint,
            reach: &self.reach,
        }
    }

    pub(super) fn inverse_target(&self) -> &[[T; 9]] {
        &self.inverse_target
    }

    /// The correction in the caller's unit.
    pub(super) fn correction(&self, correction: &[[T; 4]]) -> Vec<DVec3> {
        correction.iter().map(|c| DVec3::new(c[0].to_f64(), c[1].to_f64(), c[2].to_f64()) * self.unit).collect()
    }
}

/// Vertices in a task. A vertex takes about 5 microseconds, the scheduling of a task about two.
const CHUNK: usize = 16;

/// Local optimisation in the CPU's memory.
pub(super) struct CpuSmoother<T> {
    correction: Vec<[T; 4]>,
    /// New corrections of the vertices of one colour.
    moved: Vec<[T; 4]>,
    tolerance: T,
}

/// A vertex stays if its step would lower the objective by less than this fraction: the rounding
/// error of a sum over its tets, which was found to be a few units.
pub(super) fn tolerance(epsilon: f64) -> f64 {
    8.0 * epsilon
}

impl<T: Real> CpuSmoother<T> {
    /// - `epsilon`: unit roundoff of `T`
    pub(super) fn new(epsilon: f64) -> Self {
        Self { correction: Vec::new(), moved: Vec::new(), tolerance: T::from_f64(tolerance(epsilon)) }
    }

    /// Visits all colours in order. `run` moves consecutive vertices, given the first of them.
    fn visit(&mut self, colours: &[Range<u32>], run: impl Fn(usize, &[[T; 4]], &mut [[T; 4]]) + Sync) {
        for colour in colours {
            let colour = colour.start as usize..colour.end as usize;
            self.moved.resize(colour.len(), [T::ZERO; 4]);
            let correction = &self.correction;
            let tasks = self.moved.par_chunks_mut(CHUNK).enumerate();
            tasks.for_each(|(task, moved)| run(colour.start + task * CHUNK, correction, moved));
            self.correction[colour].copy_from_slice(&self.moved);
        }
    }
}

impl<T: Real> DeviceSmoother for CpuSmoother<T> {
    fn sweep(
        &mut self,
        patch: &SmoothingPatch,
        objective: &SmoothingObjective,
        count: usize,
    ) -> Result<Vec<DVec3>, BackendError> {
        let packed = PackedPatch::new(patch, objective);
        let star = packed.star(patch);
        self.correction.clear();
        self.correction.resize(patch.positions.len(), [T::ZERO; 4]);
        for _ in 0..count {
            match *objective {
                SmoothingObjective::Shape { power, size, delta_squared, .. } => {
                    let (delta_squared, tolerance) = (T::from_f64(delta_squared), self.tolerance);
                    let objective = smooth_vertices::MeanRatioObjective { power, size, delta_squared, tolerance };
                    let tets = smooth_vertices::Tets { star, inverse_target: packed.inverse_target() };
                    self.visit(patch.colours, |first, correction, moved| {
                        smooth_vertices::run(first, &tets, &objective, correction, moved);
                    });
                }
                SmoothingObjective::Beta { goal, gain } => {
                    let objective = raise_worst_beta::WorstBetaObjective {
                        six_goal: T::from_f64(6.0 * goal),
                        gain: T::from_f64(gain),
                    };
                    self.visit(patch.colours, |first, correction, moved| {
                        raise_worst_beta::run(first, &star, &objective, correction, moved);
                    });
                }
            }
        }
        Ok(packed.correction(&self.correction))
    }
}
