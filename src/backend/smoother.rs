//! Local quality optimisation as a backend sees it, the number type it is packed in, and the CPU's way to do it.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::packed::{pack_constraint, power_of_two};
use super::{BackendError, Constraint};
use crate::kernels::Real;
use crate::kernels::smooth_vertices::{self, Objective, Tets};
use crate::mesh::csr::Csr;

/// A mesh whose vertices are to be smoothed.
#[derive(Clone, Copy, Debug)]
pub struct SmoothingData<'a> {
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// Tets around each vertex `[n_vertices]` rows, each entry `tet * 4 + local vertex`.
    pub vertex_tets: &'a Csr,
    /// Inverse of each tet's target `[n_tets]`: of the matrix whose columns are the target's edges from its first vertex.
    pub inverse_target: &'a [DMat3],
    /// What each vertex may do `[n_vertices]`.
    pub constraint: &'a [Constraint],
}

/// A batch of sweeps: each visits all colours in order, and moves the vertices of one colour at once.
#[derive(Clone, Copy, Debug)]
pub struct SmoothingSweeps<'a> {
    /// The vertices of each colour. Two of one colour may not share a tet, and a vertex stands here at most once.
    pub colours: &'a [Vec<u32>],
    /// Power of `q` in the objective, 1 to 15, see [`smooth_vertices`].
    pub power: u32,
    /// Square of the objective's regularisation, dimensionless; 0 where all tets are valid.
    pub delta_squared: f64,
    /// Number of sweeps.
    pub count: usize,
}

/// A mesh on its device, ready to be smoothed. The device moves a *correction* to positions that stay in f64.
pub trait DeviceSmoother: Send {
    /// Replaces the constraints `[n_vertices]`.
    ///
    /// # Errors
    /// The device failed.
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError>;

    /// Begins anew from these positions `[n_vertices]`: the correction is zero.
    ///
    /// # Errors
    /// The device failed.
    fn start(&mut self, positions: &[DVec3]) -> Result<(), BackendError>;

    /// Runs a batch of sweeps. Nothing is read back.
    ///
    /// # Errors
    /// The device failed.
    fn sweep(&mut self, sweeps: &SmoothingSweeps) -> Result<(), BackendError>;

    /// The correction `[n_vertices]` as it stands.
    ///
    /// # Errors
    /// The device failed.
    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError>;
}

/// A mesh in a device's number type, in a unit near the size of its smallest target.
pub(super) struct PackedTets<T> {
    vertex_tets: Csr,
    tets: Vec<[u32; 4]>,
    inverse_target: Vec<[T; 9]>,
    constraint: Vec<[T; 4]>,
    base: Vec<[T; 9]>,
    /// The targets before rounding: `S` is taken in f64.
    exact: Vec<DMat3>,
    /// What one of the correction stands for, a power of two.
    unit: f64,
}

impl<T: Real> PackedTets<T> {
    /// # Panics
    /// The arrays do not belong to one mesh.
    pub(super) fn new(data: &SmoothingData) -> Self {
        let (n_vertices, n_tets) = (data.constraint.len(), data.tets.len());
        assert_eq!(data.vertex_tets.n_rows(), n_vertices, "one row of tets per vertex");
        assert_eq!(data.inverse_target.len(), n_tets, "one target per tet");
        // A GPU reads zero outside an array and says nothing.
        assert!(data.tets.iter().flatten().all(|&vertex| (vertex as usize) < n_vertices), "every corner is a vertex");
        let entries = &data.vertex_tets.entries;
        assert!(entries.iter().all(|&entry| (entry as usize) < 4 * n_tets), "every entry is in a tet");
        let greatest = data.inverse_target.iter().flat_map(DMat3::to_cols_array).map(f64::abs).fold(0.0, f64::max);
        let unit = power_of_two(greatest).recip();
        let pack = |target: &DMat3| target.transpose().to_cols_array().map(|entry| T::from_f64(entry * unit));
        let mut vertex_tets = data.vertex_tets.clone();
        if n_vertices == 0 {
            vertex_tets.row_start = vec![0];
        }
        Self {
            vertex_tets,
            tets: data.tets.to_vec(),
            inverse_target: data.inverse_target.iter().map(pack).collect(),
            constraint: data.constraint.iter().map(pack_constraint).collect(),
            base: vec![[T::ZERO; 9]; n_tets],
            exact: data.inverse_target.to_vec(),
            unit,
        }
    }

    pub(super) fn n_vertices(&self) -> usize {
        self.constraint.len()
    }

    /// Replaces what each vertex may do.
    pub(super) fn constrain(&mut self, constraint: &[Constraint]) {
        assert_eq!(constraint.len(), self.n_vertices(), "one constraint per vertex");
        self.constraint.clear();
        self.constraint.extend(constraint.iter().map(pack_constraint));
    }

    /// Takes `S` of each tet at these positions.
    pub(super) fn start(&mut self, positions: &[DVec3]) {
        assert_eq!(positions.len(), self.n_vertices(), "one position per vertex");
        let of_tet = (self.tets.par_iter()).zip(&self.exact);
        self.base.par_iter_mut().zip(of_tet).for_each(|(base, (tet, inverse_target))| {
            let [a, b, c, d] = tet.map(|vertex| positions[vertex as usize]);
            let s = DMat3::from_cols(b - a, c - a, d - a) * *inverse_target;
            *base = s.to_cols_array().map(T::from_f64);
        });
    }

    pub(super) fn tets(&self) -> Tets<'_, T> {
        Tets {
            row_start: &self.vertex_tets.row_start,
            vertex_tets: &self.vertex_tets.entries,
            tets: &self.tets,
            base: &self.base,
            inverse_target: &self.inverse_target,
            constraint: &self.constraint,
        }
    }

    /// The correction in the caller's unit.
    pub(super) fn correction(&self, correction: &[[T; 4]]) -> Vec<DVec3> {
        correction.iter().map(|c| DVec3::new(c[0].to_f64(), c[1].to_f64(), c[2].to_f64()) * self.unit).collect()
    }
}

/// Vertices in a task: a vertex takes some 5 microseconds, handing a task over about two.
const CHUNK: usize = 16;

/// A mesh in the CPU's memory.
pub(super) struct CpuSmoother<T> {
    packed: PackedTets<T>,
    correction: Vec<[T; 4]>,
    /// New corrections of the vertices of one colour.
    moved: Vec<[T; 4]>,
    tolerance: T,
}

/// A vertex stays where its step would lower the objective by less than this fraction: the rounding of a sum over its
/// tets, seen to be a few units.
pub(super) fn tolerance(epsilon: f64) -> f64 {
    8.0 * epsilon
}

impl<T: Real> CpuSmoother<T> {
    /// `epsilon`: unit roundoff of `T`.
    pub(super) fn new(data: &SmoothingData, epsilon: f64) -> Self {
        let packed = PackedTets::new(data);
        let correction = vec![[T::ZERO; 4]; packed.n_vertices()];
        Self { packed, correction, moved: Vec::new(), tolerance: T::from_f64(tolerance(epsilon)) }
    }
}

impl<T: Real> DeviceSmoother for CpuSmoother<T> {
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.packed.constrain(constraint);
        Ok(())
    }

    fn start(&mut self, positions: &[DVec3]) -> Result<(), BackendError> {
        self.packed.start(positions);
        self.correction.fill([T::ZERO; 4]);
        Ok(())
    }

    fn sweep(&mut self, sweeps: &SmoothingSweeps) -> Result<(), BackendError> {
        let tets = self.packed.tets();
        let delta_squared = T::from_f64(sweeps.delta_squared);
        let objective = Objective { power: sweeps.power, delta_squared, tolerance: self.tolerance };
        for colour in std::iter::repeat_n(sweeps.colours, sweeps.count).flatten() {
            self.moved.resize(colour.len(), [T::ZERO; 4]);
            let correction = &self.correction;
            let tasks = colour.par_chunks(CHUNK).zip(self.moved.par_chunks_mut(CHUNK));
            tasks.for_each(|(vertices, moved)| {
                smooth_vertices::run(vertices, &tets, &objective, correction, moved);
            });
            for (&vertex, moved) in colour.iter().zip(&self.moved) {
                self.correction[vertex as usize] = *moved;
            }
        }
        Ok(())
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        Ok(self.packed.correction(&self.correction))
    }
}
