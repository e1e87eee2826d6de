//! Hierarchies of networks on the CPU: in f32 as on a GPU, and in f64.
//!
//! The f64 hierarchy also runs its cycles in f32. The load of a cycle is the residual of the
//! correction, computed in f64, and the result of a cycle needs a few correct digits only. Load and
//! correction are f64, so no precision is lost. One of five passes over the springs is in f64.

use std::mem;

use glam::DVec3;

use super::chunks::{in_chunks, in_chunks_with};
use super::finest::Finest;
use super::levels::{self, Level, cycle, cycle_from_zero};
use crate::backend::vectors::Vectors;
use crate::backend::{BackendError, DeviceNetwork, LevelData, Measure, Sweep, WholeNetwork};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{Real, accelerate, accelerate_double, hand_over};

/// A hierarchy in f32, the twin of the GPU's.
pub(super) struct SingleHierarchy {
    /// Finest first.
    levels: Vec<Level>,
    /// The finest level's correction before the cycle, and one cycle earlier.
    start: Vectors<f32>,
    previous: Vectors<f32>,
    largest: Vec<f32>,
}

impl SingleHierarchy {
    pub(super) fn new(levels: &[LevelData]) -> Self {
        let levels = levels::levels(levels);
        let n_vertices = levels[0].e.len();
        let zero = || Vectors::zero(n_vertices);
        Self { levels, start: zero(), previous: zero(), largest: vec![0.0; n_vertices.div_ceil(BLOCK)] }
    }
}

impl DeviceNetwork for SingleHierarchy {
    fn epsilon(&self) -> f64 {
        f64::from(f32::EPSILON)
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        levels::constrain(&mut self.levels, constraint);
        Ok(())
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        let finest = &mut self.levels[0];
        finest.packed.start(load);
        finest.e.fill([0.0; 4]);
        self.previous.fill([0.0; 4]);
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let mut change = 0.0;
        for sweep in sweeps {
            self.start.copy_from_slice(&self.levels[0].e);
            cycle(&mut self.levels);
            let Level { packed, e, .. } = &mut self.levels[0];
            let factors = [sweep.relaxation, sweep.momentum].map(f32::from_f64);
            let (constraint, inverse_length) = (packed.rows().constraint, packed.inverse_length());
            let (start, previous) = (&*self.start, &*self.previous);
            in_chunks_with(e, &mut self.largest, |first, e, largest| {
                let rows = first..first + e.len();
                let [start, previous, constraint] = [start, previous, constraint].map(|of| &of[rows.clone()]);
                accelerate::run(factors, constraint, start, previous, &inverse_length[rows], e, largest);
            });
            mem::swap(&mut self.start, &mut self.previous);
            change = packed.change(greatest(&self.largest));
        }
        Ok(Measure { change, residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let finest = &self.levels[0];
        Ok(finest.packed.correction(&finest.e))
    }
}

/// A hierarchy with load and correction in f64.
pub(super) struct DoubleHierarchy {
    finest: Finest,
    /// Finest first.
    levels: Vec<Level>,
    /// The correction. It is made by the first pass, when the memory of the set-up is free.
    e: Vectors<f64>,
    /// The correction one cycle earlier.
    previous: Vectors<f64>,
    /// Whether `e` is zero everywhere.
    is_zero: bool,
    largest: Vec<f64>,
}

impl DoubleHierarchy {
    pub(super) fn new(levels: &[LevelData], whole: &WholeNetwork) -> Self {
        let of_levels = levels::levels(levels);
        let finest = Finest::new(&levels[0].network, whole);
        let largest = vec![0.0; finest.n_rows().div_ceil(BLOCK)];
        let [e, previous] = [0, 0].map(Vectors::zero);
        Self { levels: of_levels, e, previous, is_zero: true, largest, finest }
    }

    /// Sets the load of the next cycle: the residual of the correction.
    fn hand_over(&mut self) {
        let (finest, e) = (&self.finest, (!self.is_zero).then_some(&*self.e));
        let (_, load) = self.levels[0].packed.constraint_and_load();
        in_chunks(load, |first, load| hand_over::run(first, finest.rows_from(first), e, load));
    }

    /// `e_new = e + P (relaxation * correction of the cycle + momentum (e - previous))`, and the
    /// largest change: see [`accelerate_double::run`].
    fn accelerate(&mut self, sweep: &Sweep) {
        let factors = [sweep.relaxation, sweep.momentum];
        let (finest, inverse_length) = (&self.finest, self.finest.inverse_length());
        let (e, of_cycle) = (&*self.e, &*self.levels[0].e);
        in_chunks_with(&mut self.previous, &mut self.largest, |first, previous, largest| {
            let rows = finest.rows_from(first);
            accelerate_double::run(factors, first, rows, inverse_length, e, of_cycle, previous, largest);
        });
        mem::swap(&mut self.e, &mut self.previous);
        self.is_zero = false;
    }
}

impl DeviceNetwork for DoubleHierarchy {
    fn epsilon(&self) -> f64 {
        f64::EPSILON
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.finest.constrain(&constraint[..self.finest.n_rows()]);
        levels::constrain(&mut self.levels, constraint);
        Ok(())
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.finest.start(load);
        for e in [&mut self.e, &mut self.previous] {
            if e.len() == load.len() {
                e.fill([0.0; 4]);
            } else {
                *e = Vectors::zero(load.len());
            }
        }
        self.is_zero = true;
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        for sweep in sweeps {
            self.hand_over();
            cycle_from_zero(&mut self.levels);
            self.accelerate(sweep);
        }
        let largest = if sweeps.is_empty() { 0.0 } else { greatest(&self.largest) };
        Ok(Measure { change: self.finest.change(largest), residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        Ok(self.finest.correction(&self.e))
    }
}

fn greatest<T: Real>(of_blocks: &[T]) -> f64 {
    of_blocks.iter().fold(T::ZERO, |largest, &of_block| largest.max_magnitude(of_block)).to_f64()
}
