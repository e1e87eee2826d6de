//! Hierarchies of networks on the CPU: in f32 as on a GPU, and in f64.
//!
//! The f64 hierarchy also runs its cycles in f32. The load of a cycle is the residual of the
//! correction, computed in f64, and the result of a cycle needs a few correct digits only. Load and
//! correction are f64, so no precision is lost. One of five passes over the springs is in f64.
//!
//! A pass over the springs serves the corrections of one or several designs ([`OfDesigns`]).

use std::mem;

use glam::DVec3;

use super::chunks::{in_chunks, in_chunks_with};
use super::finest::Finest;
use super::levels::{self, Level, LevelVectors, cycle, cycle_from_zero};
use crate::backend::packed::{correction_of, scale_into};
use crate::backend::vectors::Vectors;
use crate::backend::{BackendError, DeviceNetwork, LevelData, MOST_TOGETHER, Measure, Sweep, Together, WholeNetwork};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{Real, accelerate, accelerate_double, hand_over};

/// A hierarchy in f32, the twin of the GPU's.
pub(super) struct SingleHierarchy {
    /// Finest first.
    levels: Vec<Level>,
    vectors: Vec<LevelVectors<4>>,
    /// Unit of load and correction, in the caller's unit.
    load_unit: f64,
    /// The finest level's correction before the cycle, and one cycle earlier.
    start: Vectors<f32>,
    previous: Vectors<f32>,
    largest: Vec<f32>,
}

impl SingleHierarchy {
    pub(super) fn new(levels: &[LevelData]) -> Self {
        let levels = levels::levels(levels);
        let n_vertices = levels[0].packed.n_vertices();
        let zero = || Vectors::zero(n_vertices);
        Self {
            vectors: levels::vectors(&levels),
            levels,
            load_unit: 1.0,
            start: zero(),
            previous: zero(),
            largest: vec![0.0; n_vertices.div_ceil(BLOCK)],
        }
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
        let finest = &mut self.vectors[0];
        self.load_unit = scale_into(load, 0, &mut finest.load);
        finest.clear();
        self.previous.fill([0.0; 4]);
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let mut change = 0.0;
        for sweep in sweeps {
            self.start.copy_from_slice(&self.vectors[0].e);
            cycle(&self.levels, &mut self.vectors);
            let (packed, e) = (&self.levels[0].packed, &mut self.vectors[0].e);
            let factors = [sweep.relaxation, sweep.momentum].map(f32::from_f64);
            let (constraint, inverse_length) = (packed.constraint(), packed.inverse_length());
            let (start, previous) = (&*self.start, &*self.previous);
            in_chunks_with(e, &mut self.largest, |first, e, largest| {
                let rows = first..first + e.len();
                let [start, previous, constraint] = [start, previous, constraint].map(|of| &of[rows.clone()]);
                accelerate::run(factors, constraint, start, previous, &inverse_length[rows], e, largest);
            });
            mem::swap(&mut self.start, &mut self.previous);
            let largest = self.largest.iter().fold(0.0, |largest: f32, &of_block| largest.max_magnitude(of_block));
            change = packed.change_of(largest.to_f64(), self.load_unit);
        }
        Ok(Measure { change, residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        Ok(correction_of(&self.vectors[0].e, 0, self.load_unit))
    }
}

/// A hierarchy with load and correction in f64.
pub(super) struct DoubleHierarchy {
    springs: Springs,
    /// The corrections of this number of designs. `None` before the first pass, when the memory of
    /// the set-up is not free yet.
    corrections: Option<(usize, Box<dyn Corrections>)>,
}

/// The networks of a hierarchy, without loads.
struct Springs {
    finest: Finest,
    /// Finest first.
    levels: Vec<Level>,
}

impl DoubleHierarchy {
    pub(super) fn new(levels: &[LevelData], whole: &WholeNetwork) -> Self {
        let finest = Finest::new(&levels[0].network, whole);
        let mut levels = levels::levels(levels);
        // Changes are measured on the finest level in f64.
        levels.iter_mut().for_each(|level| level.packed.forget_lengths());
        Self { springs: Springs { finest, levels }, corrections: None }
    }

    /// The corrections of so many designs: those in hand, or zeros.
    fn corrections(&mut self, designs: usize) -> (&Springs, &mut dyn Corrections) {
        let Self { springs, corrections } = self;
        // The corrections of another number of designs are freed first.
        let fitting = corrections.take().filter(|(of, _)| *of == designs);
        let make = || -> (usize, Box<dyn Corrections>) {
            let corrections: Box<dyn Corrections> = match designs {
                1 => Box::new(OfDesigns::<4>::new(springs)),
                2 => Box::new(OfDesigns::<6>::new(springs)),
                3 => Box::new(OfDesigns::<9>::new(springs)),
                _ => Box::new(OfDesigns::<12>::new(springs)),
            };
            (designs, corrections)
        };
        let (_, corrections) = corrections.insert(fitting.unwrap_or_else(make));
        (springs, corrections.as_mut())
    }

    /// The number of designs in hand.
    fn designs(&self) -> usize {
        self.corrections.as_ref().map_or(1, |(designs, _)| *designs)
    }
}

impl DeviceNetwork for DoubleHierarchy {
    fn epsilon(&self) -> f64 {
        f64::EPSILON
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        let Springs { finest, levels } = &mut self.springs;
        finest.constrain(&constraint[..finest.n_rows()]);
        levels::constrain(levels, constraint);
        Ok(())
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        let (_, corrections) = self.corrections(1);
        corrections.start(0, load);
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let (springs, corrections) = self.corrections(1);
        let change = sweeps.iter().fold(0.0, |_, sweep| corrections.cycle(springs, &[*sweep])[0]);
        Ok(Measure { change, residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        Ok(self.corrections(1).1.correction(0))
    }

    fn together(&mut self, designs: usize) -> Option<&mut dyn Together> {
        if !(2..=MOST_TOGETHER).contains(&designs) {
            return None;
        }
        self.corrections(designs);
        Some(self)
    }
}

impl Together for DoubleHierarchy {
    fn start(&mut self, design: usize, load: &[DVec3]) -> Result<(), BackendError> {
        let designs = self.designs();
        self.corrections(designs).1.start(design, load);
        Ok(())
    }

    fn cycle(&mut self, sweeps: &[Sweep]) -> Result<Vec<f64>, BackendError> {
        let (springs, corrections) = self.corrections(sweeps.len());
        Ok(corrections.cycle(springs, sweeps))
    }

    fn correction(&self, design: usize) -> Result<Vec<DVec3>, BackendError> {
        Ok(self.corrections.as_ref().map_or_else(Vec::new, |(_, corrections)| corrections.correction(design)))
    }
}

/// The corrections of some designs, whatever their number.
trait Corrections: Send {
    /// Sets the correction of a design to zero.
    ///
    /// - `load` `[n_vertices]`: of the design's pass, in the caller's unit
    fn start(&mut self, design: usize, load: &[DVec3]);

    /// Runs one cycle. Returns the largest change of each design, in shortest edges.
    ///
    /// - `sweeps` `[designs]`
    fn cycle(&mut self, springs: &Springs, sweeps: &[Sweep]) -> Vec<f64>;

    /// The correction of a design, in the caller's unit.
    fn correction(&self, design: usize) -> Vec<DVec3>;
}

/// Loads and corrections of `N / 3` designs, on all levels.
struct OfDesigns<const N: usize> {
    load: Vectors<f64, N>,
    e: Vectors<f64, N>,
    /// The correction one cycle earlier.
    previous: Vectors<f64, N>,
    largest: Vec<[f64; N]>,
    levels: Vec<LevelVectors<N>>,
    /// Unit of load and correction of each design, in the caller's unit.
    load_units: [f64; MOST_TOGETHER],
    /// Whether the correction of a design is zero everywhere.
    are_zero: [bool; MOST_TOGETHER],
}

impl<const N: usize> OfDesigns<N> {
    fn new(Springs { finest, levels }: &Springs) -> Self {
        let n_vertices = finest.n_rows();
        Self {
            load: Vectors::zero(n_vertices),
            e: Vectors::zero(n_vertices),
            previous: Vectors::zero(n_vertices),
            largest: vec![[0.0; N]; n_vertices.div_ceil(BLOCK)],
            levels: levels::vectors(levels),
            load_units: [1.0; MOST_TOGETHER],
            are_zero: [true; MOST_TOGETHER],
        }
    }

    /// Sets the load of the next cycle: the residual of the correction.
    ///
    /// The residual of a correction of zero is the load, apart from signs of zeros, which no
    /// correction shows. So springs are read if one of the designs needs them.
    fn hand_over(&mut self, finest: &Finest) {
        let own = &*self.load;
        let are_zero = self.are_zero[..N / 3].iter().all(|is_zero| *is_zero);
        let e = (!are_zero).then_some(&*self.e);
        in_chunks(&mut self.levels[0].load, |first, load| {
            hand_over::run(first, finest.rows_from(first, own), e, load);
        });
    }

    /// `e_new = e + P (relaxation * correction of the cycle + momentum (e - previous))`, and the
    /// largest change: see [`accelerate_double::run`].
    fn accelerate(&mut self, finest: &Finest, sweeps: &[Sweep]) {
        let mut factors = [[0.0; N]; 2];
        for (design, sweep) in sweeps.iter().enumerate() {
            for (factors, factor) in factors.iter_mut().zip([sweep.relaxation, sweep.momentum]) {
                factors[3 * design..3 * design + 3].fill(factor);
            }
            self.are_zero[design] = false;
        }
        let (load, inverse_length) = (&*self.load, finest.inverse_length());
        let (e, of_cycle) = (&*self.e, &*self.levels[0].e);
        in_chunks_with(&mut self.previous, &mut self.largest, |first, previous, largest| {
            let rows = finest.rows_from(first, load);
            accelerate_double::run(factors, first, rows, inverse_length, e, of_cycle, previous, largest);
        });
        mem::swap(&mut self.e, &mut self.previous);
    }
}

impl<const N: usize> Corrections for OfDesigns<N> {
    fn start(&mut self, design: usize, load: &[DVec3]) {
        self.load_units[design] = scale_into(load, design, &mut self.load);
        let zero = |vector: &mut [f64; N]| vector[3 * design..3 * design + 3].fill(0.0);
        for vectors in [&mut self.e, &mut self.previous] {
            in_chunks(vectors, |_, vectors| vectors.iter_mut().for_each(zero));
        }
        self.are_zero[design] = true;
    }

    fn cycle(&mut self, Springs { finest, levels }: &Springs, sweeps: &[Sweep]) -> Vec<f64> {
        self.hand_over(finest);
        cycle_from_zero(levels, &mut self.levels);
        self.accelerate(finest, sweeps);
        let largest = |design: usize| {
            self.largest.iter().fold(0.0, |largest: f64, of_block| largest.max_magnitude(of_block[design]))
        };
        (0..sweeps.len()).map(|design| finest.change_of(largest(design), self.load_units[design])).collect()
    }

    fn correction(&self, design: usize) -> Vec<DVec3> {
        correction_of(&self.e, design, self.load_units[design])
    }
}
